import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from springs import Cubic, NotRestoringError, passive_cubic, restoring_sense
from springs.cubic import outer_roots, polynomial

# The left side of appendix A [N m, rad]; sense; dead zone [deg] or None; single root [deg] or None;
# the most that the curve without its dead zone pushes outwards below and above its middle root.
TABLE = {
    "waist x": ((-0.427, 19.6, 0.676, -86.0), +1, (-27.7, 26.9), None, (3.98, 3.23)),
    "waist y": ((49.6, -153.0, -120.0, 241.0), -1, (-42.3, 53.9), None, (78.4, 34.4)),
    "waist z": ((-4.65, 136.0, 2.89, -92.6), +1, (-69.5, 69.3), None, (66.7, 60.2)),
    "shoulder x": (
        (0.916317, 8.6218689, -14.15546098, 5.26654657),
        -1,
        (-5.3, 91.0),
        None,
        (2.44, 0.31),
    ),
    "shoulder y": ((-2.206618, 30.54884913, -50.8802156, 29.9064608), -1, None, 4.8, None),
    "shoulder z": ((1.649642, -8.4232817, -18.5215934, -9.4045474), +1, None, 8.3, None),
    "hip x": ((-0.131, 136.0, 8.42, -218.0), +1, (-44.2, 46.3), None, (39.8, 43.0)),
    "hip y": ((33.180672, -144.6, 188.2, -82.76), +1, None, 23.2, None),
    "hip z": ((2.91, 38.3, -13.4, -106.0), +1, (-36.1, 33.2), None, (7.78, 10.3)),
}
GIVEN = {
    "elbow": ((1.014, 29.224, -6.13885, 214.423), -1, (0.0, 1.7), (0.0, 97.4)),
    "knee": ((-15.5, 84.5, -124.0, 49.2), -1, (0.0, 1.553), (0.0, 89.0)),
}

numbers = st.floats(-300.0, 300.0)


@pytest.mark.parametrize("name", TABLE)
def test_sense_and_dead_zone_of_every_printed_curve(name):
    coefficients, sense, zone, root, _ = TABLE[name]
    law = passive_cubic(coefficients)
    assert law.coefficients == coefficients
    assert law.sense == sense
    if zone is None:
        assert law.dead_zone is None
        assert law.torque(np.radians(root - 0.05)) > 0.0 > law.torque(np.radians(root + 0.05))
    else:
        assert np.degrees(law.dead_zone) == pytest.approx(zone, abs=0.05)


@pytest.mark.parametrize("name", GIVEN)
def test_a_given_dead_zone_wins_over_the_roots(name):
    coefficients, sense, zone, in_degrees = GIVEN[name]
    law = passive_cubic(coefficients, zone)
    assert (law.sense, law.dead_zone) == (sense, zone)
    assert np.degrees(law.dead_zone) == pytest.approx(in_degrees, abs=0.05)


@given(st.lists(st.floats(-2.0, 2.0), min_size=3, max_size=3), st.floats(1.0, 300.0), st.booleans())
def test_three_roots_give_the_dead_zone_between_the_outer_two(roots, size, negative):
    roots = [root + 0.1 * k for k, root in enumerate(sorted(roots))]
    c3, c2, c1, c0 = np.poly(roots) * (-size if negative else size)
    law = passive_cubic((c0, c1, c2, c3))
    assert law.sense == (1 if negative else -1)
    assert law.dead_zone == pytest.approx((roots[0], roots[2]), abs=1e-7)


@given(numbers, numbers, numbers, numbers.filter(lambda c3: abs(c3) > 0.1))
def test_every_cubic_becomes_passive(c0, c1, c2, c3):
    law = passive_cubic((c0, c1, c2, c3))
    real = [root.real for root in np.roots([c3, c2, c1, c0]) if abs(root.imag) < 1e-6]
    low, high = law.dead_zone or (min(real), max(real))
    far = np.linspace(1e-3, 8.0, 200)
    scale = 1e-9 * abs(polynomial((abs(c0), abs(c1), abs(c2), abs(c3)), abs(low) + abs(high) + 8.0))
    assert (law.torque(high + far) <= scale).all()
    assert (law.torque(low - far) >= -scale).all()


@pytest.mark.parametrize(
    ("coefficients", "sense"),
    [
        ((5.0, 1.0, 9.0, 2.0), -1),
        ((5.0, 1.0, 9.0, -2.0), 1),
        ((5.0, 1.0, 0.0, 0.0), -1),
        ((5.0, -1.0, 0.0, 0.0), 1),
        ((0.0, 0.0, 0.0, 0.0), -1),
    ],
)
def test_the_sense_is_the_one_that_restores_at_both_ends(coefficients, sense):
    assert restoring_sense(coefficients) == sense


@pytest.mark.parametrize(
    ("coefficients", "message"),
    [((1.0, 2.0, 3.0, 0.0), "pushes the same way"), ((1.0, 0.0, 0.0, 0.0), "restores nowhere")],
)
def test_what_no_sense_makes_restoring_is_refused_unless_the_range_is_bounded(
    coefficients, message
):
    with pytest.raises(NotRestoringError, match=message):
        passive_cubic(coefficients)
    assert passive_cubic(coefficients, bounded=True) == Cubic(coefficients, -1)


@pytest.mark.parametrize(
    "coefficients",
    [(0.0, 1.0, 0.0, 1.0), (0.0, 0.0, 0.0, 1.0), (1.0, 2.0, 0.0, 0.0), (0.0, -1e300, 1.0, 1e-300)],
)
def test_no_dead_zone_without_three_roots_in_reach(coefficients):
    assert outer_roots(coefficients) is None


@pytest.mark.parametrize("scale", [1e-150, 1e-60, 1e60, 1e150])
def test_roots_do_not_overflow(scale):
    low, high = outer_roots((0.0, -(scale**2), 0.0, 1.0))
    assert (low / scale, high / scale) == pytest.approx((-1.0, 1.0))
