"""docs/figure-language.md: its examples mean what the page says; a table lists the files."""

import re

import numpy as np
import pytest

from generator.figure import Figure
from generator.figure_file.read import FIGURE_FILE
from generator.springs_file.parse import SPRINGS_FILE
from generator.springs_file.read import load_springs
from generator.text_io import make_source
from springs import total_torque
from tests.paths import DOCS, FIGURES

PAGE = (DOCS / "figure-language.md").read_text(encoding="utf-8")


def block(language: str) -> str:
    found = re.search(rf"^```{language}\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL)
    assert found is not None
    return found[1]


def double_pendulum() -> Figure:
    reading = FIGURE_FILE.parse(make_source(block(""), "figure-language.md"))
    assert reading.diagnostics == ()
    assert reading.value is not None
    return reading.value


def test_the_figure_is_read_without_a_word() -> None:
    figure = double_pendulum()
    assert figure.degrees_of_freedom == 4
    assert figure.total_mass == 3.0
    assert figure.segments["hand"].inertia == (8e-4, 8e-4, 2e-4)
    assert figure.segments["hand"].sites["tip"].global_force == (0.5, 0.0, 0.0)


def test_its_springs_are_its_own() -> None:
    springs = load_springs(double_pendulum()).value
    assert springs is not None
    assert len(springs.joints["wrist"].axes) == 3
    (hinge,) = springs.joints["shoulder"].axes
    assert hinge.damping.viscous == 0.05
    assert total_torque(hinge.elastic, np.radians(119.0)) == 0.0
    assert total_torque(hinge.elastic, np.radians(125.0)) < -10.0


def test_the_springs_file_is_read_without_a_fault() -> None:
    reading = SPRINGS_FILE.parse(make_source(block("toml"), "figure-language.md"))
    assert reading.diagnostics == ()
    assert reading.value is not None
    (entry,) = reading.value.entries
    assert entry.joints == ("left_elbow", "right_elbow")
    assert entry.law.coefficients == (1.014, 29.224, -6.13885, 214.423)
    assert entry.law.dead_zone == pytest.approx((0.0, np.radians(97.4)), rel=1e-15)


def test_every_shipped_figure_is_in_the_table() -> None:
    folder = FIGURES
    page = (folder / "README.md").read_text(encoding="utf-8")
    for path in folder.iterdir():
        if path.suffix in {".fig", ".toml", ".optional"}:
            assert f"`{path.name}`" in page
