"""Curves of many pieces in compiled laws.

Where the curvature jumps, a method of high order loses its order. So without contact the bounds of
pieces are breakpoints, as data, and a step keeps to one piece; with contact the error control of a
method of low order suffices.
"""

from generator.rotations import Array
from generator.simulation.compiled.compiler import COUNT, REAL, VECTOR, compiled

PIECE_SIZE = 5
"""Constants of a piece: its origin, and the coefficients of a cubic."""


@compiled(REAL, REAL, VECTOR, COUNT, COUNT)
def piecewise_cubic(x: float, table: Array, first: int, breaks: int) -> float:
    """Evaluate the piece in which a displacement is, which is found by halving.

    Args:
        x: displacement [rad or m].
        table: constants of the laws, those of the first piece from `first` on.
        first: see `table`.
        breaks: number of bounds between pieces, one less than of pieces.
    """
    low, high = 0, breaks
    while low < high:
        middle = (low + high) // 2
        if x < table[first + PIECE_SIZE * (middle + 1)]:
            high = middle
        else:
            low = middle + 1
    piece = first + PIECE_SIZE * low
    u = x - table[piece]
    c0, c1, c2, c3 = table[piece + 1], table[piece + 2], table[piece + 3], table[piece + 4]
    return c0 + u * (c1 + u * (c2 + u * c3))


@compiled(REAL, REAL, VECTOR, COUNT, COUNT, VECTOR, VECTOR, COUNT)
def held_cubic(
    x: float, table: Array, first: int, breaks: int, branches: Array, switching: Array, switch: int
) -> float:
    """Evaluate the piece that the branches select, and the switching functions.

    Args:
        x: displacement [rad or m].
        table: constants of the laws, those of the first piece from `first` on.
        first: see `table`.
        breaks: number of bounds between pieces.
        branches: held signs of the switching functions.
        switching: switching functions, which are positive below their bound.
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
