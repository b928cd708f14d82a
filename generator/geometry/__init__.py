"""Surfaces of polygons: psurf and mesh files, soundness, and the mass they enclose."""

from generator.geometry.psurf import (
    format_psurf,
    parse_psurf,
    parse_psurf_file,
    read_psurf,
    write_psurf,
)
from generator.geometry.read import read_surface
from generator.geometry.surface import Surface
from generator.geometry.validate import Solid, build_solid, mass_properties

__all__ = [
    "Solid",
    "Surface",
    "build_solid",
    "format_psurf",
    "mass_properties",
    "parse_psurf",
    "parse_psurf_file",
    "read_psurf",
    "read_surface",
    "write_psurf",
]
