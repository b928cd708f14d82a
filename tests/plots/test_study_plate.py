"""Plates of a study's folder: rankings, intervals, missing indices, runs over parameters."""

import csv
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.axes import Axes

from generator.diagnostics import InputError
from generator.study.designs import design_points
from generator.study.run_table import write_run_table
from generator.study.sensitivity import (
    INDICES_NAME,
    IndexKind,
    StudyIndices,
    estimate_indices,
    write_indices,
)
from generator.study.study import (
    DesignKind,
    Measure,
    Parameter,
    RunResult,
    Statistic,
    Study,
    Uniform,
)
from generator.study.sweep import STUDY_NAME, TABLE_NAME
from plots.canvas import add_title, plot_style
from plots.medium import Medium, drawing_for, prepare_for_paper
from plots.study_plate import (
    MAX_MEASURES,
    MAX_RANKED,
    MAX_SHOWN,
    StudyRuns,
    measure_plates,
    measure_unit,
    read_runs,
    sensitivity_plates,
    study_plates,
)
from springs.backends import Array
from tests.command import answer, mover
from tests.known_functions import ISHIGAMI, known_study

COLUMNS = {
    "swing": ("left_knee.1 [deg]", Statistic.LARGEST),
    "impact": ("kinetic [J]", Statistic.TIME_OF_LARGEST),
    "still": ("kinetic [J]", Statistic.LAST),
}
MEASURES = {name: Measure(name, *each) for name, each in COLUMNS.items()}
SLOPES = np.array([1.0, 5.0, -0.2])
FAILED = 7


def study(kind: DesignKind, runs: int) -> Study:
    return replace(known_study(ISHIGAMI, kind, runs), measures=MEASURES)


def rows_of(points: Array) -> list[RunResult]:
    """Results of known functions; one run has failed, and one measure is constant."""
    swing, impact = ISHIGAMI.function(points), points @ SLOPES
    rows = [
        RunResult("done", "", {"swing": float(a), "impact": float(b), "still": 0.0})
        for a, b in zip(swing, impact, strict=True)
    ]
    rows[FAILED] = RunResult("solver failed", "it failed", dict.fromkeys(MEASURES))
    return rows


def indices(kind: DesignKind = DesignKind.SOBOL, runs: int = 64) -> StudyIndices:
    made = study(kind, runs)
    return estimate_indices(made, rows_of(design_points(made)))


def write_folder(folder: Path, made: Study, rows: Sequence[RunResult]) -> Path:
    """Write a study's folder as a sweep does."""
    folder.mkdir()
    parameters = (
        f'{name} = {{ path = "{each.paths[0]}" }}' for name, each in made.parameters.items()
    )
    measures = (
        f'{name} = {{ column = "{each.column}", take = "{each.take}" }}'
        for name, each in made.measures.items()
    )
    text = "\n".join(["[parameters]", *parameters, "[measures]", *measures, ""])
    (folder / STUDY_NAME).write_text(text, encoding="utf-8")
    write_run_table(folder / TABLE_NAME, made, design_points(made), rows)
    return folder


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = study(DesignKind.SOBOL, 64)
    rows = rows_of(design_points(made))
    path = write_folder(tmp_path_factory.mktemp("studies") / "My fall", made, rows)
    write_indices(estimate_indices(made, rows), path / INDICES_NAME)
    return path


def names(axes: Axes) -> list[str]:
    return [label.get_text() for label in axes.get_yticklabels()]


def bars(axes: Axes) -> list[tuple[float, ...]]:
    """Ends of the bars of intervals."""
    lines = [np.asarray(line.get_xdata()) for line in axes.lines]
    return [tuple(x) for x in lines if len(x) == 2 and x[0] != x[1]]


@pytest.mark.parametrize(
    ("kind", "main", "beside"),
    [
        (DesignKind.SOBOL, IndexKind.TOTAL, IndexKind.FIRST),
        (DesignKind.MORRIS, IndexKind.MU_STAR, IndexKind.SIGMA),
        (DesignKind.LATIN_HYPERCUBE, IndexKind.RANK, IndexKind.REGRESSION),
    ],
)
def test_each_measure_ranks_the_parameters(
    kind: DesignKind, main: IndexKind, beside: IndexKind
) -> None:
    made = indices(kind)
    (plate,) = sensitivity_plates(made, "fall")
    assert plate.name == "fall_sensitivity"
    for axes, (name, measure) in zip(plate.figure.axes[:2], made.measures.items(), strict=False):
        assert axes.get_title(loc="left").startswith(f"{name}: ")
        values = [measure.parameters[each][main].value for each in names(axes)]
        assert len(values) == 3
        assert values == sorted(values, reverse=True)
        drawn = bars(axes)
        for each in measure.parameters.values():
            for estimate in (each[main], each[beside]):
                ends = (estimate.low, estimate.high)
                assert ends in drawn or ends[0] == ends[1]
    assert names(plate.figure.axes[1])[0] == "p1"


def test_table_has_the_ranked_numbers() -> None:
    made = indices()
    (plate,) = sensitivity_plates(made, "fall")
    columns = plate.tables["1_swing"]
    numbers = next(values for title, values in columns.items() if "1 = p0, 2 = p1" in title)
    ranked = [made.measures["swing"].parameters[f"p{int(number) - 1}"] for number in numbers]
    assert columns["total low"].tolist() == [each[IndexKind.TOTAL].low for each in ranked]
    assert columns["first"].tolist() == [each[IndexKind.FIRST].value for each in ranked]


def test_samples_left_out_and_missing_indices_are_written_on_the_plate() -> None:
    (plate,) = sensitivity_plates(indices(), "fall")
    swing, _, still = plate.figure.axes
    assert "Left out because of failed runs: 1 of 64 samples." in swing.get_xlabel()
    assert "still: All samples have the value 0" in plate.caption
    assert "All samples have the value 0" in still.texts[0].get_text()
    assert not still.lines


def many(parameters: int, measures: int) -> StudyIndices:
    """Indices of the same measure again and again, of parameters with falling influence."""
    made = known_study(ISHIGAMI, DesignKind.SOBOL, 8)
    every = {f"q{k}": Parameter(f"q{k}", (f"a.{k}",), Uniform(0.0, 1.0)) for k in range(parameters)}
    taken = {f"m{k}": Measure(f"m{k}", "kinetic [J]", Statistic.LAST) for k in range(measures)}
    made = replace(made, parameters=every, measures=taken)
    outputs = design_points(made) @ (0.5 ** np.arange(parameters))
    rows = [RunResult("done", "", dict.fromkeys(taken, float(each))) for each in outputs]
    return estimate_indices(made, rows)


def test_many_parameters_end_in_a_line_of_text() -> None:
    (plate,) = sensitivity_plates(many(MAX_RANKED + 3, 1), "fall")
    (axes,) = plate.figure.axes
    assert len(names(axes)) == MAX_RANKED
    assert "3 more parameters: at most" in axes.get_xlabel()
    assert all(len(column) == MAX_RANKED + 3 for column in plate.tables["1_m0"].values())


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("width", [85, 174])
def test_layout_has_room_for_long_names(width: int) -> None:
    made = many(3, 2)
    names_of = {f"q{k}": f"{k}_" + "scale_of_a_joint" * 4 for k in range(3)}
    measures = {
        f"{name}_{'measure' * 5}": replace(
            one, parameters={names_of[each]: found for each, found in one.parameters.items()}
        )
        for name, one in made.measures.items()
    }
    made = replace(made, measures=measures, paths=dict.fromkeys(names_of.values(), ("a",)))
    with drawing_for(Medium.paper(width)), plot_style():
        (plate,) = sensitivity_plates(made, "fall")
        prepare_for_paper(plate.figure)
        plate.figure.draw_without_rendering()


def test_many_measures_have_several_plates() -> None:
    plates = list(sensitivity_plates(many(2, MAX_MEASURES + 1), "fall"))
    assert [plate.name for plate in plates] == ["fall_sensitivity_1", "fall_sensitivity_2"]
    assert [len(plate.figure.axes) for plate in plates] == [MAX_MEASURES, 1]


@pytest.mark.parametrize(
    ("column", "take", "unit"),
    [
        ("left_knee.1 [deg]", "largest", "deg"),
        ("left_knee.1 [deg]", "time of largest", "s"),
        ("count", "last", ""),
    ],
)
def test_unit_of_a_measure(column: str, take: str, unit: str) -> None:
    assert measure_unit(column, take) == unit


def drawn_runs(axes: Axes, marker: str) -> tuple[Array, Array]:
    line = next(line for line in axes.lines if line.get_marker() == marker)
    return np.asarray(line.get_xdata()), np.asarray(line.get_ydata())


def test_runs_over_parameters_have_their_values_and_their_failures(folder: Path) -> None:
    made = study(DesignKind.SOBOL, 64)
    points, (plate,) = design_points(made), measure_plates(read_runs(folder), "fall")
    outputs = points @ SLOPES
    done = np.arange(len(points)) != FAILED
    panels = plate.figure.axes
    assert [axes.get_xlabel() for axes in panels[-3:]] == ["p0", "p1", "p2"]
    for k, axes in enumerate(panels[3:6]):
        x, y = drawn_runs(axes, ".")
        assert (x == points[done, k]).all()
        assert y == pytest.approx(outputs[done])
        assert drawn_runs(axes, "x")[0].tolist() == [points[FAILED, k]]
    assert plate.title == "My fall: 320 runs, 1 failed"


def test_median_follows_a_parameter() -> None:
    values = np.linspace(0.0, 1.0, 400)
    noise = np.random.default_rng(2).uniform(-0.1, 0.1, 400)
    levels = np.tile([1.0, 3.0], 200)
    runs = runs_of({"a": values, "b": levels}, {"m": 2.0 * values + noise, "n": levels})
    (plate,) = measure_plates(runs, "fall")
    panels = plate.figure.axes
    median = next(line for line in panels[0].lines if np.size(line.get_xdata()) == 8)
    x, y = np.asarray(median.get_xdata()), np.asarray(median.get_ydata())
    assert x == pytest.approx((np.arange(8) + 0.5) / 8, abs=2e-3)
    assert y == pytest.approx(2.0 * x, abs=0.06)
    of_levels = next(line for line in panels[3].lines if line.get_marker() == "o")
    assert np.asarray(of_levels.get_xdata()).tolist() == [1.0, 3.0]
    assert np.asarray(of_levels.get_ydata()).tolist() == [1.0, 3.0]


def runs_of(parameters: Mapping[str, Array], measures: Mapping[str, Array]) -> StudyRuns:
    count = len(next(iter(parameters.values())))
    titles = {name: name for name in measures}
    return StudyRuns("fall", parameters, measures, titles, np.ones(count, dtype=bool))


def study_of_six() -> Study:
    made = known_study(ISHIGAMI, DesignKind.LATIN_HYPERCUBE, 2000)
    names = [f"p{k}" for k in range(MAX_SHOWN + 2)]
    every = {name: Parameter(name, (name,), Uniform(0.0, 1.0)) for name in names}
    return replace(made, parameters=every)


def test_most_influential_parameters_are_shown() -> None:
    points = design_points(study_of_six())
    parameters = {f"p{k}": column for k, column in enumerate(points.T)}
    outputs = np.exp(points[:, 2:] @ np.array([1.0, -2.0, 1.5, 3.0]))
    (plate,) = measure_plates(runs_of(parameters, {"m": outputs}), "fall")
    shown = [axes.get_xlabel() for axes in plate.figure.axes]
    assert shown == ["p2", "p3", "p4", "p5"]
    assert len(shown) == MAX_SHOWN
    assert "Left out: 2 parameters" in plate.caption
    assert set(plate.tables["runs"]) == {*parameters, "m"}


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize(
    ("count", "value", "runs_text"), [(1, np.nan, "1 run"), (100, 2.0, "100 runs")]
)
def test_layout_has_room_for_titles_of_few_runs_and_of_many(
    count: int, value: float, runs_text: str
) -> None:
    parameters = {f"p{k}": np.arange(count, dtype=float) for k in range(MAX_SHOWN)}
    title = "a_measure: time of the largest right_acromioclavicular_joint.2 [deg]"
    measures = {"m": np.full(count, value), "n": np.full(count, value)}
    runs = replace(runs_of(parameters, measures), titles=dict.fromkeys(measures, title))
    (plate,) = measure_plates(runs, "fall")
    assert plate.title == f"fall: {runs_text}"
    with plot_style():
        add_title(plate.figure, plate.title)
        plate.figure.draw_without_rendering()
    size = plate.figure.axes[0].get_position()
    assert size.width > 0.15
    assert size.height > 0.15


@pytest.mark.slow
def test_command_draws_a_folder(folder: Path, tmp_path: Path) -> None:
    data = answer("plots", folder, "-o", tmp_path / "out")
    assert [plate["name"] for plate in data["plates"]] == ["my_fall_sensitivity", "my_fall_runs"]
    report = (tmp_path / "out/report.html").read_text(encoding="utf-8")
    assert "sensitivity to parameters, with 95 % intervals" in report
    with (tmp_path / "out/my_fall_sensitivity.2_impact.csv").open(encoding="utf-8") as lines:
        rows = list(csv.DictReader(line for line in lines if not line.startswith("#")))
    assert [float(row["total"]) for row in rows] == sorted(
        (float(row["total"]) for row in rows), reverse=True
    )


def test_plates_fit_a_column_of_a_paper(folder: Path) -> None:
    with drawing_for(Medium.paper(85)), plot_style():
        ranking, runs = study_plates(folder)
        for plate in (ranking, runs):
            prepare_for_paper(plate.figure)
    assert len(runs.figure.axes) == len(MEASURES)


def test_folder_without_indices_has_its_runs(tmp_path: Path) -> None:
    made = study(DesignKind.LATIN_HYPERCUBE, 20)
    path = write_folder(tmp_path / "plain", made, rows_of(design_points(made)))
    assert [plate.name for plate in study_plates(path)] == ["plain_runs"]


def test_folder_that_cannot_be_drawn(folder: Path, tmp_path: Path) -> None:
    refused = mover("plots", tmp_path, "-o", tmp_path / "out")
    assert refused.exit_code == 1
    assert "has no table of runs, `runs.csv`" in refused.stderr
    assert not (tmp_path / "out").exists()
    mixed = mover("plots", folder, "elbow", "-o", tmp_path / "out")
    assert (mixed.exit_code, "in separate commands" in mixed.stderr) == (2, True)
    twice = mover("plots", folder, folder, "-o", tmp_path / "out")
    assert (twice.exit_code, "would be written as" in twice.stderr) == (2, True)


@pytest.mark.parametrize("name", [STUDY_NAME, TABLE_NAME, INDICES_NAME])
@pytest.mark.parametrize("text", ["", "[", "run,p0\n1,2\n", "x = 1\n"])
def test_damaged_files_are_input_errors(tmp_path: Path, name: str, text: str) -> None:
    made = study(DesignKind.SOBOL, 8)
    path = write_folder(tmp_path / "damaged", made, rows_of(design_points(made)))
    (path / name).write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=r"is not the table of its study|not a file of sens"):
        study_plates(path)


@pytest.mark.slow
def test_name_of_a_plate_comes_between_folders_with_and_without_runs(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "elbow").mkdir()
    monkeypatch.chdir(tmp_path)
    as_plate = mover("plots", "elbow", folder, "-o", "out")
    assert "in separate commands" in as_plate.stderr
    as_folder = mover("plots", "./elbow", folder, "-o", "out")
    assert "`elbow` has no table of runs" in as_folder.stderr
    made = study(DesignKind.LATIN_HYPERCUBE, 20)
    write_folder(tmp_path / "knee", made, rows_of(design_points(made)))
    assert mover("plots", "knee", "-o", "out").exit_code == 0
    assert (tmp_path / "out" / "knee_runs.svg").exists()
