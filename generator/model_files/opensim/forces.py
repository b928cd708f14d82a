"""The forces of an OpenSim model: springs of coordinates stay, all others are told as lost."""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from math import pi
from typing import Final

from generator.diagnostics import Findings, shorten
from generator.losses import Report
from generator.model_files.body_tree.tree import Body, Freedom
from generator.model_files.opensim.values import number_in, text_in
from generator.model_files.xml_read import Element
from springs.smooth_limit import SmoothLimit

_PER_DEGREE = 180.0 / pi

SPRING, LIMIT = "SpringGeneralizedForce", "CoordinateLimitForce"

_CONTACT: Final = ("HuntCrossleyForce", "ElasticFoundationForce", "SmoothSphereHalfSpaceForce")


def with_forces(
    bodies: Sequence[Body], forces: Iterable[Element], findings: Findings, report: Report
) -> tuple[Body, ...]:
    """The bodies with the springs and smooth limits that act on their coordinates."""
    freedoms = {freedom.name: freedom for body in bodies for freedom in body.freedoms}
    for force in forces:
        name = force.get("name") or force.tag
        if text_in(force, "appliesForce").lower() == "false":
            report.lose("forces that are switched off", name)
        elif force.tag in (SPRING, LIMIT):
            _hang(force, name, freedoms, findings, report)
        elif any(below.tag == "GeometryPath" for below in force.walk()):
            _check_path(force, name, findings)
            report.lose("muscles and other forces along paths", name)
        elif force.tag in _CONTACT:
            report.lose("contact", name)
        elif force.tag.endswith("Actuator"):
            report.lose("actuators", name)
        else:
            report.lose("other forces", f"{name} ({force.tag})")
    return tuple(
        replace(body, freedoms=tuple(freedoms[freedom.name] for freedom in body.freedoms))
        for body in bodies
    )


def _hang(
    force: Element,
    name: str,
    freedoms: dict[str, Freedom],
    findings: Findings,
    report: Report,
) -> None:
    """The spring or the limit of one coordinate."""
    key = text_in(force, "coordinate").rsplit("/", 1)[-1]
    freedom = freedoms.get(key)
    if freedom is None:
        report.lose("forces on coordinates that do not move here", f"{name} ({key})")
        return
    if force.tag == SPRING:
        scale = freedom.scale
        stiffness = number_in(force, "stiffness", findings)
        rest = number_in(force, "rest_length", findings)
        viscous = number_in(force, "viscosity", findings)
        if stiffness < 0.0 or viscous < 0.0:
            report.lose("springs that drive a coordinate", name)
            return
        if freedom.stiffness:
            report.lose("a second spring on one coordinate", name)
            return
        freedoms[key] = replace(
            freedom,
            stiffness=stiffness * scale * scale,
            rest=(rest - freedom.shift) / scale if stiffness else 0.0,
            damping=freedom.damping + viscous * scale * scale,
        )
        return
    if freedom.kind == "T" or freedom.scale != 1.0 or freedom.limit is not None:
        report.lose("limit forces along slides, or a second one on a coordinate", name)
        return
    limit = _limit(force, freedom.shift, findings)
    if limit is None:
        return
    if number_in(force, "damping", findings):
        report.lose("damping of limit forces", name)
    freedoms[key] = replace(freedom, limit=limit)


def _limit(force: Element, shift: float, findings: Findings) -> SmoothLimit | None:
    """The law of a limit force, whose numbers are told in degrees."""
    words = ("lower_limit", "upper_limit", "lower_stiffness", "upper_stiffness", "transition")
    lower, upper, below, above, width = (number_in(force, word, findings) for word in words)
    try:
        return SmoothLimit(
            lower / _PER_DEGREE - shift,
            upper / _PER_DEGREE - shift,
            below * _PER_DEGREE,
            above * _PER_DEGREE,
            width / _PER_DEGREE,
        )
    except ValueError as failure:
        findings.error(str(failure), force.span)
        return None


def _check_path(force: Element, name: str, findings: Findings) -> None:
    """A path has points, or the file is broken."""
    for path in force.walk():
        if path.tag != "GeometryPath":
            continue
        points = path.first("PathPointSet")
        objects = None if points is None else points.first("objects")
        count = 0 if objects is None else len(objects.children)
        if count < 2:
            place = points or path
            has = "one point" if count else "no points"
            findings.error(
                f"the path of `{shorten(name)}` has {has}",
                place.span,
                "a path leads from one point to another",
            )
