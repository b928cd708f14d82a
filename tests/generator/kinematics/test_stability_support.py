"""Support of the prototype and the poses in which it tips, against calculations by hand."""

from dataclasses import replace
from functools import cache
from importlib.resources import files
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import brentq

from generator import read_figure
from generator.diagnostics import InputError, UsageError
from generator.figure import SiteRef
from generator.kinematics.centre_of_mass import segment_masses
from generator.kinematics.placement import forward_kinematics, initial_displacements
from generator.kinematics.stability import (
    HEIGHT_TOLERANCE,
    Balance,
    FixedSupport,
    LowFaces,
    patch_from_faces,
    patch_from_site,
    stability,
)
from generator.kinematics.tree import build_tree
from tests.chains import row

FIGURES = Path(str(files("figures")))
SHANKS = ("left_lower_leg", "right_lower_leg")
SOLE = 50.7
"""How far below the knee the lowest faces of a shank lie [cm], which is as high as the knee is."""

# Appendix A: mass [g], and of the centre of mass the height over the waist and how far it is in
# front of it [cm], of all that the waist carries, arms hanging down from 50 cm above it.
OVER_WAIST = np.array(
    [
        (13169.6, 33.76, 0.09),
        (2 * 2297.4, 50.0 - 13.99, -0.03),
        (2 * 1815.81, 50.0 - 33.4 - 17.51, -0.01),
    ]
)
SHANK_MOMENT = 2 * 4000.77 * 2.61
"""Moment of the shanks about the hips [g cm]; all else is right above them."""
WHOLE = 49277.98
"""[g]"""


@cache
def prototype():
    return build_tree(read_figure("prototype"))


@cache
def with_shanks_only():
    """The prototype, whose other segments have no psurf."""
    figure = prototype().figure
    bare = {name: replace(one, psurf=None) for name, one in figure.segments.items()}
    return replace(figure, segments=bare | {name: figure.segments[name] for name in SHANKS})


@cache
def shank():
    """Vertices (n, 3) [cm] and faces of the shanks' psurf, by a reading of its own."""
    points, faces, _ = (FIGURES / "ecalf.pss").read_text(encoding="ascii").split(";;")
    vertices = np.array([line.split() for line in points.strip().splitlines()], dtype=float)
    entries = [entry.split() for entry in faces.strip().removesuffix(";").split(";")]
    return vertices, [[int(number) - 1 for number in entry] for entry in entries]


def lowest_faces():
    """Numbers of the faces whose corners are all at the height of the sole."""
    vertices, faces = shank()
    return [k for k, face in enumerate(faces, 1) if np.all(vertices[face, 2] == SOLE)]


@cache
def soles():
    figure = prototype().figure
    return FixedSupport([patch_from_faces(figure, name, lowest_faces()) for name in SHANKS])


def posed(**moved):
    values = initial_displacements(prototype())
    values.update({name: np.radians(given) for name, given in moved.items()})
    return forward_kinematics(prototype(), values)


def standing(support, **moved):
    placement = posed(**moved)
    centre = segment_masses(prototype().figure).centre(placement.poses)
    return stability(centre, support.points_in_pose(placement.poses).positions)


def test_the_figure_stands_on_the_lowest_faces_of_its_shanks():
    """By hand: the centre of mass is 0.444 cm in front of the ankles, the heels 4.6 cm behind."""
    vertices, faces = shank()
    corners = vertices[[k for number in lowest_faces() for k in faces[number - 1]]]
    heel = corners[:, 0].min()
    assert heel == -4.6
    front = (SHANK_MOMENT + OVER_WAIST[:, 0] @ OVER_WAIST[:, 2]) / WHOLE
    found = standing(soles())
    assert found.balance is Balance.INSIDE
    assert found.margin == pytest.approx((front - heel) / 100.0, abs=1e-12)
    assert found.direction == pytest.approx([0.0, 0.0, -1.0], abs=1e-12)
    pivot = found.corners[list(found.pivot)]
    assert sorted(pivot[:, 0]) == pytest.approx([-0.0612, 0.0612], abs=1e-12)
    assert pivot[:, 2] == pytest.approx([-0.046, -0.046], abs=1e-12)
    assert np.ptp(found.corners[:, 0]) == pytest.approx((12.24 + np.ptp(corners[:, 1])) / 100.0)
    assert np.ptp(found.corners[:, 2]) == pytest.approx(np.ptp(corners[:, 0]) / 100.0)


def test_the_faces_on_the_ground_are_those_lowest_faces():
    points = LowFaces(prototype().figure, 0.0).points_in_pose(posed().poses)
    assert set(points.sources) == {f"{name}:{face}" for name in SHANKS for face in lowest_faces()}
    assert standing(LowFaces(prototype().figure, 0.0)).margin == standing(soles()).margin


@settings(max_examples=40)
@given(st.floats(-0.1, 1.8), st.floats(-1.0, 1.0), st.floats(-1.0, 1.0))
def test_low_faces_are_those_with_all_corners_low(height, hip, knee):
    placement = posed(left_hip_joint=(0, 0, np.degrees(hip)), left_knee=(np.degrees(knee),))
    points = LowFaces(with_shanks_only(), height).points_in_pose(placement.poses)
    vertices, faces = shank()
    pose = placement.poses["left_lower_leg"]
    heights = (vertices / 100.0 @ pose[:3, :3].T + pose[:3, 3])[:, 1]
    limit = height + HEIGHT_TOLERANCE
    expected = [f"left_lower_leg:{k}" for k, f in enumerate(faces, 1) if heights[f].max() <= limit]
    found = [name for name in points.sources if name.startswith("left_lower_leg:")]
    assert found == expected
    assert np.all(points.positions[:, 1] <= height + 2 * HEIGHT_TOLERANCE)


def tipping_angle():
    """How far back the waist bends until the centre of mass stands over the heels [rad], by hand.

    Bent by t, what the waist carries is f cos t + u sin t in front of it, and that is to bring the
    whole 4.6 cm behind the ankles.
    """
    mass, up, front = OVER_WAIST[:, 0].sum(), *(OVER_WAIST[:, 0] @ OVER_WAIST[:, 1:])
    assert mass == pytest.approx(21396.02)
    return np.arcsin((-4.6 * WHOLE - SHANK_MOMENT) / np.hypot(front, up)) - np.arctan2(front, up)


def test_bent_back_at_the_waist_the_figure_tips_over_its_heels():
    def margin(angle):
        return standing(soles(), waist=(0.0, 0.0, np.degrees(angle))).margin

    angle = tipping_angle()
    assert -30.0 < np.degrees(angle) < -20.0
    assert brentq(margin, np.radians(-60.0), 0.0, xtol=1e-14) == pytest.approx(angle, abs=1e-12)
    sweep = np.radians(np.arange(-60.0, 0.5, 0.5))
    margins = np.array([margin(bend) for bend in sweep])
    assert np.all(np.diff(margins) > 0.0)
    assert np.array_equal(margins > 0.0, sweep > angle)
    over = standing(soles(), waist=(0.0, 0.0, np.degrees(angle)))
    assert over.balance is Balance.ON_EDGE
    fallen = standing(soles(), waist=(0.0, 0.0, np.degrees(angle) - 5.0))
    assert fallen.balance is Balance.OUTSIDE
    assert fallen.direction == pytest.approx([0.0, 0.0, -1.0], abs=1e-9)
    assert fallen.corners[list(fallen.pivot)][:, 2] == pytest.approx([-0.046, -0.046])


def test_faces_cut_into_triangles_support_the_same(tmp_path):
    """Another psurf for the shanks, every face of which is a fan of triangles."""
    figure = with_shanks_only()
    points, faces, _ = (FIGURES / "ecalf.pss").read_text(encoding="ascii").split(";;")
    entries = [entry.split() for entry in faces.strip().removesuffix(";").split(";")]
    fans = [f"{e[0]} {a} {b};" for e in entries for a, b in pairwise(e[1:])]
    assert len(fans) > len(entries)
    text = "\n".join([points.strip(), ";;", *fans, ";;", ""])
    (tmp_path / "ecalf.pss").write_text(text, encoding="ascii")
    cut = replace(figure, path=tmp_path / "cut.fig")
    for height in (0.0, 0.01, 0.2):
        one, other = standing(LowFaces(figure, height)), standing(LowFaces(cut, height))
        assert other.margin == pytest.approx(one.margin, abs=1e-12)
        assert other.balance is one.balance
    assert standing(LowFaces(cut, 0.0)).area == pytest.approx(standing(soles()).area)


def test_on_one_leg_the_figure_tips_to_the_other_side():
    one = FixedSupport([patch_from_faces(prototype().figure, "left_lower_leg")])
    found = standing(one, right_hip_joint=(0.0, 0.0, 60.0), right_knee=(60.0,))
    assert found.balance is Balance.OUTSIDE
    assert found.direction[0] < -0.9


def test_sites_and_faces_support_together():
    figure = prototype().figure
    floor = patch_from_site(figure, SiteRef("body_root", "base"))
    alone = standing(FixedSupport([floor]))
    assert len(alone.corners) == 1
    assert alone.margin == pytest.approx(-np.hypot(0.00024868702, 0.00444318602), abs=1e-9)
    heels = patch_from_faces(figure, "left_lower_leg", [496])
    joined = FixedSupport([heels, floor]).points_in_pose(posed().poses)
    assert joined.sources == ("left_lower_leg:496", "body_root.base")
    assert joined.positions[-1] == pytest.approx([0.0, 0.0, 0.0], abs=1e-12)


def test_names_belong_to_their_points():
    """Patches of one segment are gathered; each point keeps its name."""
    figure, pose = prototype().figure, posed().poses
    patches = [
        patch_from_site(figure, SiteRef("left_lower_leg", "distal")),
        patch_from_site(figure, SiteRef("right_lower_leg", "distal")),
        patch_from_site(figure, SiteRef("left_lower_leg", "proximal")),
    ]
    points = FixedSupport(patches).points_in_pose(pose)
    for position, name in zip(points.positions, points.names, strict=True):
        segment, site = name.split(".")
        expected = pose[segment] @ figure.site(SiteRef(segment, site)).pose_in_segment
        assert position == pytest.approx(expected[:3, 3], abs=1e-15)


def test_nothing_is_below_the_floor():
    points = LowFaces(prototype().figure, -0.1).points_in_pose(posed().poses)
    assert points.positions.shape == (0, 3)
    assert points.sources == ()


def test_the_ground_may_have_any_normal():
    """Turned head down, the lowest faces are those of the head."""
    points = LowFaces(prototype().figure, -1.85, (0.0, -1.0, 0.0)).points_in_pose(posed().poses)
    assert {name.split(":")[0] for name in points.sources} == {"center_torso"}
    assert np.all(points.positions[:, 1] >= 1.85 - 2 * HEIGHT_TOLERANCE)


def test_what_there_is_not_cannot_support(tmp_path):
    figure = prototype().figure
    with pytest.raises(UsageError, match="did you mean `left_lower_leg`"):
        patch_from_faces(figure, "left_lower_lg")
    with pytest.raises(UsageError, match="no face 0: the psurf of `left_lower_leg` has 626"):
        patch_from_faces(figure, "left_lower_leg", [0])
    with pytest.raises(UsageError, match="no face 627"):
        patch_from_faces(figure, "left_lower_leg", [1, 627])
    with pytest.raises(UsageError, match="no site `distl`; did you mean `distal`"):
        patch_from_site(figure, SiteRef("left_lower_leg", "distl"))
    with pytest.raises(InputError, match="`body_root` has no psurf"):
        patch_from_faces(figure, "body_root")
    with pytest.raises(InputError, match="no such file"):
        LowFaces(replace(figure, path=tmp_path / "moved.fig"), 0.0)
    with pytest.raises(InputError, match="the figure has no file"):
        LowFaces(replace(figure, path=None), 0.0)
    with pytest.raises(InputError, match="no segment of the figure has a psurf"):
        LowFaces(row(2), 0.0)
