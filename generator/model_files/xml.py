"""Elements of XML: numbers with all their digits, and a text that people can read."""

import re
from bisect import bisect_right
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from math import inf
from typing import Final
from xml.etree.ElementTree import Element, SubElement
from xml.parsers import expat
from xml.sax.saxutils import escape, quoteattr

import numpy as np
from numpy.typing import ArrayLike

from generator.diagnostics import Diagnostics, Source, Span, shorten
from generator.figure import Vector
from generator.rotations import Array, RotationSequence
from generator.units import MAX_MODEL_NUMBER

MAX_DEPTH: Final = 600
"""Largest depth of elements; in MJCF a chain of bodies is as deep as it is long."""

MAX_ELEMENTS: Final = 300_000
"""Largest number of elements; a file of 32 MB may hold millions, a model does not."""

_ATTRIBUTE = re.compile(r"""\s+([^\s=/>]+)\s*=\s*(?:"([^"]*)"|'([^']*)')""")
_TAG = re.compile(r"<([^\s/>]*)")
_TAG_END = re.compile(r"\s*/?>")


@dataclass(frozen=True)
class SourceText:
    """A text in a file: what it says, and where."""

    text: str
    span: Span


@dataclass(frozen=True)
class XmlElement:
    """An element of an XML document.

    Attributes:
        tag: its name, prefixes included.
        span: span of its start tag up to the name's end.
        attributes: attributes in the order of the file.
        children: the elements in it.
        text: the characters in it before the first child, without blanks around them; the place of
            an empty text is the element's.
        diagnostics: collects the errors of its document.
    """

    tag: str
    span: Span
    attributes: Mapping[str, SourceText]
    children: tuple["XmlElement", ...]
    text: SourceText
    diagnostics: Diagnostics = field(compare=False, repr=False)

    def find_all(self, *tags: str) -> Iterator["XmlElement"]:
        """The children with one of these tags, in order."""
        return (child for child in self.children if child.tag in tags)

    def find(self, tag: str) -> "XmlElement | None":
        """The first child with this tag."""
        return next(self.find_all(tag), None)

    def get(self, name: str) -> str | None:
        """The text of an attribute; None without it."""
        written = self.attributes.get(name)
        return None if written is None else written.text

    def span_of(self, name: str) -> Span:
        """Return the place of an attribute's value; without it, that of the element."""
        written = self.attributes.get(name)
        return self.span if written is None else written.span

    @property
    def label(self) -> str:
        """Its name; without one, its tag."""
        return self.get("name") or self.tag

    def error(self, message: str, hint: str = "", at: str | Span = "") -> None:
        """Report an error at an attribute or another place; without one, at the element."""
        place = self.span_of(at) if isinstance(at, str) else at
        self.diagnostics.error(message, place, hint)

    def numbers(self, name: str, least: int, most: int | None = None) -> tuple[float, ...] | None:
        """Parse the numbers of an attribute; None without it, or, with an error, if it is wrong."""
        written = self.attributes.get(name)
        return None if written is None else parse_numbers(written, self.diagnostics, least, most)

    def number(self, name: str, default: float = 0.0) -> float:
        """Parse one number of an attribute; `default` if it is missing or wrong."""
        (value,) = self.numbers(name, 1) or (default,)
        return value

    def vector(self, name: str, default: Vector = (0.0, 0.0, 0.0)) -> Vector:
        """Parse three numbers of an attribute; `default` if it is missing or wrong."""
        x, y, z = self.numbers(name, 3) or default
        return x, y, z

    def text_numbers(
        self, least: int, most: int | None = None, *, allow_infinite: bool = False
    ) -> tuple[float, ...] | None:
        """Parse the numbers of the text; None, with an error, if they are wrong."""
        return parse_numbers(
            self.text, self.diagnostics, least, most, allow_infinite=allow_infinite
        )

    def child_text(self, name: str) -> str:
        """Return the text of a child; empty without one."""
        child = self.find(name)
        return "" if child is None else child.text.text

    def is_child(self, name: str, value: str) -> bool:
        """Return whether the text of a child is `value` but for capitals."""
        return self.child_text(name).lower() == value

    def child_numbers(self, name: str, default: tuple[float, ...]) -> tuple[float, ...]:
        """Parse as many numbers of a child as `default` has; `default` if missing or wrong."""
        child = self.find(name)
        if child is None or not child.text.text:
            return default
        return child.text_numbers(len(default)) or default

    def child_number(self, name: str) -> float:
        """Parse one number of a child; zero if it is missing or wrong."""
        return self.child_numbers(name, (0.0,))[0]

    def direction(self, axis: Sequence[float], at: str | Span = "") -> Vector:
        """Normalise an axis of this element; z, with an error, for the zero vector."""
        length = sum(part * part for part in axis) ** 0.5
        if not 1e-10 < length < inf:
            self.error("this vector has no direction", "an axis must not be zero", at)
            return 0.0, 0.0, 1.0
        x, y, z = (part / length for part in axis)
        return x, y, z

    def is_first_of_name(self, name: str, known: dict[str, "XmlElement"]) -> bool:
        """Return whether no other element has the name of this one; report a second one."""
        first = known.setdefault(name, self)
        if first is not self:
            hint = f"the first is in line {first.span.line}"
            self.error(f"a second {self.tag} named `{shorten(name)}`", hint, "name")
        return first is self

    def walk(self) -> Iterator["XmlElement"]:
        """This element and all below it, in the order of the file."""
        waiting: list[XmlElement] = [self]
        while waiting:
            here = waiting.pop()
            yield here
            waiting += reversed(here.children)


class _ParsingStopped(Exception):  # noqa: N818 - it ends the parsing, it is not an error of its own
    """Reading stops: message, byte, hint."""

    def __init__(self, message: str, byte: int, hint: str) -> None:
        super().__init__(message)
        self.message, self.byte, self.hint = message, byte, hint


@dataclass
class _OpenElement:
    """An element whose end has not come yet."""

    tag: str
    start: int
    attributes: dict[str, SourceText]
    content_start: int
    children: list[XmlElement] = field(default_factory=list[XmlElement])
    text: list[str] = field(default_factory=list[str])
    text_end: int | None = None


class _ElementBuilder:
    """Builds elements from the events of the parser."""

    def __init__(self, source: Source, diagnostics: Diagnostics) -> None:
        self.source, self.diagnostics = source, diagnostics
        self.data = source.text.encode("utf-8", "surrogatepass")
        self._starts: list[int] | None = None
        self.open: list[_OpenElement] = []
        self.root: XmlElement | None = None
        self.count = 0
        # What a file says of its encoding no longer holds: the text is decoded already.
        self.parser = expat.ParserCreate("utf-8")
        self.parser.buffer_text = True
        self.parser.ordered_attributes = True
        self.parser.StartElementHandler = self.start
        self.parser.EndElementHandler = self.end
        self.parser.CharacterDataHandler = self.characters
        self.parser.StartDoctypeDeclHandler = self.doctype

    def offset(self, byte: int) -> int:
        """The place in the text of a byte of its UTF-8 form."""
        if len(self.data) == len(self.source.text):
            return byte
        if self._starts is None:
            codes = np.frombuffer(self.data, dtype=np.uint8)
            self._starts = np.flatnonzero((codes & 0xC0) != 0x80).tolist()
        return bisect_right(self._starts, byte) - 1

    def doctype(self, name: str, system: str | None, public: str | None, inside: bool) -> None:
        byte = self.parser.CurrentByteIndex
        raise _ParsingStopped(
            "a document type is not read", byte, "a model needs no `<!DOCTYPE ...>`"
        )

    def start(self, tag: str, attributes: list[str]) -> None:
        byte = self.parser.CurrentByteIndex
        self.count += 1
        if len(self.open) >= MAX_DEPTH:
            raise _ParsingStopped(
                "elements are nested too deeply", byte, f"{MAX_DEPTH} levels are read"
            )
        if self.count > MAX_ELEMENTS:
            raise _ParsingStopped("there are too many elements", byte, f"{MAX_ELEMENTS:,} are read")
        start, text = self.offset(byte), self.source.text
        if self.open and self.open[-1].text_end is None:
            self.open[-1].text_end = start
        name = _TAG.match(text, start)
        place = name.end() if name else start
        located: dict[str, SourceText] = {}
        values = dict(zip(attributes[::2], attributes[1::2], strict=True))
        while match := _ATTRIBUTE.match(text, place):
            where = match.span(2) if match[2] is not None else match.span(3)
            if match[1] in values:
                located[match[1]] = SourceText(values[match[1]], Span(self.source, *where))
            place = match.end()
        end = _TAG_END.match(text, place)
        self.open.append(_OpenElement(tag, start, located, end.end() if end else place))

    def characters(self, text: str) -> None:
        if self.open and not self.open[-1].children:
            self.open[-1].text.append(text)

    def end(self, tag: str) -> None:
        done = self.open.pop()
        tag_span = Span(self.source, done.start, done.start + 1 + len(done.tag))
        stop = done.text_end
        if stop is None:
            stop = max(self.offset(self.parser.CurrentByteIndex), done.content_start)
        element = XmlElement(
            done.tag,
            tag_span,
            done.attributes,
            tuple(done.children),
            SourceText(
                "".join(done.text).strip(),
                self._stripped_span(done.content_start, stop) or tag_span,
            ),
            self.diagnostics,
        )
        if self.open:
            self.open[-1].children.append(element)
        else:
            self.root = element

    def _stripped_span(self, start: int, end: int) -> Span | None:
        """Return the span without blanks around it; None if it has only blanks."""
        text = self.source.text[start:end]
        inner = text.strip()
        if not inner:
            return None
        first = start + text.find(inner)
        return Span(self.source, first, first + len(inner))


def parse_xml(source: Source, diagnostics: Diagnostics) -> XmlElement | None:
    """Parse a document into its root element; None, with an error, for another text.

    Errors of its elements, such as an attribute that is not a number, go to `diagnostics` as well.

    No entities are declared or fetched: a document type is refused before its first declaration is
    read.
    """
    builder = _ElementBuilder(source, diagnostics)
    if not source.text.strip():
        diagnostics.error("this file is empty", Span(source, 0, 1), "a model is an XML document")
        return None
    try:
        builder.parser.Parse(builder.data, True)
    except _ParsingStopped as refused:
        start = builder.offset(refused.byte)
        diagnostics.error(refused.message, Span(source, start, start + 1), refused.hint)
        return None
    except expat.ExpatError as failure:
        start = min(builder.offset(builder.parser.ErrorByteIndex), max(len(source.text) - 1, 0))
        here = builder.open[-1] if builder.open else None
        line = "" if here is None else f"line {source.line_and_column(here.start)[0]}"
        hint = f"the innermost open element is `<{here.tag}>` of {line}" if here else ""
        reason = expat.ErrorString(failure.code) or "unknown reason"
        diagnostics.error(f"this is not XML: {reason}", Span(source, start, start + 1), hint)
        return None
    return builder.root


_NUMBER = re.compile(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?")
_WORD = re.compile(r"[^\s]+")
_INFINITE_VALUES = {"inf": inf, "+inf": inf, "-inf": -inf}


def parse_numbers(
    source_text: SourceText,
    diagnostics: Diagnostics,
    min_count: int,
    max_count: int | None = None,
    *,
    allow_infinite: bool = False,
) -> tuple[float, ...] | None:
    """Parse the numbers of a text; None, with an error, if they or their count are wrong.

    Args:
        source_text: the text; blanks stand between the numbers.
        diagnostics: collects errors.
        min_count: smallest number of numbers.
        max_count: largest; None for `min_count`.
        allow_infinite: accept `Inf`.
    """
    max_count = min_count if max_count is None else max_count
    count = f"{min_count}" if min_count == max_count else f"{min_count} to {max_count}"
    values: list[float] = []
    for match in _WORD.finditer(source_text.text):
        word = match[0]
        if allow_infinite and word.lower() in _INFINITE_VALUES:
            values.append(_INFINITE_VALUES[word.lower()])
            continue
        if not _NUMBER.fullmatch(word):
            diagnostics.error(
                f"`{shorten(word)}` is not a number",
                _word_span(source_text, match),
                "one number stands here" if count == "1" else f"{count} numbers stand here",
            )
            return None
        values.append(float(word))
        if abs(values[-1]) > MAX_MODEL_NUMBER:
            diagnostics.error(
                f"`{shorten(word)}` is too large",
                _word_span(source_text, match),
                f"a number is at most {MAX_MODEL_NUMBER:.0e}",
            )
            return None
    if not min_count <= len(values) <= max_count:
        has = "1 number" if len(values) == 1 else f"{len(values)} numbers"
        diagnostics.error(f"{has} instead of {count}", source_text.span)
        return None
    return tuple(values)


def _word_span(source_text: SourceText, match: re.Match[str]) -> Span:
    """The place of a word; the whole text where entities keep the two apart."""
    span = source_text.span
    start = span.start + match.start()
    part = Span(span.source, start, start + len(match[0]))
    return part if part.text == match[0] else span


_XYZ = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


def add_element(parent: Element, tag: str, text: str | None = None, **attributes: str) -> Element:
    """Append a new element to `parent`."""
    element = SubElement(parent, tag, attributes)
    element.text = text
    return element


def format_numbers(values: ArrayLike) -> str:
    """Format numbers, separated by blanks, so that reading returns the same numbers."""
    listed: list[float] = np.atleast_1d(np.asarray(values, dtype=float)).ravel().tolist()
    return " ".join(_format_number(value) for value in listed)


def _format_number(value: float) -> str:
    return str(int(value)) if value.is_integer() and abs(value) < 1e15 else repr(value)


def format_document(root: Element, comments: Iterable[str]) -> str:
    """Format a document, one element a line, with comments at the head of its root element.

    Bodies are nested as deep as a chain is long, so the function is not recursive.
    """
    # Two hyphens would end a comment.
    notes = [f"  <!-- {comment.replace('--', '- -')} -->" for comment in comments]
    lines = ['<?xml version="1.0" encoding="utf-8"?>']
    waiting: list[tuple[Element | None, str]] = [(root, "")]
    while waiting:
        element, text = waiting.pop()
        if element is None:
            lines.append(text)
            continue
        attributes = "".join(f" {key}={quoteattr(value)}" for key, value in element.items())
        start, end = f"{text}<{element.tag}{attributes}", f"</{element.tag}>"
        if len(element):
            lines.append(f"{start}>")
            waiting.append((None, text + end))
            waiting += [(child, f"{text}  ") for child in reversed(element)]
        else:
            inside = escape(element.text or "")
            lines.append(f"{start}>{inside}{end}" if inside else f"{start}/>")
        if element is root:
            lines += notes
    return "\n".join(lines) + "\n"


def nesting_depth(document: str) -> int:
    """Return the largest depth of elements of a document of `format_document`."""
    return max((len(line) - len(line.lstrip())) // 2 + 1 for line in document.splitlines())


def body_fixed_angles(matrix: Array) -> Array:
    """Angles about x, then the turned y, then the turned z: Rx Ry Rz, shape (3,) [rad]."""
    return RotationSequence(_XYZ[::-1]).angles(matrix)[::-1]


def roll_pitch_yaw(matrix: Array) -> Array:
    """Angles about fixed x, then y, then z: Rz Ry Rx, shape (3,) [rad]."""
    return RotationSequence(_XYZ).angles(matrix)
