"""Vectors, matrices and quaternions as tuples of floats, for compiled code.

A vector is (x, y, z), a matrix nine numbers by rows, a symmetric matrix (xx, xy, xz, yy, yz, zz), a
quaternion (w, x, y, z). They are read from and written to rows of arrays at named places.
"""

from math import sqrt
from typing import TypeAlias

from generator.rotations import Array
from generator.simulation.compiled.compiler import inlined

Vector: TypeAlias = tuple[float, float, float]
Quaternion: TypeAlias = tuple[float, float, float, float]
Symmetric: TypeAlias = tuple[float, float, float, float, float, float]
Matrix: TypeAlias = tuple[float, float, float, float, float, float, float, float, float]


@inlined
def vector(table: Array, row: int, at: int) -> Vector:
    """Read a vector from a row of a table."""
    return table[row, at], table[row, at + 1], table[row, at + 2]


@inlined
def quaternion(table: Array, row: int, at: int) -> Quaternion:
    """Read a quaternion from a row of a table."""
    return table[row, at], table[row, at + 1], table[row, at + 2], table[row, at + 3]


@inlined
def symmetric(table: Array, row: int, at: int) -> Symmetric:
    """Read a symmetric matrix from a row of a table."""
    return (
        table[row, at],
        table[row, at + 1],
        table[row, at + 2],
        table[row, at + 3],
        table[row, at + 4],
        table[row, at + 5],
    )


@inlined
def matrix(table: Array, row: int, at: int) -> Matrix:
    """Read a matrix from a row of a table."""
    return (
        table[row, at],
        table[row, at + 1],
        table[row, at + 2],
        table[row, at + 3],
        table[row, at + 4],
        table[row, at + 5],
        table[row, at + 6],
        table[row, at + 7],
        table[row, at + 8],
    )


@inlined
def store(table: Array, row: int, at: int, values: tuple[float, ...]) -> None:
    """Write a tuple into a row of a table."""
    for k in range(len(values)):
        table[row, at + k] = values[k]


@inlined
def accumulate(table: Array, row: int, at: int, values: tuple[float, ...]) -> None:
    """Add a tuple to the numbers in a row of a table."""
    for k in range(len(values)):
        table[row, at + k] += values[k]


@inlined
def vector_in(state: Array, at: int) -> Vector:
    """Read a vector from a state."""
    return state[at], state[at + 1], state[at + 2]


@inlined
def quaternion_in(state: Array, at: int) -> Quaternion:
    """Read a quaternion from a state."""
    return state[at], state[at + 1], state[at + 2], state[at + 3]


@inlined
def store_in(state: Array, at: int, values: tuple[float, ...]) -> None:
    """Write a tuple into a state."""
    for k in range(len(values)):
        state[at + k] = values[k]


@inlined
def plus(a: Vector, b: Vector) -> Vector:
    """Sum of two vectors."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@inlined
def minus(a: Vector, b: Vector) -> Vector:
    """Difference of two vectors."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


@inlined
def times(factor: float, a: Vector) -> Vector:
    """Multiple of a vector."""
    return factor * a[0], factor * a[1], factor * a[2]


@inlined
def dot(a: Vector, b: Vector) -> float:
    """Scalar product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@inlined
def cross(a: Vector, b: Vector) -> Vector:
    """Vector product."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@inlined
def apply(m: Matrix, a: Vector) -> Vector:
    """Product of a matrix and a vector."""
    return (
        m[0] * a[0] + m[1] * a[1] + m[2] * a[2],
        m[3] * a[0] + m[4] * a[1] + m[5] * a[2],
        m[6] * a[0] + m[7] * a[1] + m[8] * a[2],
    )


@inlined
def apply_transposed(m: Matrix, a: Vector) -> Vector:
    """Product of a transposed matrix and a vector."""
    return (
        m[0] * a[0] + m[3] * a[1] + m[6] * a[2],
        m[1] * a[0] + m[4] * a[1] + m[7] * a[2],
        m[2] * a[0] + m[5] * a[1] + m[8] * a[2],
    )


@inlined
def apply_symmetric(s: Symmetric, a: Vector) -> Vector:
    """Product of a symmetric matrix and a vector."""
    return (
        s[0] * a[0] + s[1] * a[1] + s[2] * a[2],
        s[1] * a[0] + s[3] * a[1] + s[4] * a[2],
        s[2] * a[0] + s[4] * a[1] + s[5] * a[2],
    )


@inlined
def cross_rows(a: Vector, m: Matrix) -> Matrix:
    """Matrix whose rows are the vector products of `a` with the rows of `m`: m [a]x^T."""
    x = cross(a, (m[0], m[1], m[2]))
    y = cross(a, (m[3], m[4], m[5]))
    z = cross(a, (m[6], m[7], m[8]))
    return x[0], x[1], x[2], y[0], y[1], y[2], z[0], z[1], z[2]


@inlined
def cross_symmetric(a: Vector, s: Symmetric) -> Matrix:
    """Product [a]x s of a cross matrix and a symmetric matrix."""
    return (
        a[1] * s[2] - a[2] * s[1],
        a[1] * s[4] - a[2] * s[3],
        a[1] * s[5] - a[2] * s[4],
        a[2] * s[0] - a[0] * s[2],
        a[2] * s[1] - a[0] * s[4],
        a[2] * s[2] - a[0] * s[5],
        a[0] * s[1] - a[1] * s[0],
        a[0] * s[3] - a[1] * s[1],
        a[0] * s[4] - a[1] * s[2],
    )


@inlined
def inverse_symmetric(s: Symmetric) -> Symmetric:
    """Inverse of a symmetric matrix, by its adjugate."""
    xx = s[3] * s[5] - s[4] * s[4]
    xy = s[2] * s[4] - s[1] * s[5]
    xz = s[1] * s[4] - s[2] * s[3]
    k = 1.0 / (s[0] * xx + s[1] * xy + s[2] * xz)
    return (
        k * xx,
        k * xy,
        k * xz,
        k * (s[0] * s[5] - s[2] * s[2]),
        k * (s[1] * s[2] - s[0] * s[4]),
        k * (s[0] * s[3] - s[1] * s[1]),
    )


@inlined
def sum_of(s: Symmetric, t: Symmetric) -> Symmetric:
    """Sum of two symmetric matrices."""
    return s[0] + t[0], s[1] + t[1], s[2] + t[2], s[3] + t[3], s[4] + t[4], s[5] + t[5]


@inlined
def symmetric_times(s: Symmetric, m: Matrix) -> Matrix:
    """Product of a symmetric matrix and a matrix."""
    x = apply_symmetric(s, (m[0], m[3], m[6]))
    y = apply_symmetric(s, (m[1], m[4], m[7]))
    z = apply_symmetric(s, (m[2], m[5], m[8]))
    return x[0], y[0], z[0], x[1], y[1], z[1], x[2], y[2], z[2]


@inlined
def symmetric_less_outer(s: Symmetric, a: Vector, b: Vector) -> Symmetric:
    """Difference s - a b^T where a and b are parallel."""
    return (
        s[0] - a[0] * b[0],
        s[1] - a[0] * b[1],
        s[2] - a[0] * b[2],
        s[3] - a[1] * b[1],
        s[4] - a[1] * b[2],
        s[5] - a[2] * b[2],
    )


@inlined
def matrix_less_outer(m: Matrix, a: Vector, b: Vector) -> Matrix:
    """Difference m - a b^T."""
    return (
        m[0] - a[0] * b[0],
        m[1] - a[0] * b[1],
        m[2] - a[0] * b[2],
        m[3] - a[1] * b[0],
        m[4] - a[1] * b[1],
        m[5] - a[1] * b[2],
        m[6] - a[2] * b[0],
        m[7] - a[2] * b[1],
        m[8] - a[2] * b[2],
    )


@inlined
def symmetric_less_product(s: Symmetric, m: Matrix, n: Matrix) -> Symmetric:
    """Difference s - m^T n where the product is symmetric."""
    return (
        s[0] - m[0] * n[0] - m[3] * n[3] - m[6] * n[6],
        s[1] - m[0] * n[1] - m[3] * n[4] - m[6] * n[7],
        s[2] - m[0] * n[2] - m[3] * n[5] - m[6] * n[8],
        s[3] - m[1] * n[1] - m[4] * n[4] - m[7] * n[7],
        s[4] - m[1] * n[2] - m[4] * n[5] - m[7] * n[8],
        s[5] - m[2] * n[2] - m[5] * n[5] - m[8] * n[8],
    )


@inlined
def upper_half(m: Matrix) -> Symmetric:
    """Entries of a matrix that is symmetric."""
    return m[0], m[1], m[2], m[4], m[5], m[8]


@inlined
def twice_symmetric_part(m: Matrix) -> Symmetric:
    """Sum m + m^T."""
    return 2.0 * m[0], m[1] + m[3], m[2] + m[6], 2.0 * m[4], m[5] + m[7], 2.0 * m[8]


@inlined
def rotated_diagonal(r: Matrix, d: Vector) -> Symmetric:
    """Product r diag(d) r^T: principal moments in other axes."""
    return (
        r[0] * r[0] * d[0] + r[1] * r[1] * d[1] + r[2] * r[2] * d[2],
        r[0] * r[3] * d[0] + r[1] * r[4] * d[1] + r[2] * r[5] * d[2],
        r[0] * r[6] * d[0] + r[1] * r[7] * d[1] + r[2] * r[8] * d[2],
        r[3] * r[3] * d[0] + r[4] * r[4] * d[1] + r[5] * r[5] * d[2],
        r[3] * r[6] * d[0] + r[4] * r[7] * d[1] + r[5] * r[8] * d[2],
        r[6] * r[6] * d[0] + r[7] * r[7] * d[1] + r[8] * r[8] * d[2],
    )


@inlined
def product(p: Quaternion, q: Quaternion) -> Quaternion:
    """Quaternion of the rotation by q followed by p."""
    return (
        p[0] * q[0] - p[1] * q[1] - p[2] * q[2] - p[3] * q[3],
        p[0] * q[1] + p[1] * q[0] + p[2] * q[3] - p[3] * q[2],
        p[0] * q[2] - p[1] * q[3] + p[2] * q[0] + p[3] * q[1],
        p[0] * q[3] + p[1] * q[2] - p[2] * q[1] + p[3] * q[0],
    )


@inlined
def conjugate(q: Quaternion) -> Quaternion:
    """Quaternion of the inverse rotation."""
    return q[0], -q[1], -q[2], -q[3]


@inlined
def unit(q: Quaternion) -> Quaternion:
    """Quaternion of length one along another."""
    k = 1.0 / sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    return k * q[0], k * q[1], k * q[2], k * q[3]


@inlined
def rotation(q: Quaternion) -> Matrix:
    """Rotation matrix of a unit quaternion."""
    w, x, y, z = q
    return (
        1.0 - 2.0 * (y * y + z * z),
        2.0 * (x * y - w * z),
        2.0 * (x * z + w * y),
        2.0 * (x * y + w * z),
        1.0 - 2.0 * (x * x + z * z),
        2.0 * (y * z - w * x),
        2.0 * (x * z - w * y),
        2.0 * (y * z + w * x),
        1.0 - 2.0 * (x * x + y * y),
    )


@inlined
def quaternion_rate(q: Quaternion, spin: Vector) -> Quaternion:
    """Rate of a unit quaternion at an angular velocity in world axes [1/s]."""
    w, x, y, z = q
    a, b, c = 0.5 * spin[0], 0.5 * spin[1], 0.5 * spin[2]
    return (
        -(x * a + y * b + z * c),
        w * a + z * b - y * c,
        w * b + x * c - z * a,
        w * c + y * a - x * b,
    )
