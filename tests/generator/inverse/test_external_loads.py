"""Measured forces on a figure."""

from pathlib import Path

import numpy as np
import pytest

from generator.diagnostics import InputError, UsageError
from generator.inverse.external_loads import (
    LOADS_FILE,
    common_times,
    read_external_loads,
    wrenches_of_forces,
)
from generator.model_files.formats import read_model
from tests.generator.inverse.walking import FORCES, LOADS, MODEL

FIGURE = read_model(MODEL).figure
OPTIONS = ("calcn_r=ground_force", "calcn_l=1_ground_force")


def test_options_are_those_of_the_file():
    of_file, of_options = (
        read_external_loads(path, FIGURE, words)[0]
        for path, words in ((LOADS, ()), (FORCES, OPTIONS))
    )
    assert [one.segment for one in of_file] == ["talus_r", "talus_l"]
    for one, other in zip(of_file, of_options, strict=True):
        assert (one.body, one.segment) == (other.body, other.segment)
        for field in ("times", "force", "point", "torque"):
            assert np.array_equal(getattr(one, field), getattr(other, field))


def poses(count: int) -> dict[str, np.ndarray]:
    rng, found = np.random.default_rng(1), {}
    for name in FIGURE.segments:
        turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
        pose = np.eye(4)
        pose[:3, :3], pose[:3, 3] = turn * np.linalg.det(turn), rng.normal(size=3)
        found[name] = np.broadcast_to(pose, (count, 4, 4))
    return found | {"world": np.broadcast_to(np.eye(4), (count, 4, 4))}


def test_between_rows_forces_are_straight_lines():
    (right, _), _ = read_external_loads(LOADS, FIGURE)
    times = (right.times[100:105] + right.times[101:106]) / 2.0
    wrench = right.wrench(times, poses(5), np.eye(4))
    force = (right.force[100:105] + right.force[101:106]) / 2.0
    point = (right.point[100:105] + right.point[101:106]) / 2.0
    torque = (right.torque[100:105] + right.torque[101:106]) / 2.0
    expected = np.hstack([np.cross(point, force) + torque, force])
    np.testing.assert_allclose(wrench, expected, rtol=1e-9, atol=1e-9)


def test_frames_of_force_and_point_are_bodies(tmp_path: Path):
    """A force that is expressed in a body turns with it; without a point it acts at its origin."""
    text = LOADS.read_text().replace(
        "<force_expressed_in_body>ground", "<force_expressed_in_body>calcn_r", 1
    )
    text = text.replace("<point_identifier>ground_force_p", "<point_identifier>", 1)
    (tmp_path / FORCES.name).write_text(FORCES.read_text())
    path = tmp_path / LOADS.name
    path.write_text(text)
    (right, _), _ = read_external_loads(path, FIGURE)
    at, times = poses(3), right.times[10:13]
    part = at["talus_r"][0] @ FIGURE.segments["talus_r"].sites["calcn_r"].pose_in_segment
    force = right.force[10:13] @ part[:3, :3].T
    moment = right.torque[10:13] @ part[:3, :3].T + np.cross(part[:3, 3], force)
    wrench = wrenches_of_forces([right], times, at, FIGURE)["talus_r"]
    np.testing.assert_allclose(wrench, np.hstack([moment, force]), rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("calcn_r</applied", "calcn_x</applied", "the figure has no body `calcn_x`"),
        (">ground_force_v<", ">ground_force<", "there is no column `ground_forcex`"),
        ("calcn_r</applied_to_body>", "</applied_to_body>", "`right` has no `applied_to_body`"),
        ("walk_grf.mot", "other.mot", "there is no table `other.mot` beside this file"),
        ("<datafile>walk_grf.mot</datafile>", "", "the `datafile` with the columns is missing"),
        ("ExternalLoads", "Loads", "this document has no `ExternalLoads`"),
        ("<isDisabled>false", "<isDisabled>true", "there is no `ExternalForce` that acts"),
    ],
)
def test_wrong_files_have_a_place(old: str, new: str, message: str, tmp_path: Path):
    (tmp_path / FORCES.name).write_text(FORCES.read_text())
    path = tmp_path / "loads.xml"
    path.write_text(LOADS.read_text().replace(old, new))
    with pytest.raises(InputError) as failure:
        read_external_loads(path, FIGURE)
    assert any(message in one.message and one.span for one in failure.value.diagnostics)


def test_wrong_cells_have_a_place(tmp_path: Path):
    path = tmp_path / "forces.mot"
    lines = FORCES.read_text().splitlines()
    lines[10] = lines[10].replace(lines[10].split()[2], "nan")
    path.write_text("\n".join(lines))
    with pytest.raises(InputError, match="`nan` is not finite") as failure:
        read_external_loads(path, FIGURE, OPTIONS)
    assert failure.value.diagnostics[0].span is not None
    assert failure.value.diagnostics[0].span.line == 11


@pytest.mark.parametrize("word", ["calcn_r", "=ground_force", "calcn_r="])
def test_options_are_bodies_and_prefixes(word: str):
    with pytest.raises(UsageError, match="expected BODY=PREFIX"):
        read_external_loads(FORCES, FIGURE, [word])


def test_a_table_needs_options_and_a_file_of_loads_has_none():
    with pytest.raises(UsageError, match="name the body of each force"):
        read_external_loads(FORCES, FIGURE)
    with pytest.raises(UsageError, match="--force is for tables"):
        read_external_loads(LOADS, FIGURE, OPTIONS)


def test_times_without_forces_are_left_out():
    forces, _ = read_external_loads(LOADS, FIGURE)
    assert common_times(np.array([-1.0, 0.5, 1.0, 9.0]), forces).tolist() == [0.5, 1.0]
    with pytest.raises(InputError, match="they do not overlap"):
        common_times(np.array([5.0, 6.0]), forces)


def test_disabled_forces_are_left_out():
    text = LOADS.read_text().replace("<isDisabled>false", "<isDisabled>true", 1)
    assert [row.name for row in LOADS_FILE.parse_text(text).require_value().rows] == ["left"]
