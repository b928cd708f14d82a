"""The law of a part: a gradient, smooth where spheres touch, in series with a floor."""

from dataclasses import replace
from math import log1p

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from springs.contact_part import NORM, PartLaw, Series, compression_of, part_forces
from springs.layer import Layer

PELVIS = PartLaw(((0.0, 30e3), (0.03, 71e3)), 1.0)
HEAD = PartLaw(((0.0, 150e3), (0.005, 2e6)), 0.3)
BUTTOCKS = PartLaw(((0.0, 30e3), (0.03, 180e3)), 1.5, within=PELVIS)
SCALED = replace(PELVIS, norm_scale=0.9)

DEPTHS = st.lists(st.floats(-0.02, 0.06), min_size=1, max_size=6).filter(lambda d: max(d) > 1e-4)


def energy(law: PartLaw, depths: np.ndarray) -> float:
    return float(part_forces(law, depths, np.zeros_like(depths)).energy)


@pytest.mark.parametrize("law", [PELVIS, HEAD, BUTTOCKS, SCALED])
@given(depths=DEPTHS)
def test_the_forces_are_the_gradient_of_the_energy(law, depths):
    depths = np.array(depths)
    found = part_forces(law, depths, np.zeros_like(depths)).normal
    step = 1e-6
    slopes = [
        (energy(law, depths + step * e) - energy(law, depths - step * e)) / (2.0 * step)
        for e in np.eye(len(depths))
    ]
    # The curvature jumps nowhere, but is large: a step of 1e-6 m errs by 1e-8 of 2e6 N/m at most.
    assert found == pytest.approx(slopes, rel=1e-7, abs=1e-7 * max(1.0, np.max(found)) + 2e-3)


def test_a_further_sphere_touches_smoothly():
    """Second differences of the force converge where a second sphere touches."""
    times = np.linspace(-4e-4, 4e-4, 9)
    depths = np.stack([np.full_like(times, 0.02), times], axis=-1)
    force = part_forces(PELVIS, depths, np.zeros_like(depths)).normal
    bends = np.diff(force, n=2, axis=0) / 1e-4**2
    assert np.max(np.abs(bends)) < 1e-3 * 30e3 / 0.02


@given(depth=st.floats(2e-3, 0.02), count=st.integers(1, 7))
def test_equal_spheres_together_are_a_little_stiffer_than_one(depth, count):
    law, share = PartLaw(((0.0, 30e3),), 0.7), count ** (1.0 / NORM)
    found = part_forces(law, np.full(count, depth), np.full(count, 0.4))
    assert found.compression == pytest.approx(share * depth)
    assert np.sum(found.elastic) == pytest.approx(share * law.elastic_force(share * depth))
    assert np.sum(found.normal) == pytest.approx((1.0 + 0.28 * share) * np.sum(found.elastic))


@given(depth=st.floats(2e-3, 0.1), rate=st.floats(-1.0, 3.0), count=st.integers(1, 9))
def test_a_scaled_norm_has_the_law_in_the_reference_pose(depth, rate, count):
    """Together, n spheres at one depth and rate have the force of a single one."""
    law = replace(PELVIS, norm_scale=count ** (-1.0 / NORM))
    found = part_forces(law, np.full(count, depth), np.full(count, rate))
    alone = part_forces(PELVIS, np.array([depth]), np.array([rate]))
    assert found.compression == pytest.approx(depth)
    # Where damping takes all of the force away, what rounding leaves is relative to that.
    rounding = 1e-14 * float(alone.elastic[0])
    assert np.sum(found.normal) == pytest.approx(float(alone.normal[0]), abs=rounding)
    assert found.energy == pytest.approx(float(alone.energy))


def test_compression_without_any_touch_is_zero():
    depth, weights = compression_of(np.array([[-0.1, -0.2], [0.0, 0.0]]))
    assert depth.tolist() == [0.0, 0.0]
    assert not weights.any()


FLOORS = [
    *(Layer(((0.0, k),)) for k in (400e3, 95e3, 67e3, 59e3)),
    Layer(((0.0, 59e3), (0.08, 1e6))),
    Layer(((0.0, 150e3),), thickness=0.028),
    Layer(((0.0, 20e3), (0.01, 60e3)), thickness=0.03),
]
COVER = Layer(((0.0, 100e3), (0.006, 300e3)), thickness=0.012)


def elastic(law, depth):
    return float(law.elastic_force(depth))


@pytest.mark.parametrize("cover", [None, COVER])
@pytest.mark.parametrize("floor", [None, *FLOORS])
def test_layers_in_series_have_the_common_force(floor, cover):
    """The closed form against the equilibrium of all, beyond the transitions: compressions add."""
    part = PartLaw(PELVIS.stages, 1.0, cover=cover)
    made = part.on(floor)
    layers = [each for each in (cover, floor) if each is not None]
    if not layers:
        assert made is part
        return

    def whole_less(own, whole):
        force = elastic(PELVIS, own)
        return own + sum(float(layer.compression(force)) for layer in layers) - whole

    for whole in np.linspace(0.012, 0.15, 60):
        own = brentq(whole_less, 0.0, whole, (whole,))
        assert elastic(made, whole) == pytest.approx(elastic(PELVIS, own), rel=0.01)
        split = Series(part, floor).split(np.array(whole))
        assert sum(split) == pytest.approx(whole)
        assert float(split.part) == pytest.approx(own, abs=0.003)
        force = elastic(made, whole)
        for layer, found in ((cover, split.cover), (floor, split.floor)):
            expected = 0.0 if layer is None else float(layer.compression(force))
            assert float(found) == pytest.approx(expected)


@pytest.mark.parametrize("layer", [*FLOORS, COVER])
def test_a_layer_is_as_stiff_as_its_stages_up_to_its_thickness(layer):
    forces = np.linspace(0.0, 2e4, 2001)
    depths = layer.compression(forces)
    assert depths[0] == 0.0
    assert np.all(np.diff(depths) >= 0.0)
    assert np.max(depths) <= layer.thickness
    is_through = forces >= layer.limit
    assert depths[is_through] == pytest.approx(layer.thickness)
    slopes = np.diff(depths) / np.diff(forces)
    middles = 0.5 * (depths[1:] + depths[:-1])
    for (begin, k), end in zip(
        layer.stages, [*(x for x, _ in layer.stages[1:]), layer.thickness], strict=True
    ):
        inside = (middles > begin + 1e-3) & (middles < end - 1e-3)
        assert slopes[inside] == pytest.approx(1.0 / k)


def test_layers_split_and_merge_in_any_order():
    """A floor in front of a cover is as a cover in front of a floor."""
    one = PartLaw(PELVIS.stages, 1.0, cover=COVER).on(FLOORS[0])
    other = PartLaw(PELVIS.stages, 1.0, cover=FLOORS[0]).on(COVER)
    assert one.damping == pytest.approx(other.damping)
    assert np.array(one.stages) == pytest.approx(np.array(other.stages))
    assert one.on(None) is one


def test_a_part_on_a_hard_floor_loses_as_much_as_the_damping_of_its_own_rate():
    """Two springs of one stiffness: half of the rate is the part's."""
    part = PartLaw(((0.0, 60e3),), 0.8)
    assert part.on(Layer(((0.0, 60e3),))).damping == pytest.approx(0.4)


@pytest.mark.parametrize(
    ("stages", "thickness", "message"),
    [
        ((), 0.1, "begin at 0"),
        (((0.0, 1e4), (0.01, 0.0)), 0.1, "stiffness of a stage"),
        (((0.0, 1e4), (0.01, 2e4)), 0.01, "thickness must be above"),
    ],
)
def test_impossible_layers_are_refused(stages, thickness, message):
    with pytest.raises(ValueError, match=message):
        Layer(stages, thickness)


@pytest.mark.parametrize("floor", [None, *FLOORS])
@given(depth=st.floats(-0.01, 0.1))
def test_a_region_adds_what_it_has_more_than_its_part(floor, depth):
    whole = PartLaw(BUTTOCKS.stages).on(floor)
    added = BUTTOCKS.on(floor).elastic_force(depth)
    assert PELVIS.on(floor).elastic_force(depth) + added == pytest.approx(
        whole.elastic_force(depth), abs=1e-9
    )
    assert added >= -1e-9
    if depth < 0.03:
        assert added == 0.0
    assert BUTTOCKS.scaled(2.0).elastic_force(depth) == pytest.approx(
        2.0 * BUTTOCKS.elastic_force(depth)
    )


@pytest.mark.parametrize(
    ("cover", "floor"),
    [
        (None, Layer(((0.0, 57e3),), 0.015)),
        (Layer(((0.0, 100e3),), 0.009), Layer(((0.0, 30e3),), 0.03)),
    ],
)
def test_bends_at_one_force_are_one(cover, floor):
    """Rounding makes two of them; the pelvis bends at 855 N."""
    law = replace(PELVIS, cover=cover).on(floor)
    depths = np.array([x for x, _ in law.stages])
    assert np.min(np.diff(depths)) > 1e-6
    assert law.stages[-1][1] == pytest.approx(71e3)


@pytest.mark.parametrize("spheres", [1, 3])
@pytest.mark.parametrize("speed", [0.5, 1.0, 3.0])
def test_restitution_is_that_of_the_closed_form(spheres, speed):
    """a v - log(1 + a v) + a r v + log(1 - a r v) = 0, whatever the stages and the spheres."""
    mass, law = 12.0, PartLaw(PELVIS.stages, 0.8)

    def fall(_, state):
        depths = np.full(spheres, state[0])
        return [
            state[1],
            -np.sum(part_forces(law, depths, np.full(spheres, state[1])).normal) / mass,
        ]

    def leaves(t, state):
        return state[0] - 1e-9

    leaves.terminal, leaves.direction = True, -1
    run = solve_ivp(fall, (0.0, 1.0), [2e-9, speed], events=leaves, rtol=1e-9, atol=1e-12)
    a = law.damping * spheres ** (1.0 / NORM)  # D' is so much more than the rate of a sphere
    r = brentq(
        lambda r: a * speed - log1p(a * speed) + a * r * speed + log1p(-a * r * speed),
        1e-6,
        min(1.0, 1.0 / (a * speed)) - 1e-12,
    )
    assert -run.y[1, -1] / speed == pytest.approx(r, rel=1e-4)


@pytest.mark.parametrize(
    ("stages", "more", "message"),
    [
        ((), {}, "begin at 0"),
        (((0.01, 1e4),), {}, "begin at 0"),
        (((0.0, 1e4), (0.0, 2e4)), {}, "follow each other"),
        (((0.0, -1e4),), {}, "stiffness of a stage"),
        (((0.0, 1e4),), {"damping": -1.0}, "damping"),
        (((0.0, 1e4),), {"norm_scale": 0.0}, "scale of the norm"),
        (((0.0, 1e4),), {"norm_scale": 1.1}, "scale of the norm"),
    ],
)
def test_impossible_laws_are_refused(stages, more, message):
    with pytest.raises(ValueError, match=message):
        PartLaw(stages, **more)


@pytest.mark.parametrize(
    ("speed", "gravities", "force"),
    [(2.02, 116.0, 5.2e3), (3.56, 227.0, 10.1e3), (5.0, 340.0, 15.1e3), (7.41, 552.0, 24.6e3)],
)
def test_a_single_head_of_a_dummy_s_mass_has_its_peaks(speed, gravities, force):
    """Of 4.54 kg; standing falls of dummies have 146 to 502 g and 3.9 to 24.5 kN at these speeds.

    The peaks were computed beforehand, by another integration (Hajiaghamemar et al. 2015 measured).
    """
    mass = 4.54

    def fall(_, state):
        normal = part_forces(HEAD, state[:1], state[1:]).normal[0]
        return [state[1], 9.81 - normal / mass]

    run = solve_ivp(fall, (0.0, 0.02), [0.0, speed], rtol=1e-9, atol=1e-12)
    peak = np.max(part_forces(HEAD, run.y[:1].T, run.y[1:].T).normal)
    assert peak == pytest.approx(force, rel=0.05)
    assert peak / (mass * 9.81) == pytest.approx(gravities, rel=0.05)
