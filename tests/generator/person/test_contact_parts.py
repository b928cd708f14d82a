"""The parts of persons: every sphere has one, both sides alike, stiffness as in the table."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from generator.contact.edges import is_limb, largest_edge_depth
from generator.contact.scene import Scene
from generator.contact.spheres import LARGEST_ERROR, fit_contact_spheres
from generator.contact_file.parts import BodyContact
from generator.figure_file.read import read_figure
from generator.geometry.read import read_segment_surface
from generator.kinematics.placement import forward_kinematics, initial_displacements
from generator.kinematics.tree import build_tree
from generator.model import Model, contact_of_figure
from generator.run_options import Integrator
from generator.simulation.live.stepper import Stepper
from generator.simulation.plan import Plan
from generator.simulation.run import simulate
from springs.contact_part import part_forces
from tests.command import mover
from tests.command import run as run_command

PERSONS = ("male50", "female50")


def contact_of(name: str) -> BodyContact:
    contact = contact_of_figure(read_figure(name))
    assert contact is not None
    return contact


@pytest.mark.parametrize("name", PERSONS)
def test_every_sphere_belongs_to_a_part(name):
    fits = fit_contact_spheres(read_figure(name))
    parts = [part for part in contact_of(name).parts if not part.within]
    owned = [sphere for part in parts for sphere in part.spheres]
    every = {(segment, k) for segment, fit in fits.items() for k in range(len(fit.spheres))}
    assert set(owned) == every
    assert len(owned) == len(every)


@pytest.mark.parametrize("name", PERSONS)
def test_both_sides_have_the_same_parts(name):
    parts = {part.name: part for part in contact_of(name).parts}
    lefts = [each for each in parts if each.startswith("left_")]
    assert {each.removeprefix("left_") for each in lefts} >= {"knee", "hand", "foot", "shoulder"}
    for each in lefts:
        other = parts[each.replace("left_", "right_")]
        assert parts[each].law == other.law
        assert len(parts[each].spheres) == len(other.spheres)
    assert {"head", "pelvis", "thorax", "abdomen"} <= parts.keys()
    assert set(parts["buttocks"].spheres) < set(parts["pelvis"].spheres)
    assert {segment for segment, _ in parts["buttocks"].spheres} == {
        "lower_torso",
        "left_upper_leg",
        "right_upper_leg",
    }


@pytest.mark.parametrize("name", PERSONS)
def test_a_part_on_a_plane_has_its_stiffness_in_any_pose(name):
    """In 200 directions, pressed in by 20 mm: within a fifth of the table, on the mean.

    Single directions in which a flat sole or a whole limb meets the plane are stiffer by n^(1/6)
    for n spheres.
    """
    figure, parts = read_figure(name), contact_of(name).parts
    fits = fit_contact_spheres(figure)
    tree = build_tree(figure)
    poses = forward_kinematics(tree, initial_displacements(tree)).poses
    directions = np.random.default_rng(1).normal(size=(200, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    for part in parts:
        own = [(segment, fits[segment].spheres[number]) for segment, number in part.spheres]
        centres = np.array([(poses[s] @ np.append(one.centre, 1.0))[:3] for s, one in own])
        heights = directions @ centres.T + np.array([one.radius for _, one in own])
        depths = heights - heights.max(axis=1)[:, None] + 0.02
        totals = part_forces(part.law, depths, np.zeros_like(depths)).normal.sum(axis=1)
        ratios = totals / part.law.elastic_force(0.02)
        assert np.mean(ratios) == pytest.approx(1.0, abs=0.2)
        assert np.quantile(ratios, 0.9) < 1.25


@pytest.mark.parametrize("name", PERSONS)
def test_limbs_stop_edges_and_keep_their_heights(name):
    figure = read_figure(name)
    fits = fit_contact_spheres(figure)
    owned = {sphere for part in contact_of(name).parts for sphere in part.spheres}
    assert owned == {(segment, k) for segment, fit in fits.items() for k in range(len(fit.spheres))}
    limbs = 0
    for segment, fit in fits.items():
        surface = read_segment_surface(figure, figure.segments[segment])
        assert fit.largest_error < LARGEST_ERROR
        if is_limb(figure, segment, surface):
            limbs += 1
            assert largest_edge_depth(surface, fit.spheres) < LARGEST_ERROR + 2e-4
    assert limbs == 8
    assert len(owned) < 130


@pytest.mark.parametrize("integrator", [Integrator.COMPILED, Integrator.IMPLICIT])
def test_a_fall_of_parts_keeps_its_energy_and_rests_with_its_weight(integrator):
    figure = read_figure("male50")
    model = replace(Model.of(figure), contact=contact_of("male50"))
    plan = Plan(stop=2.0, free_root=True, scene=Scene.floor(), integrator=integrator)
    run = simulate(model, plan)
    assert run.integrator is integrator, run.integrator_reason
    drift = np.ptp(run.energy_balance)
    exchanged = np.ptp(run.energy["gravity"])
    assert drift < (1e-4 if integrator is Integrator.COMPILED else 1e-3) * exchanged
    assert run.contact.weight_carried == pytest.approx(1.0, abs=0.05)


def test_a_person_with_parts_is_written_read_and_run(tmp_path):
    path = tmp_path / "me.fig"
    made = ["person", "--sex", "female", "--stature", "1.7m", "--mass", "60kg"]
    run_command(*made, "-o", path)
    contact = contact_of_figure(read_figure(path))
    assert contact is not None
    fits = fit_contact_spheres(read_figure(path))
    owned = {sphere for part in contact.parts for sphere in part.spheres}
    assert owned == {(name, k) for name, fit in fits.items() for k in range(len(fit.spheres))}
    checked = run_command("check", tmp_path / "me.contact.toml").output
    assert "30, 71 from 30 mm" in checked
    assert "the parts can be used" in checked
    done = run_command("simulate", path, "--floor", "--stop", "0.02")
    assert f"spheres of {len(contact.parts)} parts" in done.stdout
    again = run_command(*made, "--contact", "spheres", "-o", path)
    assert "an older contact file stands beside the figure: delete it" in again.stderr
    (tmp_path / "me.contact.toml").write_text("# mine\n")
    broken = mover("simulate", path, "--floor", "--stop", "0.02")
    assert broken.exit_code == 1
    assert "me.contact.toml:1:1: error: this file states no part" in broken.stderr
    refused = mover(*made, "-o", path)
    assert refused.exit_code != 0
    assert "exists with other parts and would be replaced" in refused.stderr


def test_stages_of_the_table_stiffen_with_depth_but_for_none():
    """Each later stage of a part is stiffer: bone lies below flesh."""
    for part in contact_of("male50").parts:
        stiffnesses = [stiffness for _, stiffness in part.law.stages]
        assert all(a < b for a, b in pairwise(stiffnesses))
        assert part.band[0] < 1.0 < part.band[1]


def test_props_that_are_added_later_touch_the_parts():
    """A stepper that starts without props and gets a floor moves as one that starts with it."""
    model = replace(Model.of(read_figure("male50")), contact=contact_of("male50"))
    plan = Plan(free_root=True, height=0.0)
    late, early = Stepper(model, plan), Stepper(model, replace(plan, scene=Scene.floor()))
    late.set_scene(Scene.floor())
    heights = []
    for stepper in (late, early):
        stepper.advance(0.3)
        assert stepper.agreement_with_exudyn() < 1e-8
        heights.append(stepper.poses["head"][1, 3])
    assert heights[0] == pytest.approx(heights[1], abs=1e-6)
