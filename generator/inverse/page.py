"""The page of a measured motion: the body with the forces on it, and the moments of its joints."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from math import degrees
from typing import Any

import numpy as np

from generator.contact.arrows import MIN_ARROW_FORCE, ArrowScale
from generator.diagnostics import Diagnostic
from generator.input_files.coordinates import Coordinates, displacement_columns
from generator.inverse.external_loads import ExternalForce, ground_pose
from generator.inverse.moments import JointMoments
from generator.inverse.passive import PassiveBand
from generator.losses import Loss, Losses
from generator.motion_files import FigureMotion
from generator.motion_files.glb import format_glb
from generator.motion_files.motion import NO_MASSES
from generator.motion_files.page import (
    Frames,
    arrow_scale,
    at_frames,
    encode_floats,
    first_poses,
    force_row,
    format_page,
    kept_frames,
    page_data,
)
from generator.rotations import Array
from springs.published.parse import PublishedError
from springs.published.tables import coupled_law, curve

MAX_MOMENT_FRAMES = 1_500
"""Frames of a page; of a longer motion every second, third ... is kept."""

MAX_VALUES = 40_000
"""Values of coordinates over all frames, for a page below some 2.5 MB."""

_ARROW_SHARE = 0.6
"""Length of the scale of arrows over the size of the figure, before it is rounded: a weight is seen
as in the figures of gait analysis, not as a small part of the blows of a fall."""

_SHARED_FACTS = ("Figure", "SHA-256 of the figure", "Props")


def moments_page(
    motion: FigureMotion,
    moments: JointMoments,
    bands: Mapping[str, PassiveBand],
    coordinates: Coordinates,
    loads: Sequence[ExternalForce] | None,
    uncertainty: float,
    title: str,
    warnings: Sequence[Diagnostic] = (),
) -> str:
    """Return the text of the page.

    Args:
        motion: Measured motion.
        moments: Net moments at its frames, or at those at which forces are known.
        bands: Passive moments by coordinate.
        coordinates: Coordinates of the model that the figure is from.
        loads: Measured forces; None for those of the run that the motion is from.
        uncertainty: Uncertainty of the zero of each angle in the bands [rad].
        title: Sentence that says what the moments are of.
        warnings: Doubts about them.
    """
    every = np.flatnonzero(np.isin(motion.times, moments.times))
    most = min(MAX_MOMENT_FRAMES, max(2, MAX_VALUES // len(moments.coordinates)))
    chosen = kept_frames(every.size, most)
    shown = at_frames(motion, every[chosen])
    glb, body_losses = format_glb(shown)
    thinned = Loss(f"frames: {chosen.size:,} of {every.size:,} are kept")
    losses = Losses.collect(
        "page", [thinned if chosen.size < every.size else None, *body_losses, NO_MASSES]
    )
    data = page_data(motion, every[chosen], None, losses)
    data["outcome"], data["succeeded"] = title, not warnings
    laws = list(dict.fromkeys(law for band in bands.values() for law in band.shares))
    zeros = f"zeros of angles ±{degrees(uncertainty):g} deg"
    sure = moments.times[moments.is_sure]
    data["net"] = {
        "band": f"passive: {', '.join(laws)}; {zeros}; none at angles that no law was measured at",
        "sources": [f"{law}: {_reference(law)}" for law in laws],
        "sure": [float(sure[0]), float(sure[-1])] if sure.size else None,
    }
    cutoff = "none" if moments.cutoff is None else f"{moments.cutoff:g} Hz, both ways"
    data["facts"] = [
        *(fact for fact in data["facts"] if fact[0] in _SHARED_FACTS),
        ("Filter", cutoff),
        ("Mass", f"{moments.mass:.4g} kg"),
        ("Residual force of the root", f"{moments.mean_residual_share:.2g} body weights (mean)"),
        *(("Warning", each.message) for each in warnings),
    ]
    data["rows"] = list(_rows(motion, moments, bands, coordinates, chosen))
    if loads is not None:
        forces = _forces_in_world(shown, loads)
        data["touches"], data["total_force"] = [], _total_force(shown.times, forces)
        scale = ArrowScale.of_figure(motion.figure, first_poses(shown), _ARROW_SHARE)
        data["arrows"] = {**arrow_scale(scale), "begin_at_point": True}
        data["forces"] = [force_row(name, *some) for name, some in forces.items() if some[0].any()]
    return format_page(data, glb)


def _reference(law: str) -> str:
    """Return the reference of a published law; springs of a figure are the figure's own."""
    for find in (coupled_law, curve):
        with suppress(PublishedError):
            return str(find(law).reference)
    return "springs of the figure"


def _rows(
    motion: FigureMotion,
    moments: JointMoments,
    bands: Mapping[str, PassiveBand],
    coordinates: Coordinates,
    frames: Frames,
) -> Iterator[dict[str, Any]]:
    """Yield the coordinates with rates, moments and the ends of the passive ones."""
    places = displacement_columns(motion.chains, coordinates)
    for name, one in moments.coordinates.items():
        at = places[name]
        units = motion.chains[at.joint][at.index].units
        parts = {"moments": one.forces, "rates": one.rates}
        if name in bands:
            parts |= {"lower": bands[name].lower, "upper": bands[name].upper}
        yield {
            "joint": at.joint,
            "label": f"{name} (residual)" if one.is_root else name,
            "unit": units.displacement,
            "values": encode_floats(units.scale * one.values[frames]),
            "net": {
                "noun": "moment" if one.is_angle else "force",
                "unit": one.unit,
                "residual": one.is_root,
                **{key: encode_floats(values[frames]) for key, values in parts.items()},
            },
        }


def _forces_in_world(
    motion: FigureMotion, loads: Sequence[ExternalForce]
) -> dict[str, tuple[Array, Array]]:
    """Return forces and their points in the world by body, shape (n, 3) [N, m]."""
    poses = motion.poses
    ground = ground_pose(poses, motion.tree.figure)
    found: dict[str, tuple[Array, Array]] = {}
    for one in loads:
        force, point, _ = one.in_world(motion.times, poses, ground)
        force[np.linalg.norm(force, axis=1) < MIN_ARROW_FORCE] = 0.0
        name = one.body if one.body not in found else f"{one.body}, {one.name}"
        found[name] = force, point
    return found


def _total_force(
    times: Array,
    forces: Mapping[str, tuple[Array, Array]],
) -> dict[str, Any] | None:
    """Return the size of the sum of the forces; None without any."""
    if not forces:
        return None
    sizes = np.linalg.norm(sum(force for force, _ in forces.values()), axis=1)
    peak = int(np.argmax(sizes))
    return {
        "noun": "external force",
        "values": encode_floats(sizes),
        "peak": float(sizes[peak]),
        "peak_time": float(times[peak]),
        "note": "",
    }
