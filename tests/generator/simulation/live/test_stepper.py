"""A figure that is simulated step by step and changed in between."""

import gc
import sys
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest

from generator import (
    Ending,
    Figure,
    ModelError,
    Plan,
    Stepper,
    UnknownNameError,
    read_figure,
    simulate,
)
from generator.contact.plane import Plane
from generator.contact.scene import Prop, Scene, floor_prop
from generator.drive import Drive
from generator.figure import ContactSphere, SiteRef
from generator.kinematics.links import Coordinate, Link, Links
from generator.loads import LoadKind, TimedLoad
from generator.run_options import Integrator
from generator.simulation.compiled.layout import POINT, POWERS, SPIN, VELOCITY
from generator.tone import Tone
from springs import NUMPY, AxisSpring, Damping, Linear, Stop
from springs.contact import Surface
from tests.chains import BALL, Y, at, body, chain, figure, ground, joint, one_body, row, two_bodies
from tests.runs import springs_of

STATUS = Path("/proc/self/status")
TOLERANCE = 1e-10
HINGE = chain("Ry")
STOP = AxisSpring(Y, (Linear(3.0, 0.1), Stop(0.1, 0.4, 50.0)), Damping(0.03, 0.01))


@pytest.fixture(scope="module")
def arm() -> Figure:
    """Three bars on a ball, a hinge and a universal joint."""
    return row(3, (BALL, HINGE, chain("Rx Rz")), stiff=2.0, damp=0.02)


@pytest.fixture(scope="module")
def hinges() -> Figure:
    """Two bars on hinges; quick to compile."""
    return row(2, (HINGE,), stiff=2.0, damp=0.02)


def difference(values, others) -> float:
    """Largest difference of numbers by name."""
    return max(float(np.max(np.abs(values[n] - others[n]), initial=0.0)) for n in others)


def last(by_name):
    return {name: rows[-1] for name, rows in by_name.items()}


def balance(stepper: Stepper) -> float:
    energy = stepper.energy
    return sum(value for kind, value in energy.items() if kind != "work") - energy["work"]


def momentum(stepper: Stepper) -> np.ndarray:
    """Linear momentum, and angular momentum about the world's origin."""
    state, poses = stepper.snapshot(), stepper.poses
    total = np.zeros(6)
    for (name, part), link in zip(stepper.figure.bodies.items(), state.bodies, strict=True):
        columns, pose = state.links[link], poses[name]
        point, spin, speed = (columns[at : at + 3] for at in (POINT, SPIN, VELOCITY))
        centre = pose[:3, :3] @ part.centre_of_mass + pose[:3, 3]
        velocity = speed + np.cross(spin, centre - point)
        own = pose[:3, :3] @ (np.asarray(part.inertia) * (pose[:3, :3].T @ spin))
        total[:3] += part.mass * velocity
        total[3:] += part.mass * np.cross(centre, velocity) + own
    return total


def test_pieces_of_a_motion_are_that_of_simulate(arm):
    run = simulate(arm, Plan(stop=0.6, frame=0.1, tolerance=1e-7))
    stepper = Stepper(arm, tolerance=TOLERANCE)
    for duration in (0.1, 0.013, 0.187, 1e-5, 0.29999):
        assert stepper.advance(duration).succeeded
    one = Stepper(arm, tolerance=TOLERANCE)
    one.advance(0.6)
    assert difference(stepper.displacements, one.displacements) < 1e-8
    assert stepper.time == pytest.approx(0.6, abs=1e-15)
    assert difference(stepper.displacements, last(run.displacements)) < 2e-7
    assert difference(stepper.rates, last(run.velocities)) < 2e-6
    assert difference(stepper.poses, last(run.poses)) < 2e-7
    assert np.max(np.abs(stepper.centre_of_mass - run.centre_of_mass[-1])) < 2e-7
    assert difference(stepper.energy, last(run.energy)) < 2e-6
    assert run.displacements["joint0"][-1] != pytest.approx(run.displacements["joint0"][0], abs=0.1)


def test_gravity_off_and_on_is_three_runs_joined(arm):
    stepper, plan = Stepper(arm, tolerance=TOLERANCE), Plan(tolerance=1e-8, frame=0.1)
    start = balance(stepper)
    for k, gravity in enumerate(((0.0, -9.81, 0.0), (0.0, 0.0, 0.0), (3.0, 0.0, -9.0))):
        stepper.set_gravity(gravity)
        stepper.advance(0.2)
        run = simulate(arm, replace(plan, gravity=gravity, start=0.2 * k, stop=0.2 * k + 0.2))
        plan = replace(plan, displacements=last(run.displacements), velocities=last(run.velocities))
    assert difference(stepper.displacements, last(run.displacements)) < 1e-7
    assert difference(stepper.rates, last(run.velocities)) < 1e-6
    assert balance(stepper) == pytest.approx(start, abs=1e-7)
    assert abs(stepper.energy["work"]) > 0.1
    assert stepper.agreement_with_exudyn() < 1e-11


def test_a_change_counts_from_its_time_on(arm):
    steppers = Stepper(arm), Stepper(arm, tolerance=TOLERANCE)
    steppers[0].advance(0.1)
    start = steppers[0].snapshot()
    for stepper in steppers:
        stepper.rewind(start)
        stepper.set_gravity((50.0, 0.0, 0.0))
        stepper.advance(1e-4)
    assert difference(*(stepper.rates for stepper in steppers)) < 1e-9


def test_scales_are_those_of_scaled_springs(hinges):
    springs = springs_of("joint1", STOP)
    stepper = Stepper(hinges, Plan(springs=springs), TOLERANCE)
    start = balance(stepper)
    stepper.set_scales(2.5, 0.4)
    scaled = Stepper(hinges, Plan(springs=springs.scaled(2.5, 0.4)), TOLERANCE)
    unscaled = Stepper(hinges, Plan(springs=springs), TOLERANCE)
    for one in (stepper, scaled, unscaled):
        assert one.advance(0.5).succeeded
    assert difference(stepper.displacements, scaled.displacements) < 1e-8
    assert stepper.energy["spring"] == pytest.approx(scaled.energy["spring"], abs=1e-9)
    assert stepper.energy["dissipated"] == pytest.approx(scaled.energy["dissipated"], abs=1e-9)
    assert balance(stepper) == pytest.approx(start, abs=1e-8)
    assert difference(stepper.displacements, unscaled.displacements) > 1e-2
    assert stepper.agreement_with_exudyn() < 1e-11
    stepper.set_scales()
    assert balance(stepper) == pytest.approx(start, abs=1e-8)


def test_springs_with_other_numbers_compile_nothing(hinges):
    def springs(stiffness):
        return springs_of("joint1", AxisSpring(Y, (Linear(stiffness, 0.1),)))

    stepper = Stepper(hinges, Plan(springs=springs(1.0)), TOLERANCE)
    start, laws = balance(stepper), {name for name in sys.modules if "mover_laws" in name}
    stepper.advance(0.2)
    stepper.set_springs(springs(8.0))
    assert {name for name in sys.modules if "mover_laws" in name} == laws
    assert balance(stepper) == pytest.approx(start, abs=1e-8)
    begun = simulate(hinges, Plan(stop=0.2, frame=0.1, tolerance=1e-8, springs=springs(1.0)))
    plan = Plan(
        stop=0.2,
        frame=0.1,
        tolerance=1e-8,
        springs=springs(8.0),
        displacements=last(begun.displacements),
        velocities=last(begun.velocities),
    )
    stepper.advance(0.2)
    run = simulate(hinges, plan)
    assert difference(stepper.displacements, last(run.displacements)) < 1e-7
    with pytest.raises(UnknownNameError, match="joint9"):
        stepper.set_springs(springs_of("joint9", AxisSpring(Y, (Linear(1.0),))))
    assert stepper.springs == springs(8.0)


def test_a_force_is_a_load_at_a_site(arm):
    place, force = (0.1, -0.05, 0.2), (3.0, 1.0, -2.0)
    tip = replace(arm.segments["bar2"])
    sites = {**tip.sites, "pulled": replace(tip.sites["far"], name="pulled",
                                            location=at(shift=place))}  # fmt: skip
    sited = arm.with_parts(replace(tip, sites=sites))
    load = TimedLoad(SiteRef("bar2", "pulled"), LoadKind.GLOBAL_FORCE, (0.1, 0.3), (force, force))
    run = simulate(sited, Plan(stop=0.5, frame=0.1, tolerance=1e-8, loads=[load]))
    planned = Stepper(sited, Plan(loads=[load]), TOLERANCE)
    stepper = Stepper(arm, tolerance=TOLERANCE)
    stepper.advance(0.1)
    stepper.set_force("bar2", (9.0, 9.0, 9.0), place)
    stepper.set_force("bar2", force, place)
    assert stepper.forces == {("bar2", place): force}
    stepper.advance(0.1)
    assert stepper.agreement_with_exudyn() < 1e-11
    stepper.advance(0.1)
    stepper.set_force("bar2", (0.0, 0.0, 0.0), place)
    assert stepper.forces == {}
    stepper.advance(0.2)
    assert difference(stepper.displacements, last(run.displacements)) < 1e-7
    assert stepper.energy["work"] == pytest.approx(run.energy["work"][-1], abs=1e-7)
    assert abs(run.energy["work"][-1]) > 1e-2
    for duration in (0.1, 0.15, 0.05, 0.2):
        planned.advance(duration)
    assert difference(planned.displacements, last(run.displacements)) < 1e-7


def test_a_force_acts_at_its_point_of_a_segment_that_is_joined_elsewhere():
    stepper = Stepper(two_bodies(HINGE, (0.4,), reverse=True))
    stepper.set_force("second", (3.0, 1.0, -2.0), (0.1, -0.05, 0.2))
    assert stepper.agreement_with_exudyn() < 1e-11


def test_a_lock_is_an_impact_in_the_joints(arm):
    stepper = Stepper(arm, Plan(free_root=True), TOLERANCE)
    stepper.set_force("bar2", (1.0, 2.0, 3.0), (0.3, 0.0, 0.0))
    stepper.advance(0.3)
    stepper.set_force("bar2", (0.0, 0.0, 0.0), (0.3, 0.0, 0.0))
    before, start, poses = momentum(stepper), balance(stepper), stepper.poses
    kinetic, displacements = stepper.energy["kinetic"], stepper.displacements
    stepper.lock("joint1", "joint2")
    assert stepper.locked == ("joint1", "joint2")
    assert difference(stepper.poses, poses) < 1e-14
    assert momentum(stepper) == pytest.approx(before, abs=1e-12)
    assert np.linalg.norm(before[3:]) > 1e-2
    assert stepper.energy["kinetic"] < 0.99 * kinetic
    assert balance(stepper) == pytest.approx(start, abs=1e-12)
    assert not np.any(stepper.rates["joint1"])
    assert not np.any(stepper.rates["joint2"])
    stepper.advance(0.2)
    for name in ("joint1", "joint2"):
        assert stepper.displacements[name] == pytest.approx(displacements[name], abs=1e-14)
    assert stepper.agreement_with_exudyn() < 1e-11
    rates, kinetic = stepper.rates, stepper.energy["kinetic"]
    stepper.unlock("joint2", "joint1")
    assert difference(stepper.rates, rates) < 1e-12
    assert stepper.energy["kinetic"] == pytest.approx(kinetic, abs=1e-13)
    stepper.advance(0.1)
    assert abs(stepper.displacements["joint1"][0] - displacements["joint1"][0]) > 1e-3
    assert balance(stepper) == pytest.approx(start, abs=1e-7)


def test_a_figure_with_all_joints_locked_rests(hinges):
    stepper = Stepper(hinges)
    stepper.advance(0.2)
    stepper.lock("joint1")
    stepper.lock("joint0")
    assert set(stepper.locked) == {"joint0", "joint1"}
    poses = stepper.poses
    assert stepper.energy["kinetic"] == 0.0
    assert stepper.advance(0.5).succeeded
    assert difference(stepper.poses, poses) < 1e-14
    assert stepper.agreement_with_exudyn() < 1e-11
    stepper.unlock("joint1")
    stepper.advance(0.1)
    assert abs(stepper.rates["joint1"][0]) > 0.1


def test_a_freed_figure_falls_and_is_held_again(arm):
    stepper = Stepper(arm, tolerance=TOLERANCE)
    stepper.advance(0.2)
    start, poses, kinetic = balance(stepper), stepper.poses, stepper.energy["kinetic"]
    stepper.free_root()
    assert difference(stepper.poses, poses) < 1e-13
    assert stepper.energy["kinetic"] == pytest.approx(kinetic, rel=1e-12)
    centres = [stepper.centre_of_mass]
    for _ in range(4):
        stepper.advance(0.05)
        centres.append(stepper.centre_of_mass)
    falls = np.diff(centres, 2, axis=0) / 0.05**2
    assert falls == pytest.approx(np.tile((0.0, -9.81, 0.0), (3, 1)), abs=1e-6)
    assert stepper.agreement_with_exudyn() < 1e-11
    pose = stepper.poses["bar0"]
    stepper.hold_root()
    stepper.advance(0.2)
    assert stepper.poses["bar0"] == pytest.approx(pose, abs=1e-13)
    assert np.max(np.abs(stepper.rates["joint1"])) > 0.1
    assert stepper.agreement_with_exudyn() < 1e-11
    assert balance(stepper) == pytest.approx(start, abs=1e-7)
    stepper.free_root()
    assert stepper.locked == ()
    stepper.advance(0.1)
    assert np.max(np.abs(stepper.poses["bar0"] - pose)) > 1e-2


def test_a_copy_is_independent(arm):
    stepper, alone = Stepper(arm), Stepper(arm)
    stepper.advance(0.1)
    other = stepper.copy()
    other.set_gravity((5.0, 0.0, 0.0))
    other.lock("joint1")
    other.advance(0.3)
    stepper.advance(0.2)
    for duration in (0.1, 0.2):
        alone.advance(duration)
    assert all(np.array_equal(stepper.poses[name], pose) for name, pose in alone.poses.items())
    assert stepper.locked == ()
    assert stepper.energy == alone.energy
    assert other.time == pytest.approx(0.4)


def test_rewinding_repeats_bit_by_bit(arm):
    stepper = Stepper(arm)
    stepper.advance(0.1)
    stepper.set_force("bar1", (1.0, 0.0, 0.0))
    saved = stepper.snapshot()

    def continued():
        stepper.advance(0.1)
        stepper.lock("joint1")
        stepper.advance(0.1)
        stepper.set_gravity((0.0, 1.0, 0.0))
        stepper.free_root()
        stepper.advance(0.1)
        return stepper.poses, stepper.energy

    first = continued()
    stepper.rewind(saved)
    assert stepper.time == saved.time == pytest.approx(0.1)
    assert stepper.locked == ()
    assert stepper.gravity == Plan().gravity
    assert stepper.forces == {("bar1", (0.0, 0.0, 0.0)): (1.0, 0.0, 0.0)}
    second = continued()
    assert all(np.array_equal(first[0][name], pose) for name, pose in second[0].items())
    assert first[1] == second[1]
    stepper.rewind(saved)
    assert stepper.time == saved.time == pytest.approx(0.1)


def test_what_is_read_cannot_change_the_motion(arm):
    stepper, other = Stepper(arm), Stepper(arm)
    for quantity in ("rates", "poses", "displacements"):
        for array in getattr(stepper, quantity).values():
            array[...] = 7.0
    for one in (stepper, other):
        one.advance(0.1)
    assert difference(stepper.poses, other.poses) == 0.0
    assert difference(stepper.displacements, other.displacements) == 0.0


def test_a_hinge_keeps_its_turns(hinges):
    plan = Plan(velocities={"joint0": (30.0,)}, gravity=(0.0, 0.0, 0.0), spring_choice="none")
    stepper = Stepper(hinges, plan)
    stepper.advance(1.0)
    turned = stepper.displacements["joint0"][0]
    assert turned > 4.0 * np.pi
    stepper.lock("joint0")
    stepper.advance(0.1)
    assert stepper.displacements["joint0"][0] == turned
    stepper.unlock("joint0")
    assert stepper.displacements["joint0"][0] == turned


def test_driven_joints_follow_their_drive(hinges):
    times = np.linspace(0.0, 0.4, 9)
    drives = {"joint0": Drive(times, 0.3 + np.sin(5.0 * times)[:, None])}
    run = simulate(hinges, Plan(stop=0.4, frame=0.1, tolerance=1e-8, drives=drives))
    stepper = Stepper(hinges, Plan(stop=0.4, drives=drives), TOLERANCE)
    stepper.advance(0.15)
    stepper.set_scales(1.0, 1.0)
    stepper.lock("joint1")
    assert stepper.agreement_with_exudyn() < 1e-10
    stepper = Stepper(hinges, Plan(stop=0.4, drives=drives), TOLERANCE)
    for duration in (0.15, 0.25):
        stepper.advance(duration)
    assert difference(stepper.displacements, last(run.displacements)) < 1e-7
    assert difference(stepper.rates, last(run.velocities)) < 1e-6
    with pytest.raises(ModelError, match=r"a drive ends at 0.4 s"):
        stepper.advance(0.01)
    with pytest.raises(ModelError, match="joint0 connects the figure to the ground"):
        stepper.free_root()
    with pytest.raises(ModelError, match="both locked and driven"):
        stepper.hold_root()
    assert stepper.locked == ()


def test_a_half_turn_stops_the_motion_until_something_changes():
    spinning = one_body(BALL, stiff=(0.1, 0.1, 0.1))
    plan = Plan(velocities={"pin": (8.0, 0.0, 0.0)}, gravity=(0.0, 0.0, 0.0))
    stepper = Stepper(spinning, plan)
    for _ in range(2):
        outcome = stepper.advance(2.0)
        assert outcome.ending is Ending.TURNED_OVER
        assert outcome.joint == "pin"
        assert "joint pin rotated through 180 deg at" in outcome.message
        assert outcome.last_time == stepper.time
        assert 0.1 < stepper.time < 2.0
    turned = stepper.poses["link"]
    assert np.trace(turned[:3, :3]) == pytest.approx(-1.0, abs=1e-3)
    stepper.lock("pin")
    assert stepper.advance(0.1).succeeded
    stepper.set_scales(0.0)
    assert difference(stepper.poses, {"link": turned}) < 1e-12


@dataclass(frozen=True)
class Attraction:
    """A torque that grows without bound towards an angle of 0.5 rad."""

    sign: float = 1.0

    def torque(self, angle, ops=NUMPY):
        return self.sign / (0.5 - self.sign * angle)

    def energy(self, angle, ops=NUMPY):
        return 0.0 * angle

    breakpoints = ()

    def mirrored(self):
        return Attraction(-self.sign)


def test_a_singular_torque_stops_the_motion():
    pulled = one_body(HINGE)
    plan = Plan(springs=springs_of("pin", AxisSpring(Y, (Attraction(),))), gravity=(0, 0, 0))
    stepper = Stepper(pulled, plan)
    outcome = stepper.advance(1.0)
    assert outcome.ending is Ending.SOLVER_FAILED
    assert outcome.message.endswith("the fastest joint was pin")
    assert outcome.last_time == stepper.time > 0.0
    assert 0.49 < stepper.displacements["pin"][0] <= 0.5
    other = stepper.copy()
    other.set_scales(0.0)
    assert other.advance(0.1).succeeded
    assert other.displacements["pin"][0] > 0.5
    stepper.lock("pin")
    assert stepper.advance(0.5).succeeded
    assert stepper.time == outcome.last_time + 0.5


def test_a_stiff_motion_is_stopped_after_many_steps():
    slow = one_body(HINGE, damp=(1e6,))
    stepper = Stepper(slow, Plan(gravity=(0.0, 0.0, -9.81)))
    outcome = stepper.advance(1 / 60)
    assert outcome.ending is Ending.TOO_LONG
    assert "more than 100,000 steps a second" in outcome.message
    assert 0.0 < stepper.time < 1 / 60
    stepper.set_scales(1.0, 0.0)
    assert stepper.advance(1 / 60).succeeded


LOOP = figure(
    [ground(other=at(shift=(0.3, 0.0, 0.0))), body("a", sites={"far": at(shift=(0.3, 0.0, 0.0))})],
    [joint("one", "ground.base", "a.near", HINGE), joint("two", "a.far", "ground.other", HINGE)],
)
LINK = Links((Link(Coordinate("joint1", 0), Coordinate("joint0", 0), 0.5),))


@pytest.mark.parametrize(
    ("wrong", "plan", "reason"),
    [
        (LOOP, Plan(), "the figure has closed loops"),
        (None, Plan(links=LINK), "rotations are linked"),
        (None, Plan(step=1e-3), "the plan asks for a fixed step"),
        (None, Plan(python_torques=True), "the torques are Python functions"),
        (None, Plan(integrator=Integrator.EXUDYN), "the plan asks for Exudyn's integrator"),
        (None, Plan(tone=Tone({"all": 0.1}, strengths={"first": (1.0, 1.0)})), "the plan has tone"),
    ],
)
def test_what_is_not_supported_is_refused(hinges, wrong, plan, reason):
    with pytest.raises(ModelError, match=f"cannot be simulated step by step: {reason}"):
        Stepper(wrong or hinges, plan)


def test_wrong_changes_leave_the_stepper_unchanged(hinges):
    stepper = Stepper(hinges)
    stepper.advance(0.1)
    poses = stepper.poses
    for change, error, message in (
        (lambda: stepper.lock("joint7"), UnknownNameError, "joint7"),
        (lambda: stepper.unlock("joint7"), UnknownNameError, "joint7"),
        (lambda: stepper.set_force("bar7", (1, 0, 0)), UnknownNameError, "bar7"),
        (lambda: stepper.set_force("ground", (1, 0, 0)), ModelError, "ground does not move"),
        (lambda: stepper.set_force("bar1", (1, 0)), ModelError, "three finite components"),
        (lambda: stepper.set_gravity((0, np.nan, 0)), ModelError, "three finite components"),
        (lambda: stepper.set_scales(-1.0), ModelError, "not negative"),
        (lambda: stepper.advance(0.0), ValueError, "positive"),
        (lambda: stepper.advance(np.inf), ValueError, "positive"),
        (lambda: Stepper(hinges, tolerance=0.0), ValueError, "positive"),
    ):
        with pytest.raises(error, match=message):
            change()
    assert stepper.time == pytest.approx(0.1)
    assert difference(stepper.poses, poses) == 0.0


@pytest.mark.skipif(not STATUS.exists(), reason="the system does not report its memory")
def test_changes_and_runs_free_their_memory(hinges):
    def resident() -> float:
        """Resident memory [MB]."""
        lines = dict(line.split(":", 1) for line in STATUS.read_text().splitlines())
        return float(lines["VmRSS"].split()[0]) / 1e3

    stepper = Stepper(hinges)

    def work(count):
        for _ in range(count):
            stepper.advance(1e-3)
            stepper.lock("joint1")
            stepper.unlock("joint1")
            simulate(hinges, Plan(stop=0.01, frame=0.01))
        gc.collect()

    work(10)
    before, functions = resident(), len(sys.modules)
    work(40)
    assert resident() - before < 1.0
    assert len(sys.modules) == functions


def test_what_is_no_figure_and_no_snapshot_is_refused() -> None:
    with pytest.raises(TypeError, match="needs a Model or a Figure"):
        Stepper("pendulum")
    stepper = Stepper(read_figure("pendulum"))
    with pytest.raises(TypeError, match="to a snapshot"):
        stepper.rewind(None)
    other = Stepper(read_figure("prototype"))
    other.free_root()
    freed = other.snapshot()
    other.hold_root()
    other.rewind(freed)
    with pytest.raises(ModelError, match="another figure"):
        stepper.rewind(freed)


FLOOR = Scene((floor_prop((0.0, 1.0, 0.0)),))


def on_spheres(bars: Figure) -> Figure:
    """The same bars with a contact sphere at each end."""
    ends = tuple(ContactSphere((0.0, 0.0, z), 0.04) for z in (0.0, 0.3))
    parts = (replace(bar, contact_spheres=ends) for bar in bars.bodies.values())
    return bars.with_parts(*parts)


@pytest.fixture(scope="module")
def spheres(hinges) -> Figure:
    return on_spheres(hinges)


def test_a_fall_on_the_floor_is_that_of_simulate(spheres):
    plan = Plan(stop=0.8, frame=0.1, tolerance=1e-6, scene=FLOOR, free_root=True, height=0.1)
    run = simulate(spheres, plan)
    stepper = Stepper(spheres, plan, TOLERANCE)
    start = balance(stepper)
    for duration in (0.1, 0.13, 0.07, 0.5):
        assert stepper.advance(duration).succeeded
        assert stepper.agreement_with_exudyn() < 1e-11
    assert difference(stepper.displacements, last(run.displacements)) < 1e-6
    assert difference(stepper.poses, last(run.poses)) < 1e-6
    forces = {name: rows[-1] for name, rows in run.contact.forces.items()}
    assert stepper.contact_forces.keys() == forces.keys() == spheres.bodies.keys()
    assert difference(stepper.contact_forces, forces) < 0.01
    assert max(force[1] for force in forces.values()) > 5.0
    assert stepper.energy.keys() == run.energy.keys()
    assert difference(stepper.energy, last(run.energy)) < 1e-4
    assert stepper.energy["friction"] > 0.1
    assert balance(stepper) == pytest.approx(start, abs=1e-6)


def integrals(stepper: Stepper) -> np.ndarray:
    """Impulses on the segments since the start [N s]."""
    state = stepper.snapshot()
    return state.progress.state[-state.model.integrals : -POWERS].copy()


def test_a_freed_figure_falls_on_the_floor_and_is_held_on_it(spheres):
    floor = Prop("low", Plane((0.0, -1.0, 0.0), Y), Surface())
    stepper = Stepper(spheres, Plan(scene=Scene((floor,))), TOLERANCE)
    start = balance(stepper)
    stepper.advance(0.1)
    assert not any(force.any() for force in stepper.contact_forces.values())
    stepper.free_root()
    stepper.advance(0.8)
    before, poses = stepper.energy, stepper.poses
    assert before["contact damping"] > 0.1
    assert before["friction"] > 0.1
    impulses = integrals(stepper)
    assert np.min(impulses[[1, 4]]) > 1.0
    forces = stepper.contact_forces
    assert sum(force[1] for force in forces.values()) > 5.0
    stepper.lock("joint1")
    stepper.hold_root()
    assert stepper.energy["kinetic"] == 0.0
    assert np.array_equal(integrals(stepper), impulses)
    for kind in ("contact", "contact damping", "friction"):
        assert stepper.energy[kind] == pytest.approx(before[kind], rel=1e-12)
    assert difference(stepper.poses, poses) < 1e-14
    assert balance(stepper) == pytest.approx(start, abs=1e-6)
    stepper.unlock("joint1")
    stepper.advance(0.1)
    stepper.free_root()
    stepper.advance(0.1)
    assert stepper.agreement_with_exudyn() < 1e-11
    assert balance(stepper) == pytest.approx(start, abs=1e-6)


def test_a_start_inside_the_floor_is_refused(spheres):
    with pytest.raises(ModelError, match=r"starts .* cm inside floor: raise the figure"):
        Stepper(spheres, Plan(scene=FLOOR, free_root=True, height=-0.01))


def test_a_stopped_figure_starts_again_from_rest(spheres):
    plan = Plan(scene=FLOOR, free_root=True, height=0.05)
    stepper = Stepper(spheres, plan, TOLERANCE)
    stepper.advance(0.2)
    start, poses, before = balance(stepper), stepper.poses, stepper.energy
    other = stepper.copy()
    stepper.stop()
    assert stepper.kinetic_energy == stepper.energy["kinetic"] == 0.0
    assert difference(stepper.poses, poses) == 0.0
    assert not any(rate.any() for rate in stepper.rates.values())
    assert balance(stepper) == pytest.approx(start, abs=1e-12)
    assert other.kinetic_energy == before["kinetic"] > 0.1
    assert stepper.agreement_with_exudyn() < 1e-11
    stepper.advance(0.1)
    assert balance(stepper) == pytest.approx(start, abs=1e-6)


def test_a_stop_leaves_drives(hinges):
    times = np.linspace(0.0, 0.4, 9)
    drives = {"joint0": Drive(times, (2.0 * times)[:, None])}
    stepper = Stepper(hinges, Plan(stop=0.4, drives=drives), TOLERANCE)
    stepper.advance(0.1)
    stepper.stop()
    assert stepper.rates["joint1"] == pytest.approx([0.0])
    assert stepper.rates["joint0"] == pytest.approx([2.0])


def test_other_props_keep_the_figure_and_the_balance(spheres):
    plan = Plan(scene=FLOOR, free_root=True, height=0.02)
    stepper = Stepper(spheres, plan, TOLERANCE)
    stepper.advance(0.3)
    start, poses, rates = balance(stepper), stepper.poses, stepper.rates
    lower = Prop("lower", Plane((0.0, -0.002, 0.0), Y), Surface(stiffness=1e4))
    stored = stepper.energy["contact"]
    stepper.set_scene(Scene((lower,)))
    assert difference(stepper.poses, poses) < 1e-14
    assert difference(stepper.rates, rates) < 1e-12
    assert stepper.energy["contact"] < 0.9 * stored
    assert balance(stepper) == pytest.approx(start, abs=1e-12)
    assert stepper.agreement_with_exudyn() < 1e-11
    stepper.advance(0.3)
    assert balance(stepper) == pytest.approx(start, abs=1e-6)
    higher = Prop("higher", Plane((0.0, 0.05, 0.0), Y), Surface())
    with pytest.raises(ModelError, match=r"segment bar. is .* cm inside higher"):
        stepper.set_scene(Scene((higher,)))
    assert balance(stepper) == pytest.approx(start, abs=1e-6)


def test_a_floor_is_removed_and_put_back(spheres):
    floor = Scene((Prop("low", Plane((0.0, -0.8, 0.0), Y), Surface()),))
    stepper, planned = (
        Stepper(spheres, Plan(scene=scene, free_root=True), TOLERANCE) for scene in (Scene(), floor)
    )
    start = balance(stepper)
    stepper.advance(0.1)
    assert "contact" not in stepper.energy
    stepper.set_scene(floor)
    stepper.advance(0.7)
    planned.advance(0.1)
    planned.advance(0.7)
    assert difference(stepper.displacements, planned.displacements) < 1e-6
    assert stepper.energy["friction"] > 0.01
    assert balance(stepper) == pytest.approx(start, abs=1e-5)
    assert stepper.agreement_with_exudyn() < 1e-11
    lost, poses = stepper.energy["friction"], stepper.poses
    stepper.set_scene(Scene())
    assert difference(stepper.poses, poses) < 1e-14
    assert stepper.contact_forces == {}
    stepper.advance(0.3)
    assert stepper.energy["friction"] == lost
    assert stepper.energy["contact"] == 0.0
    assert balance(stepper) == pytest.approx(start, abs=1e-5)
    assert stepper.agreement_with_exudyn() < 1e-11
    with pytest.raises(ModelError, match=r"segment bar. is .* cm inside low: raise the figure"):
        stepper.set_scene(floor)
    assert stepper.contact_forces == {}
