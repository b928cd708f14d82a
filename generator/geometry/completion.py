"""Masses, inertias and centres of mass that a figure lacks, estimated from its psurfs.

Existing values and the text stay unchanged: statements are inserted after the `psurf` of their
segment, each with a comment on its source. The figure language has three moments of inertia along
the segment's own axes; products of inertia are left out, with a warning.
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
"""Significant digits of the statements: more than any drawing of a segment has."""

NEGLIGIBLE_PRODUCTS_RATIO = 0.01
"""Products of inertia, relative to the moments of their axes, below which nothing is said."""

MASS_FIELDS = ("mass", "inertia", CENTRE_OF_MASS_SITE)
"""Fields that a moving segment must have."""


@dataclass(frozen=True)
class ProductsOfInertia:
    """Products of inertia that the figure language cannot hold.

    Attributes:
        ratio: the largest of |I_ij| / sqrt(I_ii I_jj).
        angle: angle between the principal axes and those of the segment nearest to them, at most
            [rad].
    """

    ratio: float
    angle: float

    @property
    def are_negligible(self) -> bool:
        """True where they are too small for a warning."""
        return self.ratio <= NEGLIGIBLE_PRODUCTS_RATIO


def products_of_inertia(body: MassProperties) -> ProductsOfInertia:
    """Return the products of inertia of a body about the axes of its frame."""
    moments = np.sqrt(np.diag(body.inertia))
    ratios = np.abs(body.inertia) / np.outer(moments, moments)
    nearest = np.abs(body.principal_inertia.axes).max(axis=0).min()
    return ProductsOfInertia(
        ratio=float(ratios[~np.eye(3, dtype=bool)].max()),
        angle=float(np.arccos(min(1.0, float(nearest)))),
    )


def mass_statements(body: MassProperties) -> dict[str, str]:
    """Return the statements of a segment block, by field, for a body in the segment's frame."""
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
    """Return up to 15 digits, without a minus sign of zero."""
    return f"{value + 0.0:.15g}"


@dataclass(frozen=True)
class Addition:
    """Values added to a segment.

    Attributes:
        segment: its name.
        fields: those of `MASS_FIELDS` that were missing.
        body: the segment as estimated, in its own frame.
        density: density of that body [kg/m3]; not the requested one where the figure has the mass.
    """

    segment: str
    fields: tuple[str, ...]
    body: MassProperties
    density: float


@dataclass(frozen=True)
class Completion:
    """A figure's completed text, the additions, and warnings."""

    text: str
    additions: tuple[Addition, ...]
    diagnostics: tuple[Diagnostic, ...]


def complete_figure(figure: Figure, source: Source, density: float) -> Completion:
    """Add missing values of the moving segments from their psurfs at `density` [kg/m3].

    An existing mass stays, and the inertia is that of the psurf with this mass. An existing centre
    of mass stays as well; the inertia is still that about the centre of the psurf.

    Args:
        figure: figure as read from `source`, with the path beside its psurfs.
        source: the text of the figure.
        density: [kg/m3], uniform.

    Raises:
        InputError: psurfs cannot be read or do not bound a solid; with all errors.
        ValueError: the density is not above zero.
    """
    warnings: list[Diagnostic] = []
    errors: list[Diagnostic] = []
    additions: list[Addition] = []
    solids: dict[str, Solid | None] = {}
    for segment in figure.bodies.values():
        missing = _missing_fields(segment)
        if not missing or segment.has_ground_mass:
            continue
        obstacle = _incompletable_warning(segment, missing)
        if obstacle is not None:
            warnings.append(obstacle)
            continue
        psurf = segment.psurf or ""
        if psurf not in solids:
            solids[psurf], reported = _read_solid(figure, segment)
            (warnings if solids[psurf] else errors).extend(reported)
        solid = solids[psurf]
        if solid is not None:
            own = density if segment.mass is None else segment.mass / solid.volume
            addition = Addition(segment.name, missing, solid.mass_properties(own), own)
            additions.append(addition)
            warnings += _omitted_products_warnings(segment, addition)
    if errors:
        raise InputError([*warnings, *errors])
    text = _insert_statements(figure, source, additions)
    return Completion(text, tuple(additions), tuple(warnings))


def _read_solid(figure: Figure, segment: Segment) -> tuple[Solid | None, tuple[Diagnostic, ...]]:
    """Return the solid within a segment's psurf with its warnings, or None with its errors."""
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
    """Return a warning where a segment cannot be completed."""
    lacks = " and ".join(f"`{name}`" for name in missing)
    name = shorten(segment.name)
    if segment.mass == 0.0:
        return warning(
            f"segment `{name}` lacks {lacks}, but its mass is zero",
            origin_span(segment.origins, "mass"),
            "leave out the mass to estimate it as well",
        )
    if segment.psurf is None:
        return warning(
            f"segment `{name}` lacks {lacks}, and has no psurf to estimate it from",
            origin_span(segment.origins),
        )
    return None


def _omitted_products_warnings(segment: Segment, addition: Addition) -> list[Diagnostic]:
    products = products_of_inertia(addition.body)
    if "inertia" not in addition.fields or products.are_negligible:
        return []
    return [
        warning(
            f"the products of inertia of `{shorten(segment.name)}` are left out: up to "
            f"{100.0 * products.ratio:.2g} % of its moments",
            origin_span(segment.origins, "psurf"),
            f"its principal axes are rotated by {degrees(products.angle):.2g} deg from its own; "
            "a figure file holds moments along the segment's axes only",
        )
    ]


def _insert_statements(figure: Figure, source: Source, additions: Sequence[Addition]) -> str:
    """Return the text with the statements of all additions inserted."""
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
    """Return the statements of an addition, each with its comment."""
    density = format_quantity(float(f"{addition.density:.5g}"), Dimension.DENSITY)
    has_mass = segment.mass is not None
    of_mass = f" for the mass given, {density}" if has_mass else f" at {density}"
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
    """Return offset and text of an insertion: separate lines where `psurf = FILE;` is on one.

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
