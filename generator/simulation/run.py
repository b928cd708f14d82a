"""A figure and a plan become a recording."""

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from generator.figure import Figure
from generator.recording import Accuracy, Ending, Outcome, Recording
from generator.rotations import Array
from generator.simulation.error_control import CUT_SHORT, Refined, first_step, refine
from generator.simulation.integrate import Pass, frame_times, march
from generator.simulation.joint_motion import (
    JointMotion,
    Motion,
    drive_torques,
    energy_book,
    servo_torques,
)
from generator.simulation.model import Assembly, build
from generator.simulation.plan import Plan, springs_of
from generator.simulation.projection import put_right, strays, told_of_dead_points, told_of_poles
from generator.simulation.states import Trace
from generator.simulation.step_schedule import Guide
from springs import SpringSet

PARTED = 0.01
"""A run in which a joint's sites part by more than this has blown up [m]."""

STRAYED = 0.01
"""So has one in which a locked, linked or driven joint is off by more than this [rad or m]; it may
have come to where the rates of its displacements are not defined."""


@dataclass(frozen=True)
class Progress:
    """How far a run is.

    Attributes:
        pass_number: from 1; later passes have smaller steps.
        step: of the pass [s].
        time: simulated time that the pass has reached [s].
    """

    pass_number: int
    step: float
    time: float


def simulate(
    figure: Figure, plan: Plan | None = None, watch: Callable[[Progress], None] | None = None
) -> Recording:
    """Let a figure move under gravity, loads and its passive joints.

    Args:
        figure: what moves; its springs are those of the plan, else those of its file.
        plan: everything else; None for one second at the default tolerance.
        watch: told the progress after every frame.

    Returns:
        The motion. A run that fails is an outcome in it, with the frames up to the last good time.

    Raises:
        MoverError: the figure or the plan cannot be built: the message says why.
    """
    plan = plan or Plan()
    springs = springs_of(figure, plan)
    times = frame_times(plan.start, plan.stop, plan.frame)
    deadline = time.monotonic() + plan.wall_limit
    runner = _Runner(figure, plan, springs, times, deadline, watch)
    if plan.step is None:
        refined = refine(
            runner.first.figure, plan.tolerance, runner.run, runner.longest_step, deadline
        )
    else:
        refined = _fixed(runner.run())
    return _record(runner, refined)


class _Runner:
    """Makes passes of one run, each on an assembly of its own."""

    def __init__(
        self,
        figure: Figure,
        plan: Plan,
        springs: SpringSet,
        times: Array,
        deadline: float,
        watch: Callable[[Progress], None] | None,
    ) -> None:
        self._figure, self._plan, self._springs = figure, plan, springs
        self._times, self._deadline, self._watch = times, deadline, watch
        self._passes = 0
        begun = time.monotonic()
        self.first: Assembly = build(figure, plan, springs)
        self.build_time = time.monotonic() - begun

    @property
    def _newton(self) -> float:
        """Relative tolerance of Newton's method in the next pass.

        Well below what the extrapolation must see, and smaller with each pass: what Newton's method
        leaves undone then shows in the difference of passes like any other error.
        """
        if self._plan.step is not None:
            return 1e-9
        first = min(1e-2 * self._plan.tolerance, 1e-5)
        return max(first * max(0.1**self._passes, 1e-3), 1e-11)

    @property
    def longest_step(self) -> float:
        """The step that the plan gives, else that of the first pass [s]."""
        frame = float(self._times[1] - self._times[0])
        return self._plan.step or first_step(frame, self._plan.tolerance)

    def run(self, parts: int = 1, guide: Guide | None = None) -> Pass:
        """One pass with the longest step cut into parts, guided by an earlier one."""
        assembly, newton = self.first, self._newton
        if self._passes:
            begun = time.monotonic()
            assembly = build(self._figure, self._plan, self._springs)
            self.build_time += time.monotonic() - begun
        self._passes += 1
        number, watch = self._passes, self._watch

        def told(now: float) -> None:
            if watch is not None:
                watch(Progress(number, self.longest_step / parts, now))

        return march(
            assembly,
            self._times,
            self.longest_step,
            newton,
            self._deadline,
            told,
            guide,
            parts,
        )


def _fixed(one: Pass) -> Refined:
    """The result of a run whose step was given."""
    last = float(one.trace.times[-1])
    message = one.outcome.message or f"done at {last:.4g} s with a fixed step of {one.step:.3g} s"
    accuracy = Accuracy(None, None, last, one.step, one.steps, np.full(len(one.trace), np.nan))
    return Refined(one.trace, replace(one.outcome, message=message), accuracy, one.wall_time)


def _record(runner: _Runner, refined: Refined) -> Recording:
    """The motion in the figure's terms."""
    assembly, trace = runner.first, refined.trace
    figure = assembly.figure
    motion = Motion(assembly, trace)
    starts = assembly.placement.displacements
    joints = {name: motion.joint(joint, starts[name]) for name, joint in figure.joints.items()}
    drifts, strayed = _drifts(assembly, joints), {}
    if assembly.prescribed:
        strayed = strays(assembly, trace, joints)
    torn = _torn(refined, drifts, strayed) if len(trace) > 1 else None
    if torn is not None:
        return _record(runner, torn)
    if assembly.prescribed:
        trace = put_right(assembly, trace, joints)
        motion = Motion(assembly, trace)
        joints = {name: motion.joint(joint, starts[name]) for name, joint in figure.joints.items()}
    pulled = servo_torques(assembly, trace, joints)
    reactions = {name: motion.reaction(one, joints[name]) for name, one in figure.joints.items()}
    for name, torque in pulled.items():
        reactions[name][:, 3:] += torque
    return Recording(
        times=trace.times,
        poses=motion.poses,
        chains={name: joint.chain for name, joint in figure.joints.items()},
        displacements={name: moved.displacements for name, moved in joints.items()},
        velocities={name: moved.rates for name, moved in joints.items()},
        rotation_vectors={name: moved.rotation_vectors for name, moved in joints.items()},
        reactions=reactions,
        passive_torques=motion.passive_torques(joints),
        centre_of_mass=_centre_of_mass(figure, trace),
        energy=energy_book(assembly, trace, joints),
        outcome=told_of_poles(
            assembly, told_of_dead_points(assembly, refined.outcome, joints), joints
        ),
        accuracy=refined.accuracy,
        constraint_drift=_largest(drifts),
        strayed=_largest(strayed),
        drive_torques=drive_torques(assembly, pulled, joints),
        wall_time=refined.wall_time,
        build_time=runner.build_time,
        springs=assembly.spring_set.origin,
        law=(assembly.plan.joining or assembly.spring_set.joining).value,
    )


def _centre_of_mass(figure: Figure, trace: Trace) -> Array:
    """Of all that moves (eq. 5.1), shape (n, 3) [m]."""
    masses = np.array([body.mass for body in figure.bodies.values()], dtype=float)
    return np.asarray(np.einsum("b,nbk->nk", masses, trace.positions) / np.sum(masses))


def _drifts(assembly: Assembly, joints: Mapping[str, JointMotion]) -> dict[str, Array]:
    """Distance by which each joint's sites have parted that it should hold, shape (n,) [m]."""
    drifts: dict[str, Array] = {}
    for name, moved in joints.items():
        chain = assembly.placement.tree.chains[name]
        if not chain.slides:
            drifts[name] = np.linalg.norm(moved.between[:, :3, 3], axis=1)
        elif len(chain.slides) < 3:
            gaps = [np.linalg.norm(chain.gap(pose)[3:]) for pose in moved.between]
            drifts[name] = np.array(gaps, dtype=float)
    return drifts


def _largest(by_joint: Mapping[str, Array]) -> float:
    return max((float(np.max(drift)) for drift in by_joint.values()), default=0.0)


def _torn(
    refined: Refined, drifts: Mapping[str, Array], strayed: Mapping[str, Array]
) -> Refined | None:
    """The run up to where a joint came apart or strayed, as a failure; None where all held."""
    first = {
        (joint, what): int(np.argmax(~(drift <= bound)))
        for what, bound, by_joint in (
            ("came apart", PARTED, drifts),
            ("left where it is held", STRAYED, strayed),
        )
        for joint, drift in by_joint.items()
        if not np.all(drift <= bound)
    }
    if not first:
        return None
    joint, what = min(first, key=lambda one: first[one])
    count = max(1, first[joint, what])
    last = float(refined.trace.times[count - 1])
    message = f"joint {joint} {what} after {last:.4g} s: the step is too long for what acts there"
    outcome = Outcome(Ending.SOLVER_FAILED, message, last, joint)
    by_frame, estimate = refined.accuracy.by_frame[:count], refined.accuracy.estimate
    if refined.outcome.ending in CUT_SHORT and estimate == np.inf:
        # The passes that there was time for were coarse: finer ones would have held.
        outcome = replace(refined.outcome, last_time=last)
    accuracy = replace(
        refined.accuracy,
        estimate=None if estimate is None else float(by_frame[-1]),
        by_frame=by_frame,
        held_until=min(last, refined.accuracy.held_until),
    )
    return replace(
        refined,
        trace=refined.trace.first(count),
        outcome=outcome,
        accuracy=accuracy,
    )
