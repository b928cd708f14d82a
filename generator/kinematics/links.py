"""Linked joints: degrees of freedom that follow others in proportion (thesis, section 5.5).

The thesis links whole joints, `theta_i = c_i theta_control` (eq. 5.50), and wishes for links by
degree of freedom. A link here is one of these; a link of whole joints is one for each of their
degrees of freedom. A follower may control others in its turn: factors then multiply along the
chain.

What a links file means for a figure: links of degrees of freedom, or faults with places.
"""

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property
from typing import assert_never

import numpy as np

from generator.diagnostics import (
    Diagnostics,
    ModelError,
    Source,
    Span,
    shorten,
    spelling_hint,
)
from generator.figure import AxisKind, Figure, Joint, JointAxis
from generator.file_kind import FileKind
from generator.follower_curve import FollowerCurve
from generator.input_files.links import LINK_ENTRIES, MAX_LINK_FACTOR, LinkEntry, LinksFile
from generator.kinematics.placement import Displacements, Placement, forward_kinematics, site_pose
from generator.kinematics.tree import build_tree
from generator.rotations import Array

PARALLEL_TOLERANCE = 1e-6
"""Largest distance between unit vectors that count as equal."""

MIRROR_POSITION_TOLERANCE = 0.01
"""Largest distance between mirrored positions, relative to their distance from the plane."""

_SIDE_PATTERN = re.compile(r"left|right")

_MIRROR_SIGNS = np.array([-1.0, 1.0, 1.0])

_TWIST_MIRROR_SIGNS = np.concatenate([-_MIRROR_SIGNS, _MIRROR_SIGNS])


def format_dof_count(count: int) -> str:
    """`1 degree of freedom`, `3 degrees of freedom`."""
    return f"{count} degree{'' if count == 1 else 's'} of freedom"


def mirror_signs(figure: Figure, control: Joint, follower: Joint) -> tuple[int, ...]:
    """Return the signs that make `follower` move as the mirror image of `control`.

    The plane of symmetry is x = 0 of the world, with all displacements zero. Two joints are a pair
    where their names say so (`left_knee`, `right_knee`), or where their positions are mirror
    images. The image of a rotation about an axis is the opposite rotation about the image of the
    axis; a translation follows the image itself. All signs are +1 where a figure declares the axes
    of both sides as mirror images, as the prototype does with its negative axes.

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
    placement = _zero_placement(figure)
    # The names are the same but for `left` and `right`, exchanged.
    names_match = mirrored_name(control.name) == follower.name != control.name
    if not (names_match or _positions_match(placement, control, follower)):
        raise ModelError(
            f"`{follower.name}` is not a mirror image of `{control.name}`: their names do not "
            "differ in left and right alone, and their positions are not mirror images in "
            "the plane x = 0"
        )
    signs: list[int] = []
    for number, (one, other) in enumerate(zip(control.chain, follower.chain, strict=True), 1):
        image = _TWIST_MIRROR_SIGNS * _twist_in_world(placement, control, one)
        sign = _relative_sign(image, _twist_in_world(placement, follower, other))
        if sign is None:
            raise ModelError(
                f"degree of freedom {number} of `{follower.name}` is not a mirror image of that "
                f"of `{control.name}`"
            )
        signs.append(sign)
    return tuple(signs)


def mirror_rotations(figure: Figure) -> dict[str, tuple[str, Array]]:
    """Return the joint on the other side of each joint named after a side, and its image's axes.

    The value of a joint is the name of the other and a matrix Q, shape (3, 3): the mirror image of
    a rotation about a direction d is one about Q d, each in the axes of its joint's parent site.
    Joints that the figure has on one side only are left out.
    """
    placement, found = _zero_placement(figure), dict[str, tuple[str, Array]]()
    for name, joint in figure.joints.items():
        other = figure.joints.get(mirrored_name(name), joint)
        if other is not joint:
            mirror = np.diag(-_MIRROR_SIGNS)
            one, image = (_outboard_axes(placement, side) for side in (joint, other))
            found[name] = (other.name, image.T @ mirror @ one)
    return found


def mirrored_differences(figure: Figure, displacements: Displacements) -> dict[str, float]:
    """Return by how much the pose of each left joint differs from the mirrored right one.

    Args:
        figure: the figure.
        displacements: displacements of its joints [rad or m].

    Returns:
        The largest difference of a displacement by the name of the left joint [rad or m]; joints
        without a mirror image are left out.
    """
    differences: dict[str, float] = {}
    for name, joint in figure.joints.items():
        other = figure.joints.get(mirrored_name(name))
        if "left" not in name or other is None or not joint.chain:
            continue
        with suppress(ModelError):
            signs = np.array(mirror_signs(figure, joint, other))
            mirrored = signs * displacements[other.name]
            differences[name] = float(np.max(np.abs(displacements[name] - mirrored)))
    return differences


def mirrored_name(name: str) -> str:
    """Return a name with `left` and `right` exchanged."""
    return _SIDE_PATTERN.sub(lambda side: "right" if side[0] == "left" else "left", name)


def _zero_placement(figure: Figure) -> Placement:
    """Return the figure with all displacements zero."""
    zeros = {name: np.zeros(len(joint.chain)) for name, joint in figure.joints.items()}
    return forward_kinematics(build_tree(figure), zeros)


def _positions_match(placement: Placement, one: Joint, other: Joint) -> bool:
    """Return whether the joints are off the plane, each at the mirror image of the other."""
    place, opposite = (site_pose(placement, joint, "parent")[:3, 3] for joint in (one, other))
    return bool(
        np.linalg.norm(_MIRROR_SIGNS * place - opposite) < MIRROR_POSITION_TOLERANCE * abs(place[0])
    )


def _twist_in_world(placement: Placement, joint: Joint, factor: JointAxis) -> Array:
    """Return the twist of the outboard segment in world axes, (angular, linear), shape (6,)."""
    return (np.array(factor.twist) @ _outboard_axes(placement, joint).T).ravel()


def _outboard_axes(placement: Placement, joint: Joint) -> Array:
    """Matrix from an axis of a joint to that of the motion of the outboard segment in the world."""
    axes = site_pose(placement, joint, "parent")[:3, :3]
    forward = next(
        (branch.parent_is_inboard for branch in placement.tree.joints if branch.joint is joint),
        True,
    )
    return axes if forward else -axes


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

    With a curve it is factor * curve(control) + offset. Raises ModelError for a factor of zero and
    for numbers that are not finite.
    """

    follower: Coordinate
    control: Coordinate
    factor: float = 1.0
    offset: float = 0.0
    curve: FollowerCurve | None = None

    def __post_init__(self) -> None:
        """Check the factor and the offset."""
        if not (abs(self.factor) <= MAX_LINK_VALUE and abs(self.offset) <= MAX_LINK_VALUE):
            raise ModelError(f"the link of {self.follower} has a number that is not finite")
        if self.factor == 0.0:
            raise ModelError(f"a factor of zero links {self.follower} to nothing")

    def compose(self, earlier: "Link") -> "Link":
        """Return this link with its control replaced by the control of `earlier`.

        Raises ModelError when the product of the factors is beyond the floats, and for a curve of a
        curve.
        """
        if self.curve is not None:
            if earlier.curve is not None:
                raise ModelError(f"{self.follower} follows {self.control}, both by a curve")
            inner = self.curve.of_line(earlier.factor, earlier.offset)
            return replace(self, control=earlier.control, curve=inner)
        offset = self.factor * earlier.offset + self.offset
        factor = self.factor * earlier.factor
        return Link(self.follower, earlier.control, factor, offset, earlier.curve)

    def at(self, control: Array, derivative: int = 0) -> Array:
        """Return the follower's displacement, or a derivative of it by the control's.

        Args:
            control: Displacements of the control, of any shape [rad or m].
            derivative: Order of the derivative.
        """
        if self.curve is not None:
            values = self.factor * self.curve.at(control, derivative)
            return values if derivative else values + self.offset
        if derivative == 0:
            return self.factor * control + self.offset
        return np.full_like(control, self.factor if derivative == 1 else 0.0, dtype=float)

    @property
    def as_curve(self) -> FollowerCurve:
        """The displacement of the follower as a curve."""
        if self.curve is None:
            return FollowerCurve.line(self.factor, self.offset)
        return self.curve.scaled(self.factor, self.offset)


@dataclass(frozen=True)
class Links:
    """Links that are consistent: each follower has one control, and no chain of them is closed.

    Attributes:
        links: links in the order of the file.

    Raises:
        ModelError: a degree of freedom follows twice, or links form a cycle.
    """

    links: tuple[Link, ...] = ()

    def __post_init__(self) -> None:
        """Reject second controls and cycles."""
        seen: set[Coordinate] = set()
        for link in self.links:
            if link.follower in seen:
                raise ModelError(f"{link.follower} has two links")
            seen.add(link.follower)
        for cycle in cycles(self.links):
            raise ModelError(cycle_message(cycle))
        _ = self.resolved

    @cached_property
    def resolved(self) -> tuple[Link, ...]:
        """The same links, each to a control that follows nothing, in the order of `links`."""
        links = {link.follower: link for link in self.links}
        found: dict[Coordinate, Link] = {}
        for link in self.links:
            path = [link]
            while (control := path[-1].control) in links and control not in found:
                path.append(links[control])
            for one in reversed(path):
                earlier = found.get(one.control)
                found[one.follower] = one if earlier is None else one.compose(earlier)
        return tuple(found[link.follower] for link in self.links)

    def follow(self, displacements: Displacements) -> dict[str, Array]:
        """Return the displacements with every follower set by its control.

        Args:
            displacements: displacements by joint, shape (..., n) [rad or m]; the values of
                followers are ignored.

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
                followed = link.at(control)
            if not np.all(np.abs(followed) <= MAX_LINK_VALUE):
                raise ModelError(f"the displacement of {link.follower} is not finite")
            moved[link.follower.joint][..., link.follower.index] = followed
        return moved

    def beside(self, earlier: "Links") -> "Links":
        """Return these links and others.

        Raises ModelError as for links of one file.
        """
        return Links((*earlier.links, *self.links)) if earlier.links else self

    def constraints(self, coordinates: Sequence[Coordinate]) -> tuple[Array, Array]:
        """Return C and d of the constraints `C q = d` of links without curves [rad or m].

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
    """Return the closed chains among the links, each from follower to control."""
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


NO_LINKS = Links()
"""Links of nothing."""


def figure_links(figure: Figure) -> Links:
    """Return the links of the displacements that follow others in a figure's own file."""
    links = tuple(
        Link(Coordinate(name, k), Coordinate(one.joint, one.index), curve=one.curve)
        for name, joint in figure.joints.items()
        for k, one in enumerate(joint.followers)
        if one is not None and one.joint in figure.joints
    )
    return Links(links) if links else NO_LINKS


def cycle_message(cycle: Sequence[Coordinate]) -> str:
    """Describe a cycle."""
    if len(cycle) == 1:
        return f"{cycle[0]} follows itself"
    chain = ", which follows ".join(map(str, (*cycle[1:], cycle[0])))
    return f"the links form a cycle: {cycle[0]} follows {chain}"


def _parse_links(source: Source, diagnostics: Diagnostics, figure: Figure) -> Links | None:
    content = LINK_ENTRIES.parser(source, diagnostics)
    return None if content is None else bind_links(content, figure, diagnostics)


LINKS_FILE = FileKind("links", LINK_ENTRIES.suffix, _parse_links)


def bind_links(content: LinksFile, figure: Figure, diagnostics: Diagnostics) -> Links | None:
    """Return the links of a figure that a file describes; None after reporting errors."""
    stem = None if figure.path is None else figure.path.stem
    if content.figure and stem and content.figure != stem:
        diagnostics.warning(
            f"this file is for the figure `{shorten(content.figure)}`",
            content.origins.get("figure"),
            f"its links are applied to `{shorten(stem)}`",
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
    reported: set[Span | None] = set()
    order = list(placed)
    for cycle in cycles(links):
        place = placed[max(cycle, key=order.index)][1]
        if place not in reported:  # whole joints make a cycle for each of their degrees of freedom
            hint = "one of them must not follow another" if len(cycle) > 1 else ""
            diagnostics.error(cycle_message(cycle), place, hint)
        reported.add(place)
    if diagnostics.has_errors:
        return None
    try:
        links_of_figure = Links(links)
    except ModelError as failure:
        diagnostics.error(str(failure), None)
        return None
    for link in links_of_figure.resolved:
        if abs(link.factor) > MAX_LINK_FACTOR:
            diagnostics.error(
                f"{link.follower} follows {link.control} by the factor {link.factor:.4g}",
                placed[link.follower][1],
                f"factors multiply along the chain; from -{MAX_LINK_FACTOR:.0e} to "
                f"{MAX_LINK_FACTOR:.0e}",
            )
    return None if diagnostics.has_errors else links_of_figure


def _bind_entry(
    entry: LinkEntry, figure: Figure, diagnostics: Diagnostics
) -> Iterator[tuple[Link, Span | None]]:
    """Yield the links of one table, each with the location of its follower."""
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
                    if 0.0 < abs(entry.factor) <= MAX_LINK_FACTOR:  # others are already reported
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
    """Return indices of follower and control, and a sign; none after reporting an error."""
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
    """Return the index under a key, which a joint with one degree of freedom may omit."""
    count = len(joint.chain)
    if index is None and count == 1:
        return 0
    if index is None:
        diagnostics.error(
            f"this link does not name one of the {count} degrees of freedom of "
            f"`{shorten(joint.name)}`",
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
    """Return whether both axes and the offset are of the same kind, after reporting an error."""
    kind = joint.chain[follower.index].kind
    if kind != control.chain[followed.index].kind:
        diagnostics.error(
            f"{follower} {_motion_verb(kind)} and {followed} "
            f"{_motion_verb(control.chain[followed.index].kind)}: a link needs two of one kind",
            span,
        )
        return False
    key = "offset_deg" if kind.units.is_angle else "offset_m"
    if entry.offset and key != _offset_key_in(entry):
        diagnostics.error(f"the offset of {follower} needs the key `{key}`", _offset_span(entry))
        return False
    return True


def _motion_verb(kind: AxisKind) -> str:
    match kind:
        case AxisKind.ROTATION:
            return "rotates"
        case AxisKind.TRANSLATION:
            return "translates"
        case _:
            assert_never(kind)


def _offset_key_in(entry: LinkEntry) -> str:
    return "offset_m" if entry.offset_is_length else "offset_deg"


def _offset_span(entry: LinkEntry) -> Span | None:
    return entry.span(_offset_key_in(entry))
