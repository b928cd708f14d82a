"""Plates of a study's folder: parameters ranked by sensitivity, and measures over parameters."""

import csv
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import isfinite, nan
from pathlib import Path
from textwrap import fill
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from generator.diagnostics import InputError, error
from generator.recording import Ending
from generator.study.sensitivity import (
    INDICES_NAME,
    Estimate,
    IndexKind,
    MeasureIndices,
    StudyIndices,
    read_indices,
)
from generator.study.study import DesignKind, Take
from generator.text_io import is_file, load_text
from plots.canvas import (
    BLACK,
    BLUE,
    GREY,
    VERMILION,
    add_footer,
    create_canvas,
    plot_style,
)
from plots.medium import current_medium
from plots.plate import Plate, plate_name
from springs.backends import Array

# Matplotlib leaves the types of its keyword arguments open.
# pyright: reportUnknownMemberType=false

MAX_MEASURES = 4
"""Measures on one plate."""

MAX_RANKED = 12
"""Parameters that a panel ranks; the others follow in a line of text."""

_ROW_HEIGHT = 0.3
"""Height of a parameter in a ranking [inch]."""

_PANEL_HEIGHT = 0.95
"""Height of title, axis and margins of a ranking [inch]."""

_SOBOL_REFERENCES = (
    "I. M. Sobol, Global sensitivity indices for nonlinear mathematical models and their Monte "
    "Carlo estimates. Mathematics and Computers in Simulation 55 (2001) 271-280; "
    "doi:10.1016/S0378-4754(00)00270-6",
    "A. Saltelli, P. Annoni, I. Azzini, F. Campolongo, M. Ratto, S. Tarantola, Variance based "
    "sensitivity analysis of model output. Computer Physics Communications 181 (2010) 259-270; "
    "doi:10.1016/j.cpc.2009.09.018",
)
_MORRIS_REFERENCES = (
    "M. D. Morris, Factorial sampling plans for preliminary computational experiments. "
    "Technometrics 33 (1991) 161-174; doi:10.1080/00401706.1991.10484804",
    "F. Campolongo, J. Cariboni, A. Saltelli, An effective screening design for sensitivity "
    "analysis of large models. Environmental Modelling & Software 22 (2007) 1509-1518; "
    "doi:10.1016/j.envsoft.2006.10.004",
)


@dataclass(frozen=True)
class _Ranking:
    """Rule by which parameters are ranked and drawn.

    Attributes:
        main: index that ranks.
        beside: index that is drawn beside it.
        main_label: of the legend.
        beside_label: of the legend.
        references: of the method.
    """

    main: IndexKind
    beside: IndexKind
    main_label: str
    beside_label: str
    references: tuple[str, ...]


_RANKINGS = {
    DesignKind.SOBOL: _Ranking(
        IndexKind.TOTAL,
        IndexKind.FIRST,
        "total: alone and with the others",
        "first-order: alone",
        _SOBOL_REFERENCES,
    ),
    DesignKind.MORRIS: _Ranking(
        IndexKind.MU_STAR,
        IndexKind.SIGMA,
        "mu*: mean size of the effects",
        "sigma: their standard deviation",
        _MORRIS_REFERENCES,
    ),
}


_DONE = Ending.DONE.value


def measure_unit(column: str, take: str) -> str:
    """Return the unit of a measure: that of its column, or s for a time."""
    if take in (Take.TIME_OF_LARGEST, Take.TIME_OF_SMALLEST):
        return "s"
    head, bracket, unit = column.rpartition("[")
    return unit.rstrip("]") if bracket and head else ""


def _measure_title(name: str, column: str, take: str) -> str:
    """Return the title of a measure's panel: `swing: largest shoulder.2 [deg]`."""
    quantity = column.rpartition("[")[0].strip() or column
    unit = measure_unit(column, take)
    of = " of" if take in (Take.TIME_OF_LARGEST, Take.TIME_OF_SMALLEST) else ""
    return f"{name}: {take}{of} {quantity}" + (f" [{unit}]" if unit else "")


# Ranking


def sensitivity_plates(indices: StudyIndices, stem: str) -> Iterator[Plate]:
    """Yield plates on which each measure ranks the parameters, some measures on each.

    Args:
        indices: of the study.
        stem: of the names of the plates.
    """
    names = list(indices.measures)
    for start in range(0, len(names), MAX_MEASURES):
        number = f"_{start // MAX_MEASURES + 1}" if len(names) > MAX_MEASURES else ""
        measures = {name: indices.measures[name] for name in names[start : start + MAX_MEASURES]}
        yield _ranking_plate(indices, measures, f"{stem}_sensitivity{number}")


def _ranking_plate(
    indices: StudyIndices, measures: Mapping[str, MeasureIndices], name: str
) -> Plate:
    rule = _RANKINGS[indices.kind]
    ranked = {each: _ranked(measure, rule) for each, measure in measures.items()}
    lengths = [min(len(order), MAX_RANKED) or 1 for order in ranked.values()]
    with plot_style():
        figure = create_canvas(
            0.9 + sum(_PANEL_HEIGHT + _ROW_HEIGHT * length for length in lengths)
        )
        panels = figure.subplots(len(measures), 1, squeeze=False, height_ratios=lengths)[:, 0]
        for axes, (title, measure) in zip(panels, measures.items(), strict=True):
            _draw_ranking(axes, title, measure, ranked[title], rule)
        if indices.kind is DesignKind.SOBOL:
            _share_limits(panels)
        _add_legend(figure, rule, indices.confidence)
        sign = _sign(indices)
        add_footer(figure, sign, rule.references)
    unit = "base samples" if indices.kind is DesignKind.SOBOL else "trajectories"
    left_out = [
        f"{title}: {measure.message}" for title, measure in measures.items() if measure.message
    ]
    caption = (
        f"Parameters ranked by the {_name(rule.main)} of each measure, from {indices.samples} "
        f"{unit}. Bars are intervals of {indices.confidence:.0%} from {indices.resamples} "
        f"bootstrap samples. {' '.join(left_out)}"
    )
    return Plate(
        name=name,
        title=f"{indices.name}: sensitivity of {', '.join(measures)}",
        caption=caption.strip(),
        sign=sign,
        figure=figure,
        claims=(),
        tables=_ranking_tables(indices, measures, ranked),
        references=rule.references,
    )


def _name(kind: IndexKind) -> str:
    return {IndexKind.TOTAL: "total index", IndexKind.MU_STAR: "mean size of the effects"}[kind]


def _ranked(measure: MeasureIndices, rule: _Ranking) -> list[str]:
    """Return the parameters of a measure from the largest main index to the smallest."""
    found = measure.parameters
    return sorted(found, key=lambda name: -found[name][rule.main].value)


def _draw_ranking(
    axes: Axes, title: str, measure: MeasureIndices, order: Sequence[str], rule: _Ranking
) -> None:
    """Draw the indices of a measure, the largest on top."""
    shown = order[:MAX_RANKED]
    heading = _measure_title(title, measure.column, measure.take)
    axes.set_title(heading, loc="left", fontweight="bold", parse_math=False)
    axes.set_yticks(range(len(shown)), shown, parse_math=False)
    axes.set_ylim(max(len(shown), 1) - 0.5, -0.5)
    axes.tick_params(axis="y", length=0.0)
    axes.grid(visible=False, axis="y")
    axes.spines["left"].set_visible(False)
    if not order:
        axes.set_yticks([])
        axes.set_xticks([])
        axes.spines["bottom"].set_visible(False)
        axes.text(0.0, 0.0, fill(measure.message, 90), color=GREY, fontsize=8.0, va="center")
        return
    for row, name in enumerate(shown):
        main, beside = measure.parameters[name][rule.main], measure.parameters[name][rule.beside]
        _draw_estimate(axes, row - 0.13, main, BLUE, "o", is_main=True)
        _draw_estimate(axes, row + 0.2, beside, VERMILION, "s", is_main=False)
        axes.annotate(
            _estimate_text(main),
            (1.01, row),
            xycoords=axes.get_yaxis_transform(),
            va="center",
            fontsize=7.5,
            color=BLUE,
        )
    axes.axvline(0.0, color=BLACK, lw=0.8)
    notes = [measure.message] if measure.message else []
    if len(order) > len(shown):
        largest = measure.parameters[order[MAX_RANKED]][rule.main].value
        notes.append(f"{len(order) - len(shown)} more parameters: at most {largest:.2g}.")
    unit = measure_unit(measure.column, measure.take)
    label = "share of the variance"
    if rule.main is IndexKind.MU_STAR:
        label = f"change over a parameter's range{f' [{unit}]' if unit else ''}"
    axes.set_xlabel("\n".join([label, *notes]), fontsize=8.0, parse_math=False)


def _draw_estimate(
    axes: Axes, height: float, estimate: Estimate, colour: str, marker: str, *, is_main: bool
) -> None:
    """Draw an estimate with its interval: filled and thick, or open and thin."""
    axes.plot(
        [estimate.low, estimate.high],
        [height, height],
        color=colour,
        lw=3.0 if is_main else 1.2,
        alpha=0.5 if is_main else 1.0,
        solid_capstyle="butt",
    )
    axes.plot(
        estimate.value, height, marker, color=colour, ms=5.0, mfc=colour if is_main else "white"
    )


def _estimate_text(estimate: Estimate) -> str:
    """Return value and interval with two decimals, or with three significant digits."""
    numbers = (estimate.value, estimate.low, estimate.high)
    largest = max(abs(number) for number in numbers if isfinite(number))
    form = ".2f" if 0.1 <= largest < 10.0 else ".3g"
    value, low, high = (f"{number:{form}}" for number in numbers)
    return f"{value}  ({low} to {high})"


def _share_limits(panels: Sequence[Axes]) -> None:
    """Show shares of the variance from 0 to 1 and as far as intervals reach."""
    ends = [axes.get_xlim() for axes in panels if axes.lines]
    low = min([-0.02, *(low for low, _ in ends)])
    high = max([1.02, *(high for _, high in ends)])
    for axes in panels:
        if axes.lines:
            axes.set_xlim(low, high)


def _add_legend(figure: Figure, rule: _Ranking, confidence: float) -> None:
    main = Line2D([], [], color=BLUE, marker="o", ms=5.0, lw=3.0, label=rule.main_label)
    beside = Line2D(
        [], [], color=VERMILION, marker="s", ms=5.0, mfc="white", lw=1.2, label=rule.beside_label
    )
    bars = Line2D([], [], lw=0.0, label=f"bars: {confidence:.0%} intervals")
    figure.legend(
        handles=[main, beside, bars],
        loc="outside upper left",
        ncols=1 if current_medium().is_narrow else 3,
        fontsize=8.0,
        borderaxespad=0.2,
    )


def _sign(indices: StudyIndices) -> str:
    """Return the quantities that the parameters change."""
    parts = [f"{name} = {' and '.join(paths)}" for name, paths in indices.paths.items() if paths]
    return f"Parameters: {'; '.join(parts) or 'those of the study'}."


def _ranking_tables(
    indices: StudyIndices,
    measures: Mapping[str, MeasureIndices],
    ranked: Mapping[str, Sequence[str]],
) -> Mapping[str, Mapping[str, Array]]:
    """Return the ranked estimates of each measure, one table each."""
    numbers = {name: number for number, name in enumerate(indices.paths, start=1)}
    title = f"parameter: {', '.join(f'{number} = {name}' for name, number in numbers.items())}"
    tables: dict[str, dict[str, Array]] = {}
    for k, (measure, found) in enumerate(measures.items(), start=1):
        order = ranked[measure]
        columns = {title: np.array([numbers[name] for name in order], dtype=float)}
        for kind in IndexKind:
            for end in ("value", "low", "high"):
                cells = [
                    vars(found.parameters[name][kind])[end]
                    for name in order
                    if kind in found.parameters[name]
                ]
                if cells:
                    columns[kind.value if end == "value" else f"{kind.value} {end}"] = np.array(
                        cells
                    )
        tables[f"{k}_{plate_name(measure)}"] = columns
    return tables
