"""Changes of the curves of a figure, and the chart of one of them."""

from collections.abc import Mapping, Sequence
from html import escape
from math import ceil, degrees, floor, radians
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from generator.diagnostics import UsageError
from generator.figure import Figure
from generator.passive_curve import (
    Displacements,
    PassiveCurve,
    PublishedTorques,
    axis_springs,
    joint_label,
    passive_curve,
)
from generator.rotations import Array
from generator.springs_file.axes import axis_label, parallel_sign
from generator.springs_file.edit import (
    SpringEdit,
    apply_edits,
    check_target,
    edit_of_other_side,
    springs_and_text,
)
from springs import AxisSpring, SpringSet
from springs.axis import Direction
from springs.elastic import Range
from springs.published.tables import curves_of_motion

CurveKey = tuple[str, Direction]
"""Joint and axis of a curve."""

_UNSAVED = "changes.springs.toml"


class CurveEditor:
    """Changes of springs as loaded, by joint and axis."""

    def __init__(
        self, figure: Figure, springs: SpringSet, folder: Path, choice: str | Path | None
    ) -> None:
        """Begin without changes; `choice` is that of the springs, as for `read_springs`."""
        self.figure, self.loaded, self.springs = figure, springs, springs
        self.edits: dict[CurveKey, SpringEdit] = {}
        self._folder, self._choice = folder, choice

    @property
    def joints(self) -> dict[str, str]:
        """Joints that have curves, by their labels."""
        names = [name for name in self.figure.joints if axis_springs(self.loaded, name)]
        labels = [joint_label(name) for name in names]
        if len(set(labels)) < len(labels):
            labels = names
        return dict(zip(labels, names, strict=True))

    def motions(self, joint: str) -> dict[str, Direction]:
        """Axes of the curves of a joint, by the names of their motions."""
        found: dict[str, Direction] = {}
        for spring in axis_springs(self.loaded, joint):
            axis = f"about {axis_label(spring.direction)}"
            name = spring.motion or axis
            found[f"{name}, {axis}" if name in found else name] = spring.direction
        return found

    @property
    def best_known_joint(self) -> str:
        """The joint with the curve of most publications."""
        return max(
            self.joints.values(),
            key=lambda joint: max(
                len(curves_of_motion(joint, spring.motion))
                for spring in axis_springs(self.loaded, joint)
            ),
        )

    def curve(self, springs: SpringSet, key: CurveKey, at: Displacements) -> PassiveCurve | None:
        """Return the curve of springs about an axis in a pose; None without one."""
        joint, direction = key
        for spring in axis_springs(springs, joint):
            if parallel_sign(spring.direction, direction):
                oriented = spring.oriented_along(direction)
                return passive_curve(self.figure, springs, joint, oriented, at)
        return None

    def loaded_spring(self, key: CurveKey) -> AxisSpring:
        """Return the spring about an axis as loaded."""
        joint, direction = key
        return next(
            spring.oriented_along(direction)
            for spring in axis_springs(self.loaded, joint)
            if parallel_sign(spring.direction, direction)
        )

    def edit(self, key: CurveKey) -> SpringEdit:
        """Return the change of a curve."""
        return self.edits.get(key, SpringEdit(*key))

    def other_side(self, key: CurveKey) -> CurveKey | None:
        """Return the same curve of the joint on the other side; None without one."""
        other = edit_of_other_side(self.loaded, SpringEdit(*key))
        return None if other is None else (other.joint, other.direction)

    def change(self, edit: SpringEdit, *, both_sides: bool) -> SpringSet:
        """Replace the change of a curve, and return the springs; nothing changes on an error.

        Raises:
            ModelError: the spring has no such law, or a springs file cannot state it.
            InputError: the springs file with the changes cannot be read.
        """
        changes = [edit]
        if both_sides and (other := edit_of_other_side(self.loaded, edit)) is not None:
            changes.append(other)
        edits = dict(self.edits)
        for each in changes:
            key = each.joint, each.direction
            edits.pop(key, None)
            if apply_edits(self.loaded, [each]) != self.loaded:
                edits[key] = each
        self.springs, _ = self._read(edits, self._folder / _UNSAVED)
        self.edits = edits
        return self.springs

    def text(self, file: Path) -> str:
        """Return the springs file with the changes.

        Raises UsageError where there are none, and for the file of the springs that they change.
        """
        check_target(self.figure, file, self._choice)
        _, text = self._read(self.edits, file)
        if not text:
            raise UsageError("no curve was changed: there is nothing to save")
        return text

    def _read(self, edits: Mapping[CurveKey, SpringEdit], file: Path) -> tuple[SpringSet, str]:
        changed = apply_edits(self.loaded, edits.values())
        return springs_and_text(self.figure, self.loaded, changed, file, self._choice)


MAX_PUBLISHED = 5
"""Published curves in a chart."""

LAW_COLOUR, LOADED_COLOUR, RANGE_COLOUR = "#e8383d", "#868e96", "rgba(134,142,150,0.13)"

PUBLISHED_COLOURS = ("#3b82f6", "#16a34a", "#a855f7", "#d97706", "#0d9488")

_BAND_OPACITY = 0.2

_FIRST_PUBLISHED = 4
_SERIES_PER_ROW = 3

_EDGE = 1e-6
"""Half the width of the edge of a shaded area [rad]."""

_EXTENSION = 30
"""Points from the end of a curve to an angle beyond it."""


def chart_series() -> tuple[dict[str, Any], ...]:
    """Return the series of the chart: always as many, so that only their numbers change."""
    hidden: dict[str, Any] = {"width": 0, "points": {"show": False}}
    series: list[dict[str, Any]] = [
        {"label": "angle"},
        hidden,
        hidden,
        _line(LOADED_COLOUR, 1.0),
    ]
    for colour in PUBLISHED_COLOURS:
        series += [hidden, hidden, _line(colour, 2.0)]
    series += [
        _line(LOADED_COLOUR, 1.5, dash=(6, 4)),
        _line(LAW_COLOUR, 2.0, dash=(3, 4)),
        _line(LAW_COLOUR, 2.0, dash=(3, 4)),
        _line(LAW_COLOUR, 3.0),
        {
            "stroke": LAW_COLOUR,
            "width": 0,
            "points": {"show": True, "size": 13, "width": 3, "stroke": "#ffffff",
                       "fill": LAW_COLOUR},
        },
    ]  # fmt: skip
    return tuple(series)


def _line(colour: str, width: float, **more: object) -> dict[str, Any]:
    return {"stroke": colour, "width": width, "points": {"show": False}, **more}


def chart_bands() -> tuple[dict[str, Any], ...]:
    """Return the shaded areas: the normal range, and the scatter of the published curves."""
    bands: list[dict[str, Any]] = [{"series": (2, 1), "fill": RANGE_COLOUR}]
    for k, colour in enumerate(PUBLISHED_COLOURS):
        low = _FIRST_PUBLISHED + _SERIES_PER_ROW * k
        red, green, blue = (int(colour[i : i + 2], 16) for i in (1, 3, 5))
        fill = f"rgba({red},{green},{blue},{_BAND_OPACITY})"
        bands.append({"series": (low + 1, low), "fill": fill})
    return tuple(bands)


def chart_data(
    curve: PassiveCurve, loaded: PassiveCurve, angle: float, limit: float
) -> tuple[Array, ...]:
    """Return the columns of the chart, angles in deg first; nan where a curve is not drawn.

    The chart joins what is on both sides of nan, so that each column is drawn in one range.

    The moving point is at an angle [rad], and the chart ends at a torque [N m].
    """
    angles, place = _chart_angles(curve, loaded, angle)
    nothing, zero = np.full_like(angles, np.nan), np.zeros_like(angles)
    shaded = np.where(_normal_mask(curve, angles), 2.0 * limit, 0.0)
    columns = [np.degrees(angles), -shaded, shaded, zero]
    for k in range(MAX_PUBLISHED):
        row = curve.published[k] if k < len(curve.published) else None
        columns += [zero, zero, nothing] if row is None else _published_columns(curve, row, angles)
    torques = curve.moment_at(angles)
    known = curve.valid_range or (-np.inf, np.inf)
    below, above = angles < known[0], angles > known[1]
    before = loaded.moment_at(angles)
    columns.append(nothing if np.array_equal(before, torques) else before)
    columns += [np.where(part, torques, np.nan) for part in (below, above, ~(below | above))]
    point = nothing.copy()
    point[place] = torques[place]
    columns.append(point)
    return tuple(columns)


def _chart_angles(curve: PassiveCurve, loaded: PassiveCurve, angle: float) -> tuple[Array, int]:
    """Return the angles of the chart [rad], and the place of one of them among these."""
    low, high = float(curve.angles[0]), float(curve.angles[-1])
    beyond: Array = np.linspace(min(max(angle, low), high), angle, _EXTENSION)
    ends = [end.angle for end in curve.normal_ends if end is not None and low < end.angle < high]
    inner = [end + side * _EDGE for end in ends for side in (-1.0, 1.0)]
    angles = np.unique(np.concatenate([curve.angles, loaded.angles, beyond, inner]))
    return angles, int(np.searchsorted(angles, angle))


def _normal_mask(curve: PassiveCurve, angles: Array) -> NDArray[np.bool_]:
    """True within the normal range; False everywhere if it is not known at all."""
    low, high = (None if end is None else end.angle for end in curve.normal_ends)
    if low is None and high is None:
        return np.zeros(len(angles), dtype=bool)
    return (angles > (-np.inf if low is None else low)) & (
        angles < (np.inf if high is None else high)
    )


def _published_columns(curve: PassiveCurve, row: PublishedTorques, angles: Array) -> list[Array]:
    """Return lower and upper edge of the scatter and the torque at angles [rad].

    Without a scatter, and beyond its range, both edges are the same.
    """
    known = np.isfinite(row.torques)
    at = curve.angles[known]
    edges = (row.torques, row.torques) if row.band is None else row.band
    columns = [np.interp(angles, at, edge[known]) for edge in edges]
    beyond = (angles < at[0]) | (angles > at[-1])
    columns[1] = np.where(beyond, columns[0], columns[1])
    return [*columns, np.where(beyond, np.nan, np.interp(angles, at, row.torques[known]))]


def chart_axes(curve: PassiveCurve) -> tuple[dict[str, Any], ...]:
    """Return the axes of the chart."""
    font = "11px system-ui, sans-serif"
    common: dict[str, Any] = {
        "font": font, "labelFont": font, "labelSize": 18, "gap": 4,
        "ticks": {"size": 4, "width": 1}, "grid": {"width": 1},
    }  # fmt: skip
    return (
        {**common, "label": f"{curve.label} [deg]", "size": 34, "space": 40},
        {**common, "label": "Torque on the child [N m]", "size": 44},
    )


def angle_limits(curve: PassiveCurve, loaded: PassiveCurve, angle: float) -> tuple[float, float]:
    """Return the angles at the edges of the chart [deg]; it shows the present angle."""
    first, last = min(curve.angles[0], loaded.angles[0]), max(curve.angles[-1], loaded.angles[-1])
    low, high = degrees(min(first, angle - _ROOM)), degrees(max(last, angle + _ROOM))
    return _ANGLE_STEP * floor(low / _ANGLE_STEP), _ANGLE_STEP * ceil(high / _ANGLE_STEP)


_ROOM = radians(3.0)
"""Angle between the present one and the edge of the chart, at least [rad]."""

_ANGLE_STEP = 10.0
"""Limits of the chart are multiples of it [deg]."""


def torque_limit(loaded: PassiveCurve, moment: float) -> float:
    """Return the torque at the edges of the chart [N m]; it shows the present moment."""
    limit = loaded.torque_limits()[1]
    while abs(moment) > limit:
        limit *= 2.0
    return limit


def moment_html(moment: str, remarks: Sequence[str]) -> str:
    """Return the present moment, and remarks below it, as HTML in which no text is markup."""
    below = "".join(f"<div>{escape(remark)}</div>" for remark in remarks)
    return (
        '<div style="padding:0 1em 0.4em"><div style="font-size:1.05em;font-weight:600">'
        f'{escape(moment)}</div><div style="font-size:0.8em;opacity:0.8">{below}</div></div>'
    )


def legend_html(curve: PassiveCurve, *, is_changed: bool) -> str:
    """Return the legend as HTML in which no text is markup."""
    rows = [_legend_row(LAW_COLOUR, "solid", curve.label, "")]
    if is_changed:
        rows.append(_legend_row(LOADED_COLOUR, "dashed", "As loaded", ""))
    for row, colour in zip(curve.published, PUBLISHED_COLOURS, strict=False):
        sample = str(row.row.sample)
        remark = ", ".join(filter(None, [sample, "shaded: scatter" if row.band else ""]))
        rows.append(_legend_row(colour, "solid", row.label, remark))
    if not curve.published:
        rows.append(_legend_row("transparent", "solid", "", "No published curve of this motion"))
    if any(end is not None for end in curve.normal_ends):
        rows.append(_legend_row(_RANGE_SWATCH, "solid", "Normal range of motion", ""))
    return _block(rows)


def sources_html(curve: PassiveCurve) -> str:
    """Return the sources of the curves as HTML in which no text is markup."""
    own = ". ".join(filter(None, [curve.spring.reference.rstrip("."), curve.spring.why]))
    rows = [_legend_row(LAW_COLOUR, "solid", curve.label, own or "No source is stated.")]
    for row, colour in zip(curve.published, PUBLISHED_COLOURS, strict=False):
        rows.append(_legend_row(colour, "solid", row.label, " ".join(_remarks(row))))
    if any(end is not None for end in curve.normal_ends):
        rows.append(
            _legend_row(_RANGE_SWATCH, "solid", "Normal range of motion", " ".join(_ranges(curve)))
        )
    return _block(rows)


_RANGE_SWATCH = "rgba(134,142,150,0.45)"


def _block(rows: Sequence[str]) -> str:
    return f'<div style="font-size:0.8em;line-height:1.35;padding:0 1em">{"".join(rows)}</div>'


def _legend_row(colour: str, style: str, title: str, remark: str) -> str:
    line = f"border-top:3px {style} {colour};width:1.4em;flex:none;margin-top:0.55em"
    return (
        f'<div style="display:flex;gap:0.6em;margin-bottom:0.2em"><div style="{line}"></div>'
        f"<div><b>{escape(title)}</b> "
        f'<span style="opacity:0.75">{escape(remark)}</span></div></div>'
    )


def _sentence(text: str) -> str:
    return text[:1].upper() + text[1:]


def _remarks(row: PublishedTorques) -> list[str]:
    """Return sample, range, scatter and reference of a published curve, a sentence each."""
    published, found = row.row, list[str]()
    if str(published.sample):
        found.append(f"{_sentence(str(published.sample))}.")
    if published.valid_range is not None:
        words = "Measured" if published.range_is_measured else "Usable"
        found.append(f"{words} for {_degrees(published.valid_range)}.")
    if published.held_angles:
        others = (f"{name} at {degrees(at):.4g} deg" for name, at in published.held_angles.items())
        found.append(f"With {' and '.join(others)}.")
    if published.scatter_text:
        found.append(f"Band: {published.scatter_text}.")
    found.append(str(published.reference))
    return found


def _ranges(curve: PassiveCurve) -> list[str]:
    """Return the ends of the normal range with their sources."""
    found = [end for end in curve.normal_ends if end is not None]
    ends = ", ".join(f"{end.motion} {abs(degrees(end.angle)):.0f} deg" for end in found)
    sources = dict.fromkeys(f"{end.sample}; {end.reference}" for end in found)
    return [f"{_sentence(ends)}.", *map(_sentence, sources)]


def _degrees(ends: Range) -> str:
    low, high = (degrees(end) + 0.0 for end in ends)
    return f"{low:.4g} to {high:.4g} deg"
