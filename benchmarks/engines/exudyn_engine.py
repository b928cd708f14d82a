"""This project: Exudyn in redundant coordinates, as `generator` builds and refines it."""

from collections.abc import Mapping, Sequence
from importlib.metadata import version

import numpy as np

from benchmarks.outside import Fall
from benchmarks.passive_law import RadialLaw
from generator.figure import Figure
from generator.recording import Recording
from generator.rotations import matrix_from_rotation_vector
from generator.simulation.plan import Plan
from generator.simulation.run import simulate
from springs import AxisSpring, Cubic, Damping, JointSprings, Linear, SpringSet

NAME = "Exudyn"
VERSION = version("exudyn")

_GOLDEN = 0.5 * (1.0 + 5.0**0.5)
_ICOSAHEDRON = np.array(
    [
        turned
        for side in (1.0, -1.0)
        for turned in ((0.0, side, _GOLDEN), (side, _GOLDEN, 0.0), (_GOLDEN, 0.0, side))
    ]
) / np.hypot(1.0, _GOLDEN)
"""Directions of the six diagonals d: sum (d.r)^2 = 2 r^2 and sum (d.r)^4 = 6/5 r^4."""


def radial_springs(figure: Figure, law: RadialLaw) -> SpringSet:
    """A law of the size of the displacement alone, as axis springs.

    A ball gets three axes where the law is linear, else six, the diagonals of an icosahedron: on
    them the energies of cubics add up to one that is the same in all directions.
    """
    joints: dict[str, JointSprings] = {}
    for name, joint in figure.joints.items():
        damping = Damping(law.viscous)
        if not law.cubic:
            linear = (Linear(law.linear),)
            axes = tuple(AxisSpring(factor.axis, linear, damping) for factor in joint.chain)
        elif len(joint.chain) == 1:
            curve = Cubic((0.0, law.linear, 0.0, law.cubic), -1)
            axes = (AxisSpring(joint.chain[0].axis, (curve,), damping),)
        else:
            curve = Cubic((0.0, law.linear / 2.0, 0.0, law.cubic * 5.0 / 6.0), -1)
            axes = tuple(
                AxisSpring(tuple(map(float, axis)), (curve,), Damping(law.viscous / 2.0))
                for axis in _ICOSAHEDRON
            )
        joints[name] = JointSprings(name, axes)
    return SpringSet(joints)


def fall(figure: Figure, plan: Plan) -> tuple[Fall, Recording]:
    """The motion as the program gives it."""
    recording = simulate(figure, plan)
    if not recording.outcome.succeeded:
        raise RuntimeError(recording.outcome.message)
    energy = np.sum([recording.energy[kind] for kind in ("kinetic", "gravity", "spring")], axis=0)
    turns = {name: matrix_from_rotation_vector(r) for name, r in recording.rotation_vectors.items()}
    made = Fall(
        turns, recording.centre_of_mass, energy, recording.wall_time, recording.accuracy.steps
    )
    return made, recording


def plan_of(
    displacements: Mapping[str, Sequence[float]], springs: SpringSet | None = None, **given: float
) -> Plan:
    """A run of one second that starts at displacements [rad]; `given` are fields of the plan."""
    return Plan(displacements=displacements, springs=springs, **given)
