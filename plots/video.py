"""Videos of frames that are drawn one after the other: .mp4 by ffmpeg, .gif by Pillow."""

from collections.abc import Callable, Iterator
from contextlib import closing
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from generator.cli.progress import ItemMonitor, no_monitor
from generator.diagnostics import MoverError, UsageError
from generator.losses import Losses

VIDEO_FORMATS = (".mp4", ".gif")

_QUALITY = 18
"""Constant rate factor of H.264: smaller is better, 18 is hardly to be told from the original."""

_PALETTE_FRAMES = 5
"""Frames from which the colours of a .gif are chosen."""


@dataclass(frozen=True)
class Film:
    """Frames at a constant rate, drawn with shape (rows, columns, 3), both numbers even."""

    count: int
    fps: float
    draw: Callable[[int], NDArray[np.uint8]]

    @staticmethod
    def require_encoder(suffix: str) -> None:
        """Raise UsageError unless the library of a format is installed."""
        if suffix != ".mp4":
            return
        try:
            _ffmpeg().get_ffmpeg_exe()
        except (ImportError, RuntimeError):
            message = 'a .mp4 needs ffmpeg: in the project\'s folder, `pip install -e ".[video]"`'
            raise UsageError(message) from None

    def write(self, path: Path, kind: str, progress: ItemMonitor = no_monitor) -> Losses:
        """Write a video as `.mp4` or `.gif`, whatever the suffix of the path.

        Raises:
            OSError: the file cannot be written.
            MoverError: the encoder fails.
        """
        with progress(self.count, "frames") as done:

            def frames() -> Iterator[NDArray[np.uint8]]:
                for k in range(self.count):
                    yield self.draw(k)
                    done("")

            (self._write_gif if kind == ".gif" else self._write_mp4)(path, frames())
        return Losses(kind)

    def _write_mp4(self, path: Path, frames: Iterator[NDArray[np.uint8]]) -> None:
        first = next(frames)
        path.touch()  # ffmpeg says less about a folder that cannot be written
        encoder = _ffmpeg().write_frames(
            str(path),
            (first.shape[1], first.shape[0]),
            fps=self.fps,
            codec="libx264",
            quality=None,
            macro_block_size=2,
            ffmpeg_log_level="error",
            output_params=["-crf", str(_QUALITY), "-f", "mp4", "-movflags", "+faststart"],
        )
        with closing(encoder):
            encoder.send(None)
            try:
                encoder.send(np.ascontiguousarray(first))
                for frame in frames:
                    encoder.send(np.ascontiguousarray(frame))
            except OSError as failure:
                raise MoverError(f"ffmpeg failed: {str(failure).partition(chr(10))[0]}") from None
        try:  # ffmpeg does not say that it failed at the end
            written, _ = _ffmpeg().count_frames_and_secs(str(path))
        except RuntimeError:
            written = 0
        if written != self.count:
            raise MoverError(f"ffmpeg failed: it wrote {written} of {self.count} frames")

    def _write_gif(self, path: Path, frames: Iterator[NDArray[np.uint8]]) -> None:
        from PIL import Image

        chosen = np.linspace(0, self.count - 1, _PALETTE_FRAMES).round().astype(int)
        sample = np.concatenate([self.draw(int(k)) for k in np.unique(chosen)])
        palette = Image.fromarray(sample).quantize(256, dither=Image.Dither.NONE)
        # Times in a .gif are multiples of 10 ms.
        ends = np.round(np.arange(self.count + 1) * 100.0 / self.fps)
        durations = [int(10 * each) for each in np.diff(ends)]
        images = (
            Image.fromarray(frame).quantize(palette=palette, dither=Image.Dither.NONE)
            for frame in frames
        )
        first = next(images)
        options: dict[str, Any] = {"duration": durations, "loop": 0, "optimize": False}
        first.save(path, "GIF", save_all=True, append_images=images, **options)


def _ffmpeg() -> Any:
    """Return the module that imageio writes videos with, which declares no types."""
    return import_module("imageio_ffmpeg")
