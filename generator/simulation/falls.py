"""Kinds of fall: how a person who stands starts to fall (`docs/falls.md`).

A kind is a row of `FALLS`; all of its numbers are class estimates. Each quantity is drawn from a
uniform distribution, so that one seed is one fall. A standing person is upright along y and faces
+z, as persons and the prototype do.
"""

from dataclasses import dataclass, replace
from math import cos, pi, radians, sin

import numpy as np

from generator.contact.box import Box
from generator.contact.scene import NO_SCENE, Scene, add_floor
from generator.contact.spheres import contact_spheres
from generator.diagnostics import ModelError, NamedMapping, spelling_hint
from generator.figure import ContactSphere, Figure, Joint
from generator.input_files.scene import SCENE_FILE
from generator.input_files.tone import TONE_FILE
from generator.joint_chain import build_chain
from generator.kinematics.free_root import lowest_sphere_point
from generator.kinematics.placement import (
    Displacements,
    Placement,
    forward_kinematics,
    initial_displacements,
)
from generator.kinematics.tree import build_tree
from generator.rotations import Array, matrix_from_axis_angle, pose_matrix
from generator.simulation.plan import Plan
from generator.tone import Tone

Range = tuple[float, float]
"""Least and largest value of a uniform distribution."""

FALL_DURATION = 2.0
"""Duration of a fall, in which all parts of a person come to lie [s]."""

TOE_HEIGHT = 0.1
"""Height below which a contact sphere may be of the toes [m]."""

_UP = np.array([0.0, 1.0, 0.0])

_SIDES = ("left", "right")

_SHARES = {"hip_joint": 0.5, "knee": 1.0, "ankle": 0.5}
"""Flexion of the joints of a leg, the last displacement of each, over that of the knee."""


def _degrees(low: float, high: float | None = None) -> Range:
    return radians(low), radians(low if high is None else high)


_STILL, _BENT = (0.0, 0.0), _degrees(5.0, 25.0)


@dataclass(frozen=True)
class Fall:
    """A kind of fall: what is drawn for the start of a person who stands.

    Attributes:
        direction: Direction of lean and speed, 0 forward and pi/2 to the left [rad].
        lean: Angle by which the whole body leans in it, negative away from it [rad].
        speed: Speed of the whole body in it [m/s].
        feet_speed: Forward speed of the feet, as the legs swing about the hips [m/s].
        knees: Flexion of each knee; hip and ankle bend half as much [rad].
        height: Height of the lowest point [m].
        friction: Coefficient of friction of the floor; None for that of `--floor`.
        scene: Shipped scene beside the floor; "" for none.
        toes: Place along z at which the scene expects the toes [m]; None for a scene that stays.
        tone: Shipped tone of the muscles, of figures that have its joints; "" for a limp body.
    """

    direction: Range
    lean: Range = _STILL
    speed: Range = _STILL
    feet_speed: Range = _STILL
    knees: Range = _BENT
    height: float = 0.0
    friction: float | None = None
    scene: str = ""
    toes: float | None = None
    tone: str = ""


_TONE = "fall"
"""Tone of those who are awake and stand."""

_ANYWHERE, _FORWARD, _BACKWARD = (-pi, pi), _degrees(-10.0, 10.0), _degrees(170.0, 190.0)

FALLS: NamedMapping[Fall] = NamedMapping(
    {
        "faint": Fall(_ANYWHERE, lean=_degrees(3.0, 15.0)),
        "push": Fall(_ANYWHERE, speed=(0.0, 1.0), tone=_TONE),
        "slip": Fall(
            _FORWARD, lean=_degrees(-5.0), feet_speed=(1.0, 1.0), friction=0.2, tone=_TONE
        ),
        "trip": Fall(_FORWARD, speed=(1.2, 1.2), scene="trip", toes=0.2, tone=_TONE),
        "stairs": Fall(
            _FORWARD, speed=(1.2, 1.2), height=0.51, scene="stairs", toes=0.2, tone=_TONE
        ),
        "bed": Fall(_BACKWARD, lean=_degrees(90.0), height=0.5, scene="bed"),
        "seat": Fall(_BACKWARD, speed=(1.0, 1.4), scene="seat"),
    },
    "unknown kind of fall",
)
"""Kinds of fall, by name."""


def fall_direction(kind: str, seed: int = 0) -> float:
    """Return the direction of lean and speed of one fall, 0 forward and pi/2 to the left [rad].

    Args:
        kind: Kind of the fall, a name of `FALLS`.
        seed: Seed of the random numbers.

    Raises UnknownNameError for an unknown kind.
    """
    return _drawn_start(FALLS[kind], seed)[0]


def _drawn_start(fall: Fall, seed: int) -> tuple[float, ...]:
    """Return direction, lean, speed, speed of the feet, and flexions of the knees of a seed."""
    ranges = (fall.direction, fall.lean, fall.speed, fall.feet_speed, fall.knees, fall.knees)
    generator = np.random.default_rng(seed)
    return tuple(generator.uniform(*one) for one in ranges)


def fall_plan(figure: Figure, kind: str, seed: int = 0) -> Plan:
    """Return the plan of one fall of a person who stands.

    `replace(fall_plan(figure, "faint"), stop=3.0)` changes other fields of the plan.

    Args:
        figure: Person, or another figure whose legs have the joints of a person by name.
        kind: Kind of the fall, a name of `FALLS`.
        seed: Seed of the random numbers, at least 0. The same seed gives the same start, bit for
            bit.

    Raises:
        UnknownNameError: The kind is unknown.
        ModelError: The figure does not stand as persons do.
        InputError: A psurf of the figure cannot be read.
    """
    fall = FALLS[kind]
    bare = Plan(stop=FALL_DURATION, free_root=True, height=fall.height)
    return replace(with_start(bare, figure, kind, seed), tone=_tone(figure, fall.tone))


def with_start(plan: Plan, figure: Figure, kind: str, seed: int) -> Plan:
    """Return a plan with the start and the props of one fall; see `fall_plan`."""
    fall = FALLS[kind]
    root = _standing_joint(figure)
    direction, lean, speed, feet_speed, left, right = _drawn_start(fall, seed)
    ahead = np.array([sin(direction), 0.0, cos(direction)])
    across = np.cross(_UP, ahead)
    tree = build_tree(figure)
    pose = _bend_legs(initial_displacements(tree), left, right)
    upright = forward_kinematics(tree, pose)
    pose[root.name] = _turned(upright, root, matrix_from_axis_angle(across, lean))
    placement = forward_kinematics(tree, pose)
    scene = SCENE_FILE.read(SCENE_FILE.shipped()[fall.scene]) if fall.scene else NO_SCENE
    if fall.toes is not None:
        scene = _moved_ahead(scene, _toes(placement) - fall.toes)
    velocities = {root.child.segment: (0.0, 0.0, 0.0, *(speed * ahead).tolist())}
    if feet_speed:
        velocities |= _swing_legs(placement, feet_speed)
    moved = [root.name, *(name for name in pose if name in _leg_joints())]
    return replace(
        plan,
        scene=add_floor(scene, (0.0, 1.0, 0.0), fall.friction),
        displacements={name: tuple(pose[name].tolist()) for name in moved},
        velocities=velocities,
    )


def _tone(figure: Figure, name: str) -> Tone | None:
    """Return a shipped tone; None for a figure without its joints."""
    if not name:
        return None
    tone = TONE_FILE.read(TONE_FILE.shipped()[name])
    try:
        tone.righting_shares(figure.joints)
        tone.hold_shares(figure.joints)
    except ModelError:
        return None
    return replace(tone, name=name)


def _leg_joints() -> dict[str, float]:
    """Return the joints of both legs, with their shares of the angle of the knee."""
    return {f"{side}_{name}": share for side in _SIDES for name, share in _SHARES.items()}


def _standing_joint(figure: Figure) -> Joint:
    """Return the joint between the ground and the pelvis.

    Raises ModelError for a figure that does not stand as persons do.
    """
    needed = [f"{side}_{name}" for side in _SIDES for name in ("hip_joint", "knee")]
    for name in needed:
        if name not in figure.joints:
            hint = spelling_hint(name, figure.joints)
            raise ModelError(f"only a person falls so: the figure has no joint `{name}`; {hint}")
    roots = [
        joint
        for joint in figure.joints.values()
        if joint.parent.segment in figure.ground and joint.child.segment not in figure.ground
    ]
    if len(roots) != 1 or len(build_chain(roots[0].chain).rotations) != 3:
        raise ModelError(
            "only a person falls so: one joint of three rotations connects it to the ground"
        )
    return roots[0]


def _bend_legs(start: Displacements, left: float, right: float) -> dict[str, Array]:
    """Return displacements with bent knees [rad]; trunk and soles keep their direction."""
    pose = dict(start)
    for name in _leg_joints().keys() & pose.keys():
        knee = left if name.startswith(_SIDES[0]) else right
        pose[name] = np.array([*pose[name][:-1], pose[name][-1] + _leg_joints()[name] * knee])
    return pose


def _turned(placement: Placement, root: Joint, rotation: Array) -> Array:
    """Return the displacements of the joint to the ground that turn the figure in the world."""
    figure, chain = placement.tree.figure, build_chain(root.chain)
    site = figure.segments[root.parent.segment].sites[root.parent.site]
    axes = (placement.poses[root.parent.segment] @ site.pose_in_segment)[:3, :3]
    pose = chain.pose(placement.displacements[root.name])
    turned = axes.T @ rotation @ axes @ pose[:3, :3]
    return chain.displacements(pose_matrix(turned, pose[:3, 3]))


def _spheres(placement: Placement) -> dict[str, tuple[ContactSphere, ...]]:
    return contact_spheres(placement.tree.figure)


def _swing_legs(placement: Placement, speed: float) -> dict[str, tuple[float, ...]]:
    """Return the rates of the hips that move the feet ahead at a speed [m/s]."""
    figure, rates = placement.tree.figure, dict[str, tuple[float, ...]]()
    lowest = lowest_sphere_point(placement, _spheres(placement), _UP)
    for name in (f"{side}_hip_joint" for side in _SIDES):
        joint = figure.joints[name]
        site = figure.segments[joint.parent.segment].sites[joint.parent.site]
        centre = (placement.poses[joint.parent.segment] @ site.pose_in_segment)[:3, 3]
        rates[name] = (*[0.0] * (len(joint.chain) - 1), speed / (float(centre @ _UP) - lowest))
    return rates


def _toes(placement: Placement) -> float:
    """Return the foremost coordinate of the contact spheres near the lowest one [m]."""
    points = [
        ((placement.poses[name] @ np.append(one.centre, 1.0))[:3], one.radius)
        for name, some in _spheres(placement).items()
        for one in some
    ]
    lowest = min(centre[1] - radius for centre, radius in points)
    return max(centre[2] + r for centre, r in points if centre[1] - r < lowest + TOE_HEIGHT)


def _moved_ahead(scene: Scene, distance: float) -> Scene:
    """Return a scene whose boxes are moved along z [m]."""
    return replace(
        scene,
        props=tuple(
            replace(prop, shape=replace(prop.shape, centre=(x, y, z + distance)))
            for prop in scene.props
            if isinstance(prop.shape, Box)
            for x, y, z in [prop.shape.centre]
        ),
    )
