"""Bodies without mass, and with an inertia that no body has."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from generator.diagnostics import Source
from generator.inertia import MassProperties
from generator.losses import Losses
from generator.model_files.body_tree.to_figure import with_possible_inertia
from generator.model_files.body_tree.tree import Body
from generator.model_files.formats import parse_model, read_model
from generator.model_files.model_files import Imported
from tests.generator.model_files.imported_models import MODELS, lost, placed, pose_in_model
from tests.generator.model_files.pinocchio_fall import difference

FORK = MODELS / "fork.urdf"


@pytest.mark.parametrize(
    ("moments", "possible"),
    [
        ((1e-4, 2e-4, 1e-3), (5e-4, 5e-4, 1e-3)),  # far off: both become half the largest
        ((0.4, 0.9, 1.5), (0.6, 0.9, 1.5)),
        ((0.0, 0.0, 0.0), (8e-7, 8e-7, 8e-7)),  # a point of 2 kg
        ((0.0, 0.3, 0.3), (8e-7, 0.3, 0.3)),  # a line
        ((-1e-9, 0.3, 0.3), (8e-7, 0.3, 0.3)),
        ((0.0, 0.0, 1e-9), (1e-9, 1e-9, 1e-9)),
        ((-3.0, -2.0, -1.0), (8e-7, 8e-7, 8e-7)),
        ((0.2, 0.3, 0.4), (0.2, 0.3, 0.4)),
    ],
)
def test_moments_are_raised_to_possible_ones(moments: Any, possible: Any):
    point = MassProperties(2.0, np.array([0.1, 0.2, 0.3]), np.zeros((3, 3)))
    turn = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]
    body = Body("b", None, np.eye(4), mass=point, extra_inertia=turn @ np.diag(moments) @ turn.T)
    losses = Losses("model")
    found = with_possible_inertia(body, losses).total_mass_properties
    assert found is not None
    np.testing.assert_allclose(np.linalg.eigvalsh(found.inertia), possible, rtol=1e-9, atol=1e-18)
    np.testing.assert_array_equal(found.centre, point.centre)
    assert bool(losses.entries) == (moments != possible)


def imported(inertia: str) -> Imported:
    text = FORK.read_text().replace('ixx="0.02" iyy="0.03" izz="0.015"', inertia)
    return parse_model(Source("fork.urdf", text)).require_value()


def test_the_report_says_both_inertias():
    model = imported('ixx="0.0001" iyy="0.0002" izz="0.001"')
    (place,) = lost(model, "moments of inertia")
    assert place == "first (0.0001, 0.0002, 0.001 to 0.0005, 0.0005, 0.001)"
    assert sorted(model.figure.segments["first"].inertia or ()) == pytest.approx([5e-4, 5e-4, 1e-3])


def test_a_body_without_mass_at_an_end_is_fixed_where_the_model_has_it():
    model = read_model(FORK)
    assert lost(model, "end of a chain") == ("camera (pan)",)
    assert lost(model, "between others") == ("yoke",)
    assert "pan" not in model.coordinates
    assert "camera" in model.figure.segments["second"].sites
    assert model.figure.total_mass == pytest.approx(2.2)


def test_a_locked_pose_of_the_end_is_kept():
    text = """<OpenSimDocument Version="40500"><Model name="m"><BodySet><objects>
    <Body name="arm"><mass>1</mass><inertia>1 1 1 0 0 0</inertia></Body><Body name="tip"/></objects>
    </BodySet><JointSet><objects><PinJoint name="a">
    <socket_parent_frame>/ground</socket_parent_frame>
    <socket_child_frame>/bodyset/arm</socket_child_frame></PinJoint><SliderJoint name="b">
    <socket_parent_frame>/bodyset/arm</socket_parent_frame>
    <socket_child_frame>/bodyset/tip</socket_child_frame><coordinates><Coordinate name="out">
    <default_value>0.25</default_value></Coordinate></coordinates></SliderJoint></objects></JointSet>
    </Model></OpenSimDocument>"""
    model = parse_model(Source("m.osim", text)).require_value()
    place = pose_in_model(placed(model, {}), "arm", "tip")
    np.testing.assert_allclose(place[:3, 3], [0.25, 0.0, 0.0], atol=1e-12)


def test_without_any_mass_nothing_is_repaired():
    text = FORK.read_text().replace("inertial>", "unknown>")
    messages = [one.message for one in parse_model(Source("fork.urdf", text)).diagnostics]
    assert "`first` moves but has no mass" in messages


@pytest.mark.verify
def test_a_fork_falls_as_in_pinocchio(tmp_path: Path):
    # Pinocchio cannot move a camera without mass.
    pan = '<joint name="pan" type='
    held = FORK.read_text().replace(f'{pan}"revolute"', f'{pan}"fixed"')
    (tmp_path / "held.urdf").write_text(held)
    assert difference(tmp_path / "held.urdf", tmp_path, ("yaw", "left", "right")) < 2e-6
