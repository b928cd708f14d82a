"""Mass properties of MJCF's shapes: spheres, capsules, cylinders, ellipsoids and boxes."""

from collections.abc import Sequence
from math import pi
from typing import Final

import numpy as np

from generator.diagnostics import Diagnostics, shorten, spelling_hint
from generator.inertia import MassProperties
from generator.model_files.mjcf.joints import AngleConvention, parse_orientation, rotation_from_z_to
from generator.model_files.xml_read import (
    SourceText,
    XmlElement,
    parse_number,
    parse_numbers,
    parse_vector,
    unit_direction,
)
from generator.rotations import Array, pose_matrix

DENSITY = 1000.0
"""Of a geom that tells neither mass nor density [kg/m3]."""

SIZES: Final = {"sphere": 1, "capsule": 2, "cylinder": 2, "ellipsoid": 3, "box": 3}
"""How many sizes each solid shape has."""

FROMTO_SHAPES: Final = ("capsule", "cylinder", "ellipsoid", "box")
"""Shapes that `fromto` may tell."""

WEIGHTLESS: Final = ("plane", "hfield")
"""Shapes that stand in the world only and have no mass."""

UNREAD: Final = ("mesh", "sdf")
"""Shapes whose mass is that of a file, or of a plugin."""


def geom_mass(
    element: XmlElement, angles: AngleConvention, diagnostics: Diagnostics
) -> MassProperties | None:
    """The mass properties of a geom in its body's frame; None for a weightless one.

    `element` has the values of its default class. What cannot be read is a fault.
    """
    shape = element.get("type") or "sphere"
    if shape in WEIGHTLESS or _is_massless(element, diagnostics):
        return None
    if shape in UNREAD or "mesh" in element.attributes:
        diagnostics.error(
            "the mass of this body would come from a mesh, and meshes are not read",
            element.span_of("mesh" if "mesh" in element.attributes else "type"),
            "give the body an `inertial` with its mass and inertia",
        )
        return None
    if shape not in SIZES:
        diagnostics.error(
            f"unknown geom type `{shorten(shape)}`",
            element.span_of("type"),
            spelling_hint(shape, SIZES),
        )
        return None
    if element.get("shellinertia") == "true":
        diagnostics.error(
            "the inertia of a shell is not computed here",
            element.span_of("shellinertia"),
            "give the body an `inertial` with its mass and inertia",
        )
        return None
    place = _placed(element, shape, angles, diagnostics)
    if place is None:
        return None
    pose, size = place
    volume, unit = _volume_and_moments(shape, size)
    mass = parse_number(element, "density", diagnostics, DENSITY) * volume
    if "mass" in element.attributes:
        mass = parse_number(element, "mass", diagnostics)
    if not mass > 0.0:
        diagnostics.error("a mass is not negative", element.span_of("mass"))
        return None
    return MassProperties(mass, np.zeros(3), np.diag(unit) * mass).transform(pose)


def _is_massless(element: XmlElement, diagnostics: Diagnostics) -> bool:
    if "mass" in element.attributes:
        return parse_number(element, "mass", diagnostics) == 0.0
    return parse_number(element, "density", diagnostics, DENSITY) == 0.0


def _placed(
    element: XmlElement, shape: str, angles: AngleConvention, diagnostics: Diagnostics
) -> tuple[Array, tuple[float, ...]] | None:
    """The pose of a shape in its body, shape (4, 4), and its sizes [m]."""
    count, ends = SIZES[shape], element.attributes.get("fromto")
    size = element.attributes.get("size", SourceText("", element.span))
    told = parse_numbers(size, diagnostics, 0, 3)
    if told is None:
        return None
    needed = count
    if ends is not None and shape in FROMTO_SHAPES:
        needed = 1
    if len(told) < needed or not all(part > 0.0 for part in told[:needed]):
        plural = "s" if needed > 1 else ""
        diagnostics.error(
            f"a {shape} needs {needed} positive size{plural}",
            element.span_of("size"),
            "half lengths and radii [m]",
        )
        return None
    if ends is None or shape not in FROMTO_SHAPES:
        at = parse_vector(element, "pos", diagnostics)
        return pose_matrix(parse_orientation(element, angles, diagnostics), at), told[:count]
    read = parse_numbers(ends, diagnostics, 6)
    if read is None:
        return None
    start, end = np.array(read[:3]), np.array(read[3:])
    along = unit_direction((start - end).tolist(), ends.span, diagnostics)
    half = float(np.linalg.norm(end - start)) / 2.0
    sizes = (told[0], half) if count == 2 else (told[0], told[0], half)
    return pose_matrix(rotation_from_z_to(along), (start + end) / 2.0), sizes


def _volume_and_moments(
    shape: str, size: Sequence[float]
) -> tuple[float, tuple[float, float, float]]:
    """Volume [m3] of a shape, and principal moments for the mass one [m2]."""
    match shape:
        case "sphere":
            r = size[0]
            round_about = 0.4 * r * r
            return 4.0 / 3.0 * pi * r**3, (round_about, round_about, round_about)
        case "cylinder":
            r, h = size[:2]
            across = r * r / 4.0 + h * h / 3.0
            return 2.0 * pi * r * r * h, (across, across, r * r / 2.0)
        case "capsule":
            return _capsule_volume_and_moments(size[0], size[1])
        case "ellipsoid":
            a, b, c = (part * part for part in size[:3])
            volume = 4.0 / 3.0 * pi * size[0] * size[1] * size[2]
            return volume, ((b + c) / 5.0, (a + c) / 5.0, (a + b) / 5.0)
        case _:
            a, b, c = (part * part for part in size[:3])
            volume = 8.0 * size[0] * size[1] * size[2]
            return volume, ((b + c) / 3.0, (a + c) / 3.0, (a + b) / 3.0)


def _capsule_volume_and_moments(r: float, h: float) -> tuple[float, tuple[float, float, float]]:
    """A cylinder of half length h with a half sphere of the radius r at either end.

    The centre of a half sphere is 3/8 r from its flat side.
    """
    middle, ends = 2.0 * pi * r * r * h, 4.0 / 3.0 * pi * r**3
    volume = middle + ends
    along = middle * r * r / 2.0 + ends * 0.4 * r * r
    arm = h + 0.375 * r
    across = middle * (r * r / 4.0 + h * h / 3.0)
    across += ends * (0.4 * r * r - (0.375 * r) ** 2 + arm * arm)
    return volume, (across / volume, across / volume, along / volume)
