"""Values of a plan that are accepted, and those that are refused."""

import re
from dataclasses import replace

import pytest

from generator import read_figure, read_springs
from generator.contact.scene import Scene
from generator.diagnostics import ModelError
from generator.figure import Figure
from generator.model import Model
from generator.simulation.plan import Plan, resolve_model
from generator.springs_file.parse import SpringsFile
from springs import Linear, SphericalLaw, SpringSet


def test_defaults() -> None:
    plan = Plan()
    assert plan.gravity == (0.0, -9.81, 0.0)
    assert plan.tolerance == 1e-3
    assert plan.frame == 0.02
    assert plan.step is None


@pytest.mark.parametrize(
    ("given", "reason"),
    [
        ({"stop": 0.0}, "not after the start"),
        ({"start": 2.0}, "not after the start"),
        ({"stop": float("nan")}, "stop must be finite"),
        ({"stop": float("inf")}, "stop must be finite"),
        ({"start": float("-inf")}, "start must be finite"),
        ({"frame": 0.0}, "frame must be above zero"),
        ({"frame": float("nan")}, "frame must be finite"),
        ({"tolerance": -1e-3}, "tolerance must be above zero"),
        ({"tolerance": float("inf")}, "tolerance must be finite"),
        ({"wall_limit": 0.0}, "wall_limit must be above zero"),
        ({"wall_limit": float("nan")}, "wall_limit must be above zero"),
        ({"step": 0.0}, "step must be above zero"),
        ({"step": -1e-3}, "step must be above zero"),
        ({"step": float("inf")}, "step must be finite"),
        ({"start": 1e16, "stop": 1e16 + 2.0}, "times near 1e[+]16 s are rounded to 2 s"),
        ({"start": 1e14, "stop": 1e14 + 1.0}, "rounded to 0.02 s, too coarsely for frames of 0.02"),
        ({"start": -1e6, "stop": 1.0}, "nearer to zero"),
        ({"frame": 1e-9}, "too coarsely for frames of 1e-09 s"),
        ({"height": float("nan"), "free_root": True}, "height must be finite"),
        ({"height": 1.0}, "height needs free_root: the figure hangs from the ground"),
        ({"height": 1.0, "scene": Scene.floor()}, "height needs free_root"),
        ({"height": 1e7, "free_root": True}, "must be from -1e[+]06 to 1e[+]06 m, not 1e[+]07"),
        ({"self_contact": True}, "self_contact needs scene"),
        ({"springs": "coupled"}, "a file or a name is the spring_choice"),
        ({"springs": SpringsFile(())}, r"such as read_springs.* not a SpringsFile"),
        ({"scene": "seat"}, "read_scene"),
        ({"integrator": "exudyn"}, "Integrator.COMPILED, IMPLICIT or EXUDYN, not 'exudyn'"),
        ({"locked": "left_knee"}, "locked are names of joints"),
        ({"gravity": (0.0, -9.81)}, "three finite components"),
        ({"gravity": (0.0, float("nan"), 0.0)}, "three finite components"),
    ],
)
def test_what_makes_no_run(given, reason) -> None:
    with pytest.raises(ValueError, match=reason):
        Plan(**given)


def test_a_run_may_start_before_zero_and_take_all_day() -> None:
    assert Plan(start=-1.0, stop=0.0, wall_limit=float("inf")).start == -1.0
    assert Plan(start=1e5, stop=1e5 + 1.0).start == 1e5


def test_a_plan_is_shown_by_what_is_not_standard() -> None:
    assert repr(Plan()) == "Plan()"
    plan = Plan(stop=2.0, velocities={"left_knee": (1.0,)})
    assert repr(plan) == "Plan(stop=2.0, velocities={'left_knee': (1.0,)})"
    assert repr(SpringSet()) == "<SpringSet none: joints with springs: 0, conservative>"


KNEE = read_figure("prototype").joints["left_knee"]


def resolved(model: Model | Figure, plan: Plan) -> SpringSet:
    """The springs with which a run goes."""
    made, rest = resolve_model(model, plan)
    assert (rest.springs, rest.spring_choice, rest.law) == (None, None, None)
    return made.springs


def test_a_model_has_its_springs_and_the_plan_no_others() -> None:
    model = Model.of(read_figure("prototype"))
    assert resolved(model, Plan()) is model.springs
    weighted = resolved(model, Plan(law=SphericalLaw.WEIGHTED))
    assert weighted == replace(model.springs, law=SphericalLaw.WEIGHTED)
    for choice in ({"springs": SpringSet()}, {"spring_choice": "none"}):
        with pytest.raises(ModelError, match="both the model and the plan have springs"):
            resolve_model(model, Plan(**choice))


@pytest.mark.parametrize(("field", "value"), [("stiff", 500.0), ("rest", 0.3), ("damp", 2.0)])
def test_a_spring_changed_in_python_is_never_replaced_in_silence(field: str, value: float) -> None:
    figure = read_figure("prototype").with_parts(replace(KNEE, **{field: (value,)}))
    sentence = (
        f"`{field}` of joint `left_knee` was changed in Python, but the springs of "
        "prototype.springs.toml replace it: change them instead, as Plan"
    )
    with pytest.raises(ModelError, match=re.escape(sentence)):
        resolve_model(figure, Plan())
    with pytest.raises(ModelError, match=re.escape(sentence)):
        read_springs(None, figure)


def test_changes_that_have_an_effect_pass() -> None:
    figure = read_figure("prototype")
    assert resolved(figure, Plan()) == read_springs(None, figure)
    limited = figure.with_parts(replace(KNEE, upper_limit=(0.5,)))
    assert resolved(limited, Plan()) != resolved(figure, Plan())
    stiff = figure.with_parts(replace(KNEE, stiff=(500.0,)))
    assert resolved(stiff, Plan(spring_choice="none")).joints == {}
    own = replace(stiff, path=None)
    (spring,) = resolved(own, Plan()).joints["left_knee"].axes
    assert spring.elastic[0] == Linear(500.0, 0.0)
    springs = read_springs(None, figure)
    assert resolved(stiff, Plan(springs=springs)) is springs


def test_the_fields_of_a_file_are_replaced_as_its_page_says() -> None:
    figure = read_figure("clavicles")
    assert figure.joints["left_knee"].stiff == (1e-7,)
    assert resolved(figure, Plan()).origin == "clavicles.springs.toml"
