"""Falls of a man and a woman beside falls of people and dummies, a row a fact."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Rectangle
from scipy.stats import gaussian_kde

from plots.canvas import BLACK, BLUE, GREY, PALE, VERMILION, Look, create_canvas
from plots.fall_facts import QUANTITIES, FallFact, FallFacts, Falls, Group, Rule, Use, fall_facts
from plots.fall_verdicts import (
    Comparison,
    FallTables,
    Interval,
    compare,
    compare_all,
    ratio,
    read_fall_tables,
    sample,
    share,
    single_values,
)
from plots.medium import typographic
from plots.plate import Claim, Outcome
from plots.plate_definition import PlateDefinition
from springs.backends import Array
from springs.published.reference import Sureness

_BUTTOCKS = "the firmer region of the buttocks touches in falls to the side as well"

_BUTTOCKS_ALONE = (
    "the law of the buttocks alone, under the 54 kg of the study's model, is too stiff; thighs add "
    "to a man's force, and a woman is lighter than the study's people"
)

_AHEAD = "forward, hands land long before the pelvis, and righting has time to act"

CAUSES = {
    ("head_speed", "mean"): "righting goes on until the head touches",
    ("hand_speed", "spread"): "arms hang limp in all falls",
    ("descent", "spread"): "all falls are pushes; those of people are of many kinds",
    ("head_hits", "share"): "a woman's neck and trunk have 0.6 of a man's strength, an estimate",
    ("hand_hits", "share"): "arms hang limp, and always touch; those of people act",
    ("pelvis_hits_sideways", "share"): "nobody takes a step or lands on a knee or a hand alone",
    **dict.fromkeys((("head_odds_sideways", "odds"), ("head_odds_sideways", "side")), _AHEAD),
    **dict.fromkeys(
        (("head_odds_backward", "odds"), ("head_odds_backward", "side")),
        f"{_AHEAD}; backward, nobody bends forward",
    ),
    ("hip_force", "mean"): _BUTTOCKS,
    ("hip_force", "spread"): _BUTTOCKS,
    ("hip_force_directions", "ratio"): "backward, nobody bends hips and knees to brace",
    ("hip_force_predicted", "median"): f"predicted from loads below 1 kN; {_BUTTOCKS}",
    **{(f"floor_{floor}", "force"): _BUTTOCKS_ALONE for floor in (400, 95, 67, 59)},
}
"""Likely reasons of differences, by fact and criterion."""

_COLOURS = (BLUE, VERMILION)
_MARKERS = ("D", "s")
_OFFSETS = (-0.23, 0.23)
"""Heights of the bodies within a row, rows being 1 apart."""

_HALF = 0.19
"""Height of half a distribution."""

_MARKS = {Outcome.AGREES: "✓", Outcome.DIFFERS: "✗", Outcome.INCOMPARABLE: "–"}

_SMALL, _TINY = 6.6, 6.0
"""Sizes of text [points]."""

_MARGIN = 0.1
"""Margin at both sides, since text is of another width as SVG [inch]."""

_ROW_HEIGHT, _GROUP_HEIGHT, _REST_HEIGHT = 0.37, 0.42, 3.1
"""Heights of a row, of title and axis of a group, and of all else [inch]."""


@dataclass(frozen=True)
class FallsBesidePeople:
    """Facts, falls, and the comparison of each body with each fact."""

    facts: FallFacts
    tables: FallTables
    comparisons: Sequence[Comparison]


def read_falls() -> FallsBesidePeople:
    """Read facts and falls, and compare them."""
    facts, tables = fall_facts(), read_fall_tables()
    return FallsBesidePeople(facts, tables, compare_all(tables, facts))


def _draw(data: FallsBesidePeople) -> Figure:
    groups = data.facts.grouped()
    rows = len(data.facts.facts)
    height = _ROW_HEIGHT * rows + _GROUP_HEIGHT * len(groups) + _REST_HEIGHT
    figure = create_canvas(height)
    figure.set_layout_engine("constrained", w_pad=_MARGIN)
    heights = [_ROW_HEIGHT * len(some) for some in groups.values()]
    panels = figure.subplots(len(groups), 1, squeeze=False, height_ratios=heights)
    for axes, (group, facts) in zip(panels[:, 0], groups.items(), strict=True):
        _draw_group(axes, data, group, facts)
    figure.legend(handles=_handles(data.tables.names), loc="outside upper left", ncols=3)
    return figure


def _handles(bodies: Sequence[str]) -> list[Patch | Line2D]:
    """Return the keys: bodies awake, the same limp, and people."""
    made: list[Patch | Line2D] = [
        Patch(fc=PALE, ec="none", label="people or dummies: spread, interval"),
        Line2D([], [], color=BLACK, lw=1.4, label="their mean or value"),
    ]
    for body, colour, marker in zip(bodies, _COLOURS, _MARKERS, strict=True):
        look: Look = {"color": colour, "marker": marker, "ms": 4.0}
        made.append(Line2D([], [], **look, lw=3.0, alpha=0.8, label=f"{body}, with tone"))
        made.append(Line2D([], [], **look, mfc="white", lw=0.9, label=f"{body}, limp"))
    return made


def _draw_group(
    axes: Axes, data: FallsBesidePeople, group: Group, facts: Sequence[FallFact]
) -> None:
    """Draw the rows of a group, the first at the top."""
    ends: list[float] = []
    for row, fact in enumerate(facts):
        low, high = fact.span
        ends += fact.span
        if high > low:
            look: Look = {"fc": PALE, "ec": "none", "zorder": 0.5}
            axes.add_patch(Rectangle((low, row - 0.46), high - low, 0.92, **look))
        marks = [fact.mean] if fact.mean is not None else [low] if low == high else []
        for value in marks:
            axes.plot([value, value], [row - 0.46, row + 0.46], color=BLACK, lw=1.4, zorder=1.0)
        for number, body in enumerate(data.tables.names):
            place = row + _OFFSETS[number]
            for falls in Falls:
                if falls is Falls.LIMP or fact.falls is Falls.AWAKE:
                    ends += _draw_body(axes, place, number, data.tables, fact, body, falls)
            _write_verdict(axes, place, body, compare(data.tables, fact, body))
    if group is Group.RATIOS:
        axes.set_xscale("log")
        ticks = (0.001, 0.01, 0.1, 1, 10, 100)
        axes.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
        axes.minorticks_off()
        axes.set_xlim(0.8 * min(ends), 1.25 * max(ends))
    else:
        low, high = min(0.0, *ends), max(ends)
        axes.set_xlim(low - 0.02 * (high - low), high + 0.02 * (high - low))
    axes.set_ylim(len(facts) - 0.5, -0.5)
    axes.set_yticks(range(len(facts)))
    axes.set_yticklabels(
        f"{fact.name} [{data.facts.source_number(fact)}]\n{fact.value_text}; {fact.sureness}, "
        + (f"sets {fact.parameter}" if fact.use is Use.SETS else "tests")
        for fact in facts
    )
    axes.tick_params(axis="y", labelsize=_SMALL, length=0.0)
    axes.tick_params(axis="x", labelsize=_SMALL, pad=1.5)
    axes.grid(visible=False, axis="y")
    for row in range(1, len(facts)):
        axes.axhline(row - 0.5, color=PALE, lw=0.6, zorder=0.4)
    unit = "" if group is Group.RATIOS else f" [{facts[0].unit}]"
    axes.set_title(f"{group.value}{unit}", fontsize=7.5, fontweight="bold", pad=3.0)


def _draw_body(
    axes: Axes,
    place: float,
    number: int,
    tables: FallTables,
    fact: FallFact,
    body: str,
    falls: Falls,
) -> list[float]:
    """Draw the falls of a body, awake above its line and limp below, and return their ends."""
    match fact.rule:
        case Rule.MEAN | Rule.INTERVAL:
            centre = np.median if fact.rule is Rule.INTERVAL else np.mean
            values = sample(tables, fact, body, falls)
            return _draw_distribution(axes, place, number, values, falls, centre)
        case Rule.SHARE | Rule.ODDS | Rule.RATIO:
            estimate = share if fact.rule is Rule.SHARE else ratio
            found = estimate(tables, fact, body, falls)
            return [] if found is None else _draw_interval(axes, place, number, found, falls)
        case Rule.VALUE | Rule.ENDS:
            values = single_values(tables, fact, body)
            axes.plot(values, [place] * len(values), **_marker(number, Falls.LIMP))
            return values


def _marker(number: int, falls: Falls) -> Look:
    """Return the look of the mark of a body, open if limp."""
    colour = _COLOURS[number]
    face = colour if falls is Falls.AWAKE else "white"
    look: Look = {"ls": "none", "marker": _MARKERS[number], "color": colour}
    return {**look, "mfc": face, "ms": 3.2, "mew": 0.8, "zorder": 3.0}


_SIDES = {Falls.AWAKE: -1.0, Falls.LIMP: 1.0}
"""Senses of the halves of a row, up for awake people; rows grow downwards."""


def _draw_distribution(
    axes: Axes,
    place: float,
    number: int,
    values: Array,
    falls: Falls,
    centre: Callable[[Array], Any],
) -> list[float]:
    """Draw half a violin with mean or median, and return the ends of most values."""
    if not values.size:
        return []
    colour, side = _COLOURS[number], _SIDES[falls]
    low, high = np.percentile(values, [1.0, 99.0]).tolist()
    if values.size > 2 and high > low:
        x = np.linspace(float(values.min()), float(values.max()), 120)
        density = np.asarray(gaussian_kde(values)(x), float)
        y = place + side * _HALF * density / density.max()
        if falls is Falls.AWAKE:
            axes.fill_between(x, place, y, color=colour, alpha=0.55, lw=0.0, zorder=2.0)
        axes.plot(x, y, color=colour, lw=0.7, zorder=2.1)
    axes.plot([low, high], [place, place], color=colour, lw=0.5, zorder=2.1)
    axes.plot([centre(values)], [place + side * 0.35 * _HALF], **_marker(number, falls))
    return [low, high]


def _draw_interval(
    axes: Axes, place: float, number: int, found: Interval, falls: Falls
) -> list[float]:
    """Draw an estimate with its interval, and return its ends."""
    height = place + _SIDES[falls] * 0.45 * _HALF
    width = 1.8 if falls is Falls.AWAKE else 0.8
    axes.plot([found.low, found.high], [height] * 2, color=_COLOURS[number], lw=width, zorder=2.0)
    axes.plot([found.value], [height], **_marker(number, falls))
    return [found.low, found.high]


def _write_verdict(axes: Axes, place: float, body: str, found: Comparison) -> None:
    """Write the verdict beside a row."""
    differs = found.outcome is Outcome.DIFFERS
    look: Look = {"fontsize": _TINY, "va": "center", "fontweight": "bold" if differs else "normal"}
    colour = GREY if found.outcome is Outcome.INCOMPARABLE else BLACK
    text = f"{_MARKS[found.outcome]} {body}: {found.verdict}"
    coordinates = ("axes fraction", "data")
    axes.annotate(text, (1.015, place), xycoords=coordinates, color=colour, **look)


def claims_of(comparisons: Sequence[Comparison]) -> list[Claim]:
    """Return all claims, those that fail with the likely reason."""
    return [
        replace(claim, remark=CAUSES.get((one.fact.key, label), ""))
        if claim.outcome is Outcome.DIFFERS
        else claim
        for one in comparisons
        for label, claim in one.criteria
    ]


def _sign(facts: FallFacts) -> str:
    """Return what the marks mean, and which facts chose which parameter."""
    used = {fact.sureness for fact in facts.facts}
    grades = "; ".join(f"{one}: {one.description}" for one in Sureness if one in used)
    chosen: dict[str, list[str]] = {}
    for fact in facts.facts:
        if fact.use is Use.SETS:
            chosen.setdefault(fact.parameter, []).append(fact.name)
    sets = "; ".join(
        f"{name} (by {', '.join(dict.fromkeys(some))})" for name, some in chosen.items()
    )
    return (
        f"Violins: all falls, awake above and limp below; marks: means, medians beside "
        f"dummies, or estimates with 95 % "
        f"intervals. Dummies are compared with limp falls. Chosen by facts: {sets}. Other rows "
        f"test. {grades}."
    )


def _caption(data: FallsBesidePeople) -> str:
    names = " and ".join(
        f"a {row['body']} (`{row['figure']}`, contact by {row['contact']})"
        for row in data.tables.bodies.rows
    )
    count = len(data.tables.pushes.values("seed"))
    return (
        f"Of {names} each stands and is pushed in any direction by up to 1 m/s, {count} times with "
        "the tone `fall` and as often limp, from starts that chose no parameter. A row agrees "
        "where the mean is within one standard deviation of people's and the standard deviation "
        "within the 95 % interval of theirs; where intervals of shares and odds overlap, and odds "
        "are on people's side of 1; where the median is within the interval of dummies; where "
        "single values are within 15 %. A mean "
        f"without a published spread is not judged. {data.tables.pushes.origin}"
    )


def _tables(data: FallsBesidePeople) -> dict[str, dict[str, Array]]:
    """Return the numbers of the falls that are drawn, by body and tone."""
    return {
        f"{body}_{falls.value}": {
            f"{name} [{QUANTITIES[name].unit}]": QUANTITIES[name].factor * values
            for name, values in data.tables.pushes_of(body, falls).items()
            if name in QUANTITIES
        }
        for body in data.tables.names
        for falls in Falls
    }


falls_of_people = PlateDefinition(
    name="falls_of_people",
    title="Falls beside those of people and dummies",
    sign=lambda data: typographic(_sign(data.facts)),
    references=tuple(source.reference for source in fall_facts().sources),
    collect=read_falls,
    caption=_caption,
    draw=_draw,
    claims=lambda data: claims_of(data.comparisons),
    tables=_tables,
)
