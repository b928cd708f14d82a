"""Measures of the posture at the start of a run, held at rest: no simulation is run for them."""

from collections.abc import Callable, Iterable, Mapping
from math import isfinite

import numpy as np

from generator.hold.posture import Holder, Posture
from generator.hold.statics import Load
from generator.study.parameter_paths import Case
from generator.study.study import Measure

HELD_COLUMNS: Mapping[str, Callable[[Posture], float | None]] = {
    "hold.use [1]": lambda posture: None if posture.beyond else posture.largest_use,
    "hold.percent_capable [%]": lambda posture: posture.percent_capable,
    "hold.hands_capable [%]": lambda posture: min(
        (hand.percent_capable for hand in posture.hands), default=None
    ),
    "hold.compression [N]": lambda posture: posture.spine and posture.spine.compression,
    "hold.margin [cm]": lambda posture: posture.standing and 100.0 * posture.standing.margin,
}
"""Numbers of a held posture by the title of their column."""


_holders: list[Holder] = []
"""Holders of the last model of this process, one for each age: many cases have the same body."""


def _holder(case: Case) -> Holder:
    _holders[:] = [one for one in _holders if one.model is case.model]
    for known in _holders:
        if known.body is None or known.body.age is case.age:
            return known
    _holders.append(Holder.of(case.model, case.age))
    return _holders[-1]


def measure_held_posture(case: Case, measures: Iterable[Measure]) -> dict[str, float | None]:
    """Return measures of the posture at the start of a case, with its loads at that time.

    A posture out of balance has a negative margin, and is measured as if its feet could pull.

    Raises MoverError for a figure that cannot be judged, such as one with loops.
    """
    plan = case.plan
    loads = [
        Load(
            load.site.segment,
            force=tuple(load.components(plan.start).tolist()),
            site=load.site.site,
        )
        for load in plan.loads
        if not load.kind.is_local and load.kind.is_force
    ]
    posture = _holder(case).posture(
        {name: np.array(row) for name, row in plan.displacements.items()}, loads, must_balance=False
    )
    numbers = {each.name: HELD_COLUMNS[each.column](posture) for each in measures}
    return {
        name: value if value is not None and isfinite(value) else None
        for name, value in numbers.items()
    }
