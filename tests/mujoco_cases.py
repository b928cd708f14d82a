"""The motions that are compared with MuJoCo's, and what the comparison measures.

`python -m tests.mujoco_cases [TOLERANCE]` prints the tables of `docs/verification.md`.
"""

import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from generator.figure import Figure
from generator.figure_file import read_figure
from generator.recording import Recording
from generator.rotations import Array
from generator.simulation.plan import Plan, resolve_springs
from generator.simulation.run import simulate
from springs import AxisSpring, Cubic, Damping, JointSprings, Linear, SpringSet
from tests.chains import ACROSS, SKEW, chain, row, two_bodies
from tests.mujoco_twin import Fall, Twin, angles_between, joint_errors

TOLERANCE = 2e-5
"""The tolerance that the compared runs are asked to hold [rad]."""

STEP = 1e-3
"""Step of MuJoCo's RK4 [s], unless a case has its own."""

Values = Mapping[str, Sequence[float]]

PROTOTYPE = read_figure("prototype")


@dataclass(frozen=True)
class Case:
    """A fall.

    Attributes:
        figure: what falls.
        springs: of its joints.
        pose: displacements by joint [deg].
        velocities: rates by joint [deg/s]; of a free root, by its segment [deg/s, m/s].
        native: whether MuJoCo's own linear springs stand for the springs.
        free_root: whether the root is let go.
        stop: when the comparison ends [s].
        step: of MuJoCo's first run [s]; the second has half of it, and is the reference.
    """

    figure: Figure
    springs: SpringSet
    pose: Values = field(default_factory=dict[str, Sequence[float]])
    velocities: Values = field(default_factory=dict[str, Sequence[float]])
    native: bool = False
    free_root: bool = False
    stop: float = 1.0
    step: float = STEP

    @property
    def displacements(self) -> dict[str, tuple[float, ...]]:
        """[rad]."""
        return {name: tuple(np.radians(angles)) for name, angles in self.pose.items()}

    @property
    def rates(self) -> dict[str, tuple[float, ...]]:
        """[rad/s, m/s]."""
        return {
            name: (*np.radians(rates[:3]), *rates[3:]) for name, rates in self.velocities.items()
        }

    def plan(self, tolerance: float = TOLERANCE) -> Plan:
        """The run on Exudyn."""
        return Plan(
            stop=self.stop,
            tolerance=tolerance,
            springs=self.springs,
            displacements=self.displacements,
            velocities=self.rates,
            free_root=self.free_root,
        )

    def twin(self) -> Twin:
        """The model in MuJoCo."""
        return Twin(
            self.figure,
            self.springs,
            self.displacements,
            self.rates,
            native=self.native,
            free_root=self.free_root,
        )

    @cached_property
    def falls(self) -> tuple[Fall, Fall]:
        """MuJoCo's motion with the step and with half of it."""
        twin = self.twin()
        return twin.fall(self.stop, self.step), twin.fall(self.stop, self.step / 2.0)


def equal_springs(
    figure: Figure, stiffness: float, viscous: float, without: Sequence[str] = ()
) -> SpringSet:
    """A linear spring and damping equal about all axes, on all joints but some."""
    joints: dict[str, JointSprings] = {}
    for name, joint in figure.joints.items():
        if name not in without:
            axes = tuple(
                AxisSpring(factor.axis, (Linear(stiffness),), Damping(viscous))
                for factor in joint.chain
            )
            joints[name] = JointSprings(name, axes)
    return SpringSet(joints)


def _oblique_springs() -> SpringSet:
    """Curves of all kinds about axes that are along none of the coordinates."""
    third = tuple(float(part) for part in np.cross(SKEW, ACROSS))
    curves = (
        (SKEW, Cubic((0.5, 9.0, -1.0, 6.0), -1, (-0.2, 0.3), 0.1), Damping(0.03)),
        (ACROSS, Cubic((0.2, 4.0, 3.0, 8.0)), Damping(0.01, 0.05, 0.5)),
        (third, Linear(12.0, -0.2), Damping(0.08)),
    )
    axes = tuple(AxisSpring(axis, (law,), damping) for axis, law, damping in curves)
    return SpringSet({name: JointSprings(name, axes) for name in ("ball", "tested")})


OWN = resolve_springs(PROTOTYPE, Plan())
ROW = row(5)
OBLIQUE = chain("Rs Ra Rs")
START = (0.5, -0.3, 0.4)

TILTED = {"root_torso": (2.0, 3.0, 1.0)}
BENT = {
    "waist": (10.0, 20.0, -15.0),
    "root_torso": (5.0, -10.0, 8.0),
    "left_shoulder": (20.0, 40.0, -30.0),
    "right_shoulder": (-15.0, 25.0, 35.0),
    "right_elbow": (-40.0,),
    "left_elbow": (-25.0,),
    "right_hip_joint": (10.0, 15.0, -30.0),
    "left_hip_joint": (-10.0, 8.0, 25.0),
    "right_knee": (30.0,),
    "left_knee": (45.0,),
}
STRIDE = {
    "left_hip_joint": (5.0, 8.0, 40.0),
    "right_hip_joint": (-5.0, 4.0, -10.0),
    "left_knee": (50.0,),
    "right_knee": (15.0,),
    "right_elbow": (-30.0,),
    "left_shoulder": (10.0, 5.0, -20.0),
}
KICK = {"left_hip_joint": (0.0, 0.0, 60.0), "left_knee": (60.0,), "right_elbow": (-30.0,)}
TUMBLE = {
    "lower_torso": (60.0, 120.0, -40.0, 0.3, 3.0, 0.5),
    "left_knee": (100.0,),
    "right_shoulder": (50.0, -80.0, 60.0),
}

LINEAR = {
    "bent": Case(PROTOTYPE, equal_springs(PROTOTYPE, 20.0, 0.0), BENT, native=True),
    "bent, damped, pelvis loose": Case(
        PROTOTYPE, equal_springs(PROTOTYPE, 60.0, 0.08, ["root_torso"]), BENT, native=True
    ),
    "standing, tilted": Case(PROTOTYPE, equal_springs(PROTOTYPE, 20.0, 0.0), TILTED, native=True),
    "standing, tilted, damped, pelvis loose": Case(
        PROTOTYPE, equal_springs(PROTOTYPE, 60.0, 0.08, ["root_torso"]), TILTED, native=True
    ),
    "row of five bars on balls": Case(
        ROW, equal_springs(ROW, 3.0, 0.02), velocities={"joint2": (80.0, 50.0, -90.0)}, native=True
    ),
}
"""Linear springs, in MuJoCo its own."""

OWN_LAW = {
    "standing": Case(PROTOTYPE, OWN),
    "standing, tilted": Case(PROTOTYPE, OWN, TILTED),
    "stride": Case(PROTOTYPE, OWN, STRIDE),
    "kick": Case(PROTOTYPE, OWN, KICK),
    "free root, tumbling": Case(PROTOTYPE, OWN, BENT, TUMBLE, free_root=True, step=STEP / 2.0),
    "two bodies, oblique axes": Case(two_bodies(OBLIQUE, START), _oblique_springs()),
    "two bodies, child nearer to the root": Case(
        two_bodies(OBLIQUE, START, reverse=True),
        _oblique_springs(),
        velocities={"tested": (100.0, -60.0, 80.0)},
    ),
}
"""Curves with dead zones, in MuJoCo by its callback."""

CASES = {
    **{f"linear springs: {name}": case for name, case in LINEAR.items()},
    **{f"own law: {name}": case for name, case in OWN_LAW.items()},
}

TURNING_OVER = Case(PROTOTYPE, OWN, BENT)
"""A shoulder goes through 180 deg before the second is over."""

HARD = {
    "own law: bent, until 0.8 s": Case(PROTOTYPE, OWN, BENT, stop=0.8, step=STEP / 2.0),
    "own law: pelvis turned by 90 deg, until 0.46 s": Case(
        PROTOTYPE, OWN, {"root_torso": (90.0, 0.0, 0.0)}, stop=0.46
    ),
    "own law: upside down": Case(PROTOTYPE, OWN, {"root_torso": (170.0, 0.0, 5.0)}),
    "own law: leaning by 60 deg": Case(
        PROTOTYPE, OWN, {"root_torso": (0.0, 60.0, 0.0)}, step=STEP / 2.0
    ),
}
"""Falls that amplify errors more; they stand in the table and in no test."""


@dataclass(frozen=True)
class Comparison:
    """Differences between two motions of one case.

    Attributes:
        recording: ours.
        reference: MuJoCo's with the smaller step.
        joints: largest joint-angle difference up to each frame [rad], shape (n,).
        reference_error: by how much MuJoCo's joint angles moved when its step was halved [rad].
        origins: largest distance between a segment's origins [m].
        energy: by kind, largest difference [J].
        exchanged: the largest kinetic energy, or loss, whichever is more [J].
    """

    recording: Recording
    reference: Fall
    joints: Array
    reference_error: float
    origins: float
    energy: Mapping[str, float]
    exchanged: float


def compare(case: Case, tolerance: float = TOLERANCE) -> Comparison:
    """Run a case on both engines."""
    coarse, fine = case.falls
    recording = simulate(case.figure, case.plan(tolerance))
    n = len(recording.times)
    moved = [
        float(np.max(angles_between(coarse.joints[name][:n], fine.joints[name][:n])))
        for name in fine.joints
    ]
    apart = [
        np.linalg.norm(recording.poses[name][:, :3, 3] - places[:n], axis=1)
        for name, places in fine.origins.items()
    ]
    total = (fine.kinetic + fine.potential)[:n]
    ours = recording.energy
    energy = {
        "kinetic": ours["kinetic"] - fine.kinetic[:n],
        "potential": ours["gravity"] + ours["spring"] - fine.potential[:n],
        "dissipated": ours["dissipated"] - (total[0] - total),
    }
    return Comparison(
        recording,
        fine,
        np.maximum.accumulate(joint_errors(fine, recording)),
        max(moved),
        float(np.max(apart)),
        {kind: float(np.max(np.abs(gap))) for kind, gap in energy.items()},
        float(max(np.max(fine.kinetic[:n]), total[0] - total[-1])),
    )


def growth(case: Case) -> float:
    """Growth of a turn of the first joint by 1 urad within the time, as a factor."""
    small = 1e-6
    first = next(iter(case.figure.joints))
    angles = case.pose.get(first, np.degrees(case.figure.joints[first].displacement))
    turned = (angles[0] + np.degrees(small), *angles[1:])
    moved = replace(case, pose={**case.pose, first: turned}).twin()
    one, other = case.falls[1].joints, moved.fall(case.stop, case.step / 2.0).joints
    return max(float(np.max(angles_between(one[name], other[name]))) for name in one) / small


def main() -> None:
    """Print the table at a tolerance [rad], the first argument."""
    tolerance = float(sys.argv[1]) if sys.argv[1:] else TOLERANCE
    print("| fall | joint angles | estimate | MuJoCo's own | origins | energy | growth | wall |")
    print("|---|---|---|---|---|---|---|---|")
    for name, case in {**CASES, **HARD}.items():
        c = compare(case, tolerance)
        cells = [c.joints[-1], c.recording.accuracy.estimate, c.reference_error, c.origins]
        cells.append(max(c.energy.values()) / c.exchanged)
        figures = [f"{cell:.1e}" for cell in cells]
        figures += [f"{growth(case):.0f}", f"{c.recording.wall_time:.1f} s"]
        print(f"| {name} |", " | ".join(figures), "|", flush=True)


if __name__ == "__main__":
    main()
