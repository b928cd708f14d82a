"""How a joint's curve is drawn: ranges, moments, and what is left between it and the literature.

The plate of one joint's curve: picture, words, numbers and references put together.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
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
    add_footer,
    add_title,
    create_panels,
    draw_curve,
    draw_points,
    draw_zero_line,
    plot_style,
)
from plots.joint_curve import JointCurve, law_claims, read_curve
from plots.literature import Literature
from plots.plate import Claim, Plate
from springs.backends import Array
from springs.published import tables as published

# Matplotlib leaves the types of its keyword arguments open.
# pyright: reportUnknownMemberType=false


EXUDYN_STYLE = LineStyle("#E69F00", "-", "o")
"""What was read out of Exudyn, on every joint's sheet."""

EXCLUDED_DASH = (0, (4, 2))
"""The dash of the printed cubic within a dead zone."""

_RANGE_END_DASH = (0, (1, 3))

_READING_SPACING = 5.0
"""A reading is drawn every so many degrees."""

_MARKER_SPACING = 15.0
"""A mark stands on a published formula every so many degrees."""

_HEIGHT = 6.7
"""Of a sheet with four references [inch]."""

_REFERENCE_HEIGHT = 0.28
"""What each reference more takes [inch]."""


@dataclass(frozen=True)
class Window:
    """What a sheet shows.

    Attributes:
        angles: from and to [deg].
        torques: from and to [N m]; curves that go on beyond are cut off.
        residuals: likewise, of the lower panel.
    """

    angles: tuple[float, float]
    torques: tuple[float, float]
    residuals: tuple[float, float]

    def __post_init__(self) -> None:
        """Refuse a window that shows nothing."""
        for low, high in (self.angles, self.torques, self.residuals):
            if not low < high:
                raise ValueError(f"nothing is between {low:g} and {high:g}")


@dataclass(frozen=True)
class JointPlate:
    """What the plate of one joint's curve shows and claims; called, it reads the curve and draws.

    Attributes:
        name: of the plate.
        title: with the thesis's figure.
        joint: the left one of a pair.
        motion: what a positive angle about the axis is.
        literature: drawn beside the curve, at most as many as there are line styles.
        window: what the picture shows.
        claims: makes the claims, beyond those of the law, from the curve and the literature.
        comment: what is to be said of this joint, in front of what is said of every plate.
        held_deg: hinges that stand at an angle [deg]; every other joint is straight.
        is_estimate: whether the thesis names no source; otherwise the literature stands in for one
            that is not public.
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

    def __call__(self) -> Plate:
        """Read the curve out of Exudyn and draw it."""
        return self.draw(self.read_curve())

    def read_curve(self) -> JointCurve:
        """The joint's curve, read out of Exudyn."""
        return read_curve(self.joint, self.motion, self.held_deg)

    def draw(self, curve: JointCurve) -> Plate:
        """The plate of a curve."""
        thesis = published.publication("otani_1989").reference
        own = [str(replace(thesis, place="appendix A")), curve.spring.reference]
        others = [str(one.reference) for one in self.literature]
        ends = [str(end.reference) for end in curve.range_ends]
        references = tuple(dict.fromkeys([*own, *others, *ends]))
        return Plate(
            name=self.name,
            title=self.title,
            caption=_caption(self, curve, references),
            sign=_sign_convention(curve),
            figure=_draw(self, curve, references),
            claims=(*law_claims(curve), *self.claims(curve, *self.literature)),
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
        _draw_printed(upper, curve, angles)
        for one, pen in zip(plate.literature, LINE_STYLES, strict=False):
            _draw_literature(upper, one, angles, pen)
            _draw_residual(lower, curve, one, window, pen)
        _draw_readings(upper, curve, window)
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
        lower.set_ylabel("simulated -\npublished [N m]")
        lower.set_xlabel(f"angle [deg], positive in {curve.motion}")
        strip.legend(
            handles=[
                *_common_handles(curve, references),
                *(
                    _literature_handle(
                        one,
                        pen,
                        f"{'' if plate.is_estimate else 'substitute: '}{one.label} "
                        f"[{references.index(str(one.reference)) + 1}]",
                    )
                    for one, pen in zip(plate.literature, LINE_STYLES, strict=False)
                ),
            ],
            loc="lower left",
            bbox_to_anchor=(0.0, 1.0),
            ncols=2,
            borderaxespad=0.0,
            fontsize=7.5,
        )
        add_title(figure, plate.title)
        add_footer(figure, f"{_sign_convention(curve)} {_clipping_note(window)}", references)
    return figure


def _draw_ranges(axes: Axes, curve: JointCurve, window: Window) -> None:
    """Two bars: the normal range of motion, and where the law is free of torque."""
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
    """A bar with its ends written on it; an end that is not known is that of the window."""
    first, last = (
        edge if end is None else float(np.clip(end, *window.angles))
        for end, edge in zip(ends, window.angles, strict=True)
    )
    axes.barh(height, last - first, left=first, height=0.7, **bar_style)
    said = " to ".join("?" if end is None else f"{end:.1f}" for end in ends)
    axes.annotate(
        f"{said} deg",
        (0.5 * (first + last), height),
        ha="center",
        va="center",
        fontsize=7.0,
        bbox={"boxstyle": "round,pad=0.15", "fc": "white", "ec": "none"},
    )


def _draw_printed(axes: Axes, curve: JointCurve, angles: Array) -> None:
    """The cubic as it is printed; dashed where a dead zone rules it out."""
    printed, zone = curve.printed_torques(angles), curve.cubic.dead_zone
    out = np.zeros(angles.shape, dtype=bool)
    if zone is not None:
        out = (angles > zone[0]) & (angles < zone[1])
    for which, dash in ((~out, THESIS_STYLE.dash), (out, EXCLUDED_DASH)):
        shown = np.where(which, printed, np.nan)
        axes.plot(np.degrees(angles), shown, color=THESIS_STYLE.colour, lw=1.1, ls=dash, zorder=3)


def _draw_literature(axes: Axes, literature: Literature, angles: Array, style: LineStyle) -> None:
    if literature.points is not None:
        at, torques = literature.points
        draw_points(axes, np.degrees(at), torques, style, "_", literature.is_line)
        return
    draw_curve(
        axes, np.degrees(angles), literature.torque(angles), literature.valid_range, style, "_", 1.4
    )
    marks = np.radians(_marker_angles(angles))
    axes.plot(
        np.degrees(marks),
        literature.torque(marks),
        style.marker,
        color=style.colour,
        mfc="white",
        ms=4.0,
    )


def _marker_angles(angles: Array) -> Array:
    """Round angles at which a formula gets its mark [deg]."""
    first, last = np.degrees(angles[[0, -1]])
    return _MARKER_SPACING * np.arange(
        np.ceil(first / _MARKER_SPACING), np.floor(last / _MARKER_SPACING) + 1.0, dtype=float
    )


def _draw_residual(
    axes: Axes, curve: JointCurve, literature: Literature, window: Window, style: LineStyle
) -> None:
    """Simulated less published, where the published curve is given and the window shows it."""
    low, high = np.radians(window.angles)
    if literature.points is not None:
        at, torques = literature.points
        inside = (at >= low) & (at <= high)
        less = np.interp(at[inside], curve.angles, curve.simulated) - torques[inside]
        draw_points(axes, np.degrees(at[inside]), less, style, "_", literature.is_line)
        return
    inside = curve.range_mask(low, high)
    angles = curve.angles[inside]
    less = curve.simulated[inside] - literature.torque(angles)
    draw_curve(axes, np.degrees(angles), less, literature.valid_range, style, "_", 1.2)
    marks = np.radians(_marker_angles(angles))
    less = np.interp(marks, curve.angles, curve.simulated) - literature.torque(marks)
    axes.plot(np.degrees(marks), less, style.marker, color=style.colour, mfc="white", ms=3.5)


def _draw_readings(axes: Axes, curve: JointCurve, window: Window) -> None:
    """A thin line through all readings, and a mark on every fifth."""
    degrees_read = np.degrees(curve.angles)
    axes.plot(degrees_read, curve.simulated, color=EXUDYN_STYLE.colour, lw=1.0, zorder=2.5)
    rounded = np.round(degrees_read / _READING_SPACING) * _READING_SPACING
    shown = (np.abs(degrees_read - rounded) < 1e-6) & curve.range_mask(*np.radians(window.angles))
    axes.plot(
        degrees_read[shown],
        curve.simulated[shown],
        EXUDYN_STYLE.marker,
        color=EXUDYN_STYLE.colour,
        mec=BLACK,
        mew=0.7,
        ms=4.5,
        zorder=4,
    )


def _common_handles(curve: JointCurve, references: Sequence[str]) -> list[Line2D]:
    """What the legend says of the simulated curve, of the thesis's and of the normal range."""
    read = Line2D(
        [], [], lw=1.0, marker=EXUDYN_STYLE.marker, color=EXUDYN_STYLE.colour, mec=BLACK, ms=4.5
    )
    read.set_markeredgewidth(0.7)
    read.set_label("simulated: read out of Exudyn, joint at rest")
    printed = Line2D(
        [], [], color=THESIS_STYLE.colour, lw=1.1, label="thesis: cubic as printed [1, 2]"
    )
    handles = [read, printed]
    if curve.cubic.dead_zone is not None:
        label = "cubic as printed, ruled out by the dead zone"
        handles.append(
            Line2D([], [], color=THESIS_STYLE.colour, lw=1.1, ls=EXCLUDED_DASH, label=label)
        )
    numbers = sorted({references.index(str(end.reference)) + 1 for end in curve.range_ends})
    cited = f" [{', '.join(map(str, numbers))}]" if numbers else ""
    ends = Line2D(
        [], [], color=GREY, lw=0.9, ls=_RANGE_END_DASH, label=f"end of the normal range{cited}"
    )
    return [*handles, ends]


def _literature_handle(literature: Literature, style: LineStyle, label: str) -> Line2D:
    dash = ":" if literature.valid_range is None and not literature.is_digitised else style.dash
    if not literature.is_line:
        dash = "none"
    width = 1.0 if dash == ":" else 1.4
    return Line2D(
        [],
        [],
        color=style.colour,
        ls=dash,
        lw=width,
        marker=style.marker,
        mfc="white",
        ms=4.0,
        label=label,
    )


_CAPTION_TEMPLATE = (
    "Circles: the torque that Exudyn's equations of motion hold for the prototype at rest, read "
    "every 5 deg{held}. Black: the cubic as the thesis prints it, in the sense of the torque on "
    "the child{dashed}. Above: the normal range of motion ({ends}) and the law's dead zone. Below: "
    "simulated less published. Simulated and law differ by {differ:.1g} N m at most, which no "
    "picture shows."
)


def _clipping_note(window: Window) -> str:
    low, high = window.torques
    first, last = window.residuals
    return (
        f"Torques beyond {low:g} to {high:g} N m are cut off, differences beyond {first:g} to "
        f"{last:g}; published curves are thin and dotted where they are not known to hold."
    )


def _sign_convention(curve: JointCurve) -> str:
    """The sign convention in words."""
    said = f"Angles are positive in {curve.motion}, 0 with the figure standing upright, arms down. "
    said += "Torques act on the child and are positive in the same sense: one that drives back "
    said += "from a positive angle is negative."
    moment = "resists" if curve.cubic.sense < 0 else "acts on the child"
    return f"{said} The printed moment {moment}."


def _caption(plate: JointPlate, curve: JointCurve, references: Sequence[str]) -> str:
    ends = dict.fromkeys(
        f"{end.motion} [{references.index(str(end.reference)) + 1}]" for end in curve.range_ends
    )
    low, high = np.radians(plate.window.angles)
    said = [
        plate.comment,
        _CAPTION_TEMPLATE.format(
            held=f", {curve.held_text}" if curve.held_text else "",
            dashed="" if curve.cubic.dead_zone is None else ", dashed within the dead zone",
            ends=", ".join(ends),
            differ=float(np.abs(curve.simulated - curve.law_torques).max()),
        ),
        "" if curve.low and curve.high else "Where a range has a ? no verified end is known.",
        _clipping_note(plate.window),
    ]
    for one in plate.literature:
        notes = [
            one.held_text,
            one.note,
            "" if one.is_digitised else one.extrapolation_note(low, high),
        ]
        if any(notes):
            said.append(f"{one.label}: {'; '.join(filter(None, notes))}.")
    return " ".join(filter(None, said))


def _tables(plate: JointPlate, curve: JointCurve) -> dict[str, dict[str, Array]]:
    """The readings with every formula beside them, and each digitised curve at its own angles."""
    read = {
        "angle [deg]": np.degrees(curve.angles),
        "simulated [N m]": curve.simulated,
        "law [N m]": curve.law_torques,
        "cubic as printed, as torque on the child [N m]": curve.printed_torques(curve.angles),
    }
    if curve.other_side_torques is not None:
        read["simulated, other side [N m]"] = curve.other_side_torques
    tables = {"readings": read}
    inside = curve.range_mask(*np.radians(plate.window.angles))
    for one in plate.literature:
        if one.points is None:
            # Beyond the window an exponential says nothing, and may be larger than a number.
            shown = np.where(inside, one.torque(curve.angles), np.nan)
            read[f"{one.label} [N m]"] = shown
        else:
            at, torques = one.points
            simulated = np.interp(at, curve.angles, curve.simulated)
            tables[_file_name_part(one.label)] = {
                "angle [deg]": np.degrees(at),
                "published [N m]": torques,
                "simulated [N m]": simulated,
                "simulated - published [N m]": simulated - torques,
            }
    return tables


def _file_name_part(label: str) -> str:
    """A label as part of a file's name."""
    words = "".join(c if c.isalnum() else " " for c in label.lower()).split()
    return "_".join(words)
