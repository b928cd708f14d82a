"""Spans of the keys of a TOML text: inline tables and dotted keys are located as tables are."""

import pytest

from generator.diagnostics import Source
from generator.toml_file.spans import locate_keys


@pytest.mark.parametrize(
    "text",
    [
        "[a.b]\nlow = 1\nlist = [2, 3]\n",
        "[a]\nb = { low = 1, list = [2, 3] }\n",
        "[a]\nb.low = 1\nb.list = [2, 3]\n",
        "a.b.low = 1\na.b.list = [2, 3]\n",
        "a = { b = { low = 1, list = [2, 3] } }\n",
        "a = { b.low = 1, b.list = [2, 3] }\n",
        "[a]\n'b' = { low = 1, \"list\" = [2, 3] }\n",
    ],
)
def test_a_key_is_located_in_all_ways_of_writing_a_table(text: str):
    spans = locate_keys(Source("text", text))
    assert spans.value("a.b", 0, "low").text == "1"
    assert spans.value("a.b", 0, "list").text == "[2, 3]"
    assert spans.value("a.b", 0, "list", 1).text == "3"
    assert spans.key("a.b", 0, "low").text.endswith("low")
    assert spans.key("a", 0, "b").start <= spans.value("a.b", 0, "low").start


def test_a_missing_key_has_the_place_of_its_inline_table():
    spans = locate_keys(Source("text", "[a]\nb = { low = 1 }\nc = { low = 2 }\n"))
    assert spans.value("a.c", 0, "high").text == "{ low = 2 }"
    assert spans.table("a.b").text == "{ low = 1 }"


def test_tables_of_one_name_are_counted():
    text = "[[spring]]\nx = { low = 1 }\n[[spring]]\nx = { low = 2 }\n"
    spans = locate_keys(Source("text", text))
    assert spans.value("spring", 1, "x").text == "{ low = 2 }"
    assert spans.table("spring", 1).line == 3
