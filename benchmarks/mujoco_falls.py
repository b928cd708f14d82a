"""Falls of a person here and in MuJoCo, by the file of `mover convert --fall` or `--floor`.

Run with `python -m benchmarks.mujoco_falls`. The person is limp. Both start in the same state;
MuJoCo has the soft constraints of the file for contact, and no reach of the shoulders.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from benchmarks import tables
from generator import Plan, Scene, convert, fall_plan, read_figure, simulate
from generator.figure import Figure
from generator.recording import Recording

PERSON = "male50"

STOP = 2.0
"""End of every fall [s]."""

LAST = 0.2
"""Time at the end over which a rest is averaged [s]."""


def plans(figure: Figure) -> Mapping[str, Plan]:
    """Return the falls by name."""
    falls = {
        f"{kind}, seed {seed}": replace(fall_plan(figure, kind, seed), tone=None, stop=STOP)
        for kind in ("faint", "push")
        for seed in (0, 6)
    }
    upright = Plan(stop=STOP, scene=Scene.floor(), free_root=True, height=0.0)
    return {"upright": upright, **falls}


@dataclass(frozen=True)
class MuJoCoFall:
    """A fall in MuJoCo, in m steps.

    Attributes:
        times: Shape (m,) [s].
        centres: Centre of mass, shape (m, 3) [m].
        forces: Size of the force of all props together, shape (m,) [N].
        first: First touch of each segment with its sphere [s].
        peaks: Largest force on each segment [N].
        warnings: Number of warnings of MuJoCo.
    """

    times: np.ndarray
    centres: np.ndarray
    forces: np.ndarray
    first: Mapping[str, float]
    peaks: Mapping[str, float]
    warnings: int


def mujoco_fall(path: Path, stop: float, step: float | None = None) -> MuJoCoFall:
    """Play a model from its key `start`.

    Args:
        path: Path of the model.
        stop: End [s].
        step: Time step [s]; None for that of the file.
    """
    import mujoco

    model: Any = mujoco.MjModel.from_xml_path(str(path))
    model.opt.timestep = step or model.opt.timestep
    data: Any = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    count = round(stop / model.opt.timestep)
    centres, forces = np.zeros((count, 3)), np.zeros(count)
    first: dict[str, float] = {}
    peaks: dict[str, float] = {}
    wrench = np.zeros(6)
    for k in range(count):
        mujoco.mj_forward(model, data)
        centres[k] = data.subtree_com[0]
        on: dict[str, np.ndarray] = {}
        for number, contact in enumerate(data.contact[: data.ncon]):
            mujoco.mj_contactForce(model, data, number, wrench)
            body = model.body(model.geom_bodyid[list(contact.geom)].max()).name
            own = contact.frame.reshape(3, 3).T @ wrench[:3]
            on[body] = on.get(body, np.zeros(3)) + own
        for body, force in on.items():
            first.setdefault(body, float(data.time))
            peaks[body] = max(peaks.get(body, 0.0), float(np.linalg.norm(force)))
        forces[k] = np.linalg.norm(sum(on.values(), np.zeros(3)))
        mujoco.mj_step(model, data)
    warnings = sum(one.number for one in data.warning)
    return MuJoCoFall(
        model.opt.timestep * np.arange(count), centres, forces, first, peaks, warnings
    )


@cache
def both_falls(name: str) -> tuple[Recording, MuJoCoFall]:
    """Return a fall here and in MuJoCo."""
    figure = read_figure(PERSON)
    plan = plans(figure)[name]
    with TemporaryDirectory() as folder:
        path = Path(folder) / "body.xml"
        convert(figure, path, plan=plan)
        return simulate(figure, plan), mujoco_fall(path, STOP)


def distance(here: Recording, there: MuJoCoFall, until: float) -> float:
    """Return the largest distance of the centres of mass up to a time [m]."""
    some = here.times < until
    centres = [np.interp(here.times[some], there.times, each) for each in there.centres.T]
    return float(np.linalg.norm(np.transpose(centres) - here.centre_of_mass[some], axis=1).max())


def rows() -> Iterator[dict[str, object]]:
    """Yield the rows of the table: numbers here and, after a stroke, in MuJoCo."""
    for name in plans(read_figure(PERSON)):
        here, there = both_falls(name)
        assert here.contact is not None
        segments = here.contact.segments
        hip, head = (segments[part] for part in ("lower_torso", "head"))
        late = there.times > STOP - LAST
        heights = np.mean(here.centre_of_mass[here.times > STOP - LAST, 1])
        chaotic = here.contact.chaotic_from(here.times)
        touch = hip.first_time or STOP
        yield {
            "fall": name,
            "pelvis touches [s]": f"{touch:.3f} / {there.first['lower_torso']:.3f}",
            "apart until then [mm]": f"{1e3 * distance(here, there, touch):.0f}",
            "apart at most [mm]": f"{1e3 * distance(here, there, STOP):.0f}",
            "force, all [kN]": _pair(here.contact.max_force, float(there.forces.max())),
            "pelvis [kN]": _pair(hip.peak_force, there.peaks.get("lower_torso", 0.0)),
            "head [kN]": _pair(head.peak_force, there.peaks.get("head", 0.0)),
            "rest [m]": f"{heights:.3f} / {there.centres[late, 1].mean():.3f}",
            "chaotic from [s]": "-" if chaotic is None else f"{chaotic:.2f}",
        }


def _pair(here: float, there: float) -> str:
    return f"{here / 1e3:.1f} / {there / 1e3:.1f}"


def main() -> None:
    """Print the table."""
    tables.show(rows())


if __name__ == "__main__":
    main()
