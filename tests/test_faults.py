"""Every broken file in `tests/faults/<kind>/` gets the diagnostics in its `.expected` file.

`pytest tests/test_faults.py --update-expected` rewrites the expected diagnostics.
"""

import warnings
from collections.abc import Callable
from functools import cache
from os import sep
from pathlib import Path

import pytest

from generator.diagnostics import InputError, Parsed, Source, select_errors
from generator.figure import Figure
from generator.figure_file import FIGURE_FILE, read_figure
from generator.geometry import PSURF_FILE
from generator.geometry.validate import validate_surface
from generator.input_files.drives import DRIVES_FILE
from generator.input_files.links import LINK_ENTRIES
from generator.input_files.live import LIVE_FILE
from generator.input_files.loads import LOADS_FILE
from generator.input_files.moments import MOMENTS_FILE
from generator.input_files.pose import POSE_FILE
from generator.input_files.scene import SCENE_FILE
from generator.model_files.formats import parse_model
from generator.motion_files import ACTION_FILE, COORDINATES_FILE, motion_from_coordinates
from generator.person.measures import MEASURES_FILE, estimate_measures
from generator.person.survey import Sex
from generator.springs_file.read import load_springs
from generator.study.study_file import STUDY_FILE
from tests.paths import FAULTS, FIGURES


@cache
def prototype() -> Figure:
    return read_figure("prototype")


@cache
def joints() -> Figure:
    """A figure of joints with one, two and three axes and none."""
    return read_figure(FAULTS / "joints.fig")


def parse_springs(path: Path) -> Parsed:
    return load_springs(joints(), choice=path)


def parse_body(path: Path) -> Parsed:
    """The surface of a psurf if it encloses a body, with the diagnostics of text and surface."""
    parsed = PSURF_FILE.parse_file(path)
    if parsed.value is None:
        return parsed
    diagnostics = validate_surface(parsed.value).diagnostics
    return Parsed(None if select_errors(diagnostics) else parsed.value, diagnostics)


def parse_coordinates_of_joints(path: Path) -> Parsed:
    """The motion of the figure of joints in a table of OpenSim."""
    parsed = COORDINATES_FILE.parse_file(path)
    if parsed.value is None:
        return parsed
    return motion_from_coordinates(parsed.value, joints())


def parse_measures_of_a_man(path: Path) -> Parsed:
    """The dimensions of a man of 1.75 m and 75 kg."""
    parsed = MEASURES_FILE.parse_file(path)
    if parsed.value is None:
        return parsed
    try:
        estimate_measures(Sex.MALE, 1.75, 75.0, parsed.value)
    except InputError as failure:
        return Parsed(None, failure.diagnostics)
    return parsed


PARSERS: dict[str, Callable[[Path], Parsed]] = {
    "figure": FIGURE_FILE.parse_file,
    "pose": lambda path: POSE_FILE.parse_file(path, prototype()),
    "psurf": parse_body,
    "loads": lambda path: LOADS_FILE.parse_file(path, prototype()),
    "drives": lambda path: DRIVES_FILE.parse_file(path, prototype()),
    "moments": MOMENTS_FILE.parse_file,
    "springs": parse_springs,
    "optional": parse_springs,
    "links": lambda path: LINK_ENTRIES.parse_file(path),
    "scene": SCENE_FILE.parse_file,
    "live": LIVE_FILE.parse_file,
    "measures": parse_measures_of_a_man,
    "study": STUDY_FILE.parse_file,
    "action": ACTION_FILE.parse_file,
    "coordinates": parse_coordinates_of_joints,
    "model": lambda path: parse_model(
        Source(str(path), path.read_text(encoding="utf-8")), path.parent
    ),
}

FILES = sorted(path for path in FAULTS.glob("*/*") if path.is_file() and path.suffix != ".expected")


def test_every_kind_has_files_and_every_answer_its_file():
    assert {path.parent.name for path in FILES} == set(PARSERS)
    answers = {path.with_suffix(".expected") for path in FILES}
    assert answers == set(FAULTS.glob("*/*.expected"))
    assert len(FILES) > 180


@pytest.mark.parametrize("path", FILES, ids=lambda path: f"{path.parent.name}/{path.stem}")
def test_a_broken_file_gets_its_diagnostics(path: Path, request: pytest.FixtureRequest):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        parsed = PARSERS[path.parent.name](path)
    text = "\n".join(map(str, parsed.diagnostics)) + "\n"
    for folder in (path.parent, FIGURES):
        text = text.replace(f"{folder}{sep}", "")
    expected = path.with_suffix(".expected")
    if request.config.getoption("--update-expected"):
        expected.write_text(text, "utf-8")
    assert text == expected.read_text("utf-8")
    assert (parsed.value is None) is bool(select_errors(parsed.diagnostics))
    for diagnostic in parsed.diagnostics:
        assert diagnostic.span is not None
        assert 0 <= diagnostic.span.start <= diagnostic.span.end
        assert diagnostic.span.end <= len(diagnostic.span.source.text) + 1
