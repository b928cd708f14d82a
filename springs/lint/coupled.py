"""Checks of a law over several joints: senses, stiffness, energy and valid range."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations
from math import degrees, radians

import numpy as np

from springs.backends import Array
from springs.coupled import CoupledExponential, loop_work, nearest_conservative_law
from springs.elastic import Range
from springs.lint.finding import Finding, FindingKind, doubts_first

DEFAULT_RANGE = (radians(-90.0), radians(90.0))
"""Range of an angle whose valid range is not known [rad]."""

EXTRAPOLATION_ANGLE = radians(30.0)
"""Distance beyond the range at which the extrapolation is reported [rad]."""

_MAX_GRID_POINTS = 40_000
"""Largest number of grid points over all angles."""

_MAX_TERMS, _MAX_COORDINATES = 40, 3
"""Largest law for which a nearest conservative law is computed."""

_RELATIVE_ROUNDING = 1e-9


@dataclass(frozen=True)
class _TorqueGrid:
    """A law on an even grid over its range.

    Attributes:
        law: law over several angles.
    """

    law: CoupledExponential

    @property
    def box(self) -> tuple[Range, ...]:
        """The range of each angle [rad], or what stands for it."""
        return tuple(known or DEFAULT_RANGE for known in self.law.valid_ranges)

    @cached_property
    def angles(self) -> tuple[Array, ...]:
        """Points along each angle [rad]."""
        count = max(3, min(41, int(_MAX_GRID_POINTS ** (1.0 / len(self.box)))))
        return tuple(np.linspace(low, high, count) for low, high in self.box)

    @cached_property
    def torques(self) -> tuple[Array, ...]:
        """Torque about each coordinate at all points [N m]."""
        return self.torques_at(self.angles)

    @property
    def max_torque(self) -> float:
        """Greatest torque [N m]."""
        return max(float(np.abs(torque).max()) for torque in self.torques)

    def torques_at(self, angles: Sequence[Array]) -> tuple[Array, ...]:
        """Torques on the grid of other points along the angles [N m]."""
        grid = np.meshgrid(*angles, indexing="ij")
        return tuple(np.asarray(torque) for torque in self.law.torques(grid))

    def point_angles(self, index: int) -> tuple[float, ...]:
        """The angles of one point, counted through the whole grid [rad]."""
        shape = tuple(len(one) for one in self.angles)
        places = np.unravel_index(index, shape)
        return tuple(float(a[k]) for a, k in zip(self.angles, places, strict=True))

    def format_point(self, angles: Sequence[float], excluded: int | None = None) -> str:
        """`hip flexion 100 deg, knee flexion 0 deg`, without the coordinate `excluded`."""
        pairs = enumerate(zip(self.law.coordinates, angles, strict=True))
        return ", ".join(
            f"{name} {degrees(angle) + 0.0:.4g} deg" for k, (name, angle) in pairs if k != excluded
        )


def lint_coupled(law: CoupledExponential) -> tuple[Finding, ...]:
    """Check a law over several joints within its valid range."""
    grid = _TorqueGrid(law)
    found = (
        *_lint_energy(grid),
        *_lint_sense(grid),
        *_lint_stiffness(grid),
        *_lint_max_torque(grid),
        *_lint_valid_range(grid),
    )
    return doubts_first(found)


def lint_original_law(original: CoupledExponential) -> tuple[Finding, ...]:
    """Check a law that was replaced by the nearest conservative one."""
    return tuple(
        replace(finding, is_doubt=False, sentence=f"the law that was replaced: {finding.sentence}")
        for finding in _lint_energy(_TorqueGrid(original))
    )


def _lint_energy(grid: _TorqueGrid) -> Iterator[Finding]:
    """Report the energy, or else the work of closed loops and the nearest conservative law."""
    law, ends = grid.law, tuple(end for side in grid.box for end in side)
    if law.is_conservative:
        energies = np.asarray(law.energy(np.meshgrid(*grid.angles, indexing="ij")))
        stored = float(np.ptp(energies))
        message = f"the torques are the gradient of an energy, which varies by {stored:.4g} J"
        yield Finding(FindingKind.ENERGY, False, message, ends, (stored,))
        return
    for i, j in combinations(range(len(law.coordinates)), 2):
        pair = law
        for k, name in enumerate(law.coordinates):
            if k not in (i, j):
                pair = pair.hold_coordinate(name, 0.5 * sum(grid.box[k]))
        sides = grid.box[i], grid.box[j]
        work = loop_work(pair, sides)
        if abs(work) <= _RELATIVE_ROUNDING * grid.max_torque:
            continue
        loop = " and ".join(
            f"{name} {degrees(low) + 0.0:.4g} .. {degrees(high) + 0.0:.4g} deg"
            for name, (low, high) in zip(pair.coordinates, sides, strict=True)
        )
        yield Finding(
            FindingKind.ENERGY,
            True,
            f"carried once round {loop} the law does {work:.4g} J of work, and the opposite the "
            "other way round: no energy belongs to it",
            tuple(end for side in sides for end in side),
            (work,),
        )
    if len(law.coordinates) <= _MAX_COORDINATES and len(law.terms) <= _MAX_TERMS:
        nearest = nearest_conservative_law(law, grid.box)
        differences = ", ".join(
            f"{rms:.3g} N m about {name} (at most {most:.3g})"
            for name, rms, most in zip(
                law.coordinates, nearest.rms_difference, nearest.max_difference, strict=True
            )
        )
        message = (
            "the nearest law of the same exponentials that has an energy differs by rms "
            f"{differences}"
        )
        yield Finding(
            FindingKind.ENERGY,
            False,
            message,
            ends,
            (*nearest.rms_difference, *nearest.max_difference),
        )


def _lint_sense(grid: _TorqueGrid) -> Iterator[Finding]:
    """Check that each torque restores at both ends of its own angle."""
    for i, name in enumerate(grid.law.coordinates):
        for side, end, outwards in (("lower", 0, -1.0), ("upper", -1, 1.0)):
            driven = outwards * np.take(grid.torques[i], end, axis=i)
            angle, most = grid.box[i][end], float(driven.max())
            where = f"at the {side} end of {name}, {degrees(angle) + 0.0:.4g} deg,"
            everywhere = float(driven.min()) > _RELATIVE_ROUNDING * grid.max_torque
            if everywhere:
                message = f"{where} the torque drives the joint on, with up to {most:.3g} N m"
            elif most > _RELATIVE_ROUNDING * grid.max_torque:
                at = grid.format_point(_worst_point(grid, i, driven), excluded=i)
                message = f"{where} the torque drives on at some of the other angles, by "
                message += f"{most:.3g} N m at {at}"
            else:
                message = f"{where} the torque drives back whatever the other angles are"
            yield Finding(FindingKind.SENSE, everywhere, message, (angle,), (max(most, 0.0),))


def _worst_point(grid: _TorqueGrid, i: int, driven: Array) -> tuple[float, ...]:
    """All angles at which a torque at an end of angle `i` is greatest [rad]; its own is any."""
    places = np.unravel_index(int(driven.argmax()), driven.shape)
    others = [(angles[k]) for angles, k in zip(_other_angles(grid.angles, i), places, strict=True)]
    return (*map(float, others[:i]), 0.0, *map(float, others[i:]))


def _other_angles(angles: Sequence[Array], i: int) -> list[Array]:
    return [one for k, one in enumerate(angles) if k != i]


def _lint_stiffness(grid: _TorqueGrid) -> Iterator[Finding]:
    """Report the stiffness about each angle at fixed other angles."""
    for i, name in enumerate(grid.law.coordinates):
        steps = np.diff(grid.angles[i])
        if not steps[0] > 0.0:
            continue
        slopes = np.diff(grid.torques[i], axis=i) / steps[0]
        stiffest, softest = -float(slopes.min()), -float(slopes.max())
        message = f"the stiffness about {name} is between {softest:.4g} and {stiffest:.4g} N m/rad"
        negative = softest < -_RELATIVE_ROUNDING * grid.max_torque
        if negative:
            message += ": somewhere the torque grows with its angle"
        yield Finding(FindingKind.SLOPE, negative, message, grid.box[i], (softest, stiffest))


def _lint_max_torque(grid: _TorqueGrid) -> Iterator[Finding]:
    """Report the largest torque about each angle and its place."""
    for name, torques in zip(grid.law.coordinates, grid.torques, strict=True):
        greatest = int(np.abs(torques).argmax())
        place, torque = grid.point_angles(greatest), float(torques.ravel()[greatest])
        message = (
            f"the torque about {name} is greatest at {grid.format_point(place)}: {torque:.4g} N m"
        )
        yield Finding(FindingKind.MAX_TORQUE, False, message, place, (torque,))


def _lint_valid_range(grid: _TorqueGrid) -> Iterator[Finding]:
    """Report the valid range and the extrapolation beyond it."""
    for i, (name, known) in enumerate(
        zip(grid.law.coordinates, grid.law.valid_ranges, strict=True)
    ):
        low, high = grid.box[i]
        ends = f"{degrees(low) + 0.0:.4g} .. {degrees(high) + 0.0:.4g} deg"
        if known is None:
            message = f"the range of {name} is not known; checked over {ends}"
            yield Finding(FindingKind.VALID_RANGE, False, message, (low, high))
            continue
        places = (
            low - EXTRAPOLATION_ANGLE,
            high + EXTRAPOLATION_ANGLE,
            radians(-180.0),
            radians(180.0),
        )
        greatest = tuple(_max_torque_at(grid, i, place) for place in places)
        listed = ", ".join(
            f"{torque:.4g} N m at {degrees(place):.4g} deg"
            for place, torque in zip(places, greatest, strict=True)
        )
        message = f"beyond {name} {ends} it is an extrapolation, with up to {listed}"
        yield Finding(FindingKind.VALID_RANGE, False, message, places, greatest)


def _max_torque_at(grid: _TorqueGrid, i: int, place: float) -> float:
    """Greatest torque about any coordinate with one angle here, the others in range [N m]."""
    angles = list(grid.angles)
    angles[i] = np.array([place])
    return max(float(np.abs(torque).max()) for torque in grid.torques_at(angles))
