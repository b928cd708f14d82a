"""`mover cite` of published tables, and of figures whose springs take them."""

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

from generator.cli.app import app
from generator.figure_file import shipped_figures
from springs.published.tables import coupled_law, curve, publication, publications
from tests.paths import FIGURES


def mover(*words: object) -> Result:
    """Run the command in this process."""
    return CliRunner().invoke(app, [str(word) for word in words])


def test_all_tables_are_listed_with_their_references():
    plain, said = mover("cite", "tables"), json.loads(mover("cite", "tables", "--json").stdout)
    assert plain.exit_code == 0
    assert [one["table"] for one in said["tables"]] == list(publications())
    for name in publications():
        assert str(publication(name).reference) in plain.stdout


@pytest.mark.parametrize("name", publications())
def test_every_table_and_every_row_can_be_cited(name: str):
    said = json.loads(mover("cite", name, "--json").stdout)
    table = publication(name)
    assert [row["row"] for row in said["rows"]] == [
        f"{name}/{row}" for row in (*table.curves, *table.coupled_laws)
    ]
    for row in said["rows"]:
        one = mover("cite", row["row"])
        assert one.exit_code == 0
        assert row["formula"] in one.stdout
        assert json.loads(mover("cite", row["row"], "--json").stdout) == row


def test_a_row_tells_its_place_its_range_and_what_was_held():
    plain = mover("cite", "silder_2007/hip_knee_15").stdout
    assert str(curve("silder_2007/hip_knee_15").reference) in plain
    assert "measured -15 .. 80 deg" in plain
    assert "knee 15 deg" in plain
    leg = json.loads(mover("cite", "riener_edrich_1999/leg", "--json").stdout)
    assert leg["doi"] == coupled_law("riener_edrich_1999/leg").reference.doi
    assert leg["sureness"] == "C2"
    assert leg["range_is_measured"] is False
    assert leg["range_deg"][0] == pytest.approx([-15.0, 100.0])


@pytest.mark.parametrize(
    ("row", "turned"),
    [
        (
            "riener_edrich_1999/leg",
            "angle and moment, so that both are positive in ankle dorsiflexion",
        ),
        ("anderson_1999/knee", "angle and moment, so that positive is knee flexion"),
        (
            "anderson_madigan_nussbaum_2007/knee_male_18_25",
            "moment, so that positive is knee flexion",
        ),
        ("silder_2007/leg", ""),
    ],
)
def test_what_is_printed_in_another_sense_is_told(row: str, turned: str):
    plain = mover("cite", row).stdout
    assert ("turned here" in plain) is bool(turned)
    assert turned in plain
    assert json.loads(mover("cite", row, "--json").stdout)["turned"] == turned


def test_an_equation_is_not_digitised():
    leg = json.loads(mover("cite", "silder_2007/leg", "--json").stdout)
    assert leg["place"] == "the equations, with the mean parameters of the subjects"
    points = json.loads(mover("cite", "silder_2007/hip_knee_15", "--json").stdout)
    assert points["place"] == "digitised from the published curves"


@pytest.mark.parametrize(
    ("figure", "used"),
    [
        ("prototype", ["the figure language", "the laws of joints", "the prototype figure"]),
        (
            "pendulum",
            ["the figure language", "the laws of joints", "the pendulum of its figure 3.4"],
        ),
        ("fourbar", ["the figure language"]),
    ],
)
def test_what_of_a_figure_is_the_thesis_s(figure: str, used: list[str]):
    said = json.loads(mover("cite", figure, "--json").stdout)
    assert said["references"][0]["used_for"] == used


def test_a_figure_of_a_shipped_name_is_not_the_shipped_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    bars = shipped_figures()["fourbar"].read_text(encoding="utf-8")
    (tmp_path / "prototype").write_text(bars, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    said = json.loads(mover("cite", "prototype", "--json").stdout)
    assert said["references"][0]["used_for"] == ["the figure language"]


@pytest.mark.parametrize(
    ("name", "hint"),
    [
        ("riener_1999", "did you mean `riener_edrich_1999`?"),
        ("saul_2015/elbow_flexoin", "did you mean `saul_2015/elbow_flexion`?"),
        ("prototyp", "did you mean `prototype`?"),
        ("table", "did you mean `tables`?"),
    ],
)
def test_a_name_that_is_neither_figure_nor_table(name: str, hint: str):
    result = mover("cite", name)
    assert result.exit_code == 1
    assert f"there is no file `{name}`, no shipped figure and no published table" in result.stderr
    assert hint in result.stderr


def test_a_name_longer_than_any_files():
    result = mover("cite", "x" * 5000)
    assert result.exit_code == 1
    assert "Traceback" not in result.output


def test_springs_of_a_table_are_wrong_usage():
    assert mover("cite", "saul_2015", "--springs", "none").exit_code == 2


def test_a_figure_of_a_tables_name_goes_first(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    pendulum = FIGURES / "pendulum.fig"
    (tmp_path / "tables").write_text(pendulum.read_text(encoding="utf-8"), encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    assert mover("cite", "tables").stdout.startswith("E. M. Otani")


def test_a_figure_cites_the_tables_of_its_coupled_laws():
    said = json.loads(mover("cite", "prototype", "--springs", "coupled", "--json").stdout)
    used = {one["reference"]: one["used_for"] for one in said["references"]}
    reference = str(coupled_law("riener_edrich_1999/leg").reference)
    assert used[reference] == [
        "left_hip_joint y with left_knee -y",
        "right_hip_joint y with right_knee -y",
    ]
    assert "doi:10.1016/S0021-9290(99)00009-3 [C2: " in reference
