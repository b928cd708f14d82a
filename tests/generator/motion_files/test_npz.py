"""All of a run in one archive: numpy reads it, and this program reads every bit back."""

import json
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from generator.diagnostics import InputError
from generator.motion_files import motion_from_action, read_npz
from generator.motion_files.action import ActionFile
from generator.motion_files.npz import write
from generator.recording import Accuracy, Ending, Outcome, Recording
from tests.motions import MOTIONS, clip


def same(one: Any, other: Any) -> bool:
    if isinstance(one, np.ndarray):
        return one.shape == other.shape and one.tobytes() == other.tobytes()
    if isinstance(one, dict):
        return list(one) == list(other) and all(same(one[k], other[k]) for k in one)
    if isinstance(one, Accuracy):
        return all(same(getattr(one, f.name), getattr(other, f.name)) for f in fields(one))
    return type(one) is type(other) and (one == other or (one != one and other != other))


@pytest.mark.parametrize("name", MOTIONS)
def test_a_run_reads_back_bit_for_bit(name: str, tmp_path: Path):
    motion = clip(name)
    losses = write(motion, tmp_path / "run.npz")
    header, back = read_npz(tmp_path / "run.npz")
    assert header == motion.header
    assert motion.recording is not None
    for field in fields(Recording):
        assert same(getattr(motion.recording, field.name), getattr(back, field.name)), field.name
    assert [loss.what.split(":")[0] for loss in losses.entries] == ["the figure"]


def test_what_json_does_not_have_reads_back_too(tmp_path: Path):
    motion = clip("fourbar")
    assert motion.recording is not None
    failed = replace(
        motion.recording,
        outcome=Outcome(Ending.TURNED_OVER, "joint `a` turned \u00e9", 0.3, "a"),
        accuracy=Accuracy(
            float("nan"), 1e-3, float("inf"), 1e-3, 7, np.full(motion.times.size, np.nan)
        ),
        constraint_drift=float("nan"),
        strayed=1e-9,
        drive_torques={"crank_pin": np.arange(51.0)[:, None]},
    )
    write(replace(motion, recording=failed), tmp_path / "run.npz")
    _, back = read_npz(tmp_path / "run.npz")
    assert same(back.accuracy, failed.accuracy)
    assert np.isnan(back.constraint_drift)
    assert back.outcome == failed.outcome
    assert same(dict(back.drive_torques), failed.drive_torques)
    assert back.strayed == failed.strayed


def test_numpy_alone_finds_the_arrays_by_name(tmp_path: Path):
    motion = clip("prototype")
    write(motion, tmp_path / "run.npz")
    with np.load(tmp_path / "run.npz") as archive:
        assert np.array_equal(archive["poses/left_lower_leg"], motion.poses["left_lower_leg"])
        assert np.array_equal(archive["displacements/left_knee"], motion.displacements["left_knee"])
        about = json.loads(str(archive["about"]))
    assert about["chains"]["left_knee"] == [["R", 0.0, -1.0, 0.0]]


def test_the_motion_of_an_action_file_is_written_but_is_no_run(tmp_path: Path):
    motion = clip("fourbar")
    action = ActionFile(motion.header, motion.chains, motion.times, motion.displacements)
    write(motion_from_action(action, motion.figure), tmp_path / "run.npz")
    with np.load(tmp_path / "run.npz") as archive:
        assert np.allclose(archive["poses/rocker"], motion.poses["rocker"], atol=1e-6)
        assert not any(name.startswith("velocities") for name in archive.files)
    with pytest.raises(InputError, match="holds no run"):
        read_npz(tmp_path / "run.npz")


def arrays_of(path: Path) -> dict[str, np.ndarray]:
    write(clip("fourbar"), path)
    with np.load(path) as archive:
        return {name: archive[name] for name in archive.files}


def refused(path: Path) -> list[str]:
    with pytest.raises(InputError) as failure:
        read_npz(path)
    return [fault.message for fault in failure.value.diagnostics]


def test_all_that_is_missing_or_misshapen_is_told_at_once(tmp_path: Path):
    path = tmp_path / "run.npz"
    arrays = arrays_of(path)
    del arrays["reactions/crank_pin"]
    arrays["energy/spring"] = np.zeros(3)
    arrays["drive_torques/handle"] = np.zeros((51, 1))
    arrays["poses/crank"] = arrays["poses/crank"].astype(np.float32)
    np.savez(path, allow_pickle=False, **arrays)
    said = refused(path)
    assert len(said) == 4
    assert any("has no array `reactions/crank_pin`" in each for each in said)
    assert any("drives joint `handle`" in each for each in said)
    assert any("`energy/spring` has shape (3,), not (51,)" in each for each in said)
    assert any("`poses/crank` holds float32, not float64" in each for each in said)


def spoilt(name: str, at: tuple[int, ...], value: float, path: Path) -> list[str]:
    """What is said of a run with one wrong number."""
    arrays = arrays_of(path)
    arrays[name][at] = value
    np.savez(path, allow_pickle=False, **arrays)
    return refused(path)


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize(
    ("name", "at"),
    [
        ("displacements/crank_pin", (3, 0)),
        ("poses/crank", (50, 0, 3)),
        ("reactions/crank_pin", (0, 5)),
        ("energy/kinetic", (7,)),
    ],
)
def test_numbers_that_are_not_finite_are_refused(name, at, value, tmp_path: Path):
    path = tmp_path / "run.npz"
    said = [f"`{path}` is not a run: the array `{name}` holds numbers that are not finite"]
    assert spoilt(name, at, value, path) == said


def test_a_last_time_without_bound_is_refused(tmp_path: Path):
    assert "the array `times` holds" in spoilt("times", (50,), np.inf, tmp_path / "run.npz")[0]


@pytest.mark.parametrize(
    ("at", "value"), [((4, 0, 0), 0.3), ((4, 2, 2), 1e200), ((4, 3, 0), 0.1), ((4, 3, 3), 2.0)]
)
def test_poses_that_are_not_rigid_are_refused(at, value, tmp_path: Path):
    path = tmp_path / "run.npz"
    said = [f"`{path}` is not a run: the array `poses/crank` holds poses that are not rigid"]
    assert spoilt("poses/crank", at, value, path) == said


def test_a_mirrored_pose_is_refused(tmp_path: Path):
    path = tmp_path / "run.npz"
    arrays = arrays_of(path)
    arrays["poses/crank"][2, :3, :3] *= -1.0
    np.savez(path, allow_pickle=False, **arrays)
    assert "`poses/crank` holds poses that are not rigid" in refused(path)[0]


@pytest.mark.parametrize("share", [0.0, 0.01, 0.3, 0.7, 0.999])
def test_a_file_that_was_cut_is_refused(share: float, tmp_path: Path):
    path = tmp_path / "run.npz"
    write(clip("fourbar"), path)
    data = path.read_bytes()
    path.write_bytes(data[: int(share * len(data))])
    (said,) = refused(path)
    assert "truncated" in said


def test_bytes_that_flip_are_noticed(tmp_path: Path):
    path = tmp_path / "run.npz"
    write(clip("fourbar"), path)
    data = bytearray(path.read_bytes())
    rng = np.random.default_rng(5)
    whole = read_npz(path)[1]
    for place in rng.integers(0, len(data), 60):
        spoilt = data.copy()
        spoilt[place] ^= 0xFF
        path.write_bytes(bytes(spoilt))
        try:
            _, back = read_npz(path)
        except InputError:
            continue
        assert same(dict(back.poses), dict(whole.poses))


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"about": None}, "has no array `about`"),
        ({"about": np.array("{")}, "not what this program writes"),
        ({"about": np.array("[1]")}, "not what this program writes"),
        ({"about": np.array('{"npz": 2}')}, "its version is 2"),
        ({"about": np.array('{"npz": 1, "run": {}}')}, "not what this program writes"),
        ({"times": np.array([0.0, 0.0])}, "not one row that increases"),
        ({"times": None}, "not one row that increases"),
    ],
)
def test_what_is_no_run_is_refused(change: dict[str, Any], sentence: str, tmp_path: Path):
    path = tmp_path / "run.npz"
    arrays = {**arrays_of(path), **change}
    kept = {name: value for name, value in arrays.items() if value is not None}
    np.savez(path, allow_pickle=False, **kept)
    (said,) = refused(path)
    assert sentence in said


def test_other_files_are_refused(tmp_path: Path):
    np.save(tmp_path / "one.npy", np.zeros(3))
    (tmp_path / "one.npy").rename(tmp_path / "one.npz")
    assert refused(tmp_path / "one.npz") == [
        f"`{tmp_path / 'one.npz'}` is not a run: it is one array, not an archive of them"
    ]
    np.savez(tmp_path / "two.npz", thing=np.array([{}], dtype=object))
    assert "truncated" in refused(tmp_path / "two.npz")[0]
    assert "no such file" in refused(tmp_path / "none.npz")[0]
    assert "directory" in refused(tmp_path)[0]
