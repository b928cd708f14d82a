"""Surfaces of polygons: psurf and mesh files, soundness, and the mass they enclose."""

from generator.geometry.psurf import PSURF_FILE, format_psurf, write_psurf
from generator.geometry.read import read_surface
from generator.geometry.surface import Surface
from generator.geometry.validate import Solid, build_solid, mass_properties

__all__ = [
    "PSURF_FILE",
    "Solid",
    "Surface",
    "build_solid",
    "format_psurf",
    "mass_properties",
    "read_surface",
    "write_psurf",
]
