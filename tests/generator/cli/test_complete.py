"""`mover complete`: what is missing is filled in, what is there stays as it was written."""

import json
import re
import shutil

import numpy as np
import pytest
from typer.testing import CliRunner, Result

from generator import read_figure
from generator.cli.app import app
from generator.figure_file import simulation_diagnostics
from generator.geometry import format_psurf, mass_properties, read_psurf
from generator.geometry.surface import Surface
from tests.bodies import box
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


def mover(*words: object) -> Result:
    """Run the command in this process."""
    return CliRunner().invoke(app, [str(word) for word in words])


@pytest.fixture
def folder(tmp_path):
    """A folder with a brick of 2 x 3 x 4 cm."""
    brick = Surface.from_faces(*box((0, 0, 0), (0.02, 0.03, 0.04)))
    (tmp_path / "brick.pss").write_text(format_psurf(brick))
    return tmp_path


def completed(folder, arm, density="2g/cm3"):
    """The result, the text before and after, and the figure that came of it."""
    path, output = folder / "arm.fig", folder / "out.fig"
    path.write_text(FIGURE.format(arm=arm))
    result = mover("complete", path, "--density", density, "-o", output)
    assert result.exit_code == 0, result.output
    return result, path.read_text(), output.read_text(), read_figure(output)


def test_all_that_is_missing_is_filled_in(folder):
    result, before, after, figure = completed(folder, '    psurf = "brick.pss";  # a brick')
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


def test_ground_needs_no_mass(folder):
    _, _, _, figure = completed(folder, '    psurf = "brick.pss";')
    assert figure.segments["floor"].mass == pytest.approx(-0.001)
    assert figure.segments["floor"].inertia is None


def test_a_mass_that_is_given_is_kept_and_scales_the_inertia(folder):
    _, _, after, figure = completed(folder, '    psurf = "brick.pss"; mass = 96g;')
    arm = figure.segments["arm"]
    assert arm.mass == 0.096
    assert arm.inertia == pytest.approx(0.096 / 12 * np.array([25, 20, 13]) * 1e-4)
    assert "from the psurf for the mass given, 4 g/cm3" in after


def test_an_inertia_and_a_centre_that_are_given_are_kept(folder):
    arm = (
        '    inertia = (9,8,7);\n    psurf = "brick.pss";\n    site CM->location = trans(7cm,0,0);'
    )
    _, _, after, figure = completed(folder, arm)
    assert figure.segments["arm"].inertia == pytest.approx([9e-7, 8e-7, 7e-7])
    assert figure.segments["arm"].centre_of_mass == pytest.approx([0.07, 0, 0])
    assert figure.segments["arm"].mass == pytest.approx(0.048)
    assert after.count("estimated") == 1


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


def test_nothing_missing_is_said_and_the_text_stays(tmp_path):
    output = tmp_path / "same.fig"
    result = mover("complete", "prototype", "--density", "1g/cm3", "-o", output)
    assert result.exit_code == 0
    assert "nothing that a psurf gives was missing" in result.stdout
    assert output.read_bytes() == (FIGURES / "prototype.fig").read_bytes()


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
    result = mover(
        "complete", tmp_path / "bare.fig", "--density", "1.05g/cm3", "-o", output, "--json"
    )
    filled = json.loads(result.stdout)["filled_in"]
    assert len(filled) == 10
    figure, printed = read_figure(output), read_figure("prototype")
    assert list(figure.segments) == list(printed.segments)
    for entry in filled:
        psurf = printed.segments[entry["segment"]].psurf
        expected = mass_properties(read_psurf(FIGURES / psurf), 1050.0)
        segment = figure.segments[entry["segment"]]
        assert segment.mass == pytest.approx(expected.mass, rel=1e-6)
        assert segment.inertia == pytest.approx(np.diag(expected.inertia), rel=1e-6)
        assert segment.centre_of_mass == pytest.approx(expected.centre, abs=1e-7)
    assert "the products of inertia of `left_lower_leg` are left out: up to 37 %" in result.stderr
    assert "has no mass" not in result.stderr


def test_a_segment_without_a_psurf_is_told_and_the_others_are_filled(folder):
    arm = '    psurf = "brick.pss";\n  }\n  segment hand {\n    site near { }'
    path = folder / "two.fig"
    text = FIGURE.format(arm=arm).replace(
        "  root", "  joint w { connect arm.near to hand.near; type = R(1,0,0); }\n  root"
    )
    path.write_text(text)
    result = mover("complete", path, "--density", "2g/cm3", "-o", folder / "out.fig")
    assert result.exit_code == 0
    assert "`hand` lacks `mass` and `inertia` and `CM`, and has no psurf" in result.stderr
    figure = read_figure(folder / "out.fig")
    assert figure.segments["arm"].mass is not None
    assert figure.segments["hand"].mass is None


def test_a_mass_of_zero_is_kept_and_told(folder):
    path = folder / "arm.fig"
    path.write_text(FIGURE.format(arm='    psurf = "brick.pss";\n    mass = 0g;'))
    result = mover("complete", path, "--density", "2g/cm3", "-o", folder / "out.fig")
    assert result.exit_code == 0
    assert "its mass is zero" in result.stderr
    assert (folder / "out.fig").read_text() == path.read_text()


@pytest.mark.parametrize(
    ("psurf", "said"),
    [
        ("none.pss", "cannot be read: no such file"),
        ("open.pss", "the surface is open"),
        ("brick.stl", "give the unit"),
        ("brick.xyz", "not a known suffix"),
    ],
)
def test_a_psurf_that_is_no_body_stops_it_and_nothing_is_written(folder, psurf, said):
    vertices, faces = box()
    (folder / "open.pss").write_text(format_psurf(Surface.from_faces(vertices, faces[1:])))
    path, output = folder / "arm.fig", folder / "out.fig"
    path.write_text(FIGURE.format(arm=f'    psurf = "{psurf}";'))
    result = mover("complete", path, "--density", "2g/cm3", "-o", output)
    assert result.exit_code == 1
    assert said in result.stderr
    assert not output.exists()


def test_ends_of_line_are_kept(folder):
    path, output = folder / "arm.fig", folder / "out.fig"
    text = FIGURE.format(arm='    psurf = "brick.pss";').replace("\n", "\r\n")
    path.write_bytes(text.encode())
    assert mover("complete", path, "--density", "2g/cm3", "-o", output).exit_code == 0
    assert output.read_bytes().count(b"\r\n") == output.read_bytes().count(b"\n")


def test_what_is_complete_stays_as_it_is(folder):
    _, _, once, _ = completed(folder, '    psurf = "brick.pss";')
    again = folder / "again.fig"
    result = mover("complete", folder / "out.fig", "--density", "2g/cm3", "-o", again)
    assert result.exit_code == 0
    assert again.read_text() == once


@pytest.mark.parametrize("output", ["arm.fig", "./arm.fig", "link.fig", "brick.fig"])
def test_what_the_command_reads_is_not_written_over(folder, output):
    path = folder / "arm.fig"
    path.write_text(FIGURE.format(arm='    psurf = "brick.pss";'))
    (folder / "link.fig").symlink_to(path)
    (folder / "brick.fig").symlink_to(folder / "brick.pss")
    before = {file: file.read_bytes() for file in folder.iterdir()}
    result = mover("complete", path, "--density", "2g/cm3", "-o", folder / output)
    assert result.exit_code == 1
    assert "cannot be written: the command reads it" in result.stderr
    assert {file: file.read_bytes() for file in folder.iterdir()} == before


@pytest.mark.parametrize(
    ("output", "said"),
    [
        ("brick.pss", "`.pss` is not a known suffix; a figure file ends in .fig"),
        ("out.txt", "`.txt` is not a known suffix"),
        ("out", "the suffix is missing"),
    ],
)
def test_a_figure_is_written_to_a_figure_file(folder, output, said):
    path, brick = folder / "arm.fig", (folder / "brick.pss").read_bytes()
    path.write_text(FIGURE.format(arm='    psurf = "brick.pss";'))
    result = mover("complete", path, "--density", "2g/cm3", "-o", folder / output)
    assert result.exit_code == 2
    assert said in result.stderr
    assert (folder / "brick.pss").read_bytes() == brick
    assert sorted(file.name for file in folder.iterdir()) == ["arm.fig", "brick.pss"]


def test_what_the_new_file_will_not_find_is_told(tmp_path):
    result = mover("complete", "prototype", "--density", "1g/cm3", "-o", tmp_path / "a.fig")
    assert "the psurfs lie beside" in result.stderr
    assert "prototype.springs.toml" in result.stderr


def test_usage(folder):
    assert mover("complete", "prototype", "--density", "1g/cm3").exit_code == 2
    words = ("complete", "prototype", "-o", folder / "a.fig")
    assert mover(*words).exit_code == 2
    assert mover(*words, "--density", "1").exit_code == 2
    nowhere = folder / "nowhere" / "a.fig"
    result = mover("complete", "prototype", "--density", "1g/cm3", "-o", nowhere)
    assert result.exit_code == 1
    assert "there is no directory" in result.stderr
    assert mover("complete", "prototip", "--density", "1g/cm3", "-o", nowhere).exit_code == 1
