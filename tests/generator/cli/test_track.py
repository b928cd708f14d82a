"""`mover track`."""

from pathlib import Path

import numpy as np
import pytest

from generator.conversion import read_motion
from generator.figure_file import read_figure
from generator.inverse.markers import Markers, find_marker_sites, format_trc
from generator.motion_files import COORDINATES_FILE
from tests.command import answer, mover, run
from tests.generator.inverse.walking import LOADS, MODEL, MOTION, walk_of, write_figure_of_walk


@pytest.fixture(scope="module")
def trial(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Markers of the walk, 5 mm beside their sites, with the figure beside them."""
    folder = tmp_path_factory.mktemp("trial")
    walk = walk_of(write_figure_of_walk(folder))
    names = ["R.ASIS", "L.ASIS", "V.Sacral", "R.Thigh.Upper", "R.Shank.Upper", "R.Heel",
             "R.Midfoot.Sup", "L.Thigh.Upper", "L.Shank.Upper", "L.Heel", "L.Midfoot.Sup",
             "Sternum", "R.Acromium", "L.Acromium", "nowhere"]  # fmt: skip
    sites = find_marker_sites(names, walk.figure)
    assert len(sites) == len(names) - 1
    positions = np.stack(
        [(walk.poses[at.segment] @ np.append(at.place, 1.0))[:, :3] for at in sites.values()], 1
    )
    positions += np.random.default_rng(5).normal(0.0, 0.005, positions.shape)
    other = np.concatenate([positions, np.zeros((len(positions), 1, 3))], axis=1)
    path = folder / "walk.trc"
    path.write_text(format_trc(Markers(walk.times, (*sites, "nowhere"), other)))
    return path


def test_the_motion_of_a_model_has_the_names_of_its_coordinates(trial: Path, tmp_path: Path):
    out, action = tmp_path / "walk.mot", tmp_path / "walk.action"
    data = answer("track", MODEL, trial, "-o", out, "-o", action)
    assert data["unused"] == ["nowhere"]
    assert 3.0 < data["rms_mm"] < 12.0
    given, found = COORDINATES_FILE.read(MOTION), COORDINATES_FILE.read(out)
    titles = [title.text for title in given.titles]
    assert {title.text for title in found.titles} == set(titles)
    for k, title in enumerate(found.titles):
        expected = given.numbers[:, titles.index(title.text)]
        close = 0.02 if title.text in ("pelvis_tx", "pelvis_ty") else 10.0
        assert np.abs(found.numbers[:, k] - expected).max() < close
    text = run("inverse", MODEL, out, "--forces", LOADS, "--cutoff", "6Hz").stdout
    assert "hip_flexion_r" in text


def test_figures_and_weights(trial: Path, tmp_path: Path):
    figure, out = trial.with_name("gait10.fig"), tmp_path / "walk.sto"
    setup = tmp_path / "setup.xml"
    setup.write_text(
        "<IKTaskSet>"
        + "".join(
            f'<IKMarkerTask name="{name}"><apply>true</apply><weight>2</weight></IKMarkerTask>'
            for name in ("R.ASIS", "L.ASIS", "V.Sacral", "R.Thigh.Upper")
        )
        + "</IKTaskSet>"
    )
    data = answer("track", figure, trial, "--tasks", setup, "--weight", "Sternum=3", "-o", out)
    weights = {name: one["weight"] for name, one in data["markers"].items()}
    assert weights == {"R.ASIS": 2, "L.ASIS": 2, "V.Sacral": 2, "R.Thigh.Upper": 2, "Sternum": 3}
    assert read_motion(out, read_figure(figure)).times.size == 151
    result = mover("track", figure, trial, "--tasks", setup, "-o", out)
    assert "in 151 frames the markers do not determine" in result.stderr


@pytest.mark.parametrize(
    ("words", "code", "message"),
    [
        (("--weight", "Sternum"), 2, "expected MARKER=W"),
        (("--weight", "Sternun=1"), 2, "did you mean"),
        (("--weight", "Sternum=-1"), 2, "a weight is a number from 0"),
        (("--up", "x"), 2, "y or z"),
        (("-o", "walk.txt"), 2, "is not a known suffix"),
        (("--links", "no.links.toml"), 1, "no.links.toml"),
        (("--tasks", "no.xml"), 1, "no.xml"),
    ],
)
def test_refusals(words: tuple[str, ...], code: int, message: str, trial: Path, tmp_path: Path):
    out = tmp_path / "walk.mot"
    result = mover("track", MODEL, trial, "-o", out, *words)
    assert (result.exit_code, message in result.stderr) == (code, True), result.stderr
    assert not out.exists()


def test_markers_far_from_their_sites_are_loud(trial: Path, tmp_path: Path):
    out = tmp_path / "walk.mot"
    result = mover("track", MODEL, trial, "--up", "z", "-o", out)
    assert "mm (rms) from their sites, which is not their motion" in result.stderr
    assert "--up y" in result.stderr
    assert "from their sites" not in mover("track", MODEL, trial, "-o", out).stderr


def test_wrong_markers_leave_no_file(trial: Path, tmp_path: Path):
    path, out = tmp_path / "walk.trc", tmp_path / "walk.mot"
    path.write_text(trial.read_text().replace("\tm\t", "\tmm\t"))
    result = mover("track", MODEL, path, "-o", out)
    assert result.exit_code == 1
    assert "walk.trc: the markers span" in result.stderr
    assert not out.exists()
