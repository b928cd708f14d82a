"""Plain names: letters, digits and `_`, no two alike, and those that are plain stay."""

import re

from hypothesis import given
from hypothesis import strategies as st

from generator.names import coordinate_names, plain_names, renaming_loss
from tests.chains import BALL, chain

names = st.lists(st.text(max_size=6), max_size=8, unique=True)
PLAIN = re.compile(r"[A-Za-z_][A-Za-z0-9_]*", re.ASCII)


@given(names)
def test_plain_names_are_plain_and_differ(listed: list[str]):
    plain = plain_names(listed)
    assert list(plain) == listed
    assert all(PLAIN.fullmatch(word) for word in plain.values())
    assert len(set(plain.values())) == len(listed)
    assert all(plain[name] == name for name in listed if PLAIN.fullmatch(name))


def test_a_name_that_is_taken_gets_a_number():
    assert plain_names(["free arm", "free_arm", "free-arm"]) == {
        "free arm": "free_arm_2",
        "free_arm": "free_arm",
        "free-arm": "free_arm_3",
    }


def test_names_that_changed_are_told():
    assert renaming_loss(plain_names(["knee", "hip"])) is None
    lost = renaming_loss(plain_names(["knee", "free arm"]))
    assert lost is not None
    assert lost.where == ("'free arm' is free_arm",)


@given(names)
def test_coordinates_of_all_joints_differ(listed: list[str]):
    chains = {name: BALL if k % 2 else chain("Rx Tz") for k, name in enumerate(listed)}
    made = [word for words in coordinate_names(chains).values() for word in words]
    assert len(set(made)) == len(made) == sum(len(factors) for factors in chains.values())


def test_coordinates_are_numbered_in_the_order_of_the_chain():
    assert coordinate_names({"hip": BALL, "weld": (), "knee": chain("Rx")}) == {
        "hip": ("hip_1", "hip_2", "hip_3"),
        "weld": (),
        "knee": ("knee_1",),
    }
