"""Displacements, rates and forces of the constraints beyond the tree.

Each scalar constraint is a row of `Mechanism.rows`: a displacement g of two links that stays zero.
With the axis a of the first link, from its site to that of the second the vector d, and the axis b
of the second link, a closing joint has rows of two forms:

    g = a . d,    g' = a . v,    g'' = a . (relative acceleration) + 2 (w1 x a) . v,
    g = a . b,    g' = c . (w2 - w1),    g'' = c . (alpha2 - alpha1) + c' . (w2 - w1),    c = b x a,

where v and the relative acceleration are those of the two bodies' material points at the second
site. The first acts by a force along a at that site, the second by a couple c. Of a displacement x
that follows y by a curve f,

    g = x - f(y),    g' = x' - f' y',    g'' = x'' - f' y'' - f'' y'^2.
"""

from generator.follower_curve import ORIGIN, POWERS_FROM, START
from generator.rotations import Array
from generator.simulation.compiled.algebra import (
    Vector,
    apply,
    cross,
    dot,
    matrix,
    minus,
    plus,
    store,
    times,
    vector,
    vector_in,
)
from generator.simulation.compiled.compiler import (
    COUNT,
    MATRIX,
    NOTHING,
    REAL,
    compiled,
    inlined,
)
from generator.simulation.compiled.layout import (
    ALONG,
    AXIS,
    DIRECTION,
    FIRST_ARM,
    FIRST_AXIS,
    FIRST_SITE,
    JOINT_RATE,
    JOINT_VALUE,
    LINKED,
    MECHANISM,
    MULTIPLIER,
    POINT,
    ROTATION,
    ROW_BIAS,
    ROW_FIRST,
    ROW_KIND,
    ROW_PIECE,
    ROW_PIECES_END,
    ROW_RATE,
    ROW_SECOND,
    ROW_VALUE,
    SCRATCH,
    SECOND_ARM,
    SECOND_AXIS,
    SECOND_SITE,
    SLOPE,
    SPIN,
    SPIN_BIAS,
    VELOCITY,
    Mechanism,
    Scratch,
)


@inlined
def _part(table: Array, link: int, at: int) -> Vector:
    """Vector of a link in a table; zero for the ground."""
    return vector(table, link, at) if link >= 0 else (0.0, 0.0, 0.0)


@inlined
def _in_world(work: Array, link: int, constants: Array, r: int, at: int) -> Vector:
    """Constant vector of a row in a link, or in the ground, in world axes."""
    local = vector(constants, r, at)
    return apply(matrix(work, link, ROTATION), local) if link >= 0 else local


@compiled(NOTHING, MECHANISM, SCRATCH)
def measure_rows(mechanism: Mechanism, scratch: Scratch) -> None:
    """Compute the displacement, rate, direction and acceleration bias of each row."""
    rows, constants, curves, work, found = (
        mechanism.rows,
        mechanism.row_constants,
        mechanism.row_curves,
        scratch.work,
        scratch.row_work,
    )
    for r in range(len(rows)):
        kind, first, second = rows[r, ROW_KIND], rows[r, ROW_FIRST], rows[r, ROW_SECOND]
        if kind == LINKED:
            value, rate, acceleration = 0.0, 0.0, 0.0
            if first >= 0:
                value, rate = work[first, JOINT_VALUE], work[first, JOINT_RATE]
                # That of a drive; a free joint has none without the accelerations.
                acceleration = dot(vector(work, first, AXIS), vector(work, first, SPIN_BIAS))
            at = rows[r, ROW_PIECE]
            while at + 1 < rows[r, ROW_PIECES_END] and curves[at + 1, START] <= value:
                at += 1
            followed, slope, half_bend, since = 0.0, 0.0, 0.0, value - curves[at, ORIGIN]
            for k in range(curves.shape[1] - 1, POWERS_FROM - 1, -1):
                half_bend = half_bend * since + slope
                slope = slope * since + followed
                followed = followed * since + curves[at, k]
            found[r, ROW_VALUE] = work[second, JOINT_VALUE] - followed
            found[r, ROW_RATE] = work[second, JOINT_RATE] - slope * rate
            found[r, ROW_BIAS] = -slope * acceleration - 2.0 * half_bend * rate * rate
            found[r, SLOPE] = slope
            continue
        spin, other_spin = _part(work, first, SPIN), _part(work, second, SPIN)
        axis = _in_world(work, first, constants, r, FIRST_AXIS)
        if kind == ALONG:
            other_arm = _in_world(work, second, constants, r, SECOND_SITE)
            site = plus(_part(work, second, POINT), other_arm)
            arm = minus(site, _part(work, first, POINT))
            speed = minus(
                plus(_part(work, second, VELOCITY), cross(other_spin, other_arm)),
                plus(_part(work, first, VELOCITY), cross(spin, arm)),
            )
            centripetal = minus(
                cross(other_spin, cross(other_spin, other_arm)), cross(spin, cross(spin, arm))
            )
            # Accelerations of links are less gravity, that of the ground is zero.
            weight = dot(axis, vector_in(mechanism.gravity, 0))
            weight *= (first < 0) - (second < 0)
            offset = minus(arm, _in_world(work, first, constants, r, FIRST_SITE))
            found[r, ROW_VALUE] = dot(axis, offset)
            found[r, ROW_RATE] = dot(axis, speed)
            coriolis = 2.0 * dot(cross(spin, axis), speed)
            found[r, ROW_BIAS] = dot(axis, centripetal) + coriolis + weight
            store(found, r, DIRECTION, axis)
            store(found, r, FIRST_ARM, arm)
            store(found, r, SECOND_ARM, other_arm)
        else:
            other_axis = _in_world(work, second, constants, r, SECOND_AXIS)
            about, relative = cross(other_axis, axis), minus(other_spin, spin)
            turning = plus(
                cross(cross(other_spin, other_axis), axis), cross(other_axis, cross(spin, axis))
            )
            found[r, ROW_VALUE] = dot(axis, other_axis)
            found[r, ROW_RATE] = dot(about, relative)
            found[r, ROW_BIAS] = dot(turning, relative)
            store(found, r, DIRECTION, about)


@compiled(REAL, MECHANISM, SCRATCH, COUNT, MATRIX, COUNT, COUNT)
def relative_motion(
    mechanism: Mechanism, scratch: Scratch, r: int, motions: Array, angular: int, linear: int
) -> float:
    """Product of the row of a joint with motions of the links, at these columns of a table."""
    rows, found = mechanism.rows, scratch.row_work
    first, second = rows[r, ROW_FIRST], rows[r, ROW_SECOND]
    turn, other_turn = _part(motions, first, angular), _part(motions, second, angular)
    if rows[r, ROW_KIND] == ALONG:
        moved = plus(_part(motions, first, linear), cross(turn, vector(found, r, FIRST_ARM)))
        other = plus(
            _part(motions, second, linear), cross(other_turn, vector(found, r, SECOND_ARM))
        )
        return dot(vector(found, r, DIRECTION), minus(other, moved))
    return dot(vector(found, r, DIRECTION), minus(other_turn, turn))


@inlined
def row_wrench(
    mechanism: Mechanism, scratch: Scratch, r: int
) -> tuple[float, float, float, float, float, float]:
    """Return the force of a joint's row on its second link and the moment about the origin."""
    rows, found = mechanism.rows, scratch.row_work
    force, moment = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    if rows[r, ROW_KIND] == ALONG:
        force = times(found[r, MULTIPLIER], vector(found, r, DIRECTION))
        point = _part(scratch.work, rows[r, ROW_SECOND], POINT)
        moment = cross(plus(point, vector(found, r, SECOND_ARM)), force)
    elif rows[r, ROW_KIND] != LINKED:
        moment = times(found[r, MULTIPLIER], vector(found, r, DIRECTION))
    return force[0], force[1], force[2], moment[0], moment[1], moment[2]
