"""The files and names that the pages mention exist."""

import re
from collections.abc import Iterator
from pathlib import Path

from tests.paths import DOCS, FIGURES, ROOT

PAGES = [ROOT / "README.md", FIGURES / "README.md", *sorted(DOCS.rglob("*.md"))]
PATH = re.compile(
    r"`((?:generator|springs|plots|benchmarks|docs|figures)/[\w./]*|tests/\w{2,}[\w./]*)`"
)
NAME_IN_FILE = re.compile(r"`(\w+)` (?:of|in) `([\w/]+\.py)`")
LINK = re.compile(r"\]\(([\w./-]+)(?:#[\w-]+)?\)")


def missing_on(page: Path) -> Iterator[str]:
    text = page.read_text(encoding="utf-8")
    yield from (path for path in PATH.findall(text) if not (ROOT / path).exists())
    yield from (link for link in LINK.findall(text) if not (page.parent / link).exists())
    for name, path in NAME_IN_FILE.findall(text):
        source = (ROOT / path).read_text(encoding="utf-8") if (ROOT / path).exists() else ""
        if not re.search(rf"^(?:def |class )?{name}\b", source, re.MULTILINE):
            yield f"{name} in {path}"


def test_what_pages_mention_exists():
    missing = [f"{page.relative_to(ROOT)}: {one}" for page in PAGES for one in missing_on(page)]
    assert missing == []
