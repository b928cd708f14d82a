"""Designs of studies: numbers of runs, distributions, structure, and the same points again."""

import warnings
from collections.abc import Mapping

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats
from scipy.stats import qmc

from generator import Plan, read_figure
from generator.diagnostics import ModelError
from generator.model import Model
from generator.study.designs import (
    MORRIS_LEVELS,
    MORRIS_STEP,
    design_points,
    evenly_spaced,
    run_count,
    unit_points,
)
from generator.study.study import (
    Design,
    DesignKind,
    Distribution,
    Levels,
    LogNormal,
    Normal,
    Parameter,
    Sensitivity,
    Study,
    Uniform,
)

FIGURE = read_figure("pendulum")
DISTRIBUTIONS: Mapping[str, Distribution] = {
    "uniform": Uniform(-1.0, 3.0),
    "normal": Normal(10.0, 2.0),
    "lognormal": LogNormal(5.0, 1.5),
    "levels": Levels((1.0, 2.0, 4.0)),
}
RANDOM = (DesignKind.LATIN_HYPERCUBE, DesignKind.SOBOL, DesignKind.MORRIS)


def study(
    kind: DesignKind,
    runs: int | None = 16,
    seed: int = 7,
    *,
    distributions: Mapping[str, Distribution | None] = DISTRIBUTIONS,
    rows: tuple[tuple[float, ...], ...] = (),
    sensitivity: bool = False,
) -> Study:
    parameters = {
        name: Parameter(name, (f"springs.{name}.scale",), each)
        for name, each in distributions.items()
    }
    return Study(
        "pendulum",
        Model(FIGURE),
        Plan(stop=0.1),
        parameters,
        Design(kind, runs, seed, rows),
        {},
        sensitivity=Sensitivity() if sensitivity else None,
    )


def test_grid_has_all_combinations_and_both_ends() -> None:
    grid = study(
        DesignKind.GRID,
        None,
        distributions={"a": evenly_spaced(0.8, 1.2, 3), "b": Levels((5.0, -1.0))},
    )
    assert run_count(grid) == 6
    expected = [[0.8, 5], [0.8, -1], [1.0, 5], [1.0, -1], [1.2, 5], [1.2, -1]]
    assert design_points(grid).tolist() == expected


def test_list_is_its_rows() -> None:
    rows = ((1.0, 2.0), (3.0, 4.0), (1.0, 2.0))
    listed = study(DesignKind.LIST, None, distributions={"a": None, "b": None}, rows=rows)
    assert run_count(listed) == 3
    assert design_points(listed).tolist() == [list(row) for row in rows]


@pytest.mark.parametrize("sensitivity", [False, True])
@pytest.mark.parametrize("kind", RANDOM)
@pytest.mark.parametrize("runs", [1, 5, 64])
def test_count_is_that_of_the_points(kind: DesignKind, runs: int, sensitivity: bool) -> None:
    made = study(kind, runs, sensitivity=sensitivity)
    assert design_points(made).shape == (run_count(made), len(DISTRIBUTIONS))


def test_each_interval_of_a_latin_hypercube_has_one_point() -> None:
    unit = unit_points(study(DesignKind.LATIN_HYPERCUBE, 50))
    assert (np.sort(np.floor(50 * unit), axis=0) == np.arange(50)[:, None]).all()


def test_sobol_sequence_fills_the_cube_more_evenly_than_random_points() -> None:
    unit = unit_points(study(DesignKind.SOBOL, 256))
    random = np.random.default_rng(1).random(unit.shape)
    assert qmc.discrepancy(unit) < 0.2 * qmc.discrepancy(random)
    # A digital net: each of 256 intervals of a coordinate has one point.
    assert (np.sort(np.floor(256 * unit), axis=0) == np.arange(256)[:, None]).all()


@pytest.mark.parametrize("runs", [3, 100])
def test_sobol_sequence_of_any_length_without_a_warning(runs: int) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        points = design_points(study(DesignKind.SOBOL, runs))
    longer = design_points(study(DesignKind.SOBOL, 128))
    assert (points == longer[:runs]).all()


@pytest.mark.parametrize("kind", [DesignKind.LATIN_HYPERCUBE, DesignKind.SOBOL])
def test_values_have_their_distributions(kind: DesignKind) -> None:
    points = design_points(study(kind, 4096))
    known = {
        "uniform": stats.uniform(-1.0, 4.0),
        "normal": stats.norm(10.0, 2.0),
        "lognormal": stats.lognorm(np.log(1.5), scale=5.0),
    }
    for k, distribution in enumerate(known.values()):
        # One point in each of 4096 equally probable intervals.
        shares = distribution.cdf(np.sort(points[:, k]))
        assert (np.floor(4096 * shares) == np.arange(4096)).all()
    counts = np.unique(points[:, 3], return_counts=True)
    assert counts[0].tolist() == [1.0, 2.0, 4.0]
    assert np.ptp(counts[1]) <= 1


@given(kind=st.sampled_from(RANDOM), seed=st.integers(0, 2**63), runs=st.integers(1, 40))
def test_values_are_finite_and_within_bounds(kind: DesignKind, seed: int, runs: int) -> None:
    made = study(kind, runs, seed)
    unit, points = unit_points(made), design_points(made)
    assert ((unit > 0.0) & (unit < 1.0)).all()
    assert np.isfinite(points).all()
    assert ((points[:, 0] >= -1.0) & (points[:, 0] <= 3.0)).all()


def test_radial_design_changes_one_parameter_of_each_base_sample() -> None:
    made = study(DesignKind.SOBOL, 32, sensitivity=True)
    unit = unit_points(made).reshape(32, 6, 4)
    a, b = unit[:, 0], unit[:, 1]
    for k in range(4):
        expected = a.copy()
        expected[:, k] = b[:, k]
        assert (unit[:, 2 + k] == expected).all()
    # A and B are coordinates of one sequence in eight dimensions.
    sequence = np.hstack([a, b])
    assert (np.sort(np.floor(32 * sequence), axis=0) == np.arange(32)[:, None]).all()


def test_trajectories_change_each_parameter_once_by_half_of_the_levels() -> None:
    unit = unit_points(study(DesignKind.MORRIS, 40)).reshape(40, 5, 4)
    levels = (np.arange(MORRIS_LEVELS) + 0.5) / MORRIS_LEVELS
    assert set(unit.ravel()) == set(levels)
    steps = np.diff(unit, axis=1)
    assert (np.count_nonzero(steps, axis=1) == 1).all()
    assert (np.count_nonzero(steps, axis=2) == 1).all()
    assert set(np.abs(steps[steps != 0.0])) == {MORRIS_STEP}
    # Orders and directions differ between trajectories.
    assert len({tuple(np.argmax(each != 0.0, axis=1)) for each in steps}) > 5
    assert (steps > 0.0).any()
    assert (steps < 0.0).any()


@pytest.mark.parametrize("kind", RANDOM)
def test_seed_decides_the_points(kind: DesignKind) -> None:
    first = design_points(study(kind, seed=1))
    assert (first == design_points(study(kind, seed=1))).all()
    assert (first != design_points(study(kind, seed=2))).any()


def test_grid_needs_values() -> None:
    with pytest.raises(ModelError, match="`a` of a grid needs values, or low, high and points"):
        run_count(study(DesignKind.GRID, None, distributions={"a": Uniform(0.0, 1.0)}))


@pytest.mark.parametrize("kind", RANDOM)
def test_random_design_needs_runs_and_distributions(kind: DesignKind) -> None:
    with pytest.raises(ModelError, match="needs a number of runs"):
        run_count(study(kind, None))
    with pytest.raises(ModelError, match="`a` needs a distribution"):
        design_points(study(kind, distributions={"a": None}))


def test_nothing_but_the_random_designs_has_probabilities() -> None:
    grid = study(DesignKind.GRID, distributions={"a": Levels((1.0,))})
    with pytest.raises(ValueError, match="grid has no probabilities"):
        unit_points(grid)
