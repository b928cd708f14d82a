"""Recordings: what they add up, and how they ended."""

import numpy as np
import pytest

from generator.recording import ENERGY_KINDS, Accuracy, Ending, Outcome, Recording


def recording(energy: dict[str, list[float]]) -> Recording:
    count = len(energy["kinetic"])
    return Recording(
        times=np.arange(count, dtype=float),
        poses={},
        chains={},
        displacements={},
        velocities={},
        rotation_vectors={},
        reactions={},
        passive_torques={},
        centre_of_mass=np.zeros((count, 3)),
        energy={kind: np.array(energy[kind], dtype=float) for kind in ENERGY_KINDS},
        outcome=Outcome(Ending.DONE, "done", count - 1.0),
        accuracy=Accuracy(None, None, count - 1.0, 0.1, 10, np.zeros(count)),
    )


def test_the_balance_counts_what_loads_brought_in():
    energy = {
        "kinetic": [0.0, 5.0],
        "gravity": [10.0, 7.0],
        "spring": [1.0, 2.0],
        "dissipated": [0.0, 4.0],
        "work": [0.0, 7.0],
    }
    assert recording(energy).energy_balance.tolist() == [11.0, 11.0]


@pytest.mark.parametrize("ending", Ending)
def test_only_a_run_that_is_done_has_succeeded(ending: Ending):
    assert Outcome(ending, "", 0.0).succeeded == (ending is Ending.DONE)
