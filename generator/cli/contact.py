"""Props and contact on the command line: the options of a scene, and what a fall reports."""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from math import degrees, isfinite, pi
from typing import TYPE_CHECKING, Annotated, NamedTuple

import numpy as np
import typer

from generator.cli.answer import finite_or_none, format_count, format_table
from generator.cli.options import angle_from_option
from generator.contact_record import HEAD_INJURY_CAVEAT, ContactRecord, SegmentContact
from generator.diagnostics import Diagnostic, UsageError, warning
from generator.figure import Figure, Vector
from generator.geometry.contact_spheres import SegmentSpheres, SphereSource, fit_contact_spheres
from generator.input_files.scene import parse_scene_file
from generator.recording import Recording
from generator.rotations import Array
from generator.scene import FLOOR, Scene, floor_prop
from springs.contact import DEFAULT_SURFACE

if TYPE_CHECKING:
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
    float | None, typer.Option("--friction", help="Friction of the floor. [default: 0.6]")
]
SceneOption = Annotated[
    str | None,
    typer.Option(
        "--scene",
        metavar="FILE.scene.toml|NAME",
        help="Props, such as `step`, `seat` or `bed`; frees the figure.",
    ),
]

StartsOption = Annotated[
    int | None,
    typer.Option(
        "--starts", metavar="N", help="Repeat the run from N starts whose joint angles differ."
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
    int | None, typer.Option("--seed", help="Seed of the random --starts. [default: 0]")
]

MAX_STARTS = 10_000
"""Largest number of starts; more are a typing error."""

MIN_OVERLAP = 1e-3
"""Interpenetration of limbs from which it is worth a row [m]."""


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
        parsed = parse_scene_file(scene)
        props, diagnostics = parsed.require_value(), parsed.diagnostics
    if friction is not None:
        if not floor:
            raise UsageError("--friction needs --floor: in a scene file each surface has its own")
        if not (isfinite(friction) and friction >= 0.0):
            raise UsageError(f"--friction {friction:g}: the friction must not be negative")
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


def sphere_warnings(figure: Figure) -> Iterator[Diagnostic]:
    """Warn of segments that touch by a capsule, or not at all, for want of geometry."""
    by_source: dict[SphereSource, list[str]] = {}
    for name, spheres in fit_contact_spheres(figure).items():
        by_source.setdefault(spheres.source, []).append(name)
    capsules = by_source.get(SphereSource.CAPSULE, [])
    if capsules:
        yield warning(
            f"{_names_text(capsules)} no geometry and {_verb(capsules, 'touches', 'touch')} by a "
            "capsule between its joints",
            hint="give it a psurf, or contact spheres",
        )


def touch_warnings(recording: Recording) -> Iterator[Diagnostic]:
    """Warn of a run in which nothing was touched."""
    record = recording.contact
    if record is None or any(one.first_time is not None for one in record.segments.values()):
        return
    yield warning(
        f"the figure touched nothing until {recording.times[-1]:.3g} s",
        hint="start lower (--height), or stop later (--stop)",
    )


def contact_data(record: ContactRecord) -> dict[str, object]:
    """Return the contact of a run for `--json`."""
    last = None if record.sensitivity is None else float(record.sensitivity[-1])
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
        "disturbed_rad": None if last is None else finite_or_none(last),
        "disturbed_impact_s": record.impact_shift,
        "overlap": None if record.overlap is None else record.overlap._asdict(),
        "head_injury_criterion": dict(record.head_injury),
    }


def contact_rows(
    recording: Recording, spheres: Mapping[str, SegmentSpheres]
) -> list[tuple[str, str]]:
    """Return the rows of a summary about contact: title and text."""
    record = recording.contact
    assert record is not None
    count = sum(len(one.spheres) for one in spheres.values())
    errors = [one.largest_error for one in spheres.values() if one.largest_error is not None]
    fit = f" within {1000.0 * max(errors):.0f} mm of the surfaces" if errors else ""
    rows = [("contact", f"{format_count(count, 'sphere')}{fit}; {_first_touch_text(record)}")]
    if record.max_force > 0.0:
        peak = max(record.segments, key=lambda name: record.segments[name].peak_force)
        rows.append(
            (
                "force",
                f"largest {record.max_force:.4g} N at {record.max_force_time:.3g} s; "
                f"{peak} alone {record.segments[peak].peak_force:.4g} N",
            )
        )
        carried = record.weight_carried
        weight = "" if carried is None else f"{carried:.3f} of the weight is carried, "
        rows.append(
            (
                "end",
                f"{weight}the centre of mass moves at {1000.0 * record.creep:.0f} mm/s; "
                f"deepest penetration {1000.0 * record.max_depth:.0f} mm "
                f"({record.max_depth_segment})",
            )
        )
    if record.overlap is not None and record.overlap.depth >= MIN_OVERLAP:
        overlap = record.overlap
        rows.append(
            (
                "limbs",
                f"pass through each other: {overlap.segment} and {overlap.other} by up to "
                f"{1000.0 * overlap.depth:.0f} mm",
            )
        )
    rows.extend(
        ("head", f"HIC15 of {name} {value:.0f}; {HEAD_INJURY_CAVEAT}")
        for name, value in record.head_injury.items()
    )
    return rows


def sensitivity_rows(recording: Recording) -> list[tuple[str, str]]:
    """Return the row of a summary about the growth of a small change of the start."""
    record = recording.contact
    if record is None or record.sensitivity is None or record.height_sensitivity is None:
        return []
    angles, heights = record.sensitivity, record.height_sensitivity
    beyond = np.flatnonzero(angles > SENSITIVE_ANGLE)
    until = (
        f"from {recording.times[beyond[0]]:.3g} s on by more than {SENSITIVE_ANGLE:g} rad"
        if beyond.size
        else f"by at most {float(np.max(angles)):.2g} rad"
    )
    shift = record.impact_shift
    impact = "" if shift is None else f", the first impact by {1000.0 * shift:.2g} ms"
    return [
        (
            "chaos",
            f"joints that start 0.001 rad off differ {until}; the height of the centre of mass "
            f"by at most {1000.0 * float(np.max(heights)):.1f} mm{impact}",
        )
    ]


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
        raise UsageError(f"--starts {starts}: from 1 to {MAX_STARTS:,}")
    if seed is not None and seed < 0:
        raise UsageError(f"--seed {seed}: the seed must not be negative")
    angle = angle_from_option("--spread", spread or "1deg")
    if not 0.0 < angle <= pi:
        raise UsageError(f"--spread {spread}: the angle must be above 0 and at most 180 deg")
    return StartsChoice(starts, angle, seed or 0)


def starts_text(study: "StartStudy") -> str:
    """Format the distribution of falls from several starts."""
    rows = [("", "mean", "SD", "smallest", "largest")]
    rows += [
        (title, *(f"{value:.4g}" for value in _distribution(values)))
        for title, values in _studied(study)
        if np.isfinite(values).any()
    ]
    accuracy = f"{int(np.sum(study.is_accurate))} of {len(study)} held the tolerance to the end"
    title = (
        f"{format_count(len(study), 'start')}, angles {degrees(study.spread):.3g} deg apart (SD)"
    )
    return f"{title}, seed {study.seed}; {accuracy}\n{format_table(rows)}"


def starts_data(study: "StartStudy") -> dict[str, object]:
    """Return the falls from several starts for `--json`."""
    return {
        "spread_deg": degrees(study.spread),
        "seed": study.seed,
        "is_accurate": study.is_accurate.tolist(),
        "impact_s": _finite_list(study.impact_times),
        "max_force_N": _finite_list(study.max_forces),
        "peak_force_N": {name: _finite_list(one) for name, one in study.peak_forces.items()},
        "rest_height_m": _finite_list(study.rest_heights),
        "weight_carried": _finite_list(study.weights_carried),
    }


def _studied(study: "StartStudy") -> Iterator[tuple[str, Array]]:
    yield "first impact [s]", study.impact_times
    yield "largest force [N]", study.max_forces
    for name, forces in study.peak_forces.items():
        yield f"  {name} [N]", forces
    yield "rest height of the centre of mass [m]", study.rest_heights
    yield "weight carried", study.weights_carried


def _distribution(values: Array) -> tuple[float, ...]:
    found = values[np.isfinite(values)]
    deviation = float(np.std(found, ddof=1)) if found.size > 1 else 0.0
    return float(np.mean(found)), deviation, float(np.min(found)), float(np.max(found))


def _finite_list(values: Array) -> list[float | None]:
    return [finite_or_none(float(value)) for value in values]


SENSITIVE_ANGLE = 0.1
"""Difference of joint angles at which two falls are told apart [rad]."""


def contact_table(record: ContactRecord) -> list[tuple[str, ...]]:
    """Return the contact of each segment as the rows of a table."""
    rows: list[tuple[str, ...]] = [
        ("segment", "first contact [s]", "speed [m/s]", "peak force [N]", "at [s]", "impulse [N s]")
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


def _first_touch_text(record: ContactRecord) -> str:
    """Say which segment touches first after the start."""
    touches = {
        name: one.first_time for name, one in record.segments.items() if one.first_time is not None
    }
    if not touches:
        return "nothing was touched"
    at_start = [name for name, time in touches.items() if time <= min(touches.values())]
    later = {name: time for name, time in touches.items() if name not in at_start}
    text = f"{' and '.join(at_start)} touch{'es' if len(at_start) == 1 else ''} first"
    text += f", at {touches[at_start[0]]:.3g} s"
    if later:
        name = min(later, key=lambda name: later[name])
        speed = record.segments[name].impact_speed
        text += f"; then {name} at {later[name]:.3g} s with {speed:.2g} m/s"
    return text


def _names_text(names: list[str]) -> str:
    shown = ", ".join(names[:3]) + (f" and {len(names) - 3} more" if len(names) > 3 else "")
    return f"{shown} {_verb(names, 'has', 'have')}"


def _verb(names: list[str], one: str, several: str) -> str:
    return one if len(names) == 1 else several
