"""Arrows on a segment: dragged with the mouse, also by a page that is closed meanwhile."""

from contextlib import suppress
from typing import Any

import numpy as np
import pytest
from viser import TransformControlsEvent
from viser.transforms import SO3

from generator.kinematics.placement import forward_kinematics, initial_displacements
from generator.rotations import quaternion_from_matrix
from generator.viewer.limb_drag import GIZMO, NO_SEGMENT
from generator.viewer.pose_editor import drag_point
from generator.viewer.pose_panel import PosePanel
from tests.browser import WAIT, node_pose
from tests.generator.viewer.conftest import wait_until
from tests.generator.viewer.test_pose_panel import act

ARM = "left_lower_arm"
UP = np.array([0.0, 0.1, 0.0])


def pull(arrows: Any, number: int, phase: str, position: Any, turn: Any) -> None:
    """Do what a page does when its user drags the arrows."""
    arrows._impl.position, arrows._impl.wxyz = np.array(position), quaternion_from_matrix(turn)
    for notify in arrows._impl_aux.update_cb:
        with suppress(StopIteration):  # the callback does not wait for anything
            notify(TransformControlsEvent(object(), number, arrows, phase)).send(None)


def on_screen(client: Any, point: Any) -> tuple[float, float]:
    """Return the pixel of a page at which a point of the world is seen."""
    camera = client.camera
    x, y, z = SO3(np.array(camera.wxyz)).as_matrix().T @ (point - np.array(camera.position))
    scale = 0.5 * camera.image_height / np.tan(0.5 * camera.fov)
    return camera.image_width / 2 + scale * x / z, camera.image_height / 2 + scale * y / z


@pytest.mark.slow
def test_a_hand_is_dragged_and_a_page_that_leaves_in_mid_drag_does_no_harm(run_viewer, open_page):
    running = run_viewer("prototype")
    viewer = running.viewer
    panel = next(panel for panel in viewer.panels if isinstance(panel, PosePanel))
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
    (client,) = wait_until(running.server.get_clients).values()
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


def test_a_limb_with_arrows_reacts_to_the_mouse_again_without_them(run_viewer):
    running = run_viewer("prototype")
    panel = next(panel for panel in running.viewer.panels if isinstance(panel, PosePanel))
    mesh = running.viewer.scene.meshes[ARM]
    before = list(mesh._impl.click_cb), list(mesh._impl.drag_cb)
    assert all(before)
    act(panel.limb.segments, ARM)
    wait_until(lambda: not mesh._impl.click_cb and not mesh._impl.drag_cb)
    act(panel.limb.segments, NO_SEGMENT)
    wait_until(lambda: (mesh._impl.click_cb, mesh._impl.drag_cb) == before)


def test_a_dragged_segment_follows_with_its_orientation(run_viewer):
    """Events of two pages at once: each one's last target counts, and none is left over."""
    running = run_viewer("prototype", (PosePanel,))
    viewer = running.viewer
    (panel,) = viewer.panels
    act(panel.limb.segments, ARM)
    act(panel.limb.turning, True)
    arrows = running.call(lambda: panel.limb.arrows)
    tree = viewer.content.placement.tree
    bent = {"left_shoulder": np.array([0.1, 0.2, -0.1]), "left_elbow": np.array([0.4])}
    goal = forward_kinematics(tree, initial_displacements(tree) | bent).poses[ARM]
    turn, place = goal[:3, :3], goal[:3, :3] @ drag_point(tree, ARM) + goal[:3, 3]
    clients = {number: object() for number in (7, 8)}
    running.server.get_clients = lambda: clients
    for number in clients:
        pull(arrows, number, "start", arrows.position, np.eye(3))
    for number, far in ((7, 0.02), (8, -0.02), (7, 0.0)):
        pull(arrows, number, "update", place + far, turn)
    wait_until(lambda: np.allclose(viewer.shown.poses[ARM], goal, atol=1e-4))
    pull(arrows, 7, "end", place, turn)
    wait_until(lambda: running.call(lambda: panel.is_dragged))
    del clients[8]
    wait_until(lambda: not panel.is_dragged)
