"""Study files: what is read of them, names and paths, and that no text makes the reader fail."""

from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from generator.diagnostics import Severity
from generator.figure_file import read_figure
from generator.model import Model
from generator.person.survey import Sex
from generator.simulation.falls import fall_plan
from generator.simulation.plan import Plan
from generator.springs_file.read import read_springs
from generator.study.designs import design_points, run_count
from generator.study.parameter_paths import parse_path
from generator.study.parameters import apply_values, build_case
from generator.study.study import (
    Design,
    DesignKind,
    Levels,
    LogNormal,
    Measure,
    Normal,
    Parameter,
    PersonArguments,
    Sensitivity,
    Statistic,
    Study,
    Uniform,
)
from generator.study.study_file import read_study
from generator.study.study_tables import MAX_RUNS
from springs import Stop
from tests.paths import FIGURES
from tests.study_runs import parse_study_text

EXAMPLE = """\
figure = "pendulum"
stop = 0.3
[design]
kind = "sobol"          # how to sample: grid, latin-hypercube, sobol, list
runs = 64
seed = 7
[parameters]
gravity_scale = { path = "gravity", low = 0.8, high = 1.2 }
[measures]
swing = { column = "shoulder.2 [deg]", take = "largest" }
end = { column = "kinetic [J]", take = "last" }
# [sensitivity] asks for indices
"""


def read(text: str, folder: Path = FIGURES) -> Study:
    """The study of a text without errors and warnings."""
    parsed = parse_study_text(text, folder)
    assert all(one.severity is Severity.NOTE for one in parsed.diagnostics)
    return parsed.require_value()


def test_a_study_is_its_figure_its_runs_its_parameters_and_its_measures():
    study = read(EXAMPLE)
    figure = read_figure("pendulum")
    assert study.name == "pendulum"
    assert study.model == Model.of(figure)
    assert study.plan == Plan(stop=0.3)
    assert study.design == Design(DesignKind.SOBOL, 64, 7)
    gravity = Parameter("gravity_scale", ("gravity",), Uniform(0.8, 1.2))
    assert study.parameters == {"gravity_scale": gravity}
    swing = Measure("swing", "shoulder.2 [deg]", Statistic.LARGEST)
    assert study.measures == {"swing": swing, "end": Measure("end", "kinetic [J]", Statistic.LAST)}
    assert study.persons == ()
    assert study.fall == ""
    assert study.sensitivity is None
    assert study.text == EXAMPLE
    points = design_points(study)
    assert points.shape == (64, 1)
    assert build_case(study, points[0]).plan.gravity == (0.0, -9.81 * points[0, 0], 0.0)


def test_each_distribution_is_read():
    study = read("""\
figure = "prototype"
[design]
kind = "latin-hypercube"
runs = 5
[parameters]
uniform = { path = "gravity", low = 0.5, high = 2 }
normal = { path = "pose.left_knee", mean = -3, sd = 2.5 }
skew = { path = ["springs.left_knee.scale", "springs.right_knee.scale"], median = 1, factor = 1.5 }
levels = { path = "springs.left_elbow.scale", values = [2, 1, 1] }
[measures]
end = { column = "kinetic [J]", take = "last" }
""")
    assert [one.distribution for one in study.parameters.values()] == [
        Uniform(0.5, 2.0),
        Normal(-3.0, 2.5),
        LogNormal(1.0, 1.5),
        Levels((2.0, 1.0, 1.0)),
    ]
    both = ("springs.left_knee.scale", "springs.right_knee.scale")
    assert study.parameters["skew"].paths == both
    assert design_points(study).shape == (5, 4)


ANGLES = st.floats(-1e6, 1e6)
"""Angles that a pose may have [deg]."""


@given(ends=st.tuples(ANGLES, ANGLES).filter(lambda ends: ends[0] < ends[1]))
@settings(max_examples=30, deadline=None)
def test_numbers_are_read_exactly(ends: tuple[float, float]):
    low, high = ends
    path = f'"pose.shoulder.1", low = {low!r}, high = {high!r}'
    text = EXAMPLE.replace('"gravity", low = 0.8, high = 1.2', path)
    study = read(text)
    assert study.parameters["gravity_scale"].distribution == Uniform(*ends)


def test_a_grid_has_evenly_spaced_values():
    text = EXAMPLE.replace('"sobol"', '"grid"').replace("runs = 64\nseed = 7\n", "")
    study = read(text.replace("high = 1.2", "high = 1.2, points = 5"))
    assert study.design == Design(DesignKind.GRID)
    assert design_points(study)[:, 0] == pytest.approx([0.8, 0.9, 1.0, 1.1, 1.2], rel=1e-15)


def test_indices_have_defaults():
    assert read(EXAMPLE + "[sensitivity]\n").sensitivity == Sensitivity(0.95, 1000)
    table = "[sensitivity]\nconfidence = 0.9\nresamples = 50\n"
    assert read(EXAMPLE + table).sensitivity == Sensitivity(0.9, 50)


def test_a_person_takes_the_place_of_a_figure():
    person = '[person]\nsex = "female"\nstature_m = 1.63\nmass_kg = 62\n'
    text = EXAMPLE.replace('figure = "pendulum"\n', "").replace("[design]", f"{person}[design]")
    text = text.replace("shoulder.2 [deg]", "left_knee.1 [deg]").replace("gravity", "person.mass")
    study = read(
        text.replace("0.8", "55").replace("1.2", "70").replace("person.mass_scale", "mass")
    )
    assert study.persons == (PersonArguments(Sex.FEMALE, 1.63, 62.0, "published"),)
    assert study.model.figure.total_mass == pytest.approx(62.0)
    assert study.name == "female, 1.63 m, 62 kg"
    assert build_case(study, [65.0]).figure.total_mass == pytest.approx(65.0)


FALLS = """\
fall = "push"
tone = "fall"
[[person]]
sex = "male"
stature_m = 1.756
mass_kg = 85.5
[[person]]
sex = "female"
stature_m = 1.55
mass_kg = 80
[design]
kind = "latin-hypercube"
runs = 8
[parameters]
body = { path = "person", values = [1, 2] }
start = { path = "fall.seed", low = 0, high = 1e6 }
tone = { path = "tone.scale", values = [0, 0.5] }
head = { path = "contact.head.stiffness_scale", low = 0.5, high = 2 }
stops = { path = "springs.stop_scale", low = 0.3, high = 3 }
[measures]
pelvis = { column = "lower_torso.contact_force [N]", take = "largest" }
"""


def test_falls_of_several_persons_have_their_own_starts():
    study = read(FALLS)
    assert [person.mass for person in study.persons] == [85.5, 80.0]
    assert study.name == "2 persons"
    first, again, other, woman = (
        build_case(study, values)
        for values in (
            [1, 3, 0.5, 2.0, 1.0],
            [1, 3.7, 0.5, 2.0, 1.0],
            [1, 4, 0, 1.0, 1.0],
            [2, 3, 1.0, 1.0, 3.0],
        )
    )
    assert first.model == again.model
    assert first.plan == again.plan
    assert first.plan.displacements == fall_plan(first.figure, "push", 3).displacements
    assert first.plan.displacements != other.plan.displacements
    assert other.plan.tone is None
    assert first.plan.tone is not None
    assert first.plan.tone.righting == {"neck": 0.225, "trunk": 0.225}
    assert woman.figure.total_mass == pytest.approx(80.0)
    assert woman.plan.scene == first.plan.scene
    for case, factor in ((first, 2.0), (other, 1.0)):
        assert case.model.contact is not None
        assert case.model.contact.laws["head"].stages[0] == (0.0, factor * 150e3)
    stops = [
        next(
            law for law in case.springs.joints["left_knee"].axes[0].elastic if isinstance(law, Stop)
        )
        for case in (first, woman)
    ]
    assert stops[1].stiffness == 3.0 * stops[0].stiffness


def test_a_region_is_softened_down_to_its_part():
    case = build_case(read(FALLS), [1, 3, 0.5, 1.0, 1.0])
    path = parse_path("contact.buttocks.stiffness_scale", case)
    contact = apply_values(case, [(path, 0.5)]).model.contact
    assert contact is not None
    assert contact.laws["buttocks"].stages == ((0.0, 30e3), (0.03, 90e3))


def test_stops_of_a_reach_are_scaled():
    case = build_case(read(FALLS), [1, 3, 0.5, 1.0, 2.0])
    reach = case.springs.joints["left_shoulder"].reach
    assert reach is not None
    laws = [law for axis in (reach.beyond, reach.turn) for law in axis.elastic]
    assert {law.stiffness for law in laws if isinstance(law, Stop)} == {2000.0}


@pytest.mark.parametrize(
    ("old", "new", "line", "message"),
    [
        ('"push"', '"pish"', 1, "unknown kind of fall `pish`"),
        ('tone = "fall"', 'tone = "fell"', 2, "fell"),
        ('tone = "fall"', "tone = 2", 2, "from 0 to 1"),
        ('tone = "fall"', "gravity = [0, 0, -9.81]", 2, "`gravity` points down with `fall`"),
        ('tone = "fall"', 'scene = "bed"', 2, "exclude each other"),
        ("[1, 2]", "[1, 3]", 15, "`person` cannot be 3: they are numbered from 1 to 2"),
        ("[1, 2]", "[1, 1.5]", 15, "`person` cannot be 1.5"),
        ('body = { path = "person", values = [1, 2] }', "", 3, "no parameter chooses one of the 2"),
        ("mass_kg = 80", 'mass_kg = 80\nneck = "rigid"', 3, "an elastic neck and another a rigid"),
        ("contact.head.stiffness_scale", "floor.stiffness", 18, "have stiffnesses of their own"),
        ("low = 0.5, high = 2", "low = 1, high = 1e3", 18, "would be stiffer than 1e+09 N/m"),
        ("low = 0, high = 1e6", "low = -1, high = 1", 16, "must not be negative"),
        ("stature_m = 1.55", "stature_m = 15", 9, "stature"),
        ("low = 0.5, high = 2", "low = 0, high = 2", 18, "stiffness of a stage must be positive"),
    ],
)
def test_errors_of_falls_name_the_line(old: str, new: str, line: int, message: str):
    errors = parse_study_text(FALLS.replace(old, new), FIGURES).diagnostics
    found = [one for one in errors if message in str(one)]
    assert found, errors
    assert found[0].span is not None
    assert found[0].span.line == line


def test_an_excluded_option_is_one_error():
    errors = parse_study_text(FALLS.replace('tone = "fall"', "friction = 0.5"), FIGURES).diagnostics
    assert [one.message for one in errors] == ["`fall` and `friction` exclude each other"]


def test_files_are_searched_in_the_folder_of_the_study(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    folder, elsewhere = tmp_path / "studies", tmp_path / "elsewhere"
    folder.mkdir()
    elsewhere.mkdir()
    monkeypatch.chdir(elsewhere)
    (folder / "own.fig").write_text((FIGURES / "pendulum.fig").read_text("utf-8"), "utf-8")
    (folder / "s.study.toml").write_text(EXAMPLE.replace("pendulum", "own.fig"), "utf-8")
    study = read_study(folder / "s.study.toml")
    assert study.model.figure.path == folder / "own.fig"
    assert study.name == "own"
    (folder / "pendulum").write_text((FIGURES / "fourbar.fig").read_text("utf-8"), "utf-8")
    parsed = parse_study_text(EXAMPLE.replace("shoulder.2 [deg]", "kinetic [J]"), folder)
    assert parsed.require_value().model.figure == read_figure(
        "fourbar"
    )  # before the shipped pendulum
    (elsewhere / "other.fig").write_text("", "utf-8")
    parsed = parse_study_text(EXAMPLE.replace("pendulum", "other.fig"), folder)
    assert "no file `other.fig`" in parsed.diagnostics[0].message


def test_springs_are_chosen_as_in_a_run():
    text = EXAMPLE.replace("pendulum", "prototype").replace("shoulder.2", "left_knee.1")
    study = read(f'springs = "coupled"\n{text}')
    expected = read_springs("coupled", read_figure("prototype"))
    assert study.model.springs == expected
    assert expected.coupled


def test_the_largest_study_is_read():
    grid = EXAMPLE.replace('"sobol"', '"grid"').replace("runs = 64\nseed = 7\n", "")
    text = grid.replace("high = 1.2", "high = 1.2, points = 1000")
    second = 'b = { path = "pose.shoulder.1", low = 0, high = 1, points = 1000 }\n'
    study = parse_study_text(text.replace("[measures]", f"{second}[measures]"), FIGURES).value
    assert study is not None
    assert run_count(study) == MAX_RUNS


def test_a_parameter_may_set_what_the_start_lacks():
    """The figure starts in the bed, and the runs above it."""
    text = EXAMPLE.replace('"pendulum"', '"prototype"\nscene = "bed"')
    text = text.replace("shoulder.2 [deg]", "left_knee.1 [deg]")
    (fault, _) = parse_study_text(text, FIGURES).diagnostics
    assert "starts 5.37 cm inside bed" in fault.message
    assert fault.span is not None
    assert fault.span.text == '"prototype"'
    assert read(text.replace('"gravity"', '"height"')).plan.height == 0.0


@pytest.mark.parametrize("runs", [1, 2, 3, 4, 6, 7, 1023, 1024, 1025])
def test_powers_of_two_have_no_warning(runs: int):
    parsed = parse_study_text(EXAMPLE.replace("64", str(runs)), FIGURES)
    assert parsed.value is not None
    is_power = runs in [1 << k for k in range(11)]
    assert (parsed.diagnostics == ()) is is_power


def test_a_study_shows_what_varies_and_what_is_measured():
    page = read(EXAMPLE)._repr_html_()
    assert page.count("<table>") == 2
    assert "<td>gravity_scale</td><td>gravity</td><td>low 0.8, high 1.2</td>" in page
    assert page.count("<tr>") == 2 + 1 + 2
