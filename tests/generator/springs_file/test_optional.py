import pytest
from hypothesis import given
from hypothesis import strategies as st

from generator.springs_file.optional import OPTIONAL_FILE, OptionalRecord, write_optional
from springs.published.tables import publication
from tests.paths import FIGURES
from tests.work import counted_calls

FIGURE_4_1 = """\
1 1
0.0 2.4365e09 0.0 8.4168e09
0.0 0.0
0.0 0.0 0.0
9 3
-155000000 845000000 -1240000000 492000000
800000 0.0
0.0 0.0 1.553
"""
GOOD = "1 1\n1 2 3 4\n0 0\n0 0 0\n"

finite = st.floats(allow_nan=False, allow_infinity=False)
positive = st.floats(min_value=0.0, allow_infinity=False)
records = st.lists(
    st.builds(
        OptionalRecord,
        joint=st.integers(1, 1000),
        axis=st.integers(1, 3),
        coefficients=st.tuples(finite, finite, finite, finite),
        viscous=positive,
        coulomb=positive,
        rest=finite,
        dead_zone=st.tuples(finite, finite),
    ),
    min_size=1,
    max_size=6,
    unique_by=lambda record: (record.joint, record.axis),
)


def test_the_thesis_s_example_is_read_in_si():
    reading = OPTIONAL_FILE.parse_text(FIGURE_4_1)
    assert reading.diagnostics == ()
    assert reading.value == (
        OptionalRecord(1, 1, (0.0, 243.65, 0.0, 841.68)),
        OptionalRecord(9, 3, (-15.5, 84.5, -124.0, 49.2), 0.08, 0.0, 0.0, (0.0, 1.553)),
    )


def test_records_know_where_they_are_written():
    origins = OPTIONAL_FILE.parse_text(FIGURE_4_1).value[1].origins
    assert {key: (span.line, span.text) for key, span in origins.items()} == {
        "axis": (5, "9 3"),
        "coefficients": (6, "-155000000 845000000 -1240000000 492000000"),
        "damping": (7, "800000 0.0"),
        "dead_zone": (8, "0.0 0.0 1.553"),
    }


SPHERICAL = {1: ("waist", 1), 3: ("shoulder", 1), 4: ("shoulder", -1)}
SPHERICAL |= {7: ("hip", -1), 8: ("hip", 1)}
"""Joint numbers of the prototype's spherical joints; -1 for a right side."""

REVOLUTES = {5: ("elbow", 1.7), 6: ("elbow", 1.7), 9: ("knee", 1.553), 10: ("knee", 1.553)}
"""Joint numbers of its revolutes, with the ends of their dead zones [rad]."""


def test_the_shipped_file_holds_the_printed_cubics():
    """A right side has the coefficients of the left about y, and negated ones about x and z."""
    curves = publication("otani_1989").curves

    def cubic(name: str, sign: int = 1) -> list[float]:
        printed = curves[name].printed
        return [sign * printed.moment_unit * c for c in printed.coefficients.values()]

    expected = {
        (number, axis): (cubic(f"{joint}_{letter}", 1 if letter == "y" else side), (0.0, 0.0))
        for number, (joint, side) in SPHERICAL.items()
        for axis, letter in enumerate("xyz", start=1)
    }
    expected |= {(n, 3): (cubic(joint), (0.0, end)) for n, (joint, end) in REVOLUTES.items()}
    shipped = OPTIONAL_FILE.parse_text((FIGURES / "prototype.optional").read_text()).require_value()
    assert [(record.joint, record.axis) for record in shipped] == sorted(expected)
    for record in shipped:
        coefficients, dead_zone = expected[record.joint, record.axis]
        assert record.coefficients == pytest.approx(coefficients, rel=1e-12)
        assert record.dead_zone == dead_zone
        assert (record.viscous, record.coulomb, record.rest) == (0.08, 0.0, 0.0)


@given(records)
def test_reading_what_was_written_gives_the_same_records_to_the_last_bit(written):
    reading = OPTIONAL_FILE.parse_text(write_optional(written))
    assert reading.diagnostics == ()
    assert list(reading.value) == written


def test_what_is_written_looks_like_the_thesis_s_file():
    record = OptionalRecord(9, 3, (-15.5, 84.5, 1e9, 0.0), 0.08, 0.0, 0.0, (0.0, 1.553))
    assert write_optional([record]) == (
        "9 3\n-155000000 845000000 1e+16 0.0\n800000 0.0\n0.0 0.0 1.553\n"
    )


@pytest.mark.parametrize(
    "text",
    [
        "# springs\n\n" + GOOD.replace("1 1\n", "  1\t1   # waist, x\n\n"),
        GOOD.replace("1 2 3 4", "1.0D0 2e0 +.3E+1 4."),
    ],
)
def test_comments_blanks_and_fortran_exponents_do_not_matter(text):
    reading = OPTIONAL_FILE.parse_text(text)
    assert reading.diagnostics == ()
    assert reading.value == OPTIONAL_FILE.parse_text(GOOD).value


@pytest.mark.parametrize(
    "text",
    ["{" * 10**6, "{ { {\n" * 10**5, "9" * 10**6, "1" + "0" * 10**6 + " 1\n", "\0\n" * 10**5],
)
def test_enormous_nonsense_is_refused_with_little_work(text):
    reading, calls = counted_calls(lambda: OPTIONAL_FILE.parse_text(text))
    assert calls < 10_000
    assert reading.value is None
    assert 1 <= len(reading.diagnostics) <= 101


@pytest.mark.parametrize(
    "changes",
    [
        {"joint": 0},
        {"axis": 4},
        {"viscous": -1.0},
        {"coulomb": -1.0},
        {"rest": float("nan")},
        {"coefficients": (0.0, float("inf"), 0.0, 0.0)},
    ],
)
def test_a_record_that_the_file_cannot_hold_is_refused(changes):
    good = {"joint": 1, "axis": 1, "coefficients": (0.0, 1.0, 0.0, 0.0)}
    with pytest.raises(ValueError, match=r"counted from 1|not negative|finite"):
        OptionalRecord(**(good | changes))
