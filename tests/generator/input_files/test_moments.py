"""Measured moments from a file: what is read, and what is said of what cannot be."""

from math import pi, radians
from pathlib import Path

import pytest

from generator.diagnostics import InputError, Parsed, Severity
from generator.input_files.moments import (
    MeasuredMoments,
    parse_moments,
    parse_moments_file,
    read_moments,
)

HEADER = "angle [deg],moment [N m]\n"
ROWS = "0,1\n10,2\n20,3\n30,5\n"


def only_fault(reading: Parsed[MeasuredMoments]) -> tuple[int, str, str]:
    """Line, message and hint of the only fault, which is an error."""
    assert reading.value is None
    (fault,) = reading.diagnostics
    assert fault.severity is Severity.ERROR
    assert fault.span is not None
    return fault.span.line, fault.message, fault.hint


def test_angles_and_moments_are_read_in_si():
    text = "# an elbow\n\n" + HEADER + " -10 , +.5 \r\n0,1e0\r\n\r\n# more\r\n90,-2.5\r\n180,3.\r\n"
    reading = parse_moments(text, "elbow.csv")
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
    reading = parse_moments(f"moment [{unit}],angle [rad]\n1,0\n2,1\n4,2\n8,3\n")
    assert reading.value is not None
    assert reading.value.moments == pytest.approx([factor * m for m in (1.0, 2.0, 4.0, 8.0)])
    assert reading.value.angles == (0.0, 1.0, 2.0, 3.0)


def test_an_angle_may_be_measured_twice():
    moments = parse_moments(HEADER + "0,1\n0,2\n10,2\n20,3\n30,5\n").value
    assert moments is not None
    assert len(moments.angles) == 5


@pytest.mark.parametrize(
    ("text", "line", "message", "hint"),
    [
        ("", 1, "there are no moments in this file", "angle [deg],moment [N m]"),
        ("# nothing\n\n", 1, "there are no moments in this file", ""),
        (HEADER, 1, "a cubic needs 4 different angles; this file has none", ""),
        (HEADER + "0,1\n10,2\n", 3, "a cubic needs 4 different angles; this file has 2", ""),
        (HEADER + "0,1\n0,2\n1,1\n1,2\n2,1\n", 6, "this file has 3", ""),
        ("angle,moment [N m]\n" + ROWS, 1, "column `angle` has no unit", "deg, rad"),
        ("angle [deg],moment\n" + ROWS, 1, "column `moment` has no unit", "dyn cm, N m"),
        ("angle deg,moment [N m]\n" + ROWS, 1, "column `angle` has no unit", "in brackets"),
        ("angle [N m],moment [N m]\n" + ROWS, 1, "`[N m]` is not the unit of an angle", "deg"),
        ("angle [deg],moment [Nm]\n" + ROWS, 1, "unknown unit `Nm`", ""),
        ("angle [deg],moment [N m]\n" + ROWS + "nan,1\n", 6, "`nan` is not finite", ""),
        (HEADER + "0,1\n10,NaN\n20,3\n30,5\n", 3, "`NaN` is not finite", ""),
        (HEADER + ROWS + "40,-inf\n", 6, "`-inf` is not finite", ""),
        (HEADER + ROWS + "40,1e999\n", 6, "`1e999` is beyond the largest number", ""),
        (HEADER + ROWS + "40,1e308\n", 6, "`1e308` is too large", "at most 1e+12"),
        (HEADER + ROWS + "721,1\n", 6, "the angle 721 is too large", "at most 720 deg"),
        (HEADER + "0,1\n1e-9,2\n2e-9,1\n3,1\n", 5, "this file has 2", "count as one"),
        (HEADER + "0,1\n1e-3,2\n2e-3,1\n3e-3,1\n", 5, "too close together", "0.01 deg"),
        (HEADER + "0,1\n1e-300,2\n2e-300,1\n3e-300,1\n", 5, "too close together", ""),
        (HEADER + ROWS + "40,much\n", 6, "`much` is not a number (column `moment`)", ""),
        (HEADER + ROWS + "40,\n", 6, "a number is missing (column `moment`)", ""),
        (HEADER + ROWS + "40 deg,1\n", 6, "`40 deg` is not a number (column `angle`)", ""),
        (HEADER + ROWS + "40\n", 6, "this row has 1 cells, not 2", ""),
        (HEADER + ROWS + "40,1,2\n", 6, "this row has 3 cells, not 2", ""),
        (HEADER + ROWS + "25,1\n", 6, "the angle 25 is below 30, the one before", "sort the rows"),
        ("angel [deg],moment [N m]\n" + ROWS, 1, "unknown column `angel [deg]`", "`angle`?"),
        ("angle [deg],moment [N m],speed\n" + ROWS, 1, "unknown column `speed`", ""),
        ("angle [deg],angle [rad]\n" + ROWS, 1, "a second column `angle`", ""),
        ("angle [deg]\n0\n", 1, "there is no column `moment`", "angle [deg],moment [N m]"),
        ("angle [deg];moment [N m]\n0;1\n", 1, "columns are separated by commas", ""),
    ],
)
def test_what_cannot_be_read(text: str, line: int, message: str, hint: str):
    found = only_fault(parse_moments(text))
    assert found[0] == line
    assert message in found[1]
    assert hint in found[2]


def test_all_faults_are_told():
    reading = parse_moments(HEADER + "a,b\n10,c\n5,1\n4,1\n")
    assert [fault.span.line for fault in reading.diagnostics if fault.span] == [2, 2, 3, 5]


def test_a_file(tmp_path: Path):
    path = tmp_path / "elbow.csv"
    path.write_text(HEADER + ROWS, encoding="utf-8")
    assert read_moments(path).moments == (1.0, 2.0, 3.0, 5.0)
    path.write_bytes(b"\x00\x01")
    with pytest.raises(InputError, match="binary"):
        read_moments(path)
    assert "no such file" in parse_moments_file(tmp_path / "none.csv").diagnostics[0].message
