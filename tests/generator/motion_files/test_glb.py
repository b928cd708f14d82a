"""Binary glTF: meshes, origins and times; `tests/properties` finds every site by its nodes."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation, Slerp

from generator import read_figure
from generator.contact.scene import Scene
from generator.diagnostics import MoverError
from generator.geometry.appearance import linear_colour, mass_capsule
from generator.geometry.psurf import PSURF_FILE
from generator.motion_files import FigureMotion
from generator.motion_files.glb import write
from generator.motion_files.motion import motion_from_figure
from generator.motion_files.skeleton import build_skeleton
from generator.rotations import Array
from tests.contacts import PROPS, with_contact
from tests.motion_readers import Glb
from tests.motions import MOTIONS, any_motion, bent, clip, shipped, site, slides, standing
from tests.paths import FIGURES

WITHIN = 1e-6


@pytest.fixture(scope="module")
def prototype(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The prototype as it is drawn."""
    path = tmp_path_factory.mktemp("glb") / "prototype.glb"
    write(standing(shipped("prototype")), path)
    return path


def half_way(values: Array) -> Array:
    """Values in the middle between frames, as glTF interpolates: spherically and linearly."""
    if values.shape[1] == 3:
        return 0.5 * (values[1:] + values[:-1])
    pairs = [Rotation.from_quat(values[k : k + 2]) for k in range(len(values) - 1)]
    return np.array([Slerp([0.0, 1.0], pair)(0.5).as_quat() for pair in pairs])


@pytest.mark.verify
def test_another_reader_finds_the_same_numbers(prototype: Path):
    pygltflib = pytest.importorskip("pygltflib")
    theirs, ours = pygltflib.GLTF2().load(str(prototype)), Glb(prototype)
    assert [node.name for node in theirs.nodes] == [node["name"] for node in ours.nodes]
    assert [node.children for node in theirs.nodes] == [n.get("children", []) for n in ours.nodes]
    assert theirs.binary_blob() == ours.blob
    for channel in theirs.animations[0].channels:
        sampler = theirs.animations[0].samplers[channel.sampler]
        held = ours.channels[channel.target.node, channel.target.path]
        assert (sampler.input, sampler.output) == (held["input"], held["output"])


@pytest.mark.parametrize(
    ("motion", "shifted"),
    [
        (any_motion(shipped("prototype")), 0),
        (any_motion(shipped("fourbar")), 0),
        (any_motion(slides()), 2),
        (any_motion(shipped("prototype"), is_free=True), 1),
    ],
    ids=["prototype", "fourbar", "slides", "flying"],
)
def test_only_slides_and_free_roots_have_positions(
    motion: FigureMotion, shifted: int, tmp_path: Path
):
    write(motion, tmp_path / "out.glb")
    paths = [path for _, path in Glb(tmp_path / "out.glb").channels]
    assert paths.count("translation") == shifted


@pytest.mark.parametrize("name", MOTIONS)
def test_one_skin_holds_the_bones_with_their_poses_at_rest(name: str, tmp_path: Path):
    """The inverse bind matrices are those of the figure with all displacements zero."""
    motion = clip(name)
    write(motion, tmp_path / "out.glb")
    zero = {joint: np.zeros((1, len(chain))) for joint, chain in motion.chains.items()}
    rest = replace(motion, times=np.zeros(1), displacements=zero, recording=None)
    write(rest, tmp_path / "rest.glb")
    read, poses = Glb(tmp_path / "out.glb"), Glb(tmp_path / "rest.glb").poses()
    (skin,) = read.document["skins"]
    matrices = read.numbers(skin["inverseBindMatrices"]).reshape(-1, 4, 4).swapaxes(1, 2)
    names = [read.nodes[joint]["name"] for joint in skin["joints"]]
    assert names == [bone.segment for bone in build_skeleton(motion).bones]
    if name != "flying":
        for segment, inverse in zip(names, matrices, strict=True):
            assert np.allclose(inverse @ poses[segment][0], np.eye(4), atol=1e-6)
    assert np.array_equal(matrices[:, 3], np.tile([0.0, 0.0, 0.0, 1.0], (len(names), 1)))
    (root,) = read.document["scenes"][0]["nodes"]
    assert skin["skeleton"] == root
    assert root not in skin["joints"]


def test_the_root_has_the_name_of_the_figure_and_no_other(tmp_path: Path):
    figure = shipped("prototype")
    for title, expected in (("prototype", "prototype"), ("lower_torso", "lower_torso_2")):
        write(standing(replace(figure, name=title)), tmp_path / "out.glb")
        read = Glb(tmp_path / "out.glb")
        (root,) = read.document["scenes"][0]["nodes"]
        assert read.nodes[root]["name"] == expected
        assert len({node["name"] for node in read.nodes}) == len(read.nodes)


def test_a_pose_is_a_file_without_an_animation(tmp_path: Path):
    motion = motion_from_figure(shipped("prototype"), bent(shipped("prototype")))
    write(motion, tmp_path / "pose.glb")
    assert "animations" not in Glb(tmp_path / "pose.glb").document
    scene = trimesh.load_scene(tmp_path / "pose.glb")
    for name, segment in motion.figure.segments.items():
        for each in segment.sites:
            pose, _ = scene.graph.get(f"{name}.{each}")
            assert np.allclose(pose[:3, 3], site(motion, name, each)[0], atol=WITHIN)
        if segment.psurf is not None:
            turn, shift = motion.poses[name][0, :3, :3], motion.poses[name][0, :3, 3]
            surface = PSURF_FILE.read(FIGURES / str(segment.psurf))
            vertices = surface.vertices @ turn.T + shift
            pose, mesh = scene.graph.get(name)[0], scene.geometry[name]
            shown = trimesh.transform_points(mesh.vertices, pose)
            assert np.allclose(shown.min(axis=0), vertices.min(axis=0), atol=WITHIN)
            assert np.allclose(shown.max(axis=0), vertices.max(axis=0), atol=WITHIN)


def test_the_file_says_where_it_is_from(tmp_path: Path):
    write(clip("fourbar"), tmp_path / "out.glb")
    extras = Glb(tmp_path / "out.glb").document["asset"]["extras"]
    assert (extras["figure"], extras["outcome"]) == ("fourbar.fig", "done")
    assert len(extras["sha256"]) == 64


def test_the_figure_stands_upright_on_the_floor(prototype: Path):
    scene = trimesh.load_scene(prototype)
    low, high = scene.to_geometry().bounds
    assert low[1] == pytest.approx(0.0, abs=1e-6)
    assert high[1] == pytest.approx(1.897, abs=1e-3)
    # The arms are at its sides, left and right alike, and its feet look forward.
    assert low[0] == pytest.approx(-high[0], abs=1e-6)
    assert abs(low[2]) < high[2] < high[0]


def test_meshes_are_the_psurfs_with_their_colours(prototype: Path):
    scene = trimesh.load_scene(prototype)
    figure = shipped("prototype")
    with_psurfs = {name for name, s in figure.segments.items() if s.psurf is not None}
    assert with_psurfs <= set(scene.geometry)
    for name in with_psurfs:
        mesh = scene.geometry[name]
        assert isinstance(mesh, trimesh.Trimesh)
        surface = PSURF_FILE.read(FIGURES / str(figure.segments[name].psurf))
        fans, _ = surface.fan_triangles
        volume = np.sum(np.linalg.det(surface.vertices[fans].transpose(1, 0, 2))) / 6.0
        assert mesh.volume == pytest.approx(volume, rel=1e-5)
        assert mesh.volume > 0.0
        assert np.allclose(mesh.vertex_normals[mesh.faces[:, 0]], mesh.face_normals, atol=1e-3)
        colour = mesh.visual.material.baseColorFactor[:3] / 255.0
        assert np.allclose(colour, linear_colour((1.0, 0.37, 0.0)), atol=0.003)


def test_a_segment_without_a_psurf_is_a_capsule_from_joint_to_joint(tmp_path: Path):
    figure = shipped("fourbar")
    write(standing(figure), tmp_path / "out.glb")
    scene = trimesh.load_scene(tmp_path / "out.glb")
    crank = scene.geometry["crank"]
    shape = mass_capsule(figure, figure.segments["crank"])
    assert shape is not None
    width = 2.0 * shape.radius
    assert np.allclose(np.sort(crank.extents), [width, width, 0.2 + width], atol=1e-6)
    # 0.6 kg with the density of water, and less as the corners lie on the capsule
    assert 0.94 * 0.6e-3 < crank.volume < 0.6e-3
    assert {"frame", "crank", "coupler", "rocker"} == set(scene.geometry)


def test_a_psurf_that_cannot_be_read_is_told(tmp_path: Path):
    text = (FIGURES / "prototype.fig").read_text(encoding="utf-8")
    copy = tmp_path / "prototype.fig"
    copy.write_text(text, encoding="utf-8")
    losses = write(standing(read_figure(copy)), tmp_path / "out.glb")
    (lost,) = [loss for loss in losses.entries if loss.what == "psurfs that could not be read"]
    assert any("left_upper_arm" in where and "euparm.pss" in where for where in lost.where)
    assert "left_upper_arm" in trimesh.load_scene(tmp_path / "out.glb").geometry


def test_a_motion_that_starts_late_begins_at_zero(tmp_path: Path):
    losses = write(any_motion(slides(), np.array([5.0, 5.05, 5.1])), tmp_path / "late.glb")
    assert any("5 s" in loss.what for loss in losses.entries)
    read = Glb(tmp_path / "late.glb")
    times = read.document["accessors"][read.document["animations"][0]["samplers"][0]["input"]]
    assert times["min"] == [0.0]
    assert times["max"] == pytest.approx([0.1])


@pytest.mark.parametrize("last", [1e39, 1.7e308])
def test_a_motion_longer_than_32_bits_can_say_is_refused(last: float, tmp_path: Path):
    motion = any_motion(slides(), np.array([-last, 0.0, last]))
    with pytest.raises(MoverError, match="too long"):
        write(motion, tmp_path / "long.glb")
    assert not (tmp_path / "long.glb").exists()


def test_frames_that_24_bits_cannot_tell_apart_are_refused(tmp_path: Path):
    motion = any_motion(slides())
    close = np.array([0.0, 1e6, 1e6 + 1e-3])
    with pytest.raises(MoverError, match="too closely"):
        write(replace(motion, times=close), tmp_path / "out.glb")
    assert not (tmp_path / "out.glb").exists()


def test_props_are_nodes_beside_the_figure(tmp_path: Path):
    """A box is itself; a plane is a sheet in it, around the motion; a wall is translucent."""
    motion = with_contact(clip("slides"))
    write(motion, tmp_path / "run.glb")
    read = Glb(tmp_path / "run.glb")
    names = [node["name"] for node in read.nodes]
    roots = [names[k] for k in read.document["scenes"][0]["nodes"]]
    assert roots[1:] == ["floor", "crate", "wall"]
    origins = np.concatenate([poses[:, :3, 3] for poses in motion.poses.values()])
    for prop in PROPS.props:
        node = read.nodes[names.index(prop.name)]
        pose = read.poses()[prop.name][0]
        assert np.allclose(pose, prop.shape.pose, atol=WITHIN)
        mesh = read.document["meshes"][node["mesh"]]["primitives"][0]
        corners = read.numbers(mesh["attributes"]["POSITION"])
        assert np.allclose(prop.shape.distance(tuple(corners.T))[0], 0.0, atol=WITHIN)
        low, high = corners.min(axis=0), corners.max(axis=0)
        if prop.shape.is_endless:
            local = (origins - pose[:3, 3]) @ pose[:3, :3]
            assert np.all(low[[0, 2]] <= local[:, [0, 2]].min(axis=0) - 0.99)
            assert np.all(high[[0, 2]] >= local[:, [0, 2]].max(axis=0) + 0.99)
        else:
            assert np.allclose([low, high], prop.shape.bounds, atol=WITHIN)
        material = read.document["materials"][mesh["material"]]
        assert (material.get("alphaMode") == "BLEND") == (prop.name == "wall")


def test_a_prop_of_the_name_of_a_segment_gets_another(tmp_path: Path):
    motion = with_contact(clip("slides"))
    props = [
        replace(prop, name=name)
        for prop, name in zip(PROPS.props, ("arm", "rod", "x"), strict=True)
    ]
    write(replace(motion, scene=Scene(tuple(props))), tmp_path / "run.glb")
    names = [node["name"] for node in Glb(tmp_path / "run.glb").nodes]
    assert {"arm", "arm_2", "rod_2", "x"} <= set(names)
    assert len(set(names)) == len(names)
