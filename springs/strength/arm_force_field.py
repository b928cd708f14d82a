"""Strength of one hand in any direction: the Arm Force Field of La Delfa & Potvin 2017.

A network of 18 inputs, 13 nodes and one output gives the mean force of women from place and
direction alone, without gravity; the arm's weight adds to it or takes from it. Its numbers are
those of the authors' program (CC-BY-4.0, see `arm_force_field.toml`), the code is our own.

Vectors are in the shoulder's axes: forwards, upwards, outwards (to the side of the hand).
"""

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from springs.backends import Array
from springs.published.reference import Reference
from springs.strength.strengths import GRAVITY, percent_capable, percentile_5, reference_of

MEN_FACTOR = 1.66
"""Men's arm strength over women's: a remark in another program, not a published number."""

LEVEL_BAND = 0.01
"""Height over or under the shoulder within which a hand is level with it [m]."""

_SMALLEST_PART = 1e-12
"""Component of a direction that counts as zero: rounding of turned axes."""


@dataclass(frozen=True)
class ArmWeight:
    """Weight of an arm.

    Attributes:
        masses: Of upper arm, forearm and hand [kg].
        centres: Their centres of mass from the shoulder, shape (3, 3) [m].
        down: Direction of gravity, a unit vector, shape (3,).
    """

    masses: Sequence[float]
    centres: ArrayLike
    down: ArrayLike

    def force_at(self, hand: ArrayLike) -> Array:
        """Return the force at the hand that the weight yields, shape (3,) [N].

        It is the force across the reach that has the moment of the weight about the shoulder.

        Args:
            hand: Hand from the shoulder, shape (3,) [m].
        """
        reach, down = np.asarray(hand, dtype=float), np.asarray(self.down, dtype=float)
        weights = GRAVITY * np.asarray(self.masses, dtype=float)
        moment = np.sum(np.cross(np.asarray(self.centres, dtype=float), down) * weights[:, None], 0)
        across = np.cross(moment, reach)
        length, moment_size = float(np.linalg.norm(reach)), float(np.linalg.norm(moment))
        size = float(np.linalg.norm(across))
        if size <= _SMALLEST_PART * max(moment_size, 1.0):
            return np.zeros(3)
        return moment_size / length * (across / size)


@dataclass(frozen=True)
class HandStrength:
    """Strength of a hand along a direction.

    Attributes:
        mean: Mean force of women without gravity [N], times the factor of men for men.
        assistance: Force along the direction that the arm's weight yields [N].
        spread: Standard deviation between people over the mean.
    """

    mean: float
    assistance: float
    spread: float

    @property
    def capacity(self) -> float:
        """Mean force with gravity [N]."""
        return self.mean + self.assistance

    @property
    def capacity_5(self) -> float:
        """Force of which 95 % are capable [N]."""
        return percentile_5(self.mean, self.spread) + self.assistance

    def percent_capable(self, force: float) -> float:
        """Return the percentage of people who are capable of a force [N]."""
        return percent_capable(force - self.assistance, self.mean, self.spread)


@cache
def arm_force_field_numbers() -> Mapping[str, Any]:
    """Return the numbers of the network and its references, as in `arm_force_field.toml`."""
    path = files("springs").joinpath("strength", "arm_force_field.toml")
    return tomllib.loads(path.read_text(encoding="utf-8"))


def arm_force_field_reference() -> Reference:
    """Return the publication."""
    found = reference_of(arm_force_field_numbers())
    assert found is not None
    return found


def arm_force_field_spread() -> float:
    """Return the standard deviation of arm strength between people over the mean."""
    return float(arm_force_field_numbers()["spread"])


def hand_force(hand: ArrayLike, direction: ArrayLike) -> float:
    """Return the mean force of women at a place along a direction, without gravity [N].

    It is bounded by the least and largest forces that were measured.

    Args:
        hand: Knuckles from the shoulder, shape (3,) [m].
        direction: Direction of the force that the hand exerts, a unit vector, shape (3,).
    """
    numbers = arm_force_field_numbers()
    forwards, upwards, outwards = np.asarray(hand, dtype=float)
    f_forwards, f_upwards, f_outwards = np.asarray(direction, dtype=float)
    place = np.array([upwards, forwards, outwards])
    force = np.array([f_upwards, f_forwards, f_outwards])
    # Distances from the three axes, and the moment arm of the force.
    across = np.sqrt(np.sum(place**2) - place**2)
    arm = np.cross(place, force)
    arm = np.array([arm[0], arm[1], arm[2]])
    length = float(np.linalg.norm(arm))
    inputs = np.concatenate(
        [place, across, force, arm, [length, length**2, length**3], across * force]
    )
    scaled = np.array(numbers["gain"]) * (inputs - np.array(numbers["offset"])) - 1.0
    nodes = np.tanh(np.array(numbers["hidden_bias"]) + np.array(numbers["hidden"]) @ scaled)
    raw = numbers["output_bias"] + float(np.array(numbers["output"]) @ nodes)
    mean = (raw + 1.0) / numbers["output_gain"] + numbers["output_offset"]
    level = 0 if abs(upwards) <= LEVEL_BAND else int(np.sign(upwards))
    signs = [
        0 if abs(part) < _SMALLEST_PART else int(np.sign(part))
        for part in (f_forwards, f_upwards, f_outwards)
    ]
    index = int(np.ravel_multi_index([code + 1 for code in (level, *signs)], (3, 3, 3, 3)))
    least, largest = numbers["least_N"][index], numbers["largest_N"][index]
    return float(min(max(mean, least), largest))
