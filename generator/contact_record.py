"""Contact of a run with the props of its scene: forces, impacts and rest; `docs/contact.md`."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

from generator.figure import Vector
from generator.named_mapping import NamedMapping
from generator.rotations import Array


@dataclass(frozen=True)
class SegmentContact:
    """Contact of a segment over all steps of a run, not its frames only.

    Attributes:
        first_time: first touch [s]; None if it never touched.
        impact_speed: normal speed of the sphere that touched first, at that moment [m/s].
        peak_force: largest size of the force on the segment [N].
        peak_time: its time [s].
        impulse: integral of the force on the segment, world axes [N s].
    """

    first_time: float | None
    impact_speed: float
    peak_force: float
    peak_time: float
    impulse: Vector


class Overlap(NamedTuple):
    """Interpenetration of two segments that no joint connects.

    Attributes:
        depth: [m].
        segment: one segment.
        other: the other.
        time: [s].
    """

    depth: float
    segment: str
    other: str
    time: float


@dataclass(frozen=True, eq=False)
class ContactRecord:
    """Contact of a run of n frames; forces in world axes.

    Attributes:
        forces: on each segment with contact spheres, shape (n, 3) [N].
        ground_reaction: total force and its moment about the world's origin, shape (n, 6)
            [N, N m].
        depths: deepest penetration of each segment, zero where it touches nothing, shape (n,) [m].
        segments: contact of each segment over all steps.
        max_force: largest total force over all steps [N].
        max_force_time: its time [s].
        max_depth: deepest penetration over all steps [m].
        max_depth_segment: its segment.
        weight_carried: mean vertical force of the last 0.2 s over the weight; None without gravity.
        creep: mean horizontal speed of the centre of mass in the last 0.2 s [m/s].
        dissipated: energy lost in contact damping and friction [J].
        sensitivity: largest difference of the joint angles, of each frame, from a run whose start
            differs by 0.001 rad, shape (n,) [rad]; None if it was not computed.
        overlap: deepest interpenetration of segments that no joint connects; None without any.
    """

    forces: Mapping[str, Array]
    ground_reaction: Array
    depths: Mapping[str, Array]
    segments: Mapping[str, SegmentContact]
    max_force: float
    max_force_time: float
    max_depth: float
    max_depth_segment: str
    weight_carried: float | None
    creep: float
    dissipated: float
    sensitivity: Array | None = None
    overlap: Overlap | None = None

    def __post_init__(self) -> None:
        """Give the mappings errors that state the nearest name."""
        for name in ("forces", "depths", "segments"):
            subject = "the record has no contact of segment"
            object.__setattr__(self, name, NamedMapping(getattr(self, name), subject))
