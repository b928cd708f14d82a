"""The springs of a figure: where they come from, and how files and the figure's fields combine."""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path

from generator.errors import Fault, InputError
from generator.figure import Figure, Joint, Vector
from generator.reader.draft import place_of
from generator.reader.findings import EnoughFaults, Findings
from generator.reader.given_coupled import coupled_of_figure, replaced_laws
from generator.reader.given_springs import GivenSpring, from_records, from_springs_file
from generator.reader.joint_axes import sign_along, unit_axis
from generator.reader.optional import records_in
from generator.reader.springs_choice import NONE, PRINTED, find_springs
from generator.reader.springs_file import SpringsFile, springs_in
from generator.reader.text_file import read_text
from generator.reader.vocabulary import shown
from generator.source import Source
from springs import AxisSpring, Damping, Elastic, Joining, JointSprings, Linear, SpringSet, Stop
from springs.coupled_report import Replaced
from springs.stop import ONSET, SLIDE_ONSET, SLIDE_STIFFNESS, STIFFNESS

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
            f"these springs were written for the figure `{shown(content.figure)}`",
            content.origins.get("figure"),
            f"they are used for `{shown(stem)}`",
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
            f"the damping of `{shown(joint.name)}` is negative",
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
