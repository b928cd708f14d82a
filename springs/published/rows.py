"""Rows of the published tables: a curve, a coupled law, a shoulder rhythm, a range of motion."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from springs.backends import Array
from springs.coupled import CoupledExponential
from springs.elastic import Elastic, Range, mirror_range
from springs.published.formulas import FORMULAS, PrintedCurve
from springs.published.reference import Reference, Sample, Sureness
from springs.published.shoulder_rhythm import BoneAngle
from springs.transformed import Transformed


def comparison_obstacle(sample: Sample, reference: Reference, range_is_measured: bool) -> str:
    """Return the reason why no joint can be compared with a curve, or ""."""
    if not sample.is_measured:
        return f"the curve is {sample}"
    if reference.sureness is Sureness.DISPUTED:
        return "code bases disagree about its numbers"
    return "" if range_is_measured else "the range in which it was measured is not known"


@dataclass(frozen=True)
class PublishedCurve:
    """A published moment-angle curve of one coordinate.

    Attributes:
        name: name within its publication.
        motion: our name of a positive angle ("hip flexion").
        formula: formula as printed; a key of `springs.published.formulas.FORMULAS`.
        printed: the numbers as printed.
        convention: the printed sense of angle and moment, in words.
        angle_sign: -1 where the printed angle grows against `motion`.
        moment_sign: -1 where the printed moment acts against `motion`.
        range_is_measured: whether the range is that of a measurement; else it is the one in which
            the curve may be used.
        held_angles: angles of other joints during the measurement [rad].
        damping: viscous damping that goes with it [N m s/rad], or None.
        reference: where it is from.
        sample: what was measured.
        deviation: standard deviations of coefficients by their printed names, in printed units.
        rms_error: root-mean-square error of the models fitted to single subjects [N m], or None.
        note: what a user should know.
    """

    name: str
    motion: str
    formula: str
    printed: PrintedCurve
    reference: Reference
    sample: Sample
    deviation: Mapping[str, float] = field(default_factory=dict[str, float])
    rms_error: float | None = None
    convention: str = ""
    angle_sign: int = 1
    moment_sign: int = 1
    range_is_measured: bool = False
    held_angles: Mapping[str, float] = field(default_factory=dict[str, float])
    damping: float | None = None
    note: str = ""

    @property
    def law(self) -> Elastic:
        """The curve as torque on the child [N m] of our angle [rad]."""
        law = FORMULAS[self.formula].build_law(self.printed)
        if self.angle_sign < 0:
            law = law.mirrored()
        return law if self.angle_sign == self.moment_sign else Transformed(law, -1.0)

    @property
    def valid_range(self) -> Range | None:
        """Range of our angle in which the curve is known to hold [rad], or None."""
        known = self.printed.valid_range
        return mirror_range(known) if self.angle_sign < 0 else known

    @property
    def obstacle(self) -> str:
        """Reason why no joint can be compared with the curve, or ""."""
        return comparison_obstacle(self.sample, self.reference, self.range_is_measured)

    @property
    def scatter_text(self) -> str:
        """The published scatter in words, or ""."""
        if self.deviation:
            return "one standard deviation of each coefficient, taken as independent"
        if self.rms_error is not None:
            return f"{self.rms_error:g} N m, error of the models fitted to single subjects"
        return ""

    def torque_band(self, angles: Array) -> tuple[Array, Array] | None:
        """Lower and upper edge of the scatter about the torque [N m], shape of `angles` [rad].

        Each coefficient is moved by its standard deviation either way, one at a time; changes of
        one sign add as squares. None without a published scatter.
        """
        torque = np.asarray(self.law.torque(angles))
        if self.rms_error is not None:
            return torque - self.rms_error, torque + self.rms_error
        if not self.deviation:
            return None
        below, above = np.zeros_like(torque), np.zeros_like(torque)
        for name, deviation in self.deviation.items():
            changes = np.array(
                [
                    self._move_coefficient(name, sign * deviation).law.torque(angles) - torque
                    for sign in (-1.0, 1.0)
                ]
            )
            below += np.minimum(changes.min(axis=0), 0.0) ** 2
            above += np.maximum(changes.max(axis=0), 0.0) ** 2
        return torque - np.sqrt(below), torque + np.sqrt(above)

    def _move_coefficient(self, name: str, change: float) -> "PublishedCurve":
        moved = {**self.printed.coefficients, name: self.printed.coefficients[name] + change}
        return replace(self, printed=replace(self.printed, coefficients=moved))


@dataclass(frozen=True)
class PublishedCoupledLaw:
    """A published law of several joints, in our senses.

    Attributes:
        name: name within its publication.
        law: torques on the children [N m] of our angles [rad].
        formula: formula as printed.
        convention: the printed senses, in words.
        reversed_coordinates: coordinates of which angle and moment are printed in the other sense.
        range_is_measured: range is measured as in `PublishedCurve`.
        reference: where it is from.
        sample: what was measured.
        note: what a user should know.
    """

    name: str
    law: CoupledExponential
    formula: str
    reference: Reference
    sample: Sample
    convention: str = ""
    reversed_coordinates: tuple[str, ...] = ()
    range_is_measured: bool = False
    note: str = ""


@dataclass(frozen=True)
class PublishedRhythm:
    """Angle of a bone of the shoulder as a function of the arm's elevation.

    Attributes:
        name: name within its publication.
        bone: what turns ("clavicle elevation").
        plane: "frontal" or "sagittal" where it holds in one plane only, or "".
        law: angle of the bone [rad] of the arm's elevation [rad].
        reference: where it is from.
        sample: what was measured.
        note: what a user should know.
    """

    name: str
    bone: str
    plane: str
    law: BoneAngle
    reference: Reference
    sample: Sample
    note: str = ""


@dataclass(frozen=True)
class MotionRange:
    """The end of a range of motion.

    Attributes:
        motion: the direction, named so that the limit is positive ("hip extension").
        limit: [rad].
        reference: where it is from.
        sample: what was measured.
        at_least: whether the source calls any greater range normal too.
        deviation: standard deviation among subjects [rad], or None.
        moment: passive moment at which the end was read [N m], or None.
        age: age of the subjects [years], or None where one value is given for all.
    """

    motion: str
    limit: float
    reference: Reference
    sample: Sample
    at_least: bool = False
    deviation: float | None = None
    moment: float | None = None
    age: float | None = None


@dataclass(frozen=True)
class Publication:
    """Rows of one publication.

    Attributes:
        name: name of its file, without the ending.
        reference: reference of the whole.
        note: what a user should know, where code bases disagree.
        curves: curves by name.
        coupled_laws: coupled laws by name.
        rhythms: rhythms by name.
        ranges: ranges in the order of the file.
    """

    name: str
    reference: Reference
    note: str
    curves: Mapping[str, PublishedCurve]
    coupled_laws: Mapping[str, PublishedCoupledLaw]
    rhythms: Mapping[str, PublishedRhythm]
    ranges: tuple[MotionRange, ...]
