"""Torque laws of joints: pure functions of angle and rate, without files or figures."""

from springs.axis import AxisSpring
from springs.backends import FLOATS, NUMPY, Operations, Real
from springs.contact import Surface
from springs.contact_part import PartLaw, Series
from springs.cubic import Coefficients, Cubic, NotRestoringError, passive_cubic, restoring_sense
from springs.damping import Damping
from springs.elastic import Elastic, total_energy, total_torque
from springs.joint import (
    CoupledAxis,
    CoupledSpring,
    JointSprings,
    Singularity,
    SphericalLaw,
    SpringSet,
)
from springs.layer import Layer
from springs.linear import Linear
from springs.reach import Reach, ReachPoint, TurnRange
from springs.spherical import (
    ReachLaw,
    RotationLaw,
    conservative_energy,
    conservative_torque,
    damping_torque,
    elastic_torque,
    group_torque,
    rotation_law,
    weighted_torque,
)
from springs.stop import Stop

__all__ = [
    "FLOATS",
    "NUMPY",
    "AxisSpring",
    "Coefficients",
    "CoupledAxis",
    "CoupledSpring",
    "Cubic",
    "Damping",
    "Elastic",
    "JointSprings",
    "Layer",
    "Linear",
    "NotRestoringError",
    "Operations",
    "PartLaw",
    "Reach",
    "ReachLaw",
    "ReachPoint",
    "Real",
    "RotationLaw",
    "Series",
    "Singularity",
    "SphericalLaw",
    "SpringSet",
    "Stop",
    "Surface",
    "TurnRange",
    "conservative_energy",
    "conservative_torque",
    "damping_torque",
    "elastic_torque",
    "group_torque",
    "passive_cubic",
    "restoring_sense",
    "rotation_law",
    "total_energy",
    "total_torque",
    "weighted_torque",
]
