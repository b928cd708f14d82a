"""Difference of two motions in a quantity."""

from dataclasses import dataclass
from enum import Enum
from math import degrees

from springs.short_repr import short_repr


class Quantity(Enum):
    """Quantity in which motions differ."""

    ANGLE = "angle"
    POSITION = "position"
    FIRST_TOUCH = "first touch"
    PEAK_FORCE = "peak force"
    ENERGY = "energy"

    @property
    def unit(self) -> str:
        """Unit of tables."""
        return _UNITS[self][0]

    @property
    def scale(self) -> float:
        """Number of these units in the SI unit."""
        return _UNITS[self][1]


_UNITS = {
    Quantity.ANGLE: ("deg", degrees(1.0)),
    Quantity.POSITION: ("cm", 100.0),
    Quantity.FIRST_TOUCH: ("s", 1.0),
    Quantity.PEAK_FORCE: ("N", 1.0),
    Quantity.ENERGY: ("J", 1.0),
}


@short_repr
@dataclass(frozen=True)
class Difference:
    """Difference of a motion from the reference in one quantity.

    Attributes:
        motion: Name of the motion.
        quantity: Kind of the quantity.
        name: Name of the joint, the part of the body, the segment or the kind of energy.
        about: Motion or axis of the joint in which the difference is largest, with "mostly" before
            it where the size is the angle of a rotation about several axes; "" for others.
        size: Difference [rad, m, s, N or J], positive where the motion has more; of angles,
            positions and energies the largest over time. None where only one of both touches.
        reference: Value of the reference, of a joint about the axis; None without a touch.
        value: Value of the motion, likewise.
        reference_time: Time of the value of the reference [s]; None likewise.
        time: Time of the value of the motion, that of the largest difference [s].
        error: Sum of the estimated errors of both runs at this time, of an angle [rad]; None where
            they are not known.
        divergence: Time from which an angle first differs by more than the threshold [s]; None
            where it does not.
        column: Name of the column of the motion's table to look at; "" without any.
    """

    motion: str
    quantity: Quantity
    name: str
    about: str
    size: float | None
    reference: float | None
    value: float | None
    reference_time: float | None
    time: float | None
    error: float | None = None
    divergence: float | None = None
    column: str = ""

    @property
    def label(self) -> str:
        """Name and axis: `left_knee flexion`."""
        return f"{self.name} {self.about}".strip()

    def cells(self) -> tuple[str, ...]:
        """Return both values, the difference, and times as texts; see `Comparison.table`.

        An angle within the estimated errors of the runs has a mark, `~`.
        """
        if self.quantity is Quantity.FIRST_TOUCH:
            both = ("never" if t is None else f"{t:.3f}" for t in (self.reference, self.value))
            return *both, "" if self.size is None else f"{self.size:+.3f}"
        scale = self.quantity.scale
        numbers = (self.reference, self.value, self.size)
        first, other, size = ("" if one is None else f"{scale * one:.1f}" for one in numbers)
        if self.size and self.error is not None and abs(self.size) <= self.error:
            size = f"~{size}"
        time = self.reference_time if self.time is None else self.time
        cells = first, other, size, "" if time is None else f"{time:.3f}"
        if self.quantity is not Quantity.ANGLE:
            return cells
        return *cells, "" if self.divergence is None else f"{self.divergence:.3f}"

    def row(self) -> dict[str, str | float | None]:
        """Return the row of tables, with angles in deg, lengths in cm and times in s."""

        def shown(number: float | None) -> float | None:
            return None if number is None else self.quantity.scale * number

        return {
            "motion": self.motion,
            "quantity": self.quantity.value,
            "name": self.name,
            "about": self.about,
            "unit": self.quantity.unit,
            "reference": shown(self.reference),
            "value": shown(self.value),
            "difference": shown(self.size),
            "reference_s": self.reference_time,
            "time_s": self.time,
            "error": shown(self.error),
            "divergence_s": self.divergence,
            "column": self.column,
        }
