"""`mover convert` of another program's model."""

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

from generator.cli.app import app
from generator.figure_file import read_figure
from tests.generator.model_files.imported_models import MODELS

PENDULUM = """<mujoco model="one"><worldbody><body name="bob">
  <joint name="pin" axis="0 1 0" frictionloss="0.1"/><geom size="0.1" pos="0 0 -1"/>
</body></worldbody></mujoco>"""


def mover(*words: object) -> Result:
    return CliRunner().invoke(app, [str(word) for word in words])


@pytest.mark.parametrize("name", ["humanoid.xml", "arm.urdf", "leg.osim"])
def test_a_model_becomes_a_figure_that_moves(name, tmp_path):
    figure = tmp_path / "model.fig"
    result = mover("convert", MODELS / name, figure)
    assert result.exit_code == 0, result.stderr
    assert f"wrote {figure}" in result.stdout
    assert "the world is turned" in result.stdout or name == "leg.osim"
    run = mover("simulate", figure, "--stop", "0.1", "-o", tmp_path / "m.action", "--quiet")
    assert run.exit_code == 0, run.stderr


def test_springs_that_the_fields_cannot_hold_stand_beside_the_figure(tmp_path):
    model, figure = tmp_path / "one.xml", tmp_path / "one.fig"
    model.write_text(PENDULUM)
    result = mover("convert", model, figure, "--json")
    said = json.loads(result.stdout)
    assert said["files"] == [str(figure), str(tmp_path / "one.springs.toml")]
    assert said["coordinates"]["pin"] == {"joint": "pin", "place": 1, "scale": 1.0, "shift": 0.0}
    assert any("friction losses" in loss["what"] for loss in said["losses"][str(figure)])
    assert "coulomb_Nm = 0.1" in (tmp_path / "one.springs.toml").read_text()


def test_an_older_springs_file_is_told(tmp_path):
    model, figure = tmp_path / "one.xml", tmp_path / "one.fig"
    model.write_text(PENDULUM.replace('frictionloss="0.1"', ""))
    (tmp_path / "one.springs.toml").write_text("")
    result = mover("convert", model, figure)
    assert "an older springs file stands beside the figure" in result.stdout


def test_a_springs_file_that_was_not_named_is_kept(tmp_path):
    model, figure, springs = (tmp_path / name for name in ("p.xml", "k3.fig", "k3.springs.toml"))
    model.write_text(PENDULUM)
    springs.write_text("# mine\n")
    result = mover("convert", model, figure)
    assert result.exit_code == 1
    assert f"`{springs}` exists with other springs" in result.stderr
    assert springs.read_text() == "# mine\n"
    assert not figure.exists()


def test_a_springs_file_that_is_named_is_replaced(tmp_path):
    model, figure, springs = (tmp_path / name for name in ("p.xml", "k3.fig", "k3.springs.toml"))
    model.write_text(PENDULUM)
    springs.write_text("# mine\n")
    result = mover("convert", model, figure, springs, "--json")
    assert result.exit_code == 0, result.stderr
    assert json.loads(result.stdout)["files"] == [str(figure), str(springs)]
    assert "coulomb_Nm = 0.1" in springs.read_text()
    # The same import again changes nothing, so there is nothing to ask.
    assert mover("convert", model, figure).exit_code == 0


def test_a_springs_file_that_the_model_does_not_need_is_not_written(tmp_path):
    model, figure, springs = (tmp_path / name for name in ("p.xml", "k3.fig", "k3.springs.toml"))
    model.write_text(PENDULUM.replace('frictionloss="0.1"', ""))
    result = mover("convert", model, figure, springs)
    assert result.exit_code == 1
    assert "the model needs no springs file" in result.stderr
    assert not figure.exists()
    assert not springs.exists()


def test_a_springs_file_of_no_output_is_a_usage_error(tmp_path):
    model = tmp_path / "p.xml"
    model.write_text(PENDULUM)
    result = mover("convert", model, tmp_path / "k3.fig", tmp_path / "k4.springs.toml")
    assert result.exit_code == 2
    assert sorted(file.name for file in tmp_path.iterdir()) == ["p.xml"]


def test_hinges_stay_apart_when_asked(tmp_path):
    together, single = tmp_path / "a.fig", tmp_path / "b.fig"
    for output, words in ((together, ()), (single, ("--apart",))):
        assert mover("convert", MODELS / "humanoid.xml", output, *words).exit_code == 0
    assert "hip_right" in read_figure(together).joints
    assert "hip_x_right" in read_figure(single).joints


def test_a_broken_model_writes_nothing_and_ends_with_one(tmp_path):
    model, figure = tmp_path / "one.xml", tmp_path / "one.fig"
    model.write_text(PENDULUM.replace('axis="0 1 0"', 'type="screw"'))
    result = mover("convert", model, figure)
    assert result.exit_code == 1
    assert f"{model}:2:27: error: unknown joint type `screw`" in result.stderr
    assert not figure.exists()


@pytest.mark.parametrize(
    "words", [("out.osim",), ("out.fig", "--to", "peabody"), ("out.fig", "--springs", "none")]
)
def test_what_a_model_does_not_become_is_a_usage_error(words, tmp_path):
    output = tmp_path / words[0]
    result = mover("convert", MODELS / "arm.urdf", output, *words[1:])
    assert result.exit_code == 2
    assert not output.exists()


def test_a_figure_is_not_written_over_its_model(tmp_path):
    model = tmp_path / "one.xml"
    model.write_text(PENDULUM)
    Path(tmp_path / "one.fig").symlink_to(model)
    assert mover("convert", model, tmp_path / "one.fig").exit_code == 1
    assert model.read_text() == PENDULUM
