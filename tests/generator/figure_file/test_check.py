"""A simulation needs the masses that a figure may lack."""

import pytest

from generator.diagnostics import select_errors
from generator.figure_file import read_figure, simulation_diagnostics
from tests.paths import FAULTS


@pytest.mark.parametrize(
    ("stem", "count"),
    [("no_centre_of_mass", 2), ("no_masses", 1), ("zero_mass", 1), ("missing_psurf", 0)],
)
def test_a_simulation_needs_all_masses(stem: str, count: int):
    diagnostics = simulation_diagnostics(read_figure(FAULTS / "figure" / f"{stem}.fig"))
    assert len(diagnostics) == count
    assert select_errors(diagnostics) == diagnostics
