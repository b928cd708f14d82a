"""The clavicle's elevation as the arm is raised (the thesis's figure 5.4)."""

# Matplotlib leaves the types of its keyword arguments open.
# pyright: reportUnknownMemberType=false

from collections.abc import Mapping
from dataclasses import replace
from math import nextafter

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from plots.canvas import (
    BLUE,
    LINE_STYLES,
    THESIS_STYLE,
    LineStyle,
    add_footer,
    create_panels,
    draw_points,
    draw_zero_line,
    plot_style,
)
from plots.plate import Claim, ClaimKind, Plate
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
_REGRESSION_STYLE = LineStyle(BLUE, ":")
_INMAN = (
    "V. T. Inman, J. B. Saunders & L. C. Abbott, Observations on the Function of the Shoulder "
    "Joint, J. Bone Jt. Surg. 26A:1-30, 1944 (the thesis's source; its graph is not public)"
)
_SIGN = (
    "Clavicle elevation is positive upwards, relative to the thorax; arm elevation is 0 with the "
    "arm hanging, and relative to the thorax, not the clavicle."
)


def clavicle() -> Plate:
    """Draw the plate."""
    lines = {plane: published.rhythm(f"otani_1989/clavicle_{plane}") for plane in PLANES}
    sets = {plane: _measured_sets(plane) for plane in PLANES}
    regression = published.rhythm("de_groot_brand_2001/clavicle_elevation")
    thesis = published.publication("otani_1989").reference
    references = (
        str(replace(thesis, place="eq. 5.42 and 5.44, minus the 90 deg of eq. 5.45")),
        _INMAN,
        str(published.publication("spartacus").reference),
        str(regression.reference),
    )
    return Plate(
        name="clavicle",
        title="Clavicle against arm elevation (the thesis's figure 5.4)",
        caption=_CAPTION,
        sign=_SIGN,
        figure=_draw(lines, sets, regression, references),
        claims=tuple(_claims(lines, sets)),
        tables=_tables(lines, sets, regression),
        references=references,
    )


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


def _measured_sets(plane: str) -> dict[str, PublishedRhythm]:
    rows = published.publication("spartacus").rhythms.values()
    return {row.name.rpartition("_")[0]: row for row in rows if row.plane == plane}


def _claims(
    lines: Mapping[str, PublishedRhythm], sets: Mapping[str, Mapping[str, PublishedRhythm]]
) -> list[Claim]:
    claims: list[Claim] = []
    for plane, line in lines.items():
        slopes = {_format_name(name): mean_slope(row, plane) for name, row in sets[plane].items()}
        steepest = max(slopes, key=lambda name: slopes[name])
        claims.append(
            Claim(
                f"From 30 to 120 deg of arm elevation in the {plane} plane the thesis's line is no "
                f"steeper than the steepest measured set ({steepest})",
                mean_slope(line, plane),
                "deg/deg",
                at_most=slopes[steepest],
                kind=ClaimKind.COMPARISON,
                remark="the lines follow Inman's graph of 1944; in no later measurement listed "
                "here does the clavicle rise as fast",
            )
        )
    for plane, line in lines.items():
        elevations = np.degrees(line.law.angle(np.radians(CHECKED_ELEVATIONS)))
        by_hand = HAND_CALCULATED_ELEVATIONS[plane]
        *first, last = CHECKED_ELEVATIONS
        where = ", ".join(f"{at:g}" for at in first)
        claims.append(
            Claim(
                f"In the {plane} plane the elevation at {where} and {last:g} deg is that "
                f"calculated by hand: {', '.join(f'{value:.3f}' for value in by_hand)} deg",
                float(np.abs(elevations - by_hand).max()),
                "deg",
                at_most=0.0005,
            )
        )
    return claims


def _format_name(name: str) -> str:
    """Format `ludewig_2009` as `Ludewig 2009`."""
    return name.replace("_", " ").capitalize()


def _draw(
    lines: Mapping[str, PublishedRhythm],
    sets: Mapping[str, Mapping[str, PublishedRhythm]],
    regression: PublishedRhythm,
    references: tuple[str, ...],
) -> Figure:
    pens = {
        name: LINE_STYLES[k]
        for k, name in enumerate(dict.fromkeys([*sets["frontal"], *sets["sagittal"]]))
    }
    with plot_style():
        figure, (upper, lower) = create_panels(6.6, 2, 2, (3.0, 1.3))
        for axes, rest, plane in zip(upper, lower, PLANES, strict=True):
            grid = np.degrees(_GRID)
            law = lines[plane].law
            assert isinstance(law, PiecewiseLinear)
            axes.plot(
                grid,
                _bone_angle_degrees(lines[plane], _GRID),
                color=THESIS_STYLE.colour,
                lw=2.2,
                label="thesis [1]",
            )
            axes.plot(
                grid,
                _bone_angle_degrees(regression, _GRID, PLANES[plane]),
                _REGRESSION_STYLE.dash,
                color=_REGRESSION_STYLE.colour,
                label="substitute: de Groot & Brand [4]",
            )
            for name, row in sets[plane].items():
                assert isinstance(row.law, DigitisedPoints)
                at, elevations = np.degrees(np.array(row.law.points)).T
                draw_points(
                    axes, at, elevations, pens[name], f"substitute: {_format_name(name)} [3]"
                )
                draw_points(
                    rest,
                    at,
                    elevations - _bone_angle_degrees(lines[plane], np.radians(at)),
                    pens[name],
                    "_",
                )
            _mark_jump(axes, lines[plane])
            draw_zero_line(rest)
            axes.set_title(f"arm raised in the {plane} plane", loc="left")
            axes.legend(loc="upper left", fontsize=7.0)
            rest.set_xlabel("arm elevation [deg]")
            rest.set_xticks(range(0, 181, 30))
        upper[0].set_ylabel("clavicle elevation [deg]")
        upper[0].set_ylim(0.0, 52.0)
        lower[0].set_ylabel("set - thesis [deg]")
        add_footer(figure, _SIGN, references)
    return figure


def _mark_jump(axes: Axes, line: PublishedRhythm) -> None:
    assert isinstance(line.law, PiecewiseLinear)
    end = line.law.pieces[0][0]
    height = _bone_angle_degrees(line, np.array([end]))[0]
    axes.annotate(
        f"jumps by {piece_offset(line):+.2f} deg\nat {np.degrees(end):.4g} deg",
        (float(np.degrees(end)), float(height)),
        xytext=(112.0, 41.0),
        fontsize=7.0,
        arrowprops={"arrowstyle": "-", "lw": 0.7},
    )


def _bone_angle_degrees(rhythm: PublishedRhythm, elevation: Array, plane: float = 0.0) -> Array:
    return np.degrees(rhythm.law.angle(elevation, plane))


def _tables(
    lines: Mapping[str, PublishedRhythm],
    sets: Mapping[str, Mapping[str, PublishedRhythm]],
    regression: PublishedRhythm,
) -> dict[str, dict[str, Array]]:
    """Tables of the lines on a grid, and of the sets at the elevations of all points, or nan."""
    tables: dict[str, dict[str, Array]] = {"lines": {"arm elevation [deg]": np.degrees(_GRID)}}
    for plane, line in lines.items():
        thesis = _bone_angle_degrees(line, _GRID)
        tables["lines"][f"thesis, {plane} [deg]"] = thesis
        fitted = _bone_angle_degrees(regression, _GRID, PLANES[plane])
        tables["lines"][f"de Groot & Brand 2001, {plane} [deg]"] = fitted
        at = np.unique([x for row in sets[plane].values() for x, _ in _points(row)])
        tables[plane] = {"arm elevation [deg]": np.degrees(at)}
        for name, row in sets[plane].items():
            known = dict(_points(row))
            values = np.degrees([known.get(float(x), np.nan) for x in at])
            tables[plane][f"{_format_name(name)} [deg]"] = values
        tables[plane]["thesis [deg]"] = _bone_angle_degrees(line, at)
    return tables


def _points(row: PublishedRhythm) -> tuple[tuple[float, float], ...]:
    assert isinstance(row.law, DigitisedPoints)
    return row.law.points
