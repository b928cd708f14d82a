"""The files of a person, and those of the persons that are shipped."""

import csv
import math
import re
from pathlib import Path

import pytest

from generator.person.measures import Sex, estimate_measures
from generator.person.person import Person, build_person
from generator.person.person_files import (
    describe_measures,
    format_sources,
    person_files,
    read_references,
    sources_path,
)
from generator.person.sources import Origin, SourcedNumber
from springs.published.reference import Reference, Sureness
from tests.paths import FIGURES

SHIPPED = {"male50": (Sex.MALE, 1.756, 85.5), "female50": (Sex.FEMALE, 1.628, 67.8)}
"""Sex, stature [m] and mass [kg] of the persons in `figures`, the means of the survey."""

NUMBER = re.compile(r"(?<![\w.])[+-]?[0-9]+(?:\.[0-9]+)?(?:e[+-]?[0-9]+)?")

GRID = 1e-3
"""Of the coordinates in psurfs [cm], to which rounding may differ between machines."""


@pytest.fixture(scope="module", params=SHIPPED)
def shipped(request: pytest.FixtureRequest) -> tuple[Path, Person]:
    """Path of a shipped person, and the same person built anew."""
    return FIGURES / f"{request.param}.fig", build_person(
        estimate_measures(*SHIPPED[request.param])
    )


def differences(one: str, other: str, tolerance: float) -> list[tuple[str, str]]:
    """Numbers, and texts between them, that differ."""
    texts, numbers = (
        [find(text) for text in (one, other)] for find in (NUMBER.split, NUMBER.findall)
    )
    if len(numbers[0]) != len(numbers[1]):
        return [(f"{len(numbers[0])} numbers", f"{len(numbers[1])} numbers")]
    words = [pair for pair in zip(*texts, strict=True) if pair[0] != pair[1]]
    return words + [
        (a, b)
        for a, b in zip(*numbers, strict=True)
        if not math.isclose(float(a), float(b), rel_tol=1e-9, abs_tol=tolerance)
    ]


def test_the_shipped_persons_are_those_of_the_command(shipped: tuple[Path, Person]):
    """If this fails, write them anew: figures/README.md has the commands."""
    path, person = shipped
    files = person_files(person, path).contents
    beside = {file for file in FIGURES.glob(f"{path.stem}*") if file.is_file()}
    assert {*beside, *FIGURES.glob(f"{path.stem}_geometry/*")} == set(files)
    for file, content in files.items():
        tolerance = 1.01 * GRID if file.suffix == ".pss" else 1e-9
        found = differences(file.read_text(encoding="utf-8"), str(content), tolerance)
        assert found == [], file.name


def test_the_comparison_sees_a_gram():
    assert differences("mass = 2.5g; x 3", "mass = 2.5g; x 3", 0.0) == []
    assert differences("mass = 2.5g", "mass = 3.5g", 0.1) == [("2.5", "3.5")]
    assert differences("mass = 2.5g", "mass = 2.5kg", 0.1) == [("g", "kg")]
    assert differences("a 1 2", "a 1", 0.1) == [("2 numbers", "1 numbers")]
    assert differences("trans(0cm,-1e-3cm)", "trans(0cm,1e-3cm)", 1e-9) == [("-1e-3", "1e-3")]


def test_a_person_without_springs_has_no_springs_files(tmp_path: Path):
    person = build_person(estimate_measures(*SHIPPED["female50"]), springs="none")
    files = person_files(person, tmp_path / "me.fig")
    beside = [path.name for path in files.contents if path.parent == tmp_path]
    assert beside == ["me.sources.csv", "me.contact.toml", "me.fig"]
    assert files.losses.entries == ()


def test_a_row_of_sources_has_its_reference_and_rule():
    reference = Reference("A. Author, 1999", Sureness.PAGE, doi="10.1/2", place='table "4"')
    text = format_sources(
        [
            SourcedNumber("head", "mass", 5.5, "kg", Origin.PUBLISHED, reference, "6.94 %, of 79"),
            SourcedNumber("knee", "damping", 0.1, "N m s/rad", Origin.ESTIMATE, None, "none found"),
        ],
        "me.fig",
    )
    first, *lines = text.splitlines()
    assert first == "# figure me.fig"
    published, estimate = csv.DictReader(lines)
    assert published == {
        "part": "head",
        "quantity": "mass",
        "value": "5.5",
        "unit": "kg",
        "origin": "published",
        "reference": 'A. Author, 1999; table "4"; doi:10.1/2',
        "sureness": "read on a page",
        "rule": "6.94 %, of 79",
    }
    assert (estimate["reference"], estimate["sureness"], estimate["rule"]) == ("", "", "none found")


@pytest.mark.parametrize("text", ["", "part,reference\n1", "\0", "a,b\n1,2,3\n"])
def test_a_damaged_table_of_sources_has_no_references(text: str, tmp_path: Path):
    path = tmp_path / "me.sources.csv"
    assert read_references(path) == {}
    path.write_text(text, encoding="utf-8")
    assert read_references(path) == {}


def test_a_quote_without_its_end_leaves_the_references_before_it(tmp_path: Path):
    path = tmp_path / "me.sources.csv"
    rest = "a,b,c\n" * 30_000
    path.write_text(f'part,quantity,reference\nknee,mass,A 1989\n"{rest}', encoding="utf-8")
    assert read_references(path) == {"A 1989": ["mass"]}


def test_a_reference_is_no_formula_and_reads_back(tmp_path: Path):
    reference = Reference('=cmd|"/c calc"!A1', Sureness.PAGE)
    number = SourcedNumber("@head", "-mass", -5.5, "kg", Origin.PUBLISHED, reference, "+a, =b")
    path = tmp_path / "x.sources.csv"
    path.write_text(format_sources([number], "a,=1.fig"), encoding="utf-8")
    lines = path.read_text(encoding="utf-8").splitlines()
    assert lines[0] == "# figure a,'=1.fig"
    cells = next(csv.reader(lines[2:]))
    assert not [cell for cell in cells if cell[:1] in "=+-@" and cell not in ("-5.5", "")]
    assert read_references(path) == {'=cmd|"/c calc"!A1': ["-mass"]}


def test_paths_and_words(tmp_path: Path):
    assert sources_path(tmp_path / "my.own.fig") == tmp_path / "my.own.sources.csv"
    measures = estimate_measures(Sex.MALE, 1.7561234, 85.0)
    assert describe_measures(measures) == "male, 1.75612 m, 85 kg"
