"""docs/springs-file.md: its examples are read without a fault, and it names every key."""

import re
from math import radians
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from generator import Recording, read_figure, read_springs
from generator.diagnostics import InputError
from generator.springs_file.coupled import COUPLED_ROWS, TERM_ROWS
from generator.springs_file.laws import CubicEntry
from generator.springs_file.parse import (
    COUPLED_TABLE,
    FILE_ROWS,
    REACH_TABLE,
    SPRING_ROWS,
    SPRING_TABLE,
    SPRINGS_FILE,
    SpringsFile,
)
from generator.springs_file.reach import REACH_ROWS
from generator.springs_file.write import write_springs
from generator.text_io import make_source
from springs import Cubic, Linear
from tests.paths import DOCS

PAGE = (DOCS / "springs-file.md").read_text(encoding="utf-8")
EXAMPLES = re.findall(r"^```toml\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL)
PYTHON = re.findall(r"^```python\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL)
CURVES, COUPLED = PAGE.split("## A law over several joints")
COUPLED, REACH = COUPLED.split("## The reach of a limb")


def content(text: str) -> SpringsFile:
    reading = SPRINGS_FILE.parse(make_source(text, "springs-file.md"))
    assert reading.diagnostics == ()
    assert reading.value is not None
    return reading.value


def rows(part: str) -> set[str]:
    """The keys that stand in the tables of a part of the page."""
    lines = [line for line in part.splitlines() if line.startswith("|")]
    return {key for line in lines for key in re.findall(r"\| `([A-Za-z_0-9]+)` \|", line)}


def test_every_example_is_read_and_written_and_read():
    assert len(EXAMPLES) == 6
    for example in EXAMPLES:
        assert content(write_springs(content(example))) == content(example)


FILE_KEYS = set(FILE_ROWS.keys) - {SPRING_TABLE, COUPLED_TABLE, REACH_TABLE}


def test_every_key_of_a_curve_is_in_a_table_and_no_other():
    assert rows(CURVES) == {*SPRING_ROWS.keys, *FILE_KEYS}


def test_every_key_of_a_coupled_law_is_in_a_table_and_no_other():
    assert rows(COUPLED) == set(COUPLED_ROWS.keys)
    assert all(key in COUPLED for key in TERM_ROWS.keys)


def test_every_key_of_a_reach_is_in_a_table_and_no_other():
    assert rows(REACH) | {"reference"} == set(REACH_ROWS.keys) - {"why"}


@pytest.mark.parametrize("example", EXAMPLES)
def test_every_law_over_several_joints_of_the_page_is_one(example: str):
    for entry in content(example).coupled:
        assert len(entry.law.coordinates) == 2


def test_the_elbow_beyond_its_dead_zone_is_as_the_page_has_it():
    (found,) = re.findall(r"elbow, `(\[.*\])` with", CURVES)
    text = f'[[spring]]\njoints = ["a"]\ncoefficients_Nm_rad = {found}\nsense = -1\n'
    text += "dead_zone_deg = [0, 97.402825]\n"
    (entry,) = content(text).entries
    assert isinstance(entry.law, CubicEntry)
    law = Cubic(entry.law.coefficients, -1, entry.law.dead_zone)
    printed = Cubic(entry.law.coefficients, -1)
    told = " ".join(CURVES.split())
    assert f"gives 0 at 97.4 deg and {law.torque(radians(120.0)):.0f} N m at 120 deg" in told
    assert f"-M(120 deg) is {printed.torque(radians(120.0)):.0f} N m" in told
    assert law.torque(radians(97.4)) == 0.0


def test_the_figure_keeps_what_the_file_does_not_name(tmp_path: Path):
    path = tmp_path / "own.springs.toml"
    path.write_text('[[spring]]\njoints = ["waist"]\naxis = "x"\nstiffness_Nm_rad = 3\n', "utf-8")
    springs = read_springs(path, read_figure("prototype"))
    own = read_springs(None, read_figure("prototype"))
    assert springs.joints["left_elbow"] == own.joints["left_elbow"]
    path.write_text('base = "none"\n' + path.read_text("utf-8"), "utf-8")
    (elbow,) = read_springs(path, read_figure("prototype")).joints["left_elbow"].axes
    assert elbow.elastic == (Linear(1e-7),)
    assert "(the prototype's `stiff` is 1e-7 N m/rad)" in PAGE


@pytest.mark.parametrize("count", [3, 4])
def test_a_nearest_law_takes_the_coordinates_and_terms_of_the_page(count: int):
    assert "for at most 3 coordinates and 40 terms" in COUPLED
    for terms in (40, 41):
        said = f"""[[coupled]]
joints = {[f"j{k}" for k in range(count)]}
coordinates = {[f"c{k}" for k in range(count)]}
measured_deg = {[[0, 90]] * count}
conservative = "nearest"
terms = [
"""
        term = f"{{ amplitudes_Nm = {[1] * count}, rates_1_rad = {[1] * count} }},\n"
        faults = SPRINGS_FILE.parse_text(said + terms * term + "]\n").diagnostics
        assert bool(faults) is (count > 3 or terms > 40)


@pytest.mark.parametrize("code", PYTHON)
def test_the_code_of_the_page_runs(code: str):
    names: dict[str, Any] = {}
    exec(compile(code, "springs-file.md", "exec"), names)
    assert names["recording"].outcome.succeeded
    assert names["springs"].origin.endswith("prototype.springs.toml")
    recording = names["recording"]
    assert isinstance(recording, Recording)
    assert recording.outcome.succeeded


def test_springs_with_faults_are_an_error_that_holds_all(tmp_path: Path):
    path = tmp_path / "own.springs.toml"
    path.write_text('[[spring]]\njoints = ["a", "b"]\nstiffness_Nm_rad = 3\n', "utf-8")
    with pytest.raises(InputError) as failure:
        read_springs(path, read_figure("prototype"))
    assert len(failure.value.diagnostics) == 2
    assert read_springs("none", read_figure("prototype")).joints == {}


def test_the_error_is_printed_as_the_page_has_it():
    text = '[[spring]]\njoints = ["left_knee"]\nstiffness_Nm_rad = 1\nscale = -1\n'
    (fault,) = SPRINGS_FILE.parse(make_source(text, "my.springs.toml")).diagnostics
    assert str(fault) in PAGE


def test_points_of_one_joint_replace_the_law_of_the_leg_about_it(tmp_path: Path):
    page = (DOCS / "person.md").read_text(encoding="utf-8").split("## Your own curve of a joint")[1]
    text, *_ = re.findall(r"^```toml\n(.*?)^```", page, re.MULTILINE | re.DOTALL)
    path, figure = tmp_path / "knee.springs.toml", read_figure("male50")
    path.write_text(text, "utf-8")
    (own, _), (held, _) = read_springs(None, figure).coupled, read_springs(path, figure).coupled
    ranges = [known for known in own.law.valid_ranges if known is not None]
    grid = np.meshgrid(*(np.linspace(*known, 15) for known in ranges), indexing="ij")
    hip, _, ankle = own.law.torques(grid)
    straight = own.law.hold_coordinate("knee flexion", 0.0)
    for law, words in ((held.law, "by {} and {} N m (root"), (straight, "would by {} and {} N m")):
        changes = zip((hip, ankle), law.torques([grid[0], grid[2]]), strict=True)
        assert words.format(*(f"{np.sqrt(np.mean((a - b) ** 2)):.1f}" for a, b in changes)) in page
    upright = held.law.torques((0.0, 0.0))[1], own.law.torques((0.0, 0.0, 0.0))[2]
    assert "the ankle has {:.1f} N m instead of {:.1f} N m".format(*upright) in " ".join(
        page.split()
    )
