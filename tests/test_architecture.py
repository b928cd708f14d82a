"""Arrows between modules, the size of the packages, and the mirror of the packages in the tests.

Imports inside functions and under TYPE_CHECKING count too; import-linter leaves the latter out.
"""

import ast
import tomllib
import warnings
from collections.abc import Iterator
from functools import cache
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

from tests.paths import ROOT, TESTS

PACKAGES = ("generator", "springs", "plots")
LONG_MODULE = 800

# A library, and the one folder or module that may import it.
WALLS = {
    "dask": "generator/study/cluster.py",
    "distributed": "generator/study/cluster.py",
    "exudyn": "generator/simulation",
    "matplotlib": "plots",
    "numba": "generator/simulation/compiled",
    "viser": "generator/viewer",
}

# Folders of tests that follow a subject through several modules.
NOT_MIRRORED = ("physics", "properties", "docs", "faults")


def dotted(path: Path) -> str:
    """The name by which a file is imported."""
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


FILES = {dotted(path): path for name in PACKAGES for path in sorted((ROOT / name).rglob("*.py"))}


def statements(inside: ast.AST) -> Iterator[ast.AST]:
    """All statements at any depth; imports do not occur in expressions, which are not visited."""
    for name in ("body", "handlers", "cases", "orelse", "finalbody"):
        for statement in getattr(inside, name, ()):
            yield statement
            yield from statements(statement)


def imports(source: str) -> Iterator[str]:
    """All names that a module imports, at any depth: `a.b` and `a.b.c` for `from a.b import c`."""
    for node in statements(ast.parse(source)):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.module, "a relative import"
            for alias in node.names:
                full = f"{node.module}.{alias.name}"
                yield full if full in FILES else node.module


@cache
def sources() -> dict[str, str]:
    """Text of each module."""
    return {name: path.read_text(encoding="utf-8") for name, path in FILES.items()}


@cache
def all_imports() -> dict[str, set[str]]:
    """Names that each module imports; not found as the tests are collected, since it takes long."""
    return {name: set(imports(source)) - {name} for name, source in sources().items()}


def lies_in(module: str, package: str) -> bool:
    return module == package or module.startswith(package + ".")


def contracts() -> Iterator[tuple[str, list[list[str]]]]:
    """Container ("" is the root) and layers from the top, of each contract in pyproject.toml."""
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    for contract in settings["tool"]["importlinter"]["contracts"]:
        if contract["type"] == "layers":
            layers = [layer.split("|") for layer in contract["layers"]]
            for container in contract.get("containers", [""]):
                yield container, [[name.strip() for name in layer] for layer in layers]


def test_no_circle_of_imports():
    inside = {name: targets & FILES.keys() for name, targets in all_imports().items()}
    try:
        TopologicalSorter(inside).prepare()
    except CycleError as error:
        pytest.fail(" -> ".join(reversed(error.args[1])))


@pytest.mark.parametrize(("container", "layers"), list(contracts()))
def test_imports_at_any_depth_keep_to_the_layers(container: str, layers: list[list[str]]):
    prefix = container and container + "."
    room_of = {
        module: (depth, room)
        for depth, rooms in enumerate(layers)
        for room in rooms
        for module in FILES
        if lies_in(module, prefix + room)
    }
    upwards = [
        f"{module} -> {target}"
        for module, (depth, room) in room_of.items()
        for target in all_imports()[module] & room_of.keys()
        if room_of[target][0] < depth
        or (room_of[target][0] == depth and room_of[target][1] != room)
    ]
    assert upwards == []


def test_every_module_of_the_generator_has_a_layer():
    layers = dict(contracts())["generator"]
    rooms = {name for layer in layers for name in layer}
    here = {name.split(".")[1] for name in FILES if name.startswith("generator.")}
    assert here == rooms


@pytest.mark.parametrize(("library", "room"), WALLS.items())
def test_a_library_stays_in_its_room(library: str, room: str):
    users = [
        name
        for name, targets in all_imports().items()
        if any(lies_in(target, library) for target in targets)
    ]
    assert users
    assert [name for name in users if not FILES[name].is_relative_to(ROOT / room)] == []


@pytest.fixture(scope="module", autouse=True)
def _warn_of_long_modules() -> None:
    """Name the modules that a reader would want in parts; a cap would shape them instead."""
    lines = {name: source.count("\n") for name, source in sources().items()}
    for name, count in lines.items():
        if count > LONG_MODULE:
            warnings.warn(f"{name} has {count} lines", stacklevel=1)


def mirrored(test: Path) -> bool:
    """Tell whether `tests/a/test_b.py` or `tests/a/test_b_aspect.py` has a module `a/b.py`."""
    folder = ROOT / test.parent.relative_to(TESTS)
    words = test.stem.removeprefix("test_").split("_")
    names = ["_".join(words[:count]) for count in range(1, len(words) + 1)]
    return any((folder / f"{name}.py").is_file() or (folder / name).is_dir() for name in names)


def test_the_tests_mirror_the_packages():
    inner = [path for path in TESTS.rglob("test_*.py") if path.parent != TESTS]
    tests = [path for path in inner if path.relative_to(TESTS).parts[0] not in NOT_MIRRORED]
    assert len(tests) > 50
    assert [str(path.relative_to(TESTS)) for path in tests if not mirrored(path)] == []


def test_kinds_of_joint_axes_are_not_compared():
    """A comparison with one kind takes any other for its opposite; the type checker cannot tell."""
    compared = [
        f"{name}:{node.lineno}"
        for name, source in sources().items()
        if "AxisKind" in source
        for node in ast.walk(ast.parse(source))
        if isinstance(node, ast.Compare)
        for side in (node.left, *node.comparators)
        if isinstance(side, ast.Attribute) and ast.unparse(side.value) == "AxisKind"
    ]
    assert not compared, "match them exhaustively, or use `is_rotation`, `twist` or `units`"
