"""docs/falls.md: the table of kinds has the numbers of `FALLS`, and the example runs."""

import re
from math import degrees

import pytest

from generator.simulation.falls import FALLS
from tests.paths import DOCS

PAGE = (DOCS / "falls.md").read_text(encoding="utf-8")
ROWS = dict(
    re.findall(r"^\| `(\w+)` \| (.*) \|$", PAGE.partition("## Many falls")[0], re.MULTILINE)
)


def test_every_kind_has_a_row():
    assert list(ROWS) == list(FALLS)


@pytest.mark.parametrize("kind", FALLS)
def test_a_row_has_the_numbers_of_its_kind(kind: str):
    fall, (_, lean, speed, beside) = FALLS[kind], ROWS[kind].split("|")
    angles = sorted({round(abs(degrees(end)), 9) for end in fall.lean} - {0.0})
    assert [float(number) for number in re.findall(r"[\d.]+", lean)] == angles
    speeds = sorted(set(fall.speed)) if any(fall.speed) else []
    assert [float(number) for number in re.findall(r"[\d.]+", speed.replace("m/s", ""))] == speeds
    said = [fall.height, fall.feet_speed[0], fall.friction]
    assert all(f"{number:g}" in beside for number in said if number)
    assert not fall.scene or f"`{fall.scene}`" in beside


def test_the_knees_are_those_of_all_kinds():
    low, high = (f"{degrees(end):.0f}" for end in FALLS["faint"].knees)
    assert f"each knee is bent by {low} to {high} deg" in PAGE
    assert len({fall.knees for fall in FALLS.values()}) == 1


def test_the_example_runs(capsys: pytest.CaptureFixture[str]):
    (code,) = re.findall(r"^```python\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL)
    exec(compile(code, "falls.md", "exec"), {})
    assert 0.3 < float(capsys.readouterr().out) < 0.7
