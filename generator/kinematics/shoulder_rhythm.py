"""How the clavicle follows the arm: the thesis's lines, and a modern regression, behind one face.

Elevation of the arm is 0 while it hangs and pi overhead; its plane is 0 in the frontal plane and
pi/2 in front. Elevation of the clavicle is positive upwards and its abduction forwards, both
counted from the clavicle of a figure, which is drawn straight to the side. Left and right are
mirror images, so the side does not appear. All angles are in radians.
"""

from dataclasses import dataclass
from typing import Protocol, cast

import numpy as np

from springs.backends import Array
from springs.published import tables as published
from springs.published.reference import Reference
from springs.published.shoulder_rhythm import PiecewiseLinear, Regression

ABDUCTION_RATIO = 0.2
"""Clavicle abduction for each unit of arm abduction (eq. 5.46): the thesis's estimate."""


class ShoulderRhythm(Protocol):
    """The clavicle's two angles as functions of the arm's elevation and plane."""

    @property
    def name(self) -> str:
        """The name that a user knows it by."""
        ...

    @property
    def references(self) -> tuple[Reference, ...]:
        """Where it is from."""
        ...

    @property
    def breakpoints(self) -> tuple[float, ...]:
        """Arm elevations at which a formula gives way to the next [rad]."""
        ...

    def clavicle(self, elevation: Array, plane: Array) -> tuple[Array, Array]:
        """Elevation and abduction of the clavicle [rad], each of the shape of both arguments."""
        ...


@dataclass(frozen=True)
class OtaniRhythm:
    """The thesis's rhythm: Inman's graph in straight lines, and an estimate (eq. 5.41-5.46)."""

    name: str = "otani"

    @property
    def _frontal(self) -> PiecewiseLinear:
        return _load_lines("otani_1989/clavicle_frontal")

    @property
    def _sagittal(self) -> PiecewiseLinear:
        return _load_lines("otani_1989/clavicle_sagittal")

    @property
    def references(self) -> tuple[Reference, ...]:
        """Where it is from."""
        return (published.rhythm("otani_1989/clavicle_frontal").reference,)

    @property
    def breakpoints(self) -> tuple[float, ...]:
        """Arm elevations at which a line gives way to the next [rad]."""
        laws = (self._frontal, self._sagittal)
        return tuple(sorted(end for law in laws for end, _, _ in law.pieces if np.isfinite(end)))

    def clavicle(self, elevation: Array, plane: Array) -> tuple[Array, Array]:
        """Elevation and abduction of the clavicle [rad]."""
        frontal, sagittal = self._frontal.angle(elevation), self._sagittal.angle(elevation)
        share = np.cos(plane)
        return share * frontal + (1.0 - share) * sagittal, ABDUCTION_RATIO * plane


@dataclass(frozen=True)
class DeGrootBrandRhythm:
    """The regression of de Groot and Brand (2001), less the resting angles of its own table.

    A real clavicle at rest points 29 deg backwards and 12 deg up; that of a figure is drawn to the
    side, and this rhythm moves it from there.
    """

    name: str = "de_groot_brand"

    @property
    def _elevation(self) -> Regression:
        return _load_regression("de_groot_brand_2001/clavicle_elevation")

    @property
    def _protraction(self) -> Regression:
        return _load_regression("de_groot_brand_2001/clavicle_protraction")

    @property
    def references(self) -> tuple[Reference, ...]:
        """Where it is from."""
        return (published.rhythm("de_groot_brand_2001/clavicle_elevation").reference,)

    @property
    def breakpoints(self) -> tuple[float, ...]:
        """None: it is one formula."""
        return ()

    def clavicle(self, elevation: Array, plane: Array) -> tuple[Array, Array]:
        """Elevation and abduction of the clavicle [rad]."""
        up, forwards = (
            law.angle(elevation) + law.plane * plane - law.rest
            for law in (self._elevation, self._protraction)
        )
        return up, forwards


OTANI = OtaniRhythm()
DE_GROOT_BRAND = DeGrootBrandRhythm()

RHYTHMS: dict[str, ShoulderRhythm] = {one.name: one for one in (OTANI, DE_GROOT_BRAND)}
"""The rhythms by name."""


def _load_lines(key: str) -> PiecewiseLinear:
    return cast("PiecewiseLinear", published.rhythm(key).law)


def _load_regression(key: str) -> Regression:
    return cast("Regression", published.rhythm(key).law)
