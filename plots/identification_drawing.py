"""Picture of an identification: angles, residuals, and the profile of each estimate."""

from math import ceil

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from generator.identification.fit import CONFIDENCE, Estimate, Fit
from plots.canvas import (
    BLACK,
    BLUE,
    GREY,
    LINE_STYLES,
    PALE,
    VERMILION,
    LineStyle,
    draw_zero_line,
    plot_style,
)

# Matplotlib leaves the types of its keyword arguments open.
# pyright: reportUnknownMemberType=false

MAX_COLUMNS_DRAWN = 4
"""Largest number of measured angles that are drawn: those that move most."""

_PROFILES_PER_ROW = 3

_PROFILE_POINTS = 200

_NOISE_BANDS = 2.0
"""Half height of the band of the residuals [standard deviations of the noise]."""


def draw_identification(fit: Fit) -> Figure:
    """Draw measured and simulated angles, residuals, and profiles of the estimates."""
    profiles = [one for one in fit.estimates if one.profile is not None]
    rows = ceil(len(profiles) / _PROFILES_PER_ROW)
    with plot_style():
        figure = Figure(figsize=(7.4, 4.4 + 2.1 * rows), layout="constrained")
        heights = [4.4] + [2.1 * rows] * bool(rows)
        parts = figure.subfigures(len(heights), 1, height_ratios=heights, squeeze=False)[:, 0]
        upper, lower = parts[0].subplots(2, 1, sharex=True, height_ratios=[3, 1.3])
        _draw_angles(upper, fit)
        _draw_residuals(lower, fit)
        if rows:
            columns = min(len(profiles), _PROFILES_PER_ROW)
            panels = parts[1].subplots(rows, columns, squeeze=False, sharey=True)
            for axes, estimate in zip(panels.ravel(), profiles, strict=False):
                _draw_profile(axes, estimate, fit)
            for axes in panels.ravel()[len(profiles) :]:
                axes.set_visible(False)
            for row in panels:
                row[0].set_ylabel("increase of the\nsum of squares [variance]")
    return figure


def _draw_angles(axes: Axes, fit: Fit) -> None:
    times, data = fit.data.times, fit.data
    for k, style in _drawn_columns(fit):
        joint, coordinate = data.columns[k]
        name = (
            joint if len(fit.case.figure.joints[joint].chain) == 1 else f"{joint}.{coordinate + 1}"
        )
        axes.plot(
            times,
            np.degrees(data.angles[:, k]),
            "o",
            ms=2.6,
            mew=0.6,
            mfc="white",
            color=GREY,
            label=f"{name}, measured",
        )
        axes.plot(
            times,
            np.degrees(fit.simulated[:, k]),
            style.dash,
            color=style.colour,
            label=f"{name}, fit",
        )
    axes.set_ylabel("angle [deg]")
    axes.legend(loc="best", ncols=2)
    axes.set_title(f"{data.name}: measured and fitted angles", loc="left")


def _draw_residuals(axes: Axes, fit: Fit) -> None:
    noise = float(np.degrees(fit.noise_sd))
    band = _NOISE_BANDS * noise
    axes.axhspan(-band, band, color=PALE, alpha=0.7, lw=0.0, label=f"2 sd of {noise:.3g} deg")
    draw_zero_line(axes)
    for k, style in _drawn_columns(fit):
        values = np.degrees(fit.residuals[:, k])
        axes.plot(fit.data.times, values, ".", ms=3.0, color=style.colour)
    axes.set_ylabel("fit - measured\n[deg]")
    axes.set_xlabel("time [s]")
    axes.legend(loc="upper right")


def _drawn_columns(fit: Fit) -> list[tuple[int, LineStyle]]:
    """Return the columns that move most, with their styles."""
    order = np.argsort(-np.std(fit.data.angles, axis=0))[:MAX_COLUMNS_DRAWN]
    return list(zip(sorted(int(k) for k in order), LINE_STYLES, strict=False))


def _draw_profile(axes: Axes, estimate: Estimate, fit: Fit) -> None:
    """Draw the profile of an estimate, the parabola of its standard deviation, and both intervals.

    The increase of the sum of squares is relative to the variance of the noise.
    """
    from scipy.interpolate import PchipInterpolator

    profile = estimate.profile
    assert profile is not None
    values = np.linspace(profile.values[0], profile.values[-1], _PROFILE_POINTS)
    curve = PchipInterpolator(profile.values, profile.distances)
    half = estimate.interval[1] - estimate.value
    quantile = half / estimate.sd
    low, high = (
        edge if end is None else end
        for end, edge in zip(
            estimate.profile_interval or estimate.interval, profile.values[[0, -1]], strict=True
        )
    )
    axes.axvspan(low, high, color=PALE, alpha=0.7, lw=0.0)
    axes.plot(values, ((values - estimate.value) / estimate.sd) ** 2, "--", color=VERMILION, lw=1.2)
    axes.plot(values, np.asarray(curve(values)) ** 2, color=BLUE)
    axes.plot(profile.values, profile.distances**2, "o", ms=3.5, mfc="white", color=BLUE)
    axes.axhline(quantile**2, color=BLACK, lw=0.8, ls=":")
    axes.set_ylim(0.0, 10.0)
    unit = f" [{estimate.unit}]" if estimate.unit else ""
    axes.set_xlabel(f"{estimate.path.removeprefix('springs.')}{unit}", fontsize=8.0)
    axes.locator_params(axis="x", nbins=4)
    axes.set_title(f"{100 * CONFIDENCE:.0f} %: {low:.4g} .. {high:.4g}", loc="left", fontsize=8.0)
