"""Drives of joints from the motions that can be read."""

from pathlib import Path

import numpy as np
import pytest

from generator import read_figure
from generator.diagnostics import InputError
from generator.figure import Figure
from generator.motion_files import motion_writer
from generator.motion_files.drives import read_drives, read_drives_with_warnings
from tests.motions import clip, slides


@pytest.fixture(scope="module")
def prototype() -> Figure:
    return read_figure("prototype")


def write_table(path: Path, titles: str, rows: str) -> Path:
    text = f"inDegrees=yes\nendheader\ntime {titles}\n{rows}\n"
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize("suffix", [".action", ".npz", ".mot", ".sto"])
def test_every_motion_that_can_be_read_drives_the_joints(
    suffix: str, prototype: Figure, tmp_path: Path
):
    motion = clip("prototype")
    path = tmp_path / f"fall{suffix}"
    motion_writer(path)(motion, path)
    drives = read_drives(path, prototype)
    assert drives.keys() == motion.displacements.keys()
    for name, drive in drives.items():
        assert np.array_equal(drive.times, motion.times)
        np.testing.assert_allclose(drive.values, motion.displacements[name], rtol=1e-15)
    assert read_drives(path, prototype, ["left_knee"]).keys() == {"left_knee"}
    with pytest.raises(InputError, match="joint `nose` is not driven there"):
        read_drives(path, prototype, ["left_knee", "nose"])


def test_a_table_drives_the_displacements_that_have_a_column(prototype: Figure, tmp_path: Path):
    path = write_table(tmp_path / "a.mot", "waist_3 load waist_1", "0 90 1 0\n1 45 2 180")
    drives, (warning,) = read_drives_with_warnings(path, prototype)
    (drive,) = drives.values()
    assert (set(drives), drive.coordinates) == ({"waist"}, (0, 2))
    expected = np.radians([[0.0, 90.0], [180.0, 45.0]])
    np.testing.assert_allclose(drive.values, expected, rtol=1e-15)
    assert warning.message.endswith("left out: load")


@pytest.mark.parametrize(
    ("titles", "rows", "message"),
    [
        ("rail_2", "0 1\n1 2", "joint `rail` has a translation, and only rotations can be driven"),
        ("rail_1", "0 1", "a motion of one frame drives nothing"),
        ("sledge_1", "0 1\n1 2", "the figure has no joint `sledge`"),
        ("rail_1", "0 1\n1 2e9", "must be at most 1e.06 rad"),
        ("rail_1", "0 1\n1 nan", "`nan` is not finite"),
    ],
)
def test_tables_that_drive_nothing_are_refused(
    titles: str, rows: str, message: str, tmp_path: Path
):
    path = write_table(tmp_path / "a.mot", titles, rows)
    with pytest.raises(InputError, match=message):
        read_drives(path, slides())


def test_the_rotation_of_a_joint_with_a_translation_is_driven_alone(tmp_path: Path):
    path = write_table(tmp_path / "a.mot", "rail_1", "0 0\n1 90")
    drive = read_drives(path, slides())["rail"]
    assert drive.coordinates == (0,)
