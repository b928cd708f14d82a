"""Contact records that formats are tested with, not simulated."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from generator.contact.box import Box
from generator.contact.plane import Plane
from generator.contact.record import (
    MIN_VERTICAL_FORCE,
    ContactRecord,
    HeadImpact,
    Overlap,
    PartContact,
    SegmentContact,
)
from generator.contact.scene import Prop, Scene, floor_prop
from generator.contact_file.parts import Evidence
from generator.motion_files import FigureMotion
from generator.recording import CONTACT_ENERGY_KINDS, Recording
from springs.contact import DEFAULT_SURFACE
from tests.motions import clip

PROPS = Scene(
    (
        floor_prop((0.0, 1.0, 0.0)),
        Prop("crate", Box((0.3, 0.2, -0.4), (0.4, 0.4, 0.5), (0.1, 0.7, -0.2)), DEFAULT_SURFACE),
        Prop("wall", Plane((0.0, 0.0, -2.0), (0.2, 0.1, 1.0)), DEFAULT_SURFACE),
    )
)
"""A floor, a crate and a leaning wall."""


def contact_record(segments: Sequence[str], count: int, seed: int = 0) -> ContactRecord:
    """A record of any numbers; no contact at the first frame, and none of a last of segments."""
    rng = np.random.default_rng(seed)
    forces = {name: rng.normal(200.0, 90.0, (count, 3)) for name in segments}
    touching = segments[:-1] or segments
    for name in set(segments) - set(touching):
        forces[name][:] = 0.0
    reaction = np.hstack([sum(forces.values()), rng.normal(0.0, 50.0, (count, 3))])
    depths = {name: rng.uniform(0.0, 0.02, count) for name in segments}
    for array in (*forces.values(), reaction, *depths.values()):
        array[0] = 0.0
    contacts = {
        name: SegmentContact(
            *rng.uniform(0.0, 9.0, 4).tolist(), (0.1, *rng.normal(size=2).tolist())
        )
        for name in touching
    }
    parts = {"pelvis": forces[segments[0]], "sole": forces[segments[-1]]}
    points = {
        name: np.where(np.any(force, axis=1)[:, None], rng.normal(size=(count, 3)), 0.0)
        for name, force in parts.items()
    }
    untouched = SegmentContact(None, 0.0, 0.0, 0.0, (0.0, 0.0, 0.0))
    return ContactRecord(
        forces,
        reaction,
        depths,
        {name: contacts.get(name, untouched) for name in segments},
        max_force=2345.6,
        max_force_time=0.1,
        max_depth=0.021,
        max_depth_segment=segments[0],
        max_depth_part=f"end of {segments[0]}",
        weight_carried=1.0 / 3.0,
        creep=5.5e-3,
        dissipated=123.4,
        sensitivity=rng.uniform(0.0, 0.1, count),
        height_sensitivity=rng.uniform(0.0, 0.1, count),
        extreme_forces=rng.normal(0.0, 500.0, (3, 4)),
        impact_shift=7e-4,
        head_injury={segments[0]: 321.0 / 7.0},
        overlap=Overlap(0.069, segments[0], segments[-1], 0.2),
        heads={segments[0]: HeadImpact(130.0 / 7.0, 0.1, 1100.0 / 9.0)},
        parts={
            "pelvis": PartContact(
                0.1, 2.0 / 3.0, 999.9, 0.2, 1.0 / 3.0, (0.8, 1.7), Evidence.SCALED
            ),
            "sole": PartContact(None, 0.0, 0.0, 0.0, None, (1.0, 1.0), Evidence.ESTIMATE, "foot"),
        },
        part_forces=parts,
        force_points=points,
    )


def with_contact(motion: FigureMotion, seed: int = 0) -> FigureMotion:
    """The run of a motion with any contact of its moving segments with `PROPS`."""
    run, count = motion.recording, motion.times.size
    assert run is not None
    names = [name for name, segment in motion.figure.segments.items() if segment.mass > 0.0]
    energy = {**run.energy, **{kind: np.arange(count) / 3.0 for kind in CONTACT_ENERGY_KINDS}}
    contact = contact_record(names, count, seed)
    run = replace(run, energy=energy, contact=contact, scene=PROPS)
    return replace(motion, recording=run, scene=PROPS)


def touching_run() -> tuple[FigureMotion, Recording]:
    """A run with contact, whose vertical force is small at the second frame."""
    motion = with_contact(clip("slides"))
    assert motion.recording is not None
    contact = motion.recording.contact
    assert contact is not None
    contact.ground_reaction[1, 1] = 0.9 * MIN_VERTICAL_FORCE
    return motion, motion.recording
