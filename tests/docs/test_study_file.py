"""docs/study-file.md: its examples are read without an error, and it names every key."""

import re
from pathlib import Path
from typing import Any

import pytest

from generator.recording import Ending
from generator.study import study_tables
from generator.study.study import OUTCOMES, DesignKind, Statistic
from tests.paths import DOCS, FIGURES
from tests.study_runs import parse_study_text

PAGE = (DOCS / "study-file.md").read_text(encoding="utf-8")
EXAMPLES = re.findall(r"^```toml\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL)
PYTHON = re.findall(r"^```python\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL)
FIRST_CELLS = [line.split("|")[1] for line in PAGE.splitlines() if line.startswith("|")]
KEYS = {word for cell in FIRST_CELLS for word in re.findall(r"`([^`]+)`", cell)}
TABLES = {"set", "velocity"}


def complete(example: str) -> str:
    """Return an example with the rest of a study."""
    head, tables = "", example
    if "figure" not in example and "[person]" not in example:
        head = 'figure = "prototype"\n'
    if "[design]" not in example:
        tables += '[design]\nkind = "grid"\n[parameters.g]\npath = "gravity"\nvalues = [0.9, 1]\n'
        tables += '[measures.end]\ncolumn = "kinetic [J]"\ntake = "last"\n'
    return head + tables


@pytest.mark.parametrize("example", EXAMPLES)
def test_every_example_is_read(example: str):
    parsed = parse_study_text(complete(example), FIGURES)
    assert parsed.value is not None, list(map(str, parsed.diagnostics))


def test_every_key_is_in_a_table():
    keys = {*study_tables.RUN_KEYS, "figure", "springs"} - TABLES
    keys |= {f"[{name}]" for name in TABLES} | {*study_tables.PERSON_ROWS.keys}
    keys |= {*study_tables.DESIGN_ROWS.keys, *study_tables.PARAMETER_ROWS.keys}
    keys |= {*study_tables.MEASURE_ROWS.keys, *study_tables.SENSITIVITY_ROWS.keys}
    keys |= {f'"{one.value}"' for one in (*DesignKind, *Statistic)}
    assert keys - KEYS == set()


def paths() -> set[str]:
    """The paths of quantities in the table of the page."""
    table = PAGE[PAGE.index("| path | value |") : PAGE.index("## The measures")]
    cells = [line.split("|")[1] for line in table.splitlines()[2:] if line.startswith("|")]
    return {word for cell in cells for word in re.findall(r"`([^`]+)`", cell)}


def test_every_path_of_the_page_is_known():
    head = 'fall = "push"\n[person]\nsex = "male"\nstature_m = 1.75\nmass_kg = 75\n'
    rest = '[design]\nkind = "latin-hypercube"\nruns = 2\n[measures.end]\n'
    rest += 'column = "kinetic [J]"\ntake = "last"\n'
    rest += '[measures.use]\ncolumn = "hold.use [1]"\ntake = "start"\n[parameters]\n'

    def distribution(path: str) -> str:
        if path == "person":
            return "values = [1]"
        low = 20 if path == "hold.age" else 1
        return f"low = {low}, high = {low + 1e-3}"

    known = paths()
    assert len(known) > 15
    for springs in ("published", "coupled"):
        rows = "".join(
            f'p{k} = {{ path = "{path}", {distribution(path)} }}\n'
            for k, path in enumerate(sorted(known))
            if ("coupled" in path) is (springs == "coupled")
        )
        text = head + f'springs = "{springs}"\n' + rest + rows
        faults = parse_study_text(text, FIGURES).diagnostics
        known_faults = (
            "changes a quantity a second time",
            "kg is impossible at",
            "parts of the body have stiffnesses of their own",
        )
        unknown = [
            str(one) for one in faults if not any(text in one.message for text in known_faults)
        ]
        assert unknown == []


@pytest.mark.parametrize("code", PYTHON)
def test_the_python_of_the_page_runs(code: str, tmp_path: Path, monkeypatch: Any):
    monkeypatch.chdir(tmp_path)
    Path("swing.study.toml").write_text(EXAMPLES[0], "utf-8")
    names: dict[str, Any] = {}
    exec(code, names)
    assert names["points"].shape == (64, 1)
    assert names["first"].outcome == "done"


def test_every_outcome_is_in_a_table():
    assert OUTCOMES - {Ending.INTERRUPTED.value} - KEYS == set()
