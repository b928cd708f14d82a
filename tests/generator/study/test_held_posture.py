"""Measures of the posture at the start of a run, against those of `Holder`."""

from pathlib import Path

import numpy as np
import pytest

from generator.diagnostics import InputError
from generator.figure_file import read_figure
from generator.hold.posture import Holder
from generator.hold.statics import Load
from generator.model import Model
from generator.study.held_posture import HELD_COLUMNS
from generator.study.run_case import run_case
from generator.study.study_file import read_study
from tests.command import run

STUDY = """
figure = "FIGURE"
[set]
left_elbow = [0, 90]
right_elbow = [0, 90]
[design]
kind = "grid"
[parameters]
box = { path = "load.hand", values = [0, 8] }
lean = { path = "pose.waist.3", values = [0, 20] }
[measures]
"""


def written(folder: Path, figure: str = "male50", take: str = "start") -> Path:
    path = folder / "lift.study.toml"
    rows = (
        f'm{k} = {{ column = "{column}", take = "{take}" }}\n'
        for k, column in enumerate(HELD_COLUMNS)
    )
    path.write_text(STUDY.replace("FIGURE", figure) + "".join(rows), encoding="utf-8")
    return path


def test_measures_are_those_of_the_posture(tmp_path: Path):
    study = read_study(written(tmp_path))
    holder = Holder.of(Model.of(read_figure("male50")))
    for box, lean in ((0.0, 0.0), (8.0, 20.0)):
        pose = {f"{side}_elbow": np.radians([0.0, 90.0]) for side in ("left", "right")}
        pose["waist"] = np.radians([0.0, 0.0, lean])
        expected = holder.posture(pose, [Load("left_hand", box), Load("right_hand", box)])
        found = run_case(study, [box, lean])
        assert found.succeeded, found.message
        for name, read in zip(study.measures, HELD_COLUMNS.values(), strict=True):
            value = read(expected)
            assert found.measures[name] == (None if value is None else pytest.approx(value))


def test_heavier_boxes_are_harder_to_hold(tmp_path: Path):
    study = read_study(written(tmp_path))
    light, heavy = (run_case(study, [box, 10.0]).measures for box in (2.0, 10.0))
    assert heavy["m0"] > light["m0"]
    assert heavy["m1"] < light["m1"]
    assert heavy["m3"] > light["m3"]


@pytest.mark.parametrize(
    ("figure", "take", "message"),
    [
        ("male50", "last", "is a number of the posture at the start"),
        ("prototype", "start", "needs a figure with sex and stature"),
    ],
)
def test_measures_that_no_run_has(tmp_path: Path, figure: str, take: str, message: str):
    with pytest.raises(InputError) as caught:
        read_study(written(tmp_path, figure, take))
    assert message in str(caught.value)


@pytest.mark.slow
def test_a_sweep_of_persons(tmp_path: Path):
    path = written(tmp_path)
    text = path.read_text(encoding="utf-8").replace('figure = "male50"\n', "")
    person = '[person]\nsex = "female"\nstature_m = 1.6\nmass_kg = 60\n'
    path.write_text(person + text, encoding="utf-8")
    run("sweep", path, "-o", tmp_path / "out")
    table = (tmp_path / "out" / "runs.csv").read_text(encoding="utf-8")
    assert table.count("done") == 4
