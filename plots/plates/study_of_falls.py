"""The shipped studies of falls: what decides their forces, and softer and stiffer joints.

Their tables in `plots/data` are what these commands write, without journal and lock:

    mover sweep falls -o study_falls
    mover sweep falls_stiffness -o study_falls_stiffness
"""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from generator.study.run_case import run_case
from generator.study.sensitivity import INDICES_NAME, IndexKind, StudyIndices, read_indices
from generator.study.study_file import STUDY_FILE, read_study
from plots.canvas import BLUE, GREY, Look, create_panels
from plots.plate import Claim
from plots.plate_definition import PlateDefinition
from plots.study_plate import (
    SOBOL_REFERENCES,
    StudyRuns,
    draw_rankings,
    ranking_tables,
    rankings_caption,
    read_runs,
    varied_quantities,
)

DATA = Path(__file__).parents[1] / "data"
"""Folder of the tables."""

SHOWN = ("pelvis_force", "pelvis_weights", "head_force", "head_acceleration")
"""Measures on the plate of people."""

FORCES = ("pelvis_force", "head_force")
"""Measures on the plate of stiffness."""

MATTERS, HARDLY_MATTERS = 0.1, 0.05
"""Shares of the variance that count as much, and as hardly any."""

QUANTILES = (0.05, 0.95)
"""Quantiles of the range between falls."""

_TITLES = {
    "pelvis_force": "largest force on the pelvis [N]",
    "head_force": "largest force on the head [N]",
}

REPEATED = 1e-3
"""Largest relative difference of a repeated run, for other processors: rounding grows in a fall."""

_INDICES = (
    ("pelvis_force", "Force on the pelvis", "start", "the start", True),
    ("head_force", "Force on the head", "start", "the start", True),
    ("head_force", "Force on the head", "tone", "the tone", True),
    ("pelvis_force", "Force on the pelvis", "pelvis", "the stiffness of the pelvis", False),
    ("pelvis_force", "Force on the pelvis", "head", "the stiffness of the head", False),
)
"""Measure, its name, parameter, its name, and whether the parameter matters or hardly does."""


Ranking = tuple[StudyIndices, StudyRuns]
"""Indices of the study of four persons, and its runs."""


def _shown(data: Ranking) -> StudyIndices:
    indices, _ = data
    return replace(indices, measures={name: indices.measures[name] for name in SHOWN})


def _ranking_caption(data: Ranking) -> str:
    indices, runs = data
    return (
        f"Four persons are pushed in any direction, {len(runs.is_done)} times, each time from "
        "another start; half of them are limp. Stiffness of pelvis and head, damping of all parts, "
        "friction, the hip's datum and the stops vary over what is plausible. "
        f"5 % to 95 % of the falls: {_range_text(runs, 'pelvis_force')} on the pelvis, "
        f"{_range_text(runs, 'head_force')} on the head. {_overlaps(indices)} "
        f"{rankings_caption(_shown(data))}"
    )


def _overlaps(indices: StudyIndices) -> str:
    """Return a sentence on the parameters whose interval overlaps that of the first one."""
    texts: list[str] = []
    for name in SHOWN:
        measure = indices.measures[name]
        first, *others = measure.ranked(IndexKind.TOTAL)
        low = measure.parameters[first][IndexKind.TOTAL].low
        near = [one for one in others if measure.parameters[one][IndexKind.TOTAL].high >= low]
        texts.append(f"{name}: {first} and {', '.join(near)}" if near else f"{name}: none")
    return f"Whose intervals overlap with that of the first: {'; '.join(texts)}."


Studies = tuple[StudyRuns, StudyRuns]
"""Runs of the mean man with softer and stiffer joints, and those of people."""


def _draw_stiffness(studies: Studies) -> Figure:
    runs, people = studies
    figure, panels = create_panels(1.6 + 1.5 * len(FORCES), len(FORCES), 1)
    for row, name in zip(panels, FORCES, strict=True):
        axes, (low, high) = row[0], np.quantile(people.measures[name], QUANTILES)
        label = "falls of four persons, 5 % to 95 %"
        axes.axhspan(low, high, color=GREY, alpha=0.2, lw=0.0, label=label)
        look: Look = {"color": BLUE, "marker": "o", "ms": 4.0, "lw": 1.2, "label": "mean man"}
        axes.semilogx(runs.parameters["stiffness"], runs.measures[name], **look)
        axes.set_xticks([0.25, 0.5, 1.0, 2.0, 4.0], ["0.25", "0.5", "1", "2", "4"])
        axes.minorticks_off()
        axes.set_ylim(bottom=0.0)
        axes.set_title(_TITLES[name], fontsize=8.0, fontweight="bold")
    panels[-1][0].set_xlabel("stiffness of all joints over the published one")
    panels[0][0].legend(loc="lower left", fontsize=8.0)
    return figure


def _stiffness_claims(studies: Studies) -> Iterator[Claim]:
    force, others = (runs.measures["pelvis_force"] for runs in studies)
    low, high = np.quantile(others, QUANTILES)
    yield Claim(
        "Largest force on the pelvis: its range over the stiffnesses, as a share of that "
        "between the falls of people (5 % to 95 %)",
        float(np.ptp(force) / (high - low)),
        at_most=1.0,
    )


def _range_text(runs: StudyRuns, measure: str) -> str:
    """Return the 5 % and 95 % quantiles of a force [N]."""
    low, high = np.quantile(runs.measures[measure], QUANTILES) / 1e3
    return f"{low:.1f} to {high:.1f} kN"


def _index_claims(indices: StudyIndices) -> Iterator[Claim]:
    """Yield claims about total indices, each with the end of its interval that is nearer."""
    for measure, measured, parameter, varied, matters in _INDICES:
        total = indices.measures[measure].parameters[parameter][IndexKind.TOTAL]
        sentence = f"{measured}: total index of {varied}, {{}} end of its 95 % interval"
        if matters:
            yield Claim(sentence.format("lower"), total.low, at_least=MATTERS)
        else:
            yield Claim(sentence.format("upper"), total.high, at_most=HARDLY_MATTERS)


def _repeated_run(runs: StudyRuns) -> Claim:
    """Compute the first run again."""
    values = [float(column[0]) for column in runs.parameters.values()]
    result = run_case(read_study(STUDY_FILE.find("falls")), values)
    again = {name: np.nan if one is None else one for name, one in result.measures.items()}
    differences = [
        abs(again[measure] - column[0]) / np.nanmax(np.abs(column))
        for measure, column in runs.measures.items()
    ]
    sentence = (
        "First run, computed again: largest difference of a measure from the table, over its "
        "largest value"
    )
    return Claim(sentence, float(np.max(differences)), at_most=REPEATED, is_repetition=True)


study_falls = PlateDefinition(
    name="study_falls",
    title="What decides how hard people fall",
    sign=lambda data: varied_quantities(data[0]),
    references=SOBOL_REFERENCES,
    collect=lambda: (
        read_indices(DATA / "study_falls" / INDICES_NAME),
        read_runs(DATA / "study_falls"),
    ),
    caption=_ranking_caption,
    draw=lambda data: draw_rankings(_shown(data)),
    claims=lambda data: (*_index_claims(data[0]), _repeated_run(data[1])),
    tables=lambda data: ranking_tables(_shown(data)),
)

study_falls_stiffness = PlateDefinition(
    name="study_falls_stiffness",
    title="The mean man falls with softer and stiffer joints",
    sign="Band: 5 % to 95 % of the falls of the study of four persons.",
    collect=lambda: (read_runs(DATA / "study_falls_stiffness"), read_runs(DATA / "study_falls")),
    caption="The fall of `male50` with all passive springs from a quarter of the published "
    "stiffness to four times as stiff; damping and limits stay. The forces change where the fall "
    "takes another course, and more than they follow the stiffness.",
    draw=_draw_stiffness,
    claims=_stiffness_claims,
    tables=lambda studies: {
        "runs": {**studies[0].parameters, **{name: studies[0].measures[name] for name in FORCES}}
    },
)
