"""Rows of a table: bounds, missing and unknown keys, and what is written is read."""

from dataclasses import dataclass
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from generator.diagnostics import Diagnostics, Source
from generator.toml_file.reader import TableReader, parse_document
from generator.toml_file.rows import (
    Choice,
    Flag,
    Integer,
    Interval,
    Names,
    Number,
    Numbers,
    Row,
    Sign,
    TableRows,
    Text,
    Vector3,
)
from springs import SphericalLaw

lengths = st.floats(-1e3, 1e3)
ROWS: dict[Row[Any], st.SearchStrategy[Any]] = {
    Text("source"): st.text(),
    Number("friction", 0.0, 10.0): st.floats(0.0, 10.0),
    Number("height_cm", -10.0, 10.0, " m"): st.floats(-10.0, 10.0),
    Integer("runs", 1, 10**6): st.integers(1, 10**6),
    Flag("floor"): st.booleans(),
    Vector3("point_m", 1e3): st.tuples(lengths, lengths, lengths),
    Vector3("angles_deg", 1e3): st.tuples(lengths, lengths, lengths),
    Numbers("offsets_deg", 1e3, count=2): st.tuples(lengths, lengths),
    Interval("limits_deg", 1e3): st.tuples(lengths, lengths).map(lambda ends: tuple(sorted(ends))),
    Sign("sense"): st.sampled_from((-1, 1)),
    Choice("law", tuple(SphericalLaw)): st.sampled_from(SphericalLaw),
    Choice("axis", ("x", "y")): st.sampled_from(("x", "y")),
    Names("joints"): st.lists(st.text(), min_size=1).map(tuple),
    Text("why", is_long=True): st.text(),
}


def reader(text: str) -> TableReader:
    source, diagnostics = Source("a.toml", text), Diagnostics()
    found = parse_document(source, "table", diagnostics)
    assert found is not None
    return found


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row.key)
@given(data=st.data())
def test_what_is_written_is_read(row: Row[Any], data: st.DataObject) -> None:
    value = data.draw(ROWS[row])
    table = reader(row.write(value))
    assert (row.read(table), table.diagnostics.entries) == (value, [])
    assert row.read(reader("other = 1")) is None


WHOLE = "without quotes and decimals"


@pytest.mark.parametrize(
    ("row", "text", "message", "hint"),
    [
        (Number("friction", 0.0, 10.0), "11", "`friction` must be from 0 to 10, not 11", ""),
        (Number("a", 0.0, 9.0, " s", "of b"), "-1", "`a` must be from 0 to 9 s, not -1", "of b"),
        (Number("step", 0.0, 9.0, is_positive=True), "0", "`step` must be above zero, not 0", ""),
        (Number("low_cm", 0.0, 1.0, " m"), "101", "`low_cm` must be from 0 to 1 m, not 1.01", ""),
        (Integer("runs", 1, 9), "10", "`runs` must be from 1 to 9", ""),
        (
            Integer("runs", 1, 9),
            "2.0",
            "`runs` must be a whole number",
            WHOLE,
        ),
        (
            Integer("runs", 0, 9),
            "true",
            "`runs` must be a whole number",
            WHOLE,
        ),
        (Flag("floor"), "1", "`floor` must be true or false", "without quotes"),
        (Vector3("x", 5.0, "at most 5 m"), "[0, -6, 0]", "this number is too large", "at most 5 m"),
        (Vector3("x", positive_error=("too flat", "in m")), "[1, 0, 1]", "too flat", "in m"),
        (Vector3("x"), "[1, 2]", "`x` has 2 instead of 3 numbers", ""),
        (Number("low_deg", is_positive=True), "-9", "`low_deg` must be above zero, not -9", ""),
        (Number("scale", 0.0, hint="why"), "-9", "`scale` must not be below zero", "why"),
        (Numbers("x", count=2, negative_error=("no", "why")), "[0, -1]", "no", "why"),
        (Interval("x"), "[2, 1]", "`x` ends before it begins", "[lower, upper]"),
        (Sign("sense", "up or down"), "2", "`sense` must be -1 or +1", "up or down"),
        (
            Choice("law", tuple(SphericalLaw)),
            '"weihted"',
            "`law` cannot be `weihted`",
            "did you mean `weighted`?",
        ),
        (Choice("axis", ("x", "y")), "3", "`axis` cannot be `3`", "it is one of: x, y"),
        (Names("joints", '["a"]'), "[1]", "`joints` must be a list of names", 'as in `["a"]`'),
    ],
)
def test_a_wrong_value_has_an_error_at_its_place(
    row: Row[Any], text: str, message: str, hint: str
) -> None:
    table = reader(f"{row.key} = {text}")
    assert row.read(table) is None
    (fault,) = table.diagnostics.entries
    assert (fault.message, fault.hint) == (message, hint)
    assert fault.span is not None
    assert fault.span.text in text


KEYS = TableRows(
    "prop", (Text("name", example='"seat"'), Text("surface", example='"wood"')), ("a",)
)


@pytest.mark.parametrize(
    ("text", "messages"),
    [
        ('name = "b"\nsurface = "c"\na = 1', []),
        ('name = "b"', ["this prop has no `surface`"]),
        ('name = "b"\nsurfaces = "c"', ["unknown key `surfaces` in a prop"]),
        ("a = 1", ["this prop has no `name`", "this prop has no `surface`"]),
    ],
)
def test_a_missing_key_is_an_error_unless_another_is_a_slip_of_it(
    text: str, messages: list[str]
) -> None:
    table = reader(text)
    KEYS.check_keys(table)
    assert [one.message for one in table.diagnostics.entries] == messages


@dataclass(frozen=True)
class Part:
    viscous: float
    coulomb: float = 0.0


@dataclass(frozen=True)
class Whole:
    name: str
    lower: float = -1.0
    upper: float = 1.0
    part: Part | None = None
    senses: tuple[int, ...] = ()


WHOLE_ROWS = TableRows(
    "whole",
    (
        Text("name", example='"a"'),
        Interval("ends_deg", attribute=("lower", "upper")),
        Number("viscous_Nms_rad", 0.0, attribute="part.viscous", is_always_written=True),
        Number("coulomb_Nm", 0.0, attribute="part.coulomb"),
        Numbers("senses", count="senses", usual=1),
    ),
)


def whole_of(values: dict[str, Any]) -> Whole:
    part = {
        name: values.pop(f"part.{name}")
        for name in ("viscous", "coulomb")
        if f"part.{name}" in values
    }
    return Whole(**values, part=Part(**part) if part else None)


ENDS = st.tuples(lengths, lengths).map(sorted)
PARTS = st.none() | st.builds(Part, st.floats(0.0, 9.0), st.floats(0.0, 9.0))


@given(st.builds(lambda name, ends, part: Whole(name, *ends, part), st.text(), ENDS, PARTS))
def test_an_object_is_read_from_its_lines(whole: Whole) -> None:
    assert whole_of(WHOLE_ROWS.read(reader("\n".join(WHOLE_ROWS.lines(whole))))) == whole


def test_defaults_and_usual_items_are_not_written() -> None:
    assert list(WHOLE_ROWS.lines(Whole("a", senses=(1, 1)))) == ['name = "a"']
    lines = list(WHOLE_ROWS.lines(Whole("a", part=Part(0.0), senses=(1, -1))))
    assert lines == ['name = "a"', "viscous_Nms_rad = 0", "senses = [1, -1]"]
