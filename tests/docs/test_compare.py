"""docs/compare.md: its commands and its Python run, and print what the page shows."""

import re
import shlex
from pathlib import Path

import pytest

from tests.command import run
from tests.paths import DOCS

PAGE = (DOCS / "compare.md").read_text(encoding="utf-8")
COMMANDS = re.findall(r"^mover (.+)$", PAGE, re.MULTILINE)


@pytest.mark.slow
def test_the_commands_compare_two_falls(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.chdir(tmp_path)
    said = [run(*shlex.split(line)).stdout for line in COMMANDS][-1]
    (block,) = re.findall(r"```text\n(.*?)```", PAGE, re.DOTALL)
    shown = [re.sub(r"[-+]?[\d.]+", "#", line).split() for line in block.splitlines()]
    found = [re.sub(r"[-+]?[\d.]+", "#", line).split() for line in said.splitlines()]
    # Numbers after poses are chaotic differ from machine to machine, and so does their order.
    early = [line for line in shown if "differ" in " ".join(line) or line[:1] == ["stiff"]]
    assert len(early) > 3
    assert all(line in found for line in early)
    assert (tmp_path / "compare.html").stat().st_size > 1_000_000


@pytest.mark.slow
def test_the_python_compares_two_runs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
):
    monkeypatch.chdir(tmp_path)
    (script,) = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
    exec(script, {})
    said = capsys.readouterr().out
    first, largest = said.splitlines()
    assert first.split()[1] == "flexion"
    assert float(first.split()[2]) < 1.0
    assert largest.startswith("Difference(motion='stiff', quantity=<Quantity.ANGLE: ")
    assert (tmp_path / "compare.html").exists()
