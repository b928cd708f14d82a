"""The files of a figure with psurfs and springs."""

from pathlib import Path

import pytest

from generator.figure import Figure, Joint, Location, Segment, Site, SiteRef
from generator.figure_file import read_figure
from generator.geometry.primitives import box, sphere
from generator.geometry.read import read_segment_surface
from generator.losses import Losses
from generator.model_files.model_files import (
    ModelFiles,
    figure_files,
    older_springs_loss,
    psurf_folder,
    springs_path,
)


def figure() -> Figure:
    """A base and two links without psurfs."""
    base = Segment("base", mass=-1.0, sites={"top": Site("top", Location.at(0.0, 0.0, 0.0))})
    links = [
        Segment(
            name,
            mass=1.0,
            inertia=(1.0, 1.0, 1.0),
            sites={s: Site(s, Location.at(0.0, 0.0, 0.0)) for s in ("proximal", "CM")},
        )
        for name in ("left_arm", "right_arm")
    ]
    joints = [
        Joint(f"{link.name}_joint", SiteRef("base", "top"), SiteRef(link.name, "proximal"))
        for link in links
    ]
    return Figure(
        {each.name: each for each in (base, *links)},
        {each.name: each for each in joints},
        SiteRef("base", "top"),
    )


def write(path: Path, **options: object) -> Figure:
    files = figure_files(figure(), path, {"arm": box(0.1, 0.2, 0.3)}, {}, **options)
    ModelFiles(path, files, Losses("")).write()
    return read_figure(path)


def test_two_segments_share_a_psurf(tmp_path: Path):
    made = write(tmp_path / "me.fig", surface_names={"left_arm": "arm", "right_arm": "arm"})
    psurfs = [segment.psurf for segment in made.segments.values()]
    assert psurfs == [None, "me_geometry/arm.pss", "me_geometry/arm.pss"]
    read = read_segment_surface(made, made.segments["right_arm"])
    assert read.faces == box(0.1, 0.2, 0.3).faces


def test_a_comment_stands_above_the_figure(tmp_path: Path):
    path = tmp_path / "me.fig"
    files = figure_files(figure(), path, {}, {}, comment="one\ntwo")
    assert str(files[path]).startswith("# one\n# two\n\nfigure {")
    bare = figure_files(figure(), path, {}, {})
    assert str(bare[path]).startswith("figure {")


def test_the_figure_comes_last_after_its_springs(tmp_path: Path):
    path = tmp_path / "me.fig"
    surfaces = {"left_arm": sphere(0.1)}
    files = figure_files(figure(), path, surfaces, {springs_path(path, "coupled"): "x"})
    names = [file.relative_to(tmp_path).as_posix() for file in files]
    assert names == ["me_geometry/left_arm.pss", "me.coupled.springs.toml", "me.fig"]


def test_springs_that_are_there_already_are_a_loss(tmp_path: Path):
    path = tmp_path / "me.fig"
    assert older_springs_loss(path) is None
    springs_path(path).write_text("", encoding="utf-8")
    loss = older_springs_loss(path)
    assert loss is not None
    assert "an older springs file" in loss.what


@pytest.mark.parametrize("name", ['a "fine" \u00e9\\name', "long" * 50])
def test_any_name_of_a_file_has_a_folder_that_the_figure_can_name(name: str, tmp_path: Path):
    made = write(tmp_path / f"{name}.fig", surface_names={"left_arm": "arm"})
    assert read_segment_surface(made, made.segments["left_arm"]).face_count > 0


def test_two_figures_have_two_folders(tmp_path: Path):
    names = ["\u5de6", "\u53f3", "__", "long" * 50 + "a", "long" * 50 + "b"]
    folders = {psurf_folder(tmp_path / f"{name}.fig") for name in names}
    assert len(folders) == len(names)
