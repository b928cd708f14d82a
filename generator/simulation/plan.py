"""Parameters of a run that are not part of the figure, its springs and its wall-time limit."""

import time
from collections.abc import Callable, Container, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from math import hypot, inf, isfinite, ulp
from pathlib import Path
from typing import Any, NamedTuple, cast

from generator.contact.scene import NO_SCENE, Scene, add_floor
from generator.diagnostics import ModelError, WallLimitError
from generator.drive import Drive
from generator.figure import Figure
from generator.kinematics.links import NO_LINKS, Links
from generator.loads import TimedLoad
from generator.model import Model, contact_of_figure
from generator.run_options import RUN_OPTIONS, Integrator
from generator.toml_file.rows import Number
from generator.tone import Tone
from springs import SphericalLaw, SpringSet

Vector = tuple[float, float, float]

STANDARD_GRAVITY: Vector = (0.0, -9.81, 0.0)

MAX_FRAMES = 1_000_000
"""Largest number of frames of a run that a command makes, for the memory."""

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
        tolerance: required joint-angle error [rad]; ignored with a fixed `step`. Of a fall, the
            accuracy says until when it is met.
        certify: whether to repeat a fall at finer steps until the whole motion is within the
            tolerance.
        step: fixed step [s]; None controls the step by the estimated error.
        springs: Springs of a figure that is simulated without a `Model`; None for those beside its
            file, or for its own `stiff`, `rest`, `damp` and limits.
        spring_choice: source of the springs if `springs` is None: a path, a NAME beside the
            figure's file, "none" or "printed".
        law: law of spherical joints; None uses that of the springs.
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
        tone: tone of muscles; None for a limp body.
        integrator: method of integration. The compiled one gives way to Exudyn's for a model that
            it does not support; the recording tells why.
        python_torques: whether torques are Python functions instead of expression trees.
        wall_limit: wall-time limit of the run [s].
    """

    stop: float = 1.0
    start: float = 0.0
    frame: float = 0.02
    tolerance: float = 1e-3
    certify: bool = False
    step: float | None = None
    springs: SpringSet | None = None
    spring_choice: str | Path | None = None
    law: SphericalLaw | None = None
    gravity: Vector = STANDARD_GRAVITY
    free_root: bool = False
    height: float | None = None
    scene: Scene = NO_SCENE
    self_contact: bool = False
    displacements: Mapping[str, Sequence[float]] = field(default_factory=dict[str, Sequence[float]])
    velocities: Mapping[str, Sequence[float]] = field(default_factory=dict[str, Sequence[float]])
    loads: Sequence[TimedLoad] = ()
    links: Links = NO_LINKS
    locked: Sequence[str] = ()
    drives: Mapping[str, Drive] = field(default_factory=dict[str, Drive])
    tone: Tone | None = None
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
                "springs are a SpringSet, such as read_springs(...), "
                f"not a {type(self.springs).__name__}"
            )
        if isinstance(self.scene, str | Path):
            raise ValueError("a scene is a Scene, such as read_scene(...) or Scene.floor()")
        if isinstance(self.integrator, str):
            raise ValueError(
                "the integrator is Integrator.COMPILED, IMPLICIT or EXUDYN, "
                f"not {self.integrator!r}"
            )
        if isinstance(self.locked, str):
            raise ValueError(f'locked are names of joints: ("{self.locked}",)')
        if len(self.gravity) != 3 or not all(map(isfinite, self.gravity)):
            raise ValueError(f"gravity needs three finite components, not {self.gravity}")
        own = {each.name: getattr(self, each.name) for each in fields(self)}
        for option in RUN_OPTIONS.values():
            value, default = own.get(option.field), getattr(Plan, option.field, None)
            if not isinstance(option.row, Number) or value in (None, default):
                continue
            if not isfinite(value) and option.field != "wall_limit":  # which may be infinite
                raise ValueError(f"{option.field} must be finite, not {value:g}")
            fault = option.row.fault(value)
            if fault is not None:
                raise ValueError(f"{option.field} {fault}")
        if not self.stop > self.start:
            raise ValueError(
                f"the stop time {self.stop:g} s is not after the start {self.start:g} s"
            )
        own |= {"scene": self.scene.props or None, "tolerance": None}  # which a step replaces
        settings = [key for key, value in own.items() if value is not None and value is not False]
        for key in settings:
            known = own.keys() - ({"scene"} if key == "height" else ())  # a scene frees no figure
            sentence = _contradiction(key, settings, known, str)
            if sentence:
                raise ValueError(sentence)
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
        return _opposite(self.gravity)


def _opposite(gravity: Vector) -> Vector:
    """Return the unit vector against gravity; the world's y without gravity."""
    size = hypot(*gravity)
    if size == 0.0:
        return (0.0, 1.0, 0.0)
    x, y, z = gravity
    return (-x / size, -y / size, -z / size)


def plan_fields(settings: Mapping[str, Any]) -> dict[str, Any]:
    """Return the fields of a plan for values of options by their keys; None for a wrong one.

    A floor and a scene free the figure, which starts on the props unless a height is given.

    Raises ModelError for a floor beside a scene with one.
    """
    own = {each.name for each in fields(Plan)}
    values = {
        option.field: settings[key]
        for key, option in RUN_OPTIONS.items()
        if settings.get(key) is not None and option.field in own and not option.is_text
    }
    if not settings.keys() & {"floor", "scene"}:
        return values
    scene = settings.get("scene") or NO_SCENE
    if settings.get("floor"):
        up = _opposite(values.get("gravity", STANDARD_GRAVITY))
        scene = add_floor(scene, up, settings.get("friction"))
    return {"height": 0.0, **values, "free_root": True, "scene": scene}


class OptionFault(NamedTuple):
    """A contradiction of options, with the keys of those of which one is to be changed."""

    keys: tuple[str, ...]
    sentence: str


def option_faults(
    settings: Mapping[str, Any], known: Container[str], name: Callable[[str], str]
) -> Iterator[OptionFault]:
    """Yield the contradictions of options that are given.

    A hint follows the first colon or semicolon of a sentence.

    Args:
        settings: Values of the options that are given, by their keys; None for a wrong one.
        known: Keys of the options that may be given.
        name: Name of an option for a key, in the notation of the asker.
    """
    excluded_by = {
        key: tuple(one for one in RUN_OPTIONS[key].excludes if one in settings)
        for key in settings
        if key in RUN_OPTIONS
    }
    unwanted = {other for others in excluded_by.values() for other in others}
    for key in settings:
        sentence, excluded = _contradiction(key, settings, known, name), excluded_by.get(key, ())
        # What an excluded option needs as well does not matter: it is to be left out.
        if sentence and (excluded or key not in unwanted):
            yield OptionFault(excluded[:1] or (key,), sentence)
    values = {key: value for key, value in settings.items() if value is not None}
    height = values.get("height", 0.0)
    if settings.keys() & {"floor", "fall"} and height < 0.0:
        sentence = f"at {name('height')} {height:g} the figure would start below the floor"
        yield OptionFault(("height",), f"{sentence}; 0 is on the floor")
    x, y, z = values.get("gravity", STANDARD_GRAVITY)
    if "fall" in settings and ((x, z) != (0.0, 0.0) or y > 0.0):
        sentence = f"{name('gravity')} points down with {name('fall')}"
        yield OptionFault(("gravity",), f"{sentence}: its floor is level")
    start, stop, frame = (values.get(key, getattr(Plan, key)) for key in ("start", "stop", "frame"))
    if frame > 0.0 and (stop - start) / frame > MAX_FRAMES:
        hint = f"use a longer {name('frame')} or an earlier {name('stop')}"
        yield OptionFault(("frame", "stop", "start"), f"more than {MAX_FRAMES:,} frames; {hint}")


def _contradiction(
    key: str, settings: Container[str], known: Container[str], name: Callable[[str], str]
) -> str:
    """Return which option a given one needs or excludes; "" for none."""
    option = RUN_OPTIONS.get(key)
    if option is None:
        return ""
    reason = f": {option.reason}" if option.reason else ""
    for other in option.excludes:
        if other in settings:
            return f"{name(key)} and {name(other)} exclude each other{reason}"
    needs = [one for one in option.needs if one in known]
    if not needs or any(one in settings for one in needs):
        return ""
    *others, last = map(name, needs)
    listed = f"{', '.join(others)} or {last}" if others else last
    return f"{name(key)} needs {listed}{reason}"


def resolve_model(model: Model | Figure, plan: Plan) -> tuple[Model, Plan]:
    """Return a model with the springs and the law that a plan states, and the plan without them.

    A figure gets the springs of the plan, or those of its choice, by default its own.

    Raises:
        InputError: The springs' file is missing or has errors, all of which are listed.
        ModelError: The file replaces a `stiff`, `rest` or `damp` that was changed in Python, or
            both the model and the plan have springs.
        UnknownNameError: The springs are of a joint that the figure does not have.
    """
    if isinstance(model, Figure):
        springs = plan.springs
        model = (
            Model.of(model, plan.spring_choice, plan.law)
            if springs is None
            else Model(model, springs, contact_of_figure(model))
        )
    elif plan.springs is not None or plan.spring_choice is not None:
        raise ModelError(
            "both the model and the plan have springs: leave them out of the plan, or simulate "
            "the model's figure"
        )
    if plan.law is not None:
        model = replace(model, springs=replace(model.springs, law=plan.law))
    return model, replace(plan, springs=None, spring_choice=None, law=None)


@dataclass(frozen=True)
class WallLimit:
    """Wall-time limit of a run that has begun.

    Attributes:
        seconds: the limit [s].
        deadline: `time.monotonic()` at which it is reached.
    """

    seconds: float
    deadline: float

    @classmethod
    def begin(cls, seconds: float) -> "WallLimit":
        """Return the limit of a run that begins now."""
        return cls(seconds, time.monotonic() + seconds)

    @property
    def remaining(self) -> float:
        """Return the time until the limit, negative after it [s]."""
        return self.deadline - time.monotonic()

    @property
    def is_reached(self) -> bool:
        """Return whether the limit is reached."""
        return self.remaining < 0.0

    def require_time(self, phase: str) -> None:
        """Raise WallLimitError if the limit is reached.

        Args:
            phase: Phase of the run, as a clause ("the model was built").
        """
        if self.is_reached:
            raise WallLimitError(f"the wall-time limit of {self.seconds:g} s was reached {phase}")


NO_LIMIT = WallLimit(inf, inf)
"""Limit that is never reached."""
