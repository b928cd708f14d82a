"""Curves of many pieces in compiled laws.

Where the curvature jumps, a method of high order loses its order. So without contact the bounds of
pieces are breakpoints, and a step keeps to one piece; with contact the error control of a method of
low order suffices. Number, place and bounds of the pieces are data: curves share their code.
"""

from generator.rotations import Array
from generator.simulation.compiled.compiler import COUNT, REAL, VECTOR, compiled

PIECE_SIZE = 5
"""Constants of a piece: its origin, and the coefficients of a cubic."""

PIECES_AT, BREAKS, FIRST_SWITCH = range(3)
"""Constants of a curve: where its first piece is, number of bounds between pieces, and index of the
switching function of the first bound, -1 where none is a breakpoint."""


@compiled(REAL, REAL, VECTOR, COUNT, COUNT, VECTOR, VECTOR, COUNT, merged=True)
def piecewise_cubic(
    x: float, table: Array, law: int, curve: int, branches: Array, switching: Array, switch: int
) -> float:
    """Evaluate the cubic of a piece.

    It is the one in which the displacement is, found by halving; or the one that the branches
    select, with the switching functions stored.

    Args:
        x: displacement [rad or m].
        table: constants of the laws.
        law: first constant of the law, from which places are counted.
        curve: place of the constants of the curve.
        branches: held signs of the switching functions.
        switching: switching functions, which are positive below their bound.
        switch: index of the law's first one.
    """
    first = law + int(table[law + curve + PIECES_AT])
    breaks, own = int(table[law + curve + BREAKS]), int(table[law + curve + FIRST_SWITCH])
    piece = first
    if own >= 0:
        for k in range(breaks):
            switching[switch + own + k] = table[first + PIECE_SIZE * (k + 1)] - x
            if not branches[switch + own + k] > 0.0:
                piece += PIECE_SIZE
    else:
        low, high = 0, breaks
        while low < high:
            middle = (low + high) // 2
            if x < table[first + PIECE_SIZE * (middle + 1)]:
                high = middle
            else:
                low = middle + 1
        piece += PIECE_SIZE * low
    u = x - table[piece]
    c0, c1, c2, c3 = table[piece + 1], table[piece + 2], table[piece + 3], table[piece + 4]
    return c0 + u * (c1 + u * (c2 + u * c3))
