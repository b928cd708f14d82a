"""Springs of several rotations in models that OpenSim saved anew."""

import re
from dataclasses import replace
from pathlib import Path
from shutil import copytree

import pytest

from generator.figure import Figure
from generator.model_files.formats import read_model
from generator.model_files.model_files import Imported
from generator.model_files.opensim.write import format_files
from generator.springs_file.read import read_springs
from springs import SphericalLaw, SpringSet
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
from tests.laws import VECTOR_LAWS

RELATIVE = 1e-6
"""Difference of torques besides the stated errors of tables, relative to the largest."""

DAMPING = 1e-9
"""Difference of damping [N m s/rad]."""

LOST = "along paths"


def written(name: str, folder: Path, law: SphericalLaw = SphericalLaw.CONSERVATIVE) -> Path:
    """A model without the figure and the springs that it carries, as other programs save it."""
    figure, springs = sprung_figure(name)
    return bare_model(figure, replace(springs, law=law), folder)


def bare_model(figure: Figure, springs: SpringSet, folder: Path) -> Path:
    path = folder / "model.osim"
    format_files(figure, springs, path).write()
    path.write_text(without_carried_texts(path.read_text(encoding="utf-8")), encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def unchanged(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The model of the prototype, of which tests change copies."""
    return written("prototype", tmp_path_factory.mktemp("prototype"))


@pytest.fixture
def path(unchanged: Path, tmp_path: Path) -> Path:
    """A copy of the model of the prototype."""
    copytree(unchanged.parent, tmp_path, dirs_exist_ok=True)
    return tmp_path / unchanged.name


def check_torques(name: str, imported: Imported, folder: Path, law: SphericalLaw) -> None:
    figure, springs = sprung_figure(name)
    springs = replace(springs, law=law)
    folder.mkdir()
    back_figure, back = written_and_read(imported, folder)
    assert back.law is law
    for joint in springs.joints:
        found = compare(figure, springs, back_figure, back, joint)
        allowed = LARGEST_FACTOR * stated(imported.losses, joint) + RELATIVE * found.size
        assert found.difference <= allowed, joint
        assert found.damping <= DAMPING


@pytest.mark.slow
@pytest.mark.verify
@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("law", VECTOR_LAWS)
def test_models_that_opensim_saves_keep_their_torques(name: str, law: SphericalLaw, tmp_path: Path):
    api = pytest.importorskip("opensim")
    path = written(name, tmp_path, law)
    model, saved = api.Model(str(path)), tmp_path / "saved.osim"
    model.initSystem()
    model.printToXML(str(saved))
    check_torques(name, read_model(saved), tmp_path / "back", law)


@pytest.mark.parametrize("law", VECTOR_LAWS)
def test_models_without_texts_keep_their_torques(law: SphericalLaw, tmp_path: Path):
    imported = read_model(written("prototype", tmp_path, law))
    check_torques("prototype", imported, tmp_path / "back", law)
    assert not any(LOST in loss.what for loss in imported.losses.entries)


CHANGES = {
    "its length is no component": (r"<expression>\(f\*", "<expression>(1.001*f*"),
    "its length is no expression": (r"<expression>\(f\*", "<expression>(("),
    "it acts on one side only": ("<clamp_stretch>false", "<clamp_stretch>true"),
    "its coordinates are those of no joint": (r" ?/jointset/waist/waist_3", ""),
}


@pytest.mark.parametrize("change", CHANGES)
def test_a_force_that_is_no_law_about_an_axis_is_a_loss_and_the_others_stay(
    change: str, path: Path, tmp_path: Path
):
    text = path.read_text(encoding="utf-8")
    force = re.search(
        r'<ExpressionBasedPathForce name="waist_x_spring">.*?</Exp\w+PathForce>', text, re.S
    )
    assert force is not None
    changed = re.sub(*CHANGES[change], force[0], count=1)
    assert changed != force[0]
    path.write_text(text.replace(force[0], changed), encoding="utf-8")
    imported = read_model(path)
    assert lost(imported, LOST) == ("waist_x_spring",)
    figure, springs = sprung_figure("prototype")
    back_figure, back = written_and_read(imported, tmp_path)
    axes = {axis.direction: axis.elastic for axis in back.joints["waist"].axes}
    assert not axes[1.0, 0.0, 0.0]
    assert axes[0.0, 1.0, 0.0]
    assert axes[0.0, 0.0, 1.0]
    found = compare(figure, springs, back_figure, back, "left_hip_joint")
    assert found.difference <= LARGEST_FACTOR * stated(imported.losses, "left_hip_joint")


def test_an_edited_spring_has_its_new_law_and_the_others_theirs(path: Path, tmp_path: Path):
    text = path.read_text(encoding="utf-8")
    start = text.index('name="waist_x_spring"')
    tension = re.compile(r"(</FunctionBasedPath>\s*<expression>)([^<]*)(</expression>)")
    edited = tension.sub(r"\g<1>7*s\g<3>", text[start:], count=1)
    path.write_text(text[:start] + edited, encoding="utf-8")
    imported = read_model(path)
    figure, springs = sprung_figure("prototype")
    back_figure, back = written_and_read(imported, tmp_path)
    for joint in springs.joints:
        found = compare(figure, springs, back_figure, back, joint)
        allowed = LARGEST_FACTOR * stated(imported.losses, joint) + RELATIVE * found.size
        assert (found.difference <= allowed) == (joint != "waist"), joint
    (x,) = (axis for axis in back.joints["waist"].axes if axis.direction == (1.0, 0.0, 0.0))
    assert float(x.elastic[0].torque(0.3)) == pytest.approx(-2.1)


def test_laws_over_several_joints_are_losses_and_the_others_stay(tmp_path: Path):
    figure, _ = sprung_figure("prototype")
    springs = read_springs("coupled", figure)
    imported = read_model(bare_model(figure, springs, tmp_path))
    names = {re.sub(r"_\d+$", "", name) for name in lost(imported, LOST)}
    assert names == {f"{side}_hip_joint_{side}_knee_spring" for side in ("left", "right")}
    back_figure, back = written_and_read(imported, tmp_path)
    found = compare(figure, springs, back_figure, back, "waist")
    assert found.difference <= LARGEST_FACTOR * stated(imported.losses, "waist")
