"""Forces of coordinates as laws: torques and damping as in OpenSim or its documentation."""

from pathlib import Path

import numpy as np
import pytest

from generator.diagnostics import Source
from generator.model_files.formats import parse_model
from springs import SphericalLaw, total_torque
from springs.interpolated import Interpolated
from tests.generator.model_files.imported_models import lost, written_and_read
from tests.generator.model_files.opensim.one_joint import (
    MODEL,
    acceleration_in_opensim,
    imported,
    read,
)

ANGLES = np.linspace(-1.4, 1.4, 57)


def force(tag: str, **values: object) -> str:
    inner = "".join(f"<{key}>{value}</{key}>" for key, value in values.items())
    return f"<{tag} name='a_{tag}'><coordinate>q1</coordinate>{inner}</{tag}>"


def expression(text: str) -> str:
    return force("ExpressionBasedCoordinateForce", expression=text)


SPRING = force("SpringGeneralizedForce", stiffness=3, rest_length=0.1, viscosity=0.4)
LIMIT = force("CoordinateLimitForce", lower_limit=-30, upper_limit=40, lower_stiffness=1,
              upper_stiffness=2, transition=10)  # fmt: skip

FORCES = {
    "spring": (SPRING, True),
    "limit": (LIMIT, True),
    "limit and spring": (LIMIT + SPRING, False),
    "two springs": (SPRING + expression("-2*(q-0.5)"), True),
    "linear expression": (expression("-3*q-0.5*qdot+1"), True),
    "double exponential": (expression("2*exp(-3*(q+1))-exp(4*(q-1))-0.5*qdot"), False),
    "one-sided": (expression("-step(q-0.5)*10*(q-0.5)"), False),
    "with a definition": (expression("-a*a*a;a=2*q"), False),
}
"""Forces, and whether a springs file holds them exactly."""


@pytest.mark.verify
@pytest.mark.parametrize("name", FORCES)
def test_torques_are_those_of_opensim(name: str, tmp_path: Path):
    forces, exact = FORCES[name]
    acceleration = acceleration_in_opensim("PinJoint", forces, tmp_path)
    theirs = np.array([acceleration(angle, 0.0) for angle in ANGLES])
    damping = acceleration(0.0, -0.5) - acceleration(0.0, 0.5)
    model, axis = read("PinJoint", forces, tmp_path)
    error = 1e-12
    if not exact:
        (place,) = lost(model, "tables of points")
        error = 1.2 * float(place.split(": ")[1].split(" ")[0])
    ours = total_torque(axis.elastic, ANGLES)
    assert np.abs(ours - theirs).max() <= error
    assert axis.damping.viscous == pytest.approx(damping, abs=1e-9)


def test_limits_and_their_transitions_are_in_degrees(tmp_path: Path):
    """Beyond the transition of 10 deg the torque grows as the angle beyond the limit."""
    _, axis = read("PinJoint", LIMIT, tmp_path)
    torques = total_torque(axis.elastic, np.radians([-80.0, -45.0, -25.0, 0.0, 35.0, 55.0, 80.0]))
    assert torques == pytest.approx([50.0, 15.0, 0.0, 0.0, 0.0, -30.0, -80.0], abs=1e-9)


def test_exponential_limits_are_exact(tmp_path: Path):
    """De Groote's curves, in OpenSim since 4.6.1: an exponential at either limit."""
    limits = force("ExponentialCoordinateLimitForce", lower_shape_parameters="2 3",
                   upper_shape_parameters="4 5", lower_limit=-0.6, upper_limit=0.9)  # fmt: skip
    _, axis = read("PinJoint", limits, tmp_path)
    expected = 2.0 * np.exp(-3.0 * (ANGLES + 0.6)) - 4.0 * np.exp(5.0 * (ANGLES - 0.9))
    np.testing.assert_allclose(total_torque(axis.elastic, ANGLES), expected, rtol=1e-12)


def test_linear_stops_are_exact(tmp_path: Path):
    stop = force("CoordinateLinearStopForce", stiffness=7, damping=0.3, lower_limit=-0.6,
                 upper_limit=0.9)  # fmt: skip
    model, axis = read("PinJoint", stop, tmp_path)
    expected = 7.0 * (np.clip(ANGLES, -0.6, 0.9) - ANGLES)
    np.testing.assert_allclose(total_torque(axis.elastic, ANGLES), expected, atol=1e-12)
    assert lost(model, "damping of limit forces") == ("a_CoordinateLinearStopForce",)


def test_linear_forces_along_slides_are_springs(tmp_path: Path):
    _, axis = read("SliderJoint", expression("-30*q-2*qdot") + SPRING, tmp_path)
    assert total_torque(axis.elastic, 0.5) == pytest.approx(-30.0 * 0.5 - 3.0 * 0.4)
    assert axis.damping.viscous == pytest.approx(2.4)


@pytest.mark.parametrize("bounds", ["-99999.9 99999.9", "1e-300 2e-300", "-inf inf", "1 -1"])
def test_ranges_without_a_meaning_are_no_ranges(bounds: str):
    model = MODEL.replace("-1.5 1.5", bounds)
    springs = imported("PinJoint", expression("-exp(9*q)"), model).springs
    assert springs is not None
    law = springs.entries[0].law
    assert isinstance(law, Interpolated)
    assert law.torque(0.4) == pytest.approx(-np.exp(3.6), rel=1e-3)


@pytest.mark.parametrize(
    ("joint", "forces", "sentence"),
    [
        ("PinJoint", expression("gust(q)"), "expressions that are not read"),
        ("PinJoint", expression("1/(q-q)"), "expressions that are not finite"),
        ("PinJoint", expression("-1e308*q"), "expressions that are not finite"),
        ("PinJoint", expression("-q^3+0*sqrt(square(q+0.05)-0.0004)"), "not finite in their range"),
        ("PinJoint", expression("-tanh(qdot)-q"), "depend on the rate"),
        ("SliderJoint", expression("-q^3"), "nonlinear forces of sliding joints"),
        ("SliderJoint", LIMIT, "limit forces of sliding joints"),
        ("PinJoint", SPRING.replace("<stiffness>3", "<stiffness>-3"), "negative stiffness"),
    ],
)
def test_other_forces_are_losses(joint: str, forces: str, sentence: str):
    assert len(lost(imported(joint, forces), sentence)) == 1


@pytest.mark.parametrize(
    ("forces", "message"),
    [
        (force("CoordinateLinearStopForce", stiffness=1, lower_limit=1, upper_limit=0), "no range"),
        (force("ExponentialCoordinateLimitForce", lower_shape_parameters="1 900",
               lower_limit=9), "too large"),
    ],
)  # fmt: skip
def test_a_wrong_limit_is_refused(forces: str, message: str):
    (fault,) = parse_model(Source("m.osim", MODEL.format("PinJoint", forces))).diagnostics
    assert message in fault.message


@pytest.mark.parametrize(
    ("joint", "law"),
    [("GimbalJoint", SphericalLaw.COORDINATES), ("BallJoint", SphericalLaw.CONSERVATIVE)],
)
def test_forces_on_a_ball_are_not_laws_of_its_coordinates(
    joint: str, law: SphericalLaw, tmp_path: Path
):
    """The speeds of a BallJoint are angular velocities about the axes of the parent."""
    model = imported(joint, SPRING)
    assert written_and_read(model, tmp_path)[1].law is law
    approximate = [one for one in model.losses.entries if "rotation vector" in one.what]
    assert bool(approximate) == (joint == "BallJoint")
