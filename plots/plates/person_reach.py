"""The directions of an arm beside positions of people."""

from collections.abc import Iterator
from dataclasses import dataclass
from math import inf, radians

import numpy as np
from matplotlib.figure import Figure
from matplotlib.projections.polar import PolarAxes

from generator import read_figure, read_springs
from generator.joint_chain import build_chain
from generator.person.sources import load_data_file
from generator.rotations import matrix_from_rotation_vector, rotation_vector_from_matrix
from plots.canvas import BLACK, BLUE, GREY, VERMILION, LineStyle, Look, create_canvas, draw_marks
from plots.plate import Claim, comparison
from plots.plate_definition import PlateDefinition
from springs import FLOATS, Reach, ReachPoint, RotationLaw, rotation_law
from springs.backends import Array
from springs.coordinates import CoordinateLaw

POSITIONS = {
    "across the body": (124.0, 90.0, 0.0),
    "combing the hair": (55.0, 148.0, 0.0),
    "behind the back": (-69.0, 56.0, 60.0),
    "extended": (-90.0, 55.0, 0.0),
}
"""Plane, elevation and turn of the arm of eight people (Pearl et al. 1992) [deg]."""

TAILOR_SEAT = (-35.0, 40.0, 90.0)
"""Turn, abduction and flexion of the hips of a person who sits cross-legged [deg]."""

EFFORTLESS = 5.0
"""Moment that a relaxed arm takes by its weight alone: half of that of the level arm [N m]."""

EXAMINED = 20.0
"""Largest moment of an examiner at the end of a range [N m]."""

_PUBLISHED = ((0.0, 175.0), (90.0, 172.0), (-90.0, 62.0), (180.0, 35.0))
"""Directions of the boundary that are ends of the normal range [deg]."""

_STEP = 3.0
"""Spacing of the directions at which the boundary is drawn [deg]."""


@dataclass(frozen=True)
class Arm:
    """The left arm of `male50` and its mirror image.

    Attributes:
        reach: reach of the left arm.
        law: law of the left shoulder.
        mirrored: law of the right one.
        hip: law of the left hip.
        boundary: plane and elevation of the boundary, shape (n, 2) [deg].
        moments: moment of each of `POSITIONS` [N m].
    """

    reach: Reach
    law: RotationLaw
    mirrored: RotationLaw
    hip: CoordinateLaw
    boundary: Array
    moments: dict[str, float]


def raised(plane: float, elevation: float, turn: float = 0.0) -> Array:
    """Rotation vector of an arm that is turned about itself, then raised in a plane [deg]."""
    about = np.array([np.cos(radians(plane)), np.sin(radians(plane)), 0.0])
    turned = matrix_from_rotation_vector(np.array([0.0, 0.0, radians(turn)]))
    return rotation_vector_from_matrix(
        matrix_from_rotation_vector(radians(elevation) * about) @ turned
    )


def collect_arm() -> Arm:
    """Return the laws of the shoulders and of a hip of `male50`, and what is drawn."""
    figure = read_figure("male50")
    springs = read_springs(None, figure)

    def law(joint: str) -> RotationLaw:
        axes = build_chain(figure.joints[joint].chain).rotation_axes
        return rotation_law(springs.joints[joint], springs.law, axes)

    left, hip = law("left_shoulder"), law("left_hip_joint")
    reach = springs.joints["left_shoulder"].reach
    assert reach is not None
    assert isinstance(hip, CoordinateLaw)
    moments = {
        name: float(np.linalg.norm(left.torque(raised(*place), FLOATS)))
        for name, place in POSITIONS.items()
    }
    return Arm(reach, left, law("right_shoulder"), hip, _boundary(reach), moments)


def _boundary(reach: Reach) -> Array:
    """Highest elevation within the boundary in each plane [deg]."""
    elevations = np.arange(0.0, 181.0)
    found: list[tuple[float, float]] = []
    for plane in np.arange(-180.0, 180.0 + _STEP, _STEP):
        depths = reach.depth(np.array([raised(plane, elevation) for elevation in elevations]))
        outside = np.flatnonzero(depths > 0.0)
        found.append((float(plane), float(elevations[outside[0]]) if len(outside) else 180.0))
    return np.array(found)


def claims(arm: Arm) -> Iterator[Claim]:
    """Yield what the reach meets, and what positions of people cost."""
    boundary, turn = np.degrees(arm.reach.residuals)
    sentence = "The boundary meets its points: largest distance"
    yield Claim(sentence, float(boundary), "deg", at_most=6.0)
    sentence = (
        "The ends of the turn meet their ranges, Vairo's medians among them: largest distance"
    )
    yield Claim(sentence, float(turn), "deg", at_most=5.0)
    vectors = np.random.default_rng(0).uniform(-1.5, 1.5, (200, 3))
    flip = np.array([-1.0, 1.0, -1.0])
    difference = np.abs(arm.mirrored.torque(vectors * flip) - arm.law.torque(vectors) * flip).max()
    sentence = "The torque of the right arm is the mirror image of that of the left one"
    yield Claim(sentence, float(difference), "N m", at_most=1e-9)
    for name, moment in arm.moments.items():
        sentence = f"The arm {name} (Pearl et al. 1992): moment of the shoulder"
        yield comparison(sentence, moment, "N m", -inf, EFFORTLESS)
    torques = [
        abs(float(spring.elastic[0].torque(radians(angle))))
        for spring, angle in zip(arm.hip.springs, TAILOR_SEAT, strict=True)
        if spring is not None and spring.elastic
    ]
    sentence = (
        "Sitting cross-legged, hips flexed by 90, abducted by 40 and turned out by 35 deg: largest "
        "moment of a hip about turn and abduction"
    )
    yield comparison(sentence, max(torques), "N m", -inf, EXAMINED)


_LABELS = {"extended": ((0, -24), "center"), "combing the hair": ((0, -13), "center")}
"""Offset [points] and alignment of labels that would meet others."""


def _draw(arm: Arm) -> Figure:
    figure = create_canvas(4.6)
    axes = figure.add_subplot(projection="polar")
    assert isinstance(axes, PolarAxes)
    planes, elevations = arm.boundary.T
    directions, label = np.radians(planes), "boundary of the reach"
    axes.plot(directions, elevations, "-", color=BLUE, lw=1.8, label=label)
    axes.fill(directions, elevations, color=BLUE, alpha=0.08)
    for is_published, style, label in (
        (True, LineStyle(BLACK, "", "o"), "end of the normal range"),
        (False, LineStyle(GREY, "", "s"), "estimate"),
    ):
        points = [one for one in arm.reach.boundary if _is_published(one) is is_published]
        elevations = [np.degrees(point.elevation) for point in points]
        draw_marks(axes, [point.plane for point in points], elevations, style, label)
    for name, (plane, elevation, _) in POSITIONS.items():
        axes.plot(radians(plane), elevation, "x", color=VERMILION, ms=6, label="_")
        shift, side = _LABELS.get(name, ((6, 4), "left"))
        look: Look = {"textcoords": "offset points", "ha": side, "fontsize": 8}
        axes.annotate(name, (radians(plane), elevation), shift, **look)
    axes.plot([], [], "x", color=VERMILION, label="position of people")
    axes.set_rlim(0.0, 180.0)
    axes.set_rticks([45.0, 90.0, 135.0], ["45", "90", "135 deg"])
    axes.set_thetagrids(
        [0.0, 90.0, 180.0, 270.0], ["abduction", "flexion", "adduction", "extension"]
    )
    axes.tick_params(axis="x", pad=14)
    figure.legend(loc="outside upper left", ncols=4, fontsize=7.5)
    return figure


def _is_published(point: ReachPoint) -> bool:
    place = np.degrees((point.plane, point.elevation))
    return any(np.allclose(place, one, atol=0.5) for one in _PUBLISHED)


person_reach = PlateDefinition(
    name="person_reach",
    title="Where an arm can point",
    sign="Radius: elevation from the hanging arm. Angle: plane in which it is raised.",
    references=tuple(load_data_file("passive_joints").content["reach"]["reference"].split("; ")),
    collect=collect_arm,
    caption=(
        "The reach of the left arm of `male50`, seen along the hanging arm: an arm that is raised "
        "in a plane moves outwards from the middle. Beyond the boundary the torque of the shoulder "
        "drives it back; 30 deg before it a soft wall begins. Circles are ends of the normal "
        "range, squares are estimates between them; crosses are positions of eight people, which "
        "lie within. A chain of three angles has a pole in abduction by 90 deg; the "
        "reach has none."
    ),
    draw=_draw,
    claims=claims,
    tables=lambda arm: {
        "person_reach": {"plane [deg]": arm.boundary[:, 0], "elevation [deg]": arm.boundary[:, 1]}
    },
)
