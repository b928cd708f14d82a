"""Equations between the rates of joints, as user functions of a constraint of Exudyn.

They are `J(q) v = 0`, where a row of J gives the rate of one displacement, or a component of the
angular velocity, of a joint by the Euler parameters of its bodies. Exudyn's index-2 integrator asks
for `J v` and for J, and at each start finds the slope of `J v` by q, from which it has the
accelerations.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from generator.chain import Chain
from generator.drive import Drive
from generator.engine.exudyn_api import exu
from generator.engine.relative_turn import Quaternion, RelativeTurn
from generator.engine.turn_rates import TurnRates, Vector
from generator.frames import Array

_AXES: tuple[Vector, Vector, Vector] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


@dataclass(frozen=True)
class Term:
    """A rate in an equation, times a factor.

    Attributes:
        joint: whose rate.
        of: the place of a displacement in the joint's chain, or an axis of the parent's site along
            which the relative angular velocity is taken.
        factor: of the rate.
    """

    joint: str
    of: int | Vector
    factor: float = 1.0


Row = tuple[Term, ...]


@dataclass(frozen=True)
class JointTurn:
    """The turn of one joint of a law; `places` finds the turn of a place in its chain."""

    turn: RelativeTurn
    rates: TurnRates
    places: dict[int, int]


@dataclass(frozen=True)
class DrivenTurn:
    """The rates that the table of one joint asks for.

    A joint all of whose turns are driven follows an angular velocity, which is defined in every
    orientation; of single displacements the rates are not where two axes fall together.
    """

    chain: Chain
    turns: TurnRates
    drive: Drive
    freedoms: tuple[int, ...]

    @property
    def _whole(self) -> bool:
        return len(self.chain.turns) == 3 and set(self.freedoms) == set(self.chain.turns)

    def rows(self, name: str) -> list[Row]:
        """The equations."""
        if self._whole:
            return [(Term(name, axis),) for axis in _AXES]
        return [(Term(name, k),) for k in self.freedoms]

    def rates(self, times: float | Array) -> Array:
        """What the rows follow [rad/s], shape (..., number of rows), at times of shape (...)."""
        rates = self.drive.rates(times)
        if not self._whole:
            return rates
        order = [self.freedoms.index(place) for place in self.chain.turns]
        angles, rates = self.drive.at(times)[..., order], rates[..., order]
        found = [
            self.turns.angular_velocity(one, other)
            for one, other in zip(
                angles.reshape(-1, 3).tolist(), rates.reshape(-1, 3).tolist(), strict=True
            )
        ]
        return np.array(found).reshape(rates.shape)


class RateEquations:
    """The user functions of a servo; they keep what they found for the last coordinates."""

    def __init__(
        self,
        rows: tuple[Row, ...],
        turns: Mapping[str, JointTurn],
        size: int,
        motion: DrivenTurn | None,
    ) -> None:
        """Equations `rows` of joints `turns` over `size` coordinates, the last of them the clock's.

        With a motion, the rows follow it; without one they are zero, and there is no clock.
        """
        self.motion = motion
        self._rows, self._turns, self._size = rows, turns, size
        self._at: Sequence[float] = ()
        self._found = np.zeros((0, 0))
        self._time, self._rates = float("nan"), np.zeros(0)

    def residual(
        self, mbs: Any, t: float, itemNumber: int, q: Any, q_t: Any, velocityLevel: bool
    ) -> Any:
        """`J v`: Exudyn's index-2 integrator asks for nothing else."""
        return self._matrix(q) @ np.asarray(q_t)

    def jacobian(
        self, mbs: Any, t: float, itemNumber: int, q: Any, q_t: Any, velocityLevel: bool
    ) -> Any:
        """J, which is the slope of `J v` by v, and the direction of the constraints' forces."""
        matrix = exu.MatrixContainer()
        matrix.SetWithDenseMatrix(self._matrix(q), useDenseMatrix=True)
        return matrix

    def _matrix(self, q: Sequence[float]) -> Array:
        if q == self._at:
            return self._found
        ends = {name: turn.turn.ends(q) for name, turn in self._turns.items()}
        axes = {name: turn.rates.axes(ends[name][2]) for name, turn in self._turns.items()}
        found: list[list[float]] = []
        for row in self._rows:
            forces = [0.0] * self._size
            for term in row:
                turn = self._turns[term.joint]
                axis = (
                    axes[term.joint][turn.places[term.of]] if isinstance(term.of, int) else term.of
                )
                gradient = _gradient(ends[term.joint][2], axis, term.factor)
                turn.turn.spread(forces, ends[term.joint], gradient)
            found.append(forces)
        matrix = np.array(found)
        if self.motion is not None:
            matrix[:, -1] = -self._followed(q[-1])
        self._at, self._found = list(q), matrix
        return matrix

    def _followed(self, time: float) -> Array:
        """What the rows follow at a time, which is the same for all iterations of a step."""
        assert self.motion is not None
        if time != self._time:
            self._time, self._rates = time, self.motion.rates(time)
        return self._rates


def _gradient(turn: Quaternion, axis: Vector, factor: float) -> Quaternion:
    """Slope, by the turn, of a rate `factor * axis . omega`: the turn changes by omega turn / 2."""
    w, a, b, c = turn
    x, y, z = axis
    size = 2.0 * factor / (w * w + a * a + b * b + c * c)
    return (
        -size * (x * a + y * b + z * c),
        size * (x * w + y * c - z * b),
        size * (y * w + z * a - x * c),
        size * (z * w + x * b - y * a),
    )
