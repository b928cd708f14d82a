"""Rules that make laws: points of published curves, walls, springs in series, growing torques."""

from math import radians

import numpy as np
import pytest

from generator.person.passive_laws import (
    LawContext,
    build_law,
    rest_stiffness,
)
from springs import Linear
from springs.interpolated import Interpolated
from springs.published.tables import coupled_law, curve

CONTEXT = LawContext((radians(-40.0), radians(60.0)))


def test_points_of_a_curve_are_on_it_and_go_on_along_the_tangent():
    angles = [-30, -20, -10, 0, 10, 20, 30]
    row = {"pieces": [{"published": "anderson_1999/subtalar", "deg": angles}]}
    law = build_law(row, CONTEXT)
    expected = curve("anderson_1999/subtalar").law.torque(np.radians(angles))
    assert law.elastic.torque(np.radians(angles)) == pytest.approx(expected, abs=1e-4)
    assert "along its tangent from -30 to -40 deg and from 30 to 60 deg" in law.rule
    steps = np.diff(law.elastic.torque(np.radians([40.0, 50.0, 60.0])))
    assert steps[0] == pytest.approx(steps[1])


def test_a_spring_may_be_added_to_points():
    plus = {"published": "wiegner_watts_1986", "stiffness_Nm_rad": 2.0, "rest_deg": 30}
    row = {"pieces": [{"published": "schmidt_1998/flexion", "deg": [0, 60]}], "plus": plus}
    law = build_law(row, CONTEXT).elastic
    assert law.torque(radians(60.0)) == pytest.approx(-18.0 - 2.0 * radians(30.0), abs=1e-4)
    assert law.torque(0.0) == pytest.approx(2.0 * radians(30.0), abs=1e-4)


def test_the_spring_is_not_added_to_points_of_the_whole_torque():
    plus = {"published": "wiegner_watts_1986", "stiffness_Nm_rad": 2.0, "rest_deg": 30}
    whole = {"published": "schmidt_1998/extension", "deg": [-20, -10], "is_whole": True}
    row = {"pieces": [whole, {"published": "schmidt_1998/flexion", "deg": [0, 60]}], "plus": plus}
    law = build_law(row, CONTEXT)
    assert law.elastic.torque(radians(-20.0)) == pytest.approx(20.0 * 2.6 / 6.0, abs=1e-4)
    assert law.elastic.torque(0.0) == pytest.approx(2.0 * radians(30.0), abs=1e-4)
    assert len(law.point_references) == 4
    assert len(law.references) == 2


def test_a_wall_begins_at_its_distance_before_both_ends():
    row = {"wall": {"published": "saul_2015/shoulder_elv", "before_end_deg": 30}}
    law = build_law(row, CONTEXT)
    assert law.elastic.torque(np.radians([-10.0, 0.0, 30.0])) == pytest.approx([0.0] * 3)
    end = curve("saul_2015/shoulder_elv").law.torque(radians(180.0))
    assert law.elastic.torque(radians(60.0)) == pytest.approx(end)
    assert law.elastic.torque(radians(-40.0)) == pytest.approx(-end)
    assert "estimate" in law.rule


def test_a_joint_in_series_has_the_same_torque_at_the_same_fraction_of_its_range():
    series = Interpolated(((-0.4, 8.0), (0.0, 0.0), (0.3, -5.0), (1.2, -30.0)))
    context = LawContext((-0.1, 0.4), (series, (-0.4, 1.2)))
    law = build_law({"in_series_with": "waist"}, context).elastic
    assert law.torque(-0.1) == pytest.approx(series.torque(-0.4), abs=1e-4)
    assert law.torque(0.1) == pytest.approx(series.torque(0.3), abs=1e-4)


def test_a_growing_torque_is_reached_at_both_ends():
    row = {"growing": {"end_torque_Nm": 8.0, "growth": 3.0}}
    law = build_law(row, CONTEXT).elastic
    assert law.torque(np.array(CONTEXT.normal_range)) == pytest.approx([8.0, -8.0])
    assert law.torque(radians(30.0)) == pytest.approx(-8.0 * np.sinh(1.5) / np.sinh(3.0), abs=1e-3)


def test_one_angle_of_a_law_of_several():
    wanted = {
        "published": "riener_edrich_1999/leg",
        "coordinate": "ankle dorsiflexion",
        "deg": {"hip flexion": 45, "knee flexion": 60},
    }
    law = build_law({"held": wanted}, CONTEXT).elastic
    angles = [radians(45.0), radians(60.0), radians(10.0)]
    torque = coupled_law("riener_edrich_1999/leg").law.torques(angles)[2]
    assert law.torque(radians(10.0)) == pytest.approx(torque)


def test_a_curve_as_published_keeps_its_note_and_reference():
    law = build_law({"published": "saul_2015/pro_sup"}, CONTEXT)
    row = curve("saul_2015/pro_sup")
    assert law.references == (row.reference,)
    assert law.rule.startswith(row.note)


@pytest.mark.parametrize(
    ("law", "stiffness"),
    [
        (Linear(3.0, 0.2), 3.0),
        (Interpolated(((-1.0, 2.0), (-0.5, 0.0), (0.5, 0.0), (1.0, -2.0))), 0.0),
        (Interpolated(((-2.0, -1.0), (2.0, -3.0))), 0.5),
    ],
)
def test_stiffness_at_rest(law, stiffness):
    assert rest_stiffness(law, (-1.0, 1.0)) == pytest.approx(stiffness, abs=1e-6)
