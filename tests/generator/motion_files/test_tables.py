"""Tables: columns, units and headers; `tests/properties` reads every number back."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from generator.contact.record import centre_of_pressure
from generator.losses import Losses
from generator.motion_files import FigureMotion
from generator.motion_files.opensim_table import (
    write_mot,
    write_sto,
)
from generator.motion_files.tables import write_csv
from generator.recording import CONTACT_ENERGY_KINDS, ENERGY_KINDS
from generator.rotations import Array
from tests.contacts import touching_run
from tests.motions import any_motion, clip, slides


def test_columns_of_a_csv_are_named_with_their_units(tmp_path: Path):
    motion = any_motion(slides())
    write_csv(motion, tmp_path / "slides.csv")
    lines = (tmp_path / "slides.csv").read_text(encoding="utf-8").splitlines()
    comments = [line for line in lines if line.startswith("#")]
    assert lines[: len(comments)] == comments
    assert {"# figure leg.fig", "# outcome done", "# message done"} <= set(comments)
    assert "# joint rail R(1,0,0)*T(0,0,1)" in comments
    assert comments[-1] == "# joint weld fixed"
    assert lines[len(comments)].split(",") == [
        "time [s]",
        "rail.1 [deg]",
        "rail.2 [cm]",
        "swing.1 [deg]",
        "swing.2 [deg]",
        "swing.3 [deg]",
        "telescope.1 [cm]",
        "telescope.2 [deg]",
    ]


def test_the_energies_of_a_run_stand_in_a_csv_to_the_last_digit(tmp_path: Path):
    motion = clip("slides")
    assert motion.recording is not None
    motion.recording.write(tmp_path / "run.CSV")
    lines = (tmp_path / "run.CSV").read_text(encoding="utf-8").splitlines()
    titles, *rows = [line.split(",") for line in lines if not line.startswith("#")]
    assert titles[-5:] == [f"{kind} [J]" for kind in ENERGY_KINDS]
    columns = list(zip(*rows, strict=True))[-5:]
    for kind, column in zip(ENERGY_KINDS, columns, strict=True):
        assert [float(word) for word in column] == motion.recording.energy[kind].tolist()


def csv_columns(path: Path) -> dict[str, list[str]]:
    """Cells by title."""
    lines = path.read_text(encoding="utf-8").splitlines()
    titles, *rows = [line.split(",") for line in lines if not line.startswith("#")]
    return dict(zip(titles, map(list, zip(*rows, strict=True)), strict=True))


def test_a_csv_has_the_energies_and_forces_of_contact(tmp_path: Path):
    motion, run = touching_run()
    contact = run.contact
    assert contact is not None
    write_csv(motion, tmp_path / "run.csv")
    columns = csv_columns(tmp_path / "run.csv")
    after_energies = list(columns)[list(columns).index("work [J]") + 1 :]
    assert after_energies == [
        *(f"{kind} [J]" for kind in CONTACT_ENERGY_KINDS),
        *(f"ground_force_v{axis} [N]" for axis in "xyz"),
        *(f"ground_force_p{axis} [cm]" for axis in "xz"),
        "ground_torque_y [N m]",
        *(f"{name}.contact_force [N]" for name in contact.forces),
        *(f"{name}.contact_depth [cm]" for name in contact.depths),
    ]

    def numbers(title: str) -> Array:
        return np.array([float(word or "nan") for word in columns[title]])

    for kind in CONTACT_ENERGY_KINDS:
        assert np.array_equal(numbers(f"{kind} [J]"), run.energy[kind])
    points, moments = centre_of_pressure(contact.ground_reaction)
    for k, axis in enumerate("xyz"):
        column = numbers(f"ground_force_v{axis} [N]")
        assert np.array_equal(column, contact.ground_reaction[:, k])
    for k, axis in ((0, "x"), (2, "z")):
        column = numbers(f"ground_force_p{axis} [cm]")
        assert column[2:] / 100.0 == pytest.approx(points[2:, k], rel=1e-15)
        assert np.isnan(column[:2]).all()
    assert columns["ground_torque_y [N m]"][:2] == ["", ""]
    assert np.array_equal(numbers("ground_torque_y [N m]")[2:], moments[2:])
    for name, forces in contact.forces.items():
        found = numbers(f"{name}.contact_force [N]") ** 2
        assert found == pytest.approx(np.sum(forces**2, axis=1))
        depths = numbers(f"{name}.contact_depth [cm]")
        assert depths == pytest.approx(100.0 * contact.depths[name], rel=1e-15)


@pytest.mark.parametrize(
    ("write", "kept"),
    [
        (write_csv, {"ground reaction", "sizes of contact forces", "contact depths"}),
        (write_sto, {"ground reaction"}),
        (write_mot, {"ground reaction"}),
    ],
)
def test_tables_list_what_they_lose_of_the_contact(
    write: Callable[[FigureMotion, Path], Losses], kept: set[str], tmp_path: Path
):
    def lost(motion: FigureMotion) -> set[str]:
        places = {loss.what: set(loss.where) for loss in write(motion, tmp_path / "run").entries}
        return places["results of the run other than the motion"]

    of_contact = {
        "ground reaction",
        "sizes of contact forces",
        "directions of contact forces",
        "contact depths",
        "contact forces of parts, with their points",
        "first touches, peaks and impulses",
        "weight carried and creep",
        "sensitivity",
        "overlap of segments",
        "contact of parts of the body",
        "impacts of heads",
    }
    motion, run = touching_run()
    assert run.contact is not None
    without = lost(clip("slides"))
    assert lost(motion) - without == of_contact - kept
    none = {"head_injury": {}, "heads": {}, "parts": {}}
    bare = replace(run, contact=replace(run.contact, sensitivity=None, overlap=None, **none))
    left = lost(replace(motion, recording=bare)) - without
    assert left == of_contact - kept - {
        "sensitivity",
        "overlap of segments",
        "contact of parts of the body",
        "impacts of heads",
    }
