"""`mover cite`: the references of the numbers of a figure, and the published tables."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import degrees, isinf
from typing import Annotated, NamedTuple

import typer

from generator.cli.answer import CommandResult, Paragraphs, Table, format_count
from generator.cli.inputs import load_figure, springs_from_option
from generator.cli.options import SpringsChoice, complete_figure_name
from generator.diagnostics import Diagnostic, InputError, UsageError, error, shorten, spelling_hint
from generator.figure import Figure
from generator.figure_file.read import FIGURE_FILE
from generator.model import contact_of_figure
from generator.person.identity import identity_of
from generator.person.person_files import read_references, sources_path
from generator.simulation.muscle_tone import body_of
from generator.springs_file.axes import axis_name, coupled_axis_names
from generator.text_io import path_exists
from springs import SpringSet
from springs.elastic import Range
from springs.published.reference import Reference
from springs.published.rows import Publication, PublishedCoupledLaw, PublishedCurve
from springs.published.tables import publication, publications
from springs.strength.arm_force_field import arm_force_field_reference
from springs.strength.strengths import (
    AndersonRow,
    Strength,
    StrengthRow,
    anderson_rows,
    checks,
    endurance_reference,
    norm_reference,
    strength,
    strength_rows,
    women_factor,
)

ALL_TABLES, STRENGTHS = "tables", "strengths"
"""Names that stand for all published tables, and for the table of strengths."""


def is_table(name: str) -> bool:
    """Return whether a name is a published table, a row of one, `tables` or `strengths`."""
    source, _, row = name.partition("/")
    return name in (ALL_TABLES, STRENGTHS) or (
        source in publications() and (not row or row in _rows(source))
    )


def table_names(typed_name: str) -> tuple[str, ...]:
    """Return the names of tables, and of the rows of the table that was typed."""
    source = typed_name.partition("/")[0]
    rows = [f"{source}/{row}" for row in _rows(source)] if source in publications() else []
    return (*rows, ALL_TABLES, STRENGTHS, *publications())


def cite_table(name: str) -> CommandResult:
    """Return the references of all tables, of one table with its rows, or of one row."""
    source, _, row = name.partition("/")
    if name == STRENGTHS:
        return StrengthsCitation(strength_rows(), women_factor(), anderson_rows())
    if name == ALL_TABLES:
        tables = [publication(one) for one in publications()]
        return TableCitation(
            list(map(_table_title, tables)), {"tables": list(map(_table_header_data, tables))}
        )
    table, rows = publication(source), _rows(source)
    if row:
        return TableCitation(list(_row_paragraphs(table, rows[row])), _row_data(table, rows[row]))
    lines = [(f"  {source}/{one.name}", _motion(one), _format_ranges(one)) for one in rows.values()]
    data = [_row_data(table, one) for one in rows.values()]
    return TableCitation(
        [_table_title(table), table.note.strip(), Table(lines, 3)],
        {**_table_header_data(table), "note": table.note, "rows": data},
    )


def _rows(source: str) -> Mapping[str, PublishedCurve | PublishedCoupledLaw]:
    table = publication(source)
    return {**table.curves, **table.coupled_laws}


@dataclass(frozen=True)
class TableCitation(CommandResult):
    """References of all published tables, of one with its rows, or of one row."""

    text: Sequence[str | Table]
    data: Mapping[str, object]

    def paragraphs(self) -> Paragraphs:
        """Return contents, references and notes."""
        return self.text

    def to_json(self) -> Mapping[str, object]:
        """Return contents, references and notes, and all of each row."""
        return self.data


def _row_paragraphs(
    table: Publication, row: PublishedCurve | PublishedCoupledLaw
) -> Iterator[str | Table]:
    """Yield the reference of a row, a table of what is known, and the note."""
    fixed = (f"{one} {angle:.4g} deg" for one, angle in _held_angles_data(row).items())
    rows = [
        ("  motion", _motion(row)),
        ("  formula", row.formula),
        ("  as printed", row.convention),
        ("  turned here", _reversed_quantities(row)),
        ("  range", _format_ranges(row)),
        ("  held", ", ".join(fixed)),
        ("  sample", str(row.sample)),
        ("  scatter", row.scatter_text if isinstance(row, PublishedCurve) else ""),
    ]
    if isinstance(row, PublishedCurve) and row.damping is not None:
        rows.append(("  damping", f"{row.damping:g} N m s/rad"))
    yield f"{table.name}/{row.name}\n  {row.reference}"
    yield Table([pair for pair in rows if pair[1]], 2)
    yield row.note.strip()


@dataclass(frozen=True)
class StrengthsCitation(CommandResult):
    """References of the strengths of joints, on which tone acts and postures are judged by."""

    rows: Sequence[StrengthRow]
    women_factor: float
    curves: Sequence[AndersonRow]

    @property
    def others(self) -> Mapping[str, Reference]:
        """Sources of other strengths, by what they are for."""
        beside: dict[Reference, list[str]] = {}
        for one in checks():
            beside.setdefault(one.reference, []).append(one.motion)
        return {
            "force of a hand": arm_force_field_reference(),
            "endurance": endurance_reference(),
            "norms of the knee, by which people over 65 are scaled": norm_reference(),
            **{f"check of {', '.join(dict.fromkeys(own))}": one for one, own in beside.items()},
        }

    def paragraphs(self) -> Paragraphs:
        """Return numbers, class and reference of each row."""
        for row in self.rows:
            classes = ", ".join(dict.fromkeys(origin.value for origin in row.origins))
            sample = f"\n  {row.sample}" if row.citation is not None and str(row.sample) else ""
            yield f"{_strength_text(row)}\n  {classes}: {row.reference or ESTIMATE}{sample}"
        yield f"women have {self.women_factor:g} of men's where a row is of men only, an estimate"
        for noun, reference in self.others.items():
            yield f"{noun}\n  {reference}"

    def to_json(self) -> dict[str, object]:
        """Return all of each row."""
        return {
            "strengths": [
                {
                    "motion": row.motion,
                    "opposite": row.opposite,
                    "torque_Nm": row.torque,
                    "share_of_mgH": row.share,
                    "women_share_of_mgH": row.women_share,
                    "class": row.origin,
                    "opposite_class": row.origins[1],
                    "reference": row.reference or None,
                    "sureness": row.citation and row.citation.sureness,
                    "sample": row.sample.kind,
                    "subjects": row.sample.subjects,
                    "spread": row.spreads,
                    "why": row.why or None,
                }
                for row in self.rows
            ],
            "women_factor": self.women_factor,
            "curves": self.curves,
            "others": {noun: _reference_data(one) for noun, one in self.others.items()},
        }


def _strength_text(row: StrengthRow) -> str:
    """Return motions and numbers: `knee flexion, extension: 0.087, 0.163 m g H`."""
    part, _, kind = row.motion.rpartition(" ")
    opposite = row.opposite.removeprefix(f"{part} ")
    motions = row.motion if opposite == kind else f"{row.motion}, {opposite}"
    if row.torque is not None:
        return f"{motions}: {row.torque[0]:g}, {row.torque[1]:g} N m"
    assert row.share is not None
    text = f"{motions}: {row.share[0]:g}, {row.share[1]:g} m g H"
    if row.women_share is None:
        return text
    return f"{text}; of women {row.women_share[0]:g}, {row.women_share[1]:g}"


class Use(NamedTuple):
    """A reference and the parts of a figure that it is used for."""

    reference: str
    used_for: Sequence[str]


@dataclass(frozen=True)
class FigureCitation(CommandResult):
    """References of the numbers of a figure."""

    figure: str
    springs: str
    references: Sequence[Use]

    def paragraphs(self) -> Paragraphs:
        """Return each reference with its uses."""
        return (f"{one.reference}\n  for {', '.join(one.used_for)}" for one in self.references)


def _table_title(table: Publication) -> str:
    return f"{table.name}: {_contents(table)}\n  {table.reference}"


def _contents(table: Publication) -> str:
    """`2 curves, 1 coupled law`."""
    kinds = (
        (table.curves, "curve"),
        (table.coupled_laws, "coupled law"),
        (table.rhythms, "shoulder rhythm"),
        (table.ranges, "range limit"),
    )
    return ", ".join(format_count(len(rows), noun) for rows, noun in kinds if rows)


def _reversed_quantities(row: PublishedCurve | PublishedCoupledLaw) -> str:
    """Name the quantities that are printed with the opposite sign."""
    if isinstance(row, PublishedCoupledLaw):
        names = " and ".join(row.reversed_coordinates)
        return f"angle and moment, so that both are positive in {names}" if names else ""
    pairs = ((row.angle_sign, "angle"), (row.moment_sign, "moment"))
    parts = " and ".join(noun for sign, noun in pairs if sign < 0)
    return f"{parts}, so that positive is {row.motion}" if parts else ""


def _motion(row: PublishedCurve | PublishedCoupledLaw) -> str:
    return row.motion if isinstance(row, PublishedCurve) else ", ".join(row.law.coordinates)


def _ranges(row: PublishedCurve | PublishedCoupledLaw) -> Iterable[Range | None]:
    return (row.valid_range,) if isinstance(row, PublishedCurve) else row.law.valid_ranges


def _format_ranges(row: PublishedCurve | PublishedCoupledLaw) -> str:
    """`measured 0 .. 90 deg`, or `usable`; for each angle of a coupled law."""
    ends = ["not known" if known is None else _format_interval(*known) for known in _ranges(row)]
    if all(known is None for known in _ranges(row)):
        return "range not known"
    return f"{'measured' if row.range_is_measured else 'usable'} {', '.join(ends)}"


def _format_interval(low: float, high: float) -> str:
    """`0 .. 90 deg`, or one end of it."""
    if isinf(high):
        return "all angles" if isinf(low) else f"from {_format_degrees(low)} deg"
    return (
        f"up to {_format_degrees(high)} deg"
        if isinf(low)
        else f"{_format_degrees(low)} .. {_format_degrees(high)} deg"
    )


def _format_degrees(angle: float) -> str:
    return f"{degrees(angle) + 0.0:.4g}"


def _table_header_data(table: Publication) -> dict[str, object]:
    return {
        "table": table.name,
        **_reference_data(table.reference),
        "curves": list(table.curves),
        "coupled": list(table.coupled_laws),
        "rhythms": list(table.rhythms),
        "ranges": len(table.ranges),
    }


def _reference_data(reference: Reference) -> dict[str, object]:
    return {
        "reference": reference.text,
        "place": reference.place,
        "doi": reference.doi,
        "sureness": reference.sureness,
        "sureness_means": reference.sureness.description,
    }


def _row_data(table: Publication, row: PublishedCurve | PublishedCoupledLaw) -> dict[str, object]:
    return {
        "row": f"{table.name}/{row.name}",
        "motion": _motion(row),
        **_reference_data(row.reference),
        "formula": row.formula,
        "convention": row.convention,
        "turned": _reversed_quantities(row),
        "range_deg": [ends and [degrees(end) for end in ends] for ends in _ranges(row)],
        "range_is_measured": row.range_is_measured,
        "held_deg": _held_angles_data(row),
        "damping_Nms_rad": row.damping if isinstance(row, PublishedCurve) else None,
        "sample": row.sample.kind,
        "subjects": row.sample.subjects,
        "deviation": row.deviation if isinstance(row, PublishedCurve) else {},
        "rms_error_Nm": row.rms_error if isinstance(row, PublishedCurve) else None,
        "note": row.note,
    }


def _held_angles_data(row: PublishedCurve | PublishedCoupledLaw) -> dict[str, float]:
    if not isinstance(row, PublishedCurve):
        return {}
    return {name: degrees(angle) for name, angle in row.held_angles.items()}


ESTIMATE = "An estimate, not from a study"
"""Reference of a number that has none."""

THESIS = (
    "E. M. Otani, Software Tools for Dynamic and Kinematic Modeling of Human Motion, "
    "MS-CIS-89-43, University of Pennsylvania, 1989"
)
THESIS_LANGUAGE_USE, THESIS_LAWS_USE = "the figure language", "the laws of joints"

THESIS_FIGURE_USES = {
    "prototype": "the prototype figure",
    "clavicles": "the prototype figure",
    "pendulum": "the pendulum of its figure 3.4",
}
"""Parts of the thesis in the shipped figures."""


def cite(
    name: Annotated[
        str,
        typer.Argument(
            metavar="FIGURE|TABLE",
            autocompletion=complete_figure_name,
            help="A figure file, the name of a shipped figure, a published table such as "
            "`riener_edrich_1999` or `riener_edrich_1999/leg`, `tables` for a list of them, or "
            "`strengths` for those of muscles.",
        ),
    ],
    springs: SpringsChoice = None,
) -> CommandResult:
    """Cite the sources of the numbers in a figure or a table."""
    # A figure has precedence over a table of the same name.
    if not path_exists(FIGURE_FILE.find(name)):
        if is_table(name):
            if springs is not None:
                raise UsageError("--springs applies to a figure, not to a published table")
            return cite_table(name)
        raise InputError([_unknown_name_error(name)])
    figure, warnings = load_figure(name)
    spring_set, more = springs_from_option(figure, springs)
    uses = {reference: list[str]() for reference in spring_set.references}
    for joint in spring_set.joints.values():
        for spring in (*joint.axes, *joint.translations):
            if spring.reference:
                uses[spring.reference].append(f"{joint.joint} {axis_name(spring.direction)}")
        for name, part in joint.reach.parts if joint.reach is not None else ():
            if part.reference:
                uses[part.reference].append(f"{joint.joint} {name}")
    for spring in spring_set.coupled:
        if spring.reference:
            uses[spring.reference].append(" with ".join(coupled_axis_names(spring)))
    contact = contact_of_figure(figure)
    for part in () if contact is None else contact.parts:
        used = uses.setdefault(part.law.source, [])
        used.append(f"contact of {part.name} ({part.evidence.value})")
    for motion, own in _strengths(figure, spring_set):
        used = uses.setdefault(own.reference or ESTIMATE, [])
        used.append(f"strength of {motion} ({own.origin.value})")
    references = [
        Use(THESIS, list(_thesis_uses(figure, spring_set))),
        *(Use(*item) for item in (*_person_uses(figure, uses).items(), *uses.items())),
    ]
    return FigureCitation(name, spring_set.origin, references, diagnostics=(*warnings, *more))


def _strengths(figure: Figure, springs: SpringSet) -> Iterator[tuple[str, Strength]]:
    """Yield the motions of a person whose strength is known, with it."""
    if identity_of(figure) is None:
        return
    body = body_of(figure)
    for joint in springs.joints.values():
        for spring in joint.axes:
            own = strength(joint.joint, spring.motion, body) if spring.motion else None
            if own is not None:
                yield f"{joint.joint} {spring.motion}", own


def _person_uses(figure: Figure, cited: Iterable[str]) -> Mapping[str, list[str]]:
    """Return the other references of a person, in the table beside it, and what they are for."""
    if figure.path is None or identity_of(figure) is None:
        return {}
    references = read_references(sources_path(figure.path)).items()
    return {one: used for one, used in references if not any(one in text for text in cited)}


def _thesis_uses(figure: Figure, springs: SpringSet) -> Iterator[str]:
    """Yield the parts of a figure that come from the thesis."""
    yield THESIS_LANGUAGE_USE
    if springs.joints or springs.coupled:
        yield THESIS_LAWS_USE
    for name, path in FIGURE_FILE.shipped().items():
        if name in THESIS_FIGURE_USES and path == figure.path:
            yield THESIS_FIGURE_USES[name]


def _unknown_name_error(name: str) -> Diagnostic:
    """Return the error of a name that is neither a figure nor a table."""
    return error(
        f"there is no file `{shorten(name)}`, "
        "no shipped figure and no published table with this name",
        hint=spelling_hint(name, (*FIGURE_FILE.shipped(), *table_names(name))),
    )
