"""Falls that are compared with people: `python -m benchmarks falls-of-people`.

Both shipped persons are pushed 200 times with the tone `fall` and 200 times limp, from seed 2000
on, which set no parameter. Those with parts fall backwards on floors of several stiffnesses as
well, and their heads alone on a hard one. `python -m benchmarks.falls_of_people MAN.fig WOMAN.fig
[STARTS]` takes other figures. The plate and the page `falls_of_people` are made of what is written.
"""

import sys
from collections.abc import Iterator, Sequence
from dataclasses import replace
from math import inf, nan
from pathlib import Path
from time import perf_counter

import numpy as np
from scipy.integrate import solve_ivp

from benchmarks import tables
from generator import Falls, Model, Plan, fall_plan, read_figure, run_falls, simulate
from generator.contact.scene import Scene, floor_prop
from generator.run_options import Integrator
from generator.study.falls import HANDS, HEAD, HEADS, HIP, PELVIS
from plots.fall_facts import fall_facts
from springs.contact_part import PartLaw, part_forces
from springs.layer import Layer

COMMAND = "python -m benchmarks falls-of-people"

BUTTOCKS = "buttocks"

FIGURES = {"man": "male50", "woman": "female50"}
"""Figure of each body."""

STARTS, SEED = 200, 2000

KIND = "push"

BACKWARD_SPEED = 0.5
"""Speed of the push in falls on floors [m/s]."""

FLOOR_SPEED = 3.5
"""Speed of the pelvis to which forces on floors are scaled [m/s]."""

FLOOR_DURATION = 0.9
"""Duration of a fall on a floor [s]."""

TRUNK_MASS = 54.0
"""Mass of the trunk in the model of the study of the floors, one body alone [kg]."""

HEAD_MASS, HEAD_SPEEDS = 4.54, (2.02, 7.41)
"""Mass of a dummy's head [kg], and speeds at the ends of the interval of dummies [m/s]."""

GRAVITY = 9.81

_HITS = {"pelvis_hits": (PELVIS,), "head_hits": HEADS, "hand_hits": HANDS}


def contact_name(model: Model) -> str:
    """Name of the contact of a model, as of `mover person --contact`."""
    return "spheres" if model.contact is None or not model.contact.parts else "parts"


def push(body: str, model: Model, tone: str, starts: int) -> Iterator[tables.Row]:
    """Yield the numbers of each push of a body; those of falls that fail are blank."""
    plan = fall_plan(model.figure, KIND, SEED)
    if tone == "limp":
        plan = replace(plan, tone=None)
    falls = run_falls(model, KIND, starts, SEED, plan)
    numbers = {**falls.quantities(), **_hits(falls)}
    for k in range(len(falls)):
        yield {
            "body": body,
            "tone": tone,
            "seed": int(falls.seeds[k]),
            "direction_deg": f"{falls.direction[k]:.6g}",
            "done": int(falls.is_done[k]),
            **{name: f"{values[k]:.6g}" for name, values in numbers.items()},
        }


def _hits(falls: Falls) -> dict[str, np.ndarray]:
    """Return 1 for each fall in which a part touches, 0 for others, and NaN for failed ones."""
    done = falls.is_done
    return {name: np.where(done, falls.hits(*parts), nan) for name, parts in _HITS.items()}


def fall_on(model: Model, stiffness: float) -> tuple[float, float, float]:
    """Return the fall of a model on a floor [N/m].

    It is the speed of the lower torso [m/s], the peak force on it, and that on the part pelvis [N].
    """
    floor = floor_prop((0.0, 1.0, 0.0))
    layer = None if stiffness == inf else Layer(((0.0, stiffness),))
    floor = replace(floor, surface=replace(floor.surface, layer=layer))
    plan = Plan(
        stop=FLOOR_DURATION,
        free_root=True,
        height=0.0,
        scene=Scene((floor,)),
        velocities={PELVIS: (0.0, 0.0, 0.0, 0.0, 0.0, -BACKWARD_SPEED)},
        integrator=Integrator.IMPLICIT,
    )
    contact = simulate(model, plan).contact
    assert contact is not None
    torso = contact.segments[PELVIS]
    return torso.impact_speed, torso.peak_force, contact.parts[HIP].peak_force


def drop(law: PartLaw, mass: float, speed: float) -> float:
    """Return the peak force of a mass alone [kg] that falls on a part, at a speed [m/s]; in N."""

    def rates(_: float, state: np.ndarray) -> list[float]:
        normal = part_forces(law, state[:1], state[1:]).normal[0]
        return [state[1], GRAVITY - float(normal) / mass]

    span = 0.02 if mass < 10.0 else 0.15
    run = solve_ivp(rates, (0.0, span), [0.0, speed], rtol=1e-9, atol=1e-12, max_step=span / 2000)
    return float(np.max(part_forces(law, run.y[:1].T, run.y[1:].T).normal))


def floor_rows(body: str, model: Model) -> Iterator[tables.Row]:
    """Yield the falls of a body with parts on each floor of the facts, and on a hard one."""
    laws = {part.name: part.law for part in model.contact.parts} if model.contact else {}
    buttocks = replace(laws[BUTTOCKS], within=None, norm_scale=1.0)
    floors = [fact.floor * 1e3 for fact in fall_facts().facts if fact.floor is not None]
    for stiffness in (inf, *floors):
        speed, pelvis_force, force = fall_on(model, stiffness)
        layer = None if stiffness == inf else Layer(((0.0, stiffness),))
        alone = drop(buttocks.on(layer), TRUNK_MASS, FLOOR_SPEED)
        yield {
            "body": body,
            "floor_kN_m": f"{stiffness / 1e3:g}",
            "pelvis_speed_m_per_s": f"{speed:.6g}",
            "pelvis_force_N": f"{pelvis_force:.6g}",
            "force_N": f"{force:.6g}",
            "floor_force_N": f"{force * FLOOR_SPEED / speed:.6g}",
            "alone_force_N": f"{alone:.6g}",
        }


def head_rows(body: str, model: Model) -> Iterator[tables.Row]:
    """Yield the blows to the head of a body with parts, alone."""
    assert model.contact is not None
    (law,) = [part.law for part in model.contact.parts if part.name == HEAD]
    for speed in HEAD_SPEEDS:
        force = drop(law, HEAD_MASS, speed)
        acceleration = force / (HEAD_MASS * GRAVITY)
        yield {
            "body": body,
            "speed_m_per_s": f"{speed:g}",
            "single_head_force_N": f"{force:.6g}",
            "single_head_acceleration_g": f"{acceleration:.6g}",
        }


def main(figures: Sequence[str | Path] = tuple(FIGURES.values()), starts: int = STARTS) -> None:
    """Run all falls and write their tables."""
    pushes: list[tables.Row] = []
    others: dict[str, list[tables.Row]] = {"floors": [], "heads": []}
    bodies: list[tables.Row] = []
    for body, name in zip(FIGURES, figures, strict=True):
        model = Model.of(read_figure(name))
        contact = contact_name(model)
        mass = sum(one.mass or 0.0 for one in model.figure.bodies.values())
        bodies.append(
            {"body": body, "figure": Path(name).stem, "contact": contact, "mass_kg": mass}
        )
        for tone in ("awake", "limp"):
            begin = perf_counter()
            pushes += push(body, model, tone, starts)
            seconds = perf_counter() - begin
            print(f"{body}, {tone}: {starts} falls in {seconds:.0f} s", flush=True)
        if contact == "parts":
            others["floors"] += floor_rows(body, model)
            others["heads"] += head_rows(body, model)
    (tables.FOLDER / "falls_of_people").mkdir(parents=True, exist_ok=True)
    command = COMMAND
    if tuple(figures) != tuple(FIGURES.values()) or starts != STARTS:
        words = (*(Path(name).name for name in figures), starts)
        command = f"python -m benchmarks.falls_of_people {' '.join(map(str, words))}"
    for name, rows in {"bodies": bodies, "pushes": pushes, **others}.items():
        path = tables.FOLDER / "falls_of_people" / f"{name}.csv"
        if rows:
            tables.write(f"falls_of_people/{name}", command, rows)
        else:
            path.unlink(missing_ok=True)


if __name__ == "__main__":
    *_figures, _starts = [*sys.argv[1:], str(STARTS)][:3]
    main(_figures or tuple(FIGURES.values()), int(_starts))
