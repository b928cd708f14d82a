"""Exported models in the programs that they are for, beside this program.

Run with `python -m benchmarks exports`. For each shipped figure it compares the moments of the
springs in poses over the joints' ranges with the errors that the writer states, and half a second
of fall with ours, with and without springs. The other program falls twice, the second time finer:
the change is its own error. MuJoCo's files are under the law of coordinates, the only one that they
hold; the file without springs falls a third time, with the figure's own law in a callback.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from benchmarks import tables
from benchmarks.exported import (
    ExportedModel,
    Motion,
    MuJoCoModel,
    OpenSimModel,
    difference,
    moment_differences,
    stated_errors,
)
from benchmarks.exported_trees import BiorbdModel, PinocchioModel
from generator.figure import Figure
from generator.figure_file import read_figure
from generator.joint_chain import build_chain
from generator.kinematics.free_root import detach_root
from generator.kinematics.tree import build_tree
from generator.rotations import inverse_pose
from generator.simulation.plan import Plan
from generator.simulation.run import simulate
from generator.springs_file.read import read_springs
from springs import SphericalLaw, SpringSet

COMMAND = "python -m benchmarks exports"

STOP, FRAME = 0.5, 0.01
"""Of every fall [s]."""

TOLERANCE = 1e-6
"""Of our runs [rad]."""

ACCURACIES: Mapping[str, tuple[float, float]] = {
    "MuJoCo": (1e-3, 1.25e-4),
    "OpenSim": (1e-6, 1e-9),
    "Pinocchio": (1e-7, 1e-9),
    "biorbd": (1e-7, 1e-9),
}
"""Step [s], accuracy of OpenSim's manager, or SciPy's tolerance: of the row, and a finer one."""

LAW_STEP = 5e-4
"""Of MuJoCo with our laws, which Python evaluates [s]."""

BENT: Mapping[str, tuple[float, ...]] = {
    "right_hip_joint": (0.0, 0.0, 60.0),
    "left_hip_joint": (0.0, 0.0, -15.0),
    "left_shoulder": (0.0, 0.0, 110.0),
    "waist": (0.0, 0.0, 25.0),
}
"""Start of persons [deg]: flexion of hips, a shoulder, waist."""


@dataclass(frozen=True)
class Case:
    """A figure that falls from the pose in which it is drawn."""

    name: str
    figure: Figure
    springs: SpringSet

    @property
    def in_coordinates(self) -> "Case":
        """The case under the law of coordinates."""
        return replace(self, springs=replace(self.springs, law=SphericalLaw.COORDINATES))

    def held_by(self, program: str) -> "Case":
        """The case in a program's file: MuJoCo's is under the law of coordinates.

        Only OpenSim's holds the reach of a limb; others are without the springs of its joint.
        """
        if program == OpenSimModel.name:
            return self
        held = self.without_reaches
        return held.in_coordinates if program == MuJoCoModel.name else held

    @property
    def without_reaches(self) -> "Case":
        """The case without the springs of joints with a reach."""
        joints = {name: one for name, one in self.springs.joints.items() if one.reach is None}
        return replace(self, springs=replace(self.springs, joints=joints))

    @property
    def in_callback(self) -> "Case":
        """The case without laws over several joints, which MuJoCo's callback leaves out."""
        return replace(self, springs=replace(self.springs, coupled=()))


def posed(figure: Figure, degrees: Mapping[str, tuple[float, ...]]) -> Figure:
    """The figure, drawn with other displacements of some joints."""
    joints = dict(figure.joints)
    for name, angles in degrees.items():
        joints[name] = replace(joints[name], displacement=tuple(np.radians(angles).tolist()))
    return replace(figure, joints=joints)


def detached(case: Case) -> Case:
    """The case without its joints to the ground."""
    values = {name: np.array(one.displacement) for name, one in case.figure.joints.items()}
    figure = detach_root(case.figure, values)[0]
    return Case(f"{case.name}, free root", figure, case.springs.of_joints(figure.joints))


def cases() -> tuple[Case, ...]:
    """The shipped figures, and the prototype with a free root."""
    drawn = {
        "prototype": posed(read_figure("prototype"), BENT),
        "clavicles": posed(read_figure("clavicles"), BENT),
        "male50": posed(read_figure("male50"), BENT),
        "pendulum": read_figure("pendulum"),
        "fourbar": read_figure("fourbar"),
    }
    found = [Case(name, figure, read_springs(None, figure)) for name, figure in drawn.items()]
    return (*found, detached(found[0]))


def our_fall(figure: Figure, springs: SpringSet, stop: float = STOP) -> tuple[list[float], Motion]:
    """Times and poses of our fall."""
    plan = Plan(stop=stop, frame=FRAME, tolerance=TOLERANCE, springs=springs)
    recording = simulate(figure, plan)
    if not recording.outcome.succeeded:
        raise RuntimeError(recording.outcome.message)
    return recording.times.tolist(), recording.poses


def fall_row(model: ExportedModel, case: Case, springs: SpringSet, word: str) -> dict[str, object]:
    """Differences of the falls [mm and deg], and the change of the finer run [mm]."""
    times, ours = our_fall(case.figure, springs)
    coarse, fine = (model.fall(times, accuracy) for accuracy in ACCURACIES[model.name])
    distance, angle = difference(case.figure, coarse, ours)
    own = difference(case.figure, coarse, fine)[0]
    return {
        f"{word} [mm]": 1e3 * distance,
        f"{word} [deg]": float(np.degrees(angle)),
        f"{word}, own error [mm]": 1e3 * own,
    }


def engines() -> Iterator[Any]:
    """The programs that are installed."""
    for engine, module in (
        (OpenSimModel, "opensim"),
        (MuJoCoModel, "mujoco"),
        (BiorbdModel, "biorbd"),
        (PinocchioModel, "pinocchio"),
    ):
        try:
            __import__(module)
        except ModuleNotFoundError:
            continue
        yield engine


def row(engine: Any, case: Case, folder: Path) -> dict[str, object]:
    """The row of a figure in a program."""
    found: dict[str, object] = {"figure": case.name, "program": engine.name}
    called, case = case.in_callback, case.held_by(engine.name)
    model = engine(case.figure, case.springs, folder)
    warnings = len(model.warnings)
    if case.springs.joints and engine is not PinocchioModel:
        stated = stated_errors(model.losses, case.springs)
        compared = [
            moment_differences(model, case.figure, case.springs, name)
            for name in case.springs.joints
        ]
        found["moments [N m]"] = max(float(np.abs(each).max()) for each, _ in compared)
        found["of [N m]"] = max(size for _, size in compared)
        found["stated [N m]"] = max(stated.values(), default=0.0)
        found |= fall_row(model, case, case.springs, "with springs")
    bare = engine(case.figure, SpringSet(), folder)
    if case.springs.joints and isinstance(bare, MuJoCoModel):
        times, ours = our_fall(called.figure, called.springs)
        fall = bare.fall(times, LAW_STEP, called.springs)
        found["our laws there [mm]"] = 1e3 * difference(case.figure, fall, ours)[0]
    found |= fall_row(bare, case, SpringSet(), "without")
    found["warnings"] = warnings + len(bare.warnings)
    return found


HEAD = (
    "figure",
    "program",
    "warnings",
    "moments [N m]",
    "stated [N m]",
    "of [N m]",
    "with springs [mm]",
    "with springs [deg]",
    "with springs, own error [mm]",
    "our laws there [mm]",
    "without [mm]",
    "without, own error [mm]",
)


def is_bare_tree(figure: Figure) -> bool:
    """Tell whether a figure has neither loops nor loads, which the other formats do not hold."""
    sites = [site for body in figure.bodies.values() for site in body.sites.values()]
    return not build_tree(figure).closures and not any(site.global_force for site in sites)


def rows() -> Iterator[dict[str, object]]:
    """The rows of the table."""
    for case in cases():
        for engine in engines():
            if engine not in (OpenSimModel, MuJoCoModel) and not is_bare_tree(case.figure):
                continue
            with TemporaryDirectory() as folder:
                found = row(engine, case, Path(folder))
            yield {key: _short(found.get(key, "")) for key in HEAD}


def motion_rows(
    case: Case, times: list[float], motion: Motion, program: str
) -> Iterator[dict[str, object]]:
    """A motion as displacements of all joints, a row a frame."""
    poses = dict(motion)
    for name in case.figure.ground:
        poses[name] = np.tile(np.eye(4), (len(times), 1, 1))
    columns: dict[str, list[str]] = {}
    for name, joint in case.figure.joints.items():
        parent, child = (
            poses[ref.segment] @ case.figure.site(ref).pose_in_segment
            for ref in (joint.parent, joint.child)
        )
        values = build_chain(joint.chain).continuous_displacements(
            inverse_pose(parent) @ child, np.array(joint.displacement)
        )
        for k, column in enumerate(values.T, 1):
            columns[f"{name}_{k} [rad]"] = [str(round(value, 6) + 0.0) for value in column.tolist()]
    for frame, time in enumerate(times):
        cells = {key: column[frame] for key, column in columns.items()}
        yield {"program": program, "time [s]": f"{time:g}", **cells}


def motions(case: Case) -> Iterator[dict[str, object]]:
    """The falls that the plate draws: by the files, and by our laws in MuJoCo.

    That of MuJoCo's file is under the law of coordinates.
    """
    times, _ = our_fall(case.figure, case.springs)
    with TemporaryDirectory() as folder:
        mujoco = MuJoCoModel(case.figure, case.in_coordinates.springs, Path(folder))
        motion = mujoco.fall(times, ACCURACIES["MuJoCo"][1])
        yield from motion_rows(case, times, motion, "MuJoCo")
        bare = MuJoCoModel(case.figure, SpringSet(), Path(folder))
        motion = bare.fall(times, LAW_STEP, case.springs)
        yield from motion_rows(case, times, motion, "MuJoCo, our laws")
        opensim = OpenSimModel(case.figure, case.springs, Path(folder))
        motion = opensim.fall(times, ACCURACIES["OpenSim"][1])
        yield from motion_rows(case, times, motion, "OpenSim")


def _short(value: object) -> object:
    return float(f"{value:.2g}") if isinstance(value, float) else value


def main() -> None:
    """Print the table, and write it and the motions for the plate `exported_fall`."""
    every: list[dict[str, object]] = []
    tables.show(every.append(each) or each for each in rows())
    tables.write("exports", COMMAND, every)
    tables.write("exports_motion", COMMAND, list(motions(cases()[0])))


if __name__ == "__main__":
    main()
