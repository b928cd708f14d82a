"""What `smooth_where` joins has equal values and slopes; what `where` joins has not.

An integration ends a step at the edges of `where` alone, so a kink behind `smooth_where` would pass
through it unseen. Both sides of each edge are evaluated with complex steps, whose slopes are exact.
"""

import ast
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import springs
from generator.contact.box import Box
from springs import NUMPY, Cubic, Stop
from springs.backends import CubicPieces, select_cubic
from springs.contact import Surface
from springs.exponential import Exponential, ExponentialTerm
from springs.interpolated import Interpolated
from springs.parts import half_quaternion
from springs.smooth_limit import SmoothLimit
from springs.spherical import group_torque
from tests.contact_figures import surfaces
from tests.laws import RATES, STRATEGIES

Function: TypeAlias = Callable[[Any, Any], Any]

STEP = 1e-30

ROOT = Path(springs.__file__).parents[1]

USES = {
    "springs/backends.py": {"select_cubic"},
    "springs/contact.py": {"rising_force", "rising_slope", "rising_energy", "impact_factor"},
    "springs/coordinates.py": {"at"},
    "springs/exponential.py": {"tangent_exp", "tangent_exp_integral"},
    "springs/interpolated.py": {"_stored_energy"},
    "springs/parts.py": {"half_quaternion"},
    "springs/reach.py": {"boundary", "torque", "_at"},
    "springs/smooth_limit.py": {"_smoothed_excess", "_smoothed_excess_integral"},
    "springs/spherical.py": {"group_torque", "weighted_torque"},
    "springs/stop.py": {"_stored_energy"},
    "springs/tone/activation.py": {"_step"},
    "generator/contact/box.py": {"distance"},
    "generator/contact/force.py": {"contact_force"},
    "generator/contact/self_contact.py": {"_clip"},
}
"""Functions that use `smooth_where`. A reach is tested at its centre in `test_reach.py`, capsules
in `test_self_contact.py`, activation in `tests/springs/tone`; at the pole of coordinates, whose
cosine is kept from zero, a run ends; the weighted law only keeps a size from zero; the derivatives
of a contact force, which no explicit method reads, jump where it stops.
"""


class _Watched(type(NUMPY)):
    """Complex numbers; the conditions of both kinds are kept in the order of their evaluation."""

    def __init__(self) -> None:
        self.conditions: dict[str, list[bool]] = {"where": [], "smooth_where": []}

    def where(self, condition, yes, no):
        self.conditions["where"].append(bool(condition))
        return yes if condition else no

    def smooth_where(self, condition, yes, no):
        self.conditions["smooth_where"].append(bool(condition))
        return yes if condition else no

    def piecewise_cubic(self, value, pieces: CubicPieces):
        return select_cubic(self, value, pieces)


@dataclass(frozen=True)
class Join:
    """Both sides of a place: jumps of value and slope, the largest slope around it, and what joins.

    Attributes:
        value: jump of the value, shape (k,).
        slope: jump of the slope, shape (k,).
        scale: largest slope within 0.3 of the place.
        kinds: the kinds of conditions that change.
    """

    value: np.ndarray
    slope: np.ndarray
    scale: float
    kinds: set[str] = field(default_factory=set)

    @property
    def is_smooth(self) -> bool:
        """Whether the slope jumps by less than a millionth of the largest nearby."""
        return bool(np.max(np.abs(self.slope)) <= 1e-6 * self.scale)

    @property
    def is_continuous(self) -> bool:
        """Whether the value jumps by less than a ten-millionth of what it changes nearby."""
        return bool(np.max(np.abs(self.value)) <= 1e-7 * self.scale + 1e-12)


def at(function: Function, place: float) -> tuple[np.ndarray, np.ndarray, _Watched]:
    """Values and slopes of a function, shape (k,) each, and the conditions."""
    ops = _Watched()
    found = np.ravel(function(np.complex128(complex(place, STEP)), ops)).astype(complex)
    return found.real, found.imag / STEP, ops


def join(function: Function, place: float, width: float = 1e-9, reach: float = 0.3) -> Join:
    """Compare both sides of a place, each `width` from it."""
    (below, slope_below, one), (above, slope_above, other) = (
        at(function, place + side * width) for side in (-1.0, 1.0)
    )
    around = [at(function, place + reach * share)[1] for share in np.linspace(-1.0, 1.0, 13)]
    kinds = {kind for kind, values in one.conditions.items() if values != other.conditions[kind]}
    return Join(
        above - below - width * (slope_below + slope_above),
        slope_above - slope_below,
        float(np.max(np.abs([*around, slope_below, slope_above]))),
        kinds,
    )


TERMS_WITH_END = st.builds(
    ExponentialTerm, st.floats(-50.0, 50.0), RATES, st.floats(-1.0, 1.0), st.floats(-1.0, 3.0)
)
LAWS = (
    STRATEGIES[Stop]
    | STRATEGIES[SmoothLimit]
    | STRATEGIES[Interpolated]
    | st.builds(Exponential, TERMS_WITH_END.map(lambda term: (term,)), st.floats(-20.0, 20.0))
)


@given(law=LAWS)
def test_laws_have_equal_slopes_at_their_breakpoints(law) -> None:
    """Torque and energy of stops, smooth limits, tables and exponentials with a tangent."""
    places = sorted(law.breakpoints)
    for place in places:
        if any(0.0 < abs(place - other) < 1e-6 for other in places):
            continue
        for function in (law.torque, law.energy):
            found = join(function, place)
            assert found.is_smooth
            assert found.is_continuous
            assert found.kinds == {"smooth_where"}


@given(
    c1=st.floats(1.0, 300.0),
    c3=st.floats(1.0, 300.0),
    low=st.floats(-1.0, -0.05),
    high=st.floats(0.05, 1.0),
)
def test_the_edges_of_a_dead_zone_are_located(c1, c3, low, high) -> None:
    """There the slope jumps from zero, which is what `where` is for."""
    law = Cubic((0.0, c1, 0.0, c3), -1, (low, high))
    for edge in law.breakpoints:
        found = join(law.torque, edge)
        assert found.kinds == {"where"}
        assert not found.is_smooth
        assert abs(found.slope[0]) == pytest.approx(c1 + 3.0 * c3 * edge**2, rel=1e-4)
        assert found.is_continuous


@given(surface=surfaces)
def test_a_surface_has_two_derivatives(surface: Surface) -> None:
    """Force and energy at the touch and at the end of the transition."""
    e = surface.transition_depth
    for depth in (0.0, e):
        for function in (surface.elastic_force, surface.elastic_slope, surface.energy):
            found = join(function, depth, 1e-8 * e, 2.0 * e)
            assert found.is_smooth
            assert found.is_continuous
            assert found.kinds == {"smooth_where"}
        curvatures = [
            np.diff(
                [at(surface.elastic_force, depth + side * k * 1e-5 * e)[1] for k in (1, 2)], axis=0
            )
            / (side * 1e-5 * e)
            for side in (-1.0, 1.0)
        ]
        jump = float(np.ravel(curvatures[1] - curvatures[0])[0])
        assert abs(jump) < 1e-3 * surface.stiffness / e


@given(surface=surfaces.filter(lambda one: one.damping > 0.01))
def test_a_surface_stops_to_pull_without_a_jump(surface: Surface) -> None:
    """Its force is never negative. The slope over the rate jumps there: the one kink of contact
    beside those of the shape, which the error control of the steps has to find.
    """
    found = join(surface.impact_factor, -1.0 / surface.damping)
    assert found.kinds == {"smooth_where"}
    assert found.is_continuous
    assert found.slope[0] == pytest.approx(surface.damping)


DIRECTION = np.array([0.6, -0.48, 0.64])


@pytest.mark.parametrize(
    ("function", "place"),
    [
        (lambda a, ops: _parts(half_quaternion(a * DIRECTION, ops)), 1e-4),
        (lambda a, ops: group_torque(np.array([3.0, -1.0, 2.0]), a * DIRECTION, ops), 1e-2),
    ],
)
def test_series_join_what_they_replace(function, place) -> None:
    found = join(function, place, 1e-6 * place)
    assert found.is_smooth
    assert found.is_continuous
    assert found.kinds == {"smooth_where"}


def _parts(half: tuple[Any, Sequence[Any]]) -> np.ndarray:
    return np.array([half[0], *half[1]])


def crossings(box: Box) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Points outside a box, in its axes, from which a direction leads across a condition."""
    half = 0.5 * np.array(box.size)
    for axis in range(3):
        out = np.zeros(3)
        out[axis] = half[axis] + 0.03
        along = np.eye(3)[(axis + 1) % 3]
        yield out, along  # above the middle of a face, where a sign changes
        yield out + half * along, along  # over an edge
        beyond = np.eye(3)[(axis + 2) % 3]
        yield out + half * along + (half + 0.02) * beyond, along  # over a corner
        surface = out.copy()
        surface[axis] = half[axis]
        yield surface + 0.3 * half * along, np.eye(3)[axis]  # through the face


@pytest.mark.parametrize("size", [(1.0, 0.6, 0.8), (2.0, 0.02, 2.0)])
def test_the_distance_of_a_box_has_equal_slopes_outside(size) -> None:
    """And its normal does not jump; inside, that of the nearest face does."""
    box = Box((0.0, 0.0, 0.0), size)
    seen: set[str] = set()
    for start, direction in crossings(box):

        def along(s: Any, ops: Any, start=start, direction=direction) -> np.ndarray:
            distance, normal = box.distance(tuple(start + s * direction), ops)
            return np.array([distance, *normal])

        found = join(along, 0.0, 1e-10, 1e-3)
        seen |= found.kinds
        assert np.max(np.abs(found.value)) < 1e-7
        assert abs(found.slope[0]) < 1e-6
    assert seen == {"smooth_where"}


def test_all_uses_are_known() -> None:
    """A new use of `smooth_where` gets a test here, or is named in `USES`."""
    found: dict[str, set[str]] = {}
    for folder in ("springs", "generator/contact"):
        for path in (ROOT / folder).rglob("*.py"):
            for function in ast.walk(ast.parse(path.read_text("utf-8"))):
                if isinstance(function, ast.FunctionDef) and any(
                    isinstance(call, ast.Call)
                    and isinstance(call.func, ast.Attribute)
                    and call.func.attr == "smooth_where"
                    for call in ast.walk(function)
                ):
                    key = path.relative_to(ROOT).as_posix()
                    found.setdefault(key, set()).add(function.name)
    assert found == USES
