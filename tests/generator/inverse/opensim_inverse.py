"""Inverse dynamics of the planar walk by OpenSim's own tool."""

from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest

from generator.motion_files import COORDINATES_FILE
from generator.rotations import Array
from tests.generator.inverse.walking import LOADS, MODEL

KNEES = ("knee_r", "knee_l")


def opensim() -> Any:
    osim: Any = pytest.importorskip("opensim")
    osim.Logger.setLevelString("Error")
    return osim


def model_with_fixed_knees(folder: Path) -> Path:
    """Write the model whose knees slide nowhere, as in the figure, and return its path."""
    osim, path, document = opensim(), folder / "fixed.osim", ElementTree.parse(MODEL)
    model = osim.Model(str(MODEL))
    for name in KNEES:
        joint = osim.CustomJoint.safeDownCast(model.getJointSet().get(name))
        angle, transform = joint.get_coordinates(0).getDefaultValue(), joint.getSpatialTransform()
        element = next(one for one in document.iter("CustomJoint") if one.get("name") == name)
        for axis in ("translation1", "translation2"):
            function = getattr(transform, f"get_{axis}")().get_function()
            moved = next(one for one in element.iter("TransformAxis") if one.get("name") == axis)
            for old in [one for one in moved if one.tag not in ("coordinates", "axis")]:
                moved.remove(old)
            fixed = ElementTree.SubElement(moved, "Constant", name="function")
            value = function.calcValue(osim.Vector(1, angle))
            ElementTree.SubElement(fixed, "value").text = repr(value)
    document.write(path)
    return path


def inverse_dynamics(
    model: Path, motion: Path, folder: Path, cutoff: float | None = None, loads: Path = LOADS
) -> tuple[Array, dict[str, Array]]:
    """Times and moments of OpenSim's tool by the titles of their columns."""
    osim = opensim()
    tool = osim.InverseDynamicsTool()
    tool.setModelFileName(str(model))
    tool.setCoordinatesFileName(str(motion))
    tool.setLowpassCutoffFrequency(-1.0 if cutoff is None else cutoff)
    table = COORDINATES_FILE.read(motion)
    tool.setStartTime(float(table.times[0]))
    tool.setEndTime(float(table.times[-1]))
    excluded = osim.ArrayStr()
    excluded.append("Muscles")
    tool.setExcludedForces(excluded)
    tool.setExternalLoadsFileName(str(loads))
    tool.setResultsDir(str(folder))
    tool.setOutputGenForceFileName("opensim.sto")
    assert tool.run()
    found = COORDINATES_FILE.read(folder / "opensim.sto")
    titles = [title.text for title in found.titles]
    return found.times, dict(zip(titles, found.numbers.T, strict=True))
