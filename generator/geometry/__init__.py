"""Surfaces of polygons: psurf and mesh files, soundness, and the mass they enclose."""

from generator.geometry.psurf import (
    examine_psurf,
    format_psurf,
    parse_psurf,
    read_psurf,
    write_psurf,
)
from generator.geometry.read import read_surface
from generator.geometry.surface import Surface
from generator.geometry.validate import Solid, mass_properties, solid_of

__all__ = [
    "Solid",
    "Surface",
    "examine_psurf",
    "format_psurf",
    "mass_properties",
    "parse_psurf",
    "read_psurf",
    "read_surface",
    "solid_of",
    "write_psurf",
]
