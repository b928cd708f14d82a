"""Arrows on a segment: dragged with the mouse, also by a page that is closed meanwhile."""

from typing import Any

import numpy as np
from viser.transforms import SO3

from generator.viewer.limb_drag import GIZMO
from generator.viewer.pose_editor import drag_point
from generator.viewer.pose_panel import PosePanel
from tests.browser import WAIT, node_pose
from tests.generator.viewer.conftest import wait_until

ARM = "left_lower_arm"
UP = np.array([0.0, 0.1, 0.0])


def on_screen(client: Any, point: Any) -> tuple[float, float]:
    """Return the pixel of a page at which a point of the world is seen."""
    camera = client.camera
    x, y, z = SO3(np.array(camera.wxyz)).as_matrix().T @ (point - np.array(camera.position))
    scale = 0.5 * camera.image_height / np.tan(0.5 * camera.fov)
    return camera.image_width / 2 + scale * x / z, camera.image_height / 2 + scale * y / z


def test_a_hand_is_dragged_and_a_page_that_leaves_in_mid_drag_does_no_harm(run_viewer, open_page):
    running = run_viewer("prototype", (PosePanel,))
    viewer = running.viewer
    (panel,) = viewer.panels
    point = drag_point(viewer.content.placement.tree, ARM)

    def hand() -> Any:
        pose = viewer.shown.poses[ARM]
        return pose[:3, :3] @ point + pose[:3, 3]

    def gizmo_is_at_the_hand(page: Any) -> bool:
        pose = node_pose(page, GIZMO)
        return pose is not None and bool(np.abs(pose[:3, 3] - hand()).max() < 1e-5)

    def grab(page: Any, client: Any) -> None:
        """Press the mouse at the arrow that points up, and move it until the drag begins."""

        def begins() -> bool:
            page.mouse.up()
            page.wait_for_timeout(200.0)
            x, y = on_screen(client, hand() + UP)
            page.mouse.move(x + 3.0, y)
            page.mouse.move(x, y, steps=3)
            page.wait_for_timeout(400.0)  # the arrow under the mouse is found when it is drawn
            page.mouse.down()
            page.mouse.move(x, y - 4.0, steps=2)
            page.wait_for_timeout(300.0)
            return panel.is_dragged

        wait_until(begins)

    first = open_page(running)
    (client,) = running.server.get_clients().values()
    first.get_by_label("Segment").click()
    first.get_by_role("option", name=ARM).click()
    wait_until(lambda: gizmo_is_at_the_hand(first))
    start = hand()

    grab(first, client)
    x, y = on_screen(client, start + 3.0 * UP)
    first.mouse.move(x, y, steps=6)
    wait_until(lambda: hand()[1] - start[1] > 0.1)
    first.mouse.up()
    wait_until(lambda: not panel.is_dragged)
    moved = hand() - start
    assert abs(moved[0]) < 1e-5  # only along the arrow
    assert abs(moved[2]) < 1e-5
    assert viewer.shown.displacements["left_elbow"][0] > 0.1  # it bends forwards
    assert not np.any(viewer.shown.displacements["waist"])

    second = open_page(running)
    wait_until(lambda: gizmo_is_at_the_hand(second))
    grab(first, client)
    first.context.close()
    wait_until(lambda: not panel.is_dragged, WAIT)
    second.get_by_role("button", name="Reset", exact=True).click()
    wait_until(lambda: np.allclose(hand(), start, atol=1e-9))
    wait_until(lambda: gizmo_is_at_the_hand(second))
