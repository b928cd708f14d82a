"""OpenSim models against OpenSim's own reading of them."""

from math import radians
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from generator.diagnostics import Source
from generator.figure import AxisKind, Follower
from generator.follower_curve import CurveKind, FollowerCurve
from generator.model_files.formats import parse_model, read_model
from generator.model_files.opensim.write import format_osim
from generator.rotations import Array, pose_matrix
from springs import SpringSet
from tests.generator.inverse.walking import MODEL as WALKER
from tests.generator.model_files.imported_models import (
    MODELS,
    coordinate,
    fall,
    lost,
    placed,
    pose_in_model,
    without_carried_texts,
    written_and_read,
)
from tests.generator.model_files.opensim_fall import fall_beside_opensim

LEG = MODELS / "leg.osim"
"""All kinds of joints, written by OpenSim 4.6."""

LOCKED = "patella_angle"

WITHOUT_RATES = ("sh_x", "sh_y", "sh_z", "k_rx", "k_ry", "k_rz")


class OpenSim:
    """A model in OpenSim, its muscles switched off."""

    def __init__(self) -> None:
        self.api: Any = pytest.importorskip("opensim")
        self.api.Logger.setLevelString("Error")
        self.model = self.api.Model(str(LEG))
        self.model.getForceSet().get("rectus").set_appliesForce(False)
        self.state = self.model.initSystem()
        held = self.model.getCoordinateSet()
        self.coordinates = {held.get(k).getName(): held.get(k) for k in range(held.getSize())}
        self.moving = [name for name in self.coordinates if name != LOCKED]

    def set(self, values: Array, speeds: Array) -> None:
        for name, value, speed in zip(self.moving, values, speeds, strict=True):
            self.coordinates[name].setValue(self.state, float(value), False)
            self.coordinates[name].setSpeedValue(self.state, float(speed))
        self.model.assemble(self.state)
        self.model.realizePosition(self.state)

    def pose(self, body: str) -> Array:
        """Pose of a body in the ground, shape (4, 4)."""
        found = self.model.getBodySet().get(body).getTransformInGround(self.state)
        turn, offset = found.R().asMat33(), found.p()
        matrix = [[turn.get(i, j) for j in range(3)] for i in range(3)]
        return pose_matrix(matrix, [offset.get(i) for i in range(3)])

    def reach(self, manager: Any, time: float) -> Array:
        if time > 0.0:
            self.state = self.api.State(manager.integrate(time))
        return np.array([self.coordinates[name].getValue(self.state) for name in self.moving])


@pytest.mark.verify
def test_bodies_stand_where_opensim_has_them():
    imported, twin = read_model(LEG), OpenSim()
    rng = np.random.default_rng(1)
    for _ in range(5):
        values = rng.uniform(-0.9, 0.9, len(twin.moving))
        twin.set(values, 0.0 * values)
        placement = placed(imported, dict(zip(twin.moving, values, strict=True)))
        bodies = [name for name in imported.figure.bodies if not name.endswith("_1")]
        assert len(bodies) == 9
        for name in bodies:
            np.testing.assert_allclose(
                pose_in_model(placement, name), twin.pose(name), atol=1e-9, err_msg=name
            )
        for merged, home in (("patella", "shank"), ("toes", "foot")):
            np.testing.assert_allclose(
                pose_in_model(placement, home, merged), twin.pose(merged), atol=1e-9
            )


@pytest.mark.verify
def test_the_mass_is_opensims():
    twin = OpenSim()
    total = twin.model.getTotalMass(twin.state)
    assert read_model(LEG).figure.total_mass == pytest.approx(total, rel=1e-12)


@pytest.mark.verify
def test_a_passive_fall_is_opensims(tmp_path):
    imported, twin = read_model(LEG, separate=True), OpenSim()
    rng = np.random.default_rng(8)
    values = rng.uniform(-0.3, 0.3, len(twin.moving))
    # The speeds of a ball and of a free body are not the rates of its angles, unless they are zero.
    speeds = np.array(
        [0.0 if name in WITHOUT_RATES else rng.uniform(-1.0, 1.0) for name in twin.moving]
    )
    twin.set(values, speeds)
    manager = twin.api.Manager(twin.model)
    manager.setIntegratorAccuracy(1e-9)
    twin.state.setTime(0.0)
    manager.initialize(twin.state)
    recording = fall(
        imported,
        tmp_path,
        dict(zip(twin.moving, values, strict=True)),
        dict(zip(twin.moving, speeds, strict=True)),
        9.80665,
    )
    theirs = np.array([twin.reach(manager, float(time)) for time in recording.times])
    ours = np.stack([coordinate(imported, recording, name) for name in twin.moving], axis=1)
    assert np.ptp(ours, axis=0).max() > 0.3
    knee = twin.moving.index("knee_angle")
    assert np.any((ours[:, knee] > radians(5.0)) | (ours[:, knee] < radians(-10.0)))
    np.testing.assert_allclose(ours, theirs, atol=1e-6)


def test_a_joint_has_its_models_name_and_a_coordinate_its_place():
    imported = read_model(LEG)
    hip = imported.figure.joints["hip"]
    assert [factor.axis for factor in hip.chain] == [(0, 0, 1), (0, 1, 0), (1, 0, 0)]
    assert hip.displacement == pytest.approx((0.05, -0.1, 0.2))
    where = imported.coordinates["subtalar"]
    assert where.scale == pytest.approx(2.0)


def test_what_a_figure_does_not_hold_is_told_by_name():
    imported = read_model(LEG)
    assert lost(imported, "muscles") == ("rectus",)
    assert lost(imported, "locked") == (LOCKED,)
    assert lost(imported, "oblique") == ("foot (ankle, subtalar)",)
    assert lost(imported, "without a joint") == ("patella", "toes")
    assert lost(imported, "--gravity 0,-9.80665,0") == ()


def test_a_limit_force_stands_in_a_springs_file(tmp_path):
    _, springs = written_and_read(read_model(LEG), tmp_path)
    (axis,) = springs.joints["knee"].axes
    (law,) = axis.elastic
    # Beyond the transition the full stiffness acts on the whole distance from the limit.
    assert law.torque(radians(35.0)) == pytest.approx(-2.0 * 30.0)
    assert law.torque(radians(-40.0)) == pytest.approx(3.0 * 30.0)
    assert law.torque(radians(-3.0)) == 0.0


KNEE = """<OpenSimDocument Version="40500"><Model name="m"><BodySet><objects><Body name="shank">
<mass>3</mass><inertia>0.1 0.1 0.1 0 0 0</inertia></Body></objects></BodySet><JointSet><objects>
<CustomJoint name="knee"><socket_parent_frame>/ground</socket_parent_frame>
<socket_child_frame>/bodyset/shank</socket_child_frame>
<coordinates><Coordinate name="bend"><default_value>0.5</default_value><range>-2 0.1</range>
</Coordinate></coordinates><SpatialTransform>
<TransformAxis name="rotation1"><coordinates>bend</coordinates><axis>0 0 1</axis>
<LinearFunction><coefficients>1 0</coefficients></LinearFunction></TransformAxis>
<TransformAxis name="translation1"><coordinates>bend</coordinates><axis>1 0 0</axis>
<PolynomialFunction><coefficients>0.2 0 0.1</coefficients></PolynomialFunction></TransformAxis>
</SpatialTransform></CustomJoint></objects></JointSet>{}</Model></OpenSimDocument>"""


def test_an_axis_that_follows_a_coordinate_is_a_displacement_with_a_curve():
    imported = parse_model(Source("knee.osim", KNEE.format(""))).require_value()
    assert not any("follow" in loss.what for loss in imported.losses.entries)
    assert lost(imported, "ranges of coordinates") == ("bend -2 .. 0.1",)
    knee = imported.figure.joints["knee"]
    assert [factor.kind for factor in knee.chain] == [AxisKind.ROTATION, AxisKind.TRANSLATION]
    curve = FollowerCurve(CurveKind.POLYNOMIAL, (0.1, 0.0, 0.2))
    assert knee.followers == (None, Follower("knee", 0, curve))
    assert knee.displacement == pytest.approx((0.5, 0.2 * 0.5**2 + 0.1))
    assert imported.coordinates.keys() == {"bend"}


def test_a_polygon_is_fixed_where_its_default_has_it():
    polygon = "<PiecewiseLinearFunction><x>0 1 2</x><y>0.1 0.2 0.5</y></PiecewiseLinearFunction>"
    spline = "<PolynomialFunction><coefficients>0.2 0 0.1</coefficients></PolynomialFunction>"
    text = KNEE.format("").replace(spline, polygon)
    imported = parse_model(Source("knee.osim", text)).require_value()
    assert lost(imported, "polygon") == ("knee translation1 (bend)",)
    assert imported.figure.joints["knee"].followers == ()
    seen = pose_in_model(placed(imported, {"bend": 1.0}), "shank")
    np.testing.assert_allclose(seen[:3, 3], (0.15, 0.0, 0.0), atol=1e-12)


SLIDING = MODELS / "knee.osim"
COUPLERS = ("patella_follows", "slide_follows")


def test_what_constraints_couple_follows():
    """A patella through its own coordinate, and a slider by a spline; both constraints are held."""
    imported = read_model(SLIDING)
    assert imported.coordinates.keys() == {"hip_angle", "knee_angle"}
    assert not any("constraint" in loss.what for loss in imported.losses.entries)
    joints = imported.figure.joints
    followers = {
        name: [
            None if one is None else (one.joint, one.curve.kind.value) for one in joint.followers
        ]
        for name, joint in joints.items()
    }
    spline = ("knee", "simm_spline")
    assert followers == {
        "hip": [],
        "knee": [None, ("knee", "polynomial"), spline, spline],
        "patella_glide": [spline, spline, spline],
        "slider": [spline],
    }
    turn = joints["patella_glide"].followers[0]
    assert turn is not None
    assert turn.curve.numbers[:2] == pytest.approx(((-2.0 - 0.05) / 0.9, -1.3))


@pytest.mark.parametrize(
    ("old", "new", "what", "where"),
    [
        ("<isEnforced>true", "<isEnforced>false", "constraints", COUPLERS),
        (">knee_angle<", ">knee_angle hip_angle<", "constraints", COUPLERS),
        ("<LinearFunction name=\"function\"><coefficients>0.9 0.05</coefficients></LinearFunction>",
         "<PolynomialFunction><coefficients>0.1 0.9 0.05</coefficients></PolynomialFunction>",
         "fixed", ("patella_glide translation1 (beta)", "patella_glide translation2 (beta)",
                   "patella_glide rotation1 (beta)")),
    ],
)  # fmt: skip
def test_what_does_not_follow_is_told_by_name(
    old: str, new: str, what: str, where: tuple[str, ...]
):
    head, tail = SLIDING.read_text().split("<ConstraintSet")
    text = f"{head}<ConstraintSet{tail.replace(old, new)}"
    imported = parse_model(Source("knee.osim", text)).require_value()
    found = [loss.where for loss in imported.losses.entries if what in loss.what]
    assert where in found


@pytest.mark.verify
def test_a_fall_is_that_of_opensim(tmp_path: Path):
    """Of the model, and of the model that is written of its figure."""
    fall = fall_beside_opensim(SLIDING)
    assert fall.start < 1e-12
    assert fall.stop < 1e-8
    assert fall.moved > 0.05
    imported, path = read_model(SLIDING), tmp_path / "again.osim"
    text, losses = format_osim(imported.figure, SpringSet({}))
    assert not any("follow" in loss.what for loss in losses.entries)
    path.write_text(without_carried_texts(text))
    again = read_model(path).figure
    for name, joint in imported.figure.joints.items():
        assert again.joints[name].followers == joint.followers
    assert fall_beside_opensim(path).stop < 1e-8


@pytest.mark.verify
def test_a_fall_of_the_walking_model_is_that_of_opensim():
    fall = fall_beside_opensim(WALKER)
    assert fall.stop < 1e-8
    assert fall.moved > 0.3


def test_forces_that_a_figure_does_not_have_are_told_by_name_and_kind():
    forces = """<ForceSet><objects>
    <ExpressionBasedCoordinateForce name="wind"><coordinate>bend</coordinate>
    <expression>gust(q)</expression></ExpressionBasedCoordinateForce>
    <BushingForce name="bush"/><HuntCrossleyForce name="heel"/>
    <CoordinateActuator name="motor"/><SpringGeneralizedForce name="gone">
    <coordinate>elbow</coordinate></SpringGeneralizedForce></objects></ForceSet>
    <ConstraintSet><objects><WeldConstraint name="weld"/></objects></ConstraintSet>"""
    imported = parse_model(Source("knee.osim", KNEE.format(forces))).require_value()
    assert lost(imported, "bushings") == ("bush",)
    assert lost(imported, "expressions") == ("wind (the function `gust` is not known)",)
    assert lost(imported, "contact") == ("heel",)
    assert lost(imported, "actuators") == ("motor",)
    assert lost(imported, "constraints") == ("weld",)
    assert lost(imported, "forces on coordinates that are locked or missing") == ("gone (elbow)",)


def test_markers_become_sites():
    assert "heel" in read_model(LEG).figure.segments["foot"].sites
