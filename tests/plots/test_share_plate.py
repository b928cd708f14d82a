"""The plate of net and passive moments over a gait cycle."""

from pathlib import Path

import numpy as np
import pytest

from generator.diagnostics import InputError
from plots.share_plate import heel_strikes, read_share, share_plate
from tests.command import answer, mover, run
from tests.generator.inverse.walking import LOADS, MODEL, MOTION


@pytest.fixture(scope="module")
def table(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("walk") / "share.csv"
    run("inverse", MODEL, MOTION, "--forces", LOADS, "--cutoff", "6Hz", "-o", path)
    return path


def test_heel_strikes_end_swings():
    times = np.linspace(0.0, 3.0, 301)
    force = np.where((times % 1.2 > 0.4) & (times < 2.9), 800.0, 0.0)
    np.testing.assert_allclose(heel_strikes(times, force), [0.4, 1.6, 2.8], atol=0.011)
    assert heel_strikes(times, np.full_like(times, 500.0)) == []
    noisy = np.where(np.abs(times - 0.7) < 0.02, 0.0, force)
    np.testing.assert_allclose(heel_strikes(times, noisy), [0.4, 1.6, 2.8], atol=0.011)


def test_a_cycle_is_a_step_of_its_side(table: Path):
    share = read_share(table)
    assert share.coordinates[0] == "hip_flexion_r"
    right, left = share.cycle("hip_flexion_r"), share.cycle("knee_angle_l")
    assert right is not None
    assert left is not None
    assert 1.0 < right[1] - right[0] < 1.4
    assert 1.0 < left[1] - left[0] < 1.4
    assert right != left
    assert share.cycle("lumbar_extension") is None


def test_the_plate_has_the_moments_of_the_table(table: Path, tmp_path: Path):
    plate = share_plate(table, "share")
    assert "over a gait cycle" in plate.caption
    drawn = plate.tables["moments"]
    share = read_share(table)
    for name in share.coordinates:
        title = f"{name} net [N m]"
        assert np.array_equal(drawn[title], share.columns[title])
    assert len(plate.figure.axes) == 2 * len(share.coordinates)
    data = answer("plots", table, "-o", tmp_path / "out")
    assert [Path(one).name for one in data["files"]][:1]
    assert (tmp_path / "out" / "share.svg").exists()


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("net [N m]", "moment", "is not a table of net and passive moments"),
        ("hip_flexion_r known", "other", "has no column `hip_flexion_r known`"),
        (",yes,", ",yes,many,", "is damaged"),
    ],
)
def test_other_tables_are_refused(table: Path, old: str, new: str, message: str, tmp_path: Path):
    path = tmp_path / "share.csv"
    path.write_text(table.read_text().replace(old, new))
    with pytest.raises(InputError, match=message.replace("(", r"\(")):
        read_share(path)
    assert mover("plots", path, "-o", tmp_path / "out").exit_code == 1


def test_tables_are_drawn_apart(table: Path, tmp_path: Path):
    result = mover("plots", table, "person", "-o", tmp_path)
    assert result.exit_code == 2
    assert "in separate commands" in result.stderr
