"""One door for all surfaces: the suffix of a path chooses the format."""

from collections.abc import Mapping
from fractions import Fraction
from pathlib import Path

from generator.errors import MoverError, nearest
from generator.geometry.psurf import CENTIMETRE, read_psurf
from generator.geometry.surface import Surface

PSURF = ".pss"

OWN_UNITS: Mapping[str, Fraction | None] = {
    PSURF: CENTIMETRE,
    ".stl": None,
    ".obj": None,
    ".ply": None,
    ".glb": Fraction(1),
    ".gltf": Fraction(1),
}
"""The formats, and the length that 1 means in each [m]; None where the format does not say."""


class UnknownSurfaceError(MoverError):
    """A path whose suffix names no format, or one of which nobody knows the unit."""


def unit_of(path: str | Path, unit: Fraction | None = None) -> Fraction:
    """The length [m] that 1 means in a file: `unit` if it is given, else that of its format.

    Raises UnknownSurfaceError for an unknown suffix, and for a format without a unit when none is
    given.
    """
    suffix = Path(path).suffix.lower()
    if suffix not in OWN_UNITS:
        said = f"`{suffix}` is no known suffix" if suffix else "the suffix is missing"
        hint = nearest(suffix, OWN_UNITS)
        raise UnknownSurfaceError(f"{path}: {said} of a surface; {hint}")
    known = unit or OWN_UNITS[suffix]
    if known is None:
        raise UnknownSurfaceError(
            f"{path}: {suffix} files do not say what their lengths mean; "
            "give the unit, such as `--unit mm`"
        )
    return known


def read_surface(path: str | Path, unit: Fraction | None = None) -> Surface:
    """The surface in a psurf or mesh file; `unit` [m] overrides what 1 means in its format.

    Raises:
        UnknownSurfaceError: the format or its unit is not known.
        InputError: the file cannot be read.
    """
    meant = unit_of(path, unit)
    if Path(path).suffix.lower() == PSURF:
        return read_psurf(path, meant)
    # trimesh takes as long to import as everything else that a psurf needs.
    from generator.geometry.mesh_file import read_mesh

    return read_mesh(path, meant)
