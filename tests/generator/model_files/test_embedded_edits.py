"""Edited models under a law of coordinates: every joint has the torques of the model."""

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np
import pytest

from generator.figure import Figure, is_rotation
from generator.figure_file import read_figure
from generator.model import Model
from generator.model_files.fit_error import joint_ranges
from generator.model_files.formats import model_format, read_model
from generator.model_files.model_files import Imported
from generator.rotations import Array
from generator.simulation.exudyn_model.model import build_model
from generator.simulation.plan import Plan
from generator.simulation.statics.static_forces import StaticState
from generator.springs_file.read import read_springs
from springs import CoupledAxis, CoupledSpring, SphericalLaw, SpringSet
from springs.coupled import CoupledExponential, CoupledTerm
from tests.chains import chain
from tests.chains import row as bars
from tests.generator.model_files.imported_models import (
    lost,
    without_carried_texts,
    written_and_read,
)
from tests.generator.model_files.resaved import stated

SUFFIXES = (".xml", ".osim")
NAMES = ("prototype", pytest.param("male50", marks=pytest.mark.slow))

POSES = 40

FACTOR = 1.2
"""Largest error over the stated one, which is that of four angles in each interval of a table."""

ROUNDING = 1e-6
"""Difference of torques beside the stated errors of tables, relative to the largest."""

Edit = Callable[[str], str]


def substituted(pattern: str, new: str) -> Edit:
    def edit(text: str) -> str:
        changed, count = re.subn(pattern, new, text, count=1, flags=re.DOTALL)
        assert count == 1
        return changed

    return edit


def stiffer(suffix: str, joint: str) -> Edit:
    """Add a spring of 7 N m/rad to the third displacement of a joint."""
    if suffix == ".osim":
        return substituted(rf'(name="{joint}_3_spring">.*?<expression>)', r"\1-7*q+")
    inside = f'<joint joint="{joint}_3" coef="1"/>'
    tendon = f'<fixed name="added" stiffness="7" springlength="0">{inside}</fixed>'
    return substituted("<tendon>", f"<tendon>{tendon}")


@dataclass(frozen=True)
class Edited:
    """A figure with springs under a law of coordinates, and its model after an edit."""

    figure: Figure
    springs: SpringSet
    path: Path

    @cached_property
    def imported(self) -> Imported:
        return read_model(self.path)

    @cached_property
    def back(self) -> tuple[Figure, SpringSet]:
        folder = self.path.parent / "back"
        folder.mkdir(exist_ok=True)
        return written_and_read(self.imported, folder)

    def rows(self, joint: str) -> Array:
        """Random displacements of a joint within its ranges, before the pole, (poses, n)."""
        one = self.figure.joints[joint]
        ends = np.array(joint_ranges(one, self.springs.joints[joint]))
        rows = np.random.default_rng(3).uniform(*ends.T, (POSES, len(ends)))
        turns = [k for k, factor in enumerate(one.chain) if is_rotation(factor.kind)]
        if len(turns) == 3:
            rows[:, turns[1]] = np.clip(rows[:, turns[1]], -1.5, 1.5)
        return rows

    @cached_property
    def moments(self) -> Mapping[str, Array]:
        """Moments of the springs on each joint in its rows, which are those of no other joint."""
        return self._moments(self.figure, self.springs)

    @cached_property
    def moments_back(self) -> Mapping[str, Array]:
        """The moments of the figure that came back."""
        return self._moments(*self.back)

    def _moments(self, figure: Figure, springs: SpringSet) -> Mapping[str, Array]:
        model = build_model(Model(figure, springs), Plan(gravity=(0.0, 0.0, 0.0)))
        kinematics = model.placement.tree.kinematics
        values = np.zeros((POSES, kinematics.size))
        joints = [name for name in self.springs.joints if name in figure.joints]
        for name in joints:
            values[:, kinematics.columns[name]] = self.rows(name)
        forces = StaticState.from_displacements(model, values).forces()
        return {name: forces[:, kinematics.columns[name]] for name in joints}

    def allowed(self, joint: str) -> float:
        """Difference of the moments of a joint that its tables state [N m]."""
        size = float(np.abs(self.moments[joint]).max())
        return FACTOR * stated(self.imported.losses, joint) + ROUNDING * size

    def check(self, joint: str) -> None:
        """Compare the moments and the damping of a joint with those of the one that came back."""
        difference = np.abs(self.moments_back[joint] - self.moments[joint]).max()
        assert difference <= self.allowed(joint), joint
        one, other = (
            sorted(axis.damping.viscous for axis in springs.joints[joint].axes)
            for springs in (self.springs, self.back[1])
        )
        assert one == pytest.approx(other, rel=1e-9)


def edited(name: str, suffix: str, folder: Path, *edits: Edit) -> Edited:
    """A model after edits, without laws over several joints: each moment is of one joint alone."""
    figure = read_figure(name)
    springs = read_springs(None, figure)
    springs = replace(springs, law=SphericalLaw.COORDINATES, coupled=())
    path = folder / f"model{suffix}"
    model_format(path).format_files(figure, springs, path).write()
    text = path.read_text(encoding="utf-8")
    for edit in edits:
        text = edit(text)
    path.write_text(text, encoding="utf-8")
    return Edited(figure, springs, path)


def held_joints(of: Edited) -> list[str]:
    """Joints whose springs the file holds."""
    is_opensim = of.path.suffix == ".osim"
    return [n for n, one in of.springs.joints.items() if one.reach is None or is_opensim]


@pytest.mark.parametrize("suffix", SUFFIXES)
@pytest.mark.parametrize("name", NAMES)
def test_an_edited_spring_leaves_the_law_and_the_other_joints(
    name: str, suffix: str, tmp_path: Path
):
    joint = "neck" if name == "male50" else "waist"
    of = edited(name, suffix, tmp_path, stiffer(suffix, joint))
    lost(of.imported, "springs and loads were changed")
    _, springs = of.back
    assert springs.law is SphericalLaw.COORDINATES
    for one in held_joints(of):
        if one != joint:
            of.check(one)
    rows, allowed = of.rows(joint), of.allowed(joint) + 1e-3
    added = of.moments_back[joint] - of.moments[joint]
    assert added[:, 2] == pytest.approx(-7.0 * rows[:, 2], abs=allowed)
    assert added[:, :2] == pytest.approx(0.0 * rows[:, :2], abs=allowed)


def test_a_joint_that_was_removed_leaves_the_others(tmp_path: Path):
    """The hands are parts of the arms."""

    def remove(text: str) -> str:
        for pattern in (r'<fixed name="left_wrist.*?</fixed>', r'<joint name="left_wrist[^>]*/>'):
            text, count = re.subn(pattern, "", text, flags=re.DOTALL)
            assert count
        return text

    of = edited("male50", ".xml", tmp_path, remove)
    figure, springs = of.back
    assert springs.law is SphericalLaw.COORDINATES
    assert "left_wrist" not in figure.joints
    for joint in held_joints(of):
        if joint != "left_wrist":
            of.check(joint)


@pytest.mark.parametrize("name", NAMES)
def test_a_model_without_the_texts_that_it_carries_keeps_its_law(name: str, tmp_path: Path):
    """As OpenSim saves it: a reach is lost, with the damping of its joint."""
    of = edited(name, ".osim", tmp_path, without_carried_texts)
    _, springs = of.back
    assert springs.law is SphericalLaw.COORDINATES
    reached = [joint for joint, one in of.springs.joints.items() if one.reach is not None]
    for joint in of.springs.joints:
        if joint not in reached:
            of.check(joint)
    assert not springs.joints.keys() & set(reached)
    if reached:
        assert len(lost(of.imported, "along paths")) == 3 * len(reached)
        assert len(lost(of.imported, "damping that is not of each angle")) == 3 * len(reached)


def test_a_reach_comes_back_whole_beside_an_edited_spring(tmp_path: Path):
    of = edited("male50", ".osim", tmp_path, stiffer(".osim", "neck"))
    figure, springs = of.back
    for side in ("left", "right"):
        name = f"{side}_shoulder"
        assert springs.joints[name].reach == of.springs.joints[name].reach
        of.check(name)
    assert not any("shoulder" in place for place in lost(of.imported, "tables of points"))
    assert figure.joints["left_shoulder"].chain == of.figure.joints["left_shoulder"].chain


@pytest.mark.slow
def test_a_reach_whose_forces_have_another_factor_has_it(tmp_path: Path):
    def softer(text: str) -> str:
        for label in ("reach", "turn_upper", "turn_lower"):
            pattern = rf'(name="left_shoulder_{label}">.*?</FunctionBasedPath>\s*<expression>)'
            text = substituted(pattern, r"\g<1>0.5*")(text)
        return text

    of = edited("male50", ".osim", tmp_path, softer)
    name, (_, springs) = "left_shoulder", of.back
    own = of.springs.joints[name].reach
    assert own is not None
    assert of.moments_back[name] == pytest.approx(0.5 * of.moments[name], rel=1e-9, abs=1e-9)
    assert springs.joints["right_shoulder"].reach == of.springs.joints["right_shoulder"].reach


@pytest.mark.slow
@pytest.mark.parametrize(
    ("pattern", "new"),
    [
        (r'(name="left_shoulder_reach">.*?<expression>)', r"\g<1>0.01+"),
        (r'(name="left_shoulder_turn_upper">.*?</FunctionBasedPath>\s*<expression>)', r"\1s*"),
        (r'name="left_shoulder_turn_lower"', 'name="other" '),
    ],
    ids=["another length", "another law", "another name"],
)
def test_a_force_of_a_reach_that_is_another_is_a_loss(pattern: str, new: str, tmp_path: Path):
    """But for its name, which has no meaning."""
    of = edited("male50", ".osim", tmp_path, substituted(pattern, new))
    _, springs = of.back
    assert springs.joints["right_shoulder"].reach == of.springs.joints["right_shoulder"].reach
    if "other" in new:
        assert springs.joints["left_shoulder"].reach == of.springs.joints["left_shoulder"].reach
        return
    places = lost(of.imported, "along paths")
    assert set(places) == {f"left_shoulder_{one}" for one in ("reach", "turn_upper", "turn_lower")}
    left = springs.joints.get("left_shoulder")
    assert left is None or left.reach is None


@pytest.mark.verify
@pytest.mark.parametrize("name", NAMES)
def test_the_moments_of_an_edited_model_are_those_of_mujoco(name: str, tmp_path: Path):
    api = pytest.importorskip("mujoco")
    joint = "neck" if name == "male50" else "waist"
    of = edited(name, ".xml", tmp_path, stiffer(".xml", joint))
    model = api.MjModel.from_xml_path(str(of.path))
    data = api.MjData(model)
    for one in held_joints(of):
        count = len(of.figure.joints[one].chain)
        names = [one] if count == 1 else [f"{one}_{k}" for k in range(1, count + 1)]
        places = [int(model.joint(each).qposadr[0]) for each in names]
        speeds = [int(model.joint(each).dofadr[0]) for each in names]
        for row, expected in zip(of.rows(one), of.moments_back[one], strict=True):
            data.qpos[places] = row
            api.mj_forward(model, data)
            assert np.abs(data.qfrc_spring[speeds] - expected).max() <= of.allowed(one), one
        data.qpos[places] = 0.0


LAW = CoupledExponential(
    ("first", "second"), (CoupledTerm((2.0, 3.0), (-1.0, -1.5), 0.1),), (0.3, 0.0), (None, None)
)
"""A gradient, so that MuJoCo's tendons hold it."""

ADDED = (
    r'\1<SpringGeneralizedForce name="added"><coordinate>joint1_1</coordinate><stiffness>7'
    "</stiffness><viscosity>0</viscosity><rest_length>0</rest_length></SpringGeneralizedForce>"
)
PATHS = "along paths"
COUPLED_EDITS: list[tuple[str, str, str, str]] = [
    (".xml", "<tendon>", '<tendon><spatial name="added"/>', ""),
    (".xml", r'(_spring_1" [^>]*stiffness=")', r"\g<1>9", PATHS),
    (".xml", r'(<joint name="joint1"[^>]*axis=")[^"]*', r"\g<1>0 0 1", "joints, whose joints"),
    (".osim", r'(<ForceSet name="forceset">\s*<objects>)', ADDED, ""),
    (".osim", r'(joint2_spring">.*?<expression>)', r"\g<1>2*", PATHS),
]


@pytest.mark.parametrize(("suffix", "pattern", "new", "words"), COUPLED_EDITS)
def test_laws_over_several_joints_come_back_while_elements_and_axes_are_as_written(
    suffix: str, pattern: str, new: str, words: str, tmp_path: Path
):
    of = bars(3, [chain("Rx"), chain("Ry"), chain("Rx")])
    axes = (CoupledAxis("joint1", (0.0, 1.0, 0.0)), CoupledAxis("joint2", (-1.0, 0.0, 0.0)))
    springs = SpringSet(coupled=(CoupledSpring(LAW, axes, "a source"),))
    path = tmp_path / f"model{suffix}"
    model_format(path).format_files(of, springs, path).write()
    path.write_text(substituted(pattern, new)(path.read_text("utf-8")), "utf-8")
    imported = read_model(path)
    _, back = written_and_read(imported, tmp_path)
    assert back.coupled == (() if words else springs.coupled)
    if words:
        lost(imported, words)
