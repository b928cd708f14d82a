"""Models of OpenSim 3, which OpenSim itself converts."""

from math import cos, sin
from pathlib import Path

import numpy as np
import pytest

from generator.diagnostics import Source
from generator.model_files.formats import parse_model, read_model
from generator.model_files.opensim import read as opensim_reader
from tests.generator.model_files.imported_models import MODELS, lost, placed, pose_in_model

OLDER = MODELS.parent / "older" / "older.osim"
"""A rod on a pin, as OpenSim 3 writes models."""


def test_without_opensim_the_error_says_what_to_do(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(opensim_reader, "find_spec", lambda name: None)
    (found,) = parse_model(Source("older.osim", OLDER.read_text())).diagnostics
    assert "written by OpenSim 3 or older" in found.message
    assert found.span is not None
    assert found.span.line == 2
    assert "pip install opensim" in found.hint


def test_a_new_model_without_joints_is_not_an_older_one():
    text = '<OpenSimDocument Version="40500"><Model name="m"></Model></OpenSimDocument>'
    (found,) = parse_model(Source("m.osim", text)).diagnostics
    assert "no `JointSet`" in found.message


@pytest.mark.verify
def test_opensim_converts_an_older_model(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    pytest.importorskip("opensim")
    monkeypatch.chdir(tmp_path)
    imported = read_model(OLDER)
    (loss,) = [each for each in imported.losses.entries if "older format" in each.what]
    assert "OpenSim 4" in loss.what
    assert imported.figure.total_mass == 2.0
    assert lost(imported, "ranges of coordinates")
    pose = pose_in_model(placed(imported, {"swing": 0.3}), "rod")
    # The pin is 0.1 m above the rod's frame, 1 m above the ground, turned by 0.5 rad about y.
    turn = np.array([[cos(0.5), 0.0, sin(0.5)], [0.0, 1.0, 0.0], [-sin(0.5), 0.0, cos(0.5)]])
    down = turn @ [0.1 * sin(0.3), -0.1 * cos(0.3), 0.0]
    np.testing.assert_allclose(pose[:3, 3], np.array([0.0, 1.0, 0.2]) + down, atol=1e-12)
    assert not list(tmp_path.iterdir())  # no log of OpenSim's


def test_what_opensim_refuses_is_refused(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(opensim_reader, "find_spec", lambda name: True)
    for script, reason in (("raise ValueError('no such body')", "no such body"), ("", "crashed")):
        monkeypatch.setattr(opensim_reader, "_SCRIPT", script)
        (found,) = parse_model(Source("older.osim", OLDER.read_text())).diagnostics
        assert "OpenSim cannot convert it" in found.message
        assert reason in found.hint
