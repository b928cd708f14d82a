"""Picture of an identification: angles, residuals, and the profile of each estimate."""

from math import ceil
from typing import cast

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure, SubFigure

from generator.identification.fit import CONFIDENCE, Estimate, Fit
from generator.identification.fitted_springs import decimals
from generator.identification.whiteness import autocorrelations
from plots.canvas import (
    BLACK,
    BLUE,
    GREY,
    LINE_STYLES,
    PALE,
    VERMILION,
    LineStyle,
    Look,
    draw_zero_line,
    plot_style,
)

MAX_COLUMNS_DRAWN = 4
"""Largest number of measured angles that are drawn: those that move most."""

MAX_PANELS_PER_ROW = 4
"""Largest number of profiles and autocorrelations in a row."""

MAX_VECTOR_SAMPLES = 5_000
"""Number of samples above which they are an image within an .svg, which would be large and slow."""

_PROFILE_POINTS = 200

_LEVEL = f"{100.0 * CONFIDENCE:.0f} %"
"""Level of the intervals."""

_PROFILE_HEIGHT = 10.0
"""Largest increase of the sum of squares that is drawn [variances of the noise]."""

_QUANTITY_NAMES = {
    "scale": "scale",
    "offset_deg": "offset",
    "viscous_Nms_rad": "viscous damping",
    "coulomb_Nm": "Coulomb friction",
    "damping_scale": "scale of damping",
}

_NOISE_BANDS = 2.0
"""Half height of the band of the residuals [standard deviations of the noise]."""


def draw_identification(fit: Fit) -> Figure:
    """Draw measured and simulated angles, residuals with their autocorrelation, and profiles."""
    profiles = [one for one in fit.estimates if one.profile is not None]
    count = len(profiles) + 1
    rows = ceil(count / MAX_PANELS_PER_ROW)
    columns = ceil(count / rows)
    heights = [4.4, 2.1 * rows]
    with plot_style():
        figure = Figure(figsize=(7.4, sum(heights)), layout="constrained")
        above, below = cast("list[SubFigure]", figure.subfigures(2, 1, height_ratios=heights))
        upper, lower = above.subplots(2, 1, sharex=True, height_ratios=[3, 1.3])
        _draw_angles(upper, fit)
        _draw_residuals(lower, fit)
        panels = list(below.subplots(rows, columns, squeeze=False).ravel())
        for axes, estimate in zip(panels, profiles, strict=False):
            _draw_profile(axes, estimate, is_first=estimate is profiles[0])
        _draw_autocorrelation(panels[len(profiles)], fit)
        for axes in panels[count:]:
            axes.set_visible(False)
    return figure


def _draw_angles(axes: Axes, fit: Fit) -> None:
    times, data = fit.data.times, fit.data
    drawn = _drawn_columns(fit)
    for k, style in drawn:
        joint, coordinate = data.columns[k]
        is_single = len(fit.case.figure.joints[joint].chain) == 1
        name = joint if is_single else f"{joint}.{coordinate + 1}"
        look: Look = {"ms": 2.6, "mew": 0.6, "mfc": "white", "rasterized": _is_image(fit)}
        colour, label = GREY if len(drawn) == 1 else style.colour, f"{name}, measured"
        axes.plot(times, np.degrees(data.angles[:, k]), "o", color=colour, label=label, **look)
        simulated, label = np.degrees(fit.simulated[:, k]), f"{name}, fit"
        axes.plot(times, simulated, style.dash, color=style.colour, label=label)
    axes.set_ylabel("angle [deg]")
    axes.legend(loc="upper right" if _is_image(fit) else "best", ncols=2)  # slow with many samples
    axes.set_title(f"{data.name}: measured and fitted angles")


def _draw_residuals(axes: Axes, fit: Fit) -> None:
    noise = float(np.degrees(fit.noise_sd))
    band = _NOISE_BANDS * noise
    label = f"± 2 sd of the noise, {noise:.3g} deg"
    axes.axhspan(-band, band, color=PALE, alpha=0.7, lw=0.0, label=label)
    draw_zero_line(axes)
    for k, style in _drawn_columns(fit):
        values = np.degrees(fit.residuals[:, k])
        look: Look = {"ms": 3.0, "color": style.colour, "rasterized": _is_image(fit)}
        axes.plot(fit.data.times, values, ".", **look)
    axes.set(ylabel="fit - measured\n[deg]", xlabel="time [s]")
    limit = 1.15 * max(band, float(np.degrees(np.abs(fit.residuals).max())))
    axes.set_ylim(-limit, limit)
    axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), borderaxespad=0.0)


def _is_image(fit: Fit) -> bool:
    return len(fit.data.times) > MAX_VECTOR_SAMPLES


def _drawn_columns(fit: Fit) -> list[tuple[int, LineStyle]]:
    """Return the columns that move most, with their styles."""
    order = np.argsort(-np.std(fit.data.angles, axis=0))[:MAX_COLUMNS_DRAWN]
    return list(zip(sorted(int(k) for k in order), LINE_STYLES, strict=False))


def _draw_profile(axes: Axes, estimate: Estimate, *, is_first: bool) -> None:
    """Draw the profile of an estimate, the parabola of its standard deviation, and the interval.

    The increase of the sum of squares is relative to the variance of the noise.
    """
    profile = estimate.profile
    assert profile is not None
    values = np.linspace(float(profile.values[0]), float(profile.values[-1]), _PROFILE_POINTS)
    quantile = (estimate.interval[1] - estimate.value) / estimate.sd
    ends = estimate.profile_interval or estimate.interval
    low, high = (
        float(edge) if end is None else end
        for end, edge in zip(ends, profile.values[[0, -1]], strict=True)
    )
    parabola = ((values - estimate.value) / estimate.sd) ** 2
    axes.axvspan(low, high, color=PALE, alpha=0.7, lw=0.0)
    axes.plot(values, profile.increase(values), color=BLUE, lw=2.4, label="profile")
    axes.plot(values, parabola, "--", color=VERMILION, lw=1.0, label="from the sd")
    axes.axhline(quantile**2, color=BLACK, lw=0.8, ls=":", label=_LEVEL)
    axes.set_ylim(0.0, _PROFILE_HEIGHT)
    unit = f" [{estimate.unit}]" if estimate.unit else ""
    name, _, quantity = estimate.path.removeprefix("springs.").rpartition(".")
    axes.set_xlabel(f"{name}\n{_QUANTITY_NAMES.get(quantity, quantity)}{unit}".strip())
    axes.locator_params(axis="x", nbins=3)
    digits = decimals(estimate.sd)
    first, last = ("open" if end is None else f"{end:.{digits}f}" for end in ends)
    axes.set_title(f"{estimate.value:.{digits}f}\n{_LEVEL}: {first} .. {last}", fontsize=8.0)
    if is_first:
        axes.set_ylabel("increase of squares\n[variance of noise]")
        axes.legend(loc="best", fontsize=7.0, handlelength=1.4)


def _draw_autocorrelation(axes: Axes, fit: Fit) -> None:
    """Draw the mean autocorrelation of the columns, with the band of independent residuals."""
    samples, columns = fit.residuals.shape
    lags = max(1, fit.tests.lags)
    mean = sum(autocorrelations(column, lags) for column in fit.residuals.T) / columns
    band = 2.0 / np.sqrt(samples * columns)
    axes.axhspan(-band, band, color=PALE, alpha=0.7, lw=0.0)
    draw_zero_line(axes)
    axes.vlines(np.arange(1, lags + 1), 0.0, mean, color=BLUE, lw=2.0)
    low, high = axes.get_ylim()
    axes.set_ylim(min(low, -0.4), max(high, 0.4))
    probability = fit.tests.whiteness
    known = "" if probability is None else f"\np = {probability:.2g}"
    axes.set_xlabel(f"lag [samples]{known}")
    axes.set_title("autocorrelation\ngrey: independent", fontsize=8.0)
