"""Response of a posture to its loads, by which a page judges others without the program.

The posture stays, so that passive moments, strengths and areas of support do. Moments are linear in
weights, loads and the forces of supports, which the page finds anew.
"""

from collections.abc import Sequence
from math import degrees
from typing import Any

import numpy as np

from generator.figure import CENTRE_OF_MASS_SITE, Figure
from generator.hold.capacity import JointAxisStrength
from generator.hold.hands import SMALLEST_FORCE, hand_places
from generator.hold.posture import LEAST_USE, NO_MOMENT, Holder, Posture, standing_notes
from generator.hold.spine import ABDOMEN_ARM, BACK_ARMS, LIMITS, spine_of
from generator.hold.statics import (
    GRAVITY,
    GRIP_SITE,
    Load,
    Wrench,
    net_moments,
    site_point,
    total_wrench,
    weight_wrenches,
)
from generator.hold.support import FEET, Area, centroid, support_label
from generator.kinematics.placement import segment_jacobians
from generator.kinematics.stability import stability
from springs.strength.arm_force_field import LEVEL_BAND, arm_force_field_numbers
from springs.strength.strengths import LEAST_ENDURANCE_USE, endurance_row

HANDS = ("left_hand", "right_hand")
"""Segments in which a page has loads."""


def page_loads(figure: Figure, loads: Sequence[Load]) -> tuple[Load, ...]:
    """Return one load for each place of loads, and one of nothing in each hand without a load."""
    found: dict[tuple[str, str], Load] = {}
    for load in loads:
        sites = figure.segments[load.segment].sites
        site = load.site or (GRIP_SITE if GRIP_SITE in sites else CENTRE_OF_MASS_SITE)
        place = found.get((load.segment, site), Load(load.segment, site=load.site))
        x, y, z = (float(a + b) for a, b in zip(place.force, load.force, strict=True))
        found[load.segment, site] = Load(
            load.segment, place.mass + load.mass, (x, y, z), place.site
        )
    own = {load.segment for load in loads}
    more = (
        Load(hand)
        for hand in HANDS
        if hand in figure.bodies
        and hand not in own
        and {GRIP_SITE, CENTRE_OF_MASS_SITE} & figure.segments[hand].sites.keys()
    )
    return (*found.values(), *more)


def page_data(holder: Holder, posture: Posture) -> dict[str, Any]:
    """Return what a page needs to judge a posture with other loads.

    A row is the net moment about an axis of a joint in the sense of its motion, or a component of
    `Spine.components`; `base` has those of the weights, `columns` those of unit forces of a load,
    shape (3, n), or of unit forces at the world's origin and unit couples of a support, (6, n).
    """
    placement, jacobians = posture.placement, segment_jacobians(posture.placement)
    spine = None if posture.spine is None else spine_of(placement)

    def rows(*wrenches: Wrench) -> list[float]:
        net = net_moments(placement, wrenches, jacobians)
        moments = [axis.sense * float(net[axis.joint][axis.index]) for axis in holder.strengths]
        if spine is None:
            return moments
        return [*moments, *map(float, spine.components(placement, wrenches))]

    unit, nothing = np.eye(3), np.zeros(3)
    weights = weight_wrenches(placement, holder.model.figure)
    force, moment = total_wrench(weights)
    areas, lifted, own_notes = (), list[str](), list[str]()
    if posture.standing is not None:
        areas, lifted = holder.bearing_areas(placement)
        own_notes = standing_notes(posture.standing)
    loads = [
        {
            "segment": load.segment,
            "option": f"{load.segment}.{load.site}" if load.site else load.segment,
            "mass": load.mass,
            "force": load.force,
            "point": point.tolist(),
            "columns": [rows(Wrench(load.segment, part, point, nothing)) for part in unit],
        }
        for load in posture.loads
        for point in [site_point(placement, load.segment, load.site)]
    ]
    hands = [
        {
            "hand": place.hand,
            "axes": place.axes.tolist(),
            "point": place.point.tolist(),
            "assistance": place.assistance.tolist(),
            "factor": place.factor,
            "origin": place.origin.value,
        }
        for place in hand_places(placement, posture.loads, holder.body)
    ]
    return {
        "gravity": GRAVITY,
        "weight": {"force": force.tolist(), "moment": moment.tolist()},
        "base": rows(*weights),
        "axes": [_axis_data(axis, posture) for axis in holder.strengths],
        "loads": loads,
        "supports": [
            {
                **_area_data(area, posture),
                "columns": [
                    *(rows(Wrench(area.patch.segment, part, nothing, nothing)) for part in unit),
                    *(rows(Wrench(area.patch.segment, nothing, nothing, part)) for part in unit),
                ],
            }
            for area in areas
        ],
        "hull": _corners(np.concatenate([area.points(placement) for area in areas]))
        if areas
        else [],
        "forwards": None if (forwards := holder.forwards(placement)) is None else forwards.tolist(),
        "spine": None
        if spine is None
        else {"arms": BACK_ARMS, "front_arm": ABDOMEN_ARM, "limits": LIMITS},
        "hands": hands,
        "field": arm_force_field_numbers() if hands else None,
        "level_band": LEVEL_BAND,
        "notes_before": lifted,
        "notes_after": posture.notes[len(lifted) + len(own_notes) :],
        "no_moment": NO_MOMENT,
        "no_force": SMALLEST_FORCE,
        "least_use": LEAST_USE,
        "least_endurance_use": LEAST_ENDURANCE_USE,
    }


def _axis_data(axis: JointAxisStrength, posture: Posture) -> dict[str, Any]:
    name, index = axis.joint, axis.index
    angle = axis.sense * float(posture.placement.displacements[name][index])
    strength = None if name in posture.beyond else axis.strength
    return {
        "joint": name,
        "angle": degrees(angle),
        "passive": axis.sense * float(posture.passive[name][index])
        if name in posture.passive
        else 0.0,
        "endurance": endurance_row(name),
        "directions": [
            {
                "name": axis.direction(is_opposite),
                "capacity": None
                if strength is None
                else float(strength.capacity(angle, is_opposite)),
                "spread": axis.spread(is_opposite),
                "origin": "" if strength is None else strength.origins[is_opposite].value,
            }
            for is_opposite in (False, True)
        ],
    }


def _area_data(area: Area, posture: Posture) -> dict[str, Any]:
    points = area.points(posture.placement)
    return {
        "name": area.name,
        "label": support_label(area.name),
        "is_foot": area.patch.segment in FEET,
        "centre": centroid(points).tolist(),
        "corners": _corners(points),
    }


def _corners(points: np.ndarray) -> list[list[float]]:
    """Return z and x of the corners of the hull of points, anticlockwise seen from above [m]."""
    return stability(points.mean(axis=0), points).corners[:, [2, 0]].tolist()
