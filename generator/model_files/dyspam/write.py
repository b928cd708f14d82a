"""A figure as a mechanism of DYSPAM (section 3.2).

DYSPAM's input files, a folder of four (sections 3.1.1 and 4.1.5; `docs/dyspam.md`).

Writing is what the thesis's Ernest did; `dyspam_reader` is its inverse. All numbers in the files
are cgs and radians.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from generator.diagnostics import Diagnostic, InputError, error
from generator.figure import CENTRE_OF_MASS_SITE, Figure, Joint, Site, SiteRef, Vector
from generator.figure_file import simulation_diagnostics
from generator.kinematics.loops import OpenLoopError, close_loops
from generator.kinematics.placement import (
    Placement,
    initial_displacements,
    relative_jacobian,
    segment_jacobians,
)
from generator.kinematics.tree import build_tree
from generator.loads import LoadKind
from generator.losses import Losses, LossReport
from generator.model_files.dyspam.mechanism import (
    Connection,
    JointTriad,
    LinearSpring,
    Mechanism,
    MechanismBody,
    Point,
    PointLoad,
    Row4,
    Triad,
    joint_triad,
)
from generator.model_files.dyspam.records import (
    Structure,
    Times,
    count_loads,
    format_jackforce,
    format_structure,
)
from generator.model_files.dyspam.springs import LIMITS_LOSS, convert_springs
from generator.model_files.dyspam.tables import format_tables
from generator.rotations import Array, pose_matrix
from generator.springs_file.optional import write_optional
from generator.text_io import write_atomic
from springs import SpringSet

_NAMES = "names, in place of which are numbers"
_CHAINS = "axes, signs and order of rotations: revolutes turn about z, sphericals by z-y-x angles"

_DECIMALS = 15
"""Decimals of an SI value that are more than the rounding of a few products."""


@dataclass(frozen=True)
class NumberedFigure:
    """A figure in DYSPAM's numbers.

    Attributes:
        figure: the figure.
        placement: its start, with loops closed.
        triads: of the joints that move, in the order of their numbers, from 1.
        bodies: number of each segment; 0 for the ground.
        points: the sites that are points of interest, in the order of their numbers, from 1.
    """

    figure: Figure
    placement: Placement
    triads: Mapping[str, JointTriad]
    bodies: Mapping[str, int]
    points: tuple[SiteRef, ...]


def number_figure(figure: Figure) -> NumberedFigure:
    """The figure in DYSPAM's numbers. Raises InputError for one that its files cannot hold."""
    moving = [
        joint
        for joint in figure.joints.values()
        if not {joint.parent.segment, joint.child.segment} <= figure.ground
    ]
    triads: dict[str, JointTriad] = {}
    faults: list[Diagnostic] = list(simulation_diagnostics(figure))
    if not moving:
        faults.append(error("the figure cannot be written for DYSPAM: none of its segments moves"))
    for joint in moving:
        found = joint_triad(joint)
        if isinstance(found, Diagnostic):
            faults.append(found)
        else:
            triads[joint.name] = found
    if faults:
        raise InputError(faults)
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
    """The mechanism of a figure, its linear springs among it."""
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
    """The constant loads at points of interest."""
    return tuple(
        PointLoad(kind, number, load)
        for number, ref in enumerate(numbered.points, start=1)
        for kind, load in _site_loads(numbered.figure.site(ref))
    )


def add_figure_losses(numbered: NumberedFigure, report: LossReport) -> None:
    """Note what the files do not hold of a figure that they can hold."""
    figure = numbered.figure
    for name, k in numbered.bodies.items():
        if k:
            report.add(_NAMES, f"body {k} was {name}")
    for k, name in enumerate(numbered.triads, start=1):
        report.add(_NAMES, f"joint {k} was {name}")
    for name, triad in numbered.triads.items():
        if figure.joints[name].chain != triad.type.chain:
            report.add(_CHAINS, name)
    for name, joint in figure.joints.items():
        if joint.lower_limit is not None or joint.upper_limit is not None:
            report.add(LIMITS_LOSS, name)
    for name, segment in figure.segments.items():
        if segment.psurf:
            report.add("psurfs", name)
        if segment.attributes:
            report.add("attributes", name)
    at_joints = {end for name in numbered.triads for end in figure.joints[name].ends}
    for ref in numbered.points:
        if ref not in at_joints and _is_rotated(figure.site(ref)):
            report.add("directions of sites at which no joint is", str(ref))
    for name, segment in figure.segments.items():
        for site in segment.sites if name in figure.ground else ():
            ref = SiteRef(name, site)
            if ref != figure.root and ref not in at_joints:
                report.add("sites of the ground at which no joint is", str(ref))
            if any(_site_loads(figure.site(ref))):
                report.add("loads on the ground, which move nothing", str(ref))


def _mechanism_joint(numbered: NumberedFigure, joint: Joint, triad: JointTriad) -> Connection:
    displacement = numbered.placement.displacements[joint.name]
    angles = triad.initial_angles(numbered.placement.pose_in_parent(joint)[:3, :3], displacement)
    first, second = (numbered.bodies[ref.segment] for ref in joint.ends)
    triads = (_site_triad(numbered, joint.parent, triad), _site_triad(numbered, joint.child, triad))
    start = tuple(_rounded(angle) for angle in angles)
    return Connection(first, second, triad.type, triads, start, (0.0,) * len(start))


def _site_triad(numbered: NumberedFigure, ref: SiteRef, triad: JointTriad) -> Triad:
    """The triad at a site: in the segment's frame, on the ground in the world's."""
    pose = numbered.figure.site(ref).pose_in_segment @ pose_matrix(triad.rotation, np.zeros(3))
    if ref.segment in numbered.figure.ground:
        pose = numbered.placement.poses[ref.segment] @ pose
    made: list[Row4] = []
    for row in pose[:3].tolist():
        x, y, z, offset = map(_rounded, row)
        made.append((x, y, z, offset))
    return made[0], made[1], made[2]


def _site_loads(site: Site) -> Iterator[tuple[LoadKind, Vector]]:
    loads = (
        (LoadKind.GLOBAL_FORCE, site.global_force),
        (LoadKind.LOCAL_FORCE, site.local_force),
        (LoadKind.GLOBAL_MOMENT, site.global_moment),
        (LoadKind.LOCAL_MOMENT, site.local_moment),
    )
    return ((kind, load) for kind, load in loads if load is not None)


def _is_rotated(site: Site) -> bool:
    return bool(np.any(np.abs(site.pose_in_segment[:3, :3] - np.eye(3)) > 1e-12))


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
"""Names of the files. `optional` is empty where no spring is a cubic."""


def write(figure: Figure, springs: SpringSet, path: Path, times: Times | None = None) -> Losses:
    """Write the four files, each whole, into the folder `path`, which is made if it is not there.

    Args:
        figure: with joints of one or of three rotations.
        springs: of its joints.
        path: the folder.
        times: of the simulation; None for 0 to 1 s.

    Returns:
        What the files do not hold.

    Raises:
        InputError: a figure that the files cannot hold; it has all faults.
        OSError: a file cannot be written.
    """
    given = number_figure(figure)
    report = LossReport(FORMAT)
    add_figure_losses(given, report)
    written = convert_springs(springs, given.triads, report)
    mechanism, loads = mechanism_from_figure(given, tuple(written.rows)), point_loads(given)
    structure = Structure(
        bodies=len(mechanism.bodies),
        joints=len(mechanism.connections),
        degrees_of_freedom=_degrees_of_freedom(given),
        loads=count_loads(loads),
        springs=len(mechanism.springs),
        times=times or Times(),
    )
    texts = {
        STRUCTURE: format_structure(structure),
        TABLES: format_tables(mechanism),
        LOADS: format_jackforce(loads),
        OPTIONAL: write_optional(written.records),
    }
    path.mkdir(exist_ok=True)
    for name, text in texts.items():
        write_atomic(path / name, text)
    return report.losses


def _degrees_of_freedom(numbered_figure: NumberedFigure) -> int:
    """Degrees of freedom of the whole: those of the tree less what its loops take at the start.

    The sites of a joint that only turns coincide, so that both motions are told at one point.
    """
    placement = numbered_figure.placement
    free = sum(branch.joint.degrees_of_freedom for branch in placement.tree.joints)
    if not placement.tree.closures:
        return free
    maps, rows = segment_jacobians(placement), list[np.ndarray]()
    for joint in placement.tree.closures:
        twists = placement.tree.chains[joint.name].twists(placement.displacements[joint.name]).T
        blocked = np.eye(6) - twists @ np.linalg.pinv(twists)
        rows.append(blocked @ relative_jacobian(placement, maps, joint))
    return free - int(np.linalg.matrix_rank(np.vstack(rows), tol=1e-7))
