"""Binary STL files, the meshes that OpenSim, MuJoCo and readers of URDF have in common.

A file is 80 bytes of text, the number of triangles, and for each its normal, its corners and two
bytes without a meaning, in 32 bits a number (Burns, Automated Fabrication, 1993, section 6.5).
"""

import numpy as np

from generator.geometry.appearance import triangles_with_normals
from generator.geometry.surface import Surface

_HEADER = b"exudyn-mover, metres"
"""It must not open with `solid`, which is how a text file opens."""

_TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("unused", "<u2")])


def format_stl(surface: Surface) -> bytes:
    """Return the faces of a surface as triangles in a binary STL file, in metres."""
    corners, normals = triangles_with_normals(surface)
    triangles = np.zeros(len(corners) // 3, _TRIANGLE)
    triangles["corners"] = corners.reshape(-1, 3, 3)
    triangles["normal"] = normals[::3]
    count = np.array(len(triangles), "<u4")
    return _HEADER.ljust(80, b"\0") + count.tobytes() + triangles.tobytes()
