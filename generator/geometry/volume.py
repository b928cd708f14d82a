"""The tetrahedra between a point and the faces of a surface, and sums over them.

Section 5.3 of the thesis: the apex of all tetrahedra is one point, their bases are the triangles of
the faces. The determinant of the three edges from the apex (six volumes, eq. 5.2) keeps its sign,
negative where the apex sees a face from outside, so concave bodies and bodies with holes come out
right. With a_1, a_2, a_3 as those edges and their sum s, the integrals of eq. 5.23, 5.26, 5.31 and
5.34 (where r = s = t = 1) are

    volume          det / 6
    of x            det / 24  s
    of x x^T        det / 120 (s s^T + a_1 a_1^T + a_2 a_2^T + a_3 a_3^T)
"""

from dataclasses import dataclass

import numpy as np

from generator.geometry.surface import Array, Indices, Surface
from generator.inertia import MassProperties


@dataclass(frozen=True, eq=False)
class Tetrahedra:
    """One signed tetrahedron for each triangle of a surface.

    Attributes:
        apex: their common corner [m], shape (3,).
        edges: from the apex to the three corners of each base [m], shape (3 corners, 3, t).
        determinants: six times the signed volumes [m3], shape (t,).
        faces: the face that each base is a part of, shape (t,).
    """

    apex: Array
    edges: tuple[Array, Array, Array]
    determinants: Array
    faces: Indices

    @property
    def volume(self) -> float:
        """Signed volume within the surface [m3]; negative when its faces look inwards."""
        return float(self.determinants.sum()) / 6.0

    def volumes_of_faces(self, count: int) -> Array:
        """Signed volume between the apex and each of `count` faces [m3]."""
        return np.bincount(self.faces, self.determinants, count) / 6.0

    def mass_properties(self, density: float) -> MassProperties:
        """What encloses a positive volume, filled with `density` [kg/m3]."""
        one, two, three = self.edges
        total = one + two
        total += three
        volume = self.volume
        centre = total @ self.determinants / (24.0 * volume)
        weighted = total * self.determinants
        second = weighted @ total.T
        for edge in self.edges:
            np.multiply(edge, self.determinants, out=weighted)
            second += weighted @ edge.T
        second = second / 120.0 - volume * np.outer(centre, centre)
        with np.errstate(over="ignore"):  # what is not finite is refused as no body's
            inertia = density * (np.trace(second) * np.eye(3) - second)
        return MassProperties(density * volume, self.apex + centre, inertia)


def build_tetrahedra(surface: Surface) -> Tetrahedra:
    """The tetrahedra of a surface, with the apex in the middle of its faces' extent.

    Near the body the edges are as short as they can be: no digits are lost to a far origin.
    """
    triangles, faces = surface.fan_triangles
    points = surface.vertices.T
    used = surface.vertices[triangles[0]]
    apex = (used.min(axis=0) + used.max(axis=0)) / 2.0 if len(used) else np.zeros(3)
    near = np.ascontiguousarray(points - apex[:, None])
    one, two, three = (np.take(near, triangles[k], axis=1) for k in range(3))
    determinants = one[0] * (two[1] * three[2] - two[2] * three[1])
    determinants += one[1] * (two[2] * three[0] - two[0] * three[2])
    determinants += one[2] * (two[0] * three[1] - two[1] * three[0])
    return Tetrahedra(apex, (one, two, three), determinants, faces)
