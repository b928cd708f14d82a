"""The panel of the pose: sliders of a page, files, and what drives the figure besides."""

from contextlib import suppress
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from viser import GuiEvent

from generator.kinematics.free_root import detach_root
from generator.kinematics.links import Coordinate
from generator.kinematics.placement import forward_kinematics, initial_displacements
from generator.kinematics.tree import build_tree
from generator.viewer.pose_panel import MAX_FOLDERS, PosePanel
from generator.viewer.scene import node_name
from generator.viewer.viewer import Content, Driver, FigureState
from springs import SpringSet
from tests.browser import node_pose
from tests.chains import BALL, row
from tests.generator.viewer.conftest import RunningViewer, wait_until

ELBOW = Coordinate("left_elbow", 0)
BEND = "Lateral bend to the right [deg]"


def start(run_viewer: Any, content: Any = "prototype") -> tuple[RunningViewer, PosePanel]:
    running = run_viewer(content, (PosePanel,))
    (panel,) = running.viewer.panels
    return running, panel


def act(handle: Any, value: Any) -> None:
    """Do what a page does when its user sets a control."""
    handle._impl.value = value
    for notify in handle._impl.update_cb:
        with suppress(StopIteration):  # the callback does not wait for anything
            notify(GuiEvent(object(), 0, handle)).send(None)


def number_field(page: Any, label: str) -> Any:
    """Return the number field of the slider with a label."""
    return page.get_by_text(label, exact=True).locator("xpath=../../..").locator("input[type=text]")


def test_a_slider_moves_the_figure_on_the_page(run_viewer, open_page, tmp_path):
    running, panel = start(run_viewer)
    viewer = running.viewer
    running.call(lambda: viewer.select_joint("waist"))
    page = open_page(running)
    nodes = {segment: node_name(segment) for segment in viewer.scene.meshes}

    def page_agrees() -> bool:
        found = {segment: node_pose(page, node) for segment, node in nodes.items()}
        return all(
            pose is not None and np.abs(pose - viewer.shown.poses[segment]).max() < 1e-6
            for segment, pose in found.items()
        )

    wait_until(page_agrees)
    field = number_field(page, BEND)
    field.fill("12.5")
    field.press("Enter")
    bend = np.radians([0.0, 12.5, 0.0])
    wait_until(lambda: np.allclose(viewer.shown.displacements["waist"], bend, atol=1e-9))
    assert viewer.shown.driver is Driver.POSE
    wait_until(page_agrees)

    page.get_by_role("button", name="Save", exact=True).click()
    path = tmp_path / "new.pose"
    wait_until(path.exists)
    assert path.read_text() == panel.editor.text()
    page.get_by_role("button", name="Undo", exact=True).click()
    wait_until(lambda: not np.any(viewer.shown.displacements["waist"]))
    wait_until(lambda: field.input_value() == "0")
    page.get_by_role("button", name="Load", exact=True).click()
    wait_until(lambda: np.allclose(viewer.shown.displacements["waist"], bend, atol=1e-9))
    wait_until(page_agrees)


def test_a_pose_is_saved_beside_those_that_exist(run_viewer, tmp_path, monkeypatch):
    running, panel = start(run_viewer, "pendulum")
    told: list[str] = []
    monkeypatch.setattr(running.viewer, "notify", lambda _, text, **__: told.append(text))
    (tmp_path / "new.pose").write_text("precious")
    (tmp_path / "sub").mkdir()
    for name, written in (
        ("new.pose", "new-2.pose"),
        ("new-2.pose", "new-3.pose"),
        ("sub/a.pose", "sub/a.pose"),
        ("sub/a.pose", "sub/a-2.pose"),
    ):
        running.call(lambda name=name: setattr(panel._name, "value", name))
        running.call(panel._save)
        assert (tmp_path / written).read_text() == panel.editor.text()
        assert panel._name.value == written
    assert (tmp_path / "new.pose").read_text() == "precious"
    assert told == [
        "new-2.pose; new.pose exists and was kept",
        "new-3.pose; new-2.pose exists and was kept",
        "a.pose",
        "a-2.pose; a.pose exists and was kept",
    ]


def test_sliders_follow_a_motion_and_take_over_where_it_is(run_viewer):
    running, panel = start(run_viewer)
    viewer, slider = running.viewer, panel.sliders[ELBOW]
    tree = viewer.content.placement.tree
    moved = forward_kinematics(
        tree, initial_displacements(tree) | {"left_elbow": np.array([0.5]),
                                             "waist": np.array([0.1, 0.2, 0.3])}
    )  # fmt: skip
    shown = FigureState(Driver.MOTION, moved.displacements, moved.poses, 1.0)
    running.call(lambda: viewer.show(shown))
    wait_until(lambda: slider.value == pytest.approx(np.degrees(0.5)))
    act(slider, 40.0)
    wait_until(lambda: viewer.shown.driver is Driver.POSE)
    assert viewer.shown.displacements["left_elbow"] == pytest.approx(np.radians([40.0]))
    assert viewer.shown.displacements["waist"] == pytest.approx([0.1, 0.2, 0.3])
    waist = panel.sliders[Coordinate("waist", 2)]
    assert waist.value == pytest.approx(np.degrees(0.3))


def test_a_value_set_while_the_program_sets_others_is_not_lost(run_viewer):
    """The value counts that the slider had when the user moved it."""
    running, panel = start(run_viewer)
    slider = panel.sliders[ELBOW]

    def user_and_program() -> None:
        act(slider, 30.0)
        slider.value = 5.0

    running.call(user_and_program)
    wait_until(lambda: running.viewer.shown.displacements["left_elbow"] != 0.0)
    assert running.viewer.shown.displacements["left_elbow"] == pytest.approx(np.radians([30.0]))
    wait_until(lambda: slider.value == pytest.approx(30.0))


def test_joints_that_a_free_figure_does_not_have_are_disabled_meanwhile(run_viewer):
    running, panel = start(run_viewer)
    viewer = running.viewer
    root = panel.sliders[Coordinate("root_torso", 0)]
    free, moved = detach_root(viewer.figure, viewer.shown.displacements)
    placement = forward_kinematics(build_tree(free), moved)
    pose = viewer.shown
    running.call(lambda: viewer.show(FigureState(Driver.LIVE, moved, placement.poses, 0.0)))
    wait_until(lambda: root.disabled)
    assert not panel.sliders[ELBOW].disabled
    running.call(lambda: viewer.show(pose))
    wait_until(lambda: not root.disabled)


def test_a_displacement_beyond_the_slider_widens_it(run_viewer):
    running, panel = start(run_viewer)
    slider = panel.sliders[ELBOW]
    running.call(lambda: panel.editor.set_coordinate(ELBOW, 3.0))
    placement = panel.editor.placement
    shown = FigureState(Driver.POSE, placement.displacements, placement.poses)
    running.call(lambda: running.viewer.show(shown))
    wait_until(lambda: slider.value == pytest.approx(np.degrees(3.0)))
    assert slider.max >= slider.value


def test_a_loop_that_cannot_close_puts_the_slider_back(run_viewer):
    running, panel = start(run_viewer, "fourbar")
    slider = panel.sliders[Coordinate("rocker_bearing", 0)]
    before = dict(running.viewer.shown.displacements)
    act(slider, 0.0)
    wait_until(lambda: slider.value == pytest.approx(180.0))
    for name, values in before.items():
        assert np.array_equal(running.viewer.shown.displacements[name], values)


def test_of_a_large_figure_the_sliders_of_the_selected_joint_are_shown(run_viewer, tmp_path):
    figure = row(160, (BALL,), 0.01)
    tree = build_tree(figure)
    assert len(figure.joints) > MAX_FOLDERS
    placement = forward_kinematics(tree, initial_displacements(tree))
    content = Content(figure, SpringSet(), placement, tmp_path)
    running, panel = start(run_viewer, content)
    assert {each.joint for each in panel.sliders} == {"joint0"}
    running.call(lambda: running.viewer.select_segment("bar90"))
    assert {each.joint for each in panel.sliders} == {"joint90"}
    act(panel.sliders[Coordinate("joint90", 1)], 20.0)
    wait_until(lambda: running.viewer.shown.displacements["joint90"][1] > 0.3)


def test_marks_change_with_the_springs(run_viewer):
    running, panel = start(run_viewer)
    viewer = running.viewer
    before = panel.sliders[ELBOW]
    springs = viewer.springs
    others = {name: each for name, each in springs.joints.items() if name != "left_elbow"}
    running.call(lambda: viewer.set_springs(replace(springs, joints=others)))
    wait_until(lambda: panel.sliders.get(ELBOW, before) is not before)
    assert panel.sliders[ELBOW].label == "About y [deg]"
    assert panel.sliders[ELBOW].min == pytest.approx(-180.0)


def test_a_selected_joint_is_open_above_the_others(run_viewer):
    running = run_viewer("male50", (PosePanel,))
    viewer, panel = running.viewer, running.viewer.panels[0]
    for segment, joint in (("left_lower_leg", "left_knee"), ("head", "neck")):
        running.call(lambda segment=segment: viewer.select_segment(segment))
        folder = panel._folders[joint]
        assert viewer.joint == joint
        assert folder.expand_by_default
        assert folder.order == min(each.order for each in panel._folders.values())
