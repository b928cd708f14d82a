from pathlib import Path

import pytest

from generator.losses import Losses
from generator.model_files.model_files import ModelFiles, geometry_folder


def arm(path: Path) -> ModelFiles:
    mesh = geometry_folder(path) / "arm.stl"
    losses = Losses("model")
    losses.add("colours", "arm")
    return ModelFiles(path, {mesh: b"solid", path: "model"}, losses)


def test_writes_the_model_and_the_folder_of_its_meshes(tmp_path: Path) -> None:
    files = arm(tmp_path / "arm.osim")
    for _ in range(2):  # into the folder that the first time made
        assert files.write() is files.losses
    assert (tmp_path / "arm.osim").read_text() == "model"
    assert (tmp_path / "arm_geometry" / "arm.stl").read_bytes() == b"solid"


def test_makes_no_folder_for_a_model_in_a_folder_that_is_missing(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError):
        arm(tmp_path / "nowhere" / "arm.osim").write()
    assert not any(tmp_path.iterdir())
