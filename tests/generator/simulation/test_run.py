"""A figure and a plan become a recording."""

import warnings
from dataclasses import replace
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest

from generator import Plan, read_figure, simulate
from generator.contact.plane import Plane
from generator.contact.scene import Prop, Scene
from generator.diagnostics import ModelError, MoverError, UnknownNameError
from generator.recording import LOSS_KINDS, Ending, RecordingPart
from generator.run_options import Integrator
from generator.simulation.exudyn_model.exudyn_api import exu
from generator.simulation.run import Progress
from springs import SphericalLaw, SpringSet, Surface
from tests.chains import BALL, chain, one_body, row
from tests.contact_figures import FLOOR, block
from tests.runs import same_bits

FIGURES = Path(str(files("figures")))
NONE = SpringSet()


@pytest.fixture(scope="module")
def fall():
    return simulate(read_figure("prototype"), Plan(stop=0.1))


def test_the_recording_holds_everything_by_name(fall) -> None:
    made = read_figure("prototype")
    count = fall.times.size
    assert count == 6
    assert list(fall.displacements) == list(made.joints)
    assert list(fall.poses) == list(made.segments)
    for name, each in made.joints.items():
        assert fall.displacements[name].shape == (count, each.degrees_of_freedom)
        assert fall.velocities[name].shape == (count, each.degrees_of_freedom)
        assert fall.rotation_vectors[name].shape == (count, 3)
        assert fall.reactions[name].shape == (count, 6)
        assert fall.passive_torques[name].shape == (count, 3)
        assert fall.chains[name] == each.chain
    assert all(pose.shape == (count, 4, 4) for pose in fall.poses.values())
    assert fall.centre_of_mass.shape == (count, 3)


def test_it_says_how_it_ended_and_what_it_knows(fall) -> None:
    assert fall.outcome.ending is Ending.DONE
    assert fall.outcome.last_time == 0.1
    assert "0.1 s" in fall.outcome.message
    assert fall.accuracy.tolerance == 1e-3
    assert 0.0 < fall.accuracy.estimate <= 1e-3
    assert fall.accuracy.tolerance_met_until == 0.1
    assert fall.accuracy.steps * fall.accuracy.step > 0.1  # of several runs
    assert fall.accuracy.by_frame.shape == fall.times.shape
    assert np.all(np.diff(fall.accuracy.by_frame) >= 0.0)
    assert fall.wall_time > 0.0
    assert fall.build_time > 0.0
    assert fall.constraint_drift < 1e-5


def test_it_names_its_springs_and_law(fall) -> None:
    assert "prototype" in fall.springs
    assert fall.law == "conservative"
    weighted = simulate(row(1, stiff=3.0), Plan(stop=0.1, step=1e-3, law=SphericalLaw.WEIGHTED))
    assert weighted.law == "weighted"
    assert simulate(row(1), Plan(stop=0.1, step=1e-3, springs=NONE)).springs == "none"


def test_a_run_is_the_same_twice() -> None:
    runs = [simulate(row(2, stiff=3.0), Plan(stop=0.2)) for _ in range(2)]
    assert np.array_equal(runs[0].displacements["joint1"], runs[1].displacements["joint1"])


MOTION = (
    "times",
    "poses",
    "displacements",
    "centre_of_mass",
    "constraint_drift",
    "prescribed_motion_drift",
)
PARTS = {
    RecordingPart.VELOCITIES: ["velocities"],
    RecordingPart.ROTATION_VECTORS: ["rotation_vectors"],
    RecordingPart.REACTIONS: ["reactions", "drive_torques"],
    RecordingPart.PASSIVE_TORQUES: ["passive_torques"],
    RecordingPart.ENERGY: ["energy"],
    RecordingPart.CONTACT: ["contact"],
}


@pytest.mark.parametrize("part", PARTS)
@pytest.mark.parametrize("threads", [1, 2])
def test_a_lean_recording_has_the_same_bits(part: RecordingPart, threads: int) -> None:
    figure, plan = block(0.06), Plan(stop=0.16, scene=FLOOR, springs=NONE)
    whole = simulate(figure, plan)
    lean = simulate(figure, plan, record={part}, threads=threads)
    assert lean.recorded == {part}
    for name in MOTION:
        assert same_bits(getattr(lean, name), getattr(whole, name)), name
    assert lean.accuracy.estimate == whole.accuracy.estimate
    agreement = whole.agreement_with_exudyn if part is RecordingPart.AGREEMENT else None
    assert lean.agreement_with_exudyn == agreement
    assert whole.contact is not None
    assert whole.contact.sensitivity is not None
    undisturbed = {"sensitivity": None, "height_sensitivity": None, "impact_shift": None}
    for other, names in PARTS.items():
        for name in names:
            found = getattr(lean, name)
            if other is not part:
                assert not found, name
            elif name == "contact":
                assert same_bits(found, replace(whole.contact, **undisturbed))
            else:
                assert same_bits(found, getattr(whole, name)), name


def test_contact_of_steps_and_losses_have_the_same_bits() -> None:
    figure, plan = block(0.06), Plan(stop=0.16, scene=FLOOR, springs=NONE)
    whole = simulate(figure, plan)
    lean = simulate(figure, plan, record={RecordingPart.CONTACT_STEPS, RecordingPart.LOSSES})
    assert lean.contact is not None
    assert whole.contact is not None
    by_frame = {
        "forces": {},
        "depths": {},
        "part_forces": {},
        "force_points": {},
        "overlap": None,
        "ground_reaction": np.zeros((0, 6)),
    }
    undisturbed = {"sensitivity": None, "height_sensitivity": None, "impact_shift": None}
    assert same_bits(lean.contact, replace(whole.contact, **undisturbed, **by_frame))
    losses = {kind: whole.energy[kind] for kind in LOSS_KINDS if kind in whole.energy}
    assert same_bits(lean.energy, losses)


def test_a_run_without_the_comparison_builds_nothing_in_exudyn(monkeypatch) -> None:
    plan = Plan(stop=0.1)
    whole = simulate(row(2, stiff=3.0), plan)
    monkeypatch.setattr(exu, "SystemContainer", None)
    lean = simulate(row(2, stiff=3.0), plan, record={RecordingPart.REACTIONS})
    assert same_bits(lean.reactions, whole.reactions)
    with pytest.raises(TypeError):
        simulate(row(2, stiff=3.0), plan)


def test_a_lean_recording_says_what_it_left_out() -> None:
    lean = simulate(row(1), Plan(stop=0.1), record=())
    with pytest.raises(UnknownNameError, match="was not asked to record reactions"):
        lean.reactions["joint0"]
    with pytest.raises(ModelError, match="needs a whole recording"):
        lean.write("lean.npz")


def test_exudyn_records_lean_runs_too() -> None:
    plan = Plan(stop=0.1, step=1e-3)
    lean = simulate(row(2, stiff=3.0), plan, record={RecordingPart.REACTIONS})
    whole = simulate(row(2, stiff=3.0), plan)
    assert same_bits(lean.reactions, whole.reactions)
    assert same_bits(lean.displacements, whole.displacements)
    assert not lean.energy


def test_a_fixed_step_knows_no_error() -> None:
    run = simulate(row(1), Plan(stop=0.1, step=7e-3))
    assert run.accuracy.estimate is None
    assert run.accuracy.tolerance is None
    assert run.accuracy.step == pytest.approx(0.02 / 3)
    assert run.accuracy.steps == 15
    assert np.all(np.isnan(run.accuracy.by_frame))
    assert run.outcome.succeeded


def test_a_step_longer_than_a_frame_is_cut_to_it() -> None:
    run = simulate(row(1), Plan(stop=0.1, step=0.05))
    assert run.accuracy.steps == 5
    assert run.accuracy.step == pytest.approx(0.02)


def test_a_run_may_start_at_any_time() -> None:
    """Time itself changes nothing where no load depends on it."""
    here, there = (
        simulate(row(2), Plan(start=start, stop=start + 0.3, step=1e-3)) for start in (0.0, -5.0)
    )
    assert there.times[0] == -5.0
    assert there.times[-1] == -4.7
    assert exu.special.exceptions.parameterRangeChecks
    assert np.allclose(here.displacements["joint1"], there.displacements["joint1"], atol=1e-8)


def test_progress_is_told_of_every_pass() -> None:
    told: list[Progress] = []
    simulate(row(1), Plan(stop=0.2, integrator=Integrator.EXUDYN), told.append)
    passes = sorted({p.pass_number for p in told})
    assert passes == [1, 2]
    for number in passes:
        own = [p for p in told if p.pass_number == number]
        assert [p.time for p in own] == pytest.approx(list(0.02 * np.arange(1, 11)))
        assert len({p.step for p in own}) == 1
    steps = [next(p.step for p in told if p.pass_number == n) for n in passes]
    assert steps[1] == 0.5 * steps[0]


def test_gravity_is_the_plan_s() -> None:
    run = simulate(one_body(chain("Tz")), Plan(stop=1.0, gravity=(0, 0, 2.0), springs=NONE))
    assert run.displacements["pin"][:, 0] == pytest.approx(run.times**2, abs=1e-9)


def test_a_plan_is_not_needed() -> None:
    assert simulate(one_body(chain("Tz"))).outcome.last_time == 1.0


def test_what_cannot_be_built_says_why() -> None:
    with pytest.raises(MoverError, match="no joint `elbow`; known here: pin"):
        simulate(one_body(BALL), Plan(displacements={"elbow": (0.1,)}))


def test_the_shipped_figures_run() -> None:
    for name in ("pendulum.fig", "fourbar.fig"):
        run = simulate(read_figure(FIGURES / name), Plan(stop=0.2))
        assert run.outcome.succeeded
        assert run.accuracy.estimate < 1e-3


def test_the_drift_is_that_of_the_sites() -> None:
    made = row(3)
    run = simulate(made, Plan(stop=0.5, step=5e-3, springs=NONE))
    parted = max(
        float(np.max(np.linalg.norm((parent - child)[:, :3, 3], axis=1)))
        for parent, child in (
            [run.poses[ref.segment] @ made.site(ref).pose_in_segment for ref in each.ends]
            for each in made.joints.values()
        )
    )
    assert run.constraint_drift == pytest.approx(parted, rel=1e-6)
    assert 0.0 < parted < 1e-2


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("prototype",), "needs a Model or a Figure, such as person.model"),
        ((NONE,), "not <SpringSet none"),
        ((read_figure("pendulum"), 0.5), "Plan\\(stop=2.0\\)"),
    ],
)
def test_arguments_of_another_type_are_named(arguments, said) -> None:
    with pytest.raises(TypeError, match=said):
        simulate(*arguments)


def test_a_figure_that_stays_attached_above_a_floor_is_said() -> None:
    plan = Plan(
        stop=0.02,
        scene=Scene((Prop("floor", Plane((0.0, -1.0, 0.0), (0.0, 1.0, 0.0)), Surface()),)),
        springs=NONE,
    )
    hanging = one_body(chain("Rz"), displacement=(0.3,))
    with pytest.warns(UserWarning, match=r"stays attached to the ground by `pin`.*free_root=True"):
        simulate(hanging, plan)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        simulate(hanging, replace(plan, free_root=True))
        simulate(hanging, replace(plan, scene=Scene()))
        simulate(block(0.06), plan)
