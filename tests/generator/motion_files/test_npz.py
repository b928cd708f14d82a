"""All of a run in one archive: numpy reads it, and what is not a run is refused."""

import json
import tracemalloc
from dataclasses import fields, replace
from pathlib import Path
from typing import Any
from zipfile import ZIP_DEFLATED, ZipFile

import numpy as np
import pytest
from numpy.lib import format as npy

from generator.contact.box import Box
from generator.contact.record import ContactRecord
from generator.contact.scene import Scene
from generator.diagnostics import InputError
from generator.motion_files import motion_from_action, npz, read_npz
from generator.motion_files.action import ActionFile
from generator.motion_files.npz import write
from tests.contacts import PROPS, with_contact
from tests.motions import clip


def test_numpy_alone_finds_the_arrays_by_name(tmp_path: Path):
    motion = clip("fourbar")
    losses = write(motion, tmp_path / "run.npz")
    assert [loss.what.split(":")[0] for loss in losses.entries] == ["the figure"]
    with np.load(tmp_path / "run.npz") as archive:
        assert np.array_equal(archive["poses/rocker"], motion.poses["rocker"])
        moved = archive["displacements/crank_pin"]
        assert np.array_equal(moved, motion.displacements["crank_pin"])
        about = json.loads(str(archive["about"]))
    assert about["chains"]["crank_pin"] == [["R", 0.0, 0.0, 1.0]]


def test_the_motion_of_an_action_file_is_written_but_is_no_run(tmp_path: Path):
    motion = clip("fourbar")
    action = ActionFile(motion.header, motion.chains, motion.times, motion.displacements)
    write(motion_from_action(action, motion.figure), tmp_path / "run.npz")
    with np.load(tmp_path / "run.npz") as archive:
        assert np.allclose(archive["poses/rocker"], motion.poses["rocker"], atol=1e-6)
        assert not any(name.startswith("velocities") for name in archive.files)
    with pytest.raises(InputError, match="a motion without a run"):
        read_npz(tmp_path / "run.npz")


@pytest.fixture
def path(tmp_path: Path) -> Path:
    """The archive of a run."""
    write(clip("fourbar"), tmp_path / "run.npz")
    return tmp_path / "run.npz"


def change(path: Path, **changes: np.ndarray | None) -> None:
    """Replace arrays of an archive, or with None leave them out."""
    with np.load(path) as archive:
        arrays = {name: archive[name] for name in archive.files}
    kept = {name: array for name, array in (arrays | changes).items() if array is not None}
    np.savez(path, allow_pickle=False, **kept)


def array(path: Path, name: str) -> np.ndarray:
    with np.load(path) as archive:
        return archive[name]


def refused(path: Path) -> list[str]:
    with pytest.raises(InputError) as failure:
        read_npz(path)
    return [fault.message for fault in failure.value.diagnostics]


def test_all_that_is_missing_or_misshapen_is_told_at_once(path: Path):
    change(
        path,
        **{
            "reactions/crank_pin": None,
            "energy/spring": np.zeros(3),
            "drive_torques/handle": np.zeros((21, 1)),
            "poses/crank": array(path, "poses/crank").astype(np.float32),
        },
    )
    messages = refused(path)
    assert len(messages) == 4
    for part in (
        "has no array `reactions/crank_pin`",
        "drives joint `handle`",
        "`energy/spring` has shape (3,), not (21,)",
        "`poses/crank` holds float32, not float64",
    ):
        assert any(part in message for message in messages)


RIGID, NUMBERS = "poses that are not rigid", "numbers that are not finite"


@pytest.mark.parametrize(
    ("name", "at", "value", "what"),
    [
        ("displacements/crank_pin", (3, 0), np.nan, NUMBERS),
        ("poses/crank", (20, 0, 3), np.inf, NUMBERS),
        ("reactions/crank_pin", (0, 5), -np.inf, NUMBERS),
        ("energy/kinetic", (7,), np.nan, NUMBERS),
        ("poses/crank", (4, 0, 0), 0.3, RIGID),
        ("poses/crank", (4, 2, 2), 1e200, RIGID),
        ("poses/crank", (4, 3, 0), 0.1, RIGID),
        ("poses/crank", (4, 3, 3), 2.0, RIGID),
        ("times", (20,), np.inf, NUMBERS),
    ],
)
def test_one_wrong_number_is_refused(
    name: str, at: tuple[int, ...], value: float, what: str, path: Path
):
    spoilt = array(path, name)
    spoilt[at] = value
    change(path, **{name: spoilt})
    assert refused(path)[0] == f"`{path}` is not a run: the array `{name}` holds {what}"


def test_a_mirrored_pose_is_refused(path: Path):
    poses = array(path, "poses/crank")
    poses[2, :3, :3] *= -1.0
    change(path, **{"poses/crank": poses})
    assert f"`poses/crank` holds {RIGID}" in refused(path)[0]


@pytest.mark.parametrize("share", [0.0, 0.01, 0.3, 0.7, 0.999])
def test_a_file_that_was_cut_is_refused(share: float, path: Path):
    data = path.read_bytes()
    path.write_bytes(data[: int(share * len(data))])
    (said,) = refused(path)
    assert "truncated" in said


def test_bytes_that_flip_are_noticed(path: Path):
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
        for name, poses in whole.poses.items():
            assert np.array_equal(back.poses[name], poses)


@pytest.mark.parametrize(
    ("changes", "sentence"),
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
def test_what_is_no_run_is_refused(changes: dict[str, Any], sentence: str, path: Path):
    change(path, **changes)
    (message,) = refused(path)
    assert sentence in message


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


def test_arrays_too_large_for_the_memory_are_refused_before_they_are_made(path: Path):
    """Zeros shrink to a thousandth: a small file may declare any number of bytes."""
    header = {"descr": "<f8", "fortran_order": False, "shape": (60, 1_000_000)}
    with (
        ZipFile(path, "a", ZIP_DEFLATED, compresslevel=1) as archive,
        archive.open("poses/zeros.npy", "w") as stream,
    ):
        npy.write_array_header_1_0(stream, header)
        for _ in range(60):
            stream.write(bytes(8_000_000))
    assert path.stat().st_size < 5_000_000
    tracemalloc.start()
    with pytest.raises(InputError, match="its arrays take 480 MB, and at most 400 MB are read"):
        read_npz(path)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 1_000_000


@pytest.mark.parametrize(
    "header",
    ["{'descr': '<f8', 'fortran_order': False, 'shape': (2000000000,), }", "{'descr': ("],
)
def test_an_array_that_is_not_what_its_header_declares_is_refused(header: str, path: Path):
    with ZipFile(path, "a") as archive:
        text = header.encode() + b"\n"
        start = npy.MAGIC_PREFIX + b"\x01\x00" + len(text).to_bytes(2, "little")
        archive.writestr("more.npy", start + text)
    with pytest.raises(InputError, match="is not an archive of numpy, or is truncated"):
        read_npz(path)


def test_a_run_that_cannot_be_read_back_is_a_loss(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(npz, "MAX_RUN_BYTES", 1_000)
    losses = write(clip("fourbar"), tmp_path / "run.npz")
    assert "a way back into this program" in losses.entries[-1].what


def test_contact_is_read_back_and_stands_in_arrays_of_its_own(tmp_path: Path):
    motion = with_contact(clip("slides"))
    assert motion.recording is not None
    contact = motion.recording.contact
    assert contact is not None
    losses = write(motion, tmp_path / "run.npz")
    assert [loss.what.split(":")[0] for loss in losses.entries] == ["the figure"]
    with np.load(tmp_path / "run.npz") as archive:
        assert np.array_equal(archive["contact_forces/arm"], contact.forces["arm"])
        assert np.array_equal(archive["contact_depths/arm"], contact.depths["arm"])
        assert np.array_equal(archive["ground_reaction"], contact.ground_reaction)
    _, back = read_npz(tmp_path / "run.npz")
    assert back.contact is not None
    assert back.contact.segments == contact.segments
    assert back.contact.overlap == contact.overlap
    for field in fields(ContactRecord):
        default = field.default is None or callable(field.default_factory)
        assert not default or bool(np.any(getattr(back.contact, field.name))), field.name
    assert np.array_equal(back.energy_balance, motion.recording.energy_balance)
    assert back.scene == PROPS


def test_a_scene_that_no_file_can_hold_is_a_loss(tmp_path: Path):
    motion = with_contact(clip("slides"))
    huge = replace(PROPS.props[1], shape=Box(size=(2e3, 1.0, 1.0)))
    losses = write(replace(motion, scene=Scene((huge,))), tmp_path / "run.npz")
    assert "the props of the scene: crate" in map(str, losses.entries)
    assert read_npz(tmp_path / "run.npz")[1].scene == Scene()


@pytest.mark.parametrize("text", [5, "[[box]]", {"a": 1}])
def test_a_wrong_scene_is_refused(text: Any, tmp_path: Path):
    path = tmp_path / "run.npz"
    write(with_contact(clip("slides")), path)
    about = json.loads(str(array(path, "about")))
    about["scene"] = text
    change(path, about=np.array(json.dumps(about)))
    (message,) = refused(path)
    assert "not what this program writes" in message


def test_a_run_with_contact_needs_its_arrays(tmp_path: Path):
    path = tmp_path / "run.npz"
    write(with_contact(clip("slides")), path)
    change(
        path,
        **{
            "contact_forces/arm": None,
            "energy/friction": None,
            "ground_reaction": np.zeros((21, 3)),
            "contact_depths/rod": np.zeros(3),
            "force_points/sole": None,
            "sensitivity": np.zeros(2),
        },
    )
    messages = refused(path)
    assert len(messages) == 6
    for part in (
        "has no array `contact_forces/arm`",
        "has no array `force_points/sole`",
        "has no array `energy/friction`",
        "`ground_reaction` has shape (21, 3), not (21, 6)",
        "`contact_depths/rod` has shape (3,), not (21,)",
        "`sensitivity` has shape (2,), not (21,)",
    ):
        assert any(part in message for message in messages)


@pytest.mark.parametrize("spoilt", [{}, {"segments": {"arm": {}}}, {"segments": 3}, []])
def test_a_contact_record_without_its_numbers_is_refused(spoilt: Any, tmp_path: Path):
    path = tmp_path / "run.npz"
    write(with_contact(clip("slides")), path)
    about = json.loads(str(array(path, "about")))
    about["run"]["contact"] = spoilt
    change(path, about=np.array(json.dumps(about)))
    (message,) = refused(path)
    assert "not what this program writes" in message


def test_files_older_than_contact_are_read(path: Path):
    about = json.loads(str(array(path, "about")))
    del about["run"]["contact"], about["scene"]
    change(path, about=np.array(json.dumps(about)))
    assert read_npz(path)[1].contact is None
    assert read_npz(path)[1].scene == Scene()
