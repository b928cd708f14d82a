"""`mover sweep`: runs of a pendulum, interrupted and continued, and what is printed of them."""

import csv
import json
import os
import re
import signal
import subprocess
import sys
import threading
import time
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from statistics import median

import pytest
from typer.testing import Result

from generator.cli.progress import sweep_progress_bar
from generator.study.study import RunResult
from generator.study.sweep import SweepProgress
from generator.study.worker_pool import FinishedRun
from tests.command import answer, mover, run
from tests.processes import ENVIRONMENT

STUDY = """\
figure = "pendulum"
stop = 0.05
[design]
kind = "sobol"
runs = 16
seed = 7
[parameters]
pull = { path = "gravity", low = 0.8, high = 1.2 }
stiffness = { path = "springs.shoulder.scale", mean = 0.8, sd = 0.7 }
[measures]
swing = { column = "shoulder.2 [deg]", take = "largest" }
end = { column = "kinetic [J]", take = "last" }
[sensitivity]
resamples = 50
"""


@dataclass(frozen=True)
class Swept:
    """A study that was interrupted and continued."""

    words: tuple[str, ...]
    folder: Path
    interrupted: Result
    continued: Result

    @property
    def rows(self) -> list[dict[str, str]]:
        """Rows of the table."""
        with open(self.folder / "runs.csv", encoding="utf-8") as file:
            return list(csv.DictReader(file))

    @property
    def done(self) -> list[dict[str, str]]:
        """Rows of the runs that did not fail."""
        return [row for row in self.rows if row["outcome"] == "done"]


def interrupt_after(journal: Path, lines: int) -> None:
    """Send Ctrl-C to this process when a journal has some lines."""
    for _ in range(6000):
        if journal.exists() and journal.read_bytes().count(b"\n") >= lines:
            os.kill(os.getpid(), signal.SIGINT)
            return
        time.sleep(0.01)


@pytest.fixture(scope="module")
def swept(tmp_path_factory: pytest.TempPathFactory) -> Swept:
    base = tmp_path_factory.mktemp("sweep")
    study, folder = base / "swing.study.toml", base / "swings"
    study.write_text(STUDY)
    words = ("sweep", str(study), "-o", str(folder), "--jobs", "1", "--keep", "motions")
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    thread = threading.Thread(target=interrupt_after, args=(folder / "runs.jsonl", 4))
    thread.start()
    interrupted = mover(*words, "--json")
    thread.join()
    signal.signal(signal.SIGINT, before)
    return Swept(words, folder, interrupted, mover(*words, "--table", base / "copy.csv"))


def test_after_an_interrupt_the_runs_are_kept(swept: Swept) -> None:
    data = json.loads(swept.interrupted.stdout)
    assert swept.interrupted.exit_code == 3
    assert 3 <= data["finished"] < data["runs"] == 64
    assert data["error"].endswith("the same command continues")
    assert f"{data['finished']} of them finished before" in swept.continued.stdout


def test_the_report_fits_a_screen(swept: Swept) -> None:
    lines = swept.continued.stdout.splitlines()
    failed = len(swept.rows) - len(swept.done)
    assert lines[0].endswith(
        f"swing.study.toml: 64 runs of pendulum: {64 - failed} done, {failed} wrong input"
    )
    assert any(line.startswith("wrong input, first in run ") for line in lines)
    assert any(line.startswith("sensitivity of swing, 95 % intervals") for line in lines)
    assert len(lines) < 40
    assert max(map(len, lines)) < 200
    assert f"error: {failed} of 64 runs failed; --again failed repeats them" in (
        swept.continued.stderr
    )
    assert swept.continued.exit_code == 3


def test_the_measures_are_those_of_the_table(swept: Swept) -> None:
    data = json.loads(mover(*swept.words, "--json").stdout)
    assert list(swept.rows[0]) == [
        "run", "pull", "stiffness", "swing", "end", "outcome", "message"
    ]  # fmt: skip
    assert data["finished_before"] == data["runs"] == 64
    assert data["failed"] == sum(float(row["stiffness"]) < 0.0 for row in swept.rows) > 0
    for name in ("swing", "end"):
        values = [float(row[name]) for row in swept.done]
        assert data["measures"][name] == {
            "smallest": min(values),
            "median": median(values),
            "largest": max(values),
            "runs": len(swept.done),
        }
    assert set(data["sensitivity"]["swing"]["indices"]) == {"pull", "stiffness"}


def test_the_files_of_a_sweep(swept: Swept) -> None:
    motions = sorted((swept.folder / "motions").iterdir())
    assert [path.name for path in motions] == [f"{int(row['run']):05}.npz" for row in swept.done]
    assert (swept.folder.parent / "copy.csv").read_bytes() == (
        swept.folder / "runs.csv"
    ).read_bytes()
    assert (swept.folder / "study.toml").read_text() == STUDY
    assert json.loads((swept.folder / "sensitivity.json").read_text())["design"] == "sobol"


def test_failed_runs_are_repeated_when_asked_for(swept: Swept) -> None:
    data = json.loads(mover(*swept.words, "--again", "failed", "--json").stdout)
    assert data["finished_before"] == data["runs"] - data["failed"]


def test_dry_run_times_one_run_and_writes_nothing(tmp_path: Path) -> None:
    study = tmp_path / "swing.study.toml"
    study.write_text(STUDY)
    data = answer("sweep", study, "--dry-run", "--jobs", 3)
    assert data["runs"] == 64
    assert data["estimate_s"] == pytest.approx(64 * data["run_s"] / 3)
    pull = data["parameters"][0]
    assert (pull["name"], pull["paths"], pull["unit"]) == ("pull", ["gravity"], "")
    assert 0.8 <= pull["smallest"] < pull["largest"] <= 1.2
    assert [one["name"] for one in data["measures"]] == ["swing", "end"]
    text = run("sweep", study, "--dry-run", "--jobs", 1).stdout
    assert "springs.shoulder.scale" in text
    assert "in 1 process." in text
    assert list(tmp_path.iterdir()) == [study]


def test_trajectories_tell_the_range_that_they_cover(tmp_path: Path) -> None:
    study = tmp_path / "swing.study.toml"
    stated = 'kind = "morris"\nruns = 8\n'
    study.write_text(re.sub(r"kind = .*\nruns = .*\n", stated, STUDY), "utf-8")
    pull = answer("sweep", study, "--dry-run")["parameters"][0]
    assert pull["stated"] == [0.8, 1.2]
    assert [pull["smallest"], pull["largest"]] == pytest.approx([0.85, 1.15])
    text = run("sweep", study, "--dry-run").stdout
    assert re.search(r"^pull .* 0\.85 +1\.15 +0\.8 to 1\.2$", text, re.MULTILINE)
    assert "four levels of a parameter, at 1/8, 3/8, 5/8 and 7/8 of its range" in text


def test_dry_run_of_a_first_run_that_fails(tmp_path: Path) -> None:
    study = tmp_path / "soft.study.toml"
    text = STUDY.partition("[sensitivity]")[0].replace("sobol", "latin-hypercube")
    text = text.replace("seed = 7", "seed = 9")  # whose first point has a negative stiffness
    study.write_text(text.replace("mean = 0.8, sd = 0.7", "mean = 0.1, sd = 30.0"))
    result = mover("sweep", study, "--dry-run", "--json")
    data = json.loads(result.stdout)
    assert result.exit_code == 3
    assert (data["outcome"], data["run_s"]) == ("wrong input", None)
    assert "error: the first run failed, wrong input: `springs.shoulder.scale`" in result.stderr


def test_the_bar_shows_runs_rate_and_failures(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("FORCE_COLOR", "1")
    monkeypatch.setenv("COLUMNS", "100")
    outcomes = ("done", "wrong input", "done")
    with sweep_progress_bar(8) as update:
        update(SweepProgress(2, 8))
        for number, outcome in enumerate(outcomes, 3):
            run = FinishedRun(number - 1, RunResult(outcome, "", {}), 0.1)
            update(SweepProgress(number, 8, run))
    shown = re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", capsys.readouterr().err)
    assert "5 of 8 runs" in shown
    assert "runs/s" in shown
    assert "1 failed" in shown


def test_the_table_does_not_replace_the_list_of_the_study(tmp_path: Path) -> None:
    study, points = tmp_path / "list.study.toml", tmp_path / "points.csv"
    text = STUDY.replace(
        'kind = "sobol"\nruns = 16\nseed = 7', 'kind = "list"\nfile = "points.csv"'
    )
    study.write_text(text.partition("[sensitivity]")[0])
    points.write_text("pull,stiffness\n1,1\n")
    result = mover("sweep", str(study), "-o", str(tmp_path / "out"), "--table", str(points))
    assert result.exit_code == 1
    assert "points.csv` cannot be written: the study reads it" in result.stderr
    assert points.read_text() == "pull,stiffness\n1,1\n"
    assert not (tmp_path / "out").exists()


LEADING_PROCESS = """
import sys
from generator.cli.app import main
try:
    main()
finally:
    print(sorted({"numba", "generator.simulation.compiled_run"} & sys.modules.keys()))
"""


@pytest.mark.slow
def test_the_leading_process_does_not_load_the_compiled_integrator(tmp_path: Path) -> None:
    """It takes 200 MB, and the processes of the runs load it."""
    import_module("generator.simulation.compiled_run")  # which compiles it
    (tmp_path / "swing.study.toml").write_text(STUDY.replace("runs = 16", "runs = 8"))
    words = ["sweep", str(tmp_path / "swing.study.toml"), "-o", str(tmp_path / "runs")]
    printed = subprocess.run(
        [sys.executable, "-c", LEADING_PROCESS, *words, "--jobs", "1"],
        env=ENVIRONMENT,
        capture_output=True,
        text=True,
    ).stdout
    assert "32 runs of pendulum" in printed
    assert printed.splitlines()[-1] == "[]"
