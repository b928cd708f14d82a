"""Writing a springs file: reading what was written gives the same springs."""

from math import inf, pi
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from generator.reader.springs_file import SpringEntry, SpringsFile, parse_springs
from generator.springs_writer import write_springs
from springs import Damping, Joining

PROTOTYPE = Path(__file__).parents[1] / "figures" / "prototype.springs.toml"

NUMBERS = st.floats(
    allow_nan=False, allow_infinity=False, width=64, min_value=-1e30, max_value=1e30
)
POSITIVE = st.floats(min_value=1e-6, max_value=1e6)
ANGLES = st.floats(min_value=-2.0 * pi, max_value=2.0 * pi)
TEXTS = st.text(st.characters(exclude_categories=("Cs",), exclude_characters="\r"), max_size=250)
NAMES = st.text(st.characters(exclude_categories=("Cs",)), min_size=1, max_size=20)
COEFFICIENTS = st.tuples(NUMBERS, NUMBERS, NUMBERS, NUMBERS)
ZONES = st.tuples(ANGLES, ANGLES).map(lambda ends: (min(ends), max(ends)))


@st.composite
def cubics(draw: st.DrawFn) -> SpringEntry:
    zone = draw(st.none() | ZONES)
    return SpringEntry(
        joints=tuple(draw(st.lists(NAMES, min_size=1, max_size=3))),
        axis=draw(st.sampled_from([None, "x", "y", "z"])),
        coefficients=draw(COEFFICIENTS),
        sense=draw(st.sampled_from([None, -1, 1])),
        dead_zone=zone,
        dead_zone_stated=zone is not None or draw(st.booleans()),
        rest=draw(ANGLES),
        damping=Damping(draw(POSITIVE), draw(st.just(0.0) | POSITIVE)),
        motion=draw(TEXTS),
        reference=draw(TEXTS),
        why=draw(TEXTS),
    )


@st.composite
def linears(draw: st.DrawFn) -> SpringEntry:
    return SpringEntry(
        joints=(draw(NAMES),),
        stiffness=draw(POSITIVE),
        rest=draw(ANGLES),
        stop_stiffness=draw(POSITIVE),
        stop_onset=draw(POSITIVE),
    )


FILES = st.builds(
    SpringsFile,
    entries=st.lists(cubics() | linears(), min_size=1, max_size=3).map(tuple),
    figure=st.none() | NAMES,
    law=st.none() | st.sampled_from(Joining),
)


@given(FILES, TEXTS.filter(lambda text: text.isprintable()))
def test_what_is_written_is_read_back(content: SpringsFile, comment: str):
    reading = parse_springs(write_springs(content, comment))
    assert reading.faults == ()
    assert reading.content == content


def test_the_prototypes_springs_are_read_back():
    content = parse_springs(PROTOTYPE.read_text(encoding="utf-8")).content
    assert content is not None
    assert parse_springs(write_springs(content)).content == content


def test_the_comment_stands_above():
    text = write_springs(SpringsFile((SpringEntry(("knee",), stiffness=1.0),)), "one\ntwo")
    assert text.startswith("# one\n# two\n\n[[spring]]\n")


def test_what_no_reader_takes_is_not_written():
    long = SpringsFile((SpringEntry(("knee",), stiffness=1.0, reference="x" * 2000),))
    with pytest.raises(ValueError, match="1000 characters"):
        write_springs(long)
    infinite = SpringsFile((SpringEntry(("knee",), stiffness=inf),))
    with pytest.raises(ValueError, match="finite"):
        write_springs(infinite)
