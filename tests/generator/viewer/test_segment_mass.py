"""Mass properties of a segment as the page states them, equal to those of the commands."""

import re
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from generator import read_figure
from generator.viewer import segment_mass
from tests.command import answer

LENGTHS = st.floats(0.01, 2.0)


def number(lines: list[str], title: str) -> float:
    (line,) = [line for line in lines if line.startswith(title)]
    return float(re.findall(r"[-+\d.e]+", line.split(":")[1])[0])


def test_the_numbers_are_those_of_the_commands():
    figure = read_figure("prototype")
    segment = figure.segments["left_upper_leg"]
    lines = segment_mass.mass_lines(segment, segment_mass.segment_volume(figure, segment))
    words = ("mass", "prototype", "--segment", "left_upper_leg", "--density", "1000kg/m3")
    volume = answer(*words)["volume_m3"]
    described = answer("describe", "prototype")["segments"]
    (row,) = [each for each in described if each["name"] == "left_upper_leg"]
    assert number(lines, "Volume") == pytest.approx(1e6 * volume, abs=0.05)
    assert number(lines, "Mass") == pytest.approx(row["mass_kg"], abs=5e-5)
    assert number(lines, "Density") == pytest.approx(row["mass_kg"] / volume, abs=0.05)
    assert number(lines, "Principal") == pytest.approx(min(row["inertia_kg_m2"]), rel=1e-3)
    centre = [100.0 * part for part in row["centre_of_mass_m"]]
    (line,) = [line for line in lines if line.startswith("Centre")]
    found = [float(part) for part in re.findall(r"-?\d+\.\d+", line)]
    assert found == pytest.approx(centre, abs=0.005)


def test_a_segment_without_a_closed_surface_has_no_density():
    figure = read_figure("fourbar")
    segment = figure.segments["crank"]
    found = segment_mass.segment_volume(figure, segment)
    assert found.volume is None
    lines = segment_mass.mass_lines(segment, found)
    assert any("no closed surface" in line for line in lines)
    assert not any("Density" in line for line in lines)
    missing = replace(segment, psurf="missing.pss")
    assert "no closed surface" in segment_mass.segment_volume(figure, missing).reason


def test_ground_and_missing_masses_are_stated():
    figure = read_figure("pendulum")
    floor = figure.segments["floor"]
    lines = segment_mass.mass_lines(floor, segment_mass.segment_volume(figure, floor))
    assert "Part of the ground" in lines
    assert not any("Density" in line for line in lines)
    assert "Mass: none" in segment_mass.mass_lines(replace(floor, mass=None), None)
    assert "Mass: 0.0000 kg" in segment_mass.mass_lines(replace(floor, mass=0.0), None)


@given(mass=st.floats(0.01, 100.0), axes=st.tuples(LENGTHS, LENGTHS, LENGTHS))
def test_an_ellipsoid_has_its_own_axes(mass: float, axes: tuple[float, float, float]):
    a, b, c = (length**2 for length in axes)
    moments = 0.2 * mass * np.array([b + c, a + c, a + b])
    found = segment_mass.equimomental_semi_axes(mass, moments.tolist())
    # the smallest is the root of a difference of the largest squares
    assert np.allclose(found**2, [a, b, c], atol=1e-12 * max(a, b, c), rtol=1e-9)


def test_moments_that_no_body_has_give_a_flat_ellipsoid():
    assert segment_mass.equimomental_semi_axes(2.0, (5.0, 1.0, 1.0))[0] == 0.0
