"""The pages of contact: the table of spheres is the prototype's, the six falls are those drawn."""

import re
import sys
from importlib.util import module_from_spec, spec_from_file_location
from types import ModuleType

import pytest

from generator import read_figure
from generator.contact.spheres import LARGEST_ERROR, MAX_SPHERES, fit_contact_spheres
from tests.paths import DOCS, FIGURES

PAGE = (DOCS / "contact.md").read_text(encoding="utf-8")
THEORY = (DOCS / "contact-theory.md").read_text(encoding="utf-8")
SEGMENTS = {
    "lower leg with foot": "left_lower_leg",
    "upper leg": "left_upper_leg",
    "lower arm with hand": "left_lower_arm",
    "upper arm": "left_upper_arm",
    "lower torso": "lower_torso",
    "centre torso with head": "center_torso",
}
FITS = fit_contact_spheres(read_figure("prototype"))


@pytest.mark.parametrize(("title", "name"), SEGMENTS.items())
def test_a_row_is_the_fit_of_its_segment(title: str, name: str):
    (row,) = re.findall(rf"^\| {title} \| (\d+) \| ([\d.]+) \|$", THEORY, re.MULTILINE)
    error = FITS[name].largest_error
    assert int(row[0]) == len(FITS[name].spheres)
    assert error is not None
    assert float(row[1]) == pytest.approx(1e3 * error, abs=0.1)


def test_the_rule_is_that_of_the_fit():
    assert f"more than {1e3 * LARGEST_ERROR:.0f} mm" in THEORY
    assert "or there are eight spheres" in THEORY
    assert MAX_SPHERES == 8


def script() -> ModuleType:
    """The script of the picture of six falls."""
    spec = spec_from_file_location("falls", DOCS / "pictures/falls.py")
    assert spec is not None
    assert spec.loader is not None
    module = module_from_spec(spec)
    sys.modules["falls"] = module  # dataclasses look for it there
    try:
        spec.loader.exec_module(module)
    finally:
        del sys.modules["falls"]
    return module


def test_the_commands_of_the_six_falls_are_those_drawn():
    section = PAGE.partition("## Six falls")[2].partition("\n## ")[0]
    falls = script().FALLS
    assert re.findall(r"^mover .*$", section, re.MULTILINE) == [fall.command for fall in falls]
    for fall in falls:
        assert fall.times[-1] == float(fall.command.rpartition("--stop ")[2])


@pytest.mark.parametrize("name", ["step", "bed", "seat"])
def test_a_scene_states_the_start_of_its_fall(name: str):
    text = (FIGURES / f"{name}.scene.toml").read_text(encoding="utf-8")
    (command,) = [fall.command for fall in script().FALLS if f"--scene {name}" in fall.command]
    start = re.search(r"^# (--.*)$", text, re.MULTILINE)
    assert start is not None
    options = re.findall(r"--\S+ \S+", start[1].replace("--height 0 ", ""))
    assert options
    assert all(option in command for option in options)
