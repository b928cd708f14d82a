"""`mover convert` of another program's model."""

from pathlib import Path

import pytest

from generator.figure_file import read_figure
from tests.command import answer, mover, run
from tests.generator.model_files.imported_models import MODELS

REFUSED = Path(__file__).parent / "refusals" / "files"
PIN, PLAIN_PIN = REFUSED / "pin.xml", REFUSED / "hinge.xml"


@pytest.mark.parametrize("name", ["humanoid.xml", "arm.urdf", "leg.osim"])
def test_a_model_becomes_a_figure_that_moves(name: str, tmp_path: Path):
    figure = tmp_path / "model.fig"
    said = run("convert", MODELS / name, figure, "--verbose").stdout
    assert f"wrote {figure}" in said
    assert "the world is turned" in said or name == "leg.osim"
    run("simulate", figure, "--stop", "0.1", "-o", tmp_path / "m.action", "--quiet")


def test_springs_that_the_fields_cannot_hold_stand_beside_the_figure(tmp_path: Path):
    figure, springs = tmp_path / "one.fig", tmp_path / "one.springs.toml"
    said = answer("convert", PIN, figure)
    shapes = sorted(str(path) for path in (tmp_path / "one_geometry").iterdir())
    assert sorted(said["files"]) == sorted([str(figure), str(springs), *shapes])
    assert said["coordinates"]["pin"] == {"joint": "pin", "place": 1, "scale": 1.0, "shift": 0.0}
    assert any("friction losses" in loss["what"] for loss in said["losses"][str(figure)])
    assert "coulomb_Nm = 0.1" in springs.read_text()
    # The same import again changes nothing, so there is nothing to ask.
    run("convert", PIN, figure)


def test_a_springs_file_that_is_named_is_replaced(tmp_path: Path):
    figure, springs = tmp_path / "one.fig", tmp_path / "one.springs.toml"
    springs.write_text("# mine\n")
    said = answer("convert", PIN, figure, springs)
    shapes = sorted(str(path) for path in (tmp_path / "one_geometry").iterdir())
    assert sorted(said["files"]) == sorted([str(figure), str(springs), *shapes])
    assert "coulomb_Nm = 0.1" in springs.read_text()


def test_an_older_springs_file_is_reported(tmp_path: Path):
    (tmp_path / "one.springs.toml").write_text("")
    said = run("convert", PLAIN_PIN, tmp_path / "one.fig").stdout
    assert "an older springs file stands beside the figure" in said


def test_revolutes_stay_separate_on_demand(tmp_path: Path):
    combined, single = tmp_path / "a.fig", tmp_path / "b.fig"
    run("convert", MODELS / "humanoid.xml", combined)
    run("convert", MODELS / "humanoid.xml", single, "--apart")
    assert "hip_right" in read_figure(combined).joints
    assert "hip_x_right" in read_figure(single).joints


def test_a_figure_is_not_written_over_its_model(tmp_path: Path):
    model = tmp_path / "one.xml"
    model.write_bytes(PIN.read_bytes())
    (tmp_path / "one.fig").symlink_to(model)
    assert mover("convert", model, tmp_path / "one.fig").exit_code == 1
    assert model.read_bytes() == PIN.read_bytes()
