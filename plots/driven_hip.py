"""A slow cycle of the hip in Exudyn, and the passive torque that its motion tells."""

from dataclasses import dataclass, replace

import numpy as np

from generator import Plan, Recording, read_figure, simulate
from generator.figure import Figure, SiteRef
from generator.loads import LoadKind, TimedLoad
from springs import AxisSpring, Damping, JointSprings, SpringSet
from springs.directional import Directional
from springs.operations import Array

_HIP = "left_hip_joint"
_PELVIS, _THIGH = "lower_torso", "left_upper_leg"
_PERIOD = 8.0
_FRAMES = 800
_STEP = 1e-3
_BRAKE = 10.0
"""Of the drive [N m s/rad]: it holds the speed down, and is taken off what is measured."""


@dataclass(frozen=True)
class Cycle:
    """One cycle, from the least angle and back; n stretches between frames.

    Attributes:
        angle: hip flexion in the middle of each stretch, shape (n,) [rad].
        turned: by how much the angle grows along it, shape (n,) [rad].
        torque: passive torque on the thigh, without the brake's, shape (n,) [N m].
        dissipated: by the joint, the brake's share taken off, in Exudyn's energy book [J].
    """

    angle: Array
    turned: Array
    torque: Array
    dissipated: float

    @property
    def low(self) -> float:
        """Least angle [rad]."""
        return float(self.angle.min())

    @property
    def high(self) -> float:
        """Greatest angle [rad]."""
        return float(self.angle.max())

    @property
    def loss(self) -> float:
        """Area within the loop of torque against angle [J]; positive where energy is lost."""
        return -float(np.sum(self.torque * self.turned))

    def branch(self, angles: Array, sign: int) -> Array:
        """Torque at angles [rad] while the angle grows (+1) or falls (-1) [N m]."""
        chosen = np.flatnonzero(np.sign(self.turned) == sign)
        chosen = chosen[np.argsort(self.angle[chosen])]
        return np.interp(angles, self.angle[chosen], self.torque[chosen])


def drive(law: Directional, low: float, high: float) -> Cycle:
    """Drive the prototype's thigh slowly from about `low` to `high` [rad] and back.

    The thigh hangs alone on the fixed pelvis by its flexion axis, without gravity. A moment that
    goes up and down as a cosine drives it, between what the law asks for at both ends. The second
    of two cycles is taken. The passive torque is inertia times acceleration less the drive: it
    comes from the motion, not from the law.
    """
    figure = _thigh()
    spring = AxisSpring((0.0, 1.0, 0.0), (law,), Damping(viscous=_BRAKE))
    times = np.linspace(0.0, 2.0 * _PERIOD, 2 * _FRAMES + 1)
    least, most = -float(law.decreasing.torque(low)), -float(law.increasing.torque(high))
    swing = 0.5 * (most - least) * np.cos(2.0 * np.pi * times / _PERIOD)
    moments = [(0.0, moment, 0.0) for moment in (0.5 * (least + most) - swing).tolist()]
    load = TimedLoad(SiteRef(_THIGH, "proximal"), LoadKind.GLOBAL_MOMENT, times.tolist(), moments)
    plan = Plan(
        stop=2.0 * _PERIOD,
        frame=_PERIOD / _FRAMES,
        step=_STEP,
        springs=SpringSet({_HIP: JointSprings(_HIP, (spring,))}),
        gravity=(0.0, 0.0, 0.0),
        displacements={_HIP: (low,)},
        loads=(load,),
    )
    return _measured(simulate(figure, plan), load)


def _thigh() -> Figure:
    """The prototype's left thigh on its pelvis, which is the ground, by the axis of flexion."""
    body = read_figure("prototype")
    hip = body.joints[_HIP]
    (flexion,) = (factor for factor in hip.chain if factor.axis == (0.0, 1.0, 0.0))
    hinge = replace(hip, chain=(flexion,), displacement=(0.0,), stiff=None, rest=None, damp=None)
    pelvis = replace(body.segments[_PELVIS], mass=-1.0)
    return Figure(
        {_PELVIS: pelvis, _THIGH: body.segments[_THIGH]},
        {_HIP: hinge},
        SiteRef(_PELVIS, "llateral"),
    )


def _measured(run: Recording, load: TimedLoad) -> Cycle:
    """The last cycle of a run."""
    times, angle = run.times, run.displacements[_HIP][:, 0]
    rate = run.velocities[_HIP][:, 0]
    fastest = int(np.argmax(np.abs(rate)))
    inertia = 2.0 * run.energy["kinetic"][fastest] / rate[fastest] ** 2
    driven = load.at(times)[:, 1]
    spans = np.diff(times)
    torque = inertia * np.diff(rate) / spans - _middle(driven) + _BRAKE * _middle(rate)
    braked = _BRAKE * float(np.sum((_middle(rate**2) * spans)[-_FRAMES:]))
    dissipated = run.energy["dissipated"]
    return Cycle(
        _middle(angle)[-_FRAMES:],
        np.diff(angle)[-_FRAMES:],
        torque[-_FRAMES:],
        float(dissipated[-1] - dissipated[-1 - _FRAMES]) - braked,
    )


def _middle(values: Array) -> Array:
    """Means of neighbours, shape (n - 1,)."""
    return 0.5 * (values[1:] + values[:-1])
