"""Torques read out of the Exudyn model at rest: the law's, on every axis and off the axes."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cache
from math import radians

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from generator import Plan, read_figure, static_torques
from generator.contact.plane import Plane
from generator.contact.scene import Prop, Scene
from generator.diagnostics import ModelError
from generator.figure import Figure, Joint, Site
from generator.joint_chain import build_chain
from generator.rotations import (
    matrix_from_rotation_vector,
    pose_matrix,
    rotation_vector_from_matrix,
    unit_vector,
)
from generator.springs_file.read import read_springs
from springs import (
    AxisSpring,
    CoupledAxis,
    CoupledSpring,
    Cubic,
    Damping,
    JointSprings,
    Linear,
    SphericalLaw,
    SpringSet,
    elastic_torque,
    total_torque,
)
from springs.contact import DEFAULT_SURFACE
from springs.published import tables as published
from tests.chains import BALL, SKEW, at, body, chain, figure, ground, joint, one_body, two_bodies
from tests.laws import VECTOR_LAWS

AGREED = 1e-6
"""Largest difference of a torque read out from its law [N m]."""

PROTOTYPE = read_figure("prototype")
SPRINGS = read_springs(None, PROTOTYPE)
BALLS = tuple(n for n, s in SPRINGS.joints.items() if PROTOTYPE.joints[n].degrees_of_freedom == 3)
SWEEP = np.radians(np.arange(-150.0, 150.1, 7.5))

BOTH_KINDS = pytest.mark.parametrize("python", [False, True])


def axes(name: str) -> Sequence[AxisSpring]:
    return SPRINGS.joints[name].axes


def turned(made: Joint, vector: Sequence[float]) -> np.ndarray:
    """The displacements that turn a joint by a rotation vector."""
    matrix = matrix_from_rotation_vector(vector)
    return build_chain(made.chain).displacements(pose_matrix(matrix, np.zeros(3)))


def in_parent(law: SphericalLaw, name: str, vector: Sequence[float]) -> np.ndarray:
    """The law's torque, from its half-way frame turned into the parent's [N m]."""
    r = np.asarray(vector)
    return matrix_from_rotation_vector(0.5 * r) @ elastic_torque(law, axes(name), r)


@cache
def swept(law: SphericalLaw, python: bool) -> tuple[list[dict[str, np.ndarray]], Mapping]:
    """Every joint of the prototype at once, turned about its first, second and third axis."""
    plan = Plan(law=law, python_torques=python)
    poses = []
    for k in range(3):
        for angle in angles():
            pose = {}
            for name in SPRINGS.joints:
                made = PROTOTYPE.joints[name]
                vector = angle * np.asarray(axes(name)[k % len(axes(name))].direction)
                hinge = made.degrees_of_freedom == 1
                pose[name] = np.array([angle]) if hinge else turned(made, vector)
            poses.append(pose)
    return poses, static_torques(PROTOTYPE, poses, plan)


@cache
def angles() -> tuple[float, ...]:
    """The sweep, and the edges of all dead zones with what is next to them."""
    edges = [
        corner
        for joint in SPRINGS.joints.values()
        for axis in joint.axes
        for law in axis.elastic
        for corner in law.breakpoints
    ]
    near = [edge + by for edge in edges for by in (-1e-6, 0.0, 1e-6)]
    return tuple(np.unique([*SWEEP, *near]).tolist())


@BOTH_KINDS
@pytest.mark.parametrize("law", VECTOR_LAWS)
@pytest.mark.parametrize("name", SPRINGS.joints)
def test_a_turn_about_an_axis_reads_the_law_of_that_axis(name, law, python) -> None:
    _, torques = swept(law, python)
    read = torques[name].reshape(3, len(angles()), 3)
    for k in range(3):
        springs = axes(name)
        about = springs[k % len(springs)]
        expected = np.outer(total_torque(about.elastic, np.array(angles())), about.direction)
        # An axis that has a torque at rest keeps it, whichever way the joint is turned.
        if len(springs) == 3:
            expected = np.array(
                [in_parent(law, name, angle * np.asarray(about.direction)) for angle in angles()]
            )
            own = np.asarray(total_torque(about.elastic, np.array(angles())))
            assert np.max(np.abs(expected @ about.direction - own)) < AGREED
        assert np.max(np.abs(expected)) > 100.0
        assert np.max(np.abs(read[k] - expected)) < AGREED


@BOTH_KINDS
def test_torques_between_the_segments_add_up_to_none_on_the_whole(python) -> None:
    """`root_torso` has no spring: what the whole figure gets through it is nothing."""
    _, torques = swept(SphericalLaw.CONSERVATIVE, python)
    assert np.max(np.abs(torques["root_torso"])) < AGREED


rotation_vectors = st.tuples(
    st.lists(st.floats(-1.0, 1.0), min_size=3, max_size=3).filter(
        lambda v: np.linalg.norm(v) > 1e-3
    ),
    st.floats(0.0, radians(170.0)),
).map(lambda drawn: (drawn[1] * unit_vector(drawn[0])).tolist())


@BOTH_KINDS
@pytest.mark.parametrize("law", VECTOR_LAWS)
@given(
    vectors=st.lists(rotation_vectors, min_size=len(BALLS) + 1, max_size=len(BALLS) + 1),
    bend=st.floats(-2.6, 2.6),
)
@settings(max_examples=10)
def test_turns_about_any_axis_read_the_joined_law(law, python, vectors, bend) -> None:
    pose = {
        name: turned(PROTOTYPE.joints[name], vector)
        for name, vector in zip([*BALLS, "root_torso"], vectors, strict=True)
    }
    pose.update({name: np.array([bend]) for name in SPRINGS.joints if name not in BALLS})
    read = static_torques(PROTOTYPE, [pose], Plan(law=law, python_torques=python))
    for name, vector in zip(BALLS, vectors, strict=False):
        expected = in_parent(law, name, vector)
        assert np.max(np.abs(read[name][0] - expected)) < AGREED, name
    for name in ("left_elbow", "right_knee"):
        (spring,) = axes(name)
        expected = float(total_torque(spring.elastic, bend))
        assert abs(read[name][0] @ spring.direction - expected) < AGREED


LAWS = (Linear(12.0, 0.1), Cubic((1.0, 20.0, 5.0, 30.0), dead_zone=(-0.1, 0.3)))


def hung(made: Figure, spring: AxisSpring, name: str = "tested", **fields: object) -> Plan:
    return Plan(springs=SpringSet({name: JointSprings(name, (spring,))}), **fields)


@pytest.mark.parametrize("value", [-9.0, -0.4, 0.2, 1.1, 3.3, 8.0, 40.0])
def test_a_hinge_counts_its_turns(value) -> None:
    made = one_body(chain("Rs"))
    read = static_torques(made, [{"pin": (value,)}], hung(made, AxisSpring(SKEW, LAWS), "pin"))
    expected = float(total_torque(LAWS, value)) * np.asarray(SKEW)
    assert read["pin"][0] == pytest.approx(expected, rel=1e-11, abs=1e-9)


def test_poses_may_come_in_any_order() -> None:
    """No pose remembers the one before it."""
    made = one_body(chain("Rs"))
    plan = hung(made, AxisSpring(SKEW, LAWS), "pin")
    values = [5.0, -0.2, 12.0, 0.0, -7.0, 5.0]
    read = static_torques(made, [{"pin": (value,)} for value in values], plan)["pin"]
    alone = [static_torques(made, [{"pin": (value,)}], plan)["pin"][0] for value in values]
    assert np.allclose(read, alone, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("reverse", [False, True])
@pytest.mark.parametrize("text", ["Rs", "Rs Ra", "Rx Ry Rz"])
def test_the_torque_is_that_on_the_child_whichever_is_nearer_to_the_root(text, reverse) -> None:
    values = (0.7, -0.5, 0.4)[: len(text.split())]
    made = two_bodies(chain(text), values, reverse=reverse)
    spring = AxisSpring(SKEW, LAWS)
    r = build_chain(chain(text)).pose(values)[:3, :3]
    read = static_torques(made, [{}], hung(made, spring))
    if text == "Rs":
        expected = float(total_torque(LAWS, values[0])) * np.asarray(SKEW)
    else:
        vector = rotation_vector_from_matrix(r)
        half = matrix_from_rotation_vector(0.5 * vector)
        expected = half @ elastic_torque(SphericalLaw.CONSERVATIVE, (spring,), vector)
    assert read["tested"][0] == pytest.approx(expected, abs=1e-9)
    assert read["ball"][0] == pytest.approx(np.zeros(3), abs=1e-9)


def test_the_force_of_a_slide_is_no_torque_about_the_child() -> None:
    made = two_bodies(chain("Ts"), (0.2,))
    slide = AxisSpring(SKEW, (Linear(300.0, 0.0),))
    plan = Plan(springs=SpringSet({"tested": JointSprings("tested", (), (slide,))}))
    read = static_torques(made, [{}], plan)
    assert np.max(np.abs([*read["tested"][0], *read["ball"][0]])) < 1e-9


@pytest.mark.parametrize("angles", [(90.0, 15.0), (0.0, 60.0), (-10.0, 100.0), (20.0, 400.0)])
def test_a_law_over_two_joints_reads_its_torque_at_each(angles) -> None:
    """Riener & Edrich's leg with the ankle straight; a knee may have turned once round."""
    law = published.coupled_law("riener_edrich_1999/leg").law.hold_coordinate(
        "ankle dorsiflexion", 0.0
    )
    (knee,) = (axis.direction for axis in axes("left_knee"))
    hip = next(axis.direction for axis in axes("left_hip_joint") if axis.motion == "flexion")
    places = (CoupledAxis("left_hip_joint", hip), CoupledAxis("left_knee", knee))
    plan = Plan(springs=SpringSet(coupled=(CoupledSpring(law, places),)))
    at = np.radians(angles)
    pose = {
        "left_hip_joint": turned(PROTOTYPE.joints["left_hip_joint"], at[0] * np.asarray(hip)),
        "left_knee": at[1:],
        "waist": (0.3, 0.2, 0.1),
    }
    read = static_torques(PROTOTYPE, [pose], plan)
    expected = law.torques(at)
    assert read["left_hip_joint"][0] == pytest.approx(expected[0] * np.asarray(hip), abs=AGREED)
    assert read["left_knee"][0] == pytest.approx(expected[1] * np.asarray(knee), abs=AGREED)
    for name in ("waist", "root_torso", "right_hip_joint", "left_shoulder"):
        assert np.max(np.abs(read[name])) < AGREED


def test_gravity_loads_velocities_and_damping_are_left_out() -> None:
    link = body(
        "link", sites={"tip": Site("tip", at(shift=(0.0, 0.3, 0.2)), global_force=(50.0, 7.0, 9.0))}
    )
    made = one_body(BALL, (0.3, -0.2, 0.4), link)
    spring = AxisSpring(SKEW, LAWS, Damping(3.0, 2.0))
    plan = hung(made, spring, "pin", velocities={"pin": (1.0, 2.0, 3.0)})
    bare = one_body(BALL, (0.3, -0.2, 0.4))
    quiet = hung(bare, AxisSpring(SKEW, LAWS), "pin", gravity=(0.0, 0.0, 0.0))
    read, expected = static_torques(made, [{}], plan), static_torques(bare, [{}], quiet)
    assert np.max(np.abs(expected["pin"])) > 1.0
    assert np.allclose(read["pin"], expected["pin"], atol=1e-9)


def test_joints_that_a_pose_does_not_name_stand_as_the_plan_has_them() -> None:
    plan = Plan(displacements={"left_elbow": (1.9,)})
    read = static_torques(PROTOTYPE, [{}, {"left_elbow": (0.5,)}], plan)["left_elbow"]
    # 1.014 + 29.224 a - 6.13885 a^2 + 214.423 a^3 at 1.9 less that at 1.7 rad, resisting.
    assert read[0] == pytest.approx([0.0, -418.691992, 0.0], abs=1e-5)
    assert read[1] == pytest.approx(np.zeros(3), abs=1e-9)


@pytest.mark.parametrize(
    ("pose", "failure", "said"),
    [
        ({"left_elbw": (0.1,)}, ModelError, "no joint `left_elbw`; did you mean `left_elbow`"),
        ({"left_elbow": (0.1, 0.2)}, ModelError, "1 displacements, not 2"),
        ({"left_elbow": (float("nan"),)}, ModelError, "not finite"),
        ({"waist": (np.pi, 0.0, 0.0)}, ModelError, "waist is at 180 deg"),
    ],
)
def test_poses_that_cannot_be_read(pose, failure, said) -> None:
    with pytest.raises(failure, match=said):
        static_torques(PROTOTYPE, [pose])


def test_loops_hide_which_joint_a_torque_comes_from() -> None:
    links = [body("one"), body("two")]
    pins = [
        joint("first", "ground.base", "one.near", chain("Rz")),
        joint("second", "ground.base", "two.near", chain("Rz")),
        joint("third", "one.near", "two.near", chain("Rz")),
    ]
    made = figure([ground(), *links], pins)
    with pytest.raises(ModelError, match="the loop closed by third"):
        static_torques(made, [{}])


def test_a_freed_root_changes_no_torque() -> None:
    pose = {"waist": (0.4, 0.9, 0.2), "left_knee": (1.8,), "root_torso": (0.3, 0.2, 0.1)}
    held = static_torques(PROTOTYPE, [pose])
    loose = static_torques(PROTOTYPE, [pose], replace(Plan(), free_root=True))
    assert set(loose) == {*held, "lower_torso"} - {"root_torso"}
    for name in SPRINGS.joints:
        assert np.allclose(held[name], loose[name], atol=AGREED)


def test_props_are_ignored() -> None:
    """Also where the figure would start inside them."""
    around = Scene((Prop("solid", Plane((0.0, 9.0, 0.0), (0.0, 1.0, 0.0)), DEFAULT_SURFACE),))
    poses = [{"left_knee": np.array([2.4])}]
    found, expected = (
        static_torques(PROTOTYPE, poses, Plan(scene=scene)) for scene in (around, Scene())
    )
    assert np.any(expected["left_knee"])
    for name, torque in expected.items():
        assert found[name] == pytest.approx(torque, abs=AGREED)
