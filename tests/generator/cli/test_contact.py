"""Floors, scenes and starts on the command line: what reaches a run, and what it reports."""

import json
import os
import re
import signal
import sys
from collections.abc import Sequence
from dataclasses import replace
from math import pi, radians
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import Result

from generator import read_action, read_figure
from generator.cli import contact
from generator.cli.answer import Table, json_text
from generator.cli.inputs import plan_from_options
from generator.contact.box import Box
from generator.contact.plane import Plane
from generator.contact.record import (
    HEAD_CAVEAT,
    INJURY_CAVEAT,
    ContactRecord,
    HeadImpact,
    Overlap,
    PartContact,
    SegmentContact,
)
from generator.contact.scene import FLOOR, Prop, Scene, floor_prop
from generator.contact.spheres import fit_contact_spheres
from generator.contact_file.parts import Evidence
from generator.diagnostics import ModelError
from generator.input_files.scene import read_scene
from generator.recording import CONTACT_ENERGY_KINDS, Ending, Recording
from generator.simulation.plan import Plan
from generator.simulation.run import simulate
from generator.simulation.starts import StartStudy
from springs.contact import DEFAULT_SURFACE
from tests.command import run
from tests.contacts import contact_record
from tests.processes import on_terminal, read_to_end

WIDEST_LINE = 90
"""Width of the widest line of a summary without names of files."""

SCREEN = 24
"""Number of lines of a terminal."""

UP = (0.0, 1.0, 0.0)
STOP = 0.7


def strict_json(result: Result) -> Any:
    """The JSON of a command, without NaN and infinities."""

    def refuse(constant: str) -> None:
        raise AssertionError(f"{constant} is not JSON")

    assert result.exception is None or isinstance(result.exception, SystemExit)
    return json.loads(result.stdout, parse_constant=refuse)


def floor(*words: object) -> Any:
    """JSON of a short run of a figure on the floor that succeeds."""
    return strict_json(run("simulate", *words, "--floor", "--json"))


def row(text: str, title: str) -> str:
    """The text of a row of a summary."""
    (found,) = re.findall(rf"^{title} +(.*)$", text.partition("\n\n")[0], re.MULTILINE)
    return found


class FloorRun:
    """The collapse of the prototype: as text, as JSON, and simulated from Python."""

    def __init__(self) -> None:
        words = ("simulate", "prototype", "--floor", "--stop", STOP)
        self.text = run(*words, "-v")
        self.data = strict_json(run(*words, "--json"))
        plan = Plan(free_root=True, height=0.0, scene=Scene((floor_prop(UP),)), stop=STOP)
        self.recording = simulate(read_figure("prototype"), plan)


@pytest.fixture(scope="module")
def fall() -> FloorRun:
    return FloorRun()


@pytest.fixture(scope="module")
def record(fall: FloorRun) -> ContactRecord:
    assert fall.recording.contact is not None
    return fall.recording.contact


# The summary and the JSON of a fall


def test_the_json_is_the_contact_record(fall: FloorRun, record: ContactRecord):
    data = fall.data["contact"]
    assert data == json.loads(json_text(contact.contact_data(record)))
    assert data["weight_carried"] == record.weight_carried
    assert (data["max_force_N"], data["max_force_s"]) == (record.max_force, record.max_force_time)
    assert data["max_penetration_m"] == record.max_depth
    assert data["max_penetration_segment"] == record.max_depth_segment
    assert data["dissipated_J"] == record.dissipated
    assert data["creep_m_per_s"] == record.creep
    by_segment = {
        "first_contact_s": "first_time",
        "impact_speed_m_per_s": "impact_speed",
        "peak_force_N": "peak_force",
        "peak_force_s": "peak_time",
    }
    for key, attribute in by_segment.items():
        assert data[key] == {name: getattr(c, attribute) for name, c in record.segments.items()}
    assert data["impulse_Ns"] == {name: list(c.impulse) for name, c in record.segments.items()}
    assert record.sensitivity is not None
    assert data["sensitivity_rad"] == record.sensitivity[-1]
    assert data["head_injury_criterion"] == data["head"] == {}
    assert "parts" not in data
    assert fall.data["range"] == []
    assert "range " not in fall.text.stdout


def test_the_energies_of_contact_are_in_the_json(fall: FloorRun, record: ContactRecord):
    energy = fall.data["energy"]
    assert set(CONTACT_ENERGY_KINDS) < set(energy)
    lost = sum(energy[kind]["last"] for kind in ("contact damping", "friction"))
    assert lost == pytest.approx(record.dissipated)


def test_a_run_without_props_reports_no_contact():
    result = run("simulate", "prototype", "--stop", 0.02, "--step", 0.01)
    assert not re.search("^(contact|touch|force|depth|end|poses) ", result.stdout, re.MULTILINE)
    assert "contact" not in floorless()


def floorless() -> Any:
    return strict_json(run("simulate", "pendulum", "--stop", 0.02, "--step", 0.01, "--json"))


def test_the_rows_state_the_contact_record(fall: FloorRun, record: ContactRecord):
    text = fall.text.stdout
    assert row(text, "contact") == "35 spheres; error in height at most 11 mm"
    assert row(text, "touch") == "right_lower_leg and left_lower_leg at 0 s"
    assert f"at most {record.max_force:.4g} N, at {record.max_force_time:.3g} s" in text
    assert f"at most {1e3 * record.max_depth:.0f} mm, of {record.max_depth_part}" in text
    assert f"{record.weight_carried:.3f} of the weight carried, horizontal speed" in text
    assert "(last 0.2 s)" in row(text, "end")
    chaotic = record.chaotic_from(fall.recording.times)
    assert chaotic is not None
    assert row(text, "poses").startswith(f"chaotic from {chaotic:.3g} s: then read times, heights")
    assert record.impact_shift is not None
    assert f"\n         first impact within {1e3 * record.impact_shift:.2g} ms\n" in text
    assert record.overlap is not None
    assert f"{record.overlap.segment} and {record.overlap.other} by up to" in row(text, "overlap")


def test_a_summary_fits_a_screen(fall: FloorRun):
    brief = run("simulate", "prototype", "--floor", "--stop", 0.1, "--starts", 2).stdout
    assert len(brief.splitlines()) <= SCREEN
    for text in (brief, fall.text.stdout):
        lines = [line for line in text.splitlines() if not line.startswith("  results of")]
        assert max(map(len, lines)) <= WIDEST_LINE


def test_the_details_have_a_row_for_each_segment(fall: FloorRun, record: ContactRecord):
    header, *rows = contact.contact_table(record).rows
    assert len(header) == 6
    assert [cells[0] for cells in rows] == list(record.segments)
    for cells in rows:
        assert re.search(r"^" + " +".join(map(re.escape, filter(None, cells))), fall.text.stdout, 8)
    touched = {name for name, one in record.segments.items() if one.first_time is not None}
    assert {cells[0] for cells in rows if cells[1] != "none"} == touched
    assert {"left_lower_leg", "right_lower_leg"} < touched < set(record.segments)


# Rows of records that are not simulated


def made(recording: Recording, **changes: Any) -> Recording:
    assert recording.contact is not None
    return replace(recording, contact=replace(recording.contact, **changes))


def touching(recording: Recording, **times: float | None) -> Recording:
    """The recording with other first touches, each with a speed of 2 m/s."""
    contacts = {
        name: SegmentContact(time, 0.0 if time in (None, 0.0) else 2.0, 9.0, 0.1, (0.0, 0.0, 0.0))
        for name, time in times.items()
    }
    rows = np.zeros((recording.times.size, 3))
    forces, depths = dict.fromkeys(contacts, rows), dict.fromkeys(contacts, rows[:, 0])
    return made(recording, segments=contacts, forces=forces, depths=depths)


@pytest.mark.parametrize(
    ("times", "expected"),
    [
        ({"a": None, "b": None}, ["nothing"]),
        ({"a": 0.0, "b": None}, ["a at 0 s"]),
        ({"a": 0.0, "b": 0.0, "c": 0.0}, ["3 segments at 0 s"]),
        ({"a": 0.3, "b": None, "c": 0.20004}, ["c at 0.2 s with 2 m/s", "a at 0.3 s with 2 m/s"]),
        ({"a": 0.2, "b": 0.20004, "c": 0.0}, ["c at 0 s", "a and b at 0.2 s with 2 m/s"]),
    ],
)
def test_the_first_touches_and_the_next(times: Any, expected: Sequence[str], fall: FloorRun):
    rows = contact.contact_rows(touching(fall.recording, **times), {})
    start = [title for title, _ in rows].index("touch")
    texts = [text for title, text in rows[start:] if title in ("touch", "")][: len(expected)]
    assert texts == expected
    assert [title for title, _ in rows[start : start + len(expected)]] == ["touch", ""][
        : len(expected)
    ]


def test_a_figure_that_falls_past_the_props_is_warned_of(fall: FloorRun):
    ledge = Scene((Prop("ledge", Box((0.0, -1.0, 0.0), (1.0, 1.0, 1.0)), DEFAULT_SURFACE),))
    past = made(fall.recording, weight_carried=0.0)
    (said,) = contact.touch_warnings(replace(past, scene=ledge))
    assert said.message == "the figure falls past the props: --floor adds a floor"
    assert not list(contact.touch_warnings(replace(past, scene=Scene.floor())))
    assert not list(contact.touch_warnings(replace(fall.recording, scene=ledge)))


def test_without_a_force_there_is_no_row_of_one(fall: FloorRun):
    recording = touching(made(fall.recording, max_force=0.0, overlap=None), a=None)
    assert [title for title, _ in contact.contact_rows(recording, {})] == ["contact", "touch"]
    (said,) = contact.touch_warnings(recording)
    assert said.message == (
        "the figure touched nothing by 0.7 s: increase --stop, or reduce --height"
    )
    assert list(contact.touch_warnings(fall.recording)) == []


def test_heads_that_touch_have_their_numbers_with_a_caveat(fall: FloorRun):
    names = fall.recording.contact and list(fall.recording.contact.segments)
    assert names
    touched, other = "right_lower_leg", "right_foot"
    assert touched in names
    heads = {name: HeadImpact(130.6, 0.2, 109.7) for name in (touched, "not a segment")}
    found = made(fall.recording, heads=heads)
    assert fall.recording.contact is not None
    force = f"{fall.recording.contact.segments[touched].peak_force:.4g} N"
    text = f"{touched}: at most 131 g, {force}, 110 head weights; HIC15 needs parts of the body"
    assert contact.contact_rows(found, {})[-2:] == [("head", text), ("", HEAD_CAVEAT)]
    hic = made(found, head_injury={touched: 321.4})
    (_, text), (_, caveat) = contact.contact_rows(hic, {})[-2:]
    assert text == f"{touched}: at most 131 g, {force}, 110 head weights, HIC15 321"
    assert caveat == f"{HEAD_CAVEAT}; {INJURY_CAVEAT}"
    assert hic.contact is not None
    data = json.loads(json_text(contact.contact_data(hic.contact)))
    assert data["head_injury_criterion"] == {touched: 321.4, "not a segment": None}
    assert data["head"][touched] == {
        "peak_acceleration_g": 130.6,
        "peak_acceleration_s": 0.2,
        "peak_force_head_weights": 109.7,
    }
    assert other not in data["head"]


def of_parts(fall: FloorRun, count: int) -> ContactRecord:
    """A record of parts of which the last one touches nothing."""
    band = (0.5, 2.0)
    parts = {
        f"part {k}": PartContact(0.1 * k, 1.0 + k, 100.0 - k, 0.2, 0.1, band, Evidence.SCALED)
        for k in range(count)
    }
    parts["far"] = PartContact(None, 0.0, 0.0, 0.0, 0.0, band, Evidence.ESTIMATE)
    found = made(fall.recording, parts=parts).contact
    assert found is not None
    return found


def test_the_table_of_parts_has_those_that_touched_in_a_dozen_rows(fall: FloorRun):
    few = contact.parts_table(of_parts(fall, 3))
    assert isinstance(few, Table)
    assert [row[0] for row in few.rows] == ["part", "part 0", "part 1", "part 2"]
    assert few.rows[2] == ("part 1", "0.1", "2", "99", "70 to 140", "0.1", "scaled")
    many = contact.parts_table(of_parts(fall, 14))
    assert isinstance(many, Table)
    assert len(many.rows) == 13
    shown = [f"part {k}" for k in range(11)]
    assert [row[0] for row in many.rows[1:]] == [*shown, "3 more (--json)"]
    assert contact.parts_table(of_parts(fall, 0)) == ""
    # A head is shown however small its force.
    heads = {"part 13": HeadImpact(10.0, 0.1, 5.0)}
    with_head = contact.parts_table(replace(of_parts(fall, 14), heads=heads))
    assert isinstance(with_head, Table)
    assert [row[0] for row in with_head.rows[-2:]] == ["part 13", "3 more (--json)"]


def test_the_json_has_each_part(fall: FloorRun):
    data = json.loads(json_text(contact.contact_data(of_parts(fall, 1))))["parts"]
    assert data["part 0"] == {
        "first_contact_s": 0.0,
        "impact_speed_m_per_s": 1.0,
        "peak_force_N": 100.0,
        "peak_force_s": 0.2,
        "peak_force_body_weights": 0.1,
        "stiffness_band": [0.5, 2.0],
        "likely_force_N": pytest.approx([100.0 * 0.5**0.5, 100.0 * 2.0**0.5]),
        "class": "scaled",
    }
    assert data["far"]["first_contact_s"] is None


def test_a_fall_of_a_person_lists_parts_and_ranges():
    words = ("simulate", "male50", "--floor", "--integrator", "implicit", "--stop", 0.7)
    text, data = run(*words).stdout, strict_json(run(*words, "--json"))
    assert not re.search("^touch ", text, re.MULTILINE)
    parts = data["contact"]["parts"]
    touched = {name for name, part in parts.items() if part["first_contact_s"] is not None}
    assert {"left_foot", "right_foot"} < touched < set(parts)
    listed = set(re.findall(r"^(\w+)(?: of \w+)? +[0-9.]+ .* (?:scaled|estimate)$", text, re.M))
    assert listed == touched
    found = data["range"]
    assert found[0]["joint"] in ("left_knee", "right_knee")
    assert found[0]["limit_deg"] == pytest.approx(137.7)
    assert f"range    {found[0]['joint']} {found[0]['beyond_deg']:.2g} deg beyond 137.7" in text
    assert [one["beyond_deg"] for one in found] == sorted(
        (one["beyond_deg"] for one in found), reverse=True
    )
    assert found[-1]["beyond_deg"] >= 1.0


def test_a_disturbed_run_that_ends_early_says_until_when(fall: FloorRun):
    times = fall.recording.times
    angles, heights = np.full(times.size, np.inf), np.full(times.size, np.inf)
    angles[:10], heights[:10] = 0.01, 0.002
    angles[5:10] = 0.2
    recording = made(
        fall.recording, sensitivity=angles, height_sensitivity=heights, impact_shift=None
    )
    (title, first), (_, second) = contact.sensitivity_rows(recording)
    assert title == "poses"
    chaotic = f"chaotic from {times[5]:.3g} s"
    assert first == f"{chaotic}: then read times, heights, energies and forces,"
    height = f"height of the centre of mass within 2 mm until {times[9]:.3g} s"
    assert second == f"0.001 rad off: {height}"
    assert recording.contact is not None
    assert json.loads(json_text(contact.contact_data(recording.contact)))["sensitivity_rad"] is None


def test_records_of_one_frame_or_without_gravity_or_a_disturbed_run(fall: FloorRun):
    short = replace(fall.recording, times=fall.recording.times[:1])
    assert "end" not in dict(contact.contact_rows(short, {}))
    plain = made(fall.recording, weight_carried=None, sensitivity=None, height_sensitivity=None)
    assert dict(contact.contact_rows(plain, {}))["end"].startswith("horizontal speed ")
    assert contact.sensitivity_rows(short) == contact.sensitivity_rows(plain) == []


def test_any_record_has_rows_of_a_line(fall: FloorRun):
    names = list(fall.recording.poses)[1:]
    made_up = replace(fall.recording, contact=contact_record(names, fall.recording.times.size))
    rows = [
        *contact.contact_rows(made_up, fit_contact_spheres(read_figure("prototype"))),
        *contact.sensitivity_rows(made_up),
    ]
    assert all(len(title) <= 7 for title, _ in rows)
    assert [text for _, text in rows if 9 + len(text) > WIDEST_LINE] == []


# Options


def test_the_floor_is_below_and_has_the_default_surface():
    plan, _ = plan_from_options({"floor": True})
    (prop,) = plan.scene.props
    assert (prop.name, prop.surface) == (FLOOR, DEFAULT_SURFACE)
    assert (plan.height, plan.free_root) == (0.0, True)
    given = {"floor": True, "friction": 0.1, "height": 2.0, "gravity": (0.0, -6.0, -8.0)}
    tilted, _ = plan_from_options(given)
    (prop,) = tilted.scene.props
    assert isinstance(prop.shape, Plane)
    assert prop.shape.normal == (0, 0.6, 0.8)
    assert prop.surface == replace(DEFAULT_SURFACE, friction=0.1)
    assert tilted.height == 2.0


def test_a_scene_stands_beside_a_floor_or_alone():
    step = read_scene("step")
    both, _ = plan_from_options({"floor": True, "friction": 0.0, "scene": "step"})
    assert [prop.name for prop in both.scene.props] == [FLOOR, *(p.name for p in step.props)]
    alone, _ = plan_from_options({"scene": "step", "height": -0.2})
    assert (alone.scene, alone.height, alone.free_root) == (step, -0.2, True)
    assert plan_from_options({}) == (Plan(), ())


@pytest.mark.parametrize(
    ("spread", "angle"),
    [(None, pi / 180), ("0.1rad", 0.1), ("2.5deg", radians(2.5)), ("180deg", pi)],
)
def test_the_spread_is_an_angle_with_a_unit(spread: str | None, angle: float):
    choice = contact.starts_from_options(contact.MAX_STARTS, spread, 5)
    assert choice == (contact.MAX_STARTS, pytest.approx(angle), 5)
    assert contact.starts_from_options(None, None, None) is None


def test_a_figure_with_a_loop_falls_by_capsules():
    result = run("simulate", "fourbar", "--floor", "--stop", 0.02)
    assert "spheres" in row(result.stdout, "contact")
    said = "warning: segments without geometry touch by a capsule between their joints: "
    assert result.stderr == f"{said}crank, coupler, rocker\n"


@pytest.mark.slow
def test_segments_touch_each_other_on_demand(fall: FloorRun):
    """The run is that of the plan, and the summary does not suggest the option."""
    words = ("prototype", "--floor", "--stop", STOP, "--self-contact")
    data = floor(*words)
    plan = Plan(
        free_root=True, height=0.0, scene=Scene((floor_prop(UP),)), stop=STOP, self_contact=True
    )
    recording = simulate(read_figure("prototype"), plan)
    assert data["contact"] == json.loads(json_text(contact.contact_data(recording.contact)))
    assert data["contact"] != fall.data["contact"]
    suggestion = "(without --self-contact)"
    made_up = made(fall.recording, overlap=Overlap(0.05, "left_hand", "right_hand", 0.1))
    assert suggestion in dict(contact.contact_rows(made_up, {}))["overlap"]
    assert suggestion not in dict(contact.contact_rows(made_up, {}, self_contact=True))["overlap"]
    assert suggestion not in run("simulate", *words).stdout


# Several starts


def study(**changes: Any) -> StartStudy:
    """Three starts of which the second failed."""
    return replace(
        StartStudy(
            impact_times=np.array([np.nan, np.nan, 0.5]),
            max_forces=np.array([1000.0, np.nan, 3000.0]),
            peak_forces={"hand": np.array([10.0, np.nan, 30.0])},
            rest_heights=np.array([0.2, np.nan, 0.4]),
            weights_carried=np.full(3, np.nan),
            is_accurate=np.array([True, False, False]),
            failures={2: str(ModelError("inside a prop"))},
            spread=radians(2.0),
            seed=7,
        ),
        **changes,
    )


def test_the_table_of_starts_counts_only_what_is_known():
    lines = str(contact.StartsResult(study())).splitlines()
    assert lines[:2] == [
        "3 starts, angles varied by 2 deg (SD), seed 7; 1 within the tolerance to the end",
        "1 failed; start 2: inside a prop",
    ]
    assert [re.split("  +", line) for line in lines[2:]] == [
        ["", "mean", "SD", "smallest", "largest"],
        ["first impact [s]", "0.5", "-", "0.5", "0.5"],
        ["largest force [N]", "2000", "1414", "1000", "3000"],
        ["height of the centre of mass at the end [m]", "0.3", "0.1414", "0.2", "0.4"],
    ]
    last = contact.StartsResult(study()).details().splitlines()[-1]
    assert re.split("  +", last) == ["hand [N]", "20", "14.14", "10", "30"]


def test_starts_that_all_failed_have_no_table_and_a_fixed_step_no_tolerance():
    failures = {number: "inside a prop" for number in (1, 2, 3)}
    failed = contact.StartsResult(study(failures=failures, is_accurate=np.zeros(3, bool)))
    assert str(failed).splitlines()[1:] == ["3 failed; start 1: inside a prop"]
    assert failed.details() == ""
    fixed = contact.StartsResult(study(is_accurate=None))
    assert "tolerance" not in str(fixed)
    assert fixed.to_json()["is_accurate"] is None


def test_the_json_of_starts_has_null_for_what_is_unknown():
    data = json.loads(json_text(contact.StartsResult(study())))
    assert data["spread_deg"] == pytest.approx(2.0)
    assert data["failures"] == {"2": "inside a prop"}
    assert data["impact_s"] == [None, None, 0.5]
    assert data["max_force_N"] == [1000.0, None, 3000.0]
    assert data["weight_carried"] == [None, None, None]


@pytest.mark.slow
@pytest.mark.skipif(os.name != "posix", reason="needs SIGINT")
def test_ctrl_c_during_the_starts_keeps_the_starts_and_the_files_of_the_run(tmp_path: Path):
    line = [sys.executable, "-m", "generator.cli.app", "simulate", "prototype", "--floor"]
    line += ["--stop", "0.02", "--starts", "10000", "-o", "fall.action"]
    with on_terminal(line, cwd=tmp_path) as (process, terminal):
        seen = b""
        while b"start 1" not in seen:
            seen += os.read(terminal, 1000)
        process.send_signal(signal.SIGINT)
        seen += read_to_end(terminal)
        said, _ = process.communicate()
    assert process.returncode == 3
    assert re.search(rb"interrupted after \d+ of 10000 starts", seen)
    assert re.search(rb"\d+ starts?, angles varied by 1 deg", said)
    assert b"Traceback" not in seen + said
    assert read_action(tmp_path / "fall.action").header.outcome is Ending.DONE
