"""Measured moments from a file: what is read, and what is said of what cannot be."""

from math import pi, radians
from pathlib import Path

import pytest

from generator.diagnostics import InputError, Source
from generator.input_files.moments import MOMENTS_FILE

HEADER = "angle [deg],moment [N m]\n"
ROWS = "0,1\n10,2\n20,3\n30,5\n"


def test_angles_and_moments_are_read_in_si():
    text = "# an elbow\n\n" + HEADER + " -10 , +.5 \r\n0,1e0\r\n\r\n# more\r\n90,-2.5\r\n180,3.\r\n"
    reading = MOMENTS_FILE.parse(Source("elbow.csv", text))
    assert reading.diagnostics == ()
    moments = reading.value
    assert moments is not None
    assert moments.angles == pytest.approx((radians(-10.0), 0.0, pi / 2.0, pi), rel=1e-15)
    assert moments.moments == (0.5, 1.0, -2.5, 3.0)
    assert moments.name == "elbow.csv"


@pytest.mark.parametrize(
    ("unit", "factor"),
    [("N m", 1.0), ("N mm", 1e-3), ("dyn cm", 1e-7), ("N  cm", 1e-2), ("kg m2/s s", 1.0)],
)
def test_units_of_moment(unit: str, factor: float):
    reading = MOMENTS_FILE.parse_text(f"moment [{unit}],angle [rad]\n1,0\n2,1\n4,2\n8,3\n")
    assert reading.value is not None
    assert reading.value.moments == pytest.approx([factor * m for m in (1.0, 2.0, 4.0, 8.0)])
    assert reading.value.angles == (0.0, 1.0, 2.0, 3.0)


@pytest.mark.parametrize(
    ("angle", "moment"),
    [
        ("Angle [deg]", "MOMENT [N m]"),
        ("theta [deg]", "Torque [N m]"),
        ("Joint angle (deg)", "joint_torque (N m)"),
        ("Position[deg]", "passive moment [N m]"),
    ],
)
def test_other_titles_of_the_columns(angle: str, moment: str):
    reading = MOMENTS_FILE.parse_text(f"{moment},{angle}\n1,0\n2,10\n3,20\n5,30\n")
    assert reading.diagnostics == ()
    assert reading.value is not None
    assert reading.value.moments == (1.0, 2.0, 3.0, 5.0)
    assert reading.value.angles == pytest.approx((0.0, pi / 18.0, pi / 9.0, pi / 6.0))
    assert reading.value.titles == (angle, moment)


def test_two_titles_of_one_column_are_an_error():
    (fault,) = MOMENTS_FILE.parse_text("theta [deg],Angle [deg]\n0,1\n").diagnostics
    assert fault.message == "a second column `angle`"


def test_an_angle_may_be_measured_twice():
    moments = MOMENTS_FILE.parse_text(HEADER + "0,1\n0,2\n10,2\n20,3\n30,5\n").value
    assert moments is not None
    assert len(moments.angles) == 5


def test_a_file(tmp_path: Path):
    path = tmp_path / "elbow.csv"
    path.write_text(HEADER + ROWS, encoding="utf-8")
    assert MOMENTS_FILE.read(path).moments == (1.0, 2.0, 3.0, 5.0)
    path.write_bytes(b"\x00\x01")
    with pytest.raises(InputError, match="binary"):
        MOMENTS_FILE.read(path)
