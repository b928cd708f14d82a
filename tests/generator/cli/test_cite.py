"""`mover cite` of published tables, and of figures whose springs take them."""

from pathlib import Path

import pytest

from generator.figure_file import FIGURE_FILE
from generator.model import contact_of_figure
from springs.published.tables import coupled_law, curve, publication, publications
from springs.strength.strengths import strength_rows
from tests.command import answer, mover, run
from tests.paths import FIGURES


def test_all_tables_are_listed_with_their_references():
    plain, said = run("cite", "tables"), answer("cite", "tables")
    assert [one["table"] for one in said["tables"]] == list(publications())
    for name in publications():
        assert str(publication(name).reference) in plain.stdout


@pytest.mark.parametrize("name", publications())
def test_every_table_and_its_rows_can_be_cited(name: str):
    said = answer("cite", name)
    table = publication(name)
    assert [row["row"] for row in said["rows"]] == [
        f"{name}/{row}" for row in (*table.curves, *table.coupled_laws)
    ]
    for row in said["rows"][-1:]:
        assert row["formula"] in run("cite", row["row"]).stdout
        assert answer("cite", row["row"]) == row


def test_a_row_tells_its_place_its_range_and_what_was_held():
    plain = run("cite", "silder_2007/hip_knee_15").stdout
    assert str(curve("silder_2007/hip_knee_15").reference) in plain
    assert "measured -15 .. 80 deg" in plain
    assert "knee 15 deg" in plain
    assert "20 living subjects" in plain
    assert "2.5 N m, error of the models fitted to single subjects" in plain
    leg = answer("cite", "riener_edrich_1999/leg")
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
    plain = run("cite", row).stdout
    assert ("turned here" in plain) is bool(turned)
    assert turned in plain
    assert answer("cite", row)["turned"] == turned


def test_an_equation_is_not_digitised():
    leg = answer("cite", "silder_2007/leg")
    assert leg["place"] == "the equations, with the mean parameters of the subjects"
    points = answer("cite", "silder_2007/hip_knee_15")
    assert points["place"].startswith("digitised from the published curves at each degree")
    assert (points["subjects"], points["rms_error_Nm"]) == (20, 2.5)


def test_a_figure_cites_the_thesis_and_its_springs():
    said = answer("cite", "prototype")["references"]
    texts = [entry["reference"] for entry in said]
    assert texts[0].startswith("E. M. Otani")
    assert any("Engin" in text for text in texts)
    assert len(set(texts)) == len(texts)
    assert sum("left_knee -y" in entry["used_for"] for entry in said) == 1
    plain = run("cite", "prototype").stdout
    assert all(text in plain for text in texts)


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
    assert answer("cite", figure)["references"][0]["used_for"] == used


def test_a_figure_of_a_shipped_name_is_not_the_shipped_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    bars = FIGURE_FILE.shipped()["fourbar"].read_text(encoding="utf-8")
    (tmp_path / "prototype").write_text(bars, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    (reference,) = answer("cite", "prototype")["references"]
    assert reference["used_for"] == ["the figure language"]


def test_a_name_longer_than_any_files():
    result = mover("cite", "x" * 5000)
    assert result.exit_code == 1
    assert "Traceback" not in result.output


def test_a_figure_of_a_tables_name_goes_first(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    pendulum = FIGURES / "pendulum.fig"
    (tmp_path / "tables").write_text(pendulum.read_text(encoding="utf-8"), encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    assert run("cite", "tables").stdout.startswith("E. M. Otani")


def test_a_figure_cites_the_tables_of_its_coupled_laws():
    said = answer("cite", "prototype", "--springs", "coupled")
    used = {one["reference"]: one["used_for"] for one in said["references"]}
    reference = str(coupled_law("riener_edrich_1999/leg").reference)
    assert used[reference] == [
        "left_hip_joint y with left_knee -y",
        "right_hip_joint y with right_knee -y",
    ]
    assert "doi:10.1016/S0021-9290(99)00009-3 [C2: " in reference


def test_strengths_are_cited_with_their_classes():
    said, plain = answer("cite", "strengths"), run("cite", "strengths").stdout
    rows = {row["motion"]: row for row in said["strengths"]}
    assert len(rows) == len(strength_rows())
    assert rows["knee flexion"]["class"] == "published"
    assert "Anderson" in rows["knee flexion"]["reference"]
    assert rows["lumbar flexion"]["reference"] is None
    assert said["women_factor"] == 0.6
    assert "knee flexion, extension: 0.087, 0.163 m g H; of women 0.08, 0.159\n" in plain
    assert "lumbar twist: 80, 80 N m\n  estimate: An estimate, not from a study" in plain


def test_a_person_cites_its_parts_and_strengths_with_their_classes():
    man, woman = (
        {one["reference"]: one["used_for"] for one in answer("cite", name)["references"]}
        for name in ("male50", "female50")
    )
    contact = contact_of_figure(FIGURE_FILE.read("male50"))
    assert contact is not None
    for part in contact.parts:
        assert f"contact of {part.name} ({part.evidence.value})" in man[part.law.source]
    (neck,) = (used for text, used in man.items() if "isometric neck strength" in text)
    assert "strength of neck flexion (published)" in neck
    (neck,) = (used for text, used in woman.items() if "isometric neck strength" in text)
    assert "strength of neck flexion (estimate)" in neck
    assert "strength of left_elbow flexion (estimate)" in man["An estimate, not from a study"]
    for name in ("prototype", "pendulum"):
        used = [text for one in answer("cite", name)["references"] for text in one["used_for"]]
        assert not any(text.startswith(("contact of", "strength of")) for text in used)
