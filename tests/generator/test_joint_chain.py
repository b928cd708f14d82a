"""The chain of a joint: poses from displacements and back, and chains that no joint can hold."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from generator.diagnostics import ModelError
from generator.figure import AxisKind, JointAxis
from generator.joint_chain import Chain, build_chain
from generator.rotations import matrix_from_xyz, pose_matrix
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
