"""The formulas of the published tables: printed coefficients become laws in rad and N m.

Each formula stands in the tables as it is printed, and is the key of what reads it here.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import radians

from springs.cubic import Cubic, passive_cubic
from springs.elastic import Elastic, Range
from springs.exponential import Exponential, ExponentialTerm
from springs.interpolated import Interpolated
from springs.linear import Linear
from springs.smooth_limit import SmoothLimit

ANGLE_UNITS = {"rad": 1.0, "deg": radians(1.0)}
"""Angle units of the tables [rad]."""

MOMENT_UNITS = {"N m": 1.0, "dyn cm": 1e-7}
"""Moment units of the tables [N m]."""


@dataclass(frozen=True)
class PrintedCurve:
    """A curve as it is printed.

    Attributes:
        coefficients: coefficients by their printed names, in the printed units.
        points: pairs of angle and moment in the printed units, for a curve given so.
        dead_zone: dead zone in the printed angle unit, or None.
        angle_unit: the printed angle unit [rad].
        moment_unit: the printed moment unit [N m].
        valid_range: range in which the curve is known to hold, in its printed sense [rad], or None.
    """

    coefficients: Mapping[str, float]
    points: tuple[tuple[float, float], ...]
    dead_zone: Range | None
    angle_unit: float
    moment_unit: float
    valid_range: Range | None


@dataclass(frozen=True)
class Formula:
    """The names of a formula's coefficients, and the law that they make."""

    coefficient_names: tuple[str, ...]
    build_law: Callable[[PrintedCurve], Elastic]


def _exponential(printed: PrintedCurve, *terms: tuple[float, float, float]) -> Exponential:
    """Terms of amplitude, rate and centre in printed units; those without a rate are constants."""
    u, m = printed.angle_unit, printed.moment_unit
    turned = tuple(
        ExponentialTerm(a * m, rate / u, centre * u) for a, rate, centre in terms if rate != 0.0
    )
    constant = sum(a * m for a, rate, _ in terms if rate == 0.0)
    return Exponential(turned, constant, printed.valid_range)


def _davy_audu(p: PrintedCurve) -> Elastic:
    n = p.coefficients
    return _exponential(p, (n["k1"], -n["k2"], n["qlo"]), (-n["k3"], n["k4"], n["qhi"]))


def _anderson_1999(p: PrintedCurve) -> Elastic:
    n = p.coefficients
    return _exponential(p, (n["K1"], n["K2"], n["th2"]), (n["K3"], n["K4"], n["th1"]))


def _anderson_2007(p: PrintedCurve) -> Elastic:
    n = p.coefficients
    return _exponential(p, (n["B1"], n["k1"], 0.0), (n["B2"], n["k2"], 0.0))


def _van_arkel(p: PrintedCurve) -> Elastic:
    n = p.coefficients
    return _exponential(p, (n["a1"], n["b1"], n["c1"]), (n["a2"], n["b2"], -n["c2"]))


def _saul(p: PrintedCurve) -> Elastic:
    n, u = p.coefficients, p.angle_unit
    low, high = (n[name] * p.moment_unit / u for name in ("Klo", "Kup"))
    return SmoothLimit(n["qlo"] * u, n["qup"] * u, low, high, n["tr"] * u, p.valid_range)


def _cubic(p: PrintedCurve) -> Elastic:
    """The thesis's cubic, its sense and dead zone read by the rule of `springs.cubic`."""
    n, u, m = p.coefficients, p.angle_unit, p.moment_unit
    coefficients = (n["c0"] * m, n["c1"] * m / u, n["c2"] * m / u**2, n["c3"] * m / u**3)
    zone = p.dead_zone and (p.dead_zone[0] * u, p.dead_zone[1] * u)
    return passive_cubic(coefficients, zone)


def _linear(p: PrintedCurve) -> Elastic:
    n, u = p.coefficients, p.angle_unit
    return Linear(n["K"] * p.moment_unit / u, n["q0"] * u)


def _segments_linear(p: PrintedCurve) -> Elastic:
    n = p.coefficients
    return Linear(n["K"] / n["n"] * p.moment_unit / p.angle_unit)


def _segments_cubic(p: PrintedCurve) -> Elastic:
    n, m = p.coefficients, p.moment_unit
    share = 1.0 / (n["n"] * p.angle_unit)
    coefficients = (0.0, n["a1"] * m * share, n["a2"] * m * share**2, n["a3"] * m * share**3)
    return Cubic(coefficients, sense=1)


def _interpolated_points(p: PrintedCurve) -> Elastic:
    return Interpolated(tuple((x * p.angle_unit, y * p.moment_unit) for x, y in p.points))


FORMULAS: Mapping[str, Formula] = {
    "c0 + c1 a + c2 a^2 + c3 a^3": Formula(("c0", "c1", "c2", "c3"), _cubic),
    "k1 exp(-k2 (q - qlo)) - k3 exp(-k4 (qhi - q))": Formula(
        ("k1", "k2", "qlo", "k3", "k4", "qhi"), _davy_audu
    ),
    "K1 exp(K2 (q - th2)) + K3 exp(K4 (q - th1))": Formula(
        ("K1", "K2", "K3", "K4", "th1", "th2"), _anderson_1999
    ),
    "B1 exp(k1 th) + B2 exp(k2 th)": Formula(("B1", "k1", "B2", "k2"), _anderson_2007),
    "a1 exp(b1 (q - c1)) + a2 exp(b2 (q + c2))": Formula(
        ("a1", "b1", "c1", "a2", "b2", "c2"), _van_arkel
    ),
    "-Kup S((q-qup)/tr) (q-qup) + Klo S((qlo-q)/tr) (qlo-q), S(x) = 10x^3 - 15x^4 + 6x^5": Formula(
        ("qup", "Kup", "qlo", "Klo", "tr"), _saul
    ),
    "-K (q - q0)": Formula(("K", "q0"), _linear),
    "-K x for each of n segments in series": Formula(("K", "n"), _segments_linear),
    "a1 x + a2 x^2 + a3 x^3 for each of n segments in series": Formula(
        ("a1", "a2", "a3", "n"), _segments_cubic
    ),
    "points": Formula((), _interpolated_points),
}
