"""Strengths by joint and motion."""

import re

import numpy as np
import pytest

from generator.figure_file import FIGURE_FILE
from generator.simulation.muscle_tone import body_of
from springs.strength.strengths import (
    Body,
    Check,
    StrengthClass,
    checks,
    old_share,
    strength,
    strength_rows,
    women_factor,
)
from tests.paths import DOCS

MAN = Body(72.0, 1.75)
WOMAN = Body(60.0, 1.63, is_female=True)
FIGURES = {"male": "male50", "female": "female50"}
KNEE_ANGLES = {"extended": 20.0, "flexed": 90.0}


@pytest.mark.parametrize(
    ("joint", "motion", "largest"),
    [
        ("waist", "lumbar lateral bend to the right", (150.0, 150.0)),
        ("left_elbow", "forearm pronation", (9.0, 9.0)),
        ("neck", "twist to the left", (13.0, 13.0)),
        ("left_hip_joint", "abduction", (100.0, 100.0)),
    ],
)
def test_motions_of_persons(joint: str, motion: str, largest: tuple[float, float]) -> None:
    found = strength(joint, motion)
    assert found is not None
    assert found.largest == largest


def test_women_have_a_share_where_only_men_were_measured() -> None:
    men, women = strength("neck", "flexion", MAN), strength("neck", "flexion", WOMAN)
    assert men is not None
    assert women is not None
    assert women.largest[0] == pytest.approx(women_factor() * men.largest[0])
    assert women.origin is StrengthClass.ESTIMATE
    assert men.origin is StrengthClass.PUBLISHED


def test_unknown_motions_and_bodies_have_none() -> None:
    assert strength("left_knee", "rotation", MAN) is None
    assert strength("hinge", "", MAN) is None
    assert strength("left_knee", "flexion") is None


def test_every_row_has_numbers_and_a_source_unless_it_is_an_estimate() -> None:
    assert len(strength_rows()) > 20
    for row in strength_rows():
        assert (row.torque is None) != (row.share is None)
        assert bool(row.reference) == (row.origin is not StrengthClass.ESTIMATE), row.motion
        assert min(row.torque or row.share or ()) > 0.0
        largest = row.torque or row.share
        assert largest is not None
        assert max(largest) <= 3.0 * min(largest), "the bound of each direction needs this"


@pytest.fixture(scope="module")
def bodies() -> dict[str, Body]:
    found = {sex: body_of(FIGURE_FILE.read(name)) for sex, name in FIGURES.items()}
    return {sex: body for sex, body in found.items() if body is not None}


def own_value(check: Check, body: Body, degrees: float | None = None) -> float:
    """Our number beside a measurement, at the best angle, or at one."""
    if check.motion == "women's share of men's strength":
        return women_factor()
    if check.motion == "share over 65 years":
        return old_share()
    joint, _, motion = check.motion.rpartition(" ")
    found = strength(joint, motion, body)
    assert found is not None
    knee = KNEE_ANGLES.get(check.what.split(" ")[0]) if degrees is None else degrees
    torque = found.largest[0]
    if knee is not None:
        sense = 1.0 if motion == "flexion" else -1.0
        torque = float(found.capacity(sense * np.radians(knee), is_opposite=False))
    return torque / body.mass if check.unit == "N m/kg" else torque


def table() -> list[list[str]]:
    page = (DOCS / "hold-validation.md").read_text(encoding="utf-8")
    part = page.partition("## Strengths beside other measurements")[2].partition("\n## ")[0]
    rows = re.findall(r"^\| (.*) \|$", part, re.MULTILINE)
    return [row.split(" | ") for row in rows[1:]]


def test_page_has_each_check_with_our_number(bodies: dict[str, Body]):
    rows = table()
    assert len(rows) == len(checks())
    for (_, measured, ours, verdict), check in zip(rows, checks(), strict=True):
        low, high = check.interval
        numbers = [float(text) for text in re.findall(r"\d+(?:\.\d+)?", measured)]
        assert numbers == ([low] if low == high else [low, high])
        text = ours.partition(" ")[0]
        value = own_value(check, bodies[check.sex])
        assert float(text) == pytest.approx(value, abs=0.51 * 10.0 ** -len(text.partition(".")[2]))
        at_zero = re.search(r"(\d\.\d\d) at 0 deg, \*\*(\d+) % under", verdict)
        if at_zero is not None:
            straight = own_value(check, bodies[check.sex], 0.0)
            assert float(at_zero[1]) == pytest.approx(straight, abs=5e-3)
            assert int(at_zero[2]) == round(100.0 * (1.0 - straight / low))
        excess = re.match(r"(\d+) % (under|over)", verdict)
        if verdict.startswith(("inside", "equal")):
            assert low <= value <= high
        elif excess is not None:
            share = 1.0 - value / low if excess[2] == "under" else value / high - 1.0
            assert int(excess[1]) == round(100.0 * share)
            assert share > 0.0
        else:
            assert verdict.startswith("above")
            assert value > high


def test_checks_have_sources():
    for check in checks():
        assert check.reference.sureness == "P"
        assert check.sample.is_measured
        assert check.interval[0] <= check.interval[1]
