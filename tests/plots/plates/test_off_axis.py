"""The plate of oblique axes: its claims, against the laws written out with the printed numbers."""

from itertools import pairwise
from math import cos, hypot, pi, radians, sin

import numpy as np
import pytest
from scipy.integrate import quad

from plots.plates.off_axis import LOOP, ObliqueHip, printed_torques
from springs import SphericalLaw
from tests.plots.drawn import plate

TURN = radians(60.0)
EDGES = radians(-44.189991), radians(46.347789)


def abduction(a: float) -> float:
    """The hip's x record: on the child, with the roots of the cubic as edges of a dead zone."""
    if EDGES[0] <= a <= EDGES[1]:
        return 0.0
    return -0.131 + 136.0 * a + 8.42 * a**2 - 218.0 * a**3


def flexion(a: float) -> float:
    """The hip's y record: on the child."""
    return 33.180672 - 144.6 * a + 188.2 * a**2 - 82.76 * a**3


def weighted(x: float, y: float) -> tuple[float, float]:
    """The mended eq. 4.4 in the first quadrant of rotation vectors."""
    a = hypot(x, y)
    flexing = flexion(0.0) + y / a * (flexion(a) - flexion(0.0))
    return x / a * abduction(a), flexing


@pytest.fixture(scope="module")
def drawn():
    return plate("off_axis")


@pytest.fixture(scope="module")
def hip():
    return ObliqueHip()


def test_the_work_of_the_weighted_law(drawn) -> None:
    """The four sides integrated by themselves.

    In the half-way frame the leg turns along the rotation vector as fast as that grows, and across
    it less by sin(a/2)/(a/2).
    """

    def rate(x: float, y: float, dx: float, dy: float) -> float:
        a = hypot(x, y)
        tx, ty = weighted(x, y)
        along, across = (tx * x + ty * y) / a, (ty * x - tx * y) / a
        going, aside = (dx * x + dy * y) / a, (dy * x - dx * y) / a
        return along * going + across * aside * sin(0.5 * a) / (0.5 * a)

    def side(p: tuple[float, float], q: tuple[float, float]) -> float:
        dx, dy = q[0] - p[0], q[1] - p[1]

        def power(s: float) -> float:
            return rate(p[0] + s * dx, p[1] + s * dy, dx, dy)

        return float(quad(power, 1e-12, 1.0 - 1e-12, points=[EDGES[1] / TURN], limit=200)[0])

    expected = sum(side(p, q) for p, q in pairwise(LOOP))
    assert expected > 100.0
    assert drawn.claims[3].measured == pytest.approx(expected, abs=1e-3)


def test_the_conservative_law_gives_what_its_energy_says(hip) -> None:
    """From standing to 60 deg in both: the integrals of the two axes' laws."""
    work = hip.work_along_path(((0.0, 0.0), (0.9, 0.3), (TURN, TURN)), SphericalLaw.CONSERVATIVE)[
        1
    ][-1]
    expected = quad(abduction, 0.0, TURN, points=[EDGES[1]])[0] + quad(flexion, 0.0, TURN)[0]
    assert work == pytest.approx(expected, abs=1e-4)


@pytest.mark.parametrize("degrees", [0.0, 30.0, 67.5, 90.0])
def test_torques_between_the_axes(drawn, degrees) -> None:
    table = drawn.tables["oblique"]
    (row,) = np.flatnonzero(np.isclose(table["axis from abduction to flexion [deg]"], degrees))
    c, s = cos(radians(degrees)), sin(radians(degrees))
    x, y = TURN * c, TURN * s
    tx, ty = weighted(x, y)
    assert table["weighted along [N m]"][row] == pytest.approx(tx * c + ty * s, abs=1e-4)
    assert table["weighted across [N m]"][row] == pytest.approx(ty * c - tx * s, abs=1e-4)
    fx, fy = abduction(x), flexion(y)
    across = (fy * c - fx * s) * (pi / 6.0) / sin(pi / 6.0)
    assert table["conservative along [N m]"][row] == pytest.approx(fx * c + fy * s, abs=1e-4)
    assert table["conservative across [N m]"][row] == pytest.approx(across, abs=1e-4)


def test_eq_4_4_as_printed(hip) -> None:
    """At 60 deg abduction -98.8 N m, flexion -6.9 N m; between them each times its component."""
    found = printed_torques(hip)
    assert found.along[[0, -1]] == pytest.approx([-98.8, -6.9], abs=0.05)
    x, y = abduction(TURN), flexion(TURN)
    middle = len(found.along) // 2
    assert found.along[middle] == pytest.approx(0.5 * (x + y), abs=1e-9)
    assert found.across[middle] == pytest.approx(0.5 * (y - x), abs=1e-9)
