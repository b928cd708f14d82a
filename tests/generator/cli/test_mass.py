"""`mover mass`: what it prints of a surface, and of the psurf of a segment."""

from pathlib import Path

import numpy as np
import pytest
import trimesh

from generator import read_figure
from generator.figure_file import FIGURE_FILE
from generator.geometry import PSURF_FILE, format_psurf, mass_properties
from generator.geometry.surface import Surface
from tests.bodies import box, inside_out, together
from tests.command import answer, mover, run
from tests.paths import FAULTS, FIGURES

DENSITY = ("--density", "1.05g/cm3")
REFUSED = Path(__file__).parent / "refusals" / "files"
BRICK = REFUSED / "brick.pss"
"""A box of 2 x 3 x 4 cm with a corner at the origin."""


def test_a_brick_is_weighed():
    said = answer("mass", BRICK, "--density", "2g/cm3")
    assert said["volume_m3"] == pytest.approx(24e-6, rel=1e-12)
    assert said["mass_kg"] == pytest.approx(0.048, rel=1e-12)
    assert said["centre_of_mass_m"] == pytest.approx([0.01, 0.015, 0.02], rel=1e-12)
    moments = 0.048 / 12 * np.array([9 + 16, 4 + 16, 4 + 9]) * 1e-4
    assert np.diag(said["inertia_kg_m2"]) == pytest.approx(moments, rel=1e-12)
    assert said["principal_moments_kg_m2"] == pytest.approx(sorted(moments), rel=1e-12)
    assert np.linalg.det(said["principal_axes"]) == pytest.approx(1.0)
    assert (said["closed"], said["winding"], said["unit_m"]) == (True, "outwards", 0.01)
    assert said["density_kg_m3"] == 2000.0


def test_the_inertia_about_a_point_is_asked_for_in_the_unit_of_the_file():
    words = ("mass", BRICK, "--density", "2000kg/m3", "--about")
    inertia = answer(*words, "0,0,0")["about"]["inertia_kg_m2"]
    # A box about its corner: m/3 (b^2 + c^2), and -m/4 a b.
    assert inertia[0][0] == pytest.approx(0.048 / 3 * 25e-4, rel=1e-12)
    assert inertia[0][1] == pytest.approx(-0.048 / 4 * 6e-4, rel=1e-12)
    assert answer(*words, "-100,0,0")["about"]["point_m"] == [-1.0, 0.0, 0.0]


def test_the_report_says_what_was_used():
    said = run("mass", BRICK, *DENSITY, "--about", "1,2,3").stdout
    for words in (
        "1 body, no voids",
        "1050 kg/m^3 (1.05g/cm3)",
        "1 in the file is 0.01 m",
        "signed tetrahedra",
        "closed; 6 faces, all facing outward",
        "volume          2.4e-05 m^3",
        "mass            0.0252 kg",
        "centre of mass  0.01 0.015 0.02 m",
        "inertia about (0.01 0.02 0.03) m",
        "right-handed",
    ):
        assert words in said


@pytest.mark.parametrize("suffix", ["stl", "obj", "ply"])
def test_a_mesh_needs_a_unit(tmp_path, suffix):
    path = tmp_path / f"box.{suffix}"
    trimesh.creation.box((10, 20, 30)).export(path)
    result = mover("mass", path, *DENSITY)
    assert result.exit_code == 1
    assert "give the unit, such as `--unit mm`" in result.stderr
    assert answer("mass", path, *DENSITY, "--unit", "mm")["mass_kg"] == pytest.approx(0.0063)


def test_flipped_faces_are_corrected_and_named():
    words = ("mass", FAULTS / "psurf" / "turned.pss", *DENSITY, "--fix-winding")
    assert "flipped  2 faces: 2 (line 11), 5 (line 14)" in run(*words).stdout
    said = answer(*words)
    assert said["turned_faces"] == [2, 5]
    assert said["volume_m3"] == pytest.approx(1e-6)


def test_a_slightly_bent_face_is_a_warning():
    result = run("mass", FAULTS / "psurf" / "little_bent.pss", *DENSITY)
    assert "warning: face 2 (line 11) is not planar" in result.stderr


def test_voids_and_bodies_are_counted(tmp_path):
    path = tmp_path / "nest.pss"
    body = together(box((0, 0, 0), (3, 3, 3)), inside_out(box((1, 1, 1))), box((5, 0, 0)))
    path.write_text(format_psurf(Surface.from_faces(*body)))
    assert "2 bodies, 1 void\n" in run("mass", path, *DENSITY).stdout
    shells = answer("mass", path, *DENSITY)["shells"]
    assert [(s["first_face"], s["void"]) for s in shells] == [(1, False), (7, True), (13, False)]


def test_the_lines_of_a_segment_can_be_pasted():
    said = run("mass", "--segment", "left_upper_arm", "prototype", *DENSITY).stdout
    assert "left out" not in said
    lines = said.split("for segment `left_upper_arm`\n")[1]
    text = (FIGURES / "prototype.fig").read_text(encoding="utf-8")
    head, begin, rest = text.partition("  segment left_upper_arm {\n")
    block, end, tail = rest.partition("  }\n")
    kept = [line for line in block.splitlines(True) if "psurf" in line or "al->" in line]
    figure = FIGURE_FILE.parse_text(f"{head}{begin}{''.join(kept)}{lines}{end}{tail}").value
    assert figure is not None
    arm = figure.segments["left_upper_arm"]
    expected = mass_properties(PSURF_FILE.read(FIGURES / "euparm.pss"), 1050.0)
    assert arm.mass == pytest.approx(expected.mass, rel=1e-6)
    assert arm.inertia == pytest.approx(np.diag(expected.inertia), rel=1e-6)
    assert arm.centre_of_mass == pytest.approx(expected.centre, abs=1e-7)


def test_products_of_inertia_that_are_left_out_are_noted():
    said = run("mass", "--segment", "left_lower_leg", "prototype", *DENSITY).stdout
    assert "# products of inertia of up to 37 % of the moments are left out:" in said
    assert "turned by 6.8 deg" in said


def test_a_mesh_may_be_the_surface_of_a_segment(tmp_path):
    trimesh.creation.box((20, 30, 40)).export(tmp_path / "brick.stl")
    text = (FIGURES / "pendulum.fig").read_text(encoding="utf-8")
    link, psurf = next((n, s.psurf) for n, s in read_figure("pendulum").segments.items() if s.psurf)
    (tmp_path / "mesh.fig").write_text(text.replace(psurf, "brick.stl"), encoding="utf-8")
    words = ("mass", "--segment", link, tmp_path / "mesh.fig", *DENSITY, "--unit", "mm")
    assert answer(*words)["volume_m3"] == pytest.approx(24e-6)
