"""The pose in which a figure comes to rest, going downhill from where it starts.

Every step is one of a creeping motion, whose friction is the figure's inertia times a number:
`(s M + K) dz = f`, with the forces f on the free displacements z and their slopes -K. The number s
is large where the way is steep or K would lead uphill, and falls to next to nothing where it does
not: then the steps are Newton's, and the rest pose is found to the last digits. No step takes a
displacement far, and none is taken that the forces do not help along.
"""

from cmath import sqrt
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, assert_never, cast

import numpy as np
from scipy.linalg import qr
from scipy.optimize import least_squares

from generator.diagnostics import MoverError
from generator.figure import AxisKind, Figure
from generator.kinematics.links import Coordinate
from generator.kinematics.placement import Placement, forward_kinematics
from generator.kinematics.prescribed import loop_closure_jacobian
from generator.loads import LoadKind
from generator.rotations import Array
from generator.simulation.model import ExudynModel, build_model
from generator.simulation.plan import Plan, resolve_springs
from generator.simulation.statics import StaticState
from springs import Joining

MAX_DISPLACEMENT_STEP = 0.1
"""Largest change of a displacement in a step [rad or m]."""

MAX_STEPS = 2000

NEUTRAL_RATE_SQUARED = 1e-3
"""Squares of rates nearer to zero than this count as zero [1/s^2]: a swing of three minutes."""

RUNAWAY_DISPLACEMENT = 0.25 * MAX_STEPS * MAX_DISPLACEMENT_STEP
"""What has gone so far [rad or m] and still goes, falls or turns without end."""

_RESIDUAL_TOLERANCE = 1e-11
"""Largest force at rest, of the largest that acts on the way or 1 N m."""

_MIN_DAMPING = 1e-7
"""Smallest s [1/s^2]; a direction without any stiffness needs some."""

_FINITE_DIFFERENCE_STEP = 1e-6
"""Change of a displacement that tells the slope of the forces [rad or m]."""


class NoEquilibriumError(MoverError):
    """The figure comes to no rest; the message says what still moves it."""


@dataclass(frozen=True)
class Equilibrium:
    """A pose at rest.

    Attributes:
        displacements: of all joints, shape (n,) [rad or m].
        residual: largest force left on a free displacement [N m or N].
        stiffness: smallest eigenvalue of the slope K by which the forces push back, over the free
            displacements, of its symmetric part [`stiffness_unit`]; None where nothing is free.
        stiffness_unit: N m/rad where all that is free turns, N/m where all slides, or both.
        slowest_rate_squared: square of the rate of the slowest small motion about the pose [1/s^2]: the smallest
            eigenvalue of inv(M) K with M the inertia, or the smallest real part of one. It does not
            depend on the displacements by which the pose is told. None where nothing is free.
        growth: rate at which small motions grow [1/s]. Not zero where an eigenvalue is below zero,
            or complex, as it may be with forces that follow the figure and with the weighted law:
            then swings grow. None where nothing is free.
        energy: of gravity and springs [J]; None where a law has none, as the weighted one.
        start_energy: the same where it started.
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
        """Whether small motions grow."""
        return self.growth is not None and self.growth**2 > NEUTRAL_RATE_SQUARED

    @property
    def state(self) -> str:
        """What kind of rest this is, as the end of a sentence."""
        if self.slowest_rate_squared is None:
            return "is at rest, in a pose to which it comes back"
        if self.slowest_rate_squared < -NEUTRAL_RATE_SQUARED:
            return "is at rest, in a pose that it leaves when it is touched"
        if self.has_growing_motions:
            return "is at rest, in a pose that it leaves in growing swings when it is touched"
        if self.slowest_rate_squared > NEUTRAL_RATE_SQUARED:
            return "is at rest, in a pose to which it comes back"
        return "is at rest, and some of its motions meet no force"


def find_equilibrium(figure: Figure, plan: Plan | None = None) -> Equilibrium:
    """Let a figure come to rest under gravity, constant loads and springs.

    Args:
        figure: what settles.
        plan: start pose, springs, gravity, loads as they are at its start, locked and linked
            joints; velocities are left out, and times are not looked at.

    Raises:
        NoRestError: it does not come to rest.
        MoverError: the figure or the plan cannot be built, or joints are driven.
    """
    plan = plan or Plan()
    if plan.drives:
        raise NoEquilibriumError("a joint that is driven does not come to rest")
    assembly = build_model(figure, replace(plan, velocities={}), resolve_springs(figure, plan))
    reduced = _ReducedModel(assembly)
    start = reduced.static_state(reduced.start[None])
    z, force, steps = _minimise(reduced)
    rest, free, slope = reduced.static_state(z[None]), z.size > 0, reduced.stiffness(z)
    stores = assembly.spring_set.joining is not Joining.WEIGHTED and all(
        one.is_conservative for one in assembly.coupled
    )
    slowest, growth = None, None
    if free:
        potential = stores and all(
            load.kind is LoadKind.GLOBAL_FORCE for load, *_ in assembly.loads
        )
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


def _minimise(reduced: "_ReducedModel") -> tuple[Array, Array, int]:
    """The independent displacements at rest, the forces left on them, and the number of steps.

    Raises NoRestError when there is no rest within so many steps.
    """
    z: Array = reduced.start
    force: Array = reduced.forces(z[None])[0]
    slope, inertia = reduced.stiffness(z), reduced.inertia(z)
    s, scale, steps = 1.0, 1.0, 0
    while _max_abs(force) > _RESIDUAL_TOLERANCE * scale:
        if steps == MAX_STEPS:
            raise NoEquilibriumError(reduced.no_equilibrium_message(z, force))
        steps += 1
        s = max(s, -2.0 * _smallest_eigenvalue(_scale_by_inertia(slope, inertia)))
        step: Array = np.asarray(np.linalg.lstsq(s * inertia + slope, force, rcond=1e-13)[0], float)
        step *= MAX_DISPLACEMENT_STEP / max(_max_abs(step), MAX_DISPLACEMENT_STEP)
        there: Array = reduced.forces((z + step)[None])[0]
        smaller = _max_abs(there) < _max_abs(force) and _max_abs(step) < _FINITE_DIFFERENCE_STEP
        if smaller or float((force + there) @ step) >= 0.0:
            z, force = z + step, there
            slope, inertia = reduced.stiffness(z), reduced.inertia(z)
            s = max(0.2 * s, _MIN_DAMPING)
        else:
            s = max(8.0 * s, 1e-3)
        scale = max(scale, _max_abs(force))
    return z, force, steps


def _max_abs(values: Array) -> float:
    return float(np.max(np.abs(values), initial=0.0))


def _smallest_eigenvalue(slope: Array) -> float:
    """Smallest eigenvalue of the symmetric part."""
    return float(np.linalg.eigvalsh(0.5 * (slope + slope.T))[0])


def _scale_by_inertia(slope: Array, inertia: Array) -> Array:
    """A slope over displacements that are scaled so that the inertia is one."""
    least = 1e-12 * float(np.trace(inertia))
    root = np.asarray(np.linalg.cholesky(inertia + least * np.eye(len(inertia))), float)
    half = np.asarray(np.linalg.solve(root, slope), float)
    return np.asarray(np.linalg.solve(root, half.T), float).T


def _small_motion_rates(slope: Array, inertia: Array, *, symmetric: bool) -> tuple[float, float]:
    """Smallest real part of the squares of their rates [1/s^2], and at what rate they grow [1/s].

    Where the forces have a potential, the slope is `symmetric` but for the error of its differences
    and is taken so: equal eigenvalues would come out complex.
    """
    scaled = _scale_by_inertia(slope, inertia)
    found = (
        np.linalg.eigvalsh(0.5 * (scaled + scaled.T)) if symmetric else np.linalg.eigvals(scaled)
    )
    squares = [complex(value) for value in found]
    return min(one.real for one in squares), max(abs(sqrt(one).imag) for one in squares)


class _ReducedModel:
    """A figure told by independent displacements: not prescribed, nor what loops make of others."""

    def __init__(self, assembly: ExudynModel) -> None:
        self._assembly = assembly
        self._tree = assembly.placement.tree
        self._prescribed = assembly.prescribed
        self._values = self._tree.kinematics.displacement_vector(assembly.placement.displacements)
        rows = loop_closure_jacobian(assembly.placement) @ self._prescribed.free_jacobian
        count = int(np.linalg.matrix_rank(rows, 1e-7)) if rows.size else 0
        order: list[int] = list(range(rows.shape[1]))
        if rows.size:
            order = cast("Any", qr)(rows, mode="r", pivoting=True)[-1].tolist()
        self._following = np.array(sorted(order[:count]), dtype=int)
        self._leading = np.array(sorted(order[count:]), dtype=int)
        self._free = np.linalg.pinv(self._prescribed.free_jacobian) @ self._values
        self._offset = self._values - self._prescribed.free_jacobian @ self._free
        self.start = self._free[self._leading]

    def static_state(self, rows: Array) -> StaticState:
        """The figure at independent displacements, shape (n, leading)."""
        return StaticState.from_displacements(
            self._assembly, np.array([self._tree_displacements(row) for row in rows])
        )

    def forces(self, rows: Array) -> Array:
        """Forces on the independent displacements, shape (n, leading)."""
        still = self.static_state(rows)
        forces = still.forces()
        if not self._following.size:
            return forces @ self._prescribed.free_jacobian
        moved = [self._coordinate_jacobian(placement) for placement in still.placements()]
        return np.stack([force @ one for force, one in zip(forces, moved, strict=True)])

    def _coordinate_jacobian(self, placement: Placement) -> Array:
        """Slope of the tree's displacements by the independent ones, shape (m, leading)."""
        columns = self._prescribed.free_jacobian
        loops = loop_closure_jacobian(placement) @ columns
        follow = -np.linalg.pinv(loops[:, self._following]) @ loops[:, self._leading]
        return columns[:, self._leading] + columns[:, self._following] @ follow

    def stiffness(self, z: Array) -> Array:
        """Minus the slope of the forces at z, shape (leading, leading)."""
        if not z.size:
            return np.zeros((0, 0))
        steps = _FINITE_DIFFERENCE_STEP * np.eye(z.size)
        ends = self.forces(np.concatenate([z + steps, z - steps]))
        return (ends[z.size :] - ends[: z.size]).T / (2.0 * _FINITE_DIFFERENCE_STEP)

    def inertia(self, z: Array) -> Array:
        """Generalized inertia of the independent displacements, shape (leading, leading)."""
        still = self.static_state(z[None])
        moved = self._coordinate_jacobian(still.placements()[0])
        return moved.T @ still.inertia() @ moved

    @property
    def stiffness_unit(self) -> str:
        """Of a stiffness over the independent displacements."""
        kinds = sorted({self._leading_coordinate(k)[1] for k in range(self._leading.size)})
        return " or ".join(_stiffness_unit(kind) for kind in kinds)

    def _leading_coordinate(self, k: int) -> tuple[Coordinate, AxisKind]:
        """The k-th independent displacement, and the kind of its axis."""
        freedom = self._prescribed.free_coordinates[int(self._leading[k])]
        return freedom, self._assembly.figure.joints[freedom.joint].chain[freedom.index].kind

    def no_equilibrium_message(self, z: Array, force: Array) -> str:
        """What is said of a figure that still moves."""
        freedom, kind = self._leading_coordinate(int(np.argmax(np.abs(force))))
        unit = _effort_unit(kind)
        said = (
            f"the figure comes to no rest: after {MAX_STEPS} steps {_max_abs(force):.3g} "
            f"{unit} still move {freedom}; "
        )
        gone = np.abs(z - self.start)
        if _max_abs(gone) < RUNAWAY_DISPLACEMENT:
            return said + "it does not go away, so another start may lead to a rest"
        farthest, kind = self._leading_coordinate(int(np.argmax(gone)))
        way = f"{_max_abs(gone):.3g} {_displacement_unit(kind)}"
        return said + f"{farthest} has gone {way}: what falls freely needs a spring or a lock"

    def _tree_displacements(self, z: Array) -> Array:
        """Displacements of the tree, shape (m,), with loops closed."""
        free = self._free.copy()
        free[self._leading] = z
        columns = self._prescribed.free_jacobian
        if not self._following.size:
            return self._offset + columns @ free

        def gaps(following: Array) -> Array:
            free[self._following] = following
            values = self._offset + columns @ free
            parts = {name: values[part] for name, part in self._tree.kinematics.columns.items()}
            placement = forward_kinematics(self._tree, parts)
            return np.concatenate(
                [
                    self._tree.chains[joint.name].pose_residual(placement.pose_in_parent(joint))
                    for joint in self._tree.closures
                ]
            )

        found = least_squares(
            gaps, free[self._following], xtol=1e-15, ftol=1e-15, gtol=1e-15, max_nfev=100
        )
        free[self._following] = found.x
        self._free[self._following] = found.x
        return self._offset + columns @ free


def _stiffness_unit(kind: AxisKind) -> str:
    match kind:
        case AxisKind.ROTATION:
            return "N m/rad"
        case AxisKind.TRANSLATION:
            return "N/m"
        case _:
            assert_never(kind)


def _effort_unit(kind: AxisKind) -> str:
    match kind:
        case AxisKind.ROTATION:
            return "N m"
        case AxisKind.TRANSLATION:
            return "N"
        case _:
            assert_never(kind)


def _displacement_unit(kind: AxisKind) -> str:
    match kind:
        case AxisKind.ROTATION:
            return "rad"
        case AxisKind.TRANSLATION:
            return "m"
        case _:
            assert_never(kind)
