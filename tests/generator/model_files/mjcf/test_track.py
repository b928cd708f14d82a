"""Motions in the coordinates of models of other programs, which then play them."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from generator import (
    InputError,
    Plan,
    Recording,
    Scene,
    UsageError,
    convert,
    read_figure,
    simulate,
)
from tests.command import mover, run

FREE = {"waist": (0.1, 0.4, 0.2)}


@pytest.fixture(scope="module")
def tumble() -> Recording:
    rates = {"lower_torso": (1.0, 2.0, -0.7, 0.3, 0.5, -0.2), "left_knee": (2.0,)}
    plan = Plan(stop=0.2, free_root=True, displacements=FREE, velocities=rates)
    return simulate(read_figure("prototype"), plan)


@pytest.fixture(scope="module")
def swing() -> Recording:
    return simulate(read_figure("prototype"), Plan(stop=0.2, displacements=FREE))


def play(folder: Path, recording: Recording) -> None:
    """Compare every frame of a track with the run: poses, and kinetic energies."""
    mujoco = pytest.importorskip("mujoco")
    model = mujoco.MjModel.from_xml_path(str(folder / "body.xml"))
    data = mujoco.MjData(model)
    track = np.load(folder / "track.npz")
    assert track["time"].tolist() == recording.times.tolist()
    assert track["qpos"].shape == (len(recording.times), model.nq)
    assert track["qvel"].shape == (len(recording.times), model.nv)
    for k, (qpos, qvel) in enumerate(zip(track["qpos"], track["qvel"], strict=True)):
        data.qpos, data.qvel = qpos, qvel
        mujoco.mj_forward(model, data)
        mujoco.mj_energyVel(model, data)
        assert data.energy[1] == pytest.approx(recording.energy["kinetic"][k], abs=1e-9)
        for name in ("head", "left_lower_leg", "right_lower_arm"):
            if name in recording.poses:
                pose = recording.poses[name][k]
                assert np.allclose(data.body(name).xpos, pose[:3, 3], atol=1e-10)
                assert np.allclose(np.reshape(data.body(name).xmat, (3, 3)), pose[:3, :3])
    assert np.abs(np.diff(track["qpos"], axis=0)).max() < 0.5


@pytest.mark.verify
@pytest.mark.parametrize("law", ["conservative", "coordinates"])
def test_a_motion_plays_on_a_model_of_mujoco(law: str, swing: Recording, tmp_path: Path) -> None:
    """Balls under the one law, hinges under the other."""
    run("convert", "prototype", tmp_path / "body.xml", "--law", law)
    convert(swing, tmp_path / "track.npz", model=tmp_path / "body.xml")
    play(tmp_path, swing)


@pytest.mark.verify
def test_a_motion_with_a_loop_plays(tmp_path: Path) -> None:
    recording = simulate(read_figure("fourbar"), Plan(stop=0.1))
    convert(read_figure("fourbar"), tmp_path / "body.xml", tmp_path / "body.osim")
    convert(recording, tmp_path / "track.npz", model=tmp_path / "body.xml")
    convert(recording, tmp_path / "track.mot", model=tmp_path / "body.osim")
    play(tmp_path, recording)


@pytest.mark.verify
def test_a_free_motion_plays_on_a_model_with_a_free_root(tumble: Recording, tmp_path: Path) -> None:
    convert(read_figure("prototype"), tmp_path / "body.xml", displacements=FREE, free_root=True)
    tumble.write(tmp_path / "tumble.npz")
    words = ("--model", tmp_path / "body.xml")
    run("convert", tmp_path / "tumble.npz", tmp_path / "track.npz", *words)
    play(tmp_path, tumble)


def test_props_that_a_model_lacks_are_a_loss(tumble: Recording, tmp_path: Path) -> None:
    figure = read_figure("prototype")
    fallen = replace(tumble, scene=Scene.floor())
    start = Plan(free_root=True, height=0.0, scene=Scene.floor())
    convert(figure, tmp_path / "bare.xml", free_root=True)
    convert(figure, tmp_path / "floor.xml", tmp_path / "pose.html", plan=start)
    for name, lacks in (("bare.xml", True), ("floor.xml", False)):
        (losses,) = convert(fallen, tmp_path / "t.npz", model=tmp_path / name).values()
        assert ("which the model lacks as well: floor" in str(losses)) is lacks
    assert "floor" in (tmp_path / "pose.html").read_text(encoding="utf-8")


def test_what_else_acts_in_a_run_is_a_loss(tmp_path: Path) -> None:
    plan = Plan(gravity=(0.0, -1.62, 0.0), locked=("left_knee",))
    losses = convert(read_figure("prototype"), tmp_path / "a.xml", plan=plan)
    assert "alone: drives, links and locks of joints, gravity other" in str(
        losses[tmp_path / "a.xml"]
    )


@pytest.mark.verify
def test_the_key_of_a_start_has_its_velocities(tumble: Recording, tmp_path: Path) -> None:
    mujoco = pytest.importorskip("mujoco")
    plan = Plan(free_root=True, displacements=FREE, velocities={"left_knee": (2.0,)})
    convert(read_figure("prototype"), tmp_path / "body.xml", plan=plan)
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "body.xml"))
    expected = np.zeros(model.nv)
    expected[model.joint("left_knee").dofadr] = 2.0
    assert np.allclose(model.key_qvel[0], expected, atol=1e-12)


def test_a_model_without_a_free_root_is_refused(tumble: Recording, tmp_path: Path) -> None:
    convert(read_figure("prototype"), tmp_path / "body.xml", tmp_path / "body.osim")
    with pytest.raises(InputError, match="`root_torso`, which the model has; the model has no"):
        convert(tumble, tmp_path / "track.npz", model=tmp_path / "body.xml")
    with pytest.raises(InputError, match="no coordinates lower_torso_1, lower_torso_2"):
        convert(tumble, tmp_path / "track.mot", model=tmp_path / "body.osim")
    assert {path.suffix for path in tmp_path.iterdir()} == {".xml", ".osim", ""}
    freed = {"displacements": FREE, "free_root": True}
    convert(read_figure("prototype"), tmp_path / "free.osim", **freed)
    losses = convert(tumble, tmp_path / "track.mot", model=tmp_path / "free.osim")
    assert "leaves others standing" in str(losses[tmp_path / "track.mot"])


def test_a_motion_of_an_attached_figure_says_nothing_of_its_root(
    swing: Recording, tmp_path: Path
) -> None:
    losses = convert(swing, tmp_path / "swing.mot")
    assert "leaves others standing" not in str(losses)


def test_a_motion_without_a_run_has_no_speeds(swing: Recording, tmp_path: Path) -> None:
    convert(read_figure("prototype"), tmp_path / "body.xml")
    swing.write(tmp_path / "swing.action")
    losses = convert(tmp_path / "swing.action", tmp_path / "track.npz", model=tmp_path / "body.xml")
    assert "speeds, `qvel`, which the motion does not have" in str(losses)
    assert set(np.load(tmp_path / "track.npz")) == {"time", "qpos"}


def test_what_a_model_does_not_play_is_refused(swing: Recording, tmp_path: Path) -> None:
    convert(read_figure("prototype"), tmp_path / "body.xml", tmp_path / "body.urdf")
    with pytest.raises(UsageError, match=r"body\.xml is of MuJoCo"):
        convert(swing, tmp_path / "a.bvh", model=tmp_path / "body.xml")
    with pytest.raises(UsageError, match=r"body\.urdf is neither"):
        convert(swing, tmp_path / "a.npz", model=tmp_path / "body.urdf")
    with pytest.raises(UsageError, match="`figure`, `fps` and `model` are for motions"):
        convert(read_figure("prototype"), tmp_path / "a.xml", model=tmp_path / "body.xml")
    renamed = (tmp_path / "body.xml").read_text().replace('name="left_upper_leg"', 'name="thigh"')
    (tmp_path / "renamed.xml").write_text(renamed)
    with pytest.raises(InputError, match="the motion has no `thigh`"):
        convert(swing, tmp_path / "a.npz", model=tmp_path / "renamed.xml")
    (tmp_path / "bad.xml").write_text("<mujoco>")
    with pytest.raises(InputError, match="this is not XML"):
        convert(swing, tmp_path / "a.npz", model=tmp_path / "bad.xml")
    with pytest.raises(InputError, match="cannot be read: no such file"):
        convert(swing, tmp_path / "a.npz", model=tmp_path / "none.xml")
    assert mover("convert", "prototype", tmp_path / "a.xml", "--model", "b.xml").exit_code == 2


def test_a_floor_is_in_mujoco_models_and_a_loss_of_others(tmp_path: Path) -> None:
    words = ("--floor", "--scene", "seat", "--height", "0.3", "--friction", "0.4")
    shown = run(
        "convert", "prototype", tmp_path / "a.xml", tmp_path / "a.urdf", *words, "--verbose"
    )
    text = (tmp_path / "a.xml").read_text()
    assert 'name="floor"' in text
    assert 'geom1="seat" geom2="left_lower_leg.contact_0"' in text
    assert "the floor, the props and the contact with them" in shown.output


@pytest.mark.slow
def test_a_kind_of_fall_is_the_start_of_a_model(tmp_path: Path) -> None:
    words = ("--fall", "slip", "--seed", "6", "--verbose")
    shown = run("convert", "male50", tmp_path / "b.xml", tmp_path / "b.urdf", *words)
    assert 'qvel="' in (tmp_path / "b.xml").read_text()
    assert "the velocities of the start" in shown.output
    assert shown.output.count("what acts in `mover simulate` alone: tone of muscles") == 2


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("a.fig", "--floor"), "a figure file keeps its joints to the ground"),
        (("a.xml", "--friction", "0.4"), "--friction needs --floor"),
        (("a.xml", "--seed", "1"), "--seed needs --fall"),
        (("a.xml", "--fall", "push", "--set", "waist=1,2,3"), "exclude each other"),
        (("a.xml", "--floor", "--height", "-1"), "would start below the floor"),
        (("a.xml", "--scene", "nowhere"), "nowhere"),
        (("a.xml", "--fall", "push"), "only a person falls so"),
    ],
)
def test_wrong_starts_are_refused(
    words: tuple[str, ...], message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    figure = "pendulum" if message.startswith("only") else "prototype"
    refused = mover("convert", figure, *words)
    assert refused.exit_code in (1, 2)
    assert message in refused.output
    assert list(tmp_path.iterdir()) == []
