"""Laws over several joints as Exudyn applies them, against the laws themselves."""

import signal
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from generator.diagnostics import ModelError
from generator.model import Model
from generator.recording import Ending
from generator.rotations import (
    matrix_from_rotation_vector,
    rotation_vector_from_matrix,
    unit_vector,
)
from generator.simulation.exudyn_model.model import build_model
from generator.simulation.plan import Plan
from generator.simulation.run import simulate
from generator.simulation.statics.static_forces import static_torques
from springs import (
    FLOATS,
    NUMPY,
    AxisSpring,
    CoupledAxis,
    CoupledSpring,
    JointSprings,
    Linear,
    SphericalLaw,
    SpringSet,
    group_torque,
)
from springs.coupled import CoupledExponential, CoupledTerm
from tests.chains import (
    ACROSS,
    BALL,
    SKEW,
    X,
    Y,
    Z,
    at,
    body,
    chain,
    figure,
    ground,
    joint,
    negative,
)

NAMES = ("one", "two", "three")
LAW = CoupledExponential(
    NAMES,
    (
        CoupledTerm((1.5, -0.5, 2.0), (0.6, -0.4, 0.3), 0.1),
        CoupledTerm((0.0, -2.0, 0.4), (-0.8, 0.5, 0.0), -0.2, 0.1),
        CoupledTerm((-1.0, 0.3, 0.0), (0.2, 0.1, -0.9)),
    ),
    (0.4, -0.3, 0.8),
    (None, None, None),
)
FIRST, SECOND, THIRD = (0.3, -0.7, 0.5), (0.9,), (0.4, -0.6)


def limb(flip=(False, False, False)):
    """Ground, ball, hinge, universal: all sites turned; `flip` writes a joint the other way."""
    places = {"far": at((0.4, -0.7, 0.3), (0.1, -0.3, 0.2)), "tip": at((-0.3, 0.9, 0.5))}
    segments = [ground(hook=at((0.2, 0.5, -0.9), (0.3, 0.1, 0.0)))]
    segments += [body(name, 1.0 + 0.3 * k, sites=places) for k, name in enumerate("abc")]
    made = []
    last = "ground.hook"
    chains = (BALL, chain("Rs"), chain("Ra Rs"))
    for name, link, factors, value, turned in zip(
        NAMES, "abc", chains, (FIRST, SECOND, THIRD), flip, strict=True
    ):
        ends = (f"{link}.tip", last) if turned else (last, f"{link}.tip")
        made.append(joint(name, *ends, factors, value))
        last = f"{link}.far"
    return figure(segments, made)


AXES = (CoupledAxis("one", Y), CoupledAxis("two", negative(SKEW)), CoupledAxis("three", ACROSS))


def coupled(law=LAW, axes=AXES, **more) -> SpringSet:
    return SpringSet(coupled=(CoupledSpring(law, axes),), **more)


def expected(made, pose, springs) -> dict[str, np.ndarray]:
    """The torques on the children in the parents' axes, from poses of the joints alone."""
    sums = {name: np.zeros(3) for name in NAMES}
    vectors = {}
    for name in NAMES:
        rotation = build_model(
            Model(made, SpringSet()), Plan(displacements=pose)
        ).placement.pose_in_parent(made.joints[name])[:3, :3]
        vectors[name] = rotation_vector_from_matrix(rotation)
    for spring in springs.coupled:
        angles = [
            float(pose["two"][0]) * float(np.dot(axis.direction, SKEW))
            if axis.joint == "two"
            else float(vectors[axis.joint] @ axis.direction)
            for axis in spring.axes
        ]
        for axis, size in zip(spring.axes, spring.law.torques(angles), strict=True):
            push = float(size) * np.array(axis.direction)
            if axis.joint != "two":
                r = vectors[axis.joint]
                push = matrix_from_rotation_vector(0.5 * r) @ group_torque(push, r)
            sums[axis.joint] += push
    return sums


def random_pose(seed, turns=0.0):
    rng = np.random.default_rng(seed)
    pose = {name: rng.uniform(-1.2, 1.2, n) for name, n in zip(NAMES, (3, 1, 2), strict=True)}
    pose["two"] = pose["two"] + turns
    return pose


def assert_applied(made, pose, springs, **plan) -> None:
    """The torques read out are those of the laws, none of which is zero."""
    torques = static_torques(made, [pose], Plan(springs=springs, **plan))
    for name, torque in expected(made, pose, springs).items():
        assert np.max(np.abs(torque)) > 0.1
        assert torques[name][0] == pytest.approx(torque, rel=1e-9, abs=1e-9)


@pytest.mark.parametrize("python", [False, True])
@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize(
    "flip", [(False, False, False), (True, False, True), (False, True, False), (True, True, True)]
)
def test_exudyn_applies_the_law_s_torques(flip, seed, python) -> None:
    assert_applied(limb(flip), random_pose(seed), coupled(), python_torques=python)


@pytest.mark.parametrize("turns", [2.0 * np.pi, -4.0 * np.pi])
def test_a_hinge_s_angle_is_unwrapped(turns) -> None:
    """Whole turns more are another angle, and other torques about all joints."""
    assert_applied(limb(), random_pose(5, turns), coupled(LAW.scaled(0.1)))


def test_two_angles_of_one_joint_and_three_laws_add_up() -> None:
    axes = (CoupledAxis("one", X), CoupledAxis("one", SKEW), CoupledAxis("two", SKEW))
    own = CoupledSpring(LAW, AXES)
    springs = SpringSet(coupled=(CoupledSpring(LAW, axes), own, replace(own, why="again")))
    assert_applied(limb(), random_pose(7), springs)


def test_a_coupled_law_adds_to_the_axes_springs() -> None:
    own = {
        "one": JointSprings("one", tuple(AxisSpring(a, (Linear(4.0),)) for a in (X, Y, Z))),
        "two": JointSprings("two", (AxisSpring(SKEW, (Linear(3.0),)),)),
    }
    pose = random_pose(2)
    both, one, other = (
        static_torques(limb(), [pose], Plan(springs=springs))
        for springs in (coupled(joints=own), coupled(), SpringSet(own))
    )
    for name in NAMES:
        assert both[name] == pytest.approx(one[name] + other[name], abs=1e-9)


def test_the_order_of_coordinates_and_laws_is_irrelevant() -> None:
    order = (2, 0, 1)

    def moved(values):
        return tuple(values[k] for k in order)

    law = CoupledExponential(
        moved(NAMES),
        tuple(replace(t, amplitudes=moved(t.amplitudes), rates=moved(t.rates)) for t in LAW.terms),
        moved(LAW.constants),
        moved(LAW.valid_ranges),
    )
    pose = random_pose(3)
    one = static_torques(limb(), [pose], Plan(springs=coupled()))
    other = static_torques(limb(), [pose], Plan(springs=coupled(law, moved(AXES))))
    for name in NAMES:
        assert one[name] == pytest.approx(other[name], abs=1e-12)


def test_the_recorded_torques_are_the_applied_ones() -> None:
    springs = coupled(joints={"two": JointSprings("two", (AxisSpring(SKEW, (Linear(3.0),)),))})
    plan = Plan(stop=0.04, step=1e-3, springs=springs)
    run = simulate(limb(), plan)
    poses = [{n: run.displacements[n][k] for n in NAMES} for k in range(len(run.times))]
    torques = static_torques(limb(), poses, plan)
    for name in NAMES:
        assert run.passive_torques[name] == pytest.approx(torques[name], abs=1e-4)


def test_python_torques_give_the_same_run() -> None:
    runs = [
        simulate(limb(), Plan(stop=0.1, step=1e-3, springs=coupled(), python_torques=python))
        for python in (False, True)
    ]
    for name in NAMES:
        assert np.allclose(*(run.displacements[name] for run in runs), atol=1e-9)


@pytest.mark.parametrize(
    ("axis", "reason"),
    [
        (CoupledAxis("too", Y), "no joint too, .* `?one.*did you mean `two`"),
        (CoupledAxis("two", X), "joint two does not rotate about .*axis of the one"),
        (
            CoupledAxis("three", tuple(unit_vector(np.cross(SKEW, ACROSS)).tolist())),
            "joint three does not",
        ),
        (CoupledAxis("rail", X), "joint rail has the one of a coupled law but no rotation"),
    ],
)
def test_what_cannot_be_hung(axis, reason) -> None:
    made = limb()
    rail = joint("rail", "c.far", "d.near", chain("Tx"), (0.1,))
    made = figure([*made.segments.values(), body("d")], [*made.joints.values(), rail])
    with pytest.raises(ModelError, match=reason):
        build_model(Model(made, coupled(axes=(axis, *AXES[1:]))), Plan())


def test_a_ball_does_not_start_at_half_a_turn() -> None:
    pose = {"one": (0.0, 0.0, np.pi)}
    with pytest.raises(ModelError, match="joint one starts at 180 deg"):
        build_model(Model(limb(), coupled()), Plan(displacements=pose))


def test_a_free_root_loses_the_laws_over_joints_that_are_gone() -> None:
    axes = (CoupledAxis("two", SKEW), CoupledAxis("three", SKEW), CoupledAxis("three", ACROSS))
    springs = SpringSet(coupled=(CoupledSpring(LAW, AXES), CoupledSpring(LAW, axes)))
    assert len(build_model(Model(limb(), springs), Plan()).coupled) == 2
    (kept,) = build_model(Model(limb(), springs), Plan(free_root=True)).coupled
    assert kept.axes == axes
    run = simulate(limb(), Plan(stop=0.04, step=1e-3, free_root=True, springs=springs))
    assert run.outcome.succeeded


class Interrupted(CoupledExponential):
    """A law during whose evaluation Ctrl-C is pressed, some time after the start."""

    def torques(self, angles, ops=NUMPY):
        if ops is FLOATS and abs(angles[0]) > 1.0:
            signal.raise_signal(signal.SIGINT)
        return super().torques(angles, ops)


@pytest.fixture
def interrupt_handler() -> Iterator[None]:
    """Python's own handler of Ctrl-C, which a shell may have switched off for its background."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.usefixtures("interrupt_handler")
def test_ctrl_c_while_a_law_is_evaluated_ends_the_run() -> None:
    law = Interrupted(NAMES, LAW.terms, LAW.constants, LAW.valid_ranges)
    plan = Plan(stop=5.0, step=1e-3, springs=coupled(law), velocities={"one": (0.0, 3.0, 0.0)})
    run = simulate(limb(), plan)
    assert run.outcome.ending is Ending.INTERRUPTED
    assert 0.0 < run.outcome.last_time < 5.0


def test_directions_have_length_one() -> None:
    with pytest.raises(ValueError, match="length 1"):
        CoupledAxis("one", (0.0, 2.0, 0.0))


def test_the_law_of_spherical_joints_is_no_concern_of_coupled_laws() -> None:
    pose = random_pose(6)
    one, other = (
        static_torques(limb(), [pose], Plan(springs=coupled(), law=law))
        for law in (SphericalLaw.CONSERVATIVE, SphericalLaw.WEIGHTED)
    )
    for name in NAMES:
        assert one[name] == pytest.approx(other[name], abs=1e-12)
