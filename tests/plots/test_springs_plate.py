"""Plates of a user's springs, with published curves of their motion."""

from pathlib import Path

import numpy as np
import pytest

from generator import read_figure, read_springs
from generator.springs_file.read import load_springs_file
from plots.own_plates import OwnFiles
from plots.springs_plate import NamedSprings, matching_literature, springs_plates
from springs import Linear
from tests.command import mover, run
from tests.paths import FIGURES

TEXT = """
figure = "prototype"
[[spring]]
joints = ["left_knee", "right_knee"]
motion = "flexion"
stiffness_Nm_rad = 10
[[spring]]
joints = ["waist"]
axis = "z"
stiffness_Nm_rad = 3
"""


@pytest.fixture
def path(tmp_path: Path) -> Path:
    path = tmp_path / "mine.springs.toml"
    path.write_text(TEXT, encoding="utf-8")
    return path


def test_each_curve_has_a_plate_with_both_springs_and_the_literature(path: Path) -> None:
    own = NamedSprings(path.name, load_springs_file(path).require_value()[0])
    other = NamedSprings("prototype", read_springs(None, read_figure("prototype")))
    plates = {plate.name: plate for plate in springs_plates(own, other)}
    assert len(plates) == 2
    knee = next(plate for name, plate in plates.items() if "knee" in name)
    (columns,) = knee.tables.values()
    angles = np.radians(columns["angle [deg]"])
    (law,) = own.springs.joints["left_knee"].axes[0].elastic
    assert law == Linear(10.0)
    assert columns["mine.springs.toml [N m]"] == pytest.approx(-10.0 * angles)
    thesis = columns["prototype [N m]"]
    assert thesis[angles > 1.8].max() < -10.0
    assert "silder 2007" in " ".join(columns)
    assert any("Silder" in reference for reference in knee.references)
    waist = next(plate for name, plate in plates.items() if "waist" in name)
    assert "No published curve has this motion." in waist.caption


def test_both_springs_have_the_sense_of_the_figure_s_axis(tmp_path: Path) -> None:
    """A file that names no figure is bound to the one beside which it is drawn."""
    path = tmp_path / "mine.springs.toml"
    path.write_text(
        '[[spring]]\njoints = ["left_knee"]\nmotion = "flexion"\nstiffness_Nm_rad = 10\n', "utf-8"
    )
    for against in ("prototype", str(FIGURES / "prototype.springs.toml")):
        (plate,), _ = OwnFiles(springs=path, against=against).plates()
        (columns,) = plate.tables.values()
        (thesis,) = (v for name, v in columns.items() if name.startswith("prototype"))
        at = columns["angle [deg]"]
        assert np.abs(thesis[(at > 1.0) & (at < 88.0)]).max() == 0.0
        assert thesis[at > 100.0].max() < -10.0


def test_nothing_to_draw_is_an_error(tmp_path: Path) -> None:
    path = tmp_path / "damp.springs.toml"
    path.write_text('[[spring]]\njoints = ["left_knee"]\nviscous_Nms_rad = 1\n', "utf-8")
    refused = mover("plots", "--springs", path, "-o", tmp_path / "none")
    assert (refused.exit_code, refused.stderr) == (1, f"error: `{path}` has no curve to draw\n")
    assert not (tmp_path / "none").exists()


def test_measurements_come_first_and_one_of_each_publication() -> None:
    found = matching_literature("left_knee", "flexion")
    assert found[0].label.startswith("silder 2007")
    assert len({str(one.reference) for one in found}) == len(found)
    obstacles = [bool(one.obstacle) for one in found]
    assert obstacles == sorted(obstacles)
    assert matching_literature("hinge", "flexion") == []


def test_the_command_draws_springs(path: Path, tmp_path: Path) -> None:
    folder = tmp_path / "drawn"
    run("plots", "--springs", path, "--against", "prototype", "-o", folder)
    assert len(list(folder.glob("*.svg"))) == 2
    assert (folder / "report.html").exists()
    for words, said in (
        (("--springs", tmp_path / "no.springs.toml"), "cannot be read"),
        (("--springs", path, "--against", "nobody"), "nobody"),
        (("--springs", path, "knee"), "leave out the names"),
    ):
        refused = mover("plots", *words, "-o", tmp_path / "other")
        assert refused.exit_code in (1, 2)
        assert said in refused.stderr


def test_odd_names_and_narrow_pictures_of_springs(tmp_path: Path) -> None:
    paths = [tmp_path / folder / "_a$x^$.springs.toml" for folder in ("one", "two")]
    for stiffness, path in enumerate(paths, 5):
        path.parent.mkdir()
        table = f'[[spring]]\njoints = ["left_knee"]\nstiffness_Nm_rad = {stiffness}\n'
        path.write_text(table + 'motion = "$x^$"\n', "utf-8")
    words = ("plots", "--springs", paths[0], "--against", paths[1])
    run(*words, "-o", tmp_path / "a")
    (table,) = (tmp_path / "a").glob("*.csv")
    titles = table.read_text("utf-8").splitlines()[3].split(",")
    assert len({title for title in titles if "springs.toml" in title}) == 2
    run(*words, "--for", "paper", "--width", 85, "-o", tmp_path / "b")
    refused = mover("plots", "--springs", paths[0], "--against", "pendulum", "-o", tmp_path / "c")
    assert refused.exit_code == 1


def test_a_file_that_extends_others_draws_its_own_curves_scaled_without_stops(
    tmp_path: Path,
) -> None:
    """The stops of `male50` have 1000 N m/rad, and its other joints are not of the file."""
    path = tmp_path / "elbow.springs.toml"
    path.write_text(
        'figure = "male50"\nextends = "riener"\n[[spring]]\njoints = ["left_elbow"]\naxis = "y"\n'
        'motion = "flexion"\npoints_deg_Nm = [[-10, 3], [0, 1], [60, -2], [120, -6]]\n',
        "utf-8",
    )
    (plate,), _ = OwnFiles(springs=path).plates()
    assert plate.name == "left_elbow_flexion"
    (columns,) = plate.tables.values()
    stopped = np.abs(columns["elbow.springs.toml [N m]"]).max()
    _, highest = plate.figure.axes[0].get_ylim()
    assert 6.0 < highest < 20.0 < stopped


def test_a_law_over_several_joints_is_drawn_at_zero_of_the_others(tmp_path: Path) -> None:
    path = tmp_path / "knee.springs.toml"
    path.write_text(
        '[[spring]]\njoints = ["left_knee", "right_knee"]\nmotion = "flexion"\n'
        "points_deg_Nm = [[-5, 12], [0, 6], [30, 1], [90, -1], [130, -10]]\n",
        "utf-8",
    )
    (plate,), _ = OwnFiles(springs=path, against="male50").plates()
    (columns,) = plate.tables.values()
    own = columns["male50, hip flexion and ankle dorsiflexion at 0 deg [N m]"]
    angles = np.radians(columns["angle [deg]"])
    inside = (angles > 0.0) & (angles < np.radians(90.0))  # calf and thigh are apart
    (law, *_) = (one.law for one in read_springs(None, read_figure("male50")).coupled)
    _, knee, _ = law.torques((0.0 * angles, angles, 0.0 * angles))
    assert own[inside] == pytest.approx(knee[inside], abs=0.01)
    assert own[inside].max() > 7.0
    assert "knee.springs.toml [N m]" in columns
    plate_riener = OwnFiles(springs=FIGURES / "male50.riener.springs.toml").plates()[0]
    named = [title for one in plate_riener for titles in one.tables.values() for title in titles]
    assert "male50.riener.springs.toml, hip flexion at 0 deg [N m]" in named
