"""The figure that a mechanism of DYSPAM is, in names made of its numbers.

Reading DYSPAM's input files: a folder in, a figure and its springs out.

What was read of DYSPAM's files as a figure file and a springs file hold it.
"""

import os
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from generator.diagnostics import (
    EnoughFaults,
    Fault,
    Findings,
    InputError,
    Source,
    Span,
    error,
    errors_among,
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
from generator.figure_file.check import check
from generator.figure_file.resolve import Draft
from generator.loads import LoadKind
from generator.losses import Loss, Losses
from generator.model_files.dyspam.mechanism import (
    Connection,
    LinearSpring,
    Mechanism,
    PointLoad,
    Triad,
)
from generator.model_files.dyspam.records import MOST, Structure, Times, jackforce_in, structure_in
from generator.model_files.dyspam.tables import tables_in
from generator.model_files.dyspam.write import FILES, FORMAT, LOADS, OPTIONAL, STRUCTURE, TABLES
from generator.model_files.imported import Imported
from generator.rotations import Array, Sequence3
from generator.springs_file.axes import AXES
from generator.springs_file.parse import SpringEntry, SpringsFile
from generator.springs_file.read import springs_for
from generator.text_io import read_text
from springs import AxisSpring, Cubic, SpringSet

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


@dataclass(frozen=True)
class DyspamReading:
    """What came of reading a folder.

    Attributes:
        figure: None when `faults` holds an error.
        springs: of the figure, from `ndyspamfile` and `optional`; None likewise.
        faults: all that was found.
        losses: what the files say that a figure and its springs do not hold.
        times: of the simulation; None when they could not be read.
        rates: by joint, rates of the displacements at the start [rad/s], where there are any.
    """

    figure: Figure | None
    springs: SpringSet | None
    faults: tuple[Fault, ...]
    losses: Losses
    times: Times | None
    rates: Mapping[str, tuple[float, ...]]


def examine(path: Path) -> DyspamReading:
    """The figure and the springs in a folder, with all faults; bad input raises nothing."""
    if not path.is_dir():
        missing = error(f"there is no folder `{path}`", hint=f"it holds {', '.join(FILES)}")
        return DyspamReading(None, None, (missing,), Losses(FORMAT), None, {})
    faults: list[Fault] = []
    sources = {name: _source(path, name, faults) for name in (STRUCTURE, TABLES, LOADS)}
    structure, figure, springs = None, None, None
    rates: dict[str, tuple[float, ...]] = {}
    if not faults:
        structure = _structure(sources[STRUCTURE], faults)
    if structure is not None and not errors_among(faults):
        figure, rates = _figure(sources, structure, faults)
    if figure is not None:
        springs = _springs(figure, path / OPTIONAL, faults)
    if figure is not None and not errors_among(faults):
        figure = replace(figure, path=path / TABLES)
    else:
        figure = springs = None
    losses = Losses.of(FORMAT, () if structure is None else _losses_of_reading(structure, rates))
    times = None if structure is None else structure.times
    return DyspamReading(figure, springs, tuple(faults), losses, times, rates)


def read(path: Path) -> DyspamReading:
    """As `examine`, with figure and springs. Raises InputError, which holds all faults."""
    reading = examine(path)
    if errors_among(reading.faults):
        raise InputError(reading.faults)
    return reading


def _source(folder: Path, name: str, faults: list[Fault]) -> Source:
    source, fault = read_text(folder / name, os.fspath(folder / name))
    if fault is not None:
        faults.append(fault)
    return source


def _structure(source: Source, faults: list[Fault]) -> Structure | None:
    findings, structure = Findings(), None
    with suppress(EnoughFaults):
        structure = structure_in(source, findings)
    faults += findings.in_order()
    return structure


def _figure(
    sources: Mapping[str, Source], structure: Structure, faults: list[Fault]
) -> tuple[Figure | None, dict[str, tuple[float, ...]]]:
    """The figure, and the rates with which it starts; faults are added."""
    in_tables, in_loads, mechanism, loads = Findings(), Findings(), None, ()
    with suppress(EnoughFaults):
        mechanism = tables_in(sources[TABLES], structure, in_tables)
    if mechanism is not None:
        with suppress(EnoughFaults):
            points = MOST if in_tables.has_errors else len(mechanism.points)
            loads = jackforce_in(sources[LOADS], structure.loads, points, in_loads)
    figure = None
    if mechanism is not None and structure.place is not None and not in_tables.has_errors:
        with suppress(EnoughFaults):
            figure = figure_of(mechanism, loads, structure.place, in_tables)
    faults += [*in_tables.in_order(), *in_loads.in_order()]
    if mechanism is None or figure is None:
        return None, {}
    counted = Findings()
    has_loops = len(mechanism.connections) > len(mechanism.bodies)
    if not has_loops and structure.freedoms != figure.degrees_of_freedom:
        counted.error(
            f"the number of degrees of freedom is {structure.freedoms}",
            structure.place,
            f"the joints of {TABLES} have {figure.degrees_of_freedom}",
        )
    faults += counted.faults
    return figure, rates_of(mechanism)


def _springs(figure: Figure, path: Path, faults: list[Fault]) -> SpringSet | None:
    """The springs of `ndyspamfile`, and those of `optional` where there is one with a record."""
    choice = None
    if path.exists():
        source, fault = read_text(path, os.fspath(path))
        if fault is not None or source.text.strip():
            choice = path
    reading = springs_for(figure, choice=choice)
    faults += reading.faults
    return reading.springs


def _losses_of_reading(
    structure: Structure, rates: Mapping[str, tuple[float, ...]]
) -> list[Loss | None]:
    times = structure.times
    return [
        Loss(
            f"the times of the simulation, {times.start:g} to {times.stop:g} s with a step of "
            f"{times.step:g} s and a frame of {times.frame:g} s"
        ),
        Loss("flags that are set, whose meaning is not known") if structure.flagged else None,
        Loss("rates with which joints start", tuple(rates)) if rates else None,
    ]


_REFERENCE = "DYSPAM's file `optional`"


def imported_of(reading: DyspamReading) -> Imported:
    """The figure with its cubics as a springs file; linear springs are the figure's own fields.

    Raises InputError for a reading with errors.
    """
    figure, springs = reading.figure, reading.springs
    if figure is None or springs is None:
        raise InputError(reading.faults)
    entries = tuple(_entries(figure, springs))
    content = SpringsFile(entries) if entries else None
    return Imported(figure, content, reading.losses, {})


def _entries(figure: Figure, springs: SpringSet) -> list[SpringEntry]:
    return [
        _entry(name, law, spring, spherical=len(figure.joints[name].chain) > 1)
        for name, joint in springs.joints.items()
        for spring in joint.axes
        for law in spring.elastic
        if isinstance(law, Cubic)
    ]


def _entry(joint: str, law: Cubic, spring: AxisSpring, *, spherical: bool) -> SpringEntry:
    """A cubic with the sense and the dead zone that reading gave it; the axes are all positive."""
    return SpringEntry(
        joints=(joint,),
        axis=AXES[spring.direction.index(1.0)] if spherical else None,
        coefficients=law.coefficients,
        sense=law.sense,
        dead_zone=law.dead_zone,
        dead_zone_stated=True,
        rest=law.rest,
        damping=spring.damping,
        reference=_REFERENCE,
        why=spring.why,
    )
