"""The contact record of a run: frames from its trace, extremes over all its steps."""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from generator.contact.layers import pressed_layers
from generator.contact.record import (
    REST_DURATION,
    ContactRecord,
    SegmentContact,
    extremes_of,
    first_impact,
    head_injury_criterion,
    head_segments,
    mean_at_end,
    peak_of,
    summarize_steps,
)
from generator.contact.states import ContactModel, ContactStates, ContactTrace
from generator.figure import Figure, Vector
from generator.rotations import Array


def build_contact_record(
    model: ContactModel,
    contact: ContactTrace,
    frames: ContactStates,
    figure: Figure,
    poses: Mapping[str, Array],
    frame_times: Array,
    gravity: Vector,
    up: Vector,
) -> ContactRecord:
    """Return the contact of a run.

    Args:
        model: Props and spheres.
        contact: Contact in n frames and after each step.
        frames: Contact in the frames.
        figure: Figure that moved.
        poses: Poses of the segments, shape (n, 4, 4).
        frame_times: Times of the frames, shape (n,) [s].
        gravity: Acceleration [m/s^2].
        up: Unit vector upwards.
    """
    from generator.contact.spheres import deepest_overlap  # slow

    names, owners, upward = list(model.spheres), model.owners, np.array(up)
    steps, times = contact.steps, contact.steps.times
    ground_forces = steps.forces.sum(axis=1)
    total = np.linalg.norm(ground_forces, axis=-1)
    impulses = contact.impulses[-1]
    segments = summarize_steps(
        names, owners, times, steps.forces, steps.depths, steps.rates, impulses
    )
    max_force_time, max_force = peak_of(times, total)
    deepest = np.unravel_index(int(np.argmax(steps.depths)), steps.depths.shape)
    return ContactRecord(
        forces={name: frames.forces[:, g] for g, name in enumerate(names)},
        ground_reaction=frames.wrenches.sum(axis=1),
        depths={
            name: np.maximum(frames.depths[:, owners == g].max(axis=1), 0.0)
            for g, name in enumerate(names)
        },
        segments=segments,
        max_force=max_force,
        max_force_time=max_force_time,
        max_depth=max(float(steps.depths[deepest]), 0.0),
        max_depth_segment=names[int(owners[int(deepest[1])])],
        max_depth_part=model.parts[int(deepest[1])],
        weight_carried=_weight_carried(figure, gravity, contact, upward),
        creep=_creep(contact, upward),
        dissipated=float(contact.losses[-1].sum()),
        sensitivity=None if contact.sensitivity is None else contact.sensitivity[:, 0],
        height_sensitivity=None if contact.sensitivity is None else contact.sensitivity[:, 1],
        impact_shift=_impact_shift(names, owners, segments, contact),
        overlap=deepest_overlap(model.spheres, poses, figure, frame_times),
        head_injury=_head_injury(figure, contact),
        head_accelerations=_head_accelerations(figure, contact),
        extreme_forces=np.array([extremes_of(times, along) for along in ground_forces.T]),
        pressed_layers=tuple(pressed_layers(model, steps, poses, frame_times)),
    )


def _weight_carried(
    figure: Figure, gravity: Vector, contact: ContactTrace, up: Array
) -> float | None:
    """Mean vertical force at the end over the weight; None without gravity."""
    mass = sum(body.mass or 0.0 for body in figure.bodies.values())
    weight = mass * float(np.linalg.norm(gravity))
    if weight == 0.0:
        return None
    vertical = contact.steps.forces.sum(axis=1) @ up
    return mean_at_end(contact.steps.times, vertical) / weight


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


def _head_accelerations(figure: Figure, contact: ContactTrace) -> dict[str, float]:
    """Peak acceleration of each segment that is a head [m/s^2]."""
    return {
        name: peak_of(contact.steps.times, np.linalg.norm(accelerations, axis=1))[1]
        for name, accelerations in _head_motions(figure, contact)
    }


def _head_motions(figure: Figure, contact: ContactTrace) -> Iterator[tuple[str, Array]]:
    """Yield each head with the accelerations of its centre of mass, shape (m, 3) [m/s^2]."""
    bodies = list(figure.bodies)
    for name in head_segments(bodies):
        yield name, contact.steps.accelerations[:, bodies.index(name)]
