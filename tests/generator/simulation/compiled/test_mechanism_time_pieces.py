"""Polynomials of loads and drives give their values at every time."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from generator.drive import Drive
from generator.figure import SiteRef
from generator.loads import LoadKind, TimedLoad
from generator.simulation.compiled.mechanism import (
    drive_pieces,
    load_pieces,
    smooth_intervals,
)

SITE = SiteRef("link", "near")
START, STOP = -0.5, 2.0


@st.composite
def row_times(draw: st.DrawFn, least: int = 1) -> list[float]:
    """Increasing times in and around the run, at least 0.01 s apart."""
    places = st.integers(-100, 300)
    times = draw(st.lists(places, min_size=least, max_size=8, unique=True))
    return [0.01 * time for time in sorted(times)]


@st.composite
def loads(draw: st.DrawFn) -> TimedLoad:
    times = draw(row_times())
    numbers = st.floats(-50.0, 50.0)
    rows = st.lists(st.tuples(numbers, numbers, numbers), min_size=len(times), max_size=len(times))
    return TimedLoad(SITE, LoadKind.GLOBAL_FORCE, times, draw(rows))


@st.composite
def drives(draw: st.DrawFn) -> Drive:
    """A drive of one to three columns through the whole run."""
    inner = [time for time in draw(row_times()) if START < time < STOP]
    times = [START, *inner, STOP + draw(st.sampled_from([0.0, 0.3]))]
    width = draw(st.integers(1, 3))
    row = st.lists(st.floats(-2.0, 2.0), min_size=width, max_size=width)
    return Drive(times, draw(st.lists(row, min_size=len(times), max_size=len(times))))


def interval_at(knots: np.ndarray, time: float) -> tuple[int, float]:
    """The interval that contains a time, and the time since its start."""
    k = int(np.searchsorted(knots, time, "right")) - 1
    return k, time - knots[k]


@given(st.lists(loads(), max_size=3), st.lists(drives(), max_size=2))
def test_intervals_start_at_the_rows_within_the_run(loads, drives) -> None:
    knots = smooth_intervals(loads, drives, (START, STOP))
    rows = {float(t) for one in (*loads, *drives) for t in one.times}
    assert knots[0] == START
    assert np.all(np.diff(knots) > 0.0)
    assert set(knots.tolist()) == {START} | {t for t in rows if START < t < STOP}


@given(st.lists(loads(), min_size=1, max_size=3), st.lists(st.floats(START, STOP), max_size=20))
def test_loads_keep_their_values(loads, times) -> None:
    """Within the intervals; at a jump, the piece on either side has the limit there."""
    knots = smooth_intervals(loads, (), (START, STOP))
    pieces = load_pieces(loads, knots, STOP)
    assert pieces.shape == (len(knots), len(loads), 6)
    for time in times:
        if np.min(np.abs(np.append(knots, STOP) - time)) < 1e-9:
            continue
        k, since = interval_at(knots, time)
        for number, load in enumerate(loads):
            found = pieces[k, number, :3] + since * pieces[k, number, 3:]
            assert found == pytest.approx(load.components(time), abs=1e-10)


@given(st.lists(loads(), min_size=1, max_size=2))
def test_loads_meet_where_they_do_not_jump(loads) -> None:
    knots = smooth_intervals(loads, (), (START, STOP))
    pieces, lengths = load_pieces(loads, knots, STOP), np.diff(knots)
    ends = pieces[:-1, :, :3] + lengths[:, None, None] * pieces[:-1, :, 3:]
    for number, load in enumerate(loads):
        for k, knot in enumerate(knots[1:].tolist()):
            if knot not in (load.times[0], load.times[-1]):
                assert ends[k, number] == pytest.approx(pieces[k + 1, number, :3], abs=1e-9)


def test_a_load_that_jumps_acts_between_its_rows_alone() -> None:
    load = TimedLoad(SITE, LoadKind.LOCAL_MOMENT, (0.2, 0.6), ((1.0, 2.0, 3.0), (5.0, 0.0, -1.0)))
    knots = smooth_intervals([load], (), (0.0, 1.0))
    assert knots.tolist() == [0.0, 0.2, 0.6]
    pieces = load_pieces([load], knots, 1.0)[:, 0]
    assert np.all(pieces[[0, 2]] == 0.0)
    assert pieces[1] == pytest.approx(np.array([1.0, 2.0, 3.0, 10.0, -5.0, -10.0]))


@given(drives(), st.lists(st.floats(START, STOP), max_size=20))
def test_drives_keep_values_rates_and_accelerations(drive, times) -> None:
    knots = smooth_intervals((), [drive], (START, STOP))
    columns = [(drive, column) for column in range(np.shape(drive.values)[1])]
    pieces = drive_pieces(columns, knots, STOP)
    assert pieces.shape == (len(knots), len(columns), 4)
    for time in times:
        k, s = interval_at(knots, time)
        for order in range(3):
            exact = drive.derivatives(time, order)
            scale = 1.0 + np.max(np.abs(drive.derivatives(knots, order)))
            for column, coefficients in enumerate(pieces[k]):
                found = np.polynomial.Polynomial(coefficients).deriv(order)(s)
                assert found == pytest.approx(exact[column], rel=1e-10, abs=1e-10 * scale)


def test_drives_of_other_rows_share_the_intervals() -> None:
    """A drive keeps its values in intervals that end at another one's rows."""
    one = Drive((0.0, 0.4, 0.7, 1.0), ((0.0,), (0.3,), (-0.2,), (0.5,)))
    other = Drive((0.0, 0.25, 0.5, 1.0), ((0.1, 0.0), (0.4, 1.0), (0.2, -1.0), (0.3, 0.0)))
    knots = smooth_intervals((), [one, other], (0.0, 1.0))
    assert knots.tolist() == [0.0, 0.25, 0.4, 0.5, 0.7]
    pieces = drive_pieces([(other, 1), (one, 0)], knots, 1.0)
    for time in np.linspace(0.0, 1.0, 41).tolist():
        k, s = interval_at(knots, time)
        found = [np.polynomial.Polynomial(piece)(s) for piece in pieces[k]]
        exact = [other.displacements(time)[1], one.displacements(time)[0]]
        assert found == pytest.approx(exact, abs=1e-12)


def test_without_loads_and_drives_there_is_one_interval() -> None:
    knots = smooth_intervals((), (), (0.3, 1.0))
    assert knots.tolist() == [0.3]
    assert load_pieces((), knots, 1.0).shape == (1, 0, 6)
    assert drive_pieces((), knots, 1.0).shape == (1, 0, 4)
