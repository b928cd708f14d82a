"""The page of a comparison: its bodies, curves and table, in the file and in a real browser."""

import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from generator import Figure
from generator.comparison.comparison import Comparison, compare_motions
from generator.comparison.difference import Quantity
from generator.contact.arrows import ArrowScale
from generator.motion_files import FigureMotion, page
from springs import AxisSpring, JointSprings, Linear, SpringSet
from tests.browser import assert_accessible, launch_browser, offline_page
from tests.contact_figures import FLOOR, SLOPE_AND_CRATE
from tests.contacts import with_contact
from tests.generator.motion_files.test_page import HOSTILE, hostile_motion
from tests.generator.motion_files.test_page_in_browser import wait_for
from tests.motion_readers import Page
from tests.motions import clip, header_of, shipped, slides, start_of

WIDTHS = ((390, 844), (768, 1024), (1366, 768))
"""Windows of a phone, a tablet and a small laptop."""

WITHIN = 1e-5
"""Numbers of the bodies have 24 bits."""


def turning(made: Figure, rate: float, count: int = 11) -> FigureMotion:
    """A motion in which every displacement grows evenly [rad/s or m/s], over a second."""
    times = np.linspace(0.0, 1.0, count)
    chains = {name: joint.chain for name, joint in made.joints.items()}
    values = {
        name: start + rate * times[:, None] * np.ones(len(start))
        for name, start in start_of(made).items()
    }
    return FigureMotion(made, header_of(times), chains, times, values)


@pytest.fixture(scope="module")
def knees() -> Comparison:
    """The prototype twice, whose joints turn unlike, and another figure."""
    made = shipped("prototype")
    motions = [turning(made, 0.2), turning(made, 0.5), turning(shipped("male50"), 0.3, 21)]
    return compare_motions(motions, ["soft", "stiff", "man"])


def read(found: Comparison, folder: Path) -> Page:
    found.write(folder / "out.html")
    return Page(folder / "out.html")


def test_bodies_are_those_of_the_motions(knees: Comparison, tmp_path: Path):
    data = read(knees, tmp_path).data
    assert [one["name"] for one in data["motions"]] == ["soft", "stiff", "man"]
    glbs = [Page.glb_of(one["glb"]) for one in data["motions"]]
    assert np.array_equal(Page.doubles(data["times"]), knees.times)
    for glb, motion in zip(glbs, knees.aligned, strict=True):
        poses = glb.poses()
        for segment in motion.figure.segments.values():
            for name, each in segment.sites.items():
                expected = motion.poses[segment.name] @ each.pose_in_segment
                found = poses[f"{segment.name}.{name}"]
                np.testing.assert_allclose(found, expected, atol=WITHIN)


def test_curves_are_the_columns_in_their_units(tmp_path: Path):
    motion = with_contact(clip("slides"))
    alone = replace(motion, recording=None)
    found = compare_motions([motion, alone], ["run", "motion"])
    columns = {one["name"]: one for one in read(found, tmp_path).data["columns"]}
    assert list(columns) == list(found.curves)
    rail, slide, energy = columns["rail.1"], columns["rail.2"], columns["kinetic"]
    assert (rail["unit"], rail["group"]) == ("deg", "rail")
    degrees = np.degrees(motion.displacements["rail"][:, 0])
    for values in rail["values"]:
        assert np.allclose(Page.floats(values), degrees, rtol=1e-6)
    lengths = 100.0 * motion.displacements["rail"][:, 1]
    assert np.allclose(Page.floats(slide["values"][0]), lengths, rtol=1e-6)
    assert (energy["unit"], energy["group"], energy["values"][1]) == ("J", "energies", None)
    assert columns["arm.contact_force"]["group"] == "contact"


@pytest.mark.parametrize(("sense", "words"), [(1.0, ""), (-1.0, ", reversed")])
def test_columns_have_the_words_of_the_tables(tmp_path: Path, sense: float, words: str):
    spring = AxisSpring((0.0, -sense, 0.0), (Linear(1.0),), motion="flexion")
    springs = SpringSet({"left_knee": JointSprings("left_knee", (spring,))})
    motion = turning(shipped("prototype"), 0.2)
    other = replace(turning(shipped("prototype"), 0.5), springs=springs)
    found = compare_motions([motion, other], ["soft", "stiff"])
    labels = {one["name"]: one["label"] for one in read(found, tmp_path).data["columns"]}
    assert labels["left_knee.1"] == f"left_knee flexion{words} (left_knee.1)"
    for one in found.of("stiff", Quantity.ANGLE):
        assert labels[one.column].startswith(one.label.replace("mostly ", ""))


def test_the_tables_are_those_of_the_command(knees: Comparison, tmp_path: Path):
    tables = read(knees, tmp_path).data["tables"]
    assert [one["text"] for one in tables] == [
        knees.describe_divergence(name) for name in ("stiff", "man")
    ]
    for name, table in zip(("stiff", "man"), tables, strict=True):
        for quantity, part in zip(Quantity, table["parts"], strict=True):
            head, rows = knees.table(name, quantity)
            assert part["head"] == list(head)
            assert [row["cells"] for row in part["rows"]] == [list(cells) for cells, _ in rows]
    assert any(row["cells"][0].startswith("left/right_") for row in tables[0]["parts"][0]["rows"])


def test_the_props_are_those_of_the_first_motion_with_some(tmp_path: Path):
    motion = turning(slides(), 0.3)
    motions = [motion, *(replace(motion, scene=scene) for scene in (FLOOR, SLOPE_AND_CRATE))]
    data = read(compare_motions(motions, ["a", "b", "c"]), tmp_path).data
    nodes = [Page.glb_of(one["glb"]).nodes for one in data["motions"]]
    props = [sum("prop" in node.get("extras", {}) for node in some) for some in nodes]
    assert props == [0, 1, 0]
    assert "The props are those of b." in data["notes"]
    alike = read(compare_motions(motions[:2], ["a", "b"]), tmp_path).data
    assert not [note for note in alike["notes"] if "props" in note]


def test_a_long_comparison_draws_few_frames_and_says_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setattr(page, "MAX_PAGE_FRAMES", 7)
    motion = turning(slides(), 0.3)
    data = read(compare_motions([motion, motion], ["a", "b"]), tmp_path).data
    assert Page.doubles(data["times"]).size == 6
    assert "6 of 11 frames are drawn." in data["notes"]
    assert Page.floats(data["columns"][0]["values"][1]).size == 6


def test_text_of_files_stays_text_and_only_own_scripts_run(tmp_path: Path):
    motion = hostile_motion()
    found = compare_motions([motion, replace(motion)], [HOSTILE, f"other {HOSTILE}"])
    made = read(found, tmp_path)
    assert made.contents["title"] == [f"{HOSTILE} and other {HOSTILE}"]
    assert "unsafe" not in made.policy
    sources = dict(part.strip().split(" ", 1) for part in made.policy.split(";"))
    assert len(sources["script-src"].split()) == len(made.scripts)
    assert sources["default-src"] == "'none'"
    assert not [tag for tag, _ in made.tags if tag in {"iframe", "object", "embed", "img", "base"}]
    for name in ("compare.js", "compare.css", "compare.html"):
        text = page._asset(name)
        assert not re.findall(r"https?://", text)
    assert "{{" not in re.sub(r"<script.*?</script>", "", page._asset("transport.html"))


@pytest.fixture(scope="module")
def touched() -> Comparison:
    """Two runs with contact and one without."""
    bare = clip("slides")
    first, other = with_contact(bare), with_contact(bare, seed=1)
    return compare_motions([first, other, bare], ["soft", "hard", "air"])


def test_forces_and_touches_are_those_of_the_runs(touched: Comparison, tmp_path: Path):
    data = read(touched, tmp_path).data
    for one, motion in zip(data["motions"], touched.motions, strict=True):
        run = motion.recording
        if run is None or run.contact is None:
            assert (one["forces"], one["touches"]) == ([], [])
            continue
        rows = {row["name"]: row for row in one["forces"]}
        assert rows["pelvis"]["name"] in rows
        frames = Page.floats(rows["pelvis"]["frames"]).astype(int)
        assert frames.tolist() == list(range(1, run.times.size))
        for key, values in (
            ("forces", run.contact.part_forces),
            ("points", run.contact.force_points),
        ):
            found = Page.floats(rows["pelvis"][key]).reshape(-1, 3)
            np.testing.assert_allclose(found, values["pelvis"][1:], rtol=1e-5, atol=1e-6)
        assert [touch["name"] for touch in one["touches"]] == ["pelvis"]
    scale = ArrowScale.of_figure(touched.aligned[0].figure, page.first_poses(touched.aligned[0]))
    assert data["arrows"] == page.arrow_scale(scale)


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    with launch_browser() as found:
        yield found


def in_window(tab: Any, selector: str) -> bool:
    """Tell whether an element is in the window as a whole."""
    box, size = tab.locator(selector).bounding_box(), tab.viewport_size
    right, bottom = box["x"] + box["width"], box["y"] + box["height"]
    return min(box["x"], box["y"]) >= 0 and right <= size["width"] and bottom <= size["height"]


@pytest.mark.slow
@pytest.mark.parametrize(("width", "height"), WIDTHS)
def test_the_page_in_a_window(
    browser: Any, knees: Comparison, tmp_path: Path, width: int, height: int
):
    knees.write(tmp_path / "out.html")
    with offline_page(browser, tmp_path / "out.html", width, height) as tab:
        for selector in ("#stage", "#play", "#time", "#views", "#apart", "#column", "#time-plot"):
            assert in_window(tab, selector), selector
        assert tab.evaluate("document.documentElement.scrollWidth") <= width
        table = "document.querySelector('#tables')"
        assert tab.evaluate(f"{table}.scrollWidth <= {table}.clientWidth")
        assert "left_knee about -y (left_knee.1) [deg]" in tab.inner_text("#column")
        wait_for(tab, "page.triangles() > 1000")
        assert tab.evaluate("page.props()") == []
        buttons = tab.locator("tbody button")
        buttons.nth(3).scroll_into_view_if_needed()
        buttons.nth(3).click()
        row = knees.table("stiff", Quantity.ANGLE)[1][3][1]
        assert tab.evaluate("page.column") == row.column
        assert tab.evaluate("page.time") == pytest.approx(row.time)
        assert tab.locator("tr.selected").count() == 1
        for view in ("Front", "Side", "Top"):
            tab.get_by_role("button", name=view).click()
            assert tab.locator("#views [aria-pressed=true]").inner_text() == view


@pytest.mark.slow
@pytest.mark.parametrize(("width", "height"), WIDTHS)
def test_forces_and_touches_in_a_window(
    browser: Any, touched: Comparison, tmp_path: Path, width: int, height: int
):
    touched.write(tmp_path / "out.html")
    with offline_page(browser, tmp_path / "out.html", width, height) as tab:
        for selector in ("#stage", "#lanes", "#play", "#time", "#forces", "#column", "#time-plot"):
            assert in_window(tab, selector), selector
        assert tab.evaluate("document.documentElement.scrollWidth") <= width
        lanes = tab.locator("#lanes .touches")
        names = [lanes.nth(k).get_attribute("aria-label") for k in range(lanes.count())]
        assert names == ["First touches of soft", "First touches of hard"]
        mark = lanes.nth(1).get_by_role("button")
        assert "hard, pelvis: first touch at" in mark.get_attribute("aria-label")
        assert mark.inner_text() == "pelvis"
        colours = [
            lanes.nth(k).evaluate(
                "each => getComputedStyle(each.firstChild, '::before').background"
            )
            for k in range(2)
        ]
        assert colours[0] != colours[1]
        mark.click()
        first = touched.motions[1].recording.contact.parts["pelvis"].first_time
        assert tab.evaluate("page.time") == pytest.approx(first)
        tab.evaluate("page.seek(page.times[1])")
        assert [tab.evaluate("k => page.forces(k)", k) for k in range(3)] == [
            ["pelvis"], ["pelvis"], [],
        ]  # fmt: skip
        assert len({tab.evaluate("k => page.forceColour(k)", k) for k in range(2)}) == 2
        text = page.arrow_scale(
            ArrowScale.of_figure(touched.aligned[0].figure, page.first_poses(touched.aligned[0]))
        )["text"]
        assert text in tab.inner_text("#scale")
        tab.uncheck("#forces")
        assert tab.evaluate("page.forces(0)") == []
        assert text not in tab.inner_text("#scale")


@pytest.mark.slow
@pytest.mark.parametrize(("width", "theme"), [(390, "light"), (1366, "dark")])
def test_axe_finds_no_serious_fault(
    browser: Any, knees: Comparison, tmp_path: Path, width: int, theme: str
):
    knees.write(tmp_path / "out.html")
    assert_accessible(browser, tmp_path / "out.html", width, theme)


@pytest.mark.slow
def test_bodies_move_together_and_curves_follow_the_time(
    browser: Any, knees: Comparison, tmp_path: Path
):
    knees.write(tmp_path / "out.html")
    with offline_page(browser, tmp_path / "out.html", 1200, 800) as tab:
        first = min(
            (one for one in knees.divergences.values() if one), key=lambda one: one.divergence
        )
        assert tab.evaluate("page.column") == first.column
        for frame in (0, 7, knees.times.size - 1):
            tab.evaluate("time => page.seek(time)", float(knees.times[frame]))
            for k, motion in enumerate(knees.aligned):
                for name in ("left_lower_leg", "right_upper_arm"):
                    site = next(iter(motion.figure.segments[name].sites.values()))
                    pose = tab.evaluate("([k, n]) => page.pose(k, n)", [k, f"{name}.{site.name}"])
                    expected = motion.poses[name][frame] @ site.pose_in_segment
                    found = np.array(pose).reshape(4, 4).T
                    np.testing.assert_allclose(found, expected, atol=WITHIN)
            tab.evaluate("page.select('left_knee.1')")
            values = [np.degrees(one.displacements["left_knee"][frame, 0]) for one in knees.aligned]
            assert tab.evaluate("page.values()") == pytest.approx(values, abs=1e-4)
        assert "man" in tab.inner_text("#time-legend")

        # A body can be hidden; side by side they stand apart, each turned as before.
        wait_for(tab, "page.triangles() > 50000")
        tab.locator("#bodies input").nth(2).uncheck()
        wait_for(tab, "page.triangles() < 50000")
        x = "page.pose(1, 'lower_torso')[12] - page.pose(0, 'lower_torso')[12]"
        together = tab.evaluate(x)
        tab.check("#apart")
        assert tab.evaluate(x) - together > 0.5

        # Keys, and the other theme.
        tab.keyboard.press("Home")
        tab.keyboard.press("ArrowRight")
        assert tab.evaluate("page.frame") == 1
        background = "getComputedStyle(document.body).backgroundColor"
        shown = tab.evaluate(background)
        tab.click("#theme")
        assert tab.evaluate(background) != shown
        wait_for(tab, "parseFloat(document.querySelector('#time-plot .cursor').style.left) > 0")
        marks = tab.locator("#time-plot .divergence")
        assert marks.count() == 2


@pytest.mark.slow
def test_names_are_text_in_the_browser(browser: Any, tmp_path: Path):
    motion = hostile_motion()
    compare_motions([motion, replace(motion)], [HOSTILE, "other"]).write(tmp_path / "out.html")
    with offline_page(browser, tmp_path / "out.html", 800, 600) as tab:
        assert tab.inner_text("#title") == f"{HOSTILE} and other"
        assert HOSTILE in tab.inner_text("#bodies")
        assert tab.locator("img").count() == 0
