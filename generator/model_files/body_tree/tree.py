"""A tree of bodies as other programs describe it, before it becomes a figure.

A row of degrees of freedom connects a body with its parent. At values q its pose in the parent is
`X * exp(q1 s1) * exp(q2 s2) ...`, where the screws s rotate about or translate along axes in the
body's own frame: the first is outermost, next to the parent.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Protocol, assert_never

import numpy as np
from numpy.typing import ArrayLike

from generator.diagnostics import Span, shorten
from generator.figure import AxisKind, Vector
from generator.follower_curve import FollowerCurve
from generator.identifiers import free_name
from generator.inertia import MassProperties
from generator.losses import Losses
from generator.model_files.body_tree.shapes import Shape
from generator.rotations import Array, inverse_pose, matrix_from_axis_angle, pose_matrix
from generator.springs_file.parse import SpringEntry
from generator.springs_file.reach import ReachEntry
from springs import SphericalLaw


class Curve(Protocol):
    """A law of one displacement: an elastic law, or another function."""

    def torque(self, angle: Array, /) -> Array:
        """Torque on the child [N m or N] at displacements [rad or m]."""
        ...

    @property
    def breakpoints(self) -> tuple[float, ...]:
        """Displacements at which the slope of the torque jumps [rad or m]."""
        ...


@dataclass(frozen=True)
class FunctionCurve:
    """A law that is known as a function.

    Attributes:
        function: torque at displacements.
        breakpoints: displacements at which its slope jumps.
    """

    function: Callable[[Array], Array]
    breakpoints: tuple[float, ...] = ()

    def torque(self, angle: Array, /) -> Array:
        """Torque on the child [N m or N] at displacements [rad or m]."""
        return self.function(angle)


@dataclass(frozen=True)
class DegreeOfFreedom:
    """One degree of freedom with its passive law.

    Attributes:
        name: name of the coordinate.
        kind: kind of its motion, about the axis or along it.
        axis: unit vector in the body's frame.
        point: a point of the axis of a turn in the body's frame [m].
        value: value at the start [rad or m], from the pose `Body.pose`.
        offset: the model's coordinate is `scale` times the displacement plus this [rad or m].
        scale: positive.
        stiffness: [N m/rad or N/m].
        rest: value without spring force [rad or m], from the same zero as `value`.
        cubic: coefficients b, c of the force -(b x^2 + c x^3), x counted from `rest`.
        damping: [N m s/rad or N s/m].
        friction: dry friction [N m or N].
        lower: where a stop begins [rad or m], or None.
        upper: likewise.
        laws: further laws of the displacement, whose torques add.
        expected_range: range in which a law is sampled that no table holds exactly, or
            None.
        joint: degrees of freedom with the same name form one joint.
        control: coordinate that it follows by `curve`; "" for none.
        curve: displacement as a function of that coordinate, which is free; None for none.
    """

    name: str
    kind: AxisKind
    axis: Vector
    point: Vector = (0.0, 0.0, 0.0)
    value: float = 0.0
    offset: float = 0.0
    scale: float = 1.0
    stiffness: float = 0.0
    rest: float = 0.0
    cubic: tuple[float, float] = (0.0, 0.0)
    damping: float = 0.0
    friction: float = 0.0
    lower: float | None = None
    upper: float | None = None
    laws: tuple[Curve, ...] = ()
    expected_range: tuple[float, float] | None = None
    joint: str = ""
    control: str = ""
    curve: FollowerCurve | None = None

    @property
    def is_passive(self) -> bool:
        """True if anything resists it."""
        numbers = (self.stiffness, *self.cubic, self.damping, self.friction)
        limited = self.lower is not None or self.upper is not None
        return any(numbers) or limited or bool(self.laws)

    @property
    def pose(self) -> Array:
        """Pose at `value`, shape (4, 4)."""
        match self.kind:
            case AxisKind.ROTATION:
                turn = matrix_from_axis_angle(self.axis, self.value)
                point = np.asarray(self.point)
                return pose_matrix(turn, point - turn @ point)
            case AxisKind.TRANSLATION:
                return pose_matrix(np.eye(3), self.value * np.asarray(self.axis))
            case _:
                assert_never(self.kind)

    @property
    def flipped(self) -> "DegreeOfFreedom":
        """The degree of freedom of the parent as seen from the child."""
        x, y, z = (-part for part in self.axis)
        return replace(self, axis=(x, y, z))

    def in_frame(self, pose: Array) -> "DegreeOfFreedom":
        """Return the same degree of freedom in another frame, in which this one has `pose`."""
        x, y, z = (pose[:3, :3] @ self.axis).tolist()
        p, q, r = (pose[:3, :3] @ self.point + pose[:3, 3]).tolist()
        return replace(self, axis=(x, y, z), point=(p, q, r))


_OUTERMOST_FIRST = (("z", (0.0, 0.0, 1.0)), ("y", (0.0, 1.0, 0.0)), ("x", (1.0, 0.0, 0.0)))
"""Axes of several degrees of freedom, so that a chain is written x, y, z."""


def ball_dofs(name: str, point: Vector = (0.0, 0.0, 0.0)) -> list[DegreeOfFreedom]:
    """Return the rotations of a ball joint about a point [m], outermost first."""
    return [
        DegreeOfFreedom(f"{name}_{letter}", AxisKind.ROTATION, axis, point, joint=name)
        for letter, axis in _OUTERMOST_FIRST
    ]


def free_dofs(name: str) -> list[DegreeOfFreedom]:
    """Return the translations and the rotations of a free joint, outermost first."""
    slides = [
        DegreeOfFreedom(f"{name}_t{letter}", AxisKind.TRANSLATION, axis, joint=name)
        for letter, axis in _OUTERMOST_FIRST
    ]
    return [*slides, *ball_dofs(name)]


@dataclass(frozen=True)
class BodyReach:
    """Reach of the limb below a joint of three rotations.

    Attributes:
        table: Table of a springs file, its axes those of the joint's group; its joints have no
            meaning.
        laws: Tables of its laws, likewise.
    """

    table: ReachEntry
    laws: tuple[SpringEntry, ...]


@dataclass(frozen=True)
class Body:
    """A rigid body.

    Attributes:
        name: unique in its tree.
        parent: name of the parent body, None for the world.
        pose: pose of its frame in the parent's at zero displacements, shape (4, 4).
        dofs: dofs from the parent outwards to the body.
        mass: mass in the body's frame, or None.
        sites: frames fixed to it, by name, in the body's frame, shape (4, 4) each.
        span: where the model says it.
        joint: name of its joint if the model has one for the whole row.
        extra_inertia: part of the inertia about the centre of mass [kg m2] that is impossible by
            itself: a model may have such numbers for a part that is fixed to a larger one. Without
            mass it is the whole inertia.
        shapes: shapes in the body's frame.
        reach: reach of the limb, the law of its rotations, whose dofs have damping only.
    """

    name: str
    parent: str | None
    pose: Array
    dofs: tuple[DegreeOfFreedom, ...] = ()
    mass: MassProperties | None = None
    sites: Mapping[str, Array] = field(default_factory=dict[str, Array])
    span: Span | None = None
    joint: str = ""
    extra_inertia: Array = field(default_factory=lambda: np.zeros((3, 3)))
    shapes: tuple[Shape, ...] = ()
    reach: BodyReach | None = None

    @property
    def total_mass_properties(self) -> MassProperties | None:
        """Mass properties with the extra inertia. Raises ValueError if they are impossible."""
        if self.mass is None:
            return None
        return MassProperties(
            self.mass.mass, self.mass.centre, self.mass.inertia + self.extra_inertia
        )


def inertia_tensor(numbers: Iterable[float]) -> Array:
    """Return the tensor of the numbers xx, yy, zz, xy, xz, yz, shape (3, 3)."""
    xx, yy, zz, xy, xz, yz = numbers
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def split_extra_inertia(
    mass: float, centre: Array, inertia: Array, pose: Array
) -> tuple[MassProperties | None, Array]:
    """Return `Body.mass` and `Body.extra_inertia` from values in a frame with `pose` (4, 4).

    Raises ValueError for a negative mass.
    """
    if mass == 0.0:
        return None, pose[:3, :3] @ inertia @ pose[:3, :3].T
    try:
        return MassProperties(mass, centre, inertia).transform(pose), np.zeros((3, 3))
    except ValueError:
        point = MassProperties(mass, centre, np.zeros((3, 3))).transform(pose)
        return point, pose[:3, :3] @ inertia @ pose[:3, :3].T


@dataclass(frozen=True)
class BodyTree:
    """Bodies, each parent before its children.

    Attributes:
        bodies: bodies in that order.
        sites: frames fixed to the world.
        up_rotation: up rotation from the model's world to a figure's (y up, z ahead), shape (3, 3).
        name: name of the model, or None.
        span: where the model begins.
        shapes: fixed to the world, in its frame.
        law: law of joints of several rotations; None for that of coordinates where several hinges
            with laws form a joint and no ball has any, and else for the usual one.
    """

    bodies: tuple[Body, ...]
    sites: Mapping[str, Array]
    up_rotation: Array
    name: str | None = None
    span: Span | None = None
    shapes: tuple[Shape, ...] = ()
    law: SphericalLaw | None = None


Y_UP_FROM_Z_UP = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])
"""From x ahead, y left, z up to x left, y up, z ahead."""


def rotation_from_z_to(axis: tuple[float, float, float]) -> Array:
    """Return the shortest rotation of z onto a unit axis; half a turn about x for -z."""
    target = np.asarray(axis)
    across = np.cross([0.0, 0.0, 1.0], target)
    sine = float(np.linalg.norm(across))
    if sine < 1e-10:
        return np.eye(3) if target[2] > 0.0 else np.diag([1.0, -1.0, -1.0])
    return matrix_from_axis_angle(across / sine, float(np.arctan2(sine, target[2])))


def swap_massless_parents(tree: BodyTree) -> BodyTree:
    """Return the tree in which joints carry the bodies that have mass.

    Some models fix a body to a massless one at the joint. The two change places, so that the
    segment has the name of the body.
    """
    fixed: dict[str | None, Body] = {}
    for body in tree.bodies:
        if not body.dofs and body.mass is not None:
            fixed.setdefault(body.parent, body)
    swapped: dict[str, Body] = {}
    for body in tree.bodies:
        heavy = fixed.get(body.name)
        if body.name in swapped:
            continue
        if body.mass is not None or not body.dofs or heavy is None:
            swapped[body.name] = body
            continue
        back = inverse_pose(heavy.pose)
        swapped[heavy.name] = replace(
            heavy,
            parent=body.parent,
            pose=body.pose @ heavy.pose,
            dofs=tuple(freedom.in_frame(back) for freedom in body.dofs),
            joint=body.joint,
        )
        swapped[body.name] = replace(body, parent=heavy.name, pose=back, dofs=(), joint="")
    return replace(tree, bodies=tuple(swapped.values()))


def merge_rigid_bodies(
    tree: BodyTree, losses: Losses, kept_bodies: frozenset[str] = frozenset()
) -> BodyTree:
    """Merge bodies without degrees of freedom into their parents; their frames become sites.

    Args:
        tree: the tree.
        losses: collects the names that change.
        kept_bodies: names of bodies that are not merged.
    """
    homes: dict[str, tuple[str | None, Array]] = {}
    kept: dict[str, Body] = {}
    world, world_shapes = dict(tree.sites), tree.shapes
    for body in tree.bodies:
        parent, before = homes.get(body.parent or "", (body.parent, np.eye(4)))
        pose = before @ body.pose
        if body.dofs or body.name in kept_bodies:
            kept[body.name] = replace(body, parent=parent, pose=pose)
            continue
        homes[body.name] = (parent, pose)
        own = {name: pose @ site for name, site in body.sites.items()}
        sites = _merge_sites({body.name: pose}, own, losses)
        shapes = tuple(shape.transformed(pose) for shape in body.shapes)
        if parent is None:
            world = _merge_sites(world, sites, losses)
            world_shapes += shapes
            continue
        home = kept[parent]
        moved = None if body.mass is None else body.mass.transform(pose)
        mass = home.mass if moved is None else moved if home.mass is None else home.mass + moved
        loose = home.extra_inertia + pose[:3, :3] @ body.extra_inertia @ pose[:3, :3].T
        sites = _merge_sites(home.sites, sites, losses)
        kept[parent] = replace(
            home, mass=mass, extra_inertia=loose, sites=sites, shapes=(*home.shapes, *shapes)
        )
    return replace(tree, bodies=tuple(kept.values()), sites=world, shapes=world_shapes)


def _merge_sites(
    first: Mapping[str, Array], second: Mapping[str, Array], losses: Losses
) -> dict[str, Array]:
    """Return both, with new names for sites of `second` whose names are taken."""
    joined = dict(first)
    for name, pose in second.items():
        word = free_name(name, joined)
        joined[word] = pose
        if word != name:
            add_new_names(losses, {name: word})
    return joined


def add_new_names(losses: Losses, renamed: Mapping[str, str]) -> None:
    """Report changed names."""
    places = [f"`{shorten(name)}` is `{shorten(word)}`" for name, word in renamed.items()]
    losses.add_description("changed names", *places)


def own_site_names(body: str, sites: Mapping[str, Array]) -> dict[str, Array]:
    """Return the sites of a body, `BODY.SITE` as `SITE`: names may be unique in a whole model."""
    own = {name: name.removeprefix(f"{body}.") for name in sites}
    return {new if new not in sites else name: sites[name] for name, new in own.items()}


def merge_massless_bodies(tree: BodyTree) -> tuple[BodyTree, tuple[str, ...]]:
    """Merge each massless body with a single child into the child's joint; return the names too.

    The degrees of freedom of the two form one row: the motion does not change.
    """
    bodies = {body.name: body for body in tree.bodies}
    carried: dict[str | None, list[str]] = {}
    for body in tree.bodies:
        carried.setdefault(body.parent, []).append(body.name)
    gone: list[str] = []
    for body in reversed(tree.bodies):
        here, children = bodies[body.name], carried.get(body.name, [])
        if here.mass is not None or not here.dofs or len(children) != 1:
            continue
        child = bodies[children[0]]
        back = inverse_pose(child.pose)
        row = (*(freedom.in_frame(back) for freedom in here.dofs), *child.dofs)
        bodies[child.name] = replace(
            child, parent=here.parent, pose=here.pose @ child.pose, dofs=row, joint=""
        )
        del bodies[body.name]
        siblings = carried[here.parent]
        siblings[siblings.index(body.name)] = child.name
        gone.append(body.name)
    return replace(tree, bodies=tuple(bodies.values())), tuple(reversed(gone))


STANDARD_GRAVITY = 9.81
_ALIGNMENT_TOLERANCE = 1e-9

_GRAVITY_TOLERANCE = 1e-7
"""Difference of a gravity from the standard one that is not reported [m/s^2]."""


def rotation_to_y_up(gravity: ArrayLike, losses: Losses) -> Array:
    """Return the rotation from the model's world to a figure's, (3, 3), for a gravity [m/s^2].

    The identity if y is up. Without gravity z counts as up. From a direction between the axes it is
    the shortest rotation from z. Reports a rotation, and a gravity that is not the standard one.
    """
    up = _rotation_to_y_up(np.asarray(gravity))
    columns = [_axis_name(axis) for axis in up.T]
    if not all(columns):
        losses.add_description("the world is turned so that gravity points against y")
    elif columns != ["x", "y", "z"]:
        new = ", ".join(columns)
        losses.add_description(
            f"the world is turned so that y is up: x, y, z of the model are {new} of the figure"
        )
    size = float(np.linalg.norm(gravity))
    if abs(size - STANDARD_GRAVITY) > _GRAVITY_TOLERANCE:
        losses.add(f"gravity of {size:.8g} m/s^2: simulate with `--gravity 0,{-size + 0.0:.8g},0`")
    return up


def _rotation_to_y_up(gravity: Array) -> Array:
    size = float(np.linalg.norm(gravity))
    if size == 0.0:
        return Y_UP_FROM_Z_UP
    up = -gravity / size
    if np.abs(up - [0.0, 1.0, 0.0]).max() < _ALIGNMENT_TOLERANCE:
        return np.eye(3)
    if np.abs(up - [0.0, 0.0, 1.0]).max() < _ALIGNMENT_TOLERANCE:
        return Y_UP_FROM_Z_UP
    x, y, z = up.tolist()
    return Y_UP_FROM_Z_UP @ rotation_from_z_to((x, y, z)).T


def _axis_name(axis: Array) -> str:
    """Return `x`, `-z` ... for a unit vector along a coordinate axis; empty for another."""
    place = int(np.argmax(np.abs(axis)))
    if abs(axis[place]) < 1.0 - _ALIGNMENT_TOLERANCE:
        return ""
    return f"{'-' if axis[place] < 0.0 else ''}{'xyz'[place]}"
