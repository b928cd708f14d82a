"""What a links file means for a figure: links of degrees of freedom, or faults with places."""

from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from generator.errors import Fault, InputError, nearest
from generator.figure import Figure, Joint
from generator.posture.links import Freedom, Link, LinkError, Links, cycle_said, cycles
from generator.posture.mirror import MirrorError, freedoms_said, mirror_signs
from generator.reader.findings import EnoughFaults, Findings
from generator.reader.links_file import LARGEST_FACTOR, LinkEntry, LinksFile, links_in
from generator.reader.text_file import read_text
from generator.reader.vocabulary import shown
from generator.source import Span


@dataclass(frozen=True)
class LinksReading:
    """What came of reading links for a figure; `links` is None when `faults` holds an error."""

    links: Links | None
    faults: tuple[Fault, ...]


def read_links(path: str | Path, figure: Figure) -> Links:
    """The links in a file. Raises InputError, which holds all faults, when anything is wrong."""
    reading = examine_links(path, figure)
    if reading.links is None:
        raise InputError(reading.faults)
    return reading.links


def examine_links(path: str | Path, figure: Figure) -> LinksReading:
    """The links in a file, with all faults; bad input raises nothing."""
    source, fault = read_text(Path(path), str(path))
    if fault is not None:
        return LinksReading(None, (fault,))
    findings, links = Findings(), None
    with suppress(EnoughFaults):
        content = links_in(source, findings)
        if content is not None:
            links = links_of(content, figure, findings)
    return LinksReading(None if findings.has_errors else links, findings.in_order())


def links_of(content: LinksFile, figure: Figure, findings: Findings) -> Links | None:
    """The links of a figure that a file describes; None, with faults noted, if any is wrong."""
    stem = None if figure.path is None else figure.path.stem
    if content.figure and stem and content.figure != stem:
        findings.warning(
            f"these links were written for the figure `{shown(content.figure)}`",
            content.origins.get("figure"),
            f"they are used for `{shown(stem)}`",
        )
    placed: dict[Freedom, tuple[Link, Span | None]] = {}
    for entry in content.entries:
        for link, place in _links(entry, figure, findings):
            if link.follower in placed:
                first = placed[link.follower][1]
                hint = f"the first stands in line {first.line}" if first else ""
                findings.error(f"a second link of {link.follower}", place, hint)
                continue
            placed[link.follower] = (link, place)
    links = tuple(link for link, _ in placed.values())
    told: set[Span | None] = set()
    order = list(placed)
    for cycle in cycles(links):
        place = placed[max(cycle, key=order.index)][1]
        if place not in told:  # whole joints make a cycle for each of their degrees of freedom
            hint = "one of them must follow nothing" if len(cycle) > 1 else ""
            findings.error(cycle_said(cycle), place, hint)
        told.add(place)
    if findings.has_errors:
        return None
    try:
        made = Links(links)
    except LinkError as failure:
        findings.error(str(failure), None)
        return None
    for link in made.resolved:
        if abs(link.factor) > LARGEST_FACTOR:
            findings.error(
                f"{link.follower} follows {link.control} by the factor {link.factor:.4g}",
                placed[link.follower][1],
                f"factors multiply along the chain; from -{LARGEST_FACTOR:.0e} to "
                f"{LARGEST_FACTOR:.0e}",
            )
    return None if findings.has_errors else made


def _links(
    entry: LinkEntry, figure: Figure, findings: Findings
) -> Iterator[tuple[Link, Span | None]]:
    """The links of one table, each with the place of the joint that follows."""
    control = _joint(entry.control, figure, entry.place("control"), findings)
    for k, name in enumerate(entry.joints):
        place = entry.place(f"joints.{k}")
        joint = _joint(name, figure, place, findings)
        if control is None or joint is None:
            continue
        for one, other, sign in _pairs(entry, figure, control, joint, place, findings):
            follower, followed = Freedom(joint.name, one), Freedom(control.name, other)
            if _fits(entry, joint, control, follower, followed, place, findings):
                try:
                    link = Link(follower, followed, sign * entry.factor, entry.offset)
                except LinkError as failure:
                    if 0.0 < abs(entry.factor) <= LARGEST_FACTOR:  # others have been told
                        findings.error(str(failure), place)
                    break
                yield link, place


def _joint(name: str, figure: Figure, place: Span | None, findings: Findings) -> Joint | None:
    joint = figure.joints.get(name)
    if joint is None:
        hint = nearest(name, figure.joints)
        findings.error(f"the figure has no joint `{shown(name)}`", place, hint)
    elif not joint.chain:
        findings.error(f"joint `{shown(name)}` does not move", place, "it has no `type`")
        return None
    return joint


def _pairs(
    entry: LinkEntry,
    figure: Figure,
    control: Joint,
    joint: Joint,
    place: Span | None,
    findings: Findings,
) -> list[tuple[int, int, int]]:
    """Places of follower and control in their chains, and a sign; none, with a fault noted."""
    if entry.mirror:
        try:
            signs = mirror_signs(figure, control, joint)
        except MirrorError as failure:
            findings.error(str(failure), place, "without `mirror`, link by degree of freedom")
            return []
        return [(k, k, sign) for k, sign in enumerate(signs)]
    count, others = len(joint.chain), len(control.chain)
    if entry.dof is None and entry.control_dof is None:
        if count != others:
            findings.error(
                f"`{shown(joint.name)}` has {freedoms_said(count)} "
                f"and `{shown(control.name)}` {others}",
                place,
                "link them by degree of freedom: `dof = 1` and `control_dof = 1`",
            )
            return []
        if entry.offset and count > 1:
            hint = "with `dof` and `control_dof`, in a table for each"
            findings.error("an offset belongs to one degree of freedom", _offset_place(entry), hint)
            return []
        return [(k, k, 1) for k in range(count)]
    one = _place_in(joint, entry.dof, "dof", entry, place, findings)
    other = _place_in(control, entry.control_dof, "control_dof", entry, place, findings)
    return [] if one is None or other is None else [(one, other, 1)]


def _place_in(
    joint: Joint,
    given: int | None,
    key: str,
    entry: LinkEntry,
    place: Span | None,
    findings: Findings,
) -> int | None:
    """The degree of freedom that a key means; the only one of a joint need not be said."""
    count = len(joint.chain)
    if given is None and count == 1:
        return 0
    if given is None:
        findings.error(
            f"this link does not say which of the {count} degrees of freedom of "
            f"`{shown(joint.name)}` it means",
            place,
            f"write `{key} = 1`, or up to {count}",
        )
        return None
    if given >= count:
        findings.error(
            f"`{shown(joint.name)}` has {freedoms_said(count)}, not {given + 1}", entry.place(key)
        )
        return None
    return given


def _fits(
    entry: LinkEntry,
    joint: Joint,
    control: Joint,
    follower: Freedom,
    followed: Freedom,
    place: Span | None,
    findings: Findings,
) -> bool:
    """Whether both turn or both slide, and the offset is of their kind."""
    kind = joint.chain[follower.index].kind
    if kind != control.chain[followed.index].kind:
        verbs = {"R": "turns", "T": "slides"}
        findings.error(
            f"{follower} {verbs[kind]} and {followed} "
            f"{verbs[control.chain[followed.index].kind]}: a link joins like with like",
            place,
        )
        return False
    if entry.offset and entry.offset_is_length != (kind == "T"):
        unit = "offset_m" if kind == "T" else "offset_deg"
        findings.error(f"the offset of {follower} is `{unit}`", _offset_place(entry))
        return False
    return True


def _offset_place(entry: LinkEntry) -> Span | None:
    return entry.place("offset_m" if entry.offset_is_length else "offset_deg")
