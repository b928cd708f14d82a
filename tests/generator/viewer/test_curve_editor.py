"""Changes of curves on the page, and the chart of a curve, without a browser."""

from dataclasses import replace
from math import degrees, radians
from pathlib import Path

import numpy as np
import pytest

from generator import read_figure
from generator.diagnostics import ModelError, UsageError
from generator.passive_curve import initial_angles
from generator.springs_file.read import read_springs
from generator.viewer import curve_editor
from springs import Linear, total_torque

FIGURE = read_figure("prototype")
SPRINGS = read_springs(None, FIGURE)
AT = initial_angles(FIGURE)
POINT, LAW, BELOW, LOADED = -1, -2, -4, -5


@pytest.fixture
def editor(tmp_path: Path) -> curve_editor.CurveEditor:
    return curve_editor.CurveEditor(FIGURE, SPRINGS, tmp_path, None)


def knee_key(editor: curve_editor.CurveEditor):
    return "left_knee", editor.motions("left_knee")["flexion"]


def test_joints_and_motions_are_offered_by_their_names(editor: curve_editor.CurveEditor):
    assert editor.joints["Left hip"] == "left_hip_joint"
    assert set(editor.joints.values()) == set(SPRINGS.joints)
    assert set(editor.motions("left_shoulder")) == {"flexion", "abduction", "medial rotation"}
    assert "knee" in editor.best_known_joint or "hip" in editor.best_known_joint


def test_a_change_and_its_undoing(editor: curve_editor.CurveEditor, tmp_path: Path):
    key = knee_key(editor)
    springs = editor.change(replace(editor.edit(key), scale=2.0), both_sides=False)
    assert springs.joints["right_knee"] == SPRINGS.joints["right_knee"]
    (left,), (before,) = (one.joints["left_knee"].axes for one in (springs, SPRINGS))
    at = np.radians(np.linspace(-20.0, 140.0, 50))
    doubled = 2.0 * np.asarray(total_torque(before.elastic, at))
    assert np.array_equal(np.asarray(total_torque(left.elastic, at)), doubled)
    path = tmp_path / "mine.springs.toml"
    path.write_text(editor.text(path), encoding="utf-8")
    assert read_springs(path, FIGURE).joints == springs.joints
    editor.change(replace(editor.edit(key), scale=1.0), both_sides=False)
    assert (editor.edits, editor.springs) == ({}, SPRINGS)
    with pytest.raises(UsageError, match="nothing to save"):
        editor.text(path)


def test_both_sides_are_changed_together(editor: curve_editor.CurveEditor):
    key = knee_key(editor)
    editor.change(replace(editor.edit(key), viscous=1.0), both_sides=True)
    assert {joint for joint, _ in editor.edits} == {"left_knee", "right_knee"}
    assert editor.other_side(key) in editor.edits
    waist = "waist", editor.motions("waist")["flexion"]
    assert editor.other_side(waist) is None


def test_values_as_loaded_are_not_a_change(editor: curve_editor.CurveEditor):
    key = knee_key(editor)
    viscous = editor.loaded_spring(key).damping.viscous
    editor.change(replace(editor.edit(key), viscous=viscous), both_sides=False)
    assert editor.edits == {}


def test_nothing_changes_on_an_error(editor: curve_editor.CurveEditor):
    key = knee_key(editor)
    editor.change(replace(editor.edit(key), scale=2.0), both_sides=False)
    edits, springs = dict(editor.edits), editor.springs
    with pytest.raises(ModelError, match="stiffness"):
        editor.change(replace(editor.edit(key), stiffness=2.0), both_sides=False)
    assert (editor.edits, editor.springs) == (edits, springs)


def test_the_changed_file_is_not_overwritten(tmp_path: Path):
    path = tmp_path / "mine.springs.toml"
    path.write_text('[[spring]]\njoints = ["left_knee"]\nstiffness_Nm_rad = 2\n', "utf-8")
    editor = curve_editor.CurveEditor(FIGURE, read_springs(path, FIGURE), tmp_path, path)
    key = knee_key(editor)
    springs = editor.change(replace(editor.edit(key), stiffness=3.0), both_sides=False)
    (axis,) = springs.joints["left_knee"].axes
    assert axis.elastic == (Linear(3.0),)
    with pytest.raises(UsageError, match=r"`mine\.springs\.toml` holds the springs"):
        editor.text(path)
    other = tmp_path / "other.springs.toml"
    other.write_text(editor.text(other), "utf-8")
    assert read_springs(other, FIGURE).joints == springs.joints


def test_every_column_of_the_chart_has_a_series(editor: curve_editor.CurveEditor):
    for joint in editor.joints.values():
        for direction in editor.motions(joint).values():
            curve = editor.curve(SPRINGS, (joint, direction), AT)
            assert curve is not None
            for angle in (0.0, radians(40.0), radians(250.0)):
                columns = curve_editor.chart_data(curve, curve, angle, 50.0)
                assert len(columns) == len(curve_editor.chart_series())
                assert len({len(column) for column in columns}) == 1
                assert np.all(np.diff(columns[0]) > 0.0)
                (place,) = np.flatnonzero(np.isfinite(columns[POINT]))
                assert columns[0][place] == pytest.approx(degrees(angle))
                assert columns[POINT][place] == pytest.approx(float(curve.moment_at(angle)))
                low, high = curve_editor.angle_limits(curve, curve, angle)
                assert low <= columns[0][0]
                assert columns[0][-1] <= high
                moment = float(curve.moment_at(angle))
                assert abs(moment) <= curve_editor.torque_limit(curve, moment)
    for band in curve_editor.chart_bands():
        assert max(band["series"]) < len(curve_editor.chart_series())


def test_a_band_ends_with_its_curve(editor: curve_editor.CurveEditor):
    curve = editor.curve(SPRINGS, knee_key(editor), AT)
    assert curve is not None
    columns = curve_editor.chart_data(curve, curve, 0.0, 50.0)
    normal, *scatter = curve_editor.chart_bands()
    high, low = (columns[place] for place in normal["series"])
    low_end, high_end = (end.angle for end in curve.normal_ends if end is not None)
    inside = (np.radians(columns[0]) > low_end) & (np.radians(columns[0]) < high_end)
    assert np.array_equal(high > 50.0, inside)
    assert np.array_equal(low, -high)
    for row, band in zip(curve.published, scatter, strict=False):
        high, low = (columns[place] for place in band["series"])
        drawn = np.isfinite(columns[max(band["series"]) + 1])
        assert np.array_equal(low[~drawn], high[~drawn])
        assert np.any(high[drawn] > low[drawn]) == (row.band is not None)


def test_a_series_joins_nothing_across_a_gap(editor: curve_editor.CurveEditor):
    coupled = read_springs("coupled", FIGURE)
    editor = curve_editor.CurveEditor(FIGURE, coupled, Path(), "coupled")
    for joint in ("left_hip_joint", "left_knee", "left_elbow"):
        key = joint, editor.motions(joint)["flexion"]
        curve = editor.curve(coupled, key, AT)
        assert curve is not None
        for column in curve_editor.chart_data(curve, curve, 0.3, 50.0)[:POINT]:
            assert np.count_nonzero(np.diff(np.isfinite(column).astype(int)) != 0) <= 2
        known = curve.valid_range
        columns = curve_editor.chart_data(curve, curve, 0.3, 50.0)
        drawn = np.isfinite(columns[LAW])
        if known is not None:
            assert np.radians(columns[0][drawn]).min() >= known[0] - 1e-9
            assert np.isfinite(columns[BELOW]).any()
        else:
            assert drawn.all()


def test_the_law_as_loaded_is_drawn_when_it_was_changed(editor: curve_editor.CurveEditor):
    key = knee_key(editor)
    before = editor.curve(SPRINGS, key, AT)
    after = editor.curve(
        editor.change(replace(editor.edit(key), scale=2.0), both_sides=False), key, AT
    )
    assert before is not None
    assert after is not None
    assert not np.isfinite(curve_editor.chart_data(before, before, 0.0, 50.0)[LOADED]).any()
    columns = curve_editor.chart_data(after, before, 0.0, 50.0)
    assert np.array_equal(columns[LAW], 2.0 * columns[LOADED])
    assert "As loaded" in curve_editor.legend_html(after, is_changed=True)
    assert "As loaded" not in curve_editor.legend_html(before, is_changed=False)


def test_texts_are_never_markup(editor: curve_editor.CurveEditor):
    curve = editor.curve(SPRINGS, knee_key(editor), AT)
    assert curve is not None
    bad = "<img src=x onerror=alert(1)>"
    spring = replace(curve.spring, motion=bad, reference=bad, why=bad)
    evil = replace(curve, spring=spring, joint=bad)
    for html in (
        curve_editor.legend_html(evil, is_changed=True),
        curve_editor.sources_html(evil),
        curve_editor.moment_html(bad, [bad]),
    ):
        assert "<img" not in html
        assert "&lt;img" in html
    assert all(
        colour in curve_editor.legend_html(curve, is_changed=False)
        for colour in curve_editor.PUBLISHED_COLOURS
    )
    assert "20 living subjects" in curve_editor.sources_html(curve)
