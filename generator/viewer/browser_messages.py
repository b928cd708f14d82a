"""Messages of browsers: what a page sends to its server, checked before viser reads it.

Controls send their values, nodes their clicks and drags, and the page its camera. Uploads, requests
to share the page, and changes of other properties of a control, such as `disabled`, which viser
would carry out for all pages, are none of these.
"""

import logging
import sys
from collections.abc import Callable
from math import isfinite
from numbers import Real
from typing import Annotated, Any, Literal

import msgspec
from websockets.asyncio.server import ServerConnection
from websockets.exceptions import ConnectionClosedError
from websockets.frames import CloseCode

from generator.diagnostics import shorten

MAX_REFUSED = 10
"""Refused messages after which a browser is disconnected."""

_LARGEST = 1e9

_LONGEST_LINE = 200
"""Most characters of a line about a message: parts of it are from the browser."""

_Number = Annotated[float, msgspec.Meta(ge=-_LARGEST, le=_LARGEST)]  # NaN is in no range
_Size = Annotated[int, msgspec.Meta(ge=0, le=100_000)]
_Pair = tuple[_Number, _Number]
_Vector = tuple[_Number, _Number, _Number]
_Quaternion = tuple[_Number, _Number, _Number, _Number]


class _Message(msgspec.Struct, tag_field="type", forbid_unknown_fields=True):
    """A message; its tag and its fields are those of viser."""


class _Value(msgspec.Struct, forbid_unknown_fields=True):
    value: bool | float | str | tuple[float, ...]


class _Update(_Message, tag="GuiUpdateMessage"):
    uuid: str
    updates: _Value


class _Camera(_Message, tag="ViewerCameraMessage"):
    wxyz: _Quaternion
    position: _Vector
    fov: _Number
    near: _Number
    far: _Number
    image_height: _Size
    image_width: _Size
    look_at: _Vector
    up_direction: _Vector


class _Click(_Message, tag="SceneNodeClickMessage"):
    name: str
    ray_origin: _Vector
    ray_direction: _Vector
    screen_pos: _Pair
    instance_index: int | None
    modifier: str | None
    owner: str = ""


class _Drag(_Message, tag="SceneNodeDragMessage"):
    phase: Literal["start", "update", "end"]
    name: str
    start_position: _Vector
    start_screen_pos: _Pair
    end_position: _Vector
    end_screen_pos: _Pair
    button: Literal["left", "middle", "right"]
    instance_index: int | None
    modifier: str | None
    owner: str = ""


class _Arrows(_Message, tag="TransformControlsUpdateMessage"):
    name: str
    wxyz: _Quaternion
    position: _Vector
    owner: str = ""


class _ArrowsStart(_Message, tag="TransformControlsDragStartMessage"):
    name: str
    owner: str = ""


class _ArrowsEnd(_ArrowsStart, tag="TransformControlsDragEndMessage"):
    pass


_DECODER = msgspec.msgpack.Decoder(
    _Update | _Camera | _Click | _Drag | _Arrows | _ArrowsStart | _ArrowsEnd
)


class MessageError(Exception):
    """A message that no page sends."""


class ValueOfControlError(Exception):
    """A value that a control does not take."""


def check_message(frame: bytes | str, find_control: Callable[[str], Any]) -> None:
    """Check a message of a browser; `find_control` returns a control, or None, by its identifier.

    Raises:
        MessageError: no page sends this.
        ValueOfControlError: the control does not take this value.
    """
    if isinstance(frame, str):
        raise MessageError("it is text")
    try:
        message = _DECODER.decode(frame)
    except (msgspec.DecodeError, RecursionError, UnicodeDecodeError) as failure:
        raise MessageError(str(failure)) from None
    if isinstance(message, _Update):
        control = find_control(message.uuid)
        if control is not None:
            _check_value(control, message.updates.value)


def _check_value(control: Any, value: bool | float | str | tuple[float, ...]) -> None:
    """Raise ValueOfControlError if a value is not of the kind of the control's present one."""
    present, label = control.value, f"`{control.label}`"
    if isinstance(present, bool):
        if not isinstance(value, bool):
            raise ValueOfControlError(f"{label} is either on or off")
    elif isinstance(present, Real):
        if isinstance(value, bool) or not isinstance(value, float):
            raise ValueOfControlError(f"{label} needs a number")
        if not isfinite(value):
            raise ValueOfControlError(f"{label} needs a finite number, not {value}")
    elif isinstance(present, str):
        if not isinstance(value, str):
            raise ValueOfControlError(f"{label} needs a text")
        options = getattr(control, "options", None)
        if options is not None and value not in options:
            raise ValueOfControlError(f"{label} has no option `{shorten(value)}`")
    else:
        raise ValueOfControlError(f"{label} cannot be changed")


class BrowserConnection(ServerConnection):
    """The websocket of a browser; it receives only messages that a page sends."""

    def __init__(
        self,
        *arguments: Any,
        find_control: Callable[[str], Any],
        notify: Callable[[str], None],
        **options: Any,
    ) -> None:
        """Add the checks, and `notify`, which gets a sentence about a value that is not taken."""
        super().__init__(*arguments, **options)
        self._find_control, self._notify = find_control, notify
        self._refused = 0

    async def recv(self, decode: bool | None = None) -> Any:
        """Return the next message that a page sends."""
        while True:
            try:
                frame = await super().recv(decode)
            except ConnectionClosedError as closed:
                if closed.sent is not None and closed.sent.code == CloseCode.MESSAGE_TOO_BIG:
                    report(f"a browser was disconnected: {closed.sent.reason}")
                raise
            try:
                check_message(frame, self._find_control)
            except ValueOfControlError as failure:
                self._notify(str(failure))
            except MessageError as failure:
                self._refuse(failure)
            else:
                return frame

    def _refuse(self, failure: MessageError) -> None:
        self._refused += 1
        if self._refused <= MAX_REFUSED:
            report(f"a message of a browser was refused: {failure}")
        if self._refused == MAX_REFUSED:
            self.transport.abort()  # a closing handshake would wait for what it still sends


def report(text: str) -> None:
    """Print a line about a connection to the terminal."""
    line = "".join(char if char.isprintable() else "?" for char in text[:_LONGEST_LINE])
    print(f"page: {line}", file=sys.stderr)


_EMPTY_CONNECTION = "opening handshake failed"
"""The entry of a connection without a request, of which browsers open some in advance."""


class _LineHandler(logging.Handler):
    """Prints an entry in one line, with its exception instead of a traceback."""

    def emit(self, record: logging.LogRecord) -> None:
        if record.getMessage() == _EMPTY_CONNECTION:
            return
        failure = record.exc_info[1] if record.exc_info else None
        cause = "" if failure is None else f": {type(failure).__name__}: {failure}"
        report(record.getMessage() + cause)


def line_logger() -> logging.Logger:
    """Return a logger of one line an entry, for what libraries report of connections."""
    logger = logging.Logger("page", logging.WARNING)
    logger.addHandler(_LineHandler())
    return logger
