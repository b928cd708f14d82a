"""Falls from many starts by the method of studies against tight runs.

    python -m benchmarks.fall_statistics [RUNS [TOLERANCE]]

`male50` falls from a crouch whose joints vary. Each start is run by both methods; two processes
share the work. A tolerance is that of the fast runs only. A measure is shifted by the mean
difference over its standard deviation; the two distributions are compared by the test of
Kolmogorov and Smirnov.
"""

import sys
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace

import numpy as np
from scipy.stats import ks_2samp

from benchmarks import tables
from generator import design_points, run_case
from generator.study.study import RunMethod, RunResult
from generator.study.study_file import STUDY_FILE

RUNS = 200

STUDY = """
figure = "male50"
stop = 2.0
floor = true
height = 0.0

[design]
kind = "latin-hypercube"
runs = {runs}
seed = 1

[parameters]
left_knee = {{ path = "pose.left_knee", mean = 20.0, sd = 8.0 }}
right_knee = {{ path = "pose.right_knee", mean = 20.0, sd = 8.0 }}
waist = {{ path = "pose.waist.1", mean = 10.0, sd = 8.0 }}
bend = {{ path = "pose.waist.2", mean = 0.0, sd = 5.0 }}
neck = {{ path = "pose.neck.1", mean = 0.0, sd = 8.0 }}

[measures]
pelvis_force = {{ column = "lower_torso.contact_force [N]", take = "largest" }}
pelvis_time = {{ column = "lower_torso.contact_force [N]", take = "time of largest" }}
head_force = {{ column = "head.contact_force [N]", take = "largest" }}
head_time = {{ column = "head.contact_force [N]", take = "time of largest" }}
damped_energy = {{ column = "dissipated [J]", take = "last" }}
"""


def run(job: tuple[str, Sequence[float], RunMethod, float | None]) -> RunResult:
    """Run a start by a method, at a tolerance or that of the study."""
    text, values, method, tolerance = job
    study = replace(STUDY_FILE.parse_text(text).require_value(), method=method)
    if tolerance is not None:
        study = replace(study, plan=replace(study.plan, tolerance=tolerance))
    return run_case(study, values, threads=1)


def main() -> None:
    """Print a row for each measure."""
    text = STUDY.format(runs=int(sys.argv[1]) if len(sys.argv) > 1 else RUNS)
    study = STUDY_FILE.parse_text(text).require_value()
    points = [tuple(map(float, row)) for row in design_points(study)]
    tolerance = float(sys.argv[2]) if len(sys.argv) > 2 else None
    with ProcessPoolExecutor(2) as pool:
        fast, tight = (
            list(pool.map(run, [(text, point, method, own) for point in points], chunksize=5))
            for method, own in ((RunMethod.FAST, tolerance), (RunMethod.TIGHT, None))
        )
    rows: list[tables.Row] = []
    for name in study.measures:
        pairs = np.array(
            [
                (a.measures[name], b.measures[name])
                for a, b in zip(fast, tight, strict=True)
                if a.measures.get(name) is not None and b.measures.get(name) is not None
            ],
            dtype=float,
        )
        differences = pairs[:, 0] - pairs[:, 1]
        spread = float(np.std(pairs[:, 1], ddof=1))
        rows.append(
            {
                "measure": name,
                "runs": len(pairs),
                "tight mean": float(np.mean(pairs[:, 1])),
                "sd": spread,
                "shift [sd]": float(np.mean(differences)) / spread,
                "standard error": float(np.std(differences, ddof=1))
                / (spread * np.sqrt(len(pairs))),
                "median difference": float(np.median(np.abs(differences))),
                "KS p": float(ks_2samp(pairs[:, 0], pairs[:, 1]).pvalue),
            }
        )
    tables.show(rows)


if __name__ == "__main__":
    main()
