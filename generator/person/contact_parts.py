"""The parts of a person that touch props as wholes; `data/contact_parts.toml` has their laws.

A part holds the contact spheres in regions of segments. A region is an interval of the place along
the segment's long axis: 0 is the segment's origin, 1 the sphere that is farthest from it. A sphere
belongs to the first part in whose region it is; of paired parts there is one on each side. A region
within a part, as the buttocks, has spheres of its own: cores of those of the part there, which
touch them from inside where they are farthest behind, and are `core` times as large. So only what
comes from behind reaches them.

In its reference pose a part has the stiffness of the table: a person stands and is pressed in the
direction `reference`, to the left, up and forward; without one it is the mean of all directions.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from math import inf
from typing import Any

import numpy as np

from generator.contact.edges import add_limb_spheres, is_limb
from generator.contact.spheres import directions, fit_spheres
from generator.contact_file.parts import BodyContact, BodyPart, Evidence
from generator.figure import ContactSphere, Figure
from generator.geometry.surface import Surface
from generator.kinematics.placement import forward_kinematics, initial_displacements
from generator.kinematics.tree import build_tree
from generator.person.body import side_names
from generator.person.sources import load_data_file
from springs.backends import Array
from springs.contact_part import PartLaw, compression_of

_DATA_FILE = "contact_parts"

_REFERENCE_DEPTH = 0.02
"""Depth in the last stage at which a part in its reference pose has its stiffness [m]."""

_ASIDE = 0.5
"""Distance from the middle of the segment over the largest one, from which a sphere is at a side or
behind."""


def person_contact(
    figure: Figure, surfaces: Mapping[str, Surface], *, stops_edges: bool = True
) -> tuple[Figure, BodyContact]:
    """Return the figure of a person with contact spheres, and the parts of its body.

    Args:
        figure: Figure of the person.
        surfaces: Surfaces of its segments, by their names without side.
        stops_edges: Whether limbs have spheres along them as well, at which edges of boxes stop.
    """
    spheres: dict[str, list[ContactSphere]] = {}
    for name, surface in surfaces.items():
        fitted, sides = fit_spheres(surface), side_names(name)
        if stops_edges and is_limb(figure, sides[0], surface):
            fitted = add_limb_spheres(surface, fitted)
        for segment in sides:
            own = figure.segments[segment].contact_spheres or fitted
            spheres[segment] = [_rounded(sphere) for sphere in own]
    contact = _body_contact(spheres)
    segments = (
        replace(figure.segments[name], contact_spheres=tuple(some))
        for name, some in spheres.items()
    )
    figure = figure.with_parts(*segments)
    references = {
        name: row["reference"]
        for row in load_data_file(_DATA_FILE).content["part"]
        for name, _ in _regions(row)
        if "reference" in row
    }
    tree = build_tree(figure)
    poses = forward_kinematics(tree, initial_displacements(tree)).poses
    parts = tuple(
        replace(
            part,
            law=replace(part.law, norm_scale=_norm_scale(part, spheres, poses, references)),
        )
        for part in contact.parts
    )
    return figure, BodyContact(parts)


def _norm_scale(
    part: BodyPart,
    spheres: Mapping[str, Sequence[ContactSphere]],
    poses: Mapping[str, Array],
    references: Mapping[str, Sequence[float]],
) -> float:
    """Return the largest depth over the norm of the depths of a part in its reference pose."""
    own = [(segment, spheres[segment][number]) for segment, number in part.spheres]
    centres = np.array([(poses[name] @ np.append(one.centre, 1.0))[:3] for name, one in own])
    along = np.array([references[part.name]]) if part.name in references else directions(200)
    heights = along @ centres.T + np.array([one.radius for _, one in own])
    depth = part.law.stages[-1][0] + _REFERENCE_DEPTH
    depths = heights - heights.max(axis=1)[:, None] + depth
    return round(float(np.mean(depth / compression_of(depths)[0])), 3)


def _rounded(sphere: ContactSphere) -> ContactSphere:
    """Return a sphere to a hundredth of a millimetre."""
    x, y, z = (round(value, 5) for value in sphere.centre)
    return ContactSphere((x, y, z), round(sphere.radius, 5))


def _body_contact(spheres: Mapping[str, list[ContactSphere]]) -> BodyContact:
    """Return the parts of a person by the contact spheres of its segments, and add cores to these.

    Args:
        spheres: Spheres of the segments, to which those of regions within parts are added.
    """
    owned: dict[str, list[tuple[str, int]]] = {}
    rows: dict[str, Mapping[str, Any]] = {}
    for row in load_data_file(_DATA_FILE).content["part"]:
        for name, region in _regions(row):
            rows[name] = row
            for segment, number in list(_spheres_in(region, name, spheres)):
                sphere = segment, number
                if "within" in row:
                    outer = owned[row["within"]]
                    if sphere in outer:
                        core = segment, len(spheres[segment])
                        spheres[segment].append(_core(spheres[segment][number], row["core"]))
                        outer.append(core)
                        owned.setdefault(name, []).append(core)
                elif not any(sphere in some for some in owned.values()):
                    owned.setdefault(name, []).append(sphere)
    parts: list[BodyPart] = []
    for name, own in owned.items():
        row = rows[name]
        stages = tuple(zip(row["from_m"], row["stiffness_N_m"], strict=True))
        law = PartLaw(stages, row["damping_s_m"], row["source"])
        low, high = row["band"]
        evidence, within = Evidence(row["class"]), row.get("within", "")
        parts.append(BodyPart(name, law, tuple(own), (low, high), evidence, within))
    return BodyContact(tuple(parts))


def _core(sphere: ContactSphere, share: float) -> ContactSphere:
    """Return a smaller sphere within one, which it touches where this is farthest behind."""
    x, y, z = sphere.centre
    return _rounded(ContactSphere((x - (1.0 - share) * sphere.radius, y, z), share * sphere.radius))


def _regions(row: Mapping[str, Any]) -> Iterator[tuple[str, Mapping[str, Any]]]:
    """Yield the name of a part, with a side where it is paired, and each of its regions."""
    for side in ("left", "right") if row.get("is_paired") else ("",):
        for region in row["where"]:
            yield f"{side}_{row['name']}" if side else row["name"], region


def _spheres_in(
    region: Mapping[str, Any], part: str, spheres: Mapping[str, Sequence[ContactSphere]]
) -> Iterator[tuple[str, int]]:
    """Yield segment and number of the spheres in a region, on the side of the part."""
    side, _, _ = part.partition("_")
    low, high = region.get("along", (-inf, inf))
    for segment, some in spheres.items():
        name = segment.removeprefix("left_").removeprefix("right_")
        is_paired_segment = name != segment
        if name != region["segment"]:
            continue
        if side in ("left", "right") and is_paired_segment and not segment.startswith(side):
            continue
        farthest = max(sphere.centre[2] for sphere in some)
        widest = max(abs(sphere.centre[1]) for sphere in some)
        deepest = max(abs(sphere.centre[0]) for sphere in some)
        for number, sphere in enumerate(some):
            x, y, z = sphere.centre
            if not low <= z / farthest <= high:
                continue
            is_on_side = y > 0.0 if side == "left" else y < 0.0
            if region.get("aside") and not (is_on_side and abs(y) > _ASIDE * widest):
                continue
            if region.get("behind") and not x < -_ASIDE * deepest:
                continue
            yield segment, number
