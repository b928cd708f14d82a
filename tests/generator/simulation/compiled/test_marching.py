"""Breakpoints, jumps and half turns, against scalar equations integrated to rounding."""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any, TypeAlias

import numpy as np
import pytest
from numpy.random import default_rng
from scipy.integrate import solve_ivp

from generator.contact.box import Box
from generator.contact.scene import Prop, Scene, floor_prop
from generator.figure import Figure, SiteRef
from generator.loads import LoadKind, TimedLoad
from generator.recording import Ending
from generator.simulation.compiled.layout import POINT, STEP_CENTRE, VELOCITY
from generator.simulation.compiled.mechanism import CompiledModel
from generator.simulation.compiled.refinement import CompiledRun, StiffMotionError, run_once
from generator.simulation.compiled_run import compile_model
from generator.simulation.exudyn_model.model import build_model
from generator.simulation.plan import Plan
from springs import FLOATS, AxisSpring, Cubic, Damping, JointSprings, Linear, SpringSet
from springs.contact import Surface
from springs.interpolated import Interpolated
from tests.chains import BALL, X, Y, Z, at, body, chain, figure, ground, joint, one_body
from tests.contact_figures import FLOOR, RADIUS
from tests.contact_figures import MASS as BALL_MASS
from tests.contact_figures import ball as free_ball
from tests.runs import springs_of

Acceleration: TypeAlias = Callable[[float, float, float], float]

MASS, ARM, INERTIA = 1.0, 0.4, 0.1
ABOUT_PIN = INERTIA + MASS * ARM**2
WEIGHT = MASS * 9.81 * ARM
FINE = 1e-12

BAR = body("link", MASS, (INERTIA,) * 3, (ARM, 0.0, 0.0), {"far": at(shift=(0.8, 0.0, 0.0))})
HINGE = one_body(chain("Rz"), segment=BAR)

DEAD_ZONE = Cubic((0.0, 30.0, 0.0, 5.0), dead_zone=(-0.1, 0.1))
POINTS = tuple((x, -3.0 * x**3 + 0.2 * (-1) ** k) for k, x in enumerate(np.arange(14) * 0.2 - 1.3))
TABLE = Interpolated(POINTS)


def build(made: Figure, springs: SpringSet, stop: float, **fields: Any) -> CompiledModel:
    return compile_model(build_model(made, Plan(stop=stop, springs=springs, **fields)))


def integrate(
    acceleration: Acceleration, start: float, rate: float, times: Sequence[float]
) -> np.ndarray:
    """Angles and rates at the times, shape (n, 2), of an acceleration (time, angle, rate).

    Each interval is integrated by itself: interpolation across a breakpoint would lose digits.
    """
    states = [np.array([start, rate])]
    for begin, end in pairwise(times):
        found = solve_ivp(
            lambda t, y: [y[1], acceleration(t, *y)],
            (begin, end),
            states[-1],
            "DOP853",
            rtol=1e-13,
            atol=1e-14,
        )
        states.append(found.y[:, -1])
    return np.array(states)


def swing(
    spring: AxisSpring,
    start: float,
    rate: float,
    stop: float = 0.5,
    tolerance: float = FINE,
    weight: float = WEIGHT,
) -> tuple[CompiledRun, np.ndarray]:
    """Run a bar on a hinge; return the run, and its exact angles and rates."""
    model = build(
        HINGE,
        springs_of("pin", spring),
        stop,
        gravity=(0.0, -9.81 * weight / WEIGHT, 0.0),
        displacements={"pin": (start,)},
        velocities={"pin": (rate,)},
    )
    times = np.linspace(0.0, stop, 41)

    def acceleration(_: float, angle: float, speed: float) -> float:
        torque = sum(law.torque(angle, FLOATS) for law in spring.elastic)
        torque += spring.resistance(angle, speed, FLOATS)
        return (torque - weight * math.cos(angle)) / ABOUT_PIN

    return run_once(model, times, tolerance), integrate(acceleration, start, rate, times)


def error(run: CompiledRun, exact: np.ndarray) -> float:
    """Largest error of angle and rate, relative to 1 + their size as the tolerance is."""
    return float(np.max(np.abs(run.states[:, :2] - exact) / (1.0 + np.abs(exact))))


# Breakpoints


@pytest.mark.parametrize("edge", [-0.1, 0.1])
@pytest.mark.parametrize("rate", [-1.0, 0.0, 1.0])
@pytest.mark.parametrize("weight", [0.0, WEIGHT])
def test_a_start_on_a_breakpoint(edge, rate, weight) -> None:
    spring = AxisSpring(Z, (DEAD_ZONE,), Damping(0.1))
    run, exact = swing(spring, edge, rate, weight=weight)
    assert error(run, exact) < 1e-10
    if rate == weight == 0.0:
        assert run.states[:, :2] == pytest.approx(exact, abs=1e-12)
        assert run.event_times.size == 0


def grazing_motion(rate: float, frequency: float, times: Sequence[float]) -> np.ndarray:
    """Angles and rates of a swing from the middle of a dead zone whose peaks pass its edges.

    Within the zone it is harmonic. Every excursion is integrated by itself, from where it begins
    to where it ends.
    """
    edge = DEAD_ZONE.dead_zone[1]
    amplitude, rows, side = rate / frequency, [], 1.0
    clock = 0.0  # time at which the present harmonic motion passes the middle outwards

    def outside(_: float, y: np.ndarray) -> list[float]:
        return [y[1], -(frequency**2) * y[0] + DEAD_ZONE.torque(y[0], FLOATS) / ABOUT_PIN]

    def back(_: float, y: np.ndarray) -> float:
        return y[0] - edge

    back.terminal, back.direction = True, -1.0
    while clock < times[-1]:
        leaves = np.arcsin(edge / amplitude) / frequency
        start = [edge, frequency * np.sqrt(amplitude**2 - edge**2)]
        excursion = 2.0 * np.sqrt(2.0 * (amplitude - edge) / edge) / frequency
        out = solve_ivp(
            outside,
            (0.0, 2.0 * excursion),
            start,
            "DOP853",
            events=back,
            max_step=0.1 * excursion,
            rtol=1e-13,
            atol=1e-15,
            dense_output=True,
        )
        length = out.t_events[0][0]
        end = clock + leaves + length + leaves
        for time in times:
            since = time - clock
            if rows and time <= rows[-1][0]:
                continue
            if since <= leaves:
                phase = frequency * since
                found = amplitude * np.sin(phase), amplitude * frequency * np.cos(phase)
            elif since <= leaves + length:
                found = out.sol(since - leaves)
            elif time <= end:
                phase = frequency * (end - time)
                found = amplitude * np.sin(phase), -amplitude * frequency * np.cos(phase)
            else:
                break
            rows.append((time, side * found[0], side * found[1]))
        clock, side = end, -side
    return np.array(rows)[:, 1:]


@pytest.mark.parametrize("beyond", [1e-10, 1e-9, 1e-8, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3])
def test_a_track_that_grazes_a_breakpoint(beyond) -> None:
    """A harmonic motion within a dead zone whose peaks pass the edges."""
    spring, frequency = AxisSpring(Z, (DEAD_ZONE, Linear(26.0))), math.sqrt(26.0 / ABOUT_PIN)
    rate = (0.1 + beyond) * frequency
    run, _ = swing(spring, 0.0, rate, 1.0, weight=0.0)
    assert error(run, grazing_motion(rate, frequency, run.times)) < 1e-10
    assert run.steps < 200
    if beyond > 5e-10:
        assert run.event_times.size == 6


@pytest.mark.parametrize("beyond", [-1e-6, -1e-9, -1e-12, 0.0, 1e-12])
def test_a_track_that_hardly_reaches_a_breakpoint(beyond) -> None:
    spring, frequency = AxisSpring(Z, (DEAD_ZONE, Linear(26.0))), math.sqrt(26.0 / ABOUT_PIN)
    run, exact = swing(spring, 0.0, (0.1 + beyond) * frequency, 1.0, weight=0.0)
    assert error(run, exact) < 1e-9
    assert run.steps < 200
    assert run.event_times.size == 0


def test_a_table_of_many_points() -> None:
    run, exact = swing(AxisSpring(Z, (TABLE,), Damping(0.05)), -1.5, 2.0, 2.0)
    assert error(run, exact) < 1e-10
    assert run.event_times.size > 20


WEAK_ZONES = tuple(
    Cubic((0.0, 0.03, 0.0, 0.005), dead_zone=(-1.3 + 0.2 * k, 0.1 + 0.2 * k)) for k in range(7)
)


@pytest.mark.parametrize("tolerance", [1e-3, FINE])
def test_breakpoints_within_one_step_are_passed_in_turn(tolerance) -> None:
    """A fast bar on weak springs with dead zones: all edges are passed, in order, in their time."""
    rate, start = 20.0, -1.4
    spring = AxisSpring(Z, WEAK_ZONES)
    run, exact = swing(spring, start, rate, 0.15, tolerance, weight=0.0)
    edges = np.sort([edge for law in WEAK_ZONES for edge in law.dead_zone])
    assert run.event_times == pytest.approx((edges - start) / rate, abs=1e-4)
    assert len(set(run.event_switches)) == len(edges) == 14
    assert error(run, exact) < max(tolerance, 1e-10)


@pytest.mark.parametrize("sense", [1.0, -1.0])
def test_neighbouring_breakpoints_are_passed_in_turn(sense) -> None:
    """Edges of dead zones so near each other that a step finds both passed, in either direction."""
    zones = [(angle, angle + 1e-4) for angle in (-0.8, -0.3, 0.1, 0.6)]
    weak = tuple(Cubic((0.0, 1e-5, 0.0, 0.0), dead_zone=zone) for zone in zones)
    rate, start = 20.0, -1.2 * sense
    run, _ = swing(AxisSpring(Z, weak), start, sense * rate, 0.12, 1e-3, weight=0.0)
    edges = np.array(zones).ravel()
    expected = sorted((sense * edges - sense * start) / rate)
    assert run.event_times == pytest.approx(expected, abs=1e-7)
    assert len(set(run.event_switches)) == len(edges)


@pytest.mark.parametrize("tolerance", [1e-3, FINE])
def test_points_of_a_table_within_one_step(tolerance) -> None:
    """A fast bar on a table of weak torques: all points are passed, in order, each at its time."""
    weak = Interpolated(tuple((angle, 1e-3 * torque) for angle, torque in POINTS))
    rate, start = 20.0, -1.4
    run, exact = swing(AxisSpring(Z, (weak,)), start, rate, 0.15, tolerance, weight=0.0)
    expected = (np.array(weak.breakpoints) - start) / rate
    assert run.event_times == pytest.approx(expected, abs=1e-5)
    assert len(set(run.event_switches)) == len(POINTS)
    assert error(run, exact) < max(tolerance, 1e-10)


def test_two_joints_that_pass_a_breakpoint_at_once() -> None:
    """Two bars that mirror each other stay mirror images, and move as one alone does."""
    sides = (("a", ARM), ("b", -ARM))
    bars = [body(name, MASS, (INERTIA,) * 3, (arm, 0.0, 0.0)) for name, arm in sides]
    hinges = [joint(f"pin_{n}", "ground.base", f"{n}.near", chain("Rz")) for n in "ab"]
    law = Cubic((0.0, 30.0, 4.0, 5.0), dead_zone=(-0.1, 0.15))
    laws = {"pin_a": law, "pin_b": law.mirrored()}
    springs = SpringSet({n: JointSprings(n, (AxisSpring(Z, (one,)),)) for n, one in laws.items()})
    model = build(
        figure([ground(), *bars], hinges),
        springs,
        1.0,
        velocities={"pin_a": (3.0,), "pin_b": (-3.0,)},
    )
    times = np.linspace(0.0, 1.0, 41)
    run = run_once(model, times, FINE)
    exact = integrate(
        lambda _, x, __: (law.torque(x, FLOATS) - WEIGHT * math.cos(x)) / ABOUT_PIN, 0.0, 3.0, times
    )[:, 0]
    assert run.states[:, 0] == pytest.approx(exact, abs=1e-10)
    assert run.states[:, 1] == pytest.approx(-exact, abs=1e-10)
    passages = sum(np.count_nonzero(np.diff(exact > edge)) for edge in law.breakpoints)
    assert passages >= 4
    assert passages <= run.event_times.size <= 2 * passages
    assert np.count_nonzero(np.diff(run.event_times) > 1e-9) == passages - 1


def test_the_error_falls_with_the_power_of_the_method_across_breakpoints() -> None:
    """Of steps that are not cut by breakpoints, a few dozen, the error falls with the power 8."""
    spring = AxisSpring(Z, (DEAD_ZONE,), Damping(0.05))
    steps, errors = [], []
    for tolerance in (1e-4, 1e-6, 1e-8, 1e-10):
        run, exact = swing(spring, 0.4, 0.0, 4.0, tolerance, 0.0)
        assert run.event_times.size > 20
        steps.append(run.steps - run.event_times.size)
        errors.append(error(run, exact))
    power = np.polyfit(np.log(steps), np.log(errors), 1)[0]
    assert power < -7.0
    assert errors[-1] < 1e-8


def test_steps_after_a_breakpoint_are_not_too_long_for_their_error_estimate() -> None:
    """Out of a dead zone into a spring, whose motion is a faster one."""
    springs, rng = springs_of("pin", AxisSpring(Z, (DEAD_ZONE,), Damping(0.1))), default_rng(1)
    errors: list[float] = []
    for angle, rate in zip(rng.uniform(-0.6, 0.6, 30), rng.uniform(-6.0, 6.0, 30), strict=True):
        start = {"displacements": {"pin": (angle,)}, "velocities": {"pin": (rate,)}}
        model, times = build(HINGE, springs, 1.0, **start), np.linspace(0.0, 1.0, 41)
        exact = run_once(model, times, FINE)
        errors.append(error(run_once(model, times, 1e-8), exact.states[:, :2]))
    assert max(errors) < 40e-8


# Friction


def test_friction_with_a_narrow_slip_rate() -> None:
    """A bar stops on its friction and creeps at the rate at which friction carries the weight."""
    spring = AxisSpring(Z, (), Damping(0.0, 1.5 * WEIGHT, 1e-4))
    run, exact = swing(spring, 0.3, 2.0, 0.5, 1e-9)
    assert run.ending is Ending.DONE
    assert error(run, exact) < 1e-7
    angle, rate = run.states[-1, :2]
    assert rate == pytest.approx(-1e-4 * math.atanh(math.cos(angle) / 1.5), rel=1e-4)


def test_friction_too_stiff_for_an_explicit_method() -> None:
    spring = AxisSpring(Z, (), Damping(0.0, 1.5 * WEIGHT, 1e-7))
    with pytest.raises(StiffMotionError, match="needs more than 100,000 steps a second"):
        swing(spring, 0.3, 2.0)


# Loads


def test_loads_that_jump_and_bend() -> None:
    """A force that sets in and stops at once and has kinks, against the equation split there."""
    times, sizes = (0.1, 0.15, 0.2, 0.37), (40.0, -30.0, 10.0, 25.0)
    rows = [(0.0, size, 0.0) for size in sizes]
    load = TimedLoad(SiteRef("link", "far"), LoadKind.LOCAL_FORCE, times, rows)
    model = build(HINGE, SpringSet(), 0.5, loads=[load])
    frames = np.linspace(0.0, 0.5, 51)
    exact = [np.zeros((1, 2))]
    for start, stop in pairwise((0.0, *times, 0.5)):
        inside = frames[(frames > start + 1e-9) & (frames < stop - 1e-9)]
        acts = times[0] <= start < times[-1]

        def acceleration(t: float, angle: float, _: float, acts: bool = acts) -> float:
            force = float(np.interp(t, times, sizes)) if acts else 0.0
            return (0.8 * force - WEIGHT * math.cos(angle)) / ABOUT_PIN

        exact.append(integrate(acceleration, *exact[-1][-1], [start, *inside, stop])[1:])
    assert sum(map(len, exact)) == len(frames)  # all times are frames
    for tolerance in (1e-4, FINE):
        assert error(run_once(model, frames, tolerance), np.concatenate(exact)) < 100.0 * tolerance


# Turns


def ball(rate: float, *axes: AxisSpring) -> CompiledRun:
    """A ball of equal moments about its centre that turns about x from 3 rad."""
    segment = body("link", MASS, (INERTIA,) * 3, (0.0, 0.0, 0.0))
    model = build(
        one_body(BALL, segment=segment),
        springs_of("pin", *axes),
        1.0,
        displacements={"pin": (3.0, 0.0, 0.0)},
        velocities={"pin": (rate, 0.0, 0.0)},
    )
    return run_once(model, np.linspace(0.0, 1.0, 21), 1e-11)


def test_an_elastic_ball_ends_at_a_half_turn() -> None:
    stiffness, rate = 0.9, 5.0
    run = ball(rate, *(AxisSpring(axis, (Linear(stiffness),)) for axis in (X, Y, Z)))
    frequency = math.sqrt(stiffness / INERTIA)
    size, phase = math.hypot(3.0, rate / frequency), math.atan2(3.0 * frequency, rate)
    expected = (math.asin(math.pi / size) - phase) / frequency
    assert run.ending is Ending.TURNED_OVER
    assert run.turned_joint == "pin"
    assert run.last_time == pytest.approx(expected, abs=1e-9)
    assert run.times[-1] <= run.last_time < run.times[-1] + 0.05


def test_a_damped_ball_passes_half_turns() -> None:
    """Without a spring nothing jumps there: it turns on as damping alone decides."""
    damping = 0.05
    run = ball(20.0, *(AxisSpring(axis, (), Damping(damping)) for axis in (X, Y, Z)))
    decay = damping / INERTIA
    turned = 3.0 + 20.0 / decay * (1.0 - np.exp(-decay * run.times))
    assert run.ending is Ending.DONE
    assert run.event_times.size == int((turned[-1] + np.pi) / (2.0 * np.pi)) > 2
    expected = np.zeros((len(turned), 4))
    expected[:, 0], expected[:, 1] = np.cos(0.5 * turned), np.sin(0.5 * turned)
    cosines = np.abs(np.sum(run.states[:, :4] * expected, axis=1))
    assert cosines == pytest.approx(1.0, abs=1e-12)
    assert run.states[:, 4] == pytest.approx(20.0 * np.exp(-decay * run.times), abs=1e-8)


# Contact

ROUND = Plan(springs=SpringSet(), scene=FLOOR)
UP = STEP_CENTRE + 1
"""Place of the height of the centre of mass in the record of a step."""


def drop_ball(
    height: float,
    tolerance: float,
    surface: Surface,
    speed: float = 0.0,
    stop: float = 0.5,
    *,
    records_steps: bool = False,
) -> CompiledRun:
    """A ball falls on the floor."""
    scene = Scene((floor_prop(Y, surface),))
    plan = replace(
        ROUND, stop=stop, scene=scene, velocities={"pin": (0.0, 0.0, 0.0, 0.0, speed, 0.0)}
    )
    model = compile_model(build_model(free_ball(height), plan))
    frames = np.linspace(0.0, stop, round(stop / 0.02) + 1)
    return run_once(model, frames, tolerance, records_steps=records_steps)


def ball_motion(run: CompiledRun) -> np.ndarray:
    """Height above touching and its rate at the frames, shape (n, 2) [m, m/s]."""
    row = run.links[:, -1]
    return np.stack([row[:, POINT + 1] - RADIUS, row[:, VELOCITY + 1]], axis=1)


def bounce(
    surface: Surface, height: float, speed: float, times: np.ndarray, gravity: float = 9.81
) -> np.ndarray:
    """The same of the law, integrated from touch to touch, where its third derivative jumps."""

    def rates(_: float, y: np.ndarray) -> list[float]:
        force = surface.elastic_force(-y[0], FLOATS) * surface.impact_factor(-y[1], FLOATS)
        return [y[1], force / BALL_MASS - gravity]

    def passes(level: float) -> Callable[[float, np.ndarray], float]:
        def height_above(_: float, y: np.ndarray) -> float:
            return y[0] - level

        height_above.terminal = True
        return height_above

    events = [passes(0.0), passes(-surface.transition_depth)]
    rows, clock, state = [np.array([height, speed])], 0.0, np.array([height, speed])
    while clock < times[-1]:
        found = solve_ivp(
            rates,
            (clock, times[-1]),
            state,
            "DOP853",
            events=events,
            max_step=5e-3,
            rtol=1e-13,
            atol=1e-15,
            dense_output=True,
        )
        inside = (times > clock) & (times <= found.t[-1])
        if np.any(inside):
            rows += list(found.sol(times[inside]).T)
        clock, state = found.t[-1], found.y[:, -1]
        if clock < times[-1]:  # a step beyond the event, which would else be found again
            clock, state = clock + 1e-12, state + 1e-12 * np.array(rates(clock, state))
    return np.array(rows)


@pytest.mark.parametrize("tolerance", [1e-4, 1e-6, 1e-8, 1e-10])
@pytest.mark.parametrize(("height", "speed"), [(0.01, 0.0), (0.2, 0.0), (0.3, -2.0), (0.5, 1.0)])
def test_a_dropped_ball_moves_by_the_law(tolerance, height, speed) -> None:
    """Touches end no step: the error control alone finds the steps through them."""
    surface = Surface(friction=0.0)
    run = drop_ball(height, tolerance, surface, speed)
    exact = bounce(surface, height, speed, run.times)
    assert np.min(exact[:, 0]) < 0.0 < np.max(exact[:, 1])
    errors = np.max(np.abs(ball_motion(run) - exact), axis=0)
    assert errors[0] < 10.0 * tolerance
    assert errors[1] < 1e3 * tolerance
    assert run.event_times.size == 0


def test_the_error_of_touches_falls_with_the_power_of_the_method() -> None:
    """Three, since the force of a touch has the derivatives that the method needs."""
    surface, steps, errors = Surface(damping=0.0, friction=0.0), [], []
    for tolerance in (1e-6, 1e-7, 1e-8, 1e-9, 1e-10):
        run = drop_ball(0.05, tolerance, surface, stop=1.0)
        exact = bounce(surface, 0.05, 0.0, run.times)
        steps.append(run.steps)
        errors.append(np.max(np.abs(ball_motion(run)[:, 0] - exact[:, 0])))
    power = np.polyfit(np.log(steps), np.log(errors), 1)[0]
    assert -4.0 < power < -2.7


def test_elastic_bounces_conserve_energy() -> None:
    surface, height = Surface(damping=0.0, friction=0.0), 0.05
    run = drop_ball(height, 1e-9, surface, stop=2.0)
    heights, rates = ball_motion(run).T
    energy = BALL_MASS * (9.81 * heights + 0.5 * rates**2) + surface.energy(-heights)
    assert energy == pytest.approx(BALL_MASS * 9.81 * height, abs=1e-6)
    period = 2.0 * math.sqrt(2.0 * height / 9.81)
    bounces = np.count_nonzero((heights[:-2] < heights[1:-1]) & (heights[1:-1] > heights[2:]))
    assert bounces >= 0.8 * 2.0 / period


@pytest.mark.parametrize("tolerance", [1e-4, 1e-8])
def test_the_record_has_every_step(tolerance) -> None:
    """Its times increase, and in flight its heights are those of a falling body."""
    run = drop_ball(0.05, tolerance, Surface(), records_steps=True)
    times, heights = run.path_times, run.path_rows[:, UP] - RADIUS
    assert times[0] == 0.0
    assert times[-1] == pytest.approx(0.5, abs=1e-12)
    assert np.all(np.diff(times) > 0.0)
    before = times < math.sqrt(2.0 * 0.05 / 9.81)
    exact = 0.05 - 0.5 * 9.81 * times[before] ** 2
    assert heights[before] == pytest.approx(exact, abs=1e-9)
    assert np.count_nonzero(before) >= 2
    # The figure has one sphere, whose depth is that of the ball.
    assert run.path_rows[:, -2] == pytest.approx(-heights, abs=1e-12)
    assert np.max(np.abs(np.diff(heights))) < 1.0 * np.max(np.diff(times)) + 1e-9


def test_a_record_changes_no_bit_of_the_motion() -> None:
    kept, other = (
        drop_ball(0.05, 1e-6, Surface(), records_steps=records) for records in (True, False)
    )
    assert kept.states.tobytes() == other.states.tobytes()
    assert kept.steps == other.steps
    assert other.path_times.size == other.path_rows.size == 0


@pytest.mark.parametrize("speed", [1.0, 2.0, 8.0])
@pytest.mark.parametrize("start", [0.0, -10.0])
def test_a_ball_does_not_pass_through_a_thin_plate(speed, start) -> None:
    """Although a step of free flight could be so long that no stage of it sees the plate.

    Without gravity and damping it leaves as it came: its motion is its own mirror image in time.
    """
    surface = Surface(damping=0.0)
    plate = Prop("plate", Box((0.0, -0.01, 0.0), (2.0, 0.02, 2.0)), surface)
    for height in np.linspace(0.5, 3.0, 11):
        since = np.linspace(0.0, 2.0 * height / speed, 40)  # none at a touch
        exact = bounce(surface, float(height), -speed, since, gravity=0.0)
        plan = replace(
            ROUND,
            start=start,
            stop=start + since[-1],
            scene=Scene((plate,)),
            gravity=(0.0, 0.0, 0.0),
            velocities={"pin": (0.0, 0.0, 0.0, 0.0, -speed, 0.0)},
        )
        model = compile_model(build_model(free_ball(height), plan))
        run = run_once(model, start + since, 1e-6, records_steps=True)
        assert ball_motion(run)[-1, 1] == pytest.approx(speed, rel=1e-4)
        assert np.max(np.abs(ball_motion(run)[:, 0] - exact[:, 0])) < 1e-4
        assert np.min(run.path_rows[:, UP]) > 0.0


def test_steps_are_as_long_as_the_motion_permits_without_props() -> None:
    plan = replace(ROUND, stop=2.0, scene=Scene())
    model = compile_model(build_model(free_ball(1.0), plan))
    assert run_once(model, np.array([0.0, 2.0]), 1e-6).steps < 10
