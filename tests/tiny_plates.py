"""Small plates for the tests of what makes and shows them; and some that cannot be made."""

import os
import time
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from plots.canvas import plot_style
from plots.plate import Claim, Plate

ANGLES = np.linspace(-30.0, 30.0, 7)

TARGETS = {
    name: f"tests.tiny_plates:{name}"
    for name in ("spring", "damper", "raising", "dying", "misnamed", "endless", "complaining")
}


def _figure(moments: np.ndarray) -> Figure:
    with plot_style():
        figure = Figure(figsize=(3.0, 2.0), layout="constrained")
        axes = figure.subplots()
        axes.plot(ANGLES, moments, "o-", label="moment")
        axes.set_xlabel("angle [deg]")
        axes.legend()
    return figure


def spring() -> Plate:
    """One table, claims that hold, and a text that is no markup."""
    print("libraries print")
    moments = -2.0 * np.radians(ANGLES)
    return Plate(
        name="spring",
        title="A spring <b>& its moment</b>",
        caption="A straight line; a < b | *no* markup.",
        sign="M is positive in\nflexion.",
        figure=_figure(moments),
        claims=(
            Claim("The moment at 30 deg restores", moments[-1], "N m", at_most=0.0),
            Claim("a < 3 & b | c", 2.0, at_least=1.0, at_most=3.0),
        ),
        tables={"": {"angle [deg]": ANGLES, "moment, of the spring [N m]": moments}},
        references=("A. Author & B. Author, <Springs>, 1989", "Another, 1990"),
    )


def damper() -> Plate:
    """Two tables, and a claim that does not hold."""
    moments = 0.1 * ANGLES
    return Plate(
        name="damper",
        title="A damper",
        caption="Nothing restores.",
        sign="M acts on the child.",
        figure=_figure(moments),
        claims=(
            Claim("It restores", 3.0, "N m", at_most=0.0, remark="It only damps."),
            Claim("It is known", float("nan"), at_least=0.0),
        ),
        tables={
            "slow": {"angle [deg]": ANGLES, "moment [N m]": moments},
            "fast": {"rate [deg/s]": ANGLES},
        },
        references=(),
    )


def raising() -> Plate:
    """A plate that raises."""
    raise ValueError("no\nmoments")


def dying() -> Plate:
    """A plate that takes its process along."""
    os._exit(7)


def complaining() -> Plate:
    """A plate that takes its process along and says why, past Python."""
    os.write(2, b"first\nout of memory\n")
    os._exit(3)


def misnamed() -> Plate:
    """A plate of another name."""
    return spring()


def endless() -> Plate:
    """A plate that is never done; it leaves the number of its process."""
    Path(os.environ["ENDLESS_PROCESS"]).write_text(str(os.getpid()))
    time.sleep(300.0)
    raise AssertionError("it was left alone")
