"""Numbers of the pendulum test, of the shipped swings and of made ones."""

import json
from dataclasses import replace
from math import degrees, exp, pi, radians, sqrt

import numpy as np
import pytest

from generator import read_figure
from generator.identification.measured_angles import MeasuredAngles, read_measured_angles
from plots.pendulum_test import PendulumNumber, PendulumTest, pendulum_tests
from plots.person_facts import person_facts
from tests.command import answer, mover, run
from tests.paths import FIGURES

FACTS = person_facts().facts
SWING = FIGURES / "leg_swing.csv"


def shipped(name: str = "leg_swing") -> MeasuredAngles:
    data, warnings = read_measured_angles(FIGURES / f"{name}.csv", read_figure("leg"))
    assert not warnings
    return data


def oscillation(
    ratio: float = 0.11, stop: float = 10.0, joint: str = "left_knee"
) -> MeasuredAngles:
    """A damped oscillator that drops by 60 deg to 90 deg, with a period of a second."""
    times = np.arange(round(100.0 * stop) + 1) / 100.0
    angular, decay = 2.0 * pi, 2.0 * pi * ratio / sqrt(1.0 - ratio**2)
    shape = np.cos(angular * times) + decay / angular * np.sin(angular * times)
    angles = 90.0 - 60.0 * np.exp(-decay * times) * shape
    noise = np.random.default_rng(1).normal(0.0, 0.3, len(times))
    return MeasuredAngles("swing", times, ((joint, 0),), np.radians(angles + noise)[:, None])


def number(test: PendulumTest, quantity: str) -> PendulumNumber:
    (found,) = [one for one in test.numbers if quantity in one.quantity]
    return found


def test_an_oscillator_has_the_numbers_of_its_closed_form() -> None:
    (test,) = pendulum_tests(oscillation())
    overshoot = exp(-pi * 0.11 / sqrt(1.0 - 0.11**2))
    peaks = [60.0 * overshoot ** (2 * k + 1) for k in range(9)]
    expected = {
        "release": 30.0,
        "rest": 90.0,
        "turning point": 90.0 + 60.0 * overshoot,
        "first swing": 60.0 * (1.0 + overshoot),
        "relaxation": 1.0 + overshoot,
        "period": 1.0,
    }
    for words, value in expected.items():
        one = number(test, words)
        assert abs(one.value - value) < 4.0 * one.sd + 1e-3 * value, words
        assert one.sd < 0.02 * value
    assert number(test, "beyond 2 deg").value == sum(peak > 2.0 for peak in peaks)
    assert degrees(test.noise) == pytest.approx(0.3, rel=0.1)
    assert test.rate == pytest.approx(100.0)


def test_a_knee_is_compared_with_the_published_numbers() -> None:
    (test,) = pendulum_tests(oscillation())
    facts = [one.fact.key for one in test.numbers if one.fact]
    assert facts == [
        "knee_ratio",
        "knee_swings",
        "knee_period",
        "knee_first_velocity",
        "knee_second_velocity",
    ]
    assert number(test, "relaxation").verdict == "within"
    text = "\n".join(test.paragraphs())
    for key in facts:
        assert str(FACTS[key].source.reference) in text
    assert "1.678 ± 0.09 1.5 .. 1.9 within" in " ".join(text.split())


def test_the_epoch_of_the_times_does_not_matter() -> None:
    """Times and epoch are multiples of 1/128 s, so that the shifted times are exact."""
    data = oscillation()
    binary = replace(data, times=np.arange(len(data.times)) / 128.0)
    shifted = replace(binary, times=binary.times + 2.0**30)
    assert [test.to_json() for test in pendulum_tests(shifted)] == [
        test.to_json() for test in pendulum_tests(binary)
    ]


def test_an_elbow_is_compared_with_elbows_and_a_hip_with_nothing() -> None:
    (elbow,) = pendulum_tests(oscillation(joint="right_elbow"))
    assert {one.fact.key for one in elbow.numbers if one.fact} == {
        "elbow_ratio",
        "elbow_first_velocity",
        "elbow_second_velocity",
    }
    (hip,) = pendulum_tests(oscillation(joint="hip"))
    assert not any(one.fact or one.verdict for one in hip.numbers)
    assert "healthy" not in "".join(hip.paragraphs())


@pytest.mark.parametrize(("factor", "verdict"), [(0.8, "below"), (1.0, "within"), (1.2, "above")])
def test_verdicts(factor: float, verdict: str) -> None:
    (test,) = pendulum_tests(oscillation())
    ratio = number(test, "relaxation")
    assert replace(ratio, value=1.678 * factor).verdict == verdict
    assert replace(ratio, value=float("nan")).verdict == ""
    assert replace(ratio, fact=None).verdict == ""


def test_the_shipped_swings_have_the_numbers_of_their_noiseless_motion() -> None:
    """Numbers of the same motions at 1000 samples a second: 1.5766 and 1.6299, 9 and 8 swings."""
    for name, index, swings in (("leg_swing", 1.5766, 9), ("leg_swing_30", 1.6299, 8)):
        (test,) = pendulum_tests(shipped(name))
        ratio = number(test, "relaxation")
        assert ratio.value == pytest.approx(index, abs=4.0 * ratio.sd)
        assert number(test, "beyond").value == swings
        assert degrees(test.noise) == pytest.approx(0.5, abs=0.03)


def test_of_several_columns_those_that_swing_are_reported() -> None:
    data = oscillation()
    still = np.random.default_rng(2).normal(0.0, 0.005, data.angles.shape)
    both = replace(
        data,
        columns=(*data.columns, ("left_hip", 2), ("left_hip", 0)),
        angles=np.hstack([data.angles, data.angles, still]),
    )
    assert [test.joint for test in pendulum_tests(both)] == ["left_knee", "left_hip.3"]


def test_a_short_record_lacks_numbers() -> None:
    (test,) = pendulum_tests(oscillation(ratio=0.05, stop=3.2))
    assert np.isnan(number(test, "beyond").value)
    assert number(test, "first 2").value == pytest.approx(1.0, abs=0.01)
    assert "The record is too short for: swings beyond 2 deg." in list(test.paragraphs())
    assert json.loads(json.dumps(test.to_json(), allow_nan=False))["numbers"][5]["value"] is None


def test_a_record_without_a_swing_is_refused_with_the_reason() -> None:
    result = mover("identify", "leg", SWING, "--protocol", "pendulum", "--stop", "1")
    assert result.exit_code == 1
    assert "knee is not a swing: fewer than 3 turning points: record it for longer" in result.output


def test_json_has_the_references() -> None:
    (test,) = pendulum_tests(shipped())
    data = json.loads(json.dumps(test.to_json(), allow_nan=False))
    ratio = data["numbers"][4]
    assert data["joint"] == "knee"
    assert ratio["quantity"] == "relaxation index"
    assert ratio["healthy"]["band"] == [FACTS["knee_ratio"].low, FACTS["knee_ratio"].high]
    assert ratio["healthy"]["reference"].startswith("S. W. Kim")
    assert ratio["value"] == pytest.approx(1.5766, abs=4.0 * ratio["sd"])


def test_rates_outside_the_band_are_explained_by_the_drop() -> None:
    drop = radians(60.0)
    (test,) = pendulum_tests(oscillation(ratio=0.05))
    assert test.drop == pytest.approx(drop, abs=0.01)
    assert number(test, "first peak").verdict == "above"
    assert any("here 60 deg" in text for text in test.paragraphs())


def test_the_protocol_of_the_command_fits_nothing() -> None:
    text = run("identify", "leg", SWING, "--protocol", "pendulum").output
    (test,) = pendulum_tests(shipped())
    assert all(paragraph in text for paragraph in test.paragraphs())
    data = answer("identify", "leg", SWING, "--protocol", "pendulum")
    assert data == {"figure": "leg", "data": "leg_swing.csv", "pendulum": [test.to_json()]}


@pytest.mark.parametrize(
    "words", [(), ("--protocol", "pendulum", "-o", "a.springs.toml"), ("--plot", "a.svg")]
)
def test_a_file_needs_a_fit(words: tuple[str, ...]) -> None:
    result = mover("identify", "leg", SWING, *words)
    assert result.exit_code == 2
    assert "nothing to fit" in result.output
