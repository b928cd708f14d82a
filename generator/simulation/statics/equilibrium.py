"""The equilibrium that a figure reaches from its start by descending in energy.

Each step is a damped Newton step: `(s M + K) dz = f`, with the forces f on the free displacements
z, the stiffness K = -df/dz, the inertia M and a damping s. The damping is large where K is not
positive or a step overshoots, and decreases towards zero otherwise, so that the last steps are
Newton's. The length of a step is bounded, and a step is accepted only if the forces do work along
it.
"""

import time
from cmath import sqrt
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any, cast

import numpy as np
from scipy.linalg import qr
from scipy.optimize import least_squares

from generator.diagnostics import ModelError, MoverError
from generator.figure import Figure
from generator.kinematics.links import Coordinate
from generator.kinematics.placement import Displacements, Placement, forward_kinematics
from generator.kinematics.prescribed import loop_closure_jacobian
from generator.loads import LoadKind
from generator.model import Model
from generator.rotations import Array
from generator.simulation.plan import Plan
from generator.simulation.preconditions import singular_orientation
from generator.simulation.run_model import RunModel, prepare_run
from generator.simulation.statics.static_forces import StaticState
from generator.simulation.trace import pole_message
from generator.units import AxisUnits
from springs import Singularity, SphericalLaw

MAX_DISPLACEMENT_STEP = 0.1
"""Largest change of a displacement per step [rad or m]."""

MAX_STEPS = 2000

NEUTRAL_RATE_SQUARED = 1e-3
"""Magnitude of a squared rate that counts as zero [1/s^2]: an oscillation of three minutes."""

RUNAWAY_DISPLACEMENT = 0.25 * MAX_STEPS * MAX_DISPLACEMENT_STEP
"""Displacement beyond which a figure is reported to fall or turn without end [rad or m]."""

_RESIDUAL_TOLERANCE = 1e-11
"""Largest residual force, relative to the largest force met or to 1 N m."""

_MIN_DAMPING = 1e-7
"""Smallest s [1/s^2], for directions without stiffness."""

_FINITE_DIFFERENCE_STEP = 1e-6
"""Step of the finite differences of the forces [rad or m]."""


class NoEquilibriumError(MoverError):
    """The search found no equilibrium; the message names the largest remaining force."""


@dataclass(frozen=True)
class Equilibrium:
    """A pose at rest.

    Attributes:
        displacements: displacements by joint, shape (n,) [rad or m].
        residual: largest force on a free displacement [N m or N].
        stiffness: smallest eigenvalue of the symmetric part of the stiffness K over the free
            displacements [`stiffness_unit`]; None if nothing is free.
        stiffness_unit: N m/rad if all free displacements are angles, N/m if lengths, or both.
        slowest_rate_squared: square of the rate of the slowest small motion about the pose [1/s^2]:
            the smallest real part of an eigenvalue of inv(M) K, with M the inertia. It does not
            depend on the choice of displacements. None if nothing is free.
        growth: rate at which small motions grow [1/s]; positive if an eigenvalue is negative or
            complex, as it may be with follower forces and with the weighted law. None if nothing is
            free.
        energy: energy of gravity and springs [J]; None if a law has none, such as the weighted one.
        start_energy: the same energy at the start.
        steps: number of steps taken.
    """

    displacements: Mapping[str, Array]
    residual: float
    stiffness: float | None
    stiffness_unit: str
    slowest_rate_squared: float | None
    growth: float | None
    energy: float | None
    start_energy: float | None
    steps: int

    @property
    def has_growing_motions(self) -> bool:
        """True if small motions grow."""
        return self.growth is not None and self.growth**2 > NEUTRAL_RATE_SQUARED

    @property
    def state(self) -> str:
        """Kind of the equilibrium, as the end of a sentence."""
        if self.slowest_rate_squared is None:
            return "is at rest in a stable pose"
        if self.slowest_rate_squared < -NEUTRAL_RATE_SQUARED:
            return "is at rest in an unstable pose, which it leaves if disturbed"
        if self.has_growing_motions:
            return "is at rest in an unstable pose, which it leaves in growing swings if disturbed"
        if self.slowest_rate_squared > NEUTRAL_RATE_SQUARED:
            return "is at rest in a stable pose"
        return "is at rest in a neutral pose: some of its motions meet no force"


@dataclass(frozen=True)
class SearchProgress:
    """Progress of a search: steps taken, and the largest force left [N m or N]."""

    steps: int
    force: float


def find_equilibrium(
    model: Model | Figure,
    plan: Plan | None = None,
    watch: Callable[[SearchProgress], None] | None = None,
) -> Equilibrium:
    """Find the equilibrium of a model under gravity, constant loads and springs.

    Args:
        model: Figure with springs, as for `simulate`.
        plan: initial pose, springs, gravity, loads at the start time, locked and linked joints;
            velocities and other times are ignored.
        watch: called with the progress after every step.

    Raises:
        NoEquilibriumError: the figure does not come to rest, or not within the wall limit, or a
            joint comes to the pole of a law of coordinates.
        MoverError: the figure or the plan cannot be built, joints are driven, or there are props
            or tone.
    """
    plan = plan or Plan()
    if plan.drives:
        raise NoEquilibriumError("a driven joint does not come to rest")
    if plan.tone:
        raise ModelError("find_equilibrium is of passive joints: leave out the tone of the plan")
    if plan.scene.props:
        raise ModelError(
            "find_equilibrium ignores props: call find_resting_pose for a pose on them"
        )
    built = prepare_run(model, replace(plan, velocities={}))
    reduced = _ReducedModel(built)
    start = reduced.static_state(reduced.start[None])
    z, force, steps = _minimise(reduced, plan.wall_limit, watch)
    rest, free, slope = reduced.static_state(z[None]), z.size > 0, reduced.stiffness(z)
    stores = built.spring_set.law is not SphericalLaw.WEIGHTED and all(
        spring.law.is_conservative for spring in built.coupled
    )
    slowest, growth = None, None
    if free:
        potential = stores and all(load.kind is LoadKind.GLOBAL_FORCE for load in built.loads)
        slowest, growth = _small_motion_rates(slope, reduced.inertia(z), symmetric=potential)
    return Equilibrium(
        {name: moved.displacements[0] for name, moved in rest.joints.items()},
        _max_abs(force),
        _smallest_eigenvalue(slope) if free else None,
        reduced.stiffness_unit,
        slowest,
        growth,
        float(rest.energy()[0]) if stores else None,
        float(start.energy()[0]) if stores else None,
        steps,
    )


def _minimise(
    reduced: "_ReducedModel",
    wall_limit: float,
    watch: Callable[[SearchProgress], None] | None,
) -> tuple[Array, Array, int]:
    """Return the independent displacements at rest, the residual forces and the number of steps.

    Raises NoEquilibriumError if `MAX_STEPS` or the wall limit [s] do not reach equilibrium, or the
    way there leads a joint to its pole.
    """
    deadline = time.monotonic() + wall_limit
    z: Array = reduced.start
    force: Array = reduced.forces(z[None])[0]
    slope, inertia = reduced.stiffness(z), reduced.inertia(z)
    s, scale, steps = 1.0, 1.0, 0
    while _max_abs(force) > _RESIDUAL_TOLERANCE * scale:
        if steps == MAX_STEPS:
            raise NoEquilibriumError(reduced.no_equilibrium_message(z, force))
        if time.monotonic() > deadline:
            raise NoEquilibriumError(
                f"the wall-time limit of {wall_limit:g} s was reached after {steps} steps, with "
                f"{_max_abs(force):.3g} N m or N left"
            )
        steps += 1
        s = max(s, -2.0 * _smallest_eigenvalue(_scale_by_inertia(slope, inertia)))
        step: Array = np.asarray(np.linalg.lstsq(s * inertia + slope, force, rcond=1e-13)[0], float)
        step *= MAX_DISPLACEMENT_STEP / max(_max_abs(step), MAX_DISPLACEMENT_STEP)
        next_force: Array = reduced.forces((z + step)[None])[0]
        smaller = (
            _max_abs(next_force) < _max_abs(force) and _max_abs(step) < _FINITE_DIFFERENCE_STEP
        )
        if smaller or float((force + next_force) @ step) >= 0.0:
            z, force = z + step, next_force
            at_pole = reduced.joint_at_pole(z)
            if at_pole is not None:
                raise NoEquilibriumError(
                    f"{pole_message(at_pole, f'after {steps} steps')}; give this rotation limits, "
                    "or start nearer to the pose at rest"
                )
            slope, inertia = reduced.stiffness(z), reduced.inertia(z)
            s = max(0.2 * s, _MIN_DAMPING)
        else:
            s = max(8.0 * s, 1e-3)
        scale = max(scale, _max_abs(force))
        if watch is not None:
            watch(SearchProgress(steps, _max_abs(force)))
    return z, force, steps


def _max_abs(values: Array) -> float:
    return float(np.max(np.abs(values), initial=0.0))


def _smallest_eigenvalue(slope: Array) -> float:
    """Smallest eigenvalue of the symmetric part of a stiffness."""
    return float(np.linalg.eigvalsh(0.5 * (slope + slope.T))[0])


def _scale_by_inertia(slope: Array, inertia: Array) -> Array:
    """Stiffness over displacements scaled to unit inertia."""
    least = 1e-12 * float(np.trace(inertia))
    root = np.asarray(np.linalg.cholesky(inertia + least * np.eye(len(inertia))), float)
    half_scaled = np.asarray(np.linalg.solve(root, slope), float)
    return np.asarray(np.linalg.solve(root, half_scaled.T), float).T


def _small_motion_rates(slope: Array, inertia: Array, *, symmetric: bool) -> tuple[float, float]:
    """Smallest real part of their squared rates [1/s^2], and their growth rate [1/s].

    If the forces have a potential, the stiffness is symmetric except for the error of the finite
    differences; `symmetric` removes this error, which would make equal eigenvalues complex.
    """
    scaled = _scale_by_inertia(slope, inertia)
    eigenvalues = (
        np.linalg.eigvalsh(0.5 * (scaled + scaled.T)) if symmetric else np.linalg.eigvals(scaled)
    )
    squares = [complex(value) for value in eigenvalues]
    return min(square.real for square in squares), max(abs(sqrt(square).imag) for square in squares)


class _ReducedModel:
    """A figure in its independent displacements, with prescriptions and closed loops."""

    def __init__(self, model: RunModel) -> None:
        self._model = model
        self._tree = model.placement.tree
        self._prescribed = model.prescribed
        self._values = self._tree.kinematics.displacement_vector(model.placement.displacements)
        columns = self._prescribed.free_jacobian(model.placement.displacements)
        rows = loop_closure_jacobian(model.placement) @ columns
        count = int(np.linalg.matrix_rank(rows, 1e-7)) if rows.size else 0
        order: list[int] = list(range(rows.shape[1]))
        if rows.size:
            order = cast("Any", qr)(rows, mode="r", pivoting=True)[-1].tolist()
        self._following = np.array(sorted(order[:count]), dtype=int)
        self._leading = np.array(sorted(order[count:]), dtype=int)
        places = {one: k for k, one in enumerate(self._prescribed.coordinates)}
        self._places = [places[one] for one in self._prescribed.free_coordinates]
        self._free = self._values[self._places]
        self.start = self._free[self._leading]
        coupled = {axis.joint for one in model.coupled for axis in one.axes}
        self._joints_with_pole = [
            model.figure.joints[name]
            for name, connectors in model.springs.items()
            for connector in connectors
            if connector.law is not None
            and connector.law.singularity is Singularity.POLE
            and (name in coupled or any(spring.elastic for spring in connector.springs))
        ]

    def static_state(self, rows: Array) -> StaticState:
        """The figure at independent displacements, shape (n, leading)."""
        return StaticState.from_displacements(
            self._model, np.array([self._tree_displacements(row) for row in rows])
        )

    def forces(self, rows: Array) -> Array:
        """Forces on the independent displacements, shape (n, leading)."""
        state = self.static_state(rows)
        forces = state.forces()
        if not self._prescribed and not self._following.size:
            return forces[:, self._places]
        jacobians = [self._coordinate_jacobian(placement) for placement in state.placements()]
        return np.stack(
            [force @ jacobian for force, jacobian in zip(forces, jacobians, strict=True)]
        )

    def joint_at_pole(self, z: Array) -> str | None:
        """Return a joint that is at its pole or beyond, where its law has no torque."""
        if not self._joints_with_pole:
            return None
        placement, law = self.static_state(z[None]).placements()[0], self._model.spring_set.law
        found = (one for one in self._joints_with_pole if singular_orientation(placement, one, law))
        return next((joint.name for joint in found), None)

    def _coordinate_jacobian(self, placement: Placement) -> Array:
        """Derivative of the tree's displacements with respect to the independent, (m, leading)."""
        columns = self._prescribed.free_jacobian(placement.displacements)
        loops = loop_closure_jacobian(placement) @ columns
        follow = -np.linalg.pinv(loops[:, self._following]) @ loops[:, self._leading]
        return columns[:, self._leading] + columns[:, self._following] @ follow

    def stiffness(self, z: Array) -> Array:
        """Stiffness: minus the derivative of the forces at z, shape (leading, leading)."""
        if not z.size:
            return np.zeros((0, 0))
        steps = _FINITE_DIFFERENCE_STEP * np.eye(z.size)
        ends = self.forces(np.concatenate([z + steps, z - steps]))
        return (ends[z.size :] - ends[: z.size]).T / (2.0 * _FINITE_DIFFERENCE_STEP)

    def inertia(self, z: Array) -> Array:
        """Generalized inertia of the independent displacements, shape (leading, leading)."""
        state = self.static_state(z[None])
        jacobian = self._coordinate_jacobian(state.placements()[0])
        return jacobian.T @ state.inertia() @ jacobian

    @property
    def stiffness_unit(self) -> str:
        """Unit of a stiffness over the independent displacements."""
        units = {self._leading_coordinate(k)[1].stiffness for k in range(self._leading.size)}
        return " or ".join(sorted(units))

    def _leading_coordinate(self, k: int) -> tuple[Coordinate, AxisUnits]:
        """Return the k-th independent displacement and the units of its axis."""
        freedom = self._prescribed.free_coordinates[int(self._leading[k])]
        return freedom, self._model.figure.joints[freedom.joint].chain[freedom.index].units

    def no_equilibrium_message(self, z: Array, force: Array) -> str:
        """Message for a figure that has not come to rest."""
        freedom, units = self._leading_coordinate(int(np.argmax(np.abs(force))))
        message = (
            f"the figure does not come to rest: after {MAX_STEPS} steps {_max_abs(force):.3g} "
            f"{units.effort} still act on {freedom}; "
        )
        distance = np.abs(z - self.start)
        if _max_abs(distance) < RUNAWAY_DISPLACEMENT:
            return message + "it stays nearby, so another start may reach an equilibrium"
        farthest, units = self._leading_coordinate(int(np.argmax(distance)))
        way = f"{_max_abs(distance):.3g} {units.si}"
        return (
            message
            + f"{farthest} has moved {way}: add a spring or a lock to a joint that falls freely"
        )

    def _tree_displacements(self, z: Array) -> Array:
        """Displacements of the tree, shape (m,), with loops closed."""
        free = self._free.copy()
        free[self._leading] = z
        if not self._following.size:
            return self._tree.kinematics.displacement_vector(self._imposed(free))

        def gaps(following: Array) -> Array:
            free[self._following] = following
            placement = forward_kinematics(self._tree, self._imposed(free))
            return np.concatenate(
                [
                    self._tree.chains[joint.name].pose_residual(placement.pose_in_parent(joint))
                    for joint in self._tree.closures
                ]
            )

        solution = least_squares(
            gaps, free[self._following], xtol=1e-15, ftol=1e-15, gtol=1e-15, max_nfev=100
        )
        free[self._following] = solution.x
        self._free[self._following] = solution.x
        return self._tree.kinematics.displacement_vector(self._imposed(free))

    def _imposed(self, free: Array) -> Displacements:
        """Displacements of the tree's joints by the free ones."""
        values = self._values.copy()
        values[self._places] = free
        parts = {name: values[part] for name, part in self._tree.kinematics.columns.items()}
        return self._prescribed.impose_displacements(parts, self._model.plan.start)
