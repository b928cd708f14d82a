"""The springs of a figure: where they come from, and how files and the figure's fields combine.

Which file holds the springs of a figure: what stands beside it, or what a user chooses.

A springs file by itself: its curves, and the figure it was written for where there is one.
"""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path

from generator.diagnostics import EnoughFaults, Fault, Findings, InputError, Source, error, shorten
from generator.figure import Figure, Joint, Vector
from generator.figure_file.read import FIGURE_SUFFIX, examine_figure, shipped_figures
from generator.figure_file.resolve import place_of
from generator.springs_file.axes import sign_along, unit_axis
from generator.springs_file.bind import (
    GivenSpring,
    entry_spring,
    from_records,
    from_springs_file,
    without_repeats,
)
from generator.springs_file.bind_coupled import coupled_of_figure, coupled_springs, replaced_laws
from generator.springs_file.optional import records_in
from generator.springs_file.parse import SPRINGS_SUFFIX, SpringsFile, springs_in
from generator.text_io import read_text
from springs import AxisSpring, Damping, Elastic, Joining, JointSprings, Linear, SpringSet, Stop
from springs.joint import UNKNOWN_AXIS
from springs.lint.report import Replaced
from springs.stop import ONSET, SLIDE_ONSET, SLIDE_STIFFNESS, STIFFNESS

OPTIONAL_SUFFIX = ".optional"

NONE = "none"
PRINTED = "printed"

_FILE_SUFFIXES = (".toml", OPTIONAL_SUFFIX)


def find_springs(
    directory: Path | None, stem: str | None, choice: str | Path | None
) -> tuple[Path | None, Fault | None]:
    """The file to read, None where the figure speaks for itself; or the fault that there is none.

    Args:
        directory: where the figure's file lies; None when it is from no file.
        stem: the file's name without the suffix; None likewise.
        choice: None for what stands beside the figure; "printed" for the `optional` file there; the
            path of a file; or NAME for `STEM.NAME.springs.toml` beside the figure.
    """
    if choice is None:
        return _beside(directory, stem, (SPRINGS_SUFFIX, OPTIONAL_SUFFIX)), None
    name = str(choice)
    if name == PRINTED:
        path = _beside(directory, stem, (OPTIONAL_SUFFIX,))
        return path, None if path is not None else _no_printed_values(stem)
    if directory is None or stem is None or not _is_name(choice):
        return Path(choice), None
    for full in (f"{stem}.{name}{SPRINGS_SUFFIX}", f"{name}{SPRINGS_SUFFIX}"):
        if _is_file(directory / full):
            return directory / full, None
    known = (*named_springs(directory, stem), NONE, PRINTED)
    return None, error(
        f"there are no springs `{shorten(name)}` beside the figure `{shorten(stem)}`",
        hint=f"there are {', '.join(known)}; else name a file",
    )


def named_springs(directory: Path, stem: str) -> tuple[str, ...]:
    """The names that choose springs beside a figure."""
    paths = directory.glob("*" + SPRINGS_SUFFIX)
    names = (path.name.removesuffix(SPRINGS_SUFFIX) for path in paths)
    return tuple(sorted(n.removeprefix(f"{stem}.") for n in names if n.startswith(f"{stem}.")))


def _is_name(choice: str | Path) -> bool:
    """Whether a choice looks like a name and not like the path of a file."""
    path = Path(choice)
    is_word = len(path.parts) == 1 and path.suffix not in _FILE_SUFFIXES
    return not str(choice) or (is_word and not _is_file(path))


def _is_file(path: Path) -> bool:
    try:
        return path.is_file()
    except OSError:  # longer than any file's name
        return False


def _beside(directory: Path | None, stem: str | None, suffixes: tuple[str, ...]) -> Path | None:
    """The first file with one of these endings beside a figure."""
    if directory is None or stem is None:
        return None
    paths = (directory / f"{stem}{suffix}" for suffix in suffixes)
    return next((path for path in paths if path.exists()), None)


def _no_printed_values(stem: str | None) -> Fault:
    if stem is None:
        return error("a figure from no file has no printed values", hint="name a file of springs")
    name = f"{shorten(stem)}{OPTIONAL_SUFFIX}"
    return error(
        f"there is no `{name}` beside the figure", hint="the printed values are those of that file"
    )


OWN = "figure's own stiff/rest/damp"


@dataclass(frozen=True)
class PassiveReading:
    """What came of looking for a figure's springs.

    Attributes:
        springs: None when `faults` has an error.
        faults: all that was found.
        replaced: laws over several joints that stand for others.
    """

    springs: SpringSet | None
    faults: tuple[Fault, ...]
    replaced: tuple[Replaced, ...] = ()


def springs_for(
    figure: Figure,
    directory: Path | None = None,
    stem: str | None = None,
    choice: str | Path | None = None,
    joining: Joining | None = None,
) -> PassiveReading:
    """The passive springs of a figure, with all faults; bad input raises nothing.

    A spring from a file replaces `stiff`, `rest` and `damp` on its axis; the figure's limits are
    stops on top of whatever law an axis has.

    Args:
        figure: the figure.
        directory: where its file lies; None when it is from no file.
        stem: its file's name without the suffix; None likewise.
        choice: None for `STEM.springs.toml` beside the figure, else `STEM.optional`, else what the
            figure itself says; "none" for no springs and no stops; "printed" for `STEM.optional`
            with every moment as printed; NAME for `STEM.NAME.springs.toml` beside the figure; else
            the path of a springs file (`.toml`) or of an `optional` file.
        joining: how the axes of a spherical joint join; None for what the file says, else
            conservative.
    """
    if choice is not None and str(choice) == NONE:
        return PassiveReading(SpringSet({}, joining or Joining.CONSERVATIVE, NONE), ())
    path, missing = find_springs(directory, stem, choice)
    if missing is not None:
        return PassiveReading(None, (missing,))
    findings, springs, content = Findings(), None, None
    with suppress(EnoughFaults):
        given = []
        if path is not None:
            given, content = _given_by(figure, path, stem, str(choice) == PRINTED, findings)
        springs = _spring_set(figure, path, given, content, joining, findings)
    if findings.has_errors:
        return PassiveReading(None, findings.in_order())
    replaced = () if content is None else replaced_laws(content)
    return PassiveReading(springs, findings.in_order(), replaced)


def read_springs(path_or_name: str | Path, figure: Figure) -> SpringSet:
    """The springs in a file, hung on the joints of a figure.

    Joints that the file does not name keep the figure's own `stiff`, `rest` and `damp`, and all
    joints its limits.

    Args:
        path_or_name: of the file, or what `--springs` takes: NAME for `FIGURE.NAME.springs.toml`
            beside the figure's file, "printed" or "none".
        figure: that gets them.

    Raises:
        InputError: anything is wrong; it holds all faults. Warnings pass.
    """
    folder, stem = (None, None) if figure.path is None else (figure.path.parent, figure.path.stem)
    reading = springs_for(figure, folder, stem, path_or_name)
    if reading.springs is None:
        raise InputError(reading.faults)
    return reading.springs


def _given_by(
    figure: Figure, path: Path, stem: str | None, printed: bool, findings: Findings
) -> tuple[list[GivenSpring], SpringsFile | None]:
    """What the file at `path` gives the axes of a figure; its content if it is a springs file."""
    source, fault = read_text(path, str(path))
    if fault is not None:
        findings.error(fault.message, fault.span, fault.hint)
        return [], None
    if path.suffix != ".toml":
        return from_records(figure, records_in(source, findings), printed, findings), None
    content = _content(source, stem, findings)
    return [] if content is None else from_springs_file(figure, content, findings), content


def _spring_set(
    figure: Figure,
    path: Path | None,
    given: Sequence[GivenSpring],
    content: SpringsFile | None,
    joining: Joining | None,
    findings: Findings,
) -> SpringSet:
    """The springs that a file gives and the figure's own."""
    joints = {
        name: springs
        for name, joint in figure.joints.items()
        if (springs := _combined(joint, given, findings)) is not None
    }
    law = None if content is None else content.law
    coupled = () if content is None else coupled_of_figure(figure, content, findings)
    origin = OWN if path is None else path.name
    return SpringSet(joints, joining or law or Joining.CONSERVATIVE, origin, coupled)


def _content(source: Source, stem: str | None, findings: Findings) -> SpringsFile | None:
    """What a springs file says, with a warning when that is meant for another figure."""
    content = springs_in(source, findings)
    if content is not None and content.figure and stem and content.figure != stem:
        findings.warning(
            f"these springs were written for the figure `{shorten(content.figure)}`",
            content.origins.get("figure"),
            f"they are used for `{shorten(stem)}`",
        )
    return content


def _combined(
    joint: Joint, all_given: Sequence[GivenSpring], findings: Findings
) -> JointSprings | None:
    """The springs of a joint in the order of its chain, then those about axes it does not name.

    None for a joint without any.
    """
    given = [one for one in all_given if one.joint == joint.name]
    used: list[GivenSpring] = []
    axes: list[AxisSpring] = []
    slides: list[AxisSpring] = []
    for k, factor in enumerate(joint.chain):
        axis = unit_axis(factor.axis)
        if factor.kind == "T":
            slides += _own_spring(joint, k, axis, (SLIDE_STIFFNESS, SLIDE_ONSET), findings)
            continue
        match = next((one for one in given if sign_along(one.spring.direction, axis)), None)
        if match is None:
            axes += _own_spring(joint, k, axis, (STIFFNESS, ONSET), findings)
        elif match not in used:
            used.append(match)
            axes.append(_with_stops(joint, match))
    axes += [one.spring for one in given if one not in used]
    return JointSprings(joint.name, tuple(axes), tuple(slides)) if axes or slides else None


def _with_stops(joint: Joint, given: GivenSpring) -> AxisSpring:
    """A given spring and the stops of all the joint's factors about its axis."""
    laws: list[Elastic] = list(given.spring.elastic)
    for k, factor in enumerate(joint.chain):
        sign = sign_along(given.spring.direction, factor.axis) if factor.kind == "R" else 0
        if sign:
            stops = _stops(joint, k, given.stop_stiffness, given.stop_onset)
            laws += stops if sign > 0 else [stop.mirrored() for stop in stops]
    return replace(given.spring, elastic=tuple(laws))


def _own_spring(
    joint: Joint, k: int, axis: Vector, stop: tuple[float, float], findings: Findings
) -> list[AxisSpring]:
    """What the figure says of factor `k`: one spring, or nothing."""
    laws: list[Elastic] = []
    if joint.stiff is not None and joint.stiff[k] != 0.0:
        laws.append(Linear(joint.stiff[k], joint.rest[k] if joint.rest is not None else 0.0))
    laws += _stops(joint, k, *stop)
    viscous = joint.damp[k] if joint.damp is not None else 0.0
    if viscous < 0.0:
        findings.error(
            f"the damping of `{shorten(joint.name)}` is negative",
            place_of(joint.origins, "damp"),
            "it would feed energy",
        )
        return []
    return [AxisSpring(axis, tuple(laws), Damping(viscous))] if laws or viscous else []


def _stops(joint: Joint, k: int, stiffness: float, onset: float) -> list[Stop]:
    """The stop at the limits of factor `k`, if it has any."""
    lower = None if joint.lower_limit is None else joint.lower_limit[k]
    upper = None if joint.upper_limit is None else joint.upper_limit[k]
    return [] if lower is None and upper is None else [Stop(lower, upper, stiffness, onset)]


_AXES: Mapping[str | None, Vector] = {
    "x": (1.0, 0.0, 0.0),
    "y": (0.0, 1.0, 0.0),
    "z": (0.0, 0.0, 1.0),
    None: UNKNOWN_AXIS,
}


@dataclass(frozen=True)
class BareReading:
    """What came of reading a springs file by itself.

    Attributes:
        springs: None when `faults` holds an error.
        figure: name of the figure whose joints they were given to, or None without any.
        faults: all that was found.
        replaced: laws over several joints that stand for others.
    """

    springs: SpringSet | None
    figure: str | None
    faults: tuple[Fault, ...]
    replaced: tuple[Replaced, ...] = ()


def examine_springs(path: Path) -> BareReading:
    """The springs in a file, with all faults; bad input raises nothing.

    The figure that the file names is looked for beside it and among the shipped ones. Without one,
    joints and their axes are taken as the file has them.
    """
    source, fault = read_text(path, str(path))
    if fault is not None:
        return BareReading(None, None, (fault,))
    findings, springs, content = Findings(), None, None
    with suppress(EnoughFaults):
        content = springs_in(source, findings)
        if content is not None and not findings.has_errors:
            file = _figure_file(content, path.parent)
            reading = None if file is None else examine_figure(file)
            if reading is not None and reading.figure is not None:
                given = springs_for(reading.figure, path.parent, content.figure, path)
                return BareReading(given.springs, content.figure, given.faults, given.replaced)
            if content.figure is not None:
                findings.warning(
                    f"the figure `{shorten(content.figure)}` is not to be found or cannot be read",
                    content.origins.get("figure"),
                    "joints and axes are taken as they stand here",
                )
            springs = _springs_alone(content, path.name, findings)
    if findings.has_errors or content is None:
        return BareReading(None, None, findings.in_order())
    return BareReading(springs, None, findings.in_order(), replaced_laws(content))


def _figure_file(content: SpringsFile, folder: Path) -> Path | None:
    """The file of the figure for which springs were written."""
    if content.figure is None:
        return None
    beside = folder / f"{content.figure}{FIGURE_SUFFIX}"
    return beside if beside.is_file() else shipped_figures().get(content.figure)


def _springs_alone(content: SpringsFile, origin: str, findings: Findings) -> SpringSet:
    """The springs without a figure: no limits bound an axis, and which is the only one is unknown.

    Whatever that is, a second spring about it is one too many, and so is one about another axis.
    """
    given: list[GivenSpring] = []
    for entry in content.entries:
        for k, name in enumerate(entry.joints):
            spring = entry_spring(name, entry, _AXES[entry.axis], findings, bounded=False)
            if spring is not None:
                given.append(GivenSpring(name, spring, entry.origins.get(f"joints.{k}")))
    axes: dict[str, list[AxisSpring]] = {}
    for one in without_repeats(given, findings):
        axes.setdefault(one.joint, []).append(one.spring)
    joints = {name: JointSprings(name, tuple(springs)) for name, springs in axes.items()}
    coupled = coupled_springs(content, lambda hung, _: _AXES[hung.axis], findings)
    return SpringSet(joints, content.law or Joining.CONSERVATIVE, origin, coupled)
