"""The loop of the viewer and its errors; two browsers; text that is not markup."""

import threading
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from generator import read_figure
from generator.diagnostics import InputError, UsageError
from generator.input_files.pose import POSE_FILE
from generator.kinematics.placement import forward_kinematics, initial_displacements
from generator.kinematics.tree import build_tree
from generator.rotations import matrix_from_rotation_vector, pose_matrix
from generator.viewer.panels import PANELS
from generator.viewer.scene import node_name
from generator.viewer.viewer import (
    Content,
    Driver,
    FigureState,
    Panel,
    Viewer,
    error_text,
    html_lines,
    value_in_range,
)
from springs import SpringSet
from tests.browser import WAIT, go_to_page, node_pose
from tests.chains import BALL, at, body, figure, ground, joint
from tests.generator.viewer.conftest import wait_until


def append_all(running: Any, keys: str) -> list[int]:
    """Post an action with each key while the loop waits; return the numbers of those it took.

    A key is a letter, or a dot for none.
    """
    taken: list[int] = []
    entered, release = threading.Event(), threading.Event()

    def wait() -> None:
        entered.set()
        assert release.wait(WAIT)

    running.viewer.post(wait)
    assert entered.wait(WAIT)
    for number, key in enumerate(keys):
        running.viewer.post(lambda number=number: taken.append(number), None if key == "." else key)
    release.set()
    running.call(lambda: None)
    return taken


def test_of_consecutive_actions_with_one_key_the_last_is_taken(run_viewer):
    running = run_viewer("fourbar", ())
    assert append_all(running, "aaab..aba") == [2, 3, 4, 5, 6, 7, 8]
    assert append_all(running, "a" * 1000) == [999]
    assert append_all(running, "....") == [0, 1, 2, 3]


def fail(failure: Exception) -> None:
    raise failure


@given(st.floats(allow_nan=False), st.floats(-1e3, 1e3), st.floats(0.0, 1e3))
def test_the_value_of_a_control_is_in_its_range(value: float, low: float, width: float):
    control = SimpleNamespace(value=value, min=low, max=low + width)
    found = value_in_range(control)
    assert low <= found <= low + width
    assert found == value or not low <= value <= low + width


def test_an_error_in_a_file_is_one_line_without_the_folder(tmp_path: Path):
    file = tmp_path / "bad.pose"
    file.write_text("joint knee { displacement = (3deg); }\njoint hip { }\n")
    with pytest.raises(InputError) as failure:
        POSE_FILE.parse_file(file, read_figure("prototype")).require_value()
    text = error_text(failure.value, tmp_path)
    assert text.startswith("bad.pose:1:7: the figure has no joint `knee`")
    assert text.endswith("; 1 more error")
    assert "\n" not in text
    assert error_text(UsageError("a name is missing"), tmp_path) == "a name is missing"


def test_an_error_is_told_and_the_loop_goes_on(run_viewer, monkeypatch, capfd):
    running = run_viewer("fourbar", ())
    messages: list[tuple[str, str, bool]] = []
    monkeypatch.setattr(
        running.viewer,
        "notify",
        lambda title, text, *, is_error: messages.append((title, text, is_error)),
    )
    running.viewer.post(lambda: fail(UsageError("the file is missing")))
    running.viewer.post(lambda: fail(ZeroDivisionError("by zero")))
    assert running.call(lambda: 7) == 7
    assert messages == [
        ("Error", "the file is missing", True),
        ("Internal error", "ZeroDivisionError: by zero", True),
    ]
    error = capfd.readouterr().err
    assert "Traceback" in error
    assert "the file is missing" not in error


class FailingPanel(Panel):
    """A panel whose tick fails once."""

    title = "Failing"
    failures = 1

    def tick(self, now: float) -> None:
        if self.failures:
            self.failures -= 1
            raise UsageError("the tick failed")


class CountingPanel(Panel):
    """A panel that counts its ticks and follows the rest."""

    title = "Counting"
    ticks = 0

    def build(self) -> None:
        self.selections: list[tuple[str | None, str | None]] = []
        self.springs: list[SpringSet] = []

    def selection_changed(self, segment: str | None, joint: str | None) -> None:
        self.selections.append((segment, joint))

    def springs_changed(self, springs: SpringSet) -> None:
        self.springs.append(springs)

    def tick(self, now: float) -> None:
        self.ticks += 1


def test_a_panel_that_fails_does_not_stop_the_others(run_viewer, monkeypatch):
    monkeypatch.setattr(Viewer, "notify", lambda *_args, **_named: None)
    running = run_viewer("fourbar", (FailingPanel, CountingPanel))
    failing, counting = running.viewer.panels
    wait_until(lambda: failing.failures == 0 and counting.ticks > 3)


def test_panels_follow_selections_and_springs(run_viewer):
    running = run_viewer("prototype", (CountingPanel,))
    viewer, (panel,) = running.viewer, running.viewer.panels
    running.call(lambda: viewer.select_segment("left_lower_leg"))
    running.call(lambda: viewer.select_joint("right_elbow"))
    running.call(viewer.deselect)
    assert panel.selections == [
        ("left_lower_leg", "left_knee"),
        (viewer.figure.joints["right_elbow"].child.segment, "right_elbow"),
        (None, "right_elbow"),
    ]
    springs = replace(viewer.springs)
    running.call(lambda: viewer.set_springs(springs))
    assert panel.springs == [springs]
    assert viewer.springs is springs


def test_a_value_that_the_program_sets_is_not_an_event(run_viewer):
    running = run_viewer("fourbar", ())
    callbacks: list[Any] = []
    events: list[Any] = []
    running.viewer.listen(callbacks.append, events.append)
    (notify,) = callbacks
    by_user = SimpleNamespace(client=object())
    for event in (SimpleNamespace(client=None), by_user):
        with pytest.raises(StopIteration):  # a coroutine that waits for nothing
            notify(event).send(None)
    running.call(lambda: None)
    assert events == [by_user]


@given(lines=st.lists(st.text(), min_size=1, max_size=3))
def test_lines_as_html_have_no_markup_of_their_own(lines: list[str]):
    inner = html_lines(lines).removesuffix("</div>").split(">", 1)[1]
    assert "<" not in inner.replace("<br>", "")
    assert inner.count("<br>") == len(lines) - 1


def test_two_browsers_show_one_pose_and_ask_no_other_host(run_viewer, browser):
    running = run_viewer("prototype")
    requests: list[str] = []
    context = browser.new_context(viewport={"width": 600, "height": 400})
    context.on("request", lambda request: requests.append(request.url))
    pages = [context.new_page() for _ in range(2)]
    for page in pages:
        page.on("websocket", lambda opened: requests.append(opened.url))
        go_to_page(page, running.address)
    viewer, first = running.viewer, running.viewer.shown
    turn = pose_matrix(matrix_from_rotation_vector(np.array([0.1, 0.4, -0.2])), np.ones(3))
    poses = {name: turn @ pose for name, pose in first.poses.items()}
    running.call(lambda: viewer.show(FigureState(Driver.POSE, first.displacements, poses)))
    for page in pages:
        for segment in viewer.scene.meshes:
            node, pose = node_name(segment), poses[segment]
            wait_until(
                lambda page=page, node=node, pose=pose: (
                    (found := node_pose(page, node)) is not None
                    and np.abs(found - pose).max() < 1e-6
                )
            )
    pages[0].close()  # a browser that leaves does not disturb the other
    running.call(lambda: viewer.show(first))
    node = node_name("left_lower_leg")
    wait_until(
        lambda: np.abs(node_pose(pages[1], node) - first.poses["left_lower_leg"]).max() < 1e-6
    )
    port = running.server.get_port()
    own = (f"http://127.0.0.1:{port}", f"ws://127.0.0.1:{port}", "data:", "blob:")
    assert len(requests) >= 4
    assert [url for url in requests if not url.startswith(own)] == []
    context.close()


def long_chain(count: int, folder: Path) -> Content:
    """The content of a page of a chain of segments without psurfs."""
    segments, joints, before = [ground()], [], "ground.base"
    for k in range(count):
        sites = {"far": at(shift=(0.0, 0.1, 0.0))}
        segments.append(body(f"s{k}", mass=0.5, centre=(0.0, 0.05, 0.0), sites=sites))
        joints.append(joint(f"j{k}", before, f"s{k}.near", BALL, (0.02, 0.0, 0.01)))
        before = f"s{k}.far"
    made = figure(segments, joints)
    tree = build_tree(made)
    placement = forward_kinematics(tree, initial_displacements(tree))
    return Content(made, SpringSet({}), placement, folder)


def test_a_figure_of_160_segments_has_its_page(run_viewer, monkeypatch, tmp_path):
    told: list[object] = []
    monkeypatch.setattr(Viewer, "notify", lambda _viewer, *texts, **_named: told.append(texts))
    running = run_viewer(long_chain(160, tmp_path), PANELS)
    viewer = running.viewer
    assert len(viewer.scene.meshes) == 160
    running.call(lambda: viewer.select_segment("s159"))
    running.call(lambda: viewer.show(viewer.shown))
    running.call(lambda: None)
    assert told == []
