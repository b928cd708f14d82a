"""A model in OpenSim and its figure, falling side by side without forces.

`python -m tests.generator.model_files.opensim_fall MODEL.osim ...` prints how far the bodies are
apart after 0.3 s from a random pose with random rates, how far they moved, and by how much the
energy of OpenSim's own motion has changed, which nothing should; `--accuracy` and `--integrator`
are OpenSim's.
"""

from argparse import ArgumentParser
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest

from generator.figure import without_followers
from generator.model import Model
from generator.model_files.body_tree.to_figure import FRAME
from generator.model_files.formats import read_model
from generator.recording import Recording
from generator.rotations import Array
from generator.simulation.plan import Plan
from generator.simulation.run import simulate
from springs import SpringSet

STOP, SPREAD, SPEED = 0.3, 0.25, 1.5


class Fall(NamedTuple):
    """Differences of two falls.

    Attributes:
        start: Largest distance of the origins of bodies at the start [m].
        stop: The same at the end [m].
        moved: Largest distance that one moves [m].
        energy: Change of the energy in OpenSim [J].
        recording: The fall here.
    """

    start: float
    stop: float
    moved: float
    energy: float
    recording: Recording


class Twin:
    """A model in OpenSim without forces."""

    def __init__(self, path: Path) -> None:
        self.api: Any = pytest.importorskip("opensim")
        self.api.Logger.setLevelString("Error")
        self.api.Logger.removeFileSink()
        self.model = self.api.Model(str(path))
        self.model.updForceSet().clearAndDestroy()
        self.model.updControllerSet().clearAndDestroy()
        self.state = self.model.initSystem()
        self.coordinates: Any = self.model.getCoordinateSet()

    def set(self, name: str, value: float, rate: float) -> None:
        coordinate = self.coordinates.get(name)
        coordinate.setClamped(self.state, False)
        coordinate.setValue(self.state, value, False)
        coordinate.setSpeedValue(self.state, rate)

    def follow(self) -> None:
        """Set the coordinates that follow others by constraints."""
        constraints = self.model.getConstraintSet()
        for k in range(constraints.getSize()):
            one = self.api.CoordinateCouplerConstraint.safeDownCast(constraints.get(k))
            if one is None:
                continue
            control = self.coordinates.get(one.getIndependentCoordinateNames().get(0))
            at, function = control.getValue(self.state), one.getFunction()
            places = (at - 1e-6, at, at + 1e-6)
            ends = [function.calcValue(self.api.Vector(1, place)) for place in places]
            rate = (ends[2] - ends[0]) / 2e-6 * control.getSpeedValue(self.state)
            self.set(one.getDependentCoordinateName(), ends[1], rate)

    def places(self) -> dict[str, Array]:
        """Origin of each body [m]."""
        self.model.realizePosition(self.state)
        bodies = self.model.getBodySet()
        every = [bodies.get(k) for k in range(bodies.getSize())]
        return {b.getName(): b.getPositionInGround(self.state).to_numpy() for b in every}

    def energy(self) -> float:
        self.model.realizeDynamics(self.state)
        kinetic = self.model.calcKineticEnergy(self.state)
        return float(kinetic + self.model.calcPotentialEnergy(self.state))


def as_rows(values: dict[str, Array]) -> dict[str, tuple[float, ...]]:
    return {name: tuple(row.tolist()) for name, row in values.items()}


def fall_beside_opensim(path: Path, accuracy: float = 1e-9, integrator: str = "") -> Fall:
    """Let a model fall here and in OpenSim from the same random state.

    Args:
        path: Model.
        accuracy: Accuracy of OpenSim's integrator.
        integrator: OpenSim's name of it; "" for its own choice.
    """
    twin, imported = Twin(path), read_model(path)
    figure, rng = imported.figure, np.random.default_rng(1)
    values = {name: np.array(joint.displacement) for name, joint in figure.joints.items()}
    rates = {name: np.zeros(len(joint.chain)) for name, joint in figure.joints.items()}
    for name, at in imported.coordinates.items():
        default = twin.coordinates.get(name).getDefaultValue()
        value, rate = default + rng.uniform(-SPREAD, SPREAD), rng.uniform(-SPEED, SPEED)
        twin.set(name, value, rate)
        values[at.joint][at.index] = (value - at.offset) / at.scale
        rates[at.joint][at.index] = rate / at.scale
    twin.follow()
    first, energy = twin.places(), twin.energy()
    x, y, z = (float(part) for part in twin.model.getGravity().to_numpy())
    start = {
        "displacements": without_followers(figure.joints, values),
        "velocities": as_rows(rates),
    }
    plan = Plan(stop=STOP, tolerance=1e-6, gravity=(x, y, z), **start)
    recording = simulate(Model(figure, SpringSet({})), plan)
    manager = twin.api.Manager(twin.model)
    if integrator:
        method = getattr(twin.api.Manager, f"IntegratorMethod_{integrator}")
        manager.setIntegratorMethod(method)
    manager.setIntegratorAccuracy(accuracy)
    manager.initialize(twin.state)
    twin.state = manager.integrate(STOP)
    last = twin.places()

    def distance(places: dict[str, Array], frame: int) -> float:
        ours = {
            name: recording.poses[name][frame] @ one.sites[FRAME].pose_in_segment[:, 3]
            for name, one in figure.segments.items()
            if name in places and FRAME in one.sites
        }
        return max(float(np.abs(place[:3] - places[name]).max()) for name, place in ours.items())

    moved = max(float(np.abs(last[name] - first[name]).max()) for name in last)
    change = twin.energy() - energy
    return Fall(distance(first, 0), distance(last, -1), moved, change, recording)


if __name__ == "__main__":
    options = ArgumentParser()
    options.add_argument("models", nargs="+", type=Path)
    options.add_argument("--accuracy", type=float, default=1e-9)
    options.add_argument("--integrator", default="", help="such as CPodes")
    chosen = options.parse_args()
    for model in chosen.models:
        fall = fall_beside_opensim(model, chosen.accuracy, chosen.integrator)
        name, balance = model.name, np.ptp(fall.recording.energy_balance)
        print(f"{name:32s} {1e3 * fall.stop:8.1e} mm of {1e3 * fall.moved:5.0f}", end="; ")
        print(f"energy {balance:.0e} J, OpenSim {fall.energy:+.0e} J", end="; ")
        print(f"from Exudyn {fall.recording.agreement_with_exudyn:.0e}", flush=True)
