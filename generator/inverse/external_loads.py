"""Measured forces on a body, such as those of force plates: OpenSim's tables of them.

A file of `ExternalLoads` (`.xml`) says which columns of a table act on which body. Between its rows
forces, points and torques are straight lines, as in OpenSim.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from generator.diagnostics import (
    Diagnostics,
    InputError,
    Source,
    Span,
    UsageError,
    shorten,
    spelling_hint,
)
from generator.figure import Figure, SiteRef
from generator.file_kind import FileKind
from generator.inverse.smoothing import input_error
from generator.model_files.body_tree.to_figure import FRAME, ORIGIN, WORLD
from generator.model_files.xml import XmlElement, parse_xml
from generator.motion_files import COORDINATES_FILE
from generator.motion_files.opensim_table import CoordinateTable
from generator.rotations import Array

GROUND = "ground"
"""Name of the world in OpenSim's files."""


@dataclass(frozen=True, eq=False)
class ExternalForce:
    """A force with its point, and a torque, on a segment, in a table of n rows.

    Attributes:
        name: Name of the force.
        body: Name of the body in the model that it acts on.
        segment: Segment of the figure that is this body or has it as a part.
        times: Times [s], shape (n,).
        force: Force [N], shape (n, 3).
        point: Its point [m], shape (n, 3); the origin of the body without columns.
        torque: Torque [N m], shape (n, 3).
        force_frame: Frame of force and torque: a segment and the pose in it; None for the ground.
        point_frame: Frame of the point, likewise.
    """

    name: str
    body: str
    segment: str
    times: Array
    force: Array
    point: Array
    torque: Array
    force_frame: tuple[str, Array] | None = None
    point_frame: tuple[str, Array] | None = None

    def in_world(
        self, times: Array, poses: Mapping[str, Array], ground: Array
    ) -> tuple[Array, Array, Array]:
        """Return force, its point and torque in the world, shape (n, 3) each [N, m, N m].

        Args:
            times: Times [s], shape (n,).
            poses: Poses of the segments in the world, shape (n, 4, 4).
            ground: Pose of the model's ground in the world, shape (4, 4).
        """

        def at(columns: Array) -> Array:
            parts: list[Array] = [np.interp(times, self.times, one) for one in columns.T]
            return np.stack(parts, axis=1)

        def frame(of: tuple[str, Array] | None) -> Array:
            pose = ground if of is None else poses[of[0]] @ of[1]
            return np.broadcast_to(pose, (len(times), 4, 4))

        turn, place = frame(self.force_frame)[:, :3, :3], frame(self.point_frame)
        force, torque = (np.einsum("nij,nj->ni", turn, at(of)) for of in (self.force, self.torque))
        point = np.einsum("nij,nj->ni", place[:, :3, :3], at(self.point)) + place[:, :3, 3]
        return force, point, torque

    def wrench(self, times: Array, poses: Mapping[str, Array], ground: Array) -> Array:
        """Return moment about the world's origin and force, (n, 6), as `in_world` [N m, N]."""
        force, point, torque = self.in_world(times, poses, ground)
        return np.hstack([np.cross(point, force) + torque, force])


def wrenches_of_forces(
    forces: Iterable[ExternalForce], times: Array, poses: Mapping[str, Array], figure: Figure
) -> dict[str, Array]:
    """Return the sum of forces on each segment about the world's origin, shape (n, 6) [N m, N]."""
    ground, total = ground_pose(poses, figure), dict[str, Array]()
    for one in forces:
        wrench = one.wrench(times, poses, ground)
        total[one.segment] = total.get(one.segment, 0.0) + wrench
    return total


def ground_pose(poses: Mapping[str, Array], figure: Figure) -> Array:
    """Return the pose of a model's ground in the world, shape (4, 4)."""
    return poses[WORLD][0] if figure.root == SiteRef(WORLD, ORIGIN) else np.eye(4)


def frame_of_body(figure: Figure, body: str) -> tuple[str, Array] | None:
    """Return the segment that a body of the model became, and the body's frame in it.

    A body without a joint is part of another, in which its frame is a site of its name. None for
    an unknown one.
    """
    segment = figure.segments.get(body)
    if segment is not None:
        site = segment.sites.get(FRAME)
        return body, np.eye(4) if site is None else site.pose_in_segment
    for name, segment in figure.segments.items():
        if body in segment.sites and name not in figure.ground:
            return name, segment.sites[body].pose_in_segment
    return None


def _body_names(figure: Figure) -> list[str]:
    """Return the names of bodies that forces may act on, parts of segments last."""
    bodies = figure.bodies
    return [*bodies, *(site for segment in bodies.values() for site in segment.sites)]


@dataclass(frozen=True)
class LoadRow:
    """Contents of an `ExternalForce`, with its place.

    Attributes:
        name: Name of the force.
        body: Body that it acts on.
        prefixes: Beginnings of the columns of force, point and torque; empty without columns.
        frames: Bodies in which force and point are expressed.
        span: Place of the force in its file; None for an option.
    """

    name: str
    body: str
    prefixes: tuple[str, str, str]
    frames: tuple[str, str] = (GROUND, GROUND)
    span: Span | None = None


@dataclass(frozen=True)
class ExternalLoads:
    """Contents of a file of `ExternalLoads`.

    Attributes:
        rows: Forces that are not disabled.
        table: Name of the table's file, as it is written.
        table_span: Place of that name.
    """

    rows: tuple[LoadRow, ...]
    table: str
    table_span: Span


def _parse_loads(source: Source, diagnostics: Diagnostics) -> ExternalLoads | None:
    root = parse_xml(source, diagnostics)
    if root is None:
        return None
    loads = next((each for each in root.walk() if each.tag == "ExternalLoads"), None)
    if loads is None:
        message = "this document has no `ExternalLoads`"
        root.error(message, "OpenSim's inverse dynamics takes such a file")
        return None
    rows = [
        row
        for each in loads.walk()
        if each.tag == "ExternalForce" and (row := _load_row(each, diagnostics)) is not None
    ]
    file = loads.find("datafile")
    if file is None or not file.text.text:
        place = loads.span if file is None else file.span
        diagnostics.error("the `datafile` with the columns is missing", place)
        return None
    if not rows and not diagnostics.has_errors:
        diagnostics.error("there is no `ExternalForce` that acts", loads.span)
    return ExternalLoads(tuple(rows), file.text.text, file.text.span)


LOADS_FILE = FileKind("external loads", ".xml", _parse_loads)


def _load_row(element: XmlElement, diagnostics: Diagnostics) -> LoadRow | None:
    """Return what a force says; None, perhaps with an error, for one that does not act."""
    is_off = element.is_child("isDisabled", "true")
    if is_off or element.is_child("appliesForce", "false"):
        return None
    name = element.get("name") or "force"
    body = element.child_text("applied_to_body").rpartition("/")[2]
    words = [element.child_text(f"{word}_identifier") for word in ("force", "point", "torque")]
    force, point, torque = ("" if word == "Unassigned" else word for word in words)
    if not body or not (force or torque):
        missing = "force_identifier" if body else "applied_to_body"
        element.error(f"the force `{shorten(name)}` has no `{missing}`")
        return None
    frames = [
        element.child_text(f"{word}_expressed_in_body").rpartition("/")[2] or GROUND
        for word in ("force", "point")
    ]
    place = element.find("applied_to_body") or element
    return LoadRow(name, body, (force, point, torque), (frames[0], frames[1]), place.text.span)


def load_row_of_option(text: str) -> LoadRow:
    """Parse `BODY=PREFIX`, of the columns `PREFIX_vx`, `PREFIX_px` and the torque's.

    The torque has the prefix with `torque` in place of `force`, as in OpenSim's files:
    `ground_force_r` and `ground_torque_r`. Raises UsageError.
    """
    body, equals, prefix = (part.strip() for part in text.partition("="))
    if not (body and equals and prefix):
        raise UsageError(f"--force {text}: expected BODY=PREFIX, such as calcn_r=ground_force")
    head, _, tail = prefix.rpartition("force")
    torque = f"{head}torque{tail}_" if "force" in prefix else f"{prefix}_torque_"
    return LoadRow(body, body, (f"{prefix}_v", f"{prefix}_p", torque))


def read_external_loads(
    path: Path, figure: Figure, options: Sequence[str] = ()
) -> tuple[tuple[ExternalForce, ...], Path]:
    """Read forces on a figure, and return them with the path of their table.

    Args:
        path: File of `ExternalLoads`, or with options the table itself.
        figure: Figure on which they act.
        options: `BODY=PREFIX` for each force.

    Raises:
        UsageError: The options do not fit the file.
        InputError: A file is wrong, a column missing, or a body unknown.
    """
    is_loads = path.suffix.lower() == LOADS_FILE.suffix
    if is_loads and options:
        raise UsageError(f"{path} says which bodies the forces act on; --force is for tables")
    if not is_loads:
        if not options:
            raise UsageError(
                f"{path}: name the body of each force with --force BODY=PREFIX, such as "
                "--force calcn_r=ground_force, or give OpenSim's file of external loads, .xml"
            )
        return _forces_of_rows(path, tuple(map(load_row_of_option, options)), figure), path
    loads = LOADS_FILE.read(path)
    table = path.parent / loads.table
    if not table.exists():
        collector = Diagnostics()
        message = f"there is no table `{shorten(loads.table)}` beside this file"
        collector.error(message, loads.table_span)
        raise InputError(collector.sorted_by_position())
    return _forces_of_rows(table, loads.rows, figure), table


def _forces_of_rows(
    path: Path, rows: Sequence[LoadRow], figure: Figure
) -> tuple[ExternalForce, ...]:
    """Return the forces of a table; raises InputError."""
    table = COORDINATES_FILE.parse_file(path, has_angles=False).require_value()
    collector = Diagnostics()
    used = {
        f"{prefix}{axis}" for row in rows for prefix in row.prefixes if prefix for axis in "xyz"
    }
    found = [_force_of_row(row, table, figure, used, collector) for row in rows]
    if collector.has_errors:
        raise InputError(collector.sorted_by_position())
    return tuple(force for force in found if force is not None)


def _force_of_row(
    row: LoadRow, table: CoordinateTable, figure: Figure, used: set[str], diagnostics: Diagnostics
) -> ExternalForce | None:
    """Return a force; None, with errors, where a body or a column is missing.

    Hints leave out columns that forces have, `used`.
    """
    bodies = (row.body, *row.frames)
    frames = [None if name == GROUND else frame_of_body(figure, name) for name in bodies]
    for k, (name, frame) in enumerate(zip(bodies, frames, strict=True)):
        if frame is None and (name != GROUND or k == 0):
            hint = spelling_hint(name, _body_names(figure))
            owner = "" if row.span else f"--force {row.body}: "
            diagnostics.error(f"{owner}the figure has no body `{shorten(name)}`", row.span, hint)
    columns = [_columns(prefix, table, used, diagnostics) for prefix in row.prefixes]
    acted = frames[0]
    if acted is None or any(one is None for one in columns):
        return None
    zeros = np.zeros((len(table.times), 3))
    force, point, torque = (zeros if one is None or not one.size else one for one in columns)
    at, expressed = frames[2], frames[1]
    if not row.prefixes[1]:  # without a point a force acts at the origin of its body
        at = acted
    return ExternalForce(
        row.name, row.body, acted[0], table.times, force, point, torque, expressed, at
    )


def _columns(
    prefix: str, table: CoordinateTable, used: set[str], diagnostics: Diagnostics
) -> Array | None:
    """Return three columns, (n, 3), (0,) without a prefix; None, with an error, without them."""
    if not prefix:
        return np.zeros(0)
    places = {title.text: k for k, title in enumerate(table.titles)}
    wanted = [f"{prefix}{axis}" for axis in "xyz"]
    missing = [name for name in wanted if name not in places]
    for name in missing[:1]:
        hint = spelling_hint(name, places.keys() - used)
        diagnostics.error(f"there is no column `{shorten(name)}`", table.title_line, hint)
    if missing:
        return None
    return np.stack([table.finite_column(places[name], diagnostics) for name in wanted], axis=1)


def common_times(times: Array, forces: Sequence[ExternalForce]) -> Array:
    """Return the times of a motion at which all forces are known, shape (n,) [s].

    Raises InputError where there are none.
    """
    kept = times
    for force in forces:
        first, last = float(force.times[0]), float(force.times[-1])
        kept = kept[(kept >= first) & (kept <= last)]
        if not len(kept):
            raise input_error(
                f"the forces are known from {first:g} to {last:g} s, "
                f"the motion from {times[0]:g} to {times[-1]:g} s: they do not overlap"
            )
    return kept
