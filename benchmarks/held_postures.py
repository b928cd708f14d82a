"""Time and memory of many postures with loads: `python -m benchmarks.held_postures [COUNT]`."""

import resource
import sys
import time

import numpy as np

from generator import Holder, Model, read_figure
from generator.hold.statics import Load
from generator.kinematics.placement import initial_displacements


def main() -> None:
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 2000
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
