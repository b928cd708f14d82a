"""The page of a motion in a real browser, from disk and without a network."""

import time
from collections.abc import Callable, Iterator
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from generator import Model, Plan, Scene, read_figure, simulate
from generator.motion_files.motion import motion_from_figure
from generator.motion_files.page import springs_of_header, write
from generator.passive_curve import passive_curves
from generator.rotations import Array
from tests.browser import WAIT, WIDTHS, assert_accessible, launch_browser
from tests.contacts import with_contact
from tests.generator.motion_files.test_glb import half_way
from tests.generator.motion_files.test_page import HOSTILE, hostile_motion
from tests.motion_readers import Page
from tests.motions import bent, clip, shipped, site

WITHIN = 1e-5
"""Numbers of the body have 24 bits."""


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    with launch_browser() as browser:
        yield browser


@pytest.fixture
def open_file(browser: Any) -> Iterator[Callable[..., Any]]:
    """Open a file without a network; the console stays silent, and nothing else is asked for."""
    context = browser.new_context(viewport={"width": 1200, "height": 800}, offline=True)
    said: list[str] = []
    asked: list[str] = []

    def open_one(path: Path, script: str = "") -> Any:
        page = context.new_page()
        page.on("console", lambda message: said.append(message.text))
        page.on("pageerror", lambda failure: said.append(str(failure)))
        page.on("dialog", lambda dialog: said.append(dialog.message))
        page.on("request", lambda request: asked.append(request.url))
        page.add_init_script(script)
        page.goto(path.as_uri())
        page.evaluate("page.ready")
        assert asked == [path.as_uri()]
        return page

    yield open_one
    context.close()
    assert said == []
    assert len(asked) == 1


def orange_pixels(page: Any) -> NDArray[np.bool_]:
    """Pixels of the body's picture that are orange, the colour of the prototype."""
    import matplotlib.image

    shot = matplotlib.image.imread(BytesIO(page.locator("#stage").screenshot()))
    red, green, blue = shot[..., 0], shot[..., 1], shot[..., 2]
    return (red > 2.0 * blue) & (red > 1.3 * green)


def body_fraction(page: Any) -> float:
    """Fraction of the body's picture that is orange."""
    return float(np.mean(orange_pixels(page)))


def body_middle(page: Any) -> tuple[float, float]:
    """A point of the torso in the window, a little above the middle of the orange pixels."""
    rows, columns = np.nonzero(orange_pixels(page))
    box = page.locator("#stage").bounding_box()
    row = np.quantile(rows, 0.3)
    return box["x"] + float(np.mean(columns)), box["y"] + float(row)


def wait_for(page: Any, condition: str) -> None:
    """Wait for a condition; Playwright's own way is against the policy of the page."""
    end = time.monotonic() + WAIT
    while not page.evaluate(condition):
        assert time.monotonic() < end, condition
        page.wait_for_timeout(20)


def site_pose(page: Any, name: str) -> Array:
    return np.array(page.evaluate("name => page.pose(name)", name)).reshape(4, 4).T


def point_left(page: Any) -> float:
    return page.evaluate("parseFloat(document.querySelector('#moment-plot .point').style.left)")


@pytest.mark.slow
def test_a_page_from_disk_plays_the_motion(open_file: Callable[..., Any], tmp_path: Path):
    motion = clip("prototype")
    write(motion, tmp_path / "fall.html")
    page = open_file(tmp_path / "fall.html")

    # The body is drawn as the page opens.
    assert page.evaluate("page.frame") == 0
    wait_for(page, "page.triangles() > 1000")
    assert 0.01 < body_fraction(page) < 0.6

    # Poses at a time are those of the recording.
    for frame in (0, 7, 20):
        page.evaluate("time => page.seek(time)", float(motion.times[frame]))
        assert page.evaluate("page.frame") == frame
        for segment in motion.figure.segments.values():
            for name, each in segment.sites.items():
                expected = motion.poses[segment.name][frame] @ each.pose_in_segment
                found = site_pose(page, f"{segment.name}.{name}")
                np.testing.assert_allclose(found, expected, atol=WITHIN)

    page.evaluate("page.seek(NaN)")
    assert page.evaluate("page.frame") == 20

    # Between two frames bones turn evenly, as another reader of the binary glTF has it.
    page.evaluate("time => page.seek(time)", float(0.5 * (motion.times[7] + motion.times[8])))
    for name, poses in Page(tmp_path / "fall.html").glb().poses(half_way).items():
        if "." in name:
            np.testing.assert_allclose(site_pose(page, name), poses[7], atol=WITHIN)

    # The point moves along the curve.
    springs = springs_of_header(motion.header, motion.figure)
    assert springs is not None
    curve = passive_curves(motion.figure, springs)["left_knee"][0]
    angles = curve.component(motion.displacements)
    labels = [row["label"] for row in page.evaluate("page.motion.rows")]
    page.select_option("#row", label=curve.label)
    places = []
    for frame in (0, 20):
        page.evaluate("time => page.seek(time)", float(motion.times[frame]))
        angle, moment, _ = page.evaluate("page.point()")
        assert angle == pytest.approx(np.degrees(angles[frame]), abs=1e-4)
        assert moment == pytest.approx(float(curve.moment_at(angles[frame])), rel=1e-5, abs=1e-9)
        places.append(point_left(page))
    assert (places[1] - places[0]) * (angles[20] - angles[0]) > 0.0
    assert curve.label in labels

    # Keys.
    page.keyboard.press("Home")
    page.keyboard.press("ArrowRight")
    page.keyboard.press("ArrowRight")
    assert page.evaluate("page.time") == motion.times[2]
    page.keyboard.press("ArrowLeft")
    assert page.evaluate("page.frame") == 1
    page.keyboard.press("Space")
    assert page.evaluate("page.playing")
    wait_for(page, "!page.playing")
    assert page.evaluate("page.time") == motion.times[-1]
    hand = site_pose(page, "left_lower_arm.distal")
    distal = motion.figure.segments["left_lower_arm"].sites["distal"].pose_in_segment
    np.testing.assert_allclose(hand, motion.poses["left_lower_arm"][-1] @ distal, atol=WITHIN)

    # A click into the lower plot sets the time.
    box = page.locator("#time-plot .u-over").bounding_box()
    page.mouse.click(box["x"] + 0.5 * box["width"], box["y"] + 0.5 * box["height"])
    assert page.evaluate("page.time") == pytest.approx(0.5 * motion.times[-1], abs=0.005)

    # A click on a segment selects its joint.
    page.keyboard.press("Home")
    page.select_option("#row", label=curve.label)
    label = "document.querySelector('#row').selectedOptions[0].label"
    joint = f"page.motion.rows.find((row) => row.label === {label}).joint"
    assert page.evaluate(joint) == "left_knee"
    page.mouse.click(*body_middle(page))
    assert page.evaluate(joint) in ("waist", "root_torso")

    # Dark and light.
    background = "getComputedStyle(document.body).backgroundColor"
    before = page.evaluate(background)
    page.click("#theme")
    assert page.evaluate(background) != before


STRUCK = """[...document.querySelectorAll("#touches span")].filter((words) => {
    const text = words.getBoundingClientRect();
    return [...document.querySelectorAll("#touches span, #touches button")].some((other) => {
      const box = other.getBoundingClientRect();
      const middle = (box.left + box.right) / 2;
      const half = other.tagName === "BUTTON" ? 1 : box.width / 2;
      return other !== words && middle - half < text.right && middle + half > text.left
        && box.top < text.bottom && box.bottom > text.top;
    });
  }).map((words) => words.textContent)"""
"""Words of first touches that have a mark or other words across them."""


@pytest.mark.slow
def test_a_fall_fits_a_phone_a_tablet_and_a_laptop(open_file: Callable[..., Any], tmp_path: Path):
    """Figure, play button, and time line with its chart and marks are seen together."""
    plan = Plan(free_root=True, height=0.0, scene=Scene.floor(), stop=2.0)
    recording = simulate(Model.of(read_figure("male50")), plan)
    recording.write(tmp_path / "fall.html")
    assert (tmp_path / "fall.html").stat().st_size < 2_500_000
    page = open_file(tmp_path / "fall.html")
    wait_for(page, "page.triangles() > 1000")
    assert recording.contact is not None
    touches = page.evaluate("page.motion.touches")
    first = recording.contact.parts["left_foot"].first_time
    assert first in [one["time"] for one in touches if one["name"] == "left foot"]
    for width, height in WIDTHS:
        page.set_viewport_size({"width": width, "height": height})
        page.evaluate("window.scrollTo(0, 0)")
        chart = "document.querySelector('#force-plot .u-over').getBoundingClientRect()"
        wait_for(page, f"{chart}.right <= innerWidth && {chart}.right > innerWidth / 2")
        for part in ("#body", "#play", "#time", "#force-plot .u-over", "#touches", "#views"):
            box = page.locator(part).bounding_box()
            assert box["x"] >= 0.0, part
            assert box["y"] >= 0.0, part
            assert box["x"] + box["width"] <= width, part
            assert box["y"] + box["height"] <= height, part
        assert page.evaluate("document.documentElement.scrollWidth") == width
        assert page.locator("#body").bounding_box()["height"] >= 0.45 * height
        height_of_body = page.locator("#body").bounding_box()["height"]
        page.click("#about summary")
        assert page.locator("#body").bounding_box()["height"] == height_of_body
        page.click("#about summary")
        for part in ("#row", "#quantity"):
            box = page.locator(part).bounding_box()
            assert box["width"] > 150.0, part
            assert box["x"] + box["width"] <= width, part
        assert page.evaluate(STRUCK) == []
        # A mark stands at its time, below the same time of the chart.
        marks = page.locator("#touches button")
        assert 2 <= marks.count() <= len(touches)
        assert "foot" in page.inner_text("#touches") or "feet" in page.inner_text("#touches")
        marks.last.click()
        time = page.evaluate("page.time")
        assert any(abs(time - one["time"]) < 1e-9 for one in touches)
        cursor = page.locator("#force-plot .cursor").bounding_box()
        mark = marks.last.bounding_box()
        assert mark["x"] + 0.4 * 16 == pytest.approx(cursor["x"] + 1.0, abs=1.5)


@pytest.mark.slow
@pytest.mark.parametrize(("width", "theme"), [(390, "light"), (1366, "dark")])
def test_a_page_is_accessible(browser: Any, tmp_path: Path, width: int, theme: str):
    write(with_contact(clip("prototype")), tmp_path / "fall.html")
    assert_accessible(browser, tmp_path / "fall.html", width, theme)


@pytest.mark.slow
def test_views_forces_and_keys(open_file: Callable[..., Any], tmp_path: Path):
    motion = with_contact(clip("prototype"))
    write(motion, tmp_path / "fall.html")
    page = open_file(tmp_path / "fall.html")
    wait_for(page, "page.triangles() > 1000")
    pressed = "document.querySelector('#views [aria-pressed=true]').textContent"
    assert page.evaluate(pressed) == "Free"
    pictures = set()
    for name in ("Front", "Side", "Top"):
        page.get_by_role("button", name=name, exact=True).click()
        assert page.evaluate(pressed) == name
        page.wait_for_timeout(200)
        pictures.add(page.locator("#body").screenshot())
        assert body_fraction(page) > 0.005
    assert len(pictures) == 3
    box = page.locator("#body").bounding_box()
    page.mouse.move(box["x"] + 0.3 * box["width"], box["y"] + 0.5 * box["height"])
    page.mouse.down()
    page.mouse.move(box["x"] + 0.5 * box["width"], box["y"] + 0.6 * box["height"])
    page.mouse.up()
    assert page.evaluate(pressed) == "Free"

    # The chart of forces by part is one of those over time.
    labels = page.locator("#quantity option").all_inner_texts()
    assert "Contact forces [N]" in labels
    page.select_option("#quantity", label="Contact forces [N]")
    assert motion.recording is not None
    contact = motion.recording.contact
    assert contact is not None
    page.evaluate("time => page.seek(time)", float(motion.times[7]))
    expected = float(np.linalg.norm(contact.ground_reaction[7, :3]))
    said = page.inner_text("#force-reading")
    assert f"{expected / 1000.0:.3g} kN" in said or f"{expected:.0f} N" in said

    # By the keyboard alone, with a focus that is seen.
    page.evaluate("document.activeElement.blur()")
    reached = []
    for _ in range(20):
        page.keyboard.press("Tab")
        reached.append(page.evaluate("document.activeElement.id || document.activeElement.tagName"))
        assert page.evaluate("getComputedStyle(document.activeElement).outlineStyle") != "none"
    assert {"follow", "forces", "time", "play", "speed", "loop"} <= set(reached)
    page.focus("#time")
    page.keyboard.press("Home")
    assert page.evaluate("page.frame") == 0
    page.keyboard.press("ArrowRight")
    assert page.evaluate("page.frame") == 1
    page.keyboard.press("End")
    assert page.evaluate("page.time") == motion.times[-1]


@pytest.mark.slow
def test_props_and_forces_are_drawn(open_file: Callable[..., Any], tmp_path: Path):
    """Forces of the parts that are touched at a time, unless they are switched off."""
    motion = with_contact(clip("prototype"))
    write(motion, tmp_path / "fall.html")
    page = open_file(tmp_path / "fall.html")
    wait_for(page, "page.triangles() > 1000")
    assert page.evaluate("page.props()") == [
        ["floor", "plane"],
        ["crate", "box"],
        ["wall", "plane"],
    ]
    assert "on the floor" in page.inner_text("#scale")
    assert page.evaluate("page.forces()") == []
    page.evaluate("time => page.seek(time)", float(motion.times[5]))
    assert page.evaluate("page.forces()") == ["pelvis"]
    assert "Arrow of 10 cm: 200 N" in page.inner_text("#scale")
    with_forces = page.locator("#stage").screenshot()
    page.uncheck("#forces")
    assert page.evaluate("page.forces()") == []
    assert "Arrow" not in page.inner_text("#scale")
    page.wait_for_timeout(200)
    assert page.locator("#stage").screenshot() != with_forces


def test_a_page_of_a_pose_shows_it(open_file: Callable[..., Any], tmp_path: Path):
    motion = motion_from_figure(shipped("prototype"), bent(shipped("prototype")))
    write(motion, tmp_path / "pose.html")
    page = open_file(tmp_path / "pose.html")
    wait_for(page, "page.triangles() > 1000")
    expected = site(motion, "left_lower_leg", "distal")[0]
    found = site_pose(page, "left_lower_leg.distal")
    np.testing.assert_allclose(found[:3, 3], expected, atol=WITHIN)


def test_names_are_text_and_a_browser_without_webgl_says_so(
    open_file: Callable[..., Any], tmp_path: Path
):
    write(hostile_motion(), tmp_path / "out.html")
    without = """const original = HTMLCanvasElement.prototype.getContext;
    HTMLCanvasElement.prototype.getContext = function (kind, ...rest) {
      return kind.startsWith("webgl") ? null : original.call(this, kind, ...rest); };"""
    page = open_file(tmp_path / "out.html", without)
    assert "no WebGL 2" in page.inner_text("#notice")
    assert page.is_hidden("#body")
    assert page.inner_text("#title") == HOSTILE
    assert page.locator("img").count() == 0
    assert HOSTILE in page.inner_text("#row")
    page.keyboard.press("End")
    assert page.evaluate("page.frame") == 2
