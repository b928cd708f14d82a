"""Live simulation beside its page: `python -m benchmarks live-page`.

The prototype falls on a floor in the process of the page's simulation, while a browser without a
window draws the page by software. Simulated over wall time, frames a second of the page
(`requestAnimationFrame`) and CPU time by process are counted over some seconds; the rows with the
best frame rate of several rounds are kept. The engine alone advances as fast as it can.
"""

import os
import shutil
import tempfile
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from benchmarks import tables
from generator.figure_file.read import read_figure
from generator.input_files.live import LiveStart
from generator.kinematics.placement import forward_kinematics, initial_displacements
from generator.kinematics.tree import build_tree
from generator.springs_file.read import read_springs
from generator.viewer.live_panel import LivePanel
from generator.viewer.server import LOOPBACK, address, close_server, find_port, open_server
from generator.viewer.viewer import Content, Viewer

COMMAND = "python -m benchmarks live-page"

ROUNDS = 3
SPAN = 4.0
"""Wall time of a count [s]."""

FLOOR = -0.02
"""Height of the floor for the engine alone: below the feet, as on the page [m]."""

WAIT = 120.0
SIZES = {"1200 x 800": (1200, 800), "600 x 400": (600, 400)}

_BROWSERS = ("chromium", "chromium-browser", "google-chrome")
_ARGUMENTS = ["--no-sandbox", "--enable-unsafe-swiftshader", "--use-angle=swiftshader"]
_COUNT = """seconds => new Promise(done => { let frames = 0; const began = performance.now();
const count = now => { frames += 1; const taken = (now - began) / 1000;
if (taken < seconds) requestAnimationFrame(count); else done(frames / taken); };
requestAnimationFrame(count); })"""

Row = dict[str, object]


def engine_alone(figure_name: str) -> Row:
    """Advance the same fall for four simulated seconds, as fast as the engine can."""
    from generator.simulation.live.live_run import LiveRun

    best = 0.0
    for _ in range(ROUNDS):
        run = LiveRun(read_figure(figure_name), LiveStart(free_root=True, floor=FLOOR))
        began, first = time.perf_counter(), run.time
        for _ in range(240):
            if not run.advance().succeeded:
                break
        best = max(best, (run.time - first) / (time.perf_counter() - began))
    return _row("engine alone, not paced", best)


def _row(
    what: str,
    rate: float | None = None,
    frames: float | None = None,
    shares: Mapping[str, float] | None = None,
) -> Row:
    """Return a row of the table."""
    shares = shares or {}
    return {
        "page": what,
        "x real time": "" if rate is None else rate,
        "page frames [1/s]": "" if frames is None else frames,
        "cores of engine": shares.get("engine", ""),
        "cores of server": shares.get("server", ""),
        "cores of browser": shares.get("browser", ""),
    }


def _cpu_times() -> dict[int, tuple[int, float]]:
    """Return the parent and the CPU time [s] of each process."""
    times: dict[int, tuple[int, float]] = {}
    ticks = os.sysconf("SC_CLK_TCK")
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            fields = (folder / "stat").read_text().rpartition(")")[2].split()
        except OSError:
            continue
        times[int(folder.name)] = int(fields[1]), (int(fields[11]) + int(fields[12])) / ticks
    return times


def _cores(before: Any, after: Any, engine: int | None, seconds: float) -> dict[str, float]:
    """Return the cores used by engine, server (this process) and browser (its other children)."""
    own = os.getpid()
    shares = {"engine": 0.0, "server": 0.0, "browser": 0.0}
    for number, (_, used) in after.items():
        if number not in before:
            continue
        ancestor = number
        while ancestor not in (0, own, engine) and ancestor in after:
            ancestor = after[ancestor][0]
        if ancestor not in (own, engine):
            continue
        kind = "engine" if ancestor == engine else "server" if number == own else "browser"
        shares[kind] += (used - before[number][1]) / seconds
    return shares


class _Page:
    """A page whose loop runs in a thread."""

    def __init__(self, figure_name: str, folder: Path) -> None:
        figure = read_figure(figure_name)
        tree = build_tree(figure)
        placement = forward_kinematics(tree, initial_displacements(tree))
        content = Content(figure, read_springs(None, figure), placement, folder)
        self.server = open_server(LOOPBACK, find_port(LOOPBACK, None), figure_name)
        self.viewer = Viewer(self.server, content, (LivePanel,))
        (self.panel,) = self.viewer.panels
        assert isinstance(self.panel, LivePanel)
        self._thread = threading.Thread(target=self.viewer.run, daemon=True)
        self._thread.start()

    def close(self) -> None:
        self.viewer.stop()
        self._thread.join()
        self.viewer.close()
        close_server(self.server)


@contextmanager
def _browser() -> Iterator[Any]:
    from playwright.sync_api import sync_playwright

    program = next(filter(None, map(shutil.which, _BROWSERS)))
    with sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=program, args=_ARGUMENTS)
        yield browser
        browser.close()


def _wait(condition: Callable[[], object]) -> None:
    end = time.monotonic() + WAIT
    while not condition():
        if time.monotonic() > end:
            raise RuntimeError("the page did not do what it should in time")
        time.sleep(0.05)


def _measure(page: _Page, tab: Any, what: str) -> Row:
    """Count over some seconds."""
    panel: Any = page.panel
    frame = panel.newest
    start = 0.0 if frame is None else frame.time
    before, began = _cpu_times(), time.perf_counter()
    rate = tab.evaluate(_COUNT, SPAN)
    seconds = time.perf_counter() - began
    after, frame = _cpu_times(), panel.newest
    advanced = 0.0 if frame is None else frame.time - start
    shares = _cores(before, after, panel.process.process_id, seconds)
    return _row(what, advanced / seconds, rate, shares)


def main() -> None:
    """Print the table and write it."""
    rows = [engine_alone("prototype")]
    with tempfile.TemporaryDirectory() as folder, _browser() as browser:
        page = _Page("prototype", Path(folder))
        try:
            for size, (width, height) in SIZES.items():
                tab = browser.new_page(viewport={"width": width, "height": height})
                tab.goto(address(page.server, LOOPBACK))
                tab.wait_for_function("() => window.__viserMutable?.nodeRefFromName?.['/figure']")
                time.sleep(3.0)
                still = [_measure(page, tab, f"{size}, paused") for _ in range(ROUNDS)]
                if page.panel.newest is None:
                    tab.get_by_label("Preset", exact=True).first.click()
                    tab.get_by_role("option", name="Hang", exact=True).click()
                    tab.get_by_text("Floor and root").click()
                    tab.get_by_label("Floor", exact=True).click()
                    tab.get_by_label("Free root").click()
                runs: list[Row] = []
                for _ in range(ROUNDS):
                    tab.get_by_text("Reset", exact=True).click()
                    tab.get_by_text("Start", exact=True).click()
                    _wait(lambda: page.panel.newest is not None and page.panel.newest.time > 0.2)
                    runs.append(_measure(page, tab, f"{size}, running"))
                    tab.get_by_text("Pause", exact=True).click()
                    _wait(lambda: not page.panel.newest.is_running)
                tab.close()
                rows += [
                    max(each, key=lambda row: row["page frames [1/s]"]) for each in (still, runs)
                ]
        finally:
            page.close()
    tables.show(rows)
    tables.write("live_page", COMMAND, rows)
