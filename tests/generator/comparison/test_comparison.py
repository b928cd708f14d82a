"""Comparison of motions: laws of differences, and what differs between runs."""

import csv
from collections.abc import Sequence
from dataclasses import replace
from io import StringIO
from math import degrees, radians
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from generator import Recording, read_figure, write_figure
from generator.comparison.comparison import (
    MAX_MOTIONS,
    SAME_TIME,
    Comparison,
    compare,
    compare_motions,
    names_of_files,
)
from generator.comparison.difference import Difference, Quantity
from generator.comparison.pair import first_crossing
from generator.contact.record import ContactRecord
from generator.diagnostics import ModelError, UsageError
from generator.joint_chain import build_chain
from generator.kinematics.free_root import FREE_CHAINS
from generator.motion_files import FigureMotion
from generator.rotations import Array
from springs import AxisSpring, JointSprings, Linear, SpringSet
from tests.chains import BALL, body, chain, figure, ground, joint
from tests.contacts import with_contact
from tests.generator.motion_files.test_resample import spin
from tests.motions import any_motion, clip, shipped, slides

GRIDS = st.lists(st.floats(0.0, 1.0), min_size=2, max_size=8, unique=True).map(
    lambda times: np.array(sorted([0.2, 0.7, *times]))
)
"""Times of frames, which all include 0.2 to 0.7 s."""


def distinct(times: Array) -> Array:
    """Times that are far enough from each other for the rates of a motion."""
    return times[np.concatenate([[True], np.diff(times) > 1e-3])]


MOTIONS = st.builds(
    lambda times, seed: any_motion(slides(), distinct(times), seed), GRIDS, st.integers(0, 9)
)


def pair(first: FigureMotion, other: FigureMotion, threshold: float = 0.1) -> Comparison:
    return compare_motions([first, other], ["first", "other"], threshold)


def by_name(found: Comparison, quantity: Quantity) -> dict[str, Difference]:
    return {one.name: one for one in found.of(found.names[1], quantity)}


@given(MOTIONS)
def test_a_motion_does_not_differ_from_itself(motion: FigureMotion):
    found = pair(motion, motion)
    assert {one.size for one in found.differences} == {0.0}
    assert found.divergences == {"other": None}
    assert all(one.divergence is None for one in found.differences)
    assert found.aligned[0].times is found.times


@settings(max_examples=30)
@given(MOTIONS, MOTIONS)
def test_differences_change_sign_with_the_order(first: FigureMotion, other: FigureMotion):
    forth, back = pair(first, other), pair(other, first)
    assert np.array_equal(forth.times, back.times)
    for quantity in (Quantity.ANGLE, Quantity.POSITION):
        one, two = by_name(forth, quantity), by_name(back, quantity)
        assert one.keys() == two.keys()
        for name, difference in one.items():
            mirrored = two[name]
            assert difference.size == pytest.approx(-(mirrored.size or 0.0), abs=1e-9)
            assert (difference.reference, difference.value) == (mirrored.value, mirrored.reference)
            assert (difference.time, difference.about) == (mirrored.time, mirrored.about)
            assert difference.divergence == pytest.approx(mirrored.divergence)


@settings(max_examples=30)
@given(st.lists(MOTIONS, min_size=2, max_size=MAX_MOTIONS))
def test_the_times_are_those_of_all_frames_within_the_common_time(motions: list[FigureMotion]):
    names = [str(k) for k in range(len(motions))]
    times = compare_motions(motions, names).times
    assert times[0] == max(one.times[0] for one in motions)
    assert times[-1] == min(one.times[-1] for one in motions)
    assert np.all(np.diff(times) > 0.0)
    for motion in motions:
        inside = motion.times[(motion.times >= times[0]) & (motion.times <= times[-1])]
        nearest = np.min(np.abs(inside[:, None] - times), axis=1)
        assert np.all(nearest <= SAME_TIME)


@given(
    st.lists(st.floats(0.0, 1.0), min_size=1, max_size=20),
    st.floats(0.01, 1.0),
    st.floats(0.01, 1.0),
)
def test_a_crossing_lies_on_the_line_between_frames(
    sizes: list[float], threshold: float, other: float
):
    times, values = 0.3 * np.arange(len(sizes)), np.array(sizes)
    found = first_crossing(times, values, threshold)
    assert (found is None) == (max(sizes) <= threshold)
    if found is None:
        return
    expected = values[0] if found == times[0] else threshold
    assert np.interp(found, times, values) == pytest.approx(expected, abs=1e-9)
    assert np.all(values[times < found - 1e-9] <= threshold)
    lower = first_crossing(times, values, min(threshold, other))
    assert lower is not None
    assert lower <= found


@given(st.integers(0, 9), st.integers(10, 19))
def test_a_ball_differs_by_the_angle_between_its_orientations(first: int, other: int):
    made = figure([ground(), body("top")], [joint("ball", "ground.base", "top.near", BALL)])
    found = pair(any_motion(made, seed=first), any_motion(made, seed=other))
    turns = [Rotation.from_matrix(one.poses["top"][:, :3, :3]) for one in found.aligned]
    angles = (turns[1] * turns[0].inv()).magnitude()
    difference = by_name(found, Quantity.ANGLE)["ball"]
    assert abs(difference.size or 0.0) == pytest.approx(np.max(angles), abs=1e-9)
    assert difference.time == found.times[np.argmax(angles)]


def test_different_frames_of_one_motion_agree():
    """A uniform rotation is interpolated without an error."""
    found = pair(spin(np.linspace(0.0, 2.0, 21)), spin(np.linspace(0.5, 3.0, 40)))
    assert by_name(found, Quantity.ANGLE)["ball"].size == pytest.approx(0.0, abs=1e-9)
    assert (found.times[0], found.times[-1]) == (0.5, 2.0)
    assert any("interpolated to the frames of all: first, other" in note for note in found.notes)
    assert "first has 0 to 2 s; the rest is left out." in found.notes


def test_frames_that_differ_by_rounding_are_not_interpolated():
    times = np.linspace(0.0, 2.0, 21)
    found = pair(spin(times), spin(times + 1e-9 * np.sin(np.arange(21.0))))
    assert found.notes[0] == "0 to 2 s, 21 frames."
    assert not any("left out" in note for note in found.notes)


def hinge(angles: Sequence[float], axis: str = "Rx") -> FigureMotion:
    made = figure([ground(), body("rod")], [joint("pin", "ground.base", "rod.near", chain(axis))])
    times = 0.1 * np.arange(len(angles))
    return replace(
        any_motion(made, times), displacements={"pin": np.array(angles, dtype=float)[:, None]}
    )


def test_a_hinge_is_compared_by_its_displacement():
    """By more than a turn as well; it diverges half-way between two frames."""
    found = pair(hinge([0.0, 0.1, 0.2, 0.3]), hinge([0.0, 0.1, 0.4, 9.3]), 0.1)
    (difference,) = found.differences
    assert difference.label == "pin about x"
    assert difference.size == pytest.approx(9.0)
    assert (difference.reference, difference.value) == pytest.approx((0.3, 9.3))
    assert difference.divergence == pytest.approx(0.15)
    assert difference.column == "pin.1"
    first = found.divergences["other"]
    assert first is not None
    assert first == difference


def test_joints_with_other_axes_are_left_out_and_listed():
    with pytest.raises(UsageError, match="other has no joint in common"):
        pair(hinge([0.0, 0.1]), hinge([0.0, 0.1], "Rz"))
    made = [
        figure(
            [ground(), body("rod"), body("top")],
            [
                joint("pin", "ground.base", "rod.near", chain(axis)),
                joint("slide", "ground.base", "top.near", chain("Ty")),
            ],
        )
        for axis in ("Rx", "R-x")
    ]
    found = pair(any_motion(made[0]), any_motion(made[1], seed=1))
    assert {one.name for one in found.differences} == {"slide"}
    assert list(found.curves) == ["pin.1", "slide.1"]
    assert list(found.curves["pin.1"].values) == ["first"]
    left = [note for note in found.notes if "pin" in note]
    assert [note[: note.index("pin")] for note in left] == [
        f"Left out, joints of {name} that the other has not as such: " for name in found.names
    ]


def test_free_segments_are_compared_whatever_their_sequence_of_rotations():
    motion = any_motion(shipped("prototype"), is_free=True)
    (root,) = (name for name, each in motion.chains.items() if tuple(each) in FREE_CHAINS)
    other = next(one for one in FREE_CHAINS if one != tuple(motion.chains[root]))
    poses = build_chain(motion.chains[root]).pose(motion.displacements[root])
    same = replace(
        motion,
        chains={**motion.chains, root: other},
        displacements={
            **motion.displacements,
            root: build_chain(other).continuous_displacements(poses),
        },
    )
    found = pair(motion, same)
    assert max(abs(one.size or 0.0) for one in found.differences) < 1e-7
    first, second = found.curves[f"{root}.4"].values.values()
    assert np.allclose(first, second, atol=1e-9)
    assert found.aligned[1].chains == motion.chains


@pytest.mark.parametrize("sense", [-1.0, 1.0])
def test_springs_name_the_axes_and_their_sense(sense: float):
    spring = AxisSpring((sense, 0.0, 0.0), (Linear(1.0),), motion="flexion")
    springs = SpringSet({"pin": JointSprings("pin", (spring,))})
    first, other = hinge([0.1, 0.1]), hinge([0.1, 0.4])
    for pair_of_both in (
        (first, replace(other, springs=springs)),
        (replace(first, springs=springs), other),
    ):
        (difference,) = pair(*pair_of_both).differences
        assert difference.label == "pin flexion"
        values = difference.reference, difference.value, difference.size
        assert values == pytest.approx((0.1 * sense, 0.4 * sense, 0.3 * sense))


def test_the_springs_that_a_header_names_name_the_axes():
    motion = any_motion(shipped("male50"))
    named = replace(motion, header=replace(motion.header, springs="male50.springs.toml"))
    found = by_name(pair(named, named), Quantity.ANGLE)
    assert found["left_knee"].label == "left_knee flexion"
    assert not [
        one.label for one in found.values() if "about" in one.label if "root" not in one.name
    ]


def touching(seed: int) -> tuple[FigureMotion, ContactRecord]:
    """A run without parts whose segments touch, and have their peaks, within 0.36 s."""
    motion = with_contact(clip("slides"), seed)
    run = motion.recording
    assert run is not None
    record = run.contact
    assert record is not None
    segments = {
        name: replace(
            one,
            first_time=one.first_time and 0.04 * one.first_time,
            peak_time=0.04 * one.peak_time,
        )
        for name, one in record.segments.items()
    }
    record = replace(record, segments=segments, parts={})
    return replace(motion, recording=replace(run, contact=record)), record


def test_runs_differ_in_touches_peaks_and_energies():
    (motion, record), (other, of_other) = touching(0), touching(1)
    found = pair(motion, other)
    peaks, touches = (by_name(found, one) for one in (Quantity.PEAK_FORCE, Quantity.FIRST_TOUCH))
    assert set(peaks) == set(touches) == {"sledge", "arm", "rod"}  # the cap touches nothing
    for name, difference in peaks.items():
        first, second = record.segments[name], of_other.segments[name]
        assert (difference.reference, difference.value) == (first.peak_force, second.peak_force)
        assert difference.size == second.peak_force - first.peak_force
        assert (difference.reference_time, difference.time) == (first.peak_time, second.peak_time)
        assert difference.column == f"{name}.contact_force"
        assert touches[name].row()["value"] == second.first_time
    times = [
        min(t for t in (one.reference, one.value) if t is not None) for one in touches.values()
    ]
    assert times == sorted(times)
    for quantity in set(Quantity) - {Quantity.FIRST_TOUCH}:
        sizes = [abs(one.size or 0.0) for one in found.of("other", quantity)]
        assert sizes == sorted(sizes, reverse=True)
    runs = [one.recording for one in found.motions if one.recording]
    falling = replace(runs[1], energy={kind: 2.0 * one for kind, one in runs[1].energy.items()})
    energies = by_name(pair(motion, replace(other, recording=falling)), Quantity.ENERGY)
    for kind, difference in energies.items():
        assert abs(difference.size or 0.0) == np.max(np.abs(runs[0].energy[kind]))
    assert "contact damping" in energies


def test_a_part_that_one_of_both_touches_with_has_no_difference():
    (motion, record), (other, of_other) = touching(0), touching(1)
    untouched = replace(of_other.segments["arm"], first_time=None, peak_force=0.0)
    contact = replace(of_other, segments={**of_other.segments, "arm": untouched})
    assert other.recording is not None
    other = replace(other, recording=replace(other.recording, contact=contact))
    touch = by_name(pair(motion, other), Quantity.FIRST_TOUCH)["arm"]
    assert (touch.size, touch.value, touch.time) == (None, None, None)
    assert touch.reference == record.segments["arm"].first_time
    peak = by_name(pair(motion, other), Quantity.PEAK_FORCE)["arm"]
    assert (peak.size, peak.time) == (-record.segments["arm"].peak_force, None)


def test_parts_of_the_body_stand_for_segments():
    motion = with_contact(clip("slides"))
    found = by_name(pair(motion, motion), Quantity.PEAK_FORCE)
    assert [(name, one.reference) for name, one in found.items()] == [("pelvis", 999.9)]


def test_peaks_at_other_times_are_left_out():
    motion, record = touching(0)
    stop = 0.5 * min(one.peak_time for one in record.segments.values() if one.peak_force)
    found = compare_motions([motion, motion], ["a", "b"], stop=stop)
    assert not by_name(found, Quantity.PEAK_FORCE)
    assert any("peaks of forces at other times: sledge, arm, rod" in note for note in found.notes)
    assert found.times[-1] == stop
    early = [one.reference for one in found.of("b", Quantity.FIRST_TOUCH)]
    assert all(one is not None and one <= stop for one in early)


def test_the_curves_are_the_columns_at_the_common_times():
    motion = with_contact(clip("slides"))
    later = replace(motion, times=motion.times + 0.013)
    assert motion.recording is not None
    later = replace(later, recording=replace(motion.recording, times=later.times))
    found = pair(motion, later)
    gravity = motion.recording.energy["gravity"]
    curve = found.curves["gravity"]
    assert curve.column.title == "gravity [J]"
    assert np.allclose(curve.values["first"], np.interp(found.times, motion.times, gravity))
    assert np.allclose(curve.values["other"], np.interp(found.times, later.times, gravity))
    assert all(one.size == found.times.size for one in found.curves["rail.1"].values.values())


def with_error(error: float) -> FigureMotion:
    """A run of the slides with the same error in all frames [rad]."""
    motion = clip("slides")
    run = motion.recording
    assert run is not None
    accuracy = replace(run.accuracy, by_frame=np.full(motion.times.size, error))
    return replace(motion, recording=replace(run, accuracy=accuracy))


def test_a_difference_has_the_error_of_both_runs():
    first, other = with_error(0.1), with_error(0.25)
    turned = {**other.displacements, "rail": other.displacements["rail"] + [0.3, 0.0]}
    other = replace(other, displacements=turned)
    difference = by_name(pair(first, other), Quantity.ANGLE)["rail"]
    assert difference.error == pytest.approx(0.35)
    assert difference.cells()[2] == f"~{degrees(0.3):.1f}"
    clear = by_name(pair(first, replace(other, recording=first.recording)), Quantity.ANGLE)["rail"]
    assert clear.error == pytest.approx(0.2)
    assert clear.cells()[2] == f"{degrees(0.3):.1f}"
    without = pair(first, replace(other, recording=None))
    assert by_name(without, Quantity.ANGLE)["rail"].error is None


def test_whole_turns_of_one_axis_of_a_ball_do_not_count():
    made = figure([ground(), body("top")], [joint("ball", "ground.base", "top.near", BALL)])
    motion = any_motion(made)
    turned = {"ball": motion.displacements["ball"] + [2.0 * np.pi, 0.0, 0.3]}
    difference = by_name(pair(motion, replace(motion, displacements=turned)), Quantity.ANGLE)[
        "ball"
    ]
    assert (difference.about, difference.column) == ("mostly about z", "ball.3")
    assert difference.size == pytest.approx(0.3)


def test_motions_from_files_and_recordings(tmp_path: Path):
    run, made = clip("slides").recording, tmp_path / "made.fig"
    assert isinstance(run, Recording)
    made.write_text(write_figure(clip("slides").figure), encoding="utf-8")
    for name in ("a.npz", "b.action"):
        run.write(tmp_path / name)
    found = compare(tmp_path / "a.npz", str(tmp_path / "b.action"), run, figure=made)
    assert found.names == ("a", "b", "C")
    assert max(abs(one.size or 0.0) for one in found.differences) < 1e-6
    assert found.threshold == radians(5.0)
    assert compare(run, run, names=("soft", "stiff")).names == ("soft", "stiff")
    lone = replace(run, model=None)
    with pytest.raises(ModelError, match="does not hold its figure"):
        compare(run, lone)
    assert compare(run, lone, figure=read_figure(made)).names == ("A", "B")


def test_the_table_is_the_same_everywhere(tmp_path: Path):
    pandas = pytest.importorskip("pandas")
    found = pair(any_motion(slides()), any_motion(slides(), seed=1))
    found.write(tmp_path / "out.csv")
    rows = list(csv.DictReader(StringIO((tmp_path / "out.csv").read_text(encoding="utf-8"))))
    assert [float(row["difference"]) for row in rows] == [
        one.row()["difference"] for one in found.differences
    ]
    frame = found.to_dataframe()
    assert isinstance(frame, pandas.DataFrame)
    assert list(frame["name"]) == [row["name"] for row in rows]
    shown = {one.quantity: one.row() for one in found.differences}
    for quantity, unit, scale in (
        (Quantity.ANGLE, "deg", degrees(1.0)),
        (Quantity.POSITION, "cm", 100.0),
    ):
        one = found.of("other", quantity)[0]
        assert shown[quantity]["unit"] == unit
        assert one.row()["difference"] == pytest.approx(scale * (one.size or 0.0))
    assert found._repr_html_().count("<tr>") == 1 + len(rows)


def test_names_of_files():
    assert names_of_files([Path("a/fall.npz"), Path("b/stiff.npz")]) == ["fall", "stiff"]
    assert names_of_files([Path("a/fall.npz"), Path("b/fall.npz")]) == ["a/fall.npz", "b/fall.npz"]
    assert names_of_files([Path("fall.npz"), Path("fall.npz")]) == ["fall (1)", "fall (2)"]


@pytest.mark.parametrize(
    ("names", "threshold", "stop", "words"),
    [
        (["a"], 0.1, None, "1 motion: 2 to 5"),
        (list("abcdef"), 0.1, None, "6 motions: 2 to 5"),
        (["a", "a"], 0.1, None, "each motion needs one of its own"),
        (["a", "b"], 0.0, None, "must be positive"),
        (["a", "b"], float("nan"), None, "must be positive"),
        (["a", "b"], 0.1, 0.0, "a stop at 0 s: the motions begin at 0 s"),
        (["a", "b"], 0.1, float("nan"), "a stop at nan s"),
    ],
)
def test_what_cannot_be_compared(
    names: list[str], threshold: float, stop: float | None, words: str
):
    motions = [hinge([0.0, 0.1]) for _ in names]
    with pytest.raises(UsageError, match=words):
        compare_motions(motions, names, threshold, stop)


def test_a_moment_keeps_its_begin_and_its_end():
    found = compare_motions([hinge([0.0, 0.1])] * 2, ["a", "b"], stop=1e-9)
    assert found.times.tolist() == [0.0, 1e-9]


def test_motions_without_a_common_time_or_of_single_frames():
    motion = hinge([0.0, 0.1])
    late = replace(motion, times=motion.times + 3.0)
    with pytest.raises(UsageError, match=r"in common: first 0 to 0\.1 s, other 3 to 3\.1 s"):
        pair(motion, late)
    single = hinge([0.05])
    found = pair(motion, single)
    assert np.array_equal(found.times, [0.0])
    assert found.differences[0].size == pytest.approx(0.05)
