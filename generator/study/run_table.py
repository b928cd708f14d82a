"""The table of the runs of a study, as comma-separated values or as Parquet."""

from collections.abc import Iterator, Sequence
from importlib import import_module
from importlib.util import find_spec
from io import BufferedWriter
from itertools import chain, islice
from pathlib import Path
from typing import Any

from generator.diagnostics import NotInstalledError, UsageError
from generator.rotations import Array
from generator.study.study import RunResult, Study
from generator.text_io import csv_lines, open_atomic

Cell = int | float | str | None

_ROWS_AT_ONCE = 100_000
"""Rows of a .parquet table that are in memory at a time."""


def check_table_path(path: Path) -> None:
    """Check that a table can have this name.

    Raises:
        UsageError: the suffix is not .csv or .parquet.
        NotInstalledError: a library is missing.
    """
    suffix = path.suffix.lower()
    if suffix not in (".csv", ".parquet"):
        raise UsageError(f"{path}: the table of runs is a .csv or a .parquet file")
    if suffix == ".parquet" and find_spec("pyarrow") is None:
        raise NotInstalledError(
            f"{path}: a .parquet table needs pyarrow, which is not installed: "
            "`pip install pyarrow`, or choose a .csv file"
        )


def write_run_table(path: Path, study: Study, points: Array, rows: Sequence[RunResult]) -> None:
    """Write the table of runs, whole or not at all, a part after the other.

    Its columns are `run`, parameters, measures, `outcome` and `message`. Numbers are exact; a
    measure that a run does not have is blank.

    Args:
        path: path of the .csv or .parquet file.
        study: that the runs belong to.
        points: values of the parameters of each run, shape (runs, parameters).
        rows: results of the runs.

    Raises:
        OSError: the file cannot be written.
    """
    with open_atomic(path) as stream:
        if path.suffix.lower() == ".parquet":
            _write_parquet(stream, study, points, rows)
            return
        lines = (
            [repr(float(cell)) if isinstance(cell, float) else cell for cell in line]
            for line in _table_rows(study, points, rows)
        )
        text = csv_lines(chain([table_titles(study)], lines))
        stream.writelines(line.encode() for line in text)


def table_titles(study: Study) -> list[str]:
    """Titles of the columns."""
    return ["run", *study.parameters, *study.measures, "outcome", "message"]


def _table_rows(study: Study, points: Array, rows: Sequence[RunResult]) -> Iterator[list[Cell]]:
    for index, (values, row) in enumerate(zip(points, rows, strict=True)):
        measures = [row.measures[name] for name in study.measures]
        yield [index, *values.tolist(), *measures, row.outcome, row.message]


def _write_parquet(
    stream: BufferedWriter, study: Study, points: Array, rows: Sequence[RunResult]
) -> None:
    pyarrow: Any = import_module("pyarrow")  # has no types
    parquet: Any = import_module("pyarrow.parquet")
    titles = table_titles(study)
    numbers = len(titles) - 3  # beside the run, the outcome and the message
    kinds = [pyarrow.int64(), *[pyarrow.float64()] * numbers, *[pyarrow.string()] * 2]
    schema = pyarrow.schema(list(zip(titles, kinds, strict=True)))
    lines = _table_rows(study, points, rows)
    with parquet.ParquetWriter(stream, schema) as writer:
        while part := list(islice(lines, _ROWS_AT_ONCE)):
            columns = zip(*part, strict=True)
            arrays = [
                pyarrow.array(column, kind) for column, kind in zip(columns, kinds, strict=True)
            ]
            writer.write_table(pyarrow.Table.from_arrays(arrays, schema=schema))
