"""Tables: columns, units and headers; `tests/properties` reads every number back."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from generator import write_recording
from generator.motion_files.tables import write_csv, write_mot, write_sto
from generator.recording import ENERGY_KINDS
from tests.motion_readers import read_table
from tests.motions import any_motion, clip, slides

WRITERS = {"mot": write_mot, "sto": write_sto}


def opensim_columns(path: Path, how: str) -> tuple[list[float], dict[str, list[float]], bool]:
    """Times, columns and whether angles are in degrees, as OpenSim's two readers have them."""
    osim: Any = pytest.importorskip("opensim")
    osim.Logger.setLevelString("Error")
    if how == "TimeSeriesTable":
        table = osim.TimeSeriesTable(str(path))
        columns = {
            label: [table.getDependentColumn(label)[k] for k in range(table.getNumRows())]
            for label in table.getColumnLabels()
        }
        in_degrees = table.getTableMetaDataString("inDegrees") == "yes"
        return list(table.getIndependentColumn()), columns, in_degrees
    stored, times = osim.Storage(str(path)), osim.ArrayDouble()
    stored.getTimeColumn(times)
    labels, columns = stored.getColumnLabels(), {}
    for k in range(1, labels.getSize()):
        column = osim.ArrayDouble()
        stored.getDataColumn(labels.get(k), column)
        columns[labels.get(k)] = [column.get(row) for row in range(column.getSize())]
    return [times.get(k) for k in range(times.getSize())], columns, stored.isInDegrees()


@pytest.mark.verify
@pytest.mark.parametrize("how", ["Storage", "TimeSeriesTable"])
@pytest.mark.parametrize("suffix", WRITERS)
def test_opensim_reads_the_same_columns(suffix: str, how: str, tmp_path: Path):
    path = tmp_path / f"slides.{suffix}"
    WRITERS[suffix](any_motion(slides()), path)
    times, columns, in_degrees = opensim_columns(path, how)
    ours = read_table(path)
    assert ["time", *columns] == ours.labels
    assert np.array_equal(np.column_stack([times, *columns.values()]), ours.rows)
    assert in_degrees == (suffix == "mot")


def test_only_the_rotations_of_mot_files_are_in_degrees(tmp_path: Path):
    motion = any_motion(slides())
    first = {}
    for suffix, write in WRITERS.items():
        write(motion, tmp_path / f"slides.{suffix}")
        table = read_table(tmp_path / f"slides.{suffix}")
        assert table.header["inDegrees"] == ("yes" if suffix == "mot" else "no")
        first[suffix] = dict(zip(table.labels, table.rows[0].tolist(), strict=True))
    angle, length = motion.displacements["rail"][0].tolist()
    assert (first["sto"]["rail_1"], first["sto"]["rail_2"]) == (angle, length)
    assert (first["mot"]["rail_1"], first["mot"]["rail_2"]) == (np.degrees(angle), length)


def test_columns_of_a_csv_are_named_with_their_units(tmp_path: Path):
    motion = any_motion(slides())
    write_csv(motion, tmp_path / "slides.csv")
    lines = (tmp_path / "slides.csv").read_text(encoding="utf-8").splitlines()
    comments = [line for line in lines if line.startswith("#")]
    assert lines[: len(comments)] == comments
    assert {"# figure leg.fig", "# outcome done", "# message done"} <= set(comments)
    assert "# joint rail R(1,0,0)*T(0,0,1)" in comments
    assert comments[-1] == "# joint weld fixed"
    assert lines[len(comments)].split(",") == [
        "time [s]",
        "rail.1 [deg]",
        "rail.2 [cm]",
        "swing.1 [deg]",
        "swing.2 [deg]",
        "swing.3 [deg]",
        "telescope.1 [cm]",
        "telescope.2 [deg]",
    ]


def test_the_energies_of_a_run_stand_in_a_csv_to_the_last_digit(tmp_path: Path):
    motion = clip("slides")
    assert motion.recording is not None
    write_recording(motion.recording, motion.figure, tmp_path / "run.CSV")
    lines = (tmp_path / "run.CSV").read_text(encoding="utf-8").splitlines()
    titles, *rows = [line.split(",") for line in lines if not line.startswith("#")]
    assert titles[-5:] == [f"{kind} [J]" for kind in ENERGY_KINDS]
    columns = list(zip(*rows, strict=True))[-5:]
    for kind, column in zip(ENERGY_KINDS, columns, strict=True):
        assert [float(word) for word in column] == motion.recording.energy[kind].tolist()
