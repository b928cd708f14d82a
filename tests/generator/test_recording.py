"""Recordings: what they add up, and how they ended."""

from dataclasses import replace

import numpy as np
import pytest

from generator.figure import AxisKind, JointAxis
from generator.named_mapping import UnknownNameError
from generator.recording import (
    CONTACT_ENERGY_KINDS,
    ENERGY_KINDS,
    Accuracy,
    Ending,
    Outcome,
    Recording,
    energy_kinds,
)


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


def test_the_balance_counts_the_energies_of_contact_where_there_are_any():
    run = recording({kind: [10.0, 10.0] for kind in ENERGY_KINDS})
    assert energy_kinds(run.energy) == ENERGY_KINDS
    lost = {"contact": [0.0, 1.0], "contact damping": [0.0, 2.0], "friction": [0.0, 4.0]}
    energy = {**run.energy, **{kind: np.array(values) for kind, values in lost.items()}}
    touched = replace(run, energy=energy)
    assert energy_kinds(touched.energy) == (*ENERGY_KINDS, *CONTACT_ENERGY_KINDS)
    assert (touched.energy_balance - run.energy_balance).tolist() == [0.0, 7.0]


def test_the_accuracy_in_words():
    run = recording({kind: [1.0, 1.0] for kind in ENERGY_KINDS})
    assert run.accuracy_text == "error not estimated"
    accuracy = Accuracy(2.5e-4, 1e-3, 0.7, 0.1, 10, np.zeros(2))
    assert replace(run, accuracy=accuracy).accuracy_text == (
        "estimated joint-angle error 2.5e-04 rad (tolerance 1.0e-03 rad, met until 0.7 s)"
    )
    unknown = replace(run, accuracy=replace(accuracy, estimate=np.inf))
    assert "too few passes finished (tolerance 1.0e-03 rad)" in unknown.accuracy_text
    assert "first frame" in replace(unknown, times=np.zeros(1)).accuracy_text


@pytest.mark.parametrize("ending", Ending)
def test_only_a_run_that_is_done_has_succeeded(ending: Ending):
    assert Outcome(ending, "", 0.0).succeeded == (ending is Ending.DONE)
    reached = ending in (Ending.DONE, Ending.INACCURATE)
    assert Outcome(ending, "", 0.0).reached_stop == reached


def test_a_recording_is_shown_in_a_line_and_as_a_table():
    chains = {
        "knee": (JointAxis(AxisKind.ROTATION, (0, 1, 0)),),
        "slide": (JointAxis(AxisKind.TRANSLATION, (0, 1, 0)),),
    }
    moved = replace(
        recording({kind: [0.0] * 3 for kind in ENERGY_KINDS}),
        chains=chains,
        displacements={
            "knee": np.radians([[-1e-4], [-90], [45]]),
            "slide": np.array([[1], [2], [3]]),
        },
    )
    line = "Recording: 3 frames, 0 to 2 s, 2 joints. done"
    assert repr(moved) == f"<{line}>"
    page = moved._repr_html_()
    assert page.startswith(f"<p>{line}</p><table>")
    row = ["knee", "1", "0.00", "-90.00", "45.00", "45.00", "deg"]
    assert "".join(f"<td>{cell}</td>" for cell in row) in page
    assert "<td>300.00</td><td>300.00</td><td>cm</td>" in page


def test_a_wrong_name_in_a_recording_raises_with_the_nearest():
    moved = replace(
        recording({kind: [0.0] for kind in ENERGY_KINDS}),
        displacements={"left_knee": np.zeros((1, 1))},
    )
    with pytest.raises(UnknownNameError, match="no joint `left_kne`; did you mean `left_knee`"):
        _ = moved.displacements["left_kne"]
    with pytest.raises(UnknownNameError, match="no energy `kinetics`; did you mean `kinetic`"):
        _ = moved.energy["kinetics"]
