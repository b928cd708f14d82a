"""Parameters of a run that are not part of the figure, and its choice of springs."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from math import hypot, isfinite, ulp
from pathlib import Path
from typing import cast

from generator.drive import Drive
from generator.figure import Figure
from generator.kinematics.links import Links
from generator.loads import TimedLoad
from generator.recording import Integrator
from generator.scene import Scene
from springs import Joining, SpringSet

Vector = tuple[float, float, float]

STANDARD_GRAVITY: Vector = (0.0, -9.81, 0.0)

MAX_FRAMES = 1_000_000
"""Largest number of frames of a run that a command makes, for the memory."""

MAX_HEIGHT = 1e6
"""Largest initial height that a command takes [m]; positions there are rounded to 1e-10 m."""

_TIME_TOLERANCE = 1e-9
"""Time by which a run may extend beyond a drive [s]."""

_MAX_TIME_ROUNDING = 1e-9
"""Largest rounding of the times of a run, as a share of the interval between its frames. Steps
would be of unequal lengths beyond it, and the error estimate too small."""


@dataclass(frozen=True)
class Plan:
    """A run, in SI units and radians.

    Attributes:
        stop: final time [s].
        start: initial time [s].
        frame: interval between recorded frames [s].
        tolerance: required joint-angle error [rad]; ignored with a fixed `step`.
        step: fixed step [s]; None controls the step by the estimated error.
        springs: the springs to use, such as `person.springs`; None for those that the figure brings
            along or that are beside its file, or for its own `stiff`, `rest`, `damp` and limits.
        spring_choice: source of the springs if `springs` is None: a path, a NAME beside the
            figure's file, "none" or "printed".
        joining: law that joins the axes of a spherical joint; None uses that of the springs.
        gravity: acceleration in world axes [m/s^2].
        free_root: whether the joints to the ground are removed.
        height: initial height of the lowest point of a figure with a free root, measured upwards
            from the world's origin [m]; None leaves the figure where it is. In a scene it is the
            lowest point of the contact spheres.
        scene: props that the figure may touch; without `free_root` it stays attached.
        self_contact: whether its segments touch each other as well, which needs a scene.
        displacements: initial displacements by joint, in place of the figure's own [rad or m].
        velocities: initial displacement rates by joint [rad/s or m/s]; zero for other joints. Of a
            free segment, by its name: angular velocity [rad/s] and velocity of its centre of mass
            [m/s], both along the world's axes.
        loads: time-dependent forces and moments.
        links: rotations that follow others.
        locked: names of joints that stay at their initial displacement.
        drives: prescribed rotations by joint, in place of `displacements`; other joints are
            simulated.
        integrator: method of integration. The compiled one gives way to Exudyn's for a model that
            it does not support; the recording tells why.
        python_torques: whether torques are Python functions instead of expression trees.
        wall_limit: wall-time limit of the run [s].
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
    height: float | None = None
    scene: Scene = field(default_factory=Scene)
    self_contact: bool = False
    displacements: Mapping[str, Sequence[float]] = field(default_factory=dict[str, Sequence[float]])
    velocities: Mapping[str, Sequence[float]] = field(default_factory=dict[str, Sequence[float]])
    loads: Sequence[TimedLoad] = ()
    links: Links = field(default_factory=Links)
    locked: Sequence[str] = ()
    drives: Mapping[str, Drive] = field(default_factory=dict[str, Drive])
    integrator: Integrator = Integrator.COMPILED
    python_torques: bool = False
    wall_limit: float = 600.0

    def __repr__(self) -> str:
        """The fields that differ from their defaults, in a line."""
        standard = Plan()
        changed = (
            f"{each.name}={value!r}"
            for each in fields(self)
            if (value := getattr(self, each.name)) != getattr(standard, each.name)
        )
        return f"Plan({', '.join(changed)})"

    def __post_init__(self) -> None:
        """Check the values. Raises ValueError."""
        if isinstance(self.springs, str | Path):
            raise ValueError("springs are a SpringSet; a file or a name is the spring_choice")
        if not isinstance(cast("object", self.springs), SpringSet | None):
            raise ValueError(
                "springs are a SpringSet, such as person.springs or read_springs(...), "
                f"not a {type(self.springs).__name__}"
            )
        if isinstance(self.scene, str | Path):
            raise ValueError("a scene is a Scene, such as read_scene(...) or Scene.floor()")
        if isinstance(self.integrator, str):
            raise ValueError(
                f"the integrator is Integrator.COMPILED or EXUDYN, not {self.integrator!r}"
            )
        if isinstance(self.locked, str):
            raise ValueError(f'locked are names of joints: ("{self.locked}",)')
        values = {"start": self.start, "stop": self.stop, "frame": self.frame}
        values.update(tolerance=self.tolerance, step=1.0 if self.step is None else self.step)
        for name, value in values.items():
            if not isfinite(value):
                raise ValueError(f"{name} must be finite, not {value:g}")
        if len(self.gravity) != 3 or not all(map(isfinite, self.gravity)):
            raise ValueError(f"gravity needs three finite components, not {self.gravity}")
        if not self.stop > self.start:
            raise ValueError(
                f"the stop time {self.stop:g} s is not after the start {self.start:g} s"
            )
        if self.height is not None:
            if not isfinite(self.height):
                raise ValueError(f"the height must be finite, not {self.height:g}")
            if not self.free_root:
                raise ValueError("a height needs a free root: other figures hang from the ground")
        if self.self_contact and not self.scene.props:
            raise ValueError("self-contact needs a scene: without props nothing is touched")
        for name in ("frame", "tolerance", "wall_limit"):
            if not getattr(self, name) > 0.0:
                quantity = name.replace("_", " ")
                raise ValueError(f"the {quantity} must be positive, not {getattr(self, name):g}")
        if self.step is not None and not self.step > 0.0:
            raise ValueError(f"the step must be positive, not {self.step:g} s")
        latest, interval = max(abs(self.start), abs(self.stop)), self.stop - self.start
        interval = min(interval, self.frame)
        if ulp(latest) > _MAX_TIME_ROUNDING * interval:
            raise ValueError(
                f"times near {latest:g} s are rounded to {ulp(latest):.1g} s, too coarsely for "
                f"frames of {interval:.3g} s: use longer frames, or times nearer to zero"
            )
        for name, drive in self.drives.items():
            if (
                self.start < drive.start - _TIME_TOLERANCE
                or self.stop > drive.stop + _TIME_TOLERANCE
            ):
                raise ValueError(
                    f"the run goes from {self.start:g} s to {self.stop:g} s, but the drive of "
                    f"{name} only from {drive.start:g} s to {drive.stop:g} s"
                )

    @property
    def up(self) -> Vector:
        """Unit vector against gravity; the world's y without gravity."""
        size = hypot(*self.gravity)
        if size == 0.0:
            return (0.0, 1.0, 0.0)
        x, y, z = self.gravity
        return (-x / size, -y / size, -z / size)


def resolve_springs(figure: Figure, plan: Plan) -> SpringSet:
    """Return the springs of the plan, or those of its choice for the figure.

    Raises:
        InputError: the springs' file is missing or has errors, all of which are listed.
        ModelError: the file replaces a `stiff`, `rest` or `damp` that was changed in Python.
    """
    if plan.springs is not None:
        return plan.springs
    from generator.springs_file.read import read_springs  # not needed for springs made in Python

    return read_springs(plan.spring_choice, figure, plan.joining)
