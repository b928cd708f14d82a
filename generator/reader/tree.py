"""The syntax tree of a figure file: what is written and where, before it means anything."""

from dataclasses import dataclass

from generator.source import Span


@dataclass(frozen=True, slots=True)
class Word:
    """A bare name."""

    text: str
    span: Span


@dataclass(frozen=True, slots=True)
class Text:
    """A string in quotes."""

    text: str
    span: Span


@dataclass(frozen=True, slots=True)
class Number:
    """A number as written, and its unit as written (`N m/rad`; empty without one)."""

    text: str
    unit: str
    span: Span
    unit_span: Span


@dataclass(frozen=True, slots=True)
class Reference:
    """`segment.site`."""

    segment: Word
    site: Word
    span: Span


@dataclass(frozen=True, slots=True)
class Items:
    """`(a, b, c)`."""

    items: tuple["Number | Word | Text", ...]
    span: Span


@dataclass(frozen=True, slots=True)
class Call:
    """`name(a, b, c)`."""

    name: Word
    arguments: Items
    span: Span


@dataclass(frozen=True, slots=True)
class Product:
    """`a * b * c`, two factors or more."""

    factors: tuple["Call | Number | Word | Text | Reference | Items", ...]
    span: Span


Term = Call | Number | Word | Text | Reference | Items
Value = Term | Product


@dataclass(frozen=True, slots=True)
class Field:
    """`name = value;`. The value is None when it could not be read."""

    name: Word
    value: Value | None


@dataclass(frozen=True, slots=True)
class Connect:
    """`connect a.s to b.t;`."""

    name: Word
    parent: Reference
    child: Reference
    span: Span


@dataclass(frozen=True, slots=True)
class Block:
    """`kind name { ... }`, or `site name->field = value;` as a block of one field.

    `opening` is the brace, None where there is none.
    """

    kind: Word
    name: Word | None
    body: tuple["Statement", ...]
    opening: Span | None


Statement = Field | Connect | Block
