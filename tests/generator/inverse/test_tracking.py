"""Motions of a figure from markers."""

from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

from generator import build_tree, read_figure
from generator.diagnostics import InputError
from generator.inverse.markers import Markers, MarkerSite, find_marker_sites, format_trc
from generator.inverse.tracking import Tracked, track_markers
from generator.kinematics.free_root import detach_root
from generator.kinematics.links import Coordinate, Link, Links
from generator.kinematics.placement import forward_kinematics, initial_displacements
from generator.kinematics.tree import Tree
from generator.model_files.formats import read_model
from generator.motion_files import FigureMotion
from generator.rotations import Array
from tests.generator.inverse.opensim_tracking import inverse_kinematics
from tests.generator.inverse.walking import MODEL, walk_of, write_figure_of_walk

Sites = dict[str, MarkerSite]


@pytest.fixture(scope="module")
def walk(tmp_path_factory: pytest.TempPathFactory) -> FigureMotion:
    return walk_of(write_figure_of_walk(tmp_path_factory.mktemp("walk")))


def sites_of_walk(motion: FigureMotion) -> Sites:
    names = [str(one.get("name")) for one in ElementTree.parse(MODEL).iter("Marker")]
    sites = find_marker_sites(names, motion.figure)
    assert len(sites) == len(names) == 39
    return sites


def markers_of(
    tree: Tree, times: Array, values: dict[str, Array], sites: Sites, noise: float = 0.0
) -> Markers:
    """Trajectories of sites along a motion, with noise [m]."""
    poses = forward_kinematics(tree, values).poses
    positions = np.stack(
        [(poses[at.segment] @ np.append(at.place, 1.0))[:, :3] for at in sites.values()], axis=1
    )
    positions += np.random.default_rng(0).normal(0.0, noise or 1e-300, positions.shape)
    return Markers(times, tuple(sites), positions)


def test_exact_markers_give_the_motion_back(walk: FigureMotion):
    sites = sites_of_walk(walk)
    markers = markers_of(walk.tree, walk.times, dict(walk.displacements), sites)
    found = track_markers(walk.tree, markers, sites)
    for joint, values in walk.displacements.items():
        np.testing.assert_allclose(found.displacements[joint], values, atol=1e-9)
    assert found.distances.max() < 1e-9
    assert (found.undetermined, found.at_limits) == ({}, ())


@pytest.mark.verify
def test_noisy_markers_give_the_coordinates_of_opensim(walk: FigureMotion, tmp_path: Path):
    sites = sites_of_walk(walk)
    markers = markers_of(walk.tree, walk.times, dict(walk.displacements), sites, noise=0.005)
    path = tmp_path / "walk.trc"
    path.write_text(format_trc(markers))
    theirs = inverse_kinematics(MODEL, path, tmp_path)
    ours = track_markers(walk.tree, markers, sites)
    for name, at in read_model(MODEL).coordinates.items():
        values = ours.displacements[at.joint][:, at.index]
        if name in ("pelvis_tx", "pelvis_ty"):
            assert np.abs(values - theirs[name]).max() < 1e-4  # 0.1 mm
        else:
            assert np.abs(np.degrees(values) - theirs[name]).max() < 0.1


def person(turn: float) -> tuple[Tree, Array, dict[str, Array], Sites]:
    """A person without ground who bends and turns, with four sites a segment."""
    figure = read_figure("male50")
    freed, _ = detach_root(figure, initial_displacements(build_tree(figure)))
    tree, times = build_tree(freed), np.linspace(0.0, 1.0, 41)
    own, rng = initial_displacements(tree), np.random.default_rng(3)
    wave = np.sin(2.0 * np.pi * times)[:, None]
    values = {
        name: own[name] + 0.2 * wave * rng.uniform(-1.0, 1.0, len(own[name]))
        for name in tree.kinematics.columns
    }
    for name, rows in values.items():
        joint = freed.joints[name]
        rows[:] = np.clip(rows, joint.lower_limit or -9.0, joint.upper_limit or 9.0)
    root = next(iter(freed.joints))
    values[root][:, 1] += turn
    values[root][:, 3:] += [0.5, 0.1, 2.0]
    sites = {
        f"{name}.{k}": MarkerSite(f"{name}.{k}", name, tuple(0.1 * rng.normal(size=3).round(2)))
        for name in freed.bodies
        for k in range(4)
    }
    return tree, times, values, sites


@pytest.mark.parametrize("turn", [0.0, 2.8])
def test_a_person_who_faces_away_is_found(turn: float):
    tree, times, values, sites = person(turn)
    markers = markers_of(tree, times, values, sites)
    found = track_markers(tree, markers, sites)
    assert found.distances.max() < 1e-6
    poses, expected = (
        forward_kinematics(tree, some).poses["left_hand"] for some in (found.displacements, values)
    )
    np.testing.assert_allclose(poses, expected, atol=1e-6)
    for rows in found.displacements.values():
        assert np.abs(np.diff(rows, axis=0)).max() < 1.0  # no frame jumps by a turn


def test_missing_markers_are_left_out(walk: FigureMotion):
    sites = sites_of_walk(walk)
    markers = markers_of(walk.tree, walk.times, dict(walk.displacements), sites)
    hidden = markers.positions.copy()
    hidden[20:40, ::3] = np.nan
    hidden[60:90, 25:30, 1] = np.nan  # a marker with one missing component is missing
    found = track_markers(walk.tree, replace(markers, positions=hidden), sites)
    for joint, values in walk.displacements.items():
        np.testing.assert_allclose(found.displacements[joint], values, atol=1e-9)
    assert np.isnan(found.distances[20:40, ::3]).all()


def hinge(limits: tuple[float, float] | None = None, wave: float = 1.0) -> tuple[Tree, Tracked]:
    """The leg of two hinges, whose knee bends by a wave, tracked by sites of both segments."""
    figure = read_figure("leg")
    if limits is not None:
        knee = figure.joints["knee"]
        figure = figure.with_parts(
            replace(knee, lower_limit=(limits[0],), upper_limit=(limits[1],))
        )
    tree, times = build_tree(figure), np.linspace(0.0, 1.0, 21)
    own = initial_displacements(tree)
    values = {name: np.tile(own[name], (21, 1)) for name in tree.kinematics.columns}
    values["knee"] = values["knee"] + wave * np.sin(3.0 * times)[:, None]
    moving = list(figure.bodies)
    sites = {
        f"{name}{k}": MarkerSite("", name, (0.1 * k, 0.05 * k * k, -0.2))
        for name in moving
        for k in range(3)
    }
    return tree, track_markers(tree, markers_of(tree, times, values, sites), sites)


def test_limits_are_kept():
    _, plain = hinge()
    high = float(np.quantile(plain.displacements["knee"], 0.6))
    low = float(plain.displacements["knee"].min()) - 1.0
    tree, found = hinge((low, high))
    knee, free = found.displacements["knee"], plain.displacements["knee"]
    assert knee.max() == high
    assert found.at_limits == (Coordinate("knee", 0),)
    inside = free < high
    np.testing.assert_allclose(knee[inside], free[inside], atol=1e-9)
    assert len(tree.joints) == len(found.displacements)


def test_followers_move_with_their_controls(walk: FigureMotion):
    """The left knee is said to follow the right one, which its markers do not."""
    sites = sites_of_walk(walk)
    markers = markers_of(walk.tree, walk.times, dict(walk.displacements), sites)
    links = Links((Link(Coordinate("knee_l", 0), Coordinate("knee_r", 0), 0.5, -0.1),))
    found = track_markers(walk.tree, markers, sites, links=links)
    left, right = (found.displacements[f"knee_{side}"][:, 0] for side in "lr")
    np.testing.assert_allclose(left, 0.5 * right - 0.1, atol=1e-12)
    assert found.distances.max() > 0.01


def test_weights_choose_which_markers_are_near(walk: FigureMotion):
    sites = sites_of_walk(walk)
    markers = markers_of(walk.tree, walk.times, dict(walk.displacements), sites, noise=0.02)
    name = "R.Heel" if "R.Heel" in sites else next(iter(sites))
    k = markers.names.index(name)
    plain, heavy = (
        track_markers(walk.tree, markers, sites, weights).distances[:, k].mean()
        for weights in ({}, {name: 1e4})
    )
    assert heavy < 0.7 * plain  # what is beside the plane of the model stays
    without = track_markers(walk.tree, markers, sites, {name: 0.0})
    assert name not in without.markers


def test_displacements_that_move_no_marker_keep_their_value(walk: FigureMotion):
    sites = {n: at for n, at in sites_of_walk(walk).items() if at.segment not in ("talus_r",)}
    markers = markers_of(walk.tree, walk.times, dict(walk.displacements), sites)
    found = track_markers(walk.tree, markers, sites)
    assert found.undetermined == {Coordinate("ankle_r", 0): 151}
    own = walk.figure.joints["ankle_r"].displacement[0]
    np.testing.assert_allclose(found.displacements["ankle_r"], own, atol=1e-12)


def test_frames_that_leave_displacements_open_are_counted(walk: FigureMotion):
    """Without markers on trunk and pelvis nothing says how far the trunk is bent."""
    sites = sites_of_walk(walk)
    markers = markers_of(walk.tree, walk.times, dict(walk.displacements), sites)
    hidden = markers.positions.copy()
    for k, site in enumerate(sites.values()):
        if site.segment in ("torso", "pelvis"):
            hidden[20:40, k] = np.nan
    found = track_markers(walk.tree, replace(markers, positions=hidden), sites)
    assert found.undetermined[Coordinate("back", 0)] == 20
    assert Coordinate("knee_r", 0) not in found.undetermined


def test_wrong_markers_are_refused(walk: FigureMotion):
    sites = sites_of_walk(walk)
    markers = markers_of(walk.tree, walk.times, dict(walk.displacements), sites)
    with pytest.raises(InputError, match="0 markers are sites of the figure"):
        track_markers(walk.tree, markers, {})
    in_mm = replace(markers, positions=1e3 * markers.positions)
    with pytest.raises(InputError, match="the markers span"):
        track_markers(walk.tree, in_mm, sites)
    gone = markers.positions.copy()
    gone[30:35, 2:] = np.nan
    with pytest.raises(InputError, match=r"only 2 markers are seen, and in 4 more frames"):
        track_markers(walk.tree, replace(markers, positions=gone), sites)
