"""Contact spheres: extents of the psurf, own spheres, capsules, and overlaps of segments."""

from dataclasses import replace
from math import pi
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from generator.contact.record import Overlap
from generator.contact.spheres import (
    LARGEST_ERROR,
    MAX_SPHERES,
    MIN_RADIUS,
    SegmentSpheres,
    SphereSource,
    deepest_overlap,
    fit_contact_spheres,
)
from generator.diagnostics import InputError
from generator.figure import ContactSphere, Figure, Location, Segment, Site
from generator.figure_file import FIGURE_FILE, read_figure
from generator.geometry import PSURF_FILE, Surface, write_psurf
from generator.rotations import Array, matrix_from_xyz
from tests.paths import FIGURES

WATER = 1000.0
PROTOTYPE = read_figure("prototype")

TEXT = """figure {
  segment floor { mass = -1g; site top->location = trans(0,0,0); }
  segment link {
    mass = 1kg; inertia = (1,1,1);
    site near->location = trans(0,0,0); site CM->location = trans(10cm,0,0);
  }
  segment end {
    mass = 500g; inertia = (1,1,1);
    site near->location = trans(0,0,0); site CM->location = trans(0,5cm,0);
  }
  joint one { connect floor.top to link.near; type = R(0,0,1); }
  joint two { connect link.CM to end.near; type = R(0,0,1); }
  root = floor.top;
}
"""


def chain() -> Figure:
    figure = FIGURE_FILE.parse_text(TEXT).value
    assert figure is not None
    return figure


def with_points(points: Array, folder: Path) -> Figure:
    """The chain, its link with a psurf that has a face over the first points and each other."""
    rows = np.asarray(points, float)
    faces = [(0, 1, max(k, 2)) for k in range(2, len(rows))]
    write_psurf(Surface.from_faces(rows, faces), folder / "link.pss")
    link = replace(chain().segments["link"], psurf="link.pss")
    return replace(chain().with_parts(link), path=folder / "chain.fig")


def table(fit: SegmentSpheres) -> Array:
    return np.array([(*sphere.centre, sphere.radius) for sphere in fit.spheres])


def random_directions(count: int = 20_000) -> Array:
    rows = np.random.default_rng(1).normal(size=(count, 3))
    return rows / np.linalg.norm(rows, axis=1)[:, None]


def heights(fit: SegmentSpheres, directions: Array) -> Array:
    """Extents of the spheres, from their definition."""
    rows = table(fit)
    return (directions @ rows[:, :3].T + rows[:, 3]).max(axis=1)


def test_the_prototype_lies_at_the_height_of_its_psurfs():
    directions = random_directions()
    for name, fit in fit_contact_spheres(PROTOTYPE).items():
        assert fit.source is SphereSource.FITTED
        psurf = PROTOTYPE.segments[name].psurf
        assert psurf
        vertices = PSURF_FILE.read(FIGURES / psurf).vertices
        error = np.abs(heights(fit, directions) - (vertices @ directions.T).max(axis=0)).max()
        assert fit.largest_error is not None
        assert fit.largest_error <= LARGEST_ERROR
        assert error == pytest.approx(fit.largest_error, rel=0.15)
        assert len(fit.spheres) < MAX_SPHERES


def test_left_and_right_are_equal():
    fits = fit_contact_spheres(PROTOTYPE)
    left = [name for name in fits if name.startswith("left")]
    assert len(left) == 4
    for name in left:
        assert fits[name] == fits[name.replace("left", "right")]


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("psurf", ["ecalf.pss", "elowarm.pss", "echest.pss"])
def test_a_mirrored_segment_has_the_mirrored_spheres(psurf: str, axis: int, tmp_path: Path):
    signs = np.where(np.arange(3) == axis, -1.0, 1.0)
    vertices = PSURF_FILE.read(FIGURES / psurf).vertices
    here, there = (
        fit_contact_spheres(with_points(vertices * flip, tmp_path))["link"]
        for flip in (np.ones(3), signs)
    )
    directions = random_directions()
    assert there.largest_error == pytest.approx(here.largest_error)
    assert np.abs(heights(here, directions) - heights(there, directions * signs)).max() < 1e-3


CENTRES = st.tuples(*[st.floats(-0.3, 0.3)] * 3)


@settings(max_examples=15, deadline=None)
@given(centre=CENTRES, radius=st.floats(0.02, 0.2), angles=CENTRES)
def test_points_on_a_sphere_have_this_sphere(
    centre: tuple[float, float, float],
    radius: float,
    angles: tuple[float, float, float],
    tmp_path_factory: pytest.TempPathFactory,
):
    surface = random_directions(600) @ matrix_from_xyz(*angles).T * radius + centre
    fit = fit_contact_spheres(with_points(surface, tmp_path_factory.mktemp("ball")))["link"]
    assert len(fit.spheres) == 1
    assert table(fit)[0] == pytest.approx((*centre, radius), abs=0.03 * radius)


@pytest.mark.parametrize(
    "corners",
    [
        [(0, 0, 0), (0.5, 0, 0), (0.5, 0.2, 0), (0, 0.2, 0)],
        [(x, y, z) for x in (0, 0.3) for y in (0, 0.4) for z in (0, 0.5)],
        [(0, 0, 0), (0.3, 0, 0), (0.6, 0, 0)],
    ],
    ids=["plate", "box", "line"],
)
def test_corners_have_a_small_sphere_each(corners: list[tuple[float, ...]], tmp_path: Path):
    fit = fit_contact_spheres(with_points(np.array(corners), tmp_path))["link"]
    assert 2 <= len(fit.spheres) <= len(corners)
    assert fit.largest_error is not None
    assert fit.largest_error < LARGEST_ERROR
    assert table(fit)[:, 3].min() >= MIN_RADIUS


def test_vertices_of_no_face_are_left_out(tmp_path: Path):
    corners = [(x, y, z) for x in (0, 0.3) for y in (0, 0.4) for z in (0, 0.5)]
    plain = fit_contact_spheres(with_points(np.array(corners), tmp_path))["link"]
    surface = PSURF_FILE.read(tmp_path / "link.pss")
    stray = replace(surface, vertices=np.vstack([surface.vertices, [9.0, 9.0, 9.0]]), text=None)
    write_psurf(stray, tmp_path / "link.pss")
    link = replace(chain().segments["link"], psurf="link.pss")
    figure = replace(chain().with_parts(link), path=tmp_path / "chain.fig")
    assert fit_contact_spheres(figure)["link"] == plain


def test_own_spheres_replace_the_fit_and_are_measured():
    low = PROTOTYPE.segments["lower_torso"]
    fitted = fit_contact_spheres(PROTOTYPE)["lower_torso"]
    figure = PROTOTYPE.with_parts(replace(low, contact_spheres=fitted.spheres))
    found = fit_contact_spheres(figure)["lower_torso"]
    assert found == replace(fitted, source=SphereSource.OWN)
    high = tuple(replace(each, radius=each.radius + 0.05) for each in fitted.spheres)
    found = fit_contact_spheres(PROTOTYPE.with_parts(replace(low, contact_spheres=high)))
    error = found["lower_torso"].largest_error
    assert error is not None
    assert fitted.largest_error is not None
    assert abs(error - 0.05) < fitted.largest_error + 1e-9


def test_psurfs_that_cannot_be_read_are_errors_unless_the_spheres_are_own(tmp_path: Path):
    figure = replace(PROTOTYPE, path=tmp_path / "prototype.fig")
    with pytest.raises(InputError) as caught:
        fit_contact_spheres(figure)
    assert len(caught.value.diagnostics) == len(PROTOTYPE.bodies)
    own = (ContactSphere((0.0, 0.0, 0.0), 0.1),)
    figure = figure.with_parts(
        *(replace(each, contact_spheres=own) for each in figure.bodies.values())
    )
    fits = fit_contact_spheres(figure)
    assert set(fits.values()) == {SegmentSpheres(own, None, SphereSource.OWN)}


def volume(fit: SegmentSpheres, length: float) -> float:
    """Of the capsule with the radius of the spheres [m^3]."""
    (radius,) = {sphere.radius for sphere in fit.spheres}
    return pi * radius**2 * length + 4.0 / 3.0 * pi * radius**3


def test_a_segment_without_psurf_has_the_spheres_of_a_capsule_of_water():
    fits = fit_contact_spheres(chain())
    assert {fit.source for fit in fits.values()} == {SphereSource.CAPSULE}
    assert {fit.largest_error for fit in fits.values()} == {None}
    # link: joints at 0 and at its centre of mass, 10 cm away; end: as far beyond as before
    assert volume(fits["link"], 0.1) == pytest.approx(1.0 / WATER)
    assert volume(fits["end"], 0.1) == pytest.approx(0.5 / WATER)
    assert {each.centre for each in fits["link"].spheres} == {(0.0, 0.0, 0.0), (0.1, 0.0, 0.0)}
    beyond = {(0.0, 0.0, 0.0), (0.0, 0.05, 0.0), (0.0, 0.1, 0.0)}
    assert {each.centre for each in fits["end"].spheres} == beyond


@pytest.mark.parametrize("change", [{"mass": None}, {"sites": {"near": Site("near")}}])
def test_a_segment_without_psurf_or_mass_has_no_spheres(change: dict[str, object]):
    end = replace(chain().segments["end"], **change)
    found = fit_contact_spheres(chain().with_parts(end))["end"]
    assert found == SegmentSpheres((), None, SphereSource.NONE)


def moved(*places: tuple[float, float, float]) -> Array:
    poses = np.tile(np.eye(4), (len(places), 1, 1))
    poses[:, :3, 3] = places
    return poses


TIMES = np.array([0.0, 0.1])


def three_balls() -> Figure:
    """A chain of three segments, with a ball of radius 10 cm at the origin of each."""
    figure = chain()
    tip = Segment("tip", 1.0, (1.0, 1.0, 1.0), sites={"a": Site("a", Location.at(0, 0, 0))})
    joint = replace(figure.joints["two"], name="three")
    joint = replace(
        joint,
        parent=replace(joint.parent, segment="end", site="CM"),
        child=replace(joint.child, segment="tip", site="a"),
    )
    ball = (ContactSphere((0.0, 0.0, 0.0), 0.1),)
    figure = replace(figure.with_parts(tip), joints={**figure.joints, "three": joint})
    return figure.with_parts(
        *(replace(each, contact_spheres=ball) for each in figure.bodies.values())
    )


def own_spheres(figure: Figure) -> dict[str, tuple[ContactSphere, ...]]:
    return {name: segment.contact_spheres for name, segment in figure.bodies.items()}


def test_the_deepest_overlap_is_of_segments_without_a_common_joint():
    figure = three_balls()
    spheres = own_spheres(figure)
    poses = {
        "link": moved((0, 0, 0), (0, 0, 0), (0, 0, 0)),
        "end": moved((0, 0, 0), (0, 0, 0), (0, 0, 0)),
        "tip": moved((0.5, 0, 0), (0.1, 0.1, 0), (0.15, 0, 0)),
    }
    deepest = deepest_overlap(spheres, poses, figure, np.array([0.0, 0.1, 0.2]))
    assert deepest == Overlap(pytest.approx(0.2 - 0.1 * 2**0.5), "link", "tip", 0.1)


def test_the_overlap_at_the_start_is_subtracted():
    figure = three_balls()
    spheres = own_spheres(figure)
    still = moved((0, 0, 0), (0, 0, 0))
    poses = {"link": still, "end": still, "tip": moved((0.15, 0, 0), (0.12, 0, 0))}
    deepest = deepest_overlap(spheres, poses, figure, TIMES)
    assert deepest == Overlap(pytest.approx(0.03), "link", "tip", 0.1)
    poses["tip"] = moved((0.12, 0, 0), (0.15, 0, 0))
    assert deepest_overlap(spheres, poses, figure, TIMES) is None


@given(angles=CENTRES, shift=CENTRES)
def test_the_overlap_does_not_depend_on_the_frame_of_the_world(
    angles: tuple[float, float, float], shift: tuple[float, float, float]
):
    figure = three_balls()
    two = (ContactSphere((0.1, 0.0, 0.05), 0.1), ContactSphere((0.0, -0.1, 0.0), 0.05))
    figure = figure.with_parts(replace(figure.segments["tip"], contact_spheres=two))
    spheres = own_spheres(figure)
    poses = {"link": moved((0, 0, 0), (0, 0, 0)), "tip": moved((0.5, 0, 0), (0.0, 0.1, 0.0))}
    world = np.eye(4)
    world[:3, :3], world[:3, 3] = matrix_from_xyz(*angles), shift
    turned = {name: world @ each for name, each in poses.items()}
    one, other = (deepest_overlap(spheres, each, figure, TIMES) for each in (poses, turned))
    assert one is not None
    assert other is not None
    assert other.depth == pytest.approx(one.depth)
    assert one.depth > 0.1
