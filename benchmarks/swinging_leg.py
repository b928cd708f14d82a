"""A swinging leg in MuJoCo, and the measured swings that are shipped with the figure `leg`.

    python -m benchmarks.swinging_leg

writes `figures/leg_swing.csv` and `figures/leg_swing_30.csv`: angles of the knee at 50 Hz with
white noise, released at 0 deg and at 30 deg. Masses are those of the figure `leg`; the elastic law
of its knee is a table of torques at every 0.01 deg, and MuJoCo integrates the motion.
"""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from math import radians
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np

import figures
from generator import read_figure, read_springs
from generator.figure import Figure
from generator.rotations import Array
from generator.text_io import write_atomic
from springs import total_torque

COMMAND = "python -m benchmarks.swinging_leg"

FIGURE, JOINT = "leg", "knee"

RATE = 50.0
"""Samples a second."""

NOISE = 0.5
"""Standard deviation of the noise [deg]."""

STEP = 1e-3
"""Of MuJoCo's Runge-Kutta method of fourth order [s]."""

SHIPPED_STOP = 12.0
"""End of the shipped swings [s]."""

_GRAVITY = 9.81
_TABLE = np.radians(np.arange(-30.0, 160.0, 0.01))


@dataclass(frozen=True)
class Truth:
    """Passive knee of a swing.

    Attributes:
        scale: factor of the elastic torque of the figure.
        offset: shift of its curve towards flexion [deg].
        viscous: damping [N m s/rad].
        coulomb: friction [N m].
        law: elastic torque [N m] at angles [rad], before the factor; None for the figure's.
    """

    scale: float = 1.0
    offset: float = 0.0
    viscous: float = 0.33
    coulomb: float = 0.0
    law: Callable[[Array], Array] | None = None

    def torques(self, angles: Array) -> Array:
        """Elastic torque [N m] at angles [rad]."""
        law = self.law or figure_law
        return self.scale * law(angles - radians(self.offset))


SHIPPED_TRUTH = Truth(scale=1.3, offset=-4.0, viscous=0.35)

SHIPPED = {"leg_swing": (0.0, 1), "leg_swing_30": (30.0, 2)}
"""Angle of the release [deg] and seed of the noise of each shipped swing, by name."""


def figure_law(angles: Array) -> Array:
    """Elastic torque [N m] of the figure's knee at angles [rad]."""
    figure = read_figure(FIGURE)
    (spring,) = read_springs(None, figure).joints[JOINT].axes
    return np.asarray(total_torque(spring.elastic, angles), dtype=float)


def swing_in_mujoco(
    truth: Truth, start: float, stop: float, figure: Figure | None = None, release: float = 0.0
) -> tuple[Array, Array]:
    """Return the times [s] and angles [deg] of a swing, without noise.

    Args:
        truth: passive knee.
        start: angle of the release [deg].
        stop: end of the swing [s].
        figure: with the mass of the shank; None for the shipped one.
        release: time until which the leg is held, a multiple of `STEP` [s].
    """
    import mujoco

    model = mujoco.MjModel.from_xml_string(_model_text(figure or read_figure(FIGURE)))
    model.opt.timestep = STEP
    data = mujoco.MjData(model)
    data.qpos[0] = radians(start)
    count, done = round(stop * RATE), 0
    angles = np.empty(count + 1)
    with _passive_torque(truth):
        for k in range(count + 1):
            steps = max(0, round((k / RATE - release) / STEP))
            if steps > done:
                mujoco.mj_step(model, data, nstep=steps - done)
            done = steps
            angles[k] = data.qpos[0]
    return np.arange(count + 1) / RATE, np.degrees(angles)


def _model_text(figure: Figure) -> str:
    """The leg in MuJoCo: world x to the left, y up, z forward, the thigh along z."""
    shank = figure.segments["shank"]
    centre = shank.centre_of_mass
    assert centre is not None
    assert shank.inertia is not None
    forward, _, along = centre.tolist()
    about_forward, about_side, about_length = shank.inertia
    root = ElementTree.Element("mujoco")
    ElementTree.SubElement(root, "compiler", angle="radian")
    option = ElementTree.SubElement(root, "option", gravity=f"0 {-_GRAVITY} 0", integrator="RK4")
    ElementTree.SubElement(option, "flag", contact="disable")
    body = ElementTree.SubElement(ElementTree.SubElement(root, "worldbody"), "body")
    ElementTree.SubElement(body, "joint", type="hinge", axis="1 0 0")
    ElementTree.SubElement(
        body,
        "inertial",
        mass=repr(shank.mass),
        pos=f"0 {forward!r} {along!r}",
        diaginertia=f"{about_side!r} {about_forward!r} {about_length!r}",
    )
    return ElementTree.tostring(root, "unicode")


@contextmanager
def _passive_torque(truth: Truth) -> Iterator[None]:
    """Let MuJoCo call the passive knee."""
    import mujoco

    torques = truth.torques(_TABLE)

    def apply(_: Any, data: Any) -> None:
        angle, rate = float(data.qpos[0]), float(data.qvel[0])
        friction = truth.coulomb * np.tanh(rate / 0.01)
        data.qfrc_passive[0] = np.interp(angle, _TABLE, torques) - truth.viscous * rate - friction

    mujoco.set_mjcb_passive(apply)
    try:
        yield
    finally:
        mujoco.set_mjcb_passive(None)


def add_noise(angles: Array, seed: int | Sequence[int], sd: float = NOISE) -> Array:
    """Return angles with white noise [deg]."""
    return angles + np.random.default_rng(seed).normal(0.0, sd, len(angles))


def shipped_text(name: str) -> str:
    """Text of a shipped swing."""
    import mujoco

    start, seed = SHIPPED[name]
    truth = SHIPPED_TRUTH
    times, angles = swing_in_mujoco(truth, start, SHIPPED_STOP)
    noisy = add_noise(angles, seed)
    head = (
        f"Synthetic: the figure `{FIGURE}` released at {start:g} deg, simulated by MuJoCo "
        f"{mujoco.__version__}, not by Exudyn.",
        f"Made by `{COMMAND}`, for which no person was measured.",
        f"True values: springs.{JOINT}.scale {truth.scale:g}, springs.{JOINT}.offset_deg "
        f"{truth.offset:g}, springs.{JOINT}.viscous_Nms_rad {truth.viscous:g};",
        f"white noise of {NOISE:g} deg (standard deviation), {RATE:g} samples a second.",
    )
    lines = [*(f"# {line}" for line in head), f"time [s],{JOINT} [deg]"]
    lines += [f"{time:.2f},{angle:.3f}" for time, angle in zip(times, noisy, strict=True)]
    return "".join(f"{line}\n" for line in lines)


def main() -> None:
    """Write the shipped swings."""
    for name in SHIPPED:
        path = Path(figures.__path__[0]) / f"{name}.csv"
        write_atomic(path, shipped_text(name))
        print(f"wrote {path}")


if __name__ == "__main__":
    main()
