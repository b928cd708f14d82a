"""The site of the pages: every page is in a table of contents, every public name in the API.

That Sphinx builds it without a warning is a stage of .ci/run.
"""

import re

import generator
import springs
from tests.paths import DOCS

TOCTREE = re.compile(r"^```\{toctree\}\n(.*?)^```", re.MULTILINE | re.DOTALL)
DIRECTIVE = re.compile(r"^\.\. (currentmodule|auto\w+):: ([\w.]+)", re.MULTILINE)


def test_every_page_is_in_a_table_of_contents_once() -> None:
    lists = TOCTREE.findall((DOCS / "index.md").read_text(encoding="utf-8"))
    entries = [line for text in lists for line in text.split("\n\n")[-1].split()]
    files = [*DOCS.rglob("*.md"), *DOCS.rglob("*.ipynb")]
    pages = {str(path.relative_to(DOCS).with_suffix("")) for path in files}
    assert sorted(entries) == sorted(pages - {"index", "paper/paper"})


def test_every_public_name_is_in_the_api() -> None:
    page = (DOCS / "api.md").read_text(encoding="utf-8")
    module, listed = "", dict[str, list[str]]()
    for directive, name in DIRECTIVE.findall(page):
        if directive == "currentmodule":
            module = name
        elif "." not in name:
            listed.setdefault(module, []).append(name)
    assert sorted(listed["generator"]) == sorted(generator.__all__)
    assert sorted(listed["springs"]) == sorted(springs.__all__)
