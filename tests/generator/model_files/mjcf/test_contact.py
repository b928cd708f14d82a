"""Contact in MuJoCo models: the laws of parts as soft constraints, the props, the spheres."""

from collections import Counter
from dataclasses import replace
from math import log
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from benchmarks.mujoco_falls import STOP, both_falls, distance
from generator import ContactSphere, Figure, Model, Plan, Prop, Scene, convert, read_figure
from generator.contact.box import Box
from generator.contact.plane import Plane
from generator.conversion import figure_of_plan
from generator.kinematics.tree import build_tree
from generator.model_files.mjcf.contact import BLOW_SPEED, fit_soft_law, inverse_masses, rebound
from generator.model_files.mjcf.write import format_mjcf
from springs import Layer, PartLaw
from springs.contact import DEFAULT_SURFACE, Surface
from tests.chains import FREE, body, one_body

STANDING = Plan(scene=Scene.floor(), free_root=True, height=0.0)

LAWS = {
    "a hard floor": (DEFAULT_SURFACE, 4.0),
    "an elastic surface": (Surface(stiffness=5e3, damping=0.0), 4.0),
    "head": (PartLaw(((0.0, 150e3), (0.005, 2000e3)), damping=0.3), 3.5),
    "pelvis": (PartLaw(((0.0, 30e3), (0.03, 71e3))), 15.0),
    "pelvis on a mat": (
        PartLaw(((0.0, 30e3), (0.03, 71e3))).on(Layer(((0.0, 150e3),), thickness=0.028)),
        15.0,
    ),
    "foot": (PartLaw(((0.0, 50e3), (0.01, 200e3)), damping=1.9), 1.2),
}
"""Laws, with the mass of a blow [kg]."""


@pytest.mark.parametrize("name", LAWS)
def test_a_soft_law_has_the_force_of_its_law(name: str) -> None:
    law, mass = LAWS[name]
    depth = np.linspace(0.0, 0.3, 30_000)
    deepest = np.interp(0.5 * 21.0 * BLOW_SPEED**2, law.energy(depth), depth)
    for sharing in (1.0, 2.5):
        soft = fit_soft_law(law, sharing, mass, 21.0)
        inside = depth[(depth > 0.0) & (depth < deepest)]
        force = np.asarray(law.elastic_force(inside))
        assert np.abs(sharing * soft.force(inside) - force).max() < 0.08 * force[-1]
        assert soft.error < 0.03


def ball(height: float, radius: float = 0.05, mass: float = 4.0) -> Figure:
    """A free ball with one contact sphere at a height."""
    inertia = 0.4 * mass * radius**2
    link = body("link", centre=(0.0, 0.0, 0.0), inertia=(inertia, inertia, inertia))
    sphere = ContactSphere((0.0, 0.0, 0.0), radius)
    return one_body(
        FREE, (0.0, 0.0, 0.0, 0.0, height, 0.0), replace(link, mass=mass, contact_spheres=(sphere,))
    )


def started(figure: Figure, plan: Plan) -> str:
    """The text of a MuJoCo model at the start of a plan."""
    start = figure_of_plan(Model.of(figure), plan)
    return format_mjcf(start.figure, start.springs, start.start)[0]


def loaded(text: str) -> tuple[Any, Any, Any]:
    """MuJoCo, a model and its state at the key `start`."""
    mujoco = pytest.importorskip("mujoco")
    model: Any = mujoco.MjModel.from_xml_string(text)
    data: Any = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    return mujoco, model, data


def test_a_rebound_is_that_of_hunt_and_crossley() -> None:
    """Closed form against the motion m v dv = -F(1 + a v) dd, which no F changes."""
    for damping in (0.3, 1.0, 1.9):
        speed, depth, step = BLOW_SPEED, 0.0, 1e-5
        while depth >= 0.0:
            speed -= step * 1e4 * depth * (1.0 + damping * speed)
            depth += step * speed
        assert rebound(damping * BLOW_SPEED) == pytest.approx(-speed / BLOW_SPEED, abs=1e-3)
    assert rebound(0.0) == 1.0


@pytest.mark.verify
@pytest.mark.parametrize("damping", [0.2, 1.0])
def test_a_ball_rebounds_from_a_floor_in_mujoco_as_here(damping: float) -> None:
    surface = Surface(damping=damping)
    scene = Scene.floor(surface=surface)
    plan = Plan(scene=scene, velocities={"pin": (0, 0, 0, 0, -BLOW_SPEED, 0)})
    text = started(ball(0.05), plan)
    mujoco, model, data = loaded(text)
    model.opt.gravity[:] = 0.0
    assert data.qvel[1] == -BLOW_SPEED
    times = np.arange(400) * model.opt.timestep
    heights = np.empty(len(times))
    for k in range(len(times)):
        heights[k] = data.qpos[1]
        mujoco.mj_step(model, data)
    expected = rebound(damping * BLOW_SPEED)
    assert data.qvel[1] / BLOW_SPEED == pytest.approx(expected, abs=0.02)
    # m v dv = -N dd with N = k d (1 + a v), whose transition is half a millimetre deep.
    v = damping * BLOW_SPEED
    deepest = np.sqrt(2.0 * 4.0 * (v - log(1.0 + v)) / (surface.stiffness * damping**2))
    assert 0.05 - heights.min() == pytest.approx(deepest, rel=0.12)


@pytest.mark.verify
def test_inverse_masses_are_those_of_mujoco() -> None:
    start = figure_of_plan(Model.of(read_figure("male50")), STANDING)
    _, model, _ = loaded(format_mjcf(start.figure, start.springs)[0])
    for name, value in inverse_masses(build_tree(start.figure)).items():
        assert model.body_invweight0[model.body(name).id][0] == pytest.approx(value, rel=1e-9)


@pytest.mark.verify
@pytest.mark.slow
def test_a_person_lands_and_rests_in_mujoco(tmp_path: Path) -> None:
    figure, floor = read_figure("male50"), STANDING.scene.props
    far = Prop("far", Box((0.0, 0.2, 5.0), (0.4, 0.4, 0.4)), DEFAULT_SURFACE)
    convert(figure, tmp_path / "two.xml", plan=replace(STANDING, scene=Scene((*floor, far))))
    losses = convert(figure, tmp_path / "body.xml", plan=STANDING)
    assert "each resists by itself" in str(losses[tmp_path / "body.xml"])
    mujoco, model, data = loaded((tmp_path / "body.xml").read_text())
    spheres = [k for k in range(model.ngeom) if ".contact_" in model.geom(k).name]
    assert len(spheres) == model.npair == 117
    weight = 9.81 * float(model.body_mass.sum())
    force, carried = np.zeros(6), []
    while data.time < 2.0:
        mujoco.mj_step(model, data)
        touching = Counter(tuple(one.geom) for one in data.contact[: data.ncon])
        assert set(touching.values()) <= {1}
        for k in range(data.ncon) if data.time > 1.8 else ():
            mujoco.mj_contactForce(model, data, k, force)
            carried.append(force[0])
    steps = round(0.2 / model.opt.timestep)
    assert sum(carried) / steps == pytest.approx(weight, rel=0.03)
    assert [one.number for one in data.warning] == [0] * len(data.warning)
    assert np.abs(data.qvel).max() < 1.0
    back = read_figure_of(tmp_path / "two.xml", tmp_path / "back.fig")
    assert back.segments.keys() == figure.segments.keys()
    assert {one.psurf is None for one in back.bodies.values()} == {False}
    assert {back.segments[name].psurf for name in back.ground} == {None}


def read_figure_of(model: Path, path: Path) -> Figure:
    convert(model, path)
    return read_figure(path)


@pytest.mark.verify
def test_props_are_where_the_scene_has_them() -> None:
    soft = replace(DEFAULT_SURFACE, stiffness=5e3, friction=0.3)
    seat = Prop("seat", Box((0.0, 0.1, 0.3), (0.4, 0.2, 0.6), (0.1, 0.5, -0.2)), soft)
    wall = Prop("wall", Plane((0.0, 0.0, -3.0), (0.0, 1.0, 4.0)), DEFAULT_SURFACE)
    plan = Plan(scene=Scene((seat, wall)))
    mujoco, model, data = loaded(started(ball(1.0), plan))
    mujoco.mj_forward(model, data)
    box, plane = (data.geom(prop.name) for prop in (seat, wall))
    assert np.allclose(box.xpos, seat.shape.pose[:3, 3])
    assert np.allclose(np.reshape(box.xmat, (3, 3)), seat.shape.pose[:3, :3])
    assert np.allclose(2.0 * model.geom("seat").size, (0.4, 0.2, 0.6))
    assert np.allclose(np.reshape(plane.xmat, (3, 3))[:, 2], np.array([0.0, 1.0, 4.0]) / 17**0.5)
    assert model.pair_friction[:, 0].tolist() == [0.3, 0.6]
    stiffness = -model.pair_solref[:, 0] * 4.0
    assert stiffness[0] < 0.3 * stiffness[1]
    for direction in ((0.2, 0.9, 0.1), (-0.5, 0.6, 0.4)):
        place = seat.shape.pose[:3, 3] + 0.2 * np.array(direction)
        data.qpos[:3] = place
        mujoco.mj_forward(model, data)
        local = seat.shape.pose[:3, :3].T @ (place - seat.shape.pose[:3, 3])
        depth = 0.05 - float(seat.shape.distance(tuple(local))[0])
        distances = [one.dist for one in data.contact[: data.ncon]]
        assert distances == ([] if depth < 0.0 else [pytest.approx(-depth, abs=1e-9)])


@pytest.mark.verify
@pytest.mark.slow
def test_a_person_falls_in_mujoco_as_here() -> None:
    """A symmetric fall, which is chaotic late; `python -m benchmarks.mujoco_falls` has others."""
    pytest.importorskip("mujoco")
    here, there = both_falls("upright")
    assert here.contact is not None
    touch = here.contact.segments["lower_torso"].first_time
    assert touch is not None
    assert there.first["lower_torso"] == pytest.approx(touch, abs=0.02)
    assert distance(here, there, touch) < 0.015
    assert distance(here, there, STOP) < 0.06
    assert there.forces.max() == pytest.approx(here.contact.max_force, rel=0.15)
    assert there.centres[-1, 1] == pytest.approx(here.centre_of_mass[-1, 1], abs=0.01)
    assert there.warnings == 0
