"""Work of damping and loads is summed at every step, whatever the frames."""

import numpy as np
import pytest

from generator.figure import SiteRef
from generator.loads import LoadKind, constant_load
from generator.simulation.plan import Plan
from generator.simulation.run import simulate
from springs import AxisSpring, Cubic, Damping, Joining, JointSprings, Linear, SpringSet
from tests.chains import BALL, X, Y, Z, body, chain, one_body, row
from tests.runs import springs_of

NONE = SpringSet()


@pytest.mark.parametrize("frame", [1e-3, 0.02, 0.03, 0.25])
def test_sums_do_not_depend_on_the_frames(frame) -> None:
    """Over one reading of the meters and over many."""
    figure = row(2, (BALL, chain("Rz")), stiff=4.0, damp=0.1)
    load = constant_load(SiteRef("bar1", "far"), LoadKind.LOCAL_FORCE, (0.5, 1.0, -0.5), -1.0, 2.0)
    runs = [
        simulate(figure, Plan(stop=0.75, step=1e-3, frame=f, loads=[load])) for f in (0.05, frame)
    ]
    for kind in ("dissipated", "work"):
        one, other = (run.energy[kind][-1] for run in runs)
        assert abs(one) > 1e-3
        assert other == pytest.approx(one, rel=1e-6)


@pytest.mark.parametrize(
    ("damping", "rate_at"),
    [
        (Damping(0.08), lambda t: 10.0 * np.exp(-0.08 / 0.04 * t)),
        (Damping(0.0, 0.2), lambda t: 10.0 - 5.0 * t),
    ],
    ids=["viscous", "Coulomb"],
)
def test_what_damping_takes_from_a_wheel_is_dissipated(damping, rate_at) -> None:
    wheel = body("link", centre=(0.0, 0.0, 0.0), inertia=(0.02, 0.03, 0.04))
    springs = springs_of("pin", AxisSpring(Z, (), damping))
    plan = Plan(stop=1.0, tolerance=1e-6, springs=springs, velocities={"pin": (10.0,)})
    run = simulate(one_body(chain("Rz"), (0.0,), wheel), plan)
    rate = rate_at(run.times)
    assert np.max(np.abs(run.velocities["pin"][:, 0] - rate)) < 1e-6
    assert np.max(np.abs(run.energy["dissipated"] - 0.02 * (100.0 - rate**2))) < 1e-6


def test_the_weighted_law_s_work_is_its_springs_energy() -> None:
    """For a turn about one axis the work against the law is the energy that the axis stores."""
    law = Cubic((0.0, 6.0, 1.0, 8.0))
    axes = tuple(AxisSpring(a, (law if a is Z else Linear(5.0),)) for a in (X, Y, Z))
    springs = SpringSet({"pin": JointSprings("pin", axes)}, Joining.WEIGHTED)
    link = body("link", centre=(0.0, -0.2, 0.0))
    run = simulate(
        one_body(BALL, (0.0, 0.0, 0.5), link), Plan(stop=0.5, step=2e-4, springs=springs)
    )
    angle = run.displacements["pin"][:, 2]
    stored = law.energy(angle) - law.energy(angle[0])
    assert np.max(np.abs(run.energy["spring"] - stored)) < 1e-5


def test_without_springs_and_loads_nothing_is_summed() -> None:
    run = simulate(row(2), Plan(stop=0.1, step=1e-3, springs=NONE))
    assert np.all(run.energy["dissipated"] == 0.0)
    assert np.all(run.energy["work"] == 0.0)
    assert np.all(run.energy["spring"] == 0.0)
