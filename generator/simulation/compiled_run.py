"""A run of an Exudyn model by compiled integration, and its comparison with Exudyn.

The compiled evaluation states the equations of the Exudyn model a second time, so the accelerations
of both are compared in several frames of every run.
"""

import time
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import replace
from functools import partial
from math import inf
from typing import assert_never

import numpy as np

from generator.contact.states import ContactSteps, ContactTrace
from generator.diagnostics import ModelError
from generator.figure import Vector
from generator.recording import (
    STEP_PARTS,
    WHOLE_RECORDING,
    Accuracy,
    Ending,
    Integrator,
    Outcome,
    RecordingPart,
)
from generator.rotations import (
    Array,
    matrix_from_axis_angle,
    quaternion_from_matrix,
    unit_vector,
)
from generator.simulation.compiled.code_cache import mark_compiled
from generator.simulation.compiled.layout import (
    AXIS_IN_PARENT,
    BALL,
    CENTRE,
    COORDINATE,
    HINGE,
    IMPACT,
    KIND,
    PARENT,
    POINT,
    POINT_ACCELERATION,
    POWERS,
    ROTATION,
    SPIN,
    SPIN_RATE,
    STEP_ACCELERATIONS,
    TONE,
    VELOCITY,
    IndexArray,
)
from generator.simulation.compiled.mechanism import CompiledModel, MechanismBuilder
from generator.simulation.compiled.refinement import (
    MAX_STEPS_PER_SECOND,
    AgreedRun,
    CompiledRun,
    Watch,
    joint_differences,
    record_links,
    run_once,
    run_until_agreed,
)
from generator.simulation.exudyn_model.agreement import BodyState, ExudynEquations
from generator.simulation.exudyn_model.model import ExudynModel
from generator.simulation.plan import Plan, WallLimit
from generator.simulation.run_model import RunModel
from generator.simulation.trace import (
    RefinedRun,
    Trace,
    estimated_accuracy,
    finished_outcome,
    half_turn_outcome,
    mean_position,
    pole_outcome,
    solver_failure_outcome,
)

mark_compiled()  # the imports above have compiled the integrator

COMPARED_FRAMES, COMPARED_FRAMES_OF_FAST_RUNS = 5, 1
"""Largest number of frames whose accelerations are compared, among them the last. A fast run is one
of many."""

MAX_DISAGREEMENT = 1e-8
"""Largest difference of accelerations, relative to the largest, at which a compiled run counts."""

DISTURBANCE = 1e-3
"""Angle by which each joint of a disturbed start differs [rad]."""

_SMALLEST_SCALE = 1.0
"""Scale of the difference where all accelerations are smaller [m/s2 or rad/s2]."""


def compile_model(model: RunModel) -> CompiledModel:
    """Compile the equations of a model."""
    plan = model.plan
    return MechanismBuilder(
        model.placement,
        model.rates,
        model.spring_set,
        model.prescribed,
        model.loads,
        plan.gravity,
        (plan.start, plan.stop),
        model.contacts,
        model.tone,
    ).build()


def run_compiled(
    model: RunModel,
    times: Array,
    limit: WallLimit,
    watch: Watch | None,
    max_steps_per_second: float = MAX_STEPS_PER_SECOND,
    record: frozenset[RecordingPart] = WHOLE_RECORDING,
    threads: int = 2,
) -> RefinedRun:
    """Run a model until two runs agree.

    Args:
        model: model without Python functions as torques.
        times: times of the frames [s], shape (n,).
        limit: wall-time limit, at which the run stops.
        watch: called several times a second.
        max_steps_per_second: steps per simulated second above which a motion is called stiff.
        record: parts of the recording; contact is recorded and the start disturbed for those.
        threads: 1 or 2.

    Raises:
        StiffMotionError: the motion needs so many steps that Exudyn's integrator is cheaper.
    """
    compiled = compile_model(model)
    disturb = model.contacts is not None and RecordingPart.CONTACT_SENSITIVITY in record
    records_steps = model.contacts is not None and bool(STEP_PARTS & record)
    start = time.monotonic()
    if model.plan.integrator is Integrator.IMPLICIT:
        if len(compiled.mechanism.rows):
            raise ModelError(
                "the implicit integrator is for figures without closed loops, links and "
                "displacements that follow others (`follow`): choose the compiled one"
            )
        alone = run_once(
            compiled,
            times,
            _step_tolerance(model.plan),
            limit.deadline,
            None if watch is None else partial(watch, 1),
            max_steps_per_second=max_steps_per_second,
            records_steps=records_steps,
            is_implicit=True,
        )
        unknown = np.full(len(alone.times), np.nan)
        agreed = AgreedRun(alone, unknown, alone.steps, 1)
        return _refined_run(model, compiled, agreed, time.monotonic() - start)
    agreed = run_until_agreed(
        compiled,
        times,
        model.plan.tolerance,
        limit.deadline,
        watch,
        max_steps_per_second,
        disturbed_start(compiled, float(times[0])) if disturb else None,
        threads,
        records_steps=records_steps,
        certify=model.plan.certify,
    )
    return _refined_run(model, compiled, agreed, time.monotonic() - start)


def _step_tolerance(plan: Plan) -> float:
    """Return the tolerance of a step of the implicit method.

    An error of the sliding velocity is one of the friction, which above a coefficient of 1 would
    exceed the normal force; with the square of the coefficient, forces of falls agree with those of
    tight runs as they do at 1.
    """
    largest = max([1.0, *(prop.surface.friction for prop in plan.scene.props)])
    return plan.tolerance / largest**2


def _refined_run(
    model: RunModel, compiled: CompiledModel, agreed: AgreedRun, wall_time: float
) -> RefinedRun:
    """Return the motion of a run, with what is known of its error."""
    run = agreed.run
    trace = replace(
        build_trace(model, compiled, run.times, run.states, run.links),
        closing_wrenches=_closing_wrenches(compiled, run),
        contact=_contact_trace(model, compiled, agreed),
    )
    mean_step = (run.last_time - float(run.times[0])) / max(run.steps, 1)
    if model.plan.integrator is Integrator.IMPLICIT:
        last = float(run.times[-1])
        accuracy = Accuracy(None, None, last, mean_step, run.steps, agreed.errors)
    else:
        tolerance = model.plan.tolerance
        accuracy = estimated_accuracy(run.times, agreed.errors, tolerance, mean_step, agreed.steps)
    return RefinedRun(trace, _outcome(model, agreed, trace, accuracy), accuracy, wall_time)


def _outcome(model: RunModel, agreed: AgreedRun, trace: Trace, accuracy: Accuracy) -> Outcome:
    """Return the ending of the run, with its sentence."""
    run = agreed.run
    last = float(run.times[-1])
    match run.ending:
        case Ending.DONE | Ending.INACCURATE:
            if accuracy.tolerance is None:
                return Outcome(Ending.DONE, f"Finished {last:.4g} s by the implicit method.", last)
            is_whole = model.contacts is None or model.plan.certify
            return finished_outcome(accuracy, last, is_whole=is_whole)
        case Ending.INTERRUPTED:
            return Outcome(run.ending, f"interrupted at {run.last_time:.4g} s", last)
        case Ending.TOO_LONG:
            message = f"the wall-time limit was reached at {run.last_time:.4g} s"
            return Outcome(run.ending, message, last)
        case Ending.TURNED_OVER | Ending.POLE:
            assert run.turned_joint is not None
            found = pole_outcome if run.ending is Ending.POLE else half_turn_outcome
            return replace(found(run.turned_joint, run.last_time), last_time=last)
        case Ending.SOLVER_FAILED:
            return solver_failure_outcome(model.figure, trace.angular_velocities[-1], last)
        case _:
            assert_never(run.ending)


def build_trace(
    model: RunModel, compiled: CompiledModel, times: Array, states: Array, links: Array
) -> Trace:
    """Return the bodies' states and accelerations in f frames.

    Args:
        model: the model.
        compiled: its compiled equations.
        times: shape (f,) [s].
        states: shape (f, n).
        links: recorded columns of every link, shape (f, links, RECORDED_COLUMNS).
    """
    body_links = [compiled.segment_links[name] for name in model.figure.bodies]
    bodies = np.array(body_links, dtype=np.int64)
    rotations, arms = body_rotations(bodies, links), centre_arms(compiled, bodies, links)

    def vectors(at: int) -> Array:
        return links[:, bodies, at : at + 3]

    accelerations = centre_accelerations(compiled, bodies, links, model.plan.gravity)
    dissipated, spring_work, load_work, *_ = states[:, -POWERS:].T
    return Trace(
        times,
        vectors(POINT) + arms,
        rotations,
        centre_velocities(compiled, bodies, links),
        vectors(SPIN),
        {},
        dissipated,
        spring_work,
        load_work,
        accelerations=np.concatenate([vectors(SPIN_RATE), accelerations], axis=-1),
        displacements={
            name: states[:, list(places)] for name, places in compiled.coordinates.items()
        },
        tone_work=None if model.tone is None else states[:, TONE - POWERS],
    )


def disturbed_start(compiled: CompiledModel, time: float) -> Array:
    """Return the initial state with every joint turned by `DISTURBANCE`, the free root as well.

    A ball is turned about an axis that a seeded generator draws, a hinge about its own in one of
    the two senses. Velocities and slides stay as they are.
    """
    start = np.array([time]), compiled.initial_state[None]
    links, constants = compiled.mechanism.links, compiled.mechanism.constants
    turns = record_links(compiled, *start)[0, :, ROTATION : ROTATION + 9].reshape(-1, 3, 3)
    state, generator = compiled.initial_state.copy(), np.random.default_rng(0)
    carried = np.tile(np.eye(3), (len(links), 1, 1))
    for i, (parent, kind, coordinate) in enumerate(links[:, [PARENT, KIND, COORDINATE]].tolist()):
        own = np.eye(3)
        if kind == BALL:
            axis = unit_vector(generator.normal(size=3))
            own = matrix_from_axis_angle(axis, np.array(DISTURBANCE))
        elif kind == HINGE and coordinate >= 0:
            angle = DISTURBANCE * float(generator.choice([-1.0, 1.0]))
            axis = constants[i, AXIS_IN_PARENT : AXIS_IN_PARENT + 3]
            axis = axis if parent < 0 else turns[parent] @ axis
            own = matrix_from_axis_angle(axis, np.array(angle))
            state[coordinate] += angle
        carried[i] = own if parent < 0 else carried[parent] @ own
        if kind == BALL:
            state[coordinate : coordinate + 4] = quaternion_from_matrix(carried[i] @ turns[i])
    return state


def _contact_trace(
    model: RunModel, compiled: CompiledModel, agreed: AgreedRun
) -> ContactTrace | None:
    """Return the integrals of contact, and its forces after every step; None without props."""
    if model.contacts is None:
        return None
    run, disturbed = agreed.run, agreed.disturbed
    integrals = run.states[:, -compiled.integrals :]
    contact = ContactTrace(
        integrals[:, IMPACT - POWERS :][:, :2],
        integrals[:, :-POWERS].reshape(len(integrals), -1, 3),
        _contact_steps(model, compiled, run),
    ).first_frames(len(run.times), float(run.times[-1]))  # steps go on where a run is stopped
    if disturbed is None:
        return contact
    count = min(len(run.times), len(disturbed.times))
    one, other = (
        build_trace(model, compiled, some.times[:count], some.states[:count], some.links[:count])
        for some in (run, disturbed)
    )
    difference = mean_position(model.figure, other.positions - one.positions)
    sensitivity = np.full((len(run.times), 2), np.inf)
    sensitivity[:count, 0] = joint_differences(compiled, run, disturbed)
    sensitivity[:count, 1] = np.abs(difference @ np.array(model.plan.up))
    return replace(
        contact, sensitivity=sensitivity, disturbed=_contact_steps(model, compiled, disturbed)
    )


def _contact_steps(model: RunModel, compiled: CompiledModel, run: CompiledRun) -> ContactSteps:
    """Return the contact after each recorded step of a run."""
    rows, links, groups = run.path_rows, len(compiled.mechanism.links), len(compiled.touching)
    sphere_numbers = 2 * len(compiled.mechanism.sphere_constants)
    ends = np.cumsum([STEP_ACCELERATIONS, 3 * links, 3 * groups, sphere_numbers])
    bodies = [compiled.segment_links[name] for name in model.figure.bodies]
    centres, accelerations, forces, spheres, parts = np.split(rows, ends, axis=1)
    laws = 0 if model.contacts is None else len(model.contacts.laws)
    return ContactSteps(
        run.path_times,
        forces.reshape(len(rows), groups, 3),
        spheres[:, ::2],
        spheres[:, 1::2],
        centres,
        accelerations.reshape(len(rows), links, 3)[:, bodies],
        parts.reshape(len(rows), parts.shape[1] // 3, 3)[:, :laws],
    )


def body_rotations(bodies: IndexArray, links: Array) -> Array:
    """Rotation matrices of B bodies, shape (..., B, 3, 3); see `centre_arms` for the arguments."""
    columns = links[..., bodies, ROTATION : ROTATION + 9]
    return columns.reshape(*columns.shape[:-1], 3, 3)


def centre_arms(compiled: CompiledModel, bodies: IndexArray, links: Array) -> Array:
    """From the points of bodies to their centres of mass, in world axes, shape (..., B, 3) [m].

    Args:
        compiled: compiled with the centres of mass.
        bodies: links of the B bodies.
        links: recorded columns, shape (..., links, RECORDED_COLUMNS).
    """
    centres = compiled.mechanism.constants[bodies, CENTRE : CENTRE + 3]
    return (body_rotations(bodies, links) @ centres[..., None])[..., 0]


def centre_velocities(compiled: CompiledModel, bodies: IndexArray, links: Array) -> Array:
    """Velocities of centres of mass, shape (..., B, 3) [m/s]; see `centre_arms`."""
    around = np.cross(links[..., bodies, SPIN : SPIN + 3], centre_arms(compiled, bodies, links))
    return links[..., bodies, VELOCITY : VELOCITY + 3] + around


def centre_accelerations(
    compiled: CompiledModel, bodies: IndexArray, links: Array, gravity: Vector
) -> Array:
    """Accelerations of centres of mass, shape (..., B, 3) [m/s^2]; see `centre_arms`."""
    arms = centre_arms(compiled, bodies, links)
    spins, spin_rates, accelerations = (
        links[..., bodies, at : at + 3] for at in (SPIN, SPIN_RATE, POINT_ACCELERATION)
    )
    around = np.cross(spin_rates, arms) + np.cross(spins, np.cross(spins, arms))
    return accelerations + np.asarray(gravity, dtype=float) + around


def _closing_wrenches(compiled: CompiledModel, run: CompiledRun) -> dict[str, Array]:
    """Return the wrenches of the joints that close loops, on their children."""
    wrenches: dict[str, Array] = {}
    for r, (name, is_on_child) in enumerate(compiled.row_joints):
        on_child = run.wrenches[:, r] if is_on_child else -run.wrenches[:, r]
        wrenches[name] = wrenches.get(name, 0.0) + on_child
    return wrenches


def agreement_with_exudyn(
    model: ExudynModel, trace: Trace, displacements: Mapping[str, Array]
) -> float:
    """Return the largest difference of the accelerations from Exudyn's, relative to the largest.

    Args:
        model: the model whose forces, masses and constraints are Exudyn's.
        trace: trace with accelerations.
        displacements: displacements of every joint in the frames [rad or m].
    """
    equations = ExudynEquations(model)
    jumps = [time for load in model.loads for time in load.discontinuities]
    near_jump = np.isclose(trace.times[:, None], jumps, rtol=0.0, atol=1e-9).any(axis=1)
    frames = np.flatnonzero(~near_jump) if not near_jump.all() else np.arange(len(trace))
    is_fast = model.plan.integrator is Integrator.IMPLICIT
    count = COMPARED_FRAMES_OF_FAST_RUNS if is_fast else COMPARED_FRAMES
    places = np.linspace(len(frames) - 1, 0, count).round().astype(int)
    differences: list[float] = []
    for k in frames[np.unique(places)].tolist():
        # At a dead point of a loop Exudyn's constraints do not determine the accelerations.
        with suppress(ModelError):
            differences.append(frame_disagreement(model, equations, trace, displacements, k))
    return float(np.max(differences)) if differences else inf


def frame_disagreement(
    model: ExudynModel,
    equations: ExudynEquations,
    trace: Trace,
    displacements: Mapping[str, Array],
    frame: int,
) -> float:
    """Return the largest difference of the accelerations in a frame from those of the equations.

    It is relative to the largest acceleration; see `agreement_with_exudyn`.
    """
    assert trace.accelerations is not None
    revolutes = {
        name: connector.axis_index
        for name, connectors in model.springs.items()
        for connector in connectors
        if connector.angle_node is not None
    }
    state = BodyState(
        float(trace.times[frame]),
        trace.positions[frame],
        quaternion_from_matrix(trace.rotations[frame]),
        trace.velocities[frame],
        trace.angular_velocities[frame],
        {name: float(displacements[name][frame, i]) for name, i in revolutes.items()},
    )
    for constraint in model.coordinate_constraints:
        rows = {name: rows[frame] for name, rows in displacements.items()}
        constraint.rate_constraint.set_near(rows)
    exact = equations.accelerations(state)
    scale = max(float(np.max(np.abs(exact))), _SMALLEST_SCALE)
    return float(np.max(np.abs(trace.accelerations[frame] - exact))) / scale
