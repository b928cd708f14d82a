"""A real browser without a window, and the nodes of a page's scene as the browser has them."""

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
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


def open_address(address: str) -> bytes:
    """Return what a client with cookies gets from the address of a page."""
    with build_opener(HTTPCookieProcessor()).open(address, timeout=30.0) as answer:
        return answer.read()


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
