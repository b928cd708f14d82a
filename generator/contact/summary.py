"""The contact record of a run: frames from its trace, extremes over all its steps."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import reduce
from operator import add

import numpy as np
from numpy.typing import NDArray

from generator.contact.layers import pressed_layers
from generator.contact.record import (
    REST_DURATION,
    STANDARD_ACCELERATION,
    ContactRecord,
    HeadImpact,
    PartContact,
    SegmentContact,
    Touches,
    extremes_of,
    first_impact,
    first_touches,
    head_injury_criterion,
    head_segments,
    mean_at_end,
    peak_of,
    summarize_steps,
)
from generator.contact.states import ContactModel, ContactStates, ContactTrace
from generator.contact_file.parts import BodyContact
from generator.figure import Figure, Vector
from generator.rotations import Array


def build_contact_record(
    model: ContactModel,
    contact: ContactTrace,
    frames: ContactStates | None,
    figure: Figure,
    poses: Mapping[str, Array],
    frame_times: Array,
    gravity: Vector,
    up: Vector,
    body: BodyContact | None = None,
    *,
    with_injury: bool = True,
) -> ContactRecord:
    """Return the contact of a run.

    Args:
        model: Props and spheres.
        contact: Contact in n frames and after each step.
        frames: Contact in the frames; None for a record of the steps alone.
        figure: Figure that moved.
        poses: Poses of the segments, shape (n, 4, 4).
        frame_times: Times of the frames, shape (n,) [s].
        gravity: Acceleration [m/s^2].
        up: Unit vector upwards.
        body: Parts of the body whose laws the model has; None without any.
        with_injury: Whether the head injury criterion is computed.
    """
    names, owners, upward = list(model.spheres), model.owners, np.array(up)
    steps, times = contact.steps, contact.steps.times
    ground_forces = reduce(add, np.moveaxis(steps.forces, 1, 0))  # faster than a sum over an axis
    total = np.linalg.norm(ground_forces, axis=-1)
    impulses = contact.impulses[-1]
    touches = first_touches(times, steps.depths, steps.rates)
    segments = summarize_steps(
        names, owners, times, steps.forces, steps.depths, steps.rates, impulses, touches
    )
    weight = _weight(figure, gravity)
    max_force_time, max_force = peak_of(times, total)
    depths = steps.depths[int(np.argmax(steps.depths.max(axis=1)))]
    deepest = int(np.argmax(depths))
    record = ContactRecord(
        forces={},
        ground_reaction=np.zeros((0, 6)),
        depths={},
        segments=segments,
        max_force=max_force,
        max_force_time=max_force_time,
        max_depth=max(float(depths[deepest]), 0.0),
        max_depth_segment=names[int(owners[deepest])],
        max_depth_part=model.parts[deepest],
        weight_carried=_weight_carried(weight, times, ground_forces @ upward),
        creep=_creep(contact, upward),
        dissipated=float(contact.losses[-1].sum()),
        sensitivity=None if contact.sensitivity is None else contact.sensitivity[:, 0],
        height_sensitivity=None if contact.sensitivity is None else contact.sensitivity[:, 1],
        impact_shift=_impact_shift(names, owners, segments, contact),
        head_injury=_head_injury(figure, contact) if model.laws and with_injury else {},
        extreme_forces=np.array([extremes_of(times, along) for along in ground_forces.T]),
        parts={} if body is None else _part_contacts(model, contact, body, weight, touches),
        heads=_head_impacts(figure, contact, segments),
        pressed_layers=tuple(pressed_layers(model, steps, poses, frame_times)),
    )
    if frames is None:
        return record
    from generator.contact.spheres import deepest_overlap  # slow

    return replace(
        record,
        forces={name: frames.forces[:, g] for g, name in enumerate(names)},
        ground_reaction=frames.wrenches.sum(axis=1),
        depths={
            name: np.maximum(frames.depths[:, owners == g].max(axis=1), 0.0)
            for g, name in enumerate(names)
        },
        overlap=deepest_overlap(model.spheres, poses, figure, frame_times),
        part_forces=dict(zip(model.groups, np.moveaxis(frames.group_forces, 1, 0), strict=True)),
        force_points=dict(zip(model.groups, np.moveaxis(frames.group_points, 1, 0), strict=True)),
    )


def _part_contacts(
    model: ContactModel, contact: ContactTrace, body: BodyContact, weight: float, touches: Touches
) -> dict[str, PartContact]:
    """Contact of each part of a body of some weight [N] over all steps."""
    steps, names, contacts = contact.steps, list(model.laws), dict[str, PartContact]()
    spheres = [one for some in model.spheres.values() for one in some]
    # A sphere belongs to a part, and may belong to a region of this as well.
    found = dict[str, SegmentContact]()
    for are_regions in (False, True):
        places = {
            part.name: place
            for place, part in enumerate(
                part for part in body.parts if bool(part.within) == are_regions
            )
        }
        owners = [places.get(one.region if are_regions else one.part, -1) for one in spheres]
        found |= summarize_steps(
            list(places),
            np.array(owners, dtype=np.intp),
            steps.times,
            steps.part_forces[:, [names.index(name) for name in places]],
            steps.depths,
            steps.rates,
            impulses=np.full((len(places), 3), np.nan),
            touches=touches,
        )
    for part in body.parts:
        own = found[part.name]
        contacts[part.name] = PartContact(
            own.first_time,
            own.impact_speed,
            own.peak_force,
            own.peak_time,
            own.peak_force / weight if weight else None,
            part.band,
            part.evidence,
            part.within,
        )
    return contacts


def _weight(figure: Figure, gravity: Vector) -> float:
    """Weight of a figure [N]."""
    mass = sum(body.mass or 0.0 for body in figure.bodies.values())
    return mass * float(np.linalg.norm(gravity))


def _weight_carried(weight: float, times: Array, vertical: Array) -> float | None:
    """Mean vertical force at the end over the weight [N]; None without gravity."""
    return mean_at_end(times, vertical) / weight if weight else None


def _creep(contact: ContactTrace, up: Array) -> float:
    """Mean horizontal speed of the centre of mass at the end [m/s]."""
    times, centres = contact.steps.times, contact.steps.centres
    along = centres - (centres @ up)[:, None] * up
    last = float(times[-1])
    start = max(last - REST_DURATION, float(times[0]))
    if not start < last:
        return 0.0
    first = np.array([np.interp([start], times, along[:, k])[0] for k in range(3)])
    return float(np.linalg.norm(along[-1] - first)) / (last - start)


def _impact_shift(
    names: Sequence[str],
    owners: NDArray[np.intp],
    segments: Mapping[str, SegmentContact],
    contact: ContactTrace,
) -> float | None:
    """Difference of the first impact from that of the disturbed run [s]; None without either."""
    if contact.disturbed is None:
        return None
    steps = contact.disturbed
    unknown = np.full((len(names), 3), np.nan)
    others = summarize_steps(
        names, owners, steps.times, steps.forces, steps.depths, steps.rates, impulses=unknown
    )
    one, other = first_impact(segments), first_impact(others)
    return None if one is None or other is None else abs(other - one)


def _head_injury(figure: Figure, contact: ContactTrace) -> dict[str, float]:
    """Head injury criterion of each segment that is a head."""
    return {
        name: head_injury_criterion(contact.steps.times, accelerations)
        for name, accelerations in _head_motions(figure, contact)
    }


def _head_impacts(
    figure: Figure, contact: ContactTrace, segments: Mapping[str, SegmentContact]
) -> dict[str, HeadImpact]:
    """Impact of each segment that is a head."""
    impacts: dict[str, HeadImpact] = {}
    for name, accelerations in _head_motions(figure, contact):
        time, largest = peak_of(contact.steps.times, np.linalg.norm(accelerations, axis=1))
        force = segments[name].peak_force if name in segments else 0.0
        weight = (figure.bodies[name].mass or 0.0) * STANDARD_ACCELERATION
        impacts[name] = HeadImpact(
            largest / STANDARD_ACCELERATION, time, force / weight if weight else 0.0
        )
    return impacts


def _head_motions(figure: Figure, contact: ContactTrace) -> Iterator[tuple[str, Array]]:
    """Yield each head with the accelerations of its centre of mass, shape (m, 3) [m/s^2]."""
    bodies = list(figure.bodies)
    for name in head_segments(bodies):
        yield name, contact.steps.accelerations[:, bodies.index(name)]
