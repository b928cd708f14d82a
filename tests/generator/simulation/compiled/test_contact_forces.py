"""Contact in the compiled evaluation, against that for arrays, and against Exudyn."""

from dataclasses import dataclass, replace
from functools import cache

import numpy as np
import pytest

from generator import read_figure
from generator.contact.scene import Cover, Scene
from generator.contact.spheres import fit_contact_spheres
from generator.contact.states import ContactStates, evaluate_contacts
from generator.contact_file.parts import BodyContact, BodyPart
from generator.figure import Figure
from generator.kinematics.placement import forward_kinematics
from generator.model import Model
from generator.rotations import quaternion_from_matrix
from generator.simulation.compiled.layout import FRICTION, IMPACT
from generator.simulation.exudyn_model.agreement import ExudynEquations
from generator.simulation.exudyn_model.bodies import body_pose
from generator.simulation.exudyn_model.model import ExudynModel, build_model
from generator.simulation.plan import Plan
from springs import SpringSet
from springs.contact_part import PartLaw
from springs.layer import Layer
from tests.compiled_models import SettableModel
from tests.contact_figures import CRATE, FLOOR, SLOPE_AND_CRATE, TILTED, odd_body, two_segments
from tests.poses import Pose, motion_matrix, random_pose

NONE = SpringSet()


@dataclass(frozen=True)
class Case:
    """A figure above a scene, and the range of heights at which it is set.

    Without springs of the case it has its own, and a free root.
    """

    figure: Figure
    root: str
    springs: SpringSet | None = None
    heights: tuple[float, float] = (-0.1, 0.5)
    states: int = 30
    contact: BodyContact | None = None
    scene: Scene = SLOPE_AND_CRATE


STAGES = ((0.0, 3e4), (0.03, 7.1e4))


def parts_of(*segments: tuple[str, ...], figure: Figure) -> BodyContact:
    """Parts that hold all spheres of some segments."""
    fits = fit_contact_spheres(figure)
    return BodyContact(
        tuple(
            BodyPart(
                " and ".join(names),
                PartLaw(STAGES, 0.8 + k),
                tuple(
                    (name, number) for name in names for number in range(len(fits[name].spheres))
                ),
            )
            for k, names in enumerate(segments)
        )
    )


ACROSS_SEGMENTS = parts_of(("first", "second"), figure=two_segments())
OF_PROTOTYPE = parts_of(
    ("lower_torso", "left_upper_leg", "right_upper_leg"),
    ("center_torso",),
    figure=read_figure("prototype"),
)
"""The other spheres of the figure are parts of their own."""

MAT = Layer(((0.0, 4e4), (0.02, 9e4)), thickness=0.05)
PAD = Layer(((0.0, 2e4),), thickness=0.012)
COVERED = Scene(
    (TILTED, replace(CRATE, surface=replace(CRATE.surface, layer=MAT))),
    (Cover("center_torso", PAD), Cover("lower_torso and left_upper_leg and right_upper_leg", MAT)),
)
"""A crate on a mat, and a slope; both parts of the prototype have covers."""

CASES = {
    "one body": Case(odd_body(), "pin", NONE),
    "two segments": Case(two_segments(), "root", NONE, (-0.1, 1.5)),
    "prototype": Case(read_figure("prototype"), "lower_torso", None, (0.2, 1.6), states=15),
    "part of two segments": Case(two_segments(), "root", NONE, (-0.1, 1.5), 30, ACROSS_SEGMENTS),
    "parts of the prototype": Case(
        read_figure("prototype"), "lower_torso", None, (0.2, 1.6), 15, OF_PROTOTYPE
    ),
    "covered parts on a mat": Case(
        read_figure("prototype"), "lower_torso", None, (0.2, 1.6), 15, OF_PROTOTYPE, COVERED
    ),
}


@cache
def settable(name: str, scene: Scene | None = None) -> tuple[SettableModel, ExudynEquations]:
    """The model, built far above a scene [default: that of the case]."""
    case = CASES[name]
    scene = case.scene if scene is None else scene
    plan = Plan(scene=scene, free_root=case.springs is None)
    if plan.free_root:
        plan = replace(plan, height=20.0)
    else:
        plan = replace(plan, displacements={case.root: (0.0, 0.0, 0.0, 0.0, 20.0, 0.0)})
    figure, springs = case.figure, case.springs
    subject = Model.of(figure) if springs is None else Model(figure, springs)
    model = build_model(replace(subject, contact=case.contact), plan)
    return SettableModel.of(model), ExudynEquations(model)


def pose_at(model: ExudynModel, case: Case, seed: int, height: float | None = None) -> Pose:
    """A random pose and motion at a random height above the scene, or at one [m]."""
    pose = random_pose(model, seed, 0.5, 3.0)
    rng = np.random.default_rng(seed)
    root = pose.placement.displacements[case.root].copy()
    root[3:] = rng.uniform(-0.3, 0.3, 3)
    low, high = case.heights
    root[4] = low + (high - low) * rng.random() ** 2 if height is None else height
    moved = {**pose.placement.displacements, case.root: root}
    return replace(pose, placement=forward_kinematics(pose.placement.tree, moved))


def expected_contact(pose: Pose) -> ContactStates:
    """The contact in a pose by the evaluation for arrays."""
    model = pose.model
    assert model.contacts is not None
    poses = np.array([body_pose(pose.placement, s) for s in model.figure.bodies.values()])
    motions = motion_matrix(pose.placement) @ pose.rates
    return evaluate_contacts(
        model.contacts,
        model.figure,
        poses[None, :, :3, 3],
        poses[None, :, :3, :3],
        motions[None, :, 3:],
        motions[None, :, :3],
    )


@pytest.mark.parametrize("name", CASES)
def test_forces_and_powers_are_those_for_arrays(name: str) -> None:
    """In states with spheres inside, touching and far."""
    made, _ = settable(name)
    touching = []
    for seed in range(CASES[name].states):
        pose = pose_at(made.model, CASES[name], seed)
        expected = expected_contact(pose)
        made.settle(pose)
        scratch = made.compiled.scratch
        scale = max(1.0, float(np.max(np.abs(expected.forces))))
        assert scratch.contact_forces == pytest.approx(
            expected.forces[0], rel=1e-10, abs=1e-10 * scale
        )
        powers = expected.impact_power[0], expected.friction_power[0]
        scale = max(1.0, *np.abs(powers))
        assert scratch.powers[[IMPACT, FRICTION]] == pytest.approx(
            powers, rel=1e-10, abs=1e-10 * scale
        )
        touching.append(np.count_nonzero(expected.depths > 0.0) / expected.depths.size)
    assert 0.0 in touching
    assert max(touching) > 0.2
    assert any(0.0 < share < 1.0 for share in touching)


@pytest.mark.parametrize("name", CASES)
def test_accelerations_are_exudyn_s(name: str) -> None:
    """Exudyn's connectors on the bodies, against the forces on the links."""
    made, equations = settable(name)
    forces = []
    for seed in range(CASES[name].states):
        pose = pose_at(made.model, CASES[name], 1000 + seed)
        exact, found = equations.accelerations(pose.state), made.accelerations(pose)
        assert np.max(np.abs(found - exact)) < 1e-10 * np.max(np.abs(exact))
        forces.append(float(np.max(np.abs(expected_contact(pose).forces))))
    assert np.count_nonzero(np.array(forces) > 10.0) > 0.3 * len(forces)


@pytest.mark.parametrize("name", CASES)
def test_far_spheres_cost_no_force(name: str) -> None:
    """The law is not evaluated, and the motion is that without a scene."""
    made, _ = settable(name)
    without, _ = settable(name, Scene())
    for seed in range(3):
        pose = pose_at(made.model, CASES[name], seed, 30.0)
        made.compiled.scratch.contact_work[:] = np.nan
        found = made.accelerations(pose)
        assert np.all(np.isnan(made.compiled.scratch.contact_work))
        assert np.all(made.compiled.scratch.contact_forces == 0.0)
        assert np.all(made.compiled.scratch.powers[[IMPACT, FRICTION]] == 0.0)
        free = without.accelerations(replace(pose, model=without.model))
        assert np.array_equal(found, free)


def test_layers_soften_parts_and_leave_other_spheres_alone() -> None:
    """In one state less energy is stored than without layers; limbs of no part feel the same."""
    soft, _ = settable("covered parts on a mat")
    hard, _ = settable("parts of the prototype")
    assert soft.model.contacts is not None
    ends = ("lower_arm", "upper_arm", "lower_leg")
    limbs = [g for g, name in enumerate(soft.model.contacts.spheres) if name.endswith(ends)]
    softer, touching = 0, 0
    for seed in range(15):
        pose = pose_at(soft.model, CASES["covered parts on a mat"], seed)
        found = expected_contact(pose)
        other = expected_contact(replace(pose, model=hard.model))
        assert found.energy[0] <= other.energy[0]
        assert found.forces[0, limbs] == pytest.approx(other.forces[0, limbs], abs=1e-9)
        softer += found.energy[0] < 0.9 * other.energy[0]
        touching += bool(np.any(found.forces[0, limbs]))
    assert softer > 3
    assert touching > 3


def test_forces_do_not_add_up_over_evaluations() -> None:
    made, _ = settable("one body")
    pose = pose_at(made.model, CASES["one body"], 0, -0.2)
    made.settle(pose)
    first = made.compiled.scratch.contact_forces.copy()
    powers = made.compiled.scratch.powers.copy()
    assert np.linalg.norm(first) > 10.0
    made.settle(pose)
    assert np.array_equal(made.compiled.scratch.contact_forces, first)
    assert np.array_equal(made.compiled.scratch.powers, powers)


def test_each_prop_pushes_by_itself() -> None:
    """The force of a scene is the sum of those of its props."""
    both, _ = settable("two segments")
    single = [settable("two segments", Scene((prop,)))[0] for prop in (TILTED, CRATE)]
    pushed = 0
    for seed in range(10):
        pose = pose_at(both.model, CASES["two segments"], seed, 0.1)
        both.settle(pose)
        parts = []
        for one in single:
            one.settle(replace(pose, model=one.model))
            parts.append(one.compiled.scratch.contact_forces.copy())
        assert both.compiled.scratch.contact_forces == pytest.approx(sum(parts), abs=1e-9)
        pushed += min(map(np.linalg.norm, parts)) > 1.0
    assert pushed >= 2


def test_the_rates_of_the_integrals_are_forces_and_powers() -> None:
    """The last numbers of a state are impulses and energies."""
    made, _ = settable("two segments")
    pose = pose_at(made.model, CASES["two segments"], 3, 0.0)
    compiled, rates = made.compiled, made.settle(pose)
    integrals, scratch = rates[-compiled.integrals :], compiled.scratch
    assert compiled.touching == ("third", "first", "second")
    assert integrals.size == 9 + len(scratch.powers)
    assert np.array_equal(integrals[:9].reshape(3, 3), scratch.contact_forces)
    assert np.array_equal(integrals[9:], scratch.powers)
    assert np.linalg.norm(scratch.contact_forces) > 1.0


def test_a_standing_start_is_in_contact_with_the_floor_alone() -> None:
    """A model is built where its spheres just touch; its first forces vanish."""
    made = SettableModel.of(
        build_model(CASES["prototype"].figure, Plan(free_root=True, height=0.0, scene=FLOOR))
    )
    model = made.model
    made.settle(Pose(model, model.placement, np.zeros_like(model.rates), 0.0))
    assert np.max(np.abs(made.compiled.scratch.contact_forces)) < 1e-6
    orientation = quaternion_from_matrix(model.placement.poses["lower_torso"][:3, :3])
    assert np.linalg.norm(orientation) == pytest.approx(1.0)
