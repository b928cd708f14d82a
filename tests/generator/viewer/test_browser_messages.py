"""What a browser may send: values, clicks, drags and the camera, and nothing else."""

import math
import socket
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st
from viser import _messages
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection

from generator.viewer import browser_messages
from generator.viewer.access import MAX_FRAME
from generator.viewer.live_panel import LivePanel
from generator.viewer.play_panel import PlayPanel
from generator.viewer.pose_panel import PosePanel
from generator.viewer.viewer import Viewer
from tests.generator.viewer.conftest import open_websocket, own_headers, wait_until

VECTOR, QUATERNION, PAIR = (0.5, 1.0, -2.0), (1.0, 0.0, 0.0, 0.0), (0.25, 0.75)

SENT = [
    _messages.GuiUpdateMessage("0", {"value": 1.5}),
    _messages.ViewerCameraMessage(QUATERNION, VECTOR, 0.7, 0.01, 1e3, 800, 1200, VECTOR, VECTOR),
    _messages.SceneNodeClickMessage("/figure/a", None, VECTOR, VECTOR, PAIR, None),
    _messages.SceneNodeDragMessage(
        "update", "/figure/a", None, VECTOR, PAIR, VECTOR, PAIR, "left", "shift"
    ),
    _messages.TransformControlsUpdateMessage("/arrows", QUATERNION, VECTOR),
    _messages.TransformControlsDragStartMessage("/arrows"),
    _messages.TransformControlsDragEndMessage("/arrows"),
]
"""Messages of a page, as viser defines them."""

CAMERA = SENT[1].as_serializable_dict()


def encoded(message: Any) -> bytes:
    return msgspec.msgpack.encode(message)


def control(value: Any, **others: Any) -> Any:
    return SimpleNamespace(label="Control", value=value, **others)


def value_error(present: Any, value: Any) -> str:
    """Sentence about a value of a control; empty if it takes it."""
    frame = encoded({"type": "GuiUpdateMessage", "uuid": "0", "updates": {"value": value}})
    try:
        browser_messages.check_message(frame, lambda _: present)
    except browser_messages.ValueOfControlError as failure:
        return str(failure)
    return ""


@pytest.mark.parametrize("message", SENT, ids=lambda each: type(each).__name__)
def test_messages_of_a_page_are_taken(message: Any):
    frame = encoded(message.as_serializable_dict())
    browser_messages.check_message(frame, lambda _: None)
    assert type(_messages.Message.deserialize(frame)) is type(message)


@pytest.mark.parametrize(
    "message",
    [
        [1, 2],
        3,
        {},
        {"type": 3},
        {"type": "NoSuchMessage"},
        {"type": "Message"},
        {"type": "ShareUrlRequest"},
        {"type": "ResetGuiMessage"},
        {
            "type": "FileTransferStartUpload", "source_component_uuid": "0", "transfer_uuid": "1",
            "filename": "a", "mime_type": "a", "part_count": 9999, "size_bytes": 10**9,
        },
        {
            "type": "FileTransferPart", "source_component_uuid": "0", "transfer_uuid": "1",
            "part_index": 0, "content": b"a",
        },
        {"type": "GuiUpdateMessage", "uuid": "0", "updates": {"disabled": True}},
        {"type": "GuiUpdateMessage", "uuid": "0", "updates": {"value": 1.0, "visible": False}},
        {"type": "GuiUpdateMessage", "uuid": "0", "updates": {}},
        {"type": "GuiUpdateMessage", "uuid": "0", "updates": {"value": None}},
        {"type": "GuiUpdateMessage", "uuid": "0", "updates": {"value": {"a": 1}}},
        {"type": "GuiUpdateMessage", "uuid": 5, "updates": {"value": 1.0}},
        {**CAMERA, "position": (0.0, math.nan, 0.0)},
        {**CAMERA, "position": (0.0, 1.0)},
        {**CAMERA, "fov": math.inf},
        {**CAMERA, "image_width": -1},
        {**CAMERA, "image_width": 10**9},
    ],
)  # fmt: skip
def test_other_messages_are_refused(message: Any):
    with pytest.raises(browser_messages.MessageError):
        browser_messages.check_message(encoded(message), lambda _: control(1.0))


@given(st.binary(max_size=200) | st.text(max_size=50))
def test_no_frame_causes_another_error(frame: bytes | str):
    with pytest.raises(browser_messages.MessageError):
        browser_messages.check_message(frame, lambda _: None)


@pytest.mark.parametrize("opcode", [b"\x91", b"\x81\xa4type", b"\x81\xa1a"])
def test_deeply_nested_frames_are_refused(opcode: bytes):
    with pytest.raises(browser_messages.MessageError):
        browser_messages.check_message(opcode * (MAX_FRAME // len(opcode)), lambda _: None)


@given(st.floats() | st.integers(-(2**63), 2**63 - 1), st.sampled_from([1, 0.5]))
def test_a_number_field_takes_finite_numbers(value: float, present: float):
    said = value_error(control(present), value)
    assert said == ("" if math.isfinite(value) else f"`Control` needs a finite number, not {value}")


@pytest.mark.parametrize(
    ("present", "value", "said"),
    [
        (control(1.5), "1", "`Control` needs a number"),
        (control(1.5), True, "`Control` needs a number"),
        (control(True), 1, "`Control` is either on or off"),
        (control(True), False, ""),
        (control("a"), 1, "`Control` needs a text"),
        (control("a"), "anything", ""),
        (control("a", options=("a", "b")), "b", ""),
        (control("a", options=("a", "b")), "c", "`Control` has no option `c`"),
        (control(1.5), (1.0, 2.0), "`Control` needs a number"),
        (control(None), 1.0, "`Control` cannot be changed"),
        (None, "a control that was removed", ""),
    ],
)
def test_a_control_takes_values_of_its_kind(present: Any, value: Any, said: str):
    assert value_error(present, value) == said


class Client:
    """A client that sends what no page sends."""

    def __init__(self, running: Any) -> None:
        self.server = running.server
        self.socket: ClientConnection = open_websocket(self.server, own_headers(self.server))
        self.socket.send(encoded(CAMERA))
        wait_until(lambda: self.server.get_clients())

    def set(self, handle: Any, **updates: Any) -> None:
        uuid = handle._impl.uuid
        self.socket.send(encoded({"type": "GuiUpdateMessage", "uuid": uuid, "updates": updates}))


@pytest.fixture
def told(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Messages in the corner of the page."""
    texts: list[str] = []
    monkeypatch.setattr(Viewer, "notify", lambda _self, _title, text, **_: texts.append(text))
    return texts


def test_values_that_are_no_numbers_are_said_on_the_page(
    run_viewer: Callable[..., Any], told: list[str], capfd: pytest.CaptureFixture[str]
):
    running = run_viewer("pendulum", (LivePanel, PosePanel, PlayPanel))
    live, pose, play = running.viewer.panels
    client = Client(running)
    handles = [live._gravity, live._height, next(iter(pose.sliders.values())), play._slider]
    before = [handle.value for handle in handles]
    for handle in handles:
        for value in (math.nan, math.inf, -math.inf, "much"):
            client.set(handle, value=value)
    client.set(play._site, value="no such site")
    client.set(live._file, value="after.action")
    wait_until(lambda: live._file.value == "after.action")
    running.call(lambda: None)
    assert [handle.value for handle in handles] == before
    assert [text for text in told if "Gravity" in text] == [
        "`Gravity [m/s2]` needs a finite number, not nan",
        "`Gravity [m/s2]` needs a finite number, not inf",
        "`Gravity [m/s2]` needs a finite number, not -inf",
        "`Gravity [m/s2]` needs a number",
    ]
    assert len(told) == 4 * len(handles) + 1
    assert capfd.readouterr().err == ""


def test_no_browser_disables_controls_for_all(
    run_viewer: Callable[..., Any], capfd: pytest.CaptureFixture[str]
):
    running = run_viewer("pendulum", (LivePanel,))
    (live,) = running.viewer.panels
    client = Client(running)
    for updates in (
        {"removed": True},  # what viser keeps of a control, by which it ignores later messages
        {"update_cb": []},
        {"is_button": True},
        {"disabled": True},
        {"value": 1.0, "removed": True},
    ):
        client.set(live._gravity, **updates)
    Client(running).set(live._gravity, value=1.5)
    wait_until(lambda: live._gravity.value == 1.5)
    assert not live._gravity.disabled
    lines = capfd.readouterr().err.splitlines()
    assert len(lines) == 5
    assert all(line.startswith("page: a message of a browser was refused: ") for line in lines)


@pytest.mark.parametrize(
    "frame",
    [
        b"\xc1",
        b"",
        "text",
        encoded({"type": "NoSuchMessage"}),
        encoded({**CAMERA, "no_such_field": 1}),
        encoded(SENT[3].as_serializable_dict() | {"name": "/no such node"}),
        bytes(MAX_FRAME + 1),
    ],
    ids=["damaged", "empty", "text", "unknown", "unknown field", "unknown node", "huge"],
)
def test_a_frame_that_no_page_sends_costs_at_most_a_line(
    run_viewer: Callable[..., Any], frame: bytes | str, capfd: pytest.CaptureFixture[str]
):
    running = run_viewer("pendulum", (LivePanel,))
    (live,) = running.viewer.panels
    client = Client(running)
    client.socket.send(frame)
    if not isinstance(frame, bytes) or len(frame) <= MAX_FRAME:
        client.socket.send(frame)
    other = Client(running)  # the server goes on
    other.set(live._file, value="after.action")
    wait_until(lambda: live._file.value == "after.action")
    lines = capfd.readouterr().err.splitlines()
    assert len(lines) <= 2
    assert all(line.startswith("page: ") for line in lines)


def test_uploads_leave_nothing_in_memory(run_viewer: Callable[..., Any]):
    running = run_viewer("pendulum", (LivePanel,))
    (live,) = running.viewer.panels
    client = Client(running)
    start = _messages.FileTransferStartUpload(live._file._impl.uuid, "1", "a", "a", 100, 10**8)
    client.socket.send(encoded(start.as_serializable_dict()))
    part = _messages.FileTransferPart(live._file._impl.uuid, "1", 0, bytes(1000))
    client.socket.send(encoded(part.as_serializable_dict()))
    client.set(live._file, value="after.action")
    wait_until(lambda: live._file.value == "after.action")
    assert not running.server.gui._current_file_upload_states


def test_a_client_that_sends_only_wrong_messages_is_disconnected(
    run_viewer: Callable[..., Any], capfd: pytest.CaptureFixture[str]
):
    running = run_viewer("pendulum", ())
    client = Client(running)
    for _ in range(3 * browser_messages.MAX_REFUSED):
        try:
            client.socket.send("text")
        except ConnectionClosed:
            break
    wait_until(lambda: not running.server.get_clients())
    assert len(capfd.readouterr().err.splitlines()) == browser_messages.MAX_REFUSED


def test_a_connection_without_a_request_is_not_reported(
    run_viewer: Callable[..., Any], capfd: pytest.CaptureFixture[str]
):
    running = run_viewer("pendulum", ())
    where = ("127.0.0.1", running.server.get_port())
    for sent in (b"\x16\x03\x01\x00\xff\r\n\r\n", b"POST / HTTP/1.1\r\n\r\n", b""):
        with socket.create_connection(where, timeout=30.0) as client:
            client.sendall(sent)
            client.shutdown(socket.SHUT_WR)
            while client.recv(1000):
                pass
    assert Client(running)
    assert capfd.readouterr().err == ""
