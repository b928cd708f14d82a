"""Linked joints: degrees of freedom that follow others in proportion (thesis, section 5.5).

The thesis links whole joints, `theta_i = c_i theta_control` (eq. 5.50), and wishes for links by
degree of freedom. A link here is one of these; a link of whole joints is one for each of their
degrees of freedom. A follower may control others in its turn: factors then multiply along the
chain.

What a links file means for a figure: links of degrees of freedom, or faults with places.
"""

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from pathlib import Path
from typing import assert_never

import numpy as np

from generator.diagnostics import (
    Diagnostics,
    ModelError,
    Parsed,
    Source,
    Span,
    shorten,
    spelling_hint,
)
from generator.figure import AxisKind, Figure, Joint, JointAxis
from generator.input_files.links import MAX_LINK_FACTOR, LinkEntry, LinksFile, parse_links_source
from generator.kinematics.placement import Displacements, Placement, forward_kinematics, site_pose
from generator.kinematics.tree import build_tree
from generator.rotations import Array, unit_vector
from generator.text_io import parse_file

PARALLEL_TOLERANCE = 1e-6
"""Largest distance between unit vectors that count as one."""

MIRROR_POSITION_TOLERANCE = 0.01
"""Largest distance of places that count as mirror images, as part of that from the plane."""

_SIDE_PATTERN = re.compile(r"left|right")

_MIRROR_SIGNS = np.array([-1.0, 1.0, 1.0])


def format_dof_count(count: int) -> str:
    """`1 degree of freedom`, `3 degrees of freedom`."""
    return f"{count} degree{'' if count == 1 else 's'} of freedom"


def mirror_signs(figure: Figure, control: Joint, follower: Joint) -> tuple[int, ...]:
    """Signs by which `follower` has to take the displacements of `control` to be its image.

    They are all +1 where the figure declares the axes of the other side as mirror images, as the
    prototype does with its negative axes.

    Args:
        figure: the figure of both.
        control: the joint that is mirrored.
        follower: the joint of the other side.

    Raises:
        ModelError: no signs make them mirror images.
    """
    if len(control.chain) != len(follower.chain):
        raise ModelError(
            f"`{control.name}` has {format_dof_count(len(control.chain))} and "
            f"`{follower.name}` {len(follower.chain)}"
        )
    tree = build_tree(figure)
    zeros = {name: np.zeros(len(joint.chain)) for name, joint in figure.joints.items()}
    placement = forward_kinematics(tree, zeros)
    if not (_names_match(control, follower) or _positions_match(placement, control, follower)):
        raise ModelError(
            f"`{follower.name}` is no mirror image of `{control.name}`: neither do their names "
            "differ in left and right alone, nor are their places mirror images in the plane x = 0"
        )
    signs: list[int] = []
    for number, (one, other) in enumerate(zip(control.chain, follower.chain, strict=True), 1):
        image = _mirrored_direction(_axis_in_world(placement, control, one), one.kind)
        sign = _relative_sign(image, _axis_in_world(placement, follower, other))
        if one.kind != other.kind or sign is None:
            raise ModelError(
                f"degree of freedom {number} of `{follower.name}` is no mirror image of that of "
                f"`{control.name}`"
            )
        signs.append(sign)
    return tuple(signs)


def _mirrored_direction(direction: Array, kind: AxisKind) -> Array:
    """Mirror image in the plane x = 0 of an axis to slide along, or of one to turn about."""
    match kind:
        case AxisKind.ROTATION:
            return -_MIRROR_SIGNS * direction
        case AxisKind.TRANSLATION:
            return _MIRROR_SIGNS * direction
        case _:
            assert_never(kind)


def _names_match(one: Joint, other: Joint) -> bool:
    """Whether the names are the same but for `left` and `right`, which stand for each other."""
    exchanged = _SIDE_PATTERN.sub(lambda side: "right" if side[0] == "left" else "left", one.name)
    return exchanged == other.name != one.name


def _positions_match(placement: Placement, one: Joint, other: Joint) -> bool:
    """Whether the joints lie off the plane, each where the other one's image is."""
    place, opposite = (site_pose(placement, joint, "parent")[:3, 3] for joint in (one, other))
    return bool(
        np.linalg.norm(_MIRROR_SIGNS * place - opposite) < MIRROR_POSITION_TOLERANCE * abs(place[0])
    )


def _axis_in_world(placement: Placement, joint: Joint, factor: JointAxis) -> Array:
    """Axis along or about which the segment farther from the root moves, shape (3,)."""
    axis = site_pose(placement, joint, "parent")[:3, :3] @ unit_vector(factor.axis)
    forward = next(
        (branch.parent_is_inboard for branch in placement.tree.joints if branch.joint is joint),
        True,
    )
    return axis if forward else -axis


def _relative_sign(one: Array, other: Array) -> int | None:
    if np.linalg.norm(one - other) < PARALLEL_TOLERANCE:
        return 1
    return -1 if np.linalg.norm(one + other) < PARALLEL_TOLERANCE else None


MAX_LINK_VALUE = 1e300
"""Displacements beyond this count as infinite: in degrees they would be [rad or m]."""


@dataclass(frozen=True, order=True)
class Coordinate:
    """One degree of freedom of a joint: `index` is its place in the chain, from 0."""

    joint: str
    index: int

    def __str__(self) -> str:
        """Joint and number, counted from 1."""
        return f"{self.joint} {self.index + 1}"


@dataclass(frozen=True)
class Link:
    """follower = factor * control + offset, with displacements in rad or m.

    Raises ModelError for a factor of zero, which links nothing, and for numbers that are not finite.
    """

    follower: Coordinate
    control: Coordinate
    factor: float = 1.0
    offset: float = 0.0

    def __post_init__(self) -> None:
        """Refuse what is no link."""
        if not (abs(self.factor) <= MAX_LINK_VALUE and abs(self.offset) <= MAX_LINK_VALUE):
            raise ModelError(f"the link of {self.follower} has a number that is not finite")
        if self.factor == 0.0:
            raise ModelError(f"a factor of zero links {self.follower} to nothing")

    def compose(self, earlier: "Link") -> "Link":
        """This link with its control expressed by the control of `earlier`, which moves it.

        Raises ModelError when the product of the factors is beyond the floats.
        """
        offset = self.factor * earlier.offset + self.offset
        return Link(self.follower, earlier.control, self.factor * earlier.factor, offset)


@dataclass(frozen=True)
class Links:
    """Links that hold together: each follower has one control, and no chain of them is closed.

    Attributes:
        links: as they were given.

    Raises:
        ModelError: a degree of freedom follows twice, or links go round; the message names them.
    """

    links: tuple[Link, ...] = ()

    def __post_init__(self) -> None:
        """Refuse second controls and cycles."""
        seen: set[Coordinate] = set()
        for link in self.links:
            if link.follower in seen:
                raise ModelError(f"{link.follower} follows twice")
            seen.add(link.follower)
        for cycle in cycles(self.links):
            raise ModelError(cycle_message(cycle))
        _ = self.resolved

    @cached_property
    def resolved(self) -> tuple[Link, ...]:
        """The same links with controls that follow nothing, in the order of `links`."""
        given = {link.follower: link for link in self.links}
        found: dict[Coordinate, Link] = {}
        for link in self.links:
            path = [link]
            while (control := path[-1].control) in given and control not in found:
                path.append(given[control])
            for one in reversed(path):
                earlier = found.get(one.control)
                found[one.follower] = one if earlier is None else one.compose(earlier)
        return tuple(found[link.follower] for link in self.links)

    @property
    def followers(self) -> frozenset[Coordinate]:
        """The degrees of freedom that follow."""
        return frozenset(link.follower for link in self.links)

    def follow(self, displacements: Displacements) -> dict[str, Array]:
        """The displacements with every follower set by its control.

        Args:
            displacements: by joint, shape (..., n) [rad or m]; what they say of followers is not
                looked at.

        Raises:
            ModelError: a joint is missing or has too few degrees of freedom, or a displacement is
                not finite.
        """
        moved = {name: np.array(values, dtype=float) for name, values in displacements.items()}
        for link in self.resolved:
            for freedom in (link.control, link.follower):
                if freedom.joint not in moved or freedom.index >= moved[freedom.joint].shape[-1]:
                    raise ModelError(f"there is no displacement of {freedom}")
            control = moved[link.control.joint][..., link.control.index]
            with np.errstate(over="ignore"):
                followed = link.factor * control + link.offset
            if not np.all(np.abs(followed) <= MAX_LINK_VALUE):
                raise ModelError(f"the displacement of {link.follower} is not finite")
            moved[link.follower.joint][..., link.follower.index] = followed
        return moved

    def constraints(self, coordinates: Sequence[Coordinate]) -> tuple[Array, Array]:
        """C and d of the constraints `C q = d` that the links put on displacements q [rad or m].

        Args:
            coordinates: which displacement stands at each place of q.

        Returns:
            C, shape (number of links, number of freedoms), with 1 at each follower and minus the
            resolved factor at its control; d, the resolved offsets [rad or m].

        Raises:
            ModelError: a linked degree of freedom is not among `coordinates`.
        """
        columns = {freedom: k for k, freedom in enumerate(coordinates)}
        rows = np.zeros((len(self.links), len(columns)))
        for row, link in zip(rows, self.resolved, strict=True):
            for freedom, value in ((link.follower, 1.0), (link.control, -link.factor)):
                if freedom not in columns:
                    raise ModelError(f"there is no displacement of {freedom}")
                row[columns[freedom]] = value
        return rows, np.array([link.offset for link in self.resolved])


def cycles(links: Iterable[Link]) -> tuple[tuple[Coordinate, ...], ...]:
    """The closed chains among links with one control a follower, each from follower to control."""
    controls: Mapping[Coordinate, Coordinate] = {link.follower: link.control for link in links}
    done: set[Coordinate] = set()
    found: list[tuple[Coordinate, ...]] = []
    for start in controls:
        path: dict[Coordinate, None] = {}
        at = start
        while at in controls and at not in done and at not in path:
            path[at] = None
            at = controls[at]
        if at in path:
            walked = list(path)
            found.append(tuple(walked[walked.index(at) :]))
        done |= path.keys()
    return tuple(found)


def cycle_message(cycle: Sequence[Coordinate]) -> str:
    """A sentence that names a cycle."""
    if len(cycle) == 1:
        return f"{cycle[0]} follows itself"
    chain = ", which follows ".join(map(str, (*cycle[1:], cycle[0])))
    return f"the links go round: {cycle[0]} follows {chain}"


def read_links(path: str | Path, figure: Figure) -> Links:
    """The links in a file. Raises InputError, which holds all faults, when anything is wrong."""
    return parse_links_file(path, figure).require_value()


def parse_links_file(path: str | Path, figure: Figure) -> Parsed[Links]:
    """The links in a file, with all faults; bad input raises nothing."""
    return parse_file(path, partial(_parse_links, figure=figure))


def _parse_links(source: Source, diagnostics: Diagnostics, figure: Figure) -> Links | None:
    content = parse_links_source(source, diagnostics)
    return None if content is None else bind_links(content, figure, diagnostics)


def bind_links(content: LinksFile, figure: Figure, diagnostics: Diagnostics) -> Links | None:
    """The links of a figure that a file describes; None, with faults noted, if any is wrong."""
    stem = None if figure.path is None else figure.path.stem
    if content.figure and stem and content.figure != stem:
        diagnostics.warning(
            f"these links were written for the figure `{shorten(content.figure)}`",
            content.origins.get("figure"),
            f"they are used for `{shorten(stem)}`",
        )
    placed: dict[Coordinate, tuple[Link, Span | None]] = {}
    for entry in content.entries:
        for link, place in _bind_entry(entry, figure, diagnostics):
            if link.follower in placed:
                first = placed[link.follower][1]
                hint = f"the first is in line {first.line}" if first else ""
                diagnostics.error(f"a second link of {link.follower}", place, hint)
                continue
            placed[link.follower] = (link, place)
    links = tuple(link for link, _ in placed.values())
    told: set[Span | None] = set()
    order = list(placed)
    for cycle in cycles(links):
        place = placed[max(cycle, key=order.index)][1]
        if place not in told:  # whole joints make a cycle for each of their degrees of freedom
            hint = "one of them must follow nothing" if len(cycle) > 1 else ""
            diagnostics.error(cycle_message(cycle), place, hint)
        told.add(place)
    if diagnostics.has_errors:
        return None
    try:
        made = Links(links)
    except ModelError as failure:
        diagnostics.error(str(failure), None)
        return None
    for link in made.resolved:
        if abs(link.factor) > MAX_LINK_FACTOR:
            diagnostics.error(
                f"{link.follower} follows {link.control} by the factor {link.factor:.4g}",
                placed[link.follower][1],
                f"factors multiply along the chain; from -{MAX_LINK_FACTOR:.0e} to "
                f"{MAX_LINK_FACTOR:.0e}",
            )
    return None if diagnostics.has_errors else made


def _bind_entry(
    entry: LinkEntry, figure: Figure, diagnostics: Diagnostics
) -> Iterator[tuple[Link, Span | None]]:
    """The links of one table, each with the place of the joint that follows."""
    control = _find_movable_joint(entry.control, figure, entry.span("control"), diagnostics)
    for k, name in enumerate(entry.joints):
        place = entry.span(f"joints.{k}")
        joint = _find_movable_joint(name, figure, place, diagnostics)
        if control is None or joint is None:
            continue
        for one, other, sign in _coordinate_pairs(
            entry, figure, control, joint, place, diagnostics
        ):
            follower, followed = Coordinate(joint.name, one), Coordinate(control.name, other)
            if _is_compatible(entry, joint, control, follower, followed, place, diagnostics):
                try:
                    link = Link(follower, followed, sign * entry.factor, entry.offset)
                except ModelError as failure:
                    if 0.0 < abs(entry.factor) <= MAX_LINK_FACTOR:  # others have been told
                        diagnostics.error(str(failure), place)
                    break
                yield link, place


def _find_movable_joint(
    name: str, figure: Figure, span: Span | None, diagnostics: Diagnostics
) -> Joint | None:
    joint = figure.joints.get(name)
    if joint is None:
        hint = spelling_hint(name, figure.joints)
        diagnostics.error(f"the figure has no joint `{shorten(name)}`", span, hint)
    elif not joint.chain:
        diagnostics.error(f"joint `{shorten(name)}` does not move", span, "it has no `type`")
        return None
    return joint


def _coordinate_pairs(
    entry: LinkEntry,
    figure: Figure,
    control: Joint,
    joint: Joint,
    span: Span | None,
    diagnostics: Diagnostics,
) -> list[tuple[int, int, int]]:
    """Places of follower and control in their chains, and a sign; none, with a fault noted."""
    if entry.mirror:
        try:
            signs = mirror_signs(figure, control, joint)
        except ModelError as failure:
            diagnostics.error(str(failure), span, "without `mirror`, link by degree of freedom")
            return []
        return [(k, k, sign) for k, sign in enumerate(signs)]
    count, others = len(joint.chain), len(control.chain)
    if entry.dof is None and entry.control_dof is None:
        if count != others:
            diagnostics.error(
                f"`{shorten(joint.name)}` has {format_dof_count(count)} "
                f"and `{shorten(control.name)}` {others}",
                span,
                "link them by degree of freedom: `dof = 1` and `control_dof = 1`",
            )
            return []
        if entry.offset and count > 1:
            hint = "with `dof` and `control_dof`, in a table for each"
            diagnostics.error(
                "an offset belongs to one degree of freedom", _offset_span(entry), hint
            )
            return []
        return [(k, k, 1) for k in range(count)]
    one = _coordinate_index(joint, entry.dof, "dof", entry, span, diagnostics)
    other = _coordinate_index(control, entry.control_dof, "control_dof", entry, span, diagnostics)
    return [] if one is None or other is None else [(one, other, 1)]


def _coordinate_index(
    joint: Joint,
    index: int | None,
    key: str,
    entry: LinkEntry,
    span: Span | None,
    diagnostics: Diagnostics,
) -> int | None:
    """The degree of freedom that a key means; the only one of a joint need not be said."""
    count = len(joint.chain)
    if index is None and count == 1:
        return 0
    if index is None:
        diagnostics.error(
            f"this link does not say which of the {count} degrees of freedom of "
            f"`{shorten(joint.name)}` it means",
            span,
            f"write `{key} = 1`, or up to {count}",
        )
        return None
    if index >= count:
        diagnostics.error(
            f"`{shorten(joint.name)}` has {format_dof_count(count)}, not {index + 1}",
            entry.span(key),
        )
        return None
    return index


def _is_compatible(
    entry: LinkEntry,
    joint: Joint,
    control: Joint,
    follower: Coordinate,
    followed: Coordinate,
    span: Span | None,
    diagnostics: Diagnostics,
) -> bool:
    """Whether both turn or both slide, and the offset is of their kind."""
    kind = joint.chain[follower.index].kind
    if kind != control.chain[followed.index].kind:
        diagnostics.error(
            f"{follower} {_motion_verb(kind)} and {followed} "
            f"{_motion_verb(control.chain[followed.index].kind)}: a link joins like with like",
            span,
        )
        return False
    key = _offset_key(kind)
    if entry.offset and key != _offset_key_in(entry):
        diagnostics.error(f"the offset of {follower} is `{key}`", _offset_span(entry))
        return False
    return True


def _motion_verb(kind: AxisKind) -> str:
    match kind:
        case AxisKind.ROTATION:
            return "turns"
        case AxisKind.TRANSLATION:
            return "slides"
        case _:
            assert_never(kind)


def _offset_key(kind: AxisKind) -> str:
    """The key of the offset of a link between displacements of this kind."""
    match kind:
        case AxisKind.ROTATION:
            return "offset_deg"
        case AxisKind.TRANSLATION:
            return "offset_m"
        case _:
            assert_never(kind)


def _offset_key_in(entry: LinkEntry) -> str:
    return "offset_m" if entry.offset_is_length else "offset_deg"


def _offset_span(entry: LinkEntry) -> Span | None:
    return entry.span(_offset_key_in(entry))
