"""Share of head hits and lead of the hands by tone, in pushes of `male50`: how `fall` was chosen.

    python -m benchmarks.tone_of_falls [FALLS]

Each tone rights neck and trunk with one share of their strength, and holds all other joints with
another, in 40 pushes (or FALLS) from the seed 500 on. People's numbers are of the facts that choose
the tone; no other number of the falls is printed, so that none chooses it.
"""

import sys
from dataclasses import replace

import numpy as np

from benchmarks import tables
from generator import fall_plan, read_figure, run_falls
from generator.model import Model
from generator.tone import Tone

RIGHTING = (0.0, 0.2, 0.3, 0.4, 0.45, 0.5)
HOLD = (0.0, 0.01, 0.03)
"""Shares of strength."""

FALLS, SEED = 40, 500


def main() -> None:
    """Print the table."""
    count = int(sys.argv[1]) if len(sys.argv) > 1 else FALLS
    people: tables.Row = {"righting": "people", "hold": "", "head hits": "0.35 to 0.48"}
    people |= {"hand leads [ms]": "38 to 50 (40)"}
    tables.show([people, *(_row(right, hold, count) for hold in HOLD for right in RIGHTING)])


def _row(right: float, hold: float, count: int) -> tables.Row:
    model = Model.of(read_figure("male50"))
    tone = Tone({"all": hold}, {"neck": right, "trunk": right})
    plan = replace(fall_plan(model.figure, "push"), tone=tone or None)
    falls = run_falls(model, "push", count, SEED, plan)
    lead = 1e3 * falls.hand_lead[np.isfinite(falls.hand_lead)]
    return {
        "righting": f"{right:g}",
        "hold": f"{hold:g}",
        "head hits": f"{falls.head_hit_share:.2f}",
        "hand leads [ms]": f"{lead.mean():.0f} ({lead.std(ddof=1):.0f})",
    }


if __name__ == "__main__":
    main()
