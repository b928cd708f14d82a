"""Passive moments along displacements, against the torques of joints in their half-way frames."""

import numpy as np
import pytest

from generator.figure_file import read_figure
from generator.hold.passive import PassiveMoments
from generator.kinematics.placement import forward_kinematics, initial_displacements
from generator.kinematics.tree import build_tree
from generator.passive_curve import passive_torque, rotation_vector
from generator.rotations import matrix_from_rotation_vector
from generator.springs_file.read import read_springs
from springs import SphericalLaw


@pytest.mark.parametrize("law", [SphericalLaw.COORDINATES, SphericalLaw.CONSERVATIVE])
def test_moments_are_the_torques_along_the_rates(law: SphericalLaw):
    figure, random = read_figure("male50"), np.random.default_rng(2)
    tree, springs = build_tree(figure), read_springs(None, figure, law)
    passive, start = PassiveMoments(tree, springs), initial_displacements(tree)
    for _ in range(3):
        values = dict(start)
        for name, joint in figure.joints.items():
            if joint.lower_limit is not None and joint.upper_limit is not None:
                # Within the limits, where stops have no torque.
                low, high = np.array(joint.lower_limit), np.array(joint.upper_limit)
                middle, half = 0.5 * (low + high), 0.5 * (high - low)
                values[name] = middle + 0.6 * half * random.uniform(-1.0, 1.0, len(half))
        found = passive.moments(values)
        assert {
            "left_hip_joint",
            "left_knee",
            "left_ankle",
            "left_shoulder",
            "waist",
        } <= found.keys()
        for name, moments in found.items():
            chain = tree.chains[name]
            torque = passive_torque(figure, springs, name, values)
            half_way = matrix_from_rotation_vector(0.5 * rotation_vector(chain, values[name]))
            rates = chain.twists(values[name])[:, :3]
            turns = list(chain.rotations)
            if len(turns) == 1:
                expected = rates[turns] @ torque
            else:
                expected = rates[turns] @ (half_way @ torque)
            assert moments[turns] == pytest.approx(expected, abs=1e-8)


def test_stops_are_left_out_and_angles_beyond_are_noted():
    figure = read_figure("male50")
    tree, springs = build_tree(figure), read_springs(None, figure)
    passive, values = PassiveMoments(tree, springs), initial_displacements(tree)
    values["left_elbow"] = np.radians([0.0, 160.0])
    with_stop = passive_torque(figure, springs, "left_elbow", values)
    assert abs(with_stop[1]) > 100.0
    assert abs(passive.moments(values)["left_elbow"][1]) < 40.0
    notes = list(passive.notes(forward_kinematics(tree, values)))
    assert any("joint left_elbow at 160 deg is beyond its limit" in note for note in notes)
    assert not any("right_elbow" in note for note in notes)
