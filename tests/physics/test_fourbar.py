"""A closed loop against its one equation of motion, integrated independently."""

from dataclasses import replace

import numpy as np
import pytest

from generator import read_figure
from generator.simulation.plan import Plan
from generator.simulation.run import simulate
from springs import SpringSet
from tests.runs import energy_error, integrate_angle

FOURBAR = read_figure("fourbar")
NONE = SpringSet()
START_RATE = 16.0

CRANK, COUPLER, ROCKER = 0.2, 0.3, 0.4
PIVOT = np.array([0.2, 0.3])
LINKS = (
    # mass, moment of inertia about z at the centre, distance of the centre from the near end
    (0.6, 0.00208, 0.10),
    (0.9, 0.00687, 0.15),
    (1.2, 0.01616, 0.20),
)


def direction(angle: float) -> np.ndarray:
    return np.array([np.cos(angle), np.sin(angle)])


def normal(angle: float) -> np.ndarray:
    return np.array([-np.sin(angle), np.cos(angle)])


def coupler_and_rocker(crank: float) -> tuple[float, float]:
    """Angles of coupler and rocker to the x axis, on the branch in which the linkage starts.

    The law of cosines in the triangle of crank pin, rocker pivot and rocker pin.
    """
    pin = CRANK * direction(crank)
    to_pivot = PIVOT - pin
    distance = np.hypot(*to_pivot)
    cosine = (COUPLER**2 + distance**2 - ROCKER**2) / (2.0 * COUPLER * distance)
    coupler = np.arctan2(to_pivot[1], to_pivot[0]) + np.arccos(cosine)
    end = pin + COUPLER * direction(coupler)
    return float(coupler), float(np.arctan2(*(end - PIVOT)[::-1]))


def slopes(crank: float) -> tuple[np.ndarray, np.ndarray]:
    """d(angles)/d(crank) and the slope of that: the loop's equation, differentiated twice."""
    coupler, rocker = coupler_and_rocker(crank)
    lengths, angles = np.array([CRANK, COUPLER, -ROCKER]), np.array([crank, coupler, rocker])
    matrix = np.stack([lengths[k] * normal(angles[k]) for k in (1, 2)], axis=1)
    first = np.linalg.solve(matrix, -lengths[0] * normal(crank))
    rates = np.array([1.0, *first])
    turning = sum(lengths[k] * direction(angles[k]) * rates[k] ** 2 for k in range(3))
    second = np.linalg.solve(matrix, turning)
    return rates, np.array([0.0, *second])


def acceleration(crank: float, rate: float) -> float:
    """Lagrange's equation of one freedom: m(q) q'' + m'(q)/2 q'^2 + dV/dq = 0."""
    angles = np.array([crank, *coupler_and_rocker(crank)])
    first, second = slopes(crank)
    roots = [(np.zeros(2), np.zeros(2)), (CRANK * normal(crank), -CRANK * direction(crank))]
    roots.append((np.zeros(2), np.zeros(2)))
    inertia = change = weight = 0.0
    for k, (mass, moment, centre) in enumerate(LINKS):
        # Slope of the link's centre with the crank angle, and the slope of that.
        speed = roots[k][0] + centre * normal(angles[k]) * first[k]
        bend = roots[k][1] + centre * (
            normal(angles[k]) * second[k] - direction(angles[k]) * first[k] ** 2
        )
        inertia += mass * speed @ speed + moment * first[k] ** 2
        change += mass * speed @ bend + moment * first[k] * second[k]
        weight += mass * 9.81 * speed[1]
    return -(change * rate**2 + weight) / inertia


@pytest.mark.parametrize("rate", [0.0, START_RATE])
def test_the_four_bar_linkage(rate) -> None:
    """All angles within 1e-6 rad over 1 s at the tolerance 1e-6; pushed, the crank goes round."""
    plan = Plan(stop=1.0, tolerance=1e-6, springs=NONE, velocities={"crank_bearing": (rate,)})
    run = simulate(FOURBAR, plan)
    assert run.outcome.succeeded
    crank, speed = integrate_angle(acceleration, np.pi, rate, run.times)
    if rate:
        assert crank[-1] - crank[0] > 2.0 * np.pi
    others = np.array([coupler_and_rocker(angle) for angle in crank]).T
    coupler, rocker = np.unwrap(others)
    assert np.max(np.abs(run.displacements["crank_bearing"][:, 0] - crank)) < 1e-6
    assert np.max(np.abs(run.velocities["crank_bearing"][:, 0] - speed)) < 1e-4
    for joint, angle in (
        ("crank_pin", coupler - crank),
        ("rocker_bearing", rocker),
        ("rocker_pin", rocker - coupler),
    ):
        found = run.displacements[joint][:, 0]
        whole = 2.0 * np.pi * np.round((found[0] - angle[0]) / (2.0 * np.pi))
        assert np.max(np.abs(found - angle - whole)) < 1e-6
    assert run.constraint_drift < 1e-5
    assert energy_error(run) < 1e-4 * max(np.ptp(run.energy["gravity"]), 1e-3)


def test_the_order_in_connect_and_in_the_file_does_not_matter() -> None:
    """Parent and child of every joint exchanged, segments and joints listed backwards."""
    joints = {
        name: replace(
            j,
            parent=j.child,
            child=j.parent,
            displacement=tuple(-d for d in j.displacement),
        )
        for name, j in reversed(FOURBAR.joints.items())
    }
    turned = replace(FOURBAR, joints=joints, segments=dict(reversed(FOURBAR.segments.items())))
    runs = [
        simulate(
            figure,
            Plan(
                stop=0.5,
                tolerance=1e-6,
                springs=NONE,
                velocities={"crank_bearing": (sign * START_RATE,)},
            ),
        )
        for figure, sign in ((FOURBAR, 1.0), (turned, -1.0))
    ]
    for name in FOURBAR.joints:
        there, back = (run.displacements[name] for run in runs)
        assert np.max(np.abs(there + back)) < 2e-6
    for name in FOURBAR.segments:
        assert np.allclose(runs[0].poses[name], runs[1].poses[name], atol=2e-6)
    for name in FOURBAR.joints:
        # The reaction on the one is the opposite of that on the other, in the other's axes.
        sizes = [np.linalg.norm(run.reactions[name][:, :3], axis=1) for run in runs]
        assert np.allclose(sizes[0], sizes[1], rtol=1e-4, atol=1e-3)


def test_a_start_at_a_dead_point() -> None:
    """Coupler and crank in line: the rows of the loop depend on each other for that moment."""
    # The distance from the crank's to the rocker's pivot is shorter than the crank and coupler in
    # line, so the triangle of the three lengths closes.
    span = np.hypot(*PIVOT)
    reach = CRANK + COUPLER
    cosine = (reach**2 + span**2 - ROCKER**2) / (2.0 * reach * span)
    crank = np.arctan2(PIVOT[1], PIVOT[0]) + np.arccos(cosine)
    end = reach * direction(crank)
    rocker = np.arctan2(*(end - PIVOT)[::-1])
    plan = Plan(
        stop=0.5,
        tolerance=1e-5,
        springs=NONE,
        displacements={
            "crank_bearing": (crank,),
            "crank_pin": (0.0,),
            "rocker_bearing": (rocker,),
        },
        velocities={"crank_bearing": (START_RATE,)},
    )
    run = simulate(FOURBAR, plan)
    assert run.outcome.succeeded
    angle, _ = integrate_angle(acceleration, crank, START_RATE, run.times)
    assert np.max(np.abs(run.displacements["crank_bearing"][:, 0] - angle)) < 1e-5
