"""Mats and covers in runs: what is pressed through is told, errors name the cover, energy stays."""

from dataclasses import replace

import numpy as np
import pytest

from generator.contact.plane import Plane
from generator.contact.scene import Cover, Prop, Scene, add_floor
from generator.diagnostics import ModelError
from generator.figure_file.read import read_figure
from generator.model import Model
from generator.run_options import Integrator
from generator.simulation.live.stepper import Stepper
from generator.simulation.plan import Plan
from generator.simulation.run import simulate
from springs.contact import DEFAULT_SURFACE
from springs.layer import Layer
from tests.command import mover
from tests.command import run as run_command

UP = (0.0, 1.0, 0.0)
PUSHED = {"lower_torso": (0.0, 0.0, 0.0, 1.0, 0.0, 0.0)}
SOFT = Layer(((0.0, 60e3), (0.05, 200e3)))
THIN = Layer(((0.0, 60e3),), thickness=0.02)
PAD = Layer(((0.0, 100e3), (0.006, 300e3)))


def floor_on(layer: Layer | None, *covers: Cover) -> Scene:
    prop = Prop("mat", Plane((0.0, 0.0, 0.0), UP), replace(DEFAULT_SURFACE, layer=layer))
    return Scene((prop,), covers)


@pytest.fixture(scope="module")
def man() -> Model:
    return Model.of(read_figure("male50"))


def run_on(model, scene, integrator=Integrator.IMPLICIT, stop=1.0):
    plan = Plan(
        stop=stop,
        free_root=True,
        height=0.0,
        scene=scene,
        integrator=integrator,
        velocities=PUSHED,
    )
    return simulate(model, plan)


@pytest.mark.parametrize("integrator", [Integrator.COMPILED, Integrator.IMPLICIT])
def test_energy_of_a_fall_on_a_thin_mat_with_a_cover_is_kept(man, integrator):
    run = run_on(man, floor_on(THIN, Cover("pelvis", PAD)), integrator)
    assert run.integrator is integrator, run.integrator_reason
    drift, exchanged = np.ptp(run.energy_balance), np.ptp(run.energy["gravity"])
    assert drift < (1e-4 if integrator is Integrator.COMPILED else 1e-3) * exchanged
    if run.agreement_with_exudyn is not None:
        assert run.agreement_with_exudyn < 1e-10


def test_layers_that_are_pressed_through_are_told(man):
    """By their parts, at the moment when they carry more than they can."""
    soft = run_on(man, floor_on(SOFT)).contact
    assert soft.pressed_layers == ()
    thin = run_on(man, floor_on(THIN)).contact
    parts = {part for _, part, _ in thin.pressed_layers}
    assert {layer for layer, _, _ in thin.pressed_layers} == {"mat"}
    assert "pelvis" in parts
    times = {part: time for _, part, time in thin.pressed_layers}
    first = min(thin.segments[name].first_time for name in ("lower_torso", "left_upper_leg"))
    assert first < times["pelvis"] < 1.0
    weak = replace(PAD, thickness=0.008)
    covered = run_on(man, floor_on(None, Cover("pelvis", weak))).contact
    assert {one.layer for one in covered.pressed_layers} == {"cover of pelvis"}
    assert {one.part for one in covered.pressed_layers} <= {"pelvis", "buttocks"}
    strong = replace(PAD, thickness=0.5)
    assert run_on(man, floor_on(None, Cover("pelvis", strong))).contact.pressed_layers == ()


def test_mats_and_covers_lower_the_force_on_the_hip(man):
    def hip(scene):
        return run_on(man, scene).contact.parts["pelvis"].peak_force

    bare = hip(floor_on(None))
    assert hip(floor_on(SOFT)) < 0.85 * bare
    assert hip(floor_on(None, Cover("pelvis", PAD))) < 0.98 * bare


def test_a_cover_of_an_unknown_part_is_an_error_with_file_line_and_parts(man, tmp_path):
    scene = floor_on(None, Cover("pelvs", PAD, "my.scene.toml:3"))
    with pytest.raises(ModelError, match=r"my.scene.toml:3: .*`pelvs`.*its parts are .*pelvis"):
        run_on(man, scene)
    with pytest.raises(ModelError, match="the figure has no parts, as a person made with"):
        run_on(replace(man, contact=None), floor_on(None, Cover("pelvis", PAD)))
    with pytest.raises(ModelError, match="nothing touches them: add a floor"):
        run_on(man, Scene(covers=(Cover("pelvis", PAD),)))
    with pytest.raises(ModelError, match="two covers are over the part `pelvis`"):
        Scene(covers=(Cover("pelvis", PAD), Cover("pelvis", SOFT)))
    covered = add_floor(Scene(covers=(Cover("head", PAD),)), UP)
    assert covered.covers == (Cover("head", PAD),)


def test_a_cover_of_a_part_is_over_its_regions_too(man):
    """A region with its part under a cover is as firm as one with a law of its own there."""
    covered = floor_on(None, Cover("pelvis", PAD)).cover(man.contact.laws, man.contact.regions)
    depth = np.linspace(0.0, 0.12, 40)
    both = [covered[name].on(SOFT).elastic_force(depth) for name in ("pelvis", "buttocks")]
    alone = replace(man.contact.laws["buttocks"], within=None, cover=PAD).on(SOFT)
    assert sum(both) == pytest.approx(alone.elastic_force(depth))
    with pytest.raises(ModelError, match="`buttocks` is a region of `pelvis`: cover that part"):
        run_on(man, floor_on(None, Cover("buttocks", PAD)))


def test_covers_that_are_put_on_later_are_as_those_of_the_start(man):
    scene = floor_on(SOFT, Cover("pelvis", PAD), Cover("left_foot", SOFT))
    plan = Plan(free_root=True, height=0.0)
    late, early = Stepper(man, plan), Stepper(man, replace(plan, scene=scene))
    late.set_scene(floor_on(SOFT))
    late.set_scene(scene)
    for stepper in (late, early):
        stepper.advance(0.2)
        assert stepper.agreement_with_exudyn() < 1e-8
    assert late.poses["head"][1, 3] == pytest.approx(early.poses["head"][1, 3], abs=1e-6)


def test_the_summary_tells_of_covers_and_layers(tmp_path):
    path = tmp_path / "me.fig"
    made = ["person", "--sex", "male", "--stature", "1.756m", "--mass", "85.5kg"]
    run_command(*made, "-o", path)
    fall = ["--velocity", "lower_torso=0,0,0,1,0,0", "--stop", "0.8", "--integrator", "implicit"]
    done = run_command("simulate", path, "--floor", "--scene", "hip_protector", *fall)
    assert "parts, pelvis covered" in done.stdout
    assert "warning: cover of pelvis was pressed through at" in done.stderr
    wrong = tmp_path / "wrong.scene.toml"
    wrong.write_text('[[cover]]\npart = "hip"\nstiffness_N_m = 1e5\nsource = "a"\n')
    refused = mover("simulate", path, "--floor", "--scene", wrong, "--stop", "0.1")
    assert refused.exit_code == 1
    assert "wrong.scene.toml:2: the scene covers the part `hip`" in refused.stderr
    bare = mover("simulate", "male50", "--floor", "--scene", wrong, "--stop", "0.1")
    assert "the figure has no parts" in bare.stderr or "does not have" in bare.stderr
    checked = run_command("check", "mat").output
    assert "150 kN/m, pressed through at 28 mm" in checked
    assert "cover of pelvis" in run_command("check", "hip_protector").output
