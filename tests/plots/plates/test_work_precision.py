"""Costs are read from the table as the plate says: the cheapest run within an error."""

from math import isnan

import numpy as np
import pytest

from plots.literature import Measurements, read_measurements
from plots.plates.work_precision import cheapest_wall_time
from tests.plots.drawn import plate

COSTS = Measurements(
    {},
    [
        {"error [rad]": "1e-2", "wall [s]": "0.1"},
        {"error [rad]": "1e-3", "wall [s]": "0.4"},
        {"error [rad]": "1e-4", "wall [s]": "0.3"},
        {"error [rad]": "1e-6", "wall [s]": "2"},
    ],
)


@pytest.mark.parametrize(("target", "wall"), [(1.0, 0.1), (1e-3, 0.3), (1e-5, 2.0)])
def test_the_cheapest_run_within_an_error(target, wall) -> None:
    assert cheapest_wall_time(COSTS, target) == wall


def test_an_error_that_no_run_reaches() -> None:
    assert isnan(cheapest_wall_time(COSTS, 1e-9))


def test_stored_ratios_are_in_the_caption() -> None:
    costs = read_measurements("work_precision").select_rows(figure="reference")
    own, other = (
        cheapest_wall_time(costs.select_rows(engine=engine, method=method), 1e-3)
        for engine, method in (("this program", "compiled"), ("MuJoCo", "RK4"))
    )
    assert f"{own / other:.2g} (MuJoCo, RK4)" in plate("work_precision").caption


def test_finer_settings_err_less() -> None:
    costs = read_measurements("work_precision").select_rows(figure="reference")
    for engine, method in (
        ("this program", "compiled"),
        ("this program", "compiled, one run"),
        ("this program", "Exudyn's integrator, fixed step"),
        ("MuJoCo", "RK4"),
        ("Drake", "Runge-Kutta 3"),
    ):
        errors = costs.select_rows(engine=engine, method=method).column("error [rad]")
        assert len(errors) >= 5
        assert np.all(np.diff(errors) < 0.0)


def test_the_whole_call_costs_more_than_two_runs_and_these_more_than_one() -> None:
    costs = read_measurements("work_precision").select_rows(engine="this program")
    for figure in ("reference", "prototype"):
        one, two, call = (
            costs.select_rows(figure=figure, method=method).column("CPU [s]")
            for method in ("compiled, one run", "compiled", "compiled, whole call")
        )
        assert np.all(one < two)
        assert np.all(two < call)


def test_chains_are_compared_at_small_errors() -> None:
    """The truth of long chains is not the recursion that loses its digits."""
    chains = read_measurements("chains")
    for method in chains.values("method"):
        assert chains.select_rows(method=method).column("error [rad]").max() < 1e-2
    own = chains.select_rows(method="this program, compiled")
    assert own.column("error [rad]").max() < 1e-5
