"""The tables of a reach: binding to both sides, writing back, extension, faults."""

from dataclasses import replace
from math import radians
from pathlib import Path

import numpy as np
import pytest

from generator import read_figure
from generator.figure_file import FIGURE_FILE
from generator.springs_file.edit import format_all, format_besides_fields, format_changes
from generator.springs_file.parse import SPRINGS_FILE
from generator.springs_file.read import joints_without_elastic_law, load_springs
from generator.springs_file.write import write_springs
from springs import FLOATS, Damping, SpringSet, Stop
from springs.smooth_limit import SmoothLimit

PROTOTYPE = read_figure("prototype")
FOLDER = FIGURE_FILE.shipped()["prototype"].parent
REACH = """\
[[reach]]
joints = ["left_shoulder", "right_shoulder"]
long_axis = "z"
planes = ["x", "y"]
centre_deg = [55, 70]
boundary_deg = [[0, 170], [60, 175], [100, 150], [150, 65], [-150, 45], [-90, 62], [-50, 110]]
turns_deg = [
    [0, 0, -80, 70], [0, 90, -100, 55], [90, 90, -100, 45], [-70, 50, -90, 65], [50, 140, -70, 25],
    [120, 80, -90, 60],
]
harmonics = 3
reference = "Points of this test"
"""
LAWS = """
[[spring]]
joints = ["left_shoulder", "right_shoulder"]
axis = "reach"
limits_deg = [-180, -30]
limit_stiffness_Nm_rad = [0, 500]
transition_deg = 120
stop_stiffness_Nm_rad = 800

[[spring]]
joints = ["left_shoulder", "right_shoulder"]
axis = "x"
viscous_Nms_rad = 0.25
"""


def reading(path: Path, text: str, figure=PROTOTYPE):
    path.write_text(text, encoding="utf-8")
    return load_springs(figure, FOLDER, "prototype", path)


def loaded(path: Path, text: str) -> SpringSet:
    found = reading(path, text)
    assert found.value is not None, found.diagnostics
    return found.value


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "my.springs.toml"


def test_both_arms_have_mirrored_reaches(path: Path) -> None:
    springs = loaded(path, REACH + LAWS)
    left, right = (springs.joints[f"{side}_shoulder"] for side in ("left", "right"))
    assert left.reach is not None
    assert right.reach is not None
    wall, stop = left.reach.beyond.elastic
    assert isinstance(wall, SmoothLimit)
    assert (wall.lower_stiffness, wall.upper_stiffness) == (0.0, 500.0)
    assert (wall.upper, wall.transition) == pytest.approx((-radians(30.0), radians(120.0)))
    assert stop == Stop(None, 0.0, 800.0)
    assert left.reach.turn.elastic == (Stop(None, 0.0),)
    assert [axis.damping for axis in left.axes] == [
        Damping(0.25),
        *(axis.damping for axis in left.axes[1:]),
    ]
    assert not any(axis.elastic for axis in left.axes)
    rng = np.random.default_rng(1)
    for r in rng.uniform(-1.5, 1.5, (20, 3)):
        one = left.reach.torque(r, FLOATS)
        other = right.reach.torque(r * (-1.0, 1.0, -1.0), FLOATS)
        assert np.allclose(other, one * (-1.0, 1.0, -1.0), atol=1e-9 * (1.0 + np.abs(one).max()))
    assert "left_shoulder" not in joints_without_elastic_law(PROTOTYPE, springs)
    assert "Points of this test" in springs.references


def test_what_is_written_is_read_back(path: Path) -> None:
    content = SPRINGS_FILE.parse_text(REACH + LAWS).require_value()
    again = SPRINGS_FILE.parse_text(write_springs(content)).require_value()
    assert again == content
    springs = loaded(path, REACH + LAWS)
    whole = loaded(path, format_all(PROTOTYPE, springs))
    assert whole.joints == springs.joints
    own = load_springs(PROTOTYPE, FOLDER, "prototype").require_value()
    changed = loaded(path, format_changes(PROTOTYPE, own, springs))
    assert changed.joints == springs.joints


def test_a_figure_can_hold_them(path: Path) -> None:
    springs = loaded(path, 'base = "none"\n' + REACH + LAWS)
    bare = replace(PROTOTYPE, path=None, springs_text=None)
    own = load_springs(bare).require_value()
    kept = SpringSet({**own.joints, "left_shoulder": springs.joints["left_shoulder"]})
    text = format_besides_fields(bare, kept)
    held = load_springs(replace(bare, springs_text=text)).require_value()
    assert held.joints["left_shoulder"] == springs.joints["left_shoulder"]


def test_a_reach_drops_the_curves_of_the_extended_file_and_is_kept_by_others(path: Path) -> None:
    base = path.with_name("base.springs.toml")
    base.write_text(REACH + LAWS, encoding="utf-8")
    kept = loaded(
        path,
        'extends = "base.springs.toml"\n[[spring]]\njoints = ["left_knee"]\nstiffness_Nm_rad = 3\n',
    )
    assert kept.joints["left_shoulder"].reach is not None
    message = "has a reach in base.springs.toml"
    stiff = '[[spring]]\njoints = ["left_shoulder"]\naxis = "x"\nstiffness_Nm_rad = 3\n'
    faults = reading(path, f'extends = "base.springs.toml"\n{stiff}').diagnostics
    assert any(message in one.message for one in faults)


def test_a_law_that_pushes_at_the_centre_gets_a_warning(path: Path) -> None:
    start = LAWS.index("limits_deg")
    stiff = LAWS[:start] + "stiffness_Nm_rad = 2\n" + LAWS[LAWS.index("stop_stiffness") :]
    found = reading(path, REACH + stiff)
    assert found.value is not None
    assert all("N m at its centre" in one.message for one in found.diagnostics)
    assert len(found.diagnostics) == 2


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (REACH.replace('"z"', '"w"'), "`long_axis`"),
        (REACH.replace('["x", "y"]', '["x", "q"]'), "two of x, y and z"),
        (REACH.replace("centre_deg = [55, 70]\n", ""), "centre_deg"),
        (REACH.replace("[55, 70]", "[-120, 30]"), "from its centre, not between"),
        (REACH.replace("[0, 170], [60, 175], ", ""), "needs 7 points, not 5"),
        (REACH.replace("-80, 70]", "80, 70]"), "ends before it begins"),
        (REACH.replace("[0, 0, -80, 70]", "[0, 0, -80]"), "a row has four numbers, not 3"),
        (REACH.replace('["left_shoulder", "right_shoulder"]', '["left_elbow"]'), "three axes"),
        (REACH.replace('["left_shoulder", "right_shoulder"]', '["arm"]'), "no joint `arm`"),
        (REACH + REACH, "a second reach"),
        (LAWS, "has no reach in this file"),
        (REACH + LAWS + LAWS.split("\n\n")[0], "a second law of the reach"),
        (REACH + LAWS.replace("viscous_Nms_rad", "stiffness_Nm_rad"), "damping only"),
        (REACH + LAWS.replace("transition", "viscous_Nms_rad = 1\ntransition"), "has no damping"),
    ],
)
def test_faults_name_what_is_wrong(path: Path, text: str, message: str) -> None:
    found = reading(path, text)
    assert found.value is None
    assert any(message in one.message for one in found.diagnostics), found.diagnostics
    assert all(one.span is not None for one in found.diagnostics)
