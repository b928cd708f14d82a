"""Models for MuJoCo: MuJoCo reads them, places the segments as we do and moves them as we do."""

import numpy as np
import pytest

from generator.figure import Figure
from generator.kinematics.loops import close_loops
from generator.kinematics.placement import initial_displacements
from generator.kinematics.tree import build_tree
from generator.model_files.mjcf.write import format_mjcf
from generator.rotations import pose_matrix
from springs import AxisSpring, Damping, JointSprings, Linear, SpringSet
from tests.chains import ACROSS, SKEW, chain, two_bodies
from tests.generator.model_files.model_cases import (
    AGREEMENT,
    CURVES,
    FRAME,
    LOADED,
    LOOPS,
    PROTOTYPE,
    START,
    STOP,
    TREES,
    apart,
    equal,
    hinge,
    on_a_rail,
    ours,
    own_springs,
    slide,
    spring_set,
)

mujoco = pytest.importorskip("mujoco")

pytestmark = pytest.mark.verify


def loaded(text: str) -> tuple:
    """The model and the state of the key `start`."""
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, model.key("start").id)
    mujoco.mj_forward(model, data)
    return model, data


def poses(of: Figure, data: object) -> dict[str, np.ndarray]:
    bodies = {n: data.body(n if n != "world" else "world_2") for n in of.bodies}
    return {n: pose_matrix(b.xmat.reshape(3, 3).copy(), b.xpos.copy()) for n, b in bodies.items()}


def moved(of: Figure, springs: SpringSet, finer: int = 1) -> dict[str, np.ndarray]:
    """The motion as MuJoCo has it, with the options of the file but for a finer step."""
    model, data = loaded(format_mjcf(of, springs)[0])
    model.opt.timestep /= finer
    rows = [poses(of, data)]
    for _ in range(round(STOP / FRAME)):
        mujoco.mj_step(model, data, round(FRAME / model.opt.timestep))
        mujoco.mj_forward(model, data)
        rows.append(poses(of, data))
    return {name: np.array([row[name] for row in rows]) for name in rows[0]}


@pytest.mark.parametrize("name", TREES | LOOPS)
def test_segments_and_sites_start_where_the_figure_is_drawn(name: str) -> None:
    of = (TREES | LOOPS)[name]
    text, _ = format_mjcf(of, SpringSet())
    _, data = loaded(text)
    tree = build_tree(of)
    expected = close_loops(tree, initial_displacements(tree)).poses
    for segment, pose in poses(of, data).items():
        assert pose == pytest.approx(expected[segment], abs=1e-12)
    for segment, one in of.segments.items():
        for site in one.sites.values():
            at_site = data.site(f"{segment}.{site.name}")
            pose = expected[segment] @ site.pose_in_segment
            assert at_site.xpos == pytest.approx(pose[:3, 3], abs=1e-12)
            assert at_site.xmat.reshape(3, 3) == pytest.approx(pose[:3, :3], abs=1e-12)


@pytest.mark.parametrize("name", TREES)
def test_figures_without_springs_fall_alike(name: str) -> None:
    of = TREES[name]
    assert apart(moved(of, SpringSet()), ours(of, SpringSet()).poses) < AGREEMENT


def test_the_prototype_falls_alike_on_its_own_hinges_and_equal_balls() -> None:
    own = own_springs(PROTOTYPE)
    hinges = [one for name, one in own.joints.items() if len(PROTOTYPE.joints[name].chain) == 1]
    balls = [n for n in own.joints if len(PROTOTYPE.joints[n].chain) == 3]
    springs = spring_set(*hinges, *(equal(PROTOTYPE, name, 40.0, 0.08) for name in balls))
    _, losses = format_mjcf(PROTOTYPE, springs)
    assert [loss.what for loss in losses.entries] == ["the references of the springs"]
    assert apart(moved(PROTOTYPE, springs, finer=4), ours(PROTOTYPE, springs).poses) < AGREEMENT


@pytest.mark.parametrize("name", CURVES)
def test_hinges_and_slides_have_the_torques_of_their_curves(name: str) -> None:
    of, laws = on_a_rail(), CURVES[name]
    springs = spring_set(hinge("hinge", *laws, axis=(-1.0, 0.0, 0.0)), slide("rail", SKEW, *laws))
    text, losses = format_mjcf(of, springs)
    assert not losses.entries
    model, data = loaded(text)
    for value in np.linspace(-2.0, 2.0, 83):
        data.qpos[:] = value
        mujoco.mj_forward(model, data)
        expected = sum(float(law.torque(value)) for law in laws)
        assert data.qfrc_passive == pytest.approx([expected, expected], rel=1e-9, abs=1e-9)


@pytest.mark.parametrize("name", CURVES)
def test_curves_move_a_hinge_alike(name: str) -> None:
    """Told about the opposite axis, and with damping."""
    of = on_a_rail()
    turned = hinge("hinge", *CURVES[name], axis=(1.0, 0.0, 0.0), viscous=0.05)
    springs = spring_set(turned, slide("rail", SKEW, *CURVES["cubic"], viscous=0.3))
    assert apart(moved(of, springs), ours(of, springs).poses) < AGREEMENT


@pytest.mark.parametrize("reverse", [False, True])
def test_equal_springs_of_a_ball_are_held(reverse: bool) -> None:
    of = two_bodies(chain("R-s Ra Rs"), START, reverse=reverse)
    third = tuple(float(part) for part in np.cross(SKEW, ACROSS))
    law, damping = (Linear(8.0),), Damping(0.05)
    axes = tuple(AxisSpring(axis, law, damping) for axis in (SKEW, ACROSS, third))
    springs = spring_set(JointSprings("tested", axes), equal(of, "ball", 5.0, 0.0))
    assert not format_mjcf(of, springs)[1].entries
    assert apart(moved(of, springs), ours(of, springs).poses) < AGREEMENT


@pytest.mark.parametrize("name", LOOPS)
def test_loops_stay_closed_and_move_alike(name: str) -> None:
    of = LOOPS[name]
    assert apart(moved(of, SpringSet()), ours(of, SpringSet()).poses) < AGREEMENT


def test_a_constant_load_acts_alike() -> None:
    assert apart(moved(LOADED, SpringSet()), ours(LOADED, SpringSet()).poses) < AGREEMENT
