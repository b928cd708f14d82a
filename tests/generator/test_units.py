import math
from contextlib import suppress
from decimal import Context, Decimal
from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from generator.diagnostics import Diagnostics, Source
from generator.figure_file.lexer import TokenStream
from generator.figure_file.parser import parse_value
from generator.figure_file.values import resolve_number
from generator.units import (
    DIMENSION_POWERS,
    ROTATION_UNITS,
    TRANSLATION_UNITS,
    Dimension,
    UnitError,
    convert_to_si,
    default_unit_factor,
    format_quantities,
    format_quantity,
    is_unit_word,
    parse_unit,
    shortest_decimal,
)

FINITE = st.floats(allow_nan=False, allow_infinity=False)


@pytest.mark.parametrize(
    ("unit", "si", "dimension"),
    [
        ("cm", 1e-2, Dimension.LENGTH),
        ("m", 1.0, Dimension.LENGTH),
        ("mm", 1e-3, Dimension.LENGTH),
        ("in", 0.0254, Dimension.LENGTH),
        ("ft", 0.3048, Dimension.LENGTH),
        ("deg", math.pi / 180, Dimension.ANGLE),
        ("rad", 1.0, Dimension.ANGLE),
        ("g", 1e-3, Dimension.MASS),
        ("kg", 1.0, Dimension.MASS),
        ("lb", 0.45359237, Dimension.MASS),
        ("dyn", 1e-5, Dimension.FORCE),
        ("N", 1.0, Dimension.FORCE),
        ("kg m/s2", 1.0, Dimension.FORCE),
        ("dyn cm", 1e-7, Dimension.MOMENT),
        ("N m", 1.0, Dimension.MOMENT),
        ("g cm2", 1e-7, Dimension.INERTIA),
        ("kg m2", 1.0, Dimension.INERTIA),
        ("lb in2", 0.45359237 * 0.0254**2, Dimension.INERTIA),
        ("g/cm3", 1000.0, Dimension.DENSITY),
        ("N m/rad", 1.0, Dimension.ANGULAR_STIFFNESS),
        ("N m/deg", 180 / math.pi, Dimension.ANGULAR_STIFFNESS),
        ("dyn cm/rad", 1e-7, Dimension.ANGULAR_STIFFNESS),
        ("N/m", 1.0, Dimension.LINEAR_STIFFNESS),
        ("N m s/rad", 1.0, Dimension.ANGULAR_DAMPING),
        ("N s/m", 1.0, Dimension.LINEAR_DAMPING),
    ],
)
def test_a_unit_is_worth_its_si_value(unit, si, dimension):
    found = parse_unit(unit)
    assert float(found.factor) == pytest.approx(si, rel=1e-15)
    assert found.powers == DIMENSION_POWERS[dimension]


@pytest.mark.parametrize(
    ("dimension", "si"),
    [
        (Dimension.NUMBER, 1.0),
        (Dimension.LENGTH, 1e-2),
        (Dimension.ANGLE, 1.0),
        (Dimension.MASS, 1e-3),
        (Dimension.INERTIA, 1e-7),
        (Dimension.FORCE, 1e-5),
        (Dimension.MOMENT, 1e-7),
        (Dimension.ANGULAR_STIFFNESS, 1e-7),
        (Dimension.LINEAR_STIFFNESS, 1e-3),
        (Dimension.ANGULAR_DAMPING, 1e-7),
        (Dimension.LINEAR_DAMPING, 1e-3),
        (Dimension.DENSITY, 1000.0),
    ],
)
def test_a_bare_number_is_cgs_and_radians(dimension, si):
    assert float(default_unit_factor(dimension)) == si


@pytest.mark.parametrize(
    ("text", "unit", "si"),
    [
        ("2.61", "cm", 0.0261),
        ("36.80", "cm", 0.368),
        ("4000.77", "g", 4.00077),
        ("1199091.8750", "g cm2", 0.1199091875),
        ("45", "deg", math.pi / 4),
        ("-90.00", "deg", -math.pi / 2),
        ("1", "in", 0.0254),
        ("+.5", "m", 0.5),
        ("5.", "m", 5.0),
        ("1e3", "mm", 1.0),
        ("800000", "dyn cm s/rad", 0.08),
        ("1e-400", "m", 0.0),
        ("0e999999", "m", 0.0),
        ("1e-" + "9" * 60, "m", 0.0),
    ],
)
def test_conversion_gives_the_nearest_float(text, unit, si):
    assert convert_to_si(text, parse_unit(unit).factor) == si


@given(value=FINITE, unit=st.sampled_from(["cm", "mm", "in", "ft", "g", "lb", "g cm2", "deg"]))
def test_conversion_is_correctly_rounded(value, unit):
    factor = parse_unit(unit).factor
    assert convert_to_si(repr(value), factor) == float(Fraction(repr(value)) * factor)


@pytest.mark.parametrize("text", ["1e999", "-1e400", "1e" + "9" * 60, "1.8e308"])
def test_a_number_beyond_the_floats_overflows(text):
    with pytest.raises(OverflowError):
        convert_to_si(text, Fraction(1))


@given(value=FINITE, dimension=st.sampled_from(Dimension))
def test_a_written_value_reads_back_exactly(value, dimension):
    assert value_of(format_quantity(value, dimension), dimension) == value


@given(
    st.floats(allow_nan=False, allow_infinity=False)
    | st.integers(-1074, 1023).map(lambda k: 2.0**k),
    st.sampled_from(["deg", "cm", "kg", "in"]),
)
def test_no_shorter_decimal_has_the_value(value: float, unit: str):
    factor = parse_unit(unit).factor
    text = shortest_decimal(value, factor)
    assert convert_to_si(text, factor) == value
    digits = len(text.partition("e")[0].replace(".", "").strip("-0"))
    exact = Fraction(value) / factor
    quotient = Context(prec=60).divide(Decimal(exact.numerator), Decimal(exact.denominator))
    for fewer in range(1, digits):
        with suppress(OverflowError):
            assert convert_to_si(str(Context(prec=fewer).plus(quotient)), factor) != value


@pytest.mark.parametrize(
    ("value", "dimension", "text"),
    [
        (0.0261, Dimension.LENGTH, "2.61cm"),
        (3.0, Dimension.LENGTH, "300cm"),
        (0.0, Dimension.LENGTH, "0cm"),
        (-math.pi / 2, Dimension.ANGLE, "-90deg"),
        (0.349066, Dimension.ANGLE, "0.349066rad"),
        (4.00077, Dimension.MASS, "4000.77g"),
        (0.1199091875, Dimension.INERTIA, "1199091.875"),
        (1e-7, Dimension.ANGULAR_STIFFNESS, "1"),
        (1000.0, Dimension.ANGULAR_STIFFNESS, "1000 N m/rad"),
        (0.08, Dimension.ANGULAR_DAMPING, "0.08 N m s/rad"),
        (9.81, Dimension.FORCE, "9.81N"),
        (1e-20, Dimension.LENGTH, "1e-18cm"),
    ],
)
def test_values_are_written_short(value, dimension, text):
    assert format_quantity(value, dimension) == text


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_what_is_not_finite_cannot_be_written(value):
    with pytest.raises(ValueError, match="cannot write"):
        format_quantity(value, Dimension.LENGTH)


@pytest.mark.parametrize(
    ("unit", "hint"),
    [
        ("CM", "did you mean `cm`?"),
        ("Kg", "did you mean `kg`?"),
        ("grd", "did you mean `rad`?"),
        ("Nm", "did you mean `N m`?"),
        ("Nm/rad", "did you mean `N m`?"),
        ("Nmm", "did you mean `N mm`?"),
        ("Nms/rad", "did you mean `N m s`?"),
        ("N*m", "did you mean `N m`?"),
        ("N.m", "did you mean `N m`?"),
        ("dyncm", "did you mean `dyn cm`?"),
        ("kgm2", "did you mean `kg m2`?"),
        ("kg*m^2", "did you mean `kg m2`?"),
        ("kg m^2", "did you mean `m2`?"),
        ("kg m\u00b2", "did you mean `m2`?"),
        ("gcm2", "did you mean `g cm2`?"),
        ("degrees", "did you mean `deg`?"),
        ("Degree", "did you mean `deg`?"),
        ("\u00b0", "did you mean `deg`?"),
        ("radians", "did you mean `rad`?"),
        ("degs/s", "did you mean `deg`?"),
        ("deg/sec", "did you mean `s`?"),
        ("Newton", "did you mean `N`?"),
        ("centimetres", "did you mean `cm`?"),
        ("inches", "did you mean `in`?"),
        ("lbs", "did you mean `lb`?"),
    ],
)
def test_an_unknown_unit_is_refused_with_the_nearest(unit, hint):
    with pytest.raises(UnitError) as raised:
        parse_unit(unit)
    assert raised.value.hint == hint


@pytest.mark.parametrize(
    ("written", "dimension", "texts"),
    [
        (("30deg", "0deg", "-90deg"), Dimension.ANGLE, None),
        (("30deg", "0.1rad", "0.2rad"), Dimension.ANGLE, "rad"),
        (("30deg", "45deg", "0.2rad"), Dimension.ANGLE, "deg"),
        (("0.25rad", "0.1rad", "0rad"), Dimension.ANGLE, None),
        (("1199091.875", "292090.1563", "0"), Dimension.INERTIA, None),
        (("2 kg m2", "3000000", "0"), Dimension.INERTIA, " kg m2"),
        (("10cm", "20cm", "30.5cm"), Dimension.LENGTH, None),
    ],
)
def test_the_numbers_of_a_list_have_one_unit(written, dimension, texts):
    """`texts` is None where all are written as they were, else their unit."""
    values = [value_of(text, dimension) for text in written]
    found = format_quantities(values, dimension)
    assert [value_of(text, dimension) for text in found] == values
    if texts is None:
        assert tuple(found) == written
    else:
        assert {text.lstrip("-0123456789.e") for text in found if text != "0"} == {texts}


def value_of(text: str, dimension: Dimension) -> float:
    """The value in SI of a number with its unit, as a figure's file is read."""
    findings = Diagnostics()
    value = resolve_number(
        parse_value(TokenStream(Source("text", text), findings), ""), dimension, findings
    )
    assert value is not None
    assert not findings.entries
    return value


def test_unit_words():
    assert all(map(is_unit_word, ["cm", "m2", "cm3", "s2", "N"]))
    assert not any(map(is_unit_word, ["", "cm5", "inertia", "2", "m2m", "floor"]))


@given(st.floats(-1e6, 1e6), st.sampled_from((ROTATION_UNITS, TRANSLATION_UNITS)))
def test_a_displacement_in_text_is_that_in_si(number, units):
    assert units.scale * units.si_value(number) == pytest.approx(number, rel=1e-14)
    assert units.si_value(1.0) == float(parse_unit(units.displacement).factor)
    assert float(parse_unit(units.si).factor) == 1.0


def test_units_of_axes_are_those_of_the_language():
    assert ROTATION_UNITS.format(math.radians(-12.5)) == "-12.5 deg"
    assert TRANSLATION_UNITS.format(-0.0) == "0 cm"
    for units, effort in ((ROTATION_UNITS, "N m"), (TRANSLATION_UNITS, "N")):
        stiffness, si = parse_unit(units.stiffness), parse_unit(units.si)
        assert units.effort == effort
        assert stiffness == parse_unit(f"{effort}/{units.si}")
        assert parse_unit(units.damping) == parse_unit(f"{effort} s/{units.si}")
        assert stiffness.factor * si.factor == parse_unit(effort).factor
        assert units.rate == f"{units.displacement}/s"
