"""The chain of a joint: poses from displacements and back, and chains that no joint can hold."""

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from generator.diagnostics import ModelError
from generator.figure import AxisKind, JointAxis
from generator.joint_chain import Chain, build_chain
from generator.rotations import (
    SINGULAR_SINE,
    Array,
    matrix_from_axis_angle,
    matrix_from_xyz,
    pose_matrix,
    unit_vector,
    wrap_angle,
)
from tests.chains import SKEW, chain

GOOD = [
    "",
    "Rx",
    "R-z",
    "Rs",
    "Ts",
    "Rx R-y",
    "Rs Ra",
    "Rx Ry Rz",
    "Rz Rx Rz",
    "R-z R-x Ry",
    "Rz Tz",
    "Tz Rz",
    "Rz Tx Ty",
    "Tx Ty Rz",
    "Rx Ry Tx Ty Tz",
    "Tx Ty Tz Rx Ry",
    "Rx Ry Rz Tx Ty Tz",
    "Tx Ts Rx",
    "Tz Rz Tx",
]


@given(st.sampled_from(GOOD), st.lists(st.floats(-1.2, 1.2), min_size=6, max_size=6))
def test_displacements_of_a_pose(text, numbers) -> None:
    made = build_chain(chain(text))
    values = np.array(numbers[: len(made.joint_axes)])
    found = made.displacements(made.pose(values), values)
    # At a pole of three turns only the pose is told; elsewhere the displacements are.
    assert np.max(np.abs(made.pose(found) - made.pose(values)), initial=0.0) < 1e-7
    assert np.max(np.abs(found - values), initial=0.0) < 1e-6
    assert np.max(np.abs(made.pose_residual(made.pose(values)))) < 1e-7


class FrameByFrame:
    """Displacements of a chain, one pose after another, in the formulas of eq. 3.1-3.15.

    Attributes:
        smallest_sine: smallest sine of the middle angle outside the singular poses.
        smallest_margin: smallest difference of the distances of the two triples to the last one.
    """

    def __init__(self, made: Chain) -> None:
        self.chain = made
        self.smallest_sine, self.smallest_margin = 1.0, 1.0
        self.sines: list[float] = []

    def displacements(self, pose: Array, near: Array) -> Array:
        turns, slides = list(self.chain.rotations), list(self.chain.translations)
        result = np.zeros(len(self.chain.joint_axes))
        axes = [unit_vector(axis) for axis in self.chain.rotation_axes]
        matrix = pose[:3, :3]
        if len(axes) == 3:
            result[turns] = self.triple(axes, matrix, near[turns])
        else:
            angles: list[float] = []
            if len(axes) == 2:
                moved = matrix @ axes[0]
                sine, cosine = axes[1] @ np.cross(axes[0], moved), axes[0] @ moved
                angles.append(float(np.arctan2(sine, cosine)))
                matrix = matrix_from_axis_angle(axes[1], angles[0]).T @ matrix
            if axes:
                angles.insert(0, angle_about(axes[0], matrix))
            result[turns] = near[turns] + wrap_angle(np.array(angles) - near[turns])
        if slides:
            directions = [unit_vector(self.chain.joint_axes[k].axis) for k in slides]
            offset = pose[:3, 3]
            if not self.chain.translations_are_outer:
                for axis, angle in reversed(list(zip(axes, result[turns], strict=True))):
                    offset = matrix_from_axis_angle(axis, angle).T @ offset
            result[slides] = np.linalg.lstsq(np.array(directions).T, offset, rcond=None)[0]
        return result

    def triple(self, axes: list[Array], matrix: Array, near: Array) -> Array:
        first, middle, last = axes
        side = np.cross(last, middle)
        offset = np.arctan2(-(first @ side), first @ last)
        x, y, z = np.stack([middle, side, last]) @ matrix @ first
        sine = float(np.hypot(x, y))
        self.sines.append(sine)
        if sine < SINGULAR_SINE:
            sign, pole = (1.0, 0.0) if z > 0.0 else (-1.0, np.pi)
            turned = matrix @ matrix_from_axis_angle(middle, pole - offset).T
            rest = wrap_angle(angle_about(last, turned) - near[2] - sign * near[0])
            steps = [sign * rest / 2.0, wrap_angle(pole - offset - near[1]), rest / 2.0]
            return near + np.array(steps)
        polar, outer = np.arctan2(sine, z), np.arctan2(x, -y)
        rest = matrix_from_axis_angle(last, outer) @ matrix_from_axis_angle(middle, polar - offset)
        inner = angle_about(first, rest.T @ matrix)
        triples = [
            near + wrap_angle(np.array(triple) - near)
            for triple in (
                (inner, polar - offset, outer),
                (inner + np.pi, -polar - offset, outer + np.pi),
            )
        ]
        distances = [float(np.linalg.norm(triple - near)) for triple in triples]
        self.smallest_sine = min(self.smallest_sine, sine)
        self.smallest_margin = min(self.smallest_margin, abs(distances[0] - distances[1]))
        return triples[int(np.argmin(distances))]


def angle_about(axis: Array, matrix: Array) -> float:
    """Angle of the rotation about the axis nearest to the matrix."""
    skew = np.array(
        [matrix[2, 1] - matrix[1, 2], matrix[0, 2] - matrix[2, 0], matrix[1, 0] - matrix[0, 1]]
    )
    return float(np.arctan2(axis @ skew, np.trace(matrix) - axis @ matrix @ axis))


@given(
    st.sampled_from([text for text in GOOD if text]),
    st.lists(st.floats(-3.0, 3.0), min_size=6, max_size=6),
    st.lists(st.floats(-12.0, 12.0), min_size=6, max_size=6),
    st.sampled_from([None, 0.0, 1e-11, 1e-7, 1e-5, 1e-3]),
    st.sampled_from([np.pi / 2, -np.pi / 2, np.pi, 0.0]),
)
def test_continuous_displacements_equal_those_frame_by_frame(
    text, starts, changes, distance_from_pole, pole
) -> None:
    """Of many turns, with slides, through singular poses and past them at a small distance."""
    made = build_chain(chain(text))
    count = len(made.joint_axes)
    times = np.linspace(0.0, 1.0, 31)[:, None]
    values = np.array(starts[:count]) + np.array(changes[:count]) * times
    if distance_from_pole is not None and len(made.rotations) == 3:
        # The middle angle stays near the pole for some frames, then passes it.
        values[:, made.rotations[1]] = pole + distance_from_pole + np.maximum(times[:, 0] - 0.2, 0)
    poses, reference = made.pose(values), FrameByFrame(made)
    expected = [values[0]]
    for pose in poses:
        expected.append(reference.displacements(pose, expected[-1]))
    assume(reference.smallest_margin > 1e-6)
    assume(not any(0.1 < sine / SINGULAR_SINE < 10.0 for sine in reference.sines))
    tolerance = 1e-13 + 1e-14 / reference.smallest_sine
    found = made.continuous_displacements(poses, values[0])
    assert np.max(np.abs(found - expected[1:])) < tolerance


def test_residuals_of_many_poses_equal_those_of_each() -> None:
    made = build_chain(chain("Rz Tx"))
    values = np.linspace(0.0, 9.0, 12).reshape(6, 2)
    poses = made.pose(values) @ pose_matrix(matrix_from_xyz(0.02, 0.01, 0.0), [0.0, 0.1, 0.2])
    residuals = made.pose_residual(poses)
    assert residuals.shape == (6, 6)
    each = [made.pose_residual(pose) for pose in poses]
    assert np.allclose(residuals, each, rtol=0.0, atol=1e-14)


@pytest.mark.parametrize("text", [text for text in GOOD if text])
def test_twists_are_the_slopes_of_the_pose(text) -> None:
    made = build_chain(chain(text))
    values = np.linspace(0.3, -0.5, len(made.joint_axes))
    pose, twists = made.pose(values), made.twists(values)
    for k in range(len(values)):
        step = np.zeros(len(values))
        step[k] = 1e-6
        slope = (made.pose(values + step) - made.pose(values - step)) / 2e-6
        spin = slope[:3, :3] @ pose[:3, :3].T
        angular = np.array([spin[2, 1], spin[0, 2], spin[1, 0]])
        at_origin = slope[:3, 3] - np.cross(angular, pose[:3, 3])
        assert np.allclose(twists[k], np.concatenate([angular, at_origin]), atol=1e-8)


def test_the_first_factor_is_innermost() -> None:
    """Figure 3.4's (0, 40, 20) deg are the z-y-x angles (20, 40, 0) deg of figure 3.2."""
    matrix = build_chain(chain("Rx Ry Rz")).pose(np.radians([0.0, 40.0, 20.0]))[:3, :3]
    about_z, about_y, about_x = (
        np.arctan2(matrix[1, 0], matrix[0, 0]),
        -np.arcsin(matrix[2, 0]),
        np.arctan2(matrix[2, 1], matrix[2, 2]),
    )
    assert (about_z, about_y, about_x) == pytest.approx((0.349066, 0.698132, 0.0), abs=1e-6)


def test_slides_outside_and_inside() -> None:
    quarter = np.pi / 2
    outside, inside = build_chain(chain("Rz Tx")), build_chain(chain("Tx Rz"))
    assert np.allclose(outside.pose([quarter, 2.0])[:3, 3], [2.0, 0.0, 0.0])
    assert np.allclose(inside.pose([2.0, quarter])[:3, 3], [0.0, 2.0, 0.0])
    assert outside.translations_are_outer
    assert not inside.translations_are_outer


def test_displacements_follow_whole_turns() -> None:
    made = build_chain(chain("R-z"))
    assert made.displacements(made.pose([7.5]), [7.0]) == pytest.approx([7.5])
    assert made.displacements(made.pose([7.5])) == pytest.approx([7.5 - 2 * np.pi])


def test_the_gap_of_a_hinge_that_is_bent_and_parted() -> None:
    made = build_chain(chain("Rz"))
    pose = pose_matrix(matrix_from_xyz(0.02, 0.0, 0.0), [0.0, 0.003, 0.0])
    gap = made.pose_residual(pose)
    assert np.linalg.norm(gap[:3]) == pytest.approx(np.sin(0.02), rel=1e-6)
    assert np.linalg.norm(gap[3:]) == pytest.approx(0.003)


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("Rx Ry Rz Rx", "4 rotations"),
        ("Rx Rs", "perpendicular to the next"),
        ("Rx Rx", "perpendicular to the next"),
        ("Rx Ry Rs", "perpendicular to the next"),
        ("Tx Ty Tx", "not independent"),
        ("Tx Ty Tz Ts", "not independent"),
        ("Rx Ty Rz", "a translation is between"),
        ("Ty Rz Tx", "a translation is between"),
    ],
)
def test_chains_that_no_joint_can_hold(text, reason) -> None:
    with pytest.raises(ModelError, match=reason):
        build_chain(chain(text))


def test_a_slide_that_commutes_may_stand_anywhere() -> None:
    made = Chain((JointAxis(AxisKind.ROTATION, SKEW), JointAxis(AxisKind.TRANSLATION, SKEW)))
    other = Chain((JointAxis(AxisKind.TRANSLATION, SKEW), JointAxis(AxisKind.ROTATION, SKEW)))
    assert np.allclose(made.pose([0.4, 0.2]), other.pose([0.2, 0.4]))


@given(st.sampled_from([text for text in GOOD if text]), st.floats(0.1, 1.0))
def test_a_twist_is_the_rate_of_the_pose_of_its_axis(text, step) -> None:
    for axis in chain(text):
        ahead, behind = (Chain((axis,)).pose([sign * step]) for sign in (1.0, -1.0))
        turned, moved = 0.5 * (ahead - behind)[:3, :3], 0.5 * (ahead - behind)[:3, 3]
        angular = np.array([turned[2, 1], turned[0, 2], turned[1, 0]])
        assert angular == pytest.approx(np.sin(step) * np.array(axis.twist.angular), abs=1e-12)
        assert moved == pytest.approx(step * np.array(axis.twist.linear), abs=1e-12)


def test_an_axis_of_an_unknown_kind_is_refused_and_not_left_out() -> None:
    unknown = JointAxis(AxisKind.ROTATION, (0.0, 0.0, 1.0))
    object.__setattr__(unknown, "kind", "S")
    with pytest.raises(AssertionError, match="unreachable"):
        build_chain((unknown,))
