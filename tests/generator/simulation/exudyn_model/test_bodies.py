"""Forces and moments at sites: what they do, when, and the work that they do."""

from dataclasses import replace

import numpy as np
import pytest

from generator.figure import Site, SiteRef
from generator.loads import LoadKind, TimedLoad, constant_load
from generator.simulation.plan import Plan
from generator.simulation.run import simulate
from generator.simulation.run_model import constant_site_loads
from springs import SpringSet
from tests.chains import FREE, at, body, chain, free_body, one_body
from tests.runs import energy_error

NONE = SpringSet()
STILL = (0.0, 0.0, 0.0)


def link(**loads):
    """A body with a turned site `hand` off its centre that carries the loads."""
    hand = Site("hand", at((0.4, -0.7, 0.3), (0.3, 0.1, -0.2)), **loads)
    return body("link", centre=(0.0, 0.0, 0.0), sites={"hand": hand})


def started(segment, rotation=(0.5, -0.4, 0.8), loads=()):
    """Acceleration of a free body in its first moment: of the centre, and angular (world)."""
    figure = one_body(FREE, (*rotation, 0.0, 0.0, 0.0), segment)
    span = 2e-3
    plan = Plan(stop=span, step=1e-5, frame=span, gravity=STILL, springs=NONE, loads=loads)
    run = simulate(figure, plan)
    linear = 2.0 * run.centre_of_mass[-1] / span**2
    moved = run.poses["link"][-1, :3, :3] @ run.poses["link"][0, :3, :3].T
    grown = [moved[2, 1] - moved[1, 2], moved[0, 2] - moved[2, 0], moved[1, 0] - moved[0, 1]]
    start = run.poses["link"][0, :3, :3]
    return linear, np.array(grown) / span**2, start


@pytest.mark.parametrize("field", ["global_force", "local_force", "global_moment", "local_moment"])
def test_loads_of_the_figure_act_at_their_site(field) -> None:
    """Local means the segment's axes, not the site's; a force off the centre turns the body."""
    value = np.array([3.0, -2.0, 1.0])
    segment = link(**{field: tuple(value)})
    linear, angular, rotation = started(segment)
    acting = value if field.startswith("global") else rotation @ value
    force = acting if field.endswith("force") else np.zeros(3)
    moment = acting if field.endswith("moment") else np.zeros(3)
    moment = moment + np.cross(rotation @ [0.3, 0.1, -0.2], force)
    inertia = rotation @ np.diag(segment.inertia) @ rotation.T
    assert linear == pytest.approx(force / segment.mass, abs=1e-4)
    assert inertia @ angular == pytest.approx(moment, abs=2e-3)


@pytest.mark.parametrize("kind", list(LoadKind))
def test_timed_loads_are_the_same_loads(kind) -> None:
    field = {
        LoadKind.GLOBAL_FORCE: "global_force",
        LoadKind.LOCAL_FORCE: "local_force",
        LoadKind.GLOBAL_MOMENT: "global_moment",
        LoadKind.LOCAL_MOMENT: "local_moment",
    }[kind]
    value = (3.0, -2.0, 1.0)
    written = one_body(FREE, (0.1, 0.2, 0.3, 0.0, 0.0, 0.0), link(**{field: value}))
    bare = one_body(FREE, (0.1, 0.2, 0.3, 0.0, 0.0, 0.0), link())
    timed = constant_load(SiteRef("link", "hand"), kind, value, -1.0, 2.0)
    runs = [
        simulate(f, Plan(stop=0.5, step=1e-3, springs=NONE, loads=loads))
        for f, loads in ((written, ()), (bare, (timed,)))
    ]
    assert np.allclose(runs[0].poses["link"], runs[1].poses["link"], atol=1e-10)
    assert np.allclose(runs[0].energy["work"], runs[1].energy["work"], atol=1e-9)
    assert abs(runs[0].energy["work"][-1]) > 0.1


@pytest.mark.parametrize("kind", list(LoadKind))
def test_the_work_of_loads_is_in_the_energy_book(kind) -> None:
    """On a spinning body, the work of a constant load balances its energy."""
    load = TimedLoad(
        SiteRef("link", "hand"), kind, (0.1, 0.35, 0.6), ((0, 0, 0), (2.0, -3.0, 1.0), (1.0, 0, 0))
    )
    plan = Plan(
        stop=1.0,
        step=5e-4,
        springs=NONE,
        loads=[load],
        velocities={"pin": (1.0, -2.0, 3.0, 0.5, 0.2, 0.1)},
    )
    run = simulate(one_body(FREE, (0.1, 0.2, 0.3, 0.0, 0.0, 0.0), link()), plan)
    assert np.ptp(run.energy["work"]) > 0.01
    assert energy_error(run) < 1e-4 * np.ptp(run.energy["work"])
    outside = (run.times < 0.1) | (run.times > 0.62)
    assert np.allclose(np.diff(run.energy["work"])[outside[1:] & outside[:-1]], 0.0, atol=1e-12)


@pytest.mark.parametrize(("start", "stop"), [(0.1, 0.7), (0.10037, 0.7), (1.0 / 3.0, 0.61803)])
def test_a_load_that_sets_in_and_stops_at_once(start, stop) -> None:
    """Between steps or on one: the motion is the exact one to 1e-6, at any step."""
    load = TimedLoad(
        SiteRef("link", "near"), LoadKind.GLOBAL_FORCE, (start, stop), ((4, 0, 0), (4, 0, 0))
    )
    figure = one_body(chain("Tx"), segment=body("link", mass=2.0))
    for given in ({"step": 7e-3}, {"step": 1e-3}, {"tolerance": 1e-3}):
        run = simulate(figure, Plan(springs=NONE, loads=[load], **given))
        pushed = np.clip(run.times - start, 0.0, stop - start)
        after = np.clip(run.times - stop, 0.0, None)
        expected = pushed**2 + 2.0 * pushed * after
        assert np.max(np.abs(run.displacements["pin"][:, 0] - expected)) < 1e-6
        assert np.max(np.abs(run.velocities["pin"][:, 0] - 2.0 * pushed)) < 1e-6
        assert run.energy["work"][-1] == pytest.approx(4.0 * (stop - start) ** 2, rel=1e-6)


def test_a_long_table_of_a_force() -> None:
    """A sine in a thousand rows: the momentum is the integral of the table."""
    times = np.linspace(0.0, 1.0, 1001)
    force = np.stack([np.sin(7.0 * times), 0.0 * times, 0.0 * times], axis=1)
    load = TimedLoad(SiteRef("link", "near"), LoadKind.GLOBAL_FORCE, tuple(times), force.tolist())
    figure = one_body(chain("Tx"), segment=body("link", mass=2.0))
    run = simulate(figure, Plan(springs=NONE, loads=[load], step=1e-3))
    expected = (1.0 - np.cos(7.0 * run.times)) / 14.0
    assert np.max(np.abs(run.velocities["pin"][:, 0] - expected)) < 1e-5


def test_loads_on_the_ground_move_nothing() -> None:
    figure = free_body()
    ground = figure.segments["ground"]
    base = replace(ground.sites["base"], global_force=(5.0, 0.0, 0.0))
    loaded = replace(
        figure, segments=figure.segments | {"ground": replace(ground, sites={"base": base})}
    )
    assert constant_site_loads(loaded, 0.0, 1.0) == []
    load = constant_load(SiteRef("ground", "base"), LoadKind.GLOBAL_FORCE, (5.0, 0, 0), 0.0, 1.0)
    run = simulate(loaded, Plan(stop=0.1, step=1e-3, springs=NONE, loads=[load]))
    assert np.allclose(run.energy["work"], 0.0)
