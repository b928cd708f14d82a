"""Coefficients of limit torques for PredSim, read again and compared with the laws."""

import csv
from io import StringIO
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from generator import read_figure
from generator.diagnostics import InputError
from generator.joint_chain import build_chain
from generator.model_files.displacement_torques import SampledTorque, sampled_torques
from generator.model_files.export_model import split_joint_laws
from generator.model_files.fit_error import joint_ranges
from generator.model_files.formats import model_format
from generator.model_files.predsim import FITTED_LOSS, TITLES, fit_limit_torque, format_files
from generator.springs_file.read import read_springs
from springs import SpringSet
from tests.chains import SKEW
from tests.generator.model_files.model_cases import (
    CURVES,
    on_a_rail,
    slide,
    spring_set,
    stated_errors,
)

PROTOTYPE = read_figure("prototype")
SPRINGS = read_springs(None, PROTOTYPE)
PATH = Path("limits.csv")


def rows_of(springs: SpringSet) -> dict[str, np.ndarray]:
    """Coefficients by coordinate."""
    text = format_files(PROTOTYPE, springs, PATH).contents[PATH]
    assert isinstance(text, str)
    rows = list(csv.reader(StringIO(text)))
    assert tuple(rows[0]) == TITLES
    assert len({row[0] for row in rows[1:]}) == len(rows) - 1
    return {row[0]: np.array(row[1:], dtype=float) for row in rows[1:]}


def predsim_torque(coefficients: np.ndarray, q: np.ndarray) -> np.ndarray:
    """The formula of PredSim's documentation."""
    k1, k2, k3, k4, theta1, theta2 = coefficients
    return k1 * np.exp(k2 * (q - theta2)) + k3 * np.exp(k4 * (q - theta1))


def test_the_errors_are_those_of_the_formula() -> None:
    rows = rows_of(SPRINGS)
    losses = format_files(PROTOTYPE, SPRINGS, PATH).losses
    (fitted,) = [loss for loss in losses.entries if loss.what == FITTED_LOSS]
    stated = stated_errors(fitted)
    assert stated.keys() == rows.keys()
    for name, own in SPRINGS.joints.items():
        of = PROTOTYPE.joints[name]
        chain, ranges = build_chain(of.chain), joint_ranges(of, own)
        laws = split_joint_laws(chain, own)
        for k, sampled in sampled_torques(of, chain, laws, SPRINGS.joining, ranges).items():
            row = rows[f"{name}_{k + 1}"]
            assert row[4:] == pytest.approx(sampled.range, rel=1e-8)
            error = predsim_torque(row, sampled.displacements) - sampled.torques
            assert np.abs(error).max() == pytest.approx(stated[f"{name}_{k + 1}"], rel=0.06)


def test_the_torques_resist_and_left_is_right() -> None:
    rows = rows_of(SPRINGS)
    for name, (k1, k2, k3, k4, *_) in rows.items():
        assert k1 <= 0.0 < k2
        assert k3 >= 0.0 > k4
        other = name.replace("left", "right") if "left" in name else name.replace("right", "left")
        assert rows[name] == pytest.approx(rows[other], rel=1e-6)


@settings(max_examples=20, deadline=None)
@given(st.floats(-60.0, -0.5), st.floats(1.0, 15.0), st.floats(0.5, 60.0), st.floats(-15.0, -1.0))
def test_two_exponentials_are_found_again(k1: float, k2: float, k3: float, k4: float) -> None:
    ends = (-0.9, 1.3)
    q = np.linspace(*ends, 181)
    torques = predsim_torque(np.array([k1, k2, k3, k4, *ends]), q)
    limit = fit_limit_torque(SampledTorque(q, torques, ends))
    assert limit.torque(q) == pytest.approx(torques, abs=1e-3 * np.abs(torques).max())


def test_slides_have_no_limit_torques_and_their_figure_no_table() -> None:
    springs = spring_set(slide("rail", SKEW, *CURVES["stop"]))
    with pytest.raises(InputError, match="no springs of rotations"):
        format_files(on_a_rail(), springs, PATH)
    with pytest.raises(InputError, match="no springs of rotations"):
        format_files(PROTOTYPE, SpringSet(), PATH)


def test_laws_over_several_joints_are_lost() -> None:
    losses = format_files(PROTOTYPE, read_springs("coupled", PROTOTYPE), PATH).losses
    assert any(loss.what == "laws over several joints" for loss in losses.entries)


def test_only_its_name_selects_the_format() -> None:
    assert model_format(PATH, "predsim").format_files is format_files
    assert model_format(PATH).format_files is not format_files
