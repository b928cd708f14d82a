"""Contact of arrays of states against closed forms, and Exudyn's connectors against it."""

from dataclasses import fields, replace
from functools import cache

import numpy as np
import pytest
from scipy.integrate import quad

from generator.contact.box import Box
from generator.contact.plane import Plane
from generator.contact.scene import Prop, Scene
from generator.contact.states import (
    ContactStates,
    ContactSteps,
    ContactTrace,
    evaluate_contacts,
)
from generator.figure_file.read import read_figure
from generator.simulation.compiled import contact_tables
from generator.simulation.compiled_run import compile_model
from generator.simulation.exudyn_model.agreement import ExudynEquations
from generator.simulation.exudyn_model.model import ExudynModel, build_model
from generator.simulation.plan import Plan
from springs import SpringSet
from springs.contact import DEFAULT_SURFACE, Surface
from tests.contact_figures import (
    FLOOR,
    SLOPE_AND_CRATE,
    SOFT,
    odd_body,
    two_segments,
)
from tests.poses import random_pose

NONE = SpringSet()
FAR = (0.0, 0.0, 0.0, 0.0, 20.0, 0.0)


def elastic(surface: Surface, depth: float) -> float:
    """The law of the docstring [N]."""
    k, e = surface.stiffness, surface.transition_depth
    if depth <= 0.0:
        return 0.0
    return k * depth**3 / e**2 * (1.0 - depth / (2.0 * e)) if depth < e else k * (depth - e / 2.0)


def closed_form(surface, point, normal, radius, centre, velocity, spin):
    """Force, moment about the origin, energy, and powers of damping and of friction on a plane."""
    depth = radius - (centre - point) @ normal
    rate = -velocity @ normal
    lowest = centre - radius * normal
    sliding = velocity + np.cross(spin, lowest - centre)
    sliding = sliding - (sliding @ normal) * normal
    normal_force = elastic(surface, depth) * max(0.0, 1.0 + surface.damping * rate)
    smooth = np.sqrt(sliding @ sliding + surface.friction_speed**2)
    force = normal_force * (normal - surface.friction * sliding / smooth)
    energy = quad(lambda d: elastic(surface, d), 0.0, max(depth, 0.0), epsabs=1e-12)[0]
    return (
        np.concatenate([force, np.cross(lowest, force)]),
        energy,
        (normal_force - elastic(surface, depth)) * rate,
        normal_force * surface.friction * (sliding @ sliding) / smooth,
        depth,
        rate,
    )


def random_states(model: ExudynModel, count: int, seed: int = 0):
    """Positions, rotations, velocities and angular velocities of the bodies, moved to a height."""
    rng = np.random.default_rng(seed)
    arrays = []
    for k in range(count):
        pose = random_pose(model, 100 * seed + k, 0.6, 3.0)
        state = pose.state
        rotations = np.array([pose.placement.poses[n][:3, :3] for n in model.figure.bodies])
        shift = np.array([*rng.uniform(-0.3, 0.3, 3)]) - state.positions[0]
        arrays.append((state.positions + shift, rotations, state.velocities))
        arrays[-1] = (*arrays[-1], state.angular_velocities)
    return [np.array(parts) for parts in zip(*arrays, strict=True)]


@cache
def built(name: str, *, python_torques: bool = False) -> ExudynModel:
    made, root = {"odd": (odd_body, "pin"), "two": (two_segments, "root")}[name]
    plan = Plan(
        springs=NONE,
        scene=SLOPE_AND_CRATE,
        displacements={root: FAR},
        python_torques=python_torques,
    )
    return build_model(made(), plan)


def evaluate(model: ExudynModel, scene: Scene, arrays) -> ContactStates:
    assert model.contacts is not None
    return evaluate_contacts(replace(model.contacts, scene=scene), model.figure, *arrays)


@pytest.mark.parametrize("name", ["odd", "two"])
def test_contact_with_planes_in_closed_form(name: str) -> None:
    """Sums over the spheres of each segment and over two planes; the deeper one counts."""
    model = built(name)
    planes = (
        Prop("one", Plane((0.1, -0.1, 0.0), (0.1, 2.0, -0.3)), Surface()),
        Prop("two", Plane((-0.2, 0.0, 0.1), (1.0, 1.0, 0.5)), SOFT),
    )
    count = 20
    arrays = random_states(model, count)
    found = evaluate(model, Scene(planes), arrays)
    bodies, spheres = list(model.figure.bodies), model.contacts.spheres
    touched = 0
    for n in range(count):
        wrenches = np.zeros((len(spheres), 6))
        sums, depths, rates = np.zeros(3), [], []
        for g, (segment, some) in enumerate(spheres.items()):
            b = bodies.index(segment)
            position, turn, velocity, spin = (part[n, b] for part in arrays)
            for sphere in some:
                centre_of_mass = model.figure.segments[segment].centre_of_mass
                arm = turn @ (np.array(sphere.centre) - centre_of_mass)
                each = [
                    closed_form(
                        plane.surface,
                        np.array(plane.shape.point),
                        np.array(plane.shape.normal) / np.linalg.norm(plane.shape.normal),
                        sphere.radius,
                        position + arm,
                        velocity + np.cross(spin, arm),
                        spin,
                    )
                    for plane in planes
                ]
                wrenches[g] += sum(one[0] for one in each)
                sums += np.array([one[1:4] for one in each]).sum(axis=0)
                deepest = max(each, key=lambda one: one[4])
                depths.append(deepest[4])
                rates.append(deepest[5])
        scale = 1.0 + np.max(np.abs(wrenches))
        assert np.max(np.abs(found.wrenches[n] - wrenches)) < 1e-11 * scale
        assert np.array_equal(found.forces[n], found.wrenches[n, :, :3])
        assert found.energy[n] == pytest.approx(sums[0], rel=1e-9, abs=1e-9)
        assert found.impact_power[n] == pytest.approx(sums[1], rel=1e-10, abs=1e-9)
        assert found.friction_power[n] == pytest.approx(sums[2], rel=1e-10, abs=1e-9)
        assert found.depths[n] == pytest.approx(np.array(depths), abs=1e-13)
        assert found.rates[n] == pytest.approx(np.array(rates), rel=1e-12, abs=1e-12)
        touched += max(depths) > 0.0
    assert touched > count / 2


def test_the_deepest_prop_of_each_sphere_counts() -> None:
    """Of a crate and the floor below it; without props there is no depth."""
    model = built("odd")
    arrays = random_states(model, 10, 1)
    props = (*FLOOR.props, Prop("box", Box((0.2, 0.1, 0.0), (0.5, 0.3, 0.4)), SOFT))
    both = evaluate(model, Scene(props), arrays)
    single = [evaluate(model, Scene((prop,)), arrays) for prop in props]
    assert np.array_equal(both.depths, np.maximum(single[0].depths, single[1].depths))
    is_second = single[1].depths > single[0].depths
    assert 0 < np.count_nonzero(is_second) < is_second.size
    assert np.array_equal(both.rates, np.where(is_second, single[1].rates, single[0].rates))
    assert both.wrenches == pytest.approx(single[0].wrenches + single[1].wrenches)
    for name in ("energy", "impact_power", "friction_power"):
        total = getattr(single[0], name) + getattr(single[1], name)
        assert getattr(both, name) == pytest.approx(total)
    nothing = evaluate(model, Scene(), arrays)
    assert np.all(nothing.depths == -np.inf)
    assert np.all(nothing.wrenches == 0.0)


def test_powers_and_energy_are_the_power_of_the_forces() -> None:
    """Force times velocity is minus the rate of the stored energy less what is lost."""
    model, step = built("two"), 1e-6
    positions, rotations, velocities, spins = random_states(model, 30, 2)
    here = evaluate(model, SLOPE_AND_CRATE, (positions, rotations, velocities, spins))

    def energy(h: float) -> np.ndarray:
        angle = h * np.linalg.norm(spins, axis=-1)[..., None, None]
        axis = spins / np.linalg.norm(spins, axis=-1, keepdims=True)
        x, y, z = np.moveaxis(axis, -1, 0)
        zero = np.zeros_like(x)
        cross = np.stack(
            [np.stack(row, axis=-1) for row in ((zero, -z, y), (z, zero, -x), (-y, x, zero))],
            axis=-2,
        )
        turn = np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * cross @ cross
        moved = (positions + h * velocities, turn @ rotations, velocities, spins)
        return evaluate(model, SLOPE_AND_CRATE, moved).energy

    stored = (energy(step) - energy(-step)) / (2.0 * step)
    at_origin = velocities - np.cross(spins, positions)
    twists = np.concatenate([at_origin, spins], axis=-1)
    places = [list(model.figure.bodies).index(name) for name in model.contacts.spheres]
    power = np.sum(here.wrenches * twists[:, places], axis=(1, 2))
    lost = here.impact_power + here.friction_power
    assert np.all(here.impact_power >= 0.0)
    assert np.all(here.friction_power >= 0.0)
    scale = np.max(np.abs(power))
    assert scale > 100.0
    assert np.max(np.abs(power + stored + lost)) < 1e-6 * scale


@pytest.mark.parametrize("python_torques", [False, True])
def test_exudyn_s_connectors_exert_these_wrenches(python_torques: bool) -> None:
    """Newton's and Euler's equations of a free body with the wrench about the origin."""
    model = built("odd", python_torques=python_torques)
    equations, link = ExudynEquations(model), model.figure.segments["link"]
    gravity = np.array(model.plan.gravity)
    rng, pressed = np.random.default_rng(0), 0
    for seed in range(15):
        state = random_pose(model, seed, 0.6, 3.0).state
        state = replace(state, positions=rng.uniform(-0.25, 0.35, (1, 3)))
        turn = rotation_from(state.parameters[0])
        arrays = (state.positions, turn[None], state.velocities, state.angular_velocities)
        wrench = evaluate(model, SLOPE_AND_CRATE, [part[None] for part in arrays]).wrenches[0, 0]
        force, moment = wrench[:3], wrench[3:] - np.cross(state.positions[0], wrench[:3])
        spin, inertia = state.angular_velocities[0], turn @ np.diag(link.inertia) @ turn.T
        expected = np.concatenate(
            [
                np.linalg.solve(inertia, moment - np.cross(spin, inertia @ spin)),
                force / link.mass + gravity,
            ]
        )
        found = equations.accelerations(state)[0]
        assert np.max(np.abs(found - expected)) < 1e-11 * max(1.0, np.max(np.abs(expected)))
        pressed += np.linalg.norm(force) > 1.0
    assert 5 < pressed < 15


def rotation_from(parameters) -> np.ndarray:
    w, x, y, z = parameters
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def test_boxes_of_one_surface_share_the_function_of_exudyn_and_the_recorded_law(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A scene of many props is built in one pass: laws are recorded once a kind and a surface."""
    boxes = [
        Prop(f"box {k}", Box((0.5 * k, -1.0, 3.0), (0.1 + 0.01 * k, 0.2, 0.3)), DEFAULT_SURFACE)
        for k in range(200)
    ]
    scene = Scene((*Scene.floor().props, *boxes))
    plan = Plan(stop=0.02, free_root=True, height=0.1, scene=scene)
    model = build_model(read_figure("leg"), plan)
    assert model.contacts is not None
    assert len(model.contacts.functions) == 2
    compile_model(model)  # with the code for contact, which is recorded when it is imported
    recorded: list[object] = []
    record = contact_tables.contact_force
    monkeypatch.setattr(
        contact_tables, "contact_force", lambda *a, **k: recorded.append(a[0]) or record(*a, **k)
    )
    compile_model(model)
    assert len(recorded) == 2


# Parts of results


def contact_steps(count: int, start: float = 0.0, seed: int = 0) -> ContactSteps:
    """Steps of 0.05 s."""
    rng = np.random.default_rng(seed)
    shapes = ((2, 3), (3,), (3,), (3,), (2, 3), (2, 3))
    return ContactSteps(
        start + 0.05 * np.arange(count), *(rng.normal(size=(count, *shape)) for shape in shapes)
    )


FIELDS = [field.name for field in fields(ContactSteps)]


def test_steps_are_taken_and_extended_in_all_parts() -> None:
    one, other = contact_steps(4), contact_steps(3, 0.2, 1)
    longer = ContactSteps.join([one, other])
    mask = np.array([True, False, True, True])
    for name in FIELDS:
        assert np.array_equal(getattr(longer, name)[:4], getattr(one, name))
        assert np.array_equal(getattr(longer, name)[4:], getattr(other, name))
        assert np.array_equal(getattr(one.take(mask), name), getattr(one, name)[mask])
        assert np.array_equal(getattr(one.take(slice(1, 3)), name), getattr(one, name)[1:3])


def trace(frames: int, steps: int, start: float = 0.0, sensitivity: bool = False) -> ContactTrace:
    """A trace whose frames are 0.1 s apart, with steps of 0.05 s."""
    rng = np.random.default_rng(frames)
    return ContactTrace(
        rng.normal(size=(frames, 2)),
        rng.normal(size=(frames, 2, 3)),
        contact_steps(steps, start, frames),
        rng.normal(size=(frames, 2)) if sensitivity else None,
    )


@pytest.mark.parametrize("start", [0.0, 5.0, -0.2, -3.0])
@pytest.mark.parametrize("count", [1, 2, 3, 5])
def test_first_frames_have_the_steps_until_the_last_of_them(start: float, count: int) -> None:
    """At positive and negative times, the step that ends at the last frame included."""
    whole = trace(5, 9, start, sensitivity=True)
    last = float(start + 0.1 * (count - 1))
    first = whole.first_frames(count, last)
    steps = 2 * count - 1
    for name in FIELDS:
        assert np.array_equal(getattr(first.steps, name), getattr(whole.steps, name)[:steps])
    assert np.array_equal(first.losses, whole.losses[:count])
    assert np.array_equal(first.impulses, whole.impulses[:count])
    assert np.array_equal(first.sensitivity, whole.sensitivity[:count])
    assert trace(5, 9).first_frames(2, 0.1).sensitivity is None


@pytest.mark.parametrize("friction", [0.0, 0.7])
def test_the_forces_of_groups_act_in_their_points(friction: float) -> None:
    """They add up to those of segments; without friction they have the moments of the contact."""
    model = built("two")
    plane = Prop("one", Plane((0.1, -0.1, 0.0), (0.1, 2.0, -0.3)), Surface(friction=friction))
    found = evaluate(model, Scene((plane,)), random_states(model, 20))
    names = list(model.contacts.groups)
    assert names == list(model.contacts.spheres)
    sizes = np.linalg.norm(found.group_forces, axis=-1)
    assert 5 < np.count_nonzero(sizes) < sizes.size
    assert found.group_forces == pytest.approx(found.forces, abs=1e-9)
    assert np.all(found.group_points[sizes == 0.0] == 0.0)
    moments = np.cross(found.group_points, found.group_forces)
    scale = np.max(np.abs(found.wrenches))
    off = np.max(np.abs(moments - found.wrenches[..., 3:])) / scale
    assert off < 1e-12 if friction == 0.0 else off > 1e-6
    local = (found.group_points[sizes > 0.0] - plane.shape.pose[:3, 3]) @ plane.shape.pose[:3, :3]
    assert np.all(local[:, 1] <= 1e-12)  # in the plane or below it


def test_spheres_of_a_part_are_a_group_over_segments() -> None:
    model = built("two")
    spheres = {
        name: tuple(replace(one, part="skin" if k == 0 else "") for k, one in enumerate(some))
        for name, some in model.contacts.spheres.items()
    }
    contacts = replace(model.contacts, spheres=spheres)
    groups = contacts.groups
    assert len(groups["skin"]) == len(spheres)
    assert sum(map(len, groups.values())) == sum(map(len, spheres.values()))
    states = evaluate_contacts(contacts, model.figure, *random_states(model, 20))
    assert states.group_forces.sum(axis=1) == pytest.approx(states.forces.sum(axis=1), abs=1e-9)
