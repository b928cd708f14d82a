"""Damaged figure files: no traceback, little work, and what is accepted is written back."""

import re

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from generator.diagnostics import select_errors
from generator.figure_file import FIGURE_FILE, simulation_diagnostics
from generator.figure_file.write import write_figure
from tests.work import counted_calls

OTHER_FIELDS = """
figure one_arm {
  attribute red { rgb = (1,0.37,0); shade = "flat"; }
  segment floor { mass = -1g; site top { } }
  segment arm {
    attribute = (red);
    mass = 2.5kg;
    site near->location = xyz(90deg,0,0) * trans(0,1cm,0);
    site near->localmoment = (1 N m,0,0);
    site CM->location = trans(5cm,0,0);
  }
  joint elbow {
    connect floor.top to arm.near;
    type = R(0,0,-1)*T(0,1,0);
    llimit = (-10deg,0); ulimit = (1rad,1ft); damp = (800000,1); rest = (5deg,2cm);
  }
  root = floor.top;
}
"""
BASES = [FIGURE_FILE.shipped()[name].read_text("utf-8") for name in ("pendulum", "fourbar")]
BASES.append(OTHER_FIELDS)

_TOKENS = re.compile(r"\w+|->|[^\w\s]|\s+")

WORDS = """
{ } ( ) ; , = * . -> / " # /* */ figure segment site joint attribute root connect to type location
mass inertia psurf displacement stiff rest damp llimit ulimit globalforce xyz trans R T R(0,0,1)
R(1,0,0) 0 1 -1 1e999 1e-999 nan inf 90 45deg 2cm 3g kg N rad floor CM proximal é
"""

SCRAPS = st.one_of(
    st.sampled_from([*WORDS.split(), " ", "\t", "\n", "\r", "\r\n", "\0", "\ufeff"]),
    st.text(max_size=5),
)


@st.composite
def damaged(draw):
    """A figure file with one to five wounds, each of a character, a word, a line or a stretch."""
    text = draw(st.sampled_from(BASES))
    for _ in range(draw(st.integers(1, 5))):
        text = draw(st.sampled_from([_character, _word, _line, _stretch]))(draw, text)
    return text


def _character(draw, text):
    place = draw(st.integers(0, len(text)))
    return _wound(draw, text, place, min(len(text), place + 1))


def _word(draw, text):
    spans = [match.span() for match in _TOKENS.finditer(text)]
    start, end = draw(st.sampled_from(spans)) if spans else (0, 0)
    return _wound(draw, text, start, end)


def _line(draw, text):
    lines = text.splitlines(keepends=True) or [""]
    index = draw(st.integers(0, len(lines) - 1))
    start = sum(map(len, lines[:index]))
    return _wound(draw, text, start, start + len(lines[index]))


def _stretch(draw, text):
    start = draw(st.integers(0, len(text)))
    return _wound(draw, text, start, min(len(text), start + draw(st.integers(0, 200))))


def _wound(draw, text, start, end):
    """Delete, double, replace, move or push aside what stands from `start` to `end`."""
    piece, before, after = text[start:end], text[:start], text[end:]
    match draw(st.sampled_from(["delete", "double", "replace", "insert", "move"])):
        case "delete":
            return before + after
        case "double":
            return before + piece + piece + after
        case "replace":
            return before + draw(SCRAPS) + after
        case "insert":
            return before + draw(SCRAPS) + piece + after
        case _:
            rest = before + after
            place = draw(st.integers(0, len(rest)))
            return rest[:place] + piece + rest[place:]


@pytest.mark.slow
@settings(max_examples=200, derandomize=True, deadline=None)
@given(text=damaged())
def test_a_damaged_file_is_told_or_read(text):
    reading, calls = counted_calls(lambda: FIGURE_FILE.parse_text(text))
    told = [str(fault) for fault in reading.diagnostics]
    assert calls < 10_000 + 100 * len(text)
    assert (reading.value is None) is bool(select_errors(reading.diagnostics))
    assert all(told)
    if reading.value is not None:
        again = FIGURE_FILE.parse_text(write_figure(reading.value))
        assert again.value == reading.value
        assert len(simulation_diagnostics(reading.value)) == len(
            simulation_diagnostics(again.value)
        )


def test_the_wounds_leave_some_files_whole_and_break_others():
    outcomes = set()

    @settings(max_examples=60, derandomize=True, deadline=None, database=None)
    @given(text=damaged())
    def look(text):
        outcomes.add(FIGURE_FILE.parse_text(text).value is None)

    look()
    assert outcomes == {True, False}
