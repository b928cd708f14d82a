"""The folder of compiled code: its name, folders that cannot be written, and a second process."""

import json
import os
import pickle
import subprocess
import sys
import time
from pathlib import Path

import pytest

from generator.simulation.compiled import code_cache
from generator.simulation.compiled.code_cache import (
    cache_folder,
    cache_warning,
    expected_folder,
    mark_compiled,
    planting_risk,
)
from tests.command import run
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


def test_the_folder_is_named_by_the_sources(monkeypatch) -> None:
    paths = [
        *PACKAGE.glob("*.py"),
        *(ROOT / "generator/contact").glob("*.py"),
        ROOT / "springs/contact.py",
    ]
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
    assert folder.stat().st_mode & 0o077 == folder.parent.stat().st_mode & 0o077 == 0


posix = pytest.mark.skipif(os.name != "posix", reason="rights of files")
superuser = pytest.mark.skipif(
    not hasattr(os, "geteuid") or os.geteuid() != 0, reason="files of other users"
)

NOBODY = 65534


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder of compiled code, with a file."""
    folder = tmp_path / "cache" / "compiled-0"
    folder.mkdir(parents=True)
    for path in (tmp_path, folder.parent, folder):
        path.chmod(0o755)
    (folder / "sub").mkdir()
    (folder / "sub" / "code.nbi").write_bytes(b"")
    return folder


@pytest.mark.parametrize("name", ["..", ".", "sub", "sub/code.nbi"])
@posix
def test_what_others_may_write_is_not_used(folder: Path, monkeypatch, name: str) -> None:
    monkeypatch.setattr(code_cache, "expected_folder", lambda: folder)
    assert planting_risk(folder) is None
    assert cache_folder.__wrapped__() == folder
    path = folder.joinpath(name)
    path.chmod(path.stat().st_mode | 0o002)
    assert cache_folder.__wrapped__() is None
    text = cache_warning.__wrapped__()
    assert f"others may write to `{path.resolve()}`" in text
    assert ("chmod go-w" if name == ".." else "remove") in text


@posix
def test_a_link_through_a_folder_of_others_is_not_followed(folder: Path, tmp_path: Path) -> None:
    (tmp_path / "open").mkdir()
    link = tmp_path / "open" / "link"
    link.symlink_to(folder.parent)
    assert planting_risk(link / folder.name) is None
    link.parent.chmod(0o777)
    assert "chmod go-w" in str(planting_risk(link / folder.name))
    link.parent.chmod(0o1777)  # in which others cannot replace the link
    assert planting_risk(link / folder.name) is None


@posix
def test_others_may_write_beside_it_in_a_sticky_folder(folder: Path) -> None:
    folder.parent.chmod(0o1777)
    assert planting_risk(folder) is None
    folder.chmod(0o1777)
    assert planting_risk(folder) is not None


@superuser
@pytest.mark.parametrize("name", ["..", ".", "sub", "sub/code.nbi"])
def test_what_is_of_another_user_is_not_used(folder: Path, name: str) -> None:
    os.chown(folder / name, NOBODY, -1)
    assert "another user's" in str(planting_risk(folder))


@superuser
@pytest.mark.parametrize("name", ["..", ".", "sub", "sub/code.nbi"])
def test_a_group_counts_as_others_unless_it_is_the_user_s(folder: Path, name: str) -> None:
    path = folder.joinpath(name)
    path.chmod(0o770)
    assert planting_risk(folder) is None  # of the superuser's own group
    os.chown(path, -1, NOBODY)
    assert "others may write" in str(planting_risk(folder))


@superuser
def test_leaves_nothing_in_the_home_of_another_user(tmp_path: Path, monkeypatch) -> None:
    os.chown(tmp_path, NOBODY, -1)
    monkeypatch.setattr(code_cache, "expected_folder", lambda: tmp_path / "cache" / "compiled-0")
    assert cache_folder.__wrapped__() is None
    assert list(tmp_path.iterdir()) == []


COMPILE = """
import sys
from pathlib import Path
from generator.simulation.compiled import code_cache
code_cache.expected_folder = lambda: Path(sys.argv[1])
from generator.simulation.compiled.compiler import REAL, compile_source
compile_source("def double(x):\\n    return x + x\\n", "double", REAL(REAL))
"""


class Planted:
    """A pickled object that creates a folder when it is loaded."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def __reduce__(self):
        return os.mkdir, (str(self.folder),)


@pytest.mark.slow
@posix
def test_a_planted_program_does_not_run(tmp_path: Path) -> None:
    folder, trace = tmp_path / "cache", tmp_path / "trace"

    def compile_in_a_process() -> None:
        subprocess.run([sys.executable, "-c", COMPILE, str(folder)], env=ENVIRONMENT, check=True)

    compile_in_a_process()
    stored = [*folder.rglob("*.nbi")]
    assert stored
    for path in stored:
        path.write_bytes(pickle.dumps(Planted(trace)))
    folder.chmod(0o777)
    compile_in_a_process()
    assert not trace.exists()
    folder.chmod(0o700)  # the test would notice
    compile_in_a_process()
    assert trace.exists()


@posix
def test_a_run_without_a_cache_says_so_once(folder: Path, monkeypatch) -> None:
    assert "could put" not in run("simulate", "pendulum", "--stop", "0.1").stderr
    folder.chmod(0o777)
    cache_folder.cache_clear()
    cache_warning.cache_clear()
    monkeypatch.setattr(code_cache, "expected_folder", lambda: folder)
    try:
        found = run("simulate", "pendulum", "--stop", "0.1")
    finally:
        cache_folder.cache_clear()
        cache_warning.cache_clear()
    assert found.stderr.count("could put programs into its cache") == 1
    assert f"`{folder}`; remove `{folder}`" in found.stderr
    assert [path.name for path in folder.rglob("*")] == ["sub", "code.nbi"]
    assert "compiled; accelerations differ" in found.stdout


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
