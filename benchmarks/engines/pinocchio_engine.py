"""Pinocchio: the articulated-body algorithm in joint coordinates, integrated by SciPy."""

from typing import Any

import numpy as np
import pinocchio as pin

from benchmarks.tree import GRAVITY, TreeModel
from generator.rotations import Array

NAME = "Pinocchio"
VERSION = pin.__version__


class Pinocchio:
    """A tree in Pinocchio."""

    def __init__(self, tree: TreeModel) -> None:
        """Build it."""
        model = pin.Model()
        model.gravity.linear = np.array([0.0, -GRAVITY, 0.0])
        places: list[tuple[int, Array]] = []
        joints: dict[str, int] = {}
        for link in tree.links:
            carrier, shift = (0, np.eye(4)) if link.base < 0 else places[link.base]
            kind: Any = pin.JointModelSpherical()
            if link.axis is not None:
                kind = pin.JointModelRevoluteUnaligned(*link.axis)
            joint = model.addJoint(carrier, kind, pin.SE3(shift @ link.in_base), link.joint)
            in_joint = np.linalg.inv(link.in_tip)
            inertia = pin.Inertia(link.mass, link.centre, np.diag(link.inertia))
            model.appendBodyToJoint(joint, inertia, pin.SE3(in_joint))
            places.append((joint, in_joint))
            joints[link.joint] = joint
        self._model, self._data = model, model.createData()
        balls = [joints[link.joint] for link in tree.balls]
        hinges = [joints[link.joint] for link in tree.hinges]
        self._ball_q = np.array([model.idx_qs[j] + np.array([3, 0, 1, 2]) for j in balls])
        self._ball_v = np.array([model.idx_vs[j] + np.arange(3) for j in balls])
        self._hinge_q = np.array([model.idx_qs[j] for j in hinges], dtype=int)
        self._hinge_v = np.array([model.idx_vs[j] for j in hinges], dtype=int)
        self._q, self._v, self._force = (np.zeros(n) for n in (model.nq, model.nv, model.nv))

    def _set(self, quaternions: Array, angles: Array, spins: Array, rates: Array) -> None:
        self._q[self._ball_q], self._q[self._hinge_q] = quaternions, angles
        self._v[self._ball_v], self._v[self._hinge_v] = spins, rates

    def accelerations(
        self,
        quaternions: Array,
        angles: Array,
        spins: Array,
        rates: Array,
        torques: tuple[Array, Array],
    ) -> tuple[Array, Array]:
        """See `outside.Accelerator`."""
        self._set(quaternions, angles, spins, rates)
        self._force[self._ball_v], self._force[self._hinge_v] = torques
        gained = pin.aba(self._model, self._data, self._q, self._v, self._force)
        return gained[self._ball_v], gained[self._hinge_v]

    def book(
        self, quaternions: Array, angles: Array, spins: Array, rates: Array
    ) -> tuple[Array, float]:
        """See `outside.Accelerator`."""
        self._set(quaternions, angles, spins, rates)
        centre = pin.centerOfMass(self._model, self._data, self._q).copy()
        kinetic = pin.computeKineticEnergy(self._model, self._data, self._q, self._v)
        return centre, kinetic + pin.computePotentialEnergy(self._model, self._data, self._q)
