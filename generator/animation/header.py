"""What stands above the numbers of an output file: where a motion is from and how it ended."""

from collections.abc import Iterator
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path

from generator.figure import Figure
from generator.frames import Array
from generator.recording import Ending, Recording

NONE = "none"
"""Stands where there is no value."""


@dataclass(frozen=True)
class Header:
    """The origin of a motion.

    Attributes:
        figure: name of the figure's file, else of the figure.
        sha256: of the bytes of the figure's file, in hexadecimal; None when it is in no file.
        start: time of the first frame [s].
        stop: time of the last frame [s].
        frame: interval between frames [s]; None where there is only one.
        springs: where the springs are from.
        law: how the axes of spherical joints join.
        outcome: how the run ended.
        message: the sentence that says it.
    """

    figure: str
    sha256: str | None
    start: float
    stop: float
    frame: float | None
    springs: str
    law: str
    outcome: Ending
    message: str

    def lines(self) -> Iterator[str]:
        """A line for each entry, its name first."""
        yield f"figure {self.figure}"
        yield f"sha256 {self.sha256 or NONE}"
        yield f"start {self.start!r}"
        yield f"stop {self.stop!r}"
        yield f"frame {NONE if self.frame is None else repr(self.frame)}"
        yield f"springs {self.springs}"
        yield f"law {self.law}"
        yield f"outcome {self.outcome.value}"
        yield f"message {self.message}"


def header_of(recording: Recording, figure: Figure) -> Header:
    """The header of a recording of a figure."""
    times, path = recording.times, figure.path
    return Header(
        figure=_one_line(figure.name if path is None else path.name),
        sha256=None if path is None else digest_of(path),
        start=float(times[0]),
        stop=float(times[-1]),
        frame=interval_of(times),
        springs=_one_line(recording.springs),
        law=_one_line(recording.law),
        outcome=recording.outcome.ending,
        message=_one_line(recording.outcome.message),
    )


def interval_of(times: Array) -> float | None:
    """Interval of the first two frames [s], without the last digits that a subtraction spoils."""
    return float(f"{times[1] - times[0]:.12g}") if len(times) > 1 else None


def digest_of(path: Path) -> str | None:
    """SHA-256 of a file's bytes, in hexadecimal; None for a file that cannot be read."""
    try:
        return sha256(path.read_bytes()).hexdigest()
    except (OSError, ValueError):  # no path may hold a zero byte
        return None


def _one_line(text: str | None) -> str:
    """The text with its blanks made single, in characters that UTF-8 can hold."""
    return " ".join((text or NONE).encode("utf-8", "replace").decode().split()) or NONE
