"""Representations of values in at most two lines."""

from dataclasses import dataclass, field

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from springs.short_repr import MAX_LENGTH, represent_mapping, short_repr


@short_repr
@dataclass
class Value:
    """A value with a field of each kind."""

    name: str
    content: object = None
    others: dict[str, object] = field(default_factory=dict[str, object])
    hidden: int = field(default=0, repr=False)


@pytest.mark.parametrize(
    ("value", "shown"),
    [
        (Value("a"), "Value(name='a')"),
        (Value("a", 1.0 / 3.0, hidden=3), "Value(name='a', content=0.333333)"),
        (Value("a", np.zeros((86, 3))), "Value(name='a', content=<array (86, 3)>)"),
        (Value("a", (1.0, 2.5)), "Value(name='a', content=(1, 2.5))"),
        (Value("a", tuple(range(5))), "Value(name='a', content=<5 values>)"),
        (Value("a", (Value("b"),)), "Value(name='a', content=<1 value>)"),
        (Value("a", Value("b")), "Value(name='a', content=Value(name='b'))"),
        (Value("a", others={"x": 1, "y": 2}), "Value(name='a', others=<2 values: x, y>)"),
        (Value("two\nlines"), "Value(name='two lines')"),
    ],
)
def test_fields_that_differ_from_their_defaults(value: Value, shown: str) -> None:
    assert repr(value) == shown


def test_a_mapping_is_its_first_names() -> None:
    assert represent_mapping({}) == "<0 values>"
    assert represent_mapping(dict.fromkeys("abcd")) == "<4 values: a, b, c, ...>"


def containers(inner: st.SearchStrategy[object]) -> st.SearchStrategy[object]:
    values = st.builds(Value, st.text(), inner)
    return st.lists(inner) | st.dictionaries(st.text(), inner) | values


contents = st.recursive(
    st.none() | st.text() | st.floats() | st.integers(), containers, max_leaves=20
)


@given(st.text(), contents, st.dictionaries(st.text(), st.integers()))
def test_no_value_is_longer_than_two_lines(name: str, content: object, others: dict[str, object]):
    shown = repr(Value(name, content, others))
    assert len(shown) <= MAX_LENGTH
    assert "\n" not in shown + represent_mapping(others)
