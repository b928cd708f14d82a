"""Pages of a viewer that runs in this process, in a browser without a window."""

import socket
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("viser", reason="viser is missing")

import viser
from websockets.sync.client import connect
from websockets.typing import Subprotocol

from generator import read_figure
from generator.kinematics.placement import forward_kinematics, initial_displacements
from generator.kinematics.tree import build_tree
from generator.springs_file.read import read_springs
from generator.viewer.access import cookie_name
from generator.viewer.panels import PANELS
from generator.viewer.server import (
    LOOPBACK,
    PageServer,
    address,
    close_server,
    find_port,
    open_server,
)
from generator.viewer.viewer import Content, Panel, Viewer
from tests.browser import WAIT, go_to_page, launch_browser

SUBPROTOCOL = Subprotocol(f"viser-v{viser.__version__}")


@pytest.fixture(scope="session")
def browser() -> Iterator[Any]:
    with launch_browser() as browser:
        yield browser


def content_of(name: str, folder: Path) -> Content:
    """Return the content of a page of a figure in the pose of its file."""
    figure = read_figure(name)
    tree = build_tree(figure)
    placement = forward_kinematics(tree, initial_displacements(tree))
    return Content(figure, read_springs(None, figure), placement, folder, title=name)


def opened(host: str) -> Iterator[PageServer]:
    """Open the server of a page, and close it at the end."""
    server = open_server(host, find_port(host, None), "title")
    yield server
    close_server(server)


@pytest.fixture(scope="module")
def server() -> Iterator[PageServer]:
    yield from opened(LOOPBACK)


@pytest.fixture(scope="module")
def open_to_all() -> Iterator[PageServer]:
    yield from opened("0.0.0.0")


class RunningViewer:
    """A viewer whose loop runs in a thread."""

    def __init__(self, content: Content, panels: Sequence[Callable[[Viewer], Panel]]) -> None:
        self.server = open_server(LOOPBACK, find_port(LOOPBACK, None), content.title)
        self.viewer = Viewer(self.server, content, panels)
        self.address = address(self.server, LOOPBACK)
        self._thread = threading.Thread(target=self.viewer.run, daemon=True)
        self._thread.start()

    def call(self, action: Callable[[], Any]) -> Any:
        """Return the value of an action that is called in the loop of the viewer."""
        done, values = threading.Event(), []

        def act() -> None:
            try:
                values.append(action())
            finally:
                done.set()

        self.viewer.post(act)
        assert done.wait(WAIT)
        return values[0]

    def close(self) -> None:
        self.viewer.stop()
        self._thread.join(WAIT)
        self.viewer.close()
        close_server(self.server)


@pytest.fixture
def run_viewer(tmp_path: Path) -> Iterator[Callable[..., RunningViewer]]:
    """Start viewers of figures or contents; they end with the test."""
    running: list[RunningViewer] = []

    def start(content: "Content | str" = "prototype", panels: Any = PANELS) -> RunningViewer:
        made = content_of(content, tmp_path) if isinstance(content, str) else content
        running.append(RunningViewer(made, panels))
        return running[-1]

    yield start
    for each in running:
        each.close()


@pytest.fixture
def open_page(browser: Any) -> Iterator[Callable[[RunningViewer], Any]]:
    """Open the page of a viewer in the browser, and wait until the figure is there."""
    contexts: list[Any] = []

    def open_one(running: RunningViewer) -> Any:
        contexts.append(browser.new_context(viewport={"width": 1200, "height": 800}))
        page = contexts[-1].new_page()
        page.set_default_timeout(1000.0 * WAIT)
        go_to_page(page, running.address)
        page.wait_for_function(
            "() => window.__viserMutable?.nodeRefFromName?.['/figure']", timeout=1000.0 * WAIT
        )
        return page

    yield open_one
    for context in contexts:
        context.close()


def wait_until(condition: Callable[[], Any], limit: float = WAIT) -> Any:
    """Return the first true value of a condition; fail after a time [s]."""
    end = time.monotonic() + limit
    while not (value := condition()):
        assert time.monotonic() < end, "the condition did not become true in time"
        time.sleep(0.02)
    return value


def type_into(page: Any, label: str, text: str) -> None:
    """Type into the first field after a label: of a slider, the one beside it."""
    field = page.get_by_text(label, exact=True).locator(
        "xpath=following::input[not(@type='hidden')][1]"
    )
    field.fill(text)
    field.press("Enter")


def own_headers(server: PageServer, host: str = LOOPBACK) -> dict[str, str]:
    """Headers of a request of the page itself."""
    port = server.get_port()
    return {
        "Host": f"{host}:{port}",
        "Origin": f"http://{host}:{port}",
        "Cookie": f"other=1; {cookie_name(port)}={server.access.key}",
    }


def open_websocket(server: PageServer, headers: Mapping[str, str], path: str = "/") -> Any:
    """Open a websocket as the page does. Raises InvalidStatus if it is refused."""
    others = {name: value for name, value in headers.items() if value and name != "Host"}
    own = {"Host": headers.get("Host", "")}
    address = f"ws://{own['Host'] or LOOPBACK}{path}"
    connected = socket.create_connection((LOOPBACK, server.get_port()), timeout=WAIT)
    return connect(address, sock=connected, subprotocols=[SUBPROTOCOL],
                   additional_headers=others, compression=None, proxy=None)  # fmt: skip
