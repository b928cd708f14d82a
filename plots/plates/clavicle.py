"""The clavicle's elevation as the arm is raised (the thesis's figure 5.4)."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from math import nextafter

import numpy as np
from matplotlib.figure import Figure

from plots.canvas import BLUE, LINE_STYLES, THESIS_STYLE, create_panels, draw_points, draw_zero_line
from plots.literature import thesis_reference
from plots.plate import Claim, ClaimKind
from plots.plate_definition import PlateDefinition
from springs.backends import Array
from springs.published import tables as published
from springs.published.rows import PublishedRhythm
from springs.published.shoulder_rhythm import DigitisedPoints, PiecewiseLinear

PLANES = {"frontal": 0.0, "sagittal": np.pi / 2.0}
"""Angles of the planes of elevation [rad]."""

MIN_ELEVATION, MAX_ELEVATION = np.radians(30.0), np.radians(120.0)
"""Range of arm elevations in which all sets were measured [rad]."""

CHECKED_ELEVATIONS = (0.0, 90.0, 131.4, 150.0)
HAND_CALCULATED_ELEVATIONS = {
    "frontal": (1.076, 23.702, 34.110, 33.450),
    "sagittal": (2.348, 21.307, 30.0, 30.0),
}
"""Eq. 5.42 and 5.44 minus 90 deg, calculated by hand at `CHECKED_ELEVATIONS` [deg]."""

_GRID = np.radians(np.arange(0.0, 181.0, 1.0))
_INMAN = (
    "V. T. Inman, J. B. Saunders & L. C. Abbott, Observations on the Function of the Shoulder "
    "Joint, J. Bone Jt. Surg. 26A:1-30, 1944 (the thesis's source; its graph is not public)"
)


@dataclass(frozen=True)
class ClavicleRhythms:
    """Elevations of the clavicle: the thesis's by plane, measured ones by plane and source."""

    lines: Mapping[str, PublishedRhythm]
    sets: Mapping[str, Mapping[str, PublishedRhythm]]
    regression: PublishedRhythm


def _read_rhythms() -> ClavicleRhythms:
    rows = published.publication("spartacus").rhythms.values()
    names = {row: row.name.rpartition("_")[0].replace("_", " ").capitalize() for row in rows}
    return ClavicleRhythms(
        {plane: published.rhythm(f"otani_1989/clavicle_{plane}") for plane in PLANES},
        {plane: {names[row]: row for row in rows if row.plane == plane} for plane in PLANES},
        published.rhythm(_REGRESSION),
    )


_REGRESSION = "de_groot_brand_2001/clavicle_elevation"

_CAPTION = (
    "The thesis's straight lines (eq. 5.42 and 5.44, minus the 90 deg of eq. 5.45) approximate "
    "Inman's graph, which is not public. The substitutes are digitised measurements [3] and a "
    "regression [4] of unknown range, dotted throughout. Below: the sets minus the thesis's line. "
    "Between 30 and 120 deg the lines are steeper than every set. The sets differ from each other "
    "by more than 10 deg: bone pins, cadavers and magnetic resonance have different zeros, so that "
    "slopes compare better than values; Fung's angles could not be converted to the convention of "
    "the database, and Karduna's clavicle was derived from other bones. Eq. 5.44 as printed jumps "
    "by 0.27 deg at 130 deg of elevation, more than its rounding, and is not corrected; the pieces "
    "of eq. 5.42 meet within theirs. No scatter of the sets is in the tables here. Nothing is "
    "simulated: the lines pose a figure and exert no force."
)


def mean_slope(rhythm: PublishedRhythm, plane: str) -> float:
    """Mean slope of a bone's elevation between 30 and 120 deg of arm elevation [deg/deg]."""
    low, high = rhythm.law.angle(np.array([MIN_ELEVATION, MAX_ELEVATION]), PLANES[plane])
    return float((high - low) / (MAX_ELEVATION - MIN_ELEVATION))


def piece_offset(rhythm: PublishedRhythm) -> float:
    """Jump between the two pieces of a line [deg], positive upwards."""
    assert isinstance(rhythm.law, PiecewiseLinear)
    end = rhythm.law.pieces[0][0]
    below, above = rhythm.law.angle(np.array([end, nextafter(end, np.pi)]))
    return float(np.degrees(above - below))


def _claims(made: ClavicleRhythms) -> Iterator[Claim]:
    for plane, line in made.lines.items():
        sets = made.sets[plane].items()
        slopes = {name: mean_slope(row, plane) for name, row in sets}
        steepest = max(slopes, key=lambda name: slopes[name])
        yield Claim(
            f"From 30 to 120 deg of arm elevation in the {plane} plane the thesis's line is no "
            f"steeper than the steepest measured set ({steepest})",
            mean_slope(line, plane),
            "deg/deg",
            at_most=slopes[steepest],
            kind=ClaimKind.COMPARISON,
            remark="the lines follow Inman's graph of 1944; in no later measurement listed "
            "here does the clavicle rise as fast",
        )
    for plane, line in made.lines.items():
        elevations = np.degrees(line.law.angle(np.radians(CHECKED_ELEVATIONS)))
        by_hand = HAND_CALCULATED_ELEVATIONS[plane]
        *first, last = CHECKED_ELEVATIONS
        where = ", ".join(f"{at:g}" for at in first)
        sentence = (
            f"In the {plane} plane the elevation at {where} and {last:g} deg is that "
            f"calculated by hand: {', '.join(f'{value:.3f}' for value in by_hand)} deg"
        )
        yield Claim(sentence, float(np.abs(elevations - by_hand).max()), "deg", at_most=0.0005)


def _draw(made: ClavicleRhythms) -> Figure:
    names = dict.fromkeys(name for plane in PLANES for name in made.sets[plane])
    pens = dict(zip(names, LINE_STYLES, strict=False))
    figure, (upper, lower) = create_panels(6.6, 2, 2, (3.0, 1.3))
    grid = np.degrees(_GRID)
    for axes, rest, plane in zip(upper, lower, PLANES, strict=True):
        line = made.lines[plane]
        thesis, colour = _bone_angle_degrees(line, _GRID), THESIS_STYLE.colour
        axes.plot(grid, thesis, color=colour, lw=2.2, label="thesis [1]")
        regression = _bone_angle_degrees(made.regression, _GRID, PLANES[plane])
        axes.plot(grid, regression, ":", color=BLUE, label="substitute: de Groot & Brand [4]")
        for name, row in made.sets[plane].items():
            at, elevations = np.degrees(np.array(_points(row))).T
            label = f"substitute: {name} [3]"
            draw_points(axes, at, elevations, pens[name], label)
            less = elevations - _bone_angle_degrees(line, np.radians(at))
            draw_points(rest, at, less, pens[name], "_")
        assert isinstance(line.law, PiecewiseLinear)
        end = line.law.pieces[0][0]
        at = np.degrees([end, *line.law.angle(np.array([end]))]).tolist()
        label = f"jumps by {piece_offset(line):+.2f} deg\nat {at[0]:.4g} deg"
        arrow = {"arrowstyle": "-", "lw": 0.7}
        axes.annotate(label, at, xytext=(112.0, 41.0), fontsize=7.0, arrowprops=arrow)
        draw_zero_line(rest)
        axes.set_title(f"arm raised in the {plane} plane")
        axes.legend(loc="upper left", fontsize=7.0)
        rest.set(xlabel="arm elevation [deg]", xticks=range(0, 181, 30))
    upper[0].set(ylabel="clavicle elevation [deg]", ylim=(0.0, 52.0))
    lower[0].set_ylabel("set - thesis [deg]")
    return figure


def _bone_angle_degrees(rhythm: PublishedRhythm, elevation: Array, plane: float = 0.0) -> Array:
    return np.degrees(rhythm.law.angle(elevation, plane))


def _tables(made: ClavicleRhythms) -> dict[str, dict[str, Array]]:
    """Tables of the lines on a grid, and of the sets at the elevations of all points, or nan."""
    tables: dict[str, dict[str, Array]] = {"lines": {"arm elevation [deg]": np.degrees(_GRID)}}
    for plane, line in made.lines.items():
        thesis = _bone_angle_degrees(line, _GRID)
        tables["lines"][f"thesis, {plane} [deg]"] = thesis
        fitted = _bone_angle_degrees(made.regression, _GRID, PLANES[plane])
        tables["lines"][f"de Groot & Brand 2001, {plane} [deg]"] = fitted
        at = np.unique([x for row in made.sets[plane].values() for x, _ in _points(row)])
        tables[plane] = {"arm elevation [deg]": np.degrees(at)}
        for name, row in made.sets[plane].items():
            known = dict(_points(row))
            values = np.degrees([known.get(float(x), np.nan) for x in at])
            tables[plane][f"{name} [deg]"] = values
        tables[plane]["thesis [deg]"] = _bone_angle_degrees(line, at)
    return tables


def _points(row: PublishedRhythm) -> tuple[tuple[float, float], ...]:
    assert isinstance(row.law, DigitisedPoints)
    return row.law.points


clavicle = PlateDefinition(
    name="clavicle",
    title="Clavicle against arm elevation (the thesis's figure 5.4)",
    sign="Clavicle elevation is positive upwards, relative to the thorax; arm elevation is 0 with "
    "the arm hanging, and relative to the thorax, not the clavicle.",
    references=(
        thesis_reference("eq. 5.42 and 5.44, minus the 90 deg of eq. 5.45"),
        _INMAN,
        str(published.publication("spartacus").reference),
        str(published.rhythm(_REGRESSION).reference),
    ),
    collect=_read_rhythms,
    caption=_CAPTION,
    draw=_draw,
    claims=_claims,
    tables=_tables,
)
