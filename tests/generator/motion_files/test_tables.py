"""OpenSim tables: OpenSim reads them, and its own kinematics place every site."""

from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from generator.figure import AxisKind, Figure, Joint, JointAxis
from generator.kinematics.tree import TreeJoint
from generator.motion_files.motion import FigureMotion
from generator.motion_files.tables import write_mot, write_sto
from tests.motions import MOTIONS, all_sites, clip, site, ten_frames

WITHIN = 1e-6
AXES = tuple(np.eye(3))


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("opensim")


def table(path: Path) -> tuple[list[str], dict[str, str], np.ndarray]:
    lines = path.read_text(encoding="utf-8").splitlines()
    end = lines.index("endheader")
    header = dict(line.split("=", 1) for line in lines[1:end])
    rows = np.array([line.split("\t") for line in lines[end + 2 :]], dtype=float)
    return lines[end + 1].split("\t"), header, rows


class Twin:
    """A figure built with OpenSim's own joints: a free frame for every factor of every chain."""

    def __init__(self, motion: FigureMotion) -> None:
        self.osim: Any = pytest.importorskip("opensim")
        self.osim.Logger.setLevelString("Error")
        self.model: Any = self.osim.Model()
        figure = motion.tree.figure
        self.bodies: dict[str, Any] = {}
        for name in figure.ground:
            self.bodies[name] = self.frame(self.model.getGround(), motion.poses[name][0], name)
        for branch in motion.tree.joints:
            self.hang(figure, branch)
        self.state = self.model.initSystem()

    def transform(self, pose: np.ndarray) -> Any:
        turn = self.osim.Mat33(*(float(part) for part in pose[:3, :3].ravel()))
        rotation = self.osim.Rotation(turn)
        return self.osim.Transform(rotation, self.osim.Vec3(*map(float, pose[:3, 3])))

    def frame(self, parent: Any, pose: np.ndarray, name: str) -> Any:
        made = self.osim.PhysicalOffsetFrame(name, parent, self.transform(pose))
        self.model.addComponent(made)
        return made

    def hang(self, figure: Figure, branch: TreeJoint) -> None:
        """One joint of one coordinate for each factor, bodies without size between them."""
        joint = branch.joint
        parent, child = (figure.site(ref).pose_in_segment for ref in joint.ends)
        order = list(range(len(joint.chain)))
        # From the base to the tip: outermost factor first; the other way round against `connect`.
        steps = order[::-1] if branch.parent_is_inboard else order
        first, last = (parent, child) if branch.parent_is_inboard else (child, parent)
        here = self.frame(self.bodies[branch.inboard], first, f"{joint.name}_base")
        for k in steps:
            here = self.coordinate(joint, k, here, forward=branch.parent_is_inboard)
        if not joint.chain:
            here = self.weld(joint, here)
        inverse = np.linalg.inv(last)
        self.bodies[branch.outboard] = self.frame(here, inverse, f"{branch.outboard}_frame")

    def body(self, name: str) -> Any:
        made = self.osim.Body(name, 1.0, self.osim.Vec3(0), self.osim.Inertia(1, 1, 1, 0, 0, 0))
        self.model.addBody(made)
        return made

    def weld(self, joint: Joint, parent: Any) -> Any:
        body = self.body(f"{joint.name}_body")
        self.model.addJoint(self.osim.WeldJoint(f"{joint.name}_weld", parent, body))
        return body

    def coordinate(self, joint: Joint, k: int, parent: Any, *, forward: bool) -> Any:
        name, factor = f"{joint.name}_{k + 1}", joint.chain[k]
        body = self.body(f"{name}_body")
        along = self.across(factor, forward=forward)
        start = self.frame(parent, along, f"{name}_start")
        made = self.osim.PinJoint if factor.kind is AxisKind.ROTATION else self.osim.SliderJoint
        moved = made(f"{name}_joint", start, body)
        moved.updCoordinate().setName(name)
        self.model.addJoint(moved)
        return self.frame(body, np.linalg.inv(along), f"{name}_end")

    @staticmethod
    def across(factor: JointAxis, *, forward: bool) -> np.ndarray:
        """A frame whose z (of a pin) or x (of a slider) is along the axis."""
        axis = np.array(factor.axis) / np.linalg.norm(factor.axis) * (1.0 if forward else -1.0)
        other = np.cross(axis, AXES[int(np.argmin(np.abs(axis)))])
        other /= np.linalg.norm(other)
        third = np.cross(axis, other)
        columns = [other, third, axis] if factor.kind is AxisKind.ROTATION else [axis, other, third]
        pose = np.eye(4)
        pose[:3, :3] = np.stack(columns, axis=1)
        return pose

    def place(self, values: dict[str, float]) -> None:
        coordinates = self.model.updCoordinateSet()
        assert coordinates.getSize() == len(values)
        for name, value in values.items():
            coordinates.get(name).setValue(self.state, value, False)
        self.model.realizePosition(self.state)

    def where(self, segment: str, point: np.ndarray) -> list[float]:
        local = self.osim.Vec3(*map(float, point))
        found = self.bodies[segment].findStationLocationInGround(self.state, local)
        return [found[k] for k in range(3)]


@cache
def twin(name: str) -> Twin:
    return Twin(clip(name))


def read(path: Path, how: str) -> tuple[list[float], dict[str, list[float]], bool]:
    """Times, columns and whether angles are in degrees, as OpenSim's two readers have them."""
    osim: Any = pytest.importorskip("opensim")
    if how == "Storage":
        stored = osim.Storage(str(path))
        labels = stored.getColumnLabels()
        columns: dict[str, list[float]] = {}
        for k in range(1, labels.getSize()):
            column = osim.ArrayDouble()
            stored.getDataColumn(labels.get(k), column)
            columns[labels.get(k)] = [column.get(row) for row in range(column.getSize())]
        moments = osim.ArrayDouble()
        stored.getTimeColumn(moments)
        times = [moments.get(row) for row in range(moments.getSize())]
        return times, columns, stored.isInDegrees()
    made = osim.TimeSeriesTable(str(path))
    columns = {
        label: [made.getDependentColumn(label)[row] for row in range(made.getNumRows())]
        for label in made.getColumnLabels()
    }
    return (
        list(made.getIndependentColumn()),
        columns,
        made.getTableMetaDataString("inDegrees") == "yes",
    )


@pytest.mark.verify
@pytest.mark.parametrize("how", ["Storage", "TimeSeriesTable"])
@pytest.mark.parametrize("suffix", ["mot", "sto"])
@pytest.mark.parametrize("name", MOTIONS)
def test_opensim_finds_every_site_in_its_place(name: str, suffix: str, how: str, folder: Path):
    motion, made = clip(name), twin(name)
    path = folder / f"{name}.{suffix}"
    (write_mot if suffix == "mot" else write_sto)(motion, path)
    times, columns, in_degrees = read(path, how)
    assert in_degrees == (suffix == "mot")
    assert times == motion.times.tolist()
    kinds = {
        f"{b.joint.name}_{k}": factor.kind
        for b in motion.tree.joints
        for k, factor in enumerate(b.joint.chain, 1)
    }
    frames = ten_frames(motion)
    for frame in frames:
        values = {
            label: np.radians(columns[label][frame])
            if in_degrees and kind is AxisKind.ROTATION
            else columns[label][frame]
            for label, kind in kinds.items()
        }
        made.place(values)
        for segment, place in all_sites(motion):
            point = motion.figure.segments[segment].sites[place].pose_in_segment[:3, 3]
            truth = site(motion, segment, place, [frame])[0]
            assert np.allclose(made.where(segment, point), truth, rtol=0.0, atol=WITHIN)


@pytest.mark.parametrize("suffix", ["mot", "sto"])
@pytest.mark.parametrize("name", MOTIONS)
def test_columns_are_the_displacements_in_order(name: str, suffix: str, folder: Path):
    motion, path = clip(name), folder / f"{name}.{suffix}"
    (write_mot if suffix == "mot" else write_sto)(motion, path)
    labels, header, rows = table(path)
    joints = motion.displacements.items()
    assert labels == ["time", *(f"{n}_{k + 1}" for n, d in joints for k in range(d.shape[1]))]
    assert (int(header["nRows"]), int(header["nColumns"])) == rows.shape
    assert header["figure"] == motion.header.figure
    assert header["inDegrees"] == ("yes" if suffix == "mot" else "no")
    said = np.concatenate(list(motion.displacements.values()), axis=1)
    turns = np.array(
        [f.kind is AxisKind.ROTATION for chain in motion.chains.values() for f in chain]
    )
    shown = np.where(turns & (suffix == "mot"), np.degrees(said), said)
    assert np.array_equal(rows, np.column_stack([motion.times, shown]))
