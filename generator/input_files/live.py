"""Live simulations in files, `NAME.live.toml`: a start, and the log of what was changed when.

`[start]` is the figure before the first frame. Each `[[change]]` was made at a frame, after this
frame was recorded and before the next one was computed. Poses and springs are texts of files of
their own kinds. The unit of a number is part of its key.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, fields
from typing import Any, TypeVar, assert_never, cast

from generator.diagnostics import Diagnostics, ModelError, Source, select_errors
from generator.file_kind import FileKind
from generator.run_options import LIVE_ROWS, MAX_LIVE_SIZE
from generator.toml_file.reader import TableReader, parse_document
from generator.toml_file.rows import Block, Integer, Row, TableRows, Text, Vector3, require_keys
from generator.toml_file.writer import numbers_to_toml, quote_toml
from springs import SphericalLaw

T = TypeVar("T")
Vector = tuple[float, float, float]

DEFAULT_FRAME = 1.0 / 60.0
"""Interval between the frames of a live simulation [s]."""

DEFAULT_GRAVITY = 9.81
"""Gravity of a live simulation, downwards [m/s2]."""

DEFAULT_TOLERANCE = 1e-4
"""Error of a step of the integrator, relative to 1 + the size of each number of the state."""

MAX_FRAMES = 216_000
"""Most frames of a live simulation: an hour of 60 a second."""

MAX_LENGTH = 16_000_000
"""Most characters of a file."""

MAX_LOG_LENGTH = 12_000_000
"""Most characters of the changes of a live simulation: a file has room for its start too."""

MAX_FORCE = 1e6
"""Largest component of a force [N]."""

_FILE_KIND = "live file"
_START, _CHANGE = "start", "change"
_NO_FLOOR = "none"

_IN_BOUNDS = f"at most {MAX_LIVE_SIZE:g}"
_FIGURE, _DIGEST = Text("figure", example='"prototype.fig"'), Text("sha256")
_END_FRAME = Integer("end_frame", 0, MAX_FRAMES, example="60")
_HEADER_ROWS = TableRows(_FILE_KIND, (_FIGURE, _DIGEST, _END_FRAME), (_START, _CHANGE))
_START_ROWS = TableRows(_START, tuple(LIVE_ROWS.values()))
_GRAVITY, _FLOOR_HEIGHT, _ROOT = (LIVE_ROWS[name] for name in ("gravity", "floor", "free_root"))
_SPRINGS_TEXT = Block("springs")
_FRAME = Integer("frame", 0, MAX_FRAMES, example="60")
_SEGMENT, _POINT = Text("segment", example='"head"'), Vector3("point_m", MAX_LIVE_SIZE, _IN_BOUNDS)
_FORCE = Vector3("force_N", MAX_FORCE, f"at most {MAX_FORCE:g}")


@dataclass(frozen=True)
class LiveStart:
    """The start of a live simulation.

    Attributes:
        springs: springs as `--springs` takes them; None for those beside the figure.
        law: that joins the axes of spherical joints; None for that of the springs.
        gravity: gravity in world axes [m/s2].
        floor: height of the floor [m]; None without a floor.
        free_root: whether the joints to the ground are removed.
        tolerance: error of a step, as for a `Stepper`.
        frame: interval between frames [s].
        pose: text of a pose file; "" for the pose of the figure's file.
        fall: kind of fall that the figure starts with, on a floor, without tone; "" for none.
        seed: seed of this fall.
        scene: text of a scene file with props beside the floor; "" for none.
        height: height of the lowest point of a free figure [m]; None leaves it where it is.
    """

    springs: str | None = None
    law: SphericalLaw | None = None
    gravity: Vector = (0.0, -DEFAULT_GRAVITY, 0.0)
    floor: float | None = None
    free_root: bool = False
    tolerance: float = DEFAULT_TOLERANCE
    frame: float = DEFAULT_FRAME
    pose: str = ""
    fall: str = ""
    seed: int = 0
    scene: str = ""
    height: float | None = None


@dataclass(frozen=True)
class SetGravity:
    """Another gravity, in world axes [m/s2]."""

    gravity: Vector


@dataclass(frozen=True)
class SetScales:
    """Other factors of the torques of springs, and of damping and friction."""

    stiffness: float
    damping: float


@dataclass(frozen=True)
class SetFloor:
    """A floor at a height [m], or none."""

    height: float | None


@dataclass(frozen=True)
class SetRoot:
    """A root that is free, or held in its present pose."""

    is_free: bool


@dataclass(frozen=True)
class SetForce:
    """A force on a point of a segment, until it is replaced; a zero force removes it.

    Attributes:
        segment: a moving one.
        point: point in its frame [m].
        force: force in world axes [N].
    """

    segment: str
    point: Vector
    force: Vector


@dataclass(frozen=True)
class SetSprings:
    """Other springs: the text of a springs file in the folder; "" for those of the start."""

    text: str


@dataclass(frozen=True)
class StopMotion:
    """A stop of all segments where they are."""


LiveChange = SetGravity | SetScales | SetFloor | SetRoot | SetForce | SetSprings | StopMotion


@dataclass(frozen=True)
class LoggedChange:
    """A change and the number of the frame at which it was made; 0 is the start."""

    frame: int
    change: LiveChange


@dataclass(frozen=True)
class LiveLog:
    """A live simulation: all that is needed to compute its motion again.

    Attributes:
        figure: name of the figure's file.
        sha256: sha256 of the bytes of this file, in hexadecimal; None when it is in no file.
        start: start before the first frame.
        changes: changes in the order in which they were made.
        end_frame: number of the last frame.
    """

    figure: str
    sha256: str | None
    start: LiveStart
    changes: tuple[LoggedChange, ...] = ()
    end_frame: int = 0


def _parse_live(source: Source, diagnostics: Diagnostics) -> LiveLog | None:
    top = parse_document(source, _FILE_KIND, diagnostics, MAX_LENGTH)
    if top is None:
        return None
    _HEADER_ROWS.check_keys(top)
    figure, digest, end_frame = _FIGURE.read(top), _DIGEST.read(top), _END_FRAME.read(top)
    start = _parse_start(top)
    changes = [_parse_change(table) for table in top.tables(_CHANGE, "changes")]
    last = 0
    for index, logged in enumerate(changes):
        if logged is None:
            continue
        span = top.spans.value(_CHANGE, index, "frame")
        if end_frame is not None and logged.frame > end_frame:
            diagnostics.error("this change is after the end", span, f"`end_frame` is {end_frame}")
        elif logged.frame < last:
            diagnostics.error("this change is before the one above it", span, "in order of frames")
        last = max(last, logged.frame)
    if diagnostics.has_errors or figure is None or end_frame is None:
        return None
    return LiveLog(figure, digest, start, tuple(each for each in changes if each), end_frame)


LIVE_FILE = FileKind("live simulation", ".live.toml", _parse_live)


def _parse_start(top: TableReader) -> LiveStart:
    """The table `[start]`; what is wrong there has its default."""
    content: Any = top.content.get(_START, {})
    if not isinstance(content, dict):
        top.error(_START, f"`{_START}` must be a table", f"write `[{_START}]`")
        return LiveStart()
    table = TableReader(cast("Mapping[str, Any]", content), _START, 0, top.spans, top.diagnostics)
    _START_ROWS.check_keys(table)
    read = {name: row.read(table) for name, row in LIVE_ROWS.items()}
    return LiveStart(**{name: value for name, value in read.items() if value is not None})


_Parser = Callable[[TableReader], LiveChange | None]


def _one_value(row: Row[T], change: Callable[[T], LiveChange]) -> _Parser:
    """Return the parser of a change that has one value."""

    def parse(table: TableReader) -> LiveChange | None:
        value = row.read(table)
        return None if value is None else change(value)

    return parse


def _parse_scales(table: TableReader) -> SetScales | None:
    scales = table.numbers("scales", 2)
    for k, scale in enumerate(scales or ()):
        if not 0.0 <= scale <= MAX_LIVE_SIZE:
            table.error("scales", "this scale is out of range", f"from 0 to {MAX_LIVE_SIZE:g}", k)
            return None
    return None if scales is None else SetScales(*scales)


def _parse_floor(table: TableReader) -> SetFloor | None:
    if table.content["floor_height_m"] == _NO_FLOOR:
        return SetFloor(None)
    height = _FLOOR_HEIGHT.read(table)
    return None if height is None else SetFloor(height)


def _parse_force(table: TableReader) -> SetForce | None:
    require_keys(table, {_SEGMENT.key: _SEGMENT.example}, _CHANGE, _CHANGE_KEYS)
    segment, force = _SEGMENT.read(table), _FORCE.read(table)
    point = _POINT.read(table) if _POINT.key in table.content else (0.0, 0.0, 0.0)
    return None if segment is None or force is None or point is None else SetForce(
        segment, point, force
    )  # fmt: skip


def _parse_stop(table: TableReader) -> StopMotion | None:
    if table.content["stop"] is True:
        return StopMotion()
    table.error("stop", "`stop` can only be `true`")
    return None


_CHANGE_PARSERS: Mapping[str, _Parser] = {
    "gravity_m_s2": _one_value(_GRAVITY, SetGravity),
    "scales": _parse_scales,
    "floor_height_m": _parse_floor,
    "root": _one_value(_ROOT, SetRoot),
    "force_N": _parse_force,
    "springs": _one_value(_SPRINGS_TEXT, SetSprings),
    "stop": _parse_stop,
}
_CHANGE_KEYS = (_FRAME.key, _SEGMENT.key, _POINT.key, *_CHANGE_PARSERS)


def _parse_change(table: TableReader) -> LoggedChange | None:
    """One `[[change]]`; None, with an error noted, if it is wrong."""
    require_keys(table, {_FRAME.key: _FRAME.example}, _CHANGE, _CHANGE_KEYS)
    frame = _FRAME.read(table)
    kind = next((key for key in _CHANGE_PARSERS if key in table.content), None)
    table.reject_unknown_keys(_CHANGE_KEYS, _CHANGE)
    if kind is None:
        hint = f"one of: {', '.join(_CHANGE_PARSERS)}"
        table.diagnostics.error("this change changes nothing", table.header_span, hint)
        return None
    others = (_SEGMENT.key, _POINT.key) if kind == _FORCE.key else ()
    for key in table.content:
        if key in _CHANGE_KEYS and key not in (_FRAME.key, kind, *others):
            message = f"`{key}` does not belong to a change of `{kind}`"
            table.error(key, message, f"write another `[[{_CHANGE}]]`")
    change = _CHANGE_PARSERS[kind](table)
    return None if frame is None or change is None else LoggedChange(frame, change)


def write_live(log: LiveLog, comment: str = "") -> str:
    """Return the text of a live file; reading it returns an equal log, bit for bit.

    Args:
        log: log to write.
        comment: one or more lines above it.

    Raises:
        ModelError: for what the reader refuses, such as a change after the end.
    """
    lines = [f"# {line}".rstrip() for line in comment.splitlines()]
    lines.append(f"figure = {quote_toml(log.figure)}")
    if log.sha256 is not None:
        lines.append(f"sha256 = {quote_toml(log.sha256)}")
    lines += [f"end_frame = {log.end_frame}", "", f"[{_START}]", *_start_lines(log.start)]
    lines += map(format_change, log.changes)
    text = "\n".join([*lines, ""])
    errors = select_errors(LIVE_FILE.parse_text(text).diagnostics)
    if errors:
        raise ModelError(f"a {_FILE_KIND} cannot hold this simulation: {errors[0].message}")
    return text


def format_change(logged: LoggedChange) -> str:
    """Return the lines of a change in a live file, after an empty one."""
    head = ("", f"[[{_CHANGE}]]", f"frame = {logged.frame}")
    return "\n".join([*head, *_change_lines(logged.change)])


def _start_lines(start: LiveStart) -> Iterator[str]:
    for each in fields(start):
        value = getattr(start, each.name)
        is_default = value == each.default and each.name in ("pose", "fall", "seed", "scene")
        if value is not None and not is_default:
            yield LIVE_ROWS[each.name].write(value)


def _change_lines(change: LiveChange) -> Iterator[str]:
    match change:
        case SetGravity():
            yield _GRAVITY.write(change.gravity)
        case SetScales():
            yield f"scales = {numbers_to_toml((change.stiffness, change.damping))}"
        case SetFloor():
            if change.height is None:
                yield f"{_FLOOR_HEIGHT.key} = {quote_toml(_NO_FLOOR)}"
            else:
                yield _FLOOR_HEIGHT.write(change.height)
        case SetRoot():
            yield _ROOT.write(change.is_free)
        case SetForce():
            yield _SEGMENT.write(change.segment)
            yield _POINT.write(change.point)
            yield _FORCE.write(change.force)
        case SetSprings():
            yield _SPRINGS_TEXT.write(change.text)
        case StopMotion():
            yield "stop = true"
        case _:
            assert_never(change)
