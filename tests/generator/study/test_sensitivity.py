"""Sensitivity indices: functions of known indices, intervals, failed runs, and the file."""

import json
import warnings
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from benchmarks.sensitivity import KnownFunction
from generator.diagnostics import InputError, ModelError
from generator.study.designs import design_points
from generator.study.sensitivity import (
    INDICES_NAME,
    MAIN_KINDS,
    MIN_SAMPLES,
    IndexKind,
    StudyIndices,
    correlations,
    estimate_indices,
    read_indices,
    sobol_indices,
    write_indices,
)
from generator.study.study import (
    DesignKind,
    Measure,
    RunResult,
    Sensitivity,
    Statistic,
    Study,
)
from springs.backends import Array
from tests.known_functions import ISHIGAMI, SOBOL_G, done, known_study, results


def estimate(known: KnownFunction, made: Study) -> StudyIndices:
    return estimate_indices(made, results(known.function(design_points(made))))


def values(indices: StudyIndices, kind: IndexKind) -> Array:
    """Estimates of a kind and the ends of their intervals, shape (3, parameters)."""
    found = [each[kind] for each in indices.measures["swing"].parameters.values()]
    return np.array([[one.value, one.low, one.high] for one in found]).T


@pytest.mark.parametrize("known", [ISHIGAMI, SOBOL_G], ids=["ishigami", "g"])
def test_scipy_has_the_same_indices(known: KnownFunction) -> None:
    made = known_study(known, DesignKind.SOBOL, 128)
    outputs = known.function(design_points(made)).reshape(128, -1).T
    theirs = stats.sobol_indices(
        func={"f_A": outputs[:1], "f_B": outputs[1:2], "f_AB": outputs[2:, None]}, n=128
    )
    ours = estimate(known, made)
    assert values(ours, IndexKind.FIRST)[0] == pytest.approx(theirs.first_order, rel=1e-9)
    assert values(ours, IndexKind.TOTAL)[0] == pytest.approx(theirs.total_order, rel=1e-9)


def test_intervals_of_random_points_are_as_wide_as_the_indices_scatter() -> None:
    """Independent points, for which the bootstrap is made: misses and widths over many seeds."""
    seeds, samples, count = 120, 256, len(ISHIGAMI.first)
    truth = np.concatenate([ISHIGAMI.first, ISHIGAMI.total])
    found: list[Array] = []
    for seed in range(seeds):
        points = np.random.default_rng(seed).random((2, samples, count))
        radial = np.repeat(points[0][:, None], 2 + count, axis=1)
        radial[:, 1] = points[1]
        for k in range(count):
            radial[:, 2 + k, k] = points[1][:, k]
        outputs = ISHIGAMI.function(radial.reshape(-1, count)).reshape(samples, -1)
        each = sobol_indices(outputs, Sensitivity(0.95, 200), seed)
        kinds = (IndexKind.FIRST, IndexKind.TOTAL)
        ends = [(one[k].value, one[k].low, one[k].high) for k in kinds for one in each]
        found.append(np.array(ends).T)
    value, low, high = np.stack(found, axis=1)
    misses = ((truth < low) | (truth > high)).sum(axis=0)
    # An exact interval misses more often in one of 10,000 such tests of six indices.
    assert (misses <= stats.binom.ppf(1.0 - 1e-4 / len(truth), seeds, 0.05)).all(), misses
    # The scatter of 120 values is known to 1 / sqrt(240), 6.5 %.
    widths = (high - low).mean(axis=0) / (2.0 * stats.norm.ppf(0.975))
    assert widths / value.std(axis=0, ddof=1) == pytest.approx(np.ones(len(truth)), abs=0.26)


def test_intervals_of_sobol_points_contain_the_known_indices_at_least_as_often() -> None:
    seeds = 40
    truth = np.concatenate([SOBOL_G.first, SOBOL_G.total])
    misses = np.zeros(len(truth), dtype=int)
    for seed in range(seeds):
        made = estimate(SOBOL_G, known_study(SOBOL_G, DesignKind.SOBOL, 256, seed))
        _, low, high = np.hstack([values(made, IndexKind.FIRST), values(made, IndexKind.TOTAL)])
        misses += (truth < low) | (truth > high)
    assert (misses <= stats.binom.ppf(1.0 - 1e-4 / len(truth), seeds, 0.05)).all(), misses


def test_confidence_widens_intervals() -> None:
    made = known_study(SOBOL_G, DesignKind.SOBOL, 64)
    narrow = replace(made, sensitivity=Sensitivity(0.5, 200))
    wide, thin = (values(estimate(SOBOL_G, each), IndexKind.TOTAL) for each in (made, narrow))
    assert (wide[0] == thin[0]).all()
    assert (wide[1] < thin[1]).all()
    assert (wide[2] > thin[2]).all()


SLOPES = (1.0, -2.0, 0.0, 5.0)
WIDTH = 2.0


def linear(x: Array) -> Array:
    return x @ np.array(SLOPES) + 100.0


LINEAR = KnownFunction("linear", linear, np.zeros(4), np.zeros(4))
PRODUCT = KnownFunction("product", lambda x: x.prod(axis=1), np.zeros(2), np.zeros(2))


def test_effects_of_a_linear_function_are_its_slopes_times_the_ranges() -> None:
    made = estimate(
        LINEAR, known_study(LINEAR, DesignKind.MORRIS, 10, bounds=(-0.5 * WIDTH, 0.5 * WIDTH))
    )
    effects = WIDTH * np.array(SLOPES)
    for end in values(made, IndexKind.MU):
        assert end == pytest.approx(effects, abs=1e-11)
    for end in values(made, IndexKind.MU_STAR):
        assert end == pytest.approx(np.abs(effects), abs=1e-11)
    assert values(made, IndexKind.SIGMA) == pytest.approx(np.zeros((3, 4)), abs=1e-11)


def test_few_effects_have_the_moments_of_a_sample() -> None:
    made = known_study(PRODUCT, DesignKind.MORRIS, 9)
    effects = [
        [path[1, 1 - k] if path[0, 1 - k] == path[1, 1 - k] else path[2, 1 - k] for k in range(2)]
        for path in design_points(made).reshape(9, 3, 2)
    ]
    found = estimate(PRODUCT, made)
    assert values(found, IndexKind.MU)[0] == pytest.approx(np.mean(effects, axis=0))
    assert values(found, IndexKind.SIGMA)[0] == pytest.approx(np.std(effects, axis=0, ddof=1))


def test_interval_of_a_mean_of_many_is_that_of_the_normal_distribution() -> None:
    found = estimate(PRODUCT, known_study(PRODUCT, DesignKind.MORRIS, 1000, resamples=4000))
    _, low, high = values(found, IndexKind.MU)
    expected = 2.0 * stats.norm.ppf(0.975) * values(found, IndexKind.SIGMA)[0] / np.sqrt(1000)
    assert high - low == pytest.approx(expected, rel=0.08)


def test_effects_of_both_signs_count_in_mu_star() -> None:
    made = estimate(PRODUCT, known_study(PRODUCT, DesignKind.MORRIS, 500, bounds=(-1.0, 1.0)))
    # The slope is the range 2 times -3/4, -1/4, 1/4 or 3/4.
    assert values(made, IndexKind.MU_STAR)[0] == pytest.approx([1.0, 1.0], rel=0.05)
    assert np.abs(values(made, IndexKind.MU)[0]).max() < 0.15


@pytest.mark.parametrize("kind", [DesignKind.SOBOL, DesignKind.MORRIS])
def test_failed_runs_leave_out_their_samples(kind: DesignKind) -> None:
    known = ISHIGAMI
    made = known_study(known, kind, 64)
    complete = results(known.function(design_points(made)))
    size = len(complete) // 64
    failed = list(complete)
    failed[3] = RunResult("solver failed", "the solver failed after 0.1 s", {"swing": 3.0})
    failed[5 * size] = RunResult("done", "", {"swing": None})
    failed[5 * size + 1] = RunResult("died", "its process ended twice", {})
    found = estimate_indices(made, failed).measures["swing"]
    assert found.samples == 62
    assert found.message == "Left out because of failed runs: 2 of 64 samples."
    # The values of the failed runs have no influence, those of the others have.
    without = estimate_indices(made, complete).measures["swing"]
    assert found.parameters != without.parameters
    failed[4 if size > 4 else 2] = done(swing=1e6)
    assert estimate_indices(made, failed).measures["swing"] == found


@pytest.mark.parametrize("kind", [DesignKind.SOBOL, DesignKind.MORRIS])
def test_constant_measure_has_no_indices(kind: DesignKind) -> None:
    made = known_study(ISHIGAMI, kind, 16)
    count = len(design_points(made))
    noise = np.random.default_rng(3).normal(size=count)
    for outputs in (np.full(count, 0.3), np.zeros(count), 0.3 + 1e-15 * noise):
        found = estimate_indices(made, results(outputs)).measures["swing"]
        assert not found.parameters
        assert found.message.startswith("All samples have the value 0")
    small = 1e-15 * noise
    assert estimate_indices(made, results(small)).measures["swing"].parameters


def test_force_without_a_touch_has_no_indices() -> None:
    made = known_study(ISHIGAMI, DesignKind.MORRIS, MIN_SAMPLES)
    nothing = results(np.zeros(len(design_points(made))))
    for column, name in (
        ("part.left_hand.peak_force", "left_hand"),
        ("head.contact_force", "head"),
    ):
        force = Measure("swing", f"{column} [N]", Statistic.LARGEST)
        found = estimate_indices(replace(made, measures={"swing": force}), nothing)
        message = f"All samples have the value 0: `{name}` touches nothing in any run."
        assert found.measures["swing"].message == message


def test_too_few_samples_have_no_indices() -> None:
    made = known_study(ISHIGAMI, DesignKind.SOBOL, MIN_SAMPLES)
    outputs = results(ISHIGAMI.function(design_points(made)))
    assert estimate_indices(made, outputs).measures["swing"].parameters
    outputs[0] = RunResult("died", "", {})
    found = estimate_indices(made, outputs).measures["swing"]
    assert not found.parameters
    assert found.message == "7 of 8 samples are complete: indices need 8."


def test_measure_that_is_mostly_constant_has_an_interval() -> None:
    """Some bootstrap samples have equal outputs only, and say nothing."""
    made = known_study(ISHIGAMI, DesignKind.SOBOL, 16)
    outputs = np.zeros(len(design_points(made)))
    outputs[0] = 1.0
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = estimate_indices(made, results(outputs))
    assert np.isfinite(values(found, IndexKind.TOTAL)).all()


def test_correlations_of_a_linear_function_are_known() -> None:
    made = known_study(SOBOL_G, DesignKind.LATIN_HYPERCUBE, 400)
    points = design_points(made)
    weights = np.array([3.0, -2.0, 1.0, *np.zeros(points.shape[1] - 3)])
    found = estimate_indices(made, results(points @ weights + 7.0))
    spread = np.std(points @ weights)
    regression = values(found, IndexKind.REGRESSION)[0]
    assert regression == pytest.approx(weights * points.std(axis=0) / spread, abs=1e-9)
    measure = found.measures["swing"]
    assert measure.r2 is not None
    assert vars(measure.r2) == pytest.approx({"value": 1.0, "low": 1.0, "high": 1.0})
    theirs = [stats.spearmanr(column, points @ weights)[0] for column in points.T]
    value, low, high = values(found, IndexKind.RANK)
    assert value == pytest.approx(theirs, abs=1e-12)
    assert ((low < value) & (value < high)).all()
    assert measure.ranked(IndexKind.RANK)[:3] == ["p0", "p1", "p2"]


def test_ranks_know_a_monotone_function_and_a_regression_does_not() -> None:
    made = known_study(SOBOL_G, DesignKind.LATIN_HYPERCUBE, 100)
    found = estimate_indices(made, results(np.exp(20.0 * design_points(made)[:, 0])))
    measure = found.measures["swing"]
    assert measure.parameters["p0"][IndexKind.RANK].value == pytest.approx(1.0)
    assert measure.r2 is not None
    assert measure.r2.value < 0.7


def test_intervals_of_rank_correlations_contain_the_true_one() -> None:
    """Of 200 studies with noise, 95 % intervals contain the correlation of very many runs."""
    rng = np.random.default_rng(1)

    def sample(count: int) -> tuple[Array, Array]:
        x = rng.random((count, 2))
        return x, x[:, 0] ** 2 + 0.3 * rng.normal(size=count)

    truth = stats.spearmanr(*(each.T[0] if each.ndim > 1 else each for each in sample(200_000)))[0]
    hits = 0
    for seed in range(200):
        found, _ = correlations(*sample(60), Sensitivity(0.95, 200), seed)
        one = found[0][IndexKind.RANK]
        hits += one.low <= truth <= one.high
    assert 0.89 <= hits / 200 <= 0.99


def test_few_runs_and_constant_samples_have_no_warning() -> None:
    made = known_study(ISHIGAMI, DesignKind.LATIN_HYPERCUBE, 8)
    outputs = np.zeros(8)
    outputs[0] = 1.0
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = estimate_indices(made, results(outputs))
    assert np.isfinite(values(found, IndexKind.RANK)).all()
    many = known_study(SOBOL_G, DesignKind.LATIN_HYPERCUBE, 8)
    few = estimate_indices(many, results(np.arange(8.0)))
    assert len(SOBOL_G.first) + 2 <= 8 or "a regression needs more" in few.measures["swing"].message


def test_same_runs_have_the_same_indices() -> None:
    made = known_study(SOBOL_G, DesignKind.SOBOL, 32)
    assert estimate(SOBOL_G, made) == estimate(SOBOL_G, made)


@pytest.mark.parametrize("kind", [DesignKind.GRID, DesignKind.LIST, DesignKind.SOBOL])
def test_other_designs_have_no_indices(kind: DesignKind) -> None:
    made = replace(known_study(SOBOL_G, kind, 8), sensitivity=None)
    with pytest.raises(ModelError, match="has no sensitivity indices"):
        estimate_indices(made, ())


def test_indices_need_all_runs() -> None:
    with pytest.raises(ModelError, match="indices need all 96 runs, but 1 are there"):
        estimate_indices(known_study(SOBOL_G, DesignKind.SOBOL, 16), results(np.zeros(1)))


@pytest.mark.parametrize("kind", [DesignKind.SOBOL, DesignKind.MORRIS, DesignKind.LATIN_HYPERCUBE])
def test_file_has_the_indices(kind: DesignKind, tmp_path: Path) -> None:
    made = estimate(ISHIGAMI, known_study(ISHIGAMI, kind, 16))
    path = tmp_path / INDICES_NAME
    write_indices(made, path)
    assert read_indices(path) == made
    data = json.loads(path.read_text())
    estimated = made.measures["swing"].parameters["p1"]
    for index, one in estimated.items():
        written = data["measures"]["swing"]["indices"]["p1"][index.value]
        assert written == {"value": one.value, "low": one.low, "high": one.high}


def test_number_that_is_not_finite_is_null(tmp_path: Path) -> None:
    made = estimate(ISHIGAMI, known_study(ISHIGAMI, DesignKind.SOBOL, 16))
    parameters = {
        name: {kind: replace(one, low=float("nan")) for kind, one in each.items()}
        for name, each in made.measures["swing"].parameters.items()
    }
    made = replace(made, measures={"swing": replace(made.measures["swing"], parameters=parameters)})
    path = tmp_path / INDICES_NAME
    write_indices(made, path)
    assert (
        json.loads(path.read_text())["measures"]["swing"]["indices"]["p0"]["total"]["low"] is None
    )
    assert np.isnan(values(read_indices(path), IndexKind.TOTAL)[1]).all()


JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner),
    max_leaves=5,
)


@settings(max_examples=40)
@given(
    key=st.sampled_from(["design", "samples", "confidence", "parameters", "measures"]), value=JSON
)
def test_damaged_file_is_an_input_error(
    tmp_path_factory: pytest.TempPathFactory, key: str, value: object
) -> None:
    path = tmp_path_factory.mktemp("damaged") / INDICES_NAME
    sound: Mapping[str, object] = {
        "figure": "pendulum",
        "design": "sobol",
        "samples": 8,
        "confidence": 0.95,
        "resamples": 10,
        "parameters": {},
        "measures": {"swing": {}},
    }
    path.write_text(json.dumps({**sound, key: value}), encoding="utf-8")
    if key == "measures" and value == {}:
        assert read_indices(path).measures == {}
        return
    with pytest.raises(InputError, match="not a file of sensitivity indices"):
        read_indices(path)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ('"total"', '"sigma"'),
        ('"p0": {', '"p9": {'),
        ('"sobol"', '"morris"'),
        ('"sobol"', '"grid"'),
    ],
)
def test_file_of_other_indices_is_an_input_error(old: str, new: str, tmp_path: Path) -> None:
    path = tmp_path / INDICES_NAME
    write_indices(estimate(ISHIGAMI, known_study(ISHIGAMI, DesignKind.SOBOL, 16)), path)
    text = path.read_text(encoding="utf-8")
    assert old in text
    path.write_text(text.replace(old, new), encoding="utf-8")
    with pytest.raises(InputError, match="not a file of sensitivity indices"):
        read_indices(path)


@pytest.mark.parametrize("kind", [DesignKind.SOBOL, DesignKind.MORRIS, DesignKind.LATIN_HYPERCUBE])
def test_indices_show_the_largest_first(kind: DesignKind) -> None:
    made = known_study(SOBOL_G, kind, 64)
    indices = estimate(SOBOL_G, made)
    measure, main = indices.measures["swing"], MAIN_KINDS[kind]
    rows = [f"<td>{name}</td><td>{measure.parameters[name][main]}<" for name in measure.parameters]
    page = indices._repr_html_()
    places = {row: page.index(row) for row in rows}
    sizes = [abs(each[main].value) for each in measure.parameters.values()]
    assert sorted(rows, key=places.__getitem__) == [rows[k] for k in np.argsort(sizes)[::-1]]
    constant = estimate_indices(made, results(np.zeros(len(design_points(made)))))
    assert "sensitivity of swing. All samples have the value 0" in constant._repr_html_()
