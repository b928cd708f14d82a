"""What `mover check` says of springs that no simulation can hang is what the simulation says."""

from pathlib import Path

import pytest
from typer.testing import CliRunner

from generator.cli.app import app
from generator.diagnostics import ModelError
from generator.figure_file import read_figure
from generator.simulation.model import ExudynModel, build_model
from generator.simulation.plan import Plan, resolve_springs

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
    f"{TURNING} stiff = (0 N m/rad,5 N/m,0 N/m);": (
        "rotations and more than one translation",
        "stiff",
    ),
    f"{TURNING} llimit = (-1deg,-1cm,-1cm); ulimit = (1deg,1cm,1cm);": (
        "rotations and more than one translation",
        "llimit",
    ),
    f"{SLIDES} damp = (1 N s/m,0 N s/m);": (
        "damping along its translations is not supported",
        "damp",
    ),
    BALL.format(180) + " stiff = (1 N m/rad,1 N m/rad,1 N m/rad);": (
        "starts at 180 deg",
        "displacement",
    ),
}
ALLOWED = [
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
    return build_model(figure, plan, resolve_springs(figure, plan))


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


def test_without_springs_nothing_is_refused(tmp_path: Path):
    path = written(next(iter(REFUSED)), tmp_path)
    assert CliRunner().invoke(app, ["check", str(path), "--springs", "none"]).exit_code == 0
