"""From bodies and freedoms to a figure: nothing moves otherwise than the freedoms say."""

from math import pi

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import expm

from generator.diagnostics import Diagnostics
from generator.figure import AxisKind
from generator.inertia import MassProperties
from generator.losses import Losses
from generator.model_files.body_tree.joints import group_dofs, rotation_group
from generator.model_files.body_tree.to_figure import figure_from_tree
from generator.model_files.body_tree.tree import (
    Body,
    BodyTree,
    DegreeOfFreedom,
    merge_massless_bodies,
)
from generator.rotations import cross_matrix, matrix_from_rotation_vector, pose_matrix
from tests.generator.model_files.imported_models import placed, pose_in_model

AXES = st.sampled_from(
    [
        (1.0, 0.0, 0.0),
        (0.0, 1.0, 0.0),
        (0.0, 0.0, 1.0),
        (0.0, -1.0, 0.0),
        (0.6, 0.8, 0.0),
        (-0.8, 0.6, 0.0),
        (0.48, 0.6, 0.64),
    ]
)
KINDS = [AxisKind.ROTATION, AxisKind.ROTATION, AxisKind.TRANSLATION]
POINTS = st.sampled_from([(0.0, 0.0, 0.0), (0.1, -0.2, 0.3), (0.0, 0.0, 0.4)])
VALUES = st.floats(-pi, pi)
MJMINVAL = 1e-15
"""Mass and inertia that MuJoCo refuses for a moving body, and all below."""

VECTORS = st.tuples(*[st.floats(-1.0, 1.0)] * 3)


@st.composite
def rows(draw):
    """The freedoms of a body, with a value for each."""
    count = draw(st.integers(1, 5))
    freedoms = tuple(
        DegreeOfFreedom(
            f"q{k}",
            draw(st.sampled_from(KINDS)),
            draw(AXES),
            draw(POINTS),
            stiffness=draw(st.sampled_from([0.0, 3.0])),
        )
        for k in range(count)
    )
    return freedoms, {f"q{k}": draw(VALUES) for k in range(count)}


@st.composite
def poses(draw):
    return pose_matrix(matrix_from_rotation_vector(draw(VECTORS)), np.array(draw(VECTORS)))


def weight(turn=(0.3, -0.5, 0.7)) -> MassProperties:
    moments = np.diag([0.02, 0.03, 0.04])
    matrix = matrix_from_rotation_vector(turn)
    return MassProperties(1.5, np.array([0.1, 0.0, -0.2]), matrix @ moments @ matrix.T)


def moved(freedoms, values):
    """The pose that a row of freedoms makes, by the exponential of each screw."""
    pose = np.eye(4)
    for freedom in freedoms:
        screw = np.zeros((4, 4))
        if freedom.kind is AxisKind.ROTATION:
            screw[:3, :3] = cross_matrix(freedom.axis)
            screw[:3, 3] = -np.cross(freedom.axis, freedom.point)
        else:
            screw[:3, 3] = freedom.axis
        pose = pose @ expm(values[freedom.name] * screw)
    return pose


def imported(*bodies: Body, apart: bool = False):
    findings = Diagnostics()
    made = figure_from_tree(
        BodyTree(bodies, {}, np.eye(3)), findings, Losses("test"), separate=apart
    )
    assert made is not None, findings.entries
    return made


@given(rows(), poses(), st.booleans())
@settings(max_examples=40)
def test_a_body_moves_as_its_freedoms_say(row, pose, apart):
    freedoms, values = row
    made = imported(Body("b", None, pose, freedoms, weight()), apart=apart)
    seen = pose_in_model(placed(made, values), "b")
    np.testing.assert_allclose(seen, pose @ moved(freedoms, values), atol=1e-9)
    assert made.figure.total_mass == pytest.approx(1.5, rel=1e-12)
    at_zero, bodies = placed(made, dict.fromkeys(values, 0.0)), made.figure.bodies
    centre = sum(
        body.mass / 1.5 * pose_in_model(at_zero, name, "CM")[:3, 3] for name, body in bodies.items()
    )
    np.testing.assert_allclose(centre, (pose @ [0.1, 0.0, -0.2, 1.0])[:3], atol=1e-12)


@given(rows(), st.integers(-12, 0))
@settings(max_examples=20)
def test_mujoco_accepts_the_carriers_of_light_bodies(row, decade):
    size = 10.0**decade
    mass = MassProperties(size, np.zeros(3), np.diag([0.02, 0.03, 0.04]) * size)
    made = imported(Body("b", None, np.eye(4), row[0], mass), apart=True)
    for segment in made.figure.bodies.values():
        assert min(segment.mass, *segment.inertia) > MJMINVAL
        assert max(segment.mass, *segment.inertia) <= size


@given(rows(), rows(), poses(), poses())
@settings(max_examples=20)
def test_a_massless_body_is_a_part_of_the_next_ones_joint(first, second, one, other):
    inner = tuple(
        DegreeOfFreedom(f"p{k}", freedom.kind, freedom.axis, freedom.point)
        for k, freedom in enumerate(second[0])
    )
    values = first[1] | {f"p{k}": second[1][f"q{k}"] for k in range(len(inner))}
    made = imported(Body("link", None, one, first[0]), Body("b", "link", other, inner, weight()))
    assert "link" not in made.figure.segments
    expected = one @ moved(first[0], values) @ other @ moved(inner, values)
    np.testing.assert_allclose(pose_in_model(placed(made, values), "b"), expected, atol=1e-9)


@given(rows(), poses(), poses())
@settings(max_examples=20)
def test_a_body_that_is_fixed_becomes_a_part_of_its_parent(row, one, other):
    freedoms, values = row
    made = imported(
        Body("a", None, one, freedoms, weight()), Body("b", "a", other, (), weight((1.0, 0.2, 0.4)))
    )
    assert "b" not in made.figure.segments
    placement = placed(made, values)
    seen = pose_in_model(placement, "a", "b")
    np.testing.assert_allclose(seen, one @ moved(freedoms, values) @ other, atol=1e-9)
    whole = weight() + weight((1.0, 0.2, 0.4)).transform(other)
    segment, frame = made.figure.segments["a"], pose_in_model(placement, "a")
    centre = np.linalg.inv(frame) @ pose_in_model(placement, "a", "CM")
    np.testing.assert_allclose(centre[:3, 3], whole.centre, atol=1e-9)
    if "a_1" not in made.figure.segments:
        assert sorted(segment.inertia) == pytest.approx(
            sorted(whole.principal_inertia.moments), rel=1e-9
        )


def test_a_body_on_a_massless_one_keeps_its_name():
    hinge = DegreeOfFreedom("q", AxisKind.ROTATION, (1.0, 0.0, 0.0))
    shift = pose_matrix(np.eye(3), np.array([0.0, 0.0, -0.3]))
    made = imported(
        Body("pin", None, np.eye(4), (hinge,), joint="knee"),
        Body("shank", "pin", shift, (), weight()),
    )
    assert set(made.figure.segments) == {"world", "shank"}
    assert set(made.figure.joints) == {"knee"}
    seen = pose_in_model(placed(made, {"q": 0.7}), "shank", "pin")
    np.testing.assert_allclose(seen, moved((hinge,), {"q": 0.7}), atol=1e-12)


def test_hinges_through_one_point_make_one_joint_where_axes_are_across():
    def row(*axes, point=(0.0, 0.0, 0.0)):
        return [
            DegreeOfFreedom(f"q{k}", AxisKind.ROTATION, axis, point) for k, axis in enumerate(axes)
        ]

    x, y, z, slant = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (0.6, 0.8, 0.0)
    sizes = [
        [len(group.dofs) for group in group_dofs(hinges)]
        for hinges in (row(x, y, z), row(x, y, x), row(x, slant), row(x, y, z, x), row(z, slant))
    ]
    assert sizes == [[3], [3], [1, 1], [3, 1], [2]]
    apart = [*row(x), DegreeOfFreedom("q1", AxisKind.ROTATION, y, (0.0, 0.0, 0.1))]
    assert [len(group.dofs) for group in group_dofs(apart)] == [1, 1]
    # Points along the axes: the two lines meet all the same.
    meeting = [
        DegreeOfFreedom("a", AxisKind.ROTATION, x, (0.3, 0.0, 0.1)),
        DegreeOfFreedom("b", AxisKind.ROTATION, y, (0.0, -2.0, 0.1)),
    ]
    (group,) = group_dofs(meeting)
    assert group.centre == pytest.approx((0.0, 0.0, 0.1))


def test_a_ball_stays_whole_whatever_stands_beside_it():
    ball = [
        DegreeOfFreedom(name, AxisKind.ROTATION, axis, joint="ball", damping=1.0)
        for name, axis in (("z", (0, 0, 1.0)), ("y", (0, 1.0, 0)), ("x", (1.0, 0, 0)))
    ]
    groups = group_dofs(
        [DegreeOfFreedom("hinge", AxisKind.ROTATION, (1.0, 0, 0)), *ball], separate=True
    )
    assert [len(group.dofs) for group in groups] == [1, 3]


def test_rotations_are_one_joint_about_axes_where_all_of_them_are_across():
    def group(*axes):
        hinges = [DegreeOfFreedom(f"q{k}", AxisKind.ROTATION, axis) for k, axis in enumerate(axes)]
        slide = DegreeOfFreedom("slide", AxisKind.TRANSLATION, (0.0, 0.0, 1.0))
        return rotation_group([slide, *hinges], "joint")

    x, y, z, slant = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (0.6, 0.8, 0.0)
    for axes in ((x, y, z), (z, slant)):
        found = group(*axes)
        assert found is not None
        assert [dof.axis for dof in found.rotations] == list(axes)
        assert {dof.joint for dof in found.rotations} == {"joint"}
    for axes in ((x,), (x, slant), (x, y, x)):
        assert group(*axes) is None


def test_massless_bodies_that_branch_stay():
    hinge = DegreeOfFreedom("q", AxisKind.ROTATION, (1.0, 0.0, 0.0))
    bodies = (
        Body("fork", None, np.eye(4), (hinge,)),
        Body("a", "fork", np.eye(4), (hinge,), weight()),
        Body("b", "fork", np.eye(4), (hinge,), weight()),
    )
    kept, gone = merge_massless_bodies(BodyTree(bodies, {}, np.eye(3)))
    assert gone == ()
    assert len(kept.bodies) == 3
