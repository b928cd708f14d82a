"""The plate of strengths, against the norms of its table."""

from plots.plate import ClaimKind, Outcome
from springs.strength.strengths import norms
from tests.plots.drawn import plate


def test_every_norm_is_compared_and_only_young_men_extend_too_weakly() -> None:
    claims = plate("strength_of_legs").claims
    assert len(claims) == len(norms())
    (different,) = [claim for claim in claims if claim.outcome is Outcome.DIFFERS]
    assert different.sentence == "Knee extension of men of 18-25 years"
    assert 0.0 < different.at_least - different.measured < 0.15


def test_what_is_set_by_the_norms_counts_as_no_comparison() -> None:
    for claim in plate("strength_of_legs").claims:
        is_set = "scaled to the middle" in claim.sentence
        assert (claim.kind is ClaimKind.VERIFICATION) == is_set
