"""The reach of a limb in OpenSim's models, as this program writes them.

The forces of a path do not tell the points of a reach, which the springs do that a model carries.
A joint whose forces are still those of its carried reach, perhaps times a factor, has it.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from generator.diagnostics import ModelError
from generator.figure import Joint, Vector, is_rotation
from generator.identifiers import coordinate_names
from generator.joint_chain import build_chain
from generator.model import Model
from generator.model_files.body_tree.tree import Body, BodyReach
from generator.model_files.opensim.expression import Expression, with_definitions
from generator.model_files.opensim.lepton import parse_expression
from generator.model_files.opensim.reach import ReachExpressions, ReachLength
from generator.model_files.opensim.rotation import RotationExpressions
from generator.model_files.opensim.rotation_springs import (
    TOLERANCE,
    JointSamples,
    PathForce,
    is_equal,
    read_path,
    samples_by_coordinates,
)
from generator.model_files.xml import XmlElement
from generator.rotations import Array, unit_axis, unit_vector
from generator.springs_file.axes import AXIS_NAMES, AxisError, axis_by_name, axis_label
from generator.springs_file.edit import reach_tables
from springs import AxisSpring, Reach, Stop, total_torque
from springs.transformed import Transformed

_LENGTHS = np.linspace(-np.pi, np.pi, 241)
"""Lengths at which tensions are compared [rad]."""

_FACTOR_DIGITS = 12
"""Digits of the factor of a tension."""


def find_reaches(
    bodies: Sequence[Body], forces: Sequence[XmlElement], carried: Model | None
) -> tuple[list[Body], list[XmlElement]]:
    """Return the bodies with the reaches whose forces are among some, and the other forces.

    Args:
        bodies: Bodies of the model.
        forces: Forces of the model.
        carried: Figure and springs that the model carries; None without them.
    """
    if carried is None:
        return list(bodies), list(forces)
    springs = carried.springs.joints.items()
    reached = {name: one.reach for name, one in springs if one.reach is not None}
    if not reached:
        return list(bodies), list(forces)
    samples = samples_by_coordinates(bodies)
    paths = {
        k: path
        for k, force in enumerate(forces)
        if force.tag == "ExpressionBasedPathForce" and (path := read_path(samples, force))
    }
    names = coordinate_names({name: one.chain for name, one in carried.figure.joints.items()})
    changed = list(bodies)
    used: set[int] = set()
    for name, reach in reached.items():
        joint = carried.figure.joints[name]
        turns = [k for k, factor in enumerate(joint.chain) if is_rotation(factor.kind)]
        sample = samples.get(frozenset(names[name][k] for k in turns))
        if sample is None:
            continue
        found = _find(reach, joint, [names[name][k] for k in turns], sample, paths)
        table = None if found is None else _body_reach(found.reach, joint, sample)
        if found is None or table is None:
            continue
        used |= found.forces
        label = sample.name
        for k, body in enumerate(changed):
            if set(sample.names) <= {dof.name for dof in body.dofs}:
                dofs = tuple(
                    replace(dof, joint=label) if is_rotation(dof.kind) else dof for dof in body.dofs
                )
                changed[k] = replace(body, dofs=dofs, reach=table)
    return changed, [force for k, force in enumerate(forces) if k not in used]


@dataclass(frozen=True)
class _Found:
    """A reach with the laws of a model, and the numbers of their forces."""

    reach: Reach
    forces: frozenset[int]


def _find(
    reach: Reach,
    joint: Joint,
    coordinates: Sequence[str],
    sample: JointSamples,
    paths: Mapping[int, PathForce],
) -> _Found | None:
    """Return a reach with the factors of its forces; None where one of them is missing."""
    angles = tuple(f"q{k + 1}" for k in range(len(coordinates)))
    axes = build_chain(joint.chain).rotation_axes
    made = ReachExpressions(reach, RotationExpressions(axes, angles))
    values = {a: sample.coordinates[name] for a, name in zip(angles, coordinates, strict=True)}
    factors: dict[str, float] = {}
    forces: set[int] = set()
    for end in made.lengths():
        for k, path in paths.items():
            if path.joint is sample and _is_end(path, end, made, values, coordinates):
                factor = _factor(path, end)
                if factor is None or k in forces or end.label in factors:
                    return None
                factors[end.label] = factor
                forces.add(k)
        if end.label not in factors:
            return None
    of_turn = {factor for label, factor in factors.items() if label != "reach"}
    if not factors or len(of_turn) > 1:
        return None
    beyond = _scaled(reach.beyond, factors.get("reach", 1.0))
    turn = _scaled(reach.turn, next(iter(of_turn), 1.0))
    return _Found(replace(reach, beyond=beyond, turn=turn), frozenset(forces))


def _scaled(spring: AxisSpring, factor: float) -> AxisSpring:
    """Return a law with a factor, a stop as one of another stiffness, which a file can state."""
    if factor == 1.0:
        return spring
    laws = tuple(
        replace(law, stiffness=factor * law.stiffness)
        if isinstance(law, Stop)
        else Transformed(law, factor)
        for law in spring.elastic
    )
    return replace(spring, elastic=laws)


def _is_end(
    path: PathForce,
    end: ReachLength,
    made: ReachExpressions,
    values: Mapping[str, Array],
    coordinates: Sequence[str],
) -> bool:
    """Return whether length and arms of a path are those of an end of a reach."""

    def evaluated(one: Expression) -> Array:
        text = with_definitions(one, made.definitions)
        return parse_expression(text, frozenset(values))(values) * np.ones_like(path.length)

    if path.arms is None or not is_equal(path.length, evaluated(end.length)):
        return False
    places = [path.joint.names.index(name) for name in coordinates]
    arms = np.stack([evaluated(arm) for arm in end.arms], axis=1)
    return is_equal(path.arms[:, places], arms)


def _factor(path: PathForce, end: ReachLength) -> float | None:
    """Return the factor of a path's tension on that of an end's law; None for another law."""
    found = path.tension_at(_LENGTHS, 0.0)
    moving = path.tension_at(_LENGTHS, 1.0)
    expected = -np.asarray(total_torque(end.law, _LENGTHS))
    size = float(expected @ expected)
    if not size or not np.isfinite(found).all() or np.any(moving != found):
        return None
    factor = float(found @ expected) / size
    error = float(np.abs(found - factor * expected).max())
    if factor <= 0.0 or error > TOLERANCE * float(np.abs(found).max()):
        return None
    return float(f"{factor:.{_FACTOR_DIGITS}g}")


def _body_reach(reach: Reach, joint: Joint, sample: JointSamples) -> BodyReach | None:
    """Return a reach in the frame of a joint that was read; None where no table states it."""
    new = replace(joint, chain=tuple(a for a in sample.group.chain if is_rotation(a.kind)))
    if any(dof.offset or dof.scale != 1.0 for dof in sample.turns):
        return None
    old_axes, new_axes = (
        np.array([unit_vector(axis.axis) for axis in one.chain if is_rotation(axis.kind)]).T
        for one in (joint, new)
    )
    turn = new_axes @ np.linalg.inv(old_axes)
    if not is_equal(turn.T @ turn, np.eye(3)) or np.linalg.det(turn) < 0.0:
        return None
    try:
        table, laws = reach_tables(joint, reach)
        long_axis = _label(turn, reach.long_axis)
        planes = tuple(_label(turn, axis).lstrip("-") for axis in reach.planes)
        declared = [axis_by_name(new, name) for name in (*planes, long_axis.lstrip("-"))]
    except (AxisError, ModelError, ValueError):
        return None
    own = axis_by_name(joint, _label(np.eye(3), reach.long_axis).lstrip("-"))
    expected = np.array([*reach.planes, own]) @ turn.T
    if not is_equal(np.array(declared), expected):
        return None
    return BodyReach(replace(table, long_axis=long_axis, planes=planes), laws)


def _label(turn: Array, axis: Vector) -> str:
    """Return the label of a turned axis; raises ValueError for one that has no letter."""
    x, y, z = (turn @ np.asarray(axis)).tolist()
    label = axis_label(unit_axis((x, y, z)))
    if label.lstrip("-") not in AXIS_NAMES:
        raise ValueError(f"the joint has no axis {label}")
    return label
