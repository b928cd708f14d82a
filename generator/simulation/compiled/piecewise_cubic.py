"""Curves of many pieces in compiled laws, whose breakpoints are data."""

from generator.rotations import Array
from generator.simulation.compiled.compiler import COUNT, REAL, VECTOR, compiled

PIECE_SIZE = 5
"""Constants of a piece: its origin, and the coefficients of a cubic."""


@compiled(REAL, REAL, VECTOR, COUNT, COUNT, VECTOR, VECTOR, COUNT)
def piecewise_cubic(
    x: float, table: Array, first: int, breaks: int, branches: Array, switching: Array, switch: int
) -> float:
    """Evaluate the piece that the branches select, and the switching functions.

    Args:
        x: displacement [rad or m].
        table: constants of the laws, those of the first piece from `first` on.
        first: see `table`.
        breaks: number of breakpoints, one less than of pieces.
        branches: held signs of the switching functions.
        switching: switching functions, which are positive below their breakpoint.
        switch: index of the first one.
    """
    piece = first
    for k in range(breaks):
        switching[switch + k] = table[first + PIECE_SIZE * (k + 1)] - x
        if not branches[switch + k] > 0.0:
            piece += PIECE_SIZE
    u = x - table[piece]
    c0, c1, c2, c3 = table[piece + 1], table[piece + 2], table[piece + 3], table[piece + 4]
    return c0 + u * (c1 + u * (c2 + u * c3))
