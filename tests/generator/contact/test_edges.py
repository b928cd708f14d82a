"""Spheres along limbs stop the edges of boxes, and change the contact with planes little."""

import numpy as np
import pytest

from generator.contact.edges import (
    PROTRUSION,
    add_limb_spheres,
    is_limb,
    largest_edge_depth,
)
from generator.contact.spheres import LARGEST_ERROR, fit_spheres
from generator.figure import ContactSphere
from generator.figure_file.read import read_figure
from generator.geometry.primitives import capsule
from generator.geometry.read import read_segment_surface

LIMBS = {"upper_arm", "lower_arm", "upper_leg", "lower_leg"}


def surface_of(figure, name):
    return read_segment_surface(figure, figure.segments[name])


@pytest.mark.parametrize("name", ["male50", "female50"])
def test_limbs_are_found_by_their_form(name):
    figure = read_figure(name)
    found = {each for each in figure.bodies if is_limb(figure, each, surface_of(figure, each))}
    assert found == {f"{side}_{each}" for side in ("left", "right") for each in LIMBS}


@pytest.fixture(scope="module", params=[("male50", 3), ("female50", 11)])
def limbs(request):
    """Surface, fitted spheres and all spheres of the limbs of a person; a seed."""
    name, seed = request.param
    figure = read_figure(name)
    surfaces = [surface_of(figure, f"left_{each}") for each in sorted(LIMBS)]
    fits = [fit_spheres(surface) for surface in surfaces]
    every = [add_limb_spheres(*pair) for pair in zip(surfaces, fits, strict=True)]
    return list(zip(surfaces, fits, every, strict=True)), np.random.default_rng(seed)


def test_edges_enter_by_no_more_than_the_fit_errs(limbs):
    for surface, fitted, every in limbs[0]:
        assert every[: len(fitted)] == fitted
        assert largest_edge_depth(surface, every) <= LARGEST_ERROR + 1e-4
        assert largest_edge_depth(surface, fitted) > 3.0 * LARGEST_ERROR
        assert len(every) <= len(fitted) + 12


def test_heights_on_planes_stay_within_the_error(limbs):
    every_limb, generator = limbs
    directions = generator.normal(size=(4000, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    for surface, fitted, every in every_limb:
        points = surface.vertices[np.unique(surface.corners)]
        extents = (directions @ points.T).max(axis=1)
        reaches = np.array([directions @ one.centre + one.radius for one in every])
        assert np.max(reaches[len(fitted) :] - extents) <= PROTRUSION + 1e-6
        assert np.max(np.abs(reaches.max(axis=0) - extents)) <= LARGEST_ERROR + 1e-4


def test_spheres_of_a_symmetric_limb_are_symmetric(limbs):
    for _, fitted, every in limbs[0]:
        added = every[len(fitted) :]
        assert {(x, -y, z, one.radius) for one in added for x, y, z in [one.centre]} == {
            (*one.centre, one.radius) for one in added
        }


def test_the_depth_between_two_spheres_is_that_of_their_discs():
    """A capsule with spheres along its axis: r - sqrt(r^2 - (gap / 2)^2) between two of them."""
    radius, gap = 0.05, 0.08
    spheres = [ContactSphere((0.0, 0.0, z), radius) for z in np.linspace(-0.24, 0.24, 7)]
    expected = radius - (radius**2 - (0.5 * gap) ** 2) ** 0.5
    found = largest_edge_depth(capsule(radius, 0.24), spheres)
    assert found == pytest.approx(expected, abs=1e-3)
