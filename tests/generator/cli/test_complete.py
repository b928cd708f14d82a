"""`mover complete`: what is missing is filled in, what is there stays as it was written."""

import json
import re
import shutil

import numpy as np
import pytest

from generator import read_figure
from generator.figure_file import simulation_diagnostics
from generator.geometry import PSURF_FILE, format_psurf, mass_properties
from generator.geometry.surface import Surface
from tests.bodies import box
from tests.command import mover, run
from tests.paths import FIGURES

FIGURE = """\
# my arm
figure {{
  segment floor {{ mass = -1g; psurf = "brick.pss"; site top->location = trans(0cm,0cm,0cm); }}
  segment arm {{
    site near->location = trans(0cm,0cm,0cm);   # here
{arm}
  }}
  joint elbow {{ connect floor.top to arm.near; type = R(0,0,1); }}
  root = floor.top;
}}
"""
BARE = '    psurf = "brick.pss";'
DENSITY = ("--density", "2g/cm3")


@pytest.fixture
def folder(tmp_path):
    """A folder with a brick of 2 x 3 x 4 cm."""
    brick = Surface.from_faces(*box((0, 0, 0), (0.02, 0.03, 0.04)))
    (tmp_path / "brick.pss").write_text(format_psurf(brick))
    return tmp_path


def completed(folder, arm):
    """The result, the text before and after, and the figure that came of it."""
    path, output = folder / "arm.fig", folder / "out.fig"
    path.write_text(FIGURE.format(arm=arm))
    result = run("complete", path, *DENSITY, "-o", output)
    return result, path.read_text(), output.read_text(), read_figure(output)


def test_all_that_is_missing_is_filled_in(folder):
    result, before, after, figure = completed(folder, BARE + "  # a brick")
    arm = figure.segments["arm"]
    assert arm.mass == pytest.approx(0.048)
    assert arm.inertia == pytest.approx(0.048 / 12 * np.array([25, 20, 13]) * 1e-4)
    assert arm.centre_of_mass == pytest.approx([0.01, 0.015, 0.02])
    assert simulation_diagnostics(figure) == ()
    added = [line for line in after.splitlines() if line not in before.splitlines()]
    assert added == [
        "    mass = 48g;  # estimated from the psurf at 2 g/cm3",
        "    inertia = (100,80,52);  # estimated from the psurf at 2 g/cm3",
        "    site CM->location = trans(1cm,1.5cm,2cm);  # estimated from the psurf",
    ]
    assert [line for line in after.splitlines() if line not in added] == before.splitlines()
    assert "arm" in result.stdout
    assert "mass, inertia, CM" in result.stdout
    # The ground needs no mass.
    assert figure.segments["floor"].mass == pytest.approx(-0.001)
    assert figure.segments["floor"].inertia is None
    # A figure that is complete stays as it is.
    again = folder / "again.fig"
    run("complete", folder / "out.fig", *DENSITY, "-o", again)
    assert again.read_text() == after


@pytest.mark.parametrize(
    ("fields", "mass", "inertia", "centre", "estimates"),
    [
        (BARE + " mass = 96g;", 0.096, (200e-7, 160e-7, 104e-7), (0.01, 0.015, 0.02), 2),
        (
            "    inertia = (9,8,7);\n" + BARE + "\n    site CM->location = trans(7cm,0,0);",
            0.048,
            (9e-7, 8e-7, 7e-7),
            (0.07, 0.0, 0.0),
            1,
        ),
    ],
    ids=["mass", "inertia and centre"],
)
def test_a_field_that_is_there_is_kept(folder, fields, mass, inertia, centre, estimates):
    """A mass scales the inertia."""
    _, _, after, figure = completed(folder, fields)
    arm = figure.segments["arm"]
    assert (arm.mass, arm.inertia) == (pytest.approx(mass), pytest.approx(inertia))
    assert arm.centre_of_mass == pytest.approx(centre)
    assert after.count("estimated from the psurf") == estimates
    assert ("from the psurf for the mass given, 4 g/cm3" in after) is (mass == 0.096)


@pytest.mark.parametrize(
    "arm",
    [
        'psurf = "brick.pss"; site CM->location = trans(0,0,0);',
        '    psurf\n    =\n    "brick.pss"\n    ;',
        '    psurf = "brick.pss"; /* a comment that\n    goes on */',
        '    psurf = "brick.pss" /* { ; */ ;  /* whole */',
        '\tpsurf = "brick.pss";\t# tab',
        '    ; psurf = "brick.pss";',
        '    site far->location = trans(0,0,1cm); psurf = "brick.pss"; /* x */ site b { }',
        '    psurf = "brick.pss";site b { }',
    ],
)
def test_statements_go_where_they_are_read_whatever_the_layout(folder, arm):
    _, before, after, figure = completed(folder, arm)
    assert figure.segments["arm"].mass == pytest.approx(0.048)
    assert simulation_diagnostics(figure) == ()
    # All that is put in stands in one place, and the text goes on behind it as it did.
    pairs = enumerate(zip(before, after, strict=False))
    place = next(k for k, (one, other) in pairs if one != other)
    assert after.endswith(before[place:])
    assert after.count("estimated from the psurf") == 3 - before.count("site CM")
    assert read_figure(folder / "arm.fig").joints == figure.joints


def test_a_complete_figure_is_copied_with_a_warning_of_what_the_copy_will_not_find(tmp_path):
    output = tmp_path / "same.fig"
    result = run("complete", "prototype", "--density", "1g/cm3", "-o", output)
    assert "nothing that a psurf gives was missing" in result.stdout
    assert output.read_bytes() == (FIGURES / "prototype.fig").read_bytes()
    assert "the psurfs lie beside" in result.stderr
    assert "prototype.springs.toml" in result.stderr


def test_the_prototype_without_its_masses_gets_them_back_from_its_psurfs(tmp_path):
    for path in FIGURES.glob("*.pss"):
        shutil.copy(path, tmp_path)
    text = (FIGURES / "prototype.fig").read_text(encoding="utf-8")
    lines = [
        line
        for line in text.splitlines(keepends=True)
        if not re.match(r"\s+(mass = [0-9]|inertia|site CM)", line)
    ]
    (tmp_path / "bare.fig").write_text("".join(lines), encoding="utf-8")
    output = tmp_path / "full.fig"
    words = ("--density", "1.05g/cm3", "-o", output, "--json")
    result = run("complete", tmp_path / "bare.fig", *words)
    filled = json.loads(result.stdout)["filled_in"]
    assert len(filled) == 10
    figure, printed = read_figure(output), read_figure("prototype")
    assert list(figure.segments) == list(printed.segments)
    for entry in filled:
        psurf = printed.segments[entry["segment"]].psurf
        expected = mass_properties(PSURF_FILE.read(FIGURES / psurf), 1050.0)
        segment = figure.segments[entry["segment"]]
        assert segment.mass == pytest.approx(expected.mass, rel=1e-6)
        assert segment.inertia == pytest.approx(np.diag(expected.inertia), rel=1e-6)
        assert segment.centre_of_mass == pytest.approx(expected.centre, abs=1e-7)
    assert "the products of inertia of `left_lower_leg` are left out: up to 37 %" in result.stderr
    assert "has no mass" not in result.stderr


def test_a_segment_without_a_psurf_is_reported_and_the_others_are_filled(folder):
    path = folder / "two.fig"
    text = FIGURE.format(arm=BARE + "\n  }\n  segment hand {\n    site near { }").replace(
        "  root", "  joint w { connect arm.near to hand.near; type = R(1,0,0); }\n  root"
    )
    path.write_text(text)
    result = run("complete", path, *DENSITY, "-o", folder / "out.fig")
    assert "`hand` lacks `mass` and `inertia` and `CM`, and has no psurf" in result.stderr
    figure = read_figure(folder / "out.fig")
    assert figure.segments["arm"].mass is not None
    assert figure.segments["hand"].mass is None


def test_a_mass_of_zero_is_kept_and_reported(folder):
    result, before, after, _ = completed(folder, BARE + "\n    mass = 0g;")
    assert "its mass is zero" in result.stderr
    assert after == before


def test_ends_of_line_are_kept(folder):
    path, output = folder / "arm.fig", folder / "out.fig"
    path.write_bytes(FIGURE.format(arm=BARE).replace("\n", "\r\n").encode())
    run("complete", path, *DENSITY, "-o", output)
    assert output.read_bytes().count(b"\r\n") == output.read_bytes().count(b"\n")


@pytest.mark.parametrize("target", ["arm.fig", "brick.pss"])
def test_no_input_is_written_over_through_a_link(folder, target):
    path = folder / "arm.fig"
    path.write_text(FIGURE.format(arm=BARE))
    (folder / "link.fig").symlink_to(folder / target)
    before = {file: file.read_bytes() for file in folder.iterdir()}
    result = mover("complete", path, *DENSITY, "-o", folder / "link.fig")
    assert result.exit_code == 1
    assert "cannot be written: the command reads it" in result.stderr
    assert {file: file.read_bytes() for file in folder.iterdir()} == before
