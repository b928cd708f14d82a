"""Kills of a sweep whose psurf is edited meanwhile: are all rows of one body?

    python -m benchmarks.edited_psurf

A pendulum begins at a height above the floor that follows from its psurf, in each of many runs of
`mover sweep`. Fifteen times a process of the runs is killed and five times the leading one, at
random moments, and before every second kill the psurf is edited. A sweep that is started with an
edited psurf must refuse the folder; it is started again with the psurf as it was. The table at the
end must have the bytes of an undisturbed sweep.
"""

import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

from benchmarks.sweeps import children
from generator.figure_file.read import FIGURE_FILE
from generator.study.journal import JOURNAL_NAME
from generator.study.sweep import TABLE_NAME

RUNS, WORKER_KILLS, PARENT_KILLS = 1200, 15, 5

_STUDY = f"""
figure = "pendulum.fig"
stop = 0.2
floor = true
self_contact = true
height = 0.5
[design]
kind = "latin-hypercube"
runs = {RUNS}
[parameters]
g = {{ path = "gravity", low = 0.9, high = 1.1 }}
[measures]
height = {{ column = "centre_of_mass_height [cm]", take = "last" }}
"""

_PSURF = "link1.pss"
_REFUSAL = "of this one before it was changed"


def main() -> None:
    """Print what happened, and fail if the tables differ."""
    with tempfile.TemporaryDirectory() as name:
        base = Path(name)
        shipped = FIGURE_FILE.shipped()["pendulum"].parent
        for file in ("pendulum.fig", "floor.pss", _PSURF):
            shutil.copy(shipped / file, base)
        (base / "fall.study.toml").write_text(_STUDY)
        _start(base, "whole").wait()
        counts = _disturb(base, random.Random(1))
        tables = [(base / folder / TABLE_NAME).read_bytes() for folder in ("whole", "disturbed")]
    print(", ".join(f"{count} {event}" for event, count in counts.items()))
    rows = tables[1].count(b"\n") - 1
    print(f"{rows} rows, {'equal' if tables[0] == tables[1] else 'DIFFERENT'}")
    sys.exit(tables[0] != tables[1] or rows != RUNS)


def _start(base: Path, folder: str) -> subprocess.Popen[str]:
    program = "from generator.cli.app import main; main()"
    words = [sys.executable, "-c", program, "sweep", "fall.study.toml", "-o", folder]
    return subprocess.Popen(
        [*words, "--jobs", "2"],
        cwd=base,
        env={**os.environ, "PYTHONPATH": str(Path(__file__).parents[1])},
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
    )


def _disturb(base: Path, moments: random.Random) -> Counter[str]:
    """Kill and edit until the sweep is finished, and return how often each event was seen."""
    psurf, original = base / _PSURF, (base / _PSURF).read_text()
    kills = ["worker"] * WORKER_KILLS + ["leading process"] * PARENT_KILLS
    moments.shuffle(kills)
    counts: Counter[str] = Counter()
    journal = base / "disturbed" / JOURNAL_NAME
    process = _start(base, "disturbed")
    for number, kill in enumerate(kills):
        until = RUNS * (number + moments.random()) / (len(kills) + 1)
        while process.poll() is None and _lines(journal) < until:
            time.sleep(0.01)
        if number % 2:
            width = moments.choice(["-9.000", "-20.000", "-50.000"])
            psurf.write_text(original.replace("-3.000", width))
            counts["edits"] += 1
        if kill == "worker":
            workers = children(process.pid)
            if workers:
                os.kill(moments.choice(workers), signal.SIGKILL)
                counts["processes of runs killed"] += 1
            continue
        process.kill()
        process.communicate()
        counts["leading processes killed"] += 1
        process = _restart(base, counts, original)
    _, message = process.communicate()
    if process.returncode:
        sys.exit(f"the sweep ended with {process.returncode}: {message}")
    return counts


def _restart(base: Path, counts: Counter[str], original: str) -> subprocess.Popen[str]:
    """Start the sweep again; with an edited psurf it must refuse the folder."""
    psurf = base / _PSURF
    if psurf.read_text() != original:
        process = _start(base, "disturbed")
        _, message = process.communicate()
        if process.returncode != 2 or _REFUSAL not in message:
            sys.exit(f"a sweep with an edited psurf ended with {process.returncode}: {message}")
        counts["refusals of an edited psurf"] += 1
        psurf.write_text(original)
    return _start(base, "disturbed")


def _lines(journal: Path) -> int:
    return journal.read_bytes().count(b"\n") if journal.exists() else 0


if __name__ == "__main__":
    main()
