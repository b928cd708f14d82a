"""Options of a run: one row each, for the command, study files, live files and Python.

A new option is a row here, a field of `Plan` of the same name, and its use.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from typing import Any

from generator.toml_file.rows import Block, Choice, Flag, Integer, Number, Row, Text, Vector3
from springs import SphericalLaw

MAX_HEIGHT = 1e6
"""Largest initial height [m]; positions there are rounded to 1e-10 m."""

MAX_FRICTION = 10.0
"""Largest coefficient of friction of a surface."""

MAX_GRAVITY = 1e9
"""Largest component of gravity [m/s2]; larger ones are typing errors."""

MAX_LIVE_SIZE = 1e3
"""Largest coordinate [m], component of gravity [m/s2] and scale in a live file."""

MAX_LIVE_SEED = 2**31 - 1
"""Largest seed of a fall in a live file."""

_TYPES: Mapping[type[Row[Any]], type] = {Number: float, Flag: bool}


class Integrator(Enum):
    """Method of integration of a run."""

    COMPILED = "compiled"
    """An explicit method of order 8, with contact of order 3, on a compiled evaluation of the
    equations of the Exudyn model."""
    IMPLICIT = "implicit"
    """A linearly implicit method of order 2 on the same evaluation, in one run without an estimate
    of its error, for many falls."""
    EXUDYN = "exudyn"
    """Exudyn's implicit trapezoidal rule."""


@dataclass(frozen=True)
class RunOption:
    """An option of a run in all its notations.

    Attributes:
        row: Key and bounds of the value; a text is a file or has a form of its own.
        help: Sentence in the help of the command, with the unit and the default.
        metavar: Form of the value in the help of the command; None for that of its type.
        field: Name in Python; "" for the key.
        type: Type of the value on the command line; None for that of the row.
        in_study: Whether study files have the option.
        live: Key and bounds of the value in live files; None if they do not have it.
        varies: Whether the number is a parameter of studies.
        needs: Keys of the options of which one must be given as well; none for no condition.
        excludes: Keys of the options that must not be given as well.
        reason: Reason for either.
    """

    row: Row[Any]
    help: str
    metavar: str | None = None
    field: str = ""
    type: Any = None
    in_study: bool = True
    live: Row[Any] | None = None
    varies: bool = False
    needs: tuple[str, ...] = ()
    excludes: tuple[str, ...] = ()
    reason: str = ""

    def __post_init__(self) -> None:
        """Complete name and type."""
        object.__setattr__(self, "field", self.field or self.key)
        object.__setattr__(self, "type", self.type or _TYPES.get(type(self.row), str))

    @property
    def key(self) -> str:
        """Key in a study file."""
        return self.row.key

    @property
    def flag(self) -> str:
        """Option of the command."""
        return f"--{self.key.replace('_', '-')}"

    @property
    def is_text(self) -> bool:
        """Return whether the value has a form of its own, which its row does not check."""
        return isinstance(self.row, Text)


_IN_LIVE_BOUNDS = f"at most {MAX_LIVE_SIZE:g}"

RUN_OPTIONS: Mapping[str, RunOption] = {
    option.key: option
    for option in (
        RunOption(Number("stop", unit=" s"), "End time [s]. [default: 1]"),
        RunOption(Number("start", unit=" s"), "Start time [s]. [default: 0]"),
        RunOption(
            Number("frame", unit=" s", is_positive=True),
            "Frame interval [s]. [default: 0.02]",
            live=Number("frame_s", 1e-4, 1.0),
        ),
        RunOption(
            Number("tolerance", unit=" rad", is_positive=True),
            "Joint-angle error tolerance [rad]. [default: 1e-3]",
            live=Number("tolerance", 1e-12, 0.1),  # of a step, relative to the numbers of the state
        ),
        RunOption(
            Flag("certify"),
            "Repeat a fall at finer steps until all of it is within the tolerance.",
            needs=("floor", "scene", "fall"),
            reason="without contact a run always is repeated",
        ),
        RunOption(
            Number("step", unit=" s", is_positive=True),
            "Fixed time step [s]; disables error control.",
            excludes=("tolerance",),
            reason="a fixed step has no error control",
        ),
        RunOption(
            Text("springs"),
            "File that changes the springs of the figure (.optional: replaces them); NAME of "
            "FIGURE.NAME.springs.toml beside it; `none`; `printed`: values as printed.",
            "FILE|NAME|none|printed",
            live=Text("springs"),
        ),
        RunOption(
            Choice("law", tuple(SphericalLaw)),
            "How curves about several axes of a joint combine.",
            type=SphericalLaw,
            live=Choice("law", tuple(SphericalLaw)),
        ),
        RunOption(
            Vector3("gravity", MAX_GRAVITY, f"at most {MAX_GRAVITY:g} m/s2"),
            "Gravity [m/s^2], world axes. [default: 0,-9.81,0]",
            "X,Y,Z",
            live=Vector3("gravity_m_s2", MAX_LIVE_SIZE, _IN_LIVE_BOUNDS),
        ),
        RunOption(
            Flag("free_root"),
            "Remove the joints to the ground.",
            live=Choice("root", {"free": True, "held": False}),
        ),
        RunOption(
            Flag("floor"),
            "Free the figure over a floor.",
            live=Number("floor_height_m", -MAX_LIVE_SIZE, MAX_LIVE_SIZE),
        ),
        RunOption(
            Text("fall"),
            "Fall of a person on a floor, for 2 s.",
            "faint|push|slip|trip|stairs|bed|seat",
            live=Text("fall"),
            excludes=("scene", "friction", "pose", "set", "velocity", "spread"),
            reason="a kind of fall has its own start and props",
        ),
        RunOption(
            Number("height", -MAX_HEIGHT, MAX_HEIGHT, " m"),
            "Initial height of the lowest point [m]. [default: 0 with a floor or a scene]",
            live=Number("height_m", -MAX_LIVE_SIZE, MAX_LIVE_SIZE),
            varies=True,
            needs=("free_root", "floor", "scene", "fall"),
            reason="the figure hangs from the ground",
        ),
        RunOption(
            Number("friction", 0.0, MAX_FRICTION),
            "Friction of the floor. [default: 0.6]",
            needs=("floor",),
            reason="in a scene file each surface has its own",
        ),
        RunOption(
            Text("scene"),
            "Props, such as `step`, `seat` or `bed`; frees the figure.",
            "FILE.scene.toml|NAME",
            live=Block("scene"),
        ),
        RunOption(
            Flag("self_contact"),
            "Let segments touch each other.",
            needs=("floor", "scene", "fall"),
        ),
        RunOption(
            Text("starts"),
            "Repeat the fall from N starts: of successive seeds, or without --fall with angles "
            "that differ at random.",
            "N",
            type=int,
            in_study=False,
            needs=("floor", "scene", "fall"),
        ),
        RunOption(
            Text("spread"),
            "Standard deviation of these angles. [default: 1deg]",
            "1deg",
            in_study=False,
            needs=("starts",),
        ),
        RunOption(
            Text("seed"),
            "Seed of the random start. [default: 0]",
            type=int,
            live=Integer("seed", 0, MAX_LIVE_SEED),
            in_study=False,
            needs=("starts", "fall"),
        ),
        RunOption(
            Text("pose"),
            "Pose file, as written by `mover pose`.",
            "FILE.pose",
            type=Path,
            live=Block("pose"),
        ),
        RunOption(
            Text("set"),
            "Displacements [deg or cm].",
            "JOINT=a,b,c",
            "displacements",
            list[str],
        ),
        RunOption(
            Text("velocity"),
            "Initial velocities [deg/s or cm/s]. Of a free figure also SEGMENT=wx,wy,wz,vx,vy,vz: "
            "angular velocity [deg/s] and that of its centre of mass [m/s], world axes.",
            "JOINT=a,b,c",
            "velocities",
            list[str],
        ),
        RunOption(
            Text("scale"),
            "Factor or value of a parameter: springs.knee.scale=4, pose.left_knee=20.",
            "PATH=VALUE",
            "scales",
            list[str],
            in_study=False,
        ),
        RunOption(
            Text("loads"),
            "Time-varying forces and moments.",
            "FILE.csv",
            type=Path,
            in_study=False,
        ),
        RunOption(
            Text("links"),
            "Links between joints.",
            "LINKS.toml",
            type=Path,
            in_study=False,
        ),
        RunOption(
            Text("lock"),
            "Joint locked at its displacement.",
            "JOINT",
            "locks",
            list[str],
            in_study=False,
        ),
        RunOption(
            Text("drive"),
            "Prescribed motion of joints.",
            "MOTION|FILE.csv",
            type=Path,
            in_study=False,
        ),
        RunOption(
            Text("driven"),
            "Joint to drive from the --drive file. [default: all]",
            "JOINT",
            type=list[str],
            in_study=False,
        ),
        RunOption(
            Text("tone"),
            "Share of their strength by which muscles hold all joints, or a tone file.",
            "0.03|NAME|FILE",
        ),
        RunOption(
            Text("right"),
            "Share by which those of joints or groups (neck, trunk, arms, legs) turn their "
            "segments upright.",
            "neck,trunk=0.5",
            type=list[str],
            in_study=False,
        ),
        RunOption(
            Text("hold"),
            "Share by which muscles of joints or groups hold their angles.",
            "JOINTS=0.1",
            type=list[str],
            in_study=False,
        ),
        RunOption(
            Text("delay"),
            "Time at which tone begins to rise. [default: there from the start]",
            "0.1s",
            in_study=False,
            needs=("tone", "right", "hold", "fall"),
        ),
        RunOption(
            Text("release"),
            "Time at which tone begins to fall. [default: never]",
            "0.3s",
            in_study=False,
            needs=("tone", "right", "hold", "fall"),
        ),
        RunOption(
            Choice("integrator", tuple(Integrator)),
            "Method of integration. [default: compiled]",
            type=Integrator,
            in_study=False,
        ),
        RunOption(
            Flag("python_torques"),
            "Evaluate torques in Python: slower, same result.",
            in_study=False,
        ),
        RunOption(
            Number("wall_limit", unit=" s", is_positive=True),
            "Limit of computing time [s]. [default: 600]",
        ),
    )
}
"""All options of a run, by their keys."""

FILES_PANEL = "Files"

PANELS: Mapping[str, Sequence[str]] = {
    FILES_PANEL: (),
    "Time": ("stop", "start", "frame"),
    "Fall and contact": (
        *("fall", "seed", "starts", "spread", "floor", "height", "friction", "scene"),
        *("self_contact", "free_root"),
    ),
    "Springs": ("springs", "scale", "law"),
    "Start": ("set", "pose", "velocity"),
    "Muscle tone": ("tone", "hold", "right", "delay", "release"),
    "Forces and prescribed joints": ("gravity", "loads", "lock", "links", "drive", "driven"),
    "Accuracy and method": (
        *("tolerance", "certify", "step", "integrator", "python_torques", "wall_limit"),
    ),
}
"""Keys of the options in each section of the help, in their order."""

STUDY_OPTIONS = tuple(option for option in RUN_OPTIONS.values() if option.in_study)

LIVE_ROWS: Mapping[str, Row[Any]] = {
    option.field: option.live for option in RUN_OPTIONS.values() if option.live is not None
}
"""Keys of the start of a live file, by their names in Python."""

VARYING_OPTIONS: Mapping[str, Number] = {
    option.key: option.row
    for option in RUN_OPTIONS.values()
    if option.varies and isinstance(option.row, Number)
}
"""Numbers that are parameters of studies, by their keys."""
