"""Action files: exact to the last bit, whole or not at all, and refused with a reason."""

from dataclasses import replace
from hashlib import sha256
from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from generator import read_action, read_figure, write_recording
from generator.diagnostics import InputError, UsageError
from generator.figure import AxisKind, Figure, JointAxis
from generator.motion_files import ActionFile, action_from_recording, format_action, parse_action
from generator.motion_files.action import format_displacement, parse_displacement
from generator.motion_files.motion import Header
from generator.recording import ENERGY_KINDS, Accuracy, Ending, Outcome, Recording
from tests.paths import DOCS, FIGURES

KNEE = (JointAxis(AxisKind.ROTATION, (0.0, -1.0, 0.0)),)
FREE = (
    JointAxis(AxisKind.ROTATION, (1.0, 0.0, 0.0)),
    JointAxis(AxisKind.ROTATION, (0.0, 1.0, 0.0)),
    JointAxis(AxisKind.ROTATION, (0.0, 0.0, 1.0)),
    JointAxis(AxisKind.TRANSLATION, (0.0, 0.6, 0.8)),
)
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


def recording_of(figure: Figure) -> Recording:
    times = np.array([0.1, 0.12, 0.13])
    moved = {
        name: np.linspace(-1.0, 1.0, 3 * joint.degrees_of_freedom).reshape(3, -1)
        for name, joint in figure.joints.items()
    }
    return Recording(
        times=times,
        poses={},
        chains={name: joint.chain for name, joint in figure.joints.items()},
        displacements=moved,
        velocities={},
        rotation_vectors={},
        reactions={},
        passive_torques={},
        centre_of_mass=np.zeros((3, 3)),
        energy={kind: np.zeros(3) for kind in ENERGY_KINDS},
        outcome=Outcome(Ending.INTERRUPTED, "interrupted\n at 0.13 s", 0.13),
        accuracy=Accuracy(None, None, 0.13, 0.01, 3, np.zeros(3)),
        springs="leg.springs.toml",
        law="weighted",
    )


def same_bits(one: np.ndarray, other: np.ndarray) -> bool:
    return one.shape == other.shape and one.tobytes() == other.tobytes()


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
    figure = read_figure("pendulum")
    recording = recording_of(figure)
    path = tmp_path / "swing.action"
    write_recording(recording, figure, path)
    action = read_action(path)
    bytes_of_figure = (FIGURES / "pendulum.fig").read_bytes()
    assert action.header == Header(
        "pendulum.fig",
        sha256(bytes_of_figure).hexdigest(),
        0.1,
        0.13,
        0.02,
        "leg.springs.toml",
        "weighted",
        Ending.INTERRUPTED,
        "interrupted at 0.13 s",
    )
    assert same_bits(action.times, recording.times)
    for name, moved in recording.displacements.items():
        assert same_bits(action.displacements[name], moved)


@pytest.mark.parametrize(
    ("path", "name"), [(None, "none"), (Path("gone") / "odd \udcff name.fig", "odd ? name.fig")]
)
def test_a_figure_whose_file_is_not_there_has_no_sha256(path: Path | None, name: str):
    figure = replace(read_figure("pendulum"), path=path)
    back = parse_action(
        format_action(action_from_recording(recording_of(figure), figure))
    ).require_value()
    assert (back.header.figure, back.header.sha256) == (name, None)


def test_times_are_normalised_to_the_motion():
    assert leg().normalised_times.tolist() == [0.0, 0.5, 1.0]
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
            parse_action(whole[:length]).require_value()


def test_a_file_that_is_not_there_is_a_sentence(tmp_path: Path):
    with pytest.raises(InputError, match="cannot be read: no such file"):
        read_action(tmp_path / "none.action")


@pytest.mark.parametrize("name", ["fall.gif", "fall", "action"])
def test_an_unknown_suffix_is_refused(tmp_path: Path, name: str):
    figure = read_figure("pendulum")
    with pytest.raises(UsageError, match=r"known are \.action, \.csv"):
        write_recording(recording_of(figure), figure, tmp_path / name)
    assert list(tmp_path.iterdir()) == []


def test_the_example_of_the_documentation_is_an_action_file():
    text = (DOCS / "action-file.md").read_text(encoding="utf-8")
    block = text[text.index("    # The motion") : text.index("(The numbers")]
    action = parse_action("\n".join(line[4:] for line in block.splitlines())).require_value()
    assert action.header.figure == "pendulum.fig"
    assert np.degrees(action.displacements["shoulder"][0]) == pytest.approx([0.0, 40.0, 20.0])
