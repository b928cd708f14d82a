"""Contact on the command line: the options of repeated starts, and what a fall reports."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import degrees, pi
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from generator.cli.answer import Table, format_count
from generator.cli.options import angle_from_option
from generator.contact.record import (
    HEAD_CAVEAT,
    INJURY_CAVEAT,
    REST_DURATION,
    ContactRecord,
    PartContact,
    SegmentContact,
)
from generator.contact.scene import Cover
from generator.contact_file.parts import BodyPart
from generator.diagnostics import Diagnostic, InputError, UsageError, warning
from generator.figure import Figure
from generator.kinematics.range_of_motion import RangeExcess
from generator.model import Model
from generator.recording import Recording
from generator.rotations import Array
from springs.layer import Stages

if TYPE_CHECKING:
    from generator.contact.spheres import SegmentSpheres
    from generator.simulation.starts import StartStudy

MAX_STARTS = 10_000
"""Largest number of starts; more are a typing error."""

MIN_OVERLAP = 1e-3
"""Interpenetration of limbs from which it is worth a row [m]."""

MAX_PARTS = 11
"""Largest number of parts of the body in a summary; those with the largest forces are kept."""

MAX_RANGES = 4
"""Largest number of joints beyond their ranges in a summary."""


def add_sphere_warnings(
    figure: Figure, diagnostics: tuple[Diagnostic, ...]
) -> tuple[Diagnostic, ...]:
    """Append a warning of the segments that touch by a capsule for want of geometry.

    Raises InputError with all diagnostics for a psurf that cannot be read.
    """
    from generator.contact.spheres import SphereSource, fit_contact_spheres  # slow import

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
    """Warn of a run in which nothing was touched, or a layer was pressed through."""
    record = recording.contact
    for layer, part, time in () if record is None else record.pressed_layers:
        by = "" if layer.endswith(part) else f" by {part}"
        yield warning(f"{layer} was pressed through{by} at {time:.3g} s: what is below is hard")
    if record is None:
        return
    if any(one.first_time is not None for one in record.segments.values()):
        is_open = not any(prop.shape.is_endless for prop in recording.scene.props)
        if is_open and record.weight_carried == 0.0 and recording.outcome.reached_stop:
            yield warning("the figure falls past the props: --floor adds a floor")
        return
    yield warning(
        f"the figure touched nothing by {recording.times[-1]:.3g} s: increase --stop, or reduce "
        "--height"
    )


def contact_data(record: ContactRecord) -> dict[str, object]:
    """Return the contact of a run for `--json`; parts of a body that has some."""
    angles, heights, segments = record.sensitivity, record.height_sensitivity, record.segments
    parts = {name: _part_data(part) for name, part in record.parts.items()}
    return {
        "weight_carried": record.weight_carried,
        "max_force_N": record.max_force,
        "max_force_s": record.max_force_time,
        "max_penetration_m": record.max_depth,
        "max_penetration_segment": record.max_depth_segment,
        "dissipated_J": record.dissipated,
        "creep_m_per_s": record.creep,
        "first_contact_s": {name: one.first_time for name, one in segments.items()},
        "impact_speed_m_per_s": {name: one.impact_speed for name, one in segments.items()},
        "peak_force_N": {name: one.peak_force for name, one in segments.items()},
        "peak_force_s": {name: one.peak_time for name, one in segments.items()},
        "impulse_Ns": {name: one.impulse for name, one in segments.items()},
        "sensitivity_rad": None if angles is None else angles[-1],
        "height_sensitivity_m": None if heights is None else heights[-1],
        "impact_shift_s": record.impact_shift,
        "overlap": record.overlap,
        "head_injury_criterion": {
            name: record.head_injury.get(name)
            for name in dict.fromkeys((*record.heads, *record.head_injury))
        },
        "head": {
            name: {
                "peak_acceleration_g": head.peak_acceleration,
                "peak_acceleration_s": head.peak_time,
                "peak_force_head_weights": head.head_weights,
            }
            for name, head in record.heads.items()
        },
        **({"parts": parts} if parts else {}),
        **({"pressed_layers": record.pressed_layers} if record.pressed_layers else {}),
    }


def _part_data(part: PartContact) -> dict[str, object]:
    """Return the contact of a part for `--json`."""
    return {
        "first_contact_s": part.first_time,
        "impact_speed_m_per_s": part.impact_speed,
        "peak_force_N": part.peak_force,
        "peak_force_s": part.peak_time,
        "peak_force_body_weights": part.body_weights,
        "stiffness_band": part.band,
        "likely_force_N": part.force_band,
        "class": part.evidence,
        **({"within": part.within} if part.within else {}),
    }


def range_data(excesses: Sequence[RangeExcess]) -> list[dict[str, object]]:
    """Return the joints that a run turned beyond their ranges, for `--json`."""
    return [
        {
            "joint": each.joint,
            "motion": each.motion or None,
            f"limit_{each.units.displacement}": None
            if each.limit is None
            else each.units.scale * each.limit,
            f"beyond_{each.units.displacement}": each.units.scale * each.beyond,
            "time_s": each.time,
        }
        for each in excesses
    ]


def range_rows(excesses: Sequence[RangeExcess]) -> list[tuple[str, str]]:
    """Return the rows of a summary about joints that a run turned beyond their ranges."""
    texts = [str(each) for each in excesses[:MAX_RANGES]]
    more = len(excesses) - len(texts)
    if more:
        texts.append(f"and {more} more, less far")
    if texts:
        texts[-1] += "; of the frames"
    return list(zip(("range", *[""] * MAX_RANGES), texts, strict=False))


def parts_table(record: ContactRecord) -> Table | str:
    """Return the contact of the parts of the body that touched, in the order of their touches.

    Heads are always among them. "" where none did.
    """
    touched = {name: one for name, one in record.parts.items() if one.first_time is not None}
    if not touched:
        return ""
    by_force = sorted(
        touched, key=lambda name: (name not in record.heads, -touched[name].peak_force)
    )
    kept = sorted(by_force[:MAX_PARTS], key=lambda name: touched[name].first_time or 0.0)
    titles = ("touch [s]", "speed [m/s]", "force [N]", "likely [N]", "body weights", "class")
    rows: list[tuple[str, ...]] = [("part", *titles), *(_part_cells(n, touched[n]) for n in kept)]
    more = len(touched) - len(kept)
    return Table([*rows, (f"{more} more (--json)",)] if more else rows)


def _part_cells(name: str, part: PartContact) -> tuple[str, ...]:
    weights = "" if part.body_weights is None else f"{part.body_weights:.2g}"
    likely = " to ".join(f"{float(f'{force:.2g}'):g}" for force in part.force_band)
    numbers = f"{part.first_time:.3g}", f"{part.impact_speed:.2g}", f"{part.peak_force:.4g}"
    title = f"{name} of {part.within}" if part.within else name
    return title, *numbers, likely, weights, part.evidence.value


def laws_table(parts: Sequence[BodyPart]) -> Table:
    """Return laws, bands and classes of parts of the body, those of both sides in one row."""
    rows: dict[tuple[str, ...], str] = {}
    for part in parts:
        name, alike = part.name.removeprefix("left_").removeprefix("right_"), _law_cells(part)
        is_known = (name, *alike) in rows
        title = f"{part.name} of {part.within}" if part.within else part.name
        rows[name, *alike] = f"{name}, left and right" if is_known else title
    titles = ("part", "spheres", "stiffness [kN/m]", "damping [s/m]", "band", "class")
    return Table([titles, *((title, *cells) for (_, *cells), title in rows.items())])


def _law_cells(part: BodyPart) -> tuple[str, str, str, str, str]:
    """Return number of spheres, stages, damping, band and class of a part."""
    low, high = part.band
    return (
        *(str(len(part.spheres)), stages_text(part.law.stages), f"{part.law.damping:g}"),
        *(f"{low:g} to {high:g}", part.evidence.value),
    )


def stages_text(stages: Stages) -> str:
    """Return stiffnesses [kN/m] with the depths from which they hold."""
    (_, first), *later = stages
    return ", ".join(
        [f"{1e-3 * first:g}", *(f"{1e-3 * k:g} from {1e3 * x:g} mm" for x, k in later)]
    )


def _parts_text(model: Model, covers: Sequence[Cover]) -> str:
    """Return in how many parts the spheres are, and which are covered; "" without parts."""
    if model.contact is None:
        return ""
    covered = ", ".join(cover.part for cover in covers)
    text = f" of {format_count(len(model.contact.parts), 'part')}"
    return f"{text}, {covered} covered" if covered else text


def contact_rows(
    recording: Recording,
    spheres: "Mapping[str, SegmentSpheres]",
    *,
    self_contact: bool = False,
    covers: Sequence[Cover] = (),
) -> list[tuple[str, str]]:
    """Return the rows of a summary about a run with contact: title and text."""
    record = recording.contact
    assert record is not None
    count = sum(len(one.spheres) for one in spheres.values())
    errors = [one.largest_error for one in spheres.values() if one.largest_error is not None]
    fit = f"; error in height at most {1000.0 * max(errors):.0f} mm" if errors else ""
    parts = "" if recording.model is None else _parts_text(recording.model, covers)
    spheres_text = f"{format_count(count, 'sphere')}{parts}{fit}"
    touches: Mapping[str, SegmentContact | PartContact] = record.parts or record.segments
    rows = [("contact", spheres_text)]
    if not record.parts or all(one.first_time is None for one in record.parts.values()):
        rows += _touch_rows(recording, record)
    if record.max_force > 0.0:
        peak = max(touches, key=lambda name: touches[name].peak_force)
        force = f"at most {record.max_force:.4g} N, at {record.max_force_time:.3g} s"
        alone = f"on {peak} at most {touches[peak].peak_force:.4g} N"
        depth = f"at most {1000.0 * record.max_depth:.0f} mm, of {record.max_depth_part}"
        rows += [("force", f"{force}; {alone}"), ("depth", depth)]
        rows += _end_rows(recording, record)
    if record.overlap is not None and record.overlap.depth >= MIN_OVERLAP:
        depth, segment, other, _ = record.overlap
        text = f"{segment} and {other} by up to {1000.0 * depth:.0f} mm"
        rows.append(("overlap", text if self_contact else f"{text} (without --self-contact)"))
    return [*rows, *_head_rows(record)]


def _head_rows(record: ContactRecord) -> Iterator[tuple[str, str]]:
    """Yield the rows of each head that touches a prop, with their caveat."""
    for name, head in record.heads.items():
        if name not in record.segments or record.segments[name].first_time is None:
            continue
        title = "" if name == "head" else f"{name}: "
        force = f"{record.segments[name].peak_force:.4g} N, {head.head_weights:.0f} head weights"
        text = f"{title}at most {head.peak_acceleration:.0f} g, {force}"
        hic = record.head_injury.get(name)
        if hic is None:
            yield "head", f"{text}; HIC15 needs parts of the body"
            yield "", HEAD_CAVEAT
        else:
            yield "head", f"{text}, HIC15 {hic:.0f}"
            yield "", f"{HEAD_CAVEAT}; {INJURY_CAVEAT}"


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
    chaotic = record.chaotic_from(times)
    if chaotic is None:
        within = f"0.001 rad off: joint angles within {float(np.max(angles)):.2g} rad of these"
    else:
        within = f"chaotic from {chaotic:.3g} s: then read times, heights, energies and forces"
    known = np.flatnonzero(np.isfinite(heights))
    last = known[-1]
    until = "to the end" if last == len(times) - 1 else f"until {times[last]:.3g} s"
    height = f"{1000.0 * float(np.max(heights[known])):.3g} mm {until}"
    texts = [
        within,
        f"{'' if chaotic is None else '0.001 rad off: '}"
        f"height of the centre of mass within {height}",
    ]
    if record.impact_shift is not None:
        texts.append(f"first impact within {1000.0 * record.impact_shift:.2g} ms")
    lines = ",\n".join(texts).split("\n")
    return list(zip(("poses", "", ""), lines, strict=False))


class StartsChoice(NamedTuple):
    """Number of disturbed starts, the standard deviation of their angles [rad], and the seed."""

    number: int
    spread: float
    seed: int


def starts_from_options(
    starts: int | None, spread: str | None, seed: int | None
) -> StartsChoice | None:
    """Return the choice of `--starts`, `--spread` and `--seed`; None without starts.

    Raises UsageError for invalid values.
    """
    if starts is None:
        return None
    if not 1 <= starts <= MAX_STARTS:
        raise UsageError(f"--starts {starts}: expected a number from 1 to {MAX_STARTS:,}")
    if seed is not None and seed < 0:
        raise UsageError(f"--seed {seed}: the seed must not be negative")
    angle = angle_from_option("--spread", spread or "1deg")
    if not 0.0 < angle <= pi:
        raise UsageError(f"--spread {spread}: the angle must be above 0 and at most 180 deg")
    return StartsChoice(starts, angle, seed or 0)


@dataclass(frozen=True)
class StartsResult:
    """Falls from several starts, the entries of an array in their order."""

    study: "StartStudy"

    def to_json(self) -> dict[str, object]:
        """Return the numbers of all starts."""
        study = self.study
        return {
            "spread_deg": degrees(study.spread),
            "seed": study.seed,
            "is_accurate": study.is_accurate,
            "failures": study.failures,
            "impact_s": study.impact_times,
            "max_force_N": study.max_forces,
            "peak_force_N": study.peak_forces,
            "rest_height_m": study.rest_heights,
            "weight_carried": study.weights_carried,
        }

    def __str__(self) -> str:
        """Format the distribution of the falls."""
        study, count = self.study, len(self.study.impact_times)
        title = f"{format_count(count, 'start')}, angles varied by {degrees(study.spread):.3g} deg"
        lines = [f"{title} (SD), seed {study.seed}"]
        if study.is_accurate is not None:
            lines[0] += f"; {int(np.sum(study.is_accurate))} within the tolerance to the end"
        if study.failures:
            number, sentence = next(iter(study.failures.items()))
            lines.append(f"{len(study.failures)} failed; start {number}: {sentence}")
        if len(study.failures) < count:
            quantities = {
                "first impact [s]": study.impact_times,
                "largest force [N]": study.max_forces,
                "height of the centre of mass at the end [m]": study.rest_heights,
                "share of the weight carried at the end": study.weights_carried,
            }
            lines.append(_distribution_table(quantities))
        return "\n".join(lines)

    def details(self) -> str:
        """Format the distribution of the largest force on each segment."""
        if len(self.study.failures) == len(self.study.impact_times):
            return ""
        forces = {f"{name} [N]": values for name, values in self.study.peak_forces.items()}
        return f"largest force on each segment\n{_distribution_table(forces)}"


def _distribution_table(quantities: Mapping[str, Array]) -> str:
    """Format a row for each quantity that is known of some start."""
    rows = [["", "mean", "SD", "smallest", "largest"]]
    for title, values in quantities.items():
        found = values[np.isfinite(values)]
        if found.size:
            deviation = f"{np.std(found, ddof=1):.4g}" if found.size > 1 else "-"
            numbers = [f"{number:.4g}" for number in (np.mean(found), found.min(), found.max())]
            rows.append([title, numbers[0], deviation, *numbers[1:]])
    return str(Table(rows))


def contact_table(record: ContactRecord) -> Table:
    """Return the contact of each segment."""
    titles = ("first touch [s]", "speed [m/s]", "peak force [N]", "at [s]", "impulse [N s]")
    rows: list[tuple[str, ...]] = [("segment", *titles)]
    for name, one in record.segments.items():
        if one.first_time is None:
            rows.append((name, "none", "", "", "", ""))
        else:
            impulse = f"{float(np.linalg.norm(one.impulse)):.4g}"
            force = f"{one.peak_force:.4g}", f"{one.peak_time:.4g}", impulse
            rows.append((name, f"{one.first_time:.4g}", f"{one.impact_speed:.3g}", *force))
    return Table(rows)
