"""Draws the pictures of the page: docs/pictures/view_*.png and docs/pictures/page.png.

A real browser without a window opens the pages. Run with `python -m docs.pictures.view` in the
project's folder, with the extras `viewer` and `test`.
"""

import time
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory
from threading import Thread
from typing import Any

from generator.cli.view import load_inputs
from generator.viewer.panels import ordered_panels
from generator.viewer.server import LOOPBACK, address, close_server, find_port, open_server
from generator.viewer.viewer import Content, Viewer
from tests.browser import go_to_page, launch_browser

FOLDER = Path(__file__).parent
SIZE = {"width": 1280, "height": 860}
SETTLING_TIME = 2500.0
"""Time until the page is drawn after a change [ms]."""

ARMS = """figure = "prototype"

[[spring]]
joints = ["left_elbow", "right_elbow"]
motion = "flexion"
stiffness_Nm_rad = 230
viscous_Nms_rad = 0.08
"""


def draw(
    browser: Any, name: str, path: Path, act: Callable[[Any, Viewer], None], folder: Path
) -> None:
    """Open the page of a file, act on it, and take its picture."""
    inputs = load_inputs(path, None, None, None, None)
    content = Content(
        inputs.figure,
        inputs.springs,
        inputs.placement,
        folder,
        inputs.motion,
        title=path.name,
        springs_choice=inputs.springs_choice,
    )
    server = open_server(LOOPBACK, find_port(LOOPBACK, None), content.title)
    viewer = Viewer(server, content, ordered_panels(content))
    Thread(target=viewer.run, daemon=True).start()
    page = browser.new_page(viewport=SIZE)
    try:
        go_to_page(page, address(server, LOOPBACK))
        page.wait_for_timeout(SETTLING_TIME)
        page.locator(".mantine-Notification-closeButton").first.click()
        act(page, viewer)
        page.mouse.move(5, 5)
        page.wait_for_timeout(SETTLING_TIME)
        page.screenshot(path=FOLDER / f"{name}.png", timeout=120e3)
    finally:
        page.close()
        viewer.stop()
        viewer.close()
        close_server(server)


def open_tab(page: Any, name: str) -> None:
    """Open a tab of the controls."""
    page.get_by_role("tab", name=name).click()
    page.wait_for_timeout(500.0)


def press(page: Any, name: str) -> None:
    """Press a button, without the wait of a click for a page that stands still."""
    page.get_by_role("button", name=name, exact=True).evaluate("button => button.click()")


def wait_for_time(viewer: Viewer, moment: float) -> None:
    """Wait until the page shows a moment of a motion [s]."""
    end = time.monotonic() + 120.0
    while time.monotonic() < end and (viewer.shown.time or 0.0) < moment:
        time.sleep(0.005)


def choose(page: Any, control: str, option: str) -> None:
    """Choose an entry of a list."""
    page.get_by_label(control, exact=True).locator("visible=true").first.click()
    page.get_by_role("option", name=option, exact=True).click()
    page.wait_for_timeout(500.0)


def tick(page: Any, control: str) -> None:
    """Tick a box."""
    page.get_by_role("checkbox", name=control, exact=True).click()
    page.wait_for_timeout(500.0)


def enter(page: Any, control: str, text: str) -> None:
    """Type into a field."""
    field = page.get_by_label(control).locator("visible=true").first
    field.fill(text)
    field.press("Enter")
    page.wait_for_timeout(500.0)


def show_curve(page: Any, viewer: Viewer) -> None:
    """Mend the elbows of the tutorial."""
    open_tab(page, "Curve")
    choose(page, "Joint", "Left elbow")
    tick(page, "Both sides")
    enter(page, "Stiffness", "2.3")


def show_pose(page: Any, viewer: Viewer) -> None:
    """Bend an elbow by its slider, and put arrows on the hand."""
    choose(page, "Segment", "left_hand")
    for joint in ("Left shoulder", "Left elbow"):
        page.get_by_text(joint, exact=True).first.click()
        page.wait_for_timeout(500.0)
    after = "xpath=following::input[not(@type='hidden')][1]"
    labels = page.get_by_text("Flexion [deg]", exact=True).locator("visible=true")
    for number, angle in enumerate(("50", "75")):
        field = labels.nth(number).locator(after)
        field.fill(angle)
        field.press("Enter")


def show_balance(page: Any, viewer: Viewer) -> None:
    """Turn the balance and an ellipsoid on, in a pose that leans."""
    open_tab(page, "Body")
    tick(page, "Balance")
    choose(page, "Segment", "left_upper_leg")
    tick(page, "Inertia ellipsoid")


def show_fall(page: Any, viewer: Viewer) -> None:
    """Let the figure fall and stop it before it lies."""
    open_tab(page, "Live")
    press(page, "Start")
    wait_for_time(viewer, 0.8)
    press(page, "Pause")
    open_tab(page, "Curve")
    choose(page, "Joint", "Left knee")


def show_motion(page: Any, viewer: Viewer) -> None:
    """Stop a motion in its midst."""
    choose(page, "Joint", "Left hip")
    after = "xpath=following::input[not(@type='hidden')][1]"
    field = page.get_by_text("Frame", exact=True).locator(after)
    field.fill("40")
    field.press("Enter")
    wait_for_time(viewer, 0.8)


def draw_page(browser: Any, name: str, path: Path) -> None:
    """Open the page of a motion from the disk, and take its picture at 0.8 s."""
    page = browser.new_page(viewport=SIZE)
    page.goto(path.as_uri())
    page.wait_for_timeout(SETTLING_TIME)
    page.evaluate("() => page.ready.then(() => page.seek(0.8))")
    page.wait_for_timeout(SETTLING_TIME)
    page.screenshot(path=FOLDER / f"{name}.png", timeout=120e3)
    page.close()


def main() -> None:
    """Draw all pictures."""
    from generator import Plan, read_figure, simulate
    from generator.contact.scene import Scene

    with TemporaryDirectory() as name, launch_browser() as browser:
        folder = Path(name)
        (folder / "arms.springs.toml").write_text(ARMS, encoding="utf-8")
        figure = read_figure("male50")
        plan = Plan(stop=2.0, free_root=True, height=0.0, scene=Scene.floor())
        recording = simulate(figure, plan)
        recording.write(folder / "fall.npz")
        recording.write(folder / "fall.html")
        draw_page(browser, "page", folder / "fall.html")
        draw(browser, "view_curve", folder / "arms.springs.toml", show_curve, folder)
        draw(browser, "view_pose", Path("male50"), show_pose, folder)
        draw(browser, "view_balance", Path("male50"), show_balance, folder)
        draw(browser, "view_live", Path("male50"), show_fall, folder)
        draw(browser, "view_play", folder / "fall.npz", show_motion, folder)


if __name__ == "__main__":
    main()
