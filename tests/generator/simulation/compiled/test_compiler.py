"""Compiled functions, with and without a folder in which they can be stored."""

import os
import subprocess
import sys

import numpy as np
import pytest
from numba import types

from generator.simulation.compiled import code_cache, compiler
from generator.simulation.compiled.compiler import (
    NOTHING,
    REAL,
    VECTOR,
    compile_source,
    compiled,
)
from tests.processes import ENVIRONMENT

SIGNATURE = types.void(VECTOR, types.float64)


def source(factor: float) -> str:
    return f"import math\n\n\ndef scale(a, x):\n    a[0] = {factor} * math.sin(x)\n"


@pytest.mark.parametrize("is_stored", [True, False])
def test_generated_source_is_compiled(monkeypatch, tmp_path, is_stored) -> None:
    folder = tmp_path if is_stored else None
    monkeypatch.setattr(compiler, "cache_folder", lambda: folder)
    values = np.zeros(1)
    for factor in (2.0, -3.5):
        made = compile_source.__wrapped__(source(factor), "scale", SIGNATURE)
        made.function(values, 0.4)
        assert values[0] == pytest.approx(factor * np.sin(0.4), rel=1e-15)
    names = {path.suffix for path in tmp_path.rglob("*") if path.is_file()}
    assert names == ({".py", ".nbi", ".nbc", ".lock"} if is_stored else set())
    assert len(list(tmp_path.glob("*.py"))) == (2 if is_stored else 0)


def test_a_folder_that_is_removed_meanwhile_is_made_again(monkeypatch, tmp_path) -> None:
    """Another version keeps its newest folders only, while this one is still at work."""
    folder = tmp_path / "removed"
    monkeypatch.setattr(compiler, "cache_folder", lambda: folder)
    values = np.zeros(1)
    compile_source.__wrapped__(source(5.0), "scale", SIGNATURE).function(values, 0.4)
    assert values[0] == pytest.approx(5.0 * np.sin(0.4), rel=1e-15)
    assert len(list(folder.glob("*.py"))) == 1


@pytest.mark.parametrize("suffix", [".nbi", ".nbc"])
@pytest.mark.parametrize("length", [0, 100])
def test_a_stored_file_that_is_cut_short_is_made_again(
    monkeypatch, tmp_path, suffix, length
) -> None:
    for module in (compiler, code_cache):
        monkeypatch.setattr(module, "cache_folder", lambda: tmp_path)
    for _ in range(3):
        values = np.zeros(1)
        compile_source.__wrapped__(source(7.0), "scale", SIGNATURE).function(values, 0.4)
        assert values[0] == pytest.approx(7.0 * np.sin(0.4), rel=1e-15)
        (stored,) = (path for path in tmp_path.rglob("*") if path.suffix == suffix)
        assert stored.stat().st_size > 100
        os.truncate(stored, length)


COMPILE = f"""
import numba
from generator.simulation.compiled.compiler import compile_source
text = {source(9.0)!r}
compile_source(text, "scale", numba.void(numba.float64[::1], numba.float64))
"""


def test_what_is_stored_loads_without_what_compilation_needs(tmp_path) -> None:
    """numba's implementations of numpy take as long to import as all else of a start."""
    environment = {**ENVIRONMENT, "XDG_CACHE_HOME": str(tmp_path)}
    asked = f'{COMPILE}\nimport sys\nprint("numba.np.arraymath" in sys.modules)'
    command = [sys.executable, "-c", asked]
    for is_loaded in ("True", "False"):
        done = subprocess.run(command, env=environment, check=True, capture_output=True, text=True)
        assert done.stdout.strip() == is_loaded


def test_of_several_processes_one_compiles(tmp_path) -> None:
    """Its code is that of all, so that they round alike."""
    environment = {**ENVIRONMENT, "NUMBA_DEBUG_CACHE": "1", "XDG_CACHE_HOME": str(tmp_path)}
    command = [sys.executable, "-c", COMPILE]
    processes = [
        subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, text=True)
        for _ in range(3)
    ]
    said = [process.communicate()[0] for process in processes]
    assert [process.returncode for process in processes] == [0, 0, 0]
    assert sorted("data saved" in text for text in said) == [False, False, True]
    assert sorted("data loaded" in text for text in said) == [False, True, True]


def test_infinity_and_not_a_number_keep_their_meaning(monkeypatch) -> None:
    monkeypatch.setattr(compiler, "cache_folder", lambda: None)

    @compiled(REAL, REAL, REAL, entry=True)
    def divide(a, b):
        if a != a:
            return 7.0
        return a / b

    assert divide(1.0, 0.0) == np.inf
    assert divide(np.nan, 1.0) == 7.0
    assert np.isnan(divide(np.inf, np.inf))


def test_a_pointer_can_be_an_argument(monkeypatch) -> None:
    """A function that takes laws is compiled once for all of them."""
    monkeypatch.setattr(compiler, "cache_folder", lambda: None)

    @compiled(NOTHING, types.FunctionType(SIGNATURE), VECTOR, entry=True)
    def call(law, a):
        law(a, 0.4)

    values = np.zeros(1)
    for factor in (1.5, 4.0):
        call(compile_source.__wrapped__(source(factor), "scale", SIGNATURE), values)
        assert values[0] == pytest.approx(factor * np.sin(0.4), rel=1e-15)
