"""Each broken psurf in `tests/faults/` is told all that its `.expected` file says, and no more."""

import pytest

from generator.diagnostics import InputError, select_errors
from generator.geometry import parse_psurf_file, read_psurf
from generator.geometry.validate import validate_surface
from tests.paths import FAULTS

FILES = sorted((FAULTS).glob("*.pss"))

HARMLESS = {"psurf_little_bent", "psurf_touching_point"}
"""Files that are used with a warning."""

UNSOUND = {
    "psurf_cutting",
    "psurf_edge_of_four",
    "psurf_flat",
    "psurf_inside_out",
    "psurf_not_planar",
    "psurf_one_inside_out",
    "psurf_one_side",
    "psurf_open",
    "psurf_open_second_block",
    "psurf_turned",
    "psurf_void_outwards",
    "psurf_without_area",
}
"""Files that can be read, but enclose no body."""


def faults_of(path):
    """All that is said of a file: of its text, or else of its surface."""
    reading = parse_psurf_file(path)
    return (
        reading.diagnostics
        if reading.value is None
        else validate_surface(reading.value).diagnostics
    )


def test_the_files_are_there():
    assert len(FILES) > 20
    assert {path.stem for path in FILES} > HARMLESS | UNSOUND


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_a_broken_psurf_is_told_everything(path):
    told = "\n".join(str(fault) for fault in faults_of(path)).replace(str(path), path.name)
    assert told == path.with_suffix(".expected").read_text("utf-8").removesuffix("\n")


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_only_what_is_no_text_of_a_psurf_cannot_be_read(path):
    assert bool(select_errors(faults_of(path))) is (path.stem not in HARMLESS)
    if path.stem in HARMLESS | UNSOUND:
        assert read_psurf(path).face_count > 0
        return
    with pytest.raises(InputError) as raised:
        read_psurf(path)
    assert raised.value.diagnostics == faults_of(path)


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_every_fault_has_a_place(path):
    for fault in faults_of(path):
        assert fault.span is not None
        assert 0 <= fault.span.start <= fault.span.end <= len(fault.span.source.text)
