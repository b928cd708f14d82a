"""Conversion in Python writes what the command writes."""

from pathlib import Path

import numpy as np
import pytest

from generator import Plan, Recording, convert, read_figure, read_npz, simulate
from generator.diagnostics import InputError, UsageError
from generator.figure import Figure
from tests.command import run


@pytest.fixture(scope="module")
def pendulum() -> Figure:
    return read_figure("pendulum")


@pytest.fixture(scope="module")
def swing(pendulum: Figure) -> Recording:
    return simulate(pendulum, Plan(stop=0.04))


def test_a_motion_is_that_of_the_command(swing, pendulum, tmp_path: Path) -> None:
    stored = tmp_path / "swing.npz"
    (losses,) = convert(swing, stored, figure=pendulum).values()
    assert [loss.what.split(":")[0] for loss in losses.entries] == ["the figure"]
    assert np.array_equal(
        read_npz(stored)[1].displacements["shoulder"], swing.displacements["shoulder"]
    )
    for suffix in (".action", ".glb", ".bvh"):
        here, there = tmp_path / f"here{suffix}", tmp_path / f"there{suffix}"
        convert(stored, here)
        run("convert", stored, there)
        assert here.read_bytes() == there.read_bytes()


def test_an_action_file_names_its_figure(swing, pendulum, tmp_path: Path) -> None:
    convert(swing, tmp_path / "swing.action", figure=pendulum)
    convert(tmp_path / "swing.action", tmp_path / "swing.glb")
    convert(tmp_path / "swing.action", tmp_path / "same.glb", figure="pendulum")
    assert (tmp_path / "swing.glb").read_bytes() == (tmp_path / "same.glb").read_bytes()
    text = (tmp_path / "swing.action").read_text(encoding="utf-8")
    (tmp_path / "other.action").write_text(text.replace("pendulum.fig", "nobody.fig"))
    with pytest.raises(InputError, match=r"a motion of `nobody\.fig`, which is not beside it"):
        convert(tmp_path / "other.action", tmp_path / "other.glb")


def test_a_figure_becomes_a_model_and_a_model_a_figure(pendulum, tmp_path: Path) -> None:
    losses = convert(pendulum, tmp_path / "here.xml", tmp_path / "here.fig")
    assert [losses[tmp_path / f"here.{suffix}"].format for suffix in ("xml", "fig")]
    run("convert", "pendulum", tmp_path / "there.xml")
    assert (tmp_path / "here.xml").read_bytes() == (tmp_path / "there.xml").read_bytes()
    assert read_figure(tmp_path / "here.fig") == pendulum
    convert(tmp_path / "here.xml", tmp_path / "back.fig")
    (tmp_path / "again").mkdir()
    run("convert", tmp_path / "here.xml", tmp_path / "again" / "back.fig")
    assert (tmp_path / "back.fig").read_bytes() == (tmp_path / "again/back.fig").read_bytes()


def test_arguments_that_do_not_fit(swing, pendulum, tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="a recording does not hold its figure"):
        convert(swing, tmp_path / "swing.glb")
    with pytest.raises(UsageError, match="`figure` and `fps` are for motions"):
        convert(pendulum, tmp_path / "a.xml", figure=pendulum)
    with pytest.raises(UsageError, match="a model becomes a figure"):
        convert(tmp_path / "model.urdf", tmp_path / "swing.glb")
    with pytest.raises(UsageError, match=r"`\.png` is not a known suffix"):
        convert(swing, tmp_path / "a.glb", tmp_path / "swing.png", figure=pendulum)
    assert list(tmp_path.iterdir()) == []
