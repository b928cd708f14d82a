"""Writing psurfs: the inverse of reading them."""

from fractions import Fraction
from pathlib import Path

from generator.geometry.psurf import CENTIMETRE
from generator.geometry.surface import Surface
from generator.reader.units import converted, decimal_of
from generator.whole_file import write_whole

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
