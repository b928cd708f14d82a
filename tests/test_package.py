"""The package as it is installed: its data, its names, and what importing it costs."""

import re
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from dataclasses import replace
from importlib import metadata
from importlib.resources import files
from pathlib import Path

import pytest

import generator
from tests.contact_figures import FLOOR, block
from tests.paths import ROOT

PACKAGES = ("generator", "springs", "plots")
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]

IMPORT_ALL = """
import importlib, pkgutil, sys
import generator, springs
for package in (generator, springs):
    for found in pkgutil.walk_packages(package.__path__, package.__name__ + "."):
        if not found.name.startswith("generator.simulation."):
            importlib.import_module(found.name)
print(*sorted({"exudyn", "matplotlib", "mujoco"} & set(sys.modules)))
"""


@pytest.fixture(scope="module")
def distribution() -> metadata.Distribution:
    """The installed distribution; a bare source tree has none."""
    try:
        return metadata.distribution(PROJECT["name"])
    except metadata.PackageNotFoundError:
        pytest.skip("the project is not installed here: pip install -e .")


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


def test_the_installed_version_is_that_of_the_project(distribution: metadata.Distribution):
    assert distribution.version == PROJECT["version"]


def test_the_command_is_mover(distribution: metadata.Distribution):
    commands = {entry.name: entry for entry in distribution.entry_points}
    assert callable(commands["mover"].load())


def test_the_metadata_keep_it_from_being_uploaded(distribution: metadata.Distribution):
    assert "Private :: Do Not Upload" in distribution.metadata.get_all("Classifier", [])


def test_the_constraints_of_ci_are_names_and_versions():
    lines = (ROOT / "requirements-ci.txt").read_text(encoding="utf-8").splitlines()
    pinned = [line for line in lines if not line.startswith("#")]
    assert len(pinned) > 50
    assert [line for line in pinned if not re.fullmatch(r"[\w.-]+==[\w.]+", line)] == []


def test_the_licence_is_installed(distribution: metadata.Distribution):
    assert distribution.metadata["License-Expression"] == "BSD-3-Clause"
    assert "the exudyn-mover authors" in (ROOT / "LICENSE").read_text(encoding="utf-8")


def test_every_public_name_is_imported_and_a_wrong_one_has_a_hint():
    assert all(getattr(generator, name) is not None for name in generator.__all__)
    assert set(generator.__all__) <= set(dir(generator))
    with pytest.raises(AttributeError, match="no attribute 'read_figur'; did you mean 'read_figu"):
        _ = generator.read_figur


def public_values(folder: Path) -> Iterator[object]:
    """Values that a script gets from the public names."""
    person = generator.build_person(generator.estimate_measures(generator.Sex.MALE, 1.75, 75.0))
    yield from (person, person.measures, person.body, person.model, person.riener_model)
    yield from (person.springs_file, person.figure, *person.passive_axes, *person.sources[:3])
    yield from (*person.surfaces.values(), *person.model.springs.joints.values())
    figure = person.figure
    yield from (figure.segments, figure.joints, *figure.segments.values(), *figure.joints.values())
    yield from (site for segment in figure.segments.values() for site in segment.sites.values())
    tree = generator.build_tree(figure)
    yield tree
    yield generator.forward_kinematics(tree, generator.initial_displacements(tree))
    yield from (generator.Scene.floor(), *generator.Scene.floor().props)
    yield generator.read_study("falls")
    yield generator.stability((0.0, 1.0, 0.0), [(0.0, 0.0, 0.0)])
    figure, plan = block(0.2), generator.Plan(stop=0.04, scene=FLOOR, springs=person.model.springs)
    yield plan
    plan = replace(plan, springs=None)
    yield from (generator.build_model(figure, plan), generator.Stepper(figure, plan))
    recording = generator.simulate(figure, plan)
    yield from (recording, recording.contact, recording.outcome, recording.accuracy)
    yield from (recording.displacements, recording.poses, recording.energy)
    for name in ("motion.action", "motion.npz"):
        recording.write(folder / name)
    yield generator.read_action(folder / "motion.action")


def test_every_public_value_is_shown_in_two_lines_at_most(tmp_path: Path):
    long = {
        type(value).__name__: len(repr(value))
        for value in public_values(tmp_path)
        if len(repr(value)) > 200 or "\n" in repr(value)
    }
    assert long == {}
