"""The package as it is installed: its data, its names, and what importing it costs."""

import ast
import subprocess
import sys
import tomllib
from importlib import metadata
from importlib.resources import files
from pathlib import Path

import pytest

from tests.paths import ROOT

PACKAGES = ("generator", "springs", "plots")
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
MODULES = sorted(path for package in PACKAGES for path in (ROOT / package).rglob("*.py"))
LONGEST = 600

# A library, and the one folder that may import it.
WALLS = {"exudyn": "generator/simulation", "matplotlib": "plots"}

IMPORT_ALL = """
import importlib, pkgutil, sys
import generator, springs
for package in (generator, springs):
    for found in pkgutil.walk_packages(package.__path__, package.__name__ + "."):
        if not found.name.startswith("generator.simulation."):
            importlib.import_module(found.name)
print(*sorted({"exudyn", "matplotlib", "mujoco"} & set(sys.modules)))
"""


def imported_names(module: Path) -> set[str]:
    """The first parts of the names of all that a module imports, inside functions too."""
    names: set[str] = set()
    for node in ast.walk(ast.parse(module.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            names |= {alias.name.partition(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module is not None:
            names.add(node.module.partition(".")[0])
    return names


@pytest.fixture(scope="module")
def distribution() -> metadata.Distribution:
    """The installed distribution; a bare source tree has none."""
    try:
        return metadata.distribution(PROJECT["name"])
    except metadata.PackageNotFoundError:
        pytest.skip("the project is not installed here: pip install -e .")


def test_the_walls_are_looked_for_where_modules_are():
    assert len(MODULES) > 20
    for folder in WALLS.values():
        assert any(path.is_relative_to(ROOT / folder) for path in MODULES)


@pytest.mark.parametrize("name", ["prototype.fig", "eltorso.pss"])
def test_the_figures_are_found_as_resources(name: str):
    assert (files("figures") / name).read_text(encoding="utf-8").strip()


@pytest.mark.parametrize("package", PACKAGES)
def test_the_packages_say_that_they_are_typed(package: str):
    assert (files(package) / "py.typed").is_file()


def test_importing_all_but_the_engine_loads_no_slow_library():
    done = subprocess.run(
        [sys.executable, "-c", IMPORT_ALL], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip() == ""


@pytest.mark.parametrize(("library", "room"), WALLS.items())
def test_a_library_stays_in_its_room(library: str, room: str):
    outside = [path for path in MODULES if not path.is_relative_to(ROOT / room)]
    assert [str(path) for path in outside if library in imported_names(path)] == []


def test_no_module_is_too_long():
    lengths = {path: path.read_text(encoding="utf-8").count("\n") for path in MODULES}
    assert {str(path): lines for path, lines in lengths.items() if lines > LONGEST} == {}


def test_the_installed_version_is_that_of_the_project(distribution: metadata.Distribution):
    assert distribution.version == PROJECT["version"]


def test_the_command_is_mover(distribution: metadata.Distribution):
    commands = {entry.name: entry for entry in distribution.entry_points}
    assert callable(commands["mover"].load())


def test_the_metadata_keep_it_from_being_uploaded(distribution: metadata.Distribution):
    assert "Private :: Do Not Upload" in distribution.metadata.get_all("Classifier", [])


def test_the_licence_is_installed(distribution: metadata.Distribution):
    assert distribution.metadata["License-Expression"] == "BSD-3-Clause"
    assert "the exudyn-mover authors" in (ROOT / "LICENSE").read_text(encoding="utf-8")
