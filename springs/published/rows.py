"""Rows of the published tables: a curve, a coupled law, a shoulder rhythm, a range of motion."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from springs.coupled import CoupledExponential
from springs.elastic import Elastic, Range, mirror_range
from springs.published.formulas import FORMULAS, PrintedCurve
from springs.published.reference import Reference
from springs.published.shoulder_rhythm import BoneAngle
from springs.transformed import Transformed


@dataclass(frozen=True)
class PublishedCurve:
    """A published moment-angle curve of one coordinate.

    Attributes:
        name: within its publication.
        motion: our name of a positive angle ("hip flexion").
        formula: as printed; a key of `springs.published.formulas.FORMULAS`.
        printed: the numbers as printed.
        convention: the printed sense of angle and moment, in words.
        angle_sign: -1 where the printed angle grows against `motion`.
        moment_sign: -1 where the printed moment acts against `motion`.
        range_is_measured: whether the range is that of a measurement; else it is the one in which
            the curve may be used.
        held_angles: angles of other joints during the measurement [rad].
        damping: viscous damping that goes with it [N m s/rad], or None.
        reference: where it is from.
        note: what a user should know.
    """

    name: str
    motion: str
    formula: str
    printed: PrintedCurve
    reference: Reference
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


@dataclass(frozen=True)
class PublishedCoupledLaw:
    """A published law of several joints, in our senses.

    Attributes:
        name: within its publication.
        law: torques on the children [N m] of our angles [rad].
        formula: as printed.
        convention: the printed senses, in words.
        reversed_coordinates: coordinates of which angle and moment are printed in the other sense.
        range_is_measured: as in `Curve`.
        reference: where it is from.
        note: what a user should know.
    """

    name: str
    law: CoupledExponential
    formula: str
    reference: Reference
    convention: str = ""
    reversed_coordinates: tuple[str, ...] = ()
    range_is_measured: bool = False
    note: str = ""


@dataclass(frozen=True)
class PublishedRhythm:
    """Angle of a bone of the shoulder as a function of the arm's elevation.

    Attributes:
        name: within its publication.
        bone: what turns ("clavicle elevation").
        plane: "frontal" or "sagittal" where it holds in one plane only, or "".
        law: angle of the bone [rad] of the arm's elevation [rad].
        reference: where it is from.
        note: what a user should know.
    """

    name: str
    bone: str
    plane: str
    law: BoneAngle
    reference: Reference
    note: str = ""


@dataclass(frozen=True)
class MotionRange:
    """The end of a range of motion.

    Attributes:
        motion: the direction, named so that the limit is positive ("hip extension").
        limit: [rad].
        reference: where it is from.
        at_least: whether the source calls any greater range normal too.
        deviation: standard deviation among subjects [rad], or None.
        moment: passive moment at which the end was read [N m], or None.
        age: of the subjects [years], or None where one value is given for all.
    """

    motion: str
    limit: float
    reference: Reference
    at_least: bool = False
    deviation: float | None = None
    moment: float | None = None
    age: float | None = None


@dataclass(frozen=True)
class Publication:
    """Rows of one publication.

    Attributes:
        name: of its file, without the ending.
        reference: of the whole.
        note: what a user should know, where code bases disagree.
        curves: by name.
        coupled_laws: by name.
        rhythms: by name.
        ranges: in the order of the file.
    """

    name: str
    reference: Reference
    note: str
    curves: Mapping[str, PublishedCurve]
    coupled_laws: Mapping[str, PublishedCoupledLaw]
    rhythms: Mapping[str, PublishedRhythm]
    ranges: tuple[MotionRange, ...]
