"""Accelerations that Exudyn's forces, masses and constraints imply at any state.

Other evaluations of a model are compared with them. The accelerations a of the bodies and the
multipliers m solve

    M a + C^T m = Q,    C a = g,

where the mass matrix M, the forces Q and the rates C v of the constraints are Exudyn's. The
accelerations are angular and linear ones instead of the second derivatives of Euler parameters:
changes of the parameters' lengths contribute neither to M nor to C. The columns of C are the rates
at unit velocities; bodies without a common constraint share an evaluation. Exudyn's own differences
give the bias g with an error of 1e-7. Here the rates are differenced along the motion with an error
of rounding: those of joints are polynomials in the coordinates, those of links and drives are
smooth.
"""

from collections.abc import Callable, Generator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from generator.diagnostics import ModelError
from generator.rotations import Array
from generator.simulation.exudyn_model.exudyn_api import exu
from generator.simulation.exudyn_model.model import ExudynModel
from generator.simulation.exudyn_run import Multipliers, current_multipliers

if TYPE_CHECKING:
    from scipy.sparse import csc_array

Indices = NDArray[np.int64]

_COORDINATES = 7
"""Number of coordinates of a rigid body with Euler parameters."""

_MOTIONS = 6
"""Number of independent accelerations of a body: angular, then linear."""

_STENCIL = (
    (1.0, 4.0 / 5.0),
    (2.0, -1.0 / 5.0),
    (3.0, 4.0 / 105.0),
    (4.0, -1.0 / 280.0),
)
"""Distances and weights of a symmetric first difference, exact for polynomials of degree 8."""

_POLYNOMIAL_STEP = 0.3
"""Largest change of a coordinate in a step of the stencil for joints [1 or m]."""

_SMOOTH_STEP = 0.001
"""The same for links and drives."""

_SOLUTION_SWEEPS = 2
"""Number of solutions of the linear equations, each for the residual of those before it."""

_MAX_DENSE_BODIES = 8
"""Number of bodies above which the linear equations are solved as sparse ones."""

_MAX_CONSTRAINT_ERROR = 1e-9
"""Largest relative error of the constraints' second derivatives; above it they are dependent."""

_DEPENDENT_CONSTRAINTS = "the constraints of the model depend on each other in this pose"


@dataclass(frozen=True)
class BodyState:
    """State of B bodies, in the order of the figure's bodies, in world axes.

    Attributes:
        time: [s].
        positions: positions of the centres of mass, shape (B, 3) [m].
        parameters: unit Euler parameters of the segment axes, scalar first, shape (B, 4).
        velocities: velocities of the centres of mass, shape (B, 3) [m/s].
        angular_velocities: shape (B, 3) [rad/s].
        angles: unwrapped angle of each revolute joint with springs, or in a coupled law [rad].
    """

    time: float
    positions: Array
    parameters: Array
    velocities: Array
    angular_velocities: Array
    angles: Mapping[str, float]


@dataclass(frozen=True)
class _ConstraintPattern:
    """Places of the nonzero columns of the constraints' Jacobian.

    Attributes:
        shape: numbers of rows and of columns.
        colours: colours of each body; bodies of one colour have no constraint in common, shape
            (B,).
        rows: row of each entry.
        columns: column of each entry.
        probes: index of the unit velocities that give each entry.
    """

    shape: tuple[int, int]
    colours: Indices
    rows: Indices
    columns: Indices
    probes: Indices


class ExudynEquations:
    """Exudyn's equations of motion of a model, evaluated without a step.

    The model keeps its state and can be integrated afterwards.
    """

    def __init__(self, model: ExudynModel) -> None:
        """Set up the evaluation of a model that has been assembled.

        Exudyn then clears the values that sensors have stored, so this must not be done in a run.
        """
        self._model, self._data = model, model.mbs.systemData
        settings = exu.SimulationSettings()
        settings.timeIntegration.numberOfSteps = 1
        settings.timeIntegration.generalizedAlpha.computeInitialAccelerations = False
        settings.solution.file.write = False
        settings.linearSolver.solverType = exu.LinearSolverType.EigenSparse
        self._solver: Any = exu.MainSolverImplicitSecondOrder()
        self._count = _COORDINATES * len(model.figure.bodies)
        self._reference = np.array(
            self._data.GetODE2Coordinates(configuration=exu.ConfigurationType.Reference)
        )[: self._count]
        self._size = int(self._data.ODE2Size())
        self._has_clock = self._size > self._count
        with self._state_kept():
            self._solver.InitializeSolver(model.mbs, settings)
        self._pattern = self._constraint_pattern()
        self._angle_indices = {
            name: int(self._data.GetNodeLTGData(connector.angle_node)[0])
            for name, connectors in model.springs.items()
            for connector in connectors
            if connector.angle_node is not None
        }

    def accelerations(self, state: BodyState) -> Array:
        """Accelerations of the bodies in world axes, shape (B, 6).

        For each body: the angular acceleration [rad/s2], then that of the centre of mass [m/s2].

        Raises:
            ModelError: the constraints depend on each other in this pose.
        """
        with self._state_kept():
            return self._solve(state)[0]

    def multipliers(self, state: BodyState) -> Multipliers:
        """Multipliers of all constraints, as the trace of a run holds them.

        Raises:
            ModelError: the constraints depend on each other in this pose.
        """
        with self._state_kept():
            _, multipliers = self._solve(state)
            self._data.SetAECoordinates(multipliers.tolist())
            return current_multipliers(self._model)

    @contextmanager
    def _state_kept(self) -> Generator[None]:
        """Restore the current state of the model at the end."""
        time, before = float(self._data.GetTime()), self._data.GetSystemState()
        try:
            yield
        finally:
            self._data.SetSystemState(before)
            self._data.SetTime(time)

    def _constraint_pattern(self) -> _ConstraintPattern:
        model, figure = self._model, self._model.figure
        bodies = {name: k for k, name in enumerate(figure.bodies)}
        items = [
            (constraint.item, {name})
            for name, constraints in model.joints.items()
            for constraint in constraints
        ]
        items += [
            (constraint.item, {term.joint for row in constraint.equations for term in row})
            for constraint in model.coordinate_constraints
        ]
        groups: list[tuple[list[int], list[int]]] = []
        for item, joints in items:
            segments = {ref.segment for name in joints for ref in figure.joints[name].ends}
            coupled = [bodies[name] for name in segments if name in bodies]
            groups.append((list(self._data.GetObjectLTGAE(item)), coupled))
        colours = _colours(len(bodies), [coupled for _, coupled in groups])
        entries = [
            (row, _MOTIONS * body + k, _MOTIONS * int(colours[body]) + k)
            for rows, coupled in groups
            for row in rows
            for body in coupled
            for k in range(_MOTIONS)
        ]
        rows, columns, probes = np.array(entries, dtype=np.int64).reshape(-1, 3).T
        shape = (int(self._data.AEsize()), _MOTIONS * len(bodies))
        return _ConstraintPattern(shape, colours, rows, columns, probes)

    def _solve(self, state: BodyState) -> tuple[Array, Array]:
        """Set a state and return its accelerations (B, 6) and multipliers (rows,)."""
        basis = _velocity_basis(state.parameters)
        speeds = np.concatenate([state.angular_velocities, state.velocities], axis=1)
        rates = (basis @ speeds[..., None])[..., 0]
        coordinates = np.concatenate([state.positions, state.parameters], axis=1)
        coordinates = coordinates.ravel() - self._reference
        self._set_state(state, coordinates, rates.ravel())
        forces, masses = self._forces_and_masses()
        forces = np.swapaxes(basis, 1, 2) @ forces[..., None]
        masses = np.swapaxes(basis, 1, 2) @ masses @ basis
        jacobian = self._jacobian(basis)
        right = -self._bias(coordinates, rates.ravel())
        return _solve_constrained(masses, forces.reshape(-1), jacobian, right)

    def _set_state(self, state: BodyState, coordinates: Array, rates: Array) -> None:
        data = self._data
        data.SetTime(state.time)
        self._set_coordinates(coordinates)
        data.SetODE2Coordinates_t([*rates.tolist(), *([1.0] * self._has_clock)])
        # The equations of unused constraint rows return the multipliers.
        data.SetAECoordinates([0.0] * self._pattern.shape[0])
        if self._angle_indices:
            angles = np.array(data.GetDataCoordinates())
            for name, index in self._angle_indices.items():
                angles[index] = state.angles[name]
            data.SetDataCoordinates(angles.tolist())

    def _set_coordinates(self, coordinates: Array) -> None:
        """Set the coordinates of the bodies, and the clock of drives."""
        clock = [self._data.GetTime()] if self._has_clock else []
        self._data.SetODE2Coordinates([*coordinates.tolist(), *clock])

    def _forces_and_masses(self) -> tuple[Array, Array]:
        """Forces (B, 7) and mass matrices (B, 7, 7) of the bodies' coordinates."""
        count = self._count // _COORDINATES
        self._solver.ComputeODE2RHS(self._model.mbs)
        forces = np.array(self._solver.GetSystemResidual())[: self._count]
        self._solver.ComputeMassMatrix(self._model.mbs)
        matrix = np.asarray(self._solver.GetSystemMassMatrix())[: self._count, : self._count]
        blocks = matrix.reshape(count, _COORDINATES, count, _COORDINATES)
        bodies = np.arange(count)
        return forces.reshape(count, _COORDINATES), blocks[bodies, :, bodies, :]

    def _rates(self, rates: Array) -> Array:
        """Rates of all constraints for rates of the bodies' coordinates, shape (rows,)."""
        self._data.SetODE2Coordinates_t([*rates.tolist(), *([0.0] * self._has_clock)])
        self._solver.ComputeAlgebraicEquations(self._model.mbs, True)
        return np.array(self._solver.GetSystemResidual())[self._size :]

    def _jacobian(self, basis: Array) -> "Array | csc_array":
        """Rates of all constraints for unit velocities of the bodies."""
        pattern, count = self._pattern, len(basis)
        if not pattern.rows.size:
            return np.zeros(pattern.shape)
        probes: list[Array] = []
        for colour in range(int(pattern.colours.max()) + 1):
            coloured = basis * (pattern.colours == colour)[:, None, None]
            probes += [
                self._rates(coloured[:, :, k].reshape(count * _COORDINATES))
                for k in range(_MOTIONS)
            ]
        entries = np.array(probes)[pattern.probes, pattern.rows]
        if count <= _MAX_DENSE_BODIES:
            matrix = np.zeros(pattern.shape)
            matrix[pattern.rows, pattern.columns] = entries
            return matrix
        from scipy.sparse import csc_array

        return csc_array((entries, (pattern.rows, pattern.columns)), shape=pattern.shape)

    def _bias(self, coordinates: Array, rates: Array) -> Array:
        """Derivatives of the rates of all constraints at constant rates of the coordinates."""
        speed = float(np.max(np.abs(rates))) or 1.0
        bias = self._rates_of_change(coordinates, rates, _POLYNOMIAL_STEP / speed)
        if not self._model.coordinate_constraints:
            return bias
        constraints = [one.rate_constraint for one in self._model.coordinate_constraints]
        for one in constraints:  # so that no stencil spans pieces of a curve
            one.hold_pieces(hold=True)
        self._rates(rates)
        smooth = self._rates_of_change(coordinates, rates, _SMOOTH_STEP / speed)
        for one in constraints:
            one.hold_pieces(hold=False)
        for constraint in self._model.coordinate_constraints:
            rows = list(self._data.GetObjectLTGAE(constraint.item))
            bias[rows] = smooth[rows]
            driven = constraint.rate_constraint.driven_rotation
            if driven is not None:
                bias[rows] -= driven.accelerations(float(self._data.GetTime()))
        return bias

    def _rates_of_change(self, coordinates: Array, rates: Array, step: float) -> Array:
        """Difference the rates of all constraints along the motion, at the same time."""
        total = np.zeros(self._pattern.shape[0])
        for distance, weight in _STENCIL:
            for sign in (1.0, -1.0):
                self._set_coordinates(coordinates + sign * distance * step * rates)
                total += sign * weight * self._rates(rates)
        self._set_coordinates(coordinates)
        return total / step


def _colours(count: int, groups: list[list[int]]) -> Indices:
    """Colours of bodies, of which two that share a group differ, shape (count,)."""
    neighbours: list[set[int]] = [set() for _ in range(count)]
    for group in groups:
        for body in group:
            neighbours[body].update(group)
    colours = np.full(count, -1, dtype=np.int64)
    for body in range(count):
        taken = {int(colours[other]) for other in neighbours[body]}
        colours[body] = next(k for k in range(count) if k not in taken)
    return colours


def _velocity_basis(parameters: Array) -> Array:
    """Rates of the coordinates for unit angular and linear velocities, shape (B, 7, 6)."""
    w, x, y, z = parameters.T
    basis = np.zeros((len(parameters), _COORDINATES, _MOTIONS))
    basis[:, 3:, :3] = 0.5 * np.moveaxis(
        np.array([[-x, -y, -z], [w, z, -y], [-z, w, x], [y, -x, w]]), 2, 0
    )
    basis[:, :3, 3:] = np.eye(3)
    return basis


def _saddle_point_solver(masses: Array, c: "Array | csc_array") -> Callable[[Array], Array]:
    """Return the solution of [[M, C^T], [C, 0]] x = r as a function of r, shape (6 B + rows,).

    M is not eliminated: for bodies of very different masses the rows of C M^-1 C^T differ so much
    that its solution would lose the accelerations of the light ones.

    Raises:
        ModelError: the rows of C depend on each other.
    """
    count, rows = len(masses), c.shape[0]
    size = _MOTIONS * count
    try:
        if isinstance(c, np.ndarray):
            matrix = np.zeros((size + rows, size + rows))
            blocks = matrix[:size, :size].reshape(count, _MOTIONS, count, _MOTIONS)
            blocks[np.arange(count), :, np.arange(count), :] = masses
            matrix[:size, size:], matrix[size:, :size] = c.T, c
            inverse = np.linalg.inv(matrix)
            return lambda right: inverse @ right
        from scipy.sparse import block_array, bsr_array, csc_array
        from scipy.sparse.linalg import splu

        diagonal = bsr_array((masses, np.arange(count), np.arange(count + 1)))
        return splu(csc_array(block_array([[diagonal, c.T], [c, None]]))).solve
    except (np.linalg.LinAlgError, RuntimeError):
        raise ModelError(_DEPENDENT_CONSTRAINTS) from None


def _solve_constrained(
    masses: Array, forces: Array, jacobian: "Array | csc_array", right: Array
) -> tuple[Array, Array]:
    """Return accelerations (B, 6) and multipliers (rows,), which are zero for unused rows.

    Args:
        masses: masses of the bodies, shape (B, 6, 6).
        forces: forces on them, shape (6 B,).
        jacobian: C, shape (rows, 6 B).
        right: g, shape (rows,).
    """
    count, size = len(masses), forces.size
    used = np.flatnonzero(abs(jacobian).sum(axis=1))
    c, g = jacobian[used], right[used]
    solve = _saddle_point_solver(masses, c)
    accelerations, multipliers = np.zeros(size), np.zeros(used.size)
    for _ in range(_SOLUTION_SWEEPS):
        product = (masses @ accelerations.reshape(count, _MOTIONS, 1)).reshape(-1)
        residual = forces - product - c.T @ multipliers
        change = solve(np.concatenate([residual, g - c @ accelerations]))
        accelerations += change[:size]
        multipliers += change[size:]
    free = np.linalg.solve(masses, forces.reshape(count, _MOTIONS, 1))
    error = np.max(np.abs(c @ accelerations - g), initial=0.0)
    scale = np.max(abs(c) @ np.abs(accelerations) + np.abs(g), initial=0.0)
    scale = max(scale, np.max(np.abs(free), initial=0.0))  # at rest all else is zero
    if not error <= _MAX_CONSTRAINT_ERROR * scale:
        raise ModelError(_DEPENDENT_CONSTRAINTS)
    all_multipliers = np.zeros(right.size)
    all_multipliers[used] = multipliers
    return accelerations.reshape(count, _MOTIONS), all_multipliers
