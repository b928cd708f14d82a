"""`mover person`: the figure of a person and the files beside it."""

import csv
from pathlib import Path

import pytest

from generator.figure_file import read_figure
from generator.model_files.model_files import springs_path
from generator.person.person_files import MADE_BY
from tests.command import Result, answer, mover, run

ME = ("person", "--sex", "female", "--stature", "1.65m", "--mass", "62kg")

BESIDE = ["me.riener.springs.toml", "me.sources.csv", "me.springs.toml", "me_geometry"]
NAMES = ["me.contact.toml", "me.fig", *BESIDE]


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


@pytest.fixture(scope="module")
def me(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A person that is written."""
    path = tmp_path_factory.mktemp("person") / "me.fig"
    run(*ME, "-o", path)
    return path


def test_a_person_is_a_figure_with_springs_surfaces_and_sources(me: Path):
    assert names(me.parent) == NAMES
    figure = read_figure(me)
    assert figure.total_mass == pytest.approx(62.0, abs=1e-9)
    psurfs = [segment.psurf for segment in figure.bodies.values()]
    assert len(psurfs) == 16
    assert {f"me_geometry/{path.name}" for path in (me.parent / "me_geometry").iterdir()} == set(
        psurfs
    )
    assert len(set(psurfs)) == 10


def test_other_commands_take_the_person(me: Path):
    said = answer("describe", me)
    assert (said["sex"], said["stature_m"]) == ("female", 1.65)
    assert said["total_mass_kg"] == pytest.approx(62.0, abs=1e-9)
    assert said["can_be_simulated"]
    assert said["springs"]["origin"] == springs_path(me).name
    assert answer("check", me)["faults"] == []
    assert 0.545 < answer("com", me)["height_over_stature"] < 0.57


def test_the_references_of_the_body_are_cited(me: Path):
    used = {each["reference"]: each["used_for"] for each in answer("cite", me)["references"]}
    (segments,) = (used[name] for name in used if "de Leva" in name and "table 4" in name)
    assert {"mass", "length"} <= set(segments)
    of_springs = [name for name in used if "A. Silder" in name]
    assert of_springs
    assert all("[C1: " in name for name in of_springs), "those of springs are cited once"
    (me.parent / "me.sources.csv").rename(me.parent / "gone.csv")
    found = answer("cite", me)["references"]
    (me.parent / "gone.csv").rename(me.parent / "me.sources.csv")
    assert not any(each["reference"].startswith("de Leva") for each in found)


def test_the_springs_of_the_leg_are_chosen_by_their_name(me: Path):
    own, pair, former = (
        answer("describe", me, *choice)["springs"]
        for choice in ((), ("--springs", "riener"), ("--springs", "coupled"))
    )
    assert [len(one["axes"]) for one in (*own["coupled"], *pair["coupled"])] == [3, 3, 2, 2]
    assert own["joints"].keys() == pair["joints"].keys()
    assert (former["coupled"], former["joints"]) == (own["coupled"], own["joints"])
    result = run("describe", me, "--springs", "coupled")
    assert "warning: springs `coupled` are the default: one law of hip, knee and a" in result.stderr


def test_springs_and_hip_datum_of_a_person(tmp_path: Path):
    path = tmp_path / "me.fig"
    said = run(*ME, "--springs", "coupled", "--hip-datum", "5deg", "-o", path).stdout
    assert "coupled is the default: hip, knee and ankle have one law" in said
    assert "an upright hip is at 5 deg" in said
    assert "\noffsets_deg = [-5, 0, 0]\n" in springs_path(path).read_text(encoding="utf-8")
    said = run(*ME, "--springs", "riener", "-o", tmp_path / "other.fig").stdout
    assert "hip and knee have one law, of Riener & Edrich 1999" in said
    assert not springs_path(tmp_path / "other.fig", "riener").exists()
    assert "riener_edrich" in springs_path(tmp_path / "other.fig").read_text(encoding="utf-8")
    refused = mover(*ME, "--hip-datum", "20deg")
    assert "the hip datum is from 0 to 15 deg, not 20 deg" in refused.stderr


def test_the_table_of_sources_has_a_row_a_number(me: Path):
    first, *lines = (me.parent / "me.sources.csv").read_text(encoding="utf-8").splitlines()
    assert first == "# figure me.fig"
    rows = list(csv.DictReader(lines))
    assert list(rows[0]) == [
        *("part", "quantity", "value", "unit", "origin", "reference", "sureness", "rule")
    ]
    assert all(None not in row and None not in row.values() for row in rows)
    masses = {row["part"]: float(row["value"]) for row in rows if row["quantity"] == "mass"}
    figure = read_figure(me)
    for part, mass in masses.items():
        if part not in ("person", "head"):
            assert mass in [
                segment.mass
                for name, segment in figure.bodies.items()
                if name in (part, f"left_{part}")
            ]
    published = [row for row in rows if row["origin"] == "published"]
    assert published
    assert all(row["reference"] and row["sureness"] for row in published)
    assert all(row["rule"] for row in rows if row["origin"] == "estimate")


def test_the_answer_fits_a_screen_and_says_what_to_do_next(tmp_path: Path):
    path = tmp_path / "my own.fig"
    lines = run(*ME, "-o", path).stdout.splitlines()
    assert len(lines) < 32
    assert lines[0].startswith("female, 1.65 m, 62 kg: 16 segments, ")
    assert sum(line.startswith("wrote ") for line in lines) == 6
    assert f"wrote 10 files in {tmp_path / 'my own_geometry'}" in lines
    assert lines[-1] == f"next: mover simulate '{path}' --floor --stop 2 -o fall.html"
    assert any(line.startswith("springs: ") for line in lines)


def test_the_answer_as_json(tmp_path: Path):
    path = tmp_path / "me.fig"
    said = answer(*ME, "-o", path)
    assert (said["sex"], said["stature_m"]) == ("female", 1.65)
    assert said["total_mass_kg"] == pytest.approx(62.0, abs=1e-9)
    assert len(said["segments"]) == 10
    for segment in said["segments"]:
        assert 300.0 < segment["density_kg_m3"] < 3000.0
    assert {dimension["measured"] for dimension in said["dimensions"]} == {False}
    assert sum(said["springs"].values()) > 0
    assert {Path(file) for file in said["files"]} == {
        file for file in tmp_path.rglob("*") if file.is_file()
    }


def test_without_an_output_the_person_is_only_shown(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.chdir(tmp_path)
    result = run(*ME)
    assert "nothing is written without -o" in result.stdout
    assert names(tmp_path) == []


def test_a_person_without_springs_warns_of_older_ones(tmp_path: Path):
    path = tmp_path / "me.fig"
    result = run(*ME, "--springs", "none", "-o", path)
    assert "springs: none" in result.stdout.splitlines()
    assert names(tmp_path) == ["me.contact.toml", "me.fig", "me.sources.csv", "me_geometry"]
    assert "springs" not in result.stderr
    run(*ME, "-o", path)
    before = springs_path(path).read_bytes()
    result = run(*ME, "--springs", "none", "-o", path)
    assert "warning: an older springs file stands beside the figure" in result.stderr
    assert springs_path(path).read_bytes() == before


def test_a_person_may_be_written_again_but_not_over_other_springs(tmp_path: Path):
    path = tmp_path / "m\u00e9, 2.fig"
    run(*ME, "-o", path)
    run(*ME[:-1], "70kg", "-o", path)
    assert read_figure(path).total_mass == pytest.approx(70.0)
    first = springs_path(path).read_text(encoding="utf-8").partition("\n")[0]
    assert first.endswith(MADE_BY)
    springs_path(path).write_text("mine", encoding="utf-8")
    before = path.read_bytes()
    result = mover(*ME, "-o", path)
    assert result.exit_code == 1
    assert f"`{springs_path(path)}` exists with other springs" in result.stderr
    assert path.read_bytes() == before


def test_the_springs_of_a_person_are_not_replaced_by_those_of_another(tmp_path: Path):
    run(*ME, "-o", tmp_path / "me.fig")
    result = mover(*ME, "-o", tmp_path / "me.riener.fig")
    assert result.exit_code == 1
    assert "me.riener.springs.toml` exists with other springs" in result.stderr
    assert names(tmp_path) == NAMES


def test_measured_dimensions_change_the_person(tmp_path: Path):
    file = tmp_path / "measures.toml"
    file.write_text("foot_length_cm = 26\n", encoding="utf-8")
    said = answer(*ME, "--measures", file)
    measured = [each for each in said["dimensions"] if each["measured"]]
    assert [(each["name"], each["value_m"]) for each in measured] == [("foot_length", 0.26)]
    (foot,) = (each for each in said["segments"] if each["name"] == "foot")
    (plain,) = (each for each in answer(*ME)["segments"] if each["name"] == "foot")
    assert foot["length_m"] > plain["length_m"]


def test_a_person_outside_the_sample_is_a_warning():
    small = (*ME[:4], "1.1m", "--mass", "18kg")
    result = run(*small)
    assert result.stderr.startswith("warning: a stature of 1.1 m is ")
    assert len(answer(*small)["warnings"]) == 2
    assert run(*ME).stderr == ""


def test_a_density_beyond_the_published_ones_is_a_warning():
    heavy = ("person", "--sex", "male", "--stature", "1.60m", "--mass", "120kg")
    result = run(*heavy)
    assert "warning: the foot has 1475 kg/m3, 34% above the published densities" in result.stderr
    assert any(line.startswith("foot ") and line.endswith("+34%") for line in lines_of(result))
    (foot,) = (each for each in answer(*heavy)["segments"] if each["name"] == "foot")
    assert foot["density_excess"] == pytest.approx(0.34, abs=0.01)


@pytest.mark.parametrize(
    ("mass", "sentence"),
    [
        ("90kg", "masses: 0.27 of regressions of Zatsiorsky 2002 on mass and stature, the"),
        ("110kg", "masses: regressions of Zatsiorsky 2002 on mass and stature"),
    ],
)
def test_the_rule_of_the_masses_is_said(mass: str, sentence: str):
    man = ("person", "--sex", "male", "--stature", "1.756m", "--mass", mass)
    assert any(line.startswith(sentence) for line in lines_of(run(*man)))


def lines_of(result: Result) -> list[str]:
    return [line.rstrip() for line in result.stdout.splitlines()]
