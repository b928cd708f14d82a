"""Mass properties of a segment as the page states them: volume, density, inertia ellipsoid."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from generator.diagnostics import InputError
from generator.figure import Figure, Segment
from generator.geometry.read import read_segment_surface
from generator.geometry.validate import build_solid
from generator.rotations import Array


@dataclass(frozen=True)
class SegmentVolume:
    """Volume of a segment's psurf [m^3], or the reason why it has none."""

    volume: float | None
    reason: str = ""


def segment_volume(figure: Figure, segment: Segment) -> SegmentVolume:
    """Return the volume of the psurf of a segment, by `mover mass`'s formula."""
    if segment.psurf is None:
        return SegmentVolume(None, "no closed surface: the segment has no psurf")
    try:
        return SegmentVolume(build_solid(read_segment_surface(figure, segment)).volume)
    except InputError as failure:
        return SegmentVolume(None, f"no closed surface: {failure.diagnostics[0].message}")


def equimomental_semi_axes(mass: float, moments: Sequence[float]) -> Array:
    """Semi-axes [m] of the uniform ellipsoid with this mass and these moments of inertia, (3,).

    The moment about axis i of a solid ellipsoid is m / 5 times the sum of the squares of the two
    other semi-axes. A square that is negative, of moments that no body has, counts as zero.
    """
    one = np.asarray(moments, dtype=float)
    squares = 2.5 / mass * (float(one.sum()) - 2.0 * one)
    return np.sqrt(np.maximum(squares, 0.0))


def mass_lines(segment: Segment, found: SegmentVolume | None) -> list[str]:
    """Return lines on the mass properties of a segment; without `found` none on its volume."""
    lines: list[str] = []
    mass = segment.mass
    is_body = mass is not None and mass > 0.0
    if mass is None:
        lines.append("Mass: none")
    elif segment.has_ground_mass:
        lines.append("Part of the ground")
    else:
        lines.append(f"Mass: {mass:.4f} kg")
    if found is not None:
        if found.volume is None:
            lines.append(f"Volume: {found.reason}")
        else:
            lines.append(f"Volume: {1e6 * found.volume:.1f} cm^3")
            if is_body and mass is not None:
                lines.append(f"Density: {mass / found.volume:.1f} kg/m^3 (mass / volume)")
    centre = segment.centre_of_mass
    if centre is not None:
        x, y, z = (f"{100.0 * part + 0.0:.2f}" for part in centre.tolist())
        lines.append(f"Centre of mass in the segment: ({x}, {y}, {z}) cm")
    if segment.inertia is not None:
        moments = ", ".join(f"{moment:.4g}" for moment in sorted(segment.inertia))
        lines.append(f"Principal moments of inertia: {moments} kg m^2")
    return lines
