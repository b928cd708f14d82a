"""The motions that are compared with MuJoCo's, and what the comparison measures.

`python -m tests.mujoco_cases` prints the table of `docs/verification.md`.
"""

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from generator.engine.plan import Plan
from generator.engine.simulate import simulate, springs_of
from generator.figure import Figure
from generator.reader import read_figure
from generator.recording import Recording
from springs import AxisSpring, Cubic, Damping, JointSprings, Linear, SpringSet
from tests.chains import ACROSS, SKEW, chain, row, two_bodies
from tests.mujoco_twin import Fall, Twin, angles_between, joint_errors

TOLERANCE = 1e-4
"""The tolerance that the compared runs are asked to hold [rad]."""

STEP = 1e-3
"""Step of MuJoCo's RK4 [s]; the reference of a comparison is the run with half of it."""

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
    """

    figure: Figure
    springs: SpringSet
    pose: Values = field(default_factory=dict[str, Sequence[float]])
    velocities: Values = field(default_factory=dict[str, Sequence[float]])
    native: bool = False
    free_root: bool = False

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
        """The run on Exudyn: one second."""
        return Plan(
            stop=1.0,
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
    hinge = AxisSpring((0.0, 0.0, -1.0), (Cubic((0.3, 3.0, -2.0, 5.0), -1, (-0.1, 0.2)),))
    return SpringSet({"tested": JointSprings("tested", axes), "ball": JointSprings("ball", axes),
                      "hinge": JointSprings("hinge", (hinge,))})


OWN = springs_of(PROTOTYPE, Plan())

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

CASES = {
    "linear, bent": Case(
        PROTOTYPE, equal_springs(PROTOTYPE, 20.0, 0.0), BENT, native=True
    ),
    "linear, bent, damped, pelvis without spring": Case(
        PROTOTYPE, equal_springs(PROTOTYPE, 60.0, 0.08, ["root_torso"]), BENT, native=True
    ),
    "linear, standing, tilted": Case(
        PROTOTYPE, equal_springs(PROTOTYPE, 20.0, 0.0), TILTED, native=True
    ),
    "linear, standing, tilted, damped, pelvis without spring": Case(
        PROTOTYPE, equal_springs(PROTOTYPE, 60.0, 0.08, ["root_torso"]), TILTED, native=True
    ),
    "own law, standing": Case(PROTOTYPE, OWN),
    "own law, standing, tilted": Case(PROTOTYPE, OWN, TILTED),
    "own law, stride": Case(PROTOTYPE, OWN, STRIDE),
    "own law, kick": Case(PROTOTYPE, OWN, KICK),
    "own law, free root, tumbling": Case(PROTOTYPE, OWN, BENT, TUMBLE, free_root=True),
    "row of five balls": Case(
        row(5), equal_springs(row(5), 3.0, 0.02), native=True
    ),
    "two bodies, oblique axes": Case(
        two_bodies(chain("Rs Ra Rs"), (0.5, -0.3, 0.4)), _oblique_springs()
    ),
    "two bodies, connected the other way round": Case(
        two_bodies(chain("Rs Ra Rs"), (0.5, -0.3, 0.4), reverse=True), _oblique_springs(),
        velocities={"tested": (100.0, -60.0, 80.0)}
    ),
}


@dataclass(frozen=True)
class Comparison:
    """What two motions of one case differ by.

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
    joints: np.ndarray
    reference_error: float
    origins: float
    energy: Mapping[str, float]
    exchanged: float


def compare(case: Case, tolerance: float = TOLERANCE) -> Comparison:
    """Run a case on both engines; frames that ours has."""
    twin = case.twin()
    coarse, fine = (twin.fall(1.0, step) for step in (STEP, STEP / 2.0))
    recording = simulate(case.figure, case.plan(tolerance))
    return compared(recording, coarse, fine)


def compared(recording: Recording, coarse: Fall, fine: Fall) -> Comparison:
    """A recording against MuJoCo's motion with two steps."""
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


def main() -> None:
    print("| fall | joints [rad] | estimated [rad] | MuJoCo's own [rad] | origins [m] | energy |")
    print("|---|---|---|---|---|---|")
    for name, case in CASES.items():
        began = time.monotonic()
        c = compare(case)
        share = max(c.energy.values()) / c.exchanged
        estimate = c.recording.accuracy.estimate
        cells = [c.joints[-1], estimate, c.reference_error, c.origins, share]
        print(f"| {name} |", " | ".join(f"{cell:.1e}" for cell in cells), "|")
        print(f"    {time.monotonic() - began:.1f} s {c.recording.outcome.message} {c.energy} {c.exchanged}", flush=True)


if __name__ == "__main__":
    main()
