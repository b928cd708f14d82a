"""Springs of several rotations in models that MuJoCo saved anew."""

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from generator.diagnostics import Source
from generator.figure import Figure
from generator.model_files.formats import parse_model, read_model
from generator.model_files.imported import Imported
from generator.model_files.mjcf.spring_fit import Ramp, axis_ramps
from generator.model_files.mjcf.write import format_files
from generator.rotations import Array
from springs import SpringSet
from tests.generator.model_files.imported_models import (
    lost,
    without_carried_texts,
    written_and_read,
)
from tests.generator.model_files.resaved import (
    LARGEST_FACTOR,
    NAMES,
    compare,
    sprung_figure,
    stated,
)

ROUNDING = 1e-5
"""Of the six digits that MuJoCo saves, relative to the largest torque."""


@dataclass(frozen=True)
class Ramps:
    """The ramps of a spring as its law, of the opposite angle for a sign of -1."""

    ramps: Sequence[Ramp]
    sign: float = 1.0

    def torque(self, angle: Array, *_: object) -> Array:
        parts = (ramp.torque(self.sign * angle) for ramp in self.ramps)
        return self.sign * sum(parts, np.zeros_like(angle))

    def mirrored(self) -> "Ramps":
        return replace(self, sign=-self.sign)


def as_ramps(figure: Figure, springs: SpringSet) -> SpringSet:
    """The springs that a model has: those of several rotations as ramps."""
    changed: dict[str, Any] = {}
    for name, each in springs.joints.items():
        joint = figure.joints[name]
        axes = each.axes
        if len(joint.chain) > 1:
            axes = tuple(
                replace(one, elastic=(Ramps(axis_ramps(joint, each, one)),)) for one in axes
            )
        changed[name] = replace(each, axes=axes)
    return replace(springs, joints=changed)


def written(name: str, folder: Path) -> Path:
    """A model without the figure and the springs that it carries."""
    path = folder / "model.xml"
    format_files(*sprung_figure(name), path).write()
    path.write_text(without_carried_texts(path.read_text(encoding="utf-8")), encoding="utf-8")
    return path


def differing_joints(name: str, imported: Imported, folder: Path) -> set[str]:
    """Joints whose torques are not those of the ramps, or whose damping is another."""
    figure, springs = sprung_figure(name)
    back_figure, back = written_and_read(imported, folder)
    fits = format_files(figure, springs, folder / "again.xml").losses
    model = as_ramps(figure, springs)
    found: set[str] = set()
    for joint in springs.joints:
        compared = compare(figure, model, back_figure, back, joint)
        allowed = LARGEST_FACTOR * stated(imported.losses, joint) + ROUNDING * compared.size
        if len(figure.joints[joint].chain) == 1:
            allowed += stated(fits, joint)
        if compared.difference > allowed or compared.damping > ROUNDING:
            found.add(joint)
    return found


@pytest.mark.verify
@pytest.mark.parametrize("name", NAMES)
def test_models_that_mujoco_saves_keep_the_torques_of_the_ramps(name: str, tmp_path: Path):
    api: Any = pytest.importorskip("mujoco")
    model, saved = api.MjModel.from_xml_path(str(written(name, tmp_path))), tmp_path / "saved.xml"
    api.mj_saveLastXML(str(saved), model)
    assert differing_joints(name, read_model(saved), tmp_path) == set()


def test_models_without_texts_keep_the_torques_of_the_ramps(tmp_path: Path):
    imported = read_model(written("clavicles", tmp_path))
    assert differing_joints("clavicles", imported, tmp_path) == set()
    assert not any(loss.what == "actuators" for loss in imported.losses.entries)


def test_an_edited_pair_changes_its_joint_only(tmp_path: Path):
    path = written("prototype", tmp_path)
    text = path.read_text(encoding="utf-8")
    pattern = r'(name="left_hip_joint_spring_1_1_\w+"[^>]* biasprm=")([^"]*)"'
    edited, count = re.subn(pattern, r'\g<1>1 -20 0"', text)
    assert count == 2
    path.write_text(edited, encoding="utf-8")
    assert differing_joints("prototype", read_model(path), tmp_path) == {"left_hip_joint"}


MODEL = """<mujoco><compiler angle="radian"/><option gravity="0 -9.81 0"/><worldbody>
<site name="base" quat="{turn}"/>
<body name="b"><joint name="j" type="ball"/><geom size=".1"/><site name="tip" quat="{turn}"/></body>
</worldbody><actuator>
<general name="one" site="tip" refsite="base" gear="0 0 0 {axis}" gainprm="0" biastype="affine"
 biasprm="1 -3 {rate}" {more}/>
<general name="two" site="base" refsite="tip" gear="0 0 0 {opposite}" gainprm="0" biastype="affine"
 biasprm="1 -3 {rate}" {more_of_two}/></actuator></mujoco>"""

PAIR = {
    "axis": "1 0 0",
    "opposite": "-1 0 0",
    "turn": "1 0 0 0",
    "rate": "-.2",
    "more": "",
    "more_of_two": "",
}


def read(**changes: str) -> Imported:
    return parse_model(Source("m.xml", MODEL.format(**PAIR | changes))).require_value()


@pytest.mark.parametrize("turn", ["1 0 0 0", ".5 .5 .5 .5", ".9 .3 -.1 .2"])
def test_a_pair_is_a_spring_about_the_axis_of_the_sites(turn: str, tmp_path: Path):
    imported = read(turn=turn)
    figure, springs = written_and_read(imported, tmp_path)
    (axis,) = (one for one in springs.joints["j"].axes if one.elastic)
    assert float(axis.elastic[0].torque(0.5)) == pytest.approx(2.0 - 6.0 * 0.5)
    assert axis.damping.viscous == pytest.approx(0.4)
    place = figure.joints["j"].child
    site = figure.segments[place.segment].sites[place.site].pose_in_segment[:3, :3]
    (tip,) = (s for s in figure.segments["b"].sites.values() if s.name == "tip")
    assert site @ axis.direction == pytest.approx(tip.pose_in_segment[:3, 0], abs=1e-9)


OTHERS = {
    "one has no equal": {"more": 'forcerange="-1 1"'},
    "they drive the rate": {"rate": ".2"},
    "they act about the same axis": {"opposite": "1 0 0"},
    "they take control": {"more": 'ctrlrange="-1 1"', "more_of_two": 'ctrlrange="-1 1"'},
    "the torque is along no axis of the joint": {"axis": ".6 .8 .1", "opposite": "-.6 -.8 -.1"},
}


@pytest.mark.parametrize("case", OTHERS)
def test_other_site_actuators_are_losses(case: str):
    assert lost(read(**OTHERS[case]), "actuators") == ("one", "two")
