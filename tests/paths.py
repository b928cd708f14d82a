"""Folders and files that tests read."""

from pathlib import Path

TESTS = Path(__file__).parent
ROOT = TESTS.parent
FIGURES = ROOT / "figures"
FAULTS = TESTS / "faults"
DOCS = ROOT / "docs"
