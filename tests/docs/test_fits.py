"""docs/fits.md: its example runs as it is printed, and its tables name what the lint finds."""

import re
import shlex
from pathlib import Path

import pytest

from generator.springs_file.parse import SPRINGS_FILE
from springs.fit_forms import Form
from springs.lint.finding import FindingKind
from tests.command import run
from tests.paths import DOCS

PAGE = (DOCS / "fits.md").read_text(encoding="utf-8")


def block(language: str) -> str:
    """The first block of code of a language."""
    found = re.search(rf"^```{language}\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL)
    assert found is not None
    return found[1]


def test_the_example_is_fitted_as_it_is_printed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.chdir(tmp_path)
    Path("elbow.csv").write_text(block(""), encoding="utf-8")
    words = shlex.split(block("sh"))
    assert words[0] == "mover"
    run(*words[1:])
    reading = SPRINGS_FILE.parse_text(Path("elbow.springs.toml").read_text(encoding="utf-8"))
    assert reading.diagnostics == ()
    assert reading.value is not None
    (entry,) = reading.value.entries
    assert entry.joints == ("left_elbow", "right_elbow")
    assert Path("elbow.svg").stat().st_size > 0


def test_every_kind_of_finding_is_in_a_table():
    rows = [line.split("|")[1] for line in PAGE.splitlines() if line.startswith("|")]
    told = {word.strip() for row in rows for word in row.split(",")}
    assert {kind.value for kind in FindingKind} <= told


def test_the_forms_of_the_tutorial_s_data_are_those_of_the_page(tmp_path: Path):
    tutorial = (DOCS / "tutorials" / "measured-limb.md").read_text(encoding="utf-8")
    found = re.search(r"^```\n# elbow.csv\n(.*?)^```", tutorial, re.MULTILINE | re.DOTALL)
    assert found is not None
    (tmp_path / "elbow.csv").write_text(found[1], encoding="utf-8")
    table = next(one for one in re.findall(r"```\n(form .*?)```", PAGE, re.DOTALL))
    assert table in run("fit", tmp_path / "elbow.csv").stdout
    for form in Form:
        assert f"| `{form}` |" in PAGE
