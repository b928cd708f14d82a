"""Pictures for a paper: signs, fonts, what stands beside them, and what does not fit."""

import re
from dataclasses import replace
from pathlib import Path

import pytest

from generator.diagnostics import MoverError
from plots.canvas import create_panels, draw_plate, plot_style
from plots.medium import Medium, current_medium, drawing_for, typographic
from plots.plate import FailedPlate
from plots.run import make_plate
from tests.command import mover, run
from tests.tiny_plates import TARGETS, spring


@pytest.mark.parametrize(
    ("text", "typeset"),
    [
        ("angle [deg]", "angle [°]"),
        ("from -12.5 to 97.4 deg", "from −12.5 to 97.4°"),
        ("simulated - published", "simulated − published"),
        ("passive-torque, 2007-2010", "passive-torque, 2007-2010"),
        ("N m s/deg", "N m s/°"),
        ("degrees", "degrees"),
    ],
)
def test_degree_and_minus_signs(text: str, typeset: str) -> None:
    assert typographic(text) == typeset


@pytest.mark.parametrize("width", [85, 174])
def test_a_plate_for_a_paper(width: int) -> None:
    with drawing_for(Medium.paper(width)), plot_style():
        figure, ((axes,),) = create_panels(3.0, 1)
        axes.plot([0.0, -1.0])
        plate = draw_plate(replace(spring(), figure=figure))
    assert [Path(name).suffix for name in plate.files] == [".pdf", ".svg", ".txt", ".bib", ".csv"]
    (size,) = re.findall(rb"/MediaBox \[ 0 0 ([\d.]+)", plate.pdf)
    assert float(size) == pytest.approx(width * 72.0 / 25.4, abs=0.01)
    assert b"/FontFile2" in plate.pdf
    text, references = plate.files["spring.txt"], plate.files["spring.bib"]
    assert spring().title in text
    assert all(reference in text for reference in spring().references)
    assert references.count("@misc{") == len(spring().references)
    assert not current_medium().is_paper


def test_a_picture_for_a_paper_has_no_title_and_is_the_same_each_time() -> None:
    with drawing_for(Medium.paper(174)):
        plate, again = draw_plate(spring()), draw_plate(spring())
    assert plate == again
    assert b"<!-- A spring" not in plate.svg
    assert b"<!-- A spring" in draw_plate(spring()).svg


def test_panels_side_by_side_do_not_fit_a_column() -> None:
    with drawing_for(Medium.paper(85)), plot_style():
        figure, panels = create_panels(3.0, 1, 3)
        for axes in panels[0]:
            axes.plot([0.0, 1.0])
    refusal = pytest.raises(MoverError, match="do not fit a column of 85 mm: use --width 174")
    with drawing_for(Medium.paper(85)), refusal:
        draw_plate(replace(spring(), figure=figure))


def test_a_worker_draws_for_its_medium() -> None:
    plate = make_plate("spring", TARGETS["spring"], Medium.paper(85))
    assert not isinstance(plate, FailedPlate)
    assert plate.pdf is not None


@pytest.mark.slow
def test_the_command_writes_for_a_paper_without_a_report(tmp_path: Path) -> None:
    run("plots", "elbow", "--for", "paper", "--width", 85, "-o", tmp_path)
    assert {path.suffix for path in tmp_path.iterdir()} == {".pdf", ".svg", ".txt", ".bib", ".csv"}
    refused = mover("plots", "elbow", "--width", 85, "-o", tmp_path)
    assert (refused.exit_code, refused.stderr) == (2, "error: --width is for --for paper\n")
