"""Plate of net and passive joint moments and powers over a gait cycle, from `mover inverse`."""

import csv
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from io import StringIO
from itertools import pairwise
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from generator.diagnostics import InputError, error
from generator.inverse.legs import SIDES
from generator.inverse.passive import VERTICAL_FORCE
from generator.text_io import load_text
from plots.canvas import BLACK, BLUE, PALE, add_footer, create_canvas, plot_style
from plots.plate import Plate
from springs.backends import Array

STRIKE_FORCE = 20.0
"""Vertical force above which a foot is on the ground [N]."""

MIN_SWING = 0.1
"""Shortest time without force before a heel strike [s]."""

_ROW_HEIGHT = 1.5
"""Height of a row of panels [inch]."""

_NET = re.compile(r"(.+) net \[N m\]")


@dataclass(frozen=True, eq=False)
class ShareTable:
    """A table of net and passive moments.

    Attributes:
        columns: Columns by title, nan for blank cells, shape (n,).
        coordinates: Coordinates with passive moments.
        is_sure: Whether each row is sure, shape (n,).
    """

    columns: Mapping[str, Array]
    coordinates: tuple[str, ...]
    is_sure: Array

    @property
    def times(self) -> Array:
        """Times [s], shape (n,)."""
        return self.columns["time [s]"]

    def cycle(self, coordinate: str) -> tuple[float, float] | None:
        """Return two heel strikes of the foot of a coordinate's side [s]; None without them.

        The first pair between which all rows are sure is preferred.
        """
        side = _side(coordinate)
        forces = [title for title in self.columns if title.endswith(VERTICAL_FORCE)]
        force = next((one for one in forces if side and _side(one) == side), None)
        if force is None:
            return None
        pairs = list(pairwise(heel_strikes(self.times, self.columns[force])))
        sure = self.times[self.is_sure > 0.0]
        known = [pair for pair in pairs if len(sure) and sure[0] <= pair[0] and pair[1] <= sure[-1]]
        return next(iter(known or pairs), None)


def heel_strikes(times: Array, force: Array) -> list[float]:
    """Return the times at which a foot meets the ground after a swing [s]."""
    found: list[float] = []
    left = times[0] if force[0] <= STRIKE_FORCE else np.nan
    for k in range(1, len(times)):
        before, here = float(force[k - 1]), float(force[k])
        if before > STRIKE_FORCE >= here:
            left = times[k]
        if before <= STRIKE_FORCE < here and times[k] - left >= MIN_SWING:
            part = (STRIKE_FORCE - before) / (here - before)
            found.append(float(times[k - 1] + part * (times[k] - times[k - 1])))
    return found


def _side(name: str) -> str:
    """Return the side that a word of a name says; empty without one."""
    words = set(re.split(r"[_\W]+", name.lower()))
    return next((side for side, known in SIDES.items() if words & set(known)), "")


def read_share(path: Path) -> ShareTable:
    """Read a table of `mover inverse`. Raises InputError for another one."""
    source, fault = load_text(path, str(path))
    if fault is not None:
        raise InputError([fault])
    rows = list(csv.reader(StringIO(source.text)))
    titles = rows[0] if rows else []
    coordinates = tuple(match[1] for title in titles if (match := _NET.fullmatch(title)))
    if not coordinates or titles[:2] != ["time [s]", "sure"] or len(rows) < 3:
        message = f"`{path}` is not a table of net and passive moments with rows"
        raise InputError([error(message, hint="`mover inverse ... -o share.csv` writes one")])
    numbers = np.empty((len(rows) - 1, len(titles)))
    for k, row in enumerate(rows[1:]):
        try:
            cells = [row[0], str(float(row[1] == "yes")), *row[2:]]
            numbers[k] = [float(cell) if cell else np.nan for cell in cells]
        except (ValueError, IndexError):
            raise InputError([error(f"`{path}`: line {k + 2} is damaged")]) from None
    columns = dict(zip(titles, numbers.T, strict=True))
    missing = [f"{name} {part}" for name in coordinates for part in ("net power [W]", "known")
               if f"{name} {part}" not in columns]  # fmt: skip
    if missing:
        raise InputError([error(f"`{path}` has no column `{missing[0]}`")])
    return ShareTable(columns, coordinates, columns.pop("sure"))


def share_plate(path: Path, name: str) -> Plate:
    """Return the plate of a table. Raises InputError for another file."""
    table = read_share(path)
    sign = (
        "Moments on the child along the coordinate, positive as it is; powers of these. Grey: at "
        "these angles some of the laws and zeros were not measured; dark grey: none was."
    )
    rows = len(table.coordinates)
    numbers: dict[str, Array] = {}
    with plot_style():
        figure = create_canvas(1.2 + _ROW_HEIGHT * rows)
        grid: Sequence[Sequence[Axes]] = figure.subplots(rows, 2, squeeze=False).tolist()
        for k, coordinate in enumerate(table.coordinates):
            cycle = table.cycle(coordinate)
            _draw_row(grid[k], table, coordinate, cycle)
            for part in ("net [N m]", "passive lower [N m]", "passive upper [N m]"):
                title = f"{coordinate} {part}"
                numbers[title] = table.columns[title]
        handles = [
            Line2D([], [], color=BLACK, label="net"),
            Patch(color=BLUE, alpha=0.4, label="passive, over laws and zeros"),
        ]
        figure.legend(handles=handles, loc="outside upper right", ncols=2, frameon=False)
        add_footer(figure, sign, ())
    cycles = [table.cycle(one) for one in table.coordinates]
    over = "a gait cycle between heel strikes of its side" if all(cycles) else "the motion"
    return Plate(
        name=name,
        title=f"{path.name}: net and passive moments and powers",
        caption=f"Net and passive moments and powers of {path.name}, over {over}. Passive moments "
        "are a range over published laws and over the zeros of angles.",
        sign=sign,
        figure=figure,
        tables={"moments": {"time [s]": table.times, **numbers}},
    )


def _draw_row(
    panels: Sequence[Axes], table: ShareTable, name: str, cycle: tuple[float, float] | None
) -> None:
    """Draw moment and power of a coordinate over a cycle, or over the sure times."""
    times = table.times
    inside = table.is_sure > 0.0 if cycle is None else (times >= cycle[0]) & (times <= cycle[1])
    x = times[inside] if cycle is None else 100.0 * (times[inside] - cycle[0]) / np.diff(cycle)
    known = table.columns[f"{name} known"][inside]
    parts = (("[N m]", "net [N m]", "passive {} [N m]"),
             ("[W]", "net power [W]", "passive power {} [W]"))  # fmt: skip
    for axes, (unit, net, passive) in zip(panels, parts, strict=True):
        lower, upper = (
            table.columns[f"{name} {passive.format(end)}"][inside] for end in ("lower", "upper")
        )
        for level, shade in ((1.0, 0.35), (1e-9, 0.45)):
            axes.fill_between(
                x, 0.0, 1.0, where=(known < level).tolist(), step="mid", color=PALE, alpha=shade,
                lw=0.0, transform=axes.get_xaxis_transform(),
            )  # fmt: skip
        axes.fill_between(x, lower, upper, color=BLUE, alpha=0.4, lw=0.5)
        axes.plot(x, table.columns[f"{name} {net}"][inside], color=BLACK, lw=1.2)
        axes.axhline(0.0, color=BLACK, lw=0.5)
        axes.set_title(f"{name.replace('_', ' ')} {unit}")
        axes.set_xlabel("time [s]" if cycle is None else "gait cycle [%]")
