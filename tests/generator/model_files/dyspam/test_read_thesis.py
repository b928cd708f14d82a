"""The thesis's own figures: 3.4 in the figure language, 3.1 to 3.3 as its simulator got it.

The two differ in stiffness and inertia, so that only the rest can be compared.
"""

from importlib.resources import files
from math import radians
from pathlib import Path
from shutil import copytree

import numpy as np
import pytest

from generator import read_figure
from generator.model_files.dyspam import read as dyspam_reader
from generator.model_files.dyspam import write as dyspam
from generator.model_files.dyspam.tables import Times
from generator.springs_file.optional import OPTIONAL_FILE
from generator.springs_file.read import load_springs

PRINTED = Path(__file__).parent / "figures_3_1_to_3_3"
SHIPPED = Path(str(files("figures")))


def written(name: str, folder: Path, **options: Times) -> dict[str, str]:
    figure = read_figure(SHIPPED / f"{name}.fig")
    springs = load_springs(figure, SHIPPED, name).value
    assert springs is not None
    dyspam.format_files(figure, springs, folder, **options).write()
    return {file: (folder / file).read_text() for file in dyspam.FILES}


def rows(text: str) -> list[list[str]]:
    return [line.split() for line in text.splitlines()]


@pytest.fixture
def pendulum(tmp_path: Path) -> list[list[str]]:
    return rows(written("pendulum", tmp_path / "out")[dyspam.TABLES])


@pytest.fixture
def printed() -> list[list[str]]:
    return rows((PRINTED / dyspam.TABLES).read_text())


@pytest.mark.parametrize(
    ("rows", "columns"),
    [
        pytest.param(slice(0, 9), slice(None), id="joint table and triads"),
        pytest.param(slice(9, 10), slice(3), id="point and mass of the body"),
        pytest.param(slice(10, 13), slice(None), id="points of interest"),
        pytest.param(slice(13, 16), slice(1), id="joint of each spring"),
        pytest.param(slice(13, 16), slice(4, 5), id="axis of each spring"),
    ],
)
def test_tables_are_those_of_figure_3_2_to_the_letter(pendulum, printed, rows, columns):
    assert [row[columns] for row in pendulum[rows]] == [row[columns] for row in printed[rows]]


def test_initial_angles_are_those_of_figure_3_2_in_its_six_decimals(pendulum, printed):
    assert [f"{float(word):.6f}" for word in pendulum[16][1:4]] == printed[16][1:4]
    assert pendulum[16][4:] == printed[16][4:]
    assert [float(word) for word in pendulum[16][1:3]] == pytest.approx([radians(20), radians(40)])
    assert len(pendulum) == len(printed)


def test_structure_is_figure_3_1(tmp_path):
    made = written("pendulum", tmp_path / "out", times=Times(0.0, 0.1, 30.0, 0.3))
    ours, theirs = (
        [line.replace(",", " ").replace("/", " ").split() for line in text.splitlines()]
        for text in (made[dyspam.STRUCTURE], (PRINTED / dyspam.STRUCTURE).read_text())
    )
    assert [list(map(float, row)) for row in ours] == [list(map(float, row)) for row in theirs]


@pytest.mark.parametrize(
    ("name", "counts"),
    [("pendulum", "1, 1, 3"), ("prototype", "10, 10, 22"), ("fourbar", "3, 4, 1")],
)
def test_bodies_joints_and_freedoms_are_counted_in_closed_loops_too(name, counts, tmp_path):
    assert written(name, tmp_path / "out")[dyspam.STRUCTURE].splitlines()[0] == counts


def test_jackforce_is_figure_3_3(tmp_path):
    made = rows(written("pendulum", tmp_path / "out")[dyspam.LOADS])
    assert made[0][:3] == ["1", "3", "100.00"]
    assert [[float(word) for word in row] for row in made] == [[1.0, 3.0, 100.0, 0.0, 0.0]]


def test_optional_is_that_of_appendix_a_number_for_number(tmp_path):
    made = OPTIONAL_FILE.parse_text(written("prototype", tmp_path / "out")[dyspam.OPTIONAL])
    appendix = OPTIONAL_FILE.parse_text((SHIPPED / "prototype.optional").read_text())
    assert made.diagnostics == appendix.diagnostics == ()
    assert len(made.value) == 19
    assert made.value == appendix.value


@pytest.fixture
def mended(tmp_path: Path) -> Path:
    """The printed figures with the moment of inertia of figure 3.4, 50 in place of 250."""
    folder = tmp_path / "mended"
    copytree(PRINTED, folder)
    tables = folder / dyspam.TABLES
    tables.write_text(tables.read_text().replace(" 250.000000", " 50.000000"))
    return folder


def test_the_inertia_of_figure_3_2_is_one_that_no_body_has():
    (fault,) = dyspam_reader.parse_dyspam(PRINTED).diagnostics
    assert "no body has the inertia of `body1`" in fault.message
    assert fault.span is not None
    assert fault.span.line == 10


def test_the_printed_figures_are_read(mended):
    reading = dyspam_reader.parse_dyspam(mended)
    assert reading.diagnostics == ()
    assert [loss.what for loss in reading.value.losses.entries] == [
        "the times of the simulation, 0 to 30 s with a step of 0.1 s and a frame of 0.3 s"
    ]
    figure = reading.value.figure
    assert figure is not None
    (joint,) = figure.joints.values()
    assert joint.displacement == (0.0, 0.698132, 0.349066)
    assert joint.stiff == pytest.approx((1e-4, 5e-5, 8e-5))
    assert joint.damp == pytest.approx((6e-5,) * 3)
    body = figure.segments["body1"]
    assert body.mass == 0.025
    assert body.inertia == (5e-6, 5e-6, 5e-6)
    assert body.sites["CM"].global_force == (1e-3, 0.0, 0.0)
    assert np.array_equal(body.sites["point2"].pose_in_segment[:3, 3], [1.5, 0.0, -0.15])


def test_the_printed_figures_are_the_pendulum_in_geometry(mended):
    """The site of figure 3.4, turned by xyz(-45,-90,-45) deg, is the triad of figure 3.2."""
    pendulum = read_figure(SHIPPED / "pendulum.fig")
    figure = dyspam_reader.parse_dyspam(mended).value.figure
    assert figure is not None
    for ref, name in (("floor", "ground"), ("link1", "body1")):
        site = "dist" if ref == "floor" else "prox"
        ours = pendulum.segments[ref].sites[site].pose_in_segment
        theirs = figure.segments[name].sites["joint1"].pose_in_segment
        assert np.allclose(ours, theirs, atol=1e-12)
