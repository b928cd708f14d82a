"""Parts of a body in files, `FIGURE.contact.toml`: laws of contact with their sources."""

from pathlib import Path

from generator.contact_file.parts import BodyContact, BodyPart, Evidence
from generator.diagnostics import Diagnostics, ModelError, Source
from generator.file_kind import FileKind
from generator.text_io import once_per_source
from generator.toml_file.reader import TableReader, parse_document
from generator.toml_file.rows import Choice, Interval, Names, Number, Numbers, TableRows, Text
from generator.toml_file.writer import document_to_toml
from springs.contact_part import PartLaw

PART_TABLE = "part"

_FILE_KIND = "contact file"
MAX_STIFFNESS = 1e9
"""Largest stiffness of a part [N/m]."""

_USUAL = {"within": "", "norm_scale": 1.0}
"""Values that are not written."""

_POSITIVE = "must be above zero", "the tangent stiffness from each depth on"
_DEPTH = "must not be below zero", "the first stage begins at 0"

PART_ROWS = TableRows(
    PART_TABLE,
    (
        Text("name", example='"pelvis"'),
        Names("spheres", example='["lower_torso 0", "left_upper_leg 0"]'),
        Text("within"),
        Numbers(
            "from_m",
            example="[0, 0.03]",
            count="stiffness_N_m",
            negative_error=_DEPTH,
            noun="depth",
        ),
        Numbers(
            "stiffness_N_m",
            example="[30e3, 71e3]",
            count="from_m",
            positive_error=_POSITIVE,
            largest=MAX_STIFFNESS,
            hint="at most 1e9 N/m",
            noun="stiffness",
        ),
        Number("norm_scale", 0.0, 1.0, is_positive=True),
        Number("damping_s_m", 0.0, 1e3, " s/m", "0: an elastic impact", example="1.0"),
        Interval("band", largest=100.0, hint="at most 100", positive_error=_POSITIVE),
        Choice("class", tuple(Evidence), example='"estimate"'),
        Text("source", example='"assumed"', is_long=True),
    ),
)


def read_contact(path: str | Path) -> BodyContact:
    """Read the parts of a body from a file.

    Raises InputError with all errors. Warnings pass.
    """
    return CONTACT_FILE.read(path)


def write_contact(contact: BodyContact, comment: str = "") -> str:
    """Return the text of a contact file; reading it returns equal parts, bit for bit.

    Args:
        contact: Parts to write.
        comment: One or more lines above them.
    """
    tables = [(PART_TABLE, _lines(part)) for part in contact.parts]
    return document_to_toml(_FILE_KIND, (), tables, comment)


def _lines(part: BodyPart) -> list[str]:
    values = {
        "name": part.name,
        "spheres": tuple(f"{segment} {number}" for segment, number in part.spheres),
        "within": part.within,
        "from_m": tuple(depth for depth, _ in part.law.stages),
        "stiffness_N_m": tuple(stiffness for _, stiffness in part.law.stages),
        "norm_scale": part.law.norm_scale,
        "damping_s_m": part.law.damping,
        "band": part.band,
        "class": part.evidence,
        "source": part.law.source,
    }
    return [
        row.write(values[row.key])
        for row in PART_ROWS.rows
        if values[row.key] != _USUAL.get(row.key)
    ]


def _parse_contact(source: Source, diagnostics: Diagnostics) -> BodyContact | None:
    top = parse_document(source, _FILE_KIND, diagnostics)
    if top is None:
        return None
    top.reject_unknown_keys((PART_TABLE,), _FILE_KIND)
    tables = top.tables(PART_TABLE, "parts")
    if not tables and not diagnostics.has_errors:
        diagnostics.error(
            "this file states no part", top.spans.table(""), f"write `[[{PART_TABLE}]]`"
        )
    parts = [_parse_part(table) for table in tables]
    if diagnostics.has_errors:
        return None
    try:
        return BodyContact(tuple(part for part in parts if part), source.name)
    except ModelError as fault:
        diagnostics.error(str(fault), top.spans.table(""))
        return None


CONTACT_FILE = FileKind("contact", ".contact.toml", once_per_source(_parse_contact))


def _parse_part(table: TableReader) -> BodyPart | None:
    """Return one part; None, with an error noted, if it is wrong."""
    PART_ROWS.check_keys(table)
    values = PART_ROWS.read(table)
    spheres: list[tuple[str, int]] = []
    for k, text in enumerate(values.get("spheres", ())):
        segment, _, number = text.rpartition(" ")
        if not segment or not number.isdecimal():
            hint = 'write the segment and the number of the sphere, as "head 0"'
            table.error("spheres", f"`{text}` does not name a sphere", hint, k)
        else:
            spheres.append((segment, int(number)))
    needed = ("name", "from_m", "stiffness_N_m", "damping_s_m", "class", "source")
    if not spheres or any(key not in values for key in needed):
        return None
    try:
        law = PartLaw(
            tuple(zip(values["from_m"], values["stiffness_N_m"], strict=True)),
            values["damping_s_m"],
            values["source"],
            norm_scale=values.get("norm_scale", 1.0),
        )
    except ValueError as fault:
        table.error("from_m", str(fault))
        return None
    band = values.get("band", (1.0, 1.0))
    within = values.get("within", "")
    return BodyPart(values["name"], law, tuple(spheres), band, values["class"], within)
