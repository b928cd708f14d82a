"""Torques of passive joints read out of the Exudyn model while nothing moves.

No law is evaluated here. The bodies are put where a pose has them, Exudyn evaluates the right-hand
side of the equations of motion, and what it gives the bodies is summed beyond each joint. Whatever
the model holds is in the sum, laws over several joints too.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from generator.engine.assembly import Assembly, build, start_of
from generator.engine.bodies import body_pose
from generator.engine.chosen_springs import springs_of
from generator.engine.exudyn_api import exu, rigid
from generator.engine.plan import Plan
from generator.errors import MoverError
from generator.figure import Figure, Site
from generator.frames import Array, rotation_vector_from_matrix
from generator.posture.links import Links
from generator.posture.placement import Displacements, Placement, site_pose

_HALF_TURN_SLACK = 1e-6
"""A rotation vector nearer than this to 180 deg points either way by its rounding [rad]."""


class StaticsError(MoverError):
    """The torques of the joints cannot be told from those on the bodies."""


def static_torques(
    figure: Figure, poses: Sequence[Displacements], plan: Plan | None = None
) -> Mapping[str, Array]:
    """Torque of every joint's passive springs on its child, in n poses at rest.

    Gravity, loads, velocities, links, locks and drives of the figure and the plan are left out.

    Args:
        figure: whose joints are read; it has no closed loops.
        poses: n of them; each gives displacements by joint [rad or m], and where it does not name
            a joint the plan's count, else the figure's own. A hinge may be turned more than once.
        plan: chooses the springs, how they join, and the kind of torques; None as in `Plan()`.

    Returns:
        By joint, about the child's site in the parent's site axes, shape (n, 3) [N m].

    Raises:
        StaticsError: the figure has loops, or a joint with springs is turned by 180 deg.
        MoverError: the figure cannot be built, or a pose does not fit it.
    """
    still = replace(
        plan or Plan(),
        gravity=(0.0, 0.0, 0.0),
        velocities={},
        loads=(),
        links=Links(),
        locked=(),
        drives={},
    )
    unloaded = _without_loads(figure)
    model = _Model.of(build(unloaded, still, springs_of(figure, still)))
    placements = [
        start_of(unloaded, replace(still, displacements={**still.displacements, **pose})).placement
        for pose in poses
    ]
    torques = {name: np.zeros((len(placements), 3)) for name in model.assembly.figure.joints}
    for row, placement in enumerate(placements):
        for name, torque in model.torques(placement).items():
            torques[name][row] = torque
    return torques


@dataclass(frozen=True)
class _Model:
    """An assembly whose equations of motion are evaluated at poses.

    Attributes:
        assembly: built without gravity and loads.
        solver: evaluates the right-hand side; it never takes a step.
        coordinates: places of each body's position and Euler parameters among all coordinates.
        turns: for each hinge with a spring its joint, the factor of the joint's chain, and the
            place where Exudyn keeps the last angle, from which it counts whole turns.
        balls: names of the joints whose springs see a rotation vector.
        reference: what Exudyn adds to its coordinates.
    """

    assembly: Assembly
    solver: Any
    coordinates: Mapping[str, Sequence[int]]
    turns: tuple[tuple[str, int, Sequence[int]], ...]
    balls: tuple[str, ...]
    reference: Array

    @classmethod
    def of(cls, assembly: Assembly) -> "_Model":
        """Prepare an assembly. Raises StaticsError for loops."""
        closures = assembly.placement.tree.closures
        if closures:
            names = ", ".join(joint.name for joint in closures)
            raise StaticsError(
                f"the loop that {names} closes hides which joint a torque comes from: "
                "only figures without loops can be read at rest"
            )
        settings = exu.SimulationSettings()
        settings.solution.file.write = False
        solver = exu.MainSolverImplicitSecondOrder()
        solver.InitializeSolver(assembly.mbs, settings)
        data = assembly.mbs.systemData
        connectors = [(name, one) for name, all_of in assembly.springs.items() for one in all_of]
        return cls(
            assembly,
            solver,
            {name: data.GetObjectLTGODE2(assembly.bodies[name]) for name in assembly.figure.bodies},
            tuple(
                (name, one.place, data.GetObjectLTGData(one.item))
                for name, one in connectors
                if one.kind == "hinge"
            ),
            tuple(name for name, one in connectors if one.kind == "ball"),
            np.array(data.GetODE2Coordinates(configuration=exu.ConfigurationType.Reference)),
        )

    def torques(self, placement: Placement) -> dict[str, Array]:
        """Torque of each joint on its child about the child's site, parent's axes, (3,) [N m]."""
        self._insist_on_rotation_vectors(placement)
        pushes = self._pushes(placement)
        torques: dict[str, Array] = {}
        for branch in reversed(placement.tree.branches):
            push, joint = pushes[branch.tip], branch.joint
            if branch.base in pushes:
                pushes[branch.base] = pushes[branch.base] + push
            child = site_pose(placement, joint, "child")
            about_child = push[3:] - np.cross(child[:3, 3], push[:3])
            turned = site_pose(placement, joint, "parent")[:3, :3].T @ about_child
            torques[joint.name] = turned if branch.forward else -turned
        return torques

    def _insist_on_rotation_vectors(self, placement: Placement) -> None:
        """Raise StaticsError where springs see a rotation vector that may point either way."""
        for name in self.balls:
            between = placement.between(placement.tree.figure.joints[name])[:3, :3]
            angle = np.linalg.norm(rotation_vector_from_matrix(between))
            if angle > np.pi - _HALF_TURN_SLACK:
                raise StaticsError(
                    f"joint {name} is turned by 180 deg, where the torque of its springs is not "
                    "defined"
                )

    def _pushes(self, placement: Placement) -> dict[str, Array]:
        """Force on each body, and moment about the world's origin, world axes, (6,) [N, N m]."""
        data = self.assembly.mbs.systemData
        coordinates = np.zeros_like(self.reference)
        figure = placement.tree.figure
        for name, places in self.coordinates.items():
            pose = body_pose(placement, figure.segments[name])
            parameters = rigid.RotationMatrix2EulerParameters(pose[:3, :3])
            coordinates[places] = [*pose[:3, 3], *parameters]
        data.SetODE2Coordinates(coordinates - self.reference)
        counted = np.array(data.GetDataCoordinates())
        for name, factor, places in self.turns:
            counted[places] = placement.displacements[name][factor]
        data.SetDataCoordinates(counted)
        self.solver.ComputeODE2RHS(self.assembly.mbs)
        right_hand_side = self.solver.GetSystemResidual()
        pushes: dict[str, Array] = {}
        for name, places in self.coordinates.items():
            here = coordinates[places]
            given = right_hand_side[places]
            # The angular velocity is G times the rates of the parameters, so they get G^T times the
            # torque; and G G^T is four times the identity.
            torque = 0.25 * np.asarray(rigid.EulerParameters2G(here[3:])) @ given[3:]
            pushes[name] = np.concatenate([given[:3], torque + np.cross(here[:3], given[:3])])
        return pushes


def _without_loads(figure: Figure) -> Figure:
    """The figure without the forces and moments written at its sites."""

    def bare(site: Site) -> Site:
        return replace(
            site, global_force=None, local_force=None, global_moment=None, local_moment=None
        )

    segments = {
        name: replace(segment, sites={key: bare(site) for key, site in segment.sites.items()})
        for name, segment in figure.segments.items()
    }
    return replace(figure, segments=segments)
