"""The effective mass of a body in a short blow, against closed forms and an integrated blow."""

import re
from dataclasses import replace

import numpy as np
import pytest

from generator import Plan, effective_mass, read_figure, simulate
from generator.diagnostics import ModelError, MoverError
from generator.figure import SiteRef
from generator.kinematics.effective_mass import head_effective_masses
from generator.kinematics.free_root import detach_root
from generator.kinematics.placement import initial_displacements
from generator.kinematics.tree import build_tree
from generator.loads import LoadKind, TimedLoad
from springs import SpringSet
from tests.chains import BALL, SKEW, body, chain, figure, ground, joint, row

MASS, INERTIA, CENTRE = 2.0, (0.03, 0.04, 0.05), (0.05, -0.1, 0.2)


def test_a_free_body_has_that_of_its_mass_and_its_turn() -> None:
    """1 / m_e = 1 / m + (r x n) . I^-1 (r x n)."""
    one = figure([ground(), body("link")], [joint("pin", "ground.base", "link.near", BALL)])
    rng = np.random.default_rng(1)
    for _ in range(5):
        point, direction = rng.normal(size=3), rng.normal(size=3)
        arm = np.cross(point - np.array(CENTRE), direction / np.linalg.norm(direction))
        expected = 1.0 / (1.0 / MASS + float(arm @ (arm / np.array(INERTIA))))
        found = effective_mass(
            one, "link", tuple(point), tuple(direction), {"pin": rng.normal(size=3)}
        )
        assert found == pytest.approx(expected, rel=1e-12)
    assert effective_mass(one, "link", CENTRE, (1, 2, 3)) == pytest.approx(MASS, rel=1e-12)


def test_two_bodies_on_a_slide_are_one_across_it() -> None:
    """Along the slide each is alone; the pair moves as one body through its centre of mass."""
    pair = figure(
        [ground(), body("first", centre=(0, 0, 0)), body("second", centre=(0, 0, 0))],
        [
            joint("pin", "ground.base", "first.near", BALL),
            joint("slide", "first.near", "second.near", chain("Rx Ry Rz Tz")),
        ],
    )
    along, across = (
        effective_mass(pair, "second", (0, 0, 0), axis) for axis in ((0, 0, 1), (1, 0, 0))
    )
    assert along == pytest.approx(MASS, rel=1e-12)
    assert across == pytest.approx(2.0 * MASS, rel=1e-12)


def test_a_short_blow_moves_the_point_by_impulse_over_mass() -> None:
    """The speed along the blow after an integrated force of 1 us on a chain of three bodies."""
    made = row(3, (chain("Rz"), BALL, chain("Rx Ty")))
    place, direction = SiteRef("bar2", "far"), np.array(SKEW)
    point = made.site(place).pose_in_segment[:3, 3]
    freed, moved = detach_root(made, initial_displacements(build_tree(made)))
    assert set(moved) == set(freed.joints)
    duration, force = 1e-6, 100.0
    load = TimedLoad(
        place, LoadKind.LOCAL_FORCE, (0.0, duration), ((force * direction).tolist(),) * 2
    )
    run = simulate(
        made,
        Plan(
            stop=2.0 * duration,
            frame=duration,
            free_root=True,
            gravity=(0.0, 0.0, 0.0),
            loads=(load,),
            springs=SpringSet(),
        ),
    )
    work = run.energy["kinetic"][-1]
    expected = effective_mass(made, "bar2", point, direction)
    assert (force * duration) ** 2 / (2.0 * work) == pytest.approx(expected, rel=1e-3)


def test_the_head_of_a_figure_without_masses_or_head_has_none() -> None:
    whole = read_figure("male50")
    assert set(head_effective_masses(whole)) == {"crown", "front_or_back", "side"}
    bare = whole.with_parts(replace(whole.segments["head"], mass=None))
    assert head_effective_masses(bare) == {}
    assert head_effective_masses(read_figure("pendulum")) == {}


def test_what_does_not_move_has_none() -> None:
    with pytest.raises(ModelError, match="`ground` does not move"):
        effective_mass(row(1, (BALL,)), "ground", (0, 0, 0), (1, 0, 0))
    light = row(1, (BALL,))
    light = light.with_parts(replace(light.segments["bar0"], inertia=None))
    with pytest.raises(ModelError, match="`bar0` lacks mass"):
        effective_mass(light, "bar0", (0, 0, 0), (1, 0, 0))


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"displacements": {"pin": (1.0, 2.0)}}, "joint pin has 3 displacements, not 2"),
        ({"displacements": {"pin": (1.0, 2.0, np.nan)}}, "a value for joint pin is not finite"),
        ({"displacements": {"pin": "bent"}}, "the values for joint pin are not numbers: 'bent'"),
        ({"displacements": {"pni": (0.0,)}}, "no joint `pni`; did you mean `pin`"),
        ({"point": (1.0, 2.0)}, "the point of a blow has three finite numbers"),
        ({"direction": (1.0, np.inf, 0.0)}, "the direction of a blow has three finite numbers"),
        ({"direction": (0, 0, 0)}, "the direction of a blow is not zero"),
    ],
)
def test_a_blow_that_does_not_fit_is_refused_in_a_sentence(
    changes: dict[str, object], said: str
) -> None:
    one = figure([ground(), body("link")], [joint("pin", "ground.base", "link.near", BALL)])
    with pytest.raises(MoverError, match=re.escape(said)):
        effective_mass(one, "link", **{"point": CENTRE, "direction": (1, 0, 0), **changes})
