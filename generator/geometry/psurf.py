"""Reading psurfs (`.pss`), the surfaces of Jack.

    file   := block+
    block  := vertex* ";;" face* ";;"
    vertex := NUMBER NUMBER NUMBER text?
    face   := INDEX INDEX INDEX+ text? ";" text?

Each of these and each `;;` is a line. Vertices are in cm and counted from 1 in every block; faces
run counter-clockwise seen from outside. Blank lines and text after the numbers say nothing; the
text of a face does not begin as a number does, or it would be a corner that cannot be read.

Writing psurfs: the inverse of reading them.
"""

import re
from contextlib import suppress
from dataclasses import dataclass, field
from fractions import Fraction
from pathlib import Path

import numpy as np

from generator.diagnostics import EnoughFaults, Fault, Findings, InputError, Source, Span, shorten
from generator.figure_file.lexer import LONGEST_WORD
from generator.geometry.surface import LEAST, Surface, SurfaceText
from generator.text_io import read_text, unified, write_whole
from generator.units import Dimension, bare_factor, converted, decimal_of

CENTIMETRE = bare_factor(Dimension.LENGTH)

_END = ";;"
_WORD = re.compile(r"[^\s;]+")
_NUMBER = re.compile(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]{1,6})?")
_PLAIN_VERTEX = re.compile(
    rf"\s*({_NUMBER.pattern})\s+({_NUMBER.pattern})\s+({_NUMBER.pattern})(?!\S)"
)
_INDEX = re.compile(r"[+-]?[0-9]+")
_PLAIN_FACE = re.compile(r"[0-9 \t]+")
_LIKE_NUMBER = re.compile(r"[+-]?\.?[0-9]")
_LONGEST_INDEX = 18

MOST_LINES = 500_000
"""Lines of the longest text that is read; it takes some seconds."""


@dataclass(frozen=True)
class PsurfReading:
    """What came of reading a psurf; `surface` is None when `faults` holds an error."""

    surface: Surface | None
    faults: tuple[Fault, ...]


def read_psurf(path: str | Path, unit: Fraction = CENTIMETRE) -> Surface:
    """The surface in a psurf file, whose lengths are in `unit` [m].

    Raises InputError, which holds all faults, when anything is wrong with the file.
    """
    reading = examine_psurf(path, unit)
    if reading.surface is None:
        raise InputError(reading.faults)
    return reading.surface


def examine_psurf(path: str | Path, unit: Fraction = CENTIMETRE) -> PsurfReading:
    """The surface in a psurf file, with all faults; bad input raises nothing."""
    source, fault = read_text(Path(path), str(path))
    if fault is not None:
        return PsurfReading(None, (fault,))
    return parse_psurf(source.text, source.name, unit)


def parse_psurf(text: str, name: str = "<text>", unit: Fraction = CENTIMETRE) -> PsurfReading:
    """The surface that `text` describes, with all faults; `name` is what they call the text."""
    findings = Findings()
    parser = _Parser(Source(name, unified(text)), unit, findings)
    with suppress(EnoughFaults):
        if not _is_too_long(parser.source, findings):
            parser.file()
    surface = None if findings.has_errors else parser.surface()
    return PsurfReading(surface, findings.in_order())


def _is_too_long(source: Source, findings: Findings) -> bool:
    lines = source.text.count("\n") + 1
    if lines <= MOST_LINES:
        return False
    hint = f"at most {MOST_LINES:,} are read; save larger surfaces as .ply or .stl"
    findings.error(f"this psurf has {lines:,} lines", Span(source, 0, 1), hint)
    return True


@dataclass
class _Parser:
    """Walks over the lines; what was read so far stands in its lists."""

    source: Source
    unit: Fraction
    findings: Findings
    vertices: list[tuple[float, ...]] = field(default_factory=list[tuple[float, ...]])
    corners: list[int] = field(default_factory=list[int])
    starts: list[int] = field(default_factory=lambda: [0])
    places: list[tuple[int, int]] = field(default_factory=list[tuple[int, int]])
    blocks: list[int] = field(default_factory=list[int])
    faces_seen: int = 0

    def file(self) -> None:
        """Read all lines; faults go to the findings."""
        in_faces, start, last = True, 0, Span(self.source, 0, 0)
        ended = True
        for line in self.source.text.split("\n"):
            here = Span(self.source, start, start + len(line))
            start += len(line) + 1
            text = line.strip()
            if not text:
                continue
            if ended:
                in_faces, ended = False, False
                self.blocks.append(len(self.vertices))
            last = _without_blanks(here)
            if text.startswith(_END):
                in_faces, ended = not in_faces, in_faces
            elif _END in text:
                self._no_line_of_its_own(last, line)
                in_faces, ended = not in_faces, in_faces
            elif in_faces:
                self._face(line, here.start)
            elif text.endswith(";"):
                self.findings.error(
                    "the vertices end without `;;`",
                    last,
                    "this is a face; a line `;;` stands before the first one",
                )
                in_faces = True
                self._face(line, here.start)
            else:
                self._vertex(line, here.start)
        if not ended:
            what = "faces" if in_faces else "vertices"
            self.findings.error(
                f"the {what} end without `;;`", last, "a line `;;` stands after the last one"
            )
        if not self.faces_seen:
            end = last if self.blocks else Span(self.source, 0, min(1, len(self.source.text)))
            self.findings.error(
                "there are no faces in this file", end, "vertices, `;;`, faces, and `;;` again"
            )

    def surface(self) -> Surface:
        """What was read, as a surface."""
        text = SurfaceText(
            self.source,
            np.array(self.places, dtype=np.int64).reshape(-1, 2),
            np.array(self.blocks, dtype=np.int64),
        )
        return Surface(
            np.array(self.vertices, dtype=float).reshape(-1, 3),
            np.array(self.corners, dtype=np.int64),
            np.array(self.starts, dtype=np.int64),
            self.source.name,
            text,
        )

    def _no_line_of_its_own(self, place: Span, line: str) -> None:
        at = place.start + line.strip().index(_END)
        self.findings.error(
            "`;;` stands behind something else",
            Span(self.source, at, at + len(_END)),
            "give it a line of its own",
        )

    def _words(self, text: str, start: int) -> list[Span]:
        return [
            Span(self.source, start + match.start(), start + match.end())
            for match in _WORD.finditer(text)
        ]

    def _vertex(self, line: str, start: int) -> None:
        """`NUMBER NUMBER NUMBER text?`."""
        plain = _PLAIN_VERTEX.match(line) if len(line) <= LONGEST_WORD else None
        if plain is not None:
            with suppress(OverflowError):
                x, y, z = (converted(number, self.unit) for number in plain.groups())
                self.vertices.append((x, y, z))
                return
        words = self._words(line, start)[:3]
        numbers = [self._coordinate(word) for word in words]
        if len(numbers) < 3 and None not in numbers:
            self.findings.error(
                f"a vertex has three coordinates, not {len(numbers)}", words[0].to(words[-1])
            )
        # A vertex that cannot be read still counts, or the faces would be told wrong as well.
        point = tuple(number or 0.0 for number in numbers)
        self.vertices.append((*point, 0.0, 0.0, 0.0)[:3])

    def _coordinate(self, word: Span) -> float | None:
        if word.end - word.start > LONGEST_WORD or not _NUMBER.fullmatch(word.text):
            self.findings.error(
                f"`{shorten(word.text)}` is not a number",
                word,
                "a vertex is three numbers without units",
            )
            return None
        try:
            return converted(word.text, self.unit)
        except OverflowError:
            self.findings.error(
                f"`{shorten(word.text)}` is too large", word, "a number must be finite"
            )
            return None

    def _face(self, line: str, start: int) -> None:
        """`INDEX INDEX INDEX+ text? ";" text?`."""
        self.faces_seen += 1
        head, mark, tail = line.partition(";")
        place = _without_blanks(Span(self.source, start, start + len(head) + len(mark)))
        if not mark:
            self.findings.error("this face has no `;` at its end", place, "as in `1 2 3;`")
        elif ";" in tail and _WORD.search(tail) and _INDEX.fullmatch(tail.split()[0]):
            self.findings.error(
                "a second face in one line",
                _without_blanks(Span(self.source, place.end, start + len(line))),
            )
        base, known = self.blocks[-1], len(self.vertices) - self.blocks[-1]
        face = self._plain(head) if _PLAIN_FACE.fullmatch(head) else None
        if face is None or not all(0 < index <= known for index in face):
            face = self._indices(head, start, known)
        if face is None:
            return
        if len(face) < LEAST:
            count = "1 vertex" if len(face) == 1 else f"{len(face) or 'no'} vertices"
            self.findings.error(f"this face has {count}, not three or more", place)
        elif len(set(face)) < len(face):
            twice = next(index for k, index in enumerate(face) if index in face[:k])
            self.findings.error(
                f"vertex {twice} stands twice in this face", place, "a face passes a vertex once"
            )
        else:
            self.corners.extend(base + index - 1 for index in face)
            self.starts.append(len(self.corners))
            self.places.append((place.start, place.end))

    @staticmethod
    def _plain(head: str) -> list[int] | None:
        words = head.split()
        return None if max(map(len, words), default=0) > _LONGEST_INDEX else [int(w) for w in words]

    def _indices(self, head: str, start: int, known: int) -> list[int] | None:
        """The numbers of a face with something odd in it; None, with the faults noted."""
        face: list[int] = []
        sound = True
        words = self._words(head, start)
        numbers = [bool(_INDEX.fullmatch(word.text)) for word in words]
        # Text after the last number says nothing; text before it may have been one.
        count = len(numbers) - numbers[::-1].index(True) if True in numbers else len(numbers)
        while count < len(words) and _LIKE_NUMBER.match(words[count].text):
            count += 1
        for word in words[:count]:
            if not _INDEX.fullmatch(word.text):
                sound = False
                self.findings.error(
                    f"`{shorten(word.text)}` is not the number of a vertex",
                    word,
                    "a face is whole numbers and a `;`, as in `1 2 3;`",
                )
                continue
            short = len(word.text) <= _LONGEST_INDEX
            if not short or not 0 < int(word.text) <= known:
                sound = False
                vertices = "1 vertex" if known == 1 else f"{known or 'no'} vertices"
                self.findings.error(
                    f"there is no vertex {shorten(word.text)}",
                    word,
                    f"this block has {vertices}, counted from 1",
                )
                continue
            face.append(int(word.text))
        return face if sound else None


def _without_blanks(span: Span) -> Span:
    text = span.text
    start = span.start + len(text) - len(text.lstrip())
    return Span(span.source, start, max(start, span.start + len(text.rstrip())))


_USUAL_DIGITS = 12


def format_psurf(surface: Surface, unit: Fraction = CENTIMETRE) -> str:
    """The text of a psurf of one block; reading it gives the same vertices, to the last bit."""
    lines = [
        " ".join(_decimal(value, unit) for value in vertex) for vertex in surface.vertices.tolist()
    ]
    lines.append(";;")
    lines += [" ".join(str(corner + 1) for corner in face) + ";" for face in surface.faces]
    lines.append(";;")
    return "\n".join(lines) + "\n"


def write_psurf(surface: Surface, path: str | Path) -> None:
    """Write a psurf file, whole or not at all. Raises OSError when it cannot be written."""
    write_whole(Path(path), format_psurf(surface))


def _decimal(value: float, unit: Fraction) -> str:
    """A number that reads back as `value`; the short one that people wrote, in nearly all cases."""
    text = f"{value / float(unit):.{_USUAL_DIGITS}g}"
    if text != "inf" and converted(text, unit) == value:
        return text
    return decimal_of(value, unit)
