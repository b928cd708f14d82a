"""Measured angles from tables and motions."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from generator.diagnostics import InputError, UsageError
from generator.identification.measured_angles import (
    MeasuredAngles,
    format_time,
    read_measured_angles,
)
from tests.motions import slides
from tests.swings import leg_case, swing, swing_text

ANGLES = st.floats(-170.0, 170.0)


def read(folder: Path, text: str, name: str = "swing.csv"):
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return read_measured_angles(path, leg_case().figure)


@given(
    rows=st.lists(st.tuples(st.floats(1e-3, 10.0), ANGLES), min_size=2, max_size=20),
    in_degrees=st.booleans(),
)
def test_a_table_is_read_back(tmp_path_factory: pytest.TempPathFactory, rows, in_degrees: bool):
    times = np.cumsum([interval for interval, _ in rows])
    angles = np.array([angle for _, angle in rows])
    unit = "deg" if in_degrees else "rad"
    shown = angles if in_degrees else np.radians(angles)
    lines = [f"{t!r}, {a!r}" for t, a in zip(times.tolist(), shown.tolist(), strict=True)]
    text = "\n".join([f"time [s], left_knee.1 [{unit}]", *lines])
    data, warnings = read(tmp_path_factory.mktemp("data"), text)
    assert warnings == ()
    assert data.columns == (("left_knee", 0),)
    assert data.times.tolist() == times.tolist()
    np.testing.assert_allclose(np.degrees(data.angles[:, 0]), angles, rtol=1e-14, atol=1e-12)


@given(
    epoch=st.sampled_from((0.0, -40.0, 1e6, 1.7e9, -1.7e9, 4e9)),
    decimals=st.integers(2, 5),
    interval=st.integers(1, 10),
)
def test_times_of_any_epoch_keep_their_differences(
    tmp_path_factory: pytest.TempPathFactory, epoch: float, decimals: int, interval: int
):
    """Written with decimals, as devices do; a sample each 1 to 10 units of the last one."""
    steps = range(0, 40 * interval, interval)
    times = [f"{int(epoch) + k * 10**-decimals:.{decimals}f}" for k in steps]
    lines = [f"{time},{k % 7}" for k, time in enumerate(times)]
    text = "\n".join(["time [s],left_knee [deg]", *lines])
    data, warnings = read(tmp_path_factory.mktemp("data"), text)
    exact = np.array(steps) * 10.0**-decimals
    np.testing.assert_allclose(data.times - data.times[0], exact, rtol=0.0, atol=1e-6)
    assert warnings == ()
    assert float(format_time(float(data.times[1]))) == data.times[1]


@pytest.mark.parametrize(
    ("epoch", "rate", "decimals", "lost"),
    [
        (0.0, 30.0, 2, "0.01 s"),
        (1.7e9, 30.0, 2, "0.01 s"),
        (1.7e9, 100.0, 3, None),
        (1.7e9, 30.0, 3, None),
        (0.0, 100.0, 6, None),
        (9e11, 1000.0, 4, "0.00012 s"),
    ],
)
def test_times_that_have_lost_digits_are_named(
    tmp_path: Path, epoch: float, rate: float, decimals: int, lost: str | None
):
    times = [f"{round(epoch + k / rate, decimals):.{decimals}f}" for k in range(60)]
    text = "\n".join(
        ["time [s],left_knee [deg]", *(f"{time},{k % 5}" for k, time in enumerate(times))]
    )
    data, warnings = read(tmp_path, text)
    assert len(data.times) == 60
    if lost is None:
        assert warnings == ()
        return
    (found,) = warnings
    assert f"the times are rounded to {lost}, though the samples are" in found.message
    assert found.hint == "write the times with more decimals, counted from the first sample"


def test_samples_at_uneven_times_have_lost_nothing(tmp_path: Path):
    times = np.round(np.cumsum(np.random.default_rng(1).uniform(0.01, 0.05, 60)), 4)
    text = "\n".join(["time [s],left_knee [deg]", *(f"{time:.4f},1" for time in times)])
    assert read(tmp_path, text)[1] == ()


def test_a_noisy_table_gives_no_warnings_of_splines(tmp_path: Path):
    rows = [f"{0.1 * k},{(-1) ** k * 20 * (k == 7) + k}" for k in range(15)]
    data, warnings = read(tmp_path, "\n".join(["time [s],left_knee [deg]", *rows]))
    assert warnings == ()
    assert data.angles.shape == (15, 1)


def test_an_opensim_table_gives_the_same_angles(tmp_path: Path):
    data = swing(stop=0.5)
    table, _ = read(tmp_path, swing_text(data))
    rows = zip(data.times.tolist(), np.degrees(data.angles[:, 0]).tolist(), strict=True)
    head = ["Coordinates", "version=1", f"nRows={len(data.times)}", "nColumns=2", "inDegrees=yes"]
    lines = [*head, "endheader", "time\tleft_knee_1", *(f"{t!r}\t{a!r}" for t, a in rows), ""]
    motion, _ = read(tmp_path, "\n".join(lines), "swing.mot")
    assert motion.columns == table.columns
    np.testing.assert_allclose(motion.angles, table.angles, rtol=0.0, atol=1e-14)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("time [s],left_kne [deg]\n0,1\n1,2", "the figure has no joint `left_kne`"),
        ("time [s],left_knee [mm]\n0,1\n1,2", "unknown unit `[mm]`"),
        ("time [s],left_knee [deg]\n0,1\n0,2", "the time does not increase"),
        ("time [s],left_knee [deg]\n0,nan\n1,2", "`nan` is not finite"),
        ("time [s],left_knee [deg]\n0,1", "two rows or more"),
        ("left_knee [deg]\n0\n1", "there is no column `time [s]`"),
    ],
)
def test_faults_have_places(tmp_path: Path, text: str, message: str):
    with pytest.raises(InputError) as caught:
        read(tmp_path, text)
    assert message in str(caught.value)
    assert "swing.csv:" in str(caught.value)


def test_samples_between_two_times():
    data = swing(stop=1.0).between(0.2, 0.6)
    assert (data.times[0], data.times[-1]) == pytest.approx((0.2, 0.6))
    assert len(data.angles) == len(data.times) == 21
    with pytest.raises(UsageError, match="it goes from 0 s to 1 s"):
        swing(stop=1.0).between(2.0)


def test_columns_of_prescribed_joints_are_left_out():
    both = MeasuredAngles("d", np.arange(2.0), (("a", 0), ("b", 0)), np.array([[1.0, 2], [3, 4]]))
    assert both.without(("a",)).angles.tolist() == [[2.0], [4.0]]
    with pytest.raises(UsageError, match="locked or prescribed"):
        both.without(("a", "b"))


def test_radians_that_are_called_degrees_are_named(tmp_path: Path):
    _, (found,) = read(tmp_path, "time [s],left_knee [rad]\n0,0\n1,40\n2,80")
    assert "an angle of `left_knee` is 4584 deg: is its unit right?" in str(found)


def test_slides_are_refused(tmp_path: Path):
    path = tmp_path / "slides.csv"
    path.write_text("time [s],rail.1 [deg],rail.2 [cm]\n0,0,1\n1,4,2\n2,8,4", encoding="utf-8")
    with pytest.raises(InputError, match="only rotations can be driven in a simulation or fitted"):
        read_measured_angles(path, slides())


@pytest.mark.parametrize("time", [5.0, 1.6e9, 1.8e9, -1e300, 1e300])
def test_a_start_of_another_epoch_is_refused(time: float):
    times = 1.7e9 + np.arange(20) / 50.0
    data = MeasuredAngles("swing.csv", times, (("left_knee", 0),), np.zeros((20, 1)))
    with pytest.raises(UsageError, match=r"is not near the samples .* go from 1700000000.0 s to"):
        data.check_time(time)
    data.check_time(1.7e9 - 0.1)
    data.check_time(1.7e9 + 0.1)
