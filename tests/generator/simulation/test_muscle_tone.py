"""Tone in runs: its work, agreement with Exudyn, and what it does to a person."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from generator import read_figure, read_npz
from generator.contact.scene import Scene, add_floor
from generator.diagnostics import ModelError
from generator.model import Model
from generator.rotations import rotation_vector_from_matrix
from generator.run_options import Integrator
from generator.simulation.exudyn_model.model import build_model
from generator.simulation.muscle_tone import tone_of_model, upright_orientations
from generator.simulation.plan import Plan
from generator.simulation.run import simulate
from generator.simulation.statics.equilibrium import find_equilibrium
from generator.tone import Tone
from springs import SphericalLaw
from springs.strength.strengths import Strength, StrengthClass
from tests.chains import BALL, chain, one_body, two_bodies
from tests.runs import energy_error

MALE = read_figure("male50")
PENDULUM = one_body(BALL, (0.3, -0.2, 0.4))
STRENGTHS, OF_PIN = {"tested": (4.0, 6.0)}, {"pin": (20.0, 30.0)}
JOINTS = [
    ("Rs", SphericalLaw.CONSERVATIVE, True),
    ("Rx R-y", SphericalLaw.COORDINATES, False),
    ("Rx Ry Rz", SphericalLaw.COORDINATES, True),
    ("Rx Ry Rz", SphericalLaw.CONSERVATIVE, False),
    ("Rz R-x", SphericalLaw.WEIGHTED, True),
]
FALL = Tone({"all": 0.03}, {"neck": 0.5, "trunk": 0.5})
PUSHED = {"left_knee": (1.0,), "waist": (0.5, 0.2, -0.6), "left_shoulder": (1.0, -2.0, 1.5)}


@pytest.mark.parametrize(("factors", "law", "reverse"), JOINTS)
@pytest.mark.parametrize(
    "tone",
    [
        Tone({"tested": 0.5}, strengths=STRENGTHS),
        Tone({"tested": 0.5}, delay=0.1, release=0.3, strengths=STRENGTHS),
        Tone({}, {"tested": 0.5}, strengths=STRENGTHS),
    ],
    ids=["hold", "hold for a time", "right"],
)
def test_work_of_tone_balances_the_energy(
    factors: str, law: SphericalLaw, tone: Tone, reverse: bool
) -> None:
    axes = chain(factors)
    start = (0.2, -0.4, 0.3)[: len(axes)]
    made = two_bodies(axes, start, reverse=reverse)
    plan = Plan(stop=0.5, tolerance=1e-6, law=law, tone=tone, velocities={"ball": (1.0, 1.0, -2.0)})
    run = simulate(made, plan)
    assert run.integrator is Integrator.COMPILED
    exchanged = np.ptp(run.energy["tone"])
    assert exchanged > 1e-3
    assert energy_error(run) < 1e-6 * max(map(np.ptp, run.energy.values()))
    assert run.agreement_with_exudyn is not None
    assert run.agreement_with_exudyn < 1e-8


def test_person_agrees_with_exudyn() -> None:
    plan = Plan(stop=0.2, free_root=True, height=0.5, tone=FALL, velocities=PUSHED, tolerance=1e-5)
    run = simulate(MALE, plan)
    assert run.integrator is Integrator.COMPILED
    assert run.agreement_with_exudyn is not None
    assert run.agreement_with_exudyn < 1e-8
    assert np.ptp(run.energy["tone"]) > 0.02
    assert energy_error(run) < 1e-6 * np.ptp(run.energy["gravity"])


@pytest.mark.parametrize("integrator", [Integrator.COMPILED, Integrator.IMPLICIT])
def test_tone_of_zero_is_no_tone(integrator: Integrator) -> None:
    plan = Plan(stop=0.04, velocities=PUSHED, integrator=integrator)
    without = simulate(MALE, plan)
    zero = simulate(MALE, replace(plan, tone=Tone({"all": 0.0}, {"neck": 0.0})))
    assert "tone" not in zero.energy
    for name, values in without.displacements.items():
        assert np.array_equal(zero.displacements[name], values)


def test_implicit_method_has_the_same_motion() -> None:
    scene = add_floor(Scene(), (0.0, 1.0, 0.0), None)
    plan = Plan(stop=0.2, free_root=True, height=0.0, scene=scene, tone=FALL, velocities=PUSHED)
    tight = simulate(MALE, replace(plan, tolerance=1e-5))
    run = simulate(MALE, replace(plan, integrator=Integrator.IMPLICIT, tolerance=1e-4))
    assert run.integrator is Integrator.IMPLICIT
    assert run.agreement_with_exudyn is not None
    assert run.agreement_with_exudyn < 1e-8
    for name in ("neck", "waist", "left_elbow"):
        assert run.displacements[name] == pytest.approx(tight.displacements[name], abs=5e-3)
    assert run.energy["tone"] == pytest.approx(tight.energy["tone"], abs=2e-2)


def test_righting_keeps_the_head_up_on_a_fixed_pelvis() -> None:
    start = {"waist": (0.0, 0.1, 0.5), "neck": (0.2, -0.1, 0.6, 0.0, 0.0, 0.0)}
    tones = (Tone(), replace(FALL, righting={"neck": 1.0, "trunk": 1.0}))
    upright = upright_orientations(MALE, tones[1])["neck"]
    errors: list[float] = []
    for tone in tones:
        run = simulate(MALE, Plan(stop=1.5, displacements=start, tone=tone, locked=("root_torso",)))
        turn = run.poses["head"][-1, :3, :3]
        error = rotation_vector_from_matrix(upright.T @ turn)
        errors.append(float(np.degrees(np.linalg.norm(error))))
    limp, righted = errors
    assert limp > 30.0
    assert righted < 5.0


def test_righting_restores_the_heading_as_well() -> None:
    tone = Tone({}, {"pin": 0.5}, strengths=OF_PIN)
    turned = build_model(PENDULUM, Plan(tone=tone)).tone
    assert turned is not None
    (righting,) = turned.righting.values()
    heading = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])
    error = rotation_vector_from_matrix(righting.upright.T @ heading @ righting.upright)
    assert np.linalg.norm(error) == pytest.approx(0.5 * np.pi)


def test_hold_keeps_the_angles_of_the_start() -> None:
    start, strengths = np.array([0.3, -0.2, 0.4]), {"pin": (200.0, 300.0)}
    plan = Plan(stop=1.0, tone=Tone({"pin": 1.0}, strengths=strengths))
    held, limp, released = (
        simulate(PENDULUM, replace(plan, tone=tone)).displacements["pin"]
        for tone in (plan.tone, Tone(), replace(plan.tone, release=0.5))
    )
    assert np.max(np.abs(held - start)) < 0.05
    assert np.max(np.abs(limp - start)) > 0.3
    before = np.arange(51) <= 25
    assert released[before] == pytest.approx(held[before], abs=1e-3)
    assert np.max(np.abs(released[-1] - start)) > 0.2


def test_strengths_of_a_person_have_their_classes() -> None:
    tone = build_model(MALE, Plan(tone=Tone({"all": 0.1}))).tone
    assert tone is not None
    assert tone.hold.keys() == {name for name in MALE.joints if name != "root_torso"}
    # Of shoulders, hips and spine three, of elbows, wrists and ankles two, of knees one.
    assert sum(tone.origins.values()) == sum(map(len, tone.hold.values())) == 35
    assert tone.origins[StrengthClass.PUBLISHED] == 9
    knee = tone.strengths["left_knee", "flexion"]
    size = MALE.total_mass * 9.81 * 1.756
    assert knee.largest == pytest.approx((0.087 * size, 0.163 * size), rel=1e-4)


@pytest.mark.parametrize(
    ("tone", "sentence"),
    [
        (Tone({"pin": 0.1}), "no strength of joint pin is known"),
        (Tone({}, {"pin": 0.1}), "righting: no strength of joint pin is known"),
        (Tone({"all": 0.1}), "no joint of this figure has a known strength"),
        (Tone({"pim": 0.1}), "did you mean `pin`"),
        (Tone({"pin": 0.1}, strengths={"pim": (1.0, 1.0)}), "no motion `pim`; did you mean `pin`"),
        (
            Tone({"pin": 0.1}, strengths={"pin": (1.0, 1.0), "pin roll": (1.0, 1.0)}, name="mine"),
            r"mine.tone.toml, row 2 of \[\[strength\]\]: .* `pin roll`; motions of joint pin: none",
        ),
    ],
)
def test_what_cannot_be_held_is_refused(tone: Tone, sentence: str) -> None:
    with pytest.raises(ModelError, match=sentence):
        simulate(PENDULUM, Plan(tone=tone))


def strengths_of_male(**more: Any) -> Mapping[tuple[str, str], Strength]:
    """Strengths of the knees of a man who holds them."""
    tone = build_model(MALE, Plan(tone=Tone({"left_knee": 0.1}, **more))).tone
    assert tone is not None
    return tone.strengths


def test_stated_strength_counts_with_its_class_in_both_senses_of_a_motion() -> None:
    key = ("left_knee", "flexion")
    stated = {"left_knee flexion": (110.0, 210.0)}
    classes = {"left_knee flexion": StrengthClass.PUBLISHED}
    assert strengths_of_male(strengths=stated)[key] == Strength(
        (110.0, 210.0), StrengthClass.ESTIMATE
    )
    found = strengths_of_male(strengths=stated, strength_classes=classes)[key]
    assert found == Strength((110.0, 210.0), StrengthClass.PUBLISHED)
    for opposite in ("extension", "hyperextension"):
        turned = strengths_of_male(strengths={f"left_knee {opposite}": (210.0, 110.0)})
        assert turned[key].largest == (110.0, 210.0)


@pytest.mark.parametrize(
    ("name", "sentence"),
    [
        ("left_knee flexon", "motions of joint left_knee: flexion, extension, hyperextension"),
        ("left_nee flexion", "did you mean `left_knee flexion`"),
        ("left_knee flexion", "`left_knee flexion` has a strength already, that of `left_knee ext"),
    ],
)
def test_unknown_and_repeated_strengths_are_refused(name: str, sentence: str) -> None:
    stated = {"left_knee extension": (210.0, 110.0), name: (1.0, 1.0)}
    with pytest.raises(ModelError, match=f"row 2 of .*{sentence}"):
        strengths_of_male(strengths=stated, name="mine")


def test_a_group_leaves_out_joints_without_strength_but_not_all() -> None:
    motions = {"waist", "thorax"}
    joints = {
        name: replace(own, axes=tuple(replace(axis, motion="") for axis in own.axes))
        if name in motions
        else own
        for name, own in Model.of(MALE).springs.joints.items()
    }
    springs = replace(Model.of(MALE).springs, joints=joints)
    made = replace(Model.of(MALE), springs=springs)
    with pytest.raises(ModelError, match="no strength of a joint of the group `trunk` is known"):
        tone_of_model(made, Tone({}, {"neck": 0.4, "trunk": 0.4}))
    stated = {"waist": (1.0, 1.0)}
    found = tone_of_model(made, Tone({}, {"neck": 0.4, "trunk": 0.4}, strengths=stated))
    assert found is not None
    assert found.righting.keys() == {"neck", "waist"}
    with pytest.raises(ModelError, match="righting: no strength of joint thorax is known"):
        tone_of_model(made, Tone({}, {"neck": 0.4, "thorax": 0.4}))


def test_equilibrium_is_of_passive_joints() -> None:
    with pytest.raises(ModelError, match="leave out the tone"):
        find_equilibrium(PENDULUM, Plan(tone=Tone({"pin": 0.1}, strengths=OF_PIN)))


def test_work_of_tone_is_in_a_recording_that_is_read_again(tmp_path) -> None:
    run = simulate(PENDULUM, Plan(stop=0.1, tone=Tone({"pin": 0.5}, strengths=OF_PIN)))
    path = tmp_path / "run.npz"
    run.write(path)
    _, read = read_npz(path)
    assert np.array_equal(read.energy["tone"], run.energy["tone"])
