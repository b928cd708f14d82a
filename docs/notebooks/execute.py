"""Execute notebooks anew, each in an empty folder, and write their outputs into them.

`python docs/notebooks/execute.py [NAME ...]` executes those of these names, by default all. It
needs nbclient and ipykernel (`pip install -e ".[test]"`), and what a notebook is about.
"""

import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import nbformat
from nbclient import NotebookClient

FOLDER = Path(__file__).parent

WITHOUT_OUTPUT = "without-output"
"""Tag of cells whose outputs are too large to keep."""

TIMEOUT = 900
"""Longest time of a cell [s]; the first fall on a machine is compiled."""


def execute(path: Path, folder: Path) -> nbformat.NotebookNode:
    """Return a notebook executed in a folder; nbclient raises CellExecutionError for an error."""
    book = nbformat.read(path, as_version=4)
    client = NotebookClient(
        book,
        timeout=TIMEOUT,
        kernel_name="python3",
        record_timing=False,
        coalesce_streams=True,
        resources={"metadata": {"path": str(folder)}},
    )
    client.execute()
    for cell in book.cells:
        if WITHOUT_OUTPUT in cell.metadata.get("tags", ()):
            cell.outputs = []
    book.metadata.pop("widgets", None)
    book.metadata.language_info = {"name": "python"}  # without the version of this machine
    return book


def main() -> None:
    """Execute notebooks, and write them."""
    for path in sorted(FOLDER.glob("*.ipynb")):
        if path.stem in sys.argv[1:] or not sys.argv[1:]:
            with TemporaryDirectory() as folder:
                book = execute(path, Path(folder))
            nbformat.write(book, path)
            print(f"executed {path}")


if __name__ == "__main__":
    main()
