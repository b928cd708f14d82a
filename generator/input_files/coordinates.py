"""Coordinates of the model that a figure is from, in a file beside it, `FIGURE.coordinates.toml`.

A `[[coordinate]]` says which displacement of the figure a coordinate became. Tables of OpenSim's
name their columns after coordinates, so that they are read and written for the model itself.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import chain as joined
from types import MappingProxyType
from typing import Any

from generator.diagnostics import Diagnostics, Source, shorten, spelling_hint
from generator.figure import Figure, JointAxis
from generator.file_kind import FileKind
from generator.identifiers import coordinate_names, plain_name, reserve_name
from generator.text_io import path_exists
from generator.toml_file.reader import TableReader, parse_document
from generator.toml_file.rows import Integer, Number, TableRows, Text
from generator.toml_file.writer import document_to_toml

COORDINATE_TABLE = "coordinate"

MAX_PLACE = 6
"""Largest number of displacements of a joint."""

MAX_SCALE, MIN_SCALE = 1e9, 1e-9
"""Bounds of the factor between a displacement and a coordinate."""

MAX_SHIFT = 1e6
"""Largest difference of a coordinate from its displacement [rad or m]."""

_SHIFTS = {True: "shift_deg", False: "shift_m"}
"""Key of the shift of an angle, and of a length."""

COORDINATE_ROWS = TableRows(
    COORDINATE_TABLE,
    (
        Text("name", example='"knee_angle_r"'),
        Text("joint", example='"knee_r"'),
        Integer("place", 1, MAX_PLACE, example="1"),
        Number("scale", MIN_SCALE, MAX_SCALE),
        Number("shift_deg", -MAX_SHIFT, MAX_SHIFT, " rad"),
        Number("shift_m", -MAX_SHIFT, MAX_SHIFT, " m"),
    ),
)

_NOUN = "coordinates file"


@dataclass(frozen=True)
class CoordinateMapping:
    """The displacement of the figure that a coordinate of the model became.

    Attributes:
        joint: Name of the joint.
        index: Index of the displacement among the joint's, from 0.
        offset: Value of the coordinate where the displacement is zero [rad or m].
        scale: Slope of the coordinate by the displacement, which is positive.
    """

    joint: str
    index: int
    offset: float = 0.0
    scale: float = 1.0


Coordinates = Mapping[str, CoordinateMapping]
"""Displacements by the names of their coordinates."""

NO_COORDINATES: Coordinates = MappingProxyType({})
"""Those of a figure that is from no model."""


def _parse_coordinates(
    source: Source, diagnostics: Diagnostics, figure: Figure, *, has_all_joints: bool = True
) -> Coordinates | None:
    top = parse_document(source, _NOUN, diagnostics)
    if top is None:
        return None
    top.reject_unknown_keys((COORDINATE_TABLE,), _NOUN)
    found: dict[str, CoordinateMapping] = {}
    owners: dict[tuple[str, int], str] = {}
    for table in top.tables(COORDINATE_TABLE, "coordinates"):
        COORDINATE_ROWS.check_keys(table)
        name, mapping = table.text("name"), _mapping(table, figure, has_all_joints)
        if name is None or mapping is None:
            continue
        place = mapping.joint, mapping.index
        if name in found or not _is_word(name):
            problem = "a second coordinate" if name in found else "blanks, or no letters, in"
            table.error("name", f"{problem} `{shorten(name)}`")
        elif place in owners:
            table.error("place", f"this displacement is `{shorten(owners[place])}` already")
        else:
            found[name], owners[place] = mapping, name
    return None if diagnostics.has_errors else found


def _mapping(table: TableReader, figure: Figure, has_all_joints: bool) -> CoordinateMapping | None:
    """Return the displacement of a table; None, with an error, where the figure has none.

    Without `has_all_joints`, joints that the figure lacks are accepted.
    """
    values: dict[str, Any] = COORDINATE_ROWS.read(table)
    if "joint" not in values or "place" not in values:
        return None
    joint, index = figure.joints.get(values["joint"]), int(values["place"]) - 1
    if joint is None:
        hint = spelling_hint(values["joint"], figure.joints)
        if has_all_joints:
            table.error("joint", f"the figure has no joint `{shorten(values['joint'])}`", hint)
        return None
    if index >= len(joint.chain):
        message = f"`{shorten(joint.name)}` has {len(joint.chain)} displacements"
        table.error("place", message, "counted from 1, in the order of its `type`")
        return None
    is_angle = joint.chain[index].units.is_angle
    own, other = _SHIFTS[is_angle], _SHIFTS[not is_angle]
    if other in values:
        table.error(other, f"this displacement has the key `{own}`")
    return CoordinateMapping(joint.name, index, values.get(own, 0.0), values.get("scale", 1.0))


def _is_word(name: str) -> bool:
    """Return whether a column can have this name."""
    return bool(name) and not any(letter.isspace() for letter in name)


COORDINATE_NAMES = FileKind("coordinates", ".coordinates.toml", _parse_coordinates)


def write_coordinates(coordinates: Coordinates, figure: Figure, comment: str = "") -> str:
    """Return the text of a coordinates file; reading it returns the same, to the last bit.

    Names that no column can have, with blanks or none at all, are left out.

    Args:
        coordinates: Coordinates of the figure.
        figure: Figure whose displacements they are.
        comment: One or more lines above them.

    Raises:
        ValueError: A number is not finite, or a name is too long to be read.
    """
    rows = {row.key: row for row in COORDINATE_ROWS.rows}
    tables: list[tuple[str, list[str]]] = []
    for name, at in coordinates.items():
        if not _is_word(name):
            continue
        is_angle = figure.joints[at.joint].chain[at.index].units.is_angle
        values: dict[str, Any] = {"name": name, "joint": at.joint, "place": at.index + 1}
        if at.scale != 1.0:
            values["scale"] = at.scale
        if at.offset:
            values[_SHIFTS[is_angle]] = at.offset
        tables.append((COORDINATE_TABLE, [rows[key].write(one) for key, one in values.items()]))
    return document_to_toml(_NOUN, (), tables, comment)


def coordinates_of_figure(figure: Figure, *, has_all_joints: bool = True) -> Coordinates:
    """Return the coordinates in the file beside that of a figure; none without one.

    Without `has_all_joints` the figure may lack joints of its file, as one with a free root does.

    Raises InputError with all errors.
    """
    path = None if figure.path is None else COORDINATE_NAMES.beside(figure.path)
    if path is None or not path_exists(path):
        return NO_COORDINATES
    return COORDINATE_NAMES.read(path, figure, has_all_joints=has_all_joints)


def displacement_columns(
    chains: Mapping[str, Sequence[JointAxis]], coordinates: Coordinates
) -> Coordinates:
    """Return the displacements of chains by the names of their columns, in the chains' order.

    A displacement without a coordinate of the model has the column `JOINT_k`.

    Args:
        chains: Factors of each joint, innermost first.
        coordinates: Coordinates of the model; those of other joints are left out.
    """
    own = {(at.joint, at.index): name for name, at in coordinates.items()}
    taken = set(own.values())
    columns: dict[str, CoordinateMapping] = {}
    for joint, names in coordinate_names(chains).items():
        for k, name in enumerate(names):
            if (joint, k) in own:
                columns[own[joint, k]] = coordinates[own[joint, k]]
            else:
                columns[reserve_name(name, taken)] = CoordinateMapping(joint, k)
    return columns


def names_in_models(
    chains: Mapping[str, Sequence[JointAxis]], coordinates: Coordinates
) -> dict[str, tuple[str, ...]]:
    """Return the names of each joint's displacements in a model that is written, in their order.

    They are those of the model that the figure is from where they are plain and have the values of
    the displacements; `JOINT_k` for others.
    """
    kept = {
        name: at
        for name, at in coordinates.items()
        if plain_name(name) == name and (at.scale, at.offset) == (1.0, 0.0)
    }
    columns = iter(displacement_columns(chains, kept))
    return {joint: tuple(next(columns) for _ in chain) for joint, chain in chains.items()}


def are_own_names(coordinates: Coordinates, figure: Figure) -> bool:
    """Return whether all columns would be the same without the coordinates."""
    chains = {name: joint.chain for name, joint in figure.joints.items()}
    names = set(joined.from_iterable(coordinate_names(chains).values()))
    own = displacement_columns(chains, NO_COORDINATES)
    return coordinates.keys() <= names and all(own[n] == at for n, at in coordinates.items())
