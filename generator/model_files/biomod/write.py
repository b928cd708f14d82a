"""The format of biorbd (`.bioMod`): segments in a tree, y up.

A segment of the format has first translations, then rotations, about coordinate axes of a frame in
its parent, the outermost first. A joint of the figure is a segment of its name without mass, which
has the displacements; a chain of another form is a row of segments `JOINT_k`. The segment that the
joint moves is fixed to it.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from decimal import Decimal
from functools import partial
from itertools import permutations
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from generator.figure import CENTRE_OF_MASS_SITE, AxisKind, Figure, JointAxis, is_rotation
from generator.identifiers import plain_names, reserve_name
from generator.kinematics.tree import TreeJoint
from generator.losses import Losses
from generator.model_files.biomod.passive_torque import (
    COUPLING_LOSS,
    FittedTorque,
    LinearTorque,
    passive_torques,
)
from generator.model_files.curves_csv import with_curves
from generator.model_files.export_model import (
    ExportModel,
    JointLaws,
    add_common_losses,
    add_tree_losses,
    build_export_model,
    has_friction,
)
from generator.model_files.fit_error import FitErrors, format_range, joint_ranges
from generator.model_files.model_files import (
    MeshFile,
    ModelFiles,
    format_with_meshes,
    geometry_folder,
)
from generator.rotations import Array, inverse_pose, pose_matrix, rotation_with_z_axis, unit_vector
from springs import SpringSet, Stop

WORLD = "root"
"""Name of the world in the format."""

NO_LIMIT = 1e3
"""End of the range of a translation without a limit [m]; a rotation's is pi."""

FITTED_LOSS = "springs approximated by exponentials or lines"

LIMITS_LOSS = "limits of several rotations, which are ranges of the single displacements here"

_LETTERS = "xyz"

_ORTHOGONAL = 1e-12
"""Largest product of unit axes that are perpendicular."""


def format_files(figure: Figure, springs: SpringSet, path: Path) -> ModelFiles:
    """Format a figure as the biorbd model at `path`.

    Raises InputError for a segment that moves without a mass, an inertia or a centre of mass.
    """
    beside = path.with_name("_".join(path.name.split()))  # a blank ends a word of the format
    files = format_with_meshes(
        figure, path, partial(format_biomod, figure, springs), geometry_folder(beside)
    )
    return with_curves(files, figure, springs)


def format_biomod(
    figure: Figure, springs: SpringSet, meshes: Mapping[str, MeshFile] | None = None
) -> tuple[str, Losses]:
    """The text of a biorbd model, and its losses; raises InputError as `format_files`.

    Args:
        figure: the figure.
        springs: springs of its joints.
        meshes: meshes by segment; None for a model without.
    """
    losses = Losses("biorbd model")
    model = build_export_model(figure, springs, losses)
    lines = _SegmentWriter(model, meshes or {}, losses).lines()
    text = "\n".join((*_HEADER, *lines)) + "\n"
    _add_losses(model, losses)
    return text, losses


_HEADER = (
    "version 4",
    "",
    "// Units are metres, kilograms, seconds and radians; y is up.",
    "// Comments of a segment name its displacements as the figure does, in the order of Q.",
    "",
    "gravity 0 -9.81 0",
)


class _SegmentWriter:
    """Segments, from the world outwards."""

    def __init__(self, model: ExportModel, meshes: Mapping[str, MeshFile], losses: Losses) -> None:
        self._model, self._meshes = model, meshes
        self._losses, self._fits = losses, FitErrors()
        taken = {WORLD}
        self._segments = {
            name: reserve_name(_not_world(plain), taken) for name, plain in model.segments.items()
        }
        self._taken = taken

    def lines(self) -> Iterator[str]:
        """Yield the lines of all segments, each base before its tip."""
        for name in self._model.figure.ground:
            yield from _segment(
                self._segments[name],
                WORLD,
                self._model.placement.poses[name],
                (),
                ["mass 0", *self._mesh_lines(name)],
            )
            yield from self._marker_lines(name)
        for branch in self._model.tree.joints:
            yield from self._tree_joint_lines(branch)
        self._fits.report(self._losses)

    def _tree_joint_lines(self, branch: TreeJoint) -> Iterator[str]:
        """Yield the segments of a joint's displacements, and the one that it moves after them."""
        model, joint = self._model, branch.joint
        pose, tip = model.branch_sites(branch)
        laws = model.laws(joint.name)
        torques = self._passive_torques(branch, laws)
        torque_lines: list[str] = []
        parent = self._segments[branch.inboard]
        groups = _groups(_outward_steps(branch))
        for group in groups:
            name = _not_world(model.joints[joint.name])
            if len(groups) > 1:
                name = model.coordinates[joint.name][group.places[0]]
            elif name in self._taken:
                name = f"{name}_joint"
            name = reserve_name(name, self._taken)
            motion = self._motion_lines(branch, group, laws)
            turn = pose_matrix(group.frame, np.zeros(3))
            yield from _segment(name, parent, pose @ turn, motion, ["mass 0"])
            for place, dof in zip(group.places, group.dofs, strict=True):
                if place in torques:
                    torque_lines += _torque_lines(name, dof, torques[place])
            parent, pose = name, inverse_pose(turn)
        moved, rest = self._segments[branch.outboard], inverse_pose(tip)
        body = [*self._body_lines(branch.outboard), *self._mesh_lines(branch.outboard)]
        yield from _segment(moved, parent, pose @ rest, (), body)
        yield from self._marker_lines(branch.outboard)
        yield from torque_lines

    def _passive_torques(self, branch: TreeJoint, laws: JointLaws) -> dict[int, FittedTorque]:
        """Return the passive torques by place in the chain, and report their errors."""
        joint = branch.joint
        ranges = joint_ranges(joint, self._model.joint_springs(joint.name))
        torques = passive_torques(joint, laws, ranges)
        for k, fitted in torques.fitted.items():
            if fitted.error is not None:
                name = self._model.coordinates[joint.name][k]
                over = format_range(fitted.range, joint.chain[k].units)
                self._fits.add(FITTED_LOSS, name, fitted.error, f" over {over}")
        if torques.coupling_error is not None:
            self._fits.add(COUPLING_LOSS, joint.name, torques.coupling_error)
        return torques.fitted

    def _motion_lines(self, branch: TreeJoint, group: "_Group", laws: JointLaws) -> Iterator[str]:
        """Yield the displacements of a segment, their ranges and their damping."""
        joint = branch.joint
        names = self._model.coordinates[joint.name]
        yield f"// {', '.join(names[place] for place in group.places)}"
        for word, letters in (("translations", group.translations), ("rotations", group.rotations)):
            if letters:
                yield f"{word} {letters}"
        yield "rangesq"
        for place in group.places:
            default = np.pi if joint.chain[place].units.is_angle else NO_LIMIT
            low = -default if joint.lower_limit is None else max(joint.lower_limit[place], -default)
            high = default if joint.upper_limit is None else min(joint.upper_limit[place], default)
            yield f"  {_numbers((low, high))}"
        alone = laws.uncoupled
        damping = [alone[k].damping.viscous if k in alone else 0.0 for k in group.places]
        if any(damping):
            yield f"jointdampings {_numbers(damping)}"

    def _body_lines(self, name: str) -> Iterator[str]:
        """Yield the mass of a segment."""
        mass, centre, moments = self._model.mass_properties(name)
        yield f"mass {_numbers(mass)}"
        yield "inertia"
        for row in np.diag(moments):
            yield f"  {_numbers(row)}"
        yield f"com {_numbers(centre)}"

    def _mesh_lines(self, name: str) -> Iterator[str]:
        mesh = self._meshes.get(name)
        if mesh is not None:
            yield f"meshfile {mesh.reference}"
            yield f"meshcolor {_numbers(mesh.colour)}"

    def _marker_lines(self, name: str) -> Iterator[str]:
        """Yield the sites of a segment but its centre of mass."""
        own = self._segments[name]
        sites = self._model.figure.segments[name].sites
        for site, plain in plain_names(sites).items():
            if site != CENTRE_OF_MASS_SITE:
                pose = sites[site].pose_in_segment
                yield ""
                yield f"marker {own}.{plain}"
                yield f"  parent {own}"
                yield f"  position {_numbers(pose[:3, 3])}"
                yield "endmarker"


def _not_world(name: str) -> str:
    """Return a name that is not the world's, which has no upper and lower case."""
    return f"{name}_segment" if name.lower() == WORLD else name


def _outward_steps(branch: TreeJoint) -> list[tuple[int, JointAxis]]:
    """Return places and factors of a chain from the base to the tip."""
    steps = list(enumerate(branch.joint.chain))
    if branch.parent_is_inboard:
        return steps[::-1]
    backwards = [(k, one.kind, *(-part for part in one.axis)) for k, one in steps]
    return [(k, JointAxis(kind, (x, y, z))) for k, kind, x, y, z in backwards]


@dataclass(frozen=True)
class _Group:
    """Displacements that one segment of the format has.

    Attributes:
        places: places in the chain, in the order of the format.
        translations: their coordinate axes ("xz"), the outermost first.
        rotations: likewise.
        frame: frame whose coordinate axes they are, in the joint's frame, shape (3, 3).
    """

    places: tuple[int, ...]
    translations: str
    rotations: str
    frame: Array

    @property
    def dofs(self) -> tuple[str, ...]:
        """Names of the displacements in their segment."""
        return (
            *(f"Trans{letter.upper()}" for letter in self.translations),
            *(f"Rot{letter.upper()}" for letter in self.rotations),
        )


def _groups(steps: list[tuple[int, JointAxis]]) -> list[_Group]:
    """Return the displacements of a joint by segment: all united, or each alone."""
    united = _group(steps)
    groups = [united] if united is not None else map(_group, ([step] for step in steps))
    return [group for group in groups if group is not None]


def _group(steps: list[tuple[int, JointAxis]]) -> _Group | None:
    """Return the displacements of a joint as those of one segment; None where they cannot be.

    Translations come first, and the axes of each kind are different axes of one frame.
    """
    if not steps:
        return None
    kinds = [is_rotation(axis.kind) for _, axis in steps]
    directions = list(dict.fromkeys(axis.axis for _, axis in steps))
    frame = _frame_along([unit_vector(direction) for direction in directions])
    if frame is None or kinds != sorted(kinds):
        return None
    letters, matrix = frame
    words = {AxisKind.TRANSLATION: "", AxisKind.ROTATION: ""}
    for _, axis in steps:
        letter = letters[directions.index(axis.axis)]
        if letter in words[axis.kind]:
            return None
        words[axis.kind] += letter
    places = tuple(place for place, _ in steps)
    return _Group(places, words[AxisKind.TRANSLATION], words[AxisKind.ROTATION], matrix)


def _frame_along(directions: list[Array]) -> tuple[str, Array] | None:
    """Return letters of coordinate axes and the frame in which they are the directions.

    A direction along a coordinate axis keeps its letter if possible, so that left and right limbs
    have the same; of several such frames it is the one that is turned least. None for directions
    that are not perpendicular.
    """
    rows = np.array(directions).reshape(-1, 3)
    if len(rows) > 3 or np.abs(rows @ rows.T - np.eye(len(rows))).max(initial=0.0) > _ORTHOGONAL:
        return None
    best: tuple[tuple[int, float], str, Array] | None = None
    for letters in permutations(range(3), len(rows)):
        frame = _complete_frame(letters, rows)
        if frame is not None:
            kept = sum(abs(row[letter]) == 1.0 for row, letter in zip(rows, letters, strict=True))
            score = kept, float(np.trace(frame))
            if best is None or score > best[0]:
                best = score, "".join(_LETTERS[k] for k in letters), frame
    return None if best is None else (best[1], best[2])


def _complete_frame(letters: tuple[int, ...], rows: Array) -> Array | None:
    """Return the rotation with some columns; None for three columns of a reflection."""
    if len(letters) == 1:
        order = [(letters[0] + k) % 3 for k in (1, 2, 3)]  # in which the direction is the third
        frame = np.empty((3, 3))
        frame[np.ix_(order, order)] = rotation_with_z_axis(rows[0][order])
        return frame
    frame = np.zeros((3, 3))
    frame[:, list(letters)] = rows.T
    if len(letters) == 2:
        third = 3 - sum(letters)
        frame[:, third] = np.cross(frame[:, (third + 1) % 3], frame[:, (third + 2) % 3])
    return frame if np.linalg.det(frame) > 0.0 else None


def _segment(
    name: str, parent: str, pose: Array, motion: Iterator[str] | tuple[str, ...], body: list[str]
) -> Iterator[str]:
    """Yield the lines of a segment."""
    yield ""
    yield f"segment {name}"
    yield f"  parent {parent}"
    yield "  rtinmatrix 1"
    yield "  rt"
    yield from (f"    {_numbers(row)}" for row in pose)
    yield from (f"  {line}" for line in motion)
    yield from (f"  {line}" for line in body)
    yield "endsegment"


def _torque_lines(segment: str, dof: str, fitted: FittedTorque) -> Iterator[str]:
    """Yield the passive torque of a displacement."""
    kind = "linear" if isinstance(fitted.torque, LinearTorque) else "exponential"
    yield ""
    yield f"passivetorque {segment}"
    yield f"  type {kind}"
    yield f"  dof {dof}"
    yield from (f"  {tag} {_numbers(value)}" for tag, value in fitted.torque.tags.items())
    yield "endpassivetorque"


def _numbers(values: ArrayLike) -> str:
    """Format numbers with all their digits and without exponents, which the format misreads."""
    flat: list[float] = np.atleast_1d(np.asarray(values, dtype=float)).ravel().tolist()
    return " ".join(format(Decimal(repr(value + 0.0)), "f") for value in flat)


def _add_losses(model: ExportModel, losses: Losses) -> None:
    """Report the parts that the format cannot hold."""
    for name, own in model.tree_springs.items():
        laws = model.laws(name)
        if any(has_friction(spring) for spring in (*own.axes, *own.translations)):
            losses.add("friction that depends on the angle", name)
        if any(spring.damping.coulomb for spring in laws.uncoupled.values()):
            losses.add("Coulomb friction", name)
        alone = (law for spring in laws.uncoupled.values() for law in spring.elastic)
        if any(isinstance(law, Stop) for law in alone):
            losses.add("stops at limits: the ranges of the file do not stop a joint", name)
        if laws.combined_resist:
            losses.add("damping and friction of several rotations", name)
    for branch in model.tree.joints:
        joint = branch.joint
        limited = joint.lower_limit is not None or joint.upper_limit is not None
        if limited and model.tree.chains[joint.name].rotations[1:]:
            losses.add(LIMITS_LOSS, joint.name)
    add_common_losses(model, losses)
    add_tree_losses(model, losses)
    losses.add_description("the orientations of sites: a marker is a point")
