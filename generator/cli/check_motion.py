"""`mover check` of motions, tables, markers, and other programs' models."""

import re
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from shlex import quote

import numpy as np

from generator.cli.answer import Table, format_count
from generator.cli.options import format_frames
from generator.diagnostics import Diagnostic, Diagnostics, InputError, shorten, warning
from generator.inverse.external_loads import LOADS_FILE
from generator.inverse.markers import C3D_SUFFIX, TRC_FILE, Markers, read_c3d
from generator.inverse.smoothing import MAX_GAP
from generator.model_files.xml import parse_xml
from generator.motion_files import COORDINATES_FILE, read_action, read_npz
from generator.motion_files.motion import Header
from generator.motion_files.opensim_table import CoordinateTable
from generator.rotations import Array
from generator.text_io import is_file, load_text

MAX_RADIANS = 4.0 * np.pi
"""Angle from which radians seem to be degrees [rad]."""

MAX_MARKER_DISTANCE = 20.0
"""Distance of a marker from the origin above which its unit seems to be another one [m]."""

MAX_LISTED = 12
"""Names of columns or markers that are listed."""

_FORCE, _MOMENT = re.compile(r".*_v[xyz]"), re.compile(r".+_(moment|force)")

Checked = tuple[tuple[Diagnostic, ...], Sequence[str | Table], str]
"""Diagnostics, contents in words, and the command that takes the file; "" for none."""


def has_measured_suffix(name: str) -> bool:
    """Return whether a name is that of a motion, of markers, or of another program's model."""
    from generator.conversion import MACRO_SUFFIX, READABLE_SUFFIXES, is_model

    suffix = Path(name).suffix.lower()
    own = (*READABLE_SUFFIXES, TRC_FILE.suffix, C3D_SUFFIX, MACRO_SUFFIX)
    return suffix in own or (is_model(name) and not Path(name).is_dir())


def check_measured(name: str) -> Checked:
    """Check such a file. Raises UsageError."""
    from generator.conversion import check_no_macros

    check_no_macros(name)
    checks: dict[str, Callable[[str], Checked]] = {
        ".mot": _check_table,
        ".sto": _check_table,
        TRC_FILE.suffix: _check_markers,
        C3D_SUFFIX: _check_markers,
        ".action": _check_motion,
        ".npz": _check_motion,
    }
    try:
        return checks.get(Path(name).suffix.lower(), _check_model)(name)
    except InputError as failure:
        return tuple(failure.diagnostics), (), ""


def _check_table(name: str) -> Checked:
    """Check displacements of joints, forces of plates, or moments of inverse dynamics."""
    parsed = COORDINATES_FILE.parse_file(name, has_angles=False)
    table = parsed.value
    if table is None:
        return parsed.diagnostics, (), ""
    columns = _listed([title.text for title in table.titles], "column")
    frames = f"{format_frames(table.times)}{_rate(table.times)}"
    if table.titles and all(_MOMENT.fullmatch(title.text) for title in table.titles):
        about = f"{frames}: moments and forces of inverse dynamics\n{columns}"
        use = "results, such as those of `mover inverse`, which no command takes"
        return (*parsed.diagnostics, *_missing_cells(table)), [about], use
    forces = [title.text for title in table.titles if _FORCE.fullmatch(title.text)]
    is_of_forces = bool(forces) and 2 * len(forces) >= len(table.titles) // 3
    if not is_of_forces and "inDegrees" not in table.entries:
        return COORDINATES_FILE.parse_file(name).diagnostics, (), ""
    found = [*parsed.diagnostics, *_gaps(table.times), *_missing_cells(table)]
    unit = "degrees" if table.in_degrees else "radians"
    largest = float(np.nanmax(np.abs(table.numbers), initial=0.0))
    if not is_of_forces and not table.in_degrees and largest > MAX_RADIANS:
        hint = "write `inDegrees=yes` in the header if they are degrees"
        found.append(warning(f"values up to {largest:.3g} in a table of radians", hint=hint))
    what = "forces" if is_of_forces else f"displacements, with angles in {unit}"
    about = f"{frames}: {what}\n{columns}"
    file = quote(name)
    use = f"`mover inverse MODEL {file} -o moments.sto` takes it"
    if is_of_forces:
        prefix = forces[0][:-3]
        use = f"`mover inverse MODEL WALK.mot --forces {file} --force BODY={prefix}` takes it"
    return tuple(found), [about], use


def _missing_cells(table: CoordinateTable) -> Iterator[Diagnostic]:
    """Yield a warning for each column with numbers that are not finite."""
    missing: list[int] = (~np.isfinite(table.numbers)).sum(axis=0).tolist()
    for title, count in zip(table.titles, missing, strict=True):
        if count:
            numbers = format_count(count, "number")
            message = f"{numbers} of `{shorten(title.text)}` are not finite"
            yield warning(message, title, "other commands refuse them")


def _check_markers(name: str) -> Checked:
    is_c3d = Path(name).suffix.lower() == C3D_SUFFIX
    parsed = None if is_c3d else TRC_FILE.parse_file(name)
    markers = read_c3d(Path(name)) if parsed is None else parsed.value
    known = () if parsed is None else parsed.diagnostics
    if markers is None:
        return known, (), ""
    found = [*known, *_gaps(markers.times)]
    gone: list[int] = np.isnan(markers.positions).any(axis=2).sum(axis=0).tolist()
    missing = {one: count for one, count in zip(markers.names, gone, strict=True) if count}
    frames = len(markers.times)
    if never := [one for one, count in missing.items() if count == frames]:
        found.append(warning(f"markers without any position: {', '.join(map(shorten, never))}"))
    about = f"{format_frames(markers.times)}{_rate(markers.times)}\n"
    about += "\n".join([_listed(markers.names, "marker"), *_extents(markers, found)])
    rows = [["missing", "frames", "of"]]
    rows += [[shorten(one), str(count), str(frames)] for one, count in missing.items()]
    sections = [about, *([Table(rows)] if missing else [])]
    return tuple(found), sections, f"`mover track FIGURE {quote(name)} -o walk.mot` takes it"


def _extents(markers: Markers, found: list[Diagnostic]) -> Iterator[str]:
    """Yield the space that the markers are in; a warning if it is too large."""
    points: Array = markers.positions[~np.isnan(markers.positions).any(axis=2)]
    if not len(points):
        return
    low, high = points.min(axis=0), points.max(axis=0)
    ends = zip("xyz", low, high, strict=True)
    yield "markers are at " + ", ".join(f"{a} {b:.3g} to {c:.3g} m" for a, b, c in ends)
    if max(np.abs(low).max(), np.abs(high).max()) > MAX_MARKER_DISTANCE:
        hint = "the `Units` of the file may be others"
        far = f"markers are more than {MAX_MARKER_DISTANCE:g} m from the origin"
        found.append(warning(far, hint=hint))


def _check_motion(name: str) -> Checked:
    """Check a motion or a run of this program."""
    header: Header
    if Path(name).suffix.lower() == ".npz":
        header, run = read_npz(name)
        times = run.times
    else:
        action = read_action(name)
        header, times = action.header, action.times
    about = f"{format_frames(times, header.figure)}: {header.message}"
    return (), [f"{about}\nsprings: {header.springs}"], f"`mover view {quote(name)}` shows it"


def _check_model(name: str) -> Checked:
    """Check another program's model, or a file of external loads."""
    from generator.model_files.formats import read_model

    file = quote(name)
    if Path(name).suffix.lower() == LOADS_FILE.suffix and is_file(Path(name)) and _is_loads(name):
        loads = LOADS_FILE.parse_file(name)
        if loads.value is None:
            return loads.diagnostics, (), ""
        bodies = ", ".join(row.body for row in loads.value.rows)
        about = f"forces of {loads.value.table} on {bodies}"
        return (
            loads.diagnostics,
            [about],
            f"`mover inverse MODEL WALK.mot --forces {file}` takes it",
        )
    imported = read_model(name)
    figure, losses = imported.figure, imported.losses.entries
    about = (
        f"{format_count(len(figure.bodies), 'segment')} of {figure.total_mass:.4g} kg, "
        f"{figure.freedoms}; "
        f"lost as a figure: {len(losses)}"
    )
    use = f"`mover convert {file} {quote(Path(name).stem)}.fig` makes a figure of it"
    return (), ["\n".join([about, *(f"  {loss}" for loss in losses)])], use


def _is_loads(name: str) -> bool:
    """Return whether a file is of OpenSim's external loads, as far as it can be read."""
    source, problem = load_text(Path(name), name)
    root = None if problem is not None else parse_xml(source, Diagnostics())
    return root is not None and any(each.tag == "ExternalLoads" for each in root.walk())


def _gaps(times: Array) -> Iterator[Diagnostic]:
    """Yield a warning of the longest gap between frames."""
    steps = np.diff(times)
    if len(steps) and steps.max() > MAX_GAP * np.median(steps):
        k = int(np.argmax(steps))
        hint = "`mover inverse` needs a motion without gaps"
        message = f"no frame lies between {times[k]:g} and {times[k + 1]:g} s"
        yield warning(message, hint=hint)


def _rate(times: Array) -> str:
    """Return the mean number of frames per second, in words."""
    duration = float(times[-1] - times[0])
    return f", {(len(times) - 1) / duration:.4g} a second" if duration else ""


def _listed(names: Sequence[str], noun: str) -> str:
    """Return the number of names, and some of them."""
    shown = ", ".join(map(shorten, names[:MAX_LISTED]))
    more = f" and {len(names) - MAX_LISTED} more" if len(names) > MAX_LISTED else ""
    return f"{format_count(len(names), noun)}: {shown}{more}"
