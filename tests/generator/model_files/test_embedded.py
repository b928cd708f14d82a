"""Models that this program has written come back whole; changes of them are read from them."""

import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache, cached_property, partial
from pathlib import Path
from shutil import copytree

import numpy as np
import pytest
from scipy.spatial import cKDTree

from generator.figure import Figure
from generator.figure_file import read_figure
from generator.figure_file.write import write_figure
from generator.geometry.read import read_segment_surface, segment_colour
from generator.kinematics.free_root import detach_root
from generator.model_files.formats import model_format, read_model
from generator.model_files.model_files import Imported, imported_files
from generator.rotations import Array
from generator.springs_file.read import read_springs
from springs import SphericalLaw, SpringSet
from tests.chains import BALL, body, one_body
from tests.generator.model_files.imported_models import MODELS, lost

SUFFIXES = (".xml", ".osim")


def shipped(name: str, choice: str | None, _: Path) -> tuple[Figure, SpringSet]:
    figure = read_figure(name)
    return figure, read_springs(choice, figure)


def another_program(model: Callable[[], Path], folder: Path) -> tuple[Figure, SpringSet]:
    figure = folder / "first.fig"
    imported_files(read_model(model()), figure).write()
    return read_figure(figure), read_springs(None, read_figure(figure))


def gymnasium_humanoid() -> Path:
    package = pytest.importorskip("gymnasium")
    return Path(package.__file__).parent / "envs/mujoco/assets/humanoid.xml"


CASES: dict[str, Callable[[Path], tuple[Figure, SpringSet]]] = {
    "prototype": partial(shipped, "prototype", None),
    "prototype with coupled laws": partial(shipped, "prototype", "coupled"),
    "prototype as printed": partial(shipped, "prototype", "printed"),
    "clavicles": partial(shipped, "clavicles", None),
    "four bars": partial(shipped, "fourbar", None),
    "pendulum": partial(shipped, "pendulum", None),
    "humanoid of Gymnasium": partial(another_program, gymnasium_humanoid),
    "leg with limit forces": partial(another_program, lambda: MODELS / "leg.osim"),
}


def write(figure: Figure, springs: SpringSet, path: Path) -> str:
    model_format(path).format_files(figure, springs, path).write()
    return path.read_text(encoding="utf-8")


def read_back(path: Path) -> tuple[Imported, Figure, SpringSet]:
    """The model as files say it that hold it."""
    imported, file = read_model(path), path.with_name("back.fig")
    imported_files(imported, file).write()
    figure = read_figure(file)
    return imported, figure, read_springs(None, figure)


@dataclass(frozen=True)
class Written:
    """A figure and springs, and the model of them, in a folder that no test changes."""

    figure: Figure
    springs: SpringSet
    path: Path

    @cached_property
    def back(self) -> tuple[Imported, Figure, SpringSet]:
        """Return what was read from the model."""
        return read_back(self.path)


Models = Callable[[str, str], Written]


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> Models:
    """The model of a case in a format, which the tests of this module share."""

    @cache
    def content(case: str) -> tuple[Figure, SpringSet]:
        return CASES[case](tmp_path_factory.mktemp("case"))

    @cache
    def model(case: str, suffix: str) -> Written:
        figure, springs = content(case)
        path = tmp_path_factory.mktemp("model") / f"model{suffix}"
        write(figure, springs, path)
        return Written(figure, springs, path)

    return model


def without_psurfs(figure: Figure) -> Figure:
    return figure.with_parts(*(replace(one, psurf=None) for one in figure.segments.values()))


def corners(figure: Figure, segment: str) -> Array:
    """Vertices of a psurf that are corners of faces, shape (n, 3)."""
    surface = read_segment_surface(figure, figure.segments[segment])
    return surface.without_unused_vertices.vertices


@pytest.mark.parametrize("suffix", SUFFIXES)
@pytest.mark.parametrize("case", CASES)
def test_figure_and_springs_come_back_exactly(case: str, suffix: str, written: Models):
    model = written(case, suffix)
    figure, springs, (imported, back, laws) = model.figure, model.springs, model.back
    assert without_psurfs(back) == without_psurfs(figure)
    assert (laws.joints, laws.coupled, laws.law) == (
        springs.joints,
        springs.coupled,
        springs.law,
    )
    assert laws.references == springs.references
    assert imported.losses.entries == ()


@pytest.mark.parametrize("suffix", [".xml", ".osim", ".urdf"])
@pytest.mark.parametrize("case", ["prototype", "pendulum", "humanoid of Gymnasium"])
def test_shapes_and_colours_come_back(case: str, suffix: str, written: Models):
    model = written(case, suffix)
    figure, (_, back, _) = model.figure, model.back
    digits = 1e-12 if suffix == ".xml" else 1e-6  # mesh files have 32-bit numbers
    drawn = [name for name, one in figure.bodies.items() if one.psurf is not None]
    assert drawn
    for name in drawn:
        one, other = corners(figure, name), corners(back, name)
        assert cKDTree(one).query(other)[0].max() < digits
        assert cKDTree(other).query(one)[0].max() < digits
        assert segment_colour(back, back.segments[name]) == pytest.approx(
            segment_colour(figure, figure.segments[name]), abs=1e-9
        )


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_a_free_root_comes_back(suffix: str, tmp_path: Path):
    figure, springs = CASES["prototype"](tmp_path)
    start = {name: np.asarray(joint.displacement) for name, joint in figure.joints.items()}
    free, moved = detach_root(figure, start)
    joints = [replace(one, displacement=tuple(moved[key])) for key, one in free.joints.items()]
    free = free.with_parts(*joints)
    springs = springs.of_joints(free.joints)
    write(free, springs, tmp_path / f"model{suffix}")
    imported, back, laws = read_back(tmp_path / f"model{suffix}")
    assert imported.losses.entries == ()
    assert laws.joints == springs.joints
    for name, joint in free.joints.items():
        assert back.joints[name].chain == joint.chain
        assert back.joints[name].displacement == joint.displacement


def edited(
    model: Written, folder: Path, pattern: str, new: str
) -> tuple[Imported, Figure, SpringSet]:
    """Read a copy of a model in which the first text of a pattern is replaced."""
    copytree(model.path.parent, folder, dirs_exist_ok=True)
    path = folder / model.path.name
    text = path.read_text(encoding="utf-8")
    changed, count = re.subn(pattern, new, text, count=1)
    assert count == 1
    assert changed != text
    path.write_text(changed, encoding="utf-8")
    return read_back(path)


@pytest.mark.parametrize(
    ("suffix", "pattern"),
    [(".xml", r'mass="4\.00077"'), (".osim", r"<mass>4\.00077</mass>")],
)
def test_an_edited_mass_is_read_and_the_springs_stay(
    suffix: str, pattern: str, tmp_path: Path, written: Models
):
    new, model = pattern.replace("\\", "").replace("4.00077", "5.5"), written("prototype", suffix)
    _, back, laws = edited(model, tmp_path, pattern, new)
    masses = [one.mass for one in back.bodies.values()]
    assert masses.count(5.5) == 1
    assert masses.count(4.00077) == 1
    assert laws.joints == model.springs.joints


@pytest.mark.parametrize(
    ("suffix", "pattern", "new"),
    [
        (".xml", r'damping="[^"]*"', 'damping="123"'),
        (".osim", r"(</coordinate>\s*<expression>)", r"\1-123*qdot+"),
    ],
)
def test_edited_springs_are_read_from_the_model(
    suffix: str, pattern: str, new: str, tmp_path: Path, written: Models
):
    imported, _, laws = edited(written("prototype", suffix), tmp_path, pattern, new)
    lost(imported, "its springs and loads were changed")
    dampings = [axis.damping.viscous for joint in laws.joints.values() for axis in joint.axes]
    assert max(dampings) >= 123.0
    assert not any("(" in reference for reference in laws.references)


@pytest.mark.parametrize(
    ("suffix", "pattern", "new"),
    [
        (".xml", r'<site name="left_lower_leg.distal" pos="[^"]*"',
         '<site name="left_lower_leg.distal" pos="1 2 3"'),
        (".osim", r"<translation>[^<]*</translation>", "<translation>1 2 3</translation>"),
    ],
)  # fmt: skip
def test_edited_bodies_are_read_from_the_model(
    suffix: str, pattern: str, new: str, tmp_path: Path, written: Models
):
    imported, _, _ = edited(written("prototype", suffix), tmp_path, pattern, new)
    lost(imported, "its bodies and joints were changed")


@pytest.mark.parametrize(
    ("pattern", "new"),
    [
        ("<figure>figure {", "<figure>figure ["),
        ("<springs>[[spring]]", "<springs>[[sprung]]"),
        ("segment right_lower_leg {", "segment right_lower_log {"),
    ],
)
def test_damaged_texts_are_not_used(pattern: str, new: str, tmp_path: Path, written: Models):
    imported, back, _ = edited(written("prototype", ".osim"), tmp_path, re.escape(pattern), new)
    lost(imported, "its texts or inertias were changed")
    assert "right_lower_leg" in back.segments


def test_numbers_in_another_form_and_spaces_are_no_change(tmp_path: Path, written: Models):
    model = written("prototype", ".xml")
    imported, _, laws = edited(model, tmp_path, r'timestep="0.001"', 'timestep=" 1e-3 "')
    assert imported.losses.entries == ()
    assert laws.joints == model.springs.joints


@pytest.mark.parametrize(
    ("pattern", "new"),
    [
        ("<worldbody>", '<worldbody><camera name="eye" pos="0 0 3"/>'),
        ("</worldbody>", '</worldbody><sensor><jointpos joint="left_knee"/></sensor>'),
        ("</worldbody>", '</worldbody><actuator><motor joint="left_knee"/></actuator>'),
    ],
)
def test_additions_are_one_loss(pattern: str, new: str, tmp_path: Path, written: Models):
    model = written("prototype", ".xml")
    imported, _, laws = edited(model, tmp_path, pattern, new)
    lost(imported, "cameras")
    assert laws.joints == model.springs.joints


def test_another_colour_is_read(tmp_path: Path, written: Models):
    model = written("prototype", ".xml")
    imported, back, laws = edited(model, tmp_path, r'rgba="[^"]*"', 'rgba="0 0.5 1 1"')
    colours = [segment_colour(back, one) for one in back.segments.values()]
    assert colours.count((0.0, 0.5, 1.0)) == 1
    assert imported.losses.entries == ()
    assert laws.references


def test_stand_ins_for_missing_psurfs_do_not_become_psurfs(tmp_path: Path):
    figure, springs = CASES["prototype"](tmp_path)
    figure = without_psurfs(figure)
    text = write(figure, springs, tmp_path / "model.xml")
    assert "<geom" in text
    assert read_model(tmp_path / "model.xml").surfaces == {}
    ball = '<geom size="0.1" contype="0" conaffinity="0" mass="0"/>'
    changed = re.sub('(<body name="right_lower_leg"[^>]*>)', rf"\1{ball}", text)
    (tmp_path / "model.xml").write_text(changed, encoding="utf-8")
    assert "right_lower_leg" in read_model(tmp_path / "model.xml").surfaces


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_a_model_without_springs_comes_back_without(suffix: str, tmp_path: Path):
    figure, _ = CASES["pendulum"](tmp_path)
    write(figure, SpringSet(), tmp_path / f"model{suffix}")
    _, back, laws = read_back(tmp_path / f"model{suffix}")
    assert laws.joints == {}
    assert back.joints["shoulder"].chain == figure.joints["shoulder"].chain


@pytest.mark.verify
def test_other_programs_skip_what_a_model_carries(written: Models):
    mujoco, opensim = (pytest.importorskip(name) for name in ("mujoco", "opensim"))
    in_mujoco, in_opensim = (written("prototype", suffix) for suffix in SUFFIXES)
    assert mujoco.MjModel.from_xml_path(str(in_mujoco.path)).ntext >= 5
    opensim.Logger.setLevelString("error")
    bodies = opensim.Model(str(in_opensim.path)).getNumBodies()
    assert bodies >= len(in_opensim.figure.bodies)


@pytest.mark.parametrize("suffix", SUFFIXES)
@pytest.mark.parametrize("law", [SphericalLaw.COORDINATES, SphericalLaw.CONSERVATIVE])
def test_the_law_of_springs_that_are_all_in_fields_comes_back(
    law: SphericalLaw, suffix: str, tmp_path: Path
):
    """As `mover convert FIGURE MODEL --law` writes them."""
    equal = {"stiff": (5.0, 5.0, 5.0), "damp": (0.1, 0.1, 0.1)}
    made = one_body(BALL, (0.2, 0.3, 0.1), body("link", centre=(0.0, -0.3, 0.0)))
    pin = replace(made.joints["pin"], **equal)
    path = tmp_path / "first.fig"
    path.write_text(write_figure(replace(made, joints={"pin": pin})), encoding="utf-8")
    figure = read_figure(path)
    springs = replace(read_springs(None, figure), law=law)
    write(figure, springs, tmp_path / f"model{suffix}")
    _, back, found = read_back(tmp_path / f"model{suffix}")
    assert (back.joints, found.joints, found.law) == (figure.joints, springs.joints, law)
