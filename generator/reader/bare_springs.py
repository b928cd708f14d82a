"""A springs file by itself: its curves, and the figure it was written for where there is one."""

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from generator.errors import Fault
from generator.figure import Vector
from generator.reader.figure_file import SUFFIX, examine_figure, shipped_figures
from generator.reader.findings import EnoughFaults, Findings
from generator.reader.given_coupled import coupled_springs, replaced_laws
from generator.reader.given_springs import GivenSpring, entry_spring, without_repeats
from generator.reader.passive import springs_for
from generator.reader.springs_file import SpringsFile, springs_in
from generator.reader.text_file import read_text
from generator.reader.vocabulary import shown
from springs import AxisSpring, Joining, JointSprings, SpringSet
from springs.coupled_report import Replaced
from springs.joint import UNKNOWN_AXIS

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
                    f"the figure `{shown(content.figure)}` is not to be found or cannot be read",
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
    beside = folder / f"{content.figure}{SUFFIX}"
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
