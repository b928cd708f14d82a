"""A real browser without a window, and the nodes of a page's scene as the browser has them."""

import shutil
from collections.abc import Iterator, Set
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from urllib.request import HTTPCookieProcessor, build_opener

import numpy as np
import pytest

from generator.rotations import Array, matrix_from_quaternion, pose_matrix

BROWSERS = ("chromium", "chromium-browser", "google-chrome")

ARGUMENTS = [
    "--no-sandbox",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--enable-unsafe-swiftshader",
    "--use-angle=swiftshader",
]

WIDTHS = ((390, 844), (768, 1024), (1366, 768))
"""Widths and heights of a phone, a tablet and a laptop."""

WAIT = 120.0
"""Time after which a page that does not do what it should fails a test [s]."""


@contextmanager
def launch_browser() -> Iterator[Any]:
    """Start Chromium; skip the test where Playwright or Chromium is missing."""
    playwright = pytest.importorskip("playwright.sync_api", reason="Playwright is missing")
    program = next(filter(None, map(shutil.which, BROWSERS)), None)
    if program is None:
        pytest.skip(f"this machine has no browser: none of {', '.join(BROWSERS)}")
    with playwright.sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=program, args=ARGUMENTS)
        try:
            yield browser
        finally:
            browser.close()


CONTROLS = frozenset({"color-contrast", "button-name", "label", "select-name"})
"""Rules of axe that a page with buttons, fields and choices passes."""


def assert_accessible(
    browser: Any, path: Path, width: int, theme: str, rules: Set[str] = CONTROLS
) -> None:
    """Axe finds nothing serious on a page from disk, and reads what rules are about."""
    axe = pytest.importorskip("axe_playwright_python.sync_playwright", reason="axe is missing")
    viewport = {"width": width, "height": 800}
    context = browser.new_context(viewport=viewport, offline=True, color_scheme=theme)
    tab = context.new_page()
    tab.goto(path.as_uri())
    tab.evaluate("page.ready")
    tab.evaluate("for (const each of document.querySelectorAll('details')) each.open = true")
    found = axe.Axe().run(tab).response
    context.close()
    passed = {rule["id"] for rule in found["passes"]}
    assert rules <= passed
    faults = [rule for rule in found["violations"] if rule["impact"] in ("serious", "critical")]
    assert [rule["id"] for rule in faults] == []


@contextmanager
def offline_page(browser: Any, path: Path, width: int, height: int) -> Iterator[Any]:
    """Open a page from disk without a network; its console is silent, and it asks for no more."""
    context = browser.new_context(viewport={"width": width, "height": height}, offline=True)
    said: list[str] = []
    asked: list[str] = []
    tab = context.new_page()
    tab.on("console", lambda message: said.append(message.text))
    tab.on("pageerror", lambda failure: said.append(str(failure)))
    tab.on("dialog", lambda dialog: said.append(dialog.message))
    tab.on("request", lambda request: asked.append(request.url))
    tab.goto(path.as_uri())
    tab.evaluate("page.ready")
    yield tab
    context.close()
    assert said == []
    assert asked == [path.as_uri()]


def go_to_page(tab: Any, address: str) -> None:
    """Open the address of a page, which leads to one without its key."""
    tab.goto(address)
    tab.wait_for_url(address.partition("?")[0])


def open_address(address: str) -> bytes:
    """Return what a client with cookies gets from the address of a page, and then without key."""
    client = build_opener(HTTPCookieProcessor())
    with client.open(address, timeout=30.0) as entrance:
        entrance.read()
    with client.open(address.partition("?")[0], timeout=30.0) as answer:
        return answer.read()


class PageClient:
    """A program that does what a page does: it opens the address and sets controls."""

    def __init__(self, address: str) -> None:
        """Open the websocket of a page with the key of its address."""
        import viser
        from websockets.sync.client import connect

        where = address.replace("http://", "ws://", 1)
        self._socket = connect(where, subprotocols=[f"viser-v{viser.__version__}"],
                               compression=None, proxy=None)  # fmt: skip
        self._controls: dict[str, str] = {}
        self.send(
            type="ViewerCameraMessage", wxyz=(1.0, 0.0, 0.0, 0.0), position=(0.0, 1.0, 3.0),
            fov=0.7, near=0.01, far=1e3, image_height=800, image_width=1200,
            look_at=(0.0, 1.0, 0.0), up_direction=(0.0, 1.0, 0.0),
        )  # fmt: skip

    def send(self, **message: Any) -> None:
        """Send a message."""
        import msgspec

        self._socket.send(msgspec.msgpack.encode(message))

    def set(self, label: str, value: Any) -> None:
        """Set the control with a label; the value of a button is True."""
        while label not in self._controls:
            self._receive()
        self.send(type="GuiUpdateMessage", uuid=self._controls[label], updates={"value": value})

    def _receive(self) -> None:
        """Take a message of the server: two lengths, compressed messages, and arrays."""
        import msgspec
        import zstandard

        frame = self._socket.recv(WAIT)
        size = int.from_bytes(frame[8:16], "little")
        window = msgspec.msgpack.decode(zstandard.decompress(frame[16 : 16 + size]))
        for message in window["messages"]:
            if message["type"].startswith("Gui") and "label" in message.get("props", ()):
                self._controls[message["props"]["label"]] = message["uuid"]

    def close(self) -> None:
        """Leave the page."""
        self._socket.close()


def node_pose(page: Any, name: str) -> Array | None:
    """Return the pose in its parent that the browser has for a node, shape (4, 4), or None."""
    found = page.evaluate(
        """name => { const node = window.__viserMutable?.nodeRefFromName?.[name];
        return node ? [node.position.toArray(), node.quaternion.toArray()] : null; }""",
        name,
    )
    if found is None:
        return None
    position, (x, y, z, w) = found
    return pose_matrix(matrix_from_quaternion(np.array([w, x, y, z])), np.array(position))
