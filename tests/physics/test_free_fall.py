"""Free fall: a body that nothing holds goes along a parabola and turns as a free body does."""

import csv

import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

from generator import read_figure
from generator.motion_files import motion_from_recording
from generator.motion_files.tables import format_csv
from generator.simulation.plan import Plan
from generator.simulation.run import simulate
from springs import SpringSet
from tests.chains import FREE, body, one_body, row

NONE = SpringSet()


@pytest.mark.parametrize("given", [{"step": 0.01}, {"tolerance": 1e-6}])
def test_a_body_falls_along_a_parabola(given) -> None:
    """Constant g is integrated without error, so a coarse step is enough."""
    link = body("link", centre=(0.0, 0.0, 0.0))
    plan = Plan(
        stop=1.0,
        springs=NONE,
        gravity=(1.0, -9.81, 0.5),
        velocities={"pin": (0.0, 0.0, 0.0, 2.0, 3.0, -1.0)},
        **given,
    )
    run = simulate(one_body(FREE, (0.0, 0.0, 0.0, 0.1, 0.2, 0.3), link), plan)
    t = run.times[:, None]
    expected = [0.1, 0.2, 0.3] + t * [2.0, 3.0, -1.0] + 0.5 * t**2 * [1.0, -9.81, 0.5]
    assert np.max(np.abs(run.displacements["pin"][:, 3:] - expected)) < 1e-9
    assert np.max(np.abs(run.centre_of_mass - expected)) < 1e-9
    assert np.max(np.abs(run.displacements["pin"][:, :3])) < 1e-9


def test_a_body_with_an_offset_centre_turns_about_it() -> None:
    """About a principal axis the spin is constant; the centre alone follows the parabola."""
    link = body("link", centre=(0.2, 0.0, 0.0))
    spin = 4.0
    plan = Plan(
        stop=0.5,
        step=2e-4,
        springs=NONE,
        velocities={"pin": (0.0, 0.0, spin, 0.0, 0.0, 0.0)},
    )
    run = simulate(one_body(FREE, (0.0,) * 6, link), plan)
    t = run.times
    centre = np.stack([0.2 + 0.0 * t, 0.2 * spin * t - 0.5 * 9.81 * t**2, 0.0 * t], axis=1)
    assert np.max(np.abs(run.centre_of_mass - centre)) < 1e-6
    assert np.max(np.abs(run.displacements["pin"][:, 2] - spin * t)) < 1e-6
    near = centre - 0.2 * np.stack([np.cos(spin * t), np.sin(spin * t), 0.0 * t], axis=1)
    assert np.max(np.abs(run.displacements["pin"][:, 3:] - near)) < 1e-6


@pytest.mark.parametrize("figure", [read_figure("prototype"), row(3)])
def test_the_centre_of_mass_of_a_figure_let_go(figure) -> None:
    first = "lower_torso" if "lower_torso" in figure.segments else "bar0"
    plan = Plan(
        stop=0.3,
        tolerance=1e-4,
        free_root=True,
        velocities={first: (0.5, -0.3, 0.2, 0.3, 1.0, -0.2)},
    )
    run = simulate(figure, plan)
    assert run.outcome.succeeded
    t = run.times[:, None]
    start = run.centre_of_mass[0]
    # The other segments ride on the first: the speed of the centre is not that of the segment.
    fall = run.centre_of_mass - start - 0.5 * t**2 * np.array([0.0, -9.81, 0.0])
    speed = fall[-1] / t[-1]
    assert np.linalg.norm(speed) > 0.5
    assert np.max(np.abs(fall - t * speed)) < 1e-6


def test_frames_of_a_tumbling_fall_are_interpolated_by_the_quaternions_of_a_table(tmp_path) -> None:
    figure = read_figure("prototype")
    plan = Plan(
        stop=0.6,
        frame=0.005,
        free_root=True,
        spring_choice="none",
        velocities={"lower_torso": (5.0, 2.0, 3.5, 0.0, 1.0, 0.0)},
    )
    run = simulate(figure, plan)
    text = format_csv(motion_from_recording(run, figure))
    titles, *rows = csv.reader(line for line in text.splitlines() if not line.startswith("#"))
    columns = [titles.index(f"lower_torso.{part} [1]") for part in ("qw", "qx", "qy", "qz")]
    quaternions = np.array([[float(row[k]) for k in columns] for row in rows])
    assert quaternions[0] == pytest.approx([1, 0, 0, 0])
    spline = CubicSpline(run.times[::4], quaternions[::4])(run.times)
    home = run.poses["lower_torso"][0, :3, :3]
    turned = Rotation.from_matrix(run.poses["lower_torso"][:, :3, :3] @ home.T)
    between = turned.inv() * Rotation.from_quat(spline, scalar_first=True)
    assert np.max(turned.magnitude()) > 2.0
    assert np.max(between.magnitude()) < np.radians(0.1)
