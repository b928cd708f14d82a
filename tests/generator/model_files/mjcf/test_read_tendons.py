"""Springs of hinges with tendons: torques and damping as in MuJoCo."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from generator.diagnostics import Source
from generator.model_files.formats import parse_model
from generator.model_files.model_files import Imported
from generator.rotations import Array
from springs import AxisSpring, Stop, total_torque
from tests.generator.model_files.imported_models import lost, written_and_read

SPRINGS = {
    "cubic": ('stiffness="3 1 2" springref="20" damping="0.5"', "", True),
    "quadratic": ('stiffness="3 1"', "", False),
    "linear with a reference": ('stiffness="3" ref="30"', "", True),
    "dead zone": ("", '<fixed springlength="-.2 .3" stiffness="4">{}</fixed>', True),
    "cubic dead zone": ("", '<fixed springlength="-.2 .3" stiffness="4 1 2">{}</fixed>', False),
    "both": ('stiffness="3"', '<fixed springlength="-.2 .3" stiffness="4">{}</fixed>', False),
    "without a length": (
        'stiffness="2" springref="10"', '<fixed stiffness="4" damping="2">{}</fixed>', False
    ),
    "by a class": ("", '<fixed class="taut" springlength="-.1 .1">{}</fixed>', True),
    "two tendons": (
        "",
        '<fixed springlength=".2" stiffness="4 2 1">{}</fixed>'
        '<fixed springlength="-1 1" stiffness="5">{}</fixed>',
        False,
    ),
}  # fmt: skip
"""Attributes of the hinge, tendons, and whether a law of the springs file holds them exactly."""

ANGLES = np.linspace(-1.5, 1.5, 61)


def model(hinge: str, tendons: str, coefficient: float = 1.0) -> str:
    joint = f'<joint joint="h" coef="{coefficient}"/>'
    return (
        '<mujoco><default><default class="taut"><tendon stiffness="6"/></default></default>'
        f'<worldbody><body name="b"><joint name="h" {hinge}/><geom size=".1"/></body></worldbody>'
        f"<tendon>{tendons.replace('{}', joint)}</tendon></mujoco>"
    )


def torques(text: str) -> tuple[Array, float]:
    """Passive torques of MuJoCo at the angles, and its damping."""
    api: Any = pytest.importorskip("mujoco")
    compiled = api.MjModel.from_xml_string(text)
    data, found = api.MjData(compiled), list[float]()
    for angle in ANGLES:
        data.qpos[0] = angle
        api.mj_forward(compiled, data)
        found.append(float(data.qfrc_passive[0]))
    still = found[-1]
    data.qvel[0] = 1.0
    api.mj_forward(compiled, data)
    return np.array(found), still - float(data.qfrc_passive[0])


def read(text: str, folder: Path) -> tuple[Imported, AxisSpring]:
    imported = parse_model(Source("m.xml", text)).require_value()
    _, springs = written_and_read(imported, folder)
    (axis,) = springs.joints["h"].axes
    return imported, axis


@pytest.mark.verify
@pytest.mark.parametrize("coefficient", [1.0, -2.0])
@pytest.mark.parametrize("name", SPRINGS)
def test_torques_are_those_of_mujoco(name: str, coefficient: float, tmp_path: Path):
    hinge, tendons, exact = SPRINGS[name]
    text = model(hinge, tendons, coefficient)
    theirs, damping = torques(text)
    imported, axis = read(text, tmp_path)
    where = imported.coordinates["h"]
    laws = [law for law in axis.elastic if not isinstance(law, Stop)]
    ours = total_torque(laws, (ANGLES - where.offset) / where.scale)
    # Errors are sampled, and printed with two digits.
    error = 1e-12 if exact and (coefficient == 1.0 or not tendons) else 1.2 * stated_error(imported)
    assert np.abs(ours - theirs).max() <= max(error, 1e-12)
    assert axis.damping.viscous == pytest.approx(damping)


def stated_error(imported: Imported) -> float:
    (place,) = lost(imported, "tables of points")
    return float(place.split(": ")[1].split(" ")[0])


def test_tendons_that_are_not_springs_of_a_hinge_are_losses():
    text = model("", '<fixed name="two">{}{}</fixed><spatial name="rope"/>')
    imported = parse_model(Source("m.xml", text)).require_value()
    assert lost(imported, "tendons over several joints") == ("two", "rope")
    text = model("", '<fixed name="hard" range="0 1">{}</fixed>')
    imported = parse_model(Source("m.xml", text)).require_value()
    assert lost(imported, "limits and armature of tendons") == ("hard",)


def test_a_slack_range_that_ends_before_it_begins_is_refused():
    text = model("", '<fixed springlength="1 -1" stiffness="1">{}</fixed>')
    (fault,) = parse_model(Source("m.xml", text)).diagnostics
    assert "slack range" in fault.message
