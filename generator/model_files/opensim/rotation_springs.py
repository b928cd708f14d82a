"""Springs of several rotations in OpenSim's models, as this program writes them.

They are forces of a path whose length is a component of a joint's rotation vector, or whose moment
arms are rates of turning about an axis: functions of the joint's coordinates, which are recognised
by their values. Such a force is a law about an axis of the joint.
"""

from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product
from math import hypot, pi
from typing import TypeAlias

import numpy as np

from generator.figure import is_rotation
from generator.joint_chain import Chain
from generator.losses import Losses
from generator.model_files.body_tree.joints import JointGroup, rotation_group
from generator.model_files.body_tree.to_figure import HINGES_AS_ONE
from generator.model_files.body_tree.tree import Body, DegreeOfFreedom
from generator.model_files.opensim.lepton import ExpressionError, parse_expression
from generator.model_files.opensim.passive_forces import with_function
from generator.model_files.xml import XmlElement
from generator.rotations import Array, matrix_from_rotation_vector, rotation_vector_from_matrix
from springs import SphericalLaw

TOLERANCE = 1e-9
"""Difference of a length [rad], an arm or a relative tension that counts as rounding."""

_SAMPLES = 20
"""Orientations at which lengths and arms are compared."""

_LARGEST_ANGLE = 0.9
"""Of their displacements [rad]: together they are less than half a turn."""

_SEED = 1

_UNREAD = ("lengthening_speed_function", "resting_length")
"""Parts of such a force that this program does not write."""

_Law: TypeAlias = Callable[[Array, float], Array]


@dataclass(frozen=True)
class RotationSpring:
    """A force that is a law about an axis of a joint.

    Attributes:
        name: name of the force.
        coordinate: coordinate whose axis it is; its positive angle is that of the law.
        torque_at: torque about the axis [N m] at components of the rotation vector [rad] and a rate
            about the axis [rad/s].
        law: law of joints of several rotations, where the force depends on it.
    """

    name: str
    coordinate: str
    torque_at: _Law
    law: SphericalLaw | None


def find_rotation_springs(
    bodies: Iterable[Body], forces: Iterable[XmlElement]
) -> tuple[list[RotationSpring], list[XmlElement]]:
    """Return the laws about axes of joints, all of one law, and the other forces."""
    joints = samples_by_coordinates(bodies)
    found: list[RotationSpring] = []
    others: list[XmlElement] = []
    law: SphericalLaw | None = None
    for force in forces:
        spring = None
        if force.tag == "ExpressionBasedPathForce":
            spring = _find_spring(joints, force)
        if spring is None or (law and spring.law and spring.law is not law):
            others.append(force)
        else:
            law = law or spring.law
            found.append(spring)
    return found, others


def samples_by_coordinates(bodies: Iterable[Body]) -> dict[frozenset[str], "JointSamples"]:
    """Return the joints of several rotations by the names of their coordinates."""
    all_joints = [JointSamples(body.dofs, body.joint or body.name) for body in bodies]
    count = Counter(name for joint in all_joints for name in joint.names)
    return {
        frozenset(joint.names): joint
        for joint in all_joints
        if joint.is_readable and all(count[name] == 1 for name in joint.names)
    }


def with_rotation_springs(
    bodies: Iterable[Body], springs: Sequence[RotationSpring], losses: Losses
) -> list[Body]:
    """Return the bodies with the laws; hinges that have such a law form one joint."""
    return [_with_springs(body, springs, losses) for body in bodies]


def _with_springs(body: Body, springs: Sequence[RotationSpring], losses: Losses) -> Body:
    names = {dof.name for dof in body.dofs}
    own = [spring for spring in springs if spring.coordinate in names]
    if not own:
        return body
    joint = body.joint or body.name
    turns = [dof for dof in body.dofs if is_rotation(dof.kind)]
    if any(dof.is_passive for dof in turns):
        losses.add(HINGES_AS_ONE, joint)
    ranges = {dof.name: dof.expected_range or (-pi, pi) for dof in turns}
    reach = 0.0
    if any(spring.law is SphericalLaw.WEIGHTED for spring in own):
        # The whole angle of displacements at their ends is the largest of a rotation.
        reach = min(hypot(*(max(-low, high) for low, high in ranges.values())), pi)
    dofs = {dof.name: dof for dof in body.dofs}
    for name, (low, high) in ranges.items():
        wider = (min(low, -reach), max(high, reach))
        dofs[name] = replace(dofs[name], joint=joint, expected_range=wider)
    for spring in own:
        dof = dofs[spring.coordinate]
        changed = with_function(dof, spring.name, spring.torque_at, losses)
        if changed == dof and spring.law is not None:  # it acts beyond the range only
            whole = replace(dof, expected_range=(-pi, pi))
            changed = with_function(whole, spring.name, spring.torque_at, losses)
        dofs[dof.name] = changed
    return replace(body, dofs=tuple(dofs.values()))


@dataclass(frozen=True)
class JointSamples:
    """The rotations of a body, at random displacements.

    Attributes:
        dofs: dofs of the body.
        name: name of the joint.
    """

    dofs: tuple[DegreeOfFreedom, ...]
    name: str

    @cached_property
    def turns(self) -> tuple[DegreeOfFreedom, ...]:
        """The rotations, outermost first."""
        return tuple(dof for dof in self.dofs if is_rotation(dof.kind))

    @property
    def names(self) -> tuple[str, ...]:
        """Of the coordinates of the rotations."""
        return tuple(dof.name for dof in self.turns)

    @property
    def is_readable(self) -> bool:
        """True for several rotations in radians that form a joint."""
        return all(dof.scale == 1.0 for dof in self.turns) and (
            rotation_group(self.dofs, self.name) is not None
        )

    @cached_property
    def displacements(self) -> Array:
        """Random angles [rad], shape (samples, rotations)."""
        rng = np.random.default_rng(_SEED)
        return rng.uniform(-_LARGEST_ANGLE, _LARGEST_ANGLE, (_SAMPLES, len(self.turns)))

    @cached_property
    def coordinates(self) -> Mapping[str, Array]:
        """Values of the coordinates, by name."""
        columns = zip(self.turns, self.displacements.T, strict=True)
        return {dof.name: values + dof.offset for dof, values in columns}

    @cached_property
    def rotation_vectors(self) -> Array:
        """Rotation vectors in the body's frame [rad], shape (samples, 3)."""
        return rotation_vector_from_matrix(self._chain.pose(self._inner_first)[:, :3, :3])

    @cached_property
    def turn_rates(self) -> Array:
        """Angular velocities in the half-way frame for unit rates, shape (samples, turns, 3)."""
        rates = self._chain.twists(self._inner_first)[:, ::-1, :3]
        half_way = matrix_from_rotation_vector(0.5 * self.rotation_vectors)
        return np.einsum("nji,nkj->nki", half_way, rates)

    @property
    def _inner_first(self) -> Array:
        return self.displacements[:, ::-1]

    @cached_property
    def _chain(self) -> Chain:
        return Chain(replace(self.group, frame=np.eye(3)).chain)

    @property
    def group(self) -> JointGroup:
        """The joint of the rotations, which is readable."""
        group = rotation_group(self.turns, self.name)
        assert group is not None, "checked before"
        return group


def _find_spring(
    joints: Mapping[frozenset[str], JointSamples], force: XmlElement
) -> RotationSpring | None:
    """Return the law of a force; None where it is not recognised."""
    path = read_path(joints, force)
    if path is None:
        return None
    name = force.label
    if path.arms is None:
        return _spring_of_length(name, path.joint, path.length, path.tension_at)
    return _spring_of_arms(name, path.joint, path.length, path.arms, path.tension_at)


@dataclass(frozen=True)
class PathForce:
    """A force along a path whose length is a function of the rotations of a joint.

    Attributes:
        joint: The joint.
        length: Length at its samples, shape (samples,).
        arms: Moment arms of its rotations, outermost first, shape (samples, rotations); None for
            minus the slopes of the length.
        tension_at: Tension [N] at lengths and a rate.
    """

    joint: "JointSamples"
    length: Array
    arms: Array | None
    tension_at: _Law


def read_path(
    joints: Mapping[frozenset[str], "JointSamples"], force: XmlElement
) -> PathForce | None:
    """Return a force along a path that depends on one of the joints; None for another."""
    path = force.find("FunctionBasedPath")
    if path is None or force.child_text("clamp_stretch").lower() != "false":
        return None
    order = [each.rsplit("/", 1)[-1] for each in path.child_text("coordinate_paths").split()]
    joint = joints.get(frozenset(order))
    if joint is None or len(order) != len(joint.turns):
        return None
    if any(each.tag in _UNREAD for each in force.walk()):
        return None
    try:
        tension = parse_expression(force.child_text("expression"), frozenset({"s", "ldot"}))
        (length,) = _function_values(joint, order, path.find("length_function"))
        arms = _function_values(joint, order, path.find("moment_arm_functions"))
    except (ExpressionError, ValueError):
        return None

    def tension_at(lengths: Array, rate: float) -> Array:
        with np.errstate(all="ignore"):
            found = tension({"s": lengths, "ldot": np.full_like(lengths, rate)})
        return found * np.ones_like(lengths)

    if len(arms) not in (0, len(order)):
        return None
    by_name = dict(zip(order, arms, strict=True)) if arms else {}
    columns = np.stack([by_name[dof.name] for dof in joint.turns], axis=1) if arms else None
    return PathForce(joint, length, columns, tension_at)


def _function_values(
    joint: JointSamples, order: Sequence[str], parent: XmlElement | None
) -> list[Array]:
    """Return the values of functions of a joint's coordinates; raises ExpressionError."""
    found: list[Array] = []
    for function in () if parent is None else parent.find_all("ExpressionBasedFunction"):
        variables = function.child_text("variables").split()
        known = dict(zip(variables, (joint.coordinates[name] for name in order), strict=True))
        value = parse_expression(function.child_text("expression"), frozenset(known))
        with np.errstate(all="ignore"):
            found.append(value(known) * np.ones(_SAMPLES))
    return found


def _spring_of_length(
    name: str, joint: JointSamples, length: Array, tension_at: _Law
) -> RotationSpring | None:
    """Return the law of a force whose length is a component of the rotation vector."""
    for dof, sign in product(joint.turns, (1.0, -1.0)):
        if is_equal(length, sign * (joint.rotation_vectors @ dof.axis)):
            return RotationSpring(
                name,
                dof.name,
                lambda angle, rate, s=sign: -s * tension_at(s * angle, s * rate),
                SphericalLaw.CONSERVATIVE,
            )
    return None


def _spring_of_arms(
    name: str, joint: JointSamples, length: Array, arms: Array, tension_at: _Law
) -> RotationSpring | None:
    """Return the law of a force whose arms are rates of turning about an axis.

    They are these themselves, of damping and constants; or weighted by the direction of the
    rotation, whose whole angle is the length.
    """
    angles = np.linalg.norm(joint.rotation_vectors, axis=1)
    for dof, sign in product(joint.turns, (1.0, -1.0)):
        rates = sign * (joint.turn_rates @ dof.axis)
        component = sign * (joint.rotation_vectors @ dof.axis)
        if not np.any(length) and is_equal(arms, rates):
            constant = np.any(tension_at(np.zeros(1), 0.0))
            return RotationSpring(
                name,
                dof.name,
                lambda angle, rate, s=sign: s * tension_at(np.zeros_like(angle), -s * rate),
                SphericalLaw.WEIGHTED if constant else None,
            )
        weights = np.abs(component) / angles
        if is_equal(length, np.copysign(angles, component)) and is_equal(
            arms, weights[:, None] * rates
        ):
            return RotationSpring(
                name,
                dof.name,
                lambda angle, rate, s=sign: s * tension_at(s * angle, -s * rate),
                SphericalLaw.WEIGHTED,
            )
    return None


def is_equal(found: Array, expected: Array) -> bool:
    """Return whether values differ by rounding alone."""
    return bool(np.abs(found - expected).max() <= TOLERANCE)
