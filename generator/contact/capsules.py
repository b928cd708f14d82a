"""Capsules of segments, by which the segments of a figure touch each other."""

from collections.abc import Mapping
from math import pi

import numpy as np

from generator.contact.self_contact import Capsule
from generator.contact.spheres import SegmentSpheres, SphereSource
from generator.diagnostics import InputError
from generator.figure import ContactSphere, Figure, Segment
from generator.geometry.read import read_segment_surface
from generator.geometry.surface import Array
from generator.geometry.validate import build_solid


def fit_capsules(figure: Figure, fits: Mapping[str, SegmentSpheres]) -> dict[str, Capsule]:
    """Return the capsule of each moving segment that has contact spheres.

    `fits` are the contact spheres of the figure.

    A closed psurf has the capsule of its volume, and of its extent along the axis of its least
    moment of inertia, on which it lies. Other segments, and those with own contact spheres, have
    the capsule between the two spheres that are farthest apart, with the mean radius of all.

    Raises InputError with the psurfs that cannot be read.
    """
    capsules: dict[str, Capsule] = {}
    by_psurf: dict[str, Capsule | None] = {}
    for name, fit in fits.items():
        segment, capsule = figure.segments[name], None
        if fit.source is SphereSource.FITTED and segment.psurf is not None:
            if segment.psurf not in by_psurf:
                by_psurf[segment.psurf] = _capsule_of_psurf(figure, segment)
            capsule = by_psurf[segment.psurf]
        if capsule is None and fit.spheres:
            capsule = _capsule_of_spheres(fit.spheres)
        if capsule is not None:
            capsules[name] = capsule
    return capsules


def _capsule_of_psurf(figure: Figure, segment: Segment) -> Capsule | None:
    """Return the capsule of a psurf; None if it is not closed."""
    surface = read_segment_surface(figure, segment)
    try:
        body = build_solid(surface, fix_winding=True).mass_properties(1.0)
    except InputError:
        return None
    axis = np.linalg.eigh(body.inertia)[1][:, 0]
    places = (surface.vertices[np.unique(surface.corners)] - body.centre) @ axis
    low, high = float(places.min()), float(places.max())
    radius = _radius(body.mass, high - low)
    half = max(0.5 * (high - low) - radius, 0.0)
    return _between(body.centre + 0.5 * (low + high) * axis, half * axis, radius)


def _radius(volume: float, length: float) -> float:
    """Radius [m] of a capsule of a volume [m^3] and a total length [m]; of a sphere if it is wider.

    The volume pi r^2 length - 2/3 pi r^3 grows with r as far as the sphere.
    """
    low, high = 0.0, 0.5 * length
    if 4.0 / 3.0 * pi * high**3 <= volume:
        return float((0.75 * volume / pi) ** (1.0 / 3.0))
    roots = np.roots([-2.0 / 3.0 * pi, pi * length, 0.0, -volume])
    real = roots.real[np.abs(roots.imag) < 1e-9 * length]
    return float(real[(real > low) & (real <= high)].min())


def _capsule_of_spheres(spheres: tuple[ContactSphere, ...]) -> Capsule:
    """Return the capsule between the spheres that are farthest apart."""
    centres = np.array([sphere.centre for sphere in spheres])
    distances = np.linalg.norm(centres[:, None] - centres, axis=-1)
    i, j = np.unravel_index(int(distances.argmax()), distances.shape)
    radius = float(np.mean([sphere.radius for sphere in spheres]))
    return _between(0.5 * (centres[i] + centres[j]), 0.5 * (centres[j] - centres[i]), radius)


def _between(middle: Array, half_line: Array, radius: float) -> Capsule:
    (x, y, z), (u, v, w) = middle.tolist(), half_line.tolist()
    return Capsule((x, y, z), (u, v, w), radius)
