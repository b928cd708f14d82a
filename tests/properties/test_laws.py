"""The mathematics of every elastic law: a law without a strategy fails the first test."""

import json
from collections.abc import Callable
from itertools import pairwise
from math import nan

import numpy as np
import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st

from generator.simulation.exudyn_model.exudyn_api import SYMBOLIC, symbols
from generator.springs_file.laws import (
    LAW_FORMS,
    LAWS,
    EntryLaw,
    LawForm,
    SlideEntry,
    describe_law,
    law_data,
)
from generator.springs_file.parse import SPRINGS_FILE, SpringEntry, SpringsFile
from generator.springs_file.write import write_springs
from generator.units import ROTATION_UNITS, TRANSLATION_UNITS, AxisUnits
from springs import FLOATS, NUMPY, Cubic, Damping, Elastic, Linear, Stop
from springs.elastic import Frictional, mirror_range, valid_range
from springs.exponential import ExponentialTerm
from springs.hysteresis import Hysteresis
from springs.interpolated import Interpolated
from springs.smooth_limit import SmoothLimit
from springs.transformed import Transformed
from tests.laws import (
    ENTRY_STRATEGIES,
    EXCESSES,
    RESISTING,
    STRATEGIES,
    law_classes,
    limits,
)
from tests.slopes import slope

ANGLE = st.floats(-2.5, 2.5)
RATE = st.floats(-2.0, 2.0)
NODES, WEIGHTS = np.polynomial.legendre.leggauss(24)
EDGE = 1e-9

every_law = pytest.mark.parametrize(
    "law_class", [row.law for row in LAWS], ids=lambda c: c.__name__
)


def drawn(data: st.DataObject, law_class: type) -> Elastic:
    return data.draw(STRATEGIES[law_class], label="law")


def size(law: Elastic, *angles: float) -> float:
    """Largest torque of the curves of a law at some angles [N m]: the scale of rounding."""
    if isinstance(law, Hysteresis):
        return size(law.increasing, *angles) + size(law.decreasing, *angles)
    if isinstance(law, Transformed):
        moved = size(law.law, *(angle - law.offset for angle in angles))
        return abs(law.scale) * moved + abs(law.constant)
    return max(abs(float(law.torque(angle))) for angle in angles)


def test_every_law_has_a_row_and_a_strategy():
    assert law_classes() == {row.law for row in LAWS} == set(STRATEGIES)
    assert {form.entry_type for form in LAW_FORMS} == set(ENTRY_STRATEGIES)


CUBIC = (0.0, 1.0, 0.0, 1.0)
RUBBING = Hysteresis.from_mean_and_width(Linear(1.0), 3.0)


@pytest.mark.parametrize(
    ("make", "arguments", "message"),
    [
        (Cubic, (CUBIC, 0), "the sense of a cubic is"),
        (Cubic, (CUBIC, 2), "not 2"),
        (
            Cubic,
            (CUBIC, -1, (0.5, 0.1)),
            "the dead zone 0.5 .. 0.1 rad ends before it begins",
        ),
        (Stop, (1.0, 0.5), "the lower limit 1 is above the upper 0.5"),
        (Stop, (0.0, 1.0, -1.0), "stiffness is not negative"),
        (Stop, (0.0, 1.0, 1.0, 0.0), "onset is positive"),
        (SmoothLimit, (1.0, 0.0, 1.0, 1.0, 1.0), "the lower limit 1 is above the upper 0"),
        (SmoothLimit, (0.0, 1.0, -1.0, 1.0, 1.0), "not negative"),
        (SmoothLimit, (0.0, 1.0, 1.0, -1.0, 1.0), "not negative"),
        (SmoothLimit, (0.0, 1.0, 1.0, 1.0, 0.0), "transition is positive"),
        (Interpolated, (((0.0, 1.0),),), "two points at least"),
        (Interpolated, (((0.0, 1.0), (0.0, 2.0)),), "0 rad comes after 0 rad"),
        (Interpolated, (((0.0, 1.0), (-1.0, 2.0)),), "-1 rad comes after 0 rad"),
        (Interpolated, (((0.0, 1.0), (1.0, nan)),), "finite numbers"),
        (ExponentialTerm, (1.0, 0.0), "write a constant instead"),
        (Damping, (-0.1,), "not negative"),
        (Damping, (0.0, -0.1), "not negative"),
        (Damping, (0.0, 1.0, 0.0), "not negative"),
        (Hysteresis.from_mean_and_width, (Linear(1.0), -1.0), "width of a hysteresis is not neg"),
        (Hysteresis.from_mean_and_width, (Linear(1.0), 1.0, 0.0), "slip rate of a direct"),
        (Transformed, (RUBBING, 2.0), "scale the two curves"),
    ],
)
def test_numbers_that_make_no_law_are_refused(
    make: Callable[..., object], arguments: tuple[object, ...], message: str
):
    with pytest.raises(ValueError, match=message):
        make(*arguments)


@every_law
@given(data=st.data(), angle=ANGLE)
def test_torque_is_minus_the_slope_of_energy(law_class: type, data: st.DataObject, angle: float):
    law = drawn(data, law_class)
    torque = law.torque(angle)
    assert torque == pytest.approx(
        -slope(law.energy, angle), rel=1e-9, abs=1e-9 + 1e-12 * size(law, angle)
    )


@every_law
@given(data=st.data(), ends=st.tuples(ANGLE, ANGLE))
def test_energy_falls_by_the_work_and_is_smooth_between_breakpoints(
    law_class: type, data: st.DataObject, ends: tuple[float, float]
):
    law, (low, high) = drawn(data, law_class), sorted(ends)
    cuts = [low, *sorted({b for b in law.breakpoints if low < b < high}), high]
    work, scale = 0.0, 0.0
    for start, end in pairwise(cuts):
        half = 0.5 * (end - start)
        torques = np.asarray(law.torque(start + half * (NODES + 1.0)))
        work += half * float(WEIGHTS @ torques)
        scale += half * float(WEIGHTS @ np.abs(torques)) + abs(float(law.energy(end)))
    assert law.energy(low) - law.energy(high) == pytest.approx(work, abs=1e-9 + 1e-6 * scale)


@every_law
@given(data=st.data())
def test_nothing_jumps_at_a_breakpoint(law_class: type, data: st.DataObject):
    law = drawn(data, law_class)
    assert list(law.breakpoints) == sorted(law.breakpoints)
    for angle in law.breakpoints:
        for function in (law.torque, law.energy):
            before, after = function(angle - EDGE), function(angle + EDGE)
            assert after == pytest.approx(before, rel=1e-5, abs=1e-3)


@every_law
@given(data=st.data(), ends=st.tuples(ANGLE, ANGLE), rate=RATE)
def test_the_mirrored_law_is_that_of_the_opposite_angle(
    law_class: type, data: st.DataObject, ends: tuple[float, float], rate: float
):
    law, (angle, other) = drawn(data, law_class), ends
    mirrored = law.mirrored()
    close = {"rel": 1e-7, "abs": 1e-7 * (1.0 + size(law, angle, other))}
    assert mirrored.torque(-angle) == pytest.approx(-law.torque(angle), **close)
    energy = mirrored.energy(-angle) - mirrored.energy(-other)
    assert energy == pytest.approx(law.energy(angle) - law.energy(other), **close)
    assert sorted(-b for b in mirrored.breakpoints) == pytest.approx(law.breakpoints)
    assert valid_range(mirrored) == mirror_range(valid_range(law))
    assert mirrored.mirrored() == law
    if isinstance(law, Frictional):
        assert isinstance(mirrored, Frictional)
        friction = -law.friction(angle, rate)
        assert mirrored.friction(-angle, -rate) == pytest.approx(friction, **close)


@every_law
@given(data=st.data(), angles=st.lists(ANGLE, min_size=1, max_size=4), rate=RATE)
def test_arrays_and_floats_agree(
    law_class: type, data: st.DataObject, angles: list[float], rate: float
):
    law, close = drawn(data, law_class), {"rtol": 1e-12, "atol": 1e-12}
    for function in (law.torque, law.energy):
        single = [function(angle, FLOATS) for angle in angles]
        assert np.allclose(function(np.array(angles)), single, **close)
    if isinstance(law, Frictional):
        single = [law.friction(angle, rate, FLOATS) for angle in angles]
        assert np.allclose(law.friction(np.array(angles), rate), single, **close)


@given(RESISTING, EXCESSES)
@example(Stop(0.0, 0.0, 1776.3, 0.076), 1.7e-65)
@example(Stop(0.0, 0.0, 217.9375, 0.01), 1e-12)
@example(Cubic((-195.0, 24.0, 0.0, 89.0), -1, (-0.63, 0.04)), 1e-17)
def test_no_law_drives_out_of_its_limits(law: Stop | SmoothLimit | Cubic, excess: float):
    lower, upper = limits(law)
    for ops in (NUMPY, FLOATS):
        assert law.torque(np.nextafter(lower - excess, -3.0), ops) >= 0.0
        assert law.torque(np.nextafter(upper + excess, 3.0), ops) <= 0.0


@pytest.mark.usefixtures("recording")
def test_no_symbolic_law_drives_out_of_its_limits():
    @settings(max_examples=50)
    @given(RESISTING, EXCESSES)
    @example(Stop(0.0, 0.0, 1776.3, 0.076), 1.7e-65)
    @example(Stop(0.0, 0.0, 217.9375, 0.01), 1e-12)
    def stays(law: Stop | SmoothLimit | Cubic, excess: float):
        angle, (lower, upper) = symbols.Real("angle", 0.0), limits(law)
        tree = law.torque(angle, SYMBOLIC)
        angle.SetValue(np.nextafter(lower - excess, -3.0))
        assert tree.Evaluate() >= 0.0
        angle.SetValue(np.nextafter(upper + excess, 3.0))
        assert tree.Evaluate() <= 0.0

    stays()


@pytest.fixture
def recording():
    symbols.SetRecording(True)
    yield
    symbols.SetRecording(False)


@pytest.mark.usefixtures("recording")
@every_law
def test_symbols_of_exudyn_and_floats_agree(law_class: type):
    @settings(max_examples=50)
    @given(STRATEGIES[law_class], st.lists(ANGLE, min_size=1, max_size=4), RATE)
    def agree(law: Elastic, angles: list[float], rate: float):
        angle, speed = symbols.Real("angle", 0.0), symbols.Real("rate", rate)
        trees = [
            (law.torque(angle, SYMBOLIC), law.torque),
            (law.energy(angle, SYMBOLIC), law.energy),
        ]
        for value in angles:
            angle.SetValue(value)
            for tree, function in trees:
                result = tree.Evaluate() if hasattr(tree, "Evaluate") else tree
                assert result == pytest.approx(function(value, FLOATS), rel=1e-11, abs=1e-10)
            if isinstance(law, Frictional):
                friction = law.friction(angle, speed, SYMBOLIC).Evaluate()
                expected = law.friction(value, rate, FLOATS)
                assert friction == pytest.approx(expected, rel=1e-11, abs=1e-10)

    agree()


# The two curves of a hysteresis are scaled, not the law.
@pytest.mark.parametrize("law_class", [row.law for row in LAWS if row.law is not Hysteresis])
@given(data=st.data(), angle=ANGLE, numbers=st.tuples(st.floats(0.0, 3.0), ANGLE, ANGLE))
def test_a_scaled_and_shifted_law_is_the_law_elsewhere(
    law_class: type, data: st.DataObject, angle: float, numbers: tuple[float, float, float]
):
    law = drawn(data, law_class)
    scale, offset, constant = numbers
    moved, close = Transformed(law, *numbers), {"rel": 1e-7, "abs": 1e-6}
    assume(all(abs(angle - b) > EDGE for b in law.breakpoints))
    expected = scale * law.torque(angle) + constant
    assert moved.torque(angle + offset) == pytest.approx(expected, **close)
    assert moved.breakpoints == pytest.approx([b + offset for b in law.breakpoints])
    known = valid_range(law)
    assert valid_range(moved) == (known and (known[0] + offset, known[1] + offset))


@every_law
@given(data=st.data(), units=st.sampled_from((ROTATION_UNITS, TRANSLATION_UNITS)))
def test_a_law_is_described_in_one_line_and_in_json(
    law_class: type, data: st.DataObject, units: AxisUnits
):
    law = drawn(data, law_class)
    line = describe_law(law, units)
    assert line
    assert "\n" not in line
    assert json.loads(json.dumps(law_data(law), allow_nan=False))["law"]


@pytest.mark.parametrize("form", LAW_FORMS, ids=lambda form: form.name)
@settings(max_examples=25)
@given(data=st.data())
def test_a_law_that_is_written_is_read_back(form: LawForm[EntryLaw], data: st.DataObject):
    law = data.draw(ENTRY_STRATEGIES[form.entry_type], label="law")
    axis = "along y" if isinstance(law, SlideEntry) else None
    texts = {"motion": "x", "reference": "x", "why": "x"}
    content = SpringsFile((SpringEntry(("knee",), axis, law, **texts),))
    (entry,) = SPRINGS_FILE.parse_text(write_springs(content)).require_value().entries
    assert entry.law == law
