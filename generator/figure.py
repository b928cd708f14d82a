"""The figure: segments, sites and joints in SI units and radians, with their places in the file.

Values are frozen; origins do not take part in equality. Each value checks its own numbers when it
is made and raises ModelError; what concerns several of them, such as a joint's sites, is checked
when a figure is read, written or simulated (`generator.figure_file.check`).
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum
from functools import cached_property, reduce
from importlib import import_module
from math import hypot, inf, isfinite
from pathlib import Path
from typing import Any, Literal, NamedTuple, TypeVar, assert_never

import numpy as np

from generator.diagnostics import (
    ModelError,
    Named,
    NamedMapping,
    Parsed,
    Span,
    format_count,
    shorten,
)
from generator.follower_curve import FollowerCurve
from generator.notebook import PageView, html_table
from generator.rotations import Array, matrix_from_xyz, pose_matrix, unit_vector
from generator.units import ROTATION_UNITS, TRANSLATION_UNITS, AxisUnits
from springs.short_repr import short_repr

Vector = tuple[float, float, float]

N = TypeVar("N", bound=Named)

CENTRE_OF_MASS_SITE = "CM"
"""The site name that Peabody reserves for the centre of mass."""

ROUNDED_AXIS_TOLERANCE = 1e-12
"""Above this difference from one an axis is scaled to length one; below it is taken as it is."""


def _set_vector(value: object, name: str, owner: str) -> None:
    """Convert a field to three finite floats; None stays. Raises ModelError."""
    numbers = getattr(value, name)
    if numbers is None:
        return
    vector = tuple(float(number) for number in numbers)
    if len(vector) != 3 or not all(map(isfinite, vector)):
        raise ModelError(f"{owner}: `{name}` needs three finite numbers, not {vector}")
    object.__setattr__(value, name, vector)


def _named_mapping(values: Mapping[str, N], subject: str) -> NamedMapping[N]:
    """Return values by their names. Raises ModelError for one under another name."""
    for name, value in values.items():
        if value.name != name:
            raise ModelError(
                f"`{shorten(value.name)}` is listed as `{shorten(name)}`; "
                "`by_name` makes a mapping from names"
            )
    return NamedMapping(values, subject)


@dataclass(frozen=True)
class Rotation:
    """`xyz(a, b, c)`: intrinsic X-Y-Z angles [rad]."""

    angles: Vector

    def __post_init__(self) -> None:
        """Check the numbers."""
        _set_vector(self, "angles", "a rotation")

    @property
    def matrix(self) -> Array:
        """The pose matrix, shape (4, 4)."""
        return pose_matrix(matrix_from_xyz(*self.angles), np.zeros(3))


@dataclass(frozen=True)
class Translation:
    """`trans(x, y, z)`: a translation [m]."""

    offset: Vector

    def __post_init__(self) -> None:
        """Check the numbers."""
        _set_vector(self, "offset", "a translation")

    @property
    def matrix(self) -> Array:
        """The pose matrix, shape (4, 4)."""
        return pose_matrix(np.eye(3), np.asarray(self.offset))


@short_repr
@dataclass(frozen=True)
class Location:
    """A product of rotations and translations as written; `*` composes in row-vector order.

    `xyz(...) * trans(...)` rotates first and then translates in the segment's unrotated frame: as
    column matrices the last factor stands leftmost.
    """

    factors: tuple[Rotation | Translation, ...] = ()

    @classmethod
    def at(cls, x: float, y: float, z: float) -> "Location":
        """Return a translation [m]: a site with the axes of its segment."""
        return cls((Translation((x, y, z)),))

    @cached_property
    def pose_in_segment(self) -> Array:
        """Pose of the site frame in the segment frame, shape (4, 4)."""
        return reduce(lambda pose, factor: factor.matrix @ pose, self.factors, np.eye(4))


@short_repr
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

    def __post_init__(self) -> None:
        """Check the loads."""
        for name in ("global_force", "local_force", "global_moment", "local_moment"):
            _set_vector(self, name, f"site `{shorten(self.name)}`")

    @property
    def pose_in_segment(self) -> Array:
        """Pose of the site frame in the segment frame, shape (4, 4)."""
        return self.location.pose_in_segment


@dataclass(frozen=True)
class ContactSphere:
    """A sphere fixed to a segment, by which it touches props.

    Attributes:
        centre: Centre in the segment frame [m].
        radius: Radius [m].
        part: Name of the part of the body that it belongs to; empty for none.
        region: Name of the firmer region of this part that it is in; empty for none.
    """

    centre: Vector
    radius: float
    part: str = ""
    region: str = ""

    def __post_init__(self) -> None:
        """Check the numbers."""
        _set_vector(self, "centre", "a contact sphere")
        object.__setattr__(self, "radius", float(self.radius))
        if not 0.0 < self.radius < inf:
            raise ModelError(f"the radius of a contact sphere is positive, not {self.radius:g} m")


@short_repr
@dataclass(frozen=True)
class Segment:
    """A rigid body, or a part of the ground when its mass is negative.

    mass [kg]; inertia: principal moments about the centre of mass along the segment's axes [kg m2];
    contact_spheres: own ones, in place of those that are fitted to its psurf.
    """

    name: str
    mass: float | None = None
    inertia: Vector | None = None
    psurf: str | None = None
    attributes: tuple[str, ...] = ()
    sites: Mapping[str, Site] = field(default_factory=dict[str, Site])
    contact_spheres: tuple[ContactSphere, ...] = ()
    origins: Mapping[str, Span] = field(default_factory=dict[str, Span], compare=False, repr=False)

    def __post_init__(self) -> None:
        """Check the numbers and the names of the sites."""
        owner = f"segment `{shorten(self.name)}`"
        _set_vector(self, "inertia", owner)
        if self.mass is not None:
            object.__setattr__(self, "mass", float(self.mass))
            if not isfinite(self.mass):
                raise ModelError(f"{owner}: the mass must be finite, not {self.mass}")
        sites = _named_mapping(self.sites, f"{owner} has no site")
        object.__setattr__(self, "sites", sites)

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

    `JointAxis.twist` and `units` say what most code needs of it. Code that can hold some kinds only
    matches it exhaustively or calls `is_rotation`, so that the type checker finds every place that
    a new kind needs.
    """

    ROTATION = "R"
    TRANSLATION = "T"

    @property
    def units(self) -> AxisUnits:
        """Units of its displacement and of what resists it."""
        match self:
            case AxisKind.ROTATION:
                return ROTATION_UNITS
            case AxisKind.TRANSLATION:
                return TRANSLATION_UNITS
            case _:
                assert_never(self)


def is_rotation(kind: Literal[AxisKind.ROTATION, AxisKind.TRANSLATION]) -> bool:
    """Return True for a rotation, False for a translation.

    For code that can hold these two kinds only: the type checker names each call that could get
    another one.
    """
    match kind:
        case AxisKind.ROTATION:
            return True
        case AxisKind.TRANSLATION:
            return False
        case _:
            assert_never(kind)


class Twist(NamedTuple):
    """Motion for a unit rate of a displacement, of the child's site in the parent's at zero.

    Attributes:
        angular: angular velocity for a unit rate.
        linear: velocity of the sites' common origin for a unit rate.
    """

    angular: Vector
    linear: Vector


@dataclass(frozen=True)
class JointAxis:
    """`R(x,y,z)` or `T(x,y,z)`: one degree of freedom about or along a unit axis."""

    kind: AxisKind
    axis: Vector

    def __post_init__(self) -> None:
        """Accept the letter of a kind, and scale the axis to length one.

        Raises ValueError for another kind, and ModelError for the zero vector.
        """
        object.__setattr__(self, "kind", AxisKind(self.kind))
        _set_vector(self, "axis", "a joint axis")
        length = hypot(*self.axis)
        if length == 0.0:
            raise ModelError("the zero vector is not a joint axis")
        if abs(length - 1.0) > ROUNDED_AXIS_TOLERANCE:
            x, y, z = self.axis
            object.__setattr__(self, "axis", (x / length, y / length, z / length))

    @property
    def units(self) -> AxisUnits:
        """Units of its displacement and of what resists it."""
        return self.kind.units

    @cached_property
    def twist(self) -> Twist:
        """Motion for a unit rate: a rotation about the axis, or a translation along it."""
        x, y, z = unit_vector(self.axis).tolist()
        match self.kind:
            case AxisKind.ROTATION:
                return Twist((x, y, z), (0.0, 0.0, 0.0))
            case AxisKind.TRANSLATION:
                return Twist((0.0, 0.0, 0.0), (x, y, z))
            case _:
                assert_never(self.kind)


@dataclass(frozen=True)
class Follower:
    """Rule by which a displacement of a joint follows another.

    Attributes:
        joint: Name of the joint whose displacement it follows.
        index: Place of that displacement in the joint's chain, from 0.
        curve: Displacement as a function of that one [rad or m].
    """

    joint: str
    index: int
    curve: FollowerCurve


@short_repr
@dataclass(frozen=True)
class Joint:
    """A connection of two segments: `child`'s site frame moves in `parent`'s.

    `parent` and `child` are the sites as written after `connect` and `to`; either may be nearer to
    the root. The chain's first factor is innermost, next to the child.
    `displacement` has a value for each factor [rad or m], zeros when it is left out; `stiff`
    [N m/rad or N/m], `rest` [rad or m], `damp` [N m s/rad or N s/m] and the limits [rad or m] have
    one for each factor, or are None. `followers` tells for each factor what its displacement
    follows, None for nothing; it is empty where all are free. Raises ModelError for another number
    of values.
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
    followers: tuple[Follower | None, ...] = ()
    origins: Mapping[str, Span] = field(default_factory=dict[str, Span], compare=False, repr=False)

    def __post_init__(self) -> None:
        """Check the number of values of each field, and that they are finite."""
        if not any(self.followers):
            object.__setattr__(self, "followers", ())
        elif len(self.followers) != len(self.chain):
            raise ModelError(
                f"joint `{shorten(self.name)}`: `followers` has "
                f"{format_count(len(self.followers), 'value')}, but the joint has "
                f"{format_count(len(self.chain), 'degree')} of freedom"
            )
        if not self.displacement:
            object.__setattr__(self, "displacement", (0.0,) * len(self.chain))
        for name in ("displacement", "stiff", "rest", "damp", "lower_limit", "upper_limit"):
            self._set_values(name, getattr(self, name))

    def _set_values(self, name: str, numbers: Sequence[float] | None) -> None:
        """Convert a field to floats, one for each factor. Raises ModelError."""
        if numbers is None:
            return
        values = tuple(float(number) for number in numbers)
        if len(values) != len(self.chain):
            raise ModelError(
                f"joint `{shorten(self.name)}`: `{name}` has {format_count(len(values), 'value')}, "
                f"but the joint has {format_count(len(self.chain), 'degree')} of freedom"
            )
        open_limit = {"lower_limit": -inf, "upper_limit": inf}.get(name)
        if not all(isfinite(value) or value == open_limit for value in values):
            raise ModelError(f"joint `{shorten(self.name)}`: `{name}` must be finite, not {values}")
        object.__setattr__(self, name, values)

    @property
    def ends(self) -> tuple[SiteRef, SiteRef]:
        """The parent's and the child's site."""
        return self.parent, self.child

    @property
    def degrees_of_freedom(self) -> int:
        """Number of displacements that follow no other."""
        return len(self.free_places)

    @property
    def free_places(self) -> tuple[int, ...]:
        """Places of the displacements that follow nothing, from 0."""
        followers = self.followers or (None,) * len(self.chain)
        return tuple(k for k, one in enumerate(followers) if one is None)

    def axes_of(self, count: int) -> tuple[JointAxis, ...]:
        """Return the factors to which so many values belong: all, or some.

        An elastic joint, such as a neck, has three rotations and three translations that are zero
        in the figure; three values are those of its rotations. Of a joint with displacements that
        follow others they may be those of the others.
        """
        if self.followers and count == len(self.free_places) > 0:
            return tuple(self.chain[k] for k in self.free_places)
        turns = tuple(factor for factor in self.chain if is_rotation(factor.kind))
        pairs = zip(self.chain, self.displacement, strict=True)
        is_elastic = not any(value for factor, value in pairs if factor not in turns)
        return (
            turns
            if count == 3 == len(turns) and len(self.chain) == 6 and is_elastic
            else self.chain
        )

    def complete(self, values: Sequence[float]) -> tuple[float, ...]:
        """Return a value for each factor, with zeros for those that `axes_of` leaves out."""
        if self.axes_of(len(values)) == self.chain:
            return tuple(values)
        turns = iter(values)
        if self.followers:
            return tuple(next(turns) if one is None else 0.0 for one in self.followers)
        return tuple(next(turns) if is_rotation(one.kind) else 0.0 for one in self.chain)


FOLLOWER_TOLERANCE = 1e-4
"""Largest difference of a stated displacement from its curve that rounding may make [rad or m]."""


def follower_faults(
    joints: Mapping[str, Joint],
    stated: Mapping[str, Sequence[float] | Array],
    displacements: Mapping[str, Sequence[float] | Array],
    rates: Mapping[str, Sequence[float] | Array] | None = None,
) -> Iterator[tuple[str, str]]:
    """Yield joints with values stated off the curves that they follow, and a sentence each.

    Args:
        joints: Joints by name.
        stated: Stated displacements by joint, or rates; zero states nothing [rad or m, per second].
        displacements: Displacements of all joints, of which those that are followed matter.
        rates: Rates of joints, if rates are stated; those of joints without any are zero.
    """
    for name in stated:
        for k, one in enumerate(joints[name].followers if name in joints else ()):
            if one is None or one.joint not in displacements or not stated[name][k]:
                continue
            value = float(one.curve.at(displacements[one.joint][one.index], int(rates is not None)))
            if rates is not None:
                value *= rates[one.joint][one.index] if one.joint in rates else 0.0
            if abs(stated[name][k] - value) > FOLLOWER_TOLERANCE:
                units, per = joints[name].chain[k].units, "" if rates is None else "/s"
                yield (
                    name,
                    f"{follower_sentence(name, k, one)} and "
                    f"{'is' if rates is None else 'moves by'} {units.format(value)}{per}, "
                    f"not {units.format(stated[name][k])}{per}",
                )


def follower_sentence(joint: str, index: int, follower: Follower) -> str:
    """Say what a displacement of a joint follows."""
    return (
        f"displacement {index + 1} of `{shorten(joint)}` follows displacement "
        f"{follower.index + 1} of `{shorten(follower.joint)}`"
    )


def without_followers(
    joints: Mapping[str, Joint], values: Mapping[str, Sequence[float] | Array]
) -> dict[str, tuple[float, ...]]:
    """Return values by joint with zeros, which state nothing, for displacements that follow."""
    return {
        name: tuple(
            float(value) if name not in joints or k in joints[name].free_places else 0.0
            for k, value in enumerate(row)
        )
        for name, row in values.items()
    }


def _format_displacements(joint: Joint) -> str:
    """Format the displacements in degrees and centimetres."""
    return ", ".join(
        axis.units.format(value)
        for axis, value in zip(joint.chain, joint.displacement, strict=True)
    )


@short_repr
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

    The mappings keep the order of the file, which is the order of joints in an action file; an
    unknown name raises UnknownNameError, a KeyError that states the nearest one. `path`
    is the file, beside which psurfs and springs are looked for; None when there is no file.
    `springs_text` is the springs file of a figure that is in no file; it is not part of the text of
    a figure file, beside which it belongs.
    `surfaces` are the contents of psurfs, by name, and `sha256` is the digest of the file, where
    they were read ahead; otherwise the files are read when they are needed.
    """

    segments: Mapping[str, Segment]
    joints: Mapping[str, Joint]
    root: SiteRef
    attributes: Mapping[str, Attribute] = field(default_factory=dict[str, Attribute])
    name: str | None = None
    path: Path | None = field(default=None, compare=False, repr=False)
    springs_text: str | None = field(default=None, repr=False)
    origins: Mapping[str, Span] = field(default_factory=dict[str, Span], compare=False, repr=False)
    surfaces: Mapping[str, Parsed[Any]] = field(
        default_factory=dict[str, Parsed[Any]], compare=False, repr=False
    )
    sha256: str | None = field(default=None, compare=False, repr=False)

    def __post_init__(self) -> None:
        """Check that every part is listed under its own name."""
        for name, kind in (
            ("segments", "segment"),
            ("joints", "joint"),
            ("attributes", "attribute"),
        ):
            parts = _named_mapping(getattr(self, name), f"the figure has no {kind}")
            object.__setattr__(self, name, parts)

    def __repr__(self) -> str:
        """Name and size, in a line."""
        name = self.name or (self.path.stem if self.path else "without a name")
        return (
            f"<Figure {name}: {format_count(len(self.segments), 'segment')}, "
            f"{format_count(len(self.joints), 'joint')}, "
            f"{self.freedoms}, "
            f"{self.total_mass:.4g} kg>"
        )

    def _repr_html_(self) -> str:
        """Tables of the segments and the joints, for notebooks."""
        segments = [
            (name, "ground" if name in self.ground else segment.mass, ", ".join(segment.sites))
            for name, segment in self.segments.items()
        ]
        joints = [
            (name, joint.parent, joint.child, _format_displacements(joint))
            for name, joint in self.joints.items()
        ]
        return html_table(
            str(self).strip("<>"), ("segment", "mass [kg]", "sites"), segments
        ) + html_table("", ("joint", "parent", "child", "displacements"), joints)

    def view(self, height: int = 600) -> PageView:
        """Return a page of the figure as its file poses it, in 3-D, for the cell of a notebook.

        See `Recording.view`.

        Args:
            height: Height of the cell [px].

        Raises:
            MoverError: The page cannot hold the figure.
        """
        # By name: motions are above.
        motion = import_module("generator.motion_files.motion").motion_from_figure(self)
        page = import_module("generator.motion_files.page").page_of_motion(motion)[0]
        return PageView(page, height)

    def with_parts(self, *parts: "Segment | Joint | Attribute") -> "Figure":
        """Return the figure with parts in place of those of the same names, or added to them.

        `figure.with_parts(replace(figure.joints["waist"], damp=(1.0, 1.0, 1.0)))` changes a joint.
        """
        changed: dict[str, dict[str, Any]] = {"segments": {}, "joints": {}, "attributes": {}}
        kinds = {Segment: "segments", Joint: "joints", Attribute: "attributes"}
        for part in parts:
            changed[kinds[type(part)]][part.name] = part
        return replace(
            self, **{name: {**getattr(self, name), **new} for name, new in changed.items()}
        )

    def site(self, ref: SiteRef) -> Site:
        """The site that `ref` names. Raises UnknownNameError for an unknown one."""
        return self.segments[ref.segment].sites[ref.site]

    @property
    def degrees_of_freedom(self) -> int:
        """Displacements that follow no other, of all joints; a loop takes some of them away."""
        return sum(joint.degrees_of_freedom for joint in self.joints.values())

    @property
    def freedoms(self) -> str:
        """The degrees of freedom in words, and the displacements that follow others."""
        followers = sum(
            one is not None for joint in self.joints.values() for one in joint.followers
        )
        more = f" and {format_count(followers, 'follower')}" if followers else ""
        return f"{format_count(self.degrees_of_freedom, 'degree')} of freedom{more}"

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
    def has_followers(self) -> bool:
        """Return whether a displacement follows another by a curve."""
        return any(any(joint.followers) for joint in self.joints.values())

    @property
    def moving_joints(self) -> dict[str, Joint]:
        """The joints of which an end moves, in the order of the file."""
        return {
            name: joint
            for name, joint in self.joints.items()
            if not {joint.parent.segment, joint.child.segment} <= self.ground
        }

    @property
    def bodies(self) -> dict[str, Segment]:
        """The segments that move, in the order of the file."""
        return {name: seg for name, seg in self.segments.items() if name not in self.ground}

    @property
    def total_mass(self) -> float:
        """Sum of the masses that move [kg]; a missing mass counts as zero."""
        return sum(seg.mass or 0.0 for seg in self.bodies.values())
