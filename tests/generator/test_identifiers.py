"""The names of our packages: another module of one of these names is reported, never used."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

import generator
from tests.paths import ROOT

SENTENCE = (
    "{hiding} hides the {name} package of exudyn-mover ({installed}): "
    "rename it or run from another folder"
)


def run(folder: Path, *words: str) -> subprocess.CompletedProcess[str]:
    """Run Python in a folder, with our packages installed."""
    return subprocess.run(
        [sys.executable, *words],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.mark.parametrize(
    ("file", "name"),
    [("springs.py", "springs"), ("plots.py", "plots"), ("figures/__init__.py", "figures")],
)
def test_a_hidden_package_is_one_sentence(tmp_path: Path, file: str, name: str) -> None:
    hiding = tmp_path / file
    hiding.parent.mkdir(exist_ok=True)
    hiding.write_text("raise RuntimeError('this module is not imported')\n")
    (tmp_path / "fall.py").write_text("import generator\n")
    place = hiding.parent if hiding.name == "__init__.py" else hiding
    sentence = SENTENCE.format(hiding=place, name=name, installed=ROOT)
    script = run(tmp_path, "fall.py")
    assert script.returncode == 1
    assert script.stderr.splitlines()[-1] == f"ImportError: {sentence}"
    command = run(tmp_path, "-m", "generator.cli", "--help")
    assert (command.returncode, command.stdout) == (1, "")
    assert command.stderr == f"error: {sentence}\n"


def test_a_folder_of_figures_hides_nothing(tmp_path: Path) -> None:
    (tmp_path / "figures").mkdir()
    (tmp_path / "fall.py").write_text("import generator, sys; print('numpy' in sys.modules)\n")
    done = run(tmp_path, "fall.py")
    assert (done.returncode, done.stdout, done.stderr) == (0, "False\n", "")


def test_the_names_that_the_package_offers() -> None:
    assert set(generator.__all__) <= set(dir(generator))
    assert all(getattr(generator, name) is not None for name in generator.__all__)
    with pytest.raises(AttributeError, match="no attribute 'simulat'"):
        _ = generator.simulat
