"""Loads at sites: Exudyn load items whose value is read from a table in time."""

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from generator.engine.bodies import add_marker
from generator.engine.exudyn_api import (
    Index,
    MainSystem,
    items,
    symbolic_user_function,
    symbols,
)
from generator.figure import Figure, SiteRef
from generator.frames import Array, homogeneous
from generator.loads import LoadKind, TimedLoad, constant
from generator.posture.placement import Placement

_SLACK = 1.0
"""By how much a constant load outlasts the run [s]: no rounding of the last step ends it early."""


def written_loads(figure: Figure, start: float, stop: float) -> list[TimedLoad]:
    """The constant loads that a figure's sites carry, from `start` to `stop` [s]."""
    loads: list[TimedLoad] = []
    for name in figure.bodies:
        for site in figure.segments[name].sites.values():
            values = {
                LoadKind.GLOBAL_FORCE: site.global_force,
                LoadKind.LOCAL_FORCE: site.local_force,
                LoadKind.GLOBAL_MOMENT: site.global_moment,
                LoadKind.LOCAL_MOMENT: site.local_moment,
            }
            ref = SiteRef(name, site.name)
            loads.extend(
                constant(ref, kind, value, start - _SLACK, stop + _SLACK)
                for kind, value in values.items()
                if value is not None and any(value)
            )
    return loads


def load_point(figure: Figure, ref: SiteRef) -> Array:
    """Pose in the segment frame of a load: at the site, along the segment's axes; shape (4, 4)."""
    return homogeneous(np.eye(3), figure.site(ref).pose_in_segment[:3, 3])


def add_loads(
    mbs: MainSystem,
    placement: Placement,
    bodies: Mapping[str, Index],
    loads: Iterable[TimedLoad],
) -> tuple[tuple[TimedLoad, Index, Any], ...]:
    """The load items: for each load the marker it acts on and the function to keep alive."""
    figure = placement.tree.figure
    added: list[tuple[TimedLoad, Index, Any]] = []
    for load in loads:
        point = load_point(figure, load.site)
        marker = add_marker(mbs, placement, bodies, load.site.segment, point)
        name = "LoadForceVector" if load.kind.is_force else "LoadTorqueVector"
        function = _table(mbs, load, name)
        mbs.AddLoad(
            getattr(items, name)(
                markerNumber=marker,
                loadVector=[0.0, 0.0, 0.0],
                bodyFixed=load.kind.is_local,
                loadVectorUserFunction=function,
            )
        )
        added.append((load, marker, function))
    return tuple(added)


def _table(mbs: MainSystem, load: TimedLoad, item: str) -> Any:
    """The load's value as an expression tree in time."""
    times = np.asarray(load.times, dtype=float)
    values = np.asarray(load.values, dtype=float)

    def value(mbs: Any, t: Any, loadVector: Any) -> Any:
        return symbols.Vector([_within(t, times, values[:, k]) for k in range(3)])

    return symbolic_user_function(mbs, value, "loadVectorUserFunction", item)


def _within(t: Any, times: Array, values: Array) -> Any:
    """Zero before the first and after the last row, linear between them."""
    if not np.any(values):
        return symbols.Real(0.0)
    zero = symbols.Real(0.0)
    inside = _piece(t, times, values)
    not_over = symbols.IfThenElse(t > float(times[-1]), zero, inside)
    return symbols.IfThenElse(t < float(times[0]), zero, not_over)


def _piece(t: Any, times: Array, values: Array) -> Any:
    """Linear interpolation as a balanced tree of conditions: a long table costs its logarithm."""
    if times.size == 1:
        return symbols.Real(float(values[0]))
    if times.size == 2:
        slope = float((values[1] - values[0]) / (times[1] - times[0]))
        return symbols.Real(float(values[0])) + slope * (t - float(times[0]))
    middle = times.size // 2
    return symbols.IfThenElse(
        t < float(times[middle]),
        _piece(t, times[: middle + 1], values[: middle + 1]),
        _piece(t, times[middle:], values[middle:]),
    )
