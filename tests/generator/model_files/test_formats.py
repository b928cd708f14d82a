"""The table of model formats, and figure files as one of them."""

from dataclasses import replace
from pathlib import Path

import pytest

from generator import read_figure
from generator.diagnostics import UsageError
from generator.model_files.formats import MODEL_FORMATS, format_fig, model_format, suffixes
from generator.motion_files import MOTION_FORMATS as MOTIONS
from tests.generator.model_files.model_cases import own_springs


def test_no_suffix_stands_for_two_formats():
    said = [*suffixes(), *MOTIONS]
    assert len(set(said)) == len(said)
    assert all(suffix == suffix.lower() and suffix.startswith(".") for suffix in said)


def test_a_suffix_of_motions_means_one_format_of_figures():
    shared = [suffix for each in MODEL_FORMATS.values() for suffix in each.motion_suffixes]
    assert shared
    assert len(set(shared)) == len(shared)
    assert set(shared) <= set(MOTIONS)
    assert model_format(Path("a.CSV")) is MODEL_FORMATS["curves"]


def test_the_suffix_chooses_and_a_name_wins_over_it():
    assert model_format(Path("a.FIG")) is MODEL_FORMATS["peabody"]
    assert model_format(Path("a.txt"), "peabody") is MODEL_FORMATS["peabody"]


def test_what_is_not_known_is_told_with_what_is():
    with pytest.raises(UsageError, match=r"`\.fog` is not a known suffix.*\.fig"):
        model_format(Path("a.fog"))
    with pytest.raises(UsageError, match="the suffix is missing"):
        model_format(Path("a"))
    with pytest.raises(UsageError, match="did you mean `peabody`"):
        model_format(Path("a.fig"), "peabod")


@pytest.mark.parametrize(
    ("name", "has_curves"),
    [("prototype", True), ("fourbar", False), ("pendulum", False), ("clavicles", True)],
)
def test_a_figure_file_leaves_psurfs_and_curves_behind(name: str, has_curves: bool, tmp_path: Path):
    figure = read_figure(name)
    springs = own_springs(figure)
    losses = format_fig(figure, springs, tmp_path / "out.fig").write()
    lost = {loss.what.split()[1]: loss.where for loss in losses.entries}
    with_psurfs = {s.psurf for s in figure.segments.values() if s.psurf is not None}
    assert set(lost.get("psurfs,", ())) == with_psurfs
    assert lost.get("springs") == (tuple(springs.joints) if has_curves else None)


def test_a_name_that_the_language_cannot_say_is_refused(tmp_path: Path):
    figure = read_figure("pendulum")
    with pytest.raises(ValueError, match="two words"):
        format_fig(
            replace(figure, name="two words"), own_springs(figure), tmp_path / "out.fig"
        ).write()
    assert not (tmp_path / "out.fig").exists()
