"""Motions of a model of OpenSim, as those of the figure that it became, and back."""

from pathlib import Path

import numpy as np
import pytest

from generator.conversion import convert, read_motion
from generator.figure_file import read_figure
from generator.input_files.coordinates import coordinates_of_figure
from generator.model_files.formats import read_model
from generator.motion_files import COORDINATES_FILE
from generator.motion_files.drives import read_drives_with_warnings
from generator.rotations import Array
from tests.command import run
from tests.generator.inverse.walking import MODEL, MOTION, walk_of, write_figure_of_walk


@pytest.fixture(scope="module")
def figure(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_figure_of_walk(tmp_path_factory.mktemp("walk"))


def columns(path: Path) -> dict[str, Array]:
    """Columns of a table by their titles."""
    table = COORDINATES_FILE.read(path)
    titles = [title.text for title in table.titles]
    return dict(zip(titles, table.numbers.T, strict=True))


def test_coordinates_beside_the_figure_are_those_of_the_model(figure: Path):
    assert coordinates_of_figure(read_figure(figure)) == read_model(MODEL).coordinates


@pytest.mark.parametrize("suffix", [".mot", ".sto"])
def test_a_motion_of_the_model_comes_back(figure: Path, suffix: str, tmp_path: Path):
    out = tmp_path / f"out{suffix}"
    run("convert", MOTION, out, tmp_path / "walk.action", "--figure", figure)
    given, back = columns(MOTION), columns(out)
    assert back.keys() == given.keys()
    for name, values in given.items():
        is_turn = name not in ("pelvis_tx", "pelvis_ty")
        expected = np.radians(values) if is_turn and suffix == ".sto" else values
        np.testing.assert_allclose(back[name], expected, rtol=1e-14, atol=1e-15)


def test_full_paths_are_names(figure: Path, tmp_path: Path):
    """Moco's solutions have values, speeds and forces."""
    lines = MOTION.read_text().splitlines()
    title = next(k for k, line in enumerate(lines) if line.startswith("time"))
    names = lines[title].split()[1:]
    lines[title] = "\t".join(["time", *(f"/jointset/some/{name}/value" for name in names)])
    lines[title] += "\t/jointset/some/knee_angle_r/speed"
    lines[title + 1 :] = [f"{line}\t0" for line in lines[title + 1 :]]
    path = tmp_path / "solution.mot"
    path.write_text("\n".join(lines).replace("nColumns=11", "nColumns=12"))
    read = read_motion(path, read_figure(figure))
    for joint, values in walk_of(figure).displacements.items():
        assert np.array_equal(read.displacements[joint], values)


def test_scale_and_shift_are_those_of_the_model(figure: Path, tmp_path: Path):
    """A coordinate is scale times the displacement, plus the shift."""
    names = figure.with_name("gait10.coordinates.toml")
    moved = tmp_path / "gait10.fig"
    moved.write_text(figure.read_text())
    text = names.read_text()
    for name, numbers in (("knee_angle_r", "scale = 2\nshift_deg = 30"), ("pelvis_tx", "")):
        start = text.index(f'name = "{name}"')
        end = text.index("place", start)
        line_end = text.index("\n", end) + 1
        text = text[:line_end] + f"{numbers or 'shift_m = -0.5'}\n" + text[line_end:]
    tmp_path.joinpath(names.name).write_text(text)
    plain, read = walk_of(figure), read_motion(MOTION, read_figure(moved))
    knee, pelvis = plain.displacements["knee_r"], plain.displacements["ground_pelvis"]
    expected = (knee - np.radians(30.0)) / 2.0
    np.testing.assert_allclose(read.displacements["knee_r"][:, 0], expected[:, 0], rtol=1e-14)
    moved_pelvis = read.displacements["ground_pelvis"][:, 2]
    np.testing.assert_allclose(moved_pelvis, pelvis[:, 2] + 0.5, rtol=1e-14)
    convert(MOTION, tmp_path / "out.sto", figure=moved)
    got = columns(tmp_path / "out.sto")["knee_angle_r"]
    np.testing.assert_allclose(got, knee[:, 0], rtol=1e-13)


def test_a_copy_of_the_figure_keeps_the_names(figure: Path, tmp_path: Path):
    convert(read_figure(figure), tmp_path / "copy.fig")
    names = coordinates_of_figure(read_figure(tmp_path / "copy.fig"))
    assert names == coordinates_of_figure(read_figure(figure))


def test_columns_of_the_model_drive_joints(figure: Path):
    drives, _ = read_drives_with_warnings(MOTION, read_figure(figure), ["knee_r"])
    assert set(drives) == {"knee_r"}
