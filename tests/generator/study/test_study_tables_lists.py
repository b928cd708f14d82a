"""Lists of a study: rows are values of the parameters, whatever the order of the columns."""

import csv
from collections.abc import Sequence
from io import StringIO
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from generator.diagnostics import Severity
from generator.study.designs import design_points
from generator.study.study import DesignKind
from tests.study_runs import parse_study_text

TEXT = """\
figure = "pendulum"
[design]
kind = "list"
file = "points.csv"
[parameters]
a = { path = "pose.shoulder.1" }
b-2 = { path = "velocity.shoulder.1" }
c = { path = "pose.shoulder.3" }
[measures]
end = { column = "kinetic [J]", take = "last" }
"""
NAMES = ("a", "b-2", "c")


def read_points(folder: Path, table: str):
    """Return the points of the study with a list."""
    (folder / "points.csv").write_text(table, "utf-8")
    parsed = parse_study_text(TEXT, folder)
    assert parsed.diagnostics == ()
    study = parsed.require_value()
    assert study.design.kind is DesignKind.LIST
    assert all(one.distribution is None for one in study.parameters.values())
    return design_points(study)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("lists")


ROWS = st.lists(st.lists(st.floats(-1e6, 1e6), min_size=3, max_size=3), min_size=1, max_size=5)


@given(rows=ROWS, order=st.permutations(range(3)))
@settings(max_examples=30, deadline=None)
def test_a_list_is_read_exactly(folder: Path, rows: list[list[float]], order: Sequence[int]):
    text = StringIO()
    table = csv.writer(text)
    table.writerow([NAMES[k] for k in order])
    table.writerows([[repr(row[k]) for k in order] for row in rows])
    assert np.array_equal(read_points(folder, text.getvalue()), rows)


def test_comments_and_blank_lines_are_not_rows(tmp_path: Path):
    table = "# of a survey\n\n a , c,b-2\r\n1,3, 2e0\r\n\r\n# end\n"
    assert np.array_equal(read_points(tmp_path, table), [[1.0, 2.0, 3.0]])


def test_the_kind_of_a_study_is_changed_by_its_word_alone(tmp_path: Path):
    (tmp_path / "points.csv").write_text("a,b-2,c\n1,2,3\n", "utf-8")
    text = TEXT.replace('"pose.shoulder.1"', '"pose.shoulder.1", low = 0, high = 1')
    parsed = parse_study_text(text, tmp_path)
    assert [one.severity for one in parsed.diagnostics] == [Severity.WARNING]
    study = parsed.require_value()
    assert study.parameters["a"].distribution is None
    assert np.array_equal(design_points(study), [[1.0, 2.0, 3.0]])
