"""Conversion in Python writes what the command writes."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from generator import Plan, Recording, convert, read_figure, read_npz, simulate
from generator.conversion import read_motion, read_motion_with_warnings
from generator.diagnostics import InputError, ModelError, UnknownNameError, UsageError
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
    with pytest.raises(ModelError, match="a recording from a file does not hold its figure"):
        convert(replace(swing, model=None), tmp_path / "swing.glb")
    with pytest.raises(UsageError, match="`figure`, `fps` and `model` are for motions"):
        convert(pendulum, tmp_path / "a.xml", figure=pendulum)
    with pytest.raises(UsageError, match="a model becomes a figure"):
        convert(tmp_path / "model.urdf", tmp_path / "swing.glb")
    with pytest.raises(UsageError, match=r"`\.png` is not a known suffix"):
        convert(swing, tmp_path / "a.glb", tmp_path / "swing.png", figure=pendulum)
    assert list(tmp_path.iterdir()) == []


def test_a_figure_starts_with_the_displacements_of_the_command(pendulum, tmp_path: Path) -> None:
    values = {"shoulder": np.radians([10.0, 20.0, 30.0])}
    convert(pendulum, tmp_path / "a.sto", displacements=values, free_root=True)
    words = ("--set", "shoulder=10,20,30", "--free-root")
    run("convert", "pendulum", tmp_path / "b.sto", *words)
    a, b = (read_motion(tmp_path / name) for name in ("a.sto", "b.sto"))
    assert (a.header, a.chains) == (b.header, b.chains)
    assert list(a.displacements) == ["link1"]
    assert a.displacements["link1"] == pytest.approx(b.displacements["link1"], abs=1e-15)
    convert(pendulum, tmp_path / "a.fig", displacements=values)
    assert read_figure(tmp_path / "a.fig").joints["shoulder"].displacement == pytest.approx(
        values["shoulder"], rel=1e-15
    )
    (tmp_path / "c.osim").write_text("old")
    losses = convert("pendulum", tmp_path / "c.osim", tmp_path / "c.glb", free_root=True)
    assert [path.name for path in losses] == ["c.osim", "c.glb"]
    assert "link1_6" in (tmp_path / "c.osim").read_text(encoding="utf-8")


def test_displacements_of_the_wrong_joints_are_refused(swing, pendulum, tmp_path: Path) -> None:
    with pytest.raises(UnknownNameError, match="did you mean `shoulder`"):
        convert(pendulum, tmp_path / "a.xml", displacements={"sholder": [0.0, 0.0, 0.0]})
    with pytest.raises(ModelError, match="joint shoulder has 3 displacements, not 1"):
        convert(pendulum, tmp_path / "a.xml", displacements={"shoulder": [0.0]})
    with pytest.raises(UsageError, match="a figure file keeps its joints to the ground"):
        convert(pendulum, tmp_path / "a.fig", free_root=True)
    for options in ({"displacements": {}}, {"free_root": True}, {"springs": "none"}):
        with pytest.raises(UsageError, match="are for figures"):
            convert(swing, tmp_path / "a.glb", figure=pendulum, **options)
        with pytest.raises(UsageError, match="are for figures"):
            convert(tmp_path / "model.urdf", tmp_path / "a.fig", **options)
    with pytest.raises(UsageError, match="are for motions"):
        convert(pendulum, tmp_path / "a.glb", fps=30)
    with pytest.raises(UsageError, match=r"a scale is for \.bvh files"):
        convert(pendulum, tmp_path / "a.glb", scale=1)
    assert list(tmp_path.iterdir()) == []


def test_a_motion_is_resampled_and_scaled(swing, pendulum, tmp_path: Path) -> None:
    convert(swing, tmp_path / "a.action", fps=100)
    motion = read_motion(tmp_path / "a.action")
    assert motion.times == pytest.approx(np.arange(5) / 100.0, abs=1e-12)
    convert(swing, tmp_path / "a.bvh", tmp_path / "a.glb", figure=pendulum, scale=1.0)
    convert(swing, tmp_path / "b.bvh", figure=pendulum)
    assert (tmp_path / "a.bvh").read_bytes() != (tmp_path / "b.bvh").read_bytes()


def test_a_table_without_a_figure_needs_one(pendulum, tmp_path: Path) -> None:
    text = "inDegrees=no\nendheader\ntime shoulder_1\n0 0.5\n"
    (tmp_path / "a.sto").write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=r"a\.sto` does not name its figure"):
        convert(tmp_path / "a.sto", tmp_path / "a.glb")
    motion, warnings = read_motion_with_warnings(tmp_path / "a.sto", pendulum)
    assert motion.displacements["shoulder"][0, 0] == 0.5
    assert len(warnings) == 1
    with pytest.raises(UsageError, match=r"motions are read from \.action, \.npz, \.mot, \.sto"):
        read_motion(tmp_path / "a.glb", pendulum)
