"""Models for OpenSim: meshes, markers, ranges of coordinates, and the publications of springs."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from math import inf, pi
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest

from generator.figure import Figure
from generator.figure_file import read_figure
from generator.geometry.read import segment_colour
from generator.kinematics.free_root import detach_root
from generator.kinematics.loops import close_loops
from generator.kinematics.placement import initial_displacements
from generator.kinematics.tree import build_tree
from generator.model_files.opensim.write import coordinate_range, format_files, format_osim
from springs import JointSprings, SpringSet
from springs.published.range_of_motion import normal_range
from tests.chains import chain, one_body, two_bodies
from tests.generator.model_files.engines import OpenSim
from tests.generator.model_files.model_cases import (
    FOURBAR,
    PENDULUM,
    PROTOTYPE,
    hinge,
    own_springs,
    spring_set,
)

NAMES = ("prototype", "clavicles", "pendulum", "fourbar")
FIGURES = {name: read_figure(name) for name in NAMES}


@contextmanager
def warnings_of(api: Any, path: Path) -> Iterator[list[str]]:
    """The lines that OpenSim logs, complete when the context ends."""
    lines: list[str] = []
    api.Logger.removeFileSink()
    api.Logger.setLevelString("Warn")
    api.Logger.addFileSink(str(path))
    try:
        yield lines
    finally:
        api.Logger.removeFileSink()
        lines += path.read_text().splitlines()


@pytest.mark.verify
@pytest.mark.parametrize("name", NAMES)
def test_opensim_reads_a_figure_and_its_meshes_without_a_warning(name: str, tmp_path: Path) -> None:
    api: Any = pytest.importorskip("opensim")
    of, path = FIGURES[name], tmp_path / "model" / f"{name}.osim"
    path.parent.mkdir()
    format_files(of, own_springs(of), path).write()
    with warnings_of(api, tmp_path / "log") as lines:
        model = api.Model(str(path))
        state = model.initSystem()
    assert lines == []
    for body in of.bodies:
        mesh = api.Mesh.safeDownCast(model.getComponent(f"/bodyset/{body}/{body}_mesh"))
        assert mesh.get_mesh_file() == f"{name}_geometry/{body}.stl"
        drawn = api.ArrayDecorativeGeometry()
        mesh.generateDecorations(True, model.getDisplayHints(), state, drawn)
        assert drawn.size() == 1
        colour = mesh.get_Appearance().get_color()
        expected = segment_colour(of, of.segments[body])
        assert [colour.get(k) for k in range(3)] == pytest.approx(expected)
    for folder in path.parent.glob("*_geometry"):
        folder.rename(tmp_path / "elsewhere")
    with warnings_of(api, tmp_path / "log") as lines:
        api.Model(str(path)).initSystem()
    assert any("Couldn't find file" in line for line in lines)


@pytest.mark.verify
@pytest.mark.parametrize("name", NAMES)
def test_markers_are_at_the_sites(name: str, tmp_path: Path) -> None:
    of = FIGURES[name]
    loaded, tree = OpenSim(of, SpringSet(), tmp_path), build_tree(of)
    poses = close_loops(tree, initial_displacements(tree)).poses
    loaded.model.realizePosition(loaded.state)
    markers = loaded.model.getMarkerSet()
    sites = [(segment, site) for segment in of.segments.values() for site in segment.sites.values()]
    assert markers.getSize() == len(sites)
    for segment, site in sites:
        place = markers.get(f"{segment.name}.{site.name}").getLocationInGround(loaded.state)
        expected = (poses[segment.name] @ site.pose_in_segment)[:3, 3]
        assert place.to_numpy() == pytest.approx(expected, abs=1e-9)


@pytest.mark.verify
def test_meshes_of_the_ground_stand_where_it_does(tmp_path: Path) -> None:
    """The frame of the four bars is the ground; its mesh has a frame of its own."""
    loaded = OpenSim(FOURBAR, SpringSet(), tmp_path)
    tree = build_tree(FOURBAR)
    expected = close_loops(tree, initial_displacements(tree)).poses["frame"]
    assert loaded.model.hasComponent("/ground/frame_frame/frame_mesh")
    loaded.model.realizePosition(loaded.state)
    assert loaded.frame("/ground/frame_frame") == pytest.approx(expected, abs=1e-12)


def test_a_mesh_has_a_name_that_no_site_has() -> None:
    link = PENDULUM.segments["link1"]
    site = replace(link.sites["CM"], name="link1_mesh")
    of = PENDULUM.with_parts(replace(link, sites={**link.sites, site.name: site}))
    text = format_files(of, SpringSet(), Path("out.osim")).contents[Path("out.osim")]
    assert '<Mesh name="link1_mesh_2">' in str(text)
    assert '<PhysicalOffsetFrame name="link1_mesh">' in str(text)


def test_losses_of_shapes() -> None:
    losses = format_files(FOURBAR, SpringSet(), Path("out.osim")).losses
    found = {loss.what: loss.where for loss in losses.entries}
    capsules = found["segments without a psurf are capsules of their mass"]
    assert set(capsules) == set(FOURBAR.bodies)


def range_of(of: Figure, springs: SpringSet, name: str) -> list[float]:
    root = ElementTree.fromstring(format_osim(of, springs)[0])
    (one,) = [each for each in root.iter("Coordinate") if each.get("name") == name]
    assert one.findtext("clamped") == "false"
    return list(map(float, (one.findtext("range") or "").split()))


def test_ranges_are_limits_else_the_normal_range_else_half_a_turn() -> None:
    free = one_body(chain("Rx"))
    assert range_of(free, SpringSet(), "pin_1") == [-pi, pi]
    limited = one_body(chain("Rx Ry"), lower_limit=(-0.3, -inf), upper_limit=(0.4, 0.5))
    assert range_of(limited, SpringSet(), "pin_1") == [-0.3, 0.4]
    assert range_of(limited, SpringSet(), "pin_2") == [-pi, 0.5]
    slide = one_body(chain("Tx"), lower_limit=(-0.3,), upper_limit=(0.4,))
    assert range_of(slide, SpringSet(), "pin_1") == [-0.3, 0.4]
    assert range_of(one_body(chain("Tx")), SpringSet(), "pin_1") == []


@pytest.mark.parametrize("joint", ["left_elbow", "right_elbow"])
def test_the_normal_range_has_the_sense_of_the_axis(joint: str) -> None:
    """The figure's elbows bend about opposite senses of the springs' axis, or the same."""
    low, high = normal_range(joint, "flexion")
    assert low is not None
    assert high is not None
    drawn = replace(PROTOTYPE.joints[joint], lower_limit=None, upper_limit=None)
    axis = drawn.chain[0].axis
    for sign in (1.0, -1.0):
        x, y, z = (sign * part for part in axis)
        (spring,) = hinge(joint, axis=(x, y, z)).axes
        springs = JointSprings(joint, (replace(spring, motion="flexion"),))
        expected = [low.angle, high.angle] if sign > 0 else [-high.angle, -low.angle]
        assert coordinate_range(drawn, springs, 0, 0.0) == pytest.approx(expected)
    assert coordinate_range(drawn, springs, 0, 3.0) == pytest.approx((-high.angle, 3.0))


def test_default_values_are_the_displacements() -> None:
    root = ElementTree.fromstring(format_osim(PROTOTYPE, SpringSet())[0])
    values = {one.get("name"): one.findtext("default_value") for one in root.iter("Coordinate")}
    for name, joint in PROTOTYPE.joints.items():
        for k, displacement in enumerate(joint.displacement, 1):
            assert float(values[f"{name}_{k}"] or "") == displacement


def test_a_free_root_has_six_coordinates() -> None:
    values = {name: np.array(one.displacement) for name, one in PROTOTYPE.joints.items()}
    of = detach_root(PROTOTYPE, values)[0]
    root = ElementTree.fromstring(format_osim(of, own_springs(PROTOTYPE))[0])
    held = {f"{name}_{k + 1}" for name, one in of.joints.items() for k in range(len(one.chain))}
    assert {one.get("name") for one in root.iter("Coordinate")} == held
    assert any(len(one.chain) == 6 for one in of.joints.values())


def test_publications_are_the_references_of_the_springs() -> None:
    springs = own_springs(PROTOTYPE)
    said = ElementTree.fromstring(format_osim(PROTOTYPE, springs)[0]).findtext(".//publications")
    assert all(" ".join(each.split()) in (said or "") for each in springs.references)
    bare = spring_set(hinge("left_elbow"))
    assert "publications" not in format_osim(PROTOTYPE, bare)[0]


@pytest.mark.parametrize(
    ("text", "start", "is_singular"),
    [
        ("Ry Rx Ry", (0.0, 0.0, 0.0), True),
        ("Ry Rx Ry", (0.0, 0.1, 0.0), False),
        ("Rx Ry Rz", (0.3, pi / 2, 0.2), True),
        ("Rx Ry Rz", (0.0, 0.0, 0.0), False),
        ("Rx Ry", (0.0, pi / 2), False),
    ],
)
def test_singular_angles_at_the_start_are_reported(
    text: str, start: tuple[float, ...], is_singular: bool
) -> None:
    losses = format_osim(two_bodies(chain(text), start), SpringSet())[1]
    found = [loss.where for loss in losses.entries if "singularity" in loss.what]
    assert found == ([("tested",)] if is_singular else [])
