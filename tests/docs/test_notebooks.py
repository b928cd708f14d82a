"""Notebooks of the site: they have outputs without errors, and run to outputs of these kinds."""

import re
import runpy
from pathlib import Path
from typing import Any

import pytest

from tests.paths import DOCS

nbformat = pytest.importorskip("nbformat")
pytest.importorskip("nbclient")

FOLDER = DOCS / "notebooks"
NOTEBOOKS = sorted(FOLDER.glob("*.ipynb"))
MAX_BYTES = 300_000
"""Size of the largest notebook, with its pictures."""

MAX_BYTES_OF_ALL = 2_500_000

OWN_PLACE = re.compile(r"/(?:home|tmp|work|root|Users)/")


def read(path: Path) -> Any:
    book = nbformat.read(path, as_version=4)
    nbformat.validate(book)
    return book


def code_cells(book: Any) -> list[Any]:
    return [cell for cell in book.cells if cell.cell_type == "code"]


def kinds(book: Any) -> list[list[tuple[str, list[str]]]]:
    """Kind and formats of each output of each code cell."""
    return [
        [(one.output_type, sorted(one.get("data", {}))) for one in cell.outputs]
        for cell in code_cells(book)
    ]


def test_the_notebooks_are_few_and_small() -> None:
    assert len(NOTEBOOKS) == 8
    assert sum(path.stat().st_size for path in NOTEBOOKS) < MAX_BYTES_OF_ALL


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_has_outputs_without_errors(path: Path) -> None:
    book = read(path)
    cells = code_cells(book)
    assert [cell.execution_count for cell in cells] == [*range(1, len(cells) + 1)]
    assert sum(len(cell.outputs) for cell in cells) >= 3
    outputs = [one for cell in cells for one in cell.outputs]
    assert all(one.output_type != "error" for one in outputs)
    assert all(one.get("name") != "stderr" for one in outputs)
    text = path.read_text(encoding="utf-8")
    assert not OWN_PLACE.search(text)
    assert len(text) < MAX_BYTES
    assert book.cells[0].source.startswith("# ")


@pytest.mark.slow
@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_runs(path: Path, tmp_path: Path) -> None:
    before = read(path)
    for module in before.metadata.get("needs", ()):
        pytest.importorskip(module)
    execute = runpy.run_path(str(FOLDER / "execute.py"))["execute"]
    after = execute(path, tmp_path)
    assert kinds(after) == kinds(before)
