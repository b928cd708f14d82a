"""Bushings at joints: their torques as in OpenSim."""

from pathlib import Path

import numpy as np
import pytest

from springs import total_torque
from tests.generator.model_files.imported_models import lost
from tests.generator.model_files.opensim.one_joint import (
    MODEL,
    acceleration_in_opensim,
    imported,
    read,
)

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


@pytest.mark.verify
@pytest.mark.parametrize("name", CASES)
def test_torques_are_those_of_opensim(name: str, tmp_path: Path):
    joint, force = CASES[name]
    acceleration = acceleration_in_opensim(joint, force, tmp_path)
    theirs = np.array([acceleration(value, 0.0) for value in ANGLES])
    _, axis = read(joint, force, tmp_path)
    error = 1e-12 if "cubic" not in name else 1e-3
    assert np.abs(total_torque(axis.elastic, ANGLES) - theirs).max() < error
    damping = acceleration(0.3, -0.5) - acceleration(0.3, 0.5)
    assert axis.damping.viscous == pytest.approx(damping, abs=1e-9)


def test_a_bushing_elsewhere_is_a_loss():
    away = "<PhysicalOffsetFrame name='off'><socket_parent>..</socket_parent>"
    away += "<translation>0 1 0</translation></PhysicalOffsetFrame>"
    force = bushing("BushingForce", ("/ground", "/bodyset/b/off"), **LINEAR)
    model = MODEL.replace("</Body>", f"<components>{away}</components></Body>")
    assert lost(imported("PinJoint", force, model), "bushings that are not at a joint") == ("bush",)


def test_terms_of_several_angles_are_a_loss():
    force = bushing("ExpressionBasedBushingForce", Mz_expression="2*theta_z+theta_x")
    assert lost(imported("PinJoint", force), "several angles") == ("bush",)
