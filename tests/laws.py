"""Strategies for the laws of springs: one for each class, and for each form in a springs file."""

import importlib
import inspect
import pkgutil
from math import pi, radians

import numpy as np
from hypothesis import strategies as st

import springs
from generator.springs_file.laws import CubicEntry, SlideEntry
from generator.springs_file.published import PublishedLaw
from springs import Cubic, Linear, SphericalLaw, Stop
from springs.exponential import Exponential, ExponentialTerm
from springs.hysteresis import Hysteresis
from springs.interpolated import Interpolated
from springs.published.tables import publication, publications
from springs.smooth_limit import SmoothLimit
from springs.transformed import Transformed

VECTOR_LAWS = (SphericalLaw.CONSERVATIVE, SphericalLaw.WEIGHTED)
"""Rules whose laws are functions of the rotation vector."""

MEMBERS = ("torque", "energy", "breakpoints", "mirrored")


def limits(law: Stop | SmoothLimit | Cubic) -> tuple[float, float]:
    """Both limits of a law of `RESISTING`."""
    if isinstance(law, Cubic):
        assert law.dead_zone is not None
        return law.dead_zone
    assert law.lower is not None
    assert law.upper is not None
    return law.lower, law.upper


def law_classes() -> set[type]:
    """The classes in `springs` that have the members of `Elastic`, in whatever module."""
    modules = [
        importlib.import_module(module.name)
        for module in pkgutil.walk_packages(springs.__path__, "springs.")
    ]
    return {
        value
        for module in modules
        for value in vars(module).values()
        if inspect.isclass(value)
        and not getattr(value, "_is_protocol", False)
        and all(hasattr(value, member) for member in MEMBERS)
    }


LOWER, UPPER = st.floats(-1.5, 0.0), st.floats(0.0, 1.5)
STIFFNESS = st.floats(0.0, 1e3)
TORQUES = st.integers(-100_000, 100_000).map(lambda milli: milli / 1000.0)
RATES = st.floats(-6.0, -0.1) | st.floats(0.1, 6.0)
SMALL = st.floats(-2.0, 2.0)
RANGES = st.none() | st.tuples(st.floats(-3.0, -1.0), st.floats(-1.0, 3.0))

TERMS = st.builds(ExponentialTerm, st.floats(-50.0, 50.0), RATES, st.floats(-1.0, 1.0))
STEPS = st.lists(st.tuples(st.floats(0.05, 1.0), TORQUES), min_size=2, max_size=8)


def _curve(steps: list[tuple[float, float]]) -> Interpolated:
    gaps, torques = zip(*steps, strict=True)
    return Interpolated(tuple(zip((np.cumsum(gaps) - 2.0).tolist(), torques, strict=True)))


STRATEGIES = {
    Cubic: st.builds(
        Cubic,
        st.tuples(*[st.floats(-300.0, 300.0)] * 4),
        st.sampled_from([-1, 1]),
        st.none() | st.tuples(LOWER, UPPER),
        st.floats(-1.0, 1.0),
    ),
    Linear: st.builds(Linear, st.floats(0.1, 1e3), SMALL),
    Exponential: st.builds(
        Exponential, st.lists(TERMS, max_size=3).map(tuple), st.floats(-20.0, 20.0), RANGES
    ),
    Interpolated: STEPS.map(_curve),
    SmoothLimit: st.builds(
        SmoothLimit, LOWER, UPPER, STIFFNESS, STIFFNESS, st.floats(0.05, 8.0), RANGES
    ),
    Stop: st.builds(
        Stop, st.none() | LOWER, st.none() | UPPER, st.floats(1.0, 2e3), st.floats(0.01, 0.3)
    ).filter(lambda stop: (stop.lower, stop.upper) != (None, None)),
}
WITHOUT_FRICTION = st.one_of(*STRATEGIES.values())
STRATEGIES[Transformed] = st.builds(Transformed, WITHOUT_FRICTION, SMALL, SMALL, SMALL)
STRATEGIES[Hysteresis] = st.builds(
    Hysteresis, WITHOUT_FRICTION, WITHOUT_FRICTION, st.floats(1e-3, 1.0)
) | st.builds(Hysteresis.from_mean_and_width, WITHOUT_FRICTION, st.floats(0.0, 20.0))


# Laws that resist beyond two limits, and angles beyond a limit, the least number among them.

EDGES = st.tuples(st.just(0.0) | LOWER, st.just(0.0) | UPPER)
SIZES = st.floats(0.0, 300.0)
RESISTING = st.one_of(
    st.builds(
        lambda edges, *numbers: Stop(*edges, *numbers),
        EDGES,
        st.floats(1.0, 2e3),
        st.floats(0.01, 0.3),
    ),
    st.builds(
        lambda edges, k, width: SmoothLimit(*edges, k, k, width),
        EDGES,
        STIFFNESS,
        st.floats(0.05, 8.0),
    ),
    st.builds(
        lambda edges, c0, c1, c3: Cubic((c0, c1, 0.0, c3), -1, edges),
        EDGES,
        st.floats(-300.0, 300.0),
        SIZES,
        SIZES,
    ),
)
EXCESSES = st.sampled_from([5e-324, 1e-300, 1.7e-65, 1e-17, 1e-12, 1e-9]) | st.floats(0.0, 2.0)


# What a springs file holds: decimal numbers of any size, so that reading back is exact.

NUMBERS = st.floats(-1e30, 1e30)
POSITIVE = st.floats(1e-6, 1e6)
ANGLES = st.floats(-2.0 * pi, 2.0 * pi)
ZONES = st.tuples(ANGLES, ANGLES).map(lambda ends: (min(ends), max(ends)))
MEASURED = st.none() | ZONES.filter(lambda ends: ends[0] < ends[1])
FILE_TORQUES = st.floats(-1e6, 1e6)
POINT_ANGLES = st.lists(st.integers(-360, 360), min_size=2, max_size=20, unique=True).map(sorted)
CURVES = POINT_ANGLES.flatmap(
    lambda angles: st.tuples(*[st.tuples(st.just(radians(a)), FILE_TORQUES) for a in angles])
).map(Interpolated)
ROWS = [f"{name}/{row}" for name in publications() for row in publication(name).curves]


def _stated(entry: CubicEntry, is_stated: bool) -> CubicEntry:
    stated = is_stated or entry.dead_zone is not None
    return CubicEntry(entry.coefficients, entry.sense, entry.dead_zone, stated, entry.rest)


def _two_curves(up: Interpolated, gap: float) -> Hysteresis:
    return Hysteresis(up, Interpolated(tuple((angle, torque + gap) for angle, torque in up.points)))


ENTRY_STRATEGIES = {
    CubicEntry: st.builds(
        _stated,
        st.builds(
            CubicEntry,
            st.tuples(*[NUMBERS] * 4),
            st.sampled_from([None, -1, 1]),
            st.none() | ZONES,
            st.just(False),
            ANGLES,
        ),
        st.booleans(),
    ),
    Linear: st.builds(Linear, st.just(0.0) | POSITIVE, ANGLES),
    SlideEntry: st.builds(SlideEntry, st.just(0.0) | POSITIVE, st.floats(-1.0, 1.0)),
    Exponential: st.builds(
        Exponential,
        st.lists(
            st.builds(ExponentialTerm, FILE_TORQUES, FILE_TORQUES.filter(bool)),
            min_size=1,
            max_size=20,
        ).map(tuple),
        FILE_TORQUES,
        MEASURED,
    ),
    Interpolated: CURVES,
    SmoothLimit: st.builds(
        lambda ends, *numbers: SmoothLimit(*ends, *numbers),
        ZONES,
        st.just(0.0) | POSITIVE,
        st.just(0.0) | POSITIVE,
        st.floats(1e-3, 10.0),
        MEASURED,
    ),
    Hysteresis: st.builds(_two_curves, CURVES, st.floats(0.0, 100.0)),
    PublishedLaw: st.builds(PublishedLaw, st.sampled_from(ROWS), st.sampled_from([-1, 1])),
}
