"""docs/architecture.md: its picture shows the imports, and its tables name what the source has."""

import re
import runpy
from itertools import pairwise

import pytest

from tests.paths import DOCS, ROOT

PAGE = (DOCS / "architecture.md").read_text(encoding="utf-8")
ROWS = re.findall(r"^\| `([\w/]+\.py)` \| `(\w+)` \|", PAGE, re.MULTILINE)
SCRIPT = runpy.run_path(str(DOCS / "pictures/architecture.py"))


@pytest.fixture(scope="module")
def graph() -> dict[str, set[str]]:
    return SCRIPT["arrows"]()


def test_the_picture_shows_all_rooms_and_the_arrows_of_the_source(graph):
    assert SCRIPT["drawn_description"]() == SCRIPT["description"](graph)
    rooms = graph.keys() | {target for targets in graph.values() for target in targets}
    assert rooms == SCRIPT["WHAT"].keys() == SCRIPT["COLUMN"].keys()


def test_the_boxes_of_the_picture_lie_beside_each_other(graph):
    column = SCRIPT["COLUMN"]
    rows: dict[int, list[float]] = {}
    for room in graph:
        rows.setdefault(SCRIPT["height"](graph, room), []).append(column[room])
    assert all(abs(column[room]) <= 2.4 for room in graph)  # else a box is cut by the edge
    for places in map(sorted, rows.values()):
        assert all(right - left > 1.4 for left, right in pairwise(places))


def test_the_tables_are_found():
    assert len(ROWS) > 20


@pytest.mark.parametrize(("path", "name"), ROWS)
def test_a_function_is_in_the_file_of_its_row(path: str, name: str):
    source = (ROOT / path).read_text(encoding="utf-8")
    assert re.search(rf"^(?:def|class) {name}\b", source, re.MULTILINE)
