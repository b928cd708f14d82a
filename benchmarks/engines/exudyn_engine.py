"""This program: an Exudyn model, integrated by the compiled method or by Exudyn's integrator."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any
from unittest.mock import patch

import numpy as np

from benchmarks.outside import Clock, Fall, Landing
from benchmarks.passive_law import RadialLaw
from generator.figure import Figure
from generator.recording import Recording
from generator.rotations import Array, matrix_from_rotation_vector
from generator.run_options import Integrator
from generator.simulation import compiled_run
from generator.simulation.compiled.refinement import AgreedRun, run_once
from generator.simulation.exudyn_model.model import build_model
from generator.simulation.plan import Plan
from generator.simulation.run import simulate
from springs import AxisSpring, Cubic, Damping, JointSprings, Linear, SpringSet

NAME = "this program"

COMPILED = "compiled"
"""Runs until two agree, with an error estimate and frames."""

WHOLE_CALL = "compiled, whole call"
"""The same with building, the comparison with Exudyn, energies and reactions."""

ONE_RUN = "compiled, one run"
"""A single run to the last state, without an estimate: what other engines do."""

EXUDYN = "Exudyn's integrator"
EXUDYN_STEP = "Exudyn's integrator, fixed step"

_GOLDEN = 0.5 * (1.0 + 5.0**0.5)
_ICOSAHEDRON = np.array(
    [
        turned
        for side in (1.0, -1.0)
        for turned in ((0.0, side, _GOLDEN), (side, _GOLDEN, 0.0), (_GOLDEN, 0.0, side))
    ]
) / np.hypot(1.0, _GOLDEN)
"""Directions of the six diagonals d: sum (d.r)^2 = 2 r^2 and sum (d.r)^4 = 6/5 r^4."""


def radial_springs(figure: Figure, law: RadialLaw) -> SpringSet:
    """A law of the size of the displacement alone, as axis springs.

    A ball gets three axes where the law is linear, else six, the diagonals of an icosahedron: on
    them the energies of cubics add up to one that is the same in all directions.
    """
    joints: dict[str, JointSprings] = {}
    for name, joint in figure.joints.items():
        damping = Damping(law.viscous)
        if not law.cubic:
            linear = (Linear(law.linear),)
            axes = tuple(AxisSpring(factor.axis, linear, damping) for factor in joint.chain)
        elif len(joint.chain) == 1:
            curve = Cubic((0.0, law.linear, 0.0, law.cubic), -1)
            axes = (AxisSpring(joint.chain[0].axis, (curve,), damping),)
        else:
            curve = Cubic((0.0, law.linear / 2.0, 0.0, law.cubic * 5.0 / 6.0), -1)
            axes = tuple(
                AxisSpring(tuple(map(float, axis)), (curve,), Damping(law.viscous / 2.0))
                for axis in _ICOSAHEDRON
            )
        joints[name] = JointSprings(name, axes)
    return SpringSet(joints)


def fall(figure: Figure, plan: Plan) -> tuple[Fall, Recording]:
    """The motion as the program gives it; times are those of the integration alone."""
    clock, agree = Clock(), compiled_run.run_until_agreed

    def clocked(*given: Any, **named: Any) -> AgreedRun:
        with clock:
            return agree(*given, **named)

    with patch.object(compiled_run, "run_until_agreed", clocked):
        recording = simulate(figure, plan)
    made = _fall(recording)
    return (replace(made, cpu=clock.cpu) if clock.cpu else made), recording


def whole_call(figure: Figure, plan: Plan) -> Fall:
    """The same motion; times are those of the call of `simulate`."""
    with Clock() as clock:
        recording = simulate(figure, plan)
    return replace(_fall(recording), wall=clock.wall, cpu=clock.cpu)


def one_run(figure: Figure, plan: Plan) -> Fall:
    """The start and the end by a single compiled run at the plan's tolerance, without an estimate.

    Its tolerance is that of the steps, not of the joint angles.
    """
    clock = Clock()

    def once(model: Any, times: Array, tolerance: float, *_: object, **__: object) -> AgreedRun:
        with clock:
            run = run_once(model, times, tolerance)
        return AgreedRun(run, np.zeros(len(run.times)), run.steps, 1)

    with patch.object(compiled_run, "run_until_agreed", once):
        made = _fall(simulate(figure, replace(plan, frame=plan.stop - plan.start)))
    return replace(made, wall=clock.wall, cpu=clock.cpu)


def _fall(recording: Recording) -> Fall:
    if not recording.outcome.succeeded:
        raise RuntimeError(recording.outcome.message)
    energy = np.sum([recording.energy[kind] for kind in ("kinetic", "gravity", "spring")], axis=0)
    turns = {name: matrix_from_rotation_vector(r) for name, r in recording.rotation_vectors.items()}
    return Fall(
        turns, recording.centre_of_mass, energy, recording.wall_time, recording.accuracy.steps
    )


def land(figure: Figure, plan: Plan) -> Landing:
    """The motion of a figure onto the floor of its plan's scene, at the frames of the plan."""
    recording = simulate(figure, plan)
    if not recording.outcome.succeeded or recording.contact is None:
        raise RuntimeError(recording.outcome.message)
    forces = {name: force[:, 1] for name, force in recording.contact.forces.items()}
    last = _fall(recording).rotations
    rotations = {name: turns[-1] for name, turns in last.items() if name in figure.joints}
    return Landing(recording.times, recording.centre_of_mass, forces, rotations)


def exudyn_plan_of(
    displacements: Mapping[str, Sequence[float]], springs: SpringSet | None = None, **given: float
) -> Plan:
    """As `plan_of`, for Exudyn's integrator."""
    return replace(plan_of(displacements, springs, **given), integrator=Integrator.EXUDYN)


def plan_of(
    displacements: Mapping[str, Sequence[float]], springs: SpringSet | None = None, **given: float
) -> Plan:
    """A run of one second that starts at displacements [rad]; `given` are fields of the plan."""
    return Plan(displacements=displacements, springs=springs, **given)


def build_time(figure: Figure, plan: Plan) -> Clock:
    """Time to build the model, with its compiled equations where they integrate it."""
    with Clock() as clock:
        model = build_model(figure, plan)
        if plan.integrator is Integrator.COMPILED:
            compiled_run.compile_model(model)
    return clock
