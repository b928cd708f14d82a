"""What one pass of the integrator leaves: the state of the bodies at every frame."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from generator.rotations import Array, matrix_from_rotation_vector, rotation_vector_from_matrix


@dataclass(frozen=True)
class Trace:
    """States at n frames of B bodies, in world axes.

    Attributes:
        times: shape (n,) [s].
        positions: of the centres of mass, shape (n, B, 3) [m].
        rotations: of the segment axes, shape (n, B, 3, 3).
        velocities: of the centres of mass, shape (n, B, 3) [m/s].
        angular_velocities: angular velocities, shape (n, B, 3) [rad/s].
        multipliers: of each constraint item of each joint, shape (n, items, 6), as Exudyn tells
            them.
        dissipated: energy taken by damping since the start, shape (n,) [J].
        spring_work: work done since the start against springs that have no energy, shape (n,) [J].
        load_work: work done by loads and drives since the start, shape (n,) [J].
        coordinate_multipliers: multipliers of the servos' rows, shape (n, rows) [N m]: minus the torques.
    """

    times: Array
    positions: Array
    rotations: Array
    velocities: Array
    angular_velocities: Array
    multipliers: Mapping[str, Array]
    dissipated: Array
    spring_work: Array
    load_work: Array
    coordinate_multipliers: Array = field(default_factory=lambda: np.zeros((0, 0)))

    def __len__(self) -> int:
        """Number of frames."""
        return self.times.size

    def first_frames(self, count: int) -> "Trace":
        """The first `count` frames."""
        return self._map_arrays(lambda values: values[:count])

    def with_motion(
        self, positions: Array, rotations: Array, velocities: Array, angular_velocities: Array
    ) -> "Trace":
        """The same with the bodies elsewhere; shapes and axes as those of the attributes."""
        return replace(
            self,
            positions=positions,
            rotations=rotations,
            velocities=velocities,
            angular_velocities=angular_velocities,
        )

    def extend_from(self, longer: "Trace") -> "Trace":
        """These frames, and after them those that another trace has more."""
        count = len(self)

        def after(mine: Array, others: Array) -> Array:
            return np.concatenate([mine, others[count:]])

        return Trace(
            after(self.times, longer.times),
            after(self.positions, longer.positions),
            after(self.rotations, longer.rotations),
            after(self.velocities, longer.velocities),
            after(self.angular_velocities, longer.angular_velocities),
            {name: after(m, longer.multipliers[name]) for name, m in self.multipliers.items()},
            after(self.dissipated, longer.dissipated),
            after(self.spring_work, longer.spring_work),
            after(self.load_work, longer.load_work),
            after(self.coordinate_multipliers, longer.coordinate_multipliers),
        )

    def _map_arrays(self, change: Callable[[Array], Array]) -> "Trace":
        multipliers = {name: change(values) for name, values in self.multipliers.items()}
        return Trace(
            change(self.times),
            change(self.positions),
            change(self.rotations),
            change(self.velocities),
            change(self.angular_velocities),
            multipliers,
            change(self.dissipated),
            change(self.spring_work),
            change(self.load_work),
            change(self.coordinate_multipliers),
        )


def richardson_extrapolation(coarse: Trace, fine: Trace, ratio: float) -> Trace:
    """Richardson's limit of two passes of a second-order method with steps `ratio` to 1.

    Vectors are extrapolated as they are, rotations along the shortest way from the coarse to the
    fine one. Frames that only one pass has are left out.
    """
    count = min(len(coarse), len(fine))
    coarse, fine = coarse.first_frames(count), fine.first_frames(count)
    gain = 1.0 / (ratio**2 - 1.0)

    def limit(one: Array, other: Array) -> Array:
        return other + gain * (other - one)

    step = rotation_vector_from_matrix(np.swapaxes(coarse.rotations, -1, -2) @ fine.rotations)
    return Trace(
        fine.times,
        limit(coarse.positions, fine.positions),
        fine.rotations @ matrix_from_rotation_vector(gain * step),
        limit(coarse.velocities, fine.velocities),
        limit(coarse.angular_velocities, fine.angular_velocities),
        {name: limit(coarse.multipliers[name], m) for name, m in fine.multipliers.items()},
        limit(coarse.dissipated, fine.dissipated),
        limit(coarse.spring_work, fine.spring_work),
        limit(coarse.load_work, fine.load_work),
        limit(coarse.coordinate_multipliers, fine.coordinate_multipliers),
    )


def rotations_from_parameters(parameters: Array) -> Array:
    """Rotation matrices of Euler parameters (scalar first), shape (..., 4) to (..., 3, 3)."""
    e = parameters / np.linalg.norm(parameters, axis=-1, keepdims=True)
    w, x, y, z = (e[..., k] for k in range(4))
    rows = [
        [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
        [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
        [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)],
    ]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def angular_velocities_from_parameters(parameters: Array, rates: Array) -> Array:
    """Angular velocities in world axes [rad/s] of Euler parameters and rates: (..., 4) each."""
    scalar, vector = parameters[..., :1], parameters[..., 1:]
    scalar_rate, vector_rate = rates[..., :1], rates[..., 1:]
    return 2.0 * (scalar * vector_rate - scalar_rate * vector + np.cross(vector, vector_rate))
