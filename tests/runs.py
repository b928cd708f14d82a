"""Shared parts of tests of runs: springs of one joint, energy error, one degree of freedom."""

import numpy as np
from scipy.integrate import solve_ivp

from springs import JointSprings, SpringSet


def springs_of(joint, *axes, slides=(), **fields) -> SpringSet:
    """The springs of one joint, about axes and along slides."""
    return SpringSet({joint: JointSprings(joint, axes, tuple(slides))}, **fields)


def energy_error(run) -> float:
    """Largest change of the energy balance since the start [J]."""
    return float(np.max(np.abs(run.energy_balance - run.energy_balance[0])))


def integrate_angle(acceleration, start, rate, times):
    """Angle and rate at some times, of an angle with an acceleration (angle, rate), to 1e-12."""
    found = solve_ivp(
        lambda _, y: [y[1], acceleration(y[0], y[1])],
        (times[0], times[-1]),
        [start, rate],
        "DOP853",
        t_eval=times,
        rtol=1e-12,
        atol=1e-12,
    )
    assert found.success
    return found.y
