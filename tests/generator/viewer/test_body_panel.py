"""The panel of the body: balance and mass on a page."""

from typing import Any

import numpy as np
import pytest

from generator.kinematics.stability import stability
from generator.rotations import Array, matrix_from_rotation_vector, pose_matrix
from generator.viewer import body_panel
from generator.viewer.balance import BalanceModel, BalanceState
from generator.viewer.scene import SELECTED_COLOUR, rgb
from generator.viewer.viewer import Driver, FigureState, Viewer
from tests.browser import node_pose
from tests.generator.viewer.conftest import wait_until

NODE_COLOUR = """name => { let found = null;
window.__viserMutable.nodeRefFromName[name]?.traverse(part => {
    if (part.isMesh && part.material.color && !found)
        found = part.material.color.getHex(); }); return found; }"""
NODE_VISIBLE = "name => window.__viserMutable.nodeRefFromName[name]?.visible === true"


def hexadecimal(colour: tuple[int, int, int]) -> int:
    red, green, blue = colour
    return (red << 16) + (green << 8) + blue


@pytest.mark.slow
def test_balance_is_drawn_in_the_colour_of_the_pose(run_viewer, open_page):
    running = run_viewer("prototype", (body_panel.BodyPanel,))
    viewer, page = running.viewer, open_page(running)

    def has_colour(colour: tuple[int, int, int]) -> bool:
        return page.evaluate(NODE_COLOUR, "/balance/centre") == hexadecimal(colour)

    def is_visible() -> bool:
        return page.evaluate(NODE_VISIBLE, "/balance")

    wait_until(lambda: node_pose(page, "/balance") is not None)
    assert not is_visible()
    page.get_by_label("Balance", exact=True).click()
    wait_until(is_visible)
    wait_until(lambda: has_colour(body_panel.BALANCED_COLOUR))
    page.get_by_text("inside the edge of the support").wait_for()

    lean = pose_matrix(matrix_from_rotation_vector(np.array([0.3, 0.0, 0.0])), np.zeros(3))
    first = viewer.shown
    poses = {name: lean @ pose for name, pose in first.poses.items()}
    leaning = FigureState(Driver.POSE, first.displacements, poses)
    running.call(lambda: viewer.show(leaning))
    wait_until(lambda: has_colour(body_panel.UNBALANCED_COLOUR))
    state = BalanceModel(viewer.figure, viewer.scene.appearances).state(leaning.poses)
    found = node_pose(page, "/balance/centre")
    assert found is not None
    assert np.allclose(found[:3, 3], state.centre, atol=1e-6)
    page.get_by_text("outside the support").wait_for()
    page.get_by_label("Balance", exact=True).click()
    wait_until(lambda: not is_visible())

    # a click on the chest shows its numbers, and draws its ellipsoid
    running.call(lambda: viewer.show(first))
    (client,) = wait_until(running.server.get_clients).values()
    client.camera.position = np.array([30.0, 0.0, 0.0])
    page.get_by_role("button", name="Frame the figure").click()
    wait_until(lambda: np.linalg.norm(client.camera.position) < 10.0)
    wait_until(lambda: click_chest(page, viewer))
    assert viewer.segment == "center_torso"
    assert tuple(viewer.scene.meshes["center_torso"].color) == rgb(SELECTED_COLOUR)
    page.get_by_text("Density: 463.8 kg/m^3").wait_for()
    page.get_by_label("Inertia ellipsoid", exact=True).click()
    wait_until(lambda: node_pose(page, "/figure/center_torso/inertia") is not None)


def click_chest(page: Any, viewer: Viewer) -> bool:
    """Click the chest of a framed figure, which is below its head and beside the controls."""
    page.mouse.click(400, 240)
    page.wait_for_timeout(200)
    return viewer.segment is not None


def regular_polygon(count: int) -> Array:
    angles = 2.0 * np.pi * np.arange(count) / count
    return np.stack([np.sin(angles), np.zeros(count), np.cos(angles)], axis=1)


@pytest.mark.parametrize("count", [0, 1, 2, 3, 31, 32, 33, 200])
@pytest.mark.parametrize("centre", [(0.0, 1.0, 0.0), (3.0, 1.0, 0.0)])
def test_a_support_of_any_number_of_corners_is_drawn(
    run_viewer, count: int, centre: tuple[float, float, float]
):
    nodes = body_panel.BalanceNodes(run_viewer("fourbar", ()).server.scene, 1.0)
    state = BalanceState(np.array(centre), 0.0, stability(centre, regular_polygon(count)))
    nodes.show(state)
    assert nodes.area.visible is (count > 0)
    colour = body_panel.BALANCED_COLOUR if state.is_balanced else body_panel.UNBALANCED_COLOUR
    assert nodes.centre.color == nodes.area.color == colour
    assert np.allclose(nodes.centre.position, centre)
    if count == 0:
        assert nodes.margin.text == ""
        return
    points = nodes.area.vertices[nodes.area.faces]
    areas = 0.5 * np.linalg.norm(
        np.cross(points[:, 1] - points[:, 0], points[:, 2] - points[:, 0]), axis=1
    )
    assert areas.sum() == pytest.approx(state.stability.area, abs=1e-5)
    assert nodes.outline.points.shape == (len(nodes.area.vertices), 2, 3)
    assert np.allclose(nodes.edge.points[0], state.pivot)
    assert nodes.margin.text == f"{100.0 * state.stability.margin:.1f} cm".replace("-0.0", "0.0")
