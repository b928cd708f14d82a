"""The figure that a mechanism of DYSPAM is, in names made of its numbers."""

from collections.abc import Iterable, Mapping
from dataclasses import replace

import numpy as np

from generator.exchange.dyspam_mechanism import (
    Connection,
    LinearSpring,
    Mechanism,
    PointLoad,
    Triad,
)
from generator.figure import (
    CENTRE_OF_MASS,
    Figure,
    Joint,
    Location,
    Segment,
    Shift,
    Site,
    SiteRef,
    Turn,
)
from generator.frames import Array, Sequence3
from generator.loads import LoadKind
from generator.reader.check import check
from generator.reader.draft import Draft
from generator.reader.findings import Findings
from generator.source import Span

GROUND = "ground"
ORIGIN = "origin"

_XYZ = Sequence3(((0.0, 0.0, 1.0), (0.0, 1.0, 0.0), (1.0, 0.0, 0.0)))
"""The angles of `xyz`, the innermost, z, first."""

_LOAD_FIELDS: Mapping[LoadKind, str] = {
    LoadKind.GLOBAL_FORCE: "global_force",
    LoadKind.LOCAL_FORCE: "local_force",
    LoadKind.GLOBAL_MOMENT: "global_moment",
    LoadKind.LOCAL_MOMENT: "local_moment",
}


def figure_of(
    mechanism: Mechanism, loads: Iterable[PointLoad], place: Span, findings: Findings
) -> Figure | None:
    """The figure of a mechanism; None, with the faults noted, where it is none.

    Bodies are `body1`, `body2` ..., joints `joint1` ..., points of interest `point1` ...; a site
    `joint1` is that joint's triad. Joint axes are those of the triads.

    Args:
        mechanism: as read.
        loads: at its points; the loads of one kind at a point add up.
        place: of the whole, for faults that have no other place.
        findings: for faults.
    """
    sites: dict[int, dict[str, Site]] = {k: {} for k in range(len(mechanism.bodies) + 1)}
    sites[0][ORIGIN] = Site(ORIGIN)
    centres = {body.centre for body in mechanism.bodies}
    named = {
        k: CENTRE_OF_MASS if k in centres else f"point{k}"
        for k in range(1, len(mechanism.points) + 1)
    }
    for k, point in enumerate(mechanism.points, start=1):
        location = Location((Shift(point.position),))
        sites[point.body][named[k]] = Site(named[k], location, origins=_origins(point.place))
    for load in loads:
        at = sites[mechanism.points[load.point - 1].body]
        at[named[load.point]] = _loaded(at[named[load.point]], load)
    draft = Draft(place, root=SiteRef(GROUND, ORIGIN), origins={"root": place})
    for k, connection in enumerate(mechanism.connections, start=1):
        joint = _joint(k, connection, [one for one in mechanism.springs if one.joint == k])
        draft.joints[joint.name] = joint
        ends = zip((connection.first, connection.second), connection.triads, strict=True)
        for body, triad in ends:
            sites[body][joint.name] = Site(joint.name, _location(triad))
    draft.segments[GROUND] = Segment(GROUND, sites=sites[0])
    for k, body in enumerate(mechanism.bodies, start=1):
        name, origins = _body_name(k), _origins(body.place)
        draft.segments[name] = Segment(
            name, body.mass, body.inertia, sites=sites[k], origins=origins
        )
    return check(draft, None, findings)


def rates_of(mechanism: Mechanism) -> dict[str, tuple[float, ...]]:
    """By joint: rates of the figure's displacements [rad/s], of those joints that start moving."""
    return {
        _joint_name(k): connection.rates[::-1]
        for k, connection in enumerate(mechanism.connections, start=1)
        if any(connection.rates)
    }


def _joint(number: int, connection: Connection, springs: list[LinearSpring]) -> Joint:
    """A joint, with a value for each factor where any axis has a spring.

    The initial angles stand outermost first, the factors of a chain innermost first.
    """
    name, chain = _joint_name(number), connection.type.chain
    ends = (SiteRef(_body_name(body), name) for body in (connection.first, connection.second))
    parent, child = ends
    joint = Joint(
        name,
        parent,
        child,
        chain,
        connection.angles[::-1],
        origins=_origins(connection.place),
    )
    if not springs:
        return joint
    by_axis = {spring.axis: spring for spring in springs}
    ordered = [by_axis.get(axis) for axis in connection.type.axes]
    stiff = tuple(0.0 if one is None else one.stiffness for one in ordered)
    rest = tuple(0.0 if one is None else one.rest for one in ordered)
    damp = tuple(0.0 if one is None else one.damping for one in ordered)
    return replace(joint, stiff=stiff, rest=rest, damp=damp)


def _loaded(site: Site, load: PointLoad) -> Site:
    """The site with one more load."""
    key = _LOAD_FIELDS[load.kind]
    before = getattr(site, key) or (0.0, 0.0, 0.0)
    x, y, z = (a + b for a, b in zip(before, load.components, strict=True))
    return replace(site, **{key: (x, y, z)})


def _location(triad: Triad) -> Location:
    rows: Array = np.array(triad)
    c, b, a = (float(angle) for angle in _XYZ.angles(rows[:, :3]))
    x, y, z = (float(value) for value in rows[:, 3])
    return Location((Turn((a, b, c)), Shift((x, y, z))))


def _origins(place: Span | None) -> dict[str, Span]:
    return {} if place is None else {"name": place}


def _body_name(number: int) -> str:
    return f"body{number}" if number else GROUND


def _joint_name(number: int) -> str:
    return f"joint{number}"
