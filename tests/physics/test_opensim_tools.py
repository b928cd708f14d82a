"""OpenSim's own tools on an exported prototype and a run of it: Analyze, IK and ID."""

from collections.abc import Iterator
from contextlib import chdir
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from benchmarks.exported import write_model
from benchmarks.exports import BENT, posed
from generator.figure import Figure
from generator.figure_file import read_figure
from generator.motion_files import motion_from_recording, motion_writer
from generator.recording import Recording
from generator.rotations import Array
from generator.simulation.plan import Plan
from generator.simulation.run import simulate
from generator.springs_file.read import read_springs

pytestmark = pytest.mark.verify
opensim: Any = pytest.importorskip("opensim")

LIMBS = {
    "left_elbow": (60.0,),
    "right_elbow": (40.0,),
    "left_knee": (50.0,),
    "right_knee": (30.0,),
}
"""Bent, since markers on a straight arm do not show its rotation about itself [deg]."""

STOP, FRAME = 0.2, 0.001
"""Of the run [s]."""


@dataclass(frozen=True)
class Exported:
    """A fall of the prototype, its model and its motion in OpenSim's formats."""

    folder: Path
    figure: Figure
    run: Recording

    @property
    def model(self) -> Path:
        return self.folder / "figure.osim"

    @property
    def motion(self) -> Path:
        return self.folder / "fall.mot"

    @cached_property
    def markers(self) -> dict[str, Array]:
        """Positions here of the model's markers, shape (n, 3) [m]."""
        model = opensim.Model(str(self.model))
        found: dict[str, Array] = {}
        for k in range(model.getMarkerSet().getSize()):
            marker = model.getMarkerSet().get(k)
            segment = marker.getParentFrame().findBaseFrame().getName()
            inside = marker.getParentFrame().findTransformInBaseFrame()
            place = inside.shiftFrameStationToBase(marker.get_location()).to_numpy()
            if segment in self.run.poses:
                found[marker.getName()] = (self.run.poses[segment] @ [*place, 1.0])[:, :3]
        return found


@pytest.fixture(scope="module")
def exported(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Exported]:
    opensim.Logger.removeFileSink()
    opensim.Logger.setLevelString("Error")
    folder = tmp_path_factory.mktemp("opensim")
    figure = posed(read_figure("prototype"), {**BENT, **LIMBS})
    springs = read_springs(None, figure)
    run = simulate(figure, Plan(stop=STOP, frame=FRAME, tolerance=1e-6, springs=springs))
    made = Exported(folder, figure, run)
    write_model(figure, springs, made.model)
    motion_writer(made.motion)(motion_from_recording(run, figure), made.motion)
    with chdir(folder):  # the tools leave files where they run
        yield made


def table(path: Path) -> dict[str, Array]:
    """Columns of a table of OpenSim."""
    read = opensim.TimeSeriesTable(str(path))
    columns = {name: read.getDependentColumn(name).to_numpy() for name in read.getColumnLabels()}
    return {"time": np.array(read.getIndependentColumn()), **columns}


def test_analyze_places_the_bodies_where_we_do(exported: Exported) -> None:
    tool = opensim.AnalyzeTool()
    tool.setName("fall")
    tool.setModelFilename(str(exported.model))
    tool.setCoordinatesFileName(str(exported.motion))
    tool.setLowpassCutoffFrequency(-1.0)
    tool.setInitialTime(0.0)
    tool.setFinalTime(STOP)
    tool.setResultsDir(str(exported.folder))
    bodies = opensim.BodyKinematics()
    bodies.setName("bodies")
    tool.updAnalysisSet().cloneAndAppend(bodies)
    tool.printToXML(str(exported.folder / "analyze.xml"))
    assert opensim.AnalyzeTool(str(exported.folder / "analyze.xml")).run()
    found = table(exported.folder / "fall_bodies_pos_global.sto")
    assert found["time"] == pytest.approx(exported.run.times, abs=1e-9)
    for name, body in exported.figure.bodies.items():
        assert body.centre_of_mass is not None
        poses = exported.run.poses[name]
        centres = (poses @ [*body.centre_of_mass, 1.0])[:, :3]
        theirs = np.stack([found[f"{name}_{axis}"] for axis in "XYZ"], axis=-1)
        assert theirs == pytest.approx(centres, abs=1e-6)
        angles = np.stack([found[f"{name}_O{axis}"] for axis in "xyz"], axis=-1)
        turns = Rotation.from_euler("XYZ", angles, degrees=True).as_matrix()
        assert turns == pytest.approx(poses[:, :3, :3], abs=1e-6)


def test_inverse_kinematics_finds_the_displacements_from_markers(exported: Exported) -> None:
    markers = exported.markers
    assert len(markers) > 2 * len(exported.figure.bodies)
    frames = slice(0, None, 10)
    rate = 1.0 / (10 * FRAME)
    trc = exported.folder / "markers.trc"
    write_trc(trc, {name: places[frames] for name, places in markers.items()}, rate)
    tool = opensim.InverseKinematicsTool()
    tool.set_model_file(str(exported.model))
    tool.set_marker_file(str(trc))
    tool.set_output_motion_file(str(exported.folder / "ik.mot"))
    tool.set_results_directory(str(exported.folder))
    tool.set_accuracy(1e-9)
    for name in markers:
        task = opensim.IKMarkerTask()
        task.setName(name)
        task.setApply(True)
        task.setWeight(1.0)
        tool.upd_IKTaskSet().cloneAndAppend(task)
    assert tool.run()
    found = table(exported.folder / "ik.mot")
    for name, values in exported.run.displacements.items():
        for k, expected in enumerate(values[frames].T, 1):
            assert np.radians(found[f"{name}_{k}"]) == pytest.approx(expected, abs=1e-3), name


def write_trc(path: Path, markers: dict[str, Array], rate: float) -> None:
    """Write positions of markers [m] at a rate [1/s], as motion capture does in mm."""
    count, frames = len(markers), len(next(iter(markers.values())))
    lines = [
        f"PathFileType\t4\t(X/Y/Z)\t{path.name}",
        "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\t"
        "OrigNumFrames",
        f"{rate:g}\t{rate:g}\t{frames}\t{count}\tmm\t{rate:g}\t1\t{frames}",
        "Frame#\tTime\t" + "\t\t\t".join(markers) + "\t\t",
        "\t\t" + "\t".join(f"X{k}\tY{k}\tZ{k}" for k in range(1, count + 1)),
        "",
    ]
    for frame in range(frames):
        places = 1e3 * np.concatenate([each[frame] for each in markers.values()])
        cells = "\t".join(f"{value:.6f}" for value in places.tolist())
        lines.append(f"{frame + 1}\t{frame / rate:.6f}\t{cells}")
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def test_inverse_dynamics_of_our_fall_needs_no_moments_but_the_springs(exported: Exported) -> None:
    """The springs of the file explain the motion: what the tool asks for beside them is small."""
    tool = opensim.InverseDynamicsTool()
    tool.setModelFileName(str(exported.model))
    tool.setCoordinatesFileName(str(exported.motion))
    tool.setLowpassCutoffFrequency(-1.0)
    tool.setStartTime(0.0)
    tool.setEndTime(STOP)
    tool.setResultsDir(str(exported.folder))
    tool.setOutputGenForceFileName("moments.sto")
    tool.run()
    found = table(exported.folder / "moments.sto")
    inner = slice(10, -10)  # splines differentiate twice badly at their ends
    passive = max(np.abs(each).max() for each in exported.run.passive_torques.values())
    for name, moments in found.items():
        if name.endswith("_moment"):
            assert np.abs(moments[inner]).max() < 2e-2 * passive, name
