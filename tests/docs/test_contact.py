"""The page of contact: its table of spheres is that of the prototype."""

import re

import pytest

from generator import read_figure
from generator.geometry.contact_spheres import LARGEST_ERROR, MAX_SPHERES, fit_contact_spheres
from tests.paths import DOCS

PAGE = (DOCS / "contact.md").read_text(encoding="utf-8")
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
    (row,) = re.findall(rf"^\| {title} \| (\d+) \| ([\d.]+) \|$", PAGE, re.MULTILINE)
    error = FITS[name].largest_error
    assert int(row[0]) == len(FITS[name].spheres)
    assert error is not None
    assert float(row[1]) == pytest.approx(1e3 * error, abs=0.1)


def test_the_rule_is_that_of_the_fit():
    assert f"more than {1e3 * LARGEST_ERROR:.0f} mm" in PAGE
    assert "or there are eight spheres" in PAGE
    assert MAX_SPHERES == 8
