"""The tab of a joint's passive moment, in a browser."""

from math import degrees

import numpy as np
import pytest

from generator.kinematics.placement import forward_kinematics
from generator.springs_file.read import read_springs
from generator.viewer.curve_panel import CurvePanel
from generator.viewer.viewer import Driver, FigureState, Viewer
from springs import SpringSet, total_torque
from tests.generator.viewer.conftest import type_into, wait_until

CHART = """() => { const plots = window.__viserTestpoints?.uplots ?? {};
const chart = Object.values(plots)[0]?.chart;
return chart ? [Array.from(chart.data, column => Array.from(column, value =>
    Number.isFinite(value) ? value : null)), chart.scales.x.max, chart.scales.y.max] : null; }"""
POINT, LAW, LOADED = -1, -2, -5
ANGLES = np.radians(np.linspace(-20.0, 140.0, 161))


def choose(page, label: str, option: str) -> None:
    page.get_by_label(label, exact=True).first.click()
    page.get_by_role("option", name=option, exact=True).click()


def columns(page) -> list[np.ndarray]:
    """Columns of the chart in the browser."""
    found = page.evaluate(CHART)
    return [] if found is None else [np.array(one, dtype=float) for one in found[0]]


def point(page) -> tuple[float, float] | None:
    """Angle [deg] and torque [N m] of the moving point in the browser."""
    data = columns(page)
    place = np.flatnonzero(np.isfinite(data[POINT])) if data else ()
    return (data[0][place[0]], data[POINT][place[0]]) if len(place) == 1 else None


def torques(springs: SpringSet, joint: str) -> np.ndarray:
    (axis,) = springs.joints[joint].axes
    return np.asarray(total_torque(axis.elastic, ANGLES))


def bend(viewer: Viewer, joint: str, angle: float) -> None:
    """Show the figure with one joint at another angle [rad]."""
    at = {**viewer.shown.displacements, joint: np.array([angle])}
    placement = forward_kinematics(viewer.content.placement.tree, at)
    viewer.show(FigureState(Driver.POSE, at, placement.poses))


@pytest.mark.slow
def test_a_curve_is_doubled_on_the_page_and_saved(run_viewer, open_page, tmp_path):
    running = run_viewer("prototype", (CurvePanel,))
    viewer, page = running.viewer, open_page(running)
    panel, loaded = viewer.panels[0], viewer.springs
    choose(page, "Joint", "Left knee")
    wait_until(lambda: viewer.joint == "left_knee")
    assert page.get_by_label("Motion", exact=True).first.input_value() == "flexion"
    assert panel.curve.label == "Left knee flexion"
    last = degrees(panel.curve.angles[-1])
    wait_until(lambda: (data := columns(page)) and abs(data[0][-1] - last) < 1e-9)
    before = columns(page)
    type_into(page, "Scale", "2")
    wait_until(lambda: viewer.springs is not loaded)
    assert np.array_equal(torques(viewer.springs, "left_knee"), 2.0 * torques(loaded, "left_knee"))
    assert viewer.springs.joints["right_knee"] == loaded.joints["right_knee"]
    wait_until(lambda: np.isfinite(columns(page)[LOADED]).all())
    data = columns(page)
    assert np.allclose(data[LAW], 2.0 * before[LAW], rtol=1e-12, atol=0.0)
    assert np.array_equal(data[LOADED], before[LAW])

    running.call(lambda: bend(viewer, "left_knee", 1.9))
    sign = float(np.sign(panel.curve.component(viewer.shown.displacements)))
    wait_until(lambda: abs(point(page)[0] - degrees(sign * 1.9)) < 1e-6)
    (axis,) = viewer.springs.joints["left_knee"].axes
    expected = float(total_torque(axis.elastic, sign * 1.9))
    assert abs(point(page)[1] - expected) < 1e-9
    page.get_by_text(f"{expected:.1f} N m at {degrees(sign * 1.9):.1f} deg").wait_for()

    (tmp_path / "mine.springs.toml").write_text("precious")
    type_into(page, "File", "mine")
    page.get_by_role("button", name="Save as .springs.toml").click()
    page.get_by_text("mine-2.springs.toml; mine.springs.toml exists and was kept").wait_for()
    again = read_springs(tmp_path / "mine-2.springs.toml", viewer.figure)
    assert (tmp_path / "mine.springs.toml").read_text() == "precious"
    assert again.joints == viewer.springs.joints
    page.get_by_role("button", name="Undo changes of this curve").click()
    wait_until(lambda: viewer.springs == loaded)


@pytest.mark.slow
def test_the_panel_follows_the_selection_and_other_springs(run_viewer, open_page):
    running = run_viewer("prototype", (CurvePanel,))
    viewer, page = running.viewer, open_page(running)
    panel = viewer.panels[0]
    running.call(lambda: viewer.select_joint("left_elbow"))
    wait_until(lambda: "Left elbow" in page.get_by_label("Joint", exact=True).first.input_value())
    assert panel.key[0] == "left_elbow"
    running.call(lambda: viewer.set_springs(viewer.springs.scaled(0.5, 1.0)))
    wait_until(lambda: np.isfinite(columns(page)[LOADED]).all())
    data = columns(page)
    assert np.allclose(data[LAW], 0.5 * data[LOADED], rtol=1e-12, atol=1e-12)
    type_into(page, "File", "../../out")
    assert panel.editor.edits == {}
    page.get_by_label("Both sides", exact=True).click()
    type_into(page, "Shift [deg]", "5")
    wait_until(lambda: len(panel.editor.edits) == 2)
    page.get_by_role("button", name="Save as .springs.toml").click()
    page.get_by_text("is not in the folder of the page").wait_for()
