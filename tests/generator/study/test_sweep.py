import errno
import os
import re
import subprocess
import sys
import tracemalloc
from collections import Counter
from collections.abc import Generator, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from benchmarks.journal import REPEATED, WARNED, damage_journals
from generator.diagnostics import InputError, UsageError
from generator.study.content_key import Versions
from generator.study.designs import design_points
from generator.study.journal import JOURNAL_NAME, LOCK_NAME, lock_folder
from generator.study.run_case import run_case
from generator.study.study import (
    DIED,
    Design,
    DesignKind,
    Parameter,
    RunResult,
    Study,
    Uniform,
)
from generator.study.sweep import (
    STUDY_NAME,
    TABLE_NAME,
    Engine,
    Sweep,
    SweepProgress,
    motion_path,
    run_sweep,
)
from generator.study.worker_pool import (
    FinishedRun,
    RunFunction,
    Task,
    died_run,
    perform_task,
    run_locally,
)
from tests.paths import FIGURES
from tests.processes import ENVIRONMENT
from tests.study_runs import FAULTY, POISON, list_study, parse_study_text, quick_run

VALUES = (0.1, 0.2, FAULTY, 0.4, 0.5)
STUDY = list_study(*VALUES)
FAULTY_RUN = VALUES.index(FAULTY)


class Serial:
    """An engine in this process that stops after a number of runs.

    Attributes:
        done: indices of the runs that it has carried out.
    """

    def __init__(self, stop_after: int | None = None, run: RunFunction = quick_run) -> None:
        self.stop_after, self.run = stop_after, run
        self.done: list[int] = []

    def __call__(self, study: Study, tasks: Sequence[Task]) -> Generator[FinishedRun]:
        for task in reversed(tasks):  # any order
            if len(self.done) == self.stop_after:
                raise KeyboardInterrupt
            yield perform_task(self.run, study, task)
            self.done.append(task.index)


def shifted_run(
    study: Study, values: Sequence[float], keep: Path | None, threads: int = 1
) -> RunResult:
    """Return other numbers than quick runs do."""
    return quick_run(study, [value + 1.0 for value in values], keep)


def sweep(
    folder: Path, engine: Engine | None = None, study: Study = STUDY, **options: bool
) -> Sweep:
    return run_sweep(study, folder, engine or Serial(), **options)


def journal_lines(folder: Path) -> list[bytes]:
    return (folder / JOURNAL_NAME).read_bytes().splitlines(keepends=True)


def test_the_folder_of_a_sweep(tmp_path: Path) -> None:
    folder, seen = tmp_path / "new" / "folder", list[SweepProgress]()
    result = run_sweep(STUDY, folder, Serial(), watch=seen.append)
    assert sorted(path.name for path in folder.iterdir()) == sorted(
        [JOURNAL_NAME, STUDY_NAME, TABLE_NAME, LOCK_NAME]
    )
    assert (folder / STUDY_NAME).read_text() == STUDY.text
    assert len(journal_lines(folder)) == 1 + len(VALUES)
    assert [row.outcome for row in result.rows] == ["done"] * 2 + ["program error"] + ["done"] * 2
    assert (result.failed, result.kept, result.points.tolist()) == (1, 0, [[v] for v in VALUES])
    assert [(each.finished, each.total) for each in seen] == [(k, 5) for k in range(6)]
    assert [each.latest and each.latest.index for each in seen] == [None, 4, 3, 2, 1, 0]


@pytest.mark.parametrize("done", range(len(VALUES) + 1))
def test_an_interrupted_sweep_continues(tmp_path: Path, done: int) -> None:
    whole = tmp_path / "whole"
    sweep(whole)
    first, second = Serial(done), Serial()
    if done < len(VALUES):
        with pytest.raises(KeyboardInterrupt):
            sweep(tmp_path / "cut", first)
        assert not (tmp_path / "cut" / TABLE_NAME).exists()
    else:
        sweep(tmp_path / "cut", first)
    result = sweep(tmp_path / "cut", second)
    assert sorted(first.done + second.done) == list(range(len(VALUES)))
    assert result.kept == done
    assert (tmp_path / "cut" / TABLE_NAME).read_bytes() == (whole / TABLE_NAME).read_bytes()


def test_a_torn_line_is_cut_and_a_damaged_one_repeated(tmp_path: Path) -> None:
    sweep(tmp_path)
    table = (tmp_path / TABLE_NAME).read_bytes()
    header, first, second, *rest, last = journal_lines(tmp_path)
    damaged = second.replace(b"0.13", b"0.14")
    assert damaged != second
    (tmp_path / JOURNAL_NAME).write_bytes(b"".join([header, first, damaged, *rest, last[:-5]]))
    engine = Serial()
    result = sweep(tmp_path, engine)
    assert sorted(engine.done) == [0, 2, 3]  # the last, the second of the first sweep, the failed
    assert [each.message for each in result.warnings] == [
        f"`{tmp_path / JOURNAL_NAME}`: line 3 is damaged and does not count"
    ]
    assert (tmp_path / TABLE_NAME).read_bytes() == table


def test_two_lines_of_a_run_are_damage_where_they_differ(tmp_path: Path) -> None:
    """A line that another sweep of the same study has written is sound by itself."""
    sweep(tmp_path / "one")
    sweep(tmp_path / "two", Serial(run=shifted_run))
    ones, twos = journal_lines(tmp_path / "one"), journal_lines(tmp_path / "two")
    table = (tmp_path / "one" / TABLE_NAME).read_bytes()
    (tmp_path / "one" / JOURNAL_NAME).write_bytes(b"".join([*ones, ones[2], twos[1]]))
    engine = Serial()
    result = sweep(tmp_path / "one", engine)
    assert sorted(engine.done) == [FAULTY_RUN, 4]
    assert [each.message.split(":")[-1] for each in result.warnings] == [
        " line 8 is damaged and does not count"
    ]
    assert (tmp_path / "one" / TABLE_NAME).read_bytes() == table
    engine = Serial()
    assert sweep(tmp_path / "one", engine).warnings == ()
    assert engine.done == []


def test_a_damaged_first_line_costs_no_run(tmp_path: Path) -> None:
    sweep(tmp_path)
    table = (tmp_path / TABLE_NAME).read_bytes()
    header, *lines = journal_lines(tmp_path)
    (tmp_path / JOURNAL_NAME).write_bytes(b"".join([header.replace(b"study", b"stuff"), *lines]))
    engine = Serial()
    result = sweep(tmp_path, engine)
    assert engine.done == [FAULTY_RUN]
    assert [each.message.split(":")[-1] for each in result.warnings] == [
        " line 1 is damaged and does not count"
    ]
    assert (tmp_path / TABLE_NAME).read_bytes() == table
    with pytest.raises(UsageError, match="does not begin as a journal"):
        sweep(tmp_path, study=list_study(0.7))


def test_a_journal_without_checksums_is_refused(tmp_path: Path) -> None:
    sweep(tmp_path)
    lines = [re.sub(rb', "crc32": "[0-9a-f]{8}"', b"", line) for line in journal_lines(tmp_path)]
    (tmp_path / JOURNAL_NAME).write_bytes(b"".join(lines))
    with pytest.raises(
        UsageError, match="does not begin as a journal of runs: choose another folder"
    ):
        sweep(tmp_path)


def test_each_damage_to_a_journal_is_seen(tmp_path: Path) -> None:
    found = Counter(consequence for _, consequence in damage_journals(tmp_path, 200))
    assert found[WARNED] + found[REPEATED] == 200


def killed_from_outside(study: Study, tasks: Sequence[Task]) -> Generator[FinishedRun]:
    """Carry out the first task; the processes of the others die."""
    yield perform_task(quick_run, study, tasks[0])
    yield from (died_run(study, task) for task in tasks[1:])


def test_a_run_that_died_is_tried_again_in_the_next_sweep(tmp_path: Path) -> None:
    """One that kills its process each time ends as a row in each sweep."""
    study = list_study(0.1, 0.2, POISON)
    result = sweep(tmp_path, killed_from_outside, study, keep_motions=True)
    assert [row.outcome for row in result.rows] == ["done", DIED, DIED]
    engine = partial(run_locally, jobs=1, run=quick_run)
    for tries in (2, 4):
        result = sweep(tmp_path, engine, study, keep_motions=True)
        assert [row.outcome for row in result.rows] == ["done", "done", DIED]
        assert result.warnings == ()
        assert len(motion_path(tmp_path, 2, 3).read_text().split()) == tries
    assert len(motion_path(tmp_path, 1, 3).read_text().split()) == 1


def test_failed_runs_are_repeated_on_demand(tmp_path: Path) -> None:
    sweep(tmp_path)
    engine = Serial()
    sweep(tmp_path, engine)
    assert engine.done == []
    sweep(tmp_path, engine, again_failed=True)
    assert engine.done == [VALUES.index(FAULTY)]


def test_runs_whose_motions_are_missing_are_repeated(tmp_path: Path) -> None:
    sweep(tmp_path)
    engine = Serial()
    sweep(tmp_path, engine, keep_motions=True)
    assert sorted(engine.done) == [0, 1, 3, 4]  # a run that failed has no motion
    motion_path(tmp_path, 3, len(VALUES)).unlink()
    engine = Serial()
    sweep(tmp_path, engine, keep_motions=True)
    assert engine.done == [3]
    assert motion_path(tmp_path, 3, 10) == tmp_path / "motions" / "00003.npz"
    assert motion_path(tmp_path, 3, 10**6 + 1).name == "0000003.npz"


def test_the_text_of_the_study_is_renewed(tmp_path: Path) -> None:
    sweep(tmp_path)
    engine = Serial()
    sweep(tmp_path, engine, replace(STUDY, text="# a remark\n"))
    assert engine.done == []
    assert (tmp_path / STUDY_NAME).read_text() == "# a remark\n"


def test_another_study_in_the_folder_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    sweep(tmp_path)
    before = journal_lines(tmp_path)
    changed = replace(STUDY, plan=replace(STUDY.plan, stop=0.4))
    with pytest.raises(UsageError, match=r"5 runs of another study.*: choose another folder"):
        sweep(tmp_path, study=changed)
    with monkeypatch.context() as patch:
        patch.setattr("generator.study.sweep.installed_versions", lambda: Versions("1", "0.1"))
        with pytest.raises(UsageError, match=r"and this is .* and Exudyn 0\.1: choose another"):
            sweep(tmp_path)
    assert journal_lines(tmp_path) == before
    (tmp_path / JOURNAL_NAME).write_bytes(b"no journal\n")
    with pytest.raises(UsageError, match="does not begin as a journal"):
        sweep(tmp_path)


@pytest.mark.parametrize("name", [STUDY_NAME, TABLE_NAME])
def test_files_of_the_user_are_not_replaced(tmp_path: Path, name: str) -> None:
    (tmp_path / name).write_text("mine")
    with pytest.raises(UsageError, match=rf"has a file `{name}` and no journal"):
        sweep(tmp_path)
    assert (tmp_path / name).read_text() == "mine"


def test_a_second_sweep_in_the_folder_is_refused(tmp_path: Path) -> None:
    with lock_folder(tmp_path), pytest.raises(UsageError, match="Another sweep is running"):
        sweep(tmp_path)
    sweep(tmp_path)


def test_what_cannot_be_written_is_a_sentence(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(InputError, match=r"file` cannot be created"):
        sweep(tmp_path / "file")
    (tmp_path / TABLE_NAME).mkdir()
    (tmp_path / "other").mkdir()

    def full_disk(study: Study, tasks: Sequence[Task]) -> Generator[FinishedRun]:
        yield perform_task(quick_run, study, tasks[0])
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    with pytest.raises(InputError, match=r"motions` cannot be written: no space left") as caught:
        sweep(tmp_path / "other", full_disk, keep_motions=True)
    assert "the same command continues" in str(caught.value)
    assert sweep(tmp_path / "other").kept == 1


def test_the_table_of_two_processes_is_that_of_this_one(tmp_path: Path) -> None:
    """The last run, which kills its process, adds one row."""
    sweep(tmp_path / "one", study=list_study(*VALUES, 0.8))
    engine = partial(run_locally, jobs=2, run=quick_run)
    sweep(tmp_path / "two", engine, list_study(*VALUES, 0.8, POISON))
    one, two = ((tmp_path / name / TABLE_NAME).read_bytes() for name in ("one", "two"))
    assert two.startswith(one)
    (last,) = two.removeprefix(one).splitlines()
    assert last.startswith(f"{len(VALUES) + 1},{POISON},,,died,".encode())


FLOOR_STUDY = """
figure = "pendulum.fig"
stop = 0.1
floor = true
self_contact = true
height = 0.5
[design]
kind = "grid"
[parameters]
g = { path = "gravity", low = 0.9, high = 1.1, points = 4 }
[measures]
height = { column = "centre_of_mass_height [cm]", take = "last" }
"""


@pytest.mark.parametrize("engine", [partial(run_locally, jobs=1), Serial(run=run_case)])
def test_a_psurf_that_is_edited_during_a_sweep_has_no_effect(
    tmp_path: Path, engine: Engine
) -> None:
    for name in ("pendulum.fig", "floor.pss", "link1.pss"):
        (tmp_path / name).write_bytes((FIGURES / name).read_bytes())
    study = parse_study_text(FLOOR_STUDY, tmp_path).require_value()
    whole = sweep(tmp_path / "whole", Serial(run=run_case), study)
    psurf = tmp_path / "link1.pss"

    def edit(progress: SweepProgress) -> None:
        if progress.finished < 2:
            psurf.write_text(psurf.read_text().replace("-3.000", "-9.000"))
        else:
            psurf.unlink(missing_ok=True)

    run_sweep(study, tmp_path / "edited", engine, watch=edit)
    tables = [(tmp_path / name / TABLE_NAME).read_bytes() for name in ("whole", "edited")]
    assert tables[0] == tables[1]
    assert whole.failed == 0
    with pytest.raises(UsageError, match="of this one before it was changed"):
        sweep(tmp_path / "edited", engine, study)


RECORD_OPENED_FILES = """
import sys
from pathlib import Path
import generator.study.run_case as cases
from generator.study.study_file import read_study
from generator.study.sweep import run_sweep
from generator.study.worker_pool import perform_task

folder = Path(sys.argv[1])
opened = []

def engine(study, tasks):
    for task in tasks:
        opened.clear()
        yield perform_task(cases.run_case, study, task)
        for path in opened:
            if path.startswith(str(folder)) and "motions" not in path:
                print(path)

sys.addaudithook(lambda event, args: event == "open" and opened.append(str(args[0])))
study = read_study(folder / "floor.study.toml")
sweep = run_sweep(study, folder / "runs", engine, keep_motions=True)
print(sweep.failed, "failed")
"""


def test_no_run_opens_a_file_of_the_study(tmp_path: Path) -> None:
    for name in ("pendulum.fig", "floor.pss", "link1.pss", "seat.scene.toml"):
        (tmp_path / name).write_bytes((FIGURES / name).read_bytes())
    (tmp_path / "points.csv").write_text("g\n0.9\n1.0\n")
    text = FLOOR_STUDY.replace('"grid"', '"list"\nfile = "points.csv"')
    text = text.replace(", low = 0.9, high = 1.1, points = 4", "")
    text = text.replace("floor = true", 'scene = "seat.scene.toml"')
    (tmp_path / "floor.study.toml").write_text(text)
    printed = subprocess.run(
        [sys.executable, "-c", RECORD_OPENED_FILES, str(tmp_path)],
        env=ENVIRONMENT,
        capture_output=True,
        text=True,
        check=True,
    )
    assert printed.stdout.splitlines() == ["0 failed"]


def test_a_finished_folder_needs_no_engine(tmp_path: Path) -> None:
    first = sweep(tmp_path)
    again = run_sweep(STUDY, str(tmp_path))
    assert (again.rows, again.kept) == (first.rows, len(VALUES))


@pytest.mark.parametrize("left", [b"", b"\0" * 100, b'{"study": "ab'])
def test_a_journal_without_a_line_is_begun_again(tmp_path: Path, left: bytes) -> None:
    sweep(tmp_path)
    table = (tmp_path / TABLE_NAME).read_bytes()
    (tmp_path / JOURNAL_NAME).write_bytes(left)
    with pytest.raises(UsageError, match=rf"has a file `{TABLE_NAME}` and no journal"):
        sweep(tmp_path)
    (tmp_path / TABLE_NAME).unlink()
    sweep(tmp_path)
    assert (tmp_path / TABLE_NAME).read_bytes() == table
    assert len(journal_lines(tmp_path)) == 1 + len(VALUES)


def test_another_study_takes_a_folder_without_runs(tmp_path: Path) -> None:
    with pytest.raises(KeyboardInterrupt):
        sweep(tmp_path, Serial(stop_after=0))
    sweep(tmp_path, study=list_study(0.7))
    assert len(journal_lines(tmp_path)) == 2
    assert sweep(tmp_path, study=list_study(0.7)).kept == 1


def computed(study: Study, tasks: Sequence[Task]) -> Generator[FinishedRun]:
    """Compute rows without a simulation."""
    for task in tasks:
        (value,) = task.values
        result = RunResult("done", "", {"swing": value / 3.0, "end": value * value})
        yield FinishedRun(task.index, result, 0.01)


@pytest.mark.slow
def test_many_runs_take_little_memory(tmp_path: Path) -> None:
    """A sweep, its continuation and the table have no object for each run at a time."""
    count, base = 10_000, list_study()
    bare = [replace(segment, psurf=None) for segment in base.model.figure.segments.values()]
    study = replace(
        base,
        model=replace(
            base.model, figure=base.model.figure.with_parts(*bare)
        ),  # a buffer for the file of a psurf has 32 MB
        parameters={"g": Parameter("g", ("gravity",), Uniform(0.8, 1.2))},
        design=Design(DesignKind.LATIN_HYPERCUBE, count, seed=7),
    )
    sweep(tmp_path / "few", computed, list_study(0.1, 0.2))  # what imports take does not count
    design_points(study)
    tracemalloc.start()
    try:
        first = sweep(tmp_path / "many", computed, study)
        again = sweep(tmp_path / "many", computed, study)
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert again.rows == first.rows
    assert again.kept == count
    assert peak < 250 * count


def test_a_sweep_shows_its_outcomes_and_measures(tmp_path: Path) -> None:
    page = sweep(tmp_path)._repr_html_()
    good = [value for value in VALUES if value != FAULTY]
    assert "5 runs of pendulum: 4 done, 1 program error" in page
    cells = (f"{end(good) / 3.0:.5g}" for end in (min, np.median, max))
    assert f"<td>swing</td><td>{'</td><td>'.join(cells)}</td><td>4</td>" in page
