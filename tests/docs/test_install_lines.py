"""Every line of the pages and messages that installs something names what can be installed.

The project is in no index, so that its own name cannot be installed; its extras are those of the
project's file, and a package beside it is one that the project or a page needs.
"""

import re
import shlex
import tomllib
from collections.abc import Iterator

import pytest

from tests.paths import ROOT

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
EXTRAS = PROJECT["project"]["optional-dependencies"]
GROUPS = PROJECT["dependency-groups"]
LISTED = [PROJECT["project"]["dependencies"], *EXTRAS.values(), *GROUPS.values()]
DEPENDENCIES = {re.split(r"[\[<>=; ]", one)[0] for group in LISTED for one in group}
ONLY_ON_PAGES = {"bpy", "cffconvert", "drake", "pyarrow"}
"""Packages that a single page or command needs."""

FOLDERS = ("docs", "generator", "springs", "plots", "benchmarks", "figures")
FILES = [ROOT / "README.md", *(p for f in FOLDERS for p in sorted((ROOT / f).rglob("*.*")))]
LINE = re.compile(r"pip3? install +(.*?)(?= *(?:&&|`|\)|#|$))", re.MULTILINE)


def install_lines() -> Iterator[tuple[str, str]]:
    """Yield the file and the words after `pip install` of each line."""
    for path in FILES:
        if path.suffix in (".md", ".py", ".ipynb", ".toml") and path.name != "changelog.md":
            for found in LINE.finditer(path.read_text(encoding="utf-8").replace('\\"', '"')):
                yield str(path.relative_to(ROOT)), found[1].strip()


LINES = sorted(set(install_lines()))


def test_the_lines_are_found() -> None:
    assert len(LINES) >= 15
    assert ("README.md", "-e .") in LINES
    assert ("generator/cli/view.py", '-e ".[viewer]"') in LINES


@pytest.mark.parametrize(("file", "line"), LINES)
def test_a_line_can_be_followed(file: str, line: str) -> None:
    words = shlex.split(line)
    while words:
        word = words.pop(0)
        if word in ("-e", "--editable"):
            found = re.fullmatch(r"\.(?:\[([\w,]+)\])?", words.pop(0))
            assert found, f"{file}: the project is installed from its folder, `-e .`"
            assert set((found[1] or "").split(",")) - {""} <= EXTRAS.keys()
        elif word == "--group":
            assert words.pop(0) in GROUPS
        elif word == "-c":
            assert (ROOT / words.pop(0)).is_file()
        else:
            assert word in DEPENDENCIES | ONLY_ON_PAGES, f"{file}: {word}"


def test_nothing_else_tells_to_install_the_project_by_name() -> None:
    named = [
        str(path.relative_to(ROOT))
        for path in FILES
        if path.suffix in (".md", ".py", ".ipynb")
        and re.search(r"pip3? install [^\n]*exudyn-mover", path.read_text(encoding="utf-8"))
    ]
    assert named == []
