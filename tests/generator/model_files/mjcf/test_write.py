"""Models for MuJoCo: they compile, and have the torques of curves, hinges and balls."""

import warnings
from collections.abc import Sequence
from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from generator.figure import Figure, Joint
from generator.figure_file import read_figure
from generator.joint_chain import Chain
from generator.kinematics.links import Coordinate, figure_links
from generator.model_files.export_model import split_joint_laws
from generator.model_files.fit_error import joint_ranges
from generator.model_files.formats import read_model
from generator.model_files.mjcf.write import MAX_POWERS, format_mjcf
from generator.rotations import Array, rotation_vector_from_matrix
from generator.springs_file.read import read_springs
from springs import (
    AxisSpring,
    Cubic,
    Damping,
    Elastic,
    JointSprings,
    Linear,
    SphericalLaw,
    SpringSet,
    total_torque,
)
from springs.exponential import Exponential, ExponentialTerm
from springs.smooth_limit import SmoothLimit
from springs.spherical import elastic_torque
from springs.transformed import Transformed
from tests.chains import ACROSS, SKEW, chain, one_body, two_bodies
from tests.generator.model_files.bent_fall import bent_prototype
from tests.generator.model_files.engines import MuJoCo, moved
from tests.generator.model_files.imported_models import MODELS
from tests.generator.model_files.model_cases import (
    AGREEMENT,
    CURVES,
    OTHER_CURVES,
    START,
    apart,
    equal,
    hinge,
    on_a_rail,
    ours,
    own_springs,
    slide,
    spring_set,
)

pytestmark = pytest.mark.verify

SHIPPED = ("prototype", "clavicles", "pendulum", "fourbar")

FITTED_CURVES: dict[str, tuple[Elastic, ...]] = OTHER_CURVES | {
    "smooth limit": (SmoothLimit(-0.3, 0.5, 80.0, 120.0, 0.2),),
    "one-sided exponential": (Exponential((ExponentialTerm(3.0, 2.0),)),),
    "constant": (Transformed(Linear(0.0), constant=2.0),),
}


@pytest.mark.parametrize("name", CURVES)
def test_hinges_and_slides_have_the_torques_of_their_curves(name: str) -> None:
    of, laws = on_a_rail(), CURVES[name]
    springs = spring_set(hinge("hinge", *laws, axis=(-1.0, 0.0, 0.0)), slide("rail", SKEW, *laws))
    loaded = MuJoCo(of, springs)
    assert not loaded.losses.entries
    for value in np.linspace(-2.0, 2.0, 83):
        loaded.data.qpos[:] = value
        loaded.api.mj_forward(loaded.model, loaded.data)
        expected = sum(float(law.torque(value)) for law in laws)
        torques = loaded.data.qfrc_passive
        assert torques == pytest.approx([expected, expected], rel=1e-9, abs=1e-9)


@pytest.mark.parametrize("name", FITTED_CURVES)
def test_other_curves_are_followed_within_their_error(name: str) -> None:
    of, laws = on_a_rail(), FITTED_CURVES[name]
    springs = spring_set(hinge("hinge", *laws, axis=(-1.0, 0.0, 0.0)))
    loaded = MuJoCo(of, springs)
    ((low, high),) = joint_ranges(of.joints["hinge"], springs.joints["hinge"])
    values = np.linspace(low, high, 181)
    expected = np.asarray(total_torque(laws, values)) + 0.0 * values
    allowed = 1e-3 * np.abs(expected).max() + 1e-2
    for value, torque in zip(values, expected, strict=True):
        loaded.data.qpos[loaded.model.joint("hinge").qposadr] = value
        loaded.api.mj_forward(loaded.model, loaded.data)
        forces = loaded.data.qfrc_passive + loaded.data.qfrc_actuator
        place = loaded.model.joint("hinge").dofadr[0]
        assert forces[place] == pytest.approx(torque, abs=allowed)


@pytest.mark.parametrize("reverse", [False, True])
def test_equal_springs_of_a_ball_are_held(reverse: bool) -> None:
    of = two_bodies(chain("R-s Ra Rs"), START, reverse=reverse)
    third = tuple(float(part) for part in np.cross(SKEW, ACROSS))
    law, damping = (Linear(8.0),), Damping(0.05)
    axes = tuple(AxisSpring(axis, law, damping) for axis in (SKEW, ACROSS, third))
    springs = spring_set(JointSprings("tested", axes), equal(of, "ball", 5.0, 0.0))
    loaded = MuJoCo(of, springs)
    assert not loaded.losses.entries
    assert not loaded.model.nu
    assert apart(moved(loaded), ours(of, springs).poses) < AGREEMENT


def test_a_cubic_law_that_is_equal_in_all_directions_is_the_spring_of_the_ball() -> None:
    """The sum of (a . x)^4 over the axes of a cube's faces and the diagonals of its faces."""
    of, law = two_bodies(chain("Rx Ry Rz"), START), Cubic((0.0, 0.0, 0.0, 6.0))
    diagonals = [(1, s, 0) for s in (1, -1)] + [(1, 0, s) for s in (1, -1)]
    diagonals += [(0, 1, s) for s in (1, -1)]
    axes = [AxisSpring(tuple(axis), (law,)) for axis in np.eye(3).tolist()]
    half = Cubic((0.0, 0.0, 0.0, 12.0))
    axes += [AxisSpring(tuple(np.array(d) / np.sqrt(2.0)), (half,)) for d in diagonals]
    springs = spring_set(JointSprings("tested", tuple(axes)))
    loaded = MuJoCo(of, springs)
    r = np.array([0.3, -0.5, 0.7])
    _turn_ball(loaded, of.joints["tested"], r)
    isotropic = elastic_torque(springs.law, springs.joints["tested"].axes, r)
    assert np.cross(isotropic, r) == pytest.approx(0.0, abs=1e-9)
    assert not loaded.losses.entries
    assert not loaded.model.nu
    assert ball_torque(loaded, of.joints["tested"]) == pytest.approx(isotropic, rel=1e-9)


def ball_torque(loaded: MuJoCo, joint: Joint) -> np.ndarray:
    """Torque of a ball on the joint's child in the parent's frame [N m], shape (3,)."""
    parent = loaded.data.site(f"{joint.parent.segment}.{joint.parent.site}")
    first = loaded.model.joint(joint.name).dofadr[0]
    axes = loaded.data.cdof[first : first + 3, :3] @ parent.xmat.reshape(3, 3)
    return np.linalg.solve(axes, loaded.data.qfrc_passive[first : first + 3])


def relative_rotation(loaded: MuJoCo, joint: Joint) -> np.ndarray:
    parent, child = (
        loaded.data.site(f"{end.segment}.{end.site}").xmat.reshape(3, 3) for end in joint.ends
    )
    return parent.T @ child


@pytest.mark.parametrize("name", ["prototype", "clavicles"])
def test_static_torques_of_shipped_figures_are_those_of_their_displacements(name: str) -> None:
    of = read_figure(name)
    springs = replace(own_springs(of), law=SphericalLaw.COORDINATES)
    loaded = MuJoCo(of, springs)
    for joint_name, each in springs.joints.items():
        joint, ranges = of.joints[joint_name], joint_ranges(of.joints[joint_name], each)
        chain = Chain(joint.chain)
        laws = split_joint_laws(chain, each, springs.law).uncoupled
        grid = np.array(list(product(*[np.linspace(*ends, 5) for ends in ranges])))
        expected = np.zeros(grid.shape)
        for k, spring in laws.items():
            expected[:, k] = total_torque(spring.elastic, grid[:, k])
        for values, torques in zip(grid, expected, strict=True):
            found = hinge_torques(loaded, joint, values)
            assert np.abs(found - torques).max() <= 1e-8 * np.abs(expected).max()


def hinge_torques(loaded: MuJoCo, joint: Joint, values: np.ndarray) -> np.ndarray:
    """Torques of the springs of a joint's hinges at displacements [N m]."""
    count = len(values)
    names = [joint.name] if count == 1 else [f"{joint.name}_{k + 1}" for k in range(count)]
    hinges = [loaded.model.joint(name) for name in names]
    for one, value in zip(hinges, values, strict=True):
        loaded.data.qpos[one.qposadr] = value
    loaded.api.mj_forward(loaded.model, loaded.data)
    forces = loaded.data.qfrc_passive + loaded.data.qfrc_actuator
    return np.array([forces[one.dofadr[0]] for one in hinges])


def _turn_ball(loaded: MuJoCo, joint: Joint, r: np.ndarray) -> None:
    """Set the rotation vector of a ball whose body is the joint's child."""
    site = loaded.figure.site(joint.child).pose_in_segment[:3, :3]
    place = loaded.model.joint(joint.name).qposadr[0]
    loaded.data.qpos[place : place + 4] = Rotation.from_rotvec(site @ r).as_quat()[[3, 0, 1, 2]]
    loaded.api.mj_forward(loaded.model, loaded.data)
    found = rotation_vector_from_matrix(relative_rotation(loaded, joint))
    assert found == pytest.approx(r, abs=1e-6)


def test_damping_that_differs_between_axes_takes_energy() -> None:
    of = two_bodies(chain("Rx Ry Rz"), START)
    axes = tuple(
        AxisSpring(tuple(axis), (), Damping(b))
        for axis, b in zip(np.eye(3).tolist(), (0.1, 0.2, 0.4), strict=True)
    )
    springs = SpringSet({"tested": JointSprings("tested", axes)}, law=SphericalLaw.COORDINATES)
    loaded = MuJoCo(of, springs)
    assert not loaded.losses.entries
    random = np.random.default_rng(1)
    for _ in range(10):
        loaded.data.qpos[:] = random.normal(size=loaded.model.nq)
        loaded.data.qvel[:] = random.normal(size=loaded.model.nv)
        loaded.api.mj_forward(loaded.model, loaded.data)
        power = loaded.data.qvel @ (loaded.data.qfrc_passive + loaded.data.qfrc_actuator)
        assert power < 0.0


def test_energy_falls_until_a_shoulder_nears_its_pole() -> None:
    of = bent_prototype()
    loaded = MuJoCo(of, replace(own_springs(of), law=SphericalLaw.COORDINATES))
    loaded.model.opt.enableflags |= loaded.api.mjtEnableBit.mjENBL_ENERGY
    energies: list[float] = []
    for frame in range(51):
        loaded.reach(0.01 * frame)
        energies.append(float(loaded.data.energy.sum()))
    assert not any(warning.number for warning in loaded.data.warning)
    assert np.diff(energies).max() < 0.0


@pytest.mark.parametrize("name", SHIPPED)
def test_shipped_figures_compile_without_warnings_also_when_saved(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    mujoco = pytest.importorskip("mujoco")
    monkeypatch.chdir(tmp_path)
    of = read_figure(name)
    (tmp_path / "out.xml").write_text(format_mjcf(of, own_springs(of))[0], encoding="utf-8")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        model = mujoco.MjModel.from_xml_path("out.xml")
        mujoco.mj_saveLastXML("saved.xml", model)
        saved = mujoco.MjModel.from_xml_path("saved.xml")
    assert not (tmp_path / "MUJOCO_LOG.TXT").exists()
    sizes = ("nq", "nv", "nu", "nbody", "ngeom", "ntendon", "nkey")
    assert [getattr(saved, size) for size in sizes] == [getattr(model, size) for size in sizes]
    assert saved.key_qpos == pytest.approx(model.key_qpos, abs=1e-5)
    assert {model.body(k).name for k in range(1, model.nbody)} == set(of.bodies)


def limited(of: Figure, lower: Sequence[float], upper: Sequence[float]) -> Figure:
    """The figure with limits of its only joint."""
    pin = replace(of.joints["pin"], lower_limit=tuple(lower), upper_limit=tuple(upper))
    return replace(of, joints={"pin": pin})


def test_limits_are_ranges_that_mujoco_does_not_enforce() -> None:
    model = MuJoCo(limited(one_body(chain("Rx")), (-0.3,), (0.4,)), SpringSet()).model
    assert model.jnt_range[0] == pytest.approx([-0.3, 0.4])
    assert not model.jnt_limited.any()
    ball = limited(one_body(chain("Rx Ry Rz")), (-0.3, -0.2, -0.1), (0.4, 0.5, 0.6))
    (loss,) = MuJoCo(ball, SpringSet()).losses.entries
    assert (loss.what, loss.where) == ("limits of three rotations", ("pin",))


def test_segments_without_a_psurf_are_capsules_that_touch_nothing() -> None:
    loaded = MuJoCo(two_bodies(chain("Rx Ry"), START[:2]), SpringSet())
    model, kinds = loaded.model, loaded.api.mjtGeom
    assert set(model.geom_type) <= {int(kinds.mjGEOM_CAPSULE), int(kinds.mjGEOM_SPHERE)}
    assert set(model.geom_bodyid) == {1, 2}
    assert not model.geom_contype.any()
    assert not model.geom_conaffinity.any()
    assert (model.geom_size[:, 0] > 0.0).all()


def test_a_law_over_several_joints_is_tendons_of_their_hinges() -> None:
    """Exponentials are followed within the error of other curves; a ball has no hinges."""
    of = read_figure("male50")
    springs = read_springs(None, of, SphericalLaw.COORDINATES)
    with_law, without = MuJoCo(of, springs), MuJoCo(of, replace(springs, coupled=()))
    names = ("left_hip_joint_3", "left_knee", "left_ankle_2")
    law = springs.coupled[0].law
    for angles in ((0.0, 0.1, 0.1), (0.9, 2.1, -0.6), (-0.25, 0.3, 0.3)):
        forces = []
        for loaded in (with_law, without):
            for name, angle in zip(names, angles, strict=True):
                loaded.data.qpos[loaded.model.joint(name).qposadr] = angle
            loaded.api.mj_forward(loaded.model, loaded.data)
            places = [int(loaded.model.joint(name).dofadr[0]) for name in names]
            forces.append((loaded.data.qfrc_passive + loaded.data.qfrc_actuator)[places])
        assert forces[0] - forces[1] == pytest.approx(law.torques(angles), abs=0.02)
    lost = "laws over several joints"
    assert lost not in str(with_law.losses)
    conservative = read_springs(None, of, SphericalLaw.CONSERVATIVE)
    assert lost in str(MuJoCo(of, conservative).losses)


def largest_gaps(model: MuJoCo) -> tuple[float, float]:
    """Largest distances of followers from their polynomials and their curves in 0.3 s [m]."""
    data, joints = model.data, model.figure.joints

    def joint(end: Coordinate) -> Any:
        last = f"_{end.index + 1}" if len(joints[end.joint].chain) > 1 else ""
        return data.joint(end.joint + last)

    links = figure_links(model.figure).links
    ends = [(joint(link.follower), joint(link.control)) for link in links]
    data.qvel[:] = np.random.default_rng(1).uniform(-3.0, 3.0, len(data.qvel))
    for link, (follower, control) in zip(links, ends, strict=True):
        follower.qvel[0] = link.as_curve.at(control.qpos[0], 1) * control.qvel[0]
    frames: list[list[tuple[float, float]]] = []
    while data.time < 0.3:
        model.api.mj_step(model.model, data)
        frames.append([(follower.qpos[0], control.qpos[0]) for follower, control in ends])
    held = curve = 0.0
    rows: Array = np.moveaxis(np.array(frames), 0, 2)
    for k, link in enumerate(links):
        y: Array = rows[k, 0]
        x: Array = rows[k, 1]
        powers = model.model.eq_data[k, MAX_POWERS - 1 :: -1]
        held = max(held, float(np.abs(y - np.polyval(powers, x)).max()))
        curve = max(curve, float(np.abs(y - link.as_curve.at(x)).max()))
    return held, curve


def test_a_sliding_knee_follows_its_curves_in_a_fall():
    knee = read_model(MODELS / "knee.osim").figure
    patella = knee.joints["patella_glide"]  # whose rotation is made free: others are slides
    of = knee.with_parts(replace(patella, followers=(None, *patella.followers[1:])))
    models = [MuJoCo(of, SpringSet({})) for _ in range(2)]
    models[1].model.eq_solref[:] = 0.02, 1.0
    models[1].model.eq_solimp[:] = 0.9, 0.95, 0.001, 0.5, 2.0
    (held, curve), (default, _) = map(largest_gaps, models)
    print(f"{1e3 * held:.4f} mm, {1e3 * curve:.2f} mm from the curves; {1e3 * default:.1f} mm")
    assert held < 1e-5
    assert curve < 1e-3
    assert default > 5e-3
