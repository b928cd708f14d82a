"""The energy book with laws over several joints: those with an energy, and those without."""

from dataclasses import replace

import numpy as np
import pytest

from generator import read_figure
from generator.recording import Ending
from generator.simulation.plan import Plan
from generator.simulation.run import simulate
from generator.springs_file.read import read_springs
from springs import CoupledAxis, CoupledSpring, SphericalLaw, SpringSet
from springs.coupled import CoupledExponential, CoupledTerm, nearest_conservative_law
from springs.published import tables as published
from tests.chains import BALL, SKEW, X, Y, chain, negative, row, two_bodies
from tests.runs import energy_error

PROTOTYPE = read_figure("prototype")

PUBLISHED = published.coupled_law("riener_edrich_1999/leg").law.hold_coordinate(
    "ankle dorsiflexion", 0.0
)
NEAREST = nearest_conservative_law(PUBLISHED, ((-0.26, 1.74), (0.0, 2.35))).law
LAWS = {"published": PUBLISHED, "nearest conservative": NEAREST}

BENT = {"left_hip_joint": (0.2, 0.3, 0.5), "right_knee": (0.6,), "waist": (0.1, -0.2, 0.3)}


def legs(law) -> tuple[CoupledSpring, ...]:
    return tuple(
        CoupledSpring(
            law, (CoupledAxis(f"{s}_hip_joint", Y), CoupledAxis(f"{s}_knee", negative(Y)))
        )
        for s in ("left", "right")
    )


def prototype(law, **plan):
    springs = read_springs(None, PROTOTYPE, SphericalLaw.CONSERVATIVE)
    springs = replace(springs, coupled=legs(law))
    return simulate(PROTOTYPE, Plan(springs=springs, displacements=BENT, **plan))


@pytest.mark.parametrize("name", LAWS)
def test_the_book_closes_and_its_error_falls_with_the_square_of_the_step(name) -> None:
    coarse, fine = (prototype(LAWS[name], stop=0.15, step=step) for step in (1e-3, 2.5e-4))
    assert np.ptp(fine.energy["spring"]) > 1.0
    assert energy_error(fine) < 2e-5 * np.ptp(fine.energy["gravity"])
    assert energy_error(fine) < energy_error(coarse) / 8.0


def test_a_conservative_law_s_energy_is_a_function_of_the_pose() -> None:
    """Of the published one, which has none, the book holds the work since the start."""
    runs = [
        simulate(
            PROTOTYPE,
            Plan(stop=0.2, step=1e-3, springs=SpringSet(coupled=legs(law)), displacements=BENT),
        )
        for law in (NEAREST, PUBLISHED)
    ]
    expected = np.zeros(len(runs[0].times))
    for side in ("left", "right"):
        hip = runs[0].rotation_vectors[f"{side}_hip_joint"][:, 1]
        expected += NEAREST.energy((hip, runs[0].displacements[f"{side}_knee"][:, 0]))
    assert np.allclose(runs[0].energy["spring"], expected, atol=1e-9)
    assert abs(expected[0]) > 1.0
    assert runs[1].energy["spring"][0] == 0.0
    assert np.ptp(runs[1].energy["spring"]) > 1.0


STIFF = CoupledExponential(
    ("one", "two"),
    (CoupledTerm((-4.0, -2.0), (2.0, 1.0)), CoupledTerm((4.0, 4.0), (-2.0, -2.0))),
    (0.0, 0.0),
    (None, None),
)


@pytest.mark.parametrize("reverse", [False, True])
@pytest.mark.parametrize("text", ["Rs", "Ra Rs", "Rx Ry Rz"])
def test_energy_is_kept_whatever_the_joints(text, reverse) -> None:
    figure = two_bodies(chain(text), 0.2 * np.ones(len(chain(text))), reverse=reverse)
    springs = SpringSet(
        coupled=(CoupledSpring(STIFF, (CoupledAxis("ball", X), CoupledAxis("tested", SKEW))),)
    )
    assert STIFF.is_conservative
    run = simulate(figure, Plan(stop=0.2, step=2.5e-4, springs=springs))
    assert run.outcome.succeeded
    assert np.ptp(run.energy["spring"]) > 0.5
    assert energy_error(run) < 1e-4 * np.ptp(run.energy["kinetic"])


SOFT = CoupledExponential(
    ("one", "two"), (CoupledTerm((-0.1, -0.1), (0.1, 0.1)),), (0.0, 0.0), (None, None)
)


def soft_springs(axis) -> SpringSet:
    axes = (CoupledAxis("joint0", axis), CoupledAxis("joint1", SKEW))
    return SpringSet(coupled=(CoupledSpring(SOFT, axes),))


def test_a_ball_of_a_coupled_law_ends_its_run_at_half_a_turn() -> None:
    springs = soft_springs(X)
    figure = row(2, (BALL, chain("Rs")))
    run = simulate(figure, Plan(stop=2.0, springs=springs, velocities={"joint0": (20.0, 0.0, 0.0)}))
    assert run.outcome.ending is Ending.TURNED_OVER
    assert run.outcome.joint == "joint0"
    assert np.linalg.norm(run.rotation_vectors["joint0"][-1]) > 2.0


def test_a_hinge_of_a_coupled_law_may_go_round() -> None:
    figure = row(2, (chain("Rs"),))
    plan = Plan(stop=0.6, step=2.5e-4, springs=soft_springs(SKEW), velocities={"joint0": (30.0,)})
    run = simulate(figure, plan)
    assert run.outcome.succeeded
    assert run.displacements["joint0"][-1, 0] > 4.0 * np.pi
    assert np.ptp(run.energy["spring"]) > 1.0
    assert energy_error(run) < 1e-4 * np.ptp(run.energy["kinetic"])
