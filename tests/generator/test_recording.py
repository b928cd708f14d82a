"""Recordings: what they add up, and how they ended."""

import sys
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest
from pandas import read_csv

from generator import Plan, read_action, read_figure, read_npz, simulate
from generator.diagnostics import ModelError, UnknownNameError
from generator.figure import AxisKind, JointAxis
from generator.kinematics.placement import forward_kinematics
from generator.recording import (
    CONTACT_ENERGY_KINDS,
    ENERGY_KINDS,
    Accuracy,
    Ending,
    Outcome,
    Recording,
    energy_kinds,
)
from tests.motions import MOTIONS, clip
from tests.runs import same_bits


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
    assert page.startswith(f"<p>{line}</p><div")
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


@pytest.mark.parametrize("name", MOTIONS)
def test_a_site_is_where_the_kinematics_of_the_joints_put_it(name: str):
    motion = clip(name)
    run = motion.recording
    for segment in motion.figure.segments.values():
        for site in segment.sites.values():
            moved = run.site(f"{segment.name}.{site.name}").position
            for k, (values, place) in enumerate(zip(rows(run), moved, strict=True)):
                poses = forward_kinematics(motion.tree, values).poses
                expected = (poses[segment.name] @ site.pose_in_segment)[:3, 3]
                assert place == pytest.approx(expected, abs=1e-6), k


def rows(run: Recording) -> list[dict[str, np.ndarray]]:
    """The displacements of each frame."""
    return [
        {name: values[k] for name, values in run.displacements.items()}
        for k in range(len(run.times))
    ]


@pytest.mark.parametrize("name", ["pendulum", "prototype"])
def test_the_velocity_of_a_site_is_the_derivative_of_its_position(name: str):
    """Central differences differ by the square of the interval, 4 times less with half of it."""
    plan = Plan(stop=0.16, tolerance=1e-9, free_root=name == "prototype")
    errors, speeds = [], []
    for frame in (0.01, 0.005):
        run = simulate(read_figure(name), replace(plan, frame=frame))
        error = 0.0
        for segment in run.model.figure.segments.values():
            for site in segment.sites:
                motion = run.site(f"{segment.name}.{site}")
                assert motion.velocity.shape == motion.position.shape == (len(run.times), 3)
                slope = (motion.position[2:] - motion.position[:-2]) / (2.0 * frame)
                error = max(error, np.abs(slope - motion.velocity[1:-1]).max())
                speeds.append(np.abs(motion.velocity).max())
        errors.append(error)
    assert max(speeds) > 0.1
    assert errors[1] < 0.02 * max(speeds)
    assert 3.0 < errors[0] / errors[1] < 5.0


def test_a_site_of_the_ground_rests():
    run = clip("pendulum").recording
    ground = run.model.figure.root
    assert not run.site(str(ground)).velocity.any()


def test_an_unknown_site_names_the_nearest_one():
    run = clip("prototype").recording
    with pytest.raises(UnknownNameError, match=r"no site `left_lower_leg.ankl`; did you mean"):
        run.site("left_lower_leg.ankl")
    rest = simulate(run.model, Plan(stop=0.02), record=()).site(str(run.model.figure.root))
    with pytest.raises(UnknownNameError, match="was not asked to record velocities"):
        _ = rest.velocity


@pytest.mark.parametrize("name", MOTIONS)
def test_a_data_frame_is_the_table_of_the_recording(name: str, tmp_path: Path):
    run = clip(name).recording
    run.write(tmp_path / "run.csv")
    frame, table = run.to_dataframe(), read_csv(tmp_path / "run.csv", comment="#")
    assert list(frame.columns) == list(table.columns)
    assert frame.to_numpy() == pytest.approx(table.to_numpy(), rel=1e-15, nan_ok=True)
    assert frame["time [s]"].tolist() == run.times.tolist()


def test_without_pandas_a_sentence_names_the_extra(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(ImportError, match=r'needs pandas: .*`pip install -e "\.\[notebook\]"`'):
        clip("pendulum").recording.to_dataframe()


def test_a_recording_is_written_and_read(tmp_path: Path):
    run = clip("prototype").recording
    assert run.write(str(tmp_path / "run.action")).entries
    assert same_bits(read_action(tmp_path / "run.action").displacements, run.displacements)
    run.write(tmp_path / "run.npz")
    _, back = read_npz(tmp_path / "run.npz")
    assert back.model is None
    for each in fields(run):
        if each.name != "model":
            assert same_bits(getattr(back, each.name), getattr(run, each.name)), each.name
    for use in (back.require_model, back.to_dataframe, lambda: back.site("torso.neck")):
        with pytest.raises(ModelError, match=r"give it one, as replace\(recording, model=Model.of"):
            use()
