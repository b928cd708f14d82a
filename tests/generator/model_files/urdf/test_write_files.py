"""Meshes, springs, limits and friction of URDF models, and the programs that read them."""

import csv
import shutil
import subprocess
from io import StringIO
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest

from generator import read_figure
from generator.figure import Figure
from generator.figure_file.read import FIGURE_FILE
from generator.geometry.appearance import segment_appearances
from generator.model_files.curves_csv import ROTATION_VECTOR, format_curves, has_curves
from generator.model_files.urdf.write import SPRINGS_LOSS, format_files, format_urdf
from generator.springs_file.read import read_springs
from springs import Elastic, Linear, Stop
from springs.hysteresis import Hysteresis
from tests.chains import SKEW
from tests.generator.model_files.model_cases import hinge, on_a_rail, slide, spring_set

SHIPPED = [name for name in FIGURE_FILE.shipped() if name != "female50"]
"""Figures of different joints."""


def written(drawn: Figure, folder: Path) -> Path:
    path = folder / "robot.urdf"
    format_files(drawn, read_springs(None, drawn), path).write()
    return path


@pytest.mark.parametrize("name", SHIPPED)
def test_every_surface_is_a_visual_of_its_colour(name: str, tmp_path: Path) -> None:
    drawn = read_figure(name)
    root = ElementTree.parse(written(drawn, tmp_path)).getroot()
    colours = {one.get("name"): one.find("color") for one in root.findall("material")}
    appearances, _ = segment_appearances(drawn)
    visuals = {
        link.get("name"): visual for link in root.findall("link") for visual in link.iter("visual")
    }
    assert visuals.keys() == appearances.keys()
    for segment, visual in visuals.items():
        mesh, material = visual.find("geometry/mesh"), visual.find("material")
        assert mesh is not None
        assert material is not None
        file = mesh.get("filename")
        assert file == f"robot_geometry/{segment}.stl"
        assert (tmp_path / file).is_file()
        colour = colours[material.get("name")]
        assert colour is not None
        rgba = np.array(colour.get("rgba", "").split(), dtype=float)
        assert np.array_equal(rgba, [*appearances[segment].colour, 1.0])


@pytest.mark.parametrize("name", SHIPPED)
def test_the_springs_are_the_table_beside_the_file(name: str, tmp_path: Path) -> None:
    drawn = read_figure(name)
    springs = read_springs(None, drawn)
    path = written(drawn, tmp_path)
    table = tmp_path / "robot_springs.csv"
    assert table.exists() == has_curves(springs)
    if not table.exists():
        return
    text = table.read_text(encoding="utf-8")
    assert text == format_curves(drawn, springs)[0]
    joints = {one.get("name") for one in ElementTree.parse(path).getroot().findall("joint")}
    for row in csv.DictReader(StringIO(text)):
        if row["coordinate"] == ROTATION_VECTOR:
            assert f"{row['joint']}_1" in joints
        else:
            assert {row["joint"], row["coordinate"]} & joints


@pytest.mark.verify
@pytest.mark.parametrize("name", SHIPPED)
def test_pinocchio_reads_the_visuals(name: str, tmp_path: Path) -> None:
    pin: Any = pytest.importorskip("pinocchio")
    drawn = read_figure(name)
    path = written(drawn, tmp_path)
    model = pin.buildModelFromUrdf(str(path))
    folders = [str(tmp_path)]
    shapes = pin.buildGeomFromUrdf(model, str(path), pin.GeometryType.VISUAL, package_dirs=folders)
    appearances, _ = segment_appearances(drawn)
    assert len(shapes.geometryObjects) == len(appearances)
    for shape in shapes.geometryObjects:
        surface = appearances[shape.name.rpartition("_")[0]]
        assert np.allclose(shape.meshColor[:3], surface.colour)
        corners = shape.geometry.vertices()
        assert np.allclose(corners.max(axis=0), surface.surface.vertices.max(axis=0), atol=1e-6)


@pytest.mark.verify
@pytest.mark.parametrize("name", SHIPPED)
def test_check_urdf_accepts_the_file(name: str, tmp_path: Path) -> None:
    program = shutil.which("check_urdf")
    if program is None:
        pytest.skip("check_urdf of urdfdom is not installed")
    path = written(read_figure(name), tmp_path)
    done = subprocess.run([program, path], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "Successfully Parsed XML" in done.stdout


def urdf_joint(name: str, springs: Any) -> tuple[ElementTree.Element, set[str]]:
    """The joint of this name, and the sentences of the losses."""
    text, losses = format_urdf(on_a_rail(), springs)
    joints = {one.get("name"): one for one in ElementTree.fromstring(text).findall("joint")}
    return joints[name], {loss.what for loss in losses.entries}


def test_a_stop_is_a_limit() -> None:
    springs = spring_set(hinge("hinge", Stop(-0.4, 0.9)), slide("rail", SKEW, Stop(None, 0.2)))
    turn, lost = urdf_joint("hinge", springs)
    along, _ = urdf_joint("rail", springs)
    limit = turn.find("limit")
    assert turn.get("type") == "revolute"
    assert limit is not None
    assert sorted([limit.get("lower"), limit.get("upper")]) in (["-0.4", "0.9"], ["-0.9", "0.4"])
    end = along.find("limit")
    assert end is not None
    assert sorted(abs(float(end.get(side, "0"))) for side in ("lower", "upper")) == [0.2, 1e9]
    assert SPRINGS_LOSS in lost


@pytest.mark.parametrize(
    ("mean", "width", "friction"), [(Linear(2.0), 1.4, 0.7 + 0.1), (Linear(2.0), 0.0, 0.1)]
)
def test_friction_of_a_law_that_does_not_depend_on_the_angle_is_a_number(
    mean: Elastic, width: float, friction: float
) -> None:
    law = Hysteresis.from_mean_and_width(mean, width)
    turn, lost = urdf_joint("hinge", spring_set(hinge("hinge", law, viscous=0.3, coulomb=0.1)))
    dynamics = turn.find("dynamics")
    assert dynamics is not None
    assert float(dynamics.get("friction", "nan")) == pytest.approx(friction)
    assert dynamics.get("damping") == "0.3"
    assert "friction that depends on the angle" not in lost
    assert "the rate at which Coulomb friction sets in" in lost


def test_friction_that_depends_on_the_angle_is_lost() -> None:
    law = Hysteresis(Linear(3.0, 0.1), Linear(2.0, 0.3))
    turn, lost = urdf_joint("hinge", spring_set(hinge("hinge", law)))
    assert turn.find("dynamics") is None
    assert "friction that depends on the angle" in lost
