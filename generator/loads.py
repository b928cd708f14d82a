"""Forces and moments at sites that vary in time."""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np

from generator.figure import Site, SiteRef, Vector
from generator.rotations import Array


class LoadKind(Enum):
    """Force or moment, with components along the axes of the world or of the segment."""

    GLOBAL_FORCE = "globalforce"
    LOCAL_FORCE = "localforce"
    GLOBAL_MOMENT = "globalmoment"
    LOCAL_MOMENT = "localmoment"

    @property
    def attribute(self) -> str:
        """Name of the attribute of a site that has such a load."""
        return self.name.lower()

    @property
    def is_force(self) -> bool:
        """A force at the site (else a moment)."""
        return self in (LoadKind.GLOBAL_FORCE, LoadKind.LOCAL_FORCE)

    @property
    def is_local(self) -> bool:
        """Components in the segment's axes (else the world's)."""
        return self in (LoadKind.LOCAL_FORCE, LoadKind.LOCAL_MOMENT)


@dataclass(frozen=True)
class TimedLoad:
    """A load at a site, linear between its rows and zero outside them.

    Attributes:
        site: where it acts.
        kind: what acts.
        times: shape (n,), increasing [s].
        values: shape (n, 3) [N or N m].
    """

    site: SiteRef
    kind: LoadKind
    times: Sequence[float]
    values: Sequence[Sequence[float]]

    def __post_init__(self) -> None:
        """Refuse rows that are out of order or not finite."""
        times, values = np.asarray(self.times, float), np.asarray(self.values, float)
        if values.shape != (times.size, 3) or times.size == 0:
            raise ValueError(f"a load needs three components a row, not {values.shape}")
        if not (np.all(np.isfinite(times)) and np.all(np.isfinite(values))):
            raise ValueError("times and components of a load must be finite")
        if np.any(np.diff(times) <= 0.0):
            raise ValueError("the times of a load must increase")

    @property
    def discontinuities(self) -> tuple[float, ...]:
        """Times at which the load jumps [s]."""
        ends = {self.times[0]: self.values[0], self.times[-1]: self.values[-1]}
        return tuple(time for time, value in ends.items() if any(value))

    def components(self, time: float | Array) -> Array:
        """The components at a time [N or N m], shape (..., 3)."""
        times, values = np.asarray(self.times, float), np.asarray(self.values, float)
        parts = [np.interp(time, times, values[:, k], left=0.0, right=0.0) for k in range(3)]
        return np.stack(parts, axis=-1)


def site_loads(site: Site) -> dict[LoadKind, Vector]:
    """The constant loads at a site by kind [N or N m]."""
    loads = {kind: getattr(site, kind.attribute) for kind in LoadKind}
    return {kind: load for kind, load in loads.items() if load is not None}


def constant_load(
    site: SiteRef, kind: LoadKind, value: Sequence[float], start: float, stop: float
) -> TimedLoad:
    """A load that does not vary from `start` to `stop` [s]."""
    return TimedLoad(site, kind, (start, stop), (tuple(value), tuple(value)))
