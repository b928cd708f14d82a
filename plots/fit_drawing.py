"""Picture of a fit: data, curves and dead zone; below, the residuals."""

from math import degrees

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from plots.canvas import BLACK, BLUE, GREY, PALE, VERMILION, Look, draw_zero_line, plot_style
from springs import Cubic
from springs.fit import CubicFit
from springs.fit_forms import Form, FormFit

_POINTS = 400
_MARGIN = 0.04


_MEANINGS = (
    "M acts on the child: the torque on the child is +M.",
    "M is the resisting moment: the torque on the child is -M.",
)


def draw_fit(
    fit: CubicFit, chosen: FormFit | None, title: str, motion: str = "", reference: str = ""
) -> Figure:
    """Draw a fit over the range of its data; without a chosen form its cubic restores nowhere."""
    with plot_style():
        figure = Figure(figsize=(6.4, 5.4), layout="constrained")
        upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=[3, 1])
        _draw_moments(upper, fit, chosen)
        upper.set_title(title)
        _draw_residuals(lower, fit, chosen)
        lower.set_xlabel(f"angle [deg]{f', positive in {motion}' if motion else ''}")
        meaning = "M as measured. The cubic restores in neither sense, so it is not a law."
        if chosen is not None:
            meaning = _MEANINGS[chosen.sense < 0]
        footer = [meaning, *([f"Data: {reference}"] if reference else [])]
        figure.supxlabel("\n".join(footer), fontsize=8.0, x=0.01, ha="left", wrap=True)
    return figure


def _draw_moments(axes: Axes, fit: CubicFit, chosen: FormFit | None) -> None:
    first, last = float(fit.angles.min()), float(fit.angles.max())
    margin = _MARGIN * (last - first)
    angles = np.linspace(first - margin, last + margin, _POINTS)
    law = None if chosen is None else chosen.law
    if isinstance(law, Cubic) and law.dead_zone is not None:
        low, high = (degrees(np.clip(e, angles[0], angles[-1])) for e in law.dead_zone)
        look: Look = {"facecolor": "none", "edgecolor": GREY, "hatch": "///", "alpha": 0.5}
        axes.axvspan(low, high, label="dead zone", **look)
    c0, c1, c2, c3 = fit.coefficients
    cubic = c0 + angles * (c1 + angles * (c2 + angles * c3))
    axes.plot(np.degrees(angles), cubic, color=BLUE, label="cubic")
    if chosen is not None:
        dashes = (0, (5, 2))
        is_cubic = chosen.form is Form.CUBIC
        label = "law, with its dead zone" if is_cubic else f"law, {chosen.form}"
        moment = chosen.moments(angles)
        axes.plot(np.degrees(angles), moment, color=VERMILION, linestyle=dashes, label=label)
    axes.plot(np.degrees(fit.angles), fit.moments, "o", color=BLACK, mfc="white", label="measured")
    draw_zero_line(axes)
    axes.set_ylabel("moment M [N m]")
    axes.legend()


def _draw_residuals(axes: Axes, fit: CubicFit, chosen: FormFit | None) -> None:
    angles, residuals, name = np.degrees(fit.angles), fit.residuals, "cubic"
    if chosen is not None and chosen.form is not Form.CUBIC:
        residuals, name = fit.moments - chosen.moments(fit.angles), "law"
    rms = float(np.sqrt(np.mean(residuals**2)))
    axes.axhspan(-rms, rms, color=PALE, label=f"rms {rms:.3g} N m")
    draw_zero_line(axes)
    axes.vlines(angles, 0.0, residuals, color=GREY, linewidth=1.0)
    axes.plot(angles, residuals, "o", color=BLACK, mfc="white", label=f"measured - {name}")
    axes.set_ylabel("residual [N m]")
    axes.legend(ncols=2)
