"""The panel of the body: balance and mass on a page."""

import numpy as np

from generator.rotations import matrix_from_rotation_vector, pose_matrix
from generator.viewer.balance import BalanceModel
from generator.viewer.body_panel import BALANCED_COLOUR, UNBALANCED_COLOUR, BodyPanel
from generator.viewer.scene import SELECTED_COLOUR, rgb
from generator.viewer.viewer import Driver, Shown
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


def test_balance_is_drawn_in_the_colour_of_the_pose(run_viewer, open_page):
    running = run_viewer("prototype", (BodyPanel,))
    viewer, page = running.viewer, open_page(running)

    def has_colour(colour: tuple[int, int, int]) -> bool:
        return page.evaluate(NODE_COLOUR, "/balance/centre") == hexadecimal(colour)

    def is_visible() -> bool:
        return page.evaluate(NODE_VISIBLE, "/balance")

    wait_until(lambda: node_pose(page, "/balance") is not None)
    assert not is_visible()
    page.get_by_label("Balance", exact=True).click()
    wait_until(is_visible)
    wait_until(lambda: has_colour(BALANCED_COLOUR))
    page.get_by_text("inside the edge of the support").wait_for()

    lean = pose_matrix(matrix_from_rotation_vector(np.array([0.3, 0.0, 0.0])), np.zeros(3))
    first = viewer.shown
    poses = {name: lean @ pose for name, pose in first.poses.items()}
    leaning = Shown(Driver.POSE, first.displacements, poses)
    running.call(lambda: viewer.show(leaning))
    wait_until(lambda: has_colour(UNBALANCED_COLOUR))
    state = BalanceModel(viewer.figure, viewer.scene.appearances).state(leaning.poses)
    found = node_pose(page, "/balance/centre")
    assert found is not None
    assert np.allclose(found[:3, 3], state.centre, atol=1e-6)
    page.get_by_text("outside the support").wait_for()
    page.get_by_label("Balance", exact=True).click()
    wait_until(lambda: not is_visible())

    # a click on the chest shows its numbers, and draws its ellipsoid
    running.call(lambda: viewer.show(first))
    running.call(viewer.frame_camera)
    wait_until(lambda: _click(page, viewer))
    assert viewer.segment == "center_torso"
    assert tuple(viewer.scene.meshes["center_torso"].color) == rgb(SELECTED_COLOUR)
    page.get_by_text("Density: 463.8 kg/m^3").wait_for()
    page.get_by_label("Inertia ellipsoid", exact=True).click()
    wait_until(lambda: node_pose(page, "/figure/center_torso/inertia") is not None)


def _click(page, viewer) -> bool:
    """Click the chest: a quarter below the head of a figure of 80 % of the page's height."""
    page.mouse.click(400, 240)
    page.wait_for_timeout(200)
    return viewer.segment is not None
