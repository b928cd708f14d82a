"""Published curves as drawn: where they are given, where they are known, what is told of them."""

from importlib.resources import files
from math import radians
from pathlib import Path

import numpy as np
import pytest

from plots.literature import (
    join_curves,
    literature_from_points,
    mirror_to_both_sides,
    published_curve,
    read_measurements,
    single_angle_curve,
)
from springs.published import tables as published
from springs.published.reference import Reference, Sample, Sureness

DATA = Path(str(files("plots"))) / "data"
SOURCE = Reference("invented for this test", Sureness.PAGE)


def test_a_curve_with_a_range_is_known_there_and_given_everywhere() -> None:
    saul = published_curve("saul_2015/elbow_flexion", "Saul")
    assert saul.valid_range == pytest.approx((0.0, radians(130.0)))
    assert np.all(np.isfinite(saul.torque(np.radians([-20.0, 50.0, 140.0]))))
    assert saul.extrapolation_note(radians(-20.0), radians(140.0)).startswith(
        "extrapolated at -20 .. 0 deg"
    )
    assert saul.extrapolation_note(0.0, radians(130.0)) == ""


def test_a_curve_given_for_one_side_ends_at_zero() -> None:
    half = published_curve("han_2010/lateral_bend", "Han", side=1)
    assert half.valid_range == pytest.approx((0.0, radians(28.0)))
    assert np.isnan(half.torque(np.array([-0.1])))[0]
    assert half.extrapolation_note(-1.0, radians(28.0)) == ""


def test_the_other_side_is_the_mirror_image() -> None:
    whole = mirror_to_both_sides(published_curve("han_2010/lateral_bend", "Han", side=1))
    angles = np.radians([5.0, 20.0, 40.0])
    assert whole.torque(-angles) == pytest.approx(-whole.torque(angles))
    # -0.6989 x - 0.0087 x^2 with x = 20/6 deg.
    assert whole.torque(np.radians([20.0]))[0] == pytest.approx(-2.426333, abs=1e-6)


def test_two_halves_are_one_curve() -> None:
    whole = join_curves(
        published_curve("schmidt_1998/flexion", "Schmidt", side=1),
        published_curve("schmidt_1998/extension", "other", side=-1),
    )
    # 1.8 and 2.6 N m/deg, of which each of six segments takes a sixth.
    assert whole.torque(np.radians([-30.0, 0.0, 30.0])) == pytest.approx([13.0, 0.0, -9.0])
    assert whole.label == "Schmidt"
    assert whole.valid_range == pytest.approx((radians(-29.0), radians(73.0)))


def test_one_coordinate_of_a_law_of_several() -> None:
    hip = single_angle_curve(
        "riener_edrich_1999/leg",
        "hip flexion",
        {"knee flexion": 15.0, "ankle dorsiflexion": 0.0},
        "Riener",
    )
    row = published.coupled_law("riener_edrich_1999/leg")
    angles = np.radians([0.0, 45.0, 90.0])
    expected = row.law.torques([angles, radians(15.0) + 0.0 * angles, 0.0 * angles])[0]
    assert hip.torque(angles) == pytest.approx(expected)
    assert hip.held_text == "knee at 15 deg, ankle at 0 deg"
    assert hip.points is None


def test_points_of_a_digitised_curve() -> None:
    silder = published_curve("silder_2007/hip_knee_15", "Silder")
    assert silder.points is not None
    angles, torques = silder.points
    assert (angles[15], torques[15]) == pytest.approx((0.0, 7.294))
    assert silder.torque_at(0.0) == pytest.approx(7.294)
    assert silder.held_text == "knee at 15 deg"
    assert silder.is_line


def test_single_points_are_no_line() -> None:
    assert not literature_from_points(((-0.5, 5.0), (0.5, -5.0)), "made", SOURCE, Sample()).is_line


def test_the_band_ends_with_the_measured_range() -> None:
    silder = published_curve("silder_2007/hip_knee_15", "Silder")
    edges = silder.band(np.radians([-20.0, 0.0, 90.0]))
    assert edges is not None
    assert edges[1] == pytest.approx([np.nan, 7.294 + 2.5, np.nan], nan_ok=True)
    assert published_curve("saul_2015/elbow_flexion", "Saul").band(np.array([0.0])) is None
    assert silder.obstacle == ""


@pytest.mark.parametrize("path", sorted(DATA.glob("*.csv")), ids=lambda path: path.stem)
def test_a_table_tells_where_it_is_from(path: Path) -> None:
    """The command is named as the table, or as the first word of several tables."""
    table = read_measurements(path.stem)
    assert table.rows
    first, said = table.provenance["command"].rsplit(" ", 1)
    assert first == "python -m benchmarks"
    assert path.stem.startswith(said.replace("-", "_"))
    assert "exudyn 1." in table.origin
    assert "mujoco " in table.origin
