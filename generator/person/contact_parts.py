"""The parts of a person that touch props as wholes; `data/contact_parts.toml` has their laws.

A part holds the contact spheres in regions of segments. A region is an interval of the place along
the segment's long axis: 0 is the segment's origin, 1 the sphere that is farthest from it. A sphere
belongs to the first part in whose region it is; of paired parts there is one on each side. A part
within another has those of its spheres that are in its region.
"""

from collections.abc import Iterator, Mapping, Sequence
from math import inf
from typing import Any

from generator.contact_file.parts import BodyContact, BodyPart, Evidence
from generator.figure import ContactSphere
from generator.person.sources import load_data_file
from springs.contact_part import PartLaw

_DATA_FILE = "contact_parts"

_ASIDE = 0.5
"""Distance from the middle of the segment over the largest one, from which a sphere is at a side or
behind."""


def person_contact(spheres: Mapping[str, Sequence[ContactSphere]]) -> BodyContact:
    """Return the parts of a person by the contact spheres of its segments."""
    owned: dict[str, list[tuple[str, int]]] = {}
    rows: dict[str, Mapping[str, Any]] = {}
    for row in load_data_file(_DATA_FILE).content["part"]:
        for name, region in _regions(row):
            rows[name] = row
            for segment, number in _spheres_in(region, name, spheres):
                sphere = segment, number
                within = row.get("within")
                if (
                    sphere in owned[within]
                    if within
                    else not any(sphere in some for some in owned.values())
                ):
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
