"""Columns of a motion: their numbers are those of its table, and extremes lie between frames."""

import numpy as np
import pytest

from generator.contact.record import ContactRecord
from generator.motion_files.motion import FigureMotion
from generator.motion_files.tables import Column, columns_of_motion
from generator.recording import RecordingPart
from tests.contacts import touching_run
from tests.motions import clip


def columns(motion: FigureMotion) -> dict[str, Column]:
    return {column.title: column for column in columns_of_motion(motion)}


def test_a_column_has_the_numbers_of_its_quantity():
    motion = clip("slides")
    assert motion.recording is not None
    found = columns(motion)
    angle, length = found["rail.1 [deg]"], found["rail.2 [cm]"]
    assert np.array_equal(angle.read(motion), motion.displacements["rail"][:, 0])
    assert [float(angle.format(v)) for v in (0.5, -2.0)] == pytest.approx(np.degrees([0.5, -2.0]))
    assert float(length.format(0.25)) == 25.0
    assert np.array_equal(found["kinetic [J]"].read(motion), motion.recording.energy["kinetic"])


def test_columns_name_the_part_of_the_recording_that_they_need():
    motion, _ = touching_run()
    found = columns(motion)
    assert found["kinetic [J]"].part is RecordingPart.ENERGY
    assert found["ground_force_vy [N]"].part is RecordingPart.CONTACT
    assert found["time [s]"].part is None


def test_quaternions_of_a_free_segment_are_units():
    motion = clip("flying")
    found = columns(motion)
    parts = [found[f"lower_torso.{part} [1]"].read(motion) for part in ("qw", "qx", "qy", "qz")]
    assert np.linalg.norm(parts, axis=0) == pytest.approx(np.ones(len(motion.times)))
    assert np.ptp(parts[0]) > 0.0


def test_an_undefined_number_is_blank_and_a_displacement_must_be_finite():
    motion, _ = touching_run()
    found = columns(motion)
    assert found["ground_force_px [cm]"].format(float("nan")) == ""
    for title in ("time [s]", "kinetic [J]"):
        assert found[title].format(1.5) == "1.5"
    first = next(column for title, column in found.items() if title.endswith("[deg]"))
    with pytest.raises(ValueError, match="cannot hold"):
        first.format(float("nan"))


def sampled(values: np.ndarray) -> tuple[Column, FigureMotion]:
    """A column with numbers of its own, in frames of some motion."""
    motion = clip("slides")
    return Column("sample", "1", lambda _: values), motion


def test_an_extreme_between_frames_is_that_of_a_parabola():
    times = clip("slides").times
    column, motion = sampled(2.0 - 50.0 * (times - 0.1113) ** 2)
    assert column.extreme(motion, 1) == pytest.approx((0.1113, 2.0), abs=1e-12)
    column, motion = sampled(50.0 * (times - 0.2871) ** 2 - 3.0)
    assert column.extreme(motion, -1) == pytest.approx((0.2871, -3.0), abs=1e-12)


def test_an_extreme_ignores_frames_without_a_number():
    times = clip("slides").times
    values = np.where(times < 0.2, np.nan, times)
    column, motion = sampled(values)
    assert column.extreme(motion, 1) == (times[-1], times[-1])
    assert column.extreme(motion, -1) == pytest.approx((0.2, 0.2))
    column, motion = sampled(np.full(len(times), np.nan))
    assert column.extreme(motion, 1) is None


def test_extremes_of_contact_forces_are_those_of_the_record():
    motion, run = touching_run()
    contact = run.contact
    assert isinstance(contact, ContactRecord)
    name, segment = next(iter(contact.segments.items()))
    found = columns(motion)
    peak = found[f"{name}.contact_force [N]"].extreme(motion, 1)
    assert peak == (segment.peak_time, segment.peak_force)
    assert contact.extreme_forces is not None
    for k, axis in enumerate("xyz"):
        extremes = [found[f"ground_force_v{axis} [N]"].extreme(motion, sign) for sign in (1, -1)]
        assert np.ravel(extremes).tolist() == contact.extreme_forces[k].tolist()
