"""Files of live simulations: values of the keys, errors with their place, exact round trip."""

import pytest

from generator.diagnostics import InputError, Source
from generator.input_files.live import (
    LIVE_FILE,
    LiveLog,
    LiveStart,
    LoggedChange,
    SetFloor,
    SetForce,
    SetGravity,
    SetRoot,
    SetScales,
    SetSprings,
    StopMotion,
    write_live,
)
from springs import SphericalLaw

TEXT = """
figure = "prototype.fig"
sha256 = "ab12"
end_frame = 90

[start]
springs = "printed"
law = "weighted"
gravity_m_s2 = [0, -1.62, 0]
floor_height_m = -0.25
root = "free"
tolerance = 1e-5
frame_s = 0.01
pose = \"\"\"
joint left_knee { displacement = (20deg); }
\"\"\"

[[change]]
frame = 0
scales = [2, 0.5]

[[change]]
frame = 10
gravity_m_s2 = [1, 0, 0]

[[change]]
frame = 10
floor_height_m = "none"

[[change]]
frame = 11
floor_height_m = 0.5

[[change]]
frame = 12
root = "held"

[[change]]
frame = 13
segment = "left arm"
point_m = [0, 0.1, 0]
force_N = [10, 0, -3]

[[change]]
frame = 14
springs = "base = \\"none\\""

[[change]]
frame = 90
stop = true
"""

LOG = LiveLog(
    "prototype.fig",
    "ab12",
    LiveStart(
        "printed",
        SphericalLaw.WEIGHTED,
        (0.0, -1.62, 0.0),
        -0.25,
        True,
        1e-5,
        0.01,
        "joint left_knee { displacement = (20deg); }\n",
    ),
    (
        LoggedChange(0, SetScales(2.0, 0.5)),
        LoggedChange(10, SetGravity((1.0, 0.0, 0.0))),
        LoggedChange(10, SetFloor(None)),
        LoggedChange(11, SetFloor(0.5)),
        LoggedChange(12, SetRoot(False)),
        LoggedChange(13, SetForce("left arm", (0.0, 0.1, 0.0), (10.0, 0.0, -3.0))),
        LoggedChange(14, SetSprings('base = "none"')),
        LoggedChange(90, StopMotion()),
    ),
    90,
)


def test_values_of_the_keys():
    reading = LIVE_FILE.parse_text(TEXT)
    assert reading.diagnostics == ()
    assert reading.value == LOG


def test_what_is_left_out_has_its_default():
    log = LIVE_FILE.parse_text('figure = "a.fig"\nend_frame = 0\n').require_value()
    assert log == LiveLog("a.fig", None, LiveStart())


HEAD = 'figure = "a.fig"\nend_frame = 9\n'


@pytest.mark.parametrize(
    ("text", "place", "message"),
    [
        ("end_frame = 1", (1, 1), "this live file has no `figure`"),
        ('figure = "a"', (1, 1), "this live file has no `end_frame`"),
        ('figure = "a"\nend_frame = 1.5', (2, 13), "must be a whole number"),
        ('figure = "a"\nend_frame = -1', (2, 13), "must be from 0 to 216,000"),
        (HEAD + "colour = 1", (3, 1), "unknown key `colour`"),
        (HEAD + "start = 3", (3, 9), "must be a table"),
        (HEAD + "change = 3", (3, 10), "changes are tables"),
        (HEAD + '[start]\nroot = "loose"', (4, 8), "`root` cannot be `loose`"),
        (HEAD + "[start]\ngravity_m_s2 = [0, 2e3, 0]", (4, 20), "too large"),
        (HEAD + "[start]\nframe_s = 0", (4, 11), "must be from 0.0001 to 1"),
        (HEAD + "[[change]]\nframe = 1", (3, 1), "this change changes nothing"),
        (HEAD + "[[change]]\nscales = [1, 1]", (3, 1), "this change has no `frame`"),
        (HEAD + "[[change]]\nframe = 1\nscales = [1, -1]", (5, 14), "out of range"),
        (HEAD + "[[change]]\nframe = 1\nstop = false", (5, 8), "can only be `true`"),
        (HEAD + "[[change]]\nframe = 10\nstop = true", (4, 9), "after the end"),
        (
            HEAD + "[[change]]\nframe = 2\nstop = true\n[[change]]\nframe = 1\nstop = true",
            (7, 9),
            "before the one above it",
        ),
        (
            HEAD + '[[change]]\nframe = 2\nstop = true\nroot = "free"',
            (6, 8),
            "`stop` does not belong to a change of `root`",
        ),
        (
            HEAD + "[[change]]\nframe = 2\nforce_N = [0, 0, 1]",
            (3, 1),
            "this change has no `segment`",
        ),
        (HEAD + "[[change]]\nframe = 2\nspeed = 3\nstop = true", (5, 1), "unknown key `speed`"),
    ],
)
def test_errors_have_a_place(text, place, message):
    reading = LIVE_FILE.parse(Source("my.live.toml", text))
    assert reading.value is None
    found = [one for one in reading.diagnostics if message in one.message]
    assert found, [one.message for one in reading.diagnostics]
    assert found[0].span is not None
    if "does not belong" not in message:
        assert (found[0].span.line, found[0].span.column) == place


@pytest.mark.parametrize(
    ("log", "reason"),
    [
        (LiveLog("a", None, LiveStart(), (LoggedChange(3, StopMotion()),), 2), "after the end"),
        (LiveLog("a", None, LiveStart(frame=0.0)), "must be from"),
        (LiveLog("a", None, LiveStart(gravity=(0.0, float("nan"), 0.0))), "finite"),
    ],
)
def test_what_no_file_holds_is_not_written(log, reason):
    with pytest.raises(ValueError, match=reason):
        write_live(log)


def test_files(tmp_path):
    path = tmp_path / "a.live.toml"
    path.write_text(write_live(LOG, "a fall"))
    assert LIVE_FILE.read(path) == LOG
    path.write_text("figure = 1")
    assert LIVE_FILE.parse_file(path).value is None
    with pytest.raises(InputError, match="must be a text"):
        LIVE_FILE.read(path)
