"""`mover check` and the simulation refuse the same springs with the same sentence."""

import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from generator.cli.app import app
from generator.diagnostics import ModelError, MoverError
from generator.figure_file import read_figure
from generator.model import Model
from generator.simulation.exudyn_model.model import ExudynModel, build_model
from generator.simulation.plan import Plan
from generator.simulation.preconditions import simulation_obstacles
from generator.simulation.run import simulate
from generator.springs_file.read import read_springs
from springs import AxisSpring, JointSprings, Linear, SpringSet

FIGURE = """figure {{
  segment floor {{ mass = -1kg; site base->location = trans(0,0,0); }}
  segment one {{ mass = 1kg; inertia = (9,9,9); site s->location = trans(0,0,0);
    site CM->location = trans(0,0,0); }}
  segment two {{ mass = 1kg; inertia = (9,9,9); site s->location = trans(0,0,0);
    site CM->location = trans(0,0,0); }}
  joint hook {{ connect floor.base to one.s; type = R(0,0,1); displacement = (0deg); }}
  joint odd {{ connect one.s to two.s; {fields} }}
  root = floor.base;
}}
"""
SLIDES = "type = T(1,0,0)*T(0,1,0); displacement = (0cm,0cm);"
TURNING = "type = R(0,0,1)*T(1,0,0)*T(0,1,0); displacement = (0deg,0cm,0cm);"
BALL = "type = R(1,0,0)*R(0,1,0)*R(0,0,1); displacement = ({}deg,0deg,0deg);"
REFUSED = {
    BALL.format(180) + " stiff = (1 N m/rad,1 N m/rad,1 N m/rad);": (
        "starts at 180 deg",
        "displacement",
    ),
}
ALLOWED = [
    f"{TURNING} stiff = (0 N m/rad,5 N/m,0 N/m);",
    f"{TURNING} llimit = (-1deg,-1cm,-1cm); ulimit = (1deg,1cm,1cm);",
    f"{SLIDES} damp = (1 N s/m,0 N s/m);",
    f"{TURNING} stiff = (3 N m/rad,0 N/m,0 N/m);",
    f"{SLIDES} stiff = (5 N/m,5 N/m);",
    BALL.format(180) + " damp = (1 N m s/rad,1 N m s/rad,1 N m s/rad);",
    BALL.format(170) + " stiff = (1 N m/rad,1 N m/rad,1 N m/rad);",
]


def written(fields: str, folder: Path) -> Path:
    path = folder / "odd.fig"
    path.write_text(FIGURE.format(fields=fields), encoding="utf-8")
    return path


def built(path: Path) -> ExudynModel:
    """The figure in Exudyn, with its own springs."""
    figure, plan = read_figure(path), Plan()
    return build_model(figure, plan)


@pytest.mark.parametrize("fields", REFUSED)
def test_a_refusal_is_told_as_the_engine_tells_it(fields: str, tmp_path: Path):
    path, (message, field) = written(fields, tmp_path), REFUSED[fields]
    with pytest.raises(ModelError, match=message) as caught:
        built(path)
    result = CliRunner().invoke(app, ["check", str(path)])
    assert result.exit_code == 1
    assert f"error: {caught.value}\n" in result.stdout
    assert f"{path}:8:" in result.stdout
    marked = result.stdout.partition(str(caught.value))[2].splitlines()
    start = marked[2].index("^")
    assert marked[1][: start + 40].rpartition(field)[1] == field


@pytest.mark.parametrize("fields", ALLOWED)
def test_what_the_engine_hangs_is_no_fault(fields: str, tmp_path: Path):
    path = written(fields, tmp_path)
    assert built(path).springs["odd"]
    assert CliRunner().invoke(app, ["check", str(path)]).exit_code == 0


def answers(path: Path) -> tuple[bool, bool, bool, bool]:
    """Return whether `check`, `describe`, `simulate` and Python's `simulate` accept a figure."""
    runner, name = CliRunner(), str(path)
    checked = json.loads(runner.invoke(app, ["check", name, "--json"]).stdout)["verdict"]
    described = json.loads(runner.invoke(app, ["describe", name, "--json"]).stdout)
    text = runner.invoke(app, ["describe", name]).stdout
    assert ("\ncan be simulated" in text) == described["can_be_simulated"]
    for obstacle in described["obstacles"][:1]:
        assert f"\ncannot be simulated: {obstacle['message']}" in text
    run = runner.invoke(app, ["simulate", name, "--stop", "0.001", "--step", "0.001"])
    try:
        simulate(read_figure(path), Plan(stop=0.001, step=0.001))
        in_python = True
    except MoverError:
        in_python = False
    return (
        checked.endswith("the figure can be simulated"),
        described["can_be_simulated"],
        run.exit_code != 1,
        in_python,
    )


ODD_FIGURES = {
    **{FIGURE.format(fields=fields): False for fields in REFUSED},
    **{FIGURE.format(fields=fields): True for fields in ALLOWED},
    FIGURE.format(
        fields="type = T(1,0,0)*R(0,0,1)*T(0,1,0); displacement = (0cm,0deg,0cm);"
    ): False,
    FIGURE.format(fields=SLIDES).replace("inertia = (9,9,9);", "", 1): False,
    FIGURE.format(fields=SLIDES).replace("mass = 1kg;", "", 1): False,
    "figure { segment a { mass = -1; site s->location = trans(0,0,0); } root = a.s; }": False,
    FIGURE.format(
        fields="type = R(0,0,1); displacement = (0deg); } "
        "joint open { connect floor.far to two.s; type = T(1,0,0); displacement = (0cm);"
    ).replace("floor { ", "floor { site far->location = trans(0,9cm,0); "): False,
}


@pytest.mark.parametrize("text", ODD_FIGURES)
def test_all_commands_agree_on_what_can_be_simulated(text: str, tmp_path: Path):
    path = tmp_path / "odd.fig"
    path.write_text(text, encoding="utf-8")
    assert answers(path) == (ODD_FIGURES[text],) * 4


def test_a_spring_about_another_axis_is_an_obstacle(tmp_path: Path):
    figure = read_figure(written("type = R(0,0,1); displacement = (0deg);", tmp_path))
    springs = SpringSet(
        {"odd": JointSprings("odd", (AxisSpring((0.6, 0.8, 0.0), (Linear(1.0),)),))}
    )
    (obstacle,) = simulation_obstacles(Model(figure, springs))
    with pytest.raises(ModelError, match="does not rotate about") as caught:
        build_model(Model(figure, springs), Plan())
    assert obstacle.message == str(caught.value)


def test_a_start_replaces_the_displacement_of_the_file(tmp_path: Path):
    path = written(BALL.format(0) + " stiff = (1 N m/rad,1 N m/rad,1 N m/rad);", tmp_path)
    figure = read_figure(path)
    springs = read_springs(None, figure)
    assert simulation_obstacles(Model(figure, springs)) == ()
    (obstacle,) = simulation_obstacles(Model(figure, springs), {"odd": (np.pi, 0.0, 0.0)})
    assert "starts at 180 deg" in obstacle.message
    assert obstacle.span is None
    run = CliRunner().invoke(app, ["simulate", str(path), "--set", "odd=180,0,0"])
    assert (run.exit_code, obstacle.message in run.stderr) == (1, True)


def test_without_springs_nothing_is_refused(tmp_path: Path):
    path = written(next(iter(REFUSED)), tmp_path)
    assert CliRunner().invoke(app, ["check", str(path), "--springs", "none"]).exit_code == 0


@pytest.mark.parametrize(
    ("after", "message"),
    [
        ("mass = 1e308kg; inertia = (9,9,9)", "the mass of `two` is too large"),
        ("mass = 1kg; inertia = (1e300,1e300,1e300)", "the inertia of `two` is too large"),
        ("mass = 1kg; inertia = (9,9,9); site far->location = trans(1e300,0,0)", "`far` of `two`"),
    ],
)
def test_numbers_beyond_any_motion_are_refused(after: str, message: str, tmp_path: Path):
    """They once ended in warnings of numpy and in a traceback of the eigenvalues."""
    text = FIGURE.format(fields="type = R(0,0,1); displacement = (0deg);")
    head, _, tail = text.rpartition("mass = 1kg; inertia = (9,9,9)")
    path = tmp_path / "arm.fig"
    path.write_text(head + after + tail, encoding="utf-8")
    for words in (("check",), ("settle",), ("simulate", "--stop", "0.02")):
        done = CliRunner().invoke(app, [words[0], str(path), *words[1:]])
        assert isinstance(done.exception, SystemExit)
        assert message in done.output
    assert done.exit_code == 1
