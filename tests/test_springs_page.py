"""docs/springs-file.md: its examples are read without a fault, and it names every key."""

import re
from pathlib import Path

import pytest

from generator.reader.coupled_table import COUPLED_KEYS
from generator.reader.own_terms import TERM_KEYS
from generator.reader.springs_file import FILE_KEYS, SPRING_KEYS, SpringsFile, parse_springs
from generator.springs_writer import write_springs

PAGE = (Path(__file__).parents[1] / "docs" / "springs-file.md").read_text(encoding="utf-8")
EXAMPLES = re.findall(r"^```toml\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL)
CURVES, COUPLED = PAGE.split("## A law over several joints")


def content(text: str) -> SpringsFile:
    reading = parse_springs(text, "springs-file.md")
    assert reading.faults == ()
    assert reading.content is not None
    return reading.content


def rows(part: str) -> set[str]:
    """The keys that stand in the tables of a part of the page."""
    lines = [line for line in part.splitlines() if line.startswith("|")]
    return {key for line in lines for key in re.findall(r"\| `([A-Za-z_0-9]+)` \|", line)}


def test_every_example_is_read_and_written_and_read():
    assert len(EXAMPLES) == 4
    for example in EXAMPLES:
        assert content(write_springs(content(example))) == content(example)


def test_every_key_of_a_curve_is_in_a_table_and_no_other():
    told = {"joints", "axis", "motion", "reference", "why"}
    assert all(f"`{key}`" in CURVES for key in told)
    assert rows(CURVES) == {*SPRING_KEYS, "figure", "law"} - told
    assert {"figure", "law"} < set(FILE_KEYS)


def test_every_key_of_a_coupled_law_is_in_a_table_and_no_other():
    assert rows(COUPLED) == set(COUPLED_KEYS)
    assert all(key in COUPLED for key in TERM_KEYS)


@pytest.mark.parametrize("example", EXAMPLES)
def test_every_law_over_several_joints_of_the_page_is_one(example: str):
    for entry in content(example).coupled:
        assert len(entry.law.coordinates) == 2


def test_the_error_is_printed_as_the_page_has_it():
    text = '[[spring]]\njoints = ["left_knee"]\nstiffness_Nm_rad = 1\nscale = -1\n'
    (fault,) = parse_springs(text, "my.springs.toml").faults
    assert str(fault) in PAGE
