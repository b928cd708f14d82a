"""Draws the psurf geometry of the shipped figures: `python docs/make_psurfs.py`.

A segment is a sequence of rings, drawn as a tailor would measure it: where the ring's front and
back lie in the side view, and how wide it is. `loft` joins the rings to one closed surface with
outward faces; `format_psurf` writes it. All lengths are cm in the segment's own frame: limbs have x
forward, z down along the limb and y to the figure's right; the torso has x forward, y left and z
up. Every segment is symmetric about its xz plane, so that left and right share one file.

The lengths are those between the sites of the figure files; the girths are chosen so that the
volume suits the segment's mass at the density of flesh: the limbs imply 0.92 to 1.03 g/cm3. For the
torso that cannot be, because its masses are too small for its lengths: the lengths win, and the
pelvis implies 0.50 g/cm3, the chest with neck and head 0.46 g/cm3.
"""

import math
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Face = tuple[int, ...]

POINTS = 16
"""Points of a ring, an even number."""

DECIMALS = 3
"""Vertices are rounded to 0.01 mm before anything is decided about their faces."""

SOLE = 50.7
"""z of the sole in the lower leg: hips 94.1 cm above the floor, less the 43.4 cm of the thigh."""


class Ring(NamedTuple):
    """One cross section, a superellipse between two points of the side view [cm].

    front, back: (x, z) of the foremost and hindmost point; width: half the breadth along y; power:
    2 is an ellipse, more is squarer; ridge: how far the foremost point alone stands out (the
    nose).
    """

    front: tuple[float, float]
    back: tuple[float, float]
    width: float
    power: float = 2.2
    ridge: float = 0.0


def level(z: float, front: float, back: float, width: float, power: float = 2.2) -> Ring:
    """A ring in the plane of constant z, from x = `front` to x = `back`."""
    return Ring((front, z), (back, z), width, power)


UPPER_LEG = [
    level(-7.0, 2.8, -2.8, 2.6),
    level(-5.8, 5.4, -5.4, 4.7),
    level(-3.4, 7.4, -7.6, 6.4),
    level(0.0, 8.5, -9.1, 7.2),
    level(4.0, 8.9, -9.7, 7.4),
    level(8.0, 9.1, -9.5, 7.3),
    level(13.0, 9.1, -8.9, 7.0),
    level(19.0, 8.8, -8.4, 6.6),
    level(25.0, 8.2, -7.8, 6.2),
    level(31.0, 7.3, -7.0, 5.7),
    level(36.5, 6.3, -6.2, 5.2),
    level(40.5, 5.9, -5.7, 5.0),
    level(43.6, 5.7, -5.4, 4.9),
    level(46.0, 5.0, -4.5, 4.4),
    level(47.6, 3.6, -3.2, 3.1),
    level(48.3, 1.8, -1.6, 1.6),
]

LOWER_LEG = [
    level(-4.8, 1.8, -1.8, 1.7),
    level(-3.8, 3.9, -3.4, 3.4),
    level(-1.5, 5.4, -4.8, 4.6),
    level(1.5, 5.8, -5.3, 4.8),
    level(5.0, 5.1, -5.7, 4.6),
    level(9.0, 4.7, -6.7, 4.9),
    level(13.5, 4.6, -7.2, 5.1),
    level(18.0, 4.5, -6.9, 4.9),
    level(23.0, 4.2, -5.7, 4.2),
    level(28.5, 3.9, -4.7, 3.5),
    level(34.0, 3.6, -4.2, 3.1),
    Ring((3.9, 38.0), (-4.4, 39.0), 3.1),
    Ring((4.9, 41.2), (-5.2, 43.0), 3.7),
    Ring((6.8, 43.2), (-6.4, 46.5), 3.6),
    Ring((9.0, 44.6), (-6.8, 49.4), 3.7),
    Ring((11.2, 45.8), (-4.6, 51.4), 3.9, 2.6),
    Ring((13.4, 46.8), (2.5, 51.4), 4.2, 2.6),
    Ring((15.6, 47.6), (9.5, 51.4), 4.8, 2.6),
    Ring((17.6, 48.2), (14.5, 51.4), 4.8, 2.6),
    Ring((19.0, 48.8), (18.0, 51.2), 4.2, 2.6),
    Ring((19.8, 49.4), (19.8, 50.6), 2.8, 2.6),
]

UPPER_ARM = [
    level(-4.5, 1.6, -1.6, 1.6),
    level(-3.7, 3.2, -3.2, 3.1),
    level(-1.7, 4.7, -4.7, 4.3),
    level(1.5, 5.5, -5.5, 4.9),
    level(5.5, 5.6, -5.6, 4.9),
    level(10.0, 5.2, -5.2, 4.5),
    level(14.0, 4.9, -4.9, 4.1),
    level(19.0, 4.9, -4.9, 4.0),
    level(24.0, 4.6, -4.5, 3.8),
    level(29.0, 4.1, -4.1, 3.6),
    level(33.4, 3.9, -4.0, 3.6),
    level(35.4, 3.3, -3.3, 3.1),
    level(36.6, 1.9, -1.9, 1.8),
]

LOWER_ARM = [
    level(-3.6, 1.8, -1.8, 1.6),
    level(-2.4, 3.2, -3.2, 3.0),
    level(0.0, 4.2, -4.1, 3.8),
    level(4.0, 4.7, -4.5, 4.1),
    level(8.0, 4.7, -4.4, 4.1),
    level(13.0, 4.3, -4.0, 3.8),
    level(19.0, 3.7, -3.4, 3.2),
    level(24.0, 3.3, -3.0, 2.6),
    level(28.0, 3.1, -2.9, 2.2),
    level(30.5, 3.6, -3.4, 2.1),
    level(33.0, 4.7, -4.1, 2.0),
    level(36.0, 5.4, -4.3, 1.9),
    level(38.5, 4.8, -4.2, 1.7),
    level(41.0, 4.1, -4.0, 1.5),
    level(44.0, 3.7, -3.5, 1.3),
    level(46.5, 2.8, -2.5, 1.1),
    level(47.6, 1.6, -1.2, 0.7),
]

CLAVICLE = [
    level(-0.5, 1.1, -1.1, 1.1, 3.0),
    level(0.5, 1.6, -1.6, 1.6, 3.0),
    level(16.7, 1.6, -1.6, 1.6, 3.0),
    level(17.7, 1.1, -1.1, 1.1, 3.0),
]

LOWER_TORSO = [
    level(-7.6, 3.0, -3.6, 2.2),
    level(-6.4, 5.6, -6.6, 4.0),
    level(-4.2, 7.2, -8.6, 7.2),
    level(-1.6, 8.2, -9.7, 10.8, 2.3),
    level(1.6, 8.7, -10.0, 13.3, 2.4),
    level(5.0, 8.8, -9.5, 13.9, 2.4),
    level(8.5, 8.6, -8.7, 13.2, 2.4),
    level(11.5, 8.3, -8.1, 12.4, 2.4),
    level(13.4, 8.2, -7.9, 12.0, 2.4),
    level(14.6, 7.0, -6.7, 10.6, 2.4),
    level(15.4, 4.5, -4.5, 7.5, 2.4),
]

CHEST = [
    level(-2.4, 4.5, -4.5, 7.5, 2.4),
    level(-1.5, 7.0, -6.7, 10.6, 2.4),
    level(0.0, 8.2, -7.9, 12.0, 2.4),
    level(4.0, 8.3, -7.7, 11.6, 2.4),
    level(9.0, 8.5, -8.0, 11.6, 2.4),
    level(15.0, 9.0, -8.8, 12.2, 2.4),
    level(22.0, 9.6, -9.7, 13.1, 2.4),
    level(29.0, 10.4, -10.3, 14.0, 2.4),
    level(34.5, 11.1, -10.5, 14.8, 2.5),
    level(40.0, 10.9, -10.3, 15.8, 2.5),
    level(45.0, 9.3, -9.5, 17.0, 2.4),
    level(49.0, 7.2, -8.5, 18.0, 2.2),
    level(52.0, 5.6, -7.6, 17.6, 2.1),
    level(54.0, 4.7, -7.0, 15.2, 2.0),
    level(55.6, 4.2, -6.6, 11.2, 2.0),
    level(57.2, 4.1, -6.2, 7.8, 2.0),
    Ring((4.2, 58.2), (-5.9, 59.6), 6.2, 2.1),
    Ring((4.4, 59.0), (-5.7, 62.0), 5.7),
    Ring((5.2, 59.6), (-5.8, 64.0), 5.6),
    Ring((8.6, 59.8), (-6.5, 65.6), 5.8),
    Ring((10.2, 60.5), (-7.4, 67.0), 6.1),
    Ring((10.3, 62.8), (-8.3, 68.8), 6.7),
    Ring((10.3, 65.0), (-9.0, 70.3), 7.1, 2.2, 0.4),
    Ring((10.3, 66.2), (-9.3, 71.4), 7.3, 2.2, 1.9),
    Ring((10.2, 68.2), (-9.6, 72.8), 7.5, 2.2, 1.2),
    Ring((10.0, 70.6), (-9.7, 74.2), 7.6, 2.2, 0.3),
    Ring((10.4, 72.2), (-9.7, 75.2), 7.7),
    Ring((10.1, 75.2), (-9.4, 77.2), 7.6),
    Ring((9.0, 78.2), (-8.6, 79.2), 7.0),
    Ring((7.2, 80.4), (-7.0, 80.8), 5.9),
    level(82.0, 4.6, -4.8, 4.1),
    level(82.5, 2.2, -2.4, 2.1),
]


def section(ring: Ring) -> Array:
    """The points of a ring from the front over +y to the back and home by -y, shape (POINTS, 3)."""
    half = POINTS // 2
    angles = np.pi * np.arange(half + 1) / half
    along = np.sign(np.cos(angles)) * np.abs(np.cos(angles)) ** (2.0 / ring.power)
    across = ring.width * np.abs(np.sin(angles)) ** (2.0 / ring.power)
    across[[0, half]] = 0.0
    front, back = np.array(ring.front), np.array(ring.back)
    side = (front + back) / 2.0 + along[:, None] * (front - back) / 2.0
    side[0] += ring.ridge * (front - back) / math.dist(ring.front, ring.back)
    right = np.round(np.column_stack([side[:, 0], across, side[:, 1]]), DECIMALS)
    return np.vstack([right, right[-2:0:-1] * [1.0, -1.0, 1.0]])


def sections(rings: list[Ring]) -> list[Array]:
    """The rings of one segment, each of shape (POINTS, 3)."""
    return [section(ring) for ring in rings]


def standing(rings: list[Array]) -> list[Array]:
    """The same rings pressed flat where they reach below the sole."""
    return [np.minimum(ring, [np.inf, np.inf, SOLE]) for ring in rings]


def link() -> list[Array]:
    """A square bar from the origin to x = 150, bent down to z = -15 (figure 3.4 of the thesis)."""
    side_views = [
        ((-3.0, 3.0), (-3.0, -3.0)),
        ((153.0, 3.0), (147.0, -3.0)),
        ((153.0, -18.0), (147.0, -18.0)),
    ]
    return [
        np.array([[x1, 3.0, z1], [x2, 3.0, z2], [x2, -3.0, z2], [x1, -3.0, z1]])
        for (x1, z1), (x2, z2) in side_views
    ]


def floor() -> list[Array]:
    """A plate under y = 0 with a post up to y = 120, where figure 3.4 hangs its link."""
    corners = np.array([[1.0, 0.0, 1.0], [1.0, 0.0, -1.0], [-1.0, 0.0, -1.0], [-1.0, 0.0, 1.0]])
    return [
        half * corners + [0.0, y, 0.0]
        for y, half in [(-2.0, 100.0), (0.0, 100.0), (0.0, 4.0), (120.0, 4.0)]
    ]


def loft(rings: list[Array]) -> tuple[Array, list[Face]]:
    """Vertices (n, 3) and faces of the closed surface through rings of equal length.

    The first and last ring become one face each, so they must be planar. Between rings a quadrangle
    stays one face where it is planar, and is split along its shorter diagonal elsewhere. The faces
    count their vertices from 0, counter-clockwise from outside.
    """
    vertices = np.vstack(rings)
    count = len(rings[0])
    last = len(vertices) - count
    faces: list[Face] = [tuple(range(count)), tuple(range(last + count - 1, last - 1, -1))]
    for start in range(0, last, count):
        for here, there in pairwise([*range(start, start + count), start]):
            faces += quadrangle(vertices, (there, here, here + count, there + count))
    if signed_volume(vertices, faces) < 0.0:
        faces = [face[::-1] for face in faces]
    return vertices, faces


def quadrangle(vertices: Array, face: Face) -> list[Face]:
    """The face itself where its corners lie in a plane, else two triangles."""
    a, b, c, d = face
    corners = vertices[list(face)]
    one, two, three = corners[1:] - corners[0]
    if abs(float(np.cross(one, two) @ three)) < 0.5 * 10.0 ** (-3 * DECIMALS):
        return [face]
    if math.dist(corners[0], corners[2]) < math.dist(corners[1], corners[3]):
        return [(a, b, c), (a, c, d)]
    return [(a, b, d), (b, c, d)]


def signed_volume(vertices: Array, faces: list[Face]) -> float:
    """Volume inside the faces [cm3]; negative when they face inwards."""
    fans = [(face[0], b, c) for face in faces for b, c in pairwise(face[1:])]
    return float(np.linalg.det(vertices[fans]).sum()) / 6.0


def format_psurf(vertices: Array, faces: list[Face]) -> str:
    """The text of a psurf file: vertices, `;;`, faces counted from 1, `;;`."""
    lines = [" ".join(f"{value + 0.0:.{DECIMALS}f}" for value in vertex) for vertex in vertices]
    lines.append(";;")
    lines += [" ".join(str(index + 1) for index in face) + ";" for face in faces]
    lines.append(";;")
    return "\n".join(lines) + "\n"


def psurfs() -> dict[str, str]:
    """The text of every shipped psurf by file name."""
    drawn = {
        "ecalf.pss": standing(sections(LOWER_LEG)),
        "eupleg.pss": sections(UPPER_LEG),
        "elowarm.pss": sections(LOWER_ARM),
        "euparm.pss": sections(UPPER_ARM),
        "eclavicle.pss": sections(CLAVICLE),
        "eltorso.pss": sections(LOWER_TORSO),
        "echest.pss": sections(CHEST),
        "link1.pss": link(),
        "floor.pss": floor(),
    }
    return {name: format_psurf(*loft(rings)) for name, rings in drawn.items()}


def write_psurfs(folder: Path) -> None:
    """Write every psurf into `folder`, over what is there."""
    for name, text in psurfs().items():
        (folder / name).write_bytes(text.encode("ascii"))


if __name__ == "__main__":
    write_psurfs(Path(__file__).parents[1] / "figures")
