"""Binary glTF: other readers place every site where it was simulated."""

import json
import struct
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation, Slerp

from generator import Plan, read_figure, simulate
from generator.diagnostics import MoverError
from generator.geometry.psurf import read_psurf
from generator.motion_files import FigureMotion, motion_from_recording
from generator.motion_files.appearance import linear_colour
from generator.motion_files.glb import write
from tests.motions import FIGURES, MOTIONS, all_sites, clip, site, ten_frames

WITHIN = 1e-6


@cache
def written(name: str, folder: Path) -> Path:
    path = folder / f"{name}.glb"
    write(clip(name), path)
    return path


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("glb")


class Foreign:
    """A `.glb` as pygltflib reads it, with kinematics of the glTF specification, 3.5.3 and C."""

    def __init__(self, path: Path) -> None:
        pygltflib = pytest.importorskip("pygltflib")
        self.gltf: Any = pygltflib.GLTF2().load(str(path))
        self.blob = self.gltf.binary_blob()
        self.names = {node.name: k for k, node in enumerate(self.gltf.nodes)}
        self.parents = {c: k for k, node in enumerate(self.gltf.nodes) for c in node.children}
        animation = self.gltf.animations[0]
        self.channels = {
            (c.target.node, c.target.path): animation.samplers[c.sampler]
            for c in animation.channels
        }

    def numbers(self, accessor: int) -> np.ndarray:
        said = self.gltf.accessors[accessor]
        view = self.gltf.bufferViews[said.bufferView]
        assert said.componentType == 5126
        width = {"SCALAR": 1, "VEC3": 3, "VEC4": 4}[said.type]
        start = view.byteOffset + (said.byteOffset or 0)
        flat = np.frombuffer(self.blob, "<f4", said.count * width, start)
        return flat.reshape(said.count, width).astype(float)

    def local(self, node: int, time: float) -> np.ndarray:
        said, pose = self.gltf.nodes[node], np.eye(4)
        turn = Rotation.from_quat(said.rotation or [0.0, 0.0, 0.0, 1.0])
        shift = np.array(said.translation or [0.0, 0.0, 0.0])
        if (node, "rotation") in self.channels:
            sampler = self.channels[node, "rotation"]
            times = self.numbers(sampler.input)[:, 0]
            turns = Rotation.from_quat(self.numbers(sampler.output))
            turn = Slerp(times, turns)(np.clip(time, times[0], times[-1]))
        if (node, "translation") in self.channels:
            sampler = self.channels[node, "translation"]
            times, values = self.numbers(sampler.input)[:, 0], self.numbers(sampler.output)
            shift = np.array([np.interp(time, times, values[:, k]) for k in range(3)])
        pose[:3, :3], pose[:3, 3] = turn.as_matrix(), shift
        return pose

    def world(self, node: int, time: float) -> np.ndarray:
        here = self.local(node, time)
        return self.world(self.parents[node], time) @ here if node in self.parents else here


@pytest.mark.verify
@pytest.mark.parametrize("name", MOTIONS)
def test_another_reader_finds_every_site_in_its_place(name: str, folder: Path):
    motion, read = clip(name), Foreign(written(name, folder))
    frames = ten_frames(motion)
    for segment, place in all_sites(motion):
        node = read.names[f"{segment}.{place}"]
        found = [read.world(node, motion.times[k])[:3, 3] for k in frames]
        assert np.allclose(found, site(motion, segment, place, frames), rtol=0.0, atol=WITHIN)


@pytest.mark.verify
@pytest.mark.parametrize("name", MOTIONS)
def test_quaternions_have_length_one_and_do_not_jump(name: str, folder: Path):
    read = Foreign(written(name, folder))
    turned = [s for (_, path), s in read.channels.items() if path == "rotation"]
    assert len(turned) == len(clip(name).tree.joints)
    for sampler in turned:
        values = read.numbers(sampler.output)
        assert np.allclose(np.linalg.norm(values, axis=1), 1.0, atol=1e-6)
        assert np.all(np.sum(values[1:] * values[:-1], axis=1) > 0.0)


def off_between_frames(interval: float, folder: Path) -> float:
    """The farthest a site is off its place half-way between frames of a falling prototype [m]."""
    figure, half = read_figure(FIGURES / "prototype.fig"), interval / 2.0
    fine = motion_from_recording(simulate(figure, Plan(stop=1.0, frame=half)), figure)
    moved = {name: rows[::2] for name, rows in fine.displacements.items()}
    coarse = FigureMotion(figure, fine.header, fine.chains, fine.times[::2], moved)
    write(coarse, folder / "coarse.glb")
    read, middle = Foreign(folder / "coarse.glb"), list(range(1, fine.times.size - 1, 2))
    return max(
        np.linalg.norm(found - site(fine, segment, place, middle), axis=1).max()
        for segment, place in all_sites(fine)
        for node in [read.names[f"{segment}.{place}"]]
        for found in [np.array([read.world(node, fine.times[k])[:3, 3] for k in middle])]
    )


@pytest.mark.verify
def test_between_frames_bones_turn_evenly_which_is_a_little_off(folder: Path):
    coarse, fine = (off_between_frames(interval, folder) for interval in (0.05, 0.02))
    assert 0.012 < coarse < 0.015
    assert 0.002 < fine < 0.0035


@pytest.mark.parametrize(
    ("name", "shifted"),
    [("prototype", 0), ("fourbar", 0), ("slides", 2), ("flying", 1)],
)
def test_only_slides_and_free_roots_are_given_positions(name: str, shifted: int, folder: Path):
    document = json_of(written(name, folder))
    paths = [c["target"]["path"] for c in document["animations"][0]["channels"]]
    assert paths.count("translation") == shifted


def json_of(path: Path) -> dict[str, Any]:
    data = path.read_bytes()
    magic, version, length = struct.unpack_from("<4sII", data)
    assert (magic, version, length) == (b"glTF", 2, len(data))
    size, kind = struct.unpack_from("<I4s", data, 12)
    assert kind == b"JSON"
    assert size % 4 == 0
    return json.loads(data[20 : 20 + size])


def test_the_file_says_where_it_is_from(folder: Path):
    extras = json_of(written("prototype", folder))["asset"]["extras"]
    assert extras["figure"] == "prototype.fig"
    assert extras["outcome"] == "done"
    assert len(extras["sha256"]) == 64


def test_trimesh_sees_the_first_frame(folder: Path):
    motion, scene = clip("prototype"), trimesh.load_scene(written("prototype", folder))
    for segment, place in all_sites(motion):
        pose, _ = scene.graph.get(f"{segment}.{place}")
        assert np.allclose(pose[:3, 3], site(motion, segment, place, [0])[0], atol=WITHIN)


def test_the_figure_stands_upright_on_the_floor(folder: Path):
    scene = trimesh.load_scene(written("prototype", folder))
    low, high = scene.to_geometry().bounds
    assert low[1] == pytest.approx(0.0, abs=1e-6)
    assert high[1] == pytest.approx(1.897, abs=1e-3)
    # The arms are at its sides, left and right alike, and its feet look forward.
    assert low[0] == pytest.approx(-high[0], abs=1e-6)
    assert abs(low[2]) < high[2] < high[0]


def test_meshes_are_the_psurfs_with_their_colours(folder: Path):
    scene = trimesh.load_scene(written("prototype", folder))
    figure = clip("prototype").figure
    with_psurfs = {name for name, s in figure.segments.items() if s.psurf is not None}
    assert with_psurfs <= set(scene.geometry)
    for name in with_psurfs:
        mesh = scene.geometry[name]
        assert isinstance(mesh, trimesh.Trimesh)
        surface = read_psurf(FIGURES / str(figure.segments[name].psurf))
        fans, _ = surface.fan_triangles
        volume = np.sum(np.linalg.det(surface.vertices[fans].transpose(1, 0, 2))) / 6.0
        assert mesh.volume == pytest.approx(volume, rel=1e-5)
        assert mesh.volume > 0.0
        assert np.allclose(mesh.vertex_normals[mesh.faces[:, 0]], mesh.face_normals, atol=1e-3)
        colour = mesh.visual.material.baseColorFactor[:3] / 255.0
        assert np.allclose(colour, linear_colour((1.0, 0.37, 0.0)), atol=0.003)


def test_a_segment_without_a_psurf_is_a_stick_from_site_to_site(folder: Path):
    scene = trimesh.load_scene(written("fourbar", folder))
    crank = scene.geometry["crank"]
    assert np.allclose(np.sort(crank.extents), [0.016, 0.016, 0.2], atol=1e-6)
    assert crank.volume > 0.0
    assert {"frame", "crank", "coupler", "rocker"} == set(scene.geometry)


def test_a_psurf_that_cannot_be_read_is_told(tmp_path: Path):
    text = (FIGURES / "prototype.fig").read_text(encoding="utf-8")
    copy = tmp_path / "prototype.fig"
    copy.write_text(text, encoding="utf-8")
    figure = read_figure(copy)
    run = simulate(figure, Plan(stop=0.02, step=0.02))
    losses = write(motion_from_recording(run, figure), tmp_path / "out.glb")
    (lost,) = [loss for loss in losses.entries if loss.what == "psurfs that could not be read"]
    assert any("left_upper_arm" in where and "euparm.pss" in where for where in lost.where)
    assert "left_upper_arm" in trimesh.load_scene(tmp_path / "out.glb").geometry


def test_a_motion_that_starts_late_begins_at_zero(tmp_path: Path):
    figure = clip("slides").figure
    run = simulate(figure, Plan(start=5.0, stop=5.1, step=0.01))
    losses = write(motion_from_recording(run, figure), tmp_path / "late.glb")
    assert any("5 s" in loss.what for loss in losses.entries)
    document = json_of(tmp_path / "late.glb")
    times = document["accessors"][document["animations"][0]["samplers"][0]["input"]]
    assert times["min"] == [0.0]
    assert times["max"] == pytest.approx([0.1])


def test_frames_that_24_bits_cannot_tell_apart_are_refused(tmp_path: Path):
    motion = clip("slides")
    close = np.concatenate([[0.0], 1e6 + 1e-3 * np.arange(motion.times.size - 1)])
    with pytest.raises(MoverError, match="too closely"):
        write(replace(motion, times=close), tmp_path / "out.glb")
    assert not (tmp_path / "out.glb").exists()
