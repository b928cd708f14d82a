"""Passive moments along a motion."""

from dataclasses import replace

import numpy as np
import pytest

from generator import read_figure, read_springs
from generator.diagnostics import UsageError
from generator.input_files.coordinates import NO_COORDINATES, displacement_columns
from generator.inverse.legs import LegAngle
from generator.inverse.moments import CoordinateForce, JointMoments, joint_moments
from generator.inverse.passive import (
    DEFAULT_LAWS,
    MEAN_PARAMETERS,
    LegLaw,
    SpringsLaw,
    format_bands,
    passive_bands,
    published_law,
)
from generator.motion_files.motion import motion_from_figure
from generator.passive_curve import passive_torque
from springs.published.tables import coupled_law, curve

TIMES = np.linspace(0.0, 2.0, 201)
LEG = {
    "hip flexion": LegAngle("hip", 1.0),
    "knee flexion": LegAngle("knee", -1.0),
    "ankle dorsiflexion": LegAngle("ankle", 1.0),
}


def walking(hip: float = 0.5) -> JointMoments:
    """A leg that swings, with a net moment of 50 N m in phase with the hip's rate."""
    w = 2.0 * np.pi
    values = {
        "hip": 0.2 + hip * np.sin(w * TIMES),
        "knee": -0.5 + 0.4 * np.cos(w * TIMES),
        "ankle": 0.1 * np.sin(w * TIMES),
    }
    rates = {name: np.gradient(one, TIMES) for name, one in values.items()}
    found = {
        name: CoordinateForce(name, True, False, values[name], rates[name], 50.0 * np.sign(rate))
        for name, rate in rates.items()
    }
    sure = (TIMES >= 0.5) & (TIMES <= 1.5)
    return JointMoments(TIMES, found, sure, 70.0, 1.8, 700.0, None)


@pytest.mark.parametrize("name", DEFAULT_LAWS)
def test_moments_are_those_of_the_law_in_its_senses(name: str):
    moments, law = walking(), coupled_law(name).law
    found = LegLaw(name, {"right": LEG}, moments, {"hip": 0.05}, 0.1).torques({"knee": 0.02})
    angles = [
        moments.coordinates["hip"].values - 0.05 + 0.1,
        -moments.coordinates["knee"].values + 0.02,
        moments.coordinates["ankle"].values,
    ]
    hip, knee, ankle = law.torques(angles)
    np.testing.assert_allclose(found["hip"].torques, hip)
    np.testing.assert_allclose(found["knee"].torques, -np.asarray(knee))
    np.testing.assert_allclose(found["ankle"].torques, ankle)
    ends = law.valid_ranges[0]
    assert ends is not None
    inside = (angles[0] >= ends[0]) & (angles[0] <= ends[1])
    assert not np.any(found["hip"].is_known & ~inside)


def test_a_curve_of_one_joint_is_a_law():
    key = "anderson_madigan_nussbaum_2007/hip_male_18_25"
    moments = walking()
    found = LegLaw(key, {"right": LEG}, moments, {}).torques({})
    assert set(found) == {"hip"}
    expected = curve(key).law.torque(moments.coordinates["hip"].values)
    np.testing.assert_allclose(found["hip"].torques, expected)


def test_shares_are_a_range_of_works():
    moments, name = walking(hip=0.3), "riener_edrich_1999/leg"
    law = LegLaw(name, {"right": LEG}, moments, {})
    band = passive_bands(moments, [law], np.radians(5.0))["hip"]
    one = moments.coordinates["hip"]
    torque = law.torques({})["hip"]
    assert np.all(torque.is_known)
    net = moments.works(one.powers).positive
    share = moments.works(torque.torques * one.rates).positive / net
    assert band.share_range is not None
    low, high = band.share_range
    assert low < share < high
    assert len(band.shares[name]) == 7
    assert np.all(band.lower <= torque.torques)
    assert np.all(torque.torques <= band.upper)


def test_wider_zeros_give_wider_shares():
    moments = walking(hip=0.3)
    laws = [LegLaw(name, {"right": LEG}, moments, {}) for name in DEFAULT_LAWS]
    narrow, wide = (passive_bands(moments, laws, np.radians(d))["hip"] for d in (2.0, 5.0))
    assert narrow.share_range is not None
    assert wide.share_range is not None
    assert wide.share_range[0] < narrow.share_range[0] < narrow.share_range[1]
    assert narrow.share_range[1] < wide.share_range[1]


def test_samples_beyond_the_measured_range_are_left_out():
    """The hip goes to -46 deg; laws are known to -15 deg."""
    moments = walking(hip=1.0)
    law = LegLaw("silder_2007/leg_curves", {"right": LEG}, moments, {})
    torque = law.torques({})["hip"]
    beyond = moments.coordinates["hip"].values < np.radians(-15.0)
    assert beyond.any()
    assert not torque.is_known[beyond].any()
    band = passive_bands(moments, [law], 0.0)["hip"]
    assert np.isnan(band.lower[beyond]).all()
    assert np.all(band.known[beyond] == 0.0)
    assert band.known_range[1] < 1.0
    rows = list(format_bands(moments, {"hip": band}))
    cells = rows[1 + int(np.argmax(beyond))].strip().split(",")
    assert cells[3:5] == ["", ""]
    assert cells[-1] == "0.0"


def test_a_share_of_less_than_half_the_work_is_not_told():
    moments = walking(hip=1.0)
    far = {"hip": 2.0}
    law = LegLaw("silder_2007/leg_curves", {"right": LEG}, moments, far)
    band = passive_bands(moments, [law], 0.0)["hip"]
    assert band.known_range[1] < 0.5
    assert band.share_range is None


def test_mean_parameters_are_no_default():
    assert not set(MEAN_PARAMETERS) & set(DEFAULT_LAWS)
    assert "Mean parameters" in coupled_law(MEAN_PARAMETERS[0]).note


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("davy_audu_1987/hip", "the range in which this law was measured is not known"),
        ("silder_2007/knees", "there are leg, leg_curves"),
        ("saul_2015/elbow_flexion", "known are angles of the leg"),
    ],
)
def test_laws_without_a_share_are_refused(name: str, message: str):
    with pytest.raises(UsageError, match=message):
        published_law(name)


def test_springs_of_a_figure_are_its_passive_torques():
    figure = read_figure("prototype")
    springs = read_springs(None, figure)
    pose = {name: np.full(len(one.chain), 0.3) for name, one in figure.joints.items()}
    frame = motion_from_figure(figure, pose)
    times = np.linspace(0.0, 1.5, 16)
    values = {name: np.tile(one, (16, 1)) for name, one in frame.displacements.items()}
    motion = replace(frame, times=times, displacements=values)
    moments = joint_moments(motion, NO_COORDINATES)
    columns = displacement_columns(motion.chains, NO_COORDINATES)
    law = SpringsLaw("own", motion, springs, moments, columns)
    found = law.torques({})
    for name in ("left_knee", "right_knee", "left_elbow"):
        axis = np.array(figure.joints[name].chain[0].axis)
        expected = passive_torque(figure, springs, name, pose) @ axis
        np.testing.assert_allclose(found[f"{name}_1"].torques, expected, rtol=1e-9, atol=1e-12)
        bent = {**pose, name: pose[name] + 0.1}
        moved = law.torques({f"{name}_1": 0.1})[f"{name}_1"].torques
        expected = passive_torque(figure, springs, name, bent) @ axis
        np.testing.assert_allclose(moved, expected, rtol=1e-9, atol=1e-12)
    standing = replace(law, zeros={"left_knee_1": 0.3}).torques({})["left_knee_1"].torques
    straight = {**pose, "left_knee": np.zeros(1)}
    expected = passive_torque(figure, springs, "left_knee", straight) @ np.array(
        figure.joints["left_knee"].chain[0].axis
    )
    np.testing.assert_allclose(standing, expected, atol=1e-12)
