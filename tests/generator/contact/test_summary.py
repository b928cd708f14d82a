"""Contact records of falls, slides and overlaps against closed forms."""

from dataclasses import replace
from functools import cache
from math import sqrt

import numpy as np
import pytest

from generator.contact.plane import Plane
from generator.contact.record import (
    STANDARD_ACCELERATION,
    ContactRecord,
    head_injury_criterion,
)
from generator.contact.scene import Prop, Scene
from generator.contact_file.parts import BodyContact, BodyPart, Evidence
from generator.figure import Figure
from generator.model import Model
from generator.recording import Recording
from generator.run_options import Integrator
from generator.simulation.plan import Plan
from generator.simulation.run import simulate
from springs import SpringSet
from springs.contact import Surface
from springs.contact_part import PartLaw
from tests.chains import FREE, body, figure, ground, joint, one_body
from tests.contact_figures import (
    BALL_INERTIA,
    FLOOR,
    MASS,
    RADIUS,
    ball,
    with_spheres,
)

NONE = SpringSet()
GRAVITY = 9.81
HEIGHT = 0.2
SKULL, SOLE = PartLaw(((0.0, 3e4),)), PartLaw(((0.0, 2e4), (0.01, 6e4)), 0.5)
ELASTIC = Surface(damping=0.0, friction=0.0)


def scene(surface: Surface, normal=(0.0, 1.0, 0.0)) -> Scene:
    return Scene((Prop("slope", Plane((0.0, 0.0, 0.0), normal), surface),))


def run_plan(made, **fields) -> Recording:
    springs = {} if isinstance(made, Model) else {"springs": NONE}
    run = simulate(made, Plan(**{**springs, "tolerance": 1e-8, **fields}))
    assert run.outcome.succeeded
    assert run.contact is not None
    return run


def contact_of(run: Recording) -> ContactRecord:
    assert run.contact is not None
    return run.contact


@cache
def drop() -> Recording:
    """A ball falls from `HEIGHT` and bounces."""
    return run_plan(ball(HEIGHT), stop=0.5, scene=FLOOR)


@cache
def bounce() -> Recording:
    return run_plan(ball(HEIGHT), stop=0.3, scene=scene(ELASTIC))


@pytest.mark.parametrize("run", [drop, bounce])
def test_the_first_touch_of_a_dropped_ball(run) -> None:
    """At sqrt(2 h / g) with sqrt(2 g h), interpolated between steps that end there."""
    touch = contact_of(run()).segments["link"]
    assert touch.first_time == pytest.approx(sqrt(2.0 * HEIGHT / GRAVITY), abs=1e-9)
    assert touch.impact_speed == pytest.approx(sqrt(2.0 * GRAVITY * HEIGHT), abs=1e-8)


@pytest.mark.parametrize("run", [drop, bounce])
def test_the_impulse_is_the_change_of_momentum(run) -> None:
    recording = run()
    impulse = np.array(contact_of(recording).segments["link"].impulse)
    duration = recording.times[-1]
    change = recording.velocities["pin"][-1, 3:] - recording.velocities["pin"][0, 3:]
    expected = MASS * (change + np.array([0.0, GRAVITY * duration, 0.0]))
    assert impulse == pytest.approx(expected, abs=1e-6)
    assert impulse[1] > 5.0


def test_forces_and_depths_of_the_frames() -> None:
    """The force is along the plane's normal, through the ball's lowest point."""
    run = drop()
    contact = contact_of(run)
    heights = run.centre_of_mass[:, 1]
    assert contact.depths["link"] == pytest.approx(np.maximum(RADIUS - heights, 0.0), abs=1e-12)
    forces = contact.forces["link"]
    touching = contact.depths["link"] > 0.0
    assert 0 < np.count_nonzero(touching) < len(run.times)
    assert np.all(forces[~touching] == 0.0)
    assert np.array_equal(contact.ground_reaction[:, :3], forces)
    moments = np.cross(run.centre_of_mass, forces)
    assert contact.ground_reaction[:, 3:] == pytest.approx(moments, abs=1e-9)
    depths = contact.depths["link"][touching]
    rates = -run.velocities["pin"][touching, 4]
    surface = FLOOR.props[0].surface
    expected = surface.elastic_force(depths) * surface.impact_factor(rates)
    assert forces[touching, 1] == pytest.approx(expected, rel=1e-9)


# Sliding and resting


def test_without_gravity_no_weight_is_carried() -> None:
    """A ball thrown down; its creep is its horizontal speed, in a run shorter than 0.2 s too."""
    run = run_plan(
        ball(0.05),
        stop=0.1,
        scene=scene(ELASTIC),
        gravity=(0.0, 0.0, 0.0),
        velocities={"pin": (0.0, 0.0, 0.0, 0.3, -1.0, 0.4)},
    )
    contact = contact_of(run)
    assert contact.weight_carried is None
    assert contact.creep == pytest.approx(0.5)
    assert contact.segments["link"].first_time == pytest.approx(0.05, abs=1e-9)
    assert contact.segments["link"].impact_speed == pytest.approx(1.0)


def test_up_is_against_gravity() -> None:
    """The same fall onto a wall, along x: all that is horizontal stays so."""
    wall = Scene((Prop("wall", Plane((0.0, 0.0, 0.0), (1.0, 0.0, 0.0)), FLOOR.props[0].surface),))
    link = with_spheres(
        body("link", MASS, BALL_INERTIA, (0.0, 0.0, 0.0)), ((0.0, 0.0, 0.0), RADIUS)
    )
    made = one_body(FREE, (0.0, 0.0, 0.0, HEIGHT + RADIUS, 0.0, 0.0), link)
    run = run_plan(made, stop=0.5, scene=wall, gravity=(-GRAVITY, 0.0, 0.0))
    found, expected = contact_of(run), contact_of(drop())
    assert found.weight_carried == pytest.approx(expected.weight_carried, abs=1e-6)
    assert found.segments["link"].first_time == pytest.approx(
        expected.segments["link"].first_time, abs=1e-9
    )
    assert found.creep < 1e-9


# Touching nothing, and several segments


def test_a_ball_that_touches_nothing() -> None:
    contact = contact_of(run_plan(ball(1.0), stop=0.1, scene=FLOOR))
    touch = contact.segments["link"]
    assert touch.first_time is None
    assert touch.impact_speed == touch.peak_force == contact.max_force == contact.max_depth == 0.0
    assert touch.impulse == (0.0, 0.0, 0.0)
    assert contact.weight_carried == contact.dissipated == 0.0
    assert contact.overlap is None


def test_a_run_without_a_scene_has_no_record() -> None:
    assert simulate(ball(1.0), Plan(stop=0.1, springs=NONE)).contact is None


def two_balls(names=("one", "other"), height: float = 1.0, shift: float = 0.05):
    """Two free balls 0.6 m from each other, beside each other along z by a shift [m]."""
    links = [
        with_spheres(body(name, MASS, BALL_INERTIA, (0.0,) * 3), ((0.0,) * 3, RADIUS))
        for name in names
    ]
    joints = [
        joint(f"to {name}", "ground.base", f"{name}.near", FREE, (0.0, 0.0, 0.0, x, height, z))
        for name, x, z in zip(names, (-0.3, 0.3), (0.0, shift), strict=True)
    ]
    return figure([ground(), *links], joints)


def test_the_overlap_of_balls_that_pass_through_each_other() -> None:
    run = run_plan(
        two_balls(),
        stop=0.6,
        scene=FLOOR,
        gravity=(0.0, 0.0, 0.0),
        velocities={
            "to one": (0.0, 0.0, 0.0, 1.0, 0.0, 0.0),
            "to other": (0.0, 0.0, 0.0, -1.0, 0.0, 0.0),
        },
    )
    overlap = contact_of(run).overlap
    assert overlap is not None
    assert {overlap.segment, overlap.other} == {"one", "other"}
    assert overlap.time == pytest.approx(0.3)
    assert overlap.depth == pytest.approx(2.0 * RADIUS - 0.05, abs=1e-9)
    assert contact_of(run).max_force == 0.0


def as_body(made: Figure, *parts: BodyPart) -> Model:
    """A figure whose parts touch as wholes."""
    return Model(made, NONE, BodyContact(parts))


def part(name: str, *segments: str, law: PartLaw = SKULL) -> BodyPart:
    """A part of the first spheres of some segments."""
    return BodyPart(name, law, tuple((one, 0) for one in segments), (0.5, 2.0), Evidence.SCALED)


def test_only_the_head_of_a_body_with_parts_has_a_head_injury_criterion() -> None:
    """That of the ball's acceleration less what the record of the frames misses."""
    assert contact_of(drop()).head_injury == contact_of(drop()).heads == {}
    made = two_balls(("left foot", "head"), HEIGHT + RADIUS)
    foot = replace(made.joints["to left foot"], displacement=(0.0, 0.0, 0.0, -0.3, 0.5, 0.0))
    made = made.with_parts(foot)
    run = run_plan(as_body(made, part("skull", "head")), stop=0.5, frame=1e-4, scene=FLOOR)
    contact = contact_of(run)
    (name, value), *others = contact.head_injury.items()
    assert name == "head"
    assert not others
    forces = contact.forces["head"]
    accelerations = forces / MASS - np.array([0.0, GRAVITY, 0.0])
    assert value == pytest.approx(head_injury_criterion(run.times, accelerations), rel=1e-2)
    assert value > 1.0
    head, touch = contact.heads["head"], contact.segments["head"]
    largest = np.linalg.norm(accelerations, axis=1).max() / STANDARD_ACCELERATION
    assert head.peak_acceleration == pytest.approx(largest, rel=1e-3)
    assert head.head_weights == touch.peak_force / (MASS * STANDARD_ACCELERATION)
    assert head.peak_time == pytest.approx(touch.peak_time, abs=1e-4)
    plain = contact_of(run_plan(made, stop=0.3, scene=FLOOR))
    assert plain.head_injury == plain.parts == {}
    assert plain.heads["head"].peak_acceleration > 1.0


def test_a_head_twice_as_stiff_has_1_68_times_the_criterion() -> None:
    """That of a mass on a spring, which the sentence of every head rests on."""
    found: list[float] = []
    for factor in (1.0, 2.0):
        law = PartLaw(((0.0, factor * 4e5),), 0.0)
        made = as_body(two_balls(("foot", "head"), 1.0 + RADIUS), part("skull", "head", law=law))
        found.append(contact_of(run_plan(made, stop=0.6, scene=FLOOR)).head_injury["head"])
    assert found[1] / found[0] == pytest.approx(2.0**0.75, rel=0.05)


def test_a_part_has_the_contact_of_its_spheres_in_all_segments() -> None:
    """Both balls are one part: it touches with the lower one, and carries both."""
    made = two_balls()
    other = replace(made.joints["to other"], displacement=(0.0, 0.0, 0.0, 0.3, 0.4 + RADIUS, 0.0))
    one = replace(made.joints["to one"], displacement=(0.0, 0.0, 0.0, -0.3, 0.2 + RADIUS, 0.0))
    made = made.with_parts(one, other)
    both = contact_of(run_plan(as_body(made, part("both", "one", "other")), stop=0.35, scene=FLOOR))
    (name, touch), *others = both.parts.items()
    assert name == "both"
    assert not others
    lower, higher = both.segments["one"], both.segments["other"]
    assert (touch.first_time, touch.impact_speed) == (lower.first_time, lower.impact_speed)
    assert touch.peak_force == pytest.approx(max(lower.peak_force, higher.peak_force), rel=1e-9)
    assert touch.body_weights == pytest.approx(touch.peak_force / (2.0 * MASS * GRAVITY), rel=1e-12)
    assert (touch.band, touch.evidence) == ((0.5, 2.0), Evidence.SCALED)
    alone = contact_of(run_plan(as_body(made, part("a", "other")), stop=0.25, scene=FLOOR))
    assert alone.segments["one"].peak_force > 0.0
    assert alone.parts["a"].first_time is None
    assert alone.parts["a"].peak_force == 0.0


SLOW_EXUDYN = [
    Integrator.COMPILED,
    Integrator.IMPLICIT,
    pytest.param(Integrator.EXUDYN, marks=pytest.mark.slow),
]
"""Exudyn evaluates the contact of parts in Python, which takes a millisecond."""


@pytest.mark.parametrize("integrator", SLOW_EXUDYN)
def test_a_region_has_the_contact_of_its_own_spheres(integrator: Integrator) -> None:
    """The higher one of two balls of a part is firmer."""
    made = two_balls()
    other = replace(made.joints["to other"], displacement=(0.0, 0.0, 0.0, 0.3, 0.2 + RADIUS, 0.0))
    one = replace(made.joints["to one"], displacement=(0.0, 0.0, 0.0, -0.3, 0.1 + RADIUS, 0.0))
    firm = PartLaw(((0.0, 3e4), (0.005, 9e4)))
    region = replace(part("firm", "other", law=firm), within="both")
    body = as_body(made.with_parts(one, other), part("both", "one", "other"), region)
    fields = {"stop": 0.25, "tolerance": 1e-4, "scene": FLOOR, "integrator": integrator}
    contact = contact_of(run_plan(body, **fields))
    whole, firmer = contact.parts["both"], contact.parts["firm"]
    higher = contact.segments["other"]
    assert (firmer.first_time, firmer.impact_speed) == (higher.first_time, higher.impact_speed)
    assert firmer.peak_force == pytest.approx(higher.peak_force, rel=1e-9)
    assert (firmer.within, whole.within) == ("both", "")
    assert whole.first_time == contact.segments["one"].first_time
    assert whole.peak_force >= firmer.peak_force > 1.1 * contact.segments["one"].peak_force


# Exudyn's integrator


@pytest.mark.parametrize(
    ("integrator", "tolerance"),
    [(Integrator.IMPLICIT, 1e-5), pytest.param(Integrator.EXUDYN, 1e-4, marks=pytest.mark.slow)],
)
def test_other_integrators_give_the_same_parts_and_heads(
    integrator: Integrator, tolerance: float
) -> None:
    """The steps of the compiled integrator are longer, and the peak between two is not seen."""
    made = two_balls(("left foot", "head"), 0.35)
    head = replace(made.joints["to head"], displacement=(0.0, 0.0, 0.0, 0.3, 0.3, 0.0))
    body = as_body(
        made.with_parts(head), part("skull", "head"), part("sole", "left foot", law=SOLE)
    )
    fields = {"stop": 0.3, "tolerance": tolerance, "scene": FLOOR}
    exact = contact_of(run_plan(body, **fields))
    found = contact_of(run_plan(body, integrator=integrator, **fields))
    assert exact.head_injury["head"] > 1.0
    assert found.head_injury["head"] == pytest.approx(exact.head_injury["head"], rel=2e-2)
    for one, other in zip(found.parts.values(), exact.parts.values(), strict=True):
        assert other.peak_force > 100.0
        assert one.first_time == pytest.approx(other.first_time, abs=1e-4)
        assert one.impact_speed == pytest.approx(other.impact_speed, rel=1e-3)
        assert one.peak_force == pytest.approx(other.peak_force, rel=1e-2)
        assert one.peak_time == pytest.approx(other.peak_time, abs=1e-3)
    assert found.heads["head"].peak_acceleration == pytest.approx(
        exact.heads["head"].peak_acceleration, rel=1e-2
    )
