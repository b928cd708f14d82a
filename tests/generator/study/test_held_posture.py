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
from springs.strength.strengths import Age
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


def test_ages_are_those_of_the_nearest_sample(tmp_path: Path):
    path = written(tmp_path)
    text = path.read_text(encoding="utf-8")
    age = 'age = { path = "hold.age", values = [18, 40, 41, 65, 66, 110] }\n[measures]\n'
    path.write_text(text.replace("[measures]\n", age), encoding="utf-8")
    study, model = read_study(path), Model.of(read_figure("male50"))
    pose = {f"{side}_elbow": np.radians([0.0, 90.0]) for side in ("left", "right")}
    loads = [Load("left_hand", 8.0), Load("right_hand", 8.0)]
    for years, sample in (
        *((18.0, Age.YOUNG), (40.0, Age.YOUNG), (41.0, Age.MIDDLE)),
        *((65.0, Age.MIDDLE), (66.0, Age.OLD), (110.0, Age.OLD)),
    ):
        expected = Holder.of(model, sample).posture(pose, loads)
        found = run_case(study, [8.0, 0.0, years])
        assert found.measures["m0"] == pytest.approx(expected.largest_use)
        assert found.measures["m1"] == pytest.approx(expected.percent_capable)
    assert "ages are from 18 to 110 years" in run_case(study, [8.0, 0.0, 17.0]).message


@pytest.mark.parametrize(
    ("path", "values", "measured", "message"),
    [
        ("hold.age", "[20, 60]", False, "`hold.age`: no measure is of the held posture"),
        ("hold.ages", "[20, 60]", True, "the path is written `hold.age`"),
        ("hold.age", "[12]", True, "`hold.age` cannot be 12: ages are from 18 to 110 years"),
    ],
)
def test_ages_that_no_study_has(
    tmp_path: Path, path: str, values: str, measured: bool, message: str
):
    file = written(tmp_path)
    head = file.read_text(encoding="utf-8").partition("[measures]")[0]
    column = '"hold.use [1]", take = "start"' if measured else '"left_elbow.1 [deg]", take = "last"'
    file.write_text(
        f'{head}age = {{ path = "{path}", values = {values} }}\n'
        f"[measures]\nm = {{ column = {column} }}\n",
        encoding="utf-8",
    )
    with pytest.raises(InputError) as caught:
        read_study(file)
    assert message in str(caught.value)


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
