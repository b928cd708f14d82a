"""The forces of an OpenSim model: springs of coordinates stay, all others are told as lost."""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from math import pi
from typing import Final

from generator.diagnostics import Diagnostics, shorten
from generator.losses import LossReport
from generator.model_files.body_tree.tree import Body, DegreeOfFreedom
from generator.model_files.opensim.values import child_number, child_text
from generator.model_files.xml_read import XmlElement
from springs.smooth_limit import SmoothLimit

_DEGREES_PER_RADIAN = 180.0 / pi

SPRING, LIMIT = "SpringGeneralizedForce", "CoordinateLimitForce"

_CONTACT: Final = ("HuntCrossleyForce", "ElasticFoundationForce", "SmoothSphereHalfSpaceForce")


def apply_forces(
    bodies: Sequence[Body],
    forces: Iterable[XmlElement],
    diagnostics: Diagnostics,
    report: LossReport,
) -> tuple[Body, ...]:
    """The bodies with the springs and smooth limits that act on their coordinates."""
    freedoms = {freedom.name: freedom for body in bodies for freedom in body.dofs}
    for force in forces:
        name = force.get("name") or force.tag
        if child_text(force, "appliesForce").lower() == "false":
            report.add("forces that are switched off", name)
        elif force.tag in (SPRING, LIMIT):
            _apply_coordinate_force(force, name, freedoms, diagnostics, report)
        elif any(below.tag == "GeometryPath" for below in force.walk()):
            _check_path(force, name, diagnostics)
            report.add("muscles and other forces along paths", name)
        elif force.tag in _CONTACT:
            report.add("contact", name)
        elif force.tag.endswith("Actuator"):
            report.add("actuators", name)
        else:
            report.add("other forces", f"{name} ({force.tag})")
    return tuple(
        replace(body, dofs=tuple(freedoms[freedom.name] for freedom in body.dofs))
        for body in bodies
    )


def _apply_coordinate_force(
    force: XmlElement,
    name: str,
    dofs: dict[str, DegreeOfFreedom],
    diagnostics: Diagnostics,
    report: LossReport,
) -> None:
    """The spring or the limit of one coordinate."""
    key = child_text(force, "coordinate").rsplit("/", 1)[-1]
    freedom = dofs.get(key)
    if freedom is None:
        report.add("forces on coordinates that do not move here", f"{name} ({key})")
        return
    if force.tag == SPRING:
        scale = freedom.scale
        stiffness = child_number(force, "stiffness", diagnostics)
        rest = child_number(force, "rest_length", diagnostics)
        viscous = child_number(force, "viscosity", diagnostics)
        if stiffness < 0.0 or viscous < 0.0:
            report.add("springs that drive a coordinate", name)
            return
        if freedom.stiffness:
            report.add("a second spring on one coordinate", name)
            return
        dofs[key] = replace(
            freedom,
            stiffness=stiffness * scale * scale,
            rest=(rest - freedom.offset) / scale if stiffness else 0.0,
            damping=freedom.damping + viscous * scale * scale,
        )
        return
    if freedom.kind == "T" or freedom.scale != 1.0 or freedom.smooth_limit is not None:
        report.add("limit forces along slides, or a second one on a coordinate", name)
        return
    limit = _limit(force, freedom.offset, diagnostics)
    if limit is None:
        return
    if child_number(force, "damping", diagnostics):
        report.add("damping of limit forces", name)
    dofs[key] = replace(freedom, smooth_limit=limit)


def _limit(force: XmlElement, offset: float, diagnostics: Diagnostics) -> SmoothLimit | None:
    """The law of a limit force, whose numbers are told in degrees."""
    words = ("lower_limit", "upper_limit", "lower_stiffness", "upper_stiffness", "transition")
    lower, upper, below, above, width = (child_number(force, word, diagnostics) for word in words)
    try:
        return SmoothLimit(
            lower / _DEGREES_PER_RADIAN - offset,
            upper / _DEGREES_PER_RADIAN - offset,
            below * _DEGREES_PER_RADIAN,
            above * _DEGREES_PER_RADIAN,
            width / _DEGREES_PER_RADIAN,
        )
    except ValueError as failure:
        diagnostics.error(str(failure), force.span)
        return None


def _check_path(force: XmlElement, name: str, diagnostics: Diagnostics) -> None:
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
            diagnostics.error(
                f"the path of `{shorten(name)}` has {has}",
                place.span,
                "a path leads from one point to another",
            )
