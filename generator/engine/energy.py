"""The energy book of a run, from the states of its frames."""

from collections.abc import Mapping

import numpy as np

from generator.engine.assembly import Assembly
from generator.engine.coupled_torques import coupled_energy
from generator.engine.motion import JointMotion, turned_joints
from generator.engine.trace import Trace
from generator.frames import Array
from springs import Joining, conservative_energy, total_energy


def energy_book(
    assembly: Assembly, trace: Trace, joints: Mapping[str, JointMotion]
) -> dict[str, Array]:
    """Energy by kind at every frame, shape (n,) each [J].

    `spring` is the stored energy of the springs; where there is none, for spherical joints with the
    weighted law and for coupled laws that are no gradient, the work done against their elastic
    torques since the start. `gravity` is counted from the world's origin.
    """
    bodies = list(assembly.figure.bodies.values())
    masses = np.array([body.mass for body in bodies], dtype=float)
    inertias = np.array([body.inertia for body in bodies], dtype=float)
    own_spins = (np.swapaxes(trace.rotations, -1, -2) @ trace.spins[..., None])[..., 0]
    kinetic = 0.5 * np.sum(masses * np.sum(trace.velocities**2, axis=-1), axis=-1)
    kinetic += 0.5 * np.sum(inertias * own_spins**2, axis=(-1, -2))
    gravity = -np.sum(masses * (trace.positions @ np.asarray(assembly.plan.gravity)), axis=-1)
    return {
        "kinetic": kinetic,
        "gravity": gravity,
        "spring": _spring_energy(assembly, trace, joints),
        "dissipated": trace.dissipated,
        "work": trace.load_work,
    }


def _spring_energy(assembly: Assembly, trace: Trace, joints: Mapping[str, JointMotion]) -> Array:
    joining = assembly.plan.joining or assembly.spring_set.joining
    weighted = joining is Joining.WEIGHTED
    stored = trace.spring_work.copy()
    for name, connectors in assembly.springs.items():
        moved = joints[name]
        for connector in connectors:
            if connector.kind != "ball":
                along = moved.displacements[:, connector.place]
                for spring in connector.springs:
                    stored += total_energy(spring.elastic, along)
            elif not weighted:
                stored += conservative_energy(connector.springs, moved.rotation_vectors)
    chains = assembly.placement.tree.chains
    for one in assembly.coupled:
        if one.stores:
            stored += coupled_energy(one.spring, chains, turned_joints(assembly, joints))
    return stored
