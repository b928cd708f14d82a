"""Paths of the quantities that a study varies, and the cases that their values make.

    springs[.JOINT[.AXIS]].scale                all torques that depend on displacements only
    springs[.JOINT[.AXIS]].damping_scale        damping and friction
    springs.JOINT[.AXIS].offset_deg             shift of the elastic curves
    springs.JOINT[.AXIS].viscous_Nms_rad        (`viscous_Ns_m` of a slide)
    springs.JOINT[.AXIS].coulomb_Nm             (`coulomb_N` of a slide)
    segments.NAME.mass | mass_scale | inertia_scale
    pose.JOINT[.k], velocity.JOINT[.k]          [deg or cm, a second]
    gravity, height, floor.friction, floor.stiffness
    person.stature | mass | DIMENSION           [m or kg]

`knee` is `left_knee` and `right_knee`, with the same anatomical change of both. An axis is the name
of its motion, such as `flexion`, or its number from 1.
"""

from collections.abc import Sequence
from dataclasses import dataclass

from generator.figure import Figure
from generator.named_mapping import UnknownNameError
from generator.simulation.plan import Plan
from generator.study.study import PersonArguments, Study


class UnknownPathError(UnknownNameError):
    """A figure has no such quantity; the message states the nearest one."""


@dataclass(frozen=True)
class Case:
    """A figure and its run.

    Attributes:
        figure: the figure.
        plan: of the run, with springs.
    """

    figure: Figure
    plan: Plan


@dataclass(frozen=True)
class ParameterPath:
    """A quantity that a study may vary.

    Attributes:
        text: as written.
        unit: of its values, such as "deg"; "" for a factor.
    """

    text: str
    unit: str

    def __str__(self) -> str:
        """As written."""
        return self.text


def parse_path(text: str, case: Case, person: PersonArguments | None = None) -> ParameterPath:
    """Return the quantity of a path. Raises UnknownPathError.

    Args:
        text: the path.
        case: its figure, springs and scene.
        person: arguments of the figure, where it is a person.
    """
    raise NotImplementedError


def nominal_value(path: ParameterPath, case: Case) -> float:
    """Value of a quantity, in the unit of its path, at which it leaves the case as it is.

    Of several quantities, that of the first.
    """
    raise NotImplementedError


def apply_values(case: Case, assignments: Sequence[tuple[ParameterPath, float]]) -> Case:
    """Return the case with values of its quantities, set one after the other.

    Raises ModelError for a value that a quantity cannot have.
    """
    raise NotImplementedError


def build_case(study: Study, values: Sequence[float]) -> Case:
    """Return the case of a study for values of its parameters, in their order.

    Raises MoverError for values that a quantity cannot have.
    """
    raise NotImplementedError
