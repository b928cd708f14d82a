"""Layers that parts of the body press through: a mat that is too thin, a cover."""

from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from generator.contact.record import PressedLayer
from generator.contact.states import ContactModel, ContactSteps
from generator.rotations import Array
from springs.contact_part import Series, compression_of


def pressed_layers(
    model: ContactModel, steps: ContactSteps, poses: Mapping[str, Array], frame_times: Array
) -> Iterator[PressedLayer]:
    """Yield the layers that are pressed through in a run, by the elastic force of a part or region.

    The prop in which a sphere is deepest in a step is that of the nearest frame.

    Args:
        model: Props, spheres and laws of parts.
        steps: Contact after each step.
        poses: Poses of the segments in n frames, shape (n, 4, 4).
        frame_times: Times of the frames, shape (n,) [s].
    """
    floors = [prop.surface.layer for prop in model.scene.props]
    layers = [*floors, *(law.cover for law in model.laws.values())]
    if all(layer is None or layer.limit == np.inf for layer in layers):
        return
    touched = _touched_props(model, poses)
    middles = 0.5 * (frame_times[1:] + frame_times[:-1])
    nearest = np.searchsorted(middles, steps.times)
    names = [(one.part, one.region) for some in model.spheres.values() for one in some]
    for name, law in model.laws.items():
        own, whole = np.flatnonzero([name in both for both in names]), replace(law, within=None)
        cover = f"cover of {names[own[0]][0] if own.size else name}"
        for place, prop in enumerate(model.scene.props):
            is_there = touched[np.ix_(nearest, own)] == place
            depths = np.where(is_there, steps.depths[:, own], -1.0)
            force = np.asarray(
                Series(whole, prop.surface.layer).law.elastic_force(
                    whole.norm_scale * compression_of(depths)[0]
                )
            )
            for layer, noun in ((law.cover, cover), (prop.surface.layer, prop.name)):
                if layer is not None and np.max(force) > layer.limit:
                    first = int(np.argmax(force > layer.limit))
                    yield PressedLayer(noun, name, float(steps.times[first]))


def _touched_props(model: ContactModel, poses: Mapping[str, Array]) -> NDArray[np.intp]:
    """Return the prop that is nearest to each of S spheres in n frames, shape (n, S)."""
    centres = np.concatenate(
        [
            np.array([one.centre for one in some]) @ np.swapaxes(poses[name][:, :3, :3], 1, 2)
            + poses[name][:, None, :3, 3]
            for name, some in model.spheres.items()
        ],
        axis=1,
    )
    distances = [
        prop.shape.distance((local[..., 0], local[..., 1], local[..., 2]))[0]
        for prop in model.scene.props
        for local in [(centres - prop.shape.pose[:3, 3]) @ prop.shape.pose[:3, :3]]
    ]
    return np.argmin(distances, axis=0)
