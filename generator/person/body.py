"""The body of a person: segments with their masses, and the places of the joint centres.

Frames: the origin of a limb segment is at its proximal joint, x forward, y to the right, z down
along the limb; that of a foot at the ankle, x forward along the foot, y right, z down. The parts of
the trunk and the head have theirs at the lower joint, x forward, y left, z up. Segments are named
without side: the left and the right one are equal in their own frames.
"""

from collections.abc import Mapping
from dataclasses import dataclass

from generator.figure import Vector
from generator.person.measures import Measures
from generator.person.sources import SourcedNumber

TRUNK_SEGMENTS = ("lower_torso", "middle_torso", "upper_torso", "head")
"""From the hips up."""

LIMB_SEGMENTS = ("upper_arm", "lower_arm", "hand", "upper_leg", "lower_leg", "foot")
"""Each of them on both sides, as `left_upper_arm` and `right_upper_arm`."""


@dataclass(frozen=True)
class BodySegment:
    """A rigid segment of a person.

    Attributes:
        name: without side.
        length: from its own joint to the next one [m]; of the head to the vertex, of the hand to
            the third fingertip, of the foot from heel to toe.
        mass: [kg].
        centre: of mass in the segment's frame [m].
        inertia: principal moments about the centre of mass, along the segment's axes [kg m2].
    """

    name: str
    length: float
    mass: float
    centre: Vector
    inertia: Vector


@dataclass(frozen=True)
class Body:
    """A person's body, standing upright with arms down, thumbs forward.

    Attributes:
        measures: from which it was made.
        segments: by their names without side.
        hip_spacing: distance of the hip centres [m].
        shoulder_spacing: distance of the shoulder centres [m].
        shoulder_height: of the shoulder centres above the thorax joint, in the upper torso [m].
        ankle_height: of the ankle centres above the sole [m].
        heel_distance: of the rear of the heel behind the ankle centre [m].
        sources: of the numbers above.
    """

    measures: Measures
    segments: Mapping[str, BodySegment]
    hip_spacing: float
    shoulder_spacing: float
    shoulder_height: float
    ankle_height: float
    heel_distance: float
    sources: tuple[SourcedNumber, ...] = ()
