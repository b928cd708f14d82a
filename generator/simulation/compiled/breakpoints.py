"""Location of breakpoints within a step.

A *switching function* is positive on one side of a breakpoint and negative on the other. Its sign,
held in `Mechanism.branches`, is wrong after the breakpoint has been passed. Its *margin*, with that
sign, is the distance from being passed: a zero counts as passed when the function is `SLACK` beyond
it. After a reversal of the sign it is thus clearly on its new side, and a start on a breakpoint
needs no special treatment.
"""

import numpy as np

from generator.simulation.compiled.compiler import COUNT, FLAG, REAL, compiled
from generator.simulation.compiled.equations import EQUATIONS, Equations
from generator.simulation.compiled.layout import MECHANISM, SCRATCH, Mechanism, Scratch
from generator.simulation.compiled.runge_kutta import (
    INTERVAL,
    PROGRESS,
    SWITCH,
    TIME,
    Progress,
    interpolate,
)
from generator.simulation.compiled.tableau import METHOD, Method

SLACK = 1e-10
"""Distance beyond a breakpoint at which it counts as passed [rad, m or 1]."""

NO_BREAKPOINT = 2.0
"""Share of a step, beyond its end, that is returned where no breakpoint is passed."""

_PARABOLA_ERROR = 0.05
"""Error of a parabola through three stages, as a share of its range between them."""

_GRAZE_WIDTH = 0.15
"""Share of a step, on each side of a suspected least margin, that is searched for it."""

_PARABOLA_MARGIN = 0.1
"""Distance outside three stages at which a least margin counts, as a share of their interval."""

_GRAZE_SWEEPS, _GRAZE_SECTIONS = 6, 8
"""Number of searches for the least margin, each around that of the one before, and of their
sections."""

_MAX_ITERATIONS = 60
"""Number of iterations of the Illinois method."""

_MIN_INTERVAL = 1e-15
"""Share of a step between two bounds of a zero below which it counts as located."""


@compiled(FLAG, MECHANISM, SCRATCH, PROGRESS, COUNT)
def store_margins(mechanism: Mechanism, scratch: Scratch, progress: Progress, stage: int) -> bool:
    """Store the margins at a stage; return whether a switching function has been passed."""
    passed = False
    for k in range(len(mechanism.branches)):
        margin = mechanism.branches[k] * scratch.switching[k] + SLACK
        progress.margins[stage, k] = margin
        passed = passed or margin < 0.0
    return passed


@compiled(COUNT, METHOD, PROGRESS)
def possible_crossings(method: Method, progress: Progress) -> int:
    """List the switching functions that may be passed and passed back between stages.

    A parabola through three stages, whose minimum lies between them, is compared with zero, and
    with the error that it may have. Returns the number of suspects; they are left in
    `progress.passed`, and the shares of the step at their least margins in `progress.shares`.
    """
    margins, count = progress.margins, 0
    for k in range(margins.shape[1]):
        smallest = np.inf
        for n in range(len(method.spread) - 2):
            i, j, m = method.spread[n], method.spread[n + 1], method.spread[n + 2]
            before, middle, after = method.nodes[i], method.nodes[j], method.nodes[m]
            slope = (margins[j, k] - margins[i, k]) / (middle - before)
            bend = ((margins[m, k] - margins[j, k]) / (after - middle) - slope) / (after - before)
            if bend <= 0.0:
                continue
            lowest = 0.5 * (before + middle - slope / bend)
            width = _PARABOLA_MARGIN * (after - before)
            if not before - width < lowest < after + width:
                continue
            lowest = min(max(lowest, before), after)
            least = margins[i, k] + (lowest - before) * (slope + bend * (lowest - middle))
            highest = max(margins[i, k], margins[m, k])
            if least < min(smallest, _PARABOLA_ERROR * (highest - least)):
                smallest = least
                progress.shares[count] = lowest
        if smallest < np.inf:
            progress.passed[count] = k
            count += 1
    return count


@compiled(REAL, EQUATIONS, MECHANISM, SCRATCH, PROGRESS, COUNT, REAL, REAL, COUNT)
def _margin(
    equations: Equations,
    mechanism: Mechanism,
    scratch: Scratch,
    progress: Progress,
    balls: int,
    step: float,
    share: float,
    switch: int,
) -> float:
    """Return the distance of a switching function from being passed, at a share of the step."""
    interpolate(equations, mechanism, scratch, progress, balls, step, share, progress.trial)
    at = progress.clock[TIME] + share * step
    equations.evaluate_laws(
        equations.laws, mechanism, scratch, progress.counts[INTERVAL], at, progress.trial
    )
    return mechanism.branches[switch] * scratch.switching[switch] + SLACK


@compiled(REAL, EQUATIONS, MECHANISM, SCRATCH, PROGRESS, COUNT, REAL, REAL, REAL, COUNT)
def _locate_zero(
    equations: Equations,
    mechanism: Mechanism,
    scratch: Scratch,
    progress: Progress,
    balls: int,
    step: float,
    before: float,
    after: float,
    switch: int,
) -> float:
    """Return the share of the step at which a margin is zero, by the Illinois method."""
    low = _margin(equations, mechanism, scratch, progress, balls, step, before, switch)
    if low <= 0.0:
        # The first stages are of low order and may show a passage too late.
        before, after = 0.0, before
        low = _margin(equations, mechanism, scratch, progress, balls, step, before, switch)
        if low <= 0.0:
            return before
    high = _margin(equations, mechanism, scratch, progress, balls, step, after, switch)
    share, side = after, 0
    for _ in range(_MAX_ITERATIONS):
        share = after - high * (after - before) / (high - low)
        if not before < share < after:
            share = 0.5 * (before + after)
        middle = _margin(equations, mechanism, scratch, progress, balls, step, share, switch)
        if abs(middle) < 0.25 * SLACK or after - before < _MIN_INTERVAL:
            break
        if middle < 0.0:
            after, high = share, middle
            if side < 0:
                low *= 0.5
            side = -1
        else:
            before, low = share, middle
            if side > 0:
                high *= 0.5
            side = 1
    return share


@compiled(REAL, EQUATIONS, MECHANISM, SCRATCH, PROGRESS, COUNT, REAL, COUNT, REAL)
def locate_graze(
    equations: Equations,
    mechanism: Mechanism,
    scratch: Scratch,
    progress: Progress,
    balls: int,
    step: float,
    switch: int,
    suspected: float,
) -> float:
    """Return the share of the step at which a suspected switching function is passed.

    Its least margin on the continuous solution is searched for around the suspected share, in ever
    finer sections. Where that is negative, the zero before it is located; else it is
    `NO_BREAKPOINT`.
    """
    low, high = max(0.0, suspected - _GRAZE_WIDTH), min(1.0, suspected + _GRAZE_WIDTH)
    for _ in range(_GRAZE_SWEEPS):
        section, least, at = (high - low) / _GRAZE_SECTIONS, np.inf, low
        for n in range(_GRAZE_SECTIONS + 1):
            share = low + n * section
            margin = _margin(equations, mechanism, scratch, progress, balls, step, share, switch)
            if margin < 0.0:
                return _locate_zero(
                    equations, mechanism, scratch, progress, balls, step, 0.0, share, switch
                )
            if margin < least:
                least, at = margin, share
        low, high = max(0.0, at - section), min(1.0, at + section)
    return NO_BREAKPOINT


@compiled(REAL, METHOD, EQUATIONS, MECHANISM, SCRATCH, PROGRESS, COUNT, REAL, REAL)
def locate_breakpoint(
    method: Method,
    equations: Equations,
    mechanism: Mechanism,
    scratch: Scratch,
    progress: Progress,
    balls: int,
    step: float,
    earliest: float,
) -> float:
    """Return the share of the step at the first breakpoint.

    It is searched for from the earliest share at which a stage has passed one, and is
    `NO_BREAKPOINT` if none is found. The switching function is left in `progress.counts[SWITCH]`.
    """
    before = 0.0
    for m in range(len(method.grid)):
        after = method.grid[m]
        if after < earliest:
            before = after
            continue
        _margin(equations, mechanism, scratch, progress, balls, step, after, 0)
        count = 0
        for k in range(len(mechanism.branches)):
            if mechanism.branches[k] * scratch.switching[k] < -SLACK:
                progress.passed[count] = k
                count += 1
        if count > 0:
            # Locate the zero of one function, then of each other one that is passed before it.
            first = after
            for n in range(count):
                k = progress.passed[n]
                if (
                    n > 0
                    and _margin(equations, mechanism, scratch, progress, balls, step, first, k)
                    > 0.0
                ):
                    continue
                first = _locate_zero(
                    equations, mechanism, scratch, progress, balls, step, before, first, k
                )
                progress.counts[SWITCH] = k
            return first
        before = after
    return NO_BREAKPOINT
