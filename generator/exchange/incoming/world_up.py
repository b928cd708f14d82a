"""Turning a model's world so that y is up and the figure faces z."""

from collections.abc import Iterator

import numpy as np

from generator.exchange.incoming.mjcf_orientation import z_onto
from generator.exchange.incoming.passive_tree import Z_UP
from generator.frames import Array

STANDARD = 9.81
_ALIGNED = 1e-9


def turned_up(gravity: Array) -> Array:
    """The rotation from the model's world to a figure's, shape (3, 3), by its gravity [m/s^2].

    Where y is up nothing turns. Without gravity z counts as up. A direction between the axes is
    brought up by the shortest turn from z.
    """
    size = float(np.linalg.norm(gravity))
    if size == 0.0:
        return Z_UP
    up = -gravity / size
    if np.abs(up - [0.0, 1.0, 0.0]).max() < _ALIGNED:
        return np.eye(3)
    if np.abs(up - [0.0, 0.0, 1.0]).max() < _ALIGNED:
        return Z_UP
    x, y, z = up.tolist()
    return Z_UP @ z_onto((x, y, z)).T


def gravity_words(gravity: Array, up: Array) -> Iterator[str]:
    """What to say of the turn, and of a gravity that is not the standard one."""
    columns = [_named(axis) for axis in up.T]
    if columns == ["x", "y", "z"]:
        pass
    elif all(columns):
        yield f"the world is turned: the model's x, y, z are {', '.join(columns)} of the figure's"
    else:
        yield "the world is turned so that gravity points against y"
    size = float(np.linalg.norm(gravity))
    if abs(size - STANDARD) > 1e-12:
        yield f"gravity of {size:.8g} m/s^2: simulate with `--gravity 0,{-size:.8g},0`"


def _named(axis: Array) -> str:
    """`x`, `-z` ... of a unit vector along a coordinate axis; empty for another."""
    place = int(np.argmax(np.abs(axis)))
    if abs(axis[place]) < 1.0 - _ALIGNED:
        return ""
    return f"{'-' if axis[place] < 0.0 else ''}{'xyz'[place]}"
