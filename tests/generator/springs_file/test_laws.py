"""The laws of a springs file: what each key means, down to a torque by hand, and what is wrong."""

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
from generator.figure_file import parse_figure
from generator.springs_file.parse import SpringsFile, parse_springs
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
    reading = parse_figure(FIGURE)
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
    (one,) = reading.value.springs.joints["left_knee"].axes
    return one


def torque(body: str, degrees: float) -> float:
    return float(total_torque(hung(body).elastic, radians(degrees)))


def content(body: str) -> SpringsFile:
    reading = parse_springs(spring(body))
    assert reading.diagnostics == ()
    assert reading.value is not None
    return reading.value


def said(text: str) -> list[str]:
    faults = [fault.as_dict() for fault in parse_springs(text).diagnostics]
    return [f"{f['line']}:{f['column']} {f['message']}" for f in faults]


# torques by hand


def test_exponentials_and_their_constant():
    body = "exponentials_Nm_1_rad = [[3.0, -4.0], [-0.5, 2.0]]\nconstant_Nm = 1.5"
    by_hand = 1.5 + 3.0 * exp(-4.0 * radians(40.0)) - 0.5 * exp(2.0 * radians(40.0))
    assert torque(body, 40.0) == pytest.approx(by_hand, rel=1e-14)
    (law,) = hung(body + "\nmeasured_deg = [-5, 110]").elastic
    assert law.valid_range == pytest.approx((radians(-5.0), radians(110.0)))


def test_points_are_met_and_the_tangent_goes_on():
    body = "points_deg_Nm = [[0, 12.0], [30, 2.0], [60, -8.0]]"
    assert [torque(body, angle) for angle in (0.0, 30.0, 60.0)] == pytest.approx([12.0, 2.0, -8.0])
    assert torque(body, 45.0) == pytest.approx(-3.0)
    assert torque(body, 90.0) == pytest.approx(-18.0)


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


@pytest.mark.parametrize(
    "key", [f"{name}/{row}" for name in publications() for row in publication(name).curves]
)
def test_a_published_row_is_its_law_with_its_reference_and_damping(key: str):
    one, row = hung(f'published = "{key}"'), curve(key)
    mine, its = (np.asarray(total_torque(laws, ANGLES)) for laws in (one.elastic, (row.law,)))
    assert np.array_equal(mine, its)
    assert one.reference == str(row.reference)
    assert one.damping == Damping(row.damping or 0.0)


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
    assert "Usable for its own angles from 0 deg on." in hung('published = "han_2010/flexion"').why


# what is wrong

E = "exponentials_Nm_1_rad = [[3, -4]]\n"
L = "limits_deg = [0, 90]\nlimit_stiffness_Nm_rad = [9, 9]\n"
UP = "increasing_points_deg_Nm = [[0, 1], [90, -1]]\n"
DOWN = "decreasing_points_deg_Nm = [[0, 2], [90, 0]]\n"
BROKEN = {
    "no pairs": (
        "exponentials_Nm_1_rad = [3, -4]",
        ["3:25 `exponentials_Nm_1_rad` must be a list of pairs of numbers"],
    ),
    "no list": (
        'points_deg_Nm = "0"',
        ["3:17 `points_deg_Nm` must be a list of pairs of numbers"],
    ),
    "no exponential": (
        "exponentials_Nm_1_rad = []",
        ["3:25 `exponentials_Nm_1_rad` has 0 pairs and needs 1 at least"],
    ),
    "three numbers, and one": (
        "exponentials_Nm_1_rad = [[3, -4, 1], [2, 1], [1]]",
        ["3:26 a pair has two numbers, not 3 numbers", "3:46 a pair has two numbers, not 1 number"],
    ),
    "no numbers": (
        'exponentials_Nm_1_rad = [["3", -4], [nan, 1e999]]',
        [
            "3:27 a number is expected here",
            "3:38 this number is not finite",
            "3:43 this number is too large",
        ],
    ),
    "rate zero": (
        "exponentials_Nm_1_rad = [[3, -4], [1, 0]]",
        ["3:39 the rate of an exponential must not be zero"],
    ),
    "measured reversed": (
        E + "measured_deg = [90, 0]",
        ["4:16 `measured_deg` ends before it begins"],
    ),
    "constant alone": (
        "stiffness_Nm_rad = 1\nconstant_Nm = 2",
        ["4:15 `constant_Nm` belongs to exponentials"],
    ),
    "measured of a cubic": (
        "stiffness_Nm_rad = 1\nmeasured_deg = [0, 1]",
        ["4:16 `measured_deg` belongs to exponentials or limits"],
    ),
    "one point": (
        "points_deg_Nm = [[0, 1]]",
        ["3:17 `points_deg_Nm` has 1 pair and needs 2 at least"],
    ),
    "points out of order": (
        "points_deg_Nm = [[0, 1], [20, 0], [10, 0], [10, 1]]",
        [
            "3:35 the points of a curve are not in order: 10 deg comes after 20 deg",
            "3:44 the points of a curve are not in order: 10 deg comes after 10 deg",
        ],
    ),
    "points too steep": (
        "points_deg_Nm = [[0, 0], [1e-300, 1e300]]",
        ["3:17 this curve is too steep for numbers"],
    ),
    "points not finite": (
        "points_deg_Nm = [[0, inf], [20, 0]]",
        ["3:22 this number is not finite"],
    ),
    "limits alone": (
        "limits_deg = [0, 90]",
        [
            "3:14 `limits_deg` needs `limit_stiffness_Nm_rad` beside it",
            "3:14 `limits_deg` needs `transition_deg` beside it",
        ],
    ),
    "limits wrong": (
        "limits_deg = [90, 0]\nlimit_stiffness_Nm_rad = [1, -9]\ntransition_deg = 0",
        [
            "3:14 `limits_deg` ends before it begins",
            "4:30 a limit's stiffness must not be below zero",
            "5:18 `transition_deg` must be above zero",
        ],
    ),
    "one curve of two": (
        DOWN,
        ["3:28 `decreasing_points_deg_Nm` needs `increasing_points_deg_Nm` beside it"],
    ),
    "curves exchanged": (
        UP.replace("increasing", "decreasing") + DOWN.replace("decreasing", "increasing"),
        [
            "4:28 the curve of the growing angle lies above that of the falling one, "
            "at 0 deg by 1 N m: a cycle there would feed energy"
        ],
    ),
    "curves apart": (
        UP + "decreasing_points_deg_Nm = [[90, 2], [120, 0]]",
        ["4:28 the two curves have no stretch of angles in common"],
    ),
    "hysteresis beside two curves": (
        UP + DOWN + "hysteresis_Nm = 1",
        ["5:17 `hysteresis_Nm` belongs to a law of one curve"],
    ),
    "hysteresis negative": (
        E + "hysteresis_Nm = -1",
        ["4:17 `hysteresis_Nm` must not be below zero"],
    ),
    "slip alone": (
        E + "slip_rad_s = 0.1",
        ["4:14 `slip_rad_s` belongs to a law that depends on the direction"],
    ),
    "slip zero": (
        E + "hysteresis_Nm = 1\nslip_rad_s = 0",
        ["5:14 `slip_rad_s` must be above zero"],
    ),
    "scale negative": (E + "scale = -1", ["4:9 `scale` must not be below zero"]),
    "scale of nothing": (
        "viscous_Nms_rad = 1\nscale = 2\noffset_deg = 1\nhysteresis_Nm = 1",
        [
            "4:9 `scale` belongs to an elastic law",
            "5:14 `offset_deg` belongs to an elastic law",
            "6:17 `hysteresis_Nm` belongs to an elastic law",
        ],
    ),
    "two laws": (
        E + "points_deg_Nm = [[0, 1], [1, 0]]",
        ["4:17 a spring is exponentials or a curve through points, not both"],
    ),
    "unknown table": (
        'published = "saul_2051/elbow_flexion"',
        ["3:13 there is no published table `saul_2051`"],
    ),
    "unknown row": (
        'published = "saul_2015/elbow"',
        ["3:13 `saul_2015` has no curve `elbow`"],
    ),
    "table without row": ('published = "saul_2015"', ["3:13 `saul_2015` is a table"]),
    "a table without curves": (
        'published = "riener_edrich_1999/leg"',
        ["3:13 `riener_edrich_1999` has no curve `leg`"],
    ),
    "published is a number": ("published = 3", ["3:13 `published` must be a text"]),
    "published sense": (
        'published = "davy_audu_1987/knee"\npublished_sense = 0',
        ["4:19 `published_sense` must be -1 or +1"],
    ),
}


@pytest.mark.parametrize("name", BROKEN)
def test_what_is_wrong_is_said_with_its_place(name: str):
    body, expected = BROKEN[name]
    assert said(spring(body)) == expected
    assert select_errors(parse_springs(spring(body)).diagnostics)


@pytest.mark.parametrize(
    ("body", "hint"),
    [
        ('published = "saul_2051/elbow_flexion"', "did you mean `saul_2015`?"),
        ('published = "saul_2015/elbow_flexon"', "did you mean `elbow_flexion`?"),
        ('published = "saul_2015"', "name one of its rows, as in `saul_2015/elbow_flexion`"),
        ('published = "riener_edrich_1999/leg"', "it has no curve at all"),
        (E + "scale = -1", "a passive joint feeds no energy"),
        ("exponentials = [[3, -4]]\n" + E, "did you mean `exponentials_Nm_1_rad`?"),
        ("point_deg_Nm = [[3, -4]]\n" + E, "did you mean `points_deg_Nm`?"),
    ],
)
def test_hints_name_what_is_near(body: str, hint: str):
    assert [fault.hint for fault in parse_springs(spring(body)).diagnostics] == [hint]


@pytest.mark.parametrize(
    "body",
    [
        "exponentials_Nm_1_rad = [[1, 400]]",
        "exponentials_Nm_1_rad = [[1e300, 40]]\nscale = 1e300",
        "coefficients_Nm_rad = [0, 1, 0, 1e308]",
    ],
)
def test_a_torque_beyond_all_numbers_is_an_error_and_no_traceback(body: str, tmp_path: Path):
    path = tmp_path / "own.springs.toml"
    path.write_text(spring(body), encoding="utf-8")
    (fault,) = load_springs(figure(), None, None, path).diagnostics
    assert "of `left_knee` is too large for a number within a turn" in fault.message
    assert fault.span is not None
    assert fault.span.line == 3


DEGREES = st.integers(-360_000, 360_000).map(lambda angle: angle / 1000.0)


@given(st.lists(st.tuples(DEGREES, st.floats(-1e3, 1e3)), max_size=5))
def test_any_points_make_a_curve_or_a_fault(points: list[tuple[float, float]]):
    reading = parse_springs(spring(f"points_deg_Nm = {[list(p) for p in points]!r}"))
    angles = [angle for angle, _ in points]
    in_order = len(points) > 1 and all(a < b for a, b in pairwise(angles))
    assert bool(select_errors(reading.diagnostics)) is not in_order


VALUES = st.recursive(
    st.sampled_from(["1", "-2.5", "nan", '"x"', "true", "[]", "{}", "{a = 1}"]),
    lambda inner: st.lists(inner, max_size=3).map(lambda items: f"[{', '.join(items)}]"),
    max_leaves=6,
)
KEYS = st.sampled_from(
    [
        *("exponentials_Nm_1_rad", "points_deg_Nm", "limits_deg", "limit_stiffness_Nm_rad"),
        *("transition_deg", "increasing_points_deg_Nm", "decreasing_points_deg_Nm", "published"),
        *("published_sense", "scale", "offset_deg", "hysteresis_Nm", "slip_rad_s", "measured_deg"),
    ]
)


@given(st.dictionaries(KEYS, VALUES, max_size=4))
def test_values_of_any_kind_give_faults_and_no_traceback(table: dict[str, str]):
    reading = parse_springs(spring("\n".join(f"{key} = {value}" for key, value in table.items())))
    assert (reading.value is None) is bool(select_errors(reading.diagnostics))
    for fault in reading.diagnostics:
        assert str(fault).startswith("<text>:")
