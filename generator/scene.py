"""Props that a figure may touch, and the force of one on a contact sphere.

`contact_force` is written once for arrays, symbols of Exudyn and recorded code; see
`springs.backends`.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from math import isfinite
from typing import NamedTuple, assert_never

import numpy as np

from generator.diagnostics import ModelError
from generator.rotations import Array, matrix_from_xyz, pose_matrix, rotation_with_z_axis
from springs.backends import NUMPY, Operations, Real
from springs.contact import DEFAULT_SURFACE, Surface
from springs.short_repr import short_repr

Vector = tuple[float, float, float]
Components = tuple[Real, Real, Real]

FLOOR = "floor"
"""Name of the plane that the option `--floor` adds."""


@dataclass(frozen=True)
class Plane:
    """The half-space below a plane.

    Attributes:
        point: on the plane [m].
        normal: pointing outwards, of any length.
    """

    point: Vector
    normal: Vector

    def __post_init__(self) -> None:
        """Raise ModelError without a direction."""
        if not (all(map(isfinite, self.normal)) and any(self.normal)):
            raise ModelError("a plane needs a normal that is not zero")

    @cached_property
    def pose(self) -> Array:
        """Axes of the plane, y along the normal, at its point, shape (4, 4)."""
        x, y, z = rotation_with_z_axis(np.divide(self.normal, max(map(abs, self.normal)))).T
        turn = np.eye(3) if np.array_equal(z, (0.0, 1.0, 0.0)) else np.array([x, z, -y]).T
        return pose_matrix(turn, self.point)


@dataclass(frozen=True)
class Box:
    """A box.

    Attributes:
        centre: [m].
        size: lengths of its edges along its own axes [m].
        angles: intrinsic x-y-z angles of these axes [rad].
    """

    centre: Vector
    size: Vector
    angles: Vector = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        """Raise ModelError for a box without a volume."""
        if not all(0.0 < length < np.inf for length in self.size):
            raise ModelError("the lengths of a box must be positive")

    @cached_property
    def pose(self) -> Array:
        """Axes of the box at its centre, shape (4, 4)."""
        return pose_matrix(matrix_from_xyz(*self.angles), self.centre)


Shape = Plane | Box


@short_repr
@dataclass(frozen=True)
class Prop:
    """A fixed body that a figure may touch."""

    name: str
    shape: Shape
    surface: Surface


@short_repr
@dataclass(frozen=True)
class Scene:
    """The props around a figure. Raises ModelError for two of one name."""

    props: tuple[Prop, ...] = ()

    @classmethod
    def floor(cls, up: Vector = (0.0, 1.0, 0.0), surface: Surface = DEFAULT_SURFACE) -> "Scene":
        """Return a floor alone."""
        return cls((floor_prop(up, surface),))

    def __post_init__(self) -> None:
        """Check the names."""
        names = Counter(prop.name for prop in self.props)
        for name, count in names.items():
            if count > 1:
                raise ModelError(f"two props are called `{name}`")


def floor_prop(up: Vector, surface: Surface = DEFAULT_SURFACE) -> Prop:
    """Return a plane through the world's origin, below which everything is floor."""
    return Prop(FLOOR, Plane((0.0, 0.0, 0.0), up), surface)


class Penetration(NamedTuple):
    """Depth of a sphere in a prop [m], negative outside, with the prop and the sphere's segment."""

    depth: float
    prop: str
    segment: str


def deepest_start(
    scene: Scene, centres: Array, radii: Array, segments: Sequence[str]
) -> Penetration | None:
    """Return the sphere that is deepest in a prop; None without spheres or props.

    Args:
        scene: with the props.
        centres: of the spheres in the world [m], shape (n, 3).
        radii: [m], shape (n,).
        segments: segment of each sphere.
    """
    deepest: Penetration | None = None
    for prop in scene.props:
        pose = prop.shape.pose
        local = (centres - pose[:3, 3]) @ pose[:3, :3]
        depths = radii - distance_from_shape(prop.shape, local)
        if not len(depths):
            continue
        k = int(np.argmax(depths))
        if deepest is None or depths[k] > deepest.depth:
            deepest = Penetration(float(depths[k]), prop.name, segments[k])
    return deepest


def distance_from_shape(shape: Shape, points: Array) -> Array:
    """Signed distances [m] of points in the axes of a shape, shape (..., 3); negative inside."""
    x, y, z = np.moveaxis(points, -1, 0)
    match shape:
        case Plane():
            return y
        case Box():
            return _distance_from_box(shape.size, (x, y, z), NUMPY)[0]
        case _:
            assert_never(shape)


class ContactForce(NamedTuple):
    """Force of a prop on a sphere, in the axes of the prop.

    Attributes:
        depth: of the sphere in the prop, negative outside [m].
        rate: of the depth [m/s].
        elastic: elastic part of the normal force [N].
        normal: normal force [N].
        direction: force over the normal force.
        arm: moment about the sphere's centre over the normal force [m].
        friction_power: power of the friction over the normal force [m/s].
    """

    depth: Real
    rate: Real
    elastic: Real
    normal: Real
    direction: Components
    arm: Components
    friction_power: Real


def contact_force(
    shape: Shape,
    surface: Surface,
    radius: Real,
    centre: Components,
    velocity: Components,
    spin: Components,
    ops: Operations = NUMPY,
    *,
    size: Components | None = None,
) -> ContactForce:
    """Return the force on a sphere.

    Friction acts at the point of the sphere that is deepest in the prop.

    Args:
        shape: of the prop.
        surface: of the prop.
        radius: of the sphere [m].
        centre: in the axes of the prop [m].
        velocity: of the centre, likewise [m/s].
        spin: angular velocity of the sphere, likewise [rad/s].
        ops: kind of the numbers.
        size: edges of a box [m], which may be arrays or symbols [default: those of the shape].
    """
    (vx, vy, vz), (wx, wy, wz) = velocity, spin
    match shape:
        case Plane():
            depth, rate = radius - centre[1], -vy
            cx, cz = vx + radius * wz, vz - radius * wx
            squared_speed = cx * cx + cz * cz
            factor = surface.friction_factor(squared_speed, ops)
            across = radius * factor
            direction = (-factor * cx, 1.0, -factor * cz)
            arm = (across * cz, 0.0, -across * cx)
        case Box():
            distance, (nx, ny, nz) = _distance_from_box(size or shape.size, centre, ops)
            depth = radius - distance
            normal_speed = nx * vx + ny * vy + nz * vz
            rate = -normal_speed
            cx = vx - nx * normal_speed - radius * (wy * nz - wz * ny)
            cy = vy - ny * normal_speed - radius * (wz * nx - wx * nz)
            cz = vz - nz * normal_speed - radius * (wx * ny - wy * nx)
            squared_speed = cx * cx + cy * cy + cz * cz
            factor = surface.friction_factor(squared_speed, ops)
            across = radius * factor
            direction = (nx - factor * cx, ny - factor * cy, nz - factor * cz)
            arm = (
                across * (ny * cz - nz * cy),
                across * (nz * cx - nx * cz),
                across * (nx * cy - ny * cx),
            )
        case _:
            assert_never(shape)
    elastic = surface.elastic_force(depth, ops)
    normal = elastic * surface.impact_factor(rate, ops)
    return ContactForce(depth, rate, elastic, normal, direction, arm, factor * squared_speed)


def _distance_from_box(
    size: Components, centre: Components, ops: Operations
) -> tuple[Real, Components]:
    """Signed distance of a point from a box, and its gradient, which is the outward normal.

    Outside, the gradient points away from the nearest point of the box; inside, from the nearest
    face.
    """
    signs = [ops.removable(p < 0.0, -1.0, 1.0) for p in centre]
    beyond = [sign * p - 0.5 * length for sign, p, length in zip(signs, centre, size, strict=True)]
    qx, qy, qz = beyond
    ox, oy, oz = (ops.removable(q > 0.0, q, 0.0) for q in beyond)
    outside = ops.sqrt(ox * ox + oy * oy + oz * oz)
    largest = ops.removable(qx > qy, qx, qy)
    largest = ops.removable(qz > largest, qz, largest)
    is_outside = largest > 0.0
    inverse = 1.0 / ops.removable(is_outside, outside, 1.0)
    x_face = ops.removable(qx > qy, ops.removable(qx > qz, 1.0, 0.0), 0.0)
    z_face = ops.removable(qz > qy, ops.removable(qz > qx, 1.0, 0.0), 0.0)
    faces = (x_face, 1.0 - x_face - z_face, z_face)
    nx, ny, nz = (
        sign * ops.removable(is_outside, o * inverse, face)
        for sign, o, face in zip(signs, (ox, oy, oz), faces, strict=True)
    )
    return ops.removable(is_outside, outside, largest), (nx, ny, nz)
