"""The laws of a springs file: what each key means, down to a torque by hand."""

from itertools import pairwise
from math import exp, radians, tanh
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from generator.diagnostics import select_errors
from generator.figure import Figure
from generator.figure_file import FIGURE_FILE
from generator.springs_file.parse import SPRINGS_FILE
from generator.springs_file.read import load_springs
from springs import AxisSpring, Damping, total_torque
from springs.published.tables import curve, publication, publications

FIGURE = """
figure { segment base { site s->location = trans(0,0,0); }
segment shank { site s->location = trans(0,0,0); }
joint left_knee { connect base.s to shank.s; type = R(0,-1,0); }
root = base.s; }
"""
ANGLES = np.radians(np.linspace(-30.0, 150.0, 37))


def figure() -> Figure:
    reading = FIGURE_FILE.parse_text(FIGURE)
    assert reading.value is not None, reading.diagnostics
    return reading.value


def spring(body: str) -> str:
    return f'[[spring]]\njoints = ["left_knee"]\n{body}\n'


def hung(body: str) -> AxisSpring:
    """The spring that a table gives the knee."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / "own.springs.toml"
        path.write_text(spring(body), encoding="utf-8")
        reading = load_springs(figure(), None, None, path)
    # Rows of all joints hang on this one.
    assert all("is a curve of" in fault.message for fault in reading.diagnostics)
    assert reading.value is not None
    (one,) = reading.value.joints["left_knee"].axes
    return one


def torque(body: str, degrees: float) -> float:
    return float(total_torque(hung(body).elastic, radians(degrees)))


# torques by hand


def test_exponentials_and_their_constant():
    body = "exponentials_Nm_1_rad = [[3.0, -4.0], [-0.5, 2.0]]\nconstant_Nm = 1.5"
    by_hand = 1.5 + 3.0 * exp(-4.0 * radians(40.0)) - 0.5 * exp(2.0 * radians(40.0))
    assert torque(body, 40.0) == pytest.approx(by_hand, rel=1e-14)
    (law,) = hung(body + "\nmeasured_deg = [-5, 110]").elastic
    assert law.valid_range == pytest.approx((radians(-5.0), radians(110.0)))


def test_smooth_limits_push_from_both_sides():
    body = "limits_deg = [10, 80]\nlimit_stiffness_Nm_rad = [50.0, 20.0]\ntransition_deg = 40"
    assert torque(body, 45.0) == 0.0
    # Half the transition beyond: S(1/2) = 10/8 - 15/16 + 6/32 = 1/2.
    assert torque(body, 100.0) == pytest.approx(-20.0 * radians(20.0) * 0.5, rel=1e-12)
    assert torque(body, -10.0) == pytest.approx(50.0 * radians(20.0) * 0.5, rel=1e-12)
    assert torque(body, 140.0) == pytest.approx(-20.0 * radians(60.0), rel=1e-12)


def test_two_curves_are_followed_by_the_direction():
    body = (
        "increasing_points_deg_Nm = [[0, 4], [60, -12]]\n"
        "decreasing_points_deg_Nm = [[0, 10], [60, -4]]\nslip_rad_s = 0.2"
    )
    one = hung(body)
    (law,) = one.elastic
    assert torque(body, 30.0) == pytest.approx(0.5 * (-4.0 + 3.0))
    assert one.resistance(radians(30.0), 50.0) == pytest.approx(-3.5)
    assert one.resistance(radians(30.0), -0.1) == pytest.approx(3.5 * tanh(0.5))
    assert law.slip == 0.2


def test_hysteresis_lies_beside_any_law():
    one = hung("stiffness_Nm_rad = 20\nhysteresis_Nm = 6\nviscous_Nms_rad = 0.5")
    assert float(total_torque(one.elastic, 0.3)) == pytest.approx(-6.0)
    assert one.resistance(0.3, 2.0) == pytest.approx(-3.0 - 0.5 * 2.0)


@pytest.mark.parametrize(
    "law",
    [
        "coefficients_Nm_rad = [1, 20, -5, 60]\nsense = -1",
        "stiffness_Nm_rad = 12\nrest_deg = 20",
        "exponentials_Nm_1_rad = [[3, -4], [-0.5, 2]]",
        "points_deg_Nm = [[0, 12], [30, 2], [60, -8]]",
        "limits_deg = [10, 80]\nlimit_stiffness_Nm_rad = [50, 20]\ntransition_deg = 40",
        "increasing_points_deg_Nm = [[0, 4], [60, -12]]\n"
        "decreasing_points_deg_Nm = [[0, 10], [60, -4]]",
        'published = "davy_audu_1987/knee"',
    ],
)
def test_every_law_is_scaled_and_moved_towards_greater_angles(law: str):
    plain, changed = hung(law), hung(f"{law}\nscale = 0.25\noffset_deg = 15")
    there, here = (
        np.asarray(total_torque(one.elastic, ANGLES + by))
        for one, by in ((changed, radians(15.0)), (plain, 0.0))
    )
    assert there == pytest.approx(0.25 * here, rel=1e-12, abs=1e-12)
    moved = changed.resistance(radians(40.0), 3.0) + changed.damping.viscous * 3.0
    still = plain.resistance(radians(25.0), 3.0) + plain.damping.viscous * 3.0
    assert moved == pytest.approx(0.25 * still, rel=1e-12, abs=1e-12)


# published curves


def test_a_published_row_is_its_law_with_its_reference_and_damping():
    for key in (f"{name}/{row}" for name in publications() for row in publication(name).curves):
        one, row = hung(f'published = "{key}"'), curve(key)
        mine, its = (np.asarray(total_torque(laws, ANGLES)) for laws in (one.elastic, (row.law,)))
        assert np.array_equal(mine, its), key
        assert one.reference == str(row.reference)
        assert one.damping == Damping(row.damping or 0.0), key


def test_a_published_row_against_the_axis_is_mirrored():
    one = hung('published = "davy_audu_1987/knee"\npublished_sense = -1')
    law = curve("davy_audu_1987/knee").law
    mine = np.asarray(total_torque(one.elastic, -ANGLES))
    assert mine == pytest.approx(-np.asarray(law.torque(ANGLES)), rel=1e-14)
    assert one.motion == ""


def test_what_a_file_states_wins_over_the_published_row():
    body = 'published = "davy_audu_1987/knee"\nviscous_Nms_rad = 0\nreference = "me"\nwhy = "so"'
    one = hung(body)
    assert (one.damping.viscous, one.reference, one.why) == (0.0, "me", "so")
    assert one.motion == "flexion"


def test_the_angles_that_were_held_are_told():
    assert hung('published = "silder_2007/hip_knee_15"').why.startswith(
        "As published, with knee at 15 deg."
    )


def test_the_range_of_a_row_is_told_where_its_law_does_not_know_it():
    why = hung('published = "han_2010/flexion"').why
    assert "Usable for its own angles from 0 deg to 73 deg." in why


DEGREES = st.integers(-360_000, 360_000).map(lambda angle: angle / 1000.0)


@given(st.lists(st.tuples(DEGREES, st.floats(-1e3, 1e3)), max_size=5))
def test_any_points_make_a_curve_or_a_fault(points: list[tuple[float, float]]):
    reading = SPRINGS_FILE.parse_text(spring(f"points_deg_Nm = {[list(p) for p in points]!r}"))
    angles = [angle for angle, _ in points]
    in_order = len(points) > 1 and all(a < b for a, b in pairwise(angles))
    assert bool(select_errors(reading.diagnostics)) is not in_order
