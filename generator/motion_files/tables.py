"""A motion as a table of comma-separated values, with its header in lines that begin with `#`."""

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from generator.losses import Loss, Losses
from generator.motion_files.action import format_chain
from generator.motion_files.columns import columns_of_motion
from generator.motion_files.motion import (
    CONTACT_DEPTHS,
    CONTACT_SIZES,
    GROUND_REACTION,
    NO_FIGURE,
    FigureMotion,
    lost_props,
    motion_from_recording,
    unrepresented,
)
from generator.recording import Recording
from generator.text_io import format_csv_comment, format_csv_rows, write_atomic

if TYPE_CHECKING:
    from pandas import DataFrame  # pyright: ignore[reportMissingTypeStubs]

NO_ENERGIES = Loss("energies: the motion is not that of a run, which alone has them")


def write_csv(motion: FigureMotion, path: Path) -> Losses:
    """Write a motion as a table of comma-separated values, whole or not at all.

    Raises:
        OSError: the file cannot be written.
        ValueError: a displacement is not finite.
    """
    write_atomic(path, format_csv(motion))
    kept = ("energies", GROUND_REACTION, CONTACT_SIZES, CONTACT_DEPTHS)
    results = unrepresented(motion, *kept) or NO_ENERGIES
    return Losses.collect("table", [NO_FIGURE, lost_props(motion), results])


def format_csv(motion: FigureMotion) -> str:
    """The text of the table: `time [s]`, each displacement `JOINT.k`, the energies of a run.

    A free segment has its orientation as a unit quaternion too, `SEGMENT.qw` to `SEGMENT.qz`, which
    is continuous and has no poles: 1, 0, 0, 0 for the orientation in the figure's file. A run with
    contact has the ground reaction, without a point below `MIN_VERTICAL_FORCE`, and for each
    segment `SEGMENT.contact_force` and `SEGMENT.contact_depth`.

    Raises ValueError for a displacement that is not finite.
    """
    return "".join(_csv_lines(motion))


def make_dataframe(data: object) -> "DataFrame":
    """Return the data frame of rows or columns. Raises ImportError without pandas."""
    try:
        from pandas import DataFrame  # pyright: ignore[reportMissingTypeStubs]
    except ImportError:
        raise ImportError(
            'a data frame needs pandas: in the project\'s folder, `pip install -e ".[notebook]"`'
        ) from None
    return DataFrame(data)


def dataframe_of_recording(recording: Recording) -> "DataFrame":
    """Return the table of a recording; see `Recording.to_dataframe`."""
    motion = motion_from_recording(recording)
    return make_dataframe(
        {
            column.title: [float(column.format(one) or "nan") for one in column.read(motion)]
            for column in columns_of_motion(motion)
        }
    )


def _csv_lines(motion: FigureMotion) -> Iterator[str]:
    yield from map(format_csv_comment, motion.header.lines())
    for name, chain in motion.chains.items():
        yield format_csv_comment(f"joint {name} {format_chain(chain)}")
    columns = list(columns_of_motion(motion))
    cells = [list(map(column.format, column.read(motion).tolist())) for column in columns]
    yield format_csv_rows([[column.title for column in columns]])
    yield from (f"{','.join(row)}\n" for row in zip(*cells, strict=True))
