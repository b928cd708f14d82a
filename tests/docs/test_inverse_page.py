"""docs/inverse.md: the example of markers runs, and its motion is found again."""

import re
from pathlib import Path

import pytest

from tests.command import answer, run
from tests.generator.inverse.walking import MODEL, MOTION
from tests.paths import DOCS

PAGE = (DOCS / "inverse.md").read_text(encoding="utf-8")


def test_markers_of_the_example_are_found_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    (text,) = re.findall(r"^```python\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL)
    monkeypatch.chdir(tmp_path)
    Path("walk.mot").write_bytes(MOTION.read_bytes())
    run("convert", MODEL, "gait10.fig")
    exec(compile(text, "inverse.md", "exec"), {})
    for body in ("gait10.fig", MODEL):
        assert answer("track", body, "walk.trc", "-o", "tracked.mot")["rms_mm"] < 1e-9
