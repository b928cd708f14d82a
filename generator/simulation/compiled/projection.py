"""States on the constraints beyond the tree and on the branches of the laws; their evaluation.

Integrated accelerations satisfy the second derivatives of the constraints g = 0 only, so positions
and rates drift. The changes M^-1 G^T m, with (G M^-1 G^T) m = -g or -g', remove the drift with the
least change in the norm of the kinetic energy.
"""

from generator.rotations import Array
from generator.simulation.compiled.algebra import (
    plus,
    quaternion_in,
    quaternion_rate,
    store_in,
    times,
    unit,
    vector,
    vector_in,
)
from generator.simulation.compiled.closure import solve_rows
from generator.simulation.compiled.compiler import (
    COUNT,
    FLAG,
    MATRIX,
    NOTHING,
    REAL,
    STACK,
    VECTOR,
    compiled,
)
from generator.simulation.compiled.layout import (
    BALL,
    COORDINATE,
    KIND,
    MECHANISM,
    RATE,
    RECORDED_COLUMNS,
    RESPONSE_JOINT,
    RESPONSE_SPIN_RATE,
    ROW_RATE,
    ROW_VALUE,
    SCRATCH,
    Mechanism,
    Scratch,
)
from generator.simulation.compiled.recursion import EQUATIONS, Equations
from generator.simulation.compiled.row_motion import row_wrench

MAX_GAP = 1e-12
"""Largest constrained displacement after a projection [m, rad or 1]."""

_MAX_STEPS = 8
"""Number of Newton steps after which a projection has failed."""


@compiled(FLAG, SCRATCH, REAL)
def _are_rows_closed(scratch: Scratch, tolerance: float) -> bool:
    """Return whether all constrained displacements are below a tolerance [m, rad or 1]."""
    for r in range(len(scratch.residual)):
        if not abs(scratch.row_work[r, ROW_VALUE]) <= tolerance:
            return False
    return True


@compiled(NOTHING, MECHANISM, SCRATCH, VECTOR)
def _correct_positions(mechanism: Mechanism, scratch: Scratch, state: Array) -> None:
    """Change the coordinates of the state last evaluated by a Newton step onto its constraints."""
    links, responses = mechanism.links, scratch.responses
    for r in range(len(scratch.residual)):
        scratch.residual[r] = -scratch.row_work[r, ROW_VALUE]
    solve_rows(scratch)
    for i in range(len(links)):
        coordinate, turn, shift = links[i, COORDINATE], (0.0, 0.0, 0.0), 0.0
        for r in range(len(scratch.residual)):
            size = scratch.residual[r]
            turn = plus(turn, times(size, vector(responses[r], i, RESPONSE_SPIN_RATE)))
            shift += size * responses[r, i, RESPONSE_JOINT]
        if links[i, KIND] == BALL:
            old = unit(quaternion_in(state, coordinate))
            w, x, y, z = quaternion_rate(old, turn)
            turned = unit((old[0] + w, old[1] + x, old[2] + y, old[3] + z))
            store_in(state, coordinate, turned)
        elif coordinate >= 0:
            state[coordinate] += shift


@compiled(NOTHING, MECHANISM, SCRATCH, VECTOR)
def _correct_rates(mechanism: Mechanism, scratch: Scratch, state: Array) -> None:
    """Change the rates of the state last evaluated so that its constraints stay satisfied."""
    links, responses = mechanism.links, scratch.responses
    for r in range(len(scratch.residual)):
        scratch.residual[r] = -scratch.row_work[r, ROW_RATE]
    solve_rows(scratch)
    for i in range(len(links)):
        rate = links[i, RATE]
        for r in range(len(scratch.residual)):
            size = scratch.residual[r]
            if links[i, KIND] == BALL:
                turn = times(size, vector(responses[r], i, RESPONSE_SPIN_RATE))
                store_in(state, rate, plus(vector_in(state, rate), turn))
            elif rate >= 0:
                state[rate] += size * responses[r, i, RESPONSE_JOINT]


@compiled(FLAG, EQUATIONS, MECHANISM, SCRATCH, COUNT, REAL, VECTOR, VECTOR, entry=True)
def project_state(
    equations: Equations,
    mechanism: Mechanism,
    scratch: Scratch,
    interval: int,
    time: float,
    state: Array,
    rates: Array,
) -> bool:
    """Project a state onto the constraints beyond the tree; return whether that succeeded.

    `rates` is working memory.
    """
    for _ in range(_MAX_STEPS):
        equations.compute_rates(equations.law, mechanism, scratch, interval, time, state, rates)
        if _are_rows_closed(scratch, MAX_GAP):
            _correct_rates(mechanism, scratch, state)
            return True
        _correct_positions(mechanism, scratch, state)
    return False


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
    """Compute the rates of a state with the branches that it lies on.

    A branch may decide on which side another switching function is, so this is repeated. Functions
    nearer to zero than `slack`, and the one with the index `fixed`, keep their sign.
    """
    for _ in range(8):
        equations.compute_rates(equations.law, mechanism, scratch, interval, time, state, rates)
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
        equations: of motion.
        mechanism: tables.
        scratch: working memory.
        times: shape (f,) [s].
        states: shape (f, n).
        links: result: the recorded columns of every link, shape (f, links, RECORDED_COLUMNS).
        rates: result: the rates of the states, shape (f, n).
        wrenches: result: of each constraint row beyond the tree, shape (f, rows, 6); see
            `row_wrench`.
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
            store_in(wrenches[f, r], 0, row_wrench(mechanism, scratch, r))
