"""The plate of a motion: quantities of a run, and the same computed from its frames alone."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from generator import Plan, read_figure, read_springs, simulate
from generator.motion_files import FigureMotion, motion_from_recording
from generator.recording import CONTACT_ENERGY_KINDS, ENERGY_KINDS
from plots.motion_plate import motion_plate, motion_quantities
from plots.plate import plate_name
from tests.command import mover, run
from tests.contacts import with_contact


def fall(choice: str | None) -> FigureMotion:
    """Two tenths of a second of the prototype, with so many frames that a spline holds them."""
    figure = read_figure("prototype")
    start = {"left_knee": (0.5,), "right_elbow": (1.0,), "left_shoulder": (0.2, 0.1, -0.3)}
    plan = Plan(stop=0.2, frame=0.0025, displacements=start, tolerance=1e-4, spring_choice=choice)
    return motion_from_recording(simulate(figure, plan), figure)


@pytest.fixture(scope="module")
def motion() -> FigureMotion:
    return fall(None)


@pytest.mark.parametrize("choice", [None, "coupled"])
def test_frames_alone_give_the_moments_and_energies_of_the_run(choice: str | None) -> None:
    motion = fall(choice)
    springs = read_springs(choice, motion.figure)
    whole = motion_quantities(motion, springs)
    frames = motion_quantities(replace(motion, recording=None), springs)
    assert whole.moments.keys() == frames.moments.keys() == whole.angles.keys()
    for name, moments in whole.moments.items():
        scale = max(1.0, float(np.abs(moments).max()))
        # The spline's rates are worst in the first and last frames.
        assert np.abs(moments - frames.moments[name])[2:-2].max() < 2e-3 * scale
    assert set(whole.energies) == set(ENERGY_KINDS)
    for kind, values in frames.energies.items():
        scale = max(1.0, float(np.ptp(whole.energies[kind])))
        assert np.abs(values - whole.energies[kind])[2:-2].max() < 1e-2 * scale
    assert frames.centre_of_mass == pytest.approx(whole.centre_of_mass, abs=1e-6)


def test_a_plate_has_a_row_of_panels_for_each_pair_of_joints(motion: FigureMotion) -> None:
    plate = motion_plate(motion, read_springs(None, motion.figure), "fall")
    pairs = {name.removeprefix("left_").removeprefix("right_") for name in motion.chains}
    assert len(plate.figure.axes) == 2 * (len(pairs) + 1)
    (columns,) = plate.tables.values()
    assert columns["left_knee.1 [deg]"][0] == pytest.approx(np.degrees(0.5))
    assert {"moment of waist.3 [N m]", "kinetic [J]", "centre of mass y [m]"} < columns.keys()


def test_all_energies_of_a_run_with_contact_are_drawn(motion: FigureMotion) -> None:
    plate = motion_plate(with_contact(motion), read_springs(None, motion.figure), "fall")
    (drawn,) = [axes for axes in plate.figure.axes if axes.get_ylabel() == "change of energy [J]"]
    kinds = [*ENERGY_KINDS, *CONTACT_ENERGY_KINDS]
    assert [line.get_label() for line in drawn.lines] == kinds
    styles = {(line.get_color(), line.get_linestyle()) for line in drawn.lines}
    assert len(styles) == len(kinds)


def test_the_ground_reaction_of_a_run_with_contact_is_drawn(motion: FigureMotion) -> None:
    touching = with_contact(motion)
    plate = motion_plate(touching, read_springs(None, motion.figure), "fall")
    assert touching.recording is not None
    assert touching.recording.contact is not None
    contact, (columns,) = touching.recording.contact, plate.tables.values()
    (drawn,) = [axes for axes in plate.figure.axes if axes.get_ylabel() == "ground reaction [N]"]
    for k, line in enumerate(drawn.lines):
        assert np.array_equal(line.get_ydata(), contact.ground_reaction[:, k])
        assert np.array_equal(columns[f"ground reaction {'xyz'[k]} [N]"], line.get_ydata())
    (deep,) = [axes for axes in plate.figure.axes if "penetration" in axes.get_ylabel()]
    deepest = np.max(list(contact.depths.values()), axis=0)
    assert np.asarray(deep.lines[0].get_ydata()) == pytest.approx(1e3 * deepest)


@pytest.mark.parametrize(("stem", "name"), [("Fall of Ann", "fall_of_ann"), ("__", "motion")])
def test_names_of_files(stem: str, name: str) -> None:
    assert plate_name(stem) == name


def test_the_command_draws_motions(tmp_path: Path) -> None:
    for suffix in ("action", "npz"):
        path = tmp_path / f"swing_{suffix}.{suffix}"
        run("simulate", "pendulum", "--stop", 0.1, "--step", 0.01, "-q", "-o", path)
    files = sorted(tmp_path.glob("swing*"))
    done = run("plots", *files, "-o", tmp_path / "drawn")
    assert len(done.stdout.splitlines()) == 4
    names = {path.name for path in (tmp_path / "drawn").iterdir()}
    assert names > {"report.html", "swing_action.svg", "swing_npz.png", "swing_npz.csv"}
    for words, said in (
        (("knee", files[0]), "draw motions and named plates in separate commands"),
        (("none.action",), "`none.action` cannot be read"),
        (("theirs.mot",), "`theirs.mot` cannot be read"),
        (("knee", "--figure", "prototype"), "--figure is for motions"),
        (("--against", "prototype"), "--against compares with the curves of --springs"),
    ):
        refused = mover("plots", *words, "-o", tmp_path / "other")
        assert refused.exit_code in (1, 2)
        assert said in refused.stderr


@pytest.mark.slow
def test_other_springs_than_those_of_the_motion_are_told(tmp_path: Path) -> None:
    path, springs = tmp_path / "fall.action", tmp_path / "stiff.springs.toml"
    springs.write_text('[[spring]]\njoints = ["left_knee"]\nstiffness_Nm_rad = 9\n', "utf-8")
    words = ("--stop", 0.02, "--step", 0.01, "-q", "--springs", springs)
    run("simulate", "prototype", *words, "-o", path)
    told = run("plots", path, "-o", tmp_path / "a").stderr
    assert "is a motion with the springs `stiff.springs.toml over prototype" in told
    assert run("plots", path, "--springs", springs, "-o", tmp_path / "b").stderr == ""
    twice = mover("plots", path, path, "-o", tmp_path / "c")
    assert "two motions would be written as `fall`" in twice.stderr


@pytest.mark.slow
def test_a_table_of_opensim_is_drawn_with_the_figure_that_is_named(tmp_path: Path) -> None:
    path = tmp_path / "theirs.mot"
    path.write_text("inDegrees=yes\nendheader\ntime left_knee_1\n0 0\n1 20\n2 50\n", "utf-8")
    assert "name the figure with --figure" in mover("plots", path, "-o", tmp_path / "a").stderr
    done = run("plots", path, "--figure", "prototype", "-o", tmp_path / "a")
    assert "is a motion with the springs `unknown`" in done.stderr
    assert "displacements without a column have the figure's own value" in done.stderr
    assert (tmp_path / "a" / "theirs.svg").is_file()
