"""docs/studies.md: its study makes the runs that the page shows, and its code reads their table."""

import re
from contextlib import redirect_stdout
from io import StringIO
from pathlib import Path

import numpy as np
import pytest

from generator import design_points, run_case
from generator.study.run_table import table_titles
from tests.paths import DOCS, FIGURES
from tests.study_runs import parse_study_text

PAGE = (DOCS / "studies.md").read_text(encoding="utf-8")


def test_the_study_of_the_page(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    (text,) = re.findall(r"^```toml\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL)
    study = parse_study_text(text, FIGURES).require_value()
    points = design_points(study)
    assert f"{len(points)} runs of leg" in PAGE
    titles, *rows = re.findall(r"^    ((?:run|\d+),.*)$", PAGE, re.MULTILINE)
    assert titles.split(",") == table_titles(study)
    for number, row in enumerate(rows):
        result = run_case(study, points[number].tolist())
        printed = [float(cell) for cell in row.split(",")[1:6]]
        assert printed == pytest.approx([*points[number], *result.measures.values()], rel=1e-6)
        assert row.split(",")[6] == result.outcome
    (code,) = (
        code
        for code in re.findall(r"^```python\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL)
        if "numpy" in code
    )
    monkeypatch.chdir(tmp_path)
    Path("knee").mkdir()
    Path("knee/runs.csv").write_text("\n".join([titles, *rows, "2,1,1,1,,,died,a, b"]) + "\n")
    with redirect_stdout(StringIO()):
        exec(code, names := {})
    assert np.isnan(names["runs"]["flexion"][-1])
    assert names["runs"]["time"][0] == pytest.approx(0.51083, abs=1e-5)
