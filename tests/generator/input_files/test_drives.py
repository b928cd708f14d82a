"""Tables that drive joints: what they say, and every fault with its place."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from generator import read_figure
from generator.drive import Drive
from generator.input_files.drives import DRIVES_FILE
from tests.chains import chain, one_body

PROTOTYPE = read_figure("prototype")
HEADER = "time [s], left_knee [deg], left_shoulder.3 [rad], left_shoulder.1 [deg]\n"


def test_columns_of_joints_and_of_their_displacements() -> None:
    """In any order, in degrees or radians; comments and energies are passed over."""
    text = (
        "# a table\n" + HEADER.replace("\n", ", kinetic [J]\n") + "0, 0, 0, 0, 1\n1,90,2,-180,5\n"
    )
    reading = DRIVES_FILE.parse_text(text, PROTOTYPE)
    assert not reading.diagnostics
    assert set(reading.value) == {"left_knee", "left_shoulder"}
    knee, shoulder = reading.value["left_knee"], reading.value["left_shoulder"]
    assert (knee.coordinates, shoulder.coordinates) == ((0,), (0, 2))
    assert knee.displacements(1.0) == pytest.approx([np.pi / 2.0])
    assert shoulder.displacements(0.5) == pytest.approx([-np.pi / 2.0, 1.0])


def test_some_joints_of_a_table() -> None:
    """Columns of others are not looked at."""
    text = "time [s],left_knee [deg],no_joint [deg],waist.2 [deg]\n0,0,0,0\n1,90,1,1\n"
    assert set(DRIVES_FILE.parse_text(text, PROTOTYPE, ["left_knee"]).value) == {"left_knee"}
    assert not DRIVES_FILE.parse_text(text, PROTOTYPE, ["right_knee"]).value


def test_slides_are_refused() -> None:
    made = one_body(chain("Tx"))
    text = "time [s],pin [cm]\n0,1\n1,2\n"
    (fault,) = DRIVES_FILE.parse_text(text, made).diagnostics
    assert "`pin` is a translation: only rotations can be driven in a simulation" in str(fault)
    assert (fault.span.line, fault.span.column) == (1, 10)


def test_splines_that_leave_the_range_of_their_rows_are_told() -> None:
    """Where each is worst, at the row before; not of a column that stays within."""
    text = (
        "time [s],left_knee [deg],waist.2 [deg]\n"
        "0,0,0\n0.1,0,10\n0.12,90,12\n0.2,90,20\n0.4,90,40\n"
    )
    reading = DRIVES_FILE.parse_text(text, PROTOTYPE)
    (told,) = reading.diagnostics
    assert told.severity.value == "warning"
    assert (told.span.line, told.span.text) == (2, "0")
    times = np.linspace(0.0, 0.4, 100_001)
    angles = np.degrees(reading.value["left_knee"].displacements(times)[:, 0])
    assert f"left_knee 1 to {angles.min():.4g} deg at" in told.message
    assert f"at {times[angles.argmin()]:.4g} s" in told.message


@given(
    st.lists(
        st.tuples(st.floats(0.01, 1.0), st.floats(-3.0, 3.0), st.floats(-3.0, 3.0)),
        min_size=2,
        max_size=8,
    )
)
def test_no_overshoot_is_missed(rows) -> None:
    """Against the spline at many times."""
    times = np.cumsum([gap for gap, *_ in rows])
    drive = Drive(times, [values for _, *values in rows])
    found = {one.column: one for one in drive.overshoots()}
    values = drive.displacements(np.linspace(times[0], times[-1], 4001))
    for column, turns in enumerate(np.transpose([values for _, *values in rows])):
        low, high = turns.min(), turns.max()
        beyond = max(values[:, column].max() - high, low - values[:, column].min())
        bound = max(0.05 * (high - low), 1e-3)
        if column in found:
            one = found[column]
            worst = max(one.value - high, low - one.value)
            assert worst > bound
            assert worst >= beyond - 1e-9
            assert times[one.row] <= one.time <= times[one.row + 1]
        else:
            assert beyond <= bound * (1.0 + 1e-6)
