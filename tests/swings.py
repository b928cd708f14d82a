"""A shank that swings about a knee at rest, and its angles with noise."""

from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np

from generator.figure_file.read import FIGURE_FILE
from generator.identification.fit import Fit, FitOptions, fit_springs
from generator.identification.measured_angles import MeasuredAngles
from generator.model import Model
from generator.simulation.plan import Plan
from generator.simulation.run import simulate
from generator.study.parameter_paths import Case, parse_path
from generator.study.parameters import apply_values

FIGURE = """
figure leg {
  segment thigh {
    mass = -1kg;
    site base->location = trans(0,0,0);
    site knee->location = trans(0m,1m,0m);
  }
  segment shank {
    mass = 4.575kg;
    inertia = (0.12 kg m2,0.12 kg m2,0.01 kg m2);
    site knee->location = trans(0,0,0);
    site CM->location = trans(0cm,-26.1cm,0cm);
  }
  joint left_knee {
    connect thigh.knee to shank.knee;
    type = R(0,0,1);
    displacement = (50deg);
  }
  root = thigh.base;
}
"""

SPRINGS = """
figure = "leg"

[[spring]]
joints = ["left_knee"]
axis = "joint"
motion = "flexion"
points_deg_Nm = [[-60, 12.0], [-20, 3.0], [0, 0.5], [40, -2.0], [80, -9.0]]
viscous_Nms_rad = 0.3
reference = "invented"
"""

SCALE, OFFSET, VISCOUS, COULOMB = (
    f"springs.left_knee.{word}" for word in ("scale", "offset_deg", "viscous_Nms_rad", "coulomb_Nm")
)

TRUTH: Mapping[str, float] = {SCALE: 1.3, OFFSET: -4.0, VISCOUS: 0.35}

NOISE = float(np.radians(0.5))
"""Standard deviation of the noise [rad]."""


def write_leg(folder: Path) -> Path:
    """Write the figure and its springs; return the figure's path."""
    path = folder / "leg.fig"
    path.write_text(FIGURE, encoding="utf-8")
    (folder / "leg.springs.toml").write_text(SPRINGS, encoding="utf-8")
    return path


@cache
def leg_case() -> Case:
    """The figure, which is in no file, with its springs."""
    from generator.springs_file.edit import springs_from_text

    figure = FIGURE_FILE.parse_text(FIGURE).require_value()
    springs = springs_from_text(SPRINGS, figure, Path("leg.springs.toml"))
    return Case(Model(figure, springs), Plan())


def paths(*texts: str):
    """The paths of quantities of the leg."""
    return [parse_path(text, leg_case()) for text in texts]


@cache
def exact_swing(values: tuple[tuple[str, float], ...], stop: float, frame: float):
    """Times and angles of a swing without noise."""
    case = leg_case()
    case = apply_values(case, [(parse_path(text, case), value) for text, value in values])
    plan = replace(case.plan, stop=stop, frame=frame, tolerance=1e-9)
    recording = simulate(case.model, plan)
    assert recording.outcome.succeeded
    return recording.times, recording.displacements["left_knee"]


def swing(
    values: Mapping[str, float] = TRUTH,
    *,
    noise: float = NOISE,
    seed: int = 1,
    stop: float = 3.0,
    frame: float = 0.02,
) -> MeasuredAngles:
    """Angles of a swing with noise."""
    times, angles = exact_swing(tuple(values.items()), stop, frame)
    drawn = np.random.default_rng(seed).standard_normal(angles.shape)
    return MeasuredAngles("swing.csv", times, (("left_knee", 0),), angles + noise * drawn)


ALONE = FitOptions(starts=1, profiles=False, release=0.0)


@cache
def fitted(texts: tuple[str, ...] = tuple(TRUTH), options: FitOptions = ALONE) -> Fit:
    """The fit of quantities to the swing of the truth."""
    return fit_springs(leg_case(), swing(), paths(*texts), options)


def standard_fit() -> Fit:
    """The fit from two starts, with profiles."""
    return fitted(options=FitOptions(starts=2, release=0.0))


def coarse_fit() -> Fit:
    """The fit with a step that is too long."""
    return fitted(options=replace(ALONE, step=0.02))


def swing_text(data: MeasuredAngles) -> str:
    """The table of a swing."""
    rows = zip(data.times.tolist(), np.degrees(data.angles[:, 0]).tolist(), strict=True)
    lines = ["# a swing", "time [s],left_knee [deg]", *(f"{t!r},{a!r}" for t, a in rows)]
    return "\n".join([*lines, ""])
