"""Damaged inputs get an answer from every reader, in little memory."""

import os
from pathlib import Path

import pytest

from benchmarks.child import peak
from benchmarks.damaged_inputs import MAX_MEMORY, READERS, make_seeds, read_damaged
from generator.cli.answer import CommandResult, format_paragraphs
from generator.diagnostics import InputError, MoverError
from tests.paths import FAULTS

COUNT = 22
"""Damaged files of each reader."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("damaged")


@pytest.fixture(scope="module")
def seeds(folder: Path) -> dict[str, list[Path]]:
    return make_seeds(folder)


@pytest.mark.parametrize("reader", READERS)
def test_damaged_inputs_are_answered(reader: str, seeds: dict[str, list[Path]], folder: Path):
    whole = [path for path in seeds[reader] if not path.is_relative_to(FAULTS)]
    for path in whole:
        try:
            READERS[reader](path)
        except MoverError as failure:
            pytest.fail(f"{path.name} is not a whole file: {failure}")
    before = 1e6 * peak()
    row = read_damaged(reader, seeds[reader], folder, COUNT)
    assert row.faults == ()
    assert row.refused > COUNT // 3
    assert row.slowest < 5.0
    assert not row.memory - before > MAX_MEMORY / 2  # not a number where it is not reported


@pytest.mark.skipif(os.name != "posix", reason="needs pipes")
@pytest.mark.parametrize("reader", sorted(set(READERS) - {"dyspam"}))
def test_a_pipe_is_refused(reader: str, seeds: dict[str, list[Path]], tmp_path: Path):
    """Reading it would wait for a writer."""
    path = tmp_path / f"pipe{''.join(seeds[reader][0].suffixes[-2:])}"
    os.mkfifo(path)
    message = ""
    try:
        answer = READERS[reader](path)
        if isinstance(answer, CommandResult):
            message = "".join(map(str, answer.diagnostics)) + format_paragraphs(answer.paragraphs())
    except InputError as failure:
        message = str(failure)
    assert "not a regular file" in message
