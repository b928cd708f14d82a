"""Tables of comma-separated values: named columns with units, and full precision."""

import csv
from pathlib import Path

import numpy as np
import pytest

from generator import read_figure, write_recording
from generator.figure import AxisKind, Figure, JointAxis
from generator.motion_files.action import parse_displacement
from generator.recording import ENERGY_KINDS, Accuracy, Ending, Outcome, Recording

SLIDE = (
    JointAxis(AxisKind.ROTATION, (0.0, 0.0, 1.0)),
    JointAxis(AxisKind.TRANSLATION, (0.0, 0.0, 1.0)),
)


@pytest.fixture(scope="module")
def figure() -> Figure:
    return read_figure("pendulum")


def recording(energy: float = 0.1) -> Recording:
    rng = np.random.default_rng(3)
    return Recording(
        times=np.array([0.0, 0.1, 0.3]),
        poses={},
        chains={"spin": SLIDE, "weld": ()},
        displacements={"spin": rng.normal(size=(3, 2)), "weld": np.zeros((3, 0))},
        velocities={},
        rotation_vectors={},
        reactions={},
        passive_torques={},
        centre_of_mass=np.zeros((3, 3)),
        energy={kind: energy * rng.normal(size=3) for kind in ENERGY_KINDS},
        outcome=Outcome(Ending.DONE, "done at 0.3 s", 0.3),
        accuracy=Accuracy(None, None, 0.3, 0.1, 3, np.zeros(3)),
    )


def written(figure: Figure, folder: Path) -> tuple[Recording, list[str], list[list[str]]]:
    """A recording, the comments above its table, and the table."""
    motion, path = recording(), folder / "motion.CSV"
    write_recording(motion, figure, path)
    lines = path.read_text(encoding="utf-8").splitlines()
    comments = [line for line in lines if line.startswith("#")]
    assert lines[: len(comments)] == comments
    return motion, comments, list(csv.reader(lines[len(comments) :]))


def test_columns_are_named_with_their_units(figure: Figure, tmp_path: Path):
    _, _, table = written(figure, tmp_path)
    assert table[0] == [
        "time [s]",
        "spin.1 [deg]",
        "spin.2 [cm]",
        "kinetic [J]",
        "gravity [J]",
        "spring [J]",
        "dissipated [J]",
        "work [J]",
    ]
    assert [len(row) for row in table] == [8, 8, 8, 8]


def test_no_digit_is_lost(figure: Figure, tmp_path: Path):
    motion, _, table = written(figure, tmp_path)
    columns = dict(zip(table[0], zip(*table[1:], strict=True), strict=True))
    assert [float(word) for word in columns["time [s]"]] == motion.times.tolist()
    for k, unit in enumerate(("deg", "cm")):
        said = [parse_displacement(word, unit) for word in columns[f"spin.{k + 1} [{unit}]"]]
        assert said == motion.displacements["spin"][:, k].tolist()
    for kind in ENERGY_KINDS:
        assert [float(word) for word in columns[f"{kind} [J]"]] == motion.energy[kind].tolist()


def test_the_header_stands_above_the_table(figure: Figure, tmp_path: Path):
    _, comments, _ = written(figure, tmp_path)
    assert "# figure pendulum.fig" in comments
    assert "# outcome done" in comments
    assert "# message done at 0.3 s" in comments
    assert comments[-2:] == ["# joint spin R(0,0,1)*T(0,0,1)", "# joint weld fixed"]
