"""Tables, drawings and pages as notebooks show them."""

import re
from html import unescape
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

from generator import Plan, compare, read_figure, simulate
from generator.notebook import PageView, html_curves, html_table
from tests.browser import launch_browser

SVG = "{http://www.w3.org/2000/svg}"
HOSTILE = '</title><script>alert("1")</script>&'


def paths_of(page: str) -> list[str]:
    """Paths of the curves of a drawing, those of the frame left out."""
    text = page[: page.index("</p>")].replace("<p>", "").partition("<span")[0]
    drawing = ElementTree.fromstring(text.replace("<svg", f'<svg xmlns="{SVG[1:-1]}"'))
    return [one.get("d") or "" for one in drawing.iter(f"{SVG}path")][1:]


def test_a_table_escapes_its_texts() -> None:
    page = html_table("<t>", ("<h>",), [("<c>",)])
    assert "<p>&lt;t&gt;</p>" in page
    assert "<th>&lt;h&gt;</th>" in page
    assert "<td>&lt;c&gt;</td>" in page


def test_a_curve_is_drawn_to_scale_with_gaps() -> None:
    y = np.array([-1.0, 0.0, np.nan, 1.0, 2.0])
    (path,) = paths_of(html_curves(("x", "y"), [("one", np.arange(5), y)], (-2.0, 2.0)))
    numbers = [tuple(map(float, each.split(","))) for each in re.findall(r"[\d.]+,[\d.]+", path)]
    assert numbers == [(40, 150), (135, 100), (325, 50), (420, 0)]
    assert path.count("M") == 2


@pytest.mark.parametrize("count", [1, 2])
def test_a_curve_without_an_extent_is_drawn(count: int) -> None:
    zero = np.zeros(count)
    page = html_curves(("x", "y"), [("one", zero, zero), ("two", zero, zero + np.nan)], (0.0, 0.0))
    assert paths_of(page) == ["M" + " ".join(["40,0.0"] * count), ""]


def test_names_of_curves_are_escaped() -> None:
    page = html_curves((HOSTILE, HOSTILE), [(HOSTILE, [0, 1], [0, 1])], (0.0, 1.0))
    assert "<script" not in page
    assert len(paths_of(page)) == 1


def test_a_page_is_in_a_frame_of_its_own() -> None:
    view = PageView(f'<!doctype html><p title="a">{HOSTILE}</p>', 300)
    text = view._repr_html_()
    assert text.count("<") == 2
    found = re.search(r'srcdoc="([^"]*)"', text)
    assert found
    assert unescape(found.group(1)) == view.html
    assert "height:300px" in text
    assert "allow-same-origin" not in text
    assert len(repr(view)) < 100


@pytest.mark.slow
def test_bodies_are_shown_in_a_cell_without_a_server(tmp_path: Path) -> None:
    figure = read_figure("pendulum")
    run = simulate(figure, Plan(stop=0.2))
    views = run.view(), figure.view(), compare(run, run).view()
    file = tmp_path / "cell.html"
    file.write_text("".join(view._repr_html_() for view in views), encoding="utf-8")
    with launch_browser() as browser:
        tab = browser.new_context(offline=True).new_page()
        said: list[str] = []
        tab.on("console", lambda message: said.append(message.text))
        tab.on("pageerror", lambda failure: said.append(str(failure)))
        tab.goto(file.as_uri())
        frames = tab.frames[1:]
        assert len(frames) == 3
        for frame in frames:
            frame.evaluate("page.ready")
            assert frame.locator("canvas").first.bounding_box()["height"] > 100
        assert said == []
