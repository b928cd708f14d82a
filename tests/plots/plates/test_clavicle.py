"""The plate of the clavicle: its claims, against numbers worked by hand."""

import numpy as np
import pytest

from plots.plate import Outcome
from plots.plates.clavicle import mean_slope, piece_offset
from springs.published import tables as published
from tests.plots.drawn import plate

PLATE = plate("clavicle")
SLOPES, VALUES = PLATE.claims[:2], PLATE.claims[2:]


def test_which_claims_hold() -> None:
    """The thesis's lines are steeper than all sets."""
    outcomes = [Outcome.DIFFERS, Outcome.DIFFERS, Outcome.HOLDS, Outcome.HOLDS]
    assert [claim.outcome for claim in PLATE.claims] == outcomes
    assert all(claim.remark for claim in PLATE.claims if not claim.holds)


def test_slopes() -> None:
    """The printed slopes, and Oki's points at 30 and 120 deg: 12.4 to 28.8, 11.5 to 26.8 deg."""
    assert [claim.measured for claim in SLOPES] == pytest.approx([0.2514, 0.21066], abs=1e-12)
    assert [c.at_most for c in SLOPES] == pytest.approx([16.4 / 90.0, 15.3 / 90.0], abs=1e-12)
    assert all("(Oki)" in claim.sentence for claim in SLOPES)


@pytest.mark.parametrize(
    ("key", "plane", "change"),
    [
        ("spartacus/ludewig_2009_frontal", "frontal", 5.2),
        ("spartacus/sahara_2007_frontal", "frontal", 6.7),
        ("spartacus/fung_2001_frontal", "frontal", 10.2),
        ("de_groot_brand_2001/clavicle_elevation", "frontal", 11.07),
        ("spartacus/karduna_sagittal", "sagittal", 7.3),
    ],
)
def test_a_modern_set_rises_less(key, plane, change) -> None:
    """Changes from 30 to 120 deg of arm elevation, from the tables [deg]."""
    assert 90.0 * mean_slope(published.rhythm(key), plane) == pytest.approx(change, abs=1e-9)


def test_jumps() -> None:
    """124.10996 (0.2514 131.4 + 91.076) meets 124.101, 119.7338 (0.21066 130 + 92.348) 120 deg."""
    frontal, sagittal = (
        piece_offset(published.rhythm(f"otani_1989/clavicle_{plane}"))
        for plane in ("frontal", "sagittal")
    )
    assert frontal == pytest.approx(-0.00896, abs=1e-9)
    assert sagittal == pytest.approx(0.2662, abs=1e-9)
    assert "jumps by 0.27 deg" in PLATE.caption


def test_the_tables_hold_what_was_measured_and_nothing_else() -> None:
    frontal = PLATE.tables["frontal"]
    assert frontal["arm elevation [deg]"] == pytest.approx([0, 30, 45, 60, 75, 90, 105, 120, 150])
    oki = frontal["Oki [deg]"]
    assert np.isnan(oki[[0, -1]]).all()
    assert oki[1:-1] == pytest.approx([12.4, 13.7, 15.6, 18.0, 21.3, 25.0, 28.8])
    assert frontal["thesis [deg]"][5] == pytest.approx(23.702)
