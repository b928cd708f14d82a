"""Results of commands as data and as text."""

import json
from collections import namedtuple
from dataclasses import dataclass, field
from enum import Enum
from math import isfinite
from pathlib import Path
from typing import Any

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from generator.cli import answer


class Colour(Enum):
    RED = "red"


Pair = namedtuple("Pair", "one other")


@dataclass(frozen=True)
class Part:
    inner: Any


@dataclass(frozen=True)
class Whole(answer.CommandResult):
    mass_kg: float
    part: Part | None
    extra: int | None = field(metadata=answer.OMITTED_IF_NONE)
    others: dict = field(metadata=answer.MERGED)
    secret: object = field(metadata=answer.HIDDEN)


leaves = st.none() | st.booleans() | st.integers() | st.floats() | st.text() | st.just(Colour.RED)
values = st.recursive(
    leaves | st.lists(st.floats(), max_size=4).map(np.array) | st.just(Path("a/b")),
    lambda inner: (
        st.lists(inner, max_size=3)
        | st.dictionaries(st.text(), inner, max_size=3)
        | inner.map(Part)
        | st.tuples(inner, inner).map(lambda both: Pair(*both))
    ),
    max_leaves=12,
)


@given(values)
def test_every_value_becomes_json_that_reads_back(value: object):
    data = answer.to_json(value)
    assert json.loads(answer.json_text(value)) == data
    assert answer.to_json(data) == data


@given(st.floats())
def test_a_number_is_itself_or_null(number: float):
    expected = number if isfinite(number) else None
    assert answer.to_json(number) == expected
    assert answer.to_json(np.array([number])) == [expected]
    assert answer.to_json(np.float64(number)) == expected


def test_the_fields_are_the_keys_in_their_order():
    whole = Whole(2.0, Part(Pair(Colour.RED, Path("a"))), None, {"b": 1, "a": 2}, object())
    assert list(answer.to_json(whole).items()) == [
        ("mass_kg", 2.0),
        ("part", {"inner": {"one": "red", "other": "a"}}),
        ("b", 1),
        ("a", 2),
    ]
    assert answer.to_json(Whole(2.0, None, 3, {}, None)) == {
        "mass_kg": 2.0,
        "part": None,
        "extra": 3,
    }


def test_a_failure_decides_the_exit_code():
    assert answer.CommandResult().code is answer.ExitCode.SUCCESS
    assert answer.CommandResult(failure="it fell over").code is answer.ExitCode.RUN_FAILED


cells = st.text("abc ", max_size=5)


@given(st.lists(st.lists(cells, min_size=1, max_size=4), min_size=1), st.integers(0, 4))
def test_the_columns_of_a_table_are_aligned(rows: list[list[str]], left: int):
    lines = str(answer.Table(rows, left)).split("\n")
    assert len(lines) == len(rows)
    assert all(line == line.rstrip() for line in lines)
    widths = [max((len(row[k]) for row in rows if k < len(row)), default=0) for k in range(4)]
    starts = [sum(widths[:k]) + 2 * k for k in range(4)]
    for line, row in zip(lines, rows, strict=True):
        for k, cell in enumerate(row):
            place = line[starts[k] : starts[k] + widths[k]].ljust(widths[k])
            assert place == (cell.ljust(widths[k]) if k < left else cell.rjust(widths[k]))


def test_empty_paragraphs_are_left_out():
    assert (
        answer.format_paragraphs(["a", "", answer.Table([]), answer.Table([["b", "c"]])])
        == "a\n\nb  c"
    )
