"""`mover picture`: moments, labels, files, and what is refused."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image

from generator.contact.arrows import ArrowScale
from generator.diagnostics import UsageError
from generator.input_files.scene import write_scene
from generator.kinematics.placement import forward_kinematics
from generator.motion_files import PICTURE_SUFFIXES, motion_writer
from plots.figure_image import Body, arrow_triangles, draw_moments
from plots.framing import Size
from plots.picture import IMAGE_FORMATS, Subject, film_times, make_film, on_white, time_labels
from plots.video import VIDEO_FORMATS
from tests.command import answer, mover, run
from tests.contacts import PROPS, with_contact
from tests.motions import clip
from tests.pictures import NO_SCENE, drawn, motion_file, moving, standing, swing, view_of


def test_moments_between_frames_are_interpolated():
    subject, motion = moving(), swing()
    times = motion.times
    at_frames = subject.moments(times.tolist())
    for k, poses in enumerate(at_frames):
        for name, pose in poses.items():
            assert pose == pytest.approx(motion.poses[name][k], abs=1e-12)
    (between,) = subject.moments([0.5 * float(times[3] + times[4])])
    rows = {name: 0.5 * (v[3] + v[4]) for name, v in motion.displacements.items()}
    expected = forward_kinematics(motion.tree, rows).poses
    for name, pose in between.items():
        assert pose == pytest.approx(expected[name], abs=1e-12)


@pytest.mark.parametrize(
    ("times", "labels"),
    [
        ([0.0, 1.0, 2.0], ["0 s", "1 s", "2 s"]),
        ([0.0, 0.4, 0.8], ["0.0 s", "0.4 s", "0.8 s"]),
        ([0.35], ["0.35 s"]),
        ([-0.0000001, 1 / 3, 2 / 3], ["0.00 s", "0.33 s", "0.67 s"]),
        ([0.001, 0.0025], ["0.001 s", "0.003 s"]),
    ],
)
def test_labels_have_the_digits_they_need(times: list[float], labels: list[str]):
    assert time_labels(times) == pytest.approx(labels)


@given(st.lists(st.floats(0.0, 5.0), min_size=1, max_size=6))
def test_labels_are_near_their_times(times: list[float]):
    labels = time_labels(times)
    assert len({len(label.partition(".")[2]) for label in labels}) == 1
    for label, time in zip(labels, times, strict=True):
        assert float(label.removesuffix(" s")) == pytest.approx(time, abs=0.0051)


@pytest.mark.parametrize("fps", [1.0, 24.0, 30.0, 100.0])
def test_a_film_lasts_as_long_as_its_motion(fps: float):
    times = film_times(np.array([0.5, 0.7, 2.5]), fps)
    assert len(times) == round(2.0 * fps) + 1
    assert times[0] == 0.5
    assert times[-1] == pytest.approx(2.5)
    assert np.diff(times) == pytest.approx(1.0 / fps)


@given(st.integers(100, 140))
def test_frames_of_a_film_have_even_sizes(width: int):
    film = make_film(moving(), view_of("front"), NO_SCENE, None, Size(width), 10.0)
    image = film.draw(2)
    assert (image.shape[0] % 2, image.shape[1] % 2, image.shape[2]) == (0, 0, 3)
    assert 0 <= image.shape[1] - width <= 1
    assert film.count == 5


def test_a_film_contains_its_motion():
    film = make_film(moving(), view_of("three-quarter"), NO_SCENE, None, Size(100), 10.0)
    frames = [film.draw(k) for k in range(film.count)]
    for image in frames:
        assert np.all(image[[0, -1]] == 255)
        assert np.all(image[:, [0, -1]] == 255)
        assert np.any(image < 200)
    assert any(np.any(frames[0] != image) for image in frames[1:])


def test_pictures_of_a_figure(tmp_path: Path):
    said = answer(
        *("picture", "prototype", "--view", "front", "--width", "8cm", "--dpi", "100"),
        *("-o", tmp_path / "a.png", "-o", tmp_path / "a.svg", "-o", tmp_path / "a.pdf"),
    )
    with Image.open(tmp_path / "a.png") as image:
        assert image.size == (315, said["sizes"][str(tmp_path / "a.png")][1])
        assert image.info["dpi"] == pytest.approx((100.0, 100.0), abs=0.1)
        pixels = np.array(image.convert("RGBA"))
    assert np.all(pixels[..., 3] == 255)
    assert pixels[0, 0].tolist() == [255, 255, 255, 255]
    assert "<svg" in (tmp_path / "a.svg").read_text(encoding="utf-8")
    assert (tmp_path / "a.pdf").read_bytes().startswith(b"%PDF")


def test_pixels_are_those_of_the_renderer(tmp_path: Path):
    run("picture", "prototype", "--view", "front", "--width", 120, "-o", tmp_path / "a.png")
    with Image.open(tmp_path / "a.png") as image:
        pixels = np.array(image.convert("RGB"))
    assert np.array_equal(pixels, on_white(drawn(standing(), view_of("front"))))


def test_the_props_of_a_run_are_drawn(tmp_path: Path):
    """As those of a scene file; --no-scene leaves them out, as a format without props."""
    recording = clip("prototype").recording
    assert recording is not None
    recording = replace(recording, scene=PROPS)
    for name in ("run.npz", "run.action"):
        recording.write(tmp_path / name)
    (tmp_path / "props.scene.toml").write_text(write_scene(PROPS), encoding="utf-8")
    pixels: list[bytes] = []
    for source, options in (
        ("run.npz", ()),
        ("run.action", ("--scene", tmp_path / "props.scene.toml")),
        ("run.npz", ("--no-scene",)),
        ("run.action", ()),
    ):
        output = tmp_path / "out.png"
        said = answer("picture", tmp_path / source, "--width", "300", *options, "-o", output)
        has_props = len(pixels) < 2
        assert said["losses"] == (["planes that are not drawn: wall"] if has_props else [])
        pixels.append(Image.open(output).tobytes())
    assert pixels[0] == pixels[1] != pixels[2] == pixels[3]


def purple_rows(image: np.ndarray) -> np.ndarray:
    """Rows in which the colour of forces is seen."""
    return np.flatnonzero(np.all(image[..., :3] == [123, 44, 191], axis=-1).any(axis=1))


def test_contact_forces_are_arrows_with_their_scale(tmp_path: Path):
    """At a frame, between two, and in a video; --no-forces leaves them and the scale out."""
    motion = with_contact(clip("prototype"))
    run = motion.recording
    assert run is not None
    assert run.contact is not None
    run.write(tmp_path / "run.npz")
    time = float(0.5 * (run.times[2] + run.times[3]))
    line = ("picture", tmp_path / "run.npz", "--view", "front", "--at", time)
    answer(*line, "-o", tmp_path / "a.png", "-o", tmp_path / "a.svg")
    answer(*line, "--no-forces", "-o", tmp_path / "b.png", "-o", tmp_path / "b.svg")
    start = run.times[0]
    still = answer("picture", tmp_path / "run.npz", "--at", start, "-o", tmp_path / "c.png")
    assert still["losses"][-1] == f"nothing is touched at {start:g} s"
    drawn, bare = (np.array(Image.open(tmp_path / f"{name}.png")) for name in "ab")
    assert len(purple_rows(drawn)) > 10
    assert len(purple_rows(bare)) == 0
    first = {name: poses[0] for name, poses in motion.poses.items()}
    scale = ArrowScale.of_figure(motion.figure, first)
    assert f"<!-- {scale.text} -->" in (tmp_path / "a.svg").read_text(encoding="utf-8")
    assert "<!-- Arrow" not in (tmp_path / "b.svg").read_text(encoding="utf-8")
    subject = Subject(Body.of_figure(motion.figure), None, motion, (), ())
    film = make_film(subject, view_of("front"), NO_SCENE, None, Size(400), 10.0)
    assert len(purple_rows(film.draw(0))) == 0  # nothing touches at the first frame
    assert len(purple_rows(film.draw(1))) > 2
    assert np.any(film.draw(0)[-25:] < 128), "the scale below"


def test_arrows_are_as_long_as_their_forces():
    scale = ArrowScale(0.2, 500.0)
    forces, tips = (
        np.array([[0.0, 250.0, 0.0], [0.0, 0.0, -20.0]]),
        np.array([[1.0] * 3, [2.0] * 3]),
    )
    for ends in scale.arrows(forces, tips):
        corners = arrow_triangles(ends[None], scale).reshape(-1, 3)
        direction = ends[1] - ends[0]
        along = (corners - ends[0]) @ direction / np.linalg.norm(direction)
        assert along.min() == pytest.approx(0.0, abs=1e-12)
        assert along.max() == pytest.approx(np.linalg.norm(direction))
        across = np.linalg.norm(np.cross(corners - ends[0], direction), axis=1)
        assert across.max() / np.linalg.norm(direction) <= scale.head_radius + 1e-12


def test_a_pose_outside_its_ranges_is_told(tmp_path: Path):
    line = ("picture", "male50", "--width", 20, "-o", tmp_path / "a.png")
    said = mover(*line, "--set", "left_knee=175").stderr
    assert "warning: joint left_knee is at 175 deg, outside its limits -1 to 137.7 deg" in said
    assert said.count("-1 to 137.7 deg") == 1
    assert "push" not in said
    assert mover(*line, "--set", "left_knee=60").stderr == ""


def test_a_transparent_picture_has_no_background(tmp_path: Path):
    run("picture", "pendulum", "--transparent", "-o", tmp_path / "a.png")
    with Image.open(tmp_path / "a.png") as image:
        alpha = np.array(image.convert("RGBA"))[..., 3]
    assert alpha[0, 0] == 0
    assert alpha.max() == 255


def test_a_strip_has_its_times_below(tmp_path: Path):
    path = motion_file(tmp_path)
    line = ["picture", path, "--figure", "pendulum", "--strip", "3", "--width", "300"]
    said = answer(*line, "-o", tmp_path / "a.svg", "-o", tmp_path / "a.png")
    assert said["times_s"] == pytest.approx([0.1, 0.3, 0.5])
    text = (tmp_path / "a.svg").read_text(encoding="utf-8")
    assert all(f"<!-- {label} -->" in text for label in ("0.1 s", "0.3 s", "0.5 s"))
    assert "<image" in text
    bare = answer(*line, "--no-labels", "-o", tmp_path / "b.png")
    heights = [said["sizes"][str(tmp_path / "a.png")][1], bare["sizes"][str(tmp_path / "b.png")][1]]
    assert heights[0] > heights[1] + 5
    with Image.open(tmp_path / "a.png") as image:
        assert image.size == (300, heights[0])
        below = np.array(image.convert("L"))[heights[1] :]
    columns = np.flatnonzero((below < 128).any(axis=0))
    assert columns[0] < 100
    assert columns[-1] > 200


def test_moments_at_times(tmp_path: Path):
    path = motion_file(tmp_path)
    line = ("picture", path, "--figure", "pendulum", "--width", 80)
    for at in ("0.1", "0.37"):
        run(*line, "--at", at, "-o", tmp_path / f"{at}.png")
    run(*line, "-o", tmp_path / "first.png")
    first, default, later = (
        (tmp_path / f"{name}.png").read_bytes() for name in ("0.1", "first", "0.37")
    )
    assert first == default
    assert first != later


def test_a_pose_file_is_drawn_as_its_displacements(tmp_path: Path):
    pose = tmp_path / "bent.pose"
    run("pose", "prototype", "--set", "left_knee=60", "-o", pose)
    small = ("--width", 60)
    run("picture", pose, "--figure", "prototype", *small, "-o", tmp_path / "a.png")
    run("picture", "prototype", "--set", "left_knee=60", *small, "-o", tmp_path / "b.png")
    run("picture", "prototype", "--pose", pose, *small, "-o", tmp_path / "c.png")
    run("picture", "prototype", *small, "-o", tmp_path / "d.png")
    a, b, c, d = ((tmp_path / f"{name}.png").read_bytes() for name in "abcd")
    assert a == b == c != d


def test_segments_without_a_psurf_are_listed(tmp_path: Path):
    said = answer("picture", "fourbar", "--view", "front", "-o", tmp_path / "a.png")
    assert any("crank" in loss for loss in said["losses"])


@pytest.mark.parametrize("kind", ["gif", "mp4"])
def test_a_video_of_a_motion(tmp_path: Path, kind: str):
    reader = pytest.importorskip("imageio.v3")
    target = tmp_path / f"swing.{kind}"
    line = ("picture", motion_file(tmp_path), "--figure", "pendulum", "--fps", 20, "--width", 80)
    said = answer(*line, "-o", target)
    assert said["frames"] == 9
    frames = reader.imread(target)
    assert frames.shape[0] == 9
    assert frames.shape[2] == 80
    assert np.abs(frames[0].astype(int) - frames[4]).max() > 50


@pytest.mark.parametrize("kind", ["gif", "mp4"])
def test_an_interrupted_video_leaves_no_file(
    tmp_path: Path, kind: str, monkeypatch: pytest.MonkeyPatch
):
    if kind == "mp4":
        pytest.importorskip("imageio_ffmpeg")
    path, count = motion_file(tmp_path), 0

    def draw(*details: object) -> np.ndarray:
        nonlocal count
        count += 1
        if count > 7:
            raise KeyboardInterrupt
        return draw_moments(*details)

    monkeypatch.setattr("plots.picture.draw_moments", draw)
    before = set(tmp_path.iterdir())
    line = ("picture", path, "--figure", "pendulum", "--fps", 20, "--width", 80)
    result = mover(*line, "-o", tmp_path / "still.png", "-o", tmp_path / f"swing.{kind}")
    assert result.exit_code == 3
    assert "interrupted before anything was written" in result.stderr
    assert set(tmp_path.iterdir()) == before


def test_commands_that_write_motions_name_this_one(tmp_path: Path):
    assert set(PICTURE_SUFFIXES) == {*IMAGE_FORMATS, *VIDEO_FORMATS}
    for suffix in PICTURE_SUFFIXES:
        with pytest.raises(UsageError, match=rf"`mover picture MOTION -o FILE\{suffix}` draws"):
            motion_writer(tmp_path / f"fall{suffix}")
