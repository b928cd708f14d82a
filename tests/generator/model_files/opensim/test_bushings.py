"""Bushings at joints: their torques as in OpenSim."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from generator.diagnostics import Source
from generator.model_files.formats import parse_model
from generator.model_files.imported import Imported
from springs import AxisSpring, total_torque
from tests.generator.model_files.imported_models import lost, written_and_read

MODEL = """<?xml version="1.0"?><OpenSimDocument Version="40500"><Model name="m">
<gravity>0 -9.81 0</gravity><BodySet name="bodyset"><objects><Body name="b"><mass>1</mass>
<mass_center>0 0 0</mass_center><inertia>1 1 1 0 0 0</inertia></Body></objects></BodySet>
<JointSet name="jointset"><objects><{0} name="j"><socket_parent_frame>/ground</socket_parent_frame>
<socket_child_frame>/bodyset/b</socket_child_frame><coordinates><Coordinate name="q1">
<default_value>0</default_value><range>-1.5 1.5</range></Coordinate></coordinates></{0}></objects>
</JointSet><ForceSet name="forceset"><objects>{1}</objects></ForceSet></Model></OpenSimDocument>"""

ANGLES = np.linspace(-1.4, 1.4, 29)

ENDS = ("/ground", "/bodyset/b")


def bushing(kind: str, ends: tuple[str, str] = ENDS, **values: str) -> str:
    sockets = "".join(f"<socket_frame{k}>{end}</socket_frame{k}>" for k, end in enumerate(ends, 1))
    inner = "".join(f"<{key}>{value}</{key}>" for key, value in values.items())
    return f"<{kind} name='bush'>{sockets}{inner}</{kind}>"


LINEAR = {"rotational_stiffness": "1 2 3", "rotational_damping": "0.1 0.2 0.3"}
LINEAR |= {"translational_stiffness": "4 5 6", "translational_damping": "0.4 0.5 0.6"}
CUBIC = {"Mx_expression": "9", "Mz_expression": "2*theta_z+theta_z^3", "Fx_expression": "7*delta_x"}

CASES = {
    "linear": ("PinJoint", bushing("BushingForce", **LINEAR)),
    "linear, the other way round": ("PinJoint", bushing("BushingForce", ENDS[::-1], **LINEAR)),
    "along a slide": ("SliderJoint", bushing("BushingForce", **LINEAR)),
    "cubic": ("PinJoint", bushing("ExpressionBasedBushingForce", **CUBIC)),
    "uneven, the other way round": (
        "PinJoint",
        bushing("ExpressionBasedBushingForce", ENDS[::-1], Mz_expression="2*theta_z+1"),
    ),
    "expression along a slide": ("SliderJoint", bushing("ExpressionBasedBushingForce", **CUBIC)),
}


def read(joint: str, force: str, folder: Path) -> tuple[Imported, AxisSpring]:
    imported = parse_model(Source("m.osim", MODEL.format(joint, force))).require_value()
    _, springs = written_and_read(imported, folder)
    (axis,) = (*springs.joints["j"].axes, *springs.joints["j"].translations)
    return imported, axis


@pytest.mark.verify
@pytest.mark.parametrize("name", CASES)
def test_torques_are_those_of_opensim(name: str, tmp_path: Path):
    api: Any = pytest.importorskip("opensim")
    api.Logger.setLevelString("error")
    joint, force = CASES[name]
    (tmp_path / "m.osim").write_text(MODEL.format(joint, force))
    model = api.Model(str(tmp_path / "m.osim"))
    state = model.initSystem()
    coordinate = model.getCoordinateSet().get(0)

    def acceleration(value: float, rate: float) -> float:
        coordinate.setValue(state, value)
        coordinate.setSpeedValue(state, rate)
        model.realizeAcceleration(state)
        return coordinate.getAccelerationValue(state)

    theirs = np.array([acceleration(value, 0.0) for value in ANGLES])
    _, axis = read(joint, force, tmp_path)
    error = 1e-12 if "cubic" not in name else 1e-3
    assert np.abs(total_torque(axis.elastic, ANGLES) - theirs).max() < error
    damping = acceleration(0.3, -0.5) - acceleration(0.3, 0.5)
    assert axis.damping.viscous == pytest.approx(damping, abs=1e-9)


def test_a_bushing_elsewhere_is_a_loss():
    away = "<PhysicalOffsetFrame name='off'><socket_parent>..</socket_parent>"
    away += "<translation>0 1 0</translation></PhysicalOffsetFrame>"
    text = MODEL.format(
        "PinJoint", bushing("BushingForce", ("/ground", "/bodyset/b/off"), **LINEAR)
    )
    text = text.replace("</Body>", f"<components>{away}</components></Body>")
    imported = parse_model(Source("m.osim", text)).require_value()
    assert lost(imported, "bushings that are not at a joint") == ("bush",)


def test_terms_of_several_angles_are_a_loss():
    force = bushing("ExpressionBasedBushingForce", Mz_expression="2*theta_z+theta_x")
    imported = parse_model(Source("m.osim", MODEL.format("PinJoint", force))).require_value()
    assert lost(imported, "several angles") == ("bush",)
