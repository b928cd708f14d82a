"""Plates of a study's folder: parameters ranked by sensitivity, and measures over parameters."""

import csv
import tomllib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from io import StringIO
from itertools import product
from math import floor, log10, nan
from pathlib import Path
from textwrap import fill
from typing import NamedTuple

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from numpy.typing import NDArray

from generator.diagnostics import InputError, error, format_count
from generator.recording import Ending
from generator.study.sensitivity import (
    INDICES_NAME,
    IndexKind,
    MeasureIndices,
    StudyIndices,
    read_indices,
)
from generator.study.study import DesignKind, Statistic
from generator.study.sweep import STUDY_NAME, TABLE_NAME
from generator.text_io import is_file, load_text, read_csv_rows
from plots.canvas import (
    BLACK,
    BLUE,
    GREY,
    VERMILION,
    Look,
    add_footer,
    create_canvas,
    create_panels,
    plot_style,
)
from plots.medium import current_medium
from plots.plate import Plate, plate_name
from springs.backends import Array

MAX_MEASURES = 4
"""Measures on one plate."""

MAX_RANKED = 12
"""Parameters that a panel ranks; the others follow in a line of text."""

_ROW_HEIGHT = 0.3
"""Height of a parameter in a ranking [inch]."""

_PANEL_HEIGHT = 0.95
"""Height of title, axis and margins of a ranking [inch]."""

SOBOL_REFERENCES = (
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

_CORRELATION_REFERENCES = (
    "J. C. Helton, F. J. Davis, Latin hypercube sampling and the propagation of uncertainty in "
    "analyses of complex systems. Reliability Engineering & System Safety 81 (2003) 23-69; "
    "doi:10.1016/S0951-8320(03)00058-9",
)


class _Ranking(NamedTuple):
    """Rule by which parameters are ranked and drawn, and the words of captions."""

    main: IndexKind
    beside: IndexKind
    main_label: str
    beside_label: str
    ranked_by: str
    samples: str
    references: tuple[str, ...]


_RANKINGS = {
    DesignKind.SOBOL: _Ranking(
        IndexKind.TOTAL,
        IndexKind.FIRST,
        "total index: alone and with the others",
        "first-order index: alone",
        "total index",
        "base samples",
        SOBOL_REFERENCES,
    ),
    DesignKind.MORRIS: _Ranking(
        IndexKind.MU_STAR,
        IndexKind.SIGMA,
        "mu*: mean size of the effects",
        "sigma: their standard deviation (bends, interactions)",
        "mean size of the effects",
        "trajectories",
        _MORRIS_REFERENCES,
    ),
    DesignKind.LATIN_HYPERCUBE: _Ranking(
        IndexKind.RANK,
        IndexKind.REGRESSION,
        "Spearman's rank correlation",
        "coefficient of a linear regression, each number over its deviation",
        "size of the rank correlation",
        "runs",
        _CORRELATION_REFERENCES,
    ),
}


def measure_unit(column: str, take: str) -> str:
    """Return the unit of a measure: that of its column, or s for a time."""
    if take in (Statistic.TIME_OF_LARGEST, Statistic.TIME_OF_SMALLEST):
        return "s"
    head, bracket, unit = column.rpartition("[")
    return unit.rstrip("]") if bracket and head else ""


def _measure_title(name: str, column: str, take: str) -> str:
    """Return the title of a measure's panel: `swing: largest shoulder.2 [deg]`."""
    quantity = column.rpartition("[")[0].strip() or column
    unit = measure_unit(column, take)
    taken = f"{take} {quantity}".replace("time of ", "time of the ")
    return f"{name}: {taken}" + (f" [{unit}]" if unit else "")


# Ranking


def sensitivity_plates(indices: StudyIndices, stem: str) -> Iterator[Plate]:
    """Yield plates on which each measure ranks the parameters, some measures on each."""
    references, sign = _RANKINGS[indices.kind].references, varied_quantities(indices)
    for names, name in _pages(indices.measures, f"{stem}_sensitivity"):
        shown = replace(indices, measures={each: indices.measures[each] for each in names})
        with plot_style():
            figure = draw_rankings(shown)
            add_footer(figure, sign, references)
        yield Plate(
            name=name,
            title=f"{indices.name}: sensitivity to parameters, with {_percent(indices)} intervals",
            caption=rankings_caption(shown),
            sign=sign,
            figure=figure,
            tables=ranking_tables(shown),
            references=references,
        )


def _pages(measures: Iterable[str], stem: str) -> Iterator[tuple[list[str], str]]:
    """Yield the measures that share a plate, with its name."""
    names = list(measures)
    for start in range(0, len(names), MAX_MEASURES):
        number = f"_{start // MAX_MEASURES + 1}" if len(names) > MAX_MEASURES else ""
        yield names[start : start + MAX_MEASURES], f"{stem}{number}"


def draw_rankings(indices: StudyIndices) -> Figure:
    """Draw the ranking of each measure; call it within `plot_style`."""
    rule = _RANKINGS[indices.kind]
    ranked = {name: measure.ranked(rule.main) for name, measure in indices.measures.items()}
    lengths = [min(len(order), MAX_RANKED) or 1 for order in ranked.values()]
    height = 0.9 + sum(_PANEL_HEIGHT + _ROW_HEIGHT * length for length in lengths)
    figure = create_canvas(height)
    grid = figure.subplots(len(lengths), 1, squeeze=False, height_ratios=lengths)
    panels: list[Axes] = list(grid[:, 0])
    for axes, (title, measure) in zip(panels, indices.measures.items(), strict=True):
        _draw_ranking(axes, title, measure, ranked[title], rule)
    if indices.kind is not DesignKind.MORRIS:  # shares, and as far as intervals reach
        ends = [axes.get_xlim() for axes in panels if axes.lines]
        low, high = (
            min([-0.02, *(low for low, _ in ends)]),
            max([1.02, *(high for _, high in ends)]),
        )
        for axes in panels:
            if axes.lines:
                axes.set_xlim(low, high)
    open_mark: Look = {"color": VERMILION, "marker": "s", "ms": 5.0, "mfc": "white", "lw": 1.2}
    main = Line2D([], [], color=BLUE, marker="o", ms=5.0, lw=3.0, label=rule.main_label)
    _add_legend_above(figure, [main, Line2D([], [], label=rule.beside_label, **open_mark)])
    return figure


def rankings_caption(indices: StudyIndices) -> str:
    """Return the text below the rankings of all measures."""
    rule = _RANKINGS[indices.kind]
    left_out = [f"{name}: {one.message}" for name, one in indices.measures.items() if one.message]
    caption = (
        f"Parameters ranked by the {rule.ranked_by} of each measure, from {indices.samples} "
        f"{rule.samples}. Bars are intervals of {_percent(indices)} from {indices.resamples} "
        "bootstrap samples."
    )
    return " ".join([caption, *left_out])


def _percent(indices: StudyIndices) -> str:
    return f"{100 * indices.confidence:g} %"


_THICK: Look = {"lw": 3.0, "alpha": 0.5}
_THIN: Look = {"lw": 1.2, "alpha": 1.0}


def _draw_ranking(
    axes: Axes, title: str, measure: MeasureIndices, order: Sequence[str], rule: _Ranking
) -> None:
    """Draw the indices of a measure, the largest on top."""
    shown = order[:MAX_RANKED]
    width = 36 if current_medium().is_narrow else 90
    heading = fill(_measure_title(title, measure.column, measure.take), width)
    axes.set_title(heading, fontweight="bold", parse_math=False)
    labels = [fill(name, 14 if current_medium().is_narrow else 28) for name in shown]
    axes.set_yticks(range(len(shown)), labels, parse_math=False)
    axes.set_ylim(max(len(shown), 1) - 0.5, -0.5)
    axes.tick_params(axis="y", length=0.0)
    axes.grid(visible=False, axis="y")
    axes.spines["left"].set_visible(False)
    if not order:
        axes.set_yticks([])
        axes.set_xticks([])
        axes.spines["bottom"].set_visible(False)
        axes.text(0.0, 0.0, _wrapped(measure.message), color=GREY, fontsize=8.0, va="center")
        return
    is_change, decimals = rule.main is IndexKind.MU_STAR, 2
    if is_change:  # three digits of the largest number
        largest = max(one[rule.main].value for one in measure.parameters.values())
        decimals = min(max(2 - floor(log10(largest)), 0), 9) if largest > 0.0 else 0
    for row, name in enumerate(shown):
        main, beside = measure.parameters[name][rule.main], measure.parameters[name][rule.beside]
        for place, one, colour, marker, face, style in (
            (row - 0.13, main, BLUE, "o", BLUE, _THICK),
            (row + 0.2, beside, VERMILION, "s", "white", _THIN),
        ):
            ends = [one.low, one.high]
            axes.plot(ends, [place, place], color=colour, solid_capstyle="butt", **style)
            axes.plot(one.value, place, marker, color=colour, ms=5.0, mfc=face)
        if current_medium().is_narrow:
            continue
        look: Look = {"va": "center", "fontsize": 7.5, "color": BLUE}
        value, low, high = (f"{x:.{decimals}f}" for x in (main.value, main.low, main.high))
        place, text = axes.get_yaxis_transform(), f"{value}  ({low} to {high})"
        axes.annotate(text, (1.01, row), xycoords=place, **look)
    axes.axvline(0.0, color=BLACK, lw=0.8)
    notes = [measure.message] if measure.message else []
    if len(order) > len(shown):
        largest = abs(measure.parameters[order[MAX_RANKED]][rule.main].value)
        notes.append(f"{len(order) - len(shown)} more parameters: at most {largest:.2g}.")
    unit = measure_unit(measure.column, measure.take)
    label = "share of the variance"
    if measure.r2 is not None:
        label = f"correlation; the regression explains {measure.r2.value:.2f} of the variance"
    if is_change:
        label = f"change over a parameter's range{f' [{unit}]' if unit else ''}"
    axes.set_xlabel("\n".join(map(_wrapped, [label, *notes])), fontsize=8.0, parse_math=False)


def _wrapped(text: str) -> str:
    return fill(text, 45 if current_medium().is_narrow else 100)


def _add_legend_above(figure: Figure, handles: Sequence[Artist]) -> None:
    columns = (2 if len(handles) == 2 else 4) // (2 if current_medium().is_narrow else 1)
    look: Look = {"fontsize": 8.0, "borderaxespad": 0.2}
    figure.legend(handles=handles, loc="outside upper left", ncols=columns, **look)


def varied_quantities(indices: StudyIndices) -> str:
    """Return a sentence of the quantities that the parameters change."""
    parts = [f"{name} = {' and '.join(paths)}" for name, paths in indices.paths.items() if paths]
    return f"Parameters: {'; '.join(parts) or 'those of the study'}."


def ranking_tables(indices: StudyIndices) -> Mapping[str, Mapping[str, Array]]:
    """Return the ranked estimates of each measure, one table each."""
    numbers = {name: number for number, name in enumerate(indices.paths, start=1)}
    title = f"parameter: {', '.join(f'{number} = {name}' for name, number in numbers.items())}"
    tables: dict[str, dict[str, Array]] = {}
    for k, (measure, found) in enumerate(indices.measures.items(), start=1):
        order = found.ranked(_RANKINGS[indices.kind].main)
        columns = {title: np.array([numbers[name] for name in order], dtype=float)}
        for kind, end in product(IndexKind, ("value", "low", "high")):
            rows = [found.parameters[name] for name in order]
            cells = [vars(row[kind])[end] for row in rows if kind in row]
            if cells:
                header = kind.value if end == "value" else f"{kind.value} {end}"
                columns[header] = np.array(cells)
        tables[f"{k}_{plate_name(measure)}"] = columns
    return tables


# Measures over parameters

MAX_SHOWN = 4
"""Parameters that a plate of measures shows."""

_SCATTER_HEIGHT = 1.75
"""Height of a row of panels [inch]."""

_CHARACTERS_PER_INCH = 12.0
"""Characters of a title on an inch of a panel."""

FEW_RUNS = 200
"""Number of runs up to which their points are large."""

_MIN_RUNS_PER_BIN = 20
_MAX_BINS = 8
_QUANTILES = (0.1, 0.5, 0.9)


@dataclass(frozen=True)
class StudyRuns:
    """Table of the runs of a study.

    Attributes:
        name: name of the folder.
        parameters: values by parameter, each of shape (runs,).
        measures: values by measure, nan where a run has none, each of shape (runs,).
        titles: titles of the measures.
        is_done: runs that reached their stop time.
    """

    name: str
    parameters: Mapping[str, Array]
    measures: Mapping[str, Array]
    titles: Mapping[str, str]
    is_done: NDArray[np.bool_]


def read_runs(folder: Path) -> StudyRuns:
    """Read the table of runs of a study's folder. Raises InputError."""
    path = folder / TABLE_NAME
    try:
        study = tomllib.loads(_text(folder / STUDY_NAME))
        titles, table = read_csv_rows(StringIO(_text(path), newline=""))
        if not {*study["parameters"], *study["measures"], "outcome"} <= {*titles}:
            raise KeyError
        rows = list(table)
        return StudyRuns(
            name=folder.resolve().name,
            parameters={name: _column(rows, name) for name in study["parameters"]},
            measures={name: _column(rows, name) for name in study["measures"]},
            titles={
                name: _measure_title(name, str(each["column"]), str(each["take"]))
                for name, each in study["measures"].items()
            },
            is_done=np.array([row["outcome"] == Ending.DONE.value for row in rows], dtype=bool),
        )
    except (KeyError, TypeError, ValueError, AttributeError, csv.Error):
        hint = "run the sweep again"
        raise InputError((error(f"`{path}` is not the table of its study", hint=hint),)) from None


def _text(path: Path) -> str:
    source, unreadable = load_text(path, str(path))
    if unreadable is not None:
        raise InputError((unreadable,))
    return source.text


def _column(rows: Sequence[Mapping[str, str]], name: str) -> Array:
    return np.array([float(row[name] or nan) for row in rows], dtype=float)


def measure_plates(runs: StudyRuns, stem: str) -> Iterator[Plate]:
    """Yield plates of the measures over the parameters, some measures on each."""
    for names, name in _pages(runs.measures, f"{stem}_runs"):
        yield _measure_plate(runs, names, name)


def _measure_plate(runs: StudyRuns, measures: Sequence[str], name: str) -> Plate:
    """Return the plate of some measures over the parameters on which they depend most."""
    shown = _most_correlated(runs, measures)
    # A title that is wider than its panel would take the room of the others.
    characters = int(_CHARACTERS_PER_INCH * (current_medium().width - 0.6) / len(shown))
    failed = int((~runs.is_done).sum())
    with plot_style():
        height = 1.1 + _SCATTER_HEIGHT * len(measures)
        figure, panels = create_panels(height, len(measures), len(shown))
        for row, measure in zip(panels, measures, strict=True):
            title = fill(runs.titles[measure], characters)
            row[0].set_title(title, fontsize=8.0, fontweight="bold", parse_math=False)
            for axes, parameter in zip(row, shown, strict=True):
                _draw_runs(axes, runs, parameter, measure)
        for axes, parameter in zip(panels[-1], shown, strict=True):
            axes.set_xlabel(fill(parameter, characters), fontsize=8.0, parse_math=False)
        handles = [
            Line2D([], [], color=GREY, marker=".", lw=0.0, label="a run"),
            Line2D([], [], color=BLUE, lw=1.6, marker="o", ms=3.0, label="median"),
            Patch(color=BLUE, alpha=0.2, lw=0.0, label="10 % to 90 %"),
        ]
        if failed:
            label = "a failed run"
            handles.append(Line2D([], [], color=VERMILION, marker="x", lw=0.0, label=label))
        _add_legend_above(figure, handles)
        sign = "Line: median of neighbouring runs; band: their 10 % to 90 % quantiles."
        add_footer(figure, sign, ())
    count = format_count(len(runs.is_done), "run")
    caption = f"Measures of {count}, of which {failed} failed, over parameters."
    if left_out := [name for name in runs.parameters if name not in shown]:
        caption += (
            f" Left out: {len(left_out)} parameters with smaller rank correlations,"
            f" {', '.join(left_out)}."
        )
    columns = {**runs.parameters, **{each: runs.measures[each] for each in measures}}
    return Plate(
        name=name,
        title=f"{runs.name}: {count}" + (f", {failed} failed" if failed else ""),
        caption=caption,
        sign=sign,
        figure=figure,
        tables={"runs": columns},
    )


def _most_correlated(runs: StudyRuns, measures: Sequence[str]) -> list[str]:
    """Return the parameters with the largest rank correlations with any of the measures."""

    def strength(name: str) -> float:
        values = runs.parameters[name]
        return max(_rank_correlation(values, runs.measures[each]) for each in measures)

    count = 1 if current_medium().is_narrow else MAX_SHOWN
    largest = sorted(runs.parameters, key=strength, reverse=True)[:count]
    return [name for name in runs.parameters if name in largest]


def _rank_correlation(x: Array, y: Array) -> float:
    """Return the size of the rank correlation, 0 for constant values."""
    from scipy.stats import rankdata

    known = np.isfinite(x) & np.isfinite(y)
    ranks = [rankdata(each[known]) for each in (x, y)]
    if known.sum() < 2 or not all(np.ptp(each) for each in ranks):
        return 0.0
    return abs(float(np.corrcoef(ranks[0], ranks[1])[0, 1]))


def _draw_runs(axes: Axes, runs: StudyRuns, parameter: str, measure: str) -> None:
    x, y = runs.parameters[parameter], runs.measures[measure]
    good = runs.is_done & np.isfinite(y)
    # Many points are pale, so that median and band stay visible.
    alpha = min(0.6, max(0.06, 400.0 / max(len(x), 1)))
    size = 3.0 if len(x) > FEW_RUNS else 7.0
    look: Look = {"ms": size, "mew": 0.0, "alpha": alpha, "rasterized": True}
    axes.plot(x[good], y[good], ".", color=GREY, **look)
    failed = x[~runs.is_done]
    if len(failed):  # the layout fails with empty lines that are not clipped
        height = np.full(len(failed), 0.02)
        transform = axes.get_xaxis_transform()
        axes.plot(failed, height, "x", color=VERMILION, ms=4.0, transform=transform, clip_on=False)
    centres, quantiles = _running_quantiles(x[good], y[good])
    if len(centres):
        axes.fill_between(centres, quantiles[0], quantiles[2], color=BLUE, alpha=0.2, lw=0.0)
        axes.plot(centres, quantiles[1], color=BLUE, lw=1.6, marker="o", ms=3.0)


def _running_quantiles(x: Array, y: Array) -> tuple[Array, Array]:
    """Return middles of bins of equally many points, and quantiles in them, (3, bins).

    Values of a parameter with few levels are bins of their own.
    """
    levels = np.unique(x)
    bins = min(_MAX_BINS, len(x) // _MIN_RUNS_PER_BIN)
    if 1 < len(levels) <= _MAX_BINS:
        groups = [y[x == level] for level in levels]
        centres = levels
    elif len(levels) > 1 and bins > 1:
        order = np.argsort(x, kind="stable")
        groups = np.array_split(y[order], bins)
        centres = np.array([np.median(each) for each in np.array_split(x[order], bins)])
    else:
        return np.zeros(0), np.zeros((3, 0))
    return centres, np.array([np.quantile(each, _QUANTILES) for each in groups]).T


def study_plates(folder: Path) -> list[Plate]:
    """Return the plates of a study's folder: its indices, where it has some, and its runs.

    Raises:
        InputError: a file of the folder is missing or damaged.
    """
    if not is_file(folder / TABLE_NAME):
        hint = "finish its sweep: `mover sweep STUDY.toml -o DIR` continues"
        raise InputError((error(f"`{folder}` has no table of runs, `{TABLE_NAME}`", hint=hint),))
    stem = plate_name(folder.resolve().name)
    plates: list[Plate] = []
    if is_file(folder / INDICES_NAME):
        plates += sensitivity_plates(read_indices(folder / INDICES_NAME), stem)
    return [*plates, *measure_plates(read_runs(folder), stem)]
