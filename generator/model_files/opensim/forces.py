"""Springs and loads of an OpenSim model.

A law of one displacement is an ExpressionBasedCoordinateForce. Every other is the force of a path
whose length and moment arms are functions of coordinates: a tension, which depends on the length
and its rate, times the arms is a generalized force of each coordinate. The component of a joint's
rotation vector is the length for a law of a spherical joint, an angular velocity the rate for its
damping and friction, a sum of angles the length for a law over several joints, and an angle beyond
an end the length for a reach. So all are held exactly, in every orientation.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import reduce
from operator import add

from generator.identifiers import plain_name, reserve_name
from generator.model_files.export_model import (
    ExportModel,
    has_friction,
)
from generator.model_files.opensim.expression import (
    EXPRESSION_OPERATIONS,
    ONE,
    ZERO,
    Expression,
    with_definitions,
)
from generator.model_files.opensim.reach import ReachExpressions
from generator.model_files.opensim.rotation import RotationExpressions
from generator.model_files.xml import Element, add_element, format_numbers
from generator.springs_file.axes import AXIS_NAMES, axis_label
from springs import AxisSpring, CoupledSpring, Reach, SphericalLaw, total_torque
from springs.exponential import tangent_exp

_LENGTH, _RATE = Expression("s"), Expression("ldot")
"""Length of a path and its rate, in the expression of its tension."""


@dataclass(frozen=True)
class _Path:
    """The path of a force.

    Attributes:
        coordinates: paths of the coordinates by their names in expressions.
        definitions: definitions of other names in expressions.
        length: length as an expression.
        arms: one a coordinate; None for minus the slopes of the length.
    """

    coordinates: Mapping[str, str]
    definitions: Mapping[str, Expression]
    length: Expression
    arms: Sequence[Expression] | None = None


class ForceWriter:
    """The forces of a model, each under a name of its own."""

    def __init__(
        self, model: ExportModel, coordinate_paths: Mapping[str, str], forces: Element
    ) -> None:
        """Prepare to add forces to the element `forces`; `coordinate_paths` are by name."""
        self._model, self._paths, self._forces = model, coordinate_paths, forces
        self._names: set[str] = set()
        self.coupled: list[tuple[CoupledSpring, Sequence[Element]]] = []

    def add_force(self, tag: str, name: str) -> Element:
        """Add a force under a free name."""
        return add_element(self._forces, tag, name=reserve_name(name, self._names))

    def add_springs(self) -> None:
        """Add the springs of the tree's joints, and the laws over several of them."""
        for name in self._model.tree_springs:
            laws = self._model.laws(name)
            for index, spring in laws.uncoupled.items():
                self._add_coordinate_force(self._model.coordinates[name][index], spring)
            for number, spring in enumerate(laws.combined, 1):
                self._add_axis_forces(name, number, spring)
            if laws.reach is not None:
                self._add_reach_forces(name, laws.reach)
        for coupled in self._model.springs.coupled:
            if self._model.is_in_tree(coupled):
                count = len(self._forces)
                self._add_coupled_forces(coupled)
                self.coupled.append((coupled, self._forces[count:]))

    def _add_coordinate_force(self, coordinate: str, spring: AxisSpring) -> None:
        """Add a spring of one displacement."""
        q, rate = Expression("q"), Expression("qdot")
        torque = total_torque(spring.elastic, q, EXPRESSION_OPERATIONS)
        torque = torque + spring.resistance(q, rate, EXPRESSION_OPERATIONS)
        force = self.add_force("ExpressionBasedCoordinateForce", f"{coordinate}_spring")
        add_element(force, "coordinate", coordinate)
        add_element(force, "expression", torque.text)

    def _add_axis_forces(self, joint: str, number: int, spring: AxisSpring) -> None:
        """Add the spring about an axis of a joint of several rotations, and its damping."""
        letter = axis_label(spring.direction).removeprefix("-")
        label = f"{self._model.joints[joint]}_{letter if letter in AXIS_NAMES else number}"
        angles = self._angle_paths(joint)
        rotation = self._rotation(joint, tuple(angles))
        direction = spring.direction
        rates = [rotation.turn_rate(direction, k) for k in range(len(angles))]
        component = rotation.component(direction)
        torque = total_torque(spring.elastic, _LENGTH, EXPRESSION_OPERATIONS)
        if self._model.springs.law is not SphericalLaw.WEIGHTED:
            path = _Path(angles, rotation.definitions, component)
            self._add_path_force(f"{label}_spring", path, -1.0 * torque)
        else:
            at_rest = float(total_torque(spring.elastic, 0.0))
            alignment = rotation.alignment(direction)
            path = _Path(
                angles,
                rotation.definitions,
                rotation.signed_angle(direction),
                [alignment * rate for rate in rates],
            )
            self._add_path_force(f"{label}_spring", path, torque - at_rest)
            constant = _Path(angles, rotation.definitions, ZERO, rates)
            self._add_path_force(f"{label}_constant", constant, ZERO + at_rest)
        directional = has_friction(spring)
        path = _Path(
            angles,
            rotation.definitions,
            component if directional else ZERO,
            [-1.0 * rate for rate in rates],
        )
        resistance = spring.resistance(_LENGTH, _RATE, EXPRESSION_OPERATIONS)
        self._add_path_force(f"{label}_damping", path, -1.0 * resistance)

    def _add_reach_forces(self, joint: str, reach: Reach) -> None:
        """Add the laws beyond the ends of a reach: of the directions, and of the turn."""
        angles = self._angle_paths(joint)
        found = ReachExpressions(reach, self._rotation(joint, tuple(angles)))
        for end in found.lengths():
            torque = total_torque(end.law, _LENGTH, EXPRESSION_OPERATIONS)
            path = _Path(angles, found.definitions, end.length, end.arms)
            label = f"{self._model.joints[joint]}_{end.label}"
            self._add_path_force(label, path, -1.0 * torque)

    def _add_coupled_forces(self, spring: CoupledSpring) -> None:
        """Add a law over several joints: a force for each exponential, and one for constants."""
        coordinates: dict[str, str] = {}
        definitions: dict[str, Expression] = {}
        rotations: dict[str, RotationExpressions] = {}
        for joint in dict.fromkeys(axis.joint for axis in spring.axes):
            angles = self._angle_paths(joint, len(coordinates))
            rotations[joint] = replace(
                self._rotation(joint, tuple(angles), f"_{len(rotations) + 1}"),
                has_coordinates=self._model.springs.law is SphericalLaw.COORDINATES,
            )
            coordinates |= angles
            definitions |= rotations[joint].definitions
        components: list[Expression] = []
        slopes: list[Mapping[str, Expression]] = []
        for axis in spring.axes:
            rotation = rotations[axis.joint]
            components.append(rotation.component(axis.direction))
            slopes.append(
                {
                    angle: rotation.component_slope(axis.direction, k)
                    for k, angle in enumerate(rotation.angles)
                }
            )
        law = spring.law
        label = "_".join(self._model.joints[joint] for joint in rotations)
        parts = [(one, one.amplitudes) for one in law.terms]
        for term, amplitudes in [*parts, (None, law.constants)]:
            length, tension = ZERO, ONE
            if term is not None:
                length = _weighted_sum(term.rates, components)
                exponent = _LENGTH + term.exponent
                tension = tangent_exp(exponent, term.end, EXPRESSION_OPERATIONS)
            arms = [
                _weighted_sum(amplitudes, [slope.get(name, ZERO) for slope in slopes])
                for name in coordinates
            ]
            if any(arm != ZERO for arm in arms):
                path = _Path(coordinates, definitions, length, arms)
                self._add_path_force(f"{label}_spring", path, tension)

    def _angle_paths(self, joint: str, first: int = 0) -> dict[str, str]:
        """Paths of a joint's rotations by their names in expressions: `q1`, `q2` ..."""
        names = self._model.coordinates[joint]
        turns = self._model.tree.chains[joint].rotations
        return {f"q{first + k}": self._paths[names[index]] for k, index in enumerate(turns, 1)}

    def _rotation(
        self, joint: str, angles: tuple[str, ...], suffix: str = ""
    ) -> RotationExpressions:
        axes = self._model.tree.chains[joint].rotation_axes
        return RotationExpressions(axes, angles, suffix)

    def _add_path_force(self, name: str, path: _Path, tension: Expression) -> None:
        """Add the force of a path, if it has a tension."""
        if tension == ZERO:
            return
        force = self.add_force("ExpressionBasedPathForce", name)
        element = add_element(force, "FunctionBasedPath", name="path")
        add_element(element, "coordinate_paths", " ".join(path.coordinates.values()))
        _add_function(add_element(element, "length_function"), path, path.length)
        if path.arms is not None:
            arms = add_element(element, "moment_arm_functions")
            for arm in path.arms:
                _add_function(arms, path, arm)
        add_element(force, "expression", tension.text)
        add_element(force, "clamp_stretch", "false")

    def add_loads(self) -> None:
        """Add the constant forces and moments at sites."""
        for name in self._model.figure.bodies:
            for site in self._model.figure.segments[name].sites.values():
                loads = {
                    "global": (site.global_force, site.global_moment),
                    "local": (site.local_force, site.local_moment),
                }
                for kind, (force, moment) in loads.items():
                    if any(force or ()) or any(moment or ()):
                        body = self._model.segments[name]
                        element = self.add_force(
                            "PrescribedForce", plain_name(f"{body}_{site.name}_{kind}_load")
                        )
                        add_element(element, "socket_frame", f"/bodyset/{body}")
                        add_element(element, "pointIsGlobal", "false")
                        add_element(element, "forceIsGlobal", str(kind == "global").lower())
                        _add_constants(element, "forceFunctions", force or (0.0, 0.0, 0.0))
                        _add_constants(element, "pointFunctions", site.pose_in_segment[:3, 3])
                        _add_constants(element, "torqueFunctions", moment or (0.0, 0.0, 0.0))


def _weighted_sum(weights: Sequence[float], terms: Sequence[Expression]) -> Expression:
    return reduce(add, [w * term for w, term in zip(weights, terms, strict=True)])


def _add_function(parent: Element, path: _Path, value: Expression) -> None:
    function = add_element(parent, "ExpressionBasedFunction")
    add_element(function, "expression", with_definitions(value, path.definitions))
    add_element(function, "variables", " ".join(path.coordinates))


def _add_constants(force: Element, name: str, values: Iterable[float]) -> None:
    functions = add_element(add_element(force, "FunctionSet", name=name), "objects")
    for value in values:
        add_element(add_element(functions, "Constant"), "value", format_numbers(value))
