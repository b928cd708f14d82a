"""`python -m benchmarks [PART ...]`: measure everything, or the parts that are named.

The parts run one after another in one process and in the order below, so that the ratios of one
run are fair. All from `verification` on write what they measured into `plots/data`, where
the plates `verification`, `floor_falls`, `work_precision`, `exported_fall` and
`falls_of_people` find it; `pages`
measures nothing and writes the tables of `docs/`.
"""

import os
import sys
from importlib import import_module

from generator.simulation.preconditions import import_exudyn

PARTS = {
    "prototype": "benchmarks.prototype",
    "posture": "benchmarks.posture",
    "geometry": "benchmarks.geometry",
    "verification": "benchmarks.verification",
    "falls": "benchmarks.falls",
    "work-precision": "benchmarks.work_precision",
    "exports": "benchmarks.exports",
    "chains": "benchmarks.chains",
    "startup": "benchmarks.startup",
    "aims": "benchmarks.aims",
    "contact-cost": "benchmarks.contact_cost",
    "fall-speed": "benchmarks.fall_speed",
    "live-page": "benchmarks.live_page",
    "falls-of-people": "benchmarks.falls_of_people",
    "pages": "benchmarks.pages",
    "python-share": "benchmarks.python_share",
}


def run(names: list[str]) -> None:
    """Measure with Exudyn as the command loads it, on one core."""
    unknown = [name for name in names if name not in PARTS]
    if unknown:
        sys.exit(f"no part is called {', '.join(unknown)}; there are {', '.join(PARTS)}")
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    import_exudyn()
    for name in PARTS:
        if name in names or not names:
            print(f"\n## {name}\n", flush=True)
            try:
                import_module(PARTS[name]).main()
            except ModuleNotFoundError as missing:
                sys.exit(f"the part {name} needs the module {missing.name}, which is not installed")


run(sys.argv[1:])
