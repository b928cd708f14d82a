"""The folder of compiled code: its name, folders that cannot be written, and a second process."""

import json
import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

from generator.simulation.compiled import code_cache
from generator.simulation.compiled.code_cache import cache_folder, expected_folder, mark_compiled
from tests.paths import ROOT
from tests.processes import ENVIRONMENT

PACKAGE = Path(code_cache.__file__).parent

SIMULATE = """
import json
from generator.simulation.compiled.code_cache import cache_folder, count_functions, listeners
names = []
listeners.append(names.append)
from generator import Plan, read_figure, simulate
run = simulate(read_figure("pendulum"), Plan(stop=0.1))
folder = cache_folder()
print(json.dumps({
    "integrator": run.integrator.value,
    "angle": next(iter(run.displacements.values()))[-1, 0],
    "functions": len(names),
    "counted": count_functions(),
    "folder": None if folder is None else str(folder),
}))
"""


def simulate_in_a_process(**variables: str) -> tuple[dict, str]:
    """What a new process says, and what numba prints about its cache."""
    done = subprocess.run(
        [sys.executable, "-c", SIMULATE],
        env={**ENVIRONMENT, "NUMBA_DEBUG_CACHE": "1", **variables},
        capture_output=True,
        text=True,
        check=True,
    )
    lines = done.stdout.splitlines()
    return json.loads(lines[-1]), "\n".join(lines[:-1])


@pytest.fixture(scope="module")
def first() -> dict:
    """A run in a new process, after which its code is stored."""
    return simulate_in_a_process()[0]


def contents(folder: str) -> dict[str, int]:
    """Files and their times [ns]."""
    return {path.name: path.stat().st_mtime_ns for path in Path(folder).rglob("*.nbc")}


def test_a_second_process_compiles_nothing(first: dict) -> None:
    before = contents(first["folder"])
    second, cache = simulate_in_a_process()
    assert second == first
    assert first["integrator"] == "compiled"
    assert first["functions"] == first["counted"] > 10
    assert "data loaded" in cache
    assert "saved" not in cache
    after = contents(first["folder"])  # other tests may compile laws at the same time
    assert {name: after[name] for name in before} == before


def path_of(module: str) -> Path:
    return ROOT / (module.replace(".", "/") + ".py")


def test_the_folder_is_named_by_the_sources(monkeypatch) -> None:
    paths = [*PACKAGE.glob("*.py"), *map(path_of, code_cache._CONTACT_MODULES)]
    texts = [path.read_text(encoding="utf-8") for path in paths]
    assert sorted(code_cache._sources()) == sorted(texts)
    before = expected_folder()
    assert expected_folder() == before
    changed = (*code_cache._sources()[:-1], code_cache._sources()[-1] + "#")
    monkeypatch.setattr(code_cache, "_sources", lambda: changed)
    assert expected_folder().parent == before.parent
    assert expected_folder() != before


@pytest.mark.parametrize("place", ["a file", "below a file"])
def test_a_folder_that_cannot_be_written_is_none(tmp_path, monkeypatch, place) -> None:
    (tmp_path / "file").write_text("")
    folder = tmp_path / "file" if place == "a file" else tmp_path / "file" / "compiled-0"
    monkeypatch.setattr(code_cache, "expected_folder", lambda: folder)
    assert cache_folder.__wrapped__() is None


def test_a_missing_folder_is_made(tmp_path, monkeypatch) -> None:
    folder = tmp_path / "cache" / "compiled-0"
    monkeypatch.setattr(code_cache, "expected_folder", lambda: folder)
    assert cache_folder.__wrapped__() == folder
    assert list(folder.iterdir()) == []


@pytest.mark.slow
def test_a_run_without_a_cache_is_the_same(tmp_path, first: dict) -> None:
    """In a home that is a file, nothing can be stored: all is compiled, and nothing is left."""
    (tmp_path / "home").write_text("")
    places = {name: str(tmp_path / "home") for name in ("HOME", "XDG_CACHE_HOME", "LOCALAPPDATA")}
    found, cache = simulate_in_a_process(**places)
    assert found["folder"] is None
    assert {**found, "folder": first["folder"]} == first
    assert "saved" not in cache
    assert os.listdir(tmp_path) == ["home"]


def test_only_the_newest_folders_are_kept(tmp_path, monkeypatch) -> None:
    folders = [tmp_path / f"compiled-{k}" for k in range(7)]
    for k, folder in enumerate(folders):
        folder.mkdir()
        (folder / "code").write_text("")
        os.utime(folder, (time.time() + k, time.time() + k))
    (tmp_path / "other").mkdir()
    own = folders[0]
    monkeypatch.setattr(code_cache, "cache_folder", lambda: own)
    assert not code_cache.is_compiled()
    mark_compiled()
    assert code_cache.is_compiled()
    kept = sorted(path.name for path in tmp_path.iterdir())
    assert kept == ["compiled-0", "compiled-4", "compiled-5", "compiled-6", "other"]
