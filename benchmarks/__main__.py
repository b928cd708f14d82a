"""`python -m benchmarks`: how fast the prototype falls, and what the time goes into."""

import os

from generator.engine.door import open_exudyn


def run() -> None:
    """Measure with Exudyn as the command loads it, on one core."""
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    open_exudyn()
    from benchmarks.prototype import main

    main()


run()
