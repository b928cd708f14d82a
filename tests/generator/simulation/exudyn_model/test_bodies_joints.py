"""Joints of every chain: they leave just their freedoms, and tell the forces that they carry."""

import numpy as np
import pytest
from scipy.interpolate import make_interp_spline

from generator.figure import AxisKind, Joint
from generator.joint_chain import build_chain, locked_axes_from_chain
from generator.rotations import inverse_pose
from generator.simulation.plan import Plan
from generator.simulation.run import simulate
from springs import AxisSpring, Damping, JointSprings, Linear, SpringSet
from tests.chains import chain, one_body, two_bodies
from tests.runs import energy_error

NONE = SpringSet()
GRAVITY = np.array([0.0, -9.81, 0.0])

CHAINS = [
    "",
    "Rz",
    "R-z",
    "Rs",
    "Tx",
    "T-x",
    "Ts",
    "Rx Ry",
    "Ry R-x",
    "Rs Ra",
    "Rx Ry Rz",
    "Rz R-x Rz",
    "Rz Tz",
    "Tz R-z",
    "Rs Ts",
    "Rz Tx Ty",
    "Tx Ty Rz",
    "Rz Tx",
    "Tx Rz",
    "Ta Rs",
    "Tx Ty",
    "Ts Ta Rs",
    "Rx Ry Tz",
    "Tz Rx Ry",
    "Rx Ry Tx Ty",
    "Tx Ty Rx Ry",
    "Rx Ry Tx Ty Tz",
    "Tx Ty Tz Rx Ry",
    "Rx Ry Rz Tx",
    "Tx Rx Ry Rz",
    "Rx Ry Rz Tx Ty",
    "Tx Ty Tz",
    "Rx Ry Rz Tx Ty Tz",
]


def freedoms(text: str) -> int:
    return len(text.split())


@pytest.mark.parametrize("text", CHAINS)
def test_a_joint_locks_what_its_chain_does_not_have(text) -> None:
    locks = locked_axes_from_chain(build_chain(chain(text)))
    assert sum(sum(k.translations) + sum(k.rotations) for k in locks) == 6 - freedoms(text)


def accelerations(times, rotations, centres, inertia):
    """Of a body from its poses: of its centre [m/s2], and the rate of its spin momentum [N m]."""
    linear = make_interp_spline(times, centres, k=7).derivative(2)(times)
    flat = make_interp_spline(times, rotations.reshape(-1, 9), k=7).derivative(1)(times)
    spin = flat.reshape(-1, 3, 3) @ np.swapaxes(rotations, 1, 2)
    omega = np.stack([spin[:, 2, 1], spin[:, 0, 2], spin[:, 1, 0]], axis=1)
    own = (np.swapaxes(rotations, 1, 2) @ omega[..., None])[..., 0]
    momentum = (rotations @ (own * inertia)[..., None])[..., 0]
    return linear, make_interp_spline(times, momentum, k=7).derivative(1)(times)


def moved(text: str, reverse: bool):
    """A run of two bodies of which the second swings on the tested joint."""
    size = freedoms(text)
    values = 0.3 * np.cos(1.0 + np.arange(size))
    rates = np.cos(2.0 + 1.7 * np.arange(size))
    figure = two_bodies(chain(text), values, reverse=reverse)
    velocities = {"tested": rates, "ball": (1.0, 2.0, -1.0)}
    plan = Plan(stop=0.2, step=2.5e-4, frame=4e-3, velocities=velocities, springs=NONE)
    return figure, values, rates, simulate(figure, plan)


@pytest.mark.parametrize("reverse", [False, True])
@pytest.mark.parametrize("text", CHAINS)
def test_the_motion_stays_in_the_chain_and_the_reaction_obeys_newton_and_euler(text, reverse):
    figure, values, rates, run = moved(text, reverse)
    joint = figure.joints["tested"]
    between = _between(figure, run, joint)
    link = build_chain(joint.chain)

    # It starts as asked, and the parts outside the chain stay closed.
    assert np.allclose(run.displacements["tested"][0], values, atol=1e-9)
    assert np.allclose(run.velocities["tested"][0], rates, atol=1e-9)
    assert max(float(np.max(np.abs(link.pose_residual(pose)))) for pose in between) < 1e-5

    # Rates are the slopes of the displacements.
    if values.size:
        slopes = make_interp_spline(run.times, run.displacements["tested"], k=7).derivative(1)
        assert np.allclose(slopes(run.times), run.velocities["tested"], atol=1e-4)

    # The second body, cut free: what the joint must push it with.
    segment = figure.segments["second"]
    rotations = run.poses["second"][:, :3, :3]
    centres = run.poses["second"][:, :3, 3] + rotations @ segment.centre_of_mass
    linear, spinning = accelerations(run.times, rotations, centres, np.array(segment.inertia))
    force = segment.mass * (linear - GRAVITY)
    at = _site(figure, run, joint.child)[:, :3, 3]
    moment = spinning - np.cross(at - centres, force)
    sign = -1.0 if reverse else 1.0
    turn = np.swapaxes(_site(figure, run, joint.parent)[:, :3, :3], 1, 2)
    expected = sign * np.concatenate(
        [(turn @ force[..., None])[..., 0], (turn @ moment[..., None])[..., 0]], axis=1
    )
    found = run.reactions["tested"]
    scale = 1.0 + np.max(np.abs(expected))
    assert np.max(np.abs(found - expected)[6:-6]) < 2e-4 * scale
    assert np.max(np.abs(found - expected)[0]) < 2e-2 * scale  # the slopes end there

    # It does no work on what the joint leaves free.
    for pose, displacement, wrench in zip(between, run.displacements["tested"], found, strict=True):
        twists = link.twists(displacement)
        linear_part = twists[:, 3:] + np.cross(twists[:, :3], pose[:3, 3])
        power = linear_part @ wrench[:3] + twists[:, :3] @ wrench[3:]
        assert np.max(np.abs(power), initial=0.0) < 1e-5 * scale


def _site(figure, run, ref):
    return run.poses[ref.segment] @ figure.site(ref).pose_in_segment


def _between(figure, run, joint: Joint):
    return inverse_pose(_site(figure, run, joint.parent)) @ _site(figure, run, joint.child)


SLIDES = [
    ("Tx", False),
    ("Tx Rz", False),
    ("Tx Rz", True),
    ("Rz Tx", False),
    ("Rz Tx", True),
    ("Tx Rx Ry Rz", False),
    ("Rx Ry Rz T-s", True),
    ("Rz Tz", False),
    ("Tx Ty", False),
    ("Tx Ty", True),
    ("Tx Ts", False),
    ("Ts Ta", True),
    ("Tx Ty Tz", False),
]


def spring_along_slides(text: str, damping: float = 0.0) -> SpringSet:
    slides = tuple(
        AxisSpring(f.axis, (Linear(300.0, 0.02),), Damping(damping))
        for f in chain(text)
        if f.kind is AxisKind.TRANSLATION
    )
    return SpringSet({"tested": JointSprings("tested", (), slides)})


@pytest.mark.parametrize(("text", "reverse"), SLIDES)
def test_springs_along_slides_keep_energy_and_momentum(text, reverse) -> None:
    """Two bodies that float: the law is the displacement's, and nothing comes from outside."""
    size = freedoms(text)
    values = 0.2 * np.cos(1.0 + np.arange(size))
    rates = np.cos(2.0 + 1.7 * np.arange(size))
    figure = two_bodies(chain(text), values, reverse=reverse)
    plan = Plan(
        stop=0.4,
        step=2.5e-4,
        frame=4e-3,
        free_root=True,
        gravity=(0.0, 0.0, 0.0),
        velocities={"tested": rates},
        springs=spring_along_slides(text),
    )
    run = simulate(figure, plan)
    assert run.outcome.succeeded
    slides = [k for k, f in enumerate(chain(text)) if f.kind is AxisKind.TRANSLATION]
    stored = 150.0 * np.sum((run.displacements["tested"][:, slides] - 0.02) ** 2, axis=1)
    assert np.allclose(run.energy["spring"], stored, atol=1e-12)
    exchanged = np.ptp(run.energy["spring"])
    assert exchanged > 0.1
    assert energy_error(run) < 1e-4 * exchanged
    about_origin = angular_momentum(figure, run)
    assert np.max(np.abs(about_origin - about_origin[3:4])[3:-3]) < 1e-4


def angular_momentum(figure, run):
    """About the world's origin [N m s], from the poses."""
    total = np.zeros((len(run.times), 3))
    for name, segment in figure.bodies.items():
        rotations = run.poses[name][:, :3, :3]
        centres = run.poses[name][:, :3, 3] + rotations @ segment.centre_of_mass
        velocity = make_interp_spline(run.times, centres, k=7).derivative(1)(run.times)
        flat = make_interp_spline(run.times, rotations.reshape(-1, 9), k=7).derivative(1)
        spin = flat(run.times).reshape(-1, 3, 3) @ np.swapaxes(rotations, 1, 2)
        omega = np.stack([spin[:, 2, 1], spin[:, 0, 2], spin[:, 1, 0]], axis=1)
        own = (np.swapaxes(rotations, 1, 2) @ omega[..., None])[..., 0]
        total += segment.mass * np.cross(centres, velocity)
        total += (rotations @ (own * np.array(segment.inertia))[..., None])[..., 0]
    return total


@pytest.mark.parametrize("text", ["Tx", "Tx Ty", "Tx Ts", "Tx Ty Tz", "Rz Tx", "Tx Rz"])
def test_damping_along_slides_is_in_the_energy_book(text) -> None:
    size = freedoms(text)
    slides = tuple(
        AxisSpring(f.axis, (Linear(300.0, 0.02),), Damping(2.0, 0.3))
        for f in chain(text)
        if f.kind is AxisKind.TRANSLATION
    )
    springs = SpringSet({"pin": JointSprings("pin", (), slides)})
    figure = one_body(chain(text), 0.1 * np.ones(size))
    run = simulate(figure, Plan(stop=0.4, step=2e-4, springs=springs))
    assert run.energy["dissipated"][-1] > 0.1
    assert energy_error(run) < 1e-4 * run.energy["dissipated"][-1]
