"""A study: a figure and its run, what varies between the runs, and what is measured in each."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path
from typing import TypeAlias

from generator.model import Model
from generator.notebook import html_table
from generator.person.joints import Neck
from generator.person.passive_joints import HIP_DATUM
from generator.person.survey import Sex
from generator.recording import Ending
from generator.simulation.plan import Plan
from springs.short_repr import short_repr


@dataclass(frozen=True)
class PersonArguments:
    """Arguments of the person that is the figure of a study.

    Attributes:
        sex: sex of the samples from which the numbers come.
        stature: [m].
        mass: [kg].
        springs: "published", "riener", "none", or "coupled", which is "published".
        hip_datum: hip flexion of the upright person in the coordinate of its source [rad].
        neck: kind of the neck; None for that of `build_person` without a choice.
    """

    sex: Sex
    stature: float
    mass: float
    springs: str = "published"
    hip_datum: float = HIP_DATUM
    neck: Neck | None = None


@dataclass(frozen=True)
class Uniform:
    """Uniform distribution between two bounds."""

    low: float
    high: float


@dataclass(frozen=True)
class Normal:
    """Normal distribution."""

    mean: float
    sd: float


@dataclass(frozen=True)
class LogNormal:
    """Log-normal distribution.

    Attributes:
        median: median of the values.
        factor: factor by which values at one standard deviation of the logarithm differ from the
            median.
    """

    median: float
    factor: float


@dataclass(frozen=True)
class Levels:
    """Values that a parameter takes equally often."""

    values: tuple[float, ...]


Distribution: TypeAlias = Uniform | Normal | LogNormal | Levels


@short_repr
@dataclass(frozen=True)
class Parameter:
    """A quantity that varies between the runs of a study.

    Attributes:
        name: name of its column in the table of runs.
        paths: paths of the quantities that get its value, such as `springs.knee.scale`.
        distribution: distribution of its values, in the unit of the path; None where a list has
            them.
    """

    name: str
    paths: tuple[str, ...]
    distribution: Distribution | None


class DesignKind(StrEnum):
    """Rule by which the values of the parameters are chosen."""

    GRID = "grid"
    """All combinations of the values of the parameters."""
    LATIN_HYPERCUBE = "latin-hypercube"
    SOBOL = "sobol"
    """Scrambled Sobol sequence; with `[sensitivity]`, the design of Saltelli et al. 2010."""
    MORRIS = "morris"
    """Trajectories that change one parameter at a time (Morris 1991)."""
    LIST = "list"
    """Rows of a table."""


@short_repr
@dataclass(frozen=True)
class Design:
    """Choice of the values of the parameters.

    Attributes:
        kind: rule of the choice.
        runs: number of points of a Latin hypercube or Sobol sequence, and of trajectories of
            Morris; None for a grid and a list.
        seed: seed of the random numbers.
        rows: rows of a list, the values of the parameters in their order; empty otherwise.
        file: file of a list; None for another kind.
    """

    kind: DesignKind
    runs: int | None = None
    seed: int = 0
    rows: tuple[tuple[float, ...], ...] = ()
    file: Path | None = field(default=None, compare=False)


class Statistic(StrEnum):
    """Number that a measure takes from a column of a motion."""

    LAST = "last"
    LARGEST = "largest"
    SMALLEST = "smallest"
    TIME_OF_LARGEST = "time of largest"
    TIME_OF_SMALLEST = "time of smallest"
    REST = "rest"
    """Displacement in the equilibrium that the figure reaches from its start."""
    START = "start"
    """Demand of the posture at the start, held at rest."""


@dataclass(frozen=True)
class Measure:
    """A number of each run.

    Attributes:
        name: name of its column in the table of runs.
        column: title of a column of the motion's table, such as `left_knee.1 [deg]`.
        take: number that is taken from it.
    """

    name: str
    column: str
    take: Statistic


@dataclass(frozen=True)
class Sensitivity:
    """Sensitivity indices that a study asks for.

    Attributes:
        confidence: level of their intervals.
        resamples: number of bootstrap samples.
    """

    confidence: float = 0.95
    resamples: int = 1000


class RunMethod(StrEnum):
    """Method by which the runs of a study are integrated."""

    FAST = "fast"
    """Falls once, by the implicit method; other motions as by the tight one."""
    TIGHT = "tight"
    """As `simulate` does: two runs, of which the difference estimates the error."""


@short_repr
@dataclass(frozen=True)
class Study:
    """A study, with everything that its runs need.

    Attributes:
        name: name of its figure, or of its person, for reports.
        model: Figure and springs, before the parameters change them.
        plan: Plan of the runs, without springs.
        parameters: what varies, by name, in the order of the file.
        design: choice of their values.
        measures: numbers of each run, by name, in the order of the file.
        persons: arguments of the figure, where it is a person; of several, of which a parameter
            chooses one, the first is that of the model. Empty for a figure's file.
        fall: kind of fall of which each run has its own start; "" for the start of the plan.
        stops_edges: Whether persons have spheres along their limbs, at which edges of boxes stop.
        sensitivity: indices that are asked for; None without any.
        method: integration of its runs.
        text: text of its file.
    """

    name: str
    model: Model
    plan: Plan
    parameters: Mapping[str, Parameter]
    design: Design
    measures: Mapping[str, Measure]
    persons: tuple[PersonArguments, ...] = ()
    fall: str = ""
    stops_edges: bool = True
    sensitivity: Sensitivity | None = None
    method: RunMethod = RunMethod.FAST
    text: str = field(default="", compare=False, repr=False)

    @property
    def holds(self) -> bool:
        """True where a measure is of the posture at the start, held at rest."""
        return any(one.take is Statistic.START for one in self.measures.values())

    def _repr_html_(self) -> str:
        """Tables of what varies and what is measured, for notebooks."""
        varied = (
            (one.name, ", ".join(one.paths), "a list" if one.distribution is None else _words(one))
            for one in self.parameters.values()
        )
        measured = ((one.name, one.column, one.take) for one in self.measures.values())
        title = f"Study of {self.name}: {self.design.kind} design, {self.plan.stop:g} s each"
        return html_table(title, ("parameter", "path", "values"), varied) + html_table(
            "", ("measure", "column", "take"), measured
        )


def _words(parameter: Parameter) -> str:
    """Return the distribution of a parameter as the keys of a study file."""
    numbers = vars(parameter.distribution)
    return ", ".join(f"{key} {value}" for key, value in numbers.items())


WRONG_INPUT = "wrong input"
"""Outcome of a case that cannot be built."""

NO_EQUILIBRIUM = "no equilibrium"
"""Outcome of a run whose figure does not come to rest, where a measure is at rest."""

DIED = "died"
"""Outcome of a run whose process ended twice."""

PROGRAM_ERROR = "program error"
"""Outcome of a run that ended with an exception of the program."""

OUTCOMES = frozenset(
    [*(ending.value for ending in Ending), WRONG_INPUT, NO_EQUILIBRIUM, DIED, PROGRAM_ERROR]
)
"""All outcomes of runs."""


@short_repr
@dataclass(frozen=True)
class RunResult:
    """Result of one run of a study.

    Attributes:
        outcome: ending of the run, one of `OUTCOMES`.
        message: sentence about a run that is not done; "" otherwise.
        measures: measures by name; None where the run has no such number.
    """

    outcome: str
    message: str
    measures: Mapping[str, float | None]

    @property
    def succeeded(self) -> bool:
        """Return whether the run ended as planned."""
        return self.outcome == Ending.DONE.value


def failed_run(study: Study, outcome: str, message: str) -> RunResult:
    """Return the result of a run without measures."""
    return RunResult(outcome, message, dict.fromkeys(study.measures))
