"""Figure files as a format of models."""

from dataclasses import replace
from pathlib import Path

import pytest

from generator import read_figure
from generator.cli.inputs import springs_from_option
from generator.model_files.formats import write_fig
from tests.motions import FIGURES


@pytest.mark.parametrize("name", ["prototype", "fourbar", "pendulum", "clavicles"])
def test_the_figure_reads_back_and_its_losses_are_told(name: str, tmp_path: Path):
    figure = read_figure(FIGURES / f"{name}.fig")
    springs, _ = springs_from_option(figure, None)
    losses = write_fig(figure, springs, tmp_path / "out.fig")
    assert read_figure(tmp_path / "out.fig") == figure
    said = {loss.what.split()[1]: loss.where for loss in losses.entries}
    with_psurfs = {s.psurf for s in figure.segments.values() if s.psurf is not None}
    assert set(said.get("psurfs,", ())) == with_psurfs
    has_curves = name in ("prototype", "clavicles")
    assert ("springs" in said) == has_curves
    if has_curves:
        assert set(said["springs"]) == set(springs.joints)


def test_a_name_that_the_language_cannot_say_is_refused(tmp_path: Path):
    figure = read_figure(FIGURES / "pendulum.fig")
    springs, _ = springs_from_option(figure, None)
    with pytest.raises(ValueError, match="two words"):
        write_fig(replace(figure, name="two words"), springs, tmp_path / "out.fig")
    assert not (tmp_path / "out.fig").exists()
