"""Joint moments of a walk, beside those of OpenSim."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from generator import read_figure
from generator.diagnostics import InputError
from generator.inverse.external_loads import read_external_loads
from generator.inverse.moments import JointMoments, body_height, format_moments, joint_moments
from generator.inverse.smoothing import smooth_motion
from generator.model_files.formats import read_model
from generator.motion_files import FigureMotion
from generator.motion_files.opensim_table import write_sto
from generator.rotations import Array
from tests.generator.inverse.opensim_inverse import inverse_dynamics
from tests.generator.inverse.walking import LOADS, MODEL, MOTION, walk_of, write_figure_of_walk

GRAVITY = (0.0, -9.80665, 0.0)
COORDINATES = read_model(MODEL).coordinates


@pytest.fixture(scope="module")
def walk(tmp_path_factory: pytest.TempPathFactory) -> FigureMotion:
    return walk_of(write_figure_of_walk(tmp_path_factory.mktemp("walk")))


def moments_of(motion: FigureMotion, cutoff: float | None = None) -> JointMoments:
    forces, _ = read_external_loads(LOADS, motion.figure)
    return joint_moments(motion, COORDINATES, forces, cutoff, GRAVITY)


def largest_difference(
    ours: JointMoments, theirs: tuple[Array, dict[str, Array]], start: float, stop: float
) -> dict[str, float]:
    """Largest difference of each column between two times [N m or N]."""
    times, columns = theirs
    inner = (ours.times >= start) & (ours.times <= stop)
    return {
        one.label: float(
            np.abs(one.forces - np.interp(ours.times, times, columns[one.label]))[inner].max()
        )
        for one in ours.coordinates.values()
    }


@pytest.mark.verify
def test_moments_are_those_of_opensim_from_the_same_splines(walk: FigureMotion, tmp_path: Path):
    """Frames are 2.5 ms apart, so that the splines of both programs are the same."""
    times = np.arange(0.0, 2.5001, 0.0025)
    smooth, columns = smooth_motion(walk.tree, walk, 6.0, times), walk.tree.kinematics.columns
    values = {joint: smooth.values[:, some] for joint, some in columns.items()}
    fine = replace(walk, times=times, displacements=values)
    write_sto(fine, tmp_path / "fine.sto")
    theirs = inverse_dynamics(MODEL, tmp_path / "fine.sto", tmp_path)
    found = largest_difference(moments_of(fine), theirs, 0.1, 2.4)
    moments = {name: worst for name, worst in found.items() if name.endswith("moment")}
    assert len(moments) == 8
    assert max(moments.values()) < 0.25, found


@pytest.mark.verify
def test_moments_are_those_of_opensim_with_its_own_filter(walk: FigureMotion, tmp_path: Path):
    theirs = inverse_dynamics(MODEL, MOTION, tmp_path, cutoff=6.0)
    found = largest_difference(moments_of(walk, 6.0), theirs, 0.3, 2.2)
    assert max(found.values()) < 0.05, found


def test_residuals_and_peaks_of_the_walk(walk: FigureMotion):
    """A walk: residuals below a tenth of body weight, the ankle pushes off with 1.5 N m/kg."""
    moments = moments_of(walk, 6.0)
    assert moments.residual_share("pelvis_tx") < 0.1
    assert moments.residual_share("pelvis_ty") < 0.1
    kept = moments.kept
    for side in "rl":
        push = -moments.coordinates[f"ankle_angle_{side}"].forces[kept].min() / moments.mass
        assert 1.2 < push < 2.0
    assert [name for name, one in moments.coordinates.items() if one.is_root] == [
        "pelvis_tilt", "pelvis_ty", "pelvis_tx",
    ]  # fmt: skip


def test_works_are_integrals_of_the_power_while_it_is_sure(walk: FigureMotion):
    moments = moments_of(walk, 6.0)
    powers = moments.coordinates["ankle_angle_r"].powers
    works, kept = moments.works(powers), moments.kept
    expected = np.trapezoid(powers[kept], moments.times[kept])
    assert works.positive + works.negative == pytest.approx(expected)
    assert works.positive > 0.0 > works.negative
    first, last = moments.times[kept][[0, -1]]
    assert (first, last) == pytest.approx((0.5, 2.0), abs=0.02)


def test_a_motion_of_few_sure_frames_is_taken_whole(walk: FigureMotion):
    """One second has a single frame half a second from both ends."""
    kept = walk.times < walk.times[0] + 1.001
    short = {name: values[kept] for name, values in walk.displacements.items()}
    moments = joint_moments(replace(walk, times=walk.times[kept], displacements=short), COORDINATES)
    assert not moments.is_sure.any()
    assert moments.kept.all()


def test_the_scale_of_a_coordinate_keeps_its_power(walk: FigureMotion):
    scaled = {
        name: replace(at, scale=2.0, offset=0.3) if name == "knee_angle_r" else at
        for name, at in COORDINATES.items()
    }
    plain, other = (
        joint_moments(walk, coordinates, (), 6.0).coordinates["knee_angle_r"]
        for coordinates in (COORDINATES, scaled)
    )
    np.testing.assert_allclose(other.values, 2.0 * plain.values + 0.3)
    np.testing.assert_allclose(other.forces, 0.5 * plain.forces)
    np.testing.assert_allclose(other.powers, plain.powers)


def test_degrees_that_are_said_to_be_radians_are_refused(walk: FigureMotion):
    wrong = {name: np.degrees(values) for name, values in walk.displacements.items()}
    with pytest.raises(InputError, match="they seem to be degrees"):
        joint_moments(replace(walk, displacements=wrong), COORDINATES)


def test_the_table_is_one_of_opensim(walk: FigureMotion):
    moments = moments_of(walk, 6.0)
    lines = list(format_moments(moments))
    head = lines.index("endheader")
    assert lines[0] == "Inverse Dynamics Generalized Forces"
    assert {"nRows=151", "nColumns=11", "inDegrees=no"} <= set(lines[:head])
    titles = lines[head + 1].split("\t")
    assert {"time", "knee_angle_r_moment", "pelvis_tx_force"} <= set(titles)
    row = np.array(lines[head + 2].split("\t"), dtype=float)
    k = titles.index("knee_angle_r_moment")
    assert row[k] == moments.coordinates["knee_angle_r"].forces[0]


def test_the_height_of_a_person_is_its_stature():
    assert body_height(read_figure("male50")) == pytest.approx(1.756, abs=0.02)
    assert 1.3 < body_height(read_figure("prototype")) < 2.0
