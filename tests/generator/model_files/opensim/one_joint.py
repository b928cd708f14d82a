"""A model of OpenSim with one joint of one coordinate, as it is read here and there."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from generator.diagnostics import Source
from generator.model_files.formats import parse_model
from generator.model_files.model_files import Imported
from springs import AxisSpring
from tests.generator.model_files.imported_models import written_and_read

MODEL = """<?xml version="1.0"?><OpenSimDocument Version="40500"><Model name="m">
<gravity>0 -9.81 0</gravity><BodySet name="bodyset"><objects><Body name="b"><mass>1</mass>
<mass_center>0 0 0</mass_center><inertia>1 1 1 0 0 0</inertia></Body></objects></BodySet>
<JointSet name="jointset"><objects><{0} name="j"><socket_parent_frame>/ground</socket_parent_frame>
<socket_child_frame>/bodyset/b</socket_child_frame><coordinates><Coordinate name="q1">
<default_value>0.2</default_value><range>-1.5 1.5</range></Coordinate></coordinates></{0}></objects>
</JointSet><ForceSet name="forceset"><objects>{1}</objects></ForceSet></Model></OpenSimDocument>"""
"""A type of joint and forces are to be filled in; moment of inertia and mass are one."""


def imported(joint: str, forces: str, model: str = MODEL) -> Imported:
    return parse_model(Source("m.osim", model.format(joint, forces))).require_value()


def read(joint: str, forces: str, folder: Path) -> tuple[Imported, AxisSpring]:
    """The model here, and the spring of its coordinate as files say it."""
    model = imported(joint, forces)
    _, springs = written_and_read(model, folder)
    (axis,) = (*springs.joints["j"].axes, *springs.joints["j"].translations)
    return model, axis


def acceleration_in_opensim(
    joint: str, forces: str, folder: Path
) -> Callable[[float, float], float]:
    """Acceleration of the coordinate, which is the force on it, by value and rate."""
    api: Any = pytest.importorskip("opensim")
    api.Logger.setLevelString("error")
    (folder / "m.osim").write_text(MODEL.format(joint, forces))
    model = api.Model(str(folder / "m.osim"))
    state = model.initSystem()
    coordinate = model.getCoordinateSet().get(0)

    def acceleration(value: float, rate: float) -> float:
        coordinate.setValue(state, value)
        coordinate.setSpeedValue(state, rate)
        model.realizeAcceleration(state)
        return coordinate.getAccelerationValue(state)

    return acceleration
