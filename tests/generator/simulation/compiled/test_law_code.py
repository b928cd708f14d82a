"""The generated code of laws against the laws themselves; all laws of `springs` by their table."""

from dataclasses import fields, is_dataclass, replace
from functools import partial

import numpy as np
import pytest
from hypothesis import assume, example, given
from hypothesis import strategies as st

from generator.simulation.compiled.law_code import (
    build_law_tables,
    coupled_law,
    displacement_law,
    rotation_vector_law,
)
from generator.simulation.compiled.recorder import BranchingLawError
from generator.springs_file.laws import LAWS
from springs import (
    NUMPY,
    AxisSpring,
    CoupledAxis,
    CoupledSpring,
    Cubic,
    Damping,
    JointSprings,
    Linear,
    SphericalLaw,
    Stop,
    group_torque,
    rotation_law,
    total_torque,
)
from springs.coupled import CoupledExponential, CoupledTerm
from springs.elastic import Elastic
from springs.exponential import Exponential, ExponentialTerm
from springs.hysteresis import Hysteresis
from springs.interpolated import Interpolated
from springs.smooth_limit import SmoothLimit
from springs.spherical import VectorLaw
from springs.transformed import Transformed
from tests.chains import ACROSS, SKEW, X, Y, Z, negative
from tests.compiled_models import SEQUENTIAL, Evaluation, evaluate, plain_tables, source_of
from tests.laws import EXCESSES, RESISTING, STRATEGIES, limits

ANGLE, RATE = st.floats(-2.5, 2.5), st.floats(-2.0, 2.0)
DAMPING = st.builds(
    Damping, st.floats(0.0, 5.0), st.just(0.0) | st.floats(0.1, 5.0), st.floats(1e-3, 1.0)
)
ANY_LAW = st.one_of(*(STRATEGIES[row.law] for row in LAWS))
THIRD = tuple(np.cross(SKEW, ACROSS).tolist())
FRAMES = st.sampled_from([(X, Y, Z), (SKEW, ACROSS, THIRD), (Y, negative(SKEW))])
ROTATION = st.tuples(*[st.floats(-1.7, 1.7)] * 3)

CLASSES = [row.law for row in LAWS]
every_law = pytest.mark.parametrize("law_class", CLASSES, ids=lambda c: c.__name__)


def is_close(found: Evaluation, torques, row=0) -> bool:
    """Return whether torques are equal; near a breakpoint, to the rounding of its place."""
    expected = np.zeros(3)
    expected[: np.size(torques)] = torques
    if np.min(np.abs(found.switching), initial=np.inf) > 1e-12:
        return np.array_equal(found.torques[row], expected)
    return np.allclose(found.torques[row], expected, rtol=1e-6, atol=1e-6)


@every_law
@given(data=st.data(), x=ANGLE, v=RATE, damping=DAMPING)
def test_one_angle_has_the_torque_of_its_law(law_class, data, x, v, damping):
    spring = AxisSpring(Z, (data.draw(STRATEGIES[law_class]),), damping)
    elastic = total_torque(spring.elastic, x, SEQUENTIAL)
    viscous = spring.resistance(x, v, SEQUENTIAL)
    found = evaluate(plain_tables([displacement_law(spring, (0, 0))]), [x, 0, 0], [v, 0, 0])
    assert is_close(found, elastic + viscous)
    assert found.powers[0] == pytest.approx(-viscous * v, rel=1e-6, abs=1e-6)
    assert not found.powers[1:].any()


@given(RESISTING, EXCESSES)
@example(Stop(0.0, 0.0, 1776.3, 0.076), 1.7e-65)
@example(Stop(0.0, 0.0, 217.9375, 0.01), 1e-12)
def test_no_compiled_law_drives_out_of_its_limits(law, excess):
    tables = plain_tables([displacement_law(AxisSpring(Z, (law,)), (0, 0))])
    lower, upper = limits(law)
    below, above = np.nextafter(lower - excess, -3.0), np.nextafter(upper + excess, 3.0)
    assert evaluate(tables, [below, 0, 0], [0, 0, 0]).torques[0, 0] >= 0.0
    assert evaluate(tables, [above, 0, 0], [0, 0, 0]).torques[0, 0] <= 0.0


@pytest.mark.parametrize("law", SphericalLaw)
@given(data=st.data(), directions=FRAMES, r=ROTATION, v=ROTATION)
def test_several_angles_have_the_torque_of_their_joined_laws(law, data, directions, r, v):
    axes = [
        AxisSpring(direction, (data.draw(ANY_LAW), data.draw(ANY_LAW))[: 1 + k], data.draw(DAMPING))
        for k, direction in enumerate(directions)
    ]
    r, v = np.array(r), np.array(v)
    made = rotation_law(JointSprings("ball", tuple(axes)), law, directions)
    elastic, viscous = made.torque(r, SEQUENTIAL), made.damping(r, v, SEQUENTIAL)
    found = evaluate(plain_tables([rotation_vector_law(made, 0)]), r, v)
    assert is_close(found, elastic + viscous)
    scale = 1.0 + np.sum(np.abs(viscous)) + np.sum(np.abs(elastic))
    spring_power = -elastic @ v if law is SphericalLaw.WEIGHTED else 0.0
    assert found.powers[:2] == pytest.approx([-viscous @ v, spring_power], abs=1e-6 * scale)
    assert not found.powers[2:].any()


def dead_zone_edges(law: Elastic) -> tuple[float, ...]:
    """The edges of the dead zones of cubics, also within other laws."""
    parts = [getattr(law, each.name) for each in fields(law)] if is_dataclass(law) else []
    match law:
        case Cubic():
            return law.breakpoints
        case Transformed():
            inner = [part for part in parts if hasattr(part, "breakpoints")]
            return law.breakpoints if any(map(dead_zone_edges, inner)) else ()
        case Hysteresis():
            inner = [part for part in parts if hasattr(part, "breakpoints")]
            return tuple(edge for part in inner for edge in dead_zone_edges(part))
        case _:
            return ()


@every_law
@given(data=st.data())
def test_switching_functions_are_zero_at_the_breakpoints_and_nowhere_else(law_class, data):
    law: Elastic = data.draw(STRATEGIES[law_class])
    tables = plain_tables([displacement_law(AxisSpring(Z, (law,)), (0, 0))])

    def functions(x: float) -> np.ndarray:
        return evaluate(tables, [x, 0.0, 0.0], [0.5, 0.0, 0.0]).switching

    at_zero, at_one = functions(0.0), functions(1.0)
    zeros = at_zero / (at_zero - at_one)  # those of the laws are linear
    assert functions(0.37) == pytest.approx(at_zero + 0.37 * (at_one - at_zero), abs=1e-9)
    # Only where the slope jumps: the other breakpoints are chosen by the value.
    expected = np.array(dead_zone_edges(law))
    gaps = np.abs(zeros[:, None] - expected[None, :])
    assert gaps.size or zeros.size == expected.size == 0
    assert np.all(np.min(gaps, axis=0, initial=np.inf) < 1e-9)
    assert np.all(np.min(gaps, axis=1, initial=np.inf) < 1e-9)


def rescaled(value, factor: float):
    """The same law with every number multiplied; the form stays."""
    if isinstance(value, float):
        return value * factor
    if isinstance(value, tuple):
        return tuple(rescaled(part, factor) for part in value)
    if is_dataclass(value):
        changed = {each.name: rescaled(getattr(value, each.name), factor) for each in fields(value)}
        return replace(value, **changed)
    return value


@every_law
@given(data=st.data(), factor=st.floats(1.01, 1.5))
def test_other_coefficients_have_the_same_code(law_class, data, factor):
    spring = AxisSpring(Z, (data.draw(STRATEGIES[law_class]),), Damping(0.3, 0.2))
    other = rescaled(spring, factor)
    assume(other != spring)

    def about_axis(one: AxisSpring, joint: int):
        return rotation_vector_law(
            VectorLaw((replace(one, direction=SKEW),), is_weighted=True), joint
        )

    for record in (lambda one, joint: displacement_law(one, (joint, joint)), about_axis):
        one, two = (record(each, row) for row, each in enumerate((spring, other)))
        assert one.form == two.form
        assert one.constants != two.constants
        assert source_of([one]) == source_of([one, two, two])


def test_a_law_that_branches_is_refused_with_its_name():
    class Sudden(Linear):
        def torque(self, angle, ops=NUMPY):
            return -angle if angle > 0.1 else 0.0 * angle

    spring = AxisSpring(Z, (Linear(1.0), Sudden(1.0)))
    for record in (
        partial(displacement_law, spring, (0, 0)),
        partial(rotation_vector_law, VectorLaw((spring,), is_weighted=True), 0),
    ):
        with pytest.raises(BranchingLawError, match="Linear, Sudden cannot be compiled: a law dec"):
            record()


def test_equal_laws_are_recorded_once_but_for_those_that_can_change():
    class Own:
        stiffness = 1.0
        breakpoints = ()

        def torque(self, angle, ops=NUMPY):
            return -self.stiffness * angle

    def recorded(law):
        return displacement_law(AxisSpring(Z, (law,)), (0, 0))

    assert recorded(Linear(30.0)) is recorded(Linear(30.0))
    assert recorded(Linear(30.0)) != recorded(Linear(31.0))
    own = Own()
    for law in (own, Transformed(own, 2.0)):
        before = recorded(law)
        own.stiffness += 1.0
        assert recorded(law).constants != before.constants


# Coupled laws

COUPLED = CoupledExponential(
    ("one", "two", "three"),
    (
        CoupledTerm((1.5, -0.5, 2.0), (0.6, -0.4, 0.3), 0.1),
        CoupledTerm((0.0, -2.0, 0.4), (-0.8, 0.5, 0.0), -0.2, 0.1),
    ),
    (0.4, -0.3, 0.8),
    (None, None, None),
)
GRADIENT = CoupledExponential(
    ("one", "two", "three"),
    (CoupledTerm((-1.2, 0.8, -0.6), (0.6, -0.4, 0.3), 0.1, 0.3),),
    (0.4, -0.3, 0.8),
    (None, None, None),
)


@pytest.mark.parametrize("law", [COUPLED, GRADIENT])
@given(r=ROTATION, angle=ANGLE, v=ROTATION)
def test_a_coupled_law_of_a_ball_and_a_hinge_adds_to_their_own(law, r, angle, v):
    places = (("ball", ACROSS), ("hinge", negative(SKEW)), ("ball", Y))
    axes = tuple(CoupledAxis(*place) for place in places)
    spring, own = CoupledSpring(law, axes), AxisSpring(SKEW, (Linear(3.0, 0.2),), Damping(0.5))
    uses = [
        rotation_vector_law(VectorLaw((own,)), 0),
        displacement_law(own, (1, 0)),
        coupled_law(spring, (None, ((1, 0), -1.0), None), (("ball", 0, VectorLaw((own,))),)),
    ]
    found = evaluate(plain_tables(uses), [r, (angle, 0, 0)], [v, (v[0], 0, 0)])
    r, v = np.array(r), np.array(v)
    along = [float(np.dot(ACROSS, r)), -angle, float(np.dot(Y, r))]
    first, second, third = law.torques(along)
    ball = group_torque(first * np.array(ACROSS) + third * np.array(Y), r)
    own_law = VectorLaw((own,))
    own_ball = own_law.torque(r) + own_law.damping(r, v)
    own_hinge = total_torque(own.elastic, angle) + own.resistance(angle, v[0])
    scale = 1.0 + np.max(np.abs([first, second, third]))
    assert found.torques[0] == pytest.approx(ball + own_ball, rel=1e-12, abs=1e-12 * scale)
    assert found.torques[1, 0] == pytest.approx(own_hinge - second, rel=1e-12, abs=1e-12 * scale)
    power = 0.0 if law.is_conservative else -(ball @ v - second * v[0])
    assert found.powers[1] == pytest.approx(power, rel=1e-12, abs=1e-12 * scale)


# Compiled

EXAMPLES = {
    Cubic: Cubic((1.0, -8.0, 3.0, 20.0), -1, (-0.4, 0.5), 0.1),
    Linear: Linear(30.0, 0.2),
    Exponential: Exponential((ExponentialTerm(2.0, -3.0, -0.3), ExponentialTerm(-1.5, 2.5)), 0.3),
    Interpolated: Interpolated(((-1.0, 8.0), (-0.2, 1.0), (0.5, -2.0), (1.1, -9.0))),
    SmoothLimit: SmoothLimit(-0.5, 0.7, 40.0, 60.0, 0.4),
    Stop: Stop(-0.6, 0.8, 300.0, 0.1),
    Transformed: Transformed(Stop(-0.6, None, 200.0, 0.2), 1.5, 0.2, -0.4),
    Hysteresis: Hysteresis.from_mean_and_width(Cubic((0.0, 5.0, 0.0, 9.0)), 4.0, 0.2),
}


@pytest.mark.slow
@pytest.mark.parametrize("law", SphericalLaw)
def test_compiled_laws_are_those_of_plain_python(law):
    """All laws in one function, each for an angle; about three skew axes; and over two joints."""
    assert set(EXAMPLES) == {row.law for row in LAWS}
    laws = list(EXAMPLES.values())
    uses = [
        displacement_law(AxisSpring(Z, (law,), Damping(0.4, 0.7, 0.05)), (k, k % 3))
        for k, law in enumerate(laws)
    ]
    axes = [
        AxisSpring(axis, (law,), Damping(0.2 * k))
        for k, (axis, law) in enumerate(zip((SKEW, ACROSS, THIRD), laws[-3:], strict=True))
    ]
    ball = rotation_law(JointSprings("ball", tuple(axes)), law, (SKEW, ACROSS, THIRD))
    uses.append(rotation_vector_law(ball, len(laws)))
    places = (("ball", X), ("hinge", SKEW), ("ball", Y))
    spring = CoupledSpring(COUPLED, tuple(CoupledAxis(*place) for place in places))
    vectors = (("ball", len(laws), VectorLaw(tuple(axes))),)
    uses.append(coupled_law(spring, (None, ((1, 0), 1.0), None), vectors))
    plain, (pointer, *tables) = plain_tables(uses), build_law_tables(uses)
    compiled = pointer.function, *tables
    rng = np.random.default_rng(5)
    for size in [1e-9, 1e-3, *np.linspace(0.1, 1.7, 48)]:
        motion = size * rng.uniform(-1.0, 1.0, (2, len(laws) + 1, 3))
        expected, found = evaluate(plain, *motion), evaluate(compiled, *motion)
        assert np.array_equal(found.signs, expected.signs)
        for one, other in zip(
            (found.torques, found.switching, found.powers),
            (expected.torques, expected.switching, expected.powers),
            strict=True,
        ):
            assert one == pytest.approx(other, rel=1e-11, abs=1e-11 * np.max(np.abs(other)))


def test_of_joints_without_springs_the_torques_are_zero():
    uses = [displacement_law(None, (0, 0)), rotation_vector_law(VectorLaw(()), 1)]
    function, parameters, rows, bounds, _ = plain_tables(uses)
    torques = np.full((2, 3), np.nan)
    nothing = np.zeros(0)
    motion = np.ones((2, 3))
    function(motion, motion, parameters, nothing, rows, bounds, torques, nothing, np.zeros(3))
    assert torques[0, 0] == 0.0
    assert np.array_equal(torques[1], np.zeros(3))
