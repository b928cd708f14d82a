"""Masses, inertias and centres of mass that a figure lacks, estimated from its psurfs.

What is there is kept, and so is the text: statements are put behind the `psurf` of their segment,
each with a comment that says where it is from.

Mass, inertia and centre of mass of a segment as the figure language writes them.

A segment's inertia there is three principal moments along the segment's own axes. Of a tensor that
has products of inertia as well the diagonal is written, and `products` tells what is left out.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import degrees, floor, log10

import numpy as np

from generator.diagnostics import (
    Diagnostic,
    Diagnostics,
    InputError,
    Source,
    Span,
    shorten,
    warning,
)
from generator.figure import CENTRE_OF_MASS_SITE, Figure, Segment
from generator.figure_file.lexer import Token, tokenize
from generator.figure_file.resolve import origin_span
from generator.geometry.read import read_segment_surface
from generator.geometry.validate import Solid, build_solid
from generator.inertia import MassProperties
from generator.units import Dimension, default_unit_factor, format_quantity

SIGNIFICANT_DIGITS = 7
"""Significant digits that are written: more than any drawing of a segment has."""

NEGLIGIBLE_PRODUCTS_RATIO = 0.01
"""Products of inertia below this, relative to the moments of their axes, are not worth a word."""

MASS_FIELDS = ("mass", "inertia", CENTRE_OF_MASS_SITE)
"""What a segment that moves must have."""


@dataclass(frozen=True)
class ProductsOfInertia:
    """Products of inertia that the figure language cannot hold.

    Attributes:
        ratio: the largest of |I_ij| / sqrt(I_ii I_jj).
        angle: between the principal axes and those of the segment nearest to them, at most [rad].
    """

    ratio: float
    angle: float

    @property
    def are_negligible(self) -> bool:
        """Whether leaving them out changes nothing that counts."""
        return self.ratio <= NEGLIGIBLE_PRODUCTS_RATIO


def products_of_inertia(body: MassProperties) -> ProductsOfInertia:
    """What of a body's inertia is not along the axes of its frame."""
    moments = np.sqrt(np.diag(body.inertia))
    ratios = np.abs(body.inertia) / np.outer(moments, moments)
    nearest = np.abs(body.principal_inertia.axes).max(axis=0).min()
    return ProductsOfInertia(
        ratio=float(ratios[~np.eye(3, dtype=bool)].max()),
        angle=float(np.arccos(min(1.0, float(nearest)))),
    )


def mass_statements(body: MassProperties) -> dict[str, str]:
    """The statements of a segment block for a body told in the segment's frame, by field."""
    size = float(np.sqrt(np.trace(body.inertia) / body.mass)) / _cgs_unit(Dimension.LENGTH)
    places = SIGNIFICANT_DIGITS - 1 - floor(log10(size))
    centre = (
        _format_decimal(round(float(c) / _cgs_unit(Dimension.LENGTH), places)) for c in body.centre
    )
    moments = (
        _format_number(float(m) / _cgs_unit(Dimension.INERTIA)) for m in np.diag(body.inertia)
    )
    return {
        "mass": f"mass = {_format_number(body.mass / _cgs_unit(Dimension.MASS))}g;",
        "inertia": f"inertia = ({','.join(moments)});",
        CENTRE_OF_MASS_SITE: f"site {CENTRE_OF_MASS_SITE}->location = "
        f"trans({','.join(f'{part}cm' for part in centre)});",
    }


def _cgs_unit(dimension: Dimension) -> float:
    return float(default_unit_factor(dimension))


def _format_number(value: float) -> str:
    return _format_decimal(float(f"{value:.{SIGNIFICANT_DIGITS}g}"))


def _format_decimal(value: float) -> str:
    """Digits without an exponent where that is not too long, and without a minus before zero."""
    return f"{value + 0.0:.15g}"


@dataclass(frozen=True)
class Addition:
    """What a segment gets.

    Attributes:
        segment: its name.
        fields: of `FIELDS`, those that were missing.
        body: the segment as estimated, in its own frame.
        density: of that body [kg/m3]; another than asked for where the mass was given.
    """

    segment: str
    fields: tuple[str, ...]
    body: MassProperties
    density: float


@dataclass(frozen=True)
class Completion:
    """A figure's text with what was missing, what that is, and warnings."""

    text: str
    additions: tuple[Addition, ...]
    diagnostics: tuple[Diagnostic, ...]


def complete_figure(figure: Figure, source: Source, density: float) -> Completion:
    """Fill in what the moving segments of a figure lack, from their psurfs at `density` [kg/m3].

    A segment whose mass is given keeps it: its inertia is that of its psurf with this mass. A
    centre of mass that is given is kept as well; the inertia is then still that about the
    psurf's own centre.

    Args:
        figure: as read from `source`, with the path that its psurfs lie beside.
        source: the text of the figure.
        density: [kg/m3], the same everywhere.

    Raises:
        InputError: psurfs that are needed cannot be read, or enclose no body; with all faults.
        ValueError: the density is not above zero.
    """
    faults: list[Diagnostic] = []
    wrong: list[Diagnostic] = []
    additions: list[Addition] = []
    solids: dict[str, Solid | None] = {}
    for segment in figure.bodies.values():
        missing = _missing_fields(segment)
        if not missing or segment.has_ground_mass:
            continue
        flaw = _incompletable_warning(segment, missing)
        if flaw is not None:
            faults.append(flaw)
            continue
        psurf = segment.psurf or ""
        if psurf not in solids:
            solids[psurf], told = _read_solid(figure, segment)
            (faults if solids[psurf] else wrong).extend(told)
        solid = solids[psurf]
        if solid is not None:
            addition = _build_addition(segment, missing, solid, density)
            additions.append(addition)
            faults += _omitted_products_warnings(segment, addition)
    if wrong:
        raise InputError([*faults, *wrong])
    text = _insert_statements(figure, source, additions)
    return Completion(text, tuple(additions), tuple(faults))


def _read_solid(figure: Figure, segment: Segment) -> tuple[Solid | None, tuple[Diagnostic, ...]]:
    """The body within a segment's psurf with its warnings; None with what is wrong."""
    try:
        solid = build_solid(read_segment_surface(figure, segment))
    except InputError as failure:
        return None, failure.diagnostics
    return solid, solid.warnings


def _missing_fields(segment: Segment) -> tuple[str, ...]:
    there = {
        "mass": segment.mass is not None,
        "inertia": segment.inertia is not None,
        CENTRE_OF_MASS_SITE: CENTRE_OF_MASS_SITE in segment.sites,
    }
    return tuple(name for name in MASS_FIELDS if not there[name])


def _incompletable_warning(segment: Segment, missing: Sequence[str]) -> Diagnostic | None:
    """What keeps a segment from being filled in, as a warning."""
    lacks = " and ".join(f"`{name}`" for name in missing)
    name = shorten(segment.name)
    if segment.mass == 0.0:
        return warning(
            f"segment `{name}` lacks {lacks}, but its mass is given as zero",
            origin_span(segment.origins, "mass"),
            "leave out the mass to have it estimated as well",
        )
    if segment.psurf is None:
        return warning(
            f"segment `{name}` lacks {lacks}, and has no psurf to take it from",
            origin_span(segment.origins),
        )
    return None


def _build_addition(
    segment: Segment, missing: tuple[str, ...], solid: Solid, density: float
) -> Addition:
    if segment.mass is not None:
        density = segment.mass / solid.volume
    return Addition(segment.name, missing, solid.mass_properties(density), density)


def _omitted_products_warnings(segment: Segment, addition: Addition) -> list[Diagnostic]:
    products = products_of_inertia(addition.body)
    if "inertia" not in addition.fields or products.are_negligible:
        return []
    return [
        warning(
            f"the products of inertia of `{shorten(segment.name)}` are left out: up to "
            f"{100.0 * products.ratio:.2g} % of its moments",
            origin_span(segment.origins, "psurf"),
            f"its principal axes are turned by {degrees(products.angle):.2g} deg from its own; "
            "a figure file holds moments along the segment's axes only",
        )
    ]


def _insert_statements(figure: Figure, source: Source, additions: Sequence[Addition]) -> str:
    """The text with the statements of all additions, put in from the end on."""
    tokens = list(tokenize(source, Diagnostics())) if additions else []
    at = {token.start: place for place, token in enumerate(tokens)}
    pieces: dict[int, str] = {}
    for addition in additions:
        segment = figure.segments[addition.segment]
        place = at[segment.origins["psurf"].start]
        offset, piece = _insertion(
            source, tokens[place - 2 : place + 3], _commented_statements(segment, addition)
        )
        pieces[offset] = piece
    text = source.text
    for offset in sorted(pieces, reverse=True):
        text = text[:offset] + pieces[offset] + text[offset:]
    return text


def _commented_statements(segment: Segment, addition: Addition) -> Mapping[str, str]:
    """The statements of an addition, each with the comment that belongs to it."""
    density = format_quantity(float(f"{addition.density:.5g}"), Dimension.DENSITY)
    given = segment.mass is not None
    of_mass = f" for the mass given, {density}" if given else f" at {density}"
    statements = mass_statements(addition.body)
    return {
        statements[
            name
        ]: f"estimated from the psurf{'' if name == CENTRE_OF_MASS_SITE else of_mass}"
        for name in addition.fields
    }


def _insertion(
    source: Source, around: Sequence[Token], lines: Mapping[str, str]
) -> tuple[int, str]:
    """Where statements go and how: on lines of their own where `psurf = FILE;` has one.

    `around` are the tokens `psurf`, `=`, the file, `;` and what follows.
    """
    keyword, _, _, end, after = around
    span = Span(source, keyword.start, end.end)
    line_start = source.text.rfind("\n", 0, keyword.start) + 1
    line_end = source.text.find("\n", end.end)
    line_end = len(source.text) if line_end == -1 else line_end
    indent = source.text[line_start : keyword.start]
    comment_goes_on = "/*" in source.text[end.end : line_end].replace("*/", "")
    if indent.strip() or after.start < line_end or comment_goes_on:
        return span.end, "".join(f" {text} /* {comment} */" for text, comment in lines.items())
    return line_end, "".join(f"\n{indent}{text}  # {comment}" for text, comment in lines.items())
