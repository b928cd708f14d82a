"""Props and contact on the command line: the options of a scene, and what a fall reports."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from math import degrees, pi
from typing import TYPE_CHECKING, Annotated, NamedTuple

import numpy as np
import typer

from generator.cli.answer import finite_or_none, format_count, format_table
from generator.cli.options import angle_from_option
from generator.contact_record import (
    HEAD_INJURY_CAVEAT,
    REST_DURATION,
    ContactRecord,
    SegmentContact,
)
from generator.diagnostics import Diagnostic, InputError, UsageError, warning
from generator.figure import Figure, Vector
from generator.input_files.scene import MAX_FRICTION, SCENE_FILE
from generator.recording import Recording
from generator.rotations import Array
from generator.scene import FLOOR, Scene, floor_prop
from generator.simulation.plan import MAX_HEIGHT
from springs.contact import DEFAULT_SURFACE

if TYPE_CHECKING:
    from generator.geometry.contact_spheres import SegmentSpheres
    from generator.simulation.starts import StartStudy

FloorOption = Annotated[
    bool,
    typer.Option("--floor", help="Free the figure, and let it fall on a floor (docs/contact.md)."),
]
HeightOption = Annotated[
    float | None,
    typer.Option(
        "--height",
        help="Initial height of the lowest point of a free figure [m]. [default: 0 with a floor "
        "or a scene]",
    ),
]
FrictionOption = Annotated[
    float | None,
    typer.Option("--friction", help="Coefficient of friction of the floor. [default: 0.6]"),
]
SceneOption = Annotated[
    str | None,
    typer.Option(
        "--scene",
        metavar="FILE.scene.toml|NAME",
        help="Props, such as `step`, `seat` or `bed`; frees the figure.",
    ),
]
SelfContactOption = Annotated[
    bool,
    typer.Option(
        "--self-contact", help="Let segments touch each other as well, with --floor or --scene."
    ),
]

StartsOption = Annotated[
    int | None,
    typer.Option(
        "--starts",
        metavar="N",
        help="Repeat the fall from N starts whose joint angles differ at random.",
    ),
]
SpreadOption = Annotated[
    str | None,
    typer.Option(
        "--spread",
        metavar="1deg",
        help="Standard deviation of the angles of --starts. [default: 1deg]",
    ),
]
SeedOption = Annotated[
    int | None, typer.Option("--seed", help="Seed of the random angles of --starts. [default: 0]")
]

MAX_STARTS = 10_000
"""Largest number of starts; more are a typing error."""

MIN_OVERLAP = 1e-3
"""Interpenetration of limbs from which it is worth a row [m]."""

SENSITIVE_ANGLE = 0.1
"""Difference of joint angles at which two falls count as different [rad]."""


class SceneChoice(NamedTuple):
    """Props of a run, with the height at which a figure starts among them [m]."""

    scene: Scene
    height: float | None
    diagnostics: tuple[Diagnostic, ...]


def scene_from_options(
    *, floor: bool, friction: float | None, scene: str | None, height: float | None, up: Vector
) -> SceneChoice:
    """Return the props of `--floor`, `--friction`, `--scene` and `--height`, with warnings.

    Args:
        floor: whether there is a floor.
        friction: of the floor; None for the default.
        scene: file or name of a scene with props.
        height: of the figure's lowest point [m]; None for the default.
        up: normal of the floor.

    Raises:
        UsageError: a value is invalid, or does not apply.
        InputError: the scene has errors.
    """
    props = Scene()
    diagnostics: tuple[Diagnostic, ...] = ()
    if scene is not None:
        parsed = SCENE_FILE.parse_file(scene)
        props, diagnostics = parsed.require_value(), parsed.diagnostics
    if friction is not None:
        if not floor:
            raise UsageError("--friction needs --floor: in a scene file each surface has its own")
        if not 0.0 <= friction <= MAX_FRICTION:
            raise UsageError(
                f"--friction {friction:g}: expected a number from 0 to {MAX_FRICTION:g}"
            )
    if height is not None and abs(height) > MAX_HEIGHT:
        raise UsageError(f"--height {height:g}: expected at most {MAX_HEIGHT:,.0f} m")
    if floor:
        if any(prop.name == FLOOR for prop in props.props):
            raise UsageError(f"--floor: the scene has a prop `{FLOOR}` already")
        if height is not None and height < 0.0:
            raise UsageError(f"--height {height:g}: the figure would start below the floor")
        surface = (
            DEFAULT_SURFACE if friction is None else replace(DEFAULT_SURFACE, friction=friction)
        )
        props = Scene((floor_prop(up, surface), *props.props))
    if props.props and height is None:
        height = 0.0
    return SceneChoice(props, height, diagnostics)


def add_sphere_warnings(
    figure: Figure, diagnostics: tuple[Diagnostic, ...]
) -> tuple[Diagnostic, ...]:
    """Append a warning of the segments that touch by a capsule for want of geometry.

    Raises InputError with all diagnostics for a psurf that cannot be read.
    """
    from generator.geometry.contact_spheres import SphereSource, fit_contact_spheres  # slow import

    try:
        fits = fit_contact_spheres(figure)
    except InputError as failure:
        raise InputError((*diagnostics, *failure.diagnostics)) from None
    names = [name for name, fit in fits.items() if fit.source is SphereSource.CAPSULE]
    if not names:
        return diagnostics
    text = ", ".join(names[:3]) + (f" and {len(names) - 3} more" if len(names) > 3 else "")
    more = warning(
        f"segments without geometry touch by a capsule between their joints: {text}",
        hint="add a psurf or contact spheres to the segment",
    )
    return (*diagnostics, more)


def touch_warnings(recording: Recording) -> Iterator[Diagnostic]:
    """Warn of a run in which nothing was touched."""
    record = recording.contact
    if record is None or any(one.first_time is not None for one in record.segments.values()):
        return
    yield warning(
        f"the figure touched nothing by {recording.times[-1]:.3g} s: increase --stop, or reduce "
        "--height"
    )


def contact_data(record: ContactRecord) -> dict[str, object]:
    """Return the contact of a run for `--json`."""
    angles, heights = record.sensitivity, record.height_sensitivity
    return {
        "weight_carried": record.weight_carried,
        "max_force_N": record.max_force,
        "max_force_s": record.max_force_time,
        "max_penetration_m": record.max_depth,
        "max_penetration_segment": record.max_depth_segment,
        "dissipated_J": record.dissipated,
        "creep_m_per_s": record.creep,
        "first_contact_s": {name: one.first_time for name, one in record.segments.items()},
        "impact_speed_m_per_s": {name: one.impact_speed for name, one in record.segments.items()},
        "peak_force_N": {name: one.peak_force for name, one in record.segments.items()},
        "peak_force_s": {name: one.peak_time for name, one in record.segments.items()},
        "impulse_Ns": {name: list(one.impulse) for name, one in record.segments.items()},
        "sensitivity_rad": None if angles is None else finite_or_none(float(angles[-1])),
        "height_sensitivity_m": None if heights is None else finite_or_none(float(heights[-1])),
        "impact_shift_s": record.impact_shift,
        "overlap": None if record.overlap is None else record.overlap._asdict(),
        "head_injury_criterion": dict(record.head_injury),
    }


def contact_rows(
    recording: Recording, spheres: "Mapping[str, SegmentSpheres]", *, self_contact: bool = False
) -> list[tuple[str, str]]:
    """Return the rows of a summary about contact: title and text.

    Args:
        recording: of a run with contact.
        spheres: contact spheres by segment.
        self_contact: whether the segments touched each other.
    """
    record = recording.contact
    assert record is not None
    count = sum(len(one.spheres) for one in spheres.values())
    errors = [one.largest_error for one in spheres.values() if one.largest_error is not None]
    fit = f"; error in height at most {1000.0 * max(errors):.0f} mm" if errors else ""
    rows = [("contact", f"{format_count(count, 'sphere')}{fit}"), *_touch_rows(recording, record)]
    if record.max_force > 0.0:
        peak = max(record.segments, key=lambda name: record.segments[name].peak_force)
        force = f"at most {record.max_force:.4g} N, at {record.max_force_time:.3g} s"
        alone = f"on {peak} at most {record.segments[peak].peak_force:.4g} N"
        depth = f"at most {1000.0 * record.max_depth:.0f} mm, of {record.max_depth_segment}"
        rows += [("force", f"{force}; {alone}"), ("depth", depth)]
        rows += _end_rows(recording, record)
    if record.overlap is not None and record.overlap.depth >= MIN_OVERLAP:
        depth, segment, other, _ = record.overlap
        text = f"{segment} and {other} by up to {1000.0 * depth:.0f} mm"
        rows.append(("overlap", text if self_contact else f"{text} (without --self-contact)"))
    for name, value in record.head_injury.items():
        rows += [("head", f"HIC15 {value:.0f} of {name}"), ("", HEAD_INJURY_CAVEAT)]
    return rows


def _touch_rows(recording: Recording, record: ContactRecord) -> Iterator[tuple[str, str]]:
    """Yield a row for the segments that touch first, and one for the next."""
    by_time: dict[str, list[str]] = {}
    touches = {
        name: one.first_time for name, one in record.segments.items() if one.first_time is not None
    }
    for name in sorted(touches, key=lambda name: touches[name]):
        by_time.setdefault(f"{touches[name]:.3g} s", []).append(name)
    if not by_time:
        yield "touch", "nothing"
    for title, (time, names) in zip(("touch", ""), by_time.items(), strict=False):
        text = " and ".join(names) if len(names) <= 2 else format_count(len(names), "segment")
        speed = max(record.segments[name].impact_speed for name in names)
        is_start = touches[names[0]] == recording.times[0]
        yield title, f"{text} at {time}" + ("" if is_start else f" with {speed:.2g} m/s")


def _end_rows(recording: Recording, record: ContactRecord) -> Iterator[tuple[str, str]]:
    """Yield the row about the means at the end of a run of two frames or more."""
    duration = min(REST_DURATION, float(recording.times[-1] - recording.times[0]))
    if duration > 0.0:
        carried = record.weight_carried
        weight = "" if carried is None else f"{carried:.3f} of the weight carried, "
        speed = f"horizontal speed {record.creep:.3g} m/s"
        yield "end", f"{weight}{speed} (last {duration:.3g} s)"


def sensitivity_rows(recording: Recording) -> list[tuple[str, str]]:
    """Return the rows of a summary about the growth of a small change of the start."""
    record, times = recording.contact, recording.times
    if record is None or record.sensitivity is None or record.height_sensitivity is None:
        return []
    if len(times) == 1:
        return []
    angles, heights = record.sensitivity, record.height_sensitivity
    beyond = np.flatnonzero(angles > SENSITIVE_ANGLE)
    if beyond.size:
        within = f"{SENSITIVE_ANGLE:g} rad of these until {times[max(beyond[0] - 1, 0)]:.3g} s"
    else:
        within = f"{float(np.max(angles)):.2g} rad of these to the end"
    known = np.flatnonzero(np.isfinite(heights))
    last = known[-1]
    until = "to the end" if last == len(times) - 1 else f"until {times[last]:.3g} s"
    height = f"{1000.0 * float(np.max(heights[known])):.3g} mm {until}"
    texts = [
        f"0.001 rad off: joint angles within {within}",
        f"height of the centre of mass within {height}",
    ]
    if record.impact_shift is not None:
        texts.append(f"first impact within {1000.0 * record.impact_shift:.2g} ms")
    return list(
        zip(("start", "", ""), (*(f"{text}," for text in texts[:-1]), texts[-1]), strict=False)
    )


class StartsChoice(NamedTuple):
    """Number of disturbed starts, the standard deviation of their angles [rad], and the seed."""

    number: int
    spread: float
    seed: int


def starts_from_options(
    starts: int | None, spread: str | None, seed: int | None, *, has_props: bool
) -> StartsChoice | None:
    """Return the choice of `--starts`, `--spread` and `--seed`; None without starts.

    Raises UsageError for invalid values, and without props to fall on.
    """
    if starts is None:
        if spread is not None or seed is not None:
            raise UsageError(f"--{'spread' if seed is None else 'seed'} needs --starts")
        return None
    if not has_props:
        raise UsageError("--starts needs --floor or --scene")
    if not 1 <= starts <= MAX_STARTS:
        raise UsageError(f"--starts {starts}: expected a number from 1 to {MAX_STARTS:,}")
    if seed is not None and seed < 0:
        raise UsageError(f"--seed {seed}: the seed must not be negative")
    angle = angle_from_option("--spread", spread or "1deg")
    if not 0.0 < angle <= pi:
        raise UsageError(f"--spread {spread}: the angle must be above 0 and at most 180 deg")
    return StartsChoice(starts, angle, seed or 0)


def starts_text(study: "StartStudy") -> str:
    """Format the distribution of falls from several starts."""
    title = f"{format_count(len(study), 'start')}, angles varied by {degrees(study.spread):.3g} deg"
    lines = [f"{title} (SD), seed {study.seed}{_accuracy_text(study)}"]
    if study.failures:
        number, sentence = next(iter(study.failures.items()))
        lines.append(f"{len(study.failures)} failed; start {number}: {sentence}")
    if len(study.failures) < len(study):
        lines.append(_distribution_table(_studied(study)))
    return "\n".join(lines)


def starts_details(study: "StartStudy") -> str:
    """Format the distribution of the largest force on each segment."""
    if len(study.failures) == len(study):
        return ""
    forces = ((f"{name} [N]", values) for name, values in study.peak_forces.items())
    return "largest force on each segment\n" + _distribution_table(forces)


def _accuracy_text(study: "StartStudy") -> str:
    if study.is_accurate is None:
        return ""
    return f"; {int(np.sum(study.is_accurate))} within the tolerance to the end"


def starts_data(study: "StartStudy") -> dict[str, object]:
    """Return the falls from several starts for `--json`."""
    return {
        "spread_deg": degrees(study.spread),
        "seed": study.seed,
        "is_accurate": None if study.is_accurate is None else study.is_accurate.tolist(),
        "failures": {str(number): sentence for number, sentence in study.failures.items()},
        "impact_s": _finite_list(study.impact_times),
        "max_force_N": _finite_list(study.max_forces),
        "peak_force_N": {name: _finite_list(one) for name, one in study.peak_forces.items()},
        "rest_height_m": _finite_list(study.rest_heights),
        "weight_carried": _finite_list(study.weights_carried),
    }


def _studied(study: "StartStudy") -> Iterator[tuple[str, Array]]:
    yield "first impact [s]", study.impact_times
    yield "largest force [N]", study.max_forces
    yield "height of the centre of mass at the end [m]", study.rest_heights
    yield "share of the weight carried at the end", study.weights_carried


def _distribution_table(studied: Iterable[tuple[str, Array]]) -> str:
    """Format a row for each quantity that is known of some start."""
    rows = [("", "mean", "SD", "smallest", "largest")]
    rows += [
        (title, *("-" if value is None else f"{value:.4g}" for value in _distribution(values)))
        for title, values in studied
        if np.isfinite(values).any()
    ]
    return format_table(rows)


def _distribution(values: Array) -> tuple[float | None, ...]:
    """Return mean, standard deviation, smallest and largest of the finite values."""
    found = values[np.isfinite(values)]
    deviation = float(np.std(found, ddof=1)) if found.size > 1 else None
    return float(np.mean(found)), deviation, float(np.min(found)), float(np.max(found))


def _finite_list(values: Array) -> list[float | None]:
    return [finite_or_none(float(value)) for value in values]


def contact_table(record: ContactRecord) -> list[tuple[str, ...]]:
    """Return the contact of each segment as the rows of a table."""
    rows: list[tuple[str, ...]] = [
        ("segment", "first touch [s]", "speed [m/s]", "peak force [N]", "at [s]", "impulse [N s]")
    ]
    for name, one in record.segments.items():
        if one.first_time is None:
            rows.append((name, "none", "", "", "", ""))
        else:
            rows.append((name, *_segment_texts(one)))
    return rows


def _segment_texts(one: SegmentContact) -> Iterator[str]:
    yield f"{one.first_time:.4g}"
    yield f"{one.impact_speed:.3g}"
    yield f"{one.peak_force:.4g}"
    yield f"{one.peak_time:.4g}"
    yield f"{float(np.linalg.norm(one.impulse)):.4g}"
