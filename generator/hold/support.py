"""Supports of a posture: feet, a seat or sites, and the forces with which they carry the body."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from generator.diagnostics import MoverError, UsageError, spelling_hint
from generator.figure import CENTRE_OF_MASS_SITE, Figure, SiteRef
from generator.geometry.read import read_segment_surface
from generator.hold.statics import Wrench
from generator.kinematics.placement import Placement
from generator.kinematics.stability import (
    Patch,
    Stability,
    patch_from_faces,
    patch_from_site,
    stability,
)
from generator.rotations import Array, cross_product

SOLE_BAND = 0.01
"""Height over the lowest point of a segment up to which it bears on the ground [m]."""

SEAT = "seat"
"""Name of the support of a seat, which bears the pelvis."""

GROUND = "ground"
"""Name of no support: the figure is fixed to the ground by its root."""

SEAT_BAND = 0.04
"""Height over the lowest point of the pelvis up to which a seat bears it [m], an estimate: the
flesh of the buttocks yields."""

_PELVIS = ("lower_torso", "pelvis")
FEET = ("left_foot", "right_foot")
"""Supports by default."""


class OutOfBalanceError(MoverError):
    """The centre of pressure is outside the supports."""


class OffGroundError(MoverError):
    """Another segment is lower than both feet."""


@dataclass(frozen=True)
class Area:
    """Points of a segment that bear on the ground or a seat.

    Attributes:
        name: Name of the support.
        patch: Points on the segment.
        band: Height over the lowest point up to which points bear [m].
    """

    name: str
    patch: Patch
    band: float

    def points(self, placement: Placement) -> Array:
        """Return the points that bear in a posture, in the world, shape (n, 3) [m]."""
        pose = placement.poses[self.patch.segment]
        points = self.patch.points_in_segment @ pose[:3, :3].T + pose[:3, 3]
        heights = points[:, 1]
        return np.asarray(points[heights <= heights.min() + self.band])


@dataclass(frozen=True)
class Bearing:
    """A support in a posture.

    Attributes:
        name: Name of the support.
        segment: Segment that it bears.
        points: Corners of its area, shape (n, 3) [m].
        force: Force on the segment, shape (3,) [N].
        point: Centre of pressure, shape (3,) [m].
        couple: Couple about the vertical [N m].
        is_inside: Whether its own centre of pressure is within its area.
    """

    name: str
    segment: str
    points: Array
    force: Array
    point: Array
    couple: float
    is_inside: bool

    @property
    def wrench(self) -> Wrench:
        """Wrench on the segment."""
        return Wrench(self.segment, self.force, self.point, np.array([0.0, self.couple, 0.0]))


@dataclass(frozen=True)
class Standing:
    """Supports of a body with their forces.

    Attributes:
        bearings: Supports with their forces.
        stability: Centre of pressure, on the plane of the supports, beside their hull.
    """

    bearings: tuple[Bearing, ...]
    stability: Stability

    @property
    def centre_of_pressure(self) -> Array:
        """Mean of the points of action, by vertical force, shape (3,) [m]."""
        forces = np.array([one.force[1] for one in self.bearings])
        points = np.array([one.point for one in self.bearings])
        return np.asarray(forces @ points / forces.sum())

    @property
    def margin(self) -> float:
        """Distance of the centre of pressure to the edge of the support [m]; negative outside."""
        return self.stability.margin

    @cached_property
    def wrenches(self) -> tuple[Wrench, ...]:
        """Wrenches on the segments."""
        return tuple(one.wrench for one in self.bearings)


def default_supports(figure: Figure) -> tuple[str, ...]:
    """Return both feet; the ground for a figure without them."""
    feet = tuple(name for name in FEET if name in figure.bodies)
    return feet or (GROUND,)


def support_areas(figure: Figure, names: Sequence[str]) -> tuple[Area, ...]:
    """Return the areas of supports: segments, `SEGMENT.SITE`, `seat`; none for `ground`.

    Raises:
        UsageError: A name that the figure does not have, one that is listed twice, or `ground` with
            others.
        InputError: A psurf cannot be read.
    """
    areas: list[Area] = []
    for name in names:
        if names.count(name) > 1:
            raise UsageError(f"support `{name}` is listed twice")
        if name == GROUND and len(names) > 1:
            raise UsageError(f"the support `{GROUND}` fixes the root, and stands alone")
        if name != GROUND:
            areas.append(_area(figure, name))
    return tuple(areas)


def _area(figure: Figure, name: str) -> Area:
    segment, dot, site = name.partition(".")
    if name == SEAT:
        segment = next((one for one in _PELVIS if one in figure.bodies), "")
        if not segment:
            raise UsageError(f"support `{SEAT}`: the figure has no segment {' or '.join(_PELVIS)}")
    if segment not in figure.bodies:
        known = [*figure.bodies, SEAT, GROUND]
        raise UsageError(f"the figure has no segment `{segment}`; {spelling_hint(segment, known)}")
    if dot:
        return Area(name, patch_from_site(figure, SiteRef(segment, site)), 0.0)
    if figure.segments[segment].psurf is None:
        # Persons of studies have no psurfs; their feet have sites at heel and toe.
        sites = [each for each in figure.segments[segment].sites if each != CENTRE_OF_MASS_SITE]
        if not sites:
            raise UsageError(f"segment `{segment}` has neither a psurf nor sites")
        patches = [patch_from_site(figure, SiteRef(segment, each)) for each in sites]
        points = np.concatenate([each.points_in_segment for each in patches])
        names = tuple(name for each in patches for name in each.names)
        patch = Patch(segment, points, names, names)
    else:
        patch = patch_from_faces(figure, segment)
    return Area(name, patch, SEAT_BAND if name == SEAT else SOLE_BAND)


def body_points(figure: Figure) -> dict[str, Array]:
    """Return the corners of the psurf of each moving segment that has one, shape (n, 3) [m].

    Raises InputError when one cannot be read.
    """
    return {
        name: read_segment_surface(figure, body).vertices
        for name, body in figure.bodies.items()
        if body.psurf is not None
    }


def check_on_ground(
    points: Mapping[str, Array], areas: Sequence[Area], placement: Placement
) -> None:
    """Raise OffGroundError where another segment is lower than all areas.

    `points` are the `body_points` of the figure.
    """
    lowest = min(float(area.points(placement)[:, 1].min()) for area in areas)
    own = {area.patch.segment for area in areas}
    for name, vertices in points.items():
        if name in own:
            continue
        pose = placement.poses[name]
        height = float((vertices @ pose[1, :3]).min() + pose[1, 3])
        if height < lowest - SOLE_BAND:
            feet = "both feet are" if len(areas) > 1 else f"{areas[0].name} is"
            raise OffGroundError(
                f"{feet} off the ground: {name} is {100 * (lowest - height):.0f} cm lower; "
                "state what bears the body with --support"
            )


def lifted(areas: Sequence[Area], placement: Placement) -> list[Area]:
    """Return the areas that are higher than the lowest one by more than `SOLE_BAND`."""
    heights = [float(area.points(placement)[:, 1].min()) for area in areas]
    return [
        area
        for area, height in zip(areas, heights, strict=True)
        if height > min(heights) + SOLE_BAND
    ]


def carry(areas: Sequence[Area], placement: Placement, force: Array, moment: Array) -> Standing:
    """Return how supports carry a body, so that all forces and moments are in equilibrium.

    Vertical forces are those whose centre is nearest to the centre of pressure, and among these the
    most equal ones: on two feet each bears by its distance from the centre of pressure along the
    line between them. All points of action are then shifted alike. Horizontal forces and the couple
    about the vertical are divided as the vertical forces.

    Args:
        areas: Supports, one or more.
        placement: Posture.
        force: Sum of weights and loads, shape (3,) [N].
        moment: Their moment about the world's origin, shape (3,) [N m].

    Raises:
        OutOfBalanceError: The loads lift the body.
    """
    weight = -float(force[1])
    if weight <= 0.0:
        raise OutOfBalanceError(
            f"the loads lift the body: they pull it up by {-weight:.0f} N more than its weight"
        )
    points = [area.points(placement) for area in areas]
    centres = np.array([centroid(each) for each in points])
    shares = _shares(centres, force, moment)
    forces = -shares[:, None] * force
    residual = -moment - np.cross(centres, forces).sum(axis=0)
    shift = np.array([residual[2] / weight, 0.0, -residual[0] / weight])
    # What the shift of sideways forces adds about the vertical.
    couple = residual[1] - float(cross_product(shift, -force)[1])
    actions = centres + shift
    bearings = tuple(
        Bearing(
            area.name,
            area.patch.segment,
            corners,
            own,
            action,
            float(share) * couple,
            stability(action, corners).margin >= -_OWN_TOLERANCE,
        )
        for area, corners, own, action, share in zip(
            areas, points, forces, actions, shares, strict=True
        )
        if share > 0.0
    )
    centre = shares @ actions
    return Standing(bearings, stability(centre, np.concatenate(points)))


_OWN_TOLERANCE = 1e-6
"""Distance outside its area up to which a support's own centre of pressure is inside [m]."""


def _shares(centres: Array, force: Array, moment: Array) -> Array:
    """Return the shares of the vertical force, shape (n,); their sum is 1."""
    active = list(range(len(centres)))
    shares = np.zeros(len(centres))
    while True:
        some = centres[active]
        height = float(shares[active] @ some[:, 1]) if shares.any() else float(some[:, 1].mean())
        shares[:] = 0.0
        shares[active] = _equal_shares(some[:, [0, 2]], _pressure_centre(force, moment, height))
        # Horizontal forces act at the heights of the supports: once more with their mean.
        height = float(shares @ centres[:, 1])
        shares[active] = _equal_shares(some[:, [0, 2]], _pressure_centre(force, moment, height))
        worst = int(np.argmin(shares))
        if shares[worst] >= 0.0:
            return shares
        active.remove(worst)


def _pressure_centre(force: Array, moment: Array, height: float) -> Array:
    """Return x and z where the resultant has no moment about horizontal axes, at a height."""
    at = np.array([0.0, height, 0.0])
    about = moment - cross_product(at, force)
    return np.array([about[2] / force[1], -about[0] / force[1]])


def _equal_shares(centres: Array, target: Array) -> Array:
    """Return the most equal shares whose centre (2,) is nearest to a target, shape (n,)."""
    count = len(centres)
    mean = np.full(count, 1.0 / count)
    if count == 1:
        return mean
    offsets = centres - centres.mean(axis=0)
    # Differences of shares have the sum zero: offsets from the mean have no such part.
    inverse = np.asarray(np.linalg.pinv(offsets.T, rcond=1e-9), dtype=float)
    differences: Array = inverse @ (target - centres.mean(axis=0))
    return np.asarray(mean + differences - differences.mean())


def centroid(points: Array) -> Array:
    """Return the centroid of the hull of points, seen from above, at their mean height, (3,)."""
    found = stability(points.mean(axis=0), points)
    corners = found.corners
    if len(corners) < 3:
        return np.asarray(points.mean(axis=0))
    middle = corners.mean(axis=0)
    following = np.roll(corners, -1, axis=0)
    areas = np.cross(corners - middle, following - middle)[:, 1]
    thirds = (corners + following + middle) / 3.0
    x, _, z = areas @ thirds / areas.sum()
    return np.array([x, points[:, 1].mean(), z])


_LEAST_PART = float(np.sin(np.pi / 8.0))
"""Component of a direction from which it is named: there are eight directions."""


def support_label(name: str) -> str:
    """Return the words of a support."""
    return f"the {name.replace('_', ' ')}" if name in (*FEET, SEAT) else name


def balance_sentence(standing: Standing, forwards: Array | None) -> str:
    """Return why a posture is refused, with the way in which it tips and what may help.

    Args:
        standing: Supports.
        forwards: Horizontal direction in which the pelvis can be shifted, shape (3,); None where it
            cannot.
    """
    found = standing.stability
    names = [one.name for one in standing.bearings]
    where = " and ".join(map(support_label, names))
    if sorted(names) == sorted(FEET):
        where = "both feet"
    ways: list[str] = []
    if found.direction is not None:
        x, _, z = found.direction.tolist()
        if abs(z) > _LEAST_PART:
            ways.append("forward" if z > 0.0 else "back")
        if abs(x) > _LEAST_PART:
            ways.append("to the left" if x > 0.0 else "to the right")
    way = f", {' and '.join(ways)}" if ways else ""
    return (
        f"the centre of pressure is {-100.0 * found.margin:.1f} cm outside {where}{way}: the "
        f"person tips over; {_balance_advice(found, forwards)}"
    )


def _balance_advice(found: Stability, forwards: Array | None) -> str:
    """Return what brings the centre of pressure over the support."""
    if forwards is None:
        return "change the pose"
    aside = np.array([-forwards[2], 0.0, forwards[0]])
    sides = found.corners @ aside
    if sides.min() <= found.centre @ aside <= sides.max():
        return "change the pose, or shift the pelvis by --balance"
    return (
        "lean to the other side, or name what else bears it by --support (--balance shifts fore "
        "and aft only)"
    )
