"""Laws as Exudyn's expression trees have the values that they have as floats."""

import pytest

from generator.simulation.exudyn_api import SYMBOLIC, symbols
from springs import FLOATS, Cubic
from springs.hysteresis import Hysteresis
from springs.interpolated import Interpolated
from springs.published.tables import coupled_law, curve
from springs.transformed import Transformed

LAWS = {
    "exponential": curve("davy_audu_1987/knee").law,
    "smooth limit": curve("saul_2015/elbow_flexion").law,
    "table": curve("silder_2007/hip_knee_15").law,
    "two points": Interpolated(((-0.5, 2.0), (0.5, -2.0))),
    "scaled": Transformed(Cubic((1.0, -2.0, 3.0, 4.0), +1, (-0.5, 0.7)), 2.0, 0.1, -3.0),
}
ANGLES = [-3.0, -0.6, -0.26, 0.0, 0.3, 0.77, 1.4, 2.5]


@pytest.fixture
def recording():
    symbols.SetRecording(True)
    yield
    symbols.SetRecording(False)


@pytest.mark.usefixtures("recording")
@pytest.mark.parametrize("name", LAWS)
def test_a_law_of_one_angle(name):
    law = LAWS[name]
    angle = symbols.Real("angle", 0.0)
    torque, energy = law.torque(angle, SYMBOLIC), law.energy(angle, SYMBOLIC)
    for value in ANGLES:
        angle.SetValue(value)
        assert torque.Evaluate() == pytest.approx(law.torque(value, FLOATS), rel=1e-12, abs=1e-12)
        assert energy.Evaluate() == pytest.approx(law.energy(value, FLOATS), rel=1e-12, abs=1e-12)


@pytest.mark.usefixtures("recording")
def test_a_law_of_angle_and_rate():
    law = Hysteresis.from_mean_and_width(LAWS["table"], 8.0)
    angle, rate = symbols.Real("angle", 0.0), symbols.Real("rate", 0.0)
    torque = law.total_torque(angle, rate, SYMBOLIC)
    for value in ANGLES:
        for speed in (-1.0, -0.004, 0.0, 0.01):
            angle.SetValue(value)
            rate.SetValue(speed)
            assert torque.Evaluate() == pytest.approx(
                law.total_torque(value, speed, FLOATS), rel=1e-12
            )


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
