"""Writer of DYSPAM's input files, a folder of four (sections 3.1.1 and 4.1.5; `docs/dyspam.md`).

This is what the thesis's Ernest did (section 3.2). All numbers in the files are cgs and radians.

A spring is written only if reading it returns the same law. `optional` gives neither the sense of a
curve nor, for a spherical joint, its dead zone: reading infers both from the coefficients
(`springs.cubic`).
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from generator.diagnostics import Diagnostic, InputError, error
from generator.figure import CENTRE_OF_MASS_SITE, Figure, Joint, SiteRef, Vector
from generator.figure_file import simulation_diagnostics
from generator.kinematics.loops import OpenLoopError, close_loops
from generator.kinematics.placement import (
    Placement,
    initial_displacements,
    relative_jacobian,
    segment_jacobians,
)
from generator.kinematics.tree import build_tree
from generator.loads import site_loads
from generator.losses import Losses
from generator.model_files.dyspam.mechanism import (
    Connection,
    JointTriad,
    JointType,
    LinearSpring,
    Mechanism,
    MechanismBody,
    Point,
    PointLoad,
    Triad,
    joint_triad,
    triad_from_rows,
)
from generator.model_files.dyspam.tables import (
    Structure,
    Times,
    count_loads,
    format_jackforce,
    format_structure,
    format_tables,
)
from generator.model_files.model_files import ModelFiles
from generator.rotations import Array, pose_matrix
from generator.springs_file.axes import AXIS_NAMES, parallel_sign
from generator.springs_file.optional import OptionalRecord, write_optional
from springs import (
    AxisSpring,
    Coefficients,
    Cubic,
    Linear,
    NotRestoringError,
    SphericalLaw,
    SpringSet,
    Stop,
    passive_cubic,
)
from springs.damping import DEFAULT_SLIP_RATE

ANGLE_DECIMALS = 7
"""Decimals of the edges of dead zones [rad]: springs files give them in degrees, in which 1.7 rad
has no finite decimal."""

_MAX_EDGE_DIFFERENCE = 1e-6
"""Edges of dead zones that are nearer are the same [rad]."""

LIMITS_LOSS = "limits and their stops"
_OTHER_LAW = "springs whose law is neither a line nor a cubic, left out"
_SEVERAL = "springs of several laws about one axis, left out"
_OTHER_AXIS = "springs about axes that are none of their joint's x, y and z, left out"
_OTHER_SENSE = (
    "cubics with another sense or dead zone than `optional` gives them when it is read, left out"
)
_SLIP = f"the slip rate of friction, which is then {DEFAULT_SLIP_RATE:g} rad/s"


def convert_springs(
    springs: SpringSet, triads: Mapping[str, JointTriad], losses: Losses
) -> list[LinearSpring | OptionalRecord]:
    """Return the springs of a figure's joints as rows of `ndyspamfile` and records of `optional`.

    Args:
        springs: springs of the figure.
        triads: triads of its joints, by name in the order of their numbers.
        losses: collects the losses.
    """
    written: list[LinearSpring | OptionalRecord] = []
    for number, (name, triad) in enumerate(triads.items(), start=1):
        joint_springs = springs.joints.get(name)
        by_axis: dict[int, list[AxisSpring]] = {}
        for spring in () if joint_springs is None else joint_springs.axes:
            if any(isinstance(law, Stop) for law in spring.elastic):
                losses.add(LIMITS_LOSS, name)
            axis, own_spring = _in_triad_axes(spring, triad)
            if axis is None:
                losses.add(_OTHER_AXIS, name)
            else:
                by_axis.setdefault(axis, []).append(own_spring)
        for axis, several in sorted(by_axis.items()):
            where = name if triad.type is JointType.REVOLUTE else f"{name} {AXIS_NAMES[axis - 1]}"
            if len(several) > 1:
                losses.add(_SEVERAL, where)
            elif spring := _convert_axis_spring(several[0], triad, number, axis, where, losses):
                written.append(spring)
    _add_other_losses(springs, losses)
    return written


def _add_other_losses(springs: SpringSet, losses: Losses) -> None:
    """Report the properties of springs that the files do not have."""
    for spring in springs.coupled:
        joints = (axis.joint for axis in spring.axes)
        losses.add("springs over several joints, left out", *dict.fromkeys(joints))
    for name, joint in springs.joints.items():
        if joint.reach is not None:
            losses.add("the reach of limbs, left out", name)
        if any(axis.motion or axis.reference or axis.why for axis in joint.axes):
            losses.add_description(
                "what springs say of their motions, references and reasons", name
            )
    if springs.law is not SphericalLaw.CONSERVATIVE:
        how = f"the axes of a spherical joint join ({springs.law.value})"
        losses.add(f"the way in which {how}, which is conservative when read")


def _in_triad_axes(spring: AxisSpring, triad: JointTriad) -> tuple[int | None, AxisSpring]:
    """Return the triad axis of a spring, and the spring in the sense of that axis."""
    x, y, z = (float(part) for part in triad.rotation.T @ np.asarray(spring.direction))
    for number in triad.type.axes:
        a, b, c = (float(number == k) for k in (1, 2, 3))
        sign = parallel_sign((a, b, c), (x, y, z))
        if sign:
            return number, spring if sign > 0 else spring.with_opposite_axis()
    return None, spring


def _convert_axis_spring(
    spring: AxisSpring, triad: JointTriad, joint: int, axis: int, where: str, losses: Losses
) -> LinearSpring | OptionalRecord | None:
    """Return the spring of one axis without its stops; None without any, or with a loss."""
    laws = spring.laws_besides_stops
    if len(laws) > 1:
        losses.add(_SEVERAL, where)
        return None
    law = laws[0] if laws else Linear(0.0)
    viscous, coulomb = spring.damping.viscous, spring.damping.coulomb
    if isinstance(law, Linear) and not coulomb:
        has_spring = laws or viscous
        return LinearSpring(joint, axis, law.stiffness, viscous, law.rest) if has_spring else None
    if isinstance(law, Linear):
        law = Cubic((0.0, law.stiffness, 0.0, 0.0), rest=law.rest)
    elif not isinstance(law, Cubic):
        losses.add(_OTHER_LAW, where)
        return None
    spherical = triad.type is JointType.SPHERICAL
    record = _cubic_record(law, joint, axis, spherical=spherical)
    if record is None:
        losses.add(_OTHER_SENSE, where)
        return None
    if coulomb and spring.damping.slip != DEFAULT_SLIP_RATE:
        losses.add(_SLIP, where)
    # The printed tables give the moment about the site's own positive axis. Negated or not, a curve
    # is read as the same law: its sense follows from its coefficients.
    if spherical and triad.rotation[axis - 1, axis - 1] < 0.0:
        c0, c1, c2, c3 = record.coefficients
        record = replace(record, coefficients=(-c0, -c1, -c2, -c3))
    return replace(record, viscous=viscous, coulomb=coulomb)


def _cubic_record(law: Cubic, joint: int, axis: int, *, spherical: bool) -> OptionalRecord | None:
    """Return the record of a cubic; None if it would be read as another law."""
    zone = law.dead_zone or (0.0, 0.0)
    if spherical:
        law = _with_zero_rest(law)
        record = OptionalRecord(joint, axis, law.coefficients)
    else:
        low, high = (round(edge, ANGLE_DECIMALS) for edge in zone)
        record = OptionalRecord(joint, axis, law.coefficients, rest=law.rest, dead_zone=(low, high))
    dead_zone = None if record.dead_zone == (0.0, 0.0) else record.dead_zone
    try:
        read = passive_cubic(record.coefficients, dead_zone, record.rest)
    except NotRestoringError:
        return None
    return record if read.sense == law.sense and _equal_dead_zones(read, law) else None


def _with_zero_rest(law: Cubic) -> Cubic:
    """Return the same law with the rest at zero, as a spherical axis needs it."""
    r, (c0, c1, c2, c3) = law.rest, law.coefficients
    moved: Coefficients = (
        c0 - r * (c1 - r * (c2 - r * c3)),
        c1 - r * (2.0 * c2 - 3.0 * r * c3),
        c2 - 3.0 * r * c3,
        c3,
    )
    zone = law.dead_zone
    return Cubic(moved, law.sense, zone and (zone[0] + r, zone[1] + r))


def _equal_dead_zones(one: Cubic, other: Cubic) -> bool:
    if one.dead_zone is None or other.dead_zone is None:
        return one.dead_zone is other.dead_zone
    edges = zip(one.dead_zone, other.dead_zone, strict=True)
    return all(abs(a - b) <= _MAX_EDGE_DIFFERENCE for a, b in edges)


_NAMES = "names, in place of which are numbers"
_CHAINS = "axes, signs and order of rotations: revolutes turn about z, sphericals by z-y-x angles"

_DECIMALS = 15
"""Decimals of an SI value that are beyond rounding errors."""


@dataclass(frozen=True)
class NumberedFigure:
    """A figure in DYSPAM's numbers.

    Attributes:
        figure: the figure.
        placement: its start, with loops closed.
        triads: triads of the joints that move, in the order of their numbers, from 1.
        bodies: number of each segment; 0 for the ground.
        points: the sites that are points of interest, in the order of their numbers, from 1.
    """

    figure: Figure
    placement: Placement
    triads: Mapping[str, JointTriad]
    bodies: Mapping[str, int]
    points: tuple[SiteRef, ...]


def number_figure(figure: Figure) -> NumberedFigure:
    """Number the parts of a figure. Raises InputError for one that the files cannot hold."""
    moving = list(figure.moving_joints.values())
    triads: dict[str, JointTriad] = {}
    diagnostics: list[Diagnostic] = list(simulation_diagnostics(figure))
    if not moving:
        diagnostics.append(
            error("the figure cannot be written for DYSPAM: none of its segments moves")
        )
    for joint in moving:
        triad = joint_triad(joint)
        if isinstance(triad, Diagnostic):
            diagnostics.append(triad)
        else:
            triads[joint.name] = triad
    if diagnostics:
        raise InputError(diagnostics)
    tree = build_tree(figure)
    try:
        placement = close_loops(tree, initial_displacements(tree))
    except OpenLoopError as failure:
        raise InputError((error(str(failure)),)) from None
    bodies = dict.fromkeys(figure.ground, 0)
    bodies |= {name: k for k, name in enumerate(figure.bodies, start=1)}
    points = tuple(SiteRef(name, site) for name, seg in figure.bodies.items() for site in seg.sites)
    return NumberedFigure(figure, placement, triads, bodies, points)


def mechanism_from_figure(numbered: NumberedFigure, springs: tuple[LinearSpring, ...]) -> Mechanism:
    """Convert a figure and its linear springs into a mechanism."""
    figure = numbered.figure
    numbers = {ref: k for k, ref in enumerate(numbered.points, start=1)}
    bodies = [
        MechanismBody(numbers[SiteRef(name, CENTRE_OF_MASS_SITE)], seg.mass, seg.inertia)
        for name, seg in figure.bodies.items()
        if seg.mass is not None and seg.inertia is not None
    ]
    points = [
        Point(numbered.bodies[ref.segment], _vector(figure.site(ref).pose_in_segment[:3, 3]))
        for ref in numbered.points
    ]
    connections = [
        _mechanism_joint(numbered, figure.joints[name], triad)
        for name, triad in numbered.triads.items()
    ]
    return Mechanism(tuple(connections), tuple(bodies), tuple(points), springs)


def point_loads(numbered: NumberedFigure) -> tuple[PointLoad, ...]:
    """Return the constant loads at points of interest."""
    return tuple(
        PointLoad(kind, number, load)
        for number, ref in enumerate(numbered.points, start=1)
        for kind, load in site_loads(numbered.figure.site(ref)).items()
    )


def add_figure_losses(numbered: NumberedFigure, losses: Losses) -> None:
    """Report the parts of a figure that the files do not hold."""
    figure = numbered.figure
    for name, k in numbered.bodies.items():
        if k:
            losses.add_description(_NAMES, f"body {k} was {name}")
    for k, name in enumerate(numbered.triads, start=1):
        losses.add_description(_NAMES, f"joint {k} was {name}")
    for name, triad in numbered.triads.items():
        if figure.joints[name].chain != triad.type.chain:
            losses.add(_CHAINS, name)
    for name, joint in figure.joints.items():
        if joint.lower_limit is not None or joint.upper_limit is not None:
            losses.add(LIMITS_LOSS, name)
    for name, segment in figure.segments.items():
        if segment.psurf:
            losses.add_description("psurfs", name)
        if segment.attributes:
            losses.add_description("attributes", name)
        if segment.contact_spheres:
            losses.add("contact spheres", name)
    at_joints = {end for name in numbered.triads for end in figure.joints[name].ends}
    for ref in numbered.points:
        turn = figure.site(ref).pose_in_segment[:3, :3]
        if ref not in at_joints and np.any(np.abs(turn - np.eye(3)) > 1e-12):
            losses.add_description("directions of sites at which no joint is", str(ref))
    for name, segment in figure.segments.items():
        for site in segment.sites if name in figure.ground else ():
            ref = SiteRef(name, site)
            if ref != figure.root and ref not in at_joints:
                losses.add_description("sites of the ground at which no joint is", str(ref))
            if site_loads(figure.site(ref)):
                losses.add_description("loads on the ground, which move nothing", str(ref))


def _mechanism_joint(numbered: NumberedFigure, joint: Joint, triad: JointTriad) -> Connection:
    displacement = numbered.placement.displacements[joint.name]
    angles = triad.initial_angles(numbered.placement.pose_in_parent(joint)[:3, :3], displacement)
    first, second = (numbered.bodies[ref.segment] for ref in joint.ends)
    triads = (_site_triad(numbered, joint.parent, triad), _site_triad(numbered, joint.child, triad))
    start = tuple(_rounded(angle) for angle in angles)
    return Connection(first, second, triad.type, triads, start, (0.0,) * len(start))


def _site_triad(numbered: NumberedFigure, ref: SiteRef, triad: JointTriad) -> Triad:
    """Return the triad at a site in the segment's frame; on the ground in the world's."""
    pose = numbered.figure.site(ref).pose_in_segment @ pose_matrix(triad.rotation, np.zeros(3))
    if ref.segment in numbered.figure.ground:
        pose = numbered.placement.poses[ref.segment] @ pose
    return triad_from_rows([_rounded(value) for value in row] for row in pose[:3].tolist())


def _vector(array: Array) -> Vector:
    x, y, z = (_rounded(value) for value in array.tolist())
    return x, y, z


def _rounded(value: float) -> float:
    return round(value, _DECIMALS)


FORMAT = "DYSPAM input files"

STRUCTURE = "structure"
TABLES = "ndyspamfile"
LOADS = "jackforce"
OPTIONAL = "optional"
FILES = (STRUCTURE, TABLES, LOADS, OPTIONAL)
"""Names of the files. `optional` is empty if no spring is a cubic."""


def format_files(
    figure: Figure, springs: SpringSet, path: Path, times: Times | None = None
) -> ModelFiles:
    """Format the four files of the folder `path`.

    Args:
        figure: figure with joints of one or of three rotations.
        springs: springs of its joints.
        path: the folder.
        times: times of the simulation; None for 0 to 1 s.

    Raises:
        InputError: the files cannot hold the figure; with all reasons.
    """
    numbered = number_figure(figure)
    losses = Losses(FORMAT)
    add_figure_losses(numbered, losses)
    written = convert_springs(springs, numbered.triads, losses)
    rows = tuple(spring for spring in written if isinstance(spring, LinearSpring))
    records = [spring for spring in written if isinstance(spring, OptionalRecord)]
    mechanism, loads = mechanism_from_figure(numbered, rows), point_loads(numbered)
    structure = Structure(
        bodies=len(mechanism.bodies),
        joints=len(mechanism.connections),
        degrees_of_freedom=_degrees_of_freedom(numbered),
        loads=count_loads(loads),
        springs=len(mechanism.springs),
        times=times or Times(),
    )
    texts = {
        STRUCTURE: format_structure(structure),
        TABLES: format_tables(mechanism),
        LOADS: format_jackforce(loads),
        OPTIONAL: write_optional(records),
    }
    return ModelFiles(path, {path / name: text for name, text in texts.items()}, losses)


def _degrees_of_freedom(numbered_figure: NumberedFigure) -> int:
    """Return the degrees of freedom: those of the tree less the constraints of its loops.

    The sites of a joint that only turns coincide, so that both motions refer to one point.
    """
    placement = numbered_figure.placement
    free = sum(len(branch.joint.chain) for branch in placement.tree.joints)
    if not placement.tree.closures:
        return free
    maps, rows = segment_jacobians(placement), list[np.ndarray]()
    for joint in placement.tree.closures:
        twists = placement.tree.chains[joint.name].twists(placement.displacements[joint.name]).T
        blocked = np.eye(6) - twists @ np.linalg.pinv(twists)
        rows.append(blocked @ relative_jacobian(placement, maps, joint))
    return free - int(np.linalg.matrix_rank(np.vstack(rows), tol=1e-7))
