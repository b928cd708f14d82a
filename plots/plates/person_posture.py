"""A person standing as people stand, and relaxed without gravity."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from math import asin, radians

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from generator import Plan, read_figure
from generator.contact.scene import Scene
from generator.figure import Figure as Body
from generator.kinematics.placement import forward_kinematics
from generator.kinematics.tree import build_tree
from generator.person.survey import Sex, survey
from generator.rotations import matrix_from_rotation_vector
from plots.canvas import (
    BLACK,
    BLUE,
    PALE,
    VERMILION,
    LineStyle,
    create_canvas,
    draw_marks,
    draw_strip,
)
from plots.figure_image import Body as Surfaces
from plots.figure_image import Poses, Strip, View, draw_moments
from plots.person_facts import person_facts
from plots.plate import Claim
from plots.plate_definition import PlateDefinition
from plots.whole_body import mass_properties
from springs.backends import Array

PERSONS = {"male50": "man", "female50": "woman"}
"""Words for the figures."""

_STYLES = {"male50": LineStyle(BLUE, "-", "D"), "female50": LineStyle(VERMILION, "--", "s")}
_LANDMARK = LineStyle(BLACK, "", "o")

RELAXED_CASES: Mapping[str, tuple[str, str | None]] = {
    "man": ("male50", None),
    "man with Riener's leg": ("male50", "riener"),
}
"""Figure and choice of springs of the relaxed persons, by words."""

_SEXES = {"male50": Sex.MALE, "female50": Sex.FEMALE}

LANDMARKS = ("ankle", "knee", "hip", "shoulder", "ear")
"""From below."""

_BELOW_KNEE = ("left_lower_leg", "right_lower_leg", "left_foot", "right_foot")

_BELOW_HIP = (*_BELOW_KNEE, "left_upper_leg", "right_upper_leg")


@dataclass(frozen=True)
class Standing:
    """A person whose landmarks are as far in front of the ankles as people's.

    Attributes:
        body: the figure.
        poses: poses of its segments; the ankles are at z = 0.
        landmarks: places in the sagittal plane, forward and up, by name [m].
    """

    body: Body
    poses: Poses
    landmarks: Mapping[str, tuple[float, float]]

    def centre_above(self, below: Sequence[str]) -> tuple[float, float]:
        """Centre of mass of all but some segments, forward and up [m]."""
        others = [name for name in self.body.bodies if name not in below]
        _, up, forward = mass_properties(self.body, self.poses, others).centre.tolist()
        return forward, up

    def centre_in_front(self, landmark: str) -> float:
        """Centre of mass of what is above the knee or the hip, in front of it [cm]."""
        below = _BELOW_KNEE if landmark == "knee" else _BELOW_HIP
        return 100.0 * (self.centre_above(below)[0] - self.landmarks[landmark][0])


@dataclass(frozen=True)
class Relaxed:
    """A person at rest without gravity; displacements of its joints in rad."""

    body: Body
    displacements: Mapping[str, Array]
    poses: Poses

    @property
    def trunk_to_thigh(self) -> float:
        """Angle between the line from hips to shoulders and the left thigh [deg]."""
        trunk = _middle(self.poses, "upper_arm") - _middle(self.poses, "upper_leg")
        thigh = (self.poses["left_lower_leg"] - self.poses["left_upper_leg"])[:3, 3]
        cosine = trunk @ thigh / np.linalg.norm(trunk) / np.linalg.norm(thigh)
        return float(np.degrees(np.arccos(cosine)))

    def angle(self, joint: str, axis: int) -> float:
        """Displacement of a joint [deg]."""
        return float(np.degrees(self.displacements[joint][axis]))


@dataclass(frozen=True)
class Postures:
    """Standing persons by name of the figure, relaxed ones by words of the case."""

    standing: Mapping[str, Standing]
    relaxed: Mapping[str, Relaxed]


_SEGMENTS = {"ankle": "foot", "knee": "lower_leg", "hip": "upper_leg", "shoulder": "upper_arm"}
"""Segments that begin at the landmarks."""


def _middle(poses: Poses, segment: str) -> Array:
    """Point between the origins of the left and the right segment."""
    return 0.5 * (poses[f"left_{segment}"] + poses[f"right_{segment}"])[:3, 3]


def stand(body: Body, ear_below_vertex: float) -> Standing:
    """Lean shank, thigh, trunk and head so that each landmark is where people have it."""
    facts = person_facts().facts
    forward = {"ankle": 0.0} | {
        name: 0.01 * facts[f"{name}_before_ankle"].value for name in LANDMARKS[1:]
    }
    tree = build_tree(body)
    upright = {name: np.zeros(joint.degrees_of_freedom) for name, joint in body.joints.items()}
    straight = forward_kinematics(tree, upright).poses
    heights = {name: _middle(straight, segment)[1] for name, segment in _SEGMENTS.items()}
    base, sites = straight["head"][1, 3], body.segments["head"].sites.values()
    vertex = max((straight["head"] @ site.pose_in_segment)[1, 3] for site in sites)
    ear_above_base = vertex - ear_below_vertex - base
    shank, thigh, trunk = (
        asin((forward[above] - forward[below]) / (heights[above] - heights[below]))
        for below, above in (("ankle", "knee"), ("knee", "hip"), ("hip", "shoulder"))
    )
    neck = forward["hip"] + np.sin(trunk) * (base - heights["hip"])
    head = asin((forward["ear"] - neck) / ear_above_base)
    for side in ("left", "right"):
        upright[f"{side}_ankle"][1] = shank
        upright[f"{side}_knee"][0] = shank - thigh
        upright[f"{side}_hip_joint"][2] = trunk - thigh
        # The arms hang.
        upright[f"{side}_shoulder"][2] = trunk
    upright["neck"][2] = head - trunk
    poses = _turn_about_ankles(forward_kinematics(tree, upright).poses, trunk)
    places = {name: _middle(poses, segment) for name, segment in _SEGMENTS.items()}
    places["ear"] = poses["head"] @ np.array([0.0, 0.0, ear_above_base, 1.0])
    landmarks = {name: (float(point[2]), float(point[1])) for name, point in places.items()}
    return Standing(body, poses, landmarks)


def _turn_about_ankles(poses: Mapping[str, Array], angle: float) -> Poses:
    """Turn a figure forward [rad], and put its ankles at z = 0, as high as they were."""
    turn, shift = np.eye(4), np.eye(4)
    turn[:3, :3] = matrix_from_rotation_vector(np.array([angle, 0.0, 0.0]))
    height = _middle(poses, "foot")[1]
    turned = {name: turn @ pose for name, pose in poses.items()}
    ankle = _middle(turned, "foot")
    shift[:3, 3] = (0.0, height - ankle[1], -ankle[2])
    return {name: shift @ pose for name, pose in turned.items()}


def relax(body: Body, springs: str | None) -> Relaxed:
    """Find the rest of a person without gravity, the pelvis fixed, with a choice of springs."""
    from generator.simulation.statics.equilibrium import find_equilibrium  # Exudyn takes its time

    plan = Plan(gravity=(0.0, 0.0, 0.0), locked=("root_torso",), spring_choice=springs)
    displacements = find_equilibrium(body, plan).displacements
    poses = forward_kinematics(build_tree(body), displacements).poses
    return Relaxed(body, displacements, poses)


def ear_below_vertex(name: str) -> float:
    """Mean distance of the ear from the top of the head of a figure's sample [m]."""
    return survey().dimensions["tragion_to_top_of_head"].fits[_SEXES[name]].mean


def find_postures() -> Postures:
    """Pose and settle the persons."""
    bodies = {name: read_figure(name) for name in PERSONS}
    return Postures(
        {name: stand(body, ear_below_vertex(name)) for name, body in bodies.items()},
        {word: relax(bodies[name], springs) for word, (name, springs) in RELAXED_CASES.items()},
    )


_REPORTED = (
    ("left_hip_joint", 2, "hip flexed"),
    ("left_hip_joint", 1, "hip abducted"),
    ("left_knee", 0, "knee flexed"),
    ("left_ankle", 1, "ankle dorsiflexed"),
    ("left_shoulder", 2, "shoulder flexed"),
    ("left_shoulder", 1, "shoulder abducted"),
    ("left_elbow", 1, "elbow flexed"),
    ("waist", 2, "waist flexed"),
    ("thorax", 2, "thorax flexed"),
    ("neck", 2, "neck flexed"),
)
"""Joint, index of its displacement, and words, of the angles that are reported."""


def _caption(made: Postures) -> str:
    relaxed = made.relaxed["man"]
    angles = ", ".join(
        f"{words} {round(relaxed.angle(joint, axis))}" for joint, axis, words in _REPORTED
    )
    return (
        "Left: the joints are set so that knee, hip, shoulder and ear are as far in front of the "
        "ankle as fifteen people had them; the centres of mass of what is above the knee and above "
        "the hip follow, and are compared. From the side the figure's own standing posture is "
        "straight: there all of them are above the ankle. The ear is taken on the axis of the "
        "head, at the survey's mean height. Right: `mover settle --gravity 0,0,0` with the pelvis "
        f"fixed, from standing. The man's angles [deg]: {angles}. Of these only the angle between "
        "trunk and thigh has a published value that was read; crews of a later flight did not "
        "share one posture [3]. Riener's leg has the springs of `--springs riener`."
    )


def _claims(made: Postures) -> Iterator[Claim]:
    facts = person_facts().facts
    for name, word in PERSONS.items():
        for landmark in ("knee", "hip"):
            fact = facts[f"centre_before_{landmark}"]
            yield fact.compare(
                f"Standing {word}: centre of mass of what is above the {landmark}, in front of it "
                f"(published: {fact.value_text})",
                made.standing[name].centre_in_front(landmark),
            )
    fact = facts["trunk_to_thigh"]
    for word, relaxed in made.relaxed.items():
        yield fact.compare(
            f"Relaxed {word}, without gravity: angle between trunk and thigh (published: "
            f"{fact.value_text})",
            relaxed.trunk_to_thigh,
            remark="the passive torque of the hip vanishes nearer to standing; crew members "
            "differed from each other by as much",
        )


_STANDING_STRIP = Strip(
    View(turn=radians(-90.0), tilt=0.0),
    spacing=1.0,
    left=-0.35,
    right=0.4,
    bottom=-0.05,
    top=1.85,
    floor=None,
)

_RELAXED_STRIP = replace(
    _STANDING_STRIP, view=View(turn=radians(-60.0), tilt=radians(8.0)), left=-0.5, right=0.85
)


def _draw(made: Postures) -> Figure:
    figure = create_canvas(5.2)
    grid = figure.add_gridspec(1, 3, width_ratios=(0.75, 1.0, 2.4))
    _draw_standing(figure.add_subplot(grid[0, 0]), made.standing["male50"])
    _draw_offsets(figure.add_subplot(grid[0, 1]), made)
    _draw_relaxed(figure.add_subplot(grid[0, 2]), made)
    return figure


def _draw_standing(axes: Axes, standing: Standing) -> None:
    surfaces = Surfaces.of_figure(standing.body)
    draw_strip(axes, _STANDING_STRIP, surfaces, [standing.poses])
    axes.axvline(0.0, color=BLACK, lw=0.8, ls=":")
    for forward, up in standing.landmarks.values():
        draw_marks(axes, [forward], [up], _LANDMARK, size=4.5)
    for below in (_BELOW_KNEE, _BELOW_HIP):
        forward, up = standing.centre_above(below)
        axes.plot([forward], [up], "D", color=BLACK, ms=4.0)
    axes.set_title("man, standing")


def _draw_offsets(axes: Axes, made: Postures) -> None:
    """Places of the landmarks and centres of mass, in front of the ankle."""
    facts = person_facts().facts
    man = made.standing["male50"]
    axes.axvline(0.0, color=BLACK, lw=0.8, ls=":")
    for name in LANDMARKS[1:]:
        fact, height = facts[f"{name}_before_ankle"], man.landmarks[name][1]
        axes.plot([fact.low, fact.high], [height, height], color=BLACK, lw=1.0)
        draw_marks(axes, [fact.value], [height], _LANDMARK, size=4.5)
        axes.text(fact.high + 0.3, height, name, va="center", fontsize=7.5)
    for landmark, below in (("knee", _BELOW_KNEE), ("hip", _BELOW_HIP)):
        fact, start = facts[f"centre_before_{landmark}"], 100.0 * man.landmarks[landmark][0]
        height = man.centre_above(below)[1]
        low, high = start + fact.low, start + fact.high
        axes.fill_betweenx([height - 0.025, height + 0.025], low, high, color=PALE, lw=0.0)
        axes.text(high + 0.3, height, f"all above\nthe {landmark}", va="center", fontsize=7.5)
        for name, style in _STYLES.items():
            standing = made.standing[name]
            label = PERSONS[name] if landmark == "knee" else "_"
            at = start + standing.centre_in_front(landmark)
            draw_marks(axes, [at], [height], style, label)
    axes.set(xlim=(-1.0, 12.0), xlabel="in front of the ankle [cm]")
    axes.set(ylim=(_STANDING_STRIP.bottom, _STANDING_STRIP.top), ylabel="height [m]")
    axes.legend(loc="lower right", fontsize=7.0)


def _draw_relaxed(axes: Axes, made: Postures) -> None:
    axes.set_axis_off()
    strip = _RELAXED_STRIP
    width, height = strip.width(1), strip.top - strip.bottom
    for place, (word, relaxed) in enumerate(made.relaxed.items()):
        image = draw_moments(Surfaces.of_figure(relaxed.body), [relaxed.poses], strip, Scene())
        left = place * width
        axes.imshow(image, extent=(left, left + width, 0.0, height), interpolation="none")
        text = f"{word}\ntrunk to thigh {relaxed.trunk_to_thigh:.0f} deg"
        axes.text(left + 0.5 * width, 0.0, text, ha="center", va="top", fontsize=7.0)
    axes.set(xlim=(0.0, len(made.relaxed) * width), ylim=(-0.15, height))
    axes.set_title("relaxed without gravity")


def _tables(made: Postures) -> dict[str, Mapping[str, Array]]:
    return {
        "standing": {
            f"{word}: {quantity} [m]": np.array(
                [made.standing[person].landmarks[name][axis] for name in LANDMARKS]
            )
            for person, word in PERSONS.items()
            for axis, quantity in enumerate(("forward of the ankle", "height"))
        },
        "relaxed": {
            f"{word}: {words} [deg]": np.array([relaxed.angle(joint, axis)])
            for word, relaxed in made.relaxed.items()
            for joint, axis, words in _REPORTED
        },
    }


person_posture = PlateDefinition(
    name="person_posture",
    title="A person standing, and relaxed without gravity",
    sign="Distances are forward of the ankles; angles are zero standing upright, arms down.",
    references=person_facts().references("woodhull_1985", "neutral_posture", "mount_2003"),
    collect=find_postures,
    caption=_caption,
    draw=_draw,
    claims=_claims,
    tables=_tables,
)
