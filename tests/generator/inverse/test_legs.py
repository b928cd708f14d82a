"""Coordinates that are angles of published laws of the leg."""

import numpy as np
import pytest

from generator import build_tree, read_figure
from generator.figure import Figure
from generator.input_files.coordinates import NO_COORDINATES, displacement_columns
from generator.inverse.legs import find_legs
from generator.kinematics.placement import forward_kinematics
from generator.model_files.formats import read_model
from tests.generator.inverse.walking import MODEL


def legs_of(figure: Figure, coordinates=NO_COORDINATES):
    chains = {name: joint.chain for name, joint in figure.joints.items()}
    return find_legs(build_tree(figure), displacement_columns(chains, coordinates))


def test_knees_of_the_planar_model_bend_backwards():
    imported = read_model(MODEL)
    legs = legs_of(imported.figure, imported.coordinates)
    for side, letter in (("right", "r"), ("left", "l")):
        found = {motion: (at.coordinate, at.sign) for motion, at in legs[side].items()}
        assert found == {
            "hip flexion": (f"hip_flexion_{letter}", 1.0),
            "knee flexion": (f"knee_angle_{letter}", -1.0),
            "ankle dorsiflexion": (f"ankle_angle_{letter}", 1.0),
        }


@pytest.mark.parametrize("name", ["male50", "female50"])
def test_flexion_of_persons_moves_what_is_beyond(name: str):
    """A person faces z: by 0.1 rad the knee goes ahead, the ankle back, the toes up."""
    figure = read_figure(name)
    tree = build_tree(figure)
    zeros = {joint: np.zeros(len(one.chain)) for joint, one in figure.joints.items()}

    def moved(coordinate: str, sign: float, segment: str) -> np.ndarray:
        joint, _, place = coordinate.rpartition("_")
        bent = {**zeros, joint: zeros[joint].copy()}
        bent[joint][int(place) - 1] = 0.1 * sign
        centre = np.append(figure.segments[segment].centre_of_mass, 1.0)
        at_rest, now = (forward_kinematics(tree, one).poses[segment] for one in (zeros, bent))
        return (now @ centre - at_rest @ centre)[:3]

    for side, leg in legs_of(figure).items():
        hip, knee, ankle = leg.values()
        assert moved(hip.coordinate, hip.sign, f"{side}_upper_leg")[2] > 0.01
        assert moved(knee.coordinate, knee.sign, f"{side}_lower_leg")[2] < -0.01
        assert moved(ankle.coordinate, ankle.sign, f"{side}_foot")[1] > 0.003


@pytest.mark.parametrize("name", ["pendulum", "leg"])
def test_figures_without_feet_have_no_legs(name: str):
    assert legs_of(read_figure(name)) == {}
