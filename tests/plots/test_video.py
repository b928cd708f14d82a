"""Videos: number and content of the frames, their times, what an encoder lacks."""

from collections.abc import Callable
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from generator.diagnostics import MoverError, UsageError
from plots import video
from plots.video import Film


def bar(frame: int) -> np.ndarray:
    """A red bar that moves to the right, on white."""
    image = np.full((40, 64, 3), 255, dtype=np.uint8)
    image[10:30, 4 * frame : 4 * frame + 8] = (200, 30, 30)
    return image


def film(count: int = 7, fps: float = 30.0, draw: Callable[[int], np.ndarray] = bar) -> Film:
    return Film(count, fps, draw)


def test_a_gif_has_its_frames_at_their_times(tmp_path: Path):
    path = tmp_path / "any.part"
    film().write(path, ".gif")
    with Image.open(path) as read:
        assert (read.format, read.size, read.n_frames) == ("GIF", (64, 40), 7)
        assert read.info["loop"] == 0
        ends = []
        for k in range(7):
            read.seek(k)
            ends.append(read.info["duration"])
            assert np.abs(np.array(read.convert("RGB")).astype(int) - bar(k)).max() < 20
    assert np.cumsum(ends) == pytest.approx(np.arange(1, 8) * 1000.0 / 30.0, abs=5.0)


def test_a_mp4_has_its_frames(tmp_path: Path):
    reader = pytest.importorskip("imageio.v3")
    path = tmp_path / "any.part"
    film().write(path, ".mp4")
    target = path.rename(tmp_path / "film.mp4")
    frames = reader.imread(target)
    assert frames.shape == (7, 40, 64, 3)
    assert reader.immeta(target)["fps"] == pytest.approx(30.0)
    for k in range(7):
        assert np.mean(np.abs(frames[k].astype(int) - bar(k))) < 5.0
    assert np.abs(frames[0].astype(int) - frames[6]).max() > 100


@pytest.mark.parametrize("kind", [".gif", ".mp4"])
def test_a_film_of_one_frame(tmp_path: Path, kind: str):
    if kind == ".mp4":
        pytest.importorskip("imageio_ffmpeg")
    film(1).write(tmp_path / "one", kind)
    assert (tmp_path / "one").stat().st_size > 100


@pytest.mark.parametrize("kind", [".gif", ".mp4"])
def test_progress_counts_each_frame_once(tmp_path: Path, kind: str):
    if kind == ".mp4":
        pytest.importorskip("imageio_ffmpeg")
    done: list[str] = []
    asked: list[tuple[int, str]] = []

    @contextmanager
    def monitor(total: int, noun: str):
        asked.append((total, noun))
        yield done.append

    film().write(tmp_path / "film", kind, monitor)
    assert asked == [(7, "frames")]
    assert len(done) == 7


def test_the_encoder_stops_when_a_frame_fails(tmp_path: Path):
    pytest.importorskip("imageio_ffmpeg")

    def interrupted(frame: int) -> np.ndarray:
        if frame == 3:
            raise KeyboardInterrupt
        return bar(frame)

    with pytest.raises(KeyboardInterrupt):
        film(draw=interrupted).write(tmp_path / "film", ".mp4")


def test_a_failure_of_the_encoder_is_a_sentence(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    class Encoder:
        @staticmethod
        def write_frames(*_: object, **__: object):
            yield
            raise OSError("broken pipe\n\nFFMPEG COMMAND: ...")

    monkeypatch.setattr(video, "_ffmpeg", lambda: Encoder)
    with pytest.raises(MoverError, match=r"ffmpeg failed: broken pipe$"):
        film().write(tmp_path / "film", ".mp4")


def test_frames_that_ffmpeg_left_out_are_noted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    encoder = pytest.importorskip("imageio_ffmpeg")
    for answer in (lambda _: (6, 0.2), no_video):
        monkeypatch.setattr(encoder, "count_frames_and_secs", answer)
        with pytest.raises(MoverError, match=r"it wrote [06] of 7 frames"):
            film().write(tmp_path / "film", ".mp4")


def no_video(_: str) -> tuple[int, float]:
    raise RuntimeError("moov atom not found")


def test_a_folder_that_is_missing_is_an_error_of_the_system(tmp_path: Path):
    for kind in (".gif", ".mp4"):
        with pytest.raises(OSError, match="No such file"):
            film().write(tmp_path / "none" / "film", kind)


@pytest.mark.parametrize("failure", [ModuleNotFoundError("imageio_ffmpeg"), RuntimeError("none")])
def test_without_ffmpeg_the_extra_is_named(failure: Exception, monkeypatch: pytest.MonkeyPatch):
    def missing():
        raise failure

    monkeypatch.setattr(video, "_ffmpeg", missing)
    with pytest.raises(UsageError, match=r'pip install -e "\.\[video\]"'):
        Film.require_encoder(".mp4")
    Film.require_encoder(".gif")
