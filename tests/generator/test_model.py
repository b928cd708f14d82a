"""A figure with its springs, and parameters set as a study sets them."""

import pickle
from dataclasses import replace

import numpy as np
import pytest

from generator import Model, Plan, UnknownNameError, read_figure, read_springs, simulate
from generator.diagnostics import ModelError
from generator.study.parameter_paths import Case, UnknownPathError, parse_path
from generator.study.parameters import apply_values
from springs import SpringSet, total_torque

PROTOTYPE = Model.of(read_figure("prototype"))
PENDULUM = Model.of(read_figure("pendulum"))


def test_a_model_has_the_springs_that_a_run_of_the_figure_has() -> None:
    figure = PENDULUM.figure
    assert PENDULUM.springs == read_springs(None, figure)
    assert Model.of(figure, "none").springs.joints == {}
    plan = Plan(stop=0.1)
    alone, whole = simulate(figure, plan), simulate(PENDULUM, plan)
    chosen = simulate(figure, replace(plan, springs=PENDULUM.springs))
    for run in (whole, chosen):
        assert np.array_equal(run.displacements["shoulder"], alone.displacements["shoulder"])
        assert run.model == alone.model == PENDULUM
    assert pickle.loads(pickle.dumps(alone)).model == PENDULUM


def test_what_is_not_a_model_is_refused() -> None:
    with pytest.raises(UnknownNameError, match="joint `left_knee`, unknown to the figure"):
        Model(PENDULUM.figure, PROTOTYPE.springs.of_joints({"left_knee"}))
    with pytest.raises(TypeError, match="needs a Figure, such as"):
        Model("pendulum")
    with pytest.raises(TypeError, match=r"springs are a SpringSet, .* not a str"):
        Model(PENDULUM.figure, "none")


def test_a_parameter_of_the_springs_is_a_factor_of_their_torque() -> None:
    stiff = PROTOTYPE.with_parameter("springs.knee.scale", 4)
    assert stiff.figure is PROTOTYPE.figure
    for side in ("left", "right"):
        (before,) = PROTOTYPE.springs.joints[f"{side}_knee"].axes
        (after,) = stiff.springs.joints[f"{side}_knee"].axes
        angles = np.radians(np.linspace(5.0, 100.0, 20))
        assert total_torque(after.elastic, angles) == pytest.approx(
            4.0 * np.asarray(total_torque(before.elastic, angles))
        )
    assert stiff.springs.joints["left_elbow"] == PROTOTYPE.springs.joints["left_elbow"]


@pytest.mark.parametrize(
    ("path", "value"),
    [("springs.scale", 0.5), ("segments.upper_leg.mass", 6.0), ("springs.knee.scale", 2)],
)
def test_a_parameter_is_set_as_a_study_sets_it(path: str, value: float) -> None:
    case = Case(PROTOTYPE, Plan())
    expected = apply_values(case, [(parse_path(path, case), value)]).model
    assert PROTOTYPE.with_parameter(path, value) == expected != PROTOTYPE


@pytest.mark.parametrize(
    "path", ["gravity", "pose.left_knee", "velocity.left_knee", "height", "floor.friction"]
)
def test_parameters_of_the_run_are_those_of_the_plan(path: str) -> None:
    with pytest.raises(UnknownPathError, match="is of the run, not of the model: set it in the Pl"):
        PROTOTYPE.with_parameter(path, 0.5)


def test_other_parameters_are_refused_with_a_hint() -> None:
    with pytest.raises(UnknownPathError, match=r"did you mean `springs.knee.scale`"):
        PROTOTYPE.with_parameter("springs.kne.scale", 2.0)
    with pytest.raises(UnknownPathError, match="build_person"):
        PROTOTYPE.with_parameter("person.stature", 1.8)
    with pytest.raises(ModelError, match="must be from 0 to 1000"):
        PROTOTYPE.with_parameter("springs.knee.scale", -1.0)
    with pytest.raises(UnknownPathError, match="has no elastic law"):
        Model(PROTOTYPE.figure, SpringSet()).with_parameter("springs.knee.scale", 2.0)


def test_a_model_shows_the_curves_of_its_joints() -> None:
    page = PROTOTYPE._repr_html_()
    assert page.count("<tr>") == 1 + sum(len(one.axes) for one in PROTOTYPE.springs.joints.values())
    assert "<td>left_knee</td><td>flexion</td>" in page
    man = Model.of(read_figure("male50"))._repr_html_()
    assert "<td>left_shoulder</td><td>reach and turn</td>" in man
    assert Model(PENDULUM.figure)._repr_html_().count("<tr>") == 1
