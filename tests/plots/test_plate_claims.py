"""A claim can hold and can fail, and its words say on which side it is."""

from math import inf, nan

import pytest
from hypothesis import given
from hypothesis import strategies as st

from plots.plate import Claim, ClaimKind, Outcome, incomparable_claim

numbers = st.floats(allow_nan=False, allow_infinity=False)


@pytest.mark.parametrize(
    ("measured", "at_least", "at_most", "holds"),
    [
        (1.0, 0.0, 2.0, True),
        (0.0, 0.0, 2.0, True),
        (2.0, -inf, 2.0, True),
        (2.1, -inf, 2.0, False),
        (-0.1, 0.0, inf, False),
        (inf, 0.0, inf, True),
        (nan, 0.0, inf, False),
    ],
)
def test_it_holds_within_its_bounds(measured: float, at_least: float, at_most: float, holds: bool):
    claim = Claim("it is so", measured, at_least=at_least, at_most=at_most)
    assert claim.holds is holds
    assert claim.verdict == ("holds" if holds else "DOES NOT HOLD")


@pytest.mark.parametrize(
    ("sentence", "at_least", "at_most", "message"),
    [
        ("it is so", -inf, inf, "cannot fail"),
        ("it is so", 2.0, 1.0, "no value is 2.0 to 1.0"),
        ("it is so", nan, 1.0, "no value is nan to 1.0"),
        ("it is so", 0.0, nan, "no value is 0.0 to nan"),
        (" ", 0.0, 1.0, "needs a sentence"),
    ],
)
def test_a_claim_that_says_nothing_is_refused(
    sentence: str, at_least: float, at_most: float, message: str
):
    with pytest.raises(ValueError, match=message):
        Claim(sentence, 1.0, at_least=at_least, at_most=at_most)


@pytest.mark.parametrize(
    ("unit", "at_least", "at_most", "words"),
    [
        ("N m", -inf, 4.0, "at most 4 N m"),
        ("", 0.25, inf, "at least 0.25"),
        ("N m", -36.0, -32.0, "-36 to -32 N m"),
        ("runs", 0.0, 0.0, "exactly 0 runs"),
    ],
)
def test_the_bound_in_words(unit: str, at_least: float, at_most: float, words: str):
    assert Claim("it is so", 1.0, unit, at_least, at_most).bound_text == words


@pytest.mark.parametrize(
    ("measured", "words"), [(1.23456, "1.235 N m"), (4.00001, "4.00001 N m"), (nan, "nan N m")]
)
def test_the_measured_value_in_words(measured: float, words: str):
    assert Claim("it is so", measured, "N m", at_most=4.0).measured_text == words


@given(measured=numbers, bound=numbers, above=st.booleans())
def test_the_words_are_on_the_same_side_as_the_value(measured: float, bound: float, above: bool):
    def claim(value: float) -> Claim:
        at_least, at_most = (bound, inf) if above else (-inf, bound)
        return Claim("it is so", value, at_least=at_least, at_most=at_most)

    assert claim(float(claim(measured).measured_text)).holds is claim(measured).holds


@pytest.mark.parametrize(
    ("kind", "measured", "outcome"),
    [
        (ClaimKind.VERIFICATION, 1.0, Outcome.HOLDS),
        (ClaimKind.VERIFICATION, 3.0, Outcome.FAILS),
        (ClaimKind.SPEED, 1.0, Outcome.HOLDS),
        (ClaimKind.SPEED, 3.0, Outcome.FAILS),
        (ClaimKind.COMPARISON, 1.0, Outcome.AGREES),
        (ClaimKind.COMPARISON, 3.0, Outcome.DIFFERS),
        (ClaimKind.COMPARISON, nan, Outcome.DIFFERS),
    ],
)
def test_the_outcome_is_that_of_the_kind(kind: ClaimKind, measured: float, outcome: Outcome):
    claim = Claim("it is so", measured, at_most=2.0, kind=kind)
    assert claim.outcome is outcome
    assert claim.verdict == outcome.value


def test_a_comparison_that_cannot_be_made_has_a_reason_and_no_number():
    claim = incomparable_claim("as in a paper", "nobody measured it")
    assert claim.outcome is Outcome.INCOMPARABLE
    assert not claim.holds
    assert (claim.measured_text, claim.bound_text) == ("", "")
    assert claim.explanation == "nobody measured it"
    with pytest.raises(ValueError, match="only a comparison has an obstacle"):
        Claim("it is so", 1.0, at_most=2.0, obstacle="no")
