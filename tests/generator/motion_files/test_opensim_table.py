"""Tables: columns, units and headers; `tests/properties` reads every number back."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from generator import Plan, simulate
from generator.model_files.opensim import write as osim
from generator.motion_files import motion_from_recording
from generator.motion_files.opensim_table import (
    GROUND_REACTION_LABELS,
    point_wrench,
    write_mot,
    write_sto,
)
from springs import SpringSet
from tests.chains import FREE, body, figure, ground, joint
from tests.contacts import contact_record, touching_run
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


@pytest.mark.parametrize("suffix", WRITERS)
def test_opensim_tables_end_with_a_wrench_equivalent_to_the_ground_reaction(
    suffix: str, tmp_path: Path
):
    """Also in frames without a centre of pressure."""
    motion, run = touching_run()
    assert run.contact is not None
    reaction = run.contact.ground_reaction
    WRITERS[suffix](motion, tmp_path / "run")
    table, bare = read_table(tmp_path / "run"), tmp_path / "bare"
    WRITERS[suffix](clip("slides"), bare)
    assert table.labels == [*read_table(bare).labels, *GROUND_REACTION_LABELS]
    assert int(table.header["nColumns"]) == len(table.labels)
    forces, points, moments = np.split(table.rows[:, -9:], 3, axis=1)
    assert np.array_equal(forces, reaction[:, :3])
    assert np.cross(points, forces) + moments == pytest.approx(reaction[:, 3:], abs=1e-10)
    assert not points[:, 1].any()
    assert not table.rows[0, -9:].any()
    assert not points[1].any()
    assert not moments[2:, (0, 2)].any()


@pytest.mark.verify
@pytest.mark.parametrize("how", ["Storage", "TimeSeriesTable"])
@pytest.mark.parametrize("suffix", WRITERS)
def test_opensim_reads_the_columns_of_the_ground_reaction(suffix: str, how: str, tmp_path: Path):
    motion, run = touching_run()
    assert run.contact is not None
    path = tmp_path / f"run.{suffix}"
    WRITERS[suffix](motion, path)
    _, columns, _ = opensim_columns(path, how)
    found = np.column_stack([columns[label] for label in GROUND_REACTION_LABELS])
    assert np.array_equal(found, point_wrench(run.contact.ground_reaction))


@pytest.mark.verify
def test_an_external_force_of_opensim_is_the_ground_reaction(tmp_path: Path):
    api: Any = pytest.importorskip("opensim")
    api.Logger.removeFileSink()
    api.Logger.setLevelString("Error")
    motion, run = touching_run()
    assert run.contact is not None
    write_mot(motion, tmp_path / "run.mot")
    osim.format_files(motion.figure, SpringSet(), tmp_path / "figure.osim").write()
    stored = api.Storage(str(tmp_path / "run.mot"))
    prefixes = ("ground_force_v", "ground_force_p", "ground_torque_")
    force = api.ExternalForce(stored, *prefixes, "arm", "ground", "ground")
    model = api.Model(str(tmp_path / "figure.osim"))
    model.addForce(force)
    model.initSystem()
    for time, expected in zip(run.times.tolist(), run.contact.ground_reaction, strict=True):
        parts = (
            force.getForceAtTime(time),
            force.getPointAtTime(time),
            force.getTorqueAtTime(time),
        )
        push, point, torque = (np.array([part.get(k) for k in range(3)]) for part in parts)
        found = np.concatenate([push, np.cross(point, push) + torque])
        assert found == pytest.approx(expected, abs=1e-9)


@pytest.mark.verify
@pytest.mark.parametrize(("share", "residual"), [(1.0, 0.0), (0.0, 1.0)])
def test_inverse_dynamics_of_opensim_needs_no_force_but_the_ground_reaction(
    share: float, residual: float, tmp_path: Path
):
    """Of a body at rest in the air, which the ground reaction carries or does not."""
    api: Any = pytest.importorskip("opensim")
    api.Logger.removeFileSink()
    api.Logger.setLevelString("Error")
    made = figure(
        [ground(), body("block")],
        [joint("free", "ground.base", "block.near", FREE, (0.3, -0.2, 0.5, 0.1, 0.4, -0.3))],
    )
    run = simulate(made, Plan(stop=0.1, gravity=(0.0, 0.0, 0.0)))
    weight = 9.81 * made.segments["block"].mass
    forces = np.tile([0.0, weight, 0.0], (run.times.size, 1))
    reaction = share * np.hstack([forces, np.cross(run.centre_of_mass, forces)])
    contact = replace(contact_record(["block"], run.times.size), ground_reaction=reaction)
    motion = motion_from_recording(replace(run, contact=contact), made)
    write_mot(motion, tmp_path / "rest.mot")
    osim.format_files(made, SpringSet(), tmp_path / "block.osim").write()

    force = api.ExternalForce()
    force.setName("ground_reaction")
    force.set_applied_to_body("block")
    force.set_force_identifier("ground_force_v")
    force.set_point_identifier("ground_force_p")
    force.set_torque_identifier("ground_torque_")
    loads = api.ExternalLoads()
    loads.setDataFileName(str(tmp_path / "rest.mot"))
    loads.cloneAndAppend(force)
    loads.printToXML(str(tmp_path / "loads.xml"))
    tool = api.InverseDynamicsTool()
    tool.setModelFileName(str(tmp_path / "block.osim"))
    tool.setCoordinatesFileName(str(tmp_path / "rest.mot"))
    tool.setExternalLoadsFileName(str(tmp_path / "loads.xml"))
    tool.setResultsDir(str(tmp_path))
    tool.setOutputGenForceFileName("needed.sto")
    tool.setStartTime(0.0)
    tool.setEndTime(0.1)
    assert tool.run()
    needed = read_table(tmp_path / "needed.sto")
    upward = needed.rows[:, needed.labels.index("free_5_force")]
    assert upward == pytest.approx(residual * weight, abs=1e-6)
    assert (np.abs(needed.rows[:, 1:]).max() < 1e-6) == (residual == 0.0)
