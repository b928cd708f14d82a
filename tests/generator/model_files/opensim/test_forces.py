"""Springs in OpenSim: generalized forces at random displacements and rates."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from generator.figure import Figure
from generator.joint_chain import build_chain
from generator.model_files.opensim.write import format_osim
from generator.passive_curve import passive_torque, rotation_vector
from generator.rotations import Array, matrix_from_rotation_vector
from generator.springs_file.axes import parallel_sign
from springs import (
    AxisSpring,
    CoupledAxis,
    CoupledSpring,
    Damping,
    JointSprings,
    Linear,
    SphericalLaw,
    SpringSet,
    damping_torque,
)
from springs.coupled import CoupledExponential, CoupledTerm
from tests.chains import ACROSS, BALL, SKEW, X, Y, Z, chain, negative, row, two_bodies
from tests.generator.model_files.engines import OpenSim
from tests.generator.model_files.model_cases import (
    CLAVICLES,
    CURVES,
    FOURBAR,
    OTHER_CURVES,
    hinge,
    own_springs,
    spring_set,
)

pytestmark = pytest.mark.verify

Values = Mapping[str, Array]


def expected_forces(of: Figure, springs: SpringSet, values: Values, rates: Values) -> Values:
    """Generalized forces of the springs about the axes of all joints."""
    forces: dict[str, Array] = {}
    for name, joint in of.joints.items():
        chain = build_chain(joint.chain)
        turns = list(chain.rotations)
        if not turns:
            continue
        own = springs.joints.get(name, JointSprings(name))
        vector = rotation_vector(chain, values[name])
        half_way = matrix_from_rotation_vector(0.5 * vector)
        axes = chain.twists(values[name])[turns, :3] @ half_way  # of rates, in the half-way frame
        rate = rates[name][turns] @ axes
        torque = passive_torque(of, springs, name, values)
        if len(turns) == 1:
            axis = np.array(joint.chain[turns[0]].axis)
            for spring in own.axes:
                sense = parallel_sign(spring.direction, tuple(axis))
                angle, speed = (sense * v[name][turns[0]] for v in (values, rates))
                torque += float(spring.resistance(angle, speed)) * np.array(spring.direction)
        else:
            torque += damping_torque(own.axes, vector, rate)
        forces[name] = axes @ torque
    return forces


def inverse_dynamics(loaded: OpenSim, values: Values, rates: Values) -> dict[str, float]:
    """Forces about the coordinates at displacements and rates, without accelerations."""
    model, state = loaded.model, loaded.state
    coordinates = [model.getCoordinateSet().get(k) for k in range(model.getNumCoordinates())]
    order: dict[str, int] = {}
    for one in coordinates:
        for other in coordinates:
            other.setValue(state, float(other is one), False)
        order[one.getName()] = int(np.argmax([state.getQ().get(k) for k in range(state.getNQ())]))
    loaded.set({name: row for name, row in values.items() if f"{name}_1" in order})
    for one in coordinates:
        joint, _, number = one.getName().rpartition("_")
        one.setSpeedValue(state, float(rates[joint][int(number) - 1]))
    model.realizeDynamics(state)
    solver = loaded.api.InverseDynamicsSolver(model)
    forces = solver.solve(state, loaded.api.Vector(state.getNU(), 0.0))
    return {name: forces.get(index) for name, index in order.items()}


def check(of: Figure, springs: SpringSet, folder: Path, count: int = 3) -> None:
    """Compare the forces of springs: those of the model minus those of one without springs."""
    held, free = OpenSim(of, springs, folder), OpenSim(of, SpringSet(), folder)
    assert not [one for one in held.losses.entries if "spring" in one.what and one.where]
    random = np.random.default_rng(5)
    for row_number in range(count):
        size = 0.0 if row_number == 0 else 1.3  # at rest first
        values, rates = (
            {n: random.uniform(-part, part, len(j.chain)) for n, j in of.joints.items()}
            for part in (size, 2.0 * size)
        )
        found, without = (inverse_dynamics(one, values, rates) for one in (held, free))
        for name, expected in expected_forces(of, springs, values, rates).items():
            turns = build_chain(of.joints[name].chain).rotations
            for index, force in zip(turns, expected, strict=True):
                label = f"{name}_{index + 1}"
                said = without[label] - found[label]
                assert said == pytest.approx(force, rel=1e-9, abs=1e-9)


def test_a_shipped_figure_has_the_moments_of_its_springs(tmp_path: Path) -> None:
    check(CLAVICLES, own_springs(CLAVICLES), tmp_path)


def test_a_loop_has_the_moments_of_its_springs(tmp_path: Path) -> None:
    """The four bars lie in a plane and stay assembled at the angles in which they are drawn."""
    names = [name for name in FOURBAR.joints if name != "rocker_pin"]
    springs = spring_set(*(hinge(name, Linear(3.0, 0.1), axis=Z) for name in names))
    held, free = (OpenSim(FOURBAR, one, tmp_path) for one in (springs, SpringSet()))
    values = {name: np.array(joint.displacement) for name, joint in FOURBAR.joints.items()}
    none = {name: np.zeros_like(value) for name, value in values.items()}
    found, without = (inverse_dynamics(one, values, none) for one in (held, free))
    for name, expected in expected_forces(FOURBAR, springs, values, none).items():
        if name in names:
            said = without[f"{name}_1"] - found[f"{name}_1"]
            assert said == pytest.approx(expected[0], rel=1e-9)


CHAINS = {
    "three axes": (chain("Rz R-x Ry"), False),
    "child nearer to the root": (chain("Rz R-x Ry"), True),
    "oblique, the last axis along the first": (chain("Rs Ra Rs"), False),
    "two rotations": (chain("Rs Ra"), False),
    "two rotations, child nearer to the root": (chain("Rs Ra"), True),
    "free": (chain("Rx Ry Rz Tx Ty Tz"), False),
}


@pytest.mark.parametrize(
    ("name", "law"),
    [("three axes", SphericalLaw.WEIGHTED), *((n, SphericalLaw.CONSERVATIVE) for n in CHAINS)],
)
def test_laws_of_all_kinds_in_joints_of_all_kinds(
    name: str, law: SphericalLaw, tmp_path: Path
) -> None:
    axes, reverse = CHAINS[name]
    of = two_bodies(axes, [0.1] * len(axes), reverse=reverse)
    laws = [*CURVES.values(), *OTHER_CURVES.values()]
    directions = [X, negative(Y), Z, SKEW, negative(ACROSS), Y, negative(Z), X]
    damping = Damping(0.3, 0.7, 0.1)
    springs = JointSprings(
        "tested",
        tuple(AxisSpring(d, law, damping) for d, law in zip(directions, laws, strict=True)),
    )
    check(of, replace(spring_set(springs), law=law), tmp_path)


COUPLED = CoupledExponential(
    ("first", "second", "third"),
    (
        CoupledTerm((1.0, -2.0, 0.5), (0.8, 0.5, 0.0), 0.1),
        CoupledTerm((0.6, 0.9, 0.3), (-0.6, -0.9, -0.3), 0.2, 0.4),
    ),
    (0.3, 0.0, -0.2),
    (None, None, None),
)
"""Not conservative."""


@pytest.mark.parametrize(
    "axes",
    [
        (CoupledAxis("j0", SKEW), CoupledAxis("j1", X), CoupledAxis("j2", negative(Y))),
        (CoupledAxis("j0", X), CoupledAxis("j0", SKEW), CoupledAxis("j2", Y)),
        (CoupledAxis("j1", negative(X)), CoupledAxis("j0", Z), CoupledAxis("j3", ACROSS)),
    ],
)
def test_laws_over_several_joints(axes: tuple[CoupledAxis, ...], tmp_path: Path) -> None:
    of = row(4, [BALL, chain("Rx"), chain("Ry"), chain("Rs Ra")])
    own = spring_set(JointSprings(next(iter(of.joints)), ()))
    names = list(of.joints)
    bound = tuple(replace(axis, joint=names[int(axis.joint[1:])]) for axis in axes)
    check(of, replace(own, coupled=(CoupledSpring(COUPLED, bound),)), tmp_path, 4)


def test_forces_have_names_of_their_own() -> None:
    of = two_bodies(chain("Rx Ry Rz"), (0.1, 0.2, 0.3))
    axes = tuple(AxisSpring(d, (Linear(2.0),), Damping(0.1)) for d in (X, negative(X), SKEW))
    text = format_osim(of, spring_set(JointSprings("tested", axes)))[0]
    for name in ("x_spring", "x_damping", "x_spring_2", "x_damping_2", "3_spring", "3_damping"):
        assert text.count(f'name="tested_{name}"') == 1
    assert "constant" not in text
