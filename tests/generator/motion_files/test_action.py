"""Action files: exact to the last bit, whole or not at all, and refused with a reason."""

from dataclasses import replace
from hashlib import sha256
from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from generator import read_action
from generator.diagnostics import InputError, UsageError
from generator.figure import AxisKind, JointAxis
from generator.motion_files import ACTION_FILE, ActionFile, format_action
from generator.motion_files.action import format_displacement, parse_displacement
from generator.motion_files.motion import Header, header_from_recording
from generator.recording import Ending, Outcome, Recording
from tests.chains import BALL
from tests.motions import clip, shipped
from tests.paths import DOCS, FIGURES

KNEE = (JointAxis(AxisKind.ROTATION, (0.0, -1.0, 0.0)),)
FREE = (*BALL, JointAxis(AxisKind.TRANSLATION, (0.0, 0.6, 0.8)))
CHAINS = {"hip": FREE, "knee": KNEE, "weld": ()}

HEADER = Header("leg.fig", None, 0.0, 1.0, 0.5, "none", "weighted", Ending.DONE, "done at 1 s")

finite = st.floats(allow_nan=False, allow_infinity=False)


def leg(frames: int = 3) -> ActionFile:
    """A short motion with numbers that need all their digits."""
    times = np.linspace(0.0, 1.0, frames) if frames > 1 else np.zeros(1)
    rng = np.random.default_rng(1)
    moved = {name: rng.normal(size=(frames, len(chain))) for name, chain in CHAINS.items()}
    interval = float(times[1]) if frames > 1 else None
    header = replace(HEADER, stop=float(times[-1]), frame_interval=interval)
    return ActionFile(header, CHAINS, times, moved)


def interrupted_run() -> Recording:
    recording = clip("fourbar").recording
    assert recording is not None
    outcome = Outcome(Ending.INTERRUPTED, "interrupted\n at 0.13 s", 0.13)
    return replace(recording, outcome=outcome, springs="leg.springs.toml", law="weighted")


@given(value=finite, unit=st.sampled_from(["deg", "cm"]))
@example(value=-0.0, unit="deg")
@example(value=5e-324, unit="cm")
@example(value=1.7976931348623157e308, unit="deg")
@example(value=0.5, unit="deg")
def test_a_shown_number_is_meant_to_the_last_bit(value: float, unit: str):
    back = parse_displacement(format_displacement(value, unit), unit)
    assert np.float64(back).tobytes() == np.float64(value).tobytes()


def test_floats_beside_powers_of_two_survive_too():
    beside = [np.nextafter(2.0**k, to) for k in range(-30, 30) for to in (-np.inf, np.inf)]
    values = [*beside, *(2.0**k for k in range(-30, 30))]
    assert [parse_displacement(format_displacement(v, "deg"), "deg") for v in values] == values


def test_round_angles_look_round():
    shown = [format_displacement(v, "deg") for v in (0.0, np.radians(40.0), np.radians(-90.0))]
    assert shown == ["0.0", "40.0", "-90.0"]
    assert format_displacement(0.1, "cm") == "10.0"


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_what_is_not_finite_is_not_written(value: float):
    with pytest.raises(ValueError, match="cannot hold"):
        format_displacement(value, "deg")


def test_a_recording_is_written_with_its_origin(tmp_path: Path):
    interrupted_run().write(tmp_path / "swing.action")
    digest = sha256((FIGURES / "fourbar.fig").read_bytes()).hexdigest()
    origin = ("fourbar.fig", digest, 0.0, 0.4, 0.02, "leg.springs.toml", "weighted")
    expected = Header(*origin, Ending.INTERRUPTED, "interrupted at 0.13 s")
    assert read_action(tmp_path / "swing.action").header == expected


@pytest.mark.parametrize(
    ("path", "name"), [(None, "none"), (Path("gone") / "odd \udcff name.fig", "odd ? name.fig")]
)
def test_a_figure_whose_file_is_not_there_has_no_sha256(path: Path | None, name: str):
    figure = replace(shipped("fourbar"), path=path, name=None)
    header = header_from_recording(interrupted_run(), figure)
    assert (header.figure, header.sha256) == (name, None)


def test_times_are_normalised_to_the_motion():
    late = replace(leg(), times=np.array([2.0, 3.0, 4.0]))
    assert late.normalised_times.tolist() == [0.0, 0.5, 1.0]
    assert leg(frames=1).normalised_times.tolist() == [0.0]


def test_the_file_explains_itself():
    lines = format_action(leg()).splitlines()
    assert lines[1:3] == ["action 1", "units s deg cm"]
    assert "hip R(1,0,0)*R(0,1,0)*R(0,0,1)*T(0,0.6,0.8)" in lines
    assert "knee R(0,-1,0)" in lines
    assert "weld fixed" in lines
    assert "# normalised seconds hip.1 hip.2 hip.3 hip.4 knee.1" in lines
    assert lines[-2].startswith("1.0 1.0 ")
    assert lines[-1] == "end"


def test_the_columns_are_degrees_and_centimetres():
    moved = {"hip": np.array([[0.0, 0.0, np.pi, 0.25]]), "knee": np.array([[-np.pi / 2]])}
    moved["weld"] = np.zeros((1, 0))
    action = replace(leg(frames=1), displacements=moved)
    assert format_action(action).splitlines()[-2] == "0.0 0.0 0.0 0.0 180.0 25.0 -90.0"


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"times": np.array([0.0, 0.5, 0.5])}, "increases"),
        ({"times": np.zeros(0)}, "increases"),
        ({"chains": {**CHAINS, "knee": FREE}}, "4 displacements"),
        ({"chains": {"two words": KNEE}}, "cannot hold a joint named"),
        ({"chains": {"#knee": KNEE}}, "cannot hold a joint named"),
    ],
)
def test_what_the_file_cannot_hold_is_refused(change: dict, message: str):
    with pytest.raises(ValueError, match=message):
        replace(leg(), **change)


def test_a_file_cut_anywhere_is_refused():
    whole = format_action(leg()).rstrip()
    for length in range(0, len(whole), 7):
        with pytest.raises(InputError):
            ACTION_FILE.parse_text(whole[:length]).require_value()


@pytest.mark.parametrize("name", ["fall.gif", "fall", "action"])
def test_an_unknown_suffix_is_refused(tmp_path: Path, name: str):
    with pytest.raises(UsageError, match=r"known are \.action, \.csv"):
        interrupted_run().write(tmp_path / name)
    assert list(tmp_path.iterdir()) == []


def test_the_example_of_the_documentation_is_an_action_file():
    text = (DOCS / "action-file.md").read_text(encoding="utf-8")
    block = text[text.index("    # The motion") : text.index("(Numbers shortened")]
    action = ACTION_FILE.parse_text(
        "\n".join(line[4:] for line in block.splitlines())
    ).require_value()
    assert action.header.figure == "pendulum.fig"
    assert np.degrees(action.displacements["shoulder"][0]) == pytest.approx([0.0, 40.0, 20.0])
