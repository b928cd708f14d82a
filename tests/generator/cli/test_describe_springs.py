"""Every law in words and in data."""

import json
import re
from math import radians

import pytest

from generator.cli.describe import coupled_law_data, coupled_law_lines
from generator.springs_file.laws import describe_law, law_data
from springs import Elastic, Linear
from springs.coupled import CoupledExponential, CoupledTerm
from springs.exponential import Exponential, ExponentialTerm
from springs.hysteresis import Hysteresis
from springs.interpolated import Interpolated
from springs.published.tables import coupled_law, publication, publications
from springs.smooth_limit import SmoothLimit
from springs.transformed import Transformed

KNOWN = (radians(-5.0), radians(110.0))
UP = Interpolated(((0.0, 1.0), (radians(90.0), -1.5)))
LAWS: list[tuple[Elastic, str]] = [
    (
        Exponential(
            (ExponentialTerm(3.0, -4.0), ExponentialTerm(-0.5, 2.0, radians(10.0))), 1.5, KNOWN
        ),
        "exponentials 1.5 +3 exp(-4 a) -0.5 exp(2 (a -10 deg)) N m, known for -5 deg .. 110 deg",
    ),
    (UP, "curve through 2 points, 1 N m at 0 deg to -1.5 N m at 90 deg"),
    (
        SmoothLimit(0.0, radians(90.0), 50.0, 20.0, radians(40.0)),
        "limits 0 deg .. 90 deg, 50 and 20 N m/rad, fully grown 40 deg beyond",
    ),
    (
        Transformed(Linear(3.0), 0.5, radians(10.0), 2.0),
        "linear 3 N m/rad, rest 0 deg, times 0.5, moved by 10 deg, +2 N m",
    ),
    (
        Hysteresis.from_mean_and_width(Linear(3.0), 6.0, 0.2),
        "linear 3 N m/rad, rest 0 deg, hysteresis 6 N m, slip 0.2 rad/s",
    ),
    (
        Hysteresis(UP, Transformed(UP, constant=2.0)),
        "growing angle: curve through 2 points, 1 N m at 0 deg to -1.5 N m at 90 deg; "
        "falling angle: curve through 2 points, 1 N m at 0 deg to -1.5 N m at 90 deg, +2 N m; "
        "slip 0.01 rad/s",
    ),
    (
        Interpolated(((-1.0, -0.0), (-0.0, -8.1))),
        "curve through 2 points, 0 N m at -57.3 deg to -8.1 N m at 0 deg",
    ),
]


@pytest.mark.parametrize(("law", "words"), LAWS)
def test_a_law_in_words(law: Elastic, words: str):
    assert describe_law(law) == words


def test_the_data_of_a_law_hold_its_numbers():
    data = law_data(LAWS[0][0])
    assert data["law"] == "exponentials"
    assert data["constant_Nm"] == 1.5
    assert data["terms"] == [
        {"amplitude_Nm": 3.0, "rate_1_rad": -4.0, "centre_deg": 0.0},
        {"amplitude_Nm": -0.5, "rate_1_rad": 2.0, "centre_deg": pytest.approx(10.0)},
    ]
    assert data["measured_deg"] == pytest.approx([-5.0, 110.0])
    scaled = law_data(LAWS[3][0])
    assert (scaled["law"], scaled["scale"], scaled["constant_Nm"]) == ("scaled", 0.5, 2.0)
    assert scaled["of"] == {"law": "linear", "stiffness": 3.0, "rest": 0.0}


def test_no_published_law_is_left_without_words():
    for name in publications():
        for law in (row.law for row in publication(name).curves.values()):
            assert not re.search(rf"(^|\(){type(law).__name__}", describe_law(law)), name
            assert json.loads(json.dumps(law_data(law), allow_nan=False))["law"]


def test_a_coupled_law_in_words():
    law = CoupledExponential(
        ("hip flexion", "knee flexion"),
        (CoupledTerm((2.0, 1.0), (-4.0, -2.0)), CoupledTerm((0.0, 3.0), (0.0, -1.0))),
        (1.0, -2.0),
        (KNOWN, None),
    )
    assert list(coupled_law_lines(law)) == [
        "hip flexion: 1 +2 exp(-4 h -2 k) N m",
        "knee flexion: -2 +1 exp(-4 h -2 k) +3 exp(-1 k) N m",
        "h hip flexion, k knee flexion in rad; conservative; "
        "known for hip flexion -5 deg .. 110 deg",
    ]
    published = coupled_law("riener_edrich_1999/leg").law
    assert coupled_law_data(published)["conservative"] is False
    assert "; not conservative; " in list(coupled_law_lines(published))[-1]
