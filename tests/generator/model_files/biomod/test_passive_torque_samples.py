"""Torques about single displacements, compared with the law of all of them."""

import numpy as np
import pytest

from generator import read_figure
from generator.joint_chain import build_chain
from generator.model_files.biomod.passive_torque import (
    TYPICAL_TORQUE,
    SampledTorque,
    coupling_error,
    generalized_torques,
    sampled_torques,
)
from generator.model_files.export_model import split_joint_laws
from generator.model_files.fit_error import joint_ranges
from generator.passive_curve import rotation_vector
from generator.springs_file.read import read_springs
from springs import (
    AxisSpring,
    JointSprings,
    Linear,
    SphericalLaw,
    conservative_energy,
    total_torque,
)
from tests.chains import chain, joint

PROTOTYPE = read_figure("prototype")
SPRINGS = read_springs(None, PROTOTYPE)


@pytest.mark.parametrize("name", ["left_hip_joint", "waist", "right_shoulder"])
def test_generalized_torques_are_minus_the_slope_of_the_energy(name: str) -> None:
    factors = build_chain(PROTOTYPE.joints[name].chain)
    axes = SPRINGS.joints[name].axes
    rng = np.random.default_rng(1)
    q = rng.uniform(-0.6, 0.6, (20, len(factors.joint_axes)))
    laws = split_joint_laws(factors, SPRINGS.joints[name], SphericalLaw.CONSERVATIVE)
    torques = generalized_torques(laws, q)

    def energy(at: np.ndarray) -> np.ndarray:
        return np.asarray(conservative_energy(axes, rotation_vector(factors, at)))

    for k in range(q.shape[1]):
        step = 1e-5 * np.eye(q.shape[1])[k]
        slope = (energy(q + step) - energy(q - step)) / 2e-5
        assert torques[:, k] == pytest.approx(-slope, rel=1e-5, abs=1e-5)


@pytest.mark.parametrize("name", SPRINGS.joints)
def test_about_an_axis_of_the_springs_the_torque_is_its_law(name: str) -> None:
    of, own = PROTOTYPE.joints[name], SPRINGS.joints[name]
    ranges = joint_ranges(of, own)
    laws = split_joint_laws(build_chain(of.chain), own, SPRINGS.law)
    found = sampled_torques(of, laws, ranges)
    assert found
    for k, sampled in found.items():
        assert sampled.range == pytest.approx(np.clip(ranges[k], -np.pi, np.pi), abs=1e-5)
        axis = np.array(of.chain[k].axis)
        for spring in own.axes:
            sense = float(axis @ spring.direction)
            if abs(sense) == 1.0:
                expected = sense * total_torque(spring.elastic, sense * sampled.displacements)
                assert sampled.torques == pytest.approx(expected, rel=1e-9, abs=1e-9)


def test_equal_linear_springs_about_all_axes_differ_from_their_sum() -> None:
    of = joint("ball", "a.b", "c.d", chain("Rx Ry Rz"))
    axes = tuple(
        AxisSpring(axis, (Linear(3.0),)) for axis in ((1.0, 0, 0), (0, 1.0, 0), (0, 0, 1.0))
    )
    own = JointSprings("ball", axes)
    ranges = ((-0.5, 0.5),) * 3
    laws = split_joint_laws(build_chain(of.chain), own, SphericalLaw.CONSERVATIVE)
    torques = {k: lambda q: -3.0 * q for k in range(3)}
    found = sampled_torques(of, laws, ranges)
    for k, sampled in found.items():
        assert sampled.error_of(torques[k]).largest < 1e-12
    error = coupling_error(laws, ranges, torques)
    assert error is not None
    assert 0.05 < error.largest < 1.5
    small = ((-0.01, 0.01),) * 3
    near = coupling_error(laws, small, torques)
    assert near is not None
    assert near.largest < 1e-3
    hinge = JointSprings("ball", axes[:1])
    alone = split_joint_laws(build_chain(chain("Rx")), hinge, SphericalLaw.CONSERVATIVE)
    assert coupling_error(alone, ranges, {}) is None


def test_large_torques_count_relatively() -> None:
    x = np.array([0.0, 1.0])
    sampled = SampledTorque(x, np.array([0.0, -9.0 * TYPICAL_TORQUE]), (0.0, 1.0))
    assert sampled.weights == pytest.approx([1.0, 0.1])
    assert not sampled.is_negligible
    (factor,) = sampled.solve(np.ones((2, 1)))
    assert factor == pytest.approx(-9.0 * TYPICAL_TORQUE * 0.01 / 1.01)
    assert sampled.misfit_of(lambda q: 0.0 * q) == pytest.approx((0.9 * TYPICAL_TORQUE) ** 2)
    assert SampledTorque(x, 0.0 * x, (0.0, 1.0)).is_negligible
