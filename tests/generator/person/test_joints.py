"""The figure of a person: it closes, is its own mirror image, and moves as the prototype does."""

from dataclasses import replace
from math import degrees, radians, sin

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from generator.figure import Figure, Joint
from generator.figure_file.read import read_figure
from generator.input_files.pose import read_pose
from generator.kinematics.placement import forward_kinematics, initial_displacements
from generator.kinematics.tree import build_tree
from generator.person.body import Body, build_body
from generator.person.joints import (
    PERSON_JOINTS,
    limit_sources,
    motion_range,
    person_figure,
)
from generator.person.measures import estimate_measures
from generator.person.sources import Origin
from generator.person.stance import standing_stance
from generator.person.survey import Sex
from springs.published.range_of_motion import normal_range

TRUNK = ("lower_torso", "middle_torso", "upper_torso", "head")
LIMBS = ("upper_arm", "lower_arm", "hand", "upper_leg", "lower_leg", "foot")

MIRROR = np.diag([-1.0, 1.0, 1.0])
"""Reflection of the world in the figure's sagittal plane."""

bodies = st.builds(
    lambda sex, stature, index: build_body(estimate_measures(sex, stature, index * stature**2)),
    st.sampled_from(Sex),
    st.floats(1.45, 2.05),
    st.floats(17.0, 38.0),
)


def body(sex: Sex = Sex.MALE) -> Body:
    return build_body(estimate_measures(sex, 1.75, 75.0))


def positions(figure: Figure, **displacements: tuple[float, ...]) -> dict[str, np.ndarray]:
    """Poses of all sites in the world by `segment.site`, with some displacements."""
    tree = build_tree(figure)
    moved = initial_displacements(tree) | {n: np.array(v) for n, v in displacements.items()}
    poses = forward_kinematics(tree, moved).poses
    return {
        f"{name}.{site.name}": poses[name] @ site.pose_in_segment
        for name, segment in figure.segments.items()
        for site in segment.sites.values()
    }


def straight(figure: Figure) -> Figure:
    """The figure with all displacements zero, arms and legs straight down."""
    joints = (replace(one, displacement=(0.0,) * len(one.chain)) for one in figure.joints.values())
    return figure.with_parts(*joints)


def point(places: dict[str, np.ndarray], name: str) -> np.ndarray:
    return places[name][:3, 3]


def test_the_segments_and_joints():
    figure = person_figure(body())
    sided = [f"{side}_{name}" for name in LIMBS for side in ("left", "right")]
    assert list(figure.segments) == [*TRUNK, *sided, "body_root"]
    assert figure.ground == {"body_root"}
    counts = {name: joint.degrees_of_freedom for name, joint in figure.joints.items()}
    assert counts == {
        "root_torso": 3,
        **dict.fromkeys(("waist", "thorax"), 3),
        "neck": 6,
        **{f"{side}_{name}": 3 for side in ("left", "right") for name in ("shoulder", "hip_joint")},
        **{
            f"{side}_{name}": 2
            for side in ("left", "right")
            for name in ("elbow", "wrist", "ankle")
        },
        **dict.fromkeys(("left_knee", "right_knee"), 1),
    }
    names = [name for joint in PERSON_JOINTS for name in joint.names]
    assert ["root_torso", *names] == list(figure.joints)


@settings(max_examples=15)
@given(bodies)
def test_soles_are_on_the_ground_and_the_vertex_at_the_stature(body: Body):
    """Legs that are out lower the vertex."""
    places, hip_height = positions(person_figure(body)), standing_stance(body).hip_height(body)
    lower = body.hip_height - hip_height
    assert 0.0 < lower < 0.07 * body.hip_height
    for side in ("left", "right"):
        for site in ("distal", "heel", "sole"):
            assert point(places, f"{side}_foot.{site}")[1] == pytest.approx(0.0, abs=1e-12)
    vertex = body.measures.stature - lower
    assert point(places, "head.distal")[1] == pytest.approx(vertex, abs=1e-12)
    hips = [point(places, f"{side}_upper_leg.proximal") for side in ("left", "right")]
    assert np.allclose(np.mean(hips, axis=0), point(places, "lower_torso.proximal"), atol=1e-12)
    assert hips[0] - hips[1] == pytest.approx([body.hip_spacing, 0.0, 0.0])
    assert hips[0][1] == pytest.approx(hip_height)


@settings(max_examples=15)
@given(bodies, st.randoms(use_true_random=False))
def test_left_and_right_are_mirror_images(body: Body, random):
    figure = person_figure(body)
    signs = {"root_torso": (-1, 1, -1), **dict.fromkeys(("waist", "thorax"), (-1, -1, 1))}
    signs["neck"] = (-1, -1, 1, 1, -1, 1)
    drawn = {
        name: tuple(random.uniform(-1.0, 1.0) for _ in joint.chain)
        for name, joint in figure.joints.items()
    }
    moved, mirrored = (positions(figure, **each) for each in (drawn, mirrored_pose(drawn, signs)))
    for name, pose in moved.items():
        segment, site = name.split(".")
        if segment == "body_root" or "lateral" in site:
            continue
        other = mirrored[f"{other_side(segment)}.{site}"]
        assert np.allclose(MIRROR @ pose[:3, 3], other[:3, 3], atol=1e-12)
        across = np.diag([1.0, -1.0, 1.0])
        assert np.allclose(MIRROR @ pose[:3, :3] @ across, other[:3, :3], atol=1e-12)


def mirrored_pose(
    pose: dict[str, tuple[float, ...]], signs: dict[str, tuple[int, ...]]
) -> dict[str, tuple[float, ...]]:
    """Exchange the sides; joints of the trunk turn the other way about x and z."""
    return {
        other_side(name): tuple(
            sign * value
            for sign, value in zip(signs.get(name, (1,) * len(values)), values, strict=True)
        )
        for name, values in pose.items()
    }


def other_side(name: str) -> str:
    side, _, rest = name.partition("_")
    return {"left": f"right_{rest}", "right": f"left_{rest}"}.get(side, name)


DIRECTIONS = {
    ("waist", "lumbar flexion"): ("head.distal", (0, 0, 1)),
    ("waist", "lumbar lateral bend to the right"): ("head.distal", (-1, 0, 0)),
    ("waist", "lumbar twist to the left"): ("right_hand.distal", (0, 0, 1)),
    ("thorax", "flexion"): ("head.distal", (0, 0, 1)),
    ("thorax", "lateral bend to the right"): ("head.distal", (-1, 0, 0)),
    ("thorax", "twist to the left"): ("right_hand.distal", (0, 0, 1)),
    ("neck", "flexion"): ("head.distal", (0, 0, 1)),
    ("neck", "lateral bend to the right"): ("head.distal", (-1, 0, 0)),
    ("neck", "twist to the left"): ("head.ear", (0, 0, -1)),
    ("shoulder", "flexion"): ("left_hand.distal", (0, 0, 1)),
    ("shoulder", "abduction"): ("left_hand.distal", (1, 0, 0)),
    ("shoulder", "medial rotation"): ("left_hand.thumb", (-1, 0, 0)),
    ("elbow", "flexion"): ("left_hand.distal", (0, 0, 1)),
    ("wrist", "flexion"): ("left_hand.distal", (-1, 0, 0)),
    ("wrist", "radial deviation"): ("left_hand.distal", (0, 0, 1)),
    ("elbow", "forearm pronation"): ("left_hand.thumb", (-1, 0, 0)),
    ("hip_joint", "flexion"): ("left_foot.sole", (0, 0, 1)),
    ("hip_joint", "abduction"): ("left_foot.sole", (1, 0, 0)),
    ("hip_joint", "medial rotation"): ("left_foot.distal", (-1, 0, 0)),
    ("knee", "flexion"): ("left_foot.sole", (0, 0, -1)),
    ("ankle", "dorsiflexion"): ("left_foot.toes", (0, 1, 0)),
    ("ankle", "inversion"): ("left_foot.sole", (-1, 0, 0)),
}
"""A point of the figure, and the direction in the world to which a motion moves it."""


@pytest.mark.parametrize(("joint", "motion"), DIRECTIONS)
def test_a_positive_angle_is_the_motion_that_names_it(joint: str, motion: str):
    name, direction = DIRECTIONS[joint, motion]
    figure = with_points(straight(person_figure(body())))
    one = next(each for each in PERSON_JOINTS if each.name == joint)
    angles = [0.01 * (rotation.motion == motion) for rotation in one.rotations]
    angles += [0.0] * (len(figure.joints[one.names[0]].chain) - len(angles))
    before = positions(figure)
    after = positions(figure, **{one.names[0]: tuple(angles)})
    moved = point(after, name) - point(before, name)
    assert np.dot(moved, direction) > 0.97 * np.linalg.norm(moved) > 0.0


def with_points(figure: Figure) -> Figure:
    """Add the left ear, the tip of the left thumb, which points forward, and the left toes."""
    added = {
        "head": ("ear", (0.0, 0.08, 0.15)),
        "left_hand": ("thumb", (0.05, 0.0, 0.0)),
        "left_foot": ("toes", (0.15, 0.0, 0.0)),
    }
    for segment, (name, place) in added.items():
        part = figure.segments[segment]
        site = replace(
            part.sites["CM"], name=name, location=type(part.sites["CM"].location).at(*place)
        )
        figure = figure.with_parts(replace(part, sites={**part.sites, name: site}))
    return figure


def test_every_motion_has_a_direction_here():
    motions = {(joint.name, each.motion) for joint in PERSON_JOINTS for each in joint.rotations}
    assert motions == set(DIRECTIONS)


CARRIED_OVER = (
    *("root_torso", "waist", "left_shoulder", "right_shoulder", "left_elbow", "right_elbow"),
    *("left_hip_joint", "right_hip_joint", "left_knee", "right_knee"),
)


@pytest.mark.parametrize("name", CARRIED_OVER)
def test_joints_of_the_prototype_have_their_names_and_axes(name: str):
    figure, prototype = straight(person_figure(body())), read_figure("prototype")
    ours, theirs = figure.joints[name], prototype.joints[name]
    turn = 1 if name.endswith("elbow") else 0  # of the forearm, which the prototype lacks
    assert ours.chain[turn:] == theirs.chain
    assert set(CARRIED_OVER) == set(prototype.joints)
    assert frame_at(figure, ours) == pytest.approx(frame_at(prototype, theirs), abs=1e-12)


def frame_at(figure: Figure, joint: Joint) -> np.ndarray:
    """Axes of the frame in which a joint turns, in the world."""
    return positions(figure)[str(joint.parent)][:3, :3]


def test_a_pose_of_the_prototype_carries_over(tmp_path):
    """Angles of a pose are from straight limbs; joints that it leaves out stay in the stance."""
    file = tmp_path / "sitting.pose"
    file.write_text(
        "joint left_hip_joint { displacement = (0deg,5deg,90deg); }\n"
        "joint right_knee { displacement = (90deg); }\n"
    )
    standing, prototype = person_figure(body()), read_figure("prototype")
    figure = straight(standing)
    limbs = ("left_upper_leg", "right_lower_leg", "left_upper_arm")
    ours, theirs = (
        positions(each, **{name: tuple(row) for name, row in read_pose(file, each).items()})
        for each in (figure, prototype)
    )
    for name in limbs:
        frame = f"{name}.proximal"
        assert ours[frame][:3, :3] == pytest.approx(theirs[frame][:3, :3], abs=1e-12)
    posed = positions(standing, **{n: tuple(row) for n, row in read_pose(file, standing).items()})
    left_leg, left_arm = (f"left_{name}.proximal" for name in ("upper_leg", "upper_arm"))
    assert posed[left_leg][:3, :3] == pytest.approx(theirs[left_leg][:3, :3], abs=1e-12)
    out = posed[left_arm][:3, :3] @ [0.0, 0.0, 1.0]
    assert out[0] == pytest.approx(sin(standing_stance(body()).arms))


@pytest.mark.parametrize("sex", Sex)
def test_limits_are_the_ends_of_the_normal_ranges(sex: Sex):
    figure = person_figure(body(sex))
    for joint in PERSON_JOINTS:
        for name in joint.names:
            lower, upper = figure.joints[name].lower_limit, figure.joints[name].upper_limit
            assert lower is not None
            assert upper is not None
            ends = [motion_range(joint, rotation, sex) for rotation in joint.rotations]
            highest = [min(high.angle, radians(180.0)) for _, high in ends]
            assert list(lower)[: len(ends)] == [low.angle for low, _ in ends]
            assert list(upper)[: len(ends)] == pytest.approx(highest)
            assert all(low < 0.0 < high for low, high in zip(lower, upper, strict=True))
    assert figure.joints["root_torso"].lower_limit is None


def test_ranges_of_women_are_theirs_where_they_were_measured():
    wrist = next(joint for joint in PERSON_JOINTS if joint.name == "wrist")
    knee = next(joint for joint in PERSON_JOINTS if joint.name == "knee")
    bend = wrist.rotations[0]
    assert degrees(motion_range(wrist, bend, Sex.FEMALE)[1].angle) == pytest.approx(93.0)
    assert degrees(motion_range(wrist, bend, Sex.MALE)[1].angle) == pytest.approx(76.0)
    men = normal_range("knee", "flexion")
    assert motion_range(knee, knee.rotations[0], Sex.FEMALE) == men


@pytest.mark.parametrize("sex", Sex)
def test_every_limit_has_a_source(sex: Sex):
    sources = limit_sources(body(sex))
    rotations = sum(len(joint.rotations) for joint in PERSON_JOINTS)
    assert len(sources) == 2 * rotations
    assert len({(one.part, one.quantity, one.value > 0.0) for one in sources}) == 2 * rotations
    assert all(one.reference is not None for one in sources)
    estimates = {one.part for one in sources if one.origin is Origin.ESTIMATE}
    assert estimates == {"waist", "thorax"}
    labelled = {one.quantity for one in sources if "not measured in women" in one.rule}
    assert ("limit of knee flexion" in labelled) is (sex is Sex.FEMALE)
    assert "limit of wrist flexion" not in labelled
