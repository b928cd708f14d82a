"""Motion of the bodies of a model at the frames of a run, how the run ended, and its error."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields, replace
from math import ceil
from typing import Any, cast

import numpy as np

from generator.contact.states import ContactTrace
from generator.figure import Figure
from generator.recording import Accuracy, Ending, Outcome
from generator.rotations import Array


@dataclass(frozen=True)
class Trace:
    """States at n frames of B bodies, in world axes.

    Attributes:
        times: shape (n,) [s].
        positions: positions of the centres of mass, shape (n, B, 3) [m].
        rotations: rotations of the segment axes, shape (n, B, 3, 3).
        velocities: velocities of the centres of mass, shape (n, B, 3) [m/s].
        angular_velocities: angular velocities, shape (n, B, 3) [rad/s].
        multipliers: Exudyn's multipliers of each joint's constraint items, shape (n, items, 6).
        dissipated: energy dissipated since the start, shape (n,) [J].
        spring_work: work against springs without an energy since the start, shape (n,) [J].
        load_work: work done by loads and drives since the start, shape (n,) [J].
        coordinate_multipliers: multipliers of links and drives, which are minus their torques,
            shape (n, rows) [N m].
        accelerations: angular, and of the centres of mass, shape (n, B, 6) [rad/s2, m/s2]; known
            after compiled integration, in place of the multipliers.
        displacements: displacements of the joints that are known without their poses, shape (n,
            dof) each.
        closing_wrenches: force of the constraints of each joint that closes a loop on its child and
            moment about the world's origin, shape (n, 6) [N, N m]; after compiled integration.
        contact: integrals of contact, and its forces after every step; None without props.
        tone_work: work done by the tone of muscles since the start, shape (n,) [J]; None without.
    """

    times: Array
    positions: Array
    rotations: Array
    velocities: Array
    angular_velocities: Array
    multipliers: Mapping[str, Array]
    dissipated: Array
    spring_work: Array
    load_work: Array
    coordinate_multipliers: Array = field(default_factory=lambda: np.zeros((0, 0)))
    accelerations: Array | None = None
    displacements: Mapping[str, Array] = field(default_factory=dict[str, Array])
    closing_wrenches: Mapping[str, Array] = field(default_factory=dict[str, Array])
    contact: ContactTrace | None = None
    tone_work: Array | None = None

    def __len__(self) -> int:
        """Number of frames."""
        return self.times.size

    def first_frames(self, count: int) -> "Trace":
        """Return the first `count` frames."""
        contact = self.contact
        if contact is not None:
            contact = contact.first_frames(count, float(self.times[:count][-1]))

        def first(values: Array) -> Array:
            return values[:count]

        return replace(map_arrays(first, self), contact=contact)

    def with_motion(
        self, positions: Array, rotations: Array, velocities: Array, angular_velocities: Array
    ) -> "Trace":
        """Return a copy with another motion; shapes and axes as those of the attributes."""
        return replace(
            self,
            positions=positions,
            rotations=rotations,
            velocities=velocities,
            angular_velocities=angular_velocities,
        )


def map_arrays(function: Callable[..., Array], *traces: Trace) -> Trace:
    """Return the trace whose arrays are those of a function of the arrays of traces.

    Contact is that of the last trace.
    """
    mapped: dict[str, Any] = {}
    for name in (each.name for each in fields(Trace) if each.name != "contact"):
        values = [getattr(trace, name) for trace in traces]
        if isinstance(values[0], Mapping):
            by_name = cast("list[Mapping[str, Array]]", values)
            mapped[name] = {key: function(*(each[key] for each in by_name)) for key in by_name[0]}
        else:
            mapped[name] = None if values[0] is None else function(*values)
    return Trace(**mapped, contact=traces[-1].contact)


@dataclass(frozen=True)
class RefinedRun:
    """The best motion that the passes of a run give, with what is known of its error."""

    trace: Trace
    outcome: Outcome
    accuracy: Accuracy
    wall_time: float


def frame_times(start: float, stop: float, frame: float) -> Array:
    """Times of the frames [s]: every `frame` from `start`, and `stop` itself."""
    count = max(1, ceil((stop - start) / frame - 1e-9))
    return np.append(start + frame * np.arange(count), stop)


def mean_position(figure: Figure, positions: Array) -> Array:
    """Centre of mass of all bodies (eq. 5.1), shape (n, 3) [m].

    Args:
        figure: Figure with B bodies.
        positions: Centres of mass of the bodies, shape (n, B, 3) [m].
    """
    masses = np.array([body.mass for body in figure.bodies.values()], dtype=float)
    return np.asarray(np.einsum("b,nbk->nk", masses, positions) / np.sum(masses))


def estimated_accuracy(
    times: Array, errors: Array, tolerance: float, step: float, steps: int
) -> Accuracy:
    """Return the accuracy of a run with the estimated error up to each frame [rad]."""
    if len(errors) == 1:  # the first frame is that of the start in all passes
        errors = np.full(1, np.inf)
    accurate_times = times[errors <= tolerance]
    held_until = float(accurate_times[-1]) if accurate_times.size else float(times[0])
    return Accuracy(float(errors[-1]), tolerance, held_until, step, steps, errors)


def finished_outcome(
    accuracy: Accuracy, last: float, remedy: str = "", *, is_whole: bool = True
) -> Outcome:
    """Return the outcome of a run that reached its stop time, by the estimate of its error.

    Args:
        accuracy: Accuracy with a tolerance and an estimate, infinite if it is unknown.
        last: Stop time [s].
        remedy: Advice for an error above the tolerance, as a clause.
        is_whole: Whether the tolerance is asked for until the stop time, which that of a fall,
            whose later poses are chaotic, is not.
    """
    asked, estimate = accuracy.tolerance, accuracy.estimate
    assert asked is not None
    assert estimate is not None
    if estimate <= asked:
        message = (
            f"Finished {last:.4g} s. Estimated joint-angle error {estimate:.1e} rad "
            f"(tolerance {asked:.1e})."
        )
        return Outcome(Ending.DONE, message, last)
    if np.isfinite(estimate) and not is_whole:
        message = (
            f"Finished {last:.4g} s. Joint angles within {asked:.4g} rad until "
            f"{accuracy.tolerance_met_until:.4g} s."
        )
        return Outcome(Ending.DONE, message, last)
    if np.isfinite(estimate):
        message = (
            f"the tolerance {asked:.1e} rad is met only until "
            f"{accuracy.tolerance_met_until:.4g} s of {last:.4g} s, "
            f"where the joint-angle error is about {estimate:.1e} rad"
        )
    else:
        message = f"too few passes of {last:.4g} s ended to estimate the joint-angle error"
    return Outcome(Ending.INACCURATE, message + (remedy and f": {remedy}"), last)


def solver_failure_outcome(figure: Figure, spins: Array, last_time: float) -> Outcome:
    """Return the outcome of a run whose step became too short, or whose iterations diverged.

    Args:
        figure: Figure with B moving segments.
        spins: Angular velocities of the segments, shape (B, 3) [rad/s].
        last_time: Last time that was reached [s].
    """
    by_segment = dict.fromkeys(figure.ground, np.zeros(3))
    by_segment.update(zip(figure.bodies, spins, strict=True))
    speeds = {
        name: float(np.linalg.norm(np.subtract(*(by_segment[ref.segment] for ref in joint.ends))))
        for name, joint in figure.joints.items()
    }
    fastest = max(speeds, key=lambda name: speeds[name])
    message = f"the solver failed after {last_time:.4g} s; the fastest joint was {fastest}"
    return Outcome(Ending.SOLVER_FAILED, message, last_time, fastest)


def pole_message(joint: str, when: str) -> str:
    """Return the sentence that a joint came to its pole, `at 0.2 s` or the like."""
    return (
        f"joint {joint} reached its pole {when}: where the middle one of its rotations is "
        '90 deg, `law = "coordinates"` has no torque'
    )


def pole_outcome(joint: str, time: float) -> Outcome:
    """Return the outcome of a run that ends at the pole of a joint, at a time [s]."""
    return Outcome(Ending.POLE, pole_message(joint, f"at {time:.4g} s"), time, joint)


def half_turn_outcome(joint: str, time: float) -> Outcome:
    """Return the outcome of a run that ends at 180 deg of a joint, at a time [s]."""
    message = (
        f"joint {joint} rotated through 180 deg at {time:.4g} s, where "
        "the torque of its springs is not defined"
    )
    return Outcome(Ending.TURNED_OVER, message, time, joint)
