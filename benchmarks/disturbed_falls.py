"""Endings of disturbed falls of the shipped persons, and the largest rotation of a shoulder.

    python -m benchmarks.disturbed_falls [FALLS]

Each person falls on a floor from 100 starts (or FALLS): every displacement is that of the upright
person and a normal deviate of 0.05 rad, and the pelvis is pushed with 1 m/s in any direction. No
run should end at half a turn or a pole.
"""

import sys
from collections import Counter

import numpy as np

from benchmarks import tables
from generator import Plan, read_figure, simulate
from generator.contact.scene import Scene
from generator.model import Model
from generator.recording import RecordingPart

SPREAD, PUSH, STOP = 0.05, 1.0, 1.4
"""Standard deviation of the start [rad], speed of the push [m/s], end of the runs [s]."""


def main() -> None:
    """Print the table."""
    falls = int(sys.argv[1]) if len(sys.argv) > 1 else 100
    tables.show([_row(name, falls) for name in ("male50", "female50")])


def _row(name: str, falls: int) -> tables.Row:
    model = Model.of(read_figure(name))
    root = next(
        joint.name
        for joint in model.figure.joints.values()
        if {joint.parent.segment, joint.child.segment} & model.figure.ground
    )
    endings: Counter[str] = Counter()
    largest = 0.0
    for seed in range(falls):
        plan = _plan(model, root, np.random.default_rng(seed))
        run = simulate(model, plan, record={RecordingPart.ROTATION_VECTORS})
        endings[run.outcome.ending.value] += 1
        for side in ("left", "right"):
            moved = np.linalg.norm(run.rotation_vectors[f"{side}_shoulder"], axis=-1)
            largest = max(largest, float(np.degrees(moved.max())))
    ends = ", ".join(f"{count} {ending}" for ending, count in endings.most_common())
    return {"person": name, "falls": falls, "endings": ends, "shoulder [deg]": largest}


def _plan(model: Model, root: str, rng: np.random.Generator) -> Plan:
    joints = model.figure.joints
    displacements = {
        name: tuple(np.array(joint.displacement or (0.0,) * joint.degrees_of_freedom) + noise)
        for name, joint in joints.items()
        if name != root and joint.degrees_of_freedom
        for noise in [rng.normal(0.0, SPREAD, joint.degrees_of_freedom)]
    }
    heading = rng.uniform(0.0, 2.0 * np.pi)
    push = (PUSH * float(np.sin(heading)), 0.0, PUSH * float(np.cos(heading)))
    return Plan(
        stop=STOP,
        free_root=True,
        scene=Scene.floor(),
        height=0.02,
        displacements=displacements,
        velocities={"lower_torso": (0.0, 0.0, 0.0, *push)},
    )


if __name__ == "__main__":
    main()
