"""The files of an imported model."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from generator.figure_file import read_figure
from generator.geometry.read import read_segment_surface
from generator.model_files.formats import read_model
from generator.model_files.model_files import imported_files, springs_path
from tests.generator.model_files.imported_models import MODELS


def test_psurfs_lie_in_a_folder_beside_the_figure(tmp_path: Path):
    imported = read_model(MODELS / "humanoid.xml")
    files = imported_files(imported, tmp_path / "man.fig")
    assert list(files.contents)[-1] == tmp_path / "man.fig"
    folders = {path.parent for path in files.contents if path.suffix == ".pss"}
    assert folders == {tmp_path / "man_geometry"}
    files.write()
    figure = read_figure(tmp_path / "man.fig")
    assert imported.surfaces
    for name, surface in imported.surfaces.items():
        assert figure.segments[name].psurf == f"man_geometry/{name}.pss"
        read = read_segment_surface(figure, figure.segments[name])
        np.testing.assert_array_equal(read.vertices, surface.vertices)
        assert read.faces == surface.faces


def test_a_model_without_shapes_and_tables_is_one_file(tmp_path: Path):
    imported = replace(read_model(MODELS / "leg.osim"), coordinates={})
    bare = replace(imported, springs=None)
    assert list(imported_files(bare, tmp_path / "leg.fig").contents) == [tmp_path / "leg.fig"]
    both = [springs_path(tmp_path / "leg.fig"), tmp_path / "leg.fig"]
    assert list(imported_files(imported, tmp_path / "leg.fig").contents) == both


def test_a_springs_file_of_another_figure_is_reported(tmp_path: Path):
    imported = replace(read_model(MODELS / "leg.osim"), springs=None)
    springs_path(tmp_path / "leg.fig").write_text("")
    losses = imported_files(imported, tmp_path / "leg.fig").losses
    assert any("an older springs file" in one.what for one in losses.entries)
