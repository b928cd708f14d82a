"""Mass properties of MJCF's shapes: spheres, capsules, cylinders, ellipsoids and boxes."""

from collections.abc import Sequence
from math import pi
from typing import Final

import numpy as np

from generator.diagnostics import Findings, nearest, shorten
from generator.inertia import MassProperties
from generator.model_files.mjcf.joints import Angles, orientation_of, z_onto
from generator.model_files.xml_read import Element, Written, direction, number, numbers, vector
from generator.rotations import Array, homogeneous

DENSITY = 1000.0
"""Of a geom that tells neither mass nor density [kg/m3]."""

SIZES: Final = {"sphere": 1, "capsule": 2, "cylinder": 2, "ellipsoid": 3, "box": 3}
"""How many sizes each solid shape has."""

LONG: Final = ("capsule", "cylinder", "ellipsoid", "box")
"""Shapes that `fromto` may tell."""

WEIGHTLESS: Final = ("plane", "hfield")
"""Shapes that stand in the world only and have no mass."""

UNREAD: Final = ("mesh", "sdf")
"""Shapes whose mass is that of a file, or of a plugin."""


def geom_mass(element: Element, angles: Angles, findings: Findings) -> MassProperties | None:
    """The mass properties of a geom in its body's frame; None for a weightless one.

    `element` has the values of its default class. What cannot be read is a fault.
    """
    shape = element.get("type") or "sphere"
    if shape in WEIGHTLESS or _weightless(element, findings):
        return None
    if shape in UNREAD or "mesh" in element.attributes:
        findings.error(
            "the mass of this body would come from a mesh, and meshes are not read",
            element.place("mesh" if "mesh" in element.attributes else "type"),
            "give the body an `inertial` with its mass and inertia",
        )
        return None
    if shape not in SIZES:
        findings.error(
            f"unknown geom type `{shorten(shape)}`", element.place("type"), nearest(shape, SIZES)
        )
        return None
    if element.get("shellinertia") == "true":
        findings.error(
            "the inertia of a shell is not computed here",
            element.place("shellinertia"),
            "give the body an `inertial` with its mass and inertia",
        )
        return None
    place = _placed(element, shape, angles, findings)
    if place is None:
        return None
    pose, size = place
    volume, unit = _solid(shape, size)
    mass = number(element, "density", findings, DENSITY) * volume
    if "mass" in element.attributes:
        mass = number(element, "mass", findings)
    if not mass > 0.0:
        findings.error("a mass is not negative", element.place("mass"))
        return None
    return MassProperties(mass, np.zeros(3), np.diag(unit) * mass).in_frame(pose)


def _weightless(element: Element, findings: Findings) -> bool:
    if "mass" in element.attributes:
        return number(element, "mass", findings) == 0.0
    return number(element, "density", findings, DENSITY) == 0.0


def _placed(
    element: Element, shape: str, angles: Angles, findings: Findings
) -> tuple[Array, tuple[float, ...]] | None:
    """The pose of a shape in its body, shape (4, 4), and its sizes [m]."""
    count, ends = SIZES[shape], element.attributes.get("fromto")
    size = element.attributes.get("size", Written("", element.span))
    told = numbers(size, findings, 0, 3)
    if told is None:
        return None
    needed = count
    if ends is not None and shape in LONG:
        needed = 1
    if len(told) < needed or not all(part > 0.0 for part in told[:needed]):
        plural = "s" if needed > 1 else ""
        findings.error(
            f"a {shape} needs {needed} positive size{plural}",
            element.place("size"),
            "half lengths and radii [m]",
        )
        return None
    if ends is None or shape not in LONG:
        at = vector(element, "pos", findings)
        return homogeneous(orientation_of(element, angles, findings), at), told[:count]
    read = numbers(ends, findings, 6)
    if read is None:
        return None
    start, end = np.array(read[:3]), np.array(read[3:])
    along = direction((start - end).tolist(), ends.span, findings)
    half = float(np.linalg.norm(end - start)) / 2.0
    sizes = (told[0], half) if count == 2 else (told[0], told[0], half)
    return homogeneous(z_onto(along), (start + end) / 2.0), sizes


def _solid(shape: str, size: Sequence[float]) -> tuple[float, tuple[float, float, float]]:
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
            return _capsule(size[0], size[1])
        case "ellipsoid":
            a, b, c = (part * part for part in size[:3])
            volume = 4.0 / 3.0 * pi * size[0] * size[1] * size[2]
            return volume, ((b + c) / 5.0, (a + c) / 5.0, (a + b) / 5.0)
        case _:
            a, b, c = (part * part for part in size[:3])
            volume = 8.0 * size[0] * size[1] * size[2]
            return volume, ((b + c) / 3.0, (a + c) / 3.0, (a + b) / 3.0)


def _capsule(r: float, h: float) -> tuple[float, tuple[float, float, float]]:
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
