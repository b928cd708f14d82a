"""Laws as Exudyn's expression trees have the values that they have as floats."""

import pytest

from generator.simulation.exudyn_model.exudyn_api import SYMBOLIC, symbols
from springs import FLOATS
from springs.published.tables import coupled_law


@pytest.fixture
def recording():
    symbols.SetRecording(True)
    yield
    symbols.SetRecording(False)


@pytest.mark.usefixtures("recording")
@pytest.mark.parametrize("key", ["riener_edrich_1999/leg", "silder_2007/leg"])
def test_a_law_of_several_angles(key):
    law = coupled_law(key).law
    angles = [symbols.Real(name.partition(" ")[0], 0.0) for name in law.coordinates]
    torques = law.torques(angles, SYMBOLIC)
    for values in ((0.0, 0.0, 0.0), (1.5, 0.3, 0.1), (-0.2, 1.9, -0.3)):
        for angle, value in zip(angles, values, strict=True):
            angle.SetValue(value)
        assert [t.Evaluate() for t in torques] == pytest.approx(law.torques(values, FLOATS))
