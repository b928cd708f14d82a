"""Meshes of a figure in the scene of the page."""

import numpy as np

from generator.viewer.scene import node_name
from tests.browser import node_pose
from tests.generator.viewer.conftest import wait_until


def test_the_browser_has_the_poses_of_the_server(run_viewer, open_page):
    running = run_viewer("prototype")
    page = open_page(running)
    nodes = list(map(node_name, running.viewer.scene.meshes))
    wait_until(lambda: all(node_pose(page, node) is not None for node in nodes))
    for segment, node in zip(running.viewer.scene.meshes, nodes, strict=True):
        pose = running.viewer.shown.poses[segment]
        assert np.abs(node_pose(page, node) - pose).max() < 1e-6
