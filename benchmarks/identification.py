"""Springs found from synthetic swings: counts of true values inside intervals, and wrong models.

    python -m benchmarks.identification [--sets N] [--first N] [--jobs N]

Each data set is a swing of the figure `leg` in MuJoCo (`benchmarks.swinging_leg`) with its own true
values and its own white noise, 6 s at 50 samples a second. The leg is held until a release between
samples. Scale, offset and viscous damping are fitted as `mover identify` does. Then models that are
wrong in a known way are fitted: the doubts about them are counted.
"""

import argparse
import sys
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from multiprocessing import get_context

import numpy as np

from benchmarks import tables
from benchmarks.swinging_leg import (
    FIGURE,
    JOINT,
    NOISE,
    Truth,
    add_noise,
    swing_in_mujoco,
)
from generator import Figure, Plan, model, read_figure, read_springs
from generator.identification.doubts import fit_doubts
from generator.identification.fit import Estimate, Fit, FitOptions, fit_springs
from generator.identification.measured_angles import MeasuredAngles
from generator.simulation.preconditions import import_exudyn
from generator.study.parameter_paths import Case, parse_path
from springs import Linear, SpringSet

COMMAND = "python -m benchmarks.identification"

STOP = 6.0
"""End of the swings [s]."""

SEED = 20_000
"""Of the first data set."""

RANGES = {"scale": (0.6, 1.8), "offset_deg": (-8.0, 8.0), "viscous_Nms_rad": (0.15, 0.6)}
"""Ends of the uniform distributions of the true values."""

START_RANGE = (0.0, 10.0)
"""Ends of that of the angle of the release [deg]."""

LATEST_RELEASE = 0.3
"""End of the uniform distribution of the time of the release, in whole milliseconds [s]."""

WRONG_SETS = 5
"""Number of data sets of each wrong model."""

MASS_ERROR = -0.08
"""Relative error of the mass of the shank."""

COARSE_STEP = 0.02
"""[s]"""

FRICTION = 0.4
"""Coulomb friction of the wrong models without friction [N m]."""

LINEAR_STIFFNESS, LINEAR_REST = 6.0, 1.2
"""Of a linear law in place of the published curve [N m/rad, rad]."""

NAMES = (*RANGES, "start_deg", "release_s")
"""Estimates of a fit, in their order."""

PATHS = tuple(f"springs.{JOINT}.{name}" for name in RANGES)
FRICTION_PATH = f"springs.{JOINT}.coulomb_Nm"

# A tolerance of 1e-4 rad biases no estimate by more than 0.1 sd here, as each fit checks.
OPTIONS = FitOptions(sd=np.radians(NOISE), starts=1, profiles=False, tolerance=1e-4)


@dataclass(frozen=True)
class Model:
    """A model that is fitted.

    Attributes:
        name: in words.
        friction: of the truth [N m].
        mass_factor: of the shank in the model over that in the truth.
        is_linear: whether the elastic law of the model is linear.
        fits_friction: whether friction is fitted too.
        options: of the fit.
    """

    name: str
    friction: float = 0.0
    mass_factor: float = 1.0
    is_linear: bool = False
    fits_friction: bool = False
    options: FitOptions = OPTIONS

    @property
    def paths(self) -> tuple[str, ...]:
        """Quantities that are fitted."""
        return (*PATHS, FRICTION_PATH) if self.fits_friction else PATHS

    def case(self) -> Case:
        """Figure and plan before the fit."""
        figure = read_figure(FIGURE)
        springs = read_springs(None, figure)
        if self.is_linear:
            springs = with_linear_law(springs)
        return Case(model.Model(with_mass(figure, self.mass_factor), springs), Plan())


RIGHT = Model("right model")

WRONG = (
    Model("mass 8 % too small", mass_factor=1.0 + MASS_ERROR),
    Model(f"step of {COARSE_STEP:g} s", options=replace(OPTIONS, tolerance=None, step=COARSE_STEP)),
    Model("linear law", is_linear=True),
    Model("friction left out", friction=FRICTION),
    Model("friction fitted", friction=FRICTION, fits_friction=True),
)


def with_mass(figure: Figure, factor: float) -> Figure:
    """Return the leg with mass and inertia of the shank times a factor."""
    shank = figure.segments["shank"]
    assert shank.mass is not None
    assert shank.inertia is not None
    x, y, z = shank.inertia
    scaled = replace(shank, mass=factor * shank.mass, inertia=(factor * x, factor * y, factor * z))
    return replace(figure, segments={**figure.segments, "shank": scaled})


def with_linear_law(springs: SpringSet) -> SpringSet:
    """Return the springs with a linear law at the knee."""
    (axis,) = springs.joints[JOINT].axes
    linear = replace(axis, elastic=(Linear(LINEAR_STIFFNESS, LINEAR_REST),))
    return replace(springs, joints={JOINT: replace(springs.joints[JOINT], axes=(linear,))})


def draw_truth(number: int) -> tuple[Truth, float, float]:
    """Return the true values of a data set, and angle [deg] and time [s] of its release."""
    rng = np.random.default_rng(SEED + number)
    scale, offset, viscous = (float(rng.uniform(*ends)) for ends in RANGES.values())
    start = float(rng.uniform(*START_RANGE))
    return Truth(scale, offset, viscous), start, round(float(rng.uniform(0.0, LATEST_RELEASE)), 3)


def make_data(truth: Truth, start: float, release: float, number: int) -> MeasuredAngles:
    """Return the noisy angles of a data set."""
    times, angles = swing_in_mujoco(truth, start, STOP, release=release)
    noisy = np.radians(add_noise(angles, [SEED, number]))
    return MeasuredAngles(f"set {number}", times, ((JOINT, 0),), noisy[:, None])


def fit_model(number: int, model: Model) -> Fit:
    """Fit a model to a data set."""
    import_exudyn()
    truth, start, release = draw_truth(number)
    data = make_data(replace(truth, coulomb=model.friction), start, release, number)
    case = model.case()
    paths = [parse_path(text, case) for text in model.paths]
    return fit_springs(case, data, paths, model.options)


def is_inside(estimate: Estimate, value: float) -> bool:
    """Return whether a true value is inside the 95 % interval of its estimate."""
    low, high = estimate.interval
    return low <= value <= high


def coverage_row(number: int) -> dict[str, object]:
    """Fit the right model to a data set: truths, estimates, uncertainties and doubts."""
    fit = fit_model(number, RIGHT)
    truth, *release = draw_truth(number)
    row: dict[str, object] = {"set": number}
    values = (truth.scale, truth.offset, truth.viscous, *release)
    for name, value, estimate in zip(NAMES, values, fit.estimates, strict=True):
        row |= {
            f"{name}: true": value,
            f"{name}: estimate": estimate.value,
            f"{name}: sd": estimate.sd,
            f"{name}: inside": int(is_inside(estimate, value)),
        }
    largest = max(abs(estimate.bias) for estimate in fit.estimates)
    counts = {
        "doubts": len(fit_doubts(replace(fit, tails=()))),
        "doubts of tails": len(fit_doubts(fit)) - len(fit_doubts(replace(fit, tails=()))),
    }
    return {**row, "rms [deg]": float(np.degrees(fit.tests.rms)), "bias": largest, **counts}


def wrong_row(number: int, model: Model) -> dict[str, object]:
    """Fit a wrong model to a data set: errors of the estimates, residuals and doubts."""
    fit = fit_model(number, model)
    truth, *_ = draw_truth(number)
    by_path = {one.path: one for one in fit.estimates}
    scale, offset, viscous = (by_path[path] for path in PATHS)
    doubts = fit_doubts(replace(fit, tails=()))
    return {
        "model": model.name,
        "set": number,
        "scale over truth": scale.value / truth.scale,
        "scale: predicted with the right mass": _with_right_mass(scale, model) / truth.scale,
        "offset less truth [deg]": offset.value - truth.offset,
        "viscous over truth": viscous.value / truth.viscous,
        "error of scale [sd]": (scale.value - truth.scale) / scale.sd,
        "error of viscous [sd]": (viscous.value - truth.viscous) / viscous.sd,
        "friction [N m]": by_path[FRICTION_PATH].value if model.fits_friction else 0.0,
        "rms [deg]": float(np.degrees(fit.tests.rms)),
        "lag one": fit.tests.lag_one,
        "autocorrelated": int(fit.tests.are_autocorrelated),
        "bias [sd]": max(abs(one.bias) for one in fit.estimates),
        "doubts": " / ".join(doubts).replace(",", ";"),
    }


def _with_right_mass(estimate: Estimate, model: Model) -> float:
    """Estimate that the change per mass predicts for the true mass."""
    return estimate.value + (estimate.mass_slope or 0.0) * (1.0 / model.mass_factor - 1.0)


def main(arguments: Sequence[str] | None = None) -> None:
    """Count true values inside intervals, and fit wrong models."""
    parser = argparse.ArgumentParser(prog=COMMAND)
    parser.add_argument("--sets", type=int, default=100, help="Number of data sets.")
    parser.add_argument("--first", type=int, default=0, help="Number of the first data set.")
    parser.add_argument("--jobs", type=int, default=2, help="Number of processes.")
    options = parser.parse_args([] if arguments is None else arguments)
    numbers = range(options.first, options.first + options.sets)
    context = get_context("spawn")
    with ProcessPoolExecutor(options.jobs, mp_context=context) as pool:
        rows = [*_progress(pool.map(coverage_row, numbers), options.sets)]
        _report_coverage(rows)
        wrong: list[dict[str, object]] = []
        for model in WRONG:
            wrong += pool.map(partial(wrong_row, model=model), range(WRONG_SETS))
    tables.show({key: value for key, value in row.items() if key != "doubts"} for row in wrong)
    for model in WRONG:
        print(f"{model.name}: {next(row['doubts'] for row in wrong if row['model'] == model.name)}")


def _progress(rows: Iterator[dict[str, object]], count: int) -> Iterator[dict[str, object]]:
    for done, row in enumerate(rows, start=1):
        errors = ", ".join(f"{_error(row, name):+.2f}" for name in NAMES)
        print(f"{done} of {count}: errors {errors} sd", flush=True)
        yield row


def _report_coverage(rows: Sequence[dict[str, object]]) -> None:
    print(f"true values inside the 95 % intervals, of {len(rows)}:")
    for name in NAMES:
        inside = sum(int(str(row[f"{name}: inside"])) for row in rows)
        errors = np.array([_error(row, name) for row in rows])
        print(f"  {name}: {inside}; errors {errors.mean():+.2f} ± {errors.std(ddof=1):.2f} sd")
    for kind in ("doubts", "doubts of tails"):
        print(f"fits with {kind}: {sum(row[kind] != 0 for row in rows)}")
    print(f"largest bias of the tolerance: {max(float(str(row['bias'])) for row in rows):.2g} sd")


def _error(row: dict[str, object], name: str) -> float:
    """Error of an estimate [sd]."""
    true, estimate, sd = (float(str(row[f"{name}: {key}"])) for key in ("true", "estimate", "sd"))
    return (estimate - true) / sd


if __name__ == "__main__":
    main(sys.argv[1:])
