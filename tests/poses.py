"""Random poses and rates of a model, as states of its bodies."""

from dataclasses import dataclass

import numpy as np

from generator.kinematics.loops import close_loops, consistent_rates
from generator.kinematics.placement import Placement, forward_kinematics, segment_jacobians
from generator.rotations import Array, cross_matrix
from generator.simulation.exudyn_model.agreement import BodyState
from generator.simulation.exudyn_model.bodies import body_pose
from generator.simulation.exudyn_model.exudyn_api import rigid
from generator.simulation.exudyn_model.model import ExudynModel


@dataclass(frozen=True)
class Pose:
    """Displacements and rates of a model's tree at a time; `placement` has both kinds of joints."""

    model: ExudynModel
    placement: Placement
    rates: np.ndarray
    time: float

    @property
    def rates_by_joint(self):
        columns = self.placement.tree.kinematics.columns
        return {name: self.rates[columns[name]] for name in columns}

    def shifted(self, step: float) -> Placement:
        """The placement after the displacements have moved with their rates."""
        moved = {
            name: self.placement.displacements[name] + step * rates
            for name, rates in self.rates_by_joint.items()
        }
        return forward_kinematics(self.placement.tree, moved)

    @property
    def state(self) -> BodyState:
        figure = self.model.figure
        poses = [body_pose(self.placement, segment) for segment in figure.bodies.values()]
        motions = motion_matrix(self.placement) @ self.rates
        return BodyState(
            self.time,
            np.array([pose[:3, 3] for pose in poses]),
            np.array([rigid.RotationMatrix2EulerParameters(pose[:3, :3]) for pose in poses]),
            motions[:, 3:],
            motions[:, :3],
            {
                name: float(self.placement.displacements[name][connector.axis_index])
                for name, connectors in self.model.springs.items()
                for connector in connectors
                if connector.angle_node is not None
            },
        )


def motion_matrix(placement: Placement) -> Array:
    """Angular velocities and velocities of the centres of mass by rates, shape (B, 6, n)."""
    jacobians = segment_jacobians(placement)
    matrices: list[Array] = []
    for name, segment in placement.tree.figure.bodies.items():
        matrix = jacobians[name]
        centre = body_pose(placement, segment)[:3, 3]
        matrices.append(np.vstack([matrix[:3], matrix[3:] - cross_matrix(centre) @ matrix[:3]]))
    return np.array(matrices)


def random_pose(model: ExudynModel, seed=0, size=0.4, speed=2.0, moment=0.35) -> Pose:
    """A pose and rates that closures, locks, links and drives allow."""
    rng, start = np.random.default_rng(seed), model.placement
    figure, prescribed = model.figure, model.prescribed
    displacements = {
        name: values + size * rng.uniform(-1.0, 1.0, values.size)
        for name, values in start.displacements.items()
    }
    displacements = prescribed.impose_displacements(displacements, moment)
    placement = close_loops(start.tree, displacements, fixed=prescribed.fixed_joints)
    rates = {n: speed * rng.normal(size=j.degrees_of_freedom) for n, j in figure.joints.items()}
    rates = prescribed.impose_rates(rates, moment, placement.displacements)
    moving = consistent_rates(placement, rates, fixed=prescribed.fixed_joints)
    return Pose(model, placement, moving, moment)
