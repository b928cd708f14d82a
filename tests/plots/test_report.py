"""The report is one whole page: well-formed, complete, and without a wish for anything outside."""

import re
from base64 import b64decode
from collections import Counter
from html.parser import HTMLParser
from io import BytesIO

import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image

from plots import report as module
from plots.canvas import draw_plate
from plots.plate import Claim, ClaimKind, DrawnPlate, FailedPlate, incomparable_claim
from plots.report import report, tally
from tests.tiny_plates import damper, spring

VOID = {"meta", "img", "wbr"}
LOADING = {"src", "srcset", "data", "poster", "action", "background"}


class Page(HTMLParser):
    """Content of a page; elements must be closed in order."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.tags: Counter[str] = Counter()
        self.attributes: list[tuple[str, str, str]] = []
        self.cells: list[list[str]] = []
        self.row_kinds: list[str | None] = []
        self.words: list[str] = []
        self.style = ""
        self._open: list[str] = []
        self.feed(text)
        self.close()
        assert self._open == []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags[tag] += 1
        self.attributes += [(tag, name, value or "") for name, value in attrs]
        if tag not in VOID:
            self._open.append(tag)
        if tag == "tr":
            self.cells.append([])
            self.row_kinds.append(dict(attrs).get("class"))
        if tag in ("td", "th"):
            self.cells[-1].append("")

    def handle_endtag(self, tag: str) -> None:
        assert self._open.pop() == tag

    def handle_data(self, data: str) -> None:
        if self._open and self._open[-1] == "style":
            self.style += data
            return
        self.words.append(data)
        if {"td", "th"} & set(self._open):
            self.cells[-1][-1] += data

    def values(self, name: str) -> list[str]:
        return [value for _, attribute, value in self.attributes if attribute == name]


@pytest.fixture(scope="module")
def plates() -> list[DrawnPlate]:
    return [draw_plate(spring()), draw_plate(damper())]


@pytest.fixture(scope="module")
def page(plates: list[DrawnPlate]) -> Page:
    failed = [FailedPlate("hip", "ValueError: a < b")]
    return Page(report(plates, failed, {"command": "mover plots -o DIR", "numpy": "9.9"}))


def test_nothing_is_fetched(page: Page):
    assert not page.tags.keys() & {"script", "link", "iframe", "object", "embed", "base"}
    loaded = [value for _, name, value in page.attributes if name in LOADING]
    assert [value.partition(";")[0] for value in loaded] == [
        *["data:image/png"] * 2,
        *["data:image/svg+xml"] * 2,
    ]
    assert not re.search(r"url\(|@import", page.style)
    assert "default-src 'none'; img-src data:; style-src 'unsafe-inline'" in page.values("content")


def test_links_lead_within_the_page_or_to_the_files_beside_it(page: Page, plates: list[DrawnPlate]):
    ids = page.values("id")
    assert len(ids) == len(set(ids))
    links = page.values("href")
    assert {link[1:] for link in links if link.startswith("#")} == set(ids)
    files = [name for plate in plates for name in plate.files]
    assert [link for link in links if not link.startswith("#")] == files


def test_the_pictures_are_the_files(page: Page, plates: list[DrawnPlate]):
    *small, spring_shown, damper_shown = [
        b64decode(value.partition(",")[2]) for value in page.values("src")
    ]
    assert [spring_shown, damper_shown] == [plate.svg for plate in plates]
    for thumbnail, plate in zip(small, plates, strict=True):
        assert len(thumbnail) < 0.5 * len(plate.png)
    assert page.values("alt") == ["", "", *(plate.title for plate in plates)]


def test_claims_stand_by_their_plates_and_in_the_table_of_their_kind(
    page: Page, plates: list[DrawnPlate]
):
    rows = [
        [c.sentence, c.measured_text, c.bound_text, c.verdict, c.remark]
        for plate in plates
        for c in plate.claims
    ]
    heads = ["Claim", "Measured", "Bound", "Outcome", "Remark"]
    names = ["spring", "spring", "damper", "damper"]
    first = [[*heads, "Plate"], *([*row, name] for row, name in zip(rows, names, strict=True))]
    assert page.cells == [heads, *rows[:2], heads, *rows[2:], *first]


def test_each_kind_of_claim_has_its_verdict_and_its_table():
    claims = (
        Claim("it computes", 1.0, at_most=2.0),
        Claim("it differs", 3.0, at_most=2.0, kind=ClaimKind.COMPARISON),
        incomparable_claim("it is unknown", "not measured"),
        Claim("it is fast", 1.0, at_most=2.0, kind=ClaimKind.SPEED),
    )
    page = Page(report([plate_of("x", "y", claims)], (), {}))
    ids = page.values("id")
    assert [name for name in ids if name in set(ClaimKind)] == list(ClaimKind)
    assert "Of 2 comparisons 0 agree, 1 differ and 1 cannot be made." in page.words
    assert page.words.count("All 1 claims hold.") == 2
    assert "fails" not in page.row_kinds


def test_a_failing_claim_is_told_in_words_and_marked(page: Page):
    for cells, kind in zip(page.cells, page.row_kinds, strict=True):
        assert (cells[3] == "DOES NOT HOLD") == (kind == "fails")
    assert "2 of 4 claims hold, 2 do not." in page.words


def test_words_of_a_plate(page: Page, plates: list[DrawnPlate]):
    for plate in plates:
        for said in (plate.title, plate.caption, *plate.references):
            assert said in page.words
        assert f" {plate.sign}" in page.words
    for said in ("the plate `hip` could not be made: ValueError: a < b", "numpy", "9.9"):
        assert said in page.words


def test_a_large_picture_is_shown_as_png(plates: list[DrawnPlate], monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(module, "LARGEST_SVG", len(plates[0].svg) - 1)
    _, shown = Page(report(plates[:1], (), {})).values("src")
    assert shown.startswith("data:image/png;base64,")
    assert b64decode(shown.partition(",")[2]) == plates[0].png


def test_a_report_of_nothing():
    page = Page(report([], [FailedPlate("hip", "it is late")], {}))
    assert page.values("id") == ["made"]


PIXEL = BytesIO()
Image.new("RGB", (1, 1)).save(PIXEL, "png")


def plate_of(title: str, text: str, claims: tuple[Claim, ...]) -> DrawnPlate:
    return DrawnPlate("a", title, text, text, claims, (text,), b"<svg/>", PIXEL.getvalue(), {})


def report_of(title: str, text: str, command: str) -> Page:
    """A report with one plate."""
    claim = Claim(title, 1.0, at_most=2.0, remark=text)
    return Page(report([plate_of(title, text, (claim,))], (), {"command": command}))


USUAL = report_of("x", "x", "x")


@given(st.text(min_size=1), st.text())
def test_no_text_is_taken_for_markup(plain: str, other: str):
    page = report_of(f"x{plain}", other, plain)
    assert page.tags == USUAL.tags
    assert len(page.attributes) == len(USUAL.attributes)
    assert page.cells[1][0] == f"x{plain}"
    assert page.cells[1][4] == other
    assert page.values("alt") == ["", f"x{plain}"]


@pytest.mark.parametrize(
    ("values", "said"),
    [
        ((), "There are no claims."),
        ((1.0, 1.0), "All 2 claims hold."),
        ((1.0, 3.0, 3.0), "1 of 3 claims hold, 2 do not."),
        ((3.0,), "0 of 1 claims hold, 1 do not."),
    ],
)
def test_the_tally(values: tuple[float, ...], said: str):
    assert tally([Claim("it is so", value, at_most=2.0) for value in values]) == said


def test_the_tally_of_comparisons():
    compared = [Claim("x", v, at_most=2.0, kind=ClaimKind.COMPARISON) for v in (1.0, 3.0, 4.0)]
    claims = [Claim("y", 1.0, at_most=2.0), *compared, incomparable_claim("z", "not measured")]
    assert tally(claims) == (
        "All 1 claims hold. Of 4 comparisons 1 agree, 2 differ and 1 cannot be made."
    )
