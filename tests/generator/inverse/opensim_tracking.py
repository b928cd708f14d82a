"""Inverse kinematics of markers by OpenSim's own tool."""

from pathlib import Path

from generator.motion_files import COORDINATES_FILE
from generator.rotations import Array
from tests.generator.inverse.opensim_inverse import opensim


def inverse_kinematics(model: Path, markers: Path, folder: Path) -> dict[str, Array]:
    """Coordinates of OpenSim's tool by name [deg or m], all markers with the weight 1."""
    osim = opensim()
    tool = osim.InverseKinematicsTool()
    loaded = osim.Model(str(model))
    loaded.initSystem()
    tool.setModel(loaded)
    tool.setMarkerDataFileName(str(markers))
    tool.setStartTime(0.0)
    tool.setEndTime(100.0)
    tool.set_accuracy(1e-9)
    tool.setOutputMotionFileName(str(folder / "ik.mot"))
    tool.setResultsDir(str(folder))
    assert tool.run()
    found = COORDINATES_FILE.read(folder / "ik.mot")
    return {title.text: values for title, values in zip(found.titles, found.numbers.T, strict=True)}
