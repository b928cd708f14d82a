"""OpenSim's tables: columns, units and headers, written and read."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from generator import Plan, simulate
from generator.diagnostics import Parsed, select_errors
from generator.figure import Figure, JointAxis
from generator.kinematics.free_root import FREE_CHAINS
from generator.model_files.opensim import write as osim
from generator.motion_files import (
    FigureMotion,
    motion_from_coordinates,
    motion_from_recording,
    opensim_table,
)
from generator.motion_files.opensim_table import (
    COORDINATES_FILE,
    GROUND_REACTION_LABELS,
    write_mot,
    write_sto,
)
from generator.rotations import Array
from generator.text_io import make_source
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


def table_text(labels: Sequence[str], rows: Array, *, in_degrees: bool = False) -> str:
    """A table as OpenSim writes it, with counts that its tools have not kept true."""
    head = [f"inDegrees={'yes' if in_degrees else 'no'}", "nRows=99", "nColumns=1"]
    head += ["DataType=double", "version=3", "OpenSimVersion=4.6", "endheader"]
    lines = ["\t".join(map(repr, row)) for row in rows.tolist()]
    return "\n".join([*head, "\t".join(["time", *labels]), *lines, ""])


def parse_motion(text: str, made: Figure) -> Parsed[FigureMotion]:
    table = COORDINATES_FILE.parse(make_source(text, "table.sto")).require_value()
    return motion_from_coordinates(table, made)


def test_paths_of_opensim_are_coordinates_and_other_columns_are_left_out():
    labels = [
        "/jointset/rail/rail_2/value",
        "/jointset/rail/rail_2/speed",
        "swing/swing_3/value",
        "swing_1",
        "/forceset/muscle/activation",
    ]
    rows = np.array([[0.5, 1.0, 2.0, 3.0, 4.0, np.nan], [0.6, 5.0, 6.0, 7.0, 8.0, 9.0]])
    made = slides()
    parsed = parse_motion(table_text(labels, rows), made)
    motion = parsed.require_value()
    assert motion.times.tolist() == [0.5, 0.6]
    expected = {name: np.tile(one.displacement, (2, 1)) for name, one in made.joints.items()}
    expected["rail"][:, 1] = rows[:, 1]
    expected["swing"][:, 2], expected["swing"][:, 0] = rows[:, 3], rows[:, 4]
    assert motion.displacements.keys() == expected.keys()
    for name, values in expected.items():
        assert np.array_equal(motion.displacements[name], values), name
    missing, unknown = (each.message for each in parsed.diagnostics)
    assert missing.endswith("value: rail_1, swing_2, telescope_1, telescope_2")
    assert unknown.endswith("left out: /jointset/rail/rail_2/speed, /forceset/muscle/activation")
    assert motion.header.figure == "none"
    assert (motion.header.springs, motion.header.law) == ("unknown", "unknown")
    assert motion.header.message == "coordinates of table.sto"
    assert (motion.header.start, motion.header.stop, motion.header.frame_interval) == (
        0.5,
        0.6,
        0.1,
    )


def test_only_rotations_are_converted_from_degrees():
    rows = np.array([[0.0, 90.0, 90.0]])
    text = table_text(["rail_1", "rail_2"], rows, in_degrees=True)
    rail = parse_motion(text, slides()).require_value().displacements["rail"]
    assert rail.tolist() == [[np.pi / 2.0, 90.0]]


@pytest.mark.parametrize("axes", FREE_CHAINS)
def test_a_free_motion_keeps_the_axes_of_its_free_joint(
    axes: tuple[JointAxis, ...], tmp_path: Path
):
    made = slides()
    free = any_motion(made, is_free=True)
    (name,) = free.chains.keys() - made.joints.keys()
    motion = replace(free, chains={**free.chains, name: axes})
    write_sto(motion, tmp_path / "free.sto")
    table = COORDINATES_FILE.parse_file(tmp_path / "free.sto").require_value()
    parsed = motion_from_coordinates(table, made)
    assert parsed.diagnostics == ()
    back = parsed.require_value()
    assert back.chains == motion.chains
    for segment, poses in motion.poses.items():
        assert np.array_equal(back.poses[segment], poses)


def test_a_free_motion_of_opensim_has_the_axes_of_the_figure_in_its_own_pose():
    made = slides()
    free = any_motion(made, is_free=True)
    (name,) = free.chains.keys() - made.joints.keys()
    labels = [f"{name}_{k}" for k in range(1, 7)]
    rows = np.array([[0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6]])
    parsed = parse_motion(table_text(labels, rows), made)
    motion = parsed.require_value()
    assert motion.chains[name] == free.chains[name]
    assert motion.displacements[name].tolist() == [[0.1, 0.2, 0.3, 0.4, 0.5, 0.6]]
    assert f"the file does not say the axes of {name}" in [d.message for d in parsed.diagnostics]


def test_huge_tables_are_refused(monkeypatch: pytest.MonkeyPatch):
    rows = np.column_stack([np.arange(5.0), np.zeros(5)])
    made = slides()
    text = table_text(["rail_1"], rows)
    monkeypatch.setattr(opensim_table, "MAX_NUMBERS", 5 * made.degrees_of_freedom)
    assert parse_motion(text, made).value is not None
    monkeypatch.setattr(opensim_table, "MAX_NUMBERS", 5 * made.degrees_of_freedom - 1)
    (fault,) = select_errors(parse_motion(text, made).diagnostics)
    assert fault.message == "5 frames of this figure are too many"
    longest = max(map(len, text.splitlines()))
    monkeypatch.setattr(opensim_table, "MAX_LINE_LENGTH", longest)
    COORDINATES_FILE.parse(make_source(text, "table.sto")).require_value()
    monkeypatch.setattr(opensim_table, "MAX_LINE_LENGTH", longest - 1)
    (fault,) = COORDINATES_FILE.parse(make_source(text, "table.sto")).diagnostics
    assert fault.message == f"this line is longer than {longest - 1} characters"
    monkeypatch.undo()
    monkeypatch.setattr(opensim_table, "MAX_HEADER_LINES", 6)
    (fault,) = COORDINATES_FILE.parse(make_source(text, "table.sto")).diagnostics
    assert fault.message == "the line `endheader` is missing"


@given(
    st.lists(st.floats(allow_nan=False, allow_infinity=False), min_size=6, max_size=6),
    st.sampled_from(["\t", " ", "  \t "]),
    st.sampled_from(["\n", "\r\n", "\n\n"]),
    st.permutations(["rail_1", "rail_2", "swing_2"]),
)
def test_any_numbers_in_any_order_of_columns_are_read_to_the_last_bit(
    numbers: list[float], separator: str, newline: str, labels: list[str]
):
    rows = np.column_stack([[0.0, 1.0], np.reshape(numbers, (2, 3))])
    text = table_text(labels, rows).replace("\t", separator).replace("\n", newline)
    moved = parse_motion(text, slides()).require_value().displacements
    for label, column in zip(labels, rows.T[1:], strict=True):
        joint, _, k = label.rpartition("_")
        assert np.array_equal(moved[joint][:, int(k) - 1], column)


@pytest.mark.verify
def test_states_of_opensim_are_a_motion(tmp_path: Path):
    """A table that its own integration has written, with the paths of values and of speeds."""
    api: Any = pytest.importorskip("opensim")
    api.Logger.removeFileSink()
    api.Logger.setLevelString("Error")
    made = slides()
    osim.format_files(made, SpringSet(), tmp_path / "slides.osim").write()
    model = api.Model(str(tmp_path / "slides.osim"))
    state = model.initSystem()
    manager = api.Manager(model, state)
    manager.integrate(0.05)
    table = manager.getStatesTable()
    api.STOFileAdapter.write(table, str(tmp_path / "states.sto"))
    parsed = motion_from_coordinates(
        COORDINATES_FILE.parse_file(tmp_path / "states.sto").require_value(), made
    )
    motion = parsed.require_value()
    (left_out,) = (each.message for each in parsed.diagnostics)
    assert "/speed" in left_out
    assert "/value" not in left_out
    for name, one in made.joints.items():
        assert motion.displacements[name][0] == pytest.approx(one.displacement, abs=1e-12)
        for k in range(len(one.chain)):
            label = f"/jointset/{name}/{name}_{k + 1}/value"
            column = table.getDependentColumn(label)
            theirs = [column[row] for row in range(table.getNumRows())]
            assert motion.displacements[name][:, k] == pytest.approx(theirs, rel=1e-12, abs=1e-300)


@pytest.mark.verify
def test_a_result_of_inverse_kinematics_of_opensim_is_a_motion(tmp_path: Path):
    """The tool finds the displacements of a motion from four markers of each body."""
    api: Any = pytest.importorskip("opensim")
    api.Logger.removeFileSink()
    api.Logger.setLevelString("Error")
    made = slides()
    still = {name: np.array(one.displacement) for name, one in made.joints.items()}
    factors = np.array([1.0, 1.1, 0.9])[:, None]
    motion = replace(
        any_motion(made), displacements={name: factors * row for name, row in still.items()}
    )
    places = [(0.0, 0.0, 0.0), (0.2, 0.0, 0.0), (0.0, 0.2, 0.0), (0.0, 0.0, 0.2)]
    positions = {
        f"{body}_{k}": (motion.poses[body] @ (*place, 1.0))[:, :3]
        for body in made.bodies
        for k, place in enumerate(places)
    }
    rows = np.column_stack([np.arange(1.0, 4.0), motion.times, *positions.values()])
    head = [
        "PathFileType\t4\t(X/Y/Z)\tmarkers.trc",
        "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame"
        "\tOrigNumFrames",
        f"50\t50\t3\t{len(positions)}\tm\t50\t1\t3",
        "Frame#\tTime\t" + "\t\t\t".join(positions),
        "\t\t" + "\t".join(f"{axis}{k + 1}" for k in range(len(positions)) for axis in "XYZ"),
        "",
    ]
    lines = ["\t".join([f"{row[0]:.0f}", *map(repr, row[1:].tolist())]) for row in rows]
    (tmp_path / "markers.trc").write_text("\n".join([*head, *lines, ""]), encoding="utf-8")
    osim.format_files(made, SpringSet(), tmp_path / "slides.osim").write()
    model = api.Model(str(tmp_path / "slides.osim"))
    for name in positions:
        body, _, k = name.rpartition("_")
        marker = api.Marker(name, model.getBodySet().get(body), api.Vec3(*places[int(k)]))
        marker.thisown = False
        model.addMarker(marker)
    model.initSystem()
    tool = api.InverseKinematicsTool()
    tool.setModel(model)
    tool.setMarkerDataFileName(str(tmp_path / "markers.trc"))
    tool.setStartTime(float(motion.times[0]))
    tool.setEndTime(float(motion.times[-1]))
    tool.setOutputMotionFileName(str(tmp_path / "ik.mot"))
    tool.set_accuracy(1e-8)
    for name in positions:
        task = api.IKMarkerTask()
        task.setName(name)
        task.setApply(True)
        task.setWeight(1.0)
        tool.getIKTaskSet().cloneAndAppend(task)
    tool.set_results_directory(str(tmp_path))
    assert tool.run()
    parsed = motion_from_coordinates(
        COORDINATES_FILE.parse_file(tmp_path / "ik.mot").require_value(), made
    )
    assert parsed.diagnostics == ()
    found = parsed.require_value()
    assert found.times == pytest.approx(motion.times, abs=1e-8)
    for name, values in motion.displacements.items():
        assert found.displacements[name] == pytest.approx(values, abs=1e-5), name
