"""The files and names that the pages mention exist."""

import re
from pathlib import Path

import pytest

from tests.paths import DOCS, FIGURES, ROOT

PAGES = [ROOT / "README.md", FIGURES / "README.md", *sorted(DOCS.rglob("*.md"))]
PATH = re.compile(
    r"`((?:generator|springs|plots|benchmarks|docs|figures)/[\w./]*|tests/\w{2,}[\w./]*)`"
)
NAME_IN_FILE = re.compile(r"`(\w+)` (?:of|in) `([\w/]+\.py)`")
LINK = re.compile(r"\]\(([\w./-]+)(?:#[\w-]+)?\)")


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_what_a_page_mentions_exists(page: Path):
    text = page.read_text(encoding="utf-8")
    missing = [path for path in PATH.findall(text) if not (ROOT / path).exists()]
    missing += [link for link in LINK.findall(text) if not (page.parent / link).exists()]
    for name, path in NAME_IN_FILE.findall(text):
        source = (ROOT / path).read_text(encoding="utf-8") if (ROOT / path).exists() else ""
        if not re.search(rf"^(?:def |class )?{name}\b", source, re.MULTILINE):
            missing.append(f"{name} in {path}")
    assert missing == []
