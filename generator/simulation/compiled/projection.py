"""Rates of states with constraints beyond the tree, and projection onto these constraints.

Integrated accelerations satisfy the second derivatives of the constraints g = 0 only, so positions
and rates drift. The changes M^-1 G^T m, with (G M^-1 G^T) m = -g or -g', remove the drift with the
least change in the norm of the kinetic energy.
"""

from generator.rotations import Array
from generator.simulation.compiled.algebra import (
    plus,
    quaternion_in,
    quaternion_rate,
    store,
    store_in,
    times,
    unit,
    vector,
    vector_in,
)
from generator.simulation.compiled.closure import impose_rows, solve_rows
from generator.simulation.compiled.compiler import (
    COUNT,
    FLAG,
    NOTHING,
    REAL,
    VECTOR,
    compiled,
)
from generator.simulation.compiled.layout import (
    BALL,
    COORDINATE,
    KIND,
    LAWS,
    MECHANISM,
    POWERS,
    RATE,
    RESPONSE_JOINT,
    RESPONSE_SPIN_RATE,
    ROW_RATE,
    ROW_VALUE,
    ROW_WRENCH,
    SCRATCH,
    Laws,
    Mechanism,
    Scratch,
)
from generator.simulation.compiled.recursion import compute_rates
from generator.simulation.compiled.row_motion import measure_rows, row_wrench

MAX_GAP = 1e-12
"""Largest constrained displacement after a projection [m, rad or 1]."""

_MAX_NEWTON_STEPS = 8
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


@compiled(NOTHING, LAWS, MECHANISM, SCRATCH, COUNT, REAL, VECTOR, VECTOR, pointer=True)
def compute_constrained_rates(
    laws: Laws,
    mechanism: Mechanism,
    scratch: Scratch,
    interval: int,
    time: float,
    state: Array,
    rates: Array,
) -> None:
    """Compute the rates of a state with constraints beyond the tree, as `compute_rates` does."""
    compute_rates(laws, mechanism, scratch, interval, time, state, rates)
    measure_rows(mechanism, scratch)
    impose_rows(mechanism, scratch, rates)
    for r in range(len(mechanism.rows)):
        store(scratch.row_work, r, ROW_WRENCH, row_wrench(mechanism, scratch, r))
    for k in range(POWERS):
        rates[len(rates) - POWERS + k] = scratch.powers[k]


@compiled(FLAG, LAWS, MECHANISM, SCRATCH, COUNT, REAL, VECTOR, VECTOR, entry=True, pointer=True)
def project_state(
    laws: Laws,
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
    for _ in range(_MAX_NEWTON_STEPS):
        compute_constrained_rates(laws, mechanism, scratch, interval, time, state, rates)
        if _are_rows_closed(scratch, MAX_GAP):
            _correct_rates(mechanism, scratch, state)
            return True
        _correct_positions(mechanism, scratch, state)
    return False
