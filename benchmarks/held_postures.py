"""Time and memory of many postures with loads.

    python -m benchmarks.held_postures [COUNT]
    python -m benchmarks.held_postures COUNT --study

The second command makes them the runs of one study, with two processes.
"""

import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from generator import Holder, Model, read_figure
from generator.hold.statics import Load
from generator.kinematics.placement import initial_displacements

STUDY = """
figure = "male50"
[design]
kind = "latin-hypercube"
runs = {count}
[parameters]
age = {{ path = "hold.age", values = [20, 60, 70] }}
box = {{ path = "load.hand", low = 0, high = 15 }}
lean = {{ path = "pose.waist.3", low = 0, high = 40 }}
raise = {{ path = "pose.shoulder.3", low = 0, high = 90 }}
bend = {{ path = "pose.elbow.2", low = 0, high = 120 }}
[measures]
use = {{ column = "hold.use [1]", take = "start" }}
capable = {{ column = "hold.percent_capable [%]", take = "start" }}
disc = {{ column = "hold.compression [N]", take = "start" }}
margin = {{ column = "hold.margin [cm]", take = "start" }}
"""


def processes(number: int) -> Iterator[int]:
    """Yield a process and those that it started."""
    yield number
    try:
        for thread in Path(f"/proc/{number}/task").iterdir():
            for child in (thread / "children").read_text().split():
                yield from processes(int(child))
    except OSError:
        return


def memory(number: int) -> float:
    """Return the resident memory of a process and those that it started [MB]."""
    found = 0.0
    for each in processes(number):
        try:
            pages = int(Path(f"/proc/{each}/statm").read_text().split()[1])
        except OSError:
            continue
        found += pages * resource.getpagesize() / 2**20
    return found


def run_study(count: int) -> None:
    """Run the postures as a study, and print time and memory."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        study, journal = folder / "many.study.toml", folder / "out" / "runs.jsonl"
        study.write_text(STUDY.format(count=count), encoding="utf-8")
        words = ["sweep", str(study), "-o", str(journal.parent), "--jobs", "2"]
        began, early, peak = time.monotonic(), 0.0, 0.0
        sweep = subprocess.Popen([sys.executable, "-m", "generator.cli", *words])
        while sweep.poll() is None:
            time.sleep(1.0)
            peak = max(peak, memory(sweep.pid))
            if not early and journal.exists() and journal.stat().st_size > 20 * count:
                early = peak  # a line has some 200 bytes
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    print(
        f"{count} postures as one study: {time.monotonic() - began:.0f} s, "
        f"{1e3 * (used.ru_utime + used.ru_stime) / count:.1f} ms of a core each, "
        f"{peak:.0f} MB in all processes at most, {early:.0f} MB after a tenth"
    )


def main() -> None:
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 2000
    if "--study" in sys.argv:
        run_study(count)
        return
    holder, random = Holder.of(Model.of(read_figure("male50"))), np.random.default_rng(1)
    start = initial_displacements(holder.tree)
    sizes = {name: 0.0 if name == "neck" else 0.2 for name in start}
    before, uses = 0, np.zeros(count)
    began = time.process_time()
    for k in range(count):
        pose = {
            name: row + random.uniform(-1, 1, len(row)) * sizes[name] for name, row in start.items()
        }
        load = Load("right_hand", float(random.uniform(0.0, 20.0)))
        uses[k] = holder.posture(pose, [load], must_balance=False).largest_use
        if k == count // 10:
            before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    seconds = time.process_time() - began
    grown = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) / 1024.0
    print(
        f"{count} postures: {1e3 * seconds / count:.1f} ms of a core each, "
        f"memory grows by {grown:.1f} MB"
    )
    print(f"median of the largest uses: {np.median(uses):.3f}")


if __name__ == "__main__":
    main()
