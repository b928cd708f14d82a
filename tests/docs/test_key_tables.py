"""The tables of keys in the docs: each row of a table of a file stands there with its bounds."""

import re

import pytest

from generator.input_files.links import LINK_ROWS
from generator.springs_file.coupled import COUPLED_ROWS
from generator.springs_file.parse import FILE_ROWS, SPRING_ROWS
from generator.springs_file.reach import REACH_ROWS
from generator.study.study_tables import (
    DESIGN_ROWS,
    MEASURE_ROWS,
    PARAMETER_ROWS,
    PERSON_ROWS,
    SENSITIVITY_ROWS,
)
from generator.toml_file.rows import Choice, TableRows
from tests.paths import DOCS

TABLES: list[tuple[str, TableRows]] = [
    ("springs-file.md#", FILE_ROWS),
    ("springs-file.md#A curve about an axis", SPRING_ROWS),
    ("springs-file.md#A law over several joints", COUPLED_ROWS),
    ("springs-file.md#The reach of a limb", REACH_ROWS),
    ("links.md", LINK_ROWS),
    ("study-file.md", DESIGN_ROWS),
    ("study-file.md", PARAMETER_ROWS),
    ("study-file.md#The figure and its runs", PERSON_ROWS),
    ("study-file.md", MEASURE_ROWS),
    ("study-file.md", SENSITIVITY_ROWS),
]


def lines_of_keys(place: str) -> dict[str, str]:
    """The lines of each key in the tables of a page, or of a section of it."""
    name, _, section = place.partition("#")
    page = (DOCS / name).read_text(encoding="utf-8")
    if section:
        page = re.split(r"^## ", page.partition(f"\n## {section}\n")[2], flags=re.MULTILINE)[0]
    found: dict[str, str] = {}
    for line in page.splitlines():
        for cell in line.split("|")[1:3] if line.startswith("|") else ():
            if re.fullmatch(r" (`\w+`(, )?)+ ", cell):
                for key in re.findall(r"`(\w+)`", cell):
                    found[key] = found.get(key, "") + line
    return found


@pytest.mark.parametrize(("place", "rows"), TABLES, ids=lambda value: getattr(value, "noun", ""))
def test_a_key_stands_in_a_table_with_its_bounds(place: str, rows: TableRows):
    lines = lines_of_keys(place)
    for row in rows.rows:
        assert row.key in lines
        if isinstance(row, Choice):
            page = (DOCS / place.partition("#")[0]).read_text(encoding="utf-8")
            assert all(word in page for word in row.bounds.split(" or "))
        else:
            assert re.sub(r"e\+0*", "e", row.bounds) in lines[row.key]
