"""The tables of the pages are those of the measurements in `plots/data`."""

import pytest

from benchmarks.pages import PAGES, TABLES, fill
from tests.paths import DOCS


@pytest.mark.parametrize("name", PAGES)
def test_a_page_shows_what_was_measured(name: str) -> None:
    """Where this fails: `python -m benchmarks pages`."""
    page = (DOCS / name).read_text(encoding="utf-8")
    assert fill(page) == page


def test_every_table_stands_on_one_page() -> None:
    text = "".join((DOCS / name).read_text(encoding="utf-8") for name in PAGES)
    for name in TABLES:
        assert text.count(f"<!-- measured: {name} -->") == 1


def test_a_wrong_number_is_replaced() -> None:
    page = (DOCS / "speed.md").read_text(encoding="utf-8")
    head, mark, rest = page.partition("<!-- measured: aims -->\n\n")
    wrong = head + mark + rest.replace("| aim |", "| claim |", 1)
    assert wrong != page
    assert fill(wrong) == fill(page)
