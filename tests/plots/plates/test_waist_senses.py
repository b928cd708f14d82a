"""The plate of the waist's senses: its springs, and what follows for the fall."""

import numpy as np
import pytest

from generator import read_figure
from generator.springs_file.read import read_springs
from plots.plate import ClaimKind, Outcome
from plots.plates.waist_senses import FLEXION, TWIST, reading_springs
from springs import SpringSet, total_torque
from tests.plots.drawn import plate


@pytest.fixture(scope="module")
def springs() -> SpringSet:
    return read_springs(None, read_figure("prototype"))


def torque(springs: SpringSet, motion: str, angle: float) -> float:
    (spring,) = (one for one in springs.joints["waist"].axes if one.motion == motion)
    return float(total_torque(spring.elastic, angle))


def test_the_other_sense_is_the_printed_cubic(springs) -> None:
    other = reading_springs(springs, frozenset({FLEXION, TWIST}))
    for angle in (-1.0, -0.2, 0.0, 0.5, 1.2):
        printed = 49.6 - 153.0 * angle - 120.0 * angle**2 + 241.0 * angle**3
        assert torque(other, FLEXION, angle) == pytest.approx(printed)
        printed = -4.65 + 136.0 * angle + 2.89 * angle**2 - 92.6 * angle**3
        assert torque(other, TWIST, angle) == pytest.approx(-printed)
    # As chosen both are free here.
    assert torque(springs, FLEXION, 0.5) == torque(springs, TWIST, 0.5) == 0.0


def test_only_what_is_named_is_turned(springs) -> None:
    other = reading_springs(springs, frozenset({TWIST}))
    assert torque(other, FLEXION, 1.2) == torque(springs, FLEXION, 1.2)
    assert other.joints["left_knee"] is springs.joints["left_knee"]


@pytest.mark.slow
def test_the_sense_decides_the_motion() -> None:
    claims = plate("waist_senses").claims
    runs = [one for one in claims if one.kind is ClaimKind.VERIFICATION]
    assert len(runs) == 2
    assert all(one.holds for one in runs)
    compared = [one for one in claims if one.kind is ClaimKind.COMPARISON]
    assert [one.outcome for one in compared] == [Outcome.DIFFERS] * 6
    table = plate("waist_senses").tables
    chosen = table["standing-as-chosen"]["waist flexion [deg]"]
    other = table["standing-flexion-in-the-other-sense"]["waist flexion [deg]"]
    # As chosen the trunk falls back until the cubic holds it, in the other sense it bends forward.
    assert chosen.min() < -45.0
    assert other.min() > -1.0
    assert other.max() > 17.0
    assert np.all(table["standing-as-chosen"]["trunk, from the chosen reading [deg]"] < 1e-5)
