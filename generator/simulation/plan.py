"""What to simulate: everything about a run that the figure does not say.

Which springs a plan chooses for a figure.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import isfinite
from pathlib import Path

from generator.drive import Drive
from generator.figure import Figure
from generator.kinematics.links import Links
from generator.loads import TimedLoad
from generator.springs_file.read import load_springs
from springs import Joining, SpringSet

Vector = tuple[float, float, float]

STANDARD_GRAVITY: Vector = (0.0, -9.81, 0.0)

_TIME_TOLERANCE = 1e-9
"""By so much a run may go beyond a drive [s]."""


@dataclass(frozen=True)
class Plan:
    """A run, in SI units and radians.

    Attributes:
        stop: time at which the run ends [s].
        start: time at which it begins [s].
        frame: interval between recorded frames [s].
        tolerance: largest joint-angle error asked for [rad]; ignored when `step` is given.
        step: fixed step [s], or None to let the run choose by its own error estimate.
        springs: the springs to use; None takes those that belong to the figure's file, and where
            the figure has no file its own `stiff`, `rest`, `damp` and limits.
        spring_choice: how to find them when `springs` is None: a path, "none" or "printed".
        joining: how the axes of a spherical joint join; None takes the springs' own choice.
        gravity: [m/s^2], world axes.
        free_root: whether the joints to the ground are taken away.
        displacements: by joint, replacing the figure's own [rad or m].
        velocities: displacement rates by joint [rad/s or m/s]; zero where absent.
        loads: forces and moments that vary in time.
        links: turns that follow others, from the start on.
        locked: names of joints that stay at their displacement at the start.
        drives: by joint, the motion of its turns, which replaces what `displacements` say of them.
            All joints without one are simulated.
        python_torques: evaluate torques as Python functions instead of expression trees.
        wall_limit: longest time the run may take [s].
    """

    stop: float = 1.0
    start: float = 0.0
    frame: float = 0.02
    tolerance: float = 1e-3
    step: float | None = None
    springs: SpringSet | None = None
    spring_choice: str | Path | None = None
    joining: Joining | None = None
    gravity: Vector = STANDARD_GRAVITY
    free_root: bool = False
    displacements: Mapping[str, Sequence[float]] = field(default_factory=dict[str, Sequence[float]])
    velocities: Mapping[str, Sequence[float]] = field(default_factory=dict[str, Sequence[float]])
    loads: Sequence[TimedLoad] = ()
    links: Links = field(default_factory=Links)
    locked: Sequence[str] = ()
    drives: Mapping[str, Drive] = field(default_factory=dict[str, Drive])
    python_torques: bool = False
    wall_limit: float = 600.0

    def __post_init__(self) -> None:
        """Refuse what makes no run."""
        given = {"start": self.start, "stop": self.stop, "frame": self.frame}
        given.update(tolerance=self.tolerance, step=1.0 if self.step is None else self.step)
        for name, value in given.items():
            if not isfinite(value):
                raise ValueError(f"{name} must be finite, not {value:g}")
        if len(self.gravity) != 3 or not all(map(isfinite, self.gravity)):
            raise ValueError(f"gravity needs three finite components, not {self.gravity}")
        if not self.stop > self.start:
            raise ValueError(
                f"the stop time {self.stop:g} s is not after the start {self.start:g} s"
            )
        for name in ("frame", "tolerance", "wall_limit"):
            if not getattr(self, name) > 0.0:
                said = name.replace("_", " ")
                raise ValueError(f"the {said} must be positive, not {getattr(self, name):g}")
        if self.step is not None and not self.step > 0.0:
            raise ValueError(f"the step must be positive, not {self.step:g} s")
        for name, drive in self.drives.items():
            if (
                self.start < drive.start - _TIME_TOLERANCE
                or self.stop > drive.stop + _TIME_TOLERANCE
            ):
                raise ValueError(
                    f"the run goes from {self.start:g} s to {self.stop:g} s, but the drive of "
                    f"{name} only from {drive.start:g} s to {drive.stop:g} s"
                )


def resolve_springs(figure: Figure, plan: Plan) -> SpringSet:
    """The plan's own springs, else those that its choice finds beside the figure's file.

    Raises:
        InputError: the springs' file has errors, or is not there; it holds all of them.
    """
    if plan.springs is not None:
        return plan.springs
    folder, stem = (None, None) if figure.path is None else (figure.path.parent, figure.path.stem)
    loaded = load_springs(figure, folder, stem, plan.spring_choice, plan.joining)
    return loaded.require_value().springs
