"""The joints that close loops, as constraints of points: what most programs have for them."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from generator.exchange.model import Model
from generator.exchange.report import Report
from generator.figure import Joint
from generator.frames import Array, unit

ARM = 0.1
"""Distance along a hinge's axis of the second point that is held [m]."""


@dataclass(frozen=True)
class Loop:
    """What holds the two bodies of a joint that closes a loop.

    Attributes:
        joint: which it is.
        points: places in the frames of both sites that stay together [m]; none where the two frames
            stay together as a whole.
    """

    joint: Joint
    points: tuple[Array, ...]


def loops_of(model: Model, report: Report) -> Iterator[Loop]:
    """The loops that points can close; the others are noted as left open."""
    for joint in model.tree.closures:
        chain = model.tree.chains[joint.name]
        turns, slides = len(chain.turns), len(chain.slides)
        if turns == slides == 3:
            continue
        if slides:
            report.lose("joints that slide and close a loop: the loop is open", joint.name)
            continue
        if turns == 2:
            report.lose("joints of two turns that close a loop: they turn freely", joint.name)
        points = [np.zeros(3)] if turns else []
        if turns == 1:
            points.append(ARM * unit(joint.chain[0].axis))
        yield Loop(joint, tuple(points))
