"""Models for OpenSim: forces of laws, and motions that play; `test_export_model.py` has falls."""

from pathlib import Path

import numpy as np
import pytest

from generator.motion_files.motion import motion_from_recording
from generator.motion_files.opensim_table import write_mot
from springs import AxisSpring, SpringSet
from tests.chains import SKEW
from tests.generator.model_files.engines import OpenSim
from tests.generator.model_files.model_cases import (
    CURVES,
    OTHER_CURVES,
    TREES,
    apart,
    hinge,
    on_a_rail,
    ours,
    slide,
    spring_set,
)

pytestmark = pytest.mark.verify


@pytest.mark.parametrize("name", CURVES | OTHER_CURVES)
def test_hinges_and_slides_have_the_forces_of_their_laws(name: str, tmp_path: Path) -> None:
    of, laws = on_a_rail(), (CURVES | OTHER_CURVES)[name]
    damping = {"viscous": 0.3, "coulomb": 0.7, "slip": 0.1}
    turned = hinge("hinge", *laws, axis=(1.0, 0.0, 0.0), **damping)
    springs = spring_set(turned, slide("rail", SKEW, *laws, **damping))
    loaded = OpenSim(of, springs, tmp_path)
    assert not any("spring" in loss.what for loss in loaded.losses.entries)
    for value, rate in zip(np.linspace(-2.0, 2.0, 41), np.linspace(0.9, -1.0, 41), strict=True):
        for name, sign, spring in (
            ("hinge_1", -1.0, turned.axes[0]),
            ("rail_1", 1.0, springs.joints["rail"].translations[0]),
        ):
            coordinate = loaded.model.getCoordinateSet().get(name)
            coordinate.setValue(loaded.state, value, False)
            coordinate.setSpeedValue(loaded.state, rate)
            loaded.model.realizeDynamics(loaded.state)
            force = loaded.model.getForceSet().get(f"{name}_spring")
            said = loaded.api.Force.safeDownCast(force).getRecordValues(loaded.state).get(0)
            expected = sign * resisting(spring, sign * value, sign * rate)
            assert said == pytest.approx(expected, rel=1e-9, abs=1e-9)


def resisting(spring: AxisSpring, value: float, rate: float) -> float:
    elastic = sum(float(law.torque(value)) for law in spring.elastic)
    return elastic + float(spring.resistance(value, rate))


@pytest.mark.parametrize(
    "name",
    [
        "prototype",
        "prototype, let go",
        "slides along the child's axes, child nearer to the root",
        "rail",
    ],
)
def test_a_motion_file_plays_on_the_model(name: str, tmp_path: Path) -> None:
    of = TREES[name]
    recording = ours(of, SpringSet())
    write_mot(motion_from_recording(recording, of), tmp_path / "fall.mot")
    loaded = OpenSim(of, SpringSet(), tmp_path)
    table = loaded.api.TimeSeriesTable(str(tmp_path / "fall.mot"))
    assert table.getTableMetaDataAsString("inDegrees") == "yes"
    loaded.model.getSimbodyEngine().convertDegreesToRadians(table)
    labels = list(table.getColumnLabels())
    coordinates = loaded.model.getCoordinateSet()
    assert set(labels) == {coordinates.get(k).getName() for k in range(coordinates.getSize())}
    rows = []
    for k in range(table.getNumRows()):
        row = table.getRowAtIndex(k)
        for label, value in zip(labels, [row[j] for j in range(row.size())], strict=True):
            coordinates.get(label).setValue(loaded.state, value, False)
        rows.append(loaded.poses())
    played = {name: np.array([row[name] for row in rows]) for name in rows[0]}
    assert apart(played, recording.poses) < 1e-7
