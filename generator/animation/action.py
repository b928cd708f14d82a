"""The action file: a motion as text that explains itself (figure 3.6; `docs/action-file.md`)."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from generator.animation.clip import NO_FIGURE, Clip, unheld
from generator.animation.displayed import (
    ANGLE_UNIT,
    LENGTH_UNIT,
    shown_chain,
    shown_number,
    unit_of,
)
from generator.animation.header import Header, header_of
from generator.exchange.losses import Losses
from generator.figure import Factor, Figure
from generator.frames import Array
from generator.recording import Recording
from generator.whole_file import write_whole

VERSION = "1"
UNITS = f"s {ANGLE_UNIT} {LENGTH_UNIT}"
END = "end"


@dataclass(frozen=True, eq=False)
class ActionFile:
    """What an action file says, in SI units and radians; n frames.

    Attributes:
        header: where the motion is from.
        chains: the factors of each joint, in figure order, the innermost first.
        times: shape (n,) [s].
        displacements: of each joint, shape (n, degrees of freedom) [rad or m].
    """

    header: Header
    chains: Mapping[str, tuple[Factor, ...]]
    times: Array
    displacements: Mapping[str, Array]

    def __post_init__(self) -> None:
        """Refuse what the file could not hold."""
        if self.times.ndim != 1 or self.times.size == 0 or np.any(np.diff(self.times) <= 0.0):
            raise ValueError("the times of a motion are one row that increases")
        for name, chain in self.chains.items():
            if name.split() != [name] or name.startswith("#"):
                raise ValueError(f"an action file cannot hold a joint named {name!r}")
            if self.displacements[name].shape != (len(self.times), len(chain)):
                raise ValueError(f"joint {name} needs {len(chain)} displacements a frame")

    @property
    def normalised_times(self) -> Array:
        """Times as fractions of the motion, 0 to 1, shape (n,); 0 for a single frame."""
        return normalised(self.times)


def normalised(times: Array) -> Array:
    """Times as fractions of the whole, shape (n,); 0 for a single one."""
    whole = times[-1] - times[0]
    return (times - times[0]) / (whole if whole > 0.0 else 1.0)


def action_of(recording: Recording, figure: Figure) -> ActionFile:
    """The action file of a recording of a figure."""
    return ActionFile(
        header_of(recording, figure), recording.chains, recording.times, recording.displacements
    )


def clip_of_action(action: ActionFile, figure: Figure) -> Clip:
    """The motion in an action file, of a figure."""
    return Clip(figure, action.header, action.chains, action.times, action.displacements)


def format_action(action: ActionFile) -> str:
    """The text of an action file. Raises ValueError for a number that is not finite."""
    return "".join(f"{line}\n" for line in _lines(action))


def write(clip: Clip, path: Path) -> Losses:
    """Write a motion as an action file, whole or not at all.

    Raises:
        OSError: the file cannot be written.
        ValueError: a displacement is not finite, or a name not one word.
    """
    action = ActionFile(clip.header, clip.chains, clip.times, clip.displacements)
    write_whole(path, format_action(action))
    return Losses.of("action file", [NO_FIGURE, unheld(clip)])


def _lines(action: ActionFile) -> Iterator[str]:
    yield "# The motion of a figure: a table of its joints, then a row for each frame."
    yield f"action {VERSION}"
    yield f"units {UNITS}"
    yield from action.header.lines()
    yield f"joints {len(action.chains)}"
    columns: list[str] = []
    for name, chain in action.chains.items():
        yield f"{name} {shown_chain(chain)}"
        columns += [f"{name}.{k}" for k in range(1, len(chain) + 1)]
    yield f"frames {len(action.times)}"
    yield f"# {' '.join(['normalised', 'seconds', *columns])}"
    units = {name: [unit_of(factor) for factor in chain] for name, chain in action.chains.items()}
    rows = {name: action.displacements[name].tolist() for name in action.chains}
    fractions, times = action.normalised_times.tolist(), action.times.tolist()
    for frame, (fraction, time) in enumerate(zip(fractions, times, strict=True)):
        words = [repr(fraction), repr(time)]
        for name, row in rows.items():
            words += map(shown_number, row[frame], units[name])
        yield " ".join(words)
    yield END
