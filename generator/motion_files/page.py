"""A motion as a page: one HTML file with the body, its curves and a player, without a network.

The body is the motion's binary glTF, deflated (RFC 1950) and in base64. Scripts and styles are in
`page_assets`, those of other projects with their licences. A policy in the page lets only these
scripts run, by their SHA-256, and allows no connection (W3C, Content Security Policy Level 3).
"""

import json
import re
import zlib
from base64 import b64encode
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import cache
from hashlib import sha256
from html import escape
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from generator.contact.arrows import MIN_ARROW_FORCE, ArrowScale
from generator.diagnostics import MoverError
from generator.figure import Figure
from generator.figure_file.read import FIGURE_FILE
from generator.losses import Effect, Loss, Losses
from generator.motion_files.glb import format_glb
from generator.motion_files.motion import (
    NO_MASSES,
    PART_FORCES,
    FigureMotion,
    Header,
    unknown_props,
    unrepresented,
)
from generator.passive_curve import PassiveCurve, PublishedTorques, joint_label, passive_curves
from generator.recording import Ending, Recording, energy_kinds
from generator.rotations import Array, matrix_from_rotation_vector
from generator.springs_file.parse import SPRINGS_FILE
from generator.springs_file.read import NO_SPRINGS, read_springs
from generator.text_io import write_atomic
from springs import SphericalLaw, SpringSet

SHARED_SCRIPTS = (
    "three.min.js",
    "uPlot.min.js",
    "tools.js",
    "time_line.js",
    "stage.js",
    "body.js",
    "surroundings.js",
    "chart.js",
)
"""Scripts of all pages, in their order."""

SCRIPTS = (*SHARED_SCRIPTS, "force_strip.js", "page.js")
"""Scripts of the page of a motion."""

STYLES = ("uPlot.min.css", "page.css")
"""Styles of the page of a motion."""

MAX_PAGE_FRAMES = 6_000
"""Frames of a page; of a longer motion every second, third ... is kept."""

_ROUNDED = Loss(
    "digits: numbers other than times have 24 bits, some 7 digits", effect=Effect.ROUNDING
)

Frames = NDArray[np.int64]


def write(motion: FigureMotion, path: Path) -> Losses:
    """Write a motion as a page, whole or not at all.

    Raises:
        OSError: the file cannot be written.
        ModelError: the motion is of another figure.
        MoverError: the times of two frames are equal in single precision.
    """
    text, losses = page_of_motion(motion)
    write_atomic(path, text)
    return losses


def page_of_motion(motion: FigureMotion) -> tuple[str, Losses]:
    """Return the page of a motion as text, and what it does not hold.

    Raises ModelError and MoverError, as `write`.
    """
    springs = motion.springs or springs_of_header(motion.header, motion.figure)
    frames = kept_frames(motion.times.size)
    glb, body_losses = format_glb(at_frames(motion, frames))
    losses = Losses.collect(
        "page",
        [
            None
            if frames.size == motion.times.size
            else Loss(f"frames: {frames.size:,} of {motion.times.size:,} are kept"),
            *body_losses,
            _displacements_loss(motion, springs),
            NO_MASSES,
            Loss(
                "curves of passive moments: the springs of the motion are not known, "
                f"`{motion.header.springs}` is not beside the figure"
            )
            if springs is None
            else None,
            unknown_props(motion),
            unrepresented(
                motion, "energies", PART_FORCES, *([] if springs is None else ["passive torques"])
            ),
            _ROUNDED,
        ],
    )
    return format_page(page_data(motion, frames, springs, losses), glb), losses


def springs_of_header(header: Header, figure: Figure) -> SpringSet | None:
    """Return the springs that a motion names, from beside its figure; None if not found there."""
    choices = springs_choices(header, figure)
    return next((read_springs(choice, figure) for choice in choices), None)


def springs_choices(header: Header, figure: Figure) -> Iterator[str | None]:
    """Yield the choices for `read_springs` that give the springs that a motion names."""
    choices: list[str | None] = [NO_SPRINGS, None]
    if figure.path is not None:
        named = Path(header.springs.partition(" ")[0]).name  # a motion names no other folder
        prefix = f"{figure.path.stem}."
        if named.startswith(prefix) and named.endswith(SPRINGS_FILE.suffix):
            choices.append(named.removeprefix(prefix).removesuffix(SPRINGS_FILE.suffix))
        choices.append(str(figure.path.parent / named))
    for choice in choices:
        with suppress(MoverError, OSError, ValueError):
            if read_springs(choice, figure).origin == header.springs:
                yield choice


def _displacements_loss(motion: FigureMotion, springs: SpringSet | None) -> Loss | None:
    """Return the loss of joints of several turns whose curves are shown."""
    curves = {} if springs is None else passive_curves(motion.figure, springs)
    turned = [name for name in curves if len(curves[name][0].chain.rotations) > 1]
    what = "displacements of joints with several axes; their rotation vectors are shown"
    return Loss(what, tuple(turned)) if turned else None


def kept_frames(count: int, most: int | None = None) -> Frames:
    """Return the frames of a page: all, or at most some with the last one.

    `most` is None for `MAX_PAGE_FRAMES`.
    """
    stride = max(1, -(-(count - 1) // ((most or MAX_PAGE_FRAMES) - 1)))
    return np.unique([*range(0, count, stride), count - 1])


def at_frames(motion: FigureMotion, frames: Frames) -> FigureMotion:
    """Return the motion at some of its frames; without a run, its poses are by kinematics."""
    if frames.size == motion.times.size:
        return motion
    moved = {name: values[frames] for name, values in motion.displacements.items()}
    return replace(motion, times=motion.times[frames], displacements=moved, recording=None)


# Data of the page: texts, and arrays as base64 of little-endian floats


def page_data(
    motion: FigureMotion, frames: Frames, springs: SpringSet | None, losses: Losses
) -> dict[str, Any]:
    """Return the data of a page: texts, flags, and arrays of the frames as `encode_floats`.

    Args:
        motion: the motion.
        frames: frames to keep.
        springs: springs whose curves are shown; None where they are not known.
        losses: losses to list.
    """
    header, recording = motion.header, motion.recording
    return {
        "title": motion.figure.name or header.figure.removesuffix(FIGURE_FILE.suffix),
        "outcome": header.message,
        "succeeded": header.outcome is Ending.DONE,
        "springs": header.springs,
        "no_curve": _reason_without_curve(header, springs),
        "facts": list(_facts(motion, frames)),
        "losses": [str(loss) for loss in losses.entries],
        "times": encode_doubles(motion.times[frames]),
        "rows": list(_rows(motion, frames, springs)),
        "energy": [] if recording is None else list(_energy_rows(recording, frames)),
        "forces": [] if recording is None else list(_force_rows(recording, frames)),
        "arrows": arrow_scale(ArrowScale.of_figure(motion.figure, first_poses(motion))),
        "touches": [] if recording is None else list(touches(recording)),
        "total_force": None if recording is None else _total_force(recording, frames),
    }


def encode_floats(values: Array) -> str:
    """Return numbers as base64 of little-endian floats of 32 bits."""
    with np.errstate(over="ignore"):
        return b64encode(np.asarray(values).astype("<f4").tobytes()).decode()


def encode_doubles(values: Array) -> str:
    """Return numbers as base64 of little-endian floats of 64 bits."""
    return b64encode(np.asarray(values).astype("<f8").tobytes()).decode()


def _facts(motion: FigureMotion, frames: Frames) -> Iterator[tuple[str, str]]:
    """Yield names and values of the origin of a motion and the accuracy of its run."""
    header, recording = motion.header, motion.recording
    yield "Figure", header.figure
    yield "SHA-256 of the figure", header.sha256 or "not from a file"
    yield "Springs", header.springs
    yield "Law of spherical joints", header.law
    yield "Outcome", f"{header.outcome.value}: {header.message}"
    yield "Time", f"{header.start:g} to {header.stop:g} s, {frames.size:,} frames"
    if recording is not None:
        yield "Accuracy", recording.accuracy_text
        yield "Integrator", recording.integrator.value
        balance = recording.energy_balance
        yield "Energy balance", f"constant to {np.max(np.abs(balance - balance[0])):.2g} J"
    if motion.scene.props:
        props = (f"{prop.name}: {prop.shape.describe()}" for prop in motion.scene.props)
        yield "Props", "; ".join(props)
    yield "Reference axes", "y is up, the figure faces +z at rest, its left is +x"


def _reason_without_curve(header: Header, springs: SpringSet | None) -> str:
    if springs is None:
        return f"Passive moment not shown: the springs {header.springs} were not found."
    if header.springs == NO_SPRINGS:
        return "The motion has no springs."
    return "This joint has no elastic law."


def _energy_rows(recording: Recording, frames: Frames) -> Iterator[dict[str, str]]:
    for kind in energy_kinds(recording.energy):
        if np.any(recording.energy[kind]):
            yield {"name": kind, "values": encode_floats(recording.energy[kind][frames])}


def first_poses(motion: FigureMotion) -> Mapping[str, Array]:
    """Return the poses of the segments in the first frame, shape (4, 4)."""
    return {name: poses[0] for name, poses in motion.poses.items()}


def arrow_scale(scale: ArrowScale) -> dict[str, Any]:
    """Return the scale of a page's arrows, which end where the forces act."""
    metres = scale.length / scale.force
    return {"metres_per_newton": metres, "longest": scale.longest, "text": scale.text}


def _force_rows(recording: Recording, frames: Frames) -> Iterator[dict[str, str]]:
    """Yield forces and points of each part that is touched, in the frames in which it is."""
    contact = recording.contact
    for name, forces in () if contact is None else contact.part_forces.items():
        if contact is not None and forces[frames].any():
            points = contact.force_points[name][frames]
            yield force_row(name.replace("_", " "), forces[frames], points)


def force_row(name: str, forces: Array, points: Array) -> dict[str, str]:
    """Return forces [N] and their points [m], shape (n, 3), in the frames that have a force."""
    acting = np.flatnonzero(np.any(forces, axis=1))
    return {
        "name": name,
        "frames": encode_floats(acting.astype(float)),
        "forces": encode_floats(forces[acting]),
        "points": encode_floats(points[acting]),
    }


def touches(recording: Recording) -> Iterator[dict[str, Any]]:
    """Yield the first touch of each part of the body in order of time, or of each segment."""
    contact = recording.contact
    if contact is None:
        return
    parts = {name: part for name, part in contact.parts.items() if not part.within}
    touched = [
        (one.first_time, one.impact_speed, one.peak_force, name)
        for name, one in (parts or contact.segments).items()
        if one.first_time is not None and one.peak_force >= MIN_ARROW_FORCE
    ]
    for time, speed, force, name in sorted(touched):
        words = name.replace("_", " ")
        yield {"time": time, "name": words, "speed": speed, "force": force}


def _total_force(recording: Recording, frames: Frames) -> dict[str, Any] | None:
    """Return the size of the total contact force in frames, and its peak over all steps."""
    contact = recording.contact
    if contact is None:
        return None
    sizes = np.linalg.norm(contact.ground_reaction[frames, :3], axis=1)
    return {
        "noun": "contact force",
        "values": encode_floats(sizes),
        "peak": contact.max_force,
        "peak_time": contact.max_force_time,
        "note": " (over all steps; the line has those of the frames)",
    }


def _rows(
    motion: FigureMotion, frames: Frames, springs: SpringSet | None
) -> Iterator[dict[str, Any]]:
    """Yield what can be chosen: the curves of a joint, or its displacements without curves."""
    curves = {} if springs is None else passive_curves(motion.figure, springs)
    for joint, chain in motion.chains.items():
        if joint in curves and motion.figure.joints[joint].chain == chain:
            for curve in curves[joint]:
                yield _curve_row(motion, frames, curve)
            continue
        for k, axis in enumerate(chain):
            values = motion.displacements[joint][frames, k]
            yield {
                "joint": joint,
                "label": f"{joint_label(joint)} {k + 1}",
                "unit": axis.units.displacement,
                "values": encode_floats(axis.units.scale * values),
            }


def _curve_row(motion: FigureMotion, frames: Frames, curve: PassiveCurve) -> dict[str, Any]:
    moved = {curve.joint: motion.displacements[curve.joint][frames]}
    angles = curve.component(moved)
    row = {
        "joint": curve.joint,
        "label": curve.label,
        "unit": "deg",
        "values": encode_floats(np.degrees(angles)),
        "curve": {
            "angles": encode_floats(np.degrees(curve.angles)),
            "law": encode_floats(curve.torques),
            "moments": encode_floats(curve.moment_at(angles)),
            "limits": list(curve.torque_limits()),
            "held": _held_angles(curve),
            "source": curve.spring.reference or "without a reference",
            "published": [_published(one) for one in curve.published],
        },
    }
    if motion.recording is not None:
        row["recorded"] = encode_floats(_recorded_moments(motion.recording, curve)[frames])
    return row


def _recorded_moments(recording: Recording, curve: PassiveCurve) -> Array:
    """Moments of a run about the axis of a curve, shape (n,) [N m].

    In the half-way frame, or for a law of coordinates the generalized force of the displacement.
    """
    if curve.law is SphericalLaw.COORDINATES and len(curve.chain.rotations) > 1:
        along = [float(np.dot(axis, curve.spring.direction)) for axis in curve.chain.rotation_axes]
        k = int(np.argmax(np.abs(along)))
        twists = curve.chain.twists(recording.displacements[curve.joint])
        axes = np.sign(along[k]) * twists[:, curve.chain.rotations[k], :3]
        return np.sum(recording.passive_torques[curve.joint] * axes, axis=1)
    half_turns = matrix_from_rotation_vector(0.5 * recording.rotation_vectors[curve.joint])
    axes = half_turns @ np.array(curve.spring.direction)
    return np.sum(recording.passive_torques[curve.joint] * axes, axis=1)


def _held_angles(curve: PassiveCurve) -> str:
    """Return the angles at which laws over several joints are drawn, as a phrase, or ""."""
    angles = [f"{name} {np.degrees(angle):.0f} deg" for name, angle in curve.held_angles.items()]
    return f"at {', '.join(angles)}" if angles else ""


def _published(one: PublishedTorques) -> dict[str, Any]:
    row: dict[str, Any] = {
        "label": _authors(one.key),
        "measured": not one.row.obstacle,
        "text": _citation(one),
        "values": encode_floats(one.torques),
    }
    if one.band is not None:
        row["low"], row["high"] = map(encode_floats, one.band)
    return row


_PARTICLES = ("van", "de", "von")
"""Words that belong to the name behind them."""


def _authors(key: str) -> str:
    """Return authors and year of a key ("Silder 2007" of "silder_2007/knee_flexion")."""
    *words, year = key.partition("/")[0].split("_")
    parts = [word if word in _PARTICLES else word.capitalize() for word in words]
    names = re.sub(rf"\b({'|'.join(_PARTICLES)})_", r"\1 ", "_".join(parts)).split("_")
    return f"{' & '.join(filter(None, [', '.join(names[:-1]), names[-1]]))} {year}"


def _citation(one: PublishedTorques) -> str:
    """Return reference, sample, scatter and reservation of a published curve."""
    row = one.row
    parts = [
        str(row.reference),
        f"{row.sample.kind.value}, {row.sample.subjects} subjects"
        if row.sample.subjects
        else row.sample.kind.value,
        f"band: {row.scatter_text}" if row.scatter_text else "",
        f"not comparable: {row.obstacle}" if row.obstacle else "",
    ]
    return ". ".join(filter(None, parts))


# File


def format_page(data: dict[str, Any], glb: bytes) -> str:
    """Return the text of a page.

    Args:
        data: data as `page_data` returns it.
        glb: the motion as binary glTF.
    """
    parts = {"motion": script_json(data), "glb": encode_glb(glb)}
    return fill_page("page.html", SCRIPTS, STYLES, str(data["title"]), parts)


def encode_glb(glb: bytes) -> str:
    """Return a binary glTF deflated, as base64."""
    return b64encode(zlib.compress(glb, 9)).decode()


def fill_page(
    template: str, scripts: Sequence[str], styles: Sequence[str], title: str, parts: dict[str, str]
) -> str:
    """Return the text of a page in which only its scripts may run.

    Args:
        template: Name of the asset of the body, in which `{{NAME}}` stands for a part or an asset.
        scripts: Names of the scripts, in their order.
        styles: Names of the styles, in their order.
        title: Title of the page.
        parts: Further parts by name, in which nothing ends a script.
    """
    codes = [_asset(name) for name in scripts]
    style_texts = [_asset(name) for name in styles]
    licences = [_asset(name) for name in ("three.LICENSE.txt", "uPlot.LICENSE.txt")]
    whole = {
        "policy": escape(_policy(codes, style_texts)),
        "title": escape(title),
        "licences": escape("\n\n".join(licences)),
        "styles": "\n".join(f"<style>{text}</style>" for text in style_texts),
        "scripts": "\n".join(f"<script>{code}</script>" for code in codes),
        **parts,
    }
    text = re.sub(
        r"\{\{([\w.]+)\}\}",
        lambda found: whole[found[1]] if found[1] in whole else _asset(found[1]),
        _asset("frame.html").replace("{{body}}", _asset(template)),
    )
    return text.encode("utf-8", "replace").decode()


def script_json(data: object) -> str:
    """Return data as JSON in which nothing ends a script or begins a comment of HTML."""
    text = json.dumps(data, separators=(",", ":"), allow_nan=False)
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")


def _policy(scripts: Sequence[str], styles: Sequence[str]) -> str:
    """Return the content security policy of scripts and styles in a page."""

    def sources(texts: Sequence[str]) -> str:
        digests = (b64encode(sha256(text.encode()).digest()).decode() for text in texts)
        return " ".join(f"'sha256-{digest}'" for digest in digests)

    return (
        f"default-src 'none'; script-src {sources(scripts)}; style-src {sources(styles)}; "
        "img-src data:; base-uri 'none'; form-action 'none'"
    )


@cache
def _asset(name: str) -> str:
    """Return the text of a file of `page_assets`."""
    asset = files("generator.motion_files").joinpath("page_assets", name)
    return asset.read_text(encoding="utf-8")
