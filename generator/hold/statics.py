"""Static moments of a posture: what joints must supply under gravity, loads and supports.

The generalized forces on the displacements are minus the sum of J^T w over all wrenches w, with the
Jacobians J of the segments.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from generator.diagnostics import UsageError, spelling_hint
from generator.figure import CENTRE_OF_MASS_SITE, Figure
from generator.kinematics.placement import Placement, segment_jacobians
from generator.rotations import Array, cross_product

GRAVITY = (0.0, -9.81, 0.0)
"""Acceleration of gravity in the world [m/s2]."""

GRIP_SITE = "grip"
"""Site of a segment at which loads act by default; without it they act at the centre of mass."""


@dataclass(frozen=True)
class Load:
    """A load on a segment: a mass that hangs from it, and a force.

    Attributes:
        segment: Name of the segment.
        mass: Mass [kg].
        force: Force on the segment in world axes [N].
        site: Site at which both act; "" for `grip`, or else the centre of mass.
    """

    segment: str
    mass: float = 0.0
    force: tuple[float, float, float] = (0.0, 0.0, 0.0)
    site: str = ""

    @property
    def total(self) -> Array:
        """Force with the weight of the mass [N], shape (3,)."""
        return np.array(self.force) + self.mass * np.array(GRAVITY)


@dataclass(frozen=True)
class Wrench:
    """A force on a segment at a point, and a couple.

    Attributes:
        segment: Name of the segment.
        force: Shape (3,) [N].
        point: Point of action in the world, shape (3,) [m].
        couple: Shape (3,) [N m].
    """

    segment: str
    force: Array
    point: Array
    couple: Array

    @property
    def moment(self) -> Array:
        """Moment about the world's origin [N m], shape (3,)."""
        return cross_product(self.point, self.force) + self.couple


def site_point(placement: Placement, segment: str, site: str = "") -> Array:
    """Return the place of a site in the world, shape (3,) [m].

    Without a site: the grip, or else the centre of mass. Raises UsageError for a segment or site
    that the figure does not have.
    """
    figure = placement.tree.figure
    if segment not in figure.segments:
        hint = spelling_hint(segment, figure.bodies)
        raise UsageError(f"the figure has no segment `{segment}`; {hint}")
    sites = figure.segments[segment].sites
    name = site or (GRIP_SITE if GRIP_SITE in sites else CENTRE_OF_MASS_SITE)
    if name not in sites:
        if not site:
            raise UsageError(f"segment `{segment}` has no site `{name}`; name one: {segment}.SITE")
        raise UsageError(f"segment `{segment}` has no site `{name}`; {spelling_hint(name, sites)}")
    return np.array((placement.poses[segment] @ sites[name].pose_in_segment)[:3, 3])


def load_wrenches(placement: Placement, loads: Iterable[Load]) -> list[Wrench]:
    """Return the wrenches of loads. Raises UsageError, as `site_point`."""
    return [
        Wrench(
            load.segment, load.total, site_point(placement, load.segment, load.site), np.zeros(3)
        )
        for load in loads
    ]


def weight_wrenches(placement: Placement, figure: Figure) -> list[Wrench]:
    """Return the weights of the moving segments at their centres of mass.

    Those without mass have none.
    """
    found: list[Wrench] = []
    for name, body in figure.bodies.items():
        if body.mass and body.centre_of_mass is not None:
            pose = placement.poses[name]
            point = pose[:3, :3] @ body.centre_of_mass + pose[:3, 3]
            found.append(Wrench(name, body.mass * np.array(GRAVITY), point, np.zeros(3)))
    return found


def total_wrench(wrenches: Sequence[Wrench]) -> tuple[Array, Array]:
    """Return the sum of forces [N] and of moments about the world's origin [N m], shape (3,)."""
    force, moment = np.zeros(3), np.zeros(3)
    for one in wrenches:
        force += one.force
        moment += one.moment
    return force, moment


def net_moments(
    placement: Placement,
    wrenches: Iterable[Wrench],
    jacobians: Mapping[str, Array] | None = None,
) -> dict[str, Array]:
    """Return what joints must supply to hold a posture, shape (n,) per joint [N m or N].

    Args:
        placement: Posture.
        wrenches: All wrenches on segments: weights, loads and supports.
        jacobians: Result of `segment_jacobians`; None to compute it.
    """
    rows = segment_jacobians(placement) if jacobians is None else jacobians
    kinematics = placement.tree.kinematics
    forces = np.zeros(kinematics.size)
    for one in wrenches:
        forces -= rows[one.segment].T @ np.concatenate([one.moment, one.force])
    return {name: forces[columns] for name, columns in kinematics.columns.items()}
