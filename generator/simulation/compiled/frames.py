"""Selection of the branches of the laws in a state, and evaluation of recorded states."""

from generator.rotations import Array
from generator.simulation.compiled.compiler import (
    COUNT,
    MATRIX,
    NOTHING,
    REAL,
    STACK,
    VECTOR,
    compiled,
)
from generator.simulation.compiled.equations import EQUATIONS, Equations
from generator.simulation.compiled.layout import (
    MECHANISM,
    RECORDED_COLUMNS,
    ROW_WRENCH,
    SCRATCH,
    Mechanism,
    Scratch,
)

_MAX_SELECTIONS = 8
"""Number of evaluations after which the signs of the branches are left."""


@compiled(
    NOTHING, EQUATIONS, MECHANISM, SCRATCH, COUNT, REAL, VECTOR, VECTOR, COUNT, REAL, entry=True
)
def settle_branches(
    equations: Equations,
    mechanism: Mechanism,
    scratch: Scratch,
    interval: int,
    time: float,
    state: Array,
    rates: Array,
    fixed: int,
    slack: float,
) -> None:
    """Compute the rates of a state, and set the signs of its branches.

    Switching functions may depend on the branches of others, so this is repeated. Functions nearer
    to zero than `slack`, and the one with the index `fixed`, keep their sign.
    """
    for _ in range(_MAX_SELECTIONS):
        equations.compute_rates(equations.laws, mechanism, scratch, interval, time, state, rates)
        changed = False
        for k in range(len(mechanism.branches)):
            if k != fixed and mechanism.branches[k] * scratch.switching[k] < -slack:
                mechanism.branches[k] = -mechanism.branches[k]
                changed = True
        if not changed:
            return


@compiled(
    NOTHING,
    EQUATIONS,
    MECHANISM,
    SCRATCH,
    VECTOR,
    MATRIX,
    STACK,
    MATRIX,
    STACK,
    entry=True,
)
def record_frames(
    equations: Equations,
    mechanism: Mechanism,
    scratch: Scratch,
    times: Array,
    states: Array,
    links: Array,
    rates: Array,
    wrenches: Array,
) -> None:
    """Evaluate the states of frames.

    Args:
        equations: equations of motion.
        mechanism: tables.
        scratch: working memory.
        times: shape (f,) [s].
        states: shape (f, n).
        links: result: the recorded columns of every link, shape (f, links, RECORDED_COLUMNS).
        rates: result: the rates of the states, shape (f, n).
        wrenches: result: of each constraint row beyond the tree, shape (f, rows, 6); see
            `ROW_WRENCH`.
    """
    interval = 0
    for f in range(len(times)):
        while interval + 1 < len(mechanism.knots) and mechanism.knots[interval + 1] <= times[f]:
            interval += 1
        settle_branches(
            equations, mechanism, scratch, interval, float(times[f]), states[f], rates[f], -1, 0.0
        )
        for i in range(len(mechanism.links)):
            for k in range(RECORDED_COLUMNS):
                links[f, i, k] = scratch.work[i, k]
        for r in range(len(mechanism.rows)):
            for k in range(6):
                wrenches[f, r, k] = scratch.row_work[r, ROW_WRENCH + k]
