"""docs/links.md: its file is read without a fault, and its Python runs and does what it says."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from generator.input_files.links import LINK_ENTRIES
from tests.paths import DOCS

PAGE = (DOCS / "links.md").read_text(encoding="utf-8")


def block(language: str) -> str:
    """The one example of a language."""
    (text,) = re.findall(rf"^```{language}\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL)
    return text


def test_the_file_is_read():
    reading = LINK_ENTRIES.parse_text(block("toml"))
    assert reading.diagnostics == ()
    assert reading.value is not None
    assert [entry.joints for entry in reading.value.entries] == [("right_shoulder",), ("waist",)]


def test_the_python_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.chdir(tmp_path)
    Path("arms.links.toml").write_text(block("toml"), encoding="utf-8")
    names: dict[str, Any] = {}
    exec(compile(block("python"), "links.md", "exec"), names)
    moved = names["moved"]
    assert np.degrees(moved["right_shoulder"]) == pytest.approx([0.0, 20.0, 60.0])
    assert np.degrees(moved["waist"][2]) == pytest.approx(5.0)
    stacked = np.array([moved[one.joint][one.index] for one in names["order"]])
    assert names["C"] @ stacked == pytest.approx(names["d"])
    assert names["C"].shape == (4, 22)
