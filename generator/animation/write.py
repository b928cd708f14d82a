"""One door for all formats: the suffix of a path chooses."""

from collections.abc import Callable, Mapping
from pathlib import Path

from generator.animation import action, csv_table
from generator.errors import MoverError
from generator.figure import Figure
from generator.recording import Recording

FORMATS: Mapping[str, Callable[[Recording, Figure, Path], None]] = {
    ".action": action.write,
    ".csv": csv_table.write,
}
"""What writes a recording of a figure to a path, by suffix."""


class UnknownFormatError(MoverError):
    """A path whose suffix names no format."""


def format_of(path: Path) -> Callable[[Recording, Figure, Path], None]:
    """What writes the format that a path's suffix names. Raises UnknownFormatError."""
    try:
        return FORMATS[path.suffix.lower()]
    except KeyError:
        said = f"`{path.suffix}` is no known suffix" if path.suffix else "the suffix is missing"
        raise UnknownFormatError(f"{path}: {said}; known are {', '.join(FORMATS)}") from None


def write_recording(recording: Recording, figure: Figure, path: str | Path) -> None:
    """Write a recording of a figure in the format that the path's suffix names.

    The file is written whole or not at all.

    Raises:
        UnknownFormatError: the suffix names no format.
        OSError: the file cannot be written.
    """
    format_of(Path(path))(recording, figure, Path(path))
