"""Models for OpenSim: it reads them, places the segments as we do and moves them as we do."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import pytest

from generator.figure import Figure
from generator.kinematics.loops import close_loops
from generator.kinematics.placement import forward_kinematics, initial_displacements
from generator.kinematics.tree import build_tree
from generator.model_files.opensim.write import write
from generator.motion_files.motion import motion_from_recording
from generator.motion_files.tables import write_mot
from springs import AxisSpring, SpringSet
from tests.chains import SKEW
from tests.generator.model_files.model_cases import (
    AGREEMENT,
    CURVES,
    FRAME,
    LOADED,
    LOOPS,
    OTHER_CURVES,
    PROTOTYPE,
    STOP,
    TREES,
    apart,
    hinge,
    on_a_rail,
    ours,
    own_springs,
    slide,
    spring_set,
)

opensim = pytest.importorskip("opensim")
opensim.Logger.removeFileSink()
opensim.Logger.setLevelString("Error")

pytestmark = pytest.mark.verify


class Loaded:
    """A model as OpenSim has read it."""

    def __init__(self, of: Figure, springs: SpringSet, folder: Path) -> None:
        path = folder / "figure.osim"
        self.losses = write(of, springs, path)
        self.figure = of
        self.model = opensim.Model(str(path))
        self.state = self.model.initSystem()

    def set(self, values: Mapping[str, Sequence[float]]) -> None:
        """Displacements by joint."""
        for name, numbers in values.items():
            for k, number in enumerate(numbers, 1):
                coordinate = self.model.getCoordinateSet().get(f"{name}_{k}")
                coordinate.setValue(self.state, float(number), False)

    def pose(self, path: str) -> np.ndarray:
        """Of a frame, in the ground."""
        frame = opensim.Frame.safeDownCast(self.model.getComponent(path))
        return matrix(frame.getTransformInGround(self.state))

    def poses(self) -> dict[str, np.ndarray]:
        self.model.realizePosition(self.state)
        return {name: self.pose(f"/bodyset/{name}") for name in self.figure.bodies}

    def moved(self) -> dict[str, np.ndarray]:
        """The motion from the pose of the file."""
        rows = [self.poses()]
        manager = opensim.Manager(self.model)
        manager.setIntegratorAccuracy(1e-9)
        manager.initialize(self.state)
        for k in range(1, round(STOP / FRAME) + 1):
            self.state = manager.integrate(k * FRAME)
            rows.append(self.poses())
        return {name: np.array([row[name] for row in rows]) for name in rows[0]}


def matrix(transform: object) -> np.ndarray:
    turn, shift = transform.R(), transform.p()
    rows = [[turn.get(i, j) for j in range(3)] + [shift.get(i)] for i in range(3)]
    return np.array([*rows, [0.0, 0.0, 0.0, 1.0]])


@pytest.mark.parametrize("name", TREES | LOOPS)
def test_segments_and_sites_start_where_the_figure_is_drawn(name: str, tmp_path: Path) -> None:
    of = (TREES | LOOPS)[name]
    loaded = Loaded(of, SpringSet(), tmp_path)
    tree = build_tree(of)
    expected = close_loops(tree, initial_displacements(tree)).poses
    for segment, pose in loaded.poses().items():
        assert pose == pytest.approx(expected[segment], abs=1e-9)
    for segment, one in of.segments.items():
        for site in one.sites:
            frame = f"{segment}_{site}" if segment in of.ground else f"{segment}/{site}"
            path = "/ground/" if segment in of.ground else "/bodyset/"
            pose = expected[segment] @ one.sites[site].pose_in_segment
            assert loaded.pose(path + frame.replace(" ", "_")) == pytest.approx(pose, abs=1e-9)


@pytest.mark.parametrize("name", TREES)
def test_coordinates_are_the_displacements(name: str, tmp_path: Path) -> None:
    of = TREES[name]
    loaded = Loaded(of, SpringSet(), tmp_path)
    random = np.random.default_rng(3)
    tree = build_tree(of)
    assert loaded.model.getNumCoordinates() == of.degrees_of_freedom
    for _ in range(5):
        values = {
            joint: random.uniform(-1.2, 1.2, len(one.chain)) for joint, one in of.joints.items()
        }
        loaded.set(values)
        expected = forward_kinematics(tree, values).poses
        for segment, pose in loaded.poses().items():
            assert pose == pytest.approx(expected[segment], abs=1e-9)


@pytest.mark.parametrize("name", TREES)
def test_figures_without_springs_fall_alike(name: str, tmp_path: Path) -> None:
    of = TREES[name]
    motion = Loaded(of, SpringSet(), tmp_path).moved()
    assert apart(motion, ours(of, SpringSet()).poses) < AGREEMENT


def test_the_prototype_falls_alike_on_its_own_hinges(tmp_path: Path) -> None:
    own = own_springs(PROTOTYPE)
    hinges = [one for name, one in own.joints.items() if len(PROTOTYPE.joints[name].chain) == 1]
    loaded = Loaded(PROTOTYPE, spring_set(*hinges), tmp_path)
    assert apart(loaded.moved(), ours(PROTOTYPE, spring_set(*hinges)).poses) < AGREEMENT


@pytest.mark.parametrize("name", CURVES | OTHER_CURVES)
def test_hinges_and_slides_have_the_forces_of_their_laws(name: str, tmp_path: Path) -> None:
    of, laws = on_a_rail(), (CURVES | OTHER_CURVES)[name]
    damping = {"viscous": 0.3, "coulomb": 0.7, "slip": 0.1}
    turned = hinge("hinge", *laws, axis=(1.0, 0.0, 0.0), **damping)
    springs = spring_set(turned, slide("rail", SKEW, *laws, **damping))
    loaded = Loaded(of, springs, tmp_path)
    assert not loaded.losses.entries
    for value, rate in zip(np.linspace(-2.0, 2.0, 41), np.linspace(0.9, -1.0, 41), strict=True):
        for name, sign, spring in (
            ("hinge_1", -1.0, turned.axes[0]),
            ("rail_1", 1.0, springs.joints["rail"].translations[0]),
        ):
            coordinate = loaded.model.getCoordinateSet().get(name)
            coordinate.setValue(loaded.state, value, False)
            coordinate.setSpeedValue(loaded.state, rate)
            loaded.model.realizeDynamics(loaded.state)
            force = loaded.model.getForceSet().get(f"{name}_spring")
            said = opensim.Force.safeDownCast(force).getRecordValues(loaded.state).get(0)
            expected = sign * resisting(spring, sign * value, sign * rate)
            assert said == pytest.approx(expected, rel=1e-9, abs=1e-9)


def resisting(spring: AxisSpring, value: float, rate: float) -> float:
    elastic = sum(float(law.torque(value)) for law in spring.elastic)
    return elastic + float(spring.resistance(value, rate))


@pytest.mark.parametrize("name", ["table", "exponential", "hysteresis"])
def test_laws_move_a_hinge_alike(name: str, tmp_path: Path) -> None:
    of = on_a_rail()
    laws = (CURVES | OTHER_CURVES)[name]
    springs = spring_set(
        hinge("hinge", *laws, axis=(1.0, 0.0, 0.0), viscous=0.05, coulomb=0.05, slip=0.1),
        slide("rail", SKEW, *CURVES["stop"], viscous=0.3),
    )
    motion = Loaded(of, springs, tmp_path).moved()
    assert apart(motion, ours(of, springs).poses) < AGREEMENT


@pytest.mark.parametrize("name", LOOPS)
def test_loops_stay_closed_and_move_alike(name: str, tmp_path: Path) -> None:
    of = LOOPS[name]
    motion = Loaded(of, SpringSet(), tmp_path).moved()
    assert apart(motion, ours(of, SpringSet()).poses) < AGREEMENT


def test_a_constant_load_acts_alike(tmp_path: Path) -> None:
    motion = Loaded(LOADED, SpringSet(), tmp_path).moved()
    assert apart(motion, ours(LOADED, SpringSet()).poses) < AGREEMENT


@pytest.mark.parametrize(
    "name", ["prototype", "slides along the child's axes, child nearer to the root", "rail"]
)
def test_a_motion_file_plays_on_the_model(name: str, tmp_path: Path) -> None:
    of = TREES[name]
    recording = ours(of, SpringSet())
    write_mot(motion_from_recording(recording, of), tmp_path / "fall.mot")
    loaded = Loaded(of, SpringSet(), tmp_path)
    table = opensim.TimeSeriesTable(str(tmp_path / "fall.mot"))
    assert table.getTableMetaDataAsString("inDegrees") == "yes"
    loaded.model.getSimbodyEngine().convertDegreesToRadians(table)
    labels = list(table.getColumnLabels())
    coordinates = loaded.model.getCoordinateSet()
    assert set(labels) == {coordinates.get(k).getName() for k in range(coordinates.getSize())}
    rows = []
    for k in range(table.getNumRows()):
        row = table.getRowAtIndex(k)
        for label, value in zip(labels, [row[j] for j in range(row.size())], strict=True):
            coordinates.get(label).setValue(loaded.state, value, False)
        rows.append(loaded.poses())
    played = {name: np.array([row[name] for row in rows]) for name in rows[0]}
    assert apart(played, recording.poses) < 1e-7
