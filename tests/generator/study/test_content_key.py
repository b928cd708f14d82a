import subprocess
import sys
from dataclasses import dataclass, field, replace
from enum import Enum
from math import inf, nextafter, pi
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from generator.drive import Drive
from generator.figure_file.read import read_figure
from generator.model import Model
from generator.person.survey import Sex
from generator.study.content_key import Versions, content_key, digest, installed_versions
from generator.study.study import Measure, PersonArguments, Sensitivity, Statistic, Study
from tests.paths import FIGURES
from tests.processes import ENVIRONMENT
from tests.study_runs import pendulum_study

VERSIONS = Versions("1.2.3", "4.5.6")


def key(study: Study, versions: Versions = VERSIONS) -> str:
    return content_key(study, np.array(study.design.rows), versions)


def changed_plan(**changes: object) -> Study:
    study = pendulum_study()
    return replace(study, plan=replace(study.plan, **changes))


def heavier() -> Study:
    study = pendulum_study()
    link = study.model.figure.segments["link1"]
    figure = study.model.figure.with_parts(replace(link, mass=nextafter(25.0, 26.0)))
    return replace(study, model=replace(study.model, figure=figure))


CHANGED = {
    "stop": changed_plan(stop=nextafter(0.3, 1.0)),
    "springs": replace(pendulum_study(), model=Model(pendulum_study().model.figure)),
    "drive": changed_plan(drives={"shoulder": Drive([0.0, 1.0], np.zeros((2, 3)))}),
    "other drive": changed_plan(drives={"shoulder": Drive([0.0, 1.0], np.full((2, 3), 1e-9))}),
    "mass": heavier(),
    "points": pendulum_study(((0.9,), (1.0,), (nextafter(1.1, 2.0),))),
    "persons": replace(pendulum_study(), persons=(PersonArguments(Sex.MALE, 1.8, 80.0),)),
    "measure": replace(
        pendulum_study(),
        measures={
            **pendulum_study().measures,
            "end": Measure("end", "kinetic [J]", Statistic.LARGEST),
        },
    ),
    "order of measures": replace(
        pendulum_study(), measures=dict(reversed(pendulum_study().measures.items()))
    ),
}


def test_every_part_of_a_study_and_both_versions_have_an_effect() -> None:
    keys = [key(study) for study in (pendulum_study(), *CHANGED.values())]
    keys += [key(pendulum_study(), Versions("1.2.4", "4.5.6"))]
    keys += [key(pendulum_study(), Versions("1.2.3", "4.5.7"))]
    assert len(set(keys)) == len(CHANGED) + 3


def test_what_is_computed_from_the_rows_has_no_effect() -> None:
    study = replace(pendulum_study(), name="other", sensitivity=Sensitivity(), text="# other")
    assert key(study) == key(pendulum_study())


def test_names_of_files_have_no_effect_but_their_content_has(tmp_path: Path) -> None:
    study = pendulum_study()
    for name in ("pendulum.fig", "floor.pss", "link1.pss"):
        (tmp_path / name).write_bytes((FIGURES / name).read_bytes())

    def moved() -> Study:
        springs = replace(study.model.springs, origin="elsewhere")
        model = Model(read_figure(tmp_path / "pendulum.fig"), springs)
        return replace(study, model=model, text="other")

    assert moved().model.figure.path != study.model.figure.path
    assert key(moved()) == key(study)
    with (tmp_path / "link1.pss").open("a") as file:
        file.write("\n")
    assert key(moved()) == key(study)
    text = (tmp_path / "link1.pss").read_text().replace("153.000", "154.000")
    (tmp_path / "link1.pss").write_text(text)
    assert key(moved()) != key(study)


PRINT_KEY = """
import numpy as np
from generator.study.content_key import Versions, content_key
from tests.study_runs import pendulum_study
study = pendulum_study()
print(content_key(study, np.array(study.design.rows), Versions("1.2.3", "4.5.6")))
"""


def test_another_process_finds_the_same_key() -> None:
    for seed in ("0", "1"):
        printed = subprocess.run(
            [sys.executable, "-c", PRINT_KEY],
            env={**ENVIRONMENT, "PYTHONHASHSEED": seed},
            capture_output=True,
            text=True,
            check=True,
        )
        assert printed.stdout.strip() == key(pendulum_study()), seed


def test_the_installed_versions_are_those_of_a_sentence() -> None:
    text = str(installed_versions())
    assert text.startswith("exudyn-mover ")
    assert " and Exudyn 1." in text


class Colour(Enum):
    RED = 1
    CRIMSON = 2


@dataclass(frozen=True)
class Point:
    x: float
    name: str = field(default="", compare=False)


@dataclass(frozen=True)
class Place:
    x: float


DIFFERENT = [
    None,
    0,
    1.0,
    inf,
    -inf,
    True,
    False,
    "",
    "1",
    10**400,
    2**53 + 1,
    Colour.RED,
    Colour.CRIMSON,
    Point(1.0),
    Place(1.0),
    (),
    (1.0,),
    ((1.0,),),
    ("a", "b"),
    ("ab",),
    {},
    {"a": 1.0, "b": 2.0},
    {"b": 2.0, "a": 1.0},
    np.ones((1, 2)),
    np.ones((2, 1)),
    np.array(1.0),
]


def test_different_values_have_different_digests() -> None:
    assert len({digest(value) for value in DIFFERENT}) == len(DIFFERENT)


def test_equal_values_have_equal_digests() -> None:
    for one, other in [
        (1, 1.0),
        (0.0, -0.0),
        (np.float64(0.1), 0.1),
        (np.int64(3), 3),
        ([1, 2], (1.0, 2.0)),
        (Point(1.0, "a"), Point(1.0, "b")),
        (np.ones((2, 2)), np.asfortranarray(np.ones((2, 2)))),
    ]:
        assert digest(one) == digest(other)


@given(st.floats(allow_nan=False), st.floats(allow_nan=False))
def test_numbers_have_equal_digests_where_they_are_equal(one: float, other: float) -> None:
    assert (digest(one) == digest(other)) == (one == other)
    assert digest(one) != digest(nextafter(one, pi))


@pytest.mark.parametrize("value", [object(), b"bytes", {1}, Path("a"), digest])
def test_a_value_without_a_canonical_form_is_refused(value: object) -> None:
    with pytest.raises(TypeError, match="canonical"):
        digest(value)
