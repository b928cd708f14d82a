"""Falls of the free prototype on a floor, from ten starts, beside MuJoCo with its own contact.

Run with `python -m benchmarks falls` (15 minutes). After the first impacts two models of contact
have two trajectories, so what is compared is the distribution over the starts of numbers of each
fall. MuJoCo has the springs of the prototype by its callback, and contact of its own: convex hulls
of the psurfs at two stiffnesses, and the contact spheres of this program. Drake has the springs as
generalized forces, and its point contact of these spheres. No limb touches another.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from math import nan
from typing import TYPE_CHECKING

import numpy as np

from benchmarks import tables
from benchmarks.engines import exudyn_engine
from benchmarks.outside import Landing
from benchmarks.passive_law import CurveLaw
from benchmarks.tree import GRAVITY, TreeModel, tree_model
from generator.contact.scene import Scene, floor_prop
from generator.contact.spheres import fit_contact_spheres
from generator.figure import Figure
from generator.figure_file import read_figure
from generator.geometry.read import read_segment_surface
from generator.rotations import Array
from generator.simulation.plan import Plan
from springs.contact import DEFAULT_SURFACE, Surface

if TYPE_CHECKING:
    from benchmarks.engines.mujoco_engine import Floor

COMMAND = "python -m benchmarks falls"

STOP = 3.0
"""Of every fall [s]."""

STARTS = 10

SPREAD = 0.05
"""Standard deviation of each joint angle of the starts [rad]."""

OWN_FRAME = 1e-3
"""Frames at which forces of this program are read; its steps on the floor are about as long [s]."""

MUJOCO_STEP = 5e-4
DRAKE_STEP = 1e-3
"""Steps of the engines [s]."""

STIFFER = 1e5
"""Stiffness of a second run of this program [N/m]."""

ROOT = "lower_torso"
"""The segment that carries the free root."""

FRAME = 0.02
"""Interval of the stored heights [s]."""

FALLING, DOWN = 0.6, 0.25
"""Heights of the centre of mass below which a figure falls, and is down [m].

At 0.5 m the folded legs stop it for a moment: whether it passes that height at once depends on
millimetres.
"""

REST = 0.2
"""Duration at the end over which what is at rest is averaged [s]."""

WINDOW = 0.01
"""Duration over which the floor's force is averaged, as a force plate's filter does [s]."""

HIPS = (("lower_torso", "left_upper_leg"), ("lower_torso", "right_upper_leg"))
"""Pelvis and thigh: segments that carry the force on a hip."""

Values = Mapping[str, tuple[float, ...]]


@dataclass(frozen=True)
class Start:
    """Start of a fall: displacements [rad], velocity of all segments alike [m/s]."""

    displacements: Values
    velocity: tuple[float, float, float] = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Manner:
    """A manner to begin a fall; each start differs by random angles of all joints."""

    displacements: Values
    velocity: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def start(self, figure: Figure, seed: int) -> Start:
        """The start of a seed; the joint to the ground is not disturbed."""
        generator = np.random.default_rng(seed)
        placed: dict[str, tuple[float, ...]] = {}
        for name, joint in figure.joints.items():
            angles = np.zeros(len(joint.chain)) + self.displacements.get(name, 0.0)
            if figure.root.segment not in {end.segment for end in joint.ends}:
                angles += SPREAD * generator.standard_normal(len(joint.chain))
            placed[name] = tuple(angles.tolist())
        return Start(placed, self.velocity)


COLLAPSE = "collapse"

MANNERS = {
    COLLAPSE: Manner(
        {"left_knee": (0.35,), "right_knee": (0.35,), "left_hip_joint": (0.0, 0.15, 0.0)}
    ),
    "push, 1 m/s": Manner({}, (1.0, 0.0, 0.0)),
    "push, 2 m/s": Manner({}, (2.0, 0.0, 0.0)),
    "lean, 0.2 rad": Manner({"root_torso": (-0.2, 0.0, 0.0)}),
}
"""A collapse from standing with the knees bent; from standing straight falls to the left."""


@dataclass(frozen=True)
class Outcome:
    """Numbers of a fall that do not depend on its trajectory in detail.

    Attributes:
        falling: time at which the centre of mass is below `FALLING` [s].
        down: time at which it is below `DOWN` [s].
        rest_height: of the centre of mass at the end [m].
        drift: its horizontal way from the start to the end [m].
        largest_force: of the floor, at any step [N].
        largest_mean_force: of the floor, averaged over `WINDOW` [N].
        carried: force of the floor at the end over the weight.
        hip_force: largest on pelvis and a thigh at any step [N].
        hip_mean_force: the same averaged over `WINDOW` [N].
    """

    falling: float
    down: float
    rest_height: float
    drift: float
    largest_force: float
    largest_mean_force: float
    carried: float
    hip_force: float
    hip_mean_force: float


HEADERS = {
    "falling": f"COM below {FALLING} m [s]",
    "down": f"COM below {DOWN} m [s]",
    "rest_height": "COM height at rest [m]",
    "drift": "drift [m]",
    "largest_force": "largest force [N]",
    "largest_mean_force": "largest force, 10 ms mean [N]",
    "carried": "carried at rest [m g]",
    "hip_force": "largest hip force [N]",
    "hip_mean_force": "largest hip force, 10 ms mean [N]",
}
"""Columns of the table, by field of `Outcome`."""


def outcome(landing: Landing, weight: float) -> Outcome:
    """Read off a fall of a figure of a weight [N]."""
    times, centre, force = landing.times, landing.centre, landing.floor_force
    at_rest = times >= times[-1] - REST
    end = centre[at_rest].mean(axis=0)
    hips = [np.sum([landing.forces[name] for name in names], axis=0) for names in HIPS]
    return Outcome(
        _fall_time(times, centre[:, 1], FALLING),
        _fall_time(times, centre[:, 1], DOWN),
        float(end[1]),
        float(np.hypot(*(end - centre[0])[[0, 2]])),
        float(force.max()),
        largest_mean(times, force),
        float(force[at_rest].mean() / weight),
        float(np.max(hips)),
        max(largest_mean(times, hip) for hip in hips),
    )


def _fall_time(times: Array, heights: Array, bound: float) -> float:
    """Time at which the height passes a bound [s]; nan if it does not."""
    below = np.flatnonzero(heights < bound)
    if not below.size or below[0] == 0:
        return nan
    k = below[0]
    share = (heights[k - 1] - bound) / (heights[k - 1] - heights[k])
    return float(times[k - 1] + share * (times[k] - times[k - 1]))


def largest_mean(times: Array, force: Array, window: float = WINDOW) -> float:
    """Largest mean of a force over a window [N]; the times need not be equidistant."""
    areas = 0.5 * (force[1:] + force[:-1]) * np.diff(times)
    impulse = np.concatenate([[0.0], np.cumsum(areas)])
    ends = times[times >= times[0] + window]
    earlier, later = (np.interp(at, times, impulse) for at in (ends - window, ends))
    return float(np.max(later - earlier) / window)


@dataclass(frozen=True)
class Contender:
    """An engine with its contact."""

    engine: str
    contact: str
    land: Callable[[Start], Landing]


def hulls(figure: Figure) -> dict[str, Array]:
    """Vertices of the psurfs by segment, shape (n, 3) [m]."""
    return {
        name: read_segment_surface(figure, segment).vertices
        for name, segment in figure.bodies.items()
        if segment.psurf is not None
    }


def spheres(figure: Figure) -> dict[str, Array]:
    """Centres and radii of the contact spheres by segment, shape (n, 4) [m]."""
    return {
        name: np.array([(*sphere.centre, sphere.radius) for sphere in fitted.spheres])
        for name, fitted in fit_contact_spheres(figure).items()
    }


def _tree(figure: Figure, start: Start) -> tuple[TreeModel, CurveLaw]:
    """The tree of a start and the law of its joints, for other engines."""
    tree = tree_model(figure, start.displacements, free_root=True)
    return tree, CurveLaw.from_file(tree, figure, "prototype.springs.toml")


def own(figure: Figure, surface: Surface, stop: float = STOP) -> Callable[[Start], Landing]:
    """Falls in this program, with its frames for steps."""

    def land(start: Start) -> Landing:
        plan = Plan(
            stop=stop,
            frame=OWN_FRAME,
            displacements=start.displacements,
            velocities={ROOT: (0.0, 0.0, 0.0, *start.velocity)},
            free_root=True,
            height=0.0,
            scene=Scene((floor_prop((0.0, 1.0, 0.0), surface),)),
        )
        return exudyn_engine.land(figure, plan)

    return land


def mujoco(
    figure: Figure, floor: "Floor", step: float = MUJOCO_STEP, stop: float = STOP
) -> Callable[[Start], Landing]:
    """Falls in MuJoCo."""
    from benchmarks.engines.mujoco_engine import MuJoCo

    def land(start: Start) -> Landing:
        tree, law = _tree(figure, start)
        return MuJoCo(tree, floor=floor).land(stop, step, law, np.array(start.velocity))

    return land


def drake(
    figure: Figure, surface: Surface, step: float = DRAKE_STEP, stop: float = STOP
) -> Callable[[Start], Landing]:
    """Falls in Drake, with stiffness, damping and friction of a surface."""
    from benchmarks.engines.drake_floor import DrakeOnFloor

    shapes = spheres(figure)

    def land(start: Start) -> Landing:
        tree, law = _tree(figure, start)
        engine = DrakeOnFloor(
            tree, shapes, surface.stiffness, surface.damping, surface.friction, step
        )
        return engine.land(stop, law, np.array(start.velocity))

    return land


def contenders(figure: Figure) -> Iterator[Contender]:
    """The engines and their contacts."""
    from benchmarks.engines import mujoco_engine

    for stiffness in (DEFAULT_SURFACE.stiffness, STIFFER):
        contact = f"spheres, {stiffness / 1e3:g} kN/m"
        surface = replace(DEFAULT_SURFACE, stiffness=stiffness)
        yield Contender(exudyn_engine.NAME, contact, own(figure, surface))
    for name, shapes, time_constant in (
        ("hulls", hulls(figure), 0.02),
        ("hulls", hulls(figure), 0.005),
        ("spheres", spheres(figure), 0.02),
    ):
        contact = f"{name}, {1e3 * time_constant:g} ms"
        floor = mujoco_engine.Floor(shapes, time_constant, DEFAULT_SURFACE.friction)
        yield Contender(mujoco_engine.NAME, contact, mujoco(figure, floor))
    try:
        land = drake(figure, DEFAULT_SURFACE)
    except ImportError:
        print("Drake is not installed and is left out")
        return
    contact = f"spheres, {DEFAULT_SURFACE.stiffness / 1e3:g} kN/m"
    yield Contender("Drake", contact, land)


def main() -> None:
    """Print the table and write it, and the heights."""
    figure = read_figure("prototype")
    weight = figure.total_mass * GRAVITY
    rows: list[tables.Row] = []
    heights: list[tables.Row] = []
    for contender in contenders(figure):
        for manner, began in MANNERS.items():
            name = {"fall": manner, "engine": contender.engine, "contact": contender.contact}
            landings = [contender.land(began.start(figure, seed)) for seed in range(STARTS)]
            for seed, landing in enumerate(landings):
                read = outcome(landing, weight)
                numbers = {header: getattr(read, key) for key, header in HEADERS.items()}
                rows.append({**name, "start": seed, **numbers})
            if manner == COLLAPSE:
                heights += _heights(name, landings)
            _show_means(name, rows[-STARTS:])
    tables.write("falls", COMMAND, rows)
    tables.write("falls_starts", COMMAND, list(_starts(figure)))
    tables.write("falls_heights", COMMAND, heights)


def _starts(figure: Figure) -> Iterator[tables.Row]:
    """Angles of the starts of the collapse, which a plate repeats."""
    for seed in range(STARTS):
        for joint, angles in MANNERS[COLLAPSE].start(figure, seed).displacements.items():
            for axis, angle in enumerate(angles):
                yield {"start": seed, "joint": joint, "axis": axis, "angle [rad]": f"{angle:.9f}"}


def _heights(name: tables.Row, landings: list[Landing]) -> Iterator[tables.Row]:
    """Height of the centre of mass of each start, frame by frame."""
    for time in np.arange(0.0, STOP + 0.5 * FRAME, FRAME):
        starts = {
            f"start {seed} [m]": float(np.interp(time, landing.times, landing.centre[:, 1]))
            for seed, landing in enumerate(landings)
        }
        yield {**name, "time [s]": float(time), **starts}


def _show_means(name: tables.Row, rows: Sequence[tables.Row]) -> None:
    """Print means and standard deviations."""
    means = {
        header: f"{np.mean(values):.4g} ({np.std(values, ddof=1):.2g})"
        for header in HEADERS.values()
        for values in [np.array([row[header] for row in rows], dtype=float)]
    }
    tables.show([{**name, **means}])
