"""Tables of a study's file: files that it names, integers, and missing keys."""

import pytest

from generator.diagnostics import Diagnostics, Source
from generator.study.study_tables import require_keys, require_table
from generator.toml_file.reader import TableReader, parse_document
from generator.toml_file.rows import Integer
from tests.generator.study.test_study_file import EXAMPLE
from tests.paths import FIGURES
from tests.study_runs import parse_study_text


def reader(text: str) -> TableReader:
    """Return the reader of a text."""
    source, diagnostics = Source("text", text), Diagnostics()
    top = parse_document(source, "text", diagnostics)
    assert top is not None
    return top


def messages(table: TableReader) -> list[str]:
    """Return the messages so far."""
    return [one.message for one in table.diagnostics.entries]


@pytest.mark.parametrize("value", ["true", "1.0", '"1"', "[1]", "nan"])
def test_an_integer_is_written_without_decimals(value: str):
    table = reader(f"runs = {value}")
    assert Integer("runs", 1, 9).read(table) is None
    assert messages(table) == ["`runs` must be a whole number"]


def test_an_integer_is_within_its_range():
    table = reader("a = 1\nb = 9\nc = 0\nd = 10")
    assert [Integer(key, 1, 9).read(table) for key in "abcde"] == [1, 9, None, None, None]
    assert messages(table) == [f"`{key}` must be from 1 to 9" for key in "cd"]


def test_a_slip_of_a_key_is_not_a_missing_key():
    table = reader("colum = 1")
    assert not require_keys(table, {"column": '"a"', "take": '"last"'}, "measure")
    assert messages(table) == ["this measure has no `take`"]


def test_a_slip_of_a_table_is_not_a_missing_table():
    table = reader("[mesures]\na = 1")
    assert require_table(table, "measures", "a = 1") is None
    assert require_table(table, "design", "kind = 1") is None
    assert messages(table) == ["this study has no design"]


@pytest.mark.parametrize("key", ["figure", "springs", "pose", "scene"])
@pytest.mark.parametrize("name", ["\\u0000", "", "nowhere/nothing", "a" * 900, "/dev/null/x"])
def test_a_file_that_cannot_be_read_is_an_error_at_its_key(key: str, name: str):
    text = EXAMPLE.replace("shoulder.2 [deg]", "kinetic [J]")
    text = text.replace('figure = "pendulum"\n', "") if key == "figure" else text
    faults = parse_study_text(f'{key} = "{name}"\n{text}', FIGURES).diagnostics
    assert [(one.span and one.span.line, one.span and one.span.column) for one in faults] == [
        (1, len(key) + 4)
    ]
