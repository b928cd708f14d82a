"""Reader of DYSPAM's input files: a folder as a figure and its springs.

Names are made of the numbers of bodies, joints and points.
"""

import os
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from generator.diagnostics import (
    Diagnostic,
    Diagnostics,
    Parsed,
    Source,
    Span,
    TooManyErrors,
    error,
    select_errors,
)
from generator.figure import (
    CENTRE_OF_MASS_SITE,
    Figure,
    Joint,
    Location,
    Rotation,
    Segment,
    Site,
    SiteRef,
    Translation,
)
from generator.figure_file.check import check_figure
from generator.figure_file.resolve import FigureDraft
from generator.loads import site_loads
from generator.losses import Loss, Losses
from generator.model_files.dyspam.mechanism import (
    Connection,
    LinearSpring,
    Mechanism,
    PointLoad,
    Triad,
)
from generator.model_files.dyspam.tables import (
    MAX_COUNT,
    Structure,
    parse_jackforce,
    parse_structure,
    parse_tables,
)
from generator.model_files.dyspam.write import FILES, FORMAT, LOADS, OPTIONAL, STRUCTURE, TABLES
from generator.model_files.model_files import Imported
from generator.rotations import Array, RotationSequence
from generator.springs_file.axes import AXIS_NAMES
from generator.springs_file.laws import CubicEntry
from generator.springs_file.parse import SpringEntry, SpringsFile
from generator.springs_file.read import load_springs
from generator.text_io import load_text, parse_source
from springs import AxisSpring, Cubic, SpringSet

GROUND = "ground"
ORIGIN = "origin"

_XYZ_SEQUENCE = RotationSequence(((0.0, 0.0, 1.0), (0.0, 1.0, 0.0), (1.0, 0.0, 0.0)))
"""The angles of `xyz`, the innermost, z, first."""


def figure_from_mechanism(
    mechanism: Mechanism, loads: Iterable[PointLoad], span: Span, diagnostics: Diagnostics
) -> Figure | None:
    """Convert a mechanism into a figure; None, with diagnostics, if it is invalid.

    Bodies are `body1`, `body2` ..., joints `joint1` ..., points of interest `point1` ...; a site
    `joint1` is that joint's triad. Joint axes are those of the triads.

    Args:
        mechanism: mechanism as read.
        loads: loads at its points; the loads of one kind at a point add up.
        span: span for errors without a place of their own.
        diagnostics: collects errors.
    """
    sites: dict[int, dict[str, Site]] = {k: {} for k in range(len(mechanism.bodies) + 1)}
    sites[0][ORIGIN] = Site(ORIGIN)
    centres = {body.centre for body in mechanism.bodies}
    named = {
        k: CENTRE_OF_MASS_SITE if k in centres else f"point{k}"
        for k in range(1, len(mechanism.points) + 1)
    }
    for k, point in enumerate(mechanism.points, start=1):
        location = Location((Translation(point.position),))
        sites[point.body][named[k]] = Site(named[k], location, origins=_origins(point.span))
    for load in loads:
        at = sites[mechanism.points[load.point - 1].body]
        at[named[load.point]] = _with_load(at[named[load.point]], load)
    draft = FigureDraft(span, root=SiteRef(GROUND, ORIGIN), origins={"root": span})
    for k, connection in enumerate(mechanism.connections, start=1):
        joint = _figure_joint(k, connection, [one for one in mechanism.springs if one.joint == k])
        draft.joints[joint.name] = joint
        ends = zip((connection.first, connection.second), connection.triads, strict=True)
        for body, triad in ends:
            sites[body][joint.name] = Site(joint.name, _location(triad))
    draft.segments[GROUND] = Segment(GROUND, sites=sites[0])
    for k, body in enumerate(mechanism.bodies, start=1):
        name, origins = _body_name(k), _origins(body.span)
        draft.segments[name] = Segment(
            name, body.mass, body.inertia, sites=sites[k], origins=origins
        )
    return check_figure(draft, None, diagnostics)


def _figure_joint(number: int, connection: Connection, springs: list[LinearSpring]) -> Joint:
    """A joint, with a value for each factor where any axis has a spring.

    The initial angles stand outermost first, the factors of a chain innermost first.
    """
    name, chain = _joint_name(number), connection.type.chain
    ends = (SiteRef(_body_name(body), name) for body in (connection.first, connection.second))
    parent, child = ends
    joint = Joint(
        name, parent, child, chain, connection.angles[::-1], origins=_origins(connection.span)
    )
    if not springs:
        return joint
    by_axis = {spring.axis: spring for spring in springs}
    ordered = [by_axis.get(axis) for axis in connection.type.axes]
    stiff = tuple(0.0 if one is None else one.stiffness for one in ordered)
    rest = tuple(0.0 if one is None else one.rest for one in ordered)
    damp = tuple(0.0 if one is None else one.damping for one in ordered)
    return replace(joint, stiff=stiff, rest=rest, damp=damp)


def _with_load(site: Site, load: PointLoad) -> Site:
    """The site with one more load."""
    before = site_loads(site).get(load.kind, (0.0, 0.0, 0.0))
    x, y, z = (a + b for a, b in zip(before, load.components, strict=True))
    return replace(site, **{load.kind.attribute: (x, y, z)})


def _location(triad: Triad) -> Location:
    rows: Array = np.array(triad)
    c, b, a = (float(angle) for angle in _XYZ_SEQUENCE.angles(rows[:, :3]))
    x, y, z = (float(value) for value in rows[:, 3])
    return Location((Rotation((a, b, c)), Translation((x, y, z))))


def _origins(span: Span | None) -> dict[str, Span]:
    return {} if span is None else {"name": span}


def _body_name(number: int) -> str:
    return f"body{number}" if number else GROUND


def _joint_name(number: int) -> str:
    return f"joint{number}"


@dataclass(frozen=True)
class DyspamModel:
    """The contents of a folder.

    Attributes:
        figure: figure of the structure, its tables and loads.
        springs: springs of the figure, from `ndyspamfile` and `optional`.
        losses: what the files say that a figure and its springs do not hold.
    """

    figure: Figure
    springs: SpringSet
    losses: Losses


def parse_dyspam(path: Path) -> Parsed[DyspamModel]:
    """Parse the folder of a figure and its springs."""
    if not path.is_dir():
        missing = error(f"there is no folder `{path}`", hint=f"it holds {', '.join(FILES)}")
        return Parsed(None, (missing,))
    diagnostics: list[Diagnostic] = []
    sources = {name: _read_source(path, name, diagnostics) for name in (STRUCTURE, TABLES, LOADS)}
    if diagnostics:
        return Parsed(None, tuple(diagnostics))
    parsed = parse_source(sources[STRUCTURE], parse_structure)
    structure, diagnostics = parsed.value, [*parsed.diagnostics]
    figure, moving, springs = None, (), None
    if structure is not None:
        figure, moving = _build_figure(sources, structure, diagnostics)
    if figure is not None:
        springs = _load_springs(figure, path / OPTIONAL, diagnostics)
    if structure is None or figure is None or springs is None or select_errors(diagnostics):
        return Parsed(None, tuple(diagnostics))
    figure = replace(figure, path=path / TABLES)
    losses = Losses.collect(FORMAT, _reading_losses(structure, moving))
    return Parsed(DyspamModel(figure, springs, losses), tuple(diagnostics))


def _read_source(folder: Path, name: str, diagnostics: list[Diagnostic]) -> Source:
    source, fault = load_text(folder / name, os.fspath(folder / name))
    if fault is not None:
        diagnostics.append(fault)
    return source


def _build_figure(
    sources: Mapping[str, Source], structure: Structure, diagnostics: list[Diagnostic]
) -> tuple[Figure | None, tuple[str, ...]]:
    """Return the figure, and the joints that start moving; append diagnostics."""
    in_tables, in_loads, mechanism, loads = Diagnostics(), Diagnostics(), None, ()
    with suppress(TooManyErrors):
        mechanism = parse_tables(sources[TABLES], structure, in_tables)
    if mechanism is not None:
        with suppress(TooManyErrors):
            points = MAX_COUNT if in_tables.has_errors else len(mechanism.points)
            loads = parse_jackforce(sources[LOADS], structure.loads, points, in_loads)
    figure = None
    if mechanism is not None and structure.span is not None and not in_tables.has_errors:
        with suppress(TooManyErrors):
            figure = figure_from_mechanism(mechanism, loads, structure.span, in_tables)
    diagnostics += [*in_tables.sorted_by_position(), *in_loads.sorted_by_position()]
    if mechanism is None or figure is None:
        return None, ()
    counted = Diagnostics()
    has_loops = len(mechanism.connections) > len(mechanism.bodies)
    if not has_loops and structure.degrees_of_freedom != figure.degrees_of_freedom:
        counted.error(
            f"the number of degrees of freedom is {structure.degrees_of_freedom}",
            structure.span,
            f"the joints of {TABLES} have {figure.degrees_of_freedom}",
        )
    diagnostics += counted.entries
    starting = enumerate(mechanism.connections, start=1)
    return figure, tuple(_joint_name(k) for k, joint in starting if any(joint.rates))


def _load_springs(figure: Figure, path: Path, diagnostics: list[Diagnostic]) -> SpringSet | None:
    """Load the springs of `ndyspamfile`, and those of `optional` if it has a record."""
    choice = None
    if path.exists():
        source, fault = load_text(path, os.fspath(path))
        if fault is not None or source.text.strip():
            choice = path
    loaded = load_springs(figure, choice=choice)
    diagnostics += loaded.diagnostics
    return loaded.value


def _reading_losses(structure: Structure, moving: tuple[str, ...]) -> list[Loss | None]:
    times = structure.times
    return [
        Loss(
            f"the times of the simulation, {times.start:g} to {times.stop:g} s with a step of "
            f"{times.step:g} s and a frame of {times.frame:g} s"
        ),
        Loss("flags that are set, whose meaning is not known") if structure.has_flags else None,
        Loss("rates with which joints start", moving) if moving else None,
    ]


_REFERENCE = "DYSPAM's file `optional`"


def imported_from_dyspam(model: DyspamModel) -> Imported:
    """The figure with its cubics as a springs file; linear springs are the figure's own fields."""
    entries = tuple(_entries(model.figure, model.springs))
    content = SpringsFile(entries) if entries else None
    return Imported(model.figure, content, model.losses, {})


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
        axis=AXIS_NAMES[spring.direction.index(1.0)] if spherical else None,
        law=CubicEntry(law.coefficients, law.sense, law.dead_zone, True, law.rest),
        damping=spring.damping,
        reference=_REFERENCE,
        why=spring.why,
    )
