"""Linked joints: degrees of freedom that follow others in proportion (thesis, section 5.5).

The thesis links whole joints, `theta_i = c_i theta_control` (eq. 5.50), and wishes for links by
degree of freedom. A link here is one of these; a link of whole joints is one for each of their
degrees of freedom. A follower may control others in its turn: factors then multiply along the
chain.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from generator.errors import MoverError
from generator.frames import Array
from generator.posture.placement import Displacements

LARGEST = 1e300
"""Displacements beyond this count as infinite: in degrees they would be [rad or m]."""


class LinkError(MoverError, ValueError):
    """Links that cannot hold together; the message says why."""


@dataclass(frozen=True, order=True)
class Freedom:
    """One degree of freedom of a joint: `index` is its place in the chain, from 0."""

    joint: str
    index: int

    def __str__(self) -> str:
        """Joint and number, counted from 1."""
        return f"{self.joint} {self.index + 1}"


@dataclass(frozen=True)
class Link:
    """follower = factor * control + offset, with displacements in rad or m.

    Raises LinkError for a factor of zero, which links nothing, and for numbers that are not finite.
    """

    follower: Freedom
    control: Freedom
    factor: float = 1.0
    offset: float = 0.0

    def __post_init__(self) -> None:
        """Refuse what is no link."""
        if not (abs(self.factor) <= LARGEST and abs(self.offset) <= LARGEST):
            raise LinkError(f"the link of {self.follower} has a number that is not finite")
        if self.factor == 0.0:
            raise LinkError(f"a factor of zero links {self.follower} to nothing")

    def after(self, earlier: "Link") -> "Link":
        """This link with its control expressed by the control of `earlier`, which moves it.

        Raises LinkError when the product of the factors is beyond the floats.
        """
        offset = self.factor * earlier.offset + self.offset
        return Link(self.follower, earlier.control, self.factor * earlier.factor, offset)


@dataclass(frozen=True)
class Links:
    """Links that hold together: each follower has one control, and no chain of them is closed.

    Attributes:
        links: as they were given.

    Raises:
        LinkError: a degree of freedom follows twice, or links go round; the message names them.
    """

    links: tuple[Link, ...] = ()

    def __post_init__(self) -> None:
        """Refuse second controls and cycles."""
        seen: set[Freedom] = set()
        for link in self.links:
            if link.follower in seen:
                raise LinkError(f"{link.follower} follows twice")
            seen.add(link.follower)
        for cycle in cycles(self.links):
            raise LinkError(cycle_said(cycle))
        _ = self.resolved

    @cached_property
    def resolved(self) -> tuple[Link, ...]:
        """The same links with controls that follow nothing, in the order of `links`."""
        given = {link.follower: link for link in self.links}
        found: dict[Freedom, Link] = {}
        for link in self.links:
            path = [link]
            while (control := path[-1].control) in given and control not in found:
                path.append(given[control])
            for one in reversed(path):
                earlier = found.get(one.control)
                found[one.follower] = one if earlier is None else one.after(earlier)
        return tuple(found[link.follower] for link in self.links)

    @property
    def followers(self) -> frozenset[Freedom]:
        """The degrees of freedom that follow."""
        return frozenset(link.follower for link in self.links)

    def follow(self, displacements: Displacements) -> dict[str, Array]:
        """The displacements with every follower set by its control.

        Args:
            displacements: by joint, shape (..., n) [rad or m]; what they say of followers is not
                looked at.

        Raises:
            LinkError: a joint is missing or has too few degrees of freedom, or a displacement is
                not finite.
        """
        moved = {name: np.array(values, dtype=float) for name, values in displacements.items()}
        for link in self.resolved:
            for freedom in (link.control, link.follower):
                if freedom.joint not in moved or freedom.index >= moved[freedom.joint].shape[-1]:
                    raise LinkError(f"there is no displacement of {freedom}")
            control = moved[link.control.joint][..., link.control.index]
            with np.errstate(over="ignore"):
                followed = link.factor * control + link.offset
            if not np.all(np.abs(followed) <= LARGEST):
                raise LinkError(f"the displacement of {link.follower} is not finite")
            moved[link.follower.joint][..., link.follower.index] = followed
        return moved

    def constraints(self, freedoms: Sequence[Freedom]) -> tuple[Array, Array]:
        """C and d of the constraints `C q = d` that the links put on displacements q [rad or m].

        Args:
            freedoms: which displacement stands at each place of q.

        Returns:
            C, shape (number of links, number of freedoms), with 1 at each follower and minus the
            resolved factor at its control; d, the resolved offsets [rad or m].

        Raises:
            LinkError: a linked degree of freedom is not among `freedoms`.
        """
        columns = {freedom: k for k, freedom in enumerate(freedoms)}
        rows = np.zeros((len(self.links), len(columns)))
        for row, link in zip(rows, self.resolved, strict=True):
            for freedom, value in ((link.follower, 1.0), (link.control, -link.factor)):
                if freedom not in columns:
                    raise LinkError(f"there is no displacement of {freedom}")
                row[columns[freedom]] = value
        return rows, np.array([link.offset for link in self.resolved])


def cycles(links: Iterable[Link]) -> tuple[tuple[Freedom, ...], ...]:
    """The closed chains among links with one control a follower, each from follower to control."""
    controls: Mapping[Freedom, Freedom] = {link.follower: link.control for link in links}
    done: set[Freedom] = set()
    found: list[tuple[Freedom, ...]] = []
    for start in controls:
        path: dict[Freedom, None] = {}
        at = start
        while at in controls and at not in done and at not in path:
            path[at] = None
            at = controls[at]
        if at in path:
            walked = list(path)
            found.append(tuple(walked[walked.index(at) :]))
        done |= path.keys()
    return tuple(found)


def cycle_said(cycle: Sequence[Freedom]) -> str:
    """A sentence that names a cycle."""
    if len(cycle) == 1:
        return f"{cycle[0]} follows itself"
    chain = ", which follows ".join(map(str, (*cycle[1:], cycle[0])))
    return f"the links go round: {cycle[0]} follows {chain}"
