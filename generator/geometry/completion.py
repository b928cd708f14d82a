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

from generator.diagnostics import Fault, Findings, InputError, Source, Span, shorten, warning
from generator.figure import CENTRE_OF_MASS, Figure, Segment
from generator.figure_file.lexer import Token, tokenize
from generator.figure_file.resolve import place_of
from generator.geometry.read import surface_of
from generator.geometry.validate import Solid, solid_of
from generator.inertia import MassProperties
from generator.units import Dimension, bare_factor, written

DIGITS = 7
"""Significant digits that are written: more than any drawing of a segment has."""

SMALL = 0.01
"""Products of inertia below this, relative to the moments of their axes, are not worth a word."""

FIELDS = ("mass", "inertia", CENTRE_OF_MASS)
"""What a segment that moves must have."""


@dataclass(frozen=True)
class Products:
    """Products of inertia that the figure language cannot hold.

    Attributes:
        ratio: the largest of |I_ij| / sqrt(I_ii I_jj).
        angle: between the principal axes and those of the segment nearest to them, at most [rad].
    """

    ratio: float
    angle: float

    @property
    def are_small(self) -> bool:
        """Whether leaving them out changes nothing that counts."""
        return self.ratio <= SMALL


def products_of(body: MassProperties) -> Products:
    """What of a body's inertia is not along the axes of its frame."""
    moments = np.sqrt(np.diag(body.inertia))
    ratios = np.abs(body.inertia) / np.outer(moments, moments)
    nearest = np.abs(body.principal.axes).max(axis=0).min()
    return Products(
        ratio=float(ratios[~np.eye(3, dtype=bool)].max()),
        angle=float(np.arccos(min(1.0, float(nearest)))),
    )


def statements_of(body: MassProperties) -> dict[str, str]:
    """The statements of a segment block for a body told in the segment's frame, by field."""
    size = float(np.sqrt(np.trace(body.inertia) / body.mass)) / _cgs(Dimension.LENGTH)
    places = DIGITS - 1 - floor(log10(size))
    centre = (_decimal(round(float(c) / _cgs(Dimension.LENGTH), places)) for c in body.centre)
    moments = (_number(float(m) / _cgs(Dimension.INERTIA)) for m in np.diag(body.inertia))
    return {
        "mass": f"mass = {_number(body.mass / _cgs(Dimension.MASS))}g;",
        "inertia": f"inertia = ({','.join(moments)});",
        CENTRE_OF_MASS: f"site {CENTRE_OF_MASS}->location = "
        f"trans({','.join(f'{part}cm' for part in centre)});",
    }


def _cgs(dimension: Dimension) -> float:
    return float(bare_factor(dimension))


def _number(value: float) -> str:
    return _decimal(float(f"{value:.{DIGITS}g}"))


def _decimal(value: float) -> str:
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
    faults: tuple[Fault, ...]


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
    faults: list[Fault] = []
    wrong: list[Fault] = []
    additions: list[Addition] = []
    solids: dict[str, Solid | None] = {}
    for segment in figure.bodies.values():
        missing = _missing(segment)
        if not missing or segment.has_ground_mass:
            continue
        flaw = _why_not(segment, missing)
        if flaw is not None:
            faults.append(flaw)
            continue
        psurf = segment.psurf or ""
        if psurf not in solids:
            solids[psurf], told = _solid(figure, segment)
            (faults if solids[psurf] else wrong).extend(told)
        solid = solids[psurf]
        if solid is not None:
            addition = _addition(segment, missing, solid, density)
            additions.append(addition)
            faults += _told_of_products(segment, addition)
    if wrong:
        raise InputError([*faults, *wrong])
    text = _with_statements(figure, source, additions)
    return Completion(text, tuple(additions), tuple(faults))


def _solid(figure: Figure, segment: Segment) -> tuple[Solid | None, tuple[Fault, ...]]:
    """The body within a segment's psurf with its warnings; None with what is wrong."""
    try:
        solid = solid_of(surface_of(figure, segment))
    except InputError as failure:
        return None, failure.faults
    return solid, solid.warnings


def _missing(segment: Segment) -> tuple[str, ...]:
    there = {
        "mass": segment.mass is not None,
        "inertia": segment.inertia is not None,
        CENTRE_OF_MASS: CENTRE_OF_MASS in segment.sites,
    }
    return tuple(name for name in FIELDS if not there[name])


def _why_not(segment: Segment, missing: Sequence[str]) -> Fault | None:
    """What keeps a segment from being filled in, as a warning."""
    lacks = " and ".join(f"`{name}`" for name in missing)
    name = shorten(segment.name)
    if segment.mass == 0.0:
        return warning(
            f"segment `{name}` lacks {lacks}, but its mass is given as zero",
            place_of(segment.origins, "mass"),
            "leave out the mass to have it estimated as well",
        )
    if segment.psurf is None:
        return warning(
            f"segment `{name}` lacks {lacks}, and has no psurf to take it from",
            place_of(segment.origins),
        )
    return None


def _addition(segment: Segment, missing: tuple[str, ...], solid: Solid, density: float) -> Addition:
    if segment.mass is not None:
        density = segment.mass / solid.volume
    return Addition(segment.name, missing, solid.mass_properties(density), density)


def _told_of_products(segment: Segment, addition: Addition) -> list[Fault]:
    products = products_of(addition.body)
    if "inertia" not in addition.fields or products.are_small:
        return []
    return [
        warning(
            f"the products of inertia of `{shorten(segment.name)}` are left out: up to "
            f"{100.0 * products.ratio:.2g} % of its moments",
            place_of(segment.origins, "psurf"),
            f"its principal axes are turned by {degrees(products.angle):.2g} deg from its own; "
            "a figure file holds moments along the segment's axes only",
        )
    ]


def _with_statements(figure: Figure, source: Source, additions: Sequence[Addition]) -> str:
    """The text with the statements of all additions, put in from the end on."""
    tokens = list(tokenize(source, Findings())) if additions else []
    at = {token.start: place for place, token in enumerate(tokens)}
    pieces: dict[int, str] = {}
    for addition in additions:
        segment = figure.segments[addition.segment]
        place = at[segment.origins["psurf"].start]
        offset, piece = _insertion(source, tokens[place - 2 : place + 3], _lines(segment, addition))
        pieces[offset] = piece
    text = source.text
    for offset in sorted(pieces, reverse=True):
        text = text[:offset] + pieces[offset] + text[offset:]
    return text


def _lines(segment: Segment, addition: Addition) -> Mapping[str, str]:
    """The statements of an addition, each with the comment that belongs to it."""
    density = written(float(f"{addition.density:.5g}"), Dimension.DENSITY)
    given = segment.mass is not None
    of_mass = f" for the mass given, {density}" if given else f" at {density}"
    statements = statements_of(addition.body)
    return {
        statements[name]: f"estimated from the psurf{'' if name == CENTRE_OF_MASS else of_mass}"
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
