"""Files of live simulations: values of the keys, errors with their place, exact round trip."""

import pytest

from generator.diagnostics import InputError
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
