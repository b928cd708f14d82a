"""The figure: segments, sites and joints in SI units and radians, with their places in the file.

Values are frozen; origins do not take part in equality.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from functools import cached_property, reduce
from pathlib import Path

import numpy as np

from generator.diagnostics import Span
from generator.rotations import Array, matrix_from_xyz, pose_matrix

Vector = tuple[float, float, float]

CENTRE_OF_MASS_SITE = "CM"
"""The site name that Peabody reserves for the centre of mass."""


@dataclass(frozen=True)
class Rotation:
    """`xyz(a, b, c)`: intrinsic X-Y-Z angles [rad]."""

    angles: Vector

    @property
    def matrix(self) -> Array:
        """The pose matrix, shape (4, 4)."""
        return pose_matrix(matrix_from_xyz(*self.angles), np.zeros(3))


@dataclass(frozen=True)
class Translation:
    """`trans(x, y, z)`: a translation [m]."""

    offset: Vector

    @property
    def matrix(self) -> Array:
        """The pose matrix, shape (4, 4)."""
        return pose_matrix(np.eye(3), np.asarray(self.offset))


@dataclass(frozen=True)
class Location:
    """A product of rotations and translations as written; `*` composes in row-vector order.

    `xyz(...) * trans(...)` rotates first and then translates in the segment's unrotated frame: as
    column matrices the last factor stands leftmost.
    """

    factors: tuple[Rotation | Translation, ...] = ()

    @cached_property
    def pose_in_segment(self) -> Array:
        """Pose of the site frame in the segment frame, shape (4, 4)."""
        return reduce(lambda pose, factor: factor.matrix @ pose, self.factors, np.eye(4))


@dataclass(frozen=True)
class Site:
    """A frame fixed to a segment, with the constant loads that act there [N, N m]."""

    name: str
    location: Location = Location()
    global_force: Vector | None = None
    local_force: Vector | None = None
    global_moment: Vector | None = None
    local_moment: Vector | None = None
    origins: Mapping[str, Span] = field(default_factory=dict[str, Span], compare=False, repr=False)

    @property
    def pose_in_segment(self) -> Array:
        """Pose of the site frame in the segment frame, shape (4, 4)."""
        return self.location.pose_in_segment


@dataclass(frozen=True)
class Segment:
    """A rigid body, or a part of the ground when its mass is negative.

    mass [kg]; inertia: principal moments about the centre of mass along the segment's axes [kg m2].
    """

    name: str
    mass: float | None = None
    inertia: Vector | None = None
    psurf: str | None = None
    attributes: tuple[str, ...] = ()
    sites: Mapping[str, Site] = field(default_factory=dict[str, Site])
    origins: Mapping[str, Span] = field(default_factory=dict[str, Span], compare=False, repr=False)

    @property
    def centre_of_mass(self) -> Array | None:
        """Position of the `CM` site in the segment frame [m], shape (3,); None without one."""
        site = self.sites.get(CENTRE_OF_MASS_SITE)
        return None if site is None else site.pose_in_segment[:3, 3]

    @property
    def has_ground_mass(self) -> bool:
        """Return whether the mass is negative, which marks a part of the ground."""
        return self.mass is not None and self.mass < 0.0


@dataclass(frozen=True)
class SiteRef:
    """`segment.site`."""

    segment: str
    site: str

    def __str__(self) -> str:
        """As the language writes it."""
        return f"{self.segment}.{self.site}"


class AxisKind(StrEnum):
    """Kind of a joint axis; the value is the letter that files write.

    Match it exhaustively, so that the type checker finds every place that a new kind needs.
    """

    ROTATION = "R"
    TRANSLATION = "T"


@dataclass(frozen=True)
class JointAxis:
    """`R(x,y,z)` or `T(x,y,z)`: one degree of freedom about or along a unit axis."""

    kind: AxisKind
    axis: Vector

    def __post_init__(self) -> None:
        """Accept the letter of a kind. Raises ValueError for any other value."""
        object.__setattr__(self, "kind", AxisKind(self.kind))


@dataclass(frozen=True)
class Joint:
    """A connection of two segments: `child`'s site frame moves in `parent`'s.

    `parent` and `child` are the sites as written after `connect` and `to`; either may be nearer to
    the root. The chain's first factor is innermost, next to the child.
    `displacement` has a value for each factor [rad or m]; `stiff` [N m/rad or N/m], `rest` [rad or
    m], `damp` [N m s/rad or N s/m] and the limits [rad or m] have one for each factor, or are None.
    """

    name: str
    parent: SiteRef
    child: SiteRef
    chain: tuple[JointAxis, ...] = ()
    displacement: tuple[float, ...] = ()
    stiff: tuple[float, ...] | None = None
    rest: tuple[float, ...] | None = None
    damp: tuple[float, ...] | None = None
    lower_limit: tuple[float, ...] | None = None
    upper_limit: tuple[float, ...] | None = None
    origins: Mapping[str, Span] = field(default_factory=dict[str, Span], compare=False, repr=False)

    @property
    def ends(self) -> tuple[SiteRef, SiteRef]:
        """The parent's and the child's site."""
        return self.parent, self.child

    @property
    def degrees_of_freedom(self) -> int:
        """Number of factors in the chain."""
        return len(self.chain)


@dataclass(frozen=True)
class Attribute:
    """A named set of display values (`rgb = (1.00,0.37,0.00)`)."""

    name: str
    fields: Mapping[str, tuple[float, ...] | str] = field(
        default_factory=dict[str, tuple[float, ...] | str]
    )
    origins: Mapping[str, Span] = field(default_factory=dict[str, Span], compare=False, repr=False)


@dataclass(frozen=True)
class Figure:
    """An articulated figure: segments joined at sites, one site fixed to the world.

    The mappings keep the order of the file, which is the order of joints in an action file. `path`
    is the file, beside which psurfs and springs are looked for; None when there is no file.
    """

    segments: Mapping[str, Segment]
    joints: Mapping[str, Joint]
    root: SiteRef
    attributes: Mapping[str, Attribute] = field(default_factory=dict[str, Attribute])
    name: str | None = None
    path: Path | None = field(default=None, compare=False, repr=False)
    origins: Mapping[str, Span] = field(default_factory=dict[str, Span], compare=False, repr=False)

    def site(self, ref: SiteRef) -> Site:
        """The site that `ref` names. Raises KeyError for an unknown one."""
        return self.segments[ref.segment].sites[ref.site]

    @property
    def degrees_of_freedom(self) -> int:
        """Total over the joints; a closed loop takes some of them away again."""
        return sum(joint.degrees_of_freedom for joint in self.joints.values())

    @cached_property
    def ground(self) -> frozenset[str]:
        """Names of the segments that do not move: the root's, and those fixed to it."""
        fixed = {self.root.segment}
        rigid = [joint for joint in self.joints.values() if not joint.chain]
        grown = True
        while grown:
            grown = False
            for joint in rigid:
                ends = {joint.parent.segment, joint.child.segment}
                new = {name for name in ends - fixed if self.segments[name].has_ground_mass}
                if ends & fixed and new:
                    fixed |= new
                    grown = True
        return frozenset(fixed)

    @property
    def bodies(self) -> dict[str, Segment]:
        """The segments that move, in the order of the file."""
        return {name: seg for name, seg in self.segments.items() if name not in self.ground}

    @property
    def total_mass(self) -> float:
        """Sum of the masses that move [kg]; a missing mass counts as zero."""
        return sum(seg.mass or 0.0 for seg in self.bodies.values())
