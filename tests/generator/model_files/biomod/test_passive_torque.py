"""Passive torques of a `.bioMod` file, compared with the laws."""

from math import radians

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from generator import read_figure
from generator.joint_chain import build_chain
from generator.model_files.biomod.passive_torque import (
    ExponentialTorque,
    LinearTorque,
    generalized_torques,
    passive_torques,
)
from generator.model_files.export_model import split_joint_laws
from generator.model_files.fit_error import joint_ranges
from generator.springs_file.read import read_springs
from springs import (
    AxisSpring,
    JointSprings,
    Linear,
    SphericalLaw,
    total_torque,
)
from springs.exponential import Exponential, ExponentialTerm
from tests.chains import chain, joint

PROTOTYPE = read_figure("prototype")
SPRINGS = read_springs(None, PROTOTYPE)
WEIGHTED = read_springs(None, PROTOTYPE, law=SphericalLaw.WEIGHTED)


def torques_of(own: JointSprings, of, law=SphericalLaw.CONSERVATIVE):
    laws = split_joint_laws(build_chain(of.chain), own, law)
    return passive_torques(of, laws, joint_ranges(of, own))


@pytest.mark.parametrize("name", [n for n, own in SPRINGS.joints.items() if len(own.axes) == 1])
def test_the_error_is_that_of_the_written_torque(name: str) -> None:
    own = SPRINGS.joints[name]
    (fitted,) = torques_of(own, PROTOTYPE.joints[name]).fitted.values()
    assert fitted.error is not None
    angles = np.linspace(*fitted.range, 2001)
    differences = fitted.torque.torque(angles) - total_torque(own.axes[0].elastic, angles)
    assert fitted.error.largest == pytest.approx(np.abs(differences).max(), rel=0.05)
    assert fitted.error.rms == pytest.approx(np.sqrt(np.mean(differences**2)), rel=0.05)


@pytest.mark.slow
@pytest.mark.parametrize("name", SPRINGS.joints)
def test_the_torque_does_not_drive_the_joint_on(name: str) -> None:
    for fitted in torques_of(SPRINGS.joints[name], PROTOTYPE.joints[name]).fitted.values():
        if isinstance(fitted.torque, ExponentialTorque):
            assert max(fitted.torque.amplitudes) <= 0.0


@pytest.mark.parametrize("name", [n for n, own in SPRINGS.joints.items() if len(own.axes) == 1])
def test_elbows_and_knees_are_driven_back_from_beyond_their_ends(name: str) -> None:
    own = SPRINGS.joints[name]
    (fitted,) = torques_of(own, PROTOTYPE.joints[name]).fitted.values()
    beyond = np.array(fitted.range) + np.radians([-5.0, 5.0])
    law = total_torque(own.axes[0].elastic, beyond)
    assert np.all(np.abs(law) > 2.0)
    assert np.all(np.sign(fitted.torque.torque(beyond)) == np.sign(law))


def test_a_knee_is_approximated_better_than_by_a_line() -> None:
    own = SPRINGS.joints["left_knee"]
    (fitted,) = torques_of(own, PROTOTYPE.joints["left_knee"]).fitted.values()
    assert isinstance(fitted.torque, ExponentialTorque)
    angles = np.linspace(*fitted.range, 501)
    torques = np.asarray(total_torque(own.axes[0].elastic, angles))
    line = np.polyval(np.polyfit(angles, torques, 1), angles) - torques
    assert fitted.error is not None
    assert fitted.error.rms < 0.3 * float(np.sqrt(np.mean(line**2)))


@settings(max_examples=15, deadline=None)
@given(
    st.floats(1.0, 9.0), st.floats(1.0, 9.0), st.floats(0.5, 3.0), st.floats(0.5, 3.0),
    st.floats(-0.5, 0.5),
)  # fmt: skip
def test_exponentials_at_two_ends_are_approximated(
    rate: float, other: float, size: float, second: float, rest: float
) -> None:
    terms = (
        ExponentialTerm(-size * np.exp(-rate), rate),
        ExponentialTerm(second * np.exp(-other), -other),
    )
    law = Exponential(terms, rest, (-1.3, 1.3))
    of = joint("pin", "a.b", "c.d", chain("Rz"))
    own = JointSprings("pin", (AxisSpring((0.0, 0.0, 1.0), (law,)),))
    (fitted,) = torques_of(own, of).fitted.values()
    largest = float(np.abs(law.torque(np.linspace(*fitted.range, 301))).max())
    assert fitted.error is None or fitted.error.rms < 0.1 * largest


def test_a_linear_law_is_exact_in_the_sense_of_the_displacement() -> None:
    of = joint("pin", "a.b", "c.d", chain("R-z"))
    own = JointSprings("pin", (AxisSpring((0.0, 0.0, 1.0), (Linear(3.0, 0.2), Linear(1.0))),))
    (fitted,) = torques_of(own, of).fitted.values()
    assert isinstance(fitted.torque, LinearTorque)
    assert fitted.error is None
    assert fitted.torque.slope == pytest.approx(-4.0)
    assert fitted.torque.at_zero == pytest.approx(-0.6)


def test_without_a_torque_there_is_none() -> None:
    of = joint("pin", "a.b", "c.d", chain("Rz"))
    own = JointSprings("pin", (AxisSpring((0.0, 0.0, 1.0), (Linear(0.0),)),))
    assert torques_of(own, of).fitted == {}
    assert torques_of(JointSprings("pin"), of).fitted == {}


@pytest.mark.parametrize("springs", [SPRINGS, WEIGHTED], ids=["conservative", "weighted"])
@pytest.mark.parametrize("name", ["left_hip_joint", "left_shoulder"])
def test_about_one_axis_alone_the_errors_are_those_stated(name: str, springs) -> None:
    of, own = PROTOTYPE.joints[name], springs.joints[name]
    torques = torques_of(own, of, springs.law)
    laws = split_joint_laws(build_chain(of.chain), own, springs.law)
    assert torques.coupling_error is not None
    for k, fitted in torques.fitted.items():
        q = np.zeros((401, 3))
        q[:, k] = np.linspace(*fitted.range, 401)
        exact = generalized_torques(laws, q)[:, k]
        largest = float(np.abs(fitted.torque.torque(q[:, k]) - exact).max())
        assert fitted.error is not None
        assert fitted.error.largest == pytest.approx(largest, rel=0.05)
        assert fitted.error.rms < torques.coupling_error.largest
    assert np.ptp(torques.fitted[0].range) > radians(30.0)
