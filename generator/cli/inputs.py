"""Inputs of commands: a figure, its springs, its pose or motion, and constraints of its joints.

These are the argument FIGURE and the options `--springs`, `--pose`, `--set`, `--along`, `--links`,
`--lock` and `--drive`.
"""

import re
from collections.abc import Container, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import degrees, inf, isclose, isfinite
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from generator.cli.options import (
    displacements_from_options,
    in_display_units,
    vector_from_option,
    velocities_from_options,
)
from generator.diagnostics import (
    Diagnostic,
    InputError,
    ModelError,
    MoverError,
    Parsed,
    UsageError,
    select_errors,
    spelling_hint,
    warning,
)
from generator.drive import Drive
from generator.figure import Figure, follower_faults
from generator.figure_file import FIGURE_FILE
from generator.input_files.pose import POSE_FILE
from generator.input_files.scene import SCENE_FILE
from generator.input_files.tone import tone_from_options
from generator.kinematics.free_root import settable_joints
from generator.kinematics.links import LINKS_FILE, NO_LINKS, Links
from generator.kinematics.loops import close_loops
from generator.kinematics.placement import (
    Displacements,
    Placement,
    batched_placements,
    initial_displacements,
)
from generator.kinematics.prescribed import PrescribedMotion
from generator.kinematics.tree import build_tree
from generator.model import Model
from generator.motion_files.drives import read_drives_with_warnings
from generator.motion_files.motion import FigureMotion, Header, file_sha256
from generator.rotations import Array
from generator.run_options import RUN_OPTIONS
from generator.simulation.plan import Plan, option_faults, plan_fields
from generator.simulation.preconditions import (
    chain_obstacles,
    model_obstacles,
    simulation_obstacles,
)
from generator.springs_file.axes import parallel_sign
from generator.springs_file.parse import EXTENDS_KEY
from generator.springs_file.read import (
    NO_SPRINGS,
    joints_without_elastic_law,
    load_springs,
)
from generator.text_io import is_file
from generator.toml_file.rows import Number, Vector3
from springs import SphericalLaw, SpringSet
from springs.published.range_of_motion import normal_range


def load_figure(name: str) -> tuple[Figure, tuple[Diagnostic, ...]]:
    """Load a figure by its path or name, with warnings.

    Raises:
        InputError: The file is missing or has errors.
        UsageError: It is a file of another kind.
    """
    parsed = FIGURE_FILE.parse_file(name)
    if parsed.value is None and is_file(Path(name)):
        _refuse_other_kind(Path(name))
    return parsed.require_value(), parsed.diagnostics


def _refuse_other_kind(path: Path) -> None:
    """Raise UsageError for a file whose suffix is of another kind than figures."""
    if kind := re.search(r"\.([a-z]+)\.toml$", path.name):
        raise UsageError(f"{path} is a {kind[1]} file; figures are {FIGURE_FILE.suffix} files")
    if path.suffix not in ("", FIGURE_FILE.suffix):
        refuse_model(path)


def refuse_model(path: Path) -> None:
    """Raise UsageError for a model of another program, which says how it becomes a figure."""
    from generator.conversion import is_model  # imports all formats of models

    if is_model(str(path)):
        target = f"{path.stem or 'figure'}{FIGURE_FILE.suffix}"
        raise UsageError(
            f"{path} is a model of another program: `mover convert {path} {target}` makes a "
            "figure of it"
        )


def parse_springs_option(
    figure: Figure, choice: str | None, law: SphericalLaw | None = None
) -> Parsed[SpringSet]:
    """Read the springs that `--springs` chooses for a figure, with diagnostics."""
    path = figure.path
    folder, stem = (None, None) if path is None else (path.parent, path.stem)
    parsed = load_springs(figure, folder, stem, choice, law)
    if choice in (None, NO_SPRINGS) or parsed.value is None:
        return parsed
    springs = parsed.value
    inelastic = len(joints_without_elastic_law(figure, springs))
    moving = sum(bool(joint.chain) for joint in figure.joints.values())
    if 2 * inelastic <= moving:
        return parsed
    few = warning(
        f"{inelastic} of {moving} joints have no elastic law with the springs of {springs.origin}",
        hint=f"`{EXTENDS_KEY}` keeps the springs of another file",
    )
    return Parsed(springs, (*parsed.diagnostics, few))


def springs_from_option(
    figure: Figure, choice: str | None, law: SphericalLaw | None = None
) -> tuple[SpringSet, tuple[Diagnostic, ...]]:
    """Load the springs that `--springs` chooses for a figure, with warnings. Raises InputError."""
    parsed = parse_springs_option(figure, choice, law)
    return parsed.require_value(), parsed.diagnostics


def require_simulatable(
    model: Model,
    start: Mapping[str, Sequence[float]] | None,
    warnings: tuple[Diagnostic, ...],
) -> None:
    """Raise InputError, with the warnings so far, when the model cannot be simulated.

    `start` are its initial displacements [rad or m]; None if prescribed joints change them.
    """
    obstacles = model_obstacles(model) if start is None else simulation_obstacles(model, start)
    if obstacles:
        messages = {one.message for one in obstacles}
        raise InputError((*(one for one in warnings if one.message not in messages), *obstacles))


def given_options(values: Mapping[str, Any]) -> dict[str, Any]:
    """Return the options of a run that are given, by their keys.

    `values` are those of all options of a command, by their names in Python, among others. Raises
    UsageError for an invalid value, and for two options that contradict each other.
    """
    own = {key: option for key, option in RUN_OPTIONS.items() if option.field in values}
    settings: dict[str, Any] = {}
    for key, option in own.items():
        value, row = values[option.field], option.row
        if value is None or value is False or value == []:
            continue
        settings[key] = value
        if isinstance(row, Vector3):
            settings[key] = vector_from_option(option.flag, value, row.largest)
        if isinstance(row, Number):
            if not isfinite(value):
                raise UsageError(f"{option.flag} {value}: the number must be finite")
            fault = row.fault(value)
            if fault is not None:
                raise UsageError(f"{option.flag} {fault}")
    refuse_contradictions(settings, own)
    return settings


def refuse_contradictions(settings: Mapping[str, Any], known: Container[str] = RUN_OPTIONS) -> None:
    """Raise UsageError for the first contradiction of options, as `option_faults` lists them."""
    for fault in option_faults(settings, known, lambda key: RUN_OPTIONS[key].flag):
        raise UsageError(fault.sentence)


def plan_from_options(
    settings: Mapping[str, Any], base: Plan | None = None
) -> tuple[Plan, tuple[Diagnostic, ...]]:
    """Return the plan of the options that are given, without files of joints, and warnings.

    Args:
        settings: Values of the options, by their keys.
        base: Plan that the options change; None for the default one.

    Raises:
        UsageError: the values fit no run.
        InputError: the scene has errors.
    """
    diagnostics: tuple[Diagnostic, ...] = ()
    if "scene" in settings:
        parsed = SCENE_FILE.parse_file(settings["scene"])
        settings = {**settings, "scene": parsed.require_value()}
        diagnostics = parsed.diagnostics
    try:
        return replace(base or Plan(), **plan_fields(settings)), diagnostics
    except ModelError as failure:
        raise UsageError(f"{RUN_OPTIONS['floor'].flag}: {failure}") from None
    except ValueError as failure:
        raise UsageError(str(failure)) from None


def fall_from_options(
    figure: Figure, settings: Mapping[str, Any]
) -> tuple[Plan, tuple[Diagnostic, ...]]:
    """Return the plan of `--fall`, changed by the other options, and warnings.

    Raises:
        UsageError: The kind of fall is unknown, the figure cannot fall like that, or an option
            contradicts it.
        InputError: A psurf cannot be read.
    """
    from generator.simulation.falls import fall_plan  # fits spheres

    seed = settings.get("seed", 0)
    if seed < 0:
        raise UsageError(f"--seed {seed}: the seed must not be negative")
    try:
        plan = fall_plan(figure, settings["fall"], seed)
    except ModelError as failure:
        raise UsageError(f"--fall {settings['fall']}: {failure}") from None
    of_fall = {"floor", "free_root"}
    others = {key: value for key, value in settings.items() if key not in of_fall}
    return plan_from_options(others, plan)


def with_tone(plan: Plan, figure: Figure, settings: Mapping[str, Any]) -> Plan:
    """Return the plan with the tone of the options that are given, which add to its own.

    Raises:
        UsageError: a value cannot be read, or names no joint or group of the figure.
        InputError: the tone file is missing or has errors.
    """
    stated = settings.keys() & {"tone", "right", "hold", "delay", "release"}
    if not stated:
        return plan
    if not stated & {"tone", "right", "hold"} and plan.tone is None:
        flags = " and ".join(RUN_OPTIONS[key].flag for key in sorted(stated))
        raise UsageError(f"{flags}: this fall is of a limp body; give it --tone, --right or --hold")
    tone = tone_from_options(
        settings.get("tone"),
        settings.get("right", ()),
        settings.get("hold", ()),
        settings.get("delay"),
        settings.get("release"),
        plan.tone,
    )
    try:
        tone.righting_shares(figure.joints)
        tone.hold_shares(figure.joints)
    except ModelError as failure:
        raise UsageError(str(failure)) from None
    return replace(plan, tone=tone)


class ScaledRun(NamedTuple):
    """A model and its plan after `--scale`, and its values by path, in the units of the paths.

    The starts are displacements and rates that are set, by joint, under `pose` and `velocity`.
    """

    model: Model
    plan: Plan
    values: Mapping[str, float] = {}
    starts: Mapping[str, Mapping[str, Sequence[float]]] = {}


def scale_parameters(model: Model, plan: Plan, texts: Sequence[str]) -> ScaledRun:
    """Set the parameters of `--scale`, `PATH=VALUE`, as a study does.

    Raises UsageError for a path that is unknown or repeated, and for an impossible value.
    """
    if not texts:
        return ScaledRun(model, plan)
    from generator.study.parameters import apply_parameters  # imports all of a study

    values: list[tuple[str, float]] = []
    for text in texts:
        path, equals, number = text.partition("=")
        if not equals:
            raise UsageError(f"--scale {text}: expected PATH=VALUE")
        try:
            values.append((path.strip(), float(number)))
        except ValueError:
            raise UsageError(f"--scale {text}: `{number}` is not a number") from None
    try:
        case = apply_parameters(model, plan, values)
    except ModelError as failure:
        raise UsageError(f"--scale {failure}") from None
    starts = {
        "pose": _changed(plan.displacements, case.plan.displacements),
        "velocity": _changed(plan.velocities, case.plan.velocities),
    }
    return ScaledRun(case.model, case.plan, dict(values), starts)


def _changed(
    before: Mapping[str, Sequence[float]], after: Mapping[str, Sequence[float]]
) -> dict[str, Sequence[float]]:
    return {name: values for name, values in after.items() if before.get(name) != values}


MAX_DISTANCE = 1e9
"""Largest coordinate in the world [m]."""

DisplacementValues = dict[str, tuple[float, ...]]


def placements_of_motion(motion: FigureMotion) -> Iterator[Placement]:
    """Yield the placements of all frames in batches. Raises MoverError if out of range."""
    for placement in batched_placements(motion.tree, motion.displacements):
        check_segment_distances(placement)
        yield placement


def placement_from_options(
    figure: Figure, pose: Path | None, sets: Sequence[str]
) -> tuple[Placement, tuple[Diagnostic, ...]]:
    """Place a figure: its own pose, changed by a pose file, then by `JOINT=a,b,c`; with warnings.

    Loops are closed; joints of `--set`, or else of the file, keep their values.

    Raises:
        UsageError: `--set` cannot be read or does not fit the figure.
        InputError: the pose file is wrong, or a joint's chain is invalid.
        OpenLoopError: the loops cannot be closed.
    """
    check_chains(figure)
    tree = build_tree(figure)
    from_file, warnings = dict[str, Array](), ()
    if pose is not None:
        parsed = POSE_FILE.parse_file(pose, figure)
        from_file, warnings = dict(parsed.require_value()), parsed.diagnostics
    set_values = displacements_from_options("--set", sets, settable_joints(figure))
    asked = {
        **initial_displacements(tree),
        **from_file,
        **{name: np.array(values, dtype=float) for name, values in set_values.items()},
    }
    _refuse_off_curves(figure, set_values, asked)
    placement = close_loops(tree, asked, fixed=set(set_values or from_file))
    check_segment_distances(placement)
    return placement, warnings


def _refuse_off_curves(
    figure: Figure, set_values: DisplacementValues, asked: Mapping[str, Sequence[float] | Array]
) -> None:
    """Raise UsageError if `--set` states a displacement off the curve that it follows."""
    for name, fault in follower_faults(figure.joints, set_values, asked):
        raise UsageError(f"--set {name}: {fault}; leave it out")


def start_displacements_from_options(
    figure: Figure, pose: Path | None, sets: Sequence[str]
) -> tuple[DisplacementValues, tuple[Diagnostic, ...]]:
    """Return the initial displacements of a run [rad or m], with warnings.

    With a pose file: all joints, with closed loops. Without: the joints of `--set`, and the run
    closes the loops. Raises as `placement_from_options` does.
    """
    if pose is None and not sets:
        return {}, ()
    if pose is None:
        set_values = displacements_from_options("--set", sets, settable_joints(figure))
        drawn = {name: joint.displacement for name, joint in figure.joints.items()}
        _refuse_off_curves(figure, set_values, {**drawn, **set_values})
        return set_values, ()
    placement, warnings = placement_from_options(figure, pose, sets)
    values = placement.displacements.items()
    return {name: tuple(float(value) for value in row) for name, row in values}, warnings


MAX_ANGLE_BEYOND_RANGE = np.radians(10.0)
"""Angle beyond its normal range of motion at which a joint may start without a warning [rad]."""


def range_warnings(
    figure: Figure,
    springs: SpringSet,
    displacements: Mapping[str, Sequence[float]],
    *,
    is_start: bool = True,
) -> Iterator[Diagnostic]:
    """Yield warnings of joints that are outside their limits or their normal range of motion.

    A joint outside limits that are its normal range has one warning.

    Args:
        figure: Figure.
        springs: Springs, which name the motions.
        displacements: Displacements by joint [rad or m].
        is_start: Whether a run starts there.
    """
    verb, hint = ("starts", "its stop pushes it back") if is_start else ("is", "")
    for name, values in displacements.items():
        joint = figure.joints[name]
        lower = joint.lower_limit or (-inf,) * len(values)
        upper = joint.upper_limit or (inf,) * len(values)
        shown = in_display_units(values, joint.chain)
        units = [factor.units.displacement for factor in joint.chain]
        for k, (low, value, high) in enumerate(zip(lower, values, upper, strict=True)):
            if k in joint.free_places and not low <= value <= high:
                ends = (
                    in_display_units([end] * len(values), joint.chain)[k] for end in (low, high)
                )
                limits = " to ".join(f"{end:.4g}" for end in ends)
                yield warning(
                    f"joint {name} {verb} at {shown[k]:.4g} {units[k]}, outside its limits "
                    f"{limits} {units[k]}",
                    hint=hint,
                )
        own = springs.joints.get(name)
        if own is None or len(values) != 1 or not own.axes:
            continue
        spring = own.axes[0]
        sense = parallel_sign(spring.direction, joint.chain[0].axis)
        low, high = (
            None if end is None else end.angle for end in normal_range(name, spring.motion)
        )
        least, largest = -inf if low is None else low, inf if high is None else high
        angle, margin = sense * values[0], MAX_ANGLE_BEYOND_RANGE
        if np.allclose(sorted((sense * least, sense * largest)), (lower[0], upper[0]), atol=1e-3):
            continue
        if not least - margin <= angle <= largest + margin:
            ends = ("?" if end is None else f"{degrees(end):.4g}" for end in (low, high))
            yield warning(
                f"joint {name} {verb} at {degrees(angle):.4g} deg of {spring.motion}; "
                f"its normal range of motion is {' to '.join(ends)} deg"
            )


def motion_from_options(
    figure: Figure, path: Path, pose: Path | None, sets: Sequence[str]
) -> tuple[FigureMotion, tuple[Diagnostic, ...]]:
    """Read the motion of a figure in the file of `--along`, with warnings.

    Raises UsageError if a pose is set as well, and as `load_motion` does.
    """
    if pose is not None or sets:
        raise UsageError("--along takes its poses from the motion: leave out --pose and --set")
    motion, warnings = _read_motion(path, figure)
    _ = motion.tree  # a motion of another figure has none
    return motion, warnings


def load_motion(path: Path, figure_name: str | None) -> tuple[FigureMotion, tuple[Diagnostic, ...]]:
    """Read a motion of the figure that it names, or of another one, with warnings.

    Raises:
        UsageError: the file is not a motion that can be read.
        InputError: a file cannot be read, or a joint's chain is invalid.
        MoverError: the motion is one of another figure.
    """
    figure, warnings = (None, ()) if figure_name is None else load_figure(figure_name)
    motion, more = _read_motion(path, figure)
    return motion, (*warnings, *more)


def _read_motion(path: Path, figure: Figure | None) -> tuple[FigureMotion, tuple[Diagnostic, ...]]:
    """Read a motion; raises as `load_motion`."""
    from generator.conversion import read_motion_with_warnings  # imports all formats of models

    if figure is not None:
        check_chains(figure)
    motion, warnings = read_motion_with_warnings(path, figure)
    check_chains(motion.figure)
    return motion, (*warnings, *changed_figure_warnings(motion.figure, motion.header, path))


def check_chains(figure: Figure) -> None:
    """Raise InputError if no single joint can realise a joint's chain."""
    obstacles = tuple(chain_obstacles(figure))
    if select_errors(obstacles):
        raise InputError(obstacles)


def check_segment_distances(placement: Placement) -> None:
    """Raise MoverError if a segment is farther than `MAX_DISTANCE` from the origin."""
    for name, pose in placement.poses.items():
        check_distances(f"segment `{name}`", pose[..., :3, 3])


def check_distances(what: str, positions: Array) -> None:
    """Raise MoverError if positions, shape (..., 3) [m], exceed `MAX_DISTANCE`."""
    if not np.all(np.abs(positions) < MAX_DISTANCE):
        raise MoverError(f"{what} is more than {MAX_DISTANCE:.0e} m from the origin")


def changed_figure_warnings(figure: Figure, header: Header, path: Path) -> tuple[Diagnostic, ...]:
    """Warn if the figure's file is not the one that the motion was made with."""
    if figure.path is None or header.sha256 in (None, file_sha256(figure.path)):
        return ()
    text = f"`{path}` is a motion of another version of {header.figure} than `{figure.path}`"
    return (warning(text, hint="its joints agree, its segments may differ"),)


AGREEMENT_TOLERANCE = 1e-9
"""Largest difference of displacements that count as one [rad or m]."""


@dataclass(frozen=True)
class KinematicConstraints:
    """Links, locked joints and drives of a run."""

    links: Links = NO_LINKS
    locked: tuple[str, ...] = ()
    drives: Mapping[str, Drive] = field(default_factory=dict[str, Drive])

    def check_consistency(
        self,
        figure: Figure,
        sets: Sequence[str],
        start: float,
        velocities: Sequence[str] = (),
        *,
        free_root: bool = False,
        scaled: Mapping[str, Mapping[str, Sequence[float]]] | None = None,
    ) -> None:
        """Check that no joint starts elsewhere, or with another velocity, than it is held.

        Args:
            figure: Figure whose joints are held.
            sets: Values of `--set`.
            start: Time of the start [s].
            velocities: Values of `--velocity`.
            free_root: Effect of `--free-root`: the figure is let go.
            scaled: Displacements and rates of `--scale` by joint, under `pose` and `velocity`.

        Raises:
            UsageError: one does, or a joint is locked that cannot be.
            ModelError: the links or the drives by themselves cannot be held.
        """
        if not (self.links.links or self.locked or self.drives):
            return
        tree = build_tree(figure)
        set_values = displacements_from_options("--set", sets, settable_joints(figure))
        scaled = {"pose": {}, "velocity": {}, **(scaled or {})}
        set_values |= {name: tuple(values) for name, values in scaled["pose"].items()}
        PrescribedMotion(tree, self.links, {}, {})
        PrescribedMotion(tree, NO_LINKS, {}, self.drives)
        asked: Displacements = {
            **initial_displacements(tree),
            **{name: np.array(values) for name, values in set_values.items()},
        }
        locked = {name: asked[name] for name in self.locked}
        try:
            prescribed = PrescribedMotion(tree, self.links, locked, self.drives)
        except ModelError as failure:
            raise UsageError(str(failure)) from None
        put = prescribed.impose_displacements(asked, start)
        for name in set_values:
            if not all(
                isclose(one, other, rel_tol=AGREEMENT_TOLERANCE, abs_tol=AGREEMENT_TOLERANCE)
                for one, other in zip(*_free_parts(figure, name, asked, put), strict=True)
            ):
                option = "--scale pose." if name in scaled["pose"] else "--set "
                raise UsageError(
                    f"{option}{name}: the joint is linked or driven and starts elsewhere"
                )
        joints = settable_joints(figure, free_root=free_root)
        try:
            prescribed.check_free_root(joints)
        except ModelError as failure:
            raise UsageError(str(failure)) from None
        rates = velocities_from_options(velocities, figure, free_root=free_root)
        _check_rates(prescribed, {**rates, **scaled["velocity"]}, start, scaled["velocity"], put)


def _free_parts(figure: Figure, joint: str, *parts: Displacements) -> list[Array]:
    """Return values of a joint without those of displacements that follow in the figure's file."""
    places = list(figure.joints[joint].free_places)
    return [part[joint][places] for part in parts]


def _check_rates(
    prescribed: PrescribedMotion,
    velocities: Mapping[str, Sequence[float]],
    start: float,
    scaled: Container[str],
    displacements: Displacements,
) -> None:
    """Raise UsageError for velocities other than what is prescribed at the start [s]."""
    asked = {
        name: np.array(velocities.get(name, np.zeros(len(joint.chain))), dtype=float)
        for name, joint in prescribed.tree.figure.joints.items()
    }
    put = prescribed.impose_rates(asked, start, displacements)
    for name in velocities.keys() & asked.keys():
        one, other = _free_parts(prescribed.tree.figure, name, asked, put)
        if not np.allclose(one, other, rtol=AGREEMENT_TOLERANCE, atol=AGREEMENT_TOLERANCE):
            option = "--scale velocity." if name in scaled else "--velocity "
            raise UsageError(
                f"{option}{name}: the joint is locked, linked or driven, and starts with "
                "another velocity"
            )


def constraints_from_options(
    figure: Figure,
    links: Path | None,
    locks: Sequence[str],
    drive: Path | None = None,
    driven: Sequence[str] = (),
) -> tuple[KinematicConstraints, tuple[Diagnostic, ...]]:
    """Return the constraints of a run, with warnings.

    The drive is an action file or a table of the driven joints, or of all if none are named.

    Raises:
        UsageError: a joint is unknown.
        InputError: a file is wrong.
    """
    for option, names in (("--lock", locks), ("--driven", driven)):
        for name in names:
            if name not in figure.joints:
                hint = spelling_hint(name, figure.joints)
                raise UsageError(f"{option} {name}: the figure has no joint `{name}`; {hint}")
    if driven and drive is None:
        raise UsageError("--driven chooses joints of the --drive file, which is missing")
    read, warnings = NO_LINKS, ()
    if links is not None:
        reading = LINKS_FILE.parse_file(links, figure)
        read, warnings = reading.require_value(), reading.diagnostics
    drives: Mapping[str, Drive] = {}
    if drive is not None:
        drives, more = read_drives_with_warnings(drive, figure, driven)
        warnings += more
    return KinematicConstraints(read, tuple(dict.fromkeys(locks)), drives), warnings
