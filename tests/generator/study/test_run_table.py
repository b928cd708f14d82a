from math import inf
from pathlib import Path

import numpy as np
import pytest

from generator.diagnostics import NotInstalledError, UsageError
from generator.study.run_table import (
    check_table_path,
    table_titles,
    write_run_table,
)
from generator.study.study import RunResult
from tests.study_runs import list_study

VALUES = (0.1, 1.0, 2.0 / 3.0)
STUDY = list_study(*VALUES)
POINTS = np.array(STUDY.design.rows)
ROWS = (
    RunResult("done", "", {"swing": 1e-300, "end": np.float64(0.1)}),
    RunResult("solver failed", 'no "good", at all', {"end": None, "swing": None}),
    RunResult("done", "", {"end": inf, "swing": -0.0}),
)
TITLES = ["run", "g", "swing", "end", "outcome", "message"]


def test_a_file_of_comma_separated_values(tmp_path: Path) -> None:
    path = tmp_path / "runs.csv"
    write_run_table(path, STUDY, POINTS, ROWS)
    assert path.read_bytes().decode() == (
        "run,g,swing,end,outcome,message\n"
        "0,0.1,1e-300,0.1,done,\n"
        '1,1.0,,,solver failed,"no ""good"", at all"\n'
        "2,0.6666666666666666,-0.0,inf,done,\n"
    )
    assert table_titles(STUDY) == TITLES
    assert list(tmp_path.iterdir()) == [path]


def test_a_message_is_no_formula(tmp_path: Path) -> None:
    row = RunResult("done", '=HYPERLINK("x")', {"swing": -0.5, "end": None})
    path = tmp_path / "runs.csv"
    write_run_table(path, list_study(-1.0), np.array([[-1.0]]), [row])
    assert path.read_text().splitlines()[1] == '0,-1.0,-0.5,,done,"\'=HYPERLINK(""x"")"'


@pytest.mark.parametrize("count", [0, 3])
def test_a_parquet_file(tmp_path: Path, count: int) -> None:
    parquet = pytest.importorskip("pyarrow.parquet")
    path = tmp_path / "runs.parquet"
    check_table_path(path)
    write_run_table(path, STUDY, POINTS[:count], ROWS[:count])
    table = parquet.read_table(path).to_pydict()
    assert list(table) == TITLES
    assert table["g"] == list(VALUES)[:count]
    assert table["swing"] == [1e-300, None, -0.0][:count]
    assert table["message"] == [row.message for row in ROWS][:count]
    assert list(tmp_path.iterdir()) == [path]


def test_another_suffix_is_refused() -> None:
    with pytest.raises(UsageError, match=r"is a \.csv or a \.parquet file"):
        check_table_path(Path("runs.xlsx"))
    check_table_path(Path("RUNS.CSV"))


def test_parquet_needs_a_library(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("generator.study.run_table.find_spec", lambda name: None)
    with pytest.raises(NotInstalledError, match="pyarrow"):
        check_table_path(Path("runs.parquet"))
