"""Psurf files (`.pss`), the surfaces of Jack.

    file   := block+
    block  := vertex* ";;" face* ";;"
    vertex := NUMBER NUMBER NUMBER text?
    face   := INDEX INDEX INDEX+ text? ";" text?

Each of these and each `;;` is a line. Vertices are in cm and counted from 1 in every block; faces
run counter-clockwise seen from outside. Blank lines and text after the numbers are ignored; the
text of a face must not begin like a number.
"""

import re
from contextlib import suppress
from dataclasses import dataclass, field
from fractions import Fraction
from functools import lru_cache, partial
from math import isfinite
from pathlib import Path

import numpy as np

from generator.diagnostics import (
    Diagnostics,
    Parsed,
    Source,
    Span,
    shorten,
)
from generator.figure_file.lexer import MAX_WORD_LENGTH
from generator.file_kind import FileKind
from generator.geometry.surface import MIN_FACE_CORNERS, Surface, SurfaceText
from generator.text_io import parse_source, write_atomic
from generator.units import Dimension, convert_to_si, default_unit_factor, shortest_decimal

CENTIMETRE = default_unit_factor(Dimension.LENGTH)

_BLOCK_END = ";;"
_WORD = re.compile(r"[^\s;]+")
_NUMBER = re.compile(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]{1,6})?")
_PLAIN_VERTEX = re.compile(
    rf"\s*({_NUMBER.pattern})\s+({_NUMBER.pattern})\s+({_NUMBER.pattern})(?!\S)"
)
_INDEX = re.compile(r"[+-]?[0-9]+")
_PLAIN_FACE = re.compile(r"[0-9 \t]+")
_NUMBER_START = re.compile(r"[+-]?\.?[0-9]")
_MAX_INDEX_DIGITS = 18

MAX_LINES = 500_000
"""Lines of the longest file that is read, which takes some seconds."""


def _parse_psurf(
    source: Source, diagnostics: Diagnostics, unit: Fraction = CENTIMETRE
) -> Surface | None:
    """Parse a psurf with lengths in `unit` [m]."""
    parsed = _parse_once(source, unit)
    diagnostics.extend(Diagnostics(list(parsed.diagnostics)))
    return parsed.value


PSURF_FILE = FileKind("psurf", ".pss", _parse_psurf)


@lru_cache(maxsize=32)
def _parse_once(source: Source, unit: Fraction) -> Parsed[Surface]:
    """Parse a text; contact, mass, soundness and drawing read the same files of a figure again."""
    return parse_source(source, partial(_parse_lines, unit=unit))


def _parse_lines(source: Source, diagnostics: Diagnostics, unit: Fraction) -> Surface | None:
    if (lines := source.text.count("\n") + 1) > MAX_LINES:
        hint = f"at most {MAX_LINES:,} are read; save larger surfaces as .ply or .stl"
        diagnostics.error(f"this psurf has {lines:,} lines", Span(source, 0, 1), hint)
        return None
    parser = _Parser(source, unit, diagnostics)
    parser.parse_lines()
    return None if diagnostics.has_errors else parser.build_surface()


@dataclass
class _Parser:
    """Parser of the lines of a psurf, with the vertices and faces read so far."""

    source: Source
    unit: Fraction
    diagnostics: Diagnostics
    vertices: list[tuple[float, ...]] = field(default_factory=list[tuple[float, ...]])
    corners: list[int] = field(default_factory=list[int])
    starts: list[int] = field(default_factory=lambda: [0])
    face_spans: list[tuple[int, int]] = field(default_factory=list[tuple[int, int]])
    blocks: list[int] = field(default_factory=list[int])
    faces_seen: int = 0

    def parse_lines(self) -> None:
        """Parse all lines; errors become diagnostics."""
        in_faces, ended = True, True
        start, following, last = 0, 0, (0, "")
        for line in self.source.text.split("\n"):
            start, following = following, following + len(line) + 1
            text = line.strip()
            if not text:
                continue
            if ended:
                in_faces, ended = False, False
                self.blocks.append(len(self.vertices))
            last = start, line
            if text.startswith(_BLOCK_END):
                in_faces, ended = not in_faces, in_faces
            elif _BLOCK_END in text:
                self._report_separator_in_line(line, start)
                in_faces, ended = not in_faces, in_faces
            elif in_faces:
                self._parse_face(line, start)
            elif text.endswith(";"):
                self.diagnostics.error(
                    "the vertices end without `;;`",
                    self._stripped(line, start),
                    "this is a face; put a line `;;` before the first face",
                )
                in_faces = True
                self._parse_face(line, start)
            else:
                self._parse_vertex(line, start)
        start, line = last
        end = self._stripped(line, start)
        if not ended:
            what = "faces" if in_faces else "vertices"
            self.diagnostics.error(
                f"the {what} end without `;;`", end, "put a line `;;` after the last one"
            )
        if not self.faces_seen:
            if not self.blocks:
                end = Span(self.source, 0, min(1, len(self.source.text)))
            self.diagnostics.error(
                "there are no faces in this file", end, "vertices, `;;`, faces, and `;;` again"
            )

    def build_surface(self) -> Surface:
        """Return the surface that was read."""
        text = SurfaceText(
            self.source,
            np.array(self.face_spans, dtype=np.int64).reshape(-1, 2),
            np.array(self.blocks, dtype=np.int64),
        )
        return Surface(
            np.array(self.vertices, dtype=float).reshape(-1, 3),
            np.array(self.corners, dtype=np.int64),
            np.array(self.starts, dtype=np.int64),
            self.source.name,
            text,
        )

    def _stripped(self, text: str, start: int) -> Span:
        """Return the place of a text that begins at `start`, without the blanks around it."""
        first = start + len(text) - len(text.lstrip())
        return Span(self.source, first, max(first, start + len(text.rstrip())))

    def _report_separator_in_line(self, line: str, start: int) -> None:
        at = start + line.index(_BLOCK_END)
        self.diagnostics.error(
            "`;;` is not alone on its line",
            Span(self.source, at, at + len(_BLOCK_END)),
            "give it a line of its own",
        )

    def _words(self, text: str, start: int) -> list[Span]:
        return [
            Span(self.source, start + match.start(), start + match.end())
            for match in _WORD.finditer(text)
        ]

    def _parse_vertex(self, line: str, start: int) -> None:
        """`NUMBER NUMBER NUMBER text?`."""
        plain = _PLAIN_VERTEX.match(line) if len(line) <= MAX_WORD_LENGTH else None
        if plain is not None:
            with suppress(OverflowError):
                x, y, z = (convert_to_si(number, self.unit) for number in plain.groups())
                self.vertices.append((x, y, z))
                return
        words = self._words(line, start)[:3]
        numbers = [self._parse_coordinate(word) for word in words]
        if len(numbers) < 3 and None not in numbers:
            self.diagnostics.error(
                f"a vertex has three coordinates, not {len(numbers)}", words[0].extend_to(words[-1])
            )
        # An invalid vertex still counts, or the faces would be reported as well.
        point = tuple(number or 0.0 for number in numbers)
        self.vertices.append((*point, 0.0, 0.0, 0.0)[:3])

    def _parse_coordinate(self, word: Span) -> float | None:
        if word.end - word.start > MAX_WORD_LENGTH or not _NUMBER.fullmatch(word.text):
            self.diagnostics.error(
                f"`{shorten(word.text)}` is not a number",
                word,
                "a vertex is three numbers without units",
            )
            return None
        try:
            return convert_to_si(word.text, self.unit)
        except OverflowError:
            self.diagnostics.error(
                f"`{shorten(word.text)}` is too large", word, "a number must be finite"
            )
            return None

    def _parse_face(self, line: str, start: int) -> None:
        """`INDEX INDEX INDEX+ text? ";" text?`."""
        self.faces_seen += 1
        head, mark, tail = line.partition(";")
        if not mark:
            self.diagnostics.error(
                "this face has no `;` at its end", self._stripped(head, start), "as in `1 2 3;`"
            )
        elif ";" in tail and _WORD.search(tail) and _INDEX.fullmatch(tail.split()[0]):
            self.diagnostics.error(
                "a second face in one line",
                self._stripped(tail, start + len(head) + len(mark)),
            )
        base, known = self.blocks[-1], len(self.vertices) - self.blocks[-1]
        face = self._plain_indices(head) if _PLAIN_FACE.fullmatch(head) else None
        if face is None or not all(0 < index <= known for index in face):
            face = self._parse_indices(head, start, known)
        if face is None:
            return
        if len(face) < MIN_FACE_CORNERS:
            count = "1 vertex" if len(face) == 1 else f"{len(face) or 'no'} vertices"
            self.diagnostics.error(
                f"this face has {count}, not three or more", self._stripped(head + mark, start)
            )
        elif len(set(face)) < len(face):
            repeated = next(index for k, index in enumerate(face) if index in face[:k])
            self.diagnostics.error(
                f"vertex {repeated} is twice in this face",
                self._stripped(head + mark, start),
                "list each vertex of a face once",
            )
        else:
            self.corners.extend(base + index - 1 for index in face)
            self.starts.append(len(self.corners))
            first = start + len(head) - len(head.lstrip())
            self.face_spans.append((first, start + len(head) + len(mark)))

    @staticmethod
    def _plain_indices(head: str) -> list[int] | None:
        words = head.split()
        return (
            None if max(map(len, words), default=0) > _MAX_INDEX_DIGITS else [int(w) for w in words]
        )

    def _parse_indices(self, head: str, start: int, known: int) -> list[int] | None:
        """Return the vertex numbers of an irregular face; None after reporting errors."""
        face: list[int] = []
        valid = True
        words = self._words(head, start)
        numbers = [bool(_INDEX.fullmatch(word.text)) for word in words]
        # Text after the last number is ignored; text before it may be a misspelt number.
        count = len(numbers) - numbers[::-1].index(True) if True in numbers else len(numbers)
        while count < len(words) and _NUMBER_START.match(words[count].text):
            count += 1
        for word in words[:count]:
            if not _INDEX.fullmatch(word.text):
                valid = False
                self.diagnostics.error(
                    f"`{shorten(word.text)}` is not the number of a vertex",
                    word,
                    "a face is whole numbers and a `;`, as in `1 2 3;`",
                )
                continue
            short = len(word.text) <= _MAX_INDEX_DIGITS
            if not short or not 0 < int(word.text) <= known:
                valid = False
                vertices = "1 vertex" if known == 1 else f"{known or 'no'} vertices"
                self.diagnostics.error(
                    f"there is no vertex {shorten(word.text)}",
                    word,
                    f"this block has {vertices}, counted from 1",
                )
                continue
            face.append(int(word.text))
        return face if valid else None


_USUAL_DIGITS = (12, 15, 16, 17)
"""Numbers of digits of a coordinate that are tried first."""


def format_psurf(surface: Surface, unit: Fraction = CENTIMETRE) -> str:
    """Return the text of a psurf of one block; reading it gives exactly the same vertices."""
    values = surface.vertices.ravel().tolist()
    quotients = (surface.vertices.ravel() / float(unit)).tolist()
    numbers = [_format_coordinate(*pair, unit) for pair in zip(values, quotients, strict=True)]
    lines = [" ".join(numbers[k : k + 3]) for k in range(0, len(numbers), 3)]
    lines.append(";;")
    lines += [" ".join(str(corner + 1) for corner in face) + ";" for face in surface.faces]
    lines.append(";;")
    return "\n".join(lines) + "\n"


def write_psurf(surface: Surface, path: str | Path) -> None:
    """Write a psurf file atomically. Raises OSError when it cannot be written."""
    write_atomic(Path(path), format_psurf(surface))


def _format_coordinate(value: float, quotient: float, unit: Fraction) -> str:
    """Return a number that reads back as `value`, the shortest one in nearly all cases."""
    for digits in _USUAL_DIGITS if isfinite(quotient) else ():
        text = f"{quotient:.{digits}g}"
        if convert_to_si(text, unit) == value:
            return text
    return shortest_decimal(value, unit)
