"""Each broken file in `tests/faults/` is told all that its `.expected` file says, and no more."""

import pytest

from generator.diagnostics import InputError, select_errors
from generator.figure_file import parse_figure_file, read_figure, simulation_diagnostics
from tests.paths import FAULTS

FILES = sorted((FAULTS).glob("*.fig"))

HARMLESS = {
    "bare_angles",
    "missing_psurf",
    "no_centre_of_mass",
    "no_masses",
    "turned_centre",
    "zero_mass",
}
"""Files that are read with warnings only."""

NEEDED_FOR_SIMULATION = {"no_centre_of_mass": 2, "no_masses": 1, "zero_mass": 1}
"""Of those, the files that a simulation refuses, with the number of errors."""


def test_the_files_are_there():
    assert len(FILES) > 60


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_a_broken_file_is_told_everything(path):
    reading = parse_figure_file(path)
    told = "\n".join(str(fault) for fault in reading.diagnostics).replace(str(path), path.name)
    assert told == path.with_suffix(".expected").read_text("utf-8").removesuffix("\n")


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_a_figure_comes_of_warnings_but_not_of_errors(path):
    reading = parse_figure_file(path)
    harmless = path.stem in HARMLESS
    assert bool(select_errors(reading.diagnostics)) is not harmless
    assert (reading.value is not None) is harmless
    if not harmless:
        with pytest.raises(InputError) as raised:
            read_figure(path)
        assert raised.value.diagnostics == reading.diagnostics


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_every_fault_has_a_place(path):
    for fault in parse_figure_file(path).diagnostics:
        assert fault.span is not None
        assert 0 <= fault.span.start <= fault.span.end <= len(fault.span.source.text)


@pytest.mark.parametrize("stem", sorted(HARMLESS))
def test_a_simulation_needs_all_masses(stem):
    figure = read_figure(FAULTS / f"{stem}.fig")
    faults = simulation_diagnostics(figure)
    assert len(faults) == NEEDED_FOR_SIMULATION.get(stem, 0)
    assert select_errors(faults) == faults
