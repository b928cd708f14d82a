"""Joints that a motion turns beyond their ranges.

The range of a joint is that of its limits in the figure, which of a person are the ends of the
normal range of motion; of a joint with a reach it is the boundary of this. A joint that moves
without ever leaving its range is not among the results.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from math import inf, radians

import numpy as np

from generator.contact.record import peak_of
from generator.figure import Joint
from generator.model import Model
from generator.rotations import Array
from generator.springs_file.axes import parallel_sign
from generator.units import AxisUnits
from springs import JointSprings

LEAST_ANGLE, LEAST_DISTANCE = radians(1.0), 1e-3
"""Excess below which a joint counts as within its range [rad, m]."""


@dataclass(frozen=True)
class RangeExcess:
    """Farthest place of a joint beyond its range.

    Attributes:
        joint: Name of the joint.
        motion: Positive sense of the displacement by the springs ("flexion"), or "displacement 2"
            for one that follows another; "" where they do not name it, and for a reach.
        limit: End of the range, in this sense [rad or m]; None for the boundary of a reach.
        beyond: Largest displacement beyond it, positive [rad or m].
        time: Time of this displacement [s].
        units: Units of the displacement.
        is_only: Whether the joint has no other displacement.
    """

    joint: str
    motion: str
    limit: float | None
    beyond: float
    time: float
    units: AxisUnits
    is_only: bool = False

    def __str__(self) -> str:
        """Return joint, excess, end and time: `left_knee 21 deg beyond 137.7 deg (at 0.84 s)`."""
        unit = self.units.displacement
        end = "its reach"
        if self.limit is not None:
            end = f"{round(self.units.scale * self.limit, 3) + 0.0:.4g} {unit}"
            end += f" of {self.motion}" if self.motion and not self.is_only else ""
        excess = f"{self.units.scale * self.beyond:.2g} {unit} beyond {end}"
        return f"{self.joint} {excess} (at {self.time:.3g} s)"


def range_excesses(
    model: Model,
    times: Array,
    displacements: Mapping[str, Array],
    rotation_vectors: Mapping[str, Array],
) -> tuple[RangeExcess, ...]:
    """Return the places beyond their ranges of the joints of a model, the farthest first.

    They are those of the frames, with a parabola through the farthest one and its neighbours.

    Args:
        model: Figure with springs.
        times: Times of the frames, shape (n,) [s].
        displacements: Displacements of each joint, shape (n, degrees of freedom) [rad or m].
        rotation_vectors: Rotation vectors of each joint, shape (n, 3) [rad].
    """
    found: list[RangeExcess] = []
    for name, joint in model.figure.joints.items():
        if name not in displacements:
            continue
        springs = model.springs.joints.get(name, JointSprings(name))
        if springs.reach is not None:
            vectors = rotation_vectors[name]
            depth = np.asarray(springs.reach.depth(vectors))
            time, beyond = peak_of(times, depth)
            units = joint.chain[0].units
            found.append(RangeExcess(name, "", None, beyond, time, units))
        else:
            found += _beyond_limits(joint, springs, times, displacements[name])
    return tuple(sorted(filter(_matters, found), key=lambda each: -_size(each)))


def _size(excess: RangeExcess) -> float:
    """Excess over the least one that matters."""
    return excess.beyond / (LEAST_ANGLE if excess.units.is_angle else LEAST_DISTANCE)


def _matters(excess: RangeExcess) -> bool:
    return _size(excess) >= 1.0


def _beyond_limits(
    joint: Joint, springs: JointSprings, times: Array, values: Array
) -> Iterator[RangeExcess]:
    """Yield the farthest place beyond each end of each displacement of a joint."""
    count = len(joint.chain)
    lower = joint.lower_limit or (-inf,) * count
    upper = joint.upper_limit or (inf,) * count
    for k, factor in enumerate(joint.chain):
        motion, sense = "", 1
        for spring in springs.axes if factor.units.is_angle else springs.translations:
            sign = parallel_sign(spring.direction, factor.axis)
            if sign and spring.motion:
                motion, sense = spring.motion, sign
        if not motion and k not in joint.free_places:
            motion = f"displacement {k + 1}"
        for limit, side in ((lower[k], -1.0), (upper[k], 1.0)):
            if abs(limit) < inf:
                time, beyond = peak_of(times, side * (values[:, k] - limit))
                yield RangeExcess(
                    joint.name, motion, sense * limit, beyond, time, factor.units, count == 1
                )
