"""`mover mass`: what it prints, what it refuses, and with which code."""

import json

import numpy as np
import pytest
import trimesh
from typer.testing import CliRunner, Result

from generator import read_figure
from generator.cli.app import app
from generator.figure_file import parse_figure
from generator.geometry import format_psurf, mass_properties, read_psurf
from generator.geometry.surface import Surface
from tests.bodies import box, inside_out, together
from tests.paths import FAULTS, FIGURES

DENSITY = ("--density", "1.05g/cm3")


def mover(*words: object) -> Result:
    """Run the command in this process."""
    return CliRunner().invoke(app, [str(word) for word in words])


@pytest.fixture
def brick(tmp_path):
    """A box of 2 x 3 x 4 cm with a corner at the origin."""
    path = tmp_path / "brick.pss"
    path.write_text(format_psurf(Surface.from_faces(*box((0, 0, 0), (0.02, 0.03, 0.04)))))
    return path


def test_a_brick_is_weighed(brick):
    said = json.loads(mover("mass", brick, "--density", "2g/cm3", "--json").stdout)
    assert said["volume_m3"] == pytest.approx(24e-6, rel=1e-12)
    assert said["mass_kg"] == pytest.approx(0.048, rel=1e-12)
    assert said["centre_of_mass_m"] == pytest.approx([0.01, 0.015, 0.02], rel=1e-12)
    moments = 0.048 / 12 * np.array([9 + 16, 4 + 16, 4 + 9]) * 1e-4
    assert np.diag(said["inertia_kg_m2"]) == pytest.approx(moments, rel=1e-12)
    assert said["principal_moments_kg_m2"] == pytest.approx(sorted(moments), rel=1e-12)
    assert np.linalg.det(said["principal_axes"]) == pytest.approx(1.0)
    assert (said["closed"], said["winding"], said["unit_m"]) == (True, "outwards", 0.01)
    assert said["density_kg_m3"] == 2000.0


def test_the_inertia_about_a_point_is_asked_for_in_the_files_unit(brick):
    words = ("mass", brick, "--density", "2000kg/m3", "--about", "0,0,0", "--json")
    about = json.loads(mover(*words).stdout)["about"]
    # A box about its corner: m/3 (b^2 + c^2), and -m/4 a b.
    assert about["inertia_kg_m2"][0][0] == pytest.approx(0.048 / 3 * 25e-4, rel=1e-12)
    assert about["inertia_kg_m2"][0][1] == pytest.approx(-0.048 / 4 * 6e-4, rel=1e-12)
    far = json.loads(mover(*words[:4], "--about", "-100,0,0", "--json").stdout)["about"]
    assert far["point_m"] == [-1.0, 0.0, 0.0]


def test_the_report_says_what_was_used(brick):
    result = mover("mass", brick, *DENSITY, "--about", "1,2,3")
    assert result.exit_code == 0
    for word in (
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
        assert word in result.stdout


@pytest.mark.parametrize("suffix", ["stl", "obj", "ply"])
def test_a_mesh_without_a_unit_is_refused(tmp_path, suffix):
    path = tmp_path / f"box.{suffix}"
    trimesh.creation.box((10, 20, 30)).export(path)
    result = mover("mass", path, *DENSITY)
    assert result.exit_code == 1
    assert "give the unit, such as `--unit mm`" in result.stderr
    said = json.loads(mover("mass", path, *DENSITY, "--unit", "mm", "--json").stdout)
    assert said["mass_kg"] == pytest.approx(0.0063)


@pytest.mark.parametrize(
    ("name", "sentence"),
    [
        ("open", "the surface is open: 4 edges belong to one face only: 1-2, 2-3, 3-4, 4-1"),
        ("inside_out", "the surface is inside out: its faces point inwards, and its volume is -1e"),
        ("turned", "faces 2 (line 11), 5 (line 14) are flipped"),
        ("edge_of_four", "touches itself: edges belong to more than two faces: 3-7 to 4"),
        ("not_planar", "face 2 (line 11) is not planar"),
        ("void_outwards", "its volume would count twice"),
        ("cutting", "intersect each other"),
        ("one_side", "the surface is one-sided"),
        ("flat", "the surface encloses no volume"),
        ("faces", "there is no vertex 9"),
    ],
)  # fmt: skip
def test_what_is_no_body_has_its_sentence_and_exit_code_one(name, sentence):
    result = mover("mass", FAULTS / "psurf" / f"{name}.pss", *DENSITY)
    assert result.exit_code == 1
    assert result.stdout == ""
    assert sentence in result.stderr


def test_faults_are_told_to_programs_as_well():
    result = mover("mass", FAULTS / "psurf" / "turned.pss", *DENSITY, "--json")
    (fault,) = json.loads(result.stdout)["faults"]
    assert (fault["line"], fault["severity"]) == (11, "error")


def test_turned_faces_are_mended_and_named():
    result = mover("mass", FAULTS / "psurf" / "turned.pss", *DENSITY, "--fix-winding")
    assert result.exit_code == 0
    assert "flipped  2 faces: 2 (line 11), 5 (line 14)" in result.stdout
    said = json.loads(
        mover("mass", FAULTS / "psurf" / "turned.pss", *DENSITY, "--fix-winding", "--json").stdout
    )
    assert said["turned_faces"] == [2, 5]
    assert said["volume_m3"] == pytest.approx(1e-6)


def test_an_open_surface_is_not_mended():
    result = mover("mass", FAULTS / "psurf" / "open.pss", *DENSITY, "--fix-winding")
    assert result.exit_code == 1


def test_a_face_a_little_bent_is_a_warning():
    result = mover("mass", FAULTS / "psurf" / "little_bent.pss", *DENSITY)
    assert result.exit_code == 0
    assert "warning: face 2 (line 11) is not planar" in result.stderr


def test_voids_and_bodies_are_counted(tmp_path):
    path = tmp_path / "nest.pss"
    body = together(box((0, 0, 0), (3, 3, 3)), inside_out(box((1, 1, 1))), box((5, 0, 0)))
    path.write_text(format_psurf(Surface.from_faces(*body)))
    assert "2 bodies, 1 void\n" in mover("mass", path, *DENSITY).stdout
    shells = json.loads(mover("mass", path, *DENSITY, "--json").stdout)["shells"]
    assert [(s["first_face"], s["void"]) for s in shells] == [(1, False), (7, True), (13, False)]


# --segment


def test_the_lines_of_a_segment_can_be_pasted(tmp_path):
    result = mover("mass", "--segment", "left_upper_arm", "prototype", *DENSITY)
    assert result.exit_code == 0
    lines = result.stdout.split("for segment `left_upper_arm`\n")[1]
    text = (FIGURES / "prototype.fig").read_text(encoding="utf-8")
    head, begin, rest = text.partition("  segment left_upper_arm {\n")
    block, end, tail = rest.partition("  }\n")
    kept = [line for line in block.splitlines(True) if "psurf" in line or "al->" in line]
    figure = parse_figure(f"{head}{begin}{''.join(kept)}{lines}{end}{tail}").value
    assert figure is not None
    arm = figure.segments["left_upper_arm"]
    expected = mass_properties(read_psurf(FIGURES / "euparm.pss"), 1050.0)
    assert arm.mass == pytest.approx(expected.mass, rel=1e-6)
    assert arm.inertia == pytest.approx(np.diag(expected.inertia), rel=1e-6)
    assert arm.centre_of_mass == pytest.approx(expected.centre, abs=1e-7)


def test_products_of_inertia_that_are_left_out_are_told():
    leg = mover("mass", "--segment", "left_lower_leg", "prototype", *DENSITY)
    assert "# products of inertia of up to 37 % of the moments are left out:" in leg.stdout
    assert "turned by 6.8 deg" in leg.stdout
    arm = mover("mass", "--segment", "left_upper_arm", "prototype", *DENSITY)
    assert "left out" not in arm.stdout


def test_a_segment_that_is_not_there_or_has_no_psurf(tmp_path):
    result = mover("mass", "--segment", "left_uper_arm", "prototype", *DENSITY)
    assert result.exit_code == 2
    assert "did you mean `left_upper_arm`?" in result.stderr
    result = mover("mass", "--segment", "body_root", "prototype", *DENSITY)
    assert result.exit_code == 1
    assert "`body_root` has no psurf" in result.stderr


def test_a_segments_psurf_lies_beside_its_figure(tmp_path):
    text = (FIGURES / "pendulum.fig").read_text(encoding="utf-8")
    (tmp_path / "alone.fig").write_text(text, encoding="utf-8")
    link = next(name for name, s in read_figure("pendulum").segments.items() if s.psurf)
    result = mover("mass", "--segment", link, tmp_path / "alone.fig", *DENSITY)
    assert result.exit_code == 1
    assert "cannot be read: no such file" in result.stderr


# Options


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--density", "1.05"), "the unit is missing; give one of g/cm3, kg/m3"),
        (("--density", "1.05g"), "`g` is not a unit of a density"),
        (("--density", "1.05 g/cm9"), "unknown unit `cm9`"),
        (("--density", "heavy"), "expected a density such as 1.05g/cm3"),
        (("--density", "0g/cm3"), "a density is at least 1e-06 kg/m3"),
        (("--density", "-1g/cm3"), "a density is at least 1e-06 kg/m3"),
        (("--density", "1e-300g/cm3"), "a density is at least 1e-06 kg/m3"),
        (("--density", "1e999g/cm3"), "a density is at most 1e6 kg/m3"),
        (("--density", "1e4g/cm3"), "a density is at most 1e6 kg/m3"),
        (("--density", "1e308kg/m3", "--unit", "ft"), "--density 1e308kg/m3: "),
        ((*DENSITY, "--unit", "kg"), "`kg` is not a unit of a length"),
        ((*DENSITY, "--unit", "furlong"), "unknown unit `furlong`"),
        ((*DENSITY, "--about", "1,2"), "expected three numbers, X,Y,Z"),
        ((*DENSITY, "--about", "1,2,nan"), "must be finite"),
        ((*DENSITY, "--about", "1e300,0,0"), "the numbers must be at most 1e+09"),
    ],
)
def test_options_that_say_nothing_are_a_matter_of_usage(tmp_path, words, said):
    path = tmp_path / "big.pss"
    path.write_text(format_psurf(Surface.from_faces(*box((0, 0, 0), (10, 10, 10)))))
    result = mover("mass", path, *words)
    assert result.exit_code == 2
    assert said in result.stderr


def test_the_psurf_of_a_segment_has_the_unit_of_psurfs():
    words = ("mass", "--segment", "left_lower_leg", "prototype", *DENSITY, "--unit", "mm")
    result = mover(*words)
    assert result.exit_code == 2
    assert "--unit mm: `ecalf.pss` is in cm" in result.stderr


def test_a_mesh_may_be_the_surface_of_a_segment(tmp_path):
    trimesh.creation.box((20, 30, 40)).export(tmp_path / "brick.stl")
    text = (FIGURES / "pendulum.fig").read_text(encoding="utf-8")
    link, psurf = next((n, s.psurf) for n, s in read_figure("pendulum").segments.items() if s.psurf)
    (tmp_path / "mesh.fig").write_text(text.replace(psurf, "brick.stl"), encoding="utf-8")
    words = ("mass", "--segment", link, tmp_path / "mesh.fig", *DENSITY, "--unit", "mm", "--json")
    assert json.loads(mover(*words).stdout)["volume_m3"] == pytest.approx(24e-6)


def test_a_far_point_is_weighed_with_finite_numbers(brick):
    words = ("mass", brick, "--density", "1e6kg/m3", "--about", "1e9,0,0", "--json")
    about = json.loads(mover(*words).stdout)["about"]
    assert about["inertia_kg_m2"][1][1] == pytest.approx(24.0 * 1e14)


def test_a_density_must_be_given(brick):
    assert mover("mass", brick).exit_code == 2


def test_a_file_that_is_not_there():
    result = mover("mass", "none.pss", *DENSITY)
    assert result.exit_code == 1
    assert "`none.pss` cannot be read: no such file or directory" in result.stderr
