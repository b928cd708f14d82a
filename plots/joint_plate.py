"""The plate of one joint's curve: ranges, torques, and differences from the literature."""

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from math import degrees
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MultipleLocator

from plots.canvas import (
    BLACK,
    GREY,
    LINE_STYLES,
    PALE,
    THESIS_STYLE,
    LineStyle,
    Look,
    add_footer,
    add_legend_above,
    add_title,
    create_panels,
    draw_band,
    draw_curve,
    draw_line,
    draw_marks,
    draw_points,
    draw_zero_line,
    line_look,
    plot_style,
)
from plots.joint_curve import JointCurve, law_claims, read_curve
from plots.literature import Literature, thesis_reference
from plots.plate import Claim, Plate, incomparable_claim
from springs.backends import Array

EXUDYN_STYLE = LineStyle("#E69F00", "-", "o")
"""Style of the torques read out of Exudyn."""

EXCLUDED_DASH = (0, (4, 2))
"""Dash of the printed cubic within a dead zone."""

OTHER_SENSE_DASH = (0, (1, 1))
"""Dash of the printed cubic in the sense that was not chosen."""

_RANGE_END_DASH = (0, (1, 3))

_READING_SPACING = 5.0
"""Angle between the readings that are drawn [deg]."""

_MARKER_SPACING = 15.0
"""Angle between the markers on a published formula [deg]."""

_HEIGHT = 6.7
"""Height of a plate with four references [inch]."""

_REFERENCE_HEIGHT = 0.28
"""Height of each further reference [inch]."""


@dataclass(frozen=True)
class Window:
    """Limits of the axes of a plate.

    Attributes:
        angles: [deg].
        torques: torques of the upper panel [N m]; curves are cut off beyond.
        residuals: residuals of the lower panel, likewise.
    """

    angles: tuple[float, float]
    torques: tuple[float, float]
    residuals: tuple[float, float]

    def __post_init__(self) -> None:
        """Raise ValueError for an empty window."""
        for low, high in (self.angles, self.torques, self.residuals):
            if not low < high:
                raise ValueError(f"nothing is between {low:g} and {high:g}")


@dataclass(frozen=True)
class JointPlate:
    """One joint's curve to be read out of Exudyn, drawn and compared; a call makes the plate.

    Attributes:
        name: name of the plate.
        title: title with the number of the thesis's figure.
        joint: the left one of a pair.
        motion: name of the positive sense about the axis.
        literature: drawn beside the curve, at most as many as there are `LINE_STYLES`.
        window: limits of the axes.
        claims: claims of the curve and the literature, in addition to those of the law.
        comment: beginning of the caption.
        held_deg: angles of revolute joints other than zero [deg].
        is_estimate: True if the thesis names no source; otherwise the literature substitutes for a
            source that is not public.
        sense_odds: odds of the chosen sense of the printed moment, "60/40", where the other one is
            to be drawn as well; "" for a sense that is certain.
    """

    name: str
    title: str
    joint: str
    motion: str
    literature: tuple[Literature, ...]
    window: Window
    claims: Callable[..., Iterable[Claim]]
    comment: str
    held_deg: Mapping[str, float] = field(default_factory=dict[str, float])
    is_estimate: bool = False
    sense_odds: str = ""

    def __call__(self) -> Plate:
        """Read the curve out of Exudyn and draw it."""
        return self.build(self.collect())

    def collect(self) -> JointCurve:
        """Read the joint's curve out of Exudyn."""
        return read_curve(self.joint, self.motion, self.held_deg)

    def build(self, curve: JointCurve) -> Plate:
        """Draw the plate of a curve."""
        own = [thesis_reference("appendix A"), curve.spring.reference]
        others = [str(row.reference) for row in self.literature]
        ends = [str(end.reference) for end in curve.range_ends]
        references = tuple(dict.fromkeys([*own, *others, *ends]))
        return Plate(
            name=self.name,
            title=self.title,
            caption=_caption(self, curve, references),
            sign=_sign_convention(curve),
            figure=_draw(self, curve, references),
            claims=(
                *law_claims(curve),
                *self.claims(curve, *self.literature),
                *(
                    incomparable_claim(f"The torque is that of {row.label}", row.obstacle)
                    for row in self.literature
                    if row.obstacle
                ),
            ),
            tables=_tables(self, curve),
            references=references,
        )


def _draw(plate: JointPlate, curve: JointCurve, references: Sequence[str]) -> Figure:
    window = plate.window
    height = _HEIGHT + _REFERENCE_HEIGHT * max(0, len(references) - 4)
    with plot_style():
        figure, ((strip,), (upper,), (lower,)) = create_panels(height, 3, heights=(0.32, 3.0, 1.2))
        _draw_ranges(strip, curve, window)
        angles = np.radians(np.linspace(*window.angles, 600))
        printed, zone = curve.printed_torques(angles), curve.cubic.dead_zone or (0.0, 0.0)
        excluded = (angles > zone[0]) & (angles < zone[1])
        drawn: list[tuple[Array, Any]] = [
            (np.where(excluded, np.nan, printed), THESIS_STYLE.dash),
            (np.where(excluded, printed, np.nan), EXCLUDED_DASH),
        ]
        if plate.sense_odds:
            drawn.append((curve.other_sense_torques(angles), OTHER_SENSE_DASH))
        for torques, dash in drawn:
            look: Look = {"color": THESIS_STYLE.colour, "lw": 1.1, "ls": dash, "zorder": 3}
            upper.plot(np.degrees(angles), torques, **look)
        for row, pen in zip(plate.literature, LINE_STYLES, strict=False):
            _draw_literature(upper, row, angles, pen)
            _draw_residual(lower, curve, row, window, pen)
        read = np.degrees(curve.angles)
        upper.plot(read, curve.simulated, color=EXUDYN_STYLE.colour, lw=1.0, zorder=2.5)
        rounded = np.round(read / _READING_SPACING) * _READING_SPACING
        shown = (np.abs(read - rounded) < 1e-6) & curve.range_mask(*np.radians(window.angles))
        look = {"ls": "none", "zorder": 4, **_READING_LOOK}
        draw_line(upper, read[shown], curve.simulated[shown], EXUDYN_STYLE, **look)
        for axes, limits in ((upper, window.torques), (lower, window.residuals)):
            draw_zero_line(axes)
            axes.set_ylim(*limits)
            for end in curve.range_ends:
                angle = degrees(end.angle)
                axes.axvline(angle, color=GREY, lw=0.9, ls=_RANGE_END_DASH, zorder=1)
        lower.set_xlim(*window.angles)
        wide = window.angles[1] - window.angles[0] > 140.0
        lower.xaxis.set_major_locator(MultipleLocator(30.0 if wide else 15.0))
        upper.set_ylabel("torque on the child [N m]")
        lower.set(
            ylabel="simulated -\npublished [N m]", xlabel=f"angle [deg], positive in {curve.motion}"
        )
        handles = _common_handles(curve, references, plate.sense_odds)
        for row, pen in zip(plate.literature, LINE_STYLES, strict=False):
            subjects, number = row.sample.subjects, references.index(str(row.reference)) + 1
            counted = "" if subjects is None else f" (n = {subjects})"
            kind = "" if plate.is_estimate else "substitute: "
            label = f"{kind}{row.label}{counted} [{number}]"
            handles.append(_literature_handle(row, pen, label))
        add_legend_above(figure, strip, handles)
        add_title(figure, plate.title)
        add_footer(figure, f"{_sign_convention(curve)} {_clipping_note(window)}", references)
    return figure


def _draw_ranges(axes: Axes, curve: JointCurve, window: Window) -> None:
    """Draw the normal range of motion and the dead zone as bars."""
    ends = [None if end is None else degrees(end.angle) for end in (curve.low, curve.high)]
    _draw_bar(axes, 1.0, ends, window, {"color": PALE})
    zone = curve.cubic.dead_zone
    if zone is None:
        place = (0.5, 0.0)
        coordinates = ("axes fraction", "data")
        axes.annotate("none", place, xycoords=coordinates, ha="center", va="center", fontsize=7.0)
    else:
        hatched = {"fc": "white", "ec": GREY, "lw": 0.7, "hatch": "////"}
        _draw_bar(axes, 0.0, [degrees(edge) for edge in zone], window, hatched)
    axes.set_ylim(-0.5, 1.5)
    axes.set_yticks([0.0, 1.0], ["dead zone", "normal range"], fontsize=7.5)
    axes.tick_params(bottom=False, left=False)
    axes.grid(visible=False)
    axes.spines[["left", "bottom"]].set_visible(False)


def _draw_bar(
    axes: Axes,
    height: float,
    ends: Sequence[float | None],
    window: Window,
    bar_style: Mapping[str, Any],
) -> None:
    """Draw a bar labelled with its ends; an unknown end is that of the window."""
    first, last = (
        edge if end is None else float(np.clip(end, *window.angles))
        for end, edge in zip(ends, window.angles, strict=True)
    )
    axes.barh(height, last - first, left=first, height=0.7, **bar_style)
    label = " to ".join("?" if end is None else f"{end:.1f}" for end in ends)
    axes.annotate(
        f"{label} deg",
        (0.5 * (first + last), height),
        ha="center",
        va="center",
        fontsize=7.0,
        bbox={"boxstyle": "round,pad=0.15", "fc": "white", "ec": "none"},
    )


def _draw_literature(axes: Axes, literature: Literature, angles: Array, style: LineStyle) -> None:
    edges = literature.band(angles)
    if edges is not None:
        draw_band(axes, np.degrees(angles), *edges, style)
    if literature.points is not None:
        at, torques = literature.points
        draw_points(axes, np.degrees(at), torques, style, "_", literature.is_line)
        return
    draw_curve(
        axes, np.degrees(angles), literature.torque(angles), literature.valid_range, style, "_", 1.4
    )
    marks = np.radians(_marker_angles(angles))
    draw_marks(axes, np.degrees(marks), literature.torque(marks), style, size=4.0)


def _marker_angles(angles: Array) -> Array:
    """Round angles of the markers on a formula [deg]."""
    first, last = np.degrees(angles[[0, -1]])
    return _MARKER_SPACING * np.arange(
        np.ceil(first / _MARKER_SPACING), np.floor(last / _MARKER_SPACING) + 1.0, dtype=float
    )


def _draw_residual(
    axes: Axes, curve: JointCurve, literature: Literature, window: Window, style: LineStyle
) -> None:
    """Draw simulated minus published torque within the window."""
    low, high = np.radians(window.angles)

    def less(angles: Array) -> Array:
        return np.interp(angles, curve.angles, curve.simulated) - literature.torque(angles)

    if literature.points is not None:
        at, torques = literature.points
        at, torques = (values[(at >= low) & (at <= high)] for values in (at, torques))
        rest = np.interp(at, curve.angles, curve.simulated) - torques
        draw_points(axes, np.degrees(at), rest, style, "_", literature.is_line)
        return
    angles = curve.angles[curve.range_mask(low, high)]
    draw_curve(axes, np.degrees(angles), less(angles), literature.valid_range, style, "_", 1.2)
    marks = np.radians(_marker_angles(angles))
    draw_marks(axes, np.degrees(marks), less(marks), style, size=3.5)


_READING_LOOK: Look = {"mfc": EXUDYN_STYLE.colour, "mec": BLACK, "mew": 0.7, "ms": 4.5}


def _common_handles(curve: JointCurve, references: Sequence[str], sense_odds: str) -> list[Line2D]:
    """Legend entries of the simulated curve, the thesis's cubic and the normal range."""
    label = "simulated: read out of Exudyn, joint at rest"
    reading: Look = {**line_look(EXUDYN_STYLE), **_READING_LOOK, "lw": 1.0, "label": label}
    handles = [Line2D([], [], **reading)]
    cubics: list[tuple[str, Any]] = [("thesis: cubic as printed [1, 2]", "-")]
    if curve.cubic.dead_zone is not None:
        cubics.append(("cubic as printed, ruled out by the dead zone", EXCLUDED_DASH))
    if sense_odds:
        label = f"cubic in the other sense: the odds are {sense_odds}"
        cubics.append((label, OTHER_SENSE_DASH))
    colour = THESIS_STYLE.colour
    handles += [Line2D([], [], color=colour, lw=1.1, ls=ls, label=text) for text, ls in cubics]
    numbers = sorted({references.index(str(end.reference)) + 1 for end in curve.range_ends})
    cited = f" [{', '.join(map(str, numbers))}]" if numbers else ""
    ends = Line2D(
        [], [], color=GREY, lw=0.9, ls=_RANGE_END_DASH, label=f"end of the normal range{cited}"
    )
    return [*handles, ends]


def _literature_handle(literature: Literature, style: LineStyle, label: str) -> Line2D:
    dash = ":" if literature.valid_range is None and literature.points is None else style.dash
    if not literature.is_line:
        dash = "none"
    width = 1.0 if dash == ":" else 1.4
    look: Look = {**line_look(style), "ls": dash, "lw": width, "label": label}
    return Line2D([], [], **look)


_CAPTION_TEMPLATE = (
    "Circles: joint torque in Exudyn's equations of motion for the prototype at rest, read every "
    "5 deg{held}. Black: the cubic as printed in the thesis, as torque on the child{dashed}. "
    "Above: normal range of motion ({ends}) and dead zone of the law. Below: simulated minus "
    "published torque. Simulated torque and law differ by at most {differ:.1g} N m."
)


_DEAD_ZONE_NOTE = (
    "The thesis prints no dead zones for spherical joints: this one is the reading of this "
    "project, because in its sense the printed cubic drives outwards there with up to "
    "{:.3g} N m. Nothing is compared within it."
)
"""Of a dead zone that the thesis does not print."""


def _clipping_note(window: Window) -> str:
    low, high = window.torques
    first, last = window.residuals
    return (
        f"Torques outside {low:g} to {high:g} N m are cut off, differences outside {first:g} to "
        f"{last:g} N m; published curves are thin and dotted outside their known range."
    )


def _sign_convention(curve: JointCurve) -> str:
    """The sign convention in words."""
    moment = "is the resisting moment" if curve.cubic.sense < 0 else "acts on the child"
    return (
        f"Angles are positive in {curve.motion}, 0 with the figure standing upright, arms down. "
        "Torques act on the child and are positive in the same sense: a torque that drives back "
        f"from a positive angle is negative. The printed moment {moment}."
    )


def _caption(plate: JointPlate, curve: JointCurve, references: Sequence[str]) -> str:
    ends = dict.fromkeys(
        f"{end.motion} [{references.index(str(end.reference)) + 1}]" for end in curve.range_ends
    )
    low, high = np.radians(plate.window.angles)
    sentences = [
        plate.comment,
        _CAPTION_TEMPLATE.format(
            held=f", {curve.held_text}" if curve.held_text else "",
            dashed="" if curve.cubic.dead_zone is None else ", dashed within the dead zone",
            ends=", ".join(ends),
            differ=float(np.abs(curve.simulated - curve.law_torques).max()),
        ),
        ""
        if curve.low and curve.high
        else "A ? marks an end of the range for which no verified value is known.",
        _DEAD_ZONE_NOTE.format(curve.outward_torque) if curve.has_assumed_dead_zone else "",
        _clipping_note(plate.window),
    ]
    for row in plate.literature:
        notes = [
            str(row.sample),
            row.held_text,
            row.note,
            f"the band is {row.scatter_text}" if row.scatter_text else "",
            "" if row.points is not None else row.extrapolation_note(low, high),
        ]
        if any(notes):
            sentences.append(f"{row.label}: {'; '.join(filter(None, notes))}.")
    return " ".join(filter(None, sentences))


def _tables(plate: JointPlate, curve: JointCurve) -> dict[str, dict[str, Array]]:
    """A table of the readings with every formula, and one of each digitised curve."""
    read = {
        "angle [deg]": np.degrees(curve.angles),
        "simulated [N m]": curve.simulated,
        "law [N m]": curve.law_torques,
        "cubic as printed, as torque on the child [N m]": curve.printed_torques(curve.angles),
    }
    if plate.sense_odds:
        other = curve.other_sense_torques(curve.angles)
        read["cubic in the other sense, as torque on the child [N m]"] = other
    if curve.other_side_torques is not None:
        read["simulated, other side [N m]"] = curve.other_side_torques
    tables = {"readings": read}
    inside = curve.range_mask(*np.radians(plate.window.angles))
    for row in plate.literature:
        if row.points is None:
            # Beyond the window an exponential is meaningless, and may overflow.
            shown = np.where(inside, row.torque(curve.angles), np.nan)
            read[f"{row.label} [N m]"] = shown
            for side, edge in _edges(row, curve.angles):
                column = f"{row.label}, {side} edge of the scatter [N m]"
                read[column] = np.where(inside, edge, np.nan)
        else:
            at, torques = row.points
            simulated = np.interp(at, curve.angles, curve.simulated)
            tables["_".join(re.findall("[a-z0-9]+", row.label.lower()))] = columns = {
                "angle [deg]": np.degrees(at),
                "published [N m]": torques,
                "simulated [N m]": simulated,
                "simulated - published [N m]": simulated - torques,
            }
            for side, edge in _edges(row, at):
                columns[f"{side} edge of the scatter [N m]"] = edge
    return tables


def _edges(row: Literature, angles: Array) -> Iterable[tuple[str, Array]]:
    """Lower and upper edge of the published scatter, if it is known."""
    return zip(("lower", "upper"), row.band(angles) or (), strict=False)
