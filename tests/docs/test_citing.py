"""What others cite and install states the facts of the project: citation, recipe and paper."""

import re
import tomllib
from typing import Any

import pytest
import yaml

from springs.published.tables import publication, publications
from tests.paths import DOCS, ROOT

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
PAPER = (DOCS / "paper" / "paper.md").read_text(encoding="utf-8")
_, _HEAD, BODY = PAPER.split("---\n", 2)
BIBLIOGRAPHY = (DOCS / "paper" / "paper.bib").read_text(encoding="utf-8")


def read_yaml(path: str) -> Any:
    return yaml.safe_load((ROOT / path).read_text(encoding="utf-8"))


def test_the_citation_is_that_of_the_project() -> None:
    """The keys that the schema 1.2.0 needs, and no others than it knows; `cffconvert` tests all."""
    citation = read_yaml("CITATION.cff")
    assert {"cff-version", "message", "title", "authors"} <= citation.keys()
    assert citation["cff-version"] == "1.2.0"
    assert citation["type"] == "software"
    assert citation["title"] == PROJECT["name"]
    assert citation["version"] == PROJECT["version"]
    assert citation["license"] == PROJECT["license"]
    assert citation["authors"] == PROJECT["authors"]
    assert citation["keywords"] == PROJECT["keywords"]
    for each in citation["references"]:
        assert {"type", "title", "authors", "year"} <= each.keys()


def test_the_recipe_has_version_and_dependencies_of_the_project() -> None:
    recipe = read_yaml("conda/recipe.yaml")
    assert recipe["context"]["version"] == PROJECT["version"]
    engine, project = recipe["outputs"]
    assert engine["package"]["name"] == "exudyn"
    pinned = re.escape(recipe["context"]["exudyn"])
    constraints = (ROOT / "requirements-ci.txt").read_text(encoding="utf-8")
    assert re.search(rf"^exudyn=={pinned}$", constraints, re.MULTILINE)
    assert (ROOT / "conda" / project["source"]["path"]).resolve() == ROOT
    needed = [f"python {PROJECT['requires-python']}"]
    needed += [re.sub(r"^([\w-]+)", r"\1 ", one) for one in PROJECT["dependencies"]]
    given = [one.replace("matplotlib-base", "matplotlib") for one in project["requirements"]["run"]]
    assert sorted(given) == sorted(needed)
    (script,) = project["build"]["python"]["entry_points"]
    assert script == f"mover = {PROJECT['scripts']['mover']}"
    assert project["about"]["license"] == PROJECT["license"]
    assert project["about"]["summary"] == PROJECT["description"]


def test_the_paper_has_the_form_of_the_journal() -> None:
    head = yaml.safe_load(_HEAD)
    assert {"title", "tags", "authors", "affiliations", "date", "bibliography"} <= head.keys()
    assert [one["name"] for one in head["authors"]] == [PROJECT["authors"][0]["name"]]
    assert {one["affiliation"] for one in head["authors"]} == {
        one["index"] for one in head["affiliations"]
    }
    assert re.findall(r"^# (.*)$", BODY, re.MULTILINE) == [
        *("Summary", "Statement of need", "State of the field", "Software design"),
        *("Research impact statement", "AI usage disclosure", "Acknowledgements", "References"),
    ]
    words = re.sub(r"[#*`]|\[@[^]]*\]|!\[|\]\([^)]*\)", "", BODY).split()
    assert 750 <= len(words) <= 1750


def test_the_paper_cites_what_its_bibliography_has() -> None:
    cited = set(re.findall(r"@(\w+)", BODY))
    entries = dict(re.findall(r"^@\w+\{(\w+),\n(.*?)^\}", BIBLIOGRAPHY, re.MULTILINE | re.DOTALL))
    assert cited == entries.keys()
    found = {
        key: re.search(r"^  (doi|url) = ", text, re.MULTILINE) for key, text in entries.items()
    }
    assert [key for key, place in found.items() if place is None] == []


def test_the_paper_counts_the_published_curves() -> None:
    tables = [publication(name) for name in publications()]
    curves, laws = (
        sum(len(getattr(one, kind)) for one in tables) for kind in ("curves", "coupled_laws")
    )
    sources = sum(bool(one.curves or one.coupled_laws) for one in tables)
    said = f"{curves} curves and {laws} laws over several joints from {sources} sources"
    assert said in " ".join(BODY.split())


def number(pattern: str, page: str) -> str:
    """The number that a page has at the group of a pattern."""
    found = re.search(pattern, (DOCS / page).read_text(encoding="utf-8"), re.MULTILINE)
    assert found is not None, pattern
    return found[1]


OPENSIM, MUJOCO = r"^\| male50 \| OpenSim \|", r"^\| male50 \| MuJoCo \|"


@pytest.mark.parametrize(
    ("sentence", "page", "patterns"),
    [
        (
            "OpenSim's passive moments agree with ours to {} N m of up to {} N m",
            "model-formats.md",
            [rf"{OPENSIM} (\S+) \|", rf"{OPENSIM} \S+ \| \S+ \| (\S+) \|"],
        ),
        (
            "exponentials are fitted, to {} N m of {} N m",
            "model-formats.md",
            [rf"{MUJOCO} (\S+) \|", rf"{MUJOCO} \S+ \| \S+ \| (\S+) \|"],
        ),
        (
            "its man gains {} J and {} m/s horizontally",
            "falls-of-people.md",
            [r"gains (\S+) J and", r"J and (\S+) m/s horizontally"],
        ),
        ("to {} rad", "verification.md", [r"All agree to (\S+) rad"]),
        (
            "took {} ms where",
            "speed.md",
            [r"^\| 1e-05 \| OpenSim, .*? \| (\S+) \| \S+ \| \S+ \| \S+ \|$"],
        ),
        ("It buys {} ms", "speed.md", [r"^\| this program, compiled \| (\S+) \| \S+ \|$"]),
    ],
)
def test_a_measured_number_is_that_of_its_page(
    sentence: str, page: str, patterns: list[str]
) -> None:
    said = sentence.format(*(number(pattern, page) for pattern in patterns))
    assert said in " ".join(BODY.split())


def test_the_agreement_with_falls_of_people_is_that_of_the_page() -> None:
    page = (DOCS / "falls-of-people.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\|.*\| tests \|.*\| (.*) \|.*\| (.*) \|$", page, re.MULTILINE)
    man, woman = ([row[k] for row in rows if row[k] != "not judged"] for k in (0, 1))
    assert len(man) == len(woman)
    counted = (
        f"Of the {len(man)} judged facts that set no parameter, the man agrees with "
        f"{man.count('agrees')} and the woman with {woman.count('agrees')}"
    )
    assert counted in " ".join(BODY.split())
