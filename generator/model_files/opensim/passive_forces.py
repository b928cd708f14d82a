"""Passive forces of OpenSim's models: springs, limits and expressions of coordinates.

A bushing acts between two frames, by the three body-fixed angles (x, y, z) and the three
displacements of the second in the first. Where the frames coincide with a joint's, and its axes are
theirs, each moment is a law of one degree of freedom.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from math import exp, pi
from typing import Final

import numpy as np

from generator.diagnostics import shorten
from generator.figure import is_rotation
from generator.losses import Losses
from generator.model_files.body_tree.tree import Body, Curve, DegreeOfFreedom, FunctionCurve
from generator.model_files.opensim.frames import GROUND, FrameIndex
from generator.model_files.opensim.lepton import ExpressionError, parse_expression
from generator.model_files.xml import XmlElement
from generator.rotations import Array, inverse_pose
from generator.units import MAX_MODEL_NUMBER
from springs import Cubic
from springs.exponential import Exponential, ExponentialTerm
from springs.smooth_limit import SmoothLimit

_DEGREES_PER_RADIAN = 180.0 / pi

_CONTACT: Final = ("HuntCrossleyForce", "ElasticFoundationForce", "SmoothSphereHalfSpaceForce")

BUSHINGS: Final = ("BushingForce", "ExpressionBasedBushingForce")
"""Forces between frames, which `apply_bushings` reads."""

_PATHS: Final = ("GeometryPath", "FunctionBasedPath", "Scholz2015GeometryPath")


def apply_forces(
    bodies: Sequence[Body], forces: Iterable[XmlElement], losses: Losses
) -> tuple[Body, ...]:
    """The bodies with the springs and limits that act on their coordinates."""
    freedoms = {freedom.name: freedom for body in bodies for freedom in body.dofs}
    reader = _ForceReader(freedoms, losses)
    for force in forces:
        name = force.label
        if force.tag in BUSHINGS:
            continue
        if force.tag in _READERS:
            reader.read(force, name)
        elif any(below.tag in _PATHS for below in force.walk()):
            _check_path(force, name)
            losses.add("muscles and other forces along paths", name)
        elif force.tag in _CONTACT:
            losses.add("contact", name)
        elif force.tag.endswith("Actuator"):
            losses.add("actuators", name)
        else:
            losses.add("other forces", f"{name} ({force.tag})")
    return tuple(
        replace(body, dofs=tuple(freedoms[freedom.name] for freedom in body.dofs))
        for body in bodies
    )


@dataclass
class _ForceReader:
    """Adds the laws of coordinate forces to degrees of freedom, by the names of coordinates."""

    dofs: dict[str, DegreeOfFreedom]
    losses: Losses

    def read(self, force: XmlElement, name: str) -> None:
        """Add the law of a force to the degree of freedom of its coordinate."""
        key = force.child_text("coordinate").rsplit("/", 1)[-1]
        dof = self.dofs.get(key)
        if dof is None:
            self.losses.add("forces on coordinates that are locked or missing", f"{name} ({key})")
            return
        self.dofs[key] = _READERS[force.tag](self, force, name, dof)

    def _number(self, force: XmlElement, word: str) -> float:
        return force.child_number(word)

    def spring(self, force: XmlElement, name: str, dof: DegreeOfFreedom) -> DegreeOfFreedom:
        """Add a linear spring and damper."""
        stiffness, viscous = (self._number(force, word) for word in ("stiffness", "viscosity"))
        if stiffness < 0.0 or viscous < 0.0:
            self.losses.add("springs with a negative stiffness or viscosity", name)
            return dof
        dof = replace(dof, damping=dof.damping + viscous * dof.scale * dof.scale)
        rest = (self._number(force, "rest_length") - dof.offset) / dof.scale
        if not stiffness:
            return dof
        return _with_stiffness(dof, stiffness * dof.scale * dof.scale, rest)

    def limit(self, force: XmlElement, name: str, dof: DegreeOfFreedom) -> DegreeOfFreedom:
        """Add a limit whose stiffness grows smoothly."""
        if not self._is_plain_rotation(dof, name):
            return dof
        words = ("lower_limit", "upper_limit", "lower_stiffness", "upper_stiffness", "transition")
        lower, upper, below, above, width = (self._number(force, word) for word in words)
        try:
            law = SmoothLimit(
                lower / _DEGREES_PER_RADIAN - dof.offset,
                upper / _DEGREES_PER_RADIAN - dof.offset,
                below * _DEGREES_PER_RADIAN,
                above * _DEGREES_PER_RADIAN,
                width / _DEGREES_PER_RADIAN,
            )
        except ValueError as failure:
            force.error(str(failure))
            return dof
        return self._with_limit(force, name, dof, law)

    def exponential(self, force: XmlElement, name: str, dof: DegreeOfFreedom) -> DegreeOfFreedom:
        """Add two exponentials, one at either limit."""
        if not self._is_plain_rotation(dof, name):
            return dof
        terms: list[ExponentialTerm] = []
        for side, sign in (("lower", 1.0), ("upper", -1.0)):
            parameters = force.child_numbers(f"{side}_shape_parameters", (0.0, 0.0))
            limit = self._number(force, f"{side}_limit") - dof.offset
            size, rate = parameters[0], -sign * parameters[1]
            if size and rate:
                try:
                    terms.append(ExponentialTerm(sign * size * exp(-rate * limit), rate))
                except OverflowError:
                    force.error(f"the exponentials of `{shorten(name)}` are too large")
                    return dof
            elif size:
                self.losses.add("constant forces of exponentials without a rate", name)
        return _with_law(dof, Exponential(tuple(terms))) if terms else dof

    def stop(self, force: XmlElement, name: str, dof: DegreeOfFreedom) -> DegreeOfFreedom:
        """Add a linear spring beyond either limit."""
        if not self._is_plain_rotation(dof, name):
            return dof
        lower, upper = (
            self._number(force, f"{side}_limit") - dof.offset for side in ("lower", "upper")
        )
        stiffness = self._number(force, "stiffness")
        if stiffness < 0.0 or lower > upper:
            force.error(f"the stop `{shorten(name)}` has no range, or a negative stiffness")
            return dof
        law = Cubic((0.0, stiffness, 0.0, 0.0), -1, (lower, upper))
        return self._with_limit(force, name, dof, law) if stiffness else dof

    def expression(self, force: XmlElement, name: str, dof: DegreeOfFreedom) -> DegreeOfFreedom:
        """Add an expression of the coordinate and its rate: an elastic law and viscous damping."""
        try:
            function = parse_expression(
                force.child_text("expression") or "0", frozenset({"q", "qdot"})
            )
        except ExpressionError as failure:
            self.losses.add("forces with expressions that are not read", f"{name} ({failure})")
            return dof

        def force_at(values: Array, rate: float) -> Array:
            """Generalized force of the displacement, at displacements and a rate of it."""
            coordinate = dof.scale * values + dof.offset
            rates = np.full_like(coordinate, dof.scale * rate)
            with np.errstate(all="ignore"):
                found = function({"q": coordinate, "qdot": rates})
            return dof.scale * found * np.ones_like(coordinate)

        return with_function(dof, name, force_at, self.losses)

    def _is_plain_rotation(self, dof: DegreeOfFreedom, name: str) -> bool:
        if is_rotation(dof.kind) and dof.scale == 1.0:
            return True
        self.losses.add("limit forces of sliding joints", name)
        return False

    def _with_limit(
        self, force: XmlElement, name: str, dof: DegreeOfFreedom, law: Curve
    ) -> DegreeOfFreedom:
        if self._number(force, "damping"):
            self.losses.add("damping of limit forces", name)
        return _with_law(dof, law)


_Reader = Callable[[_ForceReader, XmlElement, str, DegreeOfFreedom], DegreeOfFreedom]

_READERS: Final[Mapping[str, _Reader]] = {
    "SpringGeneralizedForce": _ForceReader.spring,
    "CoordinateLimitForce": _ForceReader.limit,
    "ExponentialCoordinateLimitForce": _ForceReader.exponential,
    "CoordinateLinearStopForce": _ForceReader.stop,
    "ExpressionBasedCoordinateForce": _ForceReader.expression,
}
"""Readers of forces on one coordinate, by class."""


def with_function(
    dof: DegreeOfFreedom, name: str, force_at: Callable[[Array, float], Array], losses: Losses
) -> DegreeOfFreedom:
    """Return a degree of freedom with the elastic and the viscous part of a function.

    Args:
        dof: the degree of freedom.
        name: name of the force.
        force_at: generalized force at displacements and a rate of them.
        losses: notes what is neither.
    """
    ends = dof.expected_range or (-1.0, 1.0)
    angles = np.linspace(ends[0], ends[1], _PROBES)
    elastic = force_at(angles, 0.0)
    if not (np.abs(elastic) <= MAX_MODEL_NUMBER).all():
        losses.add("forces with expressions that are not finite", name)
        return dof
    dampings = np.array([(elastic - force_at(angles, rate)) / rate for rate in _PROBE_RATES])
    viscous = float(np.median(dampings))
    size = float(np.abs(dampings).max())
    if not np.isfinite(size) or np.ptp(dampings) > _LINEAR_TOLERANCE * size or viscous < 0.0:
        losses.add("parts of forces that depend on the rate, but for damping", name)
        viscous = 0.0
    dof = replace(dof, damping=dof.damping + viscous)
    slope, first = np.polyfit(angles, elastic, 1).tolist()
    scale = float(np.abs(elastic).max())
    if scale == 0.0:
        return dof
    straight = np.abs(elastic - slope * angles - first).max() <= _LINEAR_TOLERANCE * scale
    if straight and slope < 0.0:
        return _with_stiffness(dof, -slope, -first / slope)
    if not is_rotation(dof.kind):
        losses.add("nonlinear forces of sliding joints", name)
        return dof
    return _with_law(dof, FunctionCurve(lambda values: force_at(values, 0.0)))


_PROBES = 41
"""Displacements at which an expression is compared with a straight line and with damping."""

_PROBE_RATES = (-2.0, -0.5, 0.01, 0.5, 2.0)
"""Rates at which it is compared with viscous damping [rad/s or m/s]."""

_LINEAR_TOLERANCE = 1e-9
"""Relative difference from a straight line that counts as rounding."""


def _with_stiffness(dof: DegreeOfFreedom, stiffness: float, rest: float) -> DegreeOfFreedom:
    """Return a degree of freedom with a linear spring more; two are one between their rests."""
    total = dof.stiffness + stiffness
    mean = (dof.stiffness * dof.rest + stiffness * rest) / total
    return replace(dof, stiffness=total, rest=mean if dof.stiffness else rest)


def _with_law(dof: DegreeOfFreedom, law: Curve) -> DegreeOfFreedom:
    return replace(dof, laws=(*dof.laws, law))


def _check_path(force: XmlElement, name: str) -> None:
    """A path has points, or the file is broken."""
    for path in force.walk():
        if path.tag != "GeometryPath":
            continue
        points = path.find("PathPointSet")
        objects = None if points is None else points.find("objects")
        count = 0 if objects is None else len(objects.children)
        if count < 2:
            place = points or path
            has = "one point" if count else "no points"
            place.error(
                f"the path of `{shorten(name)}` has {has}", "a path leads from one point to another"
            )


_VARIABLES = ("theta_x", "theta_y", "theta_z", "delta_x", "delta_y", "delta_z")
_EXPRESSIONS = tuple(f"{kind}{axis}_expression" for kind in "MF" for axis in "xyz")

_ALIGNMENT_TOLERANCE = 1e-9
"""Largest difference of frames, and of axes, that count as the same."""


def apply_bushings(
    frames: FrameIndex, bodies: Iterable[Body], forces: Iterable[XmlElement], losses: Losses
) -> list[Body]:
    """Return the bodies with the laws of bushings at their joints; report the other bushings."""
    found = {body.name: body for body in bodies}
    for force in forces:
        if force.tag not in BUSHINGS:
            continue
        name = force.label
        changed = _with_bushing(frames, found, force, name, losses)
        if changed is None:
            losses.add("bushings that are not at a joint with their axes", name)
        else:
            found[changed.name] = changed
    return list(found.values())


def _with_bushing(
    frames: FrameIndex, bodies: Mapping[str, Body], force: XmlElement, name: str, losses: Losses
) -> Body | None:
    """Return the body whose joint has a bushing; None where no joint has its frames and axes."""
    sockets = ("socket_frame1", "socket_frame2")
    if not all(force.child_text(socket) for socket in sockets):
        return None
    ends = [frames.resolve(force, socket) for socket in sockets]
    if ends[0] is None or ends[1] is None:
        return None
    (first, first_pose), (second, second_pose) = ends[0], ends[1]
    sign, body = 1.0, bodies.get(second)
    if body is None or (body.parent or GROUND) != first:
        sign, body = -1.0, bodies.get(first)
        first_pose, second_pose = second_pose, first_pose
        if body is None or (body.parent or GROUND) != second:
            return None
    offset = inverse_pose(first_pose) @ body.pose @ second_pose
    if np.abs(offset - np.eye(4)).max() > _ALIGNMENT_TOLERANCE:
        return None
    dofs: list[DegreeOfFreedom] = []
    for dof in body.dofs:
        place = _place(dof, second_pose)
        if place is None:
            return None
        index, sense = place
        dofs.append(_with_moment(force, name, dof, index, sign * sense, losses))
    return replace(body, dofs=tuple(dofs))


def _place(dof: DegreeOfFreedom, frame: Array) -> tuple[int, float] | None:
    """Return the number of a degree of freedom among a bushing's, and its sense along the axis."""
    axis = frame[:3, :3].T @ np.asarray(dof.axis)
    k = int(np.argmax(np.abs(axis)))
    if np.abs(np.abs(axis[k]) - 1.0) > _ALIGNMENT_TOLERANCE:
        return None
    if not is_rotation(dof.kind):
        return k + 3, float(np.sign(axis[k]))
    arm = np.cross(np.asarray(dof.point) - frame[:3, 3], dof.axis)
    if np.abs(arm).max() > _ALIGNMENT_TOLERANCE:
        return None
    return k, float(np.sign(axis[k]))


def _with_moment(
    force: XmlElement, name: str, dof: DegreeOfFreedom, index: int, sense: float, losses: Losses
) -> DegreeOfFreedom:
    """Return a degree of freedom with the moment or force of a bushing and its damping."""
    word = "rotational" if index < 3 else "translational"
    damping = force.child_numbers(f"{word}_damping", (0.0, 0.0, 0.0))[index % 3]
    stiffness = force.child_numbers(f"{word}_stiffness", (0.0, 0.0, 0.0))[index % 3]
    function, text = None, force.child_text(_EXPRESSIONS[index])
    if force.tag == "ExpressionBasedBushingForce":
        try:
            function = parse_expression(text or "0", frozenset(_VARIABLES))
        except ExpressionError as failure:
            losses.add("forces with expressions that are not read", f"{name} ({failure})")
            return dof

    def moment_at(values: Array, rate: float) -> Array:
        """Generalized force of the displacement, at displacements and a rate of it."""
        angle = sense * values
        if function is None:
            resisting = stiffness * angle
        else:
            zero = np.zeros_like(angle)
            known = {other: zero for other in _VARIABLES} | {_VARIABLES[index]: angle}
            with np.errstate(all="ignore"):
                resisting = function(known) * np.ones_like(angle)
        return -sense * resisting - damping * rate

    others = [other for k, other in enumerate(_VARIABLES) if k != index]
    if function is not None and any(other in text for other in others):
        losses.add("terms of bushings that depend on several angles or displacements", name)
    return with_function(dof, name, moment_at, losses)
