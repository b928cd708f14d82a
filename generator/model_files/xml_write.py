"""Elements of XML: numbers with all their digits, and a text that people can read."""

from collections.abc import Iterable
from xml.etree.ElementTree import Element, SubElement
from xml.sax.saxutils import escape, quoteattr

import numpy as np
from numpy.typing import ArrayLike

from generator.rotations import Array, RotationSequence

__all__ = [
    "Element",
    "add_element",
    "body_fixed_angles",
    "format_document",
    "format_numbers",
    "roll_pitch_yaw",
]

_XYZ = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


def add_element(parent: Element, tag: str, text: str | None = None, **attributes: str) -> Element:
    """A new element at the end of `parent`."""
    element = SubElement(parent, tag, attributes)
    element.text = text
    return element


def format_numbers(values: ArrayLike) -> str:
    """Numbers with blanks between them, so that reading gives the same numbers."""
    listed: list[float] = np.atleast_1d(np.asarray(values, dtype=float)).ravel().tolist()
    return " ".join(_format_number(value) for value in listed)


def _format_number(value: float) -> str:
    return str(int(value)) if value.is_integer() and abs(value) < 1e15 else repr(value)


def format_document(root: Element, comments: Iterable[str]) -> str:
    """The text of a file, an element a line, with comments at the head of its root element.

    Bodies stand within bodies as deep as a chain is long: no function here calls itself.
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
        given = "".join(f" {key}={quoteattr(value)}" for key, value in element.items())
        start, end = f"{text}<{element.tag}{given}", f"</{element.tag}>"
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


def body_fixed_angles(matrix: Array) -> Array:
    """Angles about x, then the turned y, then the turned z: Rx Ry Rz, shape (3,) [rad]."""
    return RotationSequence(_XYZ[::-1]).angles(matrix)[::-1]


def roll_pitch_yaw(matrix: Array) -> Array:
    """Angles about fixed x, then y, then z: Rz Ry Rx, shape (3,) [rad]."""
    return RotationSequence(_XYZ).angles(matrix)
