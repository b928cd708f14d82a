"""Runs of figures whose displacements follow others by curves: a knee that slides as it bends."""

from dataclasses import replace

import numpy as np
import pytest

from generator.contact.scene import Scene
from generator.diagnostics import ModelError
from generator.drive import Drive
from generator.figure import Figure
from generator.kinematics.links import Coordinate, Link, Links
from generator.kinematics.placement import initial_displacements
from generator.kinematics.tree import build_tree
from generator.model import Model
from generator.model_files.formats import read_model
from generator.recording import Integrator, Recording
from generator.rotations import Array
from generator.simulation.live.stepper import Stepper
from generator.simulation.plan import Plan
from generator.simulation.run import simulate
from generator.simulation.run_model import initial_state
from generator.simulation.starts import vary_start
from generator.simulation.statics.equilibrium import find_equilibrium
from generator.study.parameter_paths import UnknownPathError
from generator.study.parameters import apply_parameters
from springs import SpringSet
from tests.generator.model_files.imported_models import MODELS

FIGURE: Figure = read_model(MODELS / "knee.osim").figure
LIMP = Model(FIGURE, SpringSet({}))
SPEEDS = {"hip": (1.0,), "knee": (-3.0,)}
BENT = {"knee": (-0.9,)}


def gaps(figure: Figure, displacements: dict[str, Array]) -> float:
    """Largest distance of a displacement from the curve that it follows [rad or m]."""
    return max(
        float(np.abs(one.curve.at(displacements[one.joint][..., one.index]) - rows[..., k]).max())
        for name, rows in displacements.items()
        for k, one in enumerate(figure.joints[name].followers)
        if one is not None
    )


def run(**settings: object) -> Recording:
    """A fall of 0.4 s from a bent knee."""
    values: dict[str, object] = {"stop": 0.4, "frame": 0.05, "displacements": BENT}
    return simulate(LIMP, Plan(**{**values, "velocities": SPEEDS, **settings}))  # pyright: ignore[reportArgumentType]


@pytest.fixture(scope="module")
def fall() -> Recording:
    return run(tolerance=1e-8)


def test_followers_stay_on_their_curves_and_energy_is_conserved(fall: Recording):
    assert fall.integrator is Integrator.COMPILED
    assert np.ptp(fall.displacements["knee"][:, 0]) > 0.5
    assert np.ptp(fall.displacements["slider"]) > 0.005
    assert gaps(FIGURE, dict(fall.displacements)) < 1e-12
    assert np.ptp(fall.energy_balance) < 1e-7


def test_accelerations_are_those_of_exudyn(fall: Recording):
    assert fall.agreement_with_exudyn is not None
    assert fall.agreement_with_exudyn < 1e-11


def test_a_joint_counted_backwards_moves_the_same(fall: Recording):
    """The patella carries the thigh's site: its slides are along axes of the child."""
    glide = FIGURE.joints["patella_glide"]
    turned = replace(glide, parent=glide.child, child=glide.parent, chain=glide.chain[::-1])
    signs = [replace(one, curve=one.curve.scaled(-1.0)) for one in glide.followers[::-1] if one]
    figure = FIGURE.with_parts(replace(turned, followers=tuple(signs)))
    other = simulate(
        Model(figure, SpringSet({})),
        Plan(stop=0.4, frame=0.05, displacements=BENT, velocities=SPEEDS, tolerance=1e-8),
    )
    assert other.agreement_with_exudyn is not None
    assert other.agreement_with_exudyn < 1e-11
    for name, poses in fall.poses.items():
        np.testing.assert_allclose(other.poses[name], poses, atol=1e-7)
    back = other.reactions["patella_glide"][:, :3]
    turn = other.poses["patella"][:, :3, :3]
    site = fall.poses["thigh"][:, :3, :3]
    forces = np.einsum("nij,nj->ni", site, fall.reactions["patella_glide"][:, :3])
    np.testing.assert_allclose(np.einsum("nij,nj->ni", turn, back), -forces, atol=1e-4)


def test_a_control_that_turns_round_follows_the_curve_all_the_way():
    """Beyond half a turn, where Exudyn sees the same orientation."""
    motion = run(velocities={"knee": (30.0,)}, stop=0.3)
    angles = motion.displacements["knee"][:, 0]
    assert angles[-1] > 1.2 * np.pi
    assert motion.integrator is Integrator.COMPILED, motion.integrator_reason
    assert gaps(FIGURE, dict(motion.displacements)) < 1e-11


def test_what_follows_a_locked_or_driven_joint_is_still_or_driven():
    still = run(locked=("knee",), velocities={"hip": (1.0,)})
    assert np.ptp(still.displacements["knee"], axis=0) == pytest.approx(0.0, abs=1e-12)
    assert np.ptp(still.displacements["slider"]) == pytest.approx(0.0, abs=1e-12)
    drive = Drive([0.0, 0.2, 0.4], [[-0.9], [-1.2], [-0.4]], (0,))
    driven = run(drives={"knee": drive}, velocities={})
    np.testing.assert_allclose(
        driven.displacements["knee"][:, 0], drive.displacements(driven.times)[:, 0], atol=1e-9
    )
    assert gaps(FIGURE, dict(driven.displacements)) < 1e-11
    for motion in (still, driven):
        assert motion.integrator is Integrator.COMPILED, motion.integrator_reason
        assert np.ptp(motion.energy_balance) < 1e-4
    with pytest.raises(ModelError, match="is locked"):
        run(locked=("slider",))


def test_links_and_followers_compose():
    """The hip follows the slider, whose curve is of the knee; then the knee follows the hip."""
    links = Links((Link(Coordinate("hip", 0), Coordinate("slider", 0), 2.0),))
    motion = run(links=links, velocities={"knee": (-3.0,)})
    hip, slider = motion.displacements["hip"][:, 0], motion.displacements["slider"][:, 0]
    np.testing.assert_allclose(hip, 2.0 * slider, atol=1e-10)
    assert motion.integrator is Integrator.COMPILED, motion.integrator_reason
    knee = Links((Link(Coordinate("knee", 0), Coordinate("hip", 0), -0.5, -0.8),))
    turned = run(links=knee, displacements={}, velocities={"hip": (2.0,)})
    assert gaps(FIGURE, dict(turned.displacements)) < 1e-11


def test_followers_are_no_degrees_of_freedom():
    assert FIGURE.freedoms == "2 degrees of freedom and 7 followers"
    assert FIGURE.joints["knee"].degrees_of_freedom == 1


def test_free_displacements_alone_may_be_given():
    every = (-0.9, *np.zeros(3))
    one, other = (run(stop=0.1, displacements={"knee": values}) for values in ((-0.9,), every))
    np.testing.assert_array_equal(one.displacements["knee"], other.displacements["knee"])


def test_a_live_simulation_keeps_followers_through_locks(fall: Recording):
    stepper = Stepper(LIMP, Plan(stop=9.0, displacements=BENT, velocities=SPEEDS), tolerance=1e-8)
    stepper.advance(0.4)
    for name, rows in fall.displacements.items():
        np.testing.assert_allclose(stepper.displacements[name], rows[-1], atol=1e-5)
    before = sum(stepper.energy.values())
    stepper.lock("hip")
    stepper.advance(0.1)
    stepper.unlock("hip")
    stepper.advance(0.1)
    assert gaps(FIGURE, stepper.displacements) < 1e-11
    assert sum(stepper.energy.values()) == pytest.approx(before, abs=1e-6)
    assert stepper.agreement_with_exudyn() < 1e-10


def test_equilibrium_of_a_sliding_knee_has_no_net_force():
    """A spring at the knee and gravity; a run from there stays there."""
    knee = replace(FIGURE.joints["knee"], stiff=(8.0, 0.0, 0.0, 0.0), damp=(0.5, 0.0, 0.0, 0.0))
    hip = replace(FIGURE.joints["hip"], stiff=(20.0,), damp=(1.0,))
    figure = FIGURE.with_parts(knee, hip)
    rest = find_equilibrium(figure, Plan())
    assert gaps(figure, dict(rest.displacements)) < 1e-12
    start = {name: tuple(values) for name, values in rest.displacements.items() if len(values)}
    motion = simulate(figure, Plan(stop=0.5, frame=0.1, displacements=start))
    assert np.ptp(motion.displacements["knee"][:, 0]) < 1e-5


@pytest.mark.slow
def test_exudyns_own_integrator_moves_the_same(fall: Recording):
    slow = run(integrator=Integrator.EXUDYN, stop=0.05)
    for name, rows in fall.displacements.items():
        np.testing.assert_allclose(slow.displacements[name], rows[: len(slow.times)], atol=1e-5)
    for name, wrenches in fall.reactions.items():
        close = 1e-2 * (1.0 + np.abs(wrenches).max())
        np.testing.assert_allclose(slow.reactions[name], wrenches[: len(slow.times)], atol=close)


def test_an_implicit_run_of_followers_is_refused():
    with pytest.raises(ModelError, match=r"implicit .*`follow`"):
        run(integrator=Integrator.IMPLICIT)


def test_values_off_the_curves_are_refused():
    """A patella that slides as the knee turns; zeros state nothing."""
    slides = tuple(np.r_[0.0, 0.0, 0.1].tolist())
    follows = "displacement 3 of `patella_glide` follows displacement 1 of `knee` and "
    with pytest.raises(ModelError, match=f"at the start {follows}is .* cm, not 10 cm; leave"):
        run(displacements={**BENT, "patella_glide": slides})
    with pytest.raises(ModelError, match=f"at the start {follows}moves by .* cm/s, not 10 cm/s"):
        run(velocities={**SPEEDS, "patella_glide": slides})


def test_a_changed_or_varied_control_moves_what_follows_it():
    """Also if a plan states the pose of all joints."""
    tree = build_tree(FIGURE)
    drawn = {name: tuple(row.tolist()) for name, row in initial_displacements(tree).items()}
    plan = Plan(displacements=drawn, scene=Scene.floor(), free_root=True)
    varied = vary_start(FIGURE, plan, 0.1, np.random.default_rng(0))
    changed = apply_parameters(LIMP, Plan(displacements=drawn), [("pose.knee.1", -30.0)])
    for one in (varied, changed.plan):
        start = initial_state(FIGURE, replace(one, scene=Scene(), free_root=False)).placement
        assert gaps(FIGURE, dict(start.displacements)) < 1e-12
        assert start.displacements["knee"][0] != drawn["knee"][0]
    for path in ("pose.knee.2", "velocity.slider"):
        with pytest.raises(UnknownPathError, match=r"follows displacement 1 of `knee`; vary that"):
            apply_parameters(LIMP, Plan(), [(path, 1.0)])
