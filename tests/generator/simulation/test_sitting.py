"""A person on a chair that fits."""

import numpy as np
import pytest

from generator import Model, Plan, read_figure, simulate
from generator.contact.scene import deepest_start
from generator.contact.spheres import fit_contact_spheres
from generator.diagnostics import ModelError
from generator.kinematics.placement import forward_kinematics
from generator.kinematics.tree import build_tree
from generator.simulation.sitting import sitting_start


@pytest.mark.parametrize("name", ["male50", "female50", "prototype"])
def test_a_person_touches_seat_back_and_floor_and_is_in_none(name: str):
    figure = read_figure(name)
    pose, scene = sitting_start(figure)
    poses = forward_kinematics(build_tree(figure), pose).poses
    spheres = [
        (segment, *(poses[segment] @ np.append(one.centre, 1.0))[:3], one.radius)
        for segment, fit in fit_contact_spheres(figure).items()
        for one in fit.spheres
    ]
    segments = [row[0] for row in spheres]
    numbers = np.array([row[1:] for row in spheres])
    numbers[:, 1] -= np.min(numbers[:, 1] - numbers[:, 3])  # as a run of height 0 begins
    centres, radii = numbers[:, :3], numbers[:, 3]
    for prop in scene.props:
        deepest = deepest_start(type(scene)((prop,)), centres, radii, segments)
        assert deepest is not None
        assert deepest.depth == pytest.approx(0.0, abs=1e-9)
    assert 0.25 < scene.props[1].shape.pose[1, 3] < 0.45


@pytest.mark.slow
@pytest.mark.parametrize("name", ["male50", "female50", "prototype"])
def test_a_limp_person_stays_on_the_chair(name: str):
    figure = read_figure(name)
    pose, scene = sitting_start(figure)
    start = {joint: tuple(pose[joint].tolist()) for joint in figure.joints}
    run = simulate(
        Model.of(figure),
        Plan(free_root=True, height=0.0, scene=scene, displacements=start, stop=4.0),
    )
    places = run.poses["lower_torso"][:, :3, 3]
    assert np.ptp(places[:, 1]) < 0.05
    assert np.ptp(places[:, 2]) < 0.15


def test_what_has_no_legs_does_not_sit():
    with pytest.raises(ModelError, match="no hip joints"):
        sitting_start(read_figure("pendulum"))
