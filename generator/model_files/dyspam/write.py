"""A figure as a mechanism of DYSPAM (section 3.2).

DYSPAM's input files, a folder of four (sections 3.1.1 and 4.1.5; `docs/dyspam.md`).

Writing is what the thesis's Ernest did; `dyspam_reader` is its inverse. All numbers in the files
are cgs and radians.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from generator.diagnostics import Fault, InputError, error
from generator.figure import CENTRE_OF_MASS, Figure, Joint, Site, SiteRef, Vector
from generator.figure_file import faults_for_simulation
from generator.kinematics.loops import OpenLoopError, assemble
from generator.kinematics.placement import (
    Placement,
    drawn_displacements,
    motion_maps,
    relative_motion_map,
)
from generator.kinematics.tree import hang
from generator.loads import LoadKind
from generator.losses import Losses, Report
from generator.model_files.dyspam.mechanism import (
    Body,
    Connection,
    JointTriad,
    LinearSpring,
    Mechanism,
    Point,
    PointLoad,
    Row4,
    Triad,
    triad_of,
)
from generator.model_files.dyspam.records import (
    Structure,
    Times,
    counts_of,
    jackforce_text,
    structure_text,
)
from generator.model_files.dyspam.springs import LIMITS, written_springs
from generator.model_files.dyspam.tables import tables_text
from generator.rotations import Array, homogeneous
from generator.springs_file.optional import write_optional
from generator.text_io import write_whole
from springs import SpringSet

_NAMES = "names, in place of which are numbers"
_CHAINS = "axes, signs and order of rotations: revolutes turn about z, sphericals by z-y-x angles"

_ROUNDING = 15
"""Decimals of an SI value that are more than the rounding of a few products."""


@dataclass(frozen=True)
class Numbered:
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


def numbered(figure: Figure) -> Numbered:
    """The figure in DYSPAM's numbers. Raises InputError for one that its files cannot hold."""
    moving = [
        joint
        for joint in figure.joints.values()
        if not {joint.parent.segment, joint.child.segment} <= figure.ground
    ]
    triads: dict[str, JointTriad] = {}
    faults: list[Fault] = list(faults_for_simulation(figure))
    if not moving:
        faults.append(error("the figure cannot be written for DYSPAM: none of its segments moves"))
    for joint in moving:
        found = triad_of(joint)
        if isinstance(found, Fault):
            faults.append(found)
        else:
            triads[joint.name] = found
    if faults:
        raise InputError(faults)
    tree = hang(figure)
    try:
        placement = assemble(tree, drawn_displacements(tree))
    except OpenLoopError as failure:
        raise InputError((error(str(failure)),)) from None
    bodies = dict.fromkeys(figure.ground, 0)
    bodies |= {name: k for k, name in enumerate(figure.bodies, start=1)}
    points = tuple(SiteRef(name, site) for name, seg in figure.bodies.items() for site in seg.sites)
    return Numbered(figure, placement, triads, bodies, points)


def mechanism_of(given: Numbered, springs: tuple[LinearSpring, ...]) -> Mechanism:
    """The mechanism of a figure, its linear springs among it."""
    figure = given.figure
    numbers = {ref: k for k, ref in enumerate(given.points, start=1)}
    bodies = [
        Body(numbers[SiteRef(name, CENTRE_OF_MASS)], seg.mass, seg.inertia)
        for name, seg in figure.bodies.items()
        if seg.mass is not None and seg.inertia is not None
    ]
    points = [
        Point(given.bodies[ref.segment], _vector(figure.site(ref).pose_in_segment[:3, 3]))
        for ref in given.points
    ]
    connections = [
        _connection(given, figure.joints[name], triad) for name, triad in given.triads.items()
    ]
    return Mechanism(tuple(connections), tuple(bodies), tuple(points), springs)


def loads_of(given: Numbered) -> tuple[PointLoad, ...]:
    """The constant loads at points of interest."""
    return tuple(
        PointLoad(kind, number, load)
        for number, ref in enumerate(given.points, start=1)
        for kind, load in _loads(given.figure.site(ref))
    )


def lose_of_figure(given: Numbered, report: Report) -> None:
    """Note what the files do not hold of a figure that they can hold."""
    figure = given.figure
    for name, k in given.bodies.items():
        if k:
            report.lose(_NAMES, f"body {k} was {name}")
    for k, name in enumerate(given.triads, start=1):
        report.lose(_NAMES, f"joint {k} was {name}")
    for name, triad in given.triads.items():
        if figure.joints[name].chain != triad.type.chain:
            report.lose(_CHAINS, name)
    for name, joint in figure.joints.items():
        if joint.lower_limit is not None or joint.upper_limit is not None:
            report.lose(LIMITS, name)
    for name, segment in figure.segments.items():
        if segment.psurf:
            report.lose("psurfs", name)
        if segment.attributes:
            report.lose("attributes", name)
    at_joints = {end for name in given.triads for end in figure.joints[name].ends}
    for ref in given.points:
        if ref not in at_joints and _is_turned(figure.site(ref)):
            report.lose("directions of sites at which no joint is", str(ref))
    for name, segment in figure.segments.items():
        for site in segment.sites if name in figure.ground else ():
            ref = SiteRef(name, site)
            if ref != figure.root and ref not in at_joints:
                report.lose("sites of the ground at which no joint is", str(ref))
            if any(_loads(figure.site(ref))):
                report.lose("loads on the ground, which move nothing", str(ref))


def _connection(given: Numbered, joint: Joint, triad: JointTriad) -> Connection:
    displacement = given.placement.displacements[joint.name]
    angles = triad.angles(given.placement.between(joint)[:3, :3], displacement)
    first, second = (given.bodies[ref.segment] for ref in joint.ends)
    triads = (_triad(given, joint.parent, triad), _triad(given, joint.child, triad))
    start = tuple(_rounded(angle) for angle in angles)
    return Connection(first, second, triad.type, triads, start, (0.0,) * len(start))


def _triad(given: Numbered, ref: SiteRef, triad: JointTriad) -> Triad:
    """The triad at a site: in the segment's frame, on the ground in the world's."""
    pose = given.figure.site(ref).pose_in_segment @ homogeneous(triad.turn, np.zeros(3))
    if ref.segment in given.figure.ground:
        pose = given.placement.poses[ref.segment] @ pose
    made: list[Row4] = []
    for row in pose[:3].tolist():
        x, y, z, offset = map(_rounded, row)
        made.append((x, y, z, offset))
    return made[0], made[1], made[2]


def _loads(site: Site) -> Iterator[tuple[LoadKind, Vector]]:
    loads = (
        (LoadKind.GLOBAL_FORCE, site.global_force),
        (LoadKind.LOCAL_FORCE, site.local_force),
        (LoadKind.GLOBAL_MOMENT, site.global_moment),
        (LoadKind.LOCAL_MOMENT, site.local_moment),
    )
    return ((kind, load) for kind, load in loads if load is not None)


def _is_turned(site: Site) -> bool:
    return bool(np.any(np.abs(site.pose_in_segment[:3, :3] - np.eye(3)) > 1e-12))


def _vector(array: Array) -> Vector:
    x, y, z = (_rounded(value) for value in array.tolist())
    return x, y, z


def _rounded(value: float) -> float:
    return round(value, _ROUNDING)


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
    given = numbered(figure)
    report = Report(FORMAT)
    lose_of_figure(given, report)
    written = written_springs(springs, given.triads, report)
    mechanism, loads = mechanism_of(given, tuple(written.rows)), loads_of(given)
    structure = Structure(
        bodies=len(mechanism.bodies),
        joints=len(mechanism.connections),
        freedoms=_freedoms(given),
        loads=counts_of(loads),
        springs=len(mechanism.springs),
        times=times or Times(),
    )
    texts = {
        STRUCTURE: structure_text(structure),
        TABLES: tables_text(mechanism),
        LOADS: jackforce_text(loads),
        OPTIONAL: write_optional(written.records),
    }
    path.mkdir(exist_ok=True)
    for name, text in texts.items():
        write_whole(path / name, text)
    return report.losses


def _freedoms(given: Numbered) -> int:
    """Degrees of freedom of the whole: those of the tree less what its loops take at the start.

    The sites of a joint that only turns coincide, so that both motions are told at one point.
    """
    placement = given.placement
    free = sum(branch.joint.degrees_of_freedom for branch in placement.tree.branches)
    if not placement.tree.closures:
        return free
    maps, rows = motion_maps(placement), list[np.ndarray]()
    for joint in placement.tree.closures:
        twists = placement.tree.chains[joint.name].twists(placement.displacements[joint.name]).T
        blocked = np.eye(6) - twists @ np.linalg.pinv(twists)
        rows.append(blocked @ relative_motion_map(placement, maps, joint))
    return free - int(np.linalg.matrix_rank(np.vstack(rows), tol=1e-7))
