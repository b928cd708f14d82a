"""A comparison as a page: one HTML file with all bodies, their curves and the table of differences.

It is made as the page of a motion (`generator.motion_files.page`), of the same scripts.
"""

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

from generator.comparison.comparison import Comparison
from generator.comparison.difference import Quantity
from generator.comparison.pair import known_springs, name_axis
from generator.contact.arrows import ArrowScale, part_forces_at
from generator.contact.scene import NO_SCENE
from generator.motion_files import FigureMotion
from generator.motion_files.glb import format_glb
from generator.motion_files.page import (
    SHARED_SCRIPTS,
    STYLES,
    Frames,
    arrow_scale,
    encode_doubles,
    encode_floats,
    encode_glb,
    fill_page,
    first_poses,
    force_row,
    kept_frames,
    script_json,
    touches,
)
from generator.motion_files.tables import Column
from generator.recording import RecordingPart
from generator.rotations import Array
from springs import SpringSet

_GROUPS = {
    RecordingPart.ENERGY: "energies",
    RecordingPart.LOSSES: "energies",
    RecordingPart.CONTACT: "contact",
}


def format_comparison(found: Comparison) -> str:
    """Return the text of the page of a comparison.

    Raises:
        ModelError: A motion is of another figure.
        MoverError: The times of two frames are equal in single precision.
    """
    frames = kept_frames(found.times.size)
    data = {
        "notes": list(_notes(found, frames)),
        "times": encode_doubles(found.times[frames]),
        "motions": list(_motions(found, frames)),
        "arrows": arrow_scale(
            ArrowScale.of_figure(found.aligned[0].figure, first_poses(found.aligned[0]))
        ),
        "columns": list(_columns(found, frames)),
        "tables": list(_tables(found)),
    }
    title = " and ".join(found.names)
    scripts = (*SHARED_SCRIPTS, "force_strip.js", "compare.js")
    return fill_page(
        "compare.html",
        scripts,
        (*STYLES, "compare.css"),
        title,
        {"comparison": script_json({"title": title, **data})},
    )


def _notes(found: Comparison, frames: Frames) -> Iterator[str]:
    yield from found.notes
    if frames.size < found.times.size:
        yield f"{frames.size:,} of {found.times.size:,} frames are drawn."
    if any(column.part is RecordingPart.CONTACT for column, _ in found.curves.values()):
        yield "Peak forces are of all steps; curves have the frames only."
    shown = _shown_scene(found)
    if any(one.scene.props and one.scene != found.motions[shown].scene for one in found.motions):
        yield f"The props are those of {found.names[shown]}."


def _shown_scene(found: Comparison) -> int:
    """Return the index of the first motion with props, whose scene is drawn."""
    return next((k for k, motion in enumerate(found.motions) if motion.scene.props), 0)


def _motions(found: Comparison, frames: Frames) -> Iterator[dict[str, Any]]:
    """Yield the name, the body, the contact and the origin of each motion."""
    for k, (name, motion) in enumerate(zip(found.names, found.aligned, strict=True)):
        if frames.size < found.times.size:
            moved = {joint: values[frames] for joint, values in motion.displacements.items()}
            motion = replace(motion, times=found.times[frames], displacements=moved, recording=None)
        if k != _shown_scene(found):
            motion = replace(motion, scene=NO_SCENE)
        yield {
            "name": name,
            "glb": encode_glb(format_glb(motion)[0]),
            **_contact(found.motions[k], found.times[frames]),
            "facts": [
                ["Figure", motion.header.figure],
                ["Springs", f"{motion.header.springs}, law {motion.header.law}"],
                ["Outcome", found.motions[k].header.message],
            ],
        }


def _contact(motion: FigureMotion, times: Array) -> dict[str, Any]:
    """Return contact forces at times and first touches until the last of them, if any."""
    run = motion.recording
    if run is None or run.contact is None:
        return {"forces": [], "touches": []}
    forces = part_forces_at(run.contact, run.times, times)
    return {
        "forces": [
            force_row(name.replace("_", " "), *some)
            for name, some in forces.items()
            if some[0].any()
        ],
        "touches": [one for one in touches(run) if times[0] <= one["time"] <= times[-1]],
    }


def _columns(found: Comparison, frames: Frames) -> Iterator[dict[str, Any]]:
    """Yield the columns that can be chosen, in the order of the tables of motions."""
    springs = known_springs(found.motions)
    for name, (column, values) in found.curves.items():
        yield {
            "name": name,
            "label": _label(found, springs, column),
            "group": _group(column),
            "unit": column.unit,
            "values": [
                encode_floats(column.scale * values[motion][frames]) if motion in values else None
                for motion in found.names
            ],
        }


def _label(found: Comparison, springs: SpringSet | None, column: Column) -> str:
    """Return the words of the tables for a column, and its name."""
    joint, _, axis = column.name.rpartition(".")
    if not column.is_displacement or joint not in found.aligned[0].chains:
        return column.name
    about, sense = name_axis(found.aligned[0], springs, joint, int(axis) - 1)
    return f"{joint} {about}{', reversed' if sense < 0 else ''} ({column.name})"


def _group(column: Column) -> str:
    if column.part is not None:
        return _GROUPS[column.part]
    return column.name.rpartition(".")[0]


def _tables(found: Comparison) -> Iterator[dict[str, Any]]:
    """Yield the tables of each motion, with the times and columns that their rows lead to."""
    for name, first in found.divergences.items():
        yield {
            "text": found.describe_divergence(name),
            "divergence": first and {"time": first.divergence, "column": first.column},
            "parts": [_table(found, name, quantity) for quantity in Quantity],
        }


def _table(found: Comparison, name: str, quantity: Quantity) -> dict[str, Any]:
    head, rows = found.table(name, quantity)
    return {
        "head": head,
        "rows": [
            {
                "cells": cells,
                "column": one.column,
                "time": one.reference_time if one.time is None else one.time,
            }
            for cells, one in rows
        ],
    }
