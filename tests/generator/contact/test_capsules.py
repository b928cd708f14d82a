"""Capsules of segments: of the volume and length of a psurf, or between contact spheres."""

from dataclasses import replace
from math import pi

import numpy as np
import pytest

from generator import read_figure
from generator.contact.capsules import fit_capsules
from generator.contact.self_contact import Capsule
from generator.contact.spheres import fit_contact_spheres
from generator.figure import ContactSphere, Figure
from generator.geometry import Surface, write_psurf
from generator.geometry.read import read_segment_surface
from generator.geometry.validate import mass_properties
from tests.bodies import prism
from tests.chains import FREE, body, one_body

PROTOTYPE = read_figure("prototype")


def capsules_of(figure: Figure) -> dict[str, Capsule]:
    return fit_capsules(figure, fit_contact_spheres(figure))


def length(capsule: Capsule) -> float:
    return 2.0 * (float(np.linalg.norm(capsule.half_line)) + capsule.radius)


def volume(capsule: Capsule) -> float:
    straight = 2.0 * float(np.linalg.norm(capsule.half_line))
    return pi * capsule.radius**2 * straight + 4.0 / 3.0 * pi * capsule.radius**3


def with_psurf(folder, vertices, faces) -> Figure:
    write_psurf(Surface.from_faces(vertices, faces), folder / "link.pss")
    link = replace(body("link"), psurf="link.pss")
    return replace(one_body(FREE, segment=link), path=folder / "link.fig")


def test_capsules_of_the_prototype_have_the_volume_and_the_length_of_its_psurfs():
    capsules = capsules_of(PROTOTYPE)
    assert list(capsules) == list(PROTOTYPE.bodies)
    for name, capsule in capsules.items():
        surface = read_segment_surface(PROTOTYPE, PROTOTYPE.segments[name])
        assert volume(capsule) == pytest.approx(mass_properties(surface, 1.0).mass, rel=1e-9)
        axis = np.array(capsule.half_line) / np.linalg.norm(capsule.half_line)
        places = surface.vertices[np.unique(surface.corners)] @ axis
        assert length(capsule) == pytest.approx(float(np.ptp(places)), rel=1e-9)
        middle = 0.5 * (places.min() + places.max())
        assert np.dot(capsule.middle, axis) == pytest.approx(float(middle), abs=1e-12)


def test_limbs_lie_along_their_psurfs_and_the_pelvis_across():
    capsules = capsules_of(PROTOTYPE)
    for name in ("left_upper_leg", "right_lower_arm", "center_torso"):
        half = np.abs(capsules[name].half_line)
        assert half[2] > 0.99 * np.linalg.norm(half)
    half = np.abs(capsules["lower_torso"].half_line)
    assert half[1] > 0.99 * np.linalg.norm(half)


def test_a_round_bar(tmp_path):
    """A prism of many sides with a length far above its radius."""
    angles = np.linspace(0.0, 2.0 * pi, 200, endpoint=False)
    outline = 0.05 * np.column_stack([np.cos(angles), np.sin(angles)])
    capsule = capsules_of(with_psurf(tmp_path, *prism(outline, 1.0)))["link"]
    assert capsule.middle == pytest.approx((0.0, 0.0, 0.5), abs=1e-9)
    assert length(capsule) == pytest.approx(1.0, abs=1e-9)
    assert volume(capsule) == pytest.approx(pi * 0.05**2, rel=1e-3)


def test_a_stout_block_has_the_sphere_of_its_volume(tmp_path):
    """A capsule of its length would be too small."""
    square = 0.1 * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    capsule = capsules_of(with_psurf(tmp_path, *prism(square, 0.22)))["link"]
    assert np.linalg.norm(capsule.half_line) == 0.0
    assert capsule.middle == pytest.approx((0.0, 0.0, 0.11), abs=1e-9)
    assert volume(capsule) == pytest.approx(0.2 * 0.2 * 0.22)


def test_an_open_psurf_has_the_capsule_of_its_spheres(tmp_path):
    square = 0.1 * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    vertices, faces = prism(square, 1.0)
    figure = with_psurf(tmp_path, vertices, faces[1:])
    capsule = capsules_of(figure)["link"]
    spheres = fit_contact_spheres(figure)["link"].spheres
    check_capsule_of_spheres(capsule, spheres)


def test_own_spheres_replace_the_psurf():
    own = tuple(ContactSphere((0.1 * k, 0.0, 0.01 * k * k), 0.02 + 0.01 * k) for k in range(4))
    thigh = replace(PROTOTYPE.segments["left_upper_leg"], contact_spheres=own)
    capsules = capsules_of(PROTOTYPE.with_parts(thigh))
    check_capsule_of_spheres(capsules["left_upper_leg"], own)
    assert capsules["right_upper_leg"] == capsules_of(PROTOTYPE)["right_upper_leg"]


def check_capsule_of_spheres(capsule: Capsule, spheres) -> None:
    centres = np.array([sphere.centre for sphere in spheres])
    longest = max(np.linalg.norm(a - b) for a in centres for b in centres)
    assert 2.0 * np.linalg.norm(capsule.half_line) == pytest.approx(longest)
    ends = [np.array(capsule.middle) + s * np.array(capsule.half_line) for s in (-1.0, 1.0)]
    for end in ends:
        assert min(np.linalg.norm(centres - end, axis=1)) < 1e-12
    assert capsule.radius == pytest.approx(np.mean([sphere.radius for sphere in spheres]))


def test_a_segment_without_spheres_has_no_capsule():
    massless = replace(body("link"), mass=0.0)
    assert capsules_of(one_body(FREE, segment=massless)) == {}
