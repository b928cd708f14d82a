"""The two rhythms behind one face."""

import numpy as np
import pytest

from generator.kinematics.shoulder import DE_GROOT_BRAND, OTANI, RHYTHMS


def test_the_regression_worked_by_hand():
    up, forwards = DE_GROOT_BRAND.clavicle(np.radians(90.0), np.radians([0.0, 90.0]))
    raised = 3.917 + 0.123 * 90.0 + (0.493 - 1.0) * 11.680
    swung = -4.983 - 0.242 * 90.0 + (0.851 - 1.0) * -28.573
    assert np.degrees(up) == pytest.approx([raised, raised - 0.046 * 90.0])
    assert np.degrees(forwards) == pytest.approx([swung, swung + 0.120 * 90.0])


def test_between_the_planes_the_thesis_weighs_by_the_cosine():
    elevation = np.radians(60.0)
    (side, oblique, ahead), _ = OTANI.clavicle(elevation, np.radians([0.0, 60.0, 90.0]))
    assert oblique == pytest.approx((side + ahead) / 2.0)


def test_the_lines_give_way_where_the_thesis_says():
    assert np.degrees(OTANI.breakpoints) == pytest.approx([130.0, 131.4])
    assert DE_GROOT_BRAND.breakpoints == ()


@pytest.mark.parametrize("name", sorted(RHYTHMS))
def test_a_raised_arm_raises_the_clavicle(name):
    elevation = np.radians(np.arange(0.0, 131.0))
    for plane in (0.0, np.pi / 2):
        up, _ = RHYTHMS[name].clavicle(elevation, np.full_like(elevation, plane))
        assert np.all(np.diff(up) > 0.0)


@pytest.mark.parametrize("name", sorted(RHYTHMS))
def test_an_arm_brought_forwards_brings_the_clavicle_forwards(name):
    plane = np.radians(np.arange(0.0, 121.0))
    _, forwards = RHYTHMS[name].clavicle(np.full_like(plane, np.pi / 2), plane)
    assert np.all(np.diff(forwards) > 0.0)


def test_each_rhythm_says_where_it_is_from():
    assert "Otani" in str(OTANI.references[0])
    assert "de Groot" in str(DE_GROOT_BRAND.references[0])
