"""The report of what a format could not hold."""

import pytest

from generator.losses import MAX_NAMED_PLACES, Effect, Loss, Losses


def test_of_many_places_some_are_shown_and_all_are_data():
    places = tuple(f"joint{k}" for k in range(MAX_NAMED_PLACES + 3))
    loss = Loss("the friction", places)
    assert str(loss).endswith("joint7 and 3 more")
    assert Losses.collect("BVH", [loss]).to_json() == [
        {"what": "the friction", "where": list(places)}
    ]


def test_a_loss_that_says_nothing_is_refused():
    with pytest.raises(ValueError, match="what was lost"):
        Loss("  ")


def test_nothing_lost_is_no_loss():
    assert Losses.collect("BVH", [None, Loss("the date"), None]).entries == (Loss("the date"),)
    assert Losses("BVH").entries == ()


def test_the_gravest_come_first_and_a_kind_has_the_effect_of_its_gravest():
    losses = Losses.collect("BVH", [Loss("digits", effect=Effect.ROUNDING), Loss("the springs")])
    losses.add("names", "hip", effect=Effect.DESCRIPTION)
    losses.add("digits", "knee", effect=Effect.APPROXIMATION)
    assert [loss.what for loss in losses.entries] == ["the springs", "digits", "names"]


def test_losses_are_printed_one_a_line():
    losses = Losses.collect("BVH", [Loss("the date"), Loss("the friction", ("knee", "hip"))])
    assert str(losses) == "the date\nthe friction: knee, hip"
    assert len(repr(losses)) < 200
