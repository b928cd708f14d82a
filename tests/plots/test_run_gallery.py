"""The gallery holds every plate of the package, and the page shows them as the code makes them."""

import pkgutil
import re
from collections.abc import Iterator
from importlib import import_module
from math import isfinite

import pytest

import plots.plates
from plots.canvas import draw_plate, render_figure
from plots.joint_plate import JointPlate
from plots.plate import Claim, ClaimKind
from plots.plate_definition import PlateDefinition
from plots.report import claims_table, gallery_page
from plots.run import PLATES
from tests.paths import DOCS
from tests.plots.drawn import plate
from tests.tiny_plates import damper, spring


def page() -> str:
    return (DOCS / "gallery.md").read_text(encoding="utf-8")


def makers_of_plates() -> Iterator[str]:
    for found in pkgutil.iter_modules(plots.plates.__path__):
        module = import_module(f"plots.plates.{found.name}")
        for name, value in vars(module).items():
            if isinstance(value, JointPlate | PlateDefinition):
                yield f"{module.__name__}:{name}"


def test_every_plate_of_the_package_is_in_the_gallery():
    assert sorted(PLATES.values()) == sorted(makers_of_plates())


def test_the_page_shows_every_plate_in_order():
    assert re.findall(r'^<a id="(.+)"></a>$', page(), re.MULTILINE) == list(PLATES)
    shown = re.findall(r"^!\[.*\]\((.+)\)$", page(), re.MULTILINE)
    assert shown == [f"gallery/{name}.svg" for name in PLATES]
    assert sorted(path.name for path in (DOCS / "gallery").iterdir()) == sorted(
        f"{name}.svg" for name in PLATES
    )


def rows(text: str) -> list[list[str]]:
    """The cells of all tables of a page, without heads."""
    lines = [line for line in text.splitlines() if re.match(r"\| (?!claim \|)", line)]
    return [[cell.strip() for cell in re.split(r"(?<!\\)\|", line)[1:-1]] for line in lines]


@pytest.mark.slow
@pytest.mark.parametrize("name", PLATES)
def test_a_plate_can_be_drawn_and_its_table_is_that_of_the_page(name: str):
    """Sentences, bounds and verdicts are; measured values differ in rounding, and in speed.

    What a run differs from itself on the machine that made the page is within its bound.
    """
    section = page().partition(f'<a id="{name}"></a>')[2].partition("<a id=")[0]
    assert render_figure(plate(name).figure, "svg")
    written, claims = rows(section), plate(name).claims
    fresh = rows("\n".join(claims_table(claims)))
    assert [[*row[:1], *row[2:]] for row in written] == [[*row[:1], *row[2:]] for row in fresh]
    for row, claim in zip(written, claims, strict=True):
        if claim.obstacle or claim.kind is ClaimKind.SPEED or claim.is_repetition:
            continue
        bounds = [abs(bound) for bound in (claim.at_least, claim.at_most) if isfinite(bound)]
        rough = 1e-2 * max(abs(claim.measured), *bounds)
        measured = float(row[1].split()[0])
        assert measured == pytest.approx(claim.measured, abs=rough, nan_ok=True), row[0]


def test_a_page_of_two():
    text = gallery_page([draw_plate(spring()), draw_plate(damper())], "page")
    assert "`mover plots --gallery page.md`" in text
    assert "2 of 4 claims hold, 2 do not." in text
    assert r"- [A spring \<b\>\& its moment\</b\>](#spring)" in text
    assert "![A damper](page/damper.svg)" in text
    assert "*Sign:* M is positive in flexion." in text
    assert r"1. A. Author \& B. Author, \<Springs\>, 1989" in text
    assert rows(text) == [
        ["The moment at 30 deg restores", "-1.047 N m", "at most 0 N m", "holds"],
        [r"a \< 3 \& b \| c", "2", "1 to 3", "holds"],
        ["It restores (It only damps.)", "3 N m", "at most 0 N m", "**DOES NOT HOLD**"],
        ["It is known", "nan", "at least 0", "**DOES NOT HOLD**"],
    ]


def test_a_unit_is_no_markup():
    *_, row = claims_table([Claim("x", 1.0, "N_m*s*|", at_most=2.0)])
    assert row == r"| x | 1 N\_m\*s\*\| | at most 2 N\_m\*s\*\| | holds |"
