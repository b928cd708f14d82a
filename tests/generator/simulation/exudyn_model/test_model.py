"""The figure as a live Exudyn system, and what is refused before it becomes one."""

from dataclasses import replace

import numpy as np
import pytest

from generator import UnknownNameError, read_figure
from generator.contact.box import Box
from generator.contact.plane import Plane
from generator.contact.scene import Prop, Scene
from generator.diagnostics import InputError, ModelError, MoverError
from generator.figure import SiteRef
from generator.kinematics.loops import OpenLoopError
from generator.loads import LoadKind, constant_load
from generator.model import Model
from generator.simulation.exudyn_model.exudyn_api import exu, items
from generator.simulation.exudyn_model.model import ExudynModel, build_model
from generator.simulation.plan import Plan
from generator.simulation.run_model import initial_state
from generator.springs_file.read import read_springs
from springs import AxisSpring, JointSprings, Linear, SpringSet
from springs.contact import Surface
from tests.chains import BALL, Z, body, figure, ground, joint, one_body, row
from tests.contact_figures import FLOOR, ball, with_spheres

PROTOTYPE = read_figure("prototype")
FOURBAR = read_figure("fourbar")


@pytest.fixture(scope="module")
def prototype() -> ExudynModel:
    return build_model(PROTOTYPE)


def test_names_lead_to_items_and_wrong_ones_to_the_nearest(prototype) -> None:
    assert repr(prototype) == f"<ExudynModel of {prototype.figure!r}>"
    with pytest.raises(
        UnknownNameError, match=r"no site `left_lower_arm\.distl`; did you mean `left_l"
    ):
        _ = prototype.sites["left_lower_arm.distl"]
    with pytest.raises(UnknownNameError, match="no springs at joint `root_torso`; "):
        _ = prototype.springs["root_torso"]


def test_every_segment_joint_and_site_is_there_by_name(prototype) -> None:
    made = prototype.figure
    assert set(prototype.bodies) == set(made.segments)
    assert set(prototype.joints) == set(made.joints)
    assert set(prototype.sites) == {
        f"{s.name}.{site}" for s in made.segments.values() for site in s.sites
    }
    assert set(prototype.springs) == set(made.joints) - {"root_torso"}


def test_bodies_have_the_segments_mass_and_inertia(prototype) -> None:
    for name, segment in prototype.figure.bodies.items():
        item = prototype.mbs.GetObject(prototype.bodies[name])
        assert item["mass"] == segment.mass
        assert np.allclose(item["inertia"], [*segment.inertia, 0, 0, 0])


def test_sites_are_where_the_placement_puts_them(prototype) -> None:
    for name, marker in prototype.sites.items():
        segment, site = name.split(".")
        pose = (
            prototype.placement.poses[segment]
            @ prototype.figure.site(SiteRef(segment, site)).pose_in_segment
        )
        found = prototype.mbs.GetMarkerOutput(marker, exu.OutputVariableType.Position)
        turned = prototype.mbs.GetMarkerOutput(marker, exu.OutputVariableType.RotationMatrix)
        assert np.allclose(found, pose[:3, 3], atol=1e-12)
        assert np.allclose(np.reshape(turned, (3, 3)), pose[:3, :3], atol=1e-12)


def test_it_counts_the_freedoms(prototype) -> None:
    """Ten bodies of seven coordinates, their norms, and what the joints lock: 22 freedoms."""
    data = prototype.mbs.systemData
    bodies = len(prototype.figure.bodies)
    locked = sum(
        sum(c.locked_axes.translations) + sum(c.locked_axes.rotations)
        for constraints in prototype.joints.values()
        for c in constraints
    )
    assert data.ODE2Size() == 7 * bodies
    assert data.AEsize() == bodies + locked
    assert 6 * bodies - locked == 22


def test_building_into_the_caller_s_system() -> None:
    """The caller assembles; his own items and the figure's move together."""
    container = exu.SystemContainer()
    mbs = container.AddSystem()
    node = mbs.AddNode(items.NodePoint(referenceCoordinates=[0.0, 1.0, 0.0]))
    mass = mbs.AddObject(items.ObjectMassPoint(physicsMass=1.0, nodeNumber=node))
    force = mbs.AddMarker(items.MarkerBodyMass(bodyNumber=mass))
    mbs.AddLoad(items.LoadMassProportional(markerNumber=force, loadVector=[0.0, -9.81, 0.0]))
    assembly = build_model(Model(row(2)), Plan(), mbs)
    assert assembly.mbs is mbs
    assert assembly.container is None
    mbs.Assemble()
    settings = exu.SimulationSettings()
    settings.timeIntegration.endTime = 0.1
    settings.timeIntegration.numberOfSteps = 100
    settings.solution.file.write = False
    mbs.SolveDynamic(settings, solverType=exu.DynamicSolverType.TrapezoidalIndex2)
    kinds = exu.OutputVariableType
    assert mbs.GetObjectOutputBody(mass, kinds.Position)[1] == pytest.approx(1.0 - 0.5 * 0.0981)
    fallen = mbs.GetObjectOutputBody(assembly.bodies["bar1"], kinds.Displacement)
    assert fallen[1] < -0.01


def test_one_system_holds_a_figure_twice() -> None:
    container = exu.SystemContainer()
    mbs = container.AddSystem()
    springs = SpringSet({"joint0": JointSprings("joint0", (AxisSpring(Z, (Linear(3.0),)),))})
    one, other = (build_model(Model(row(2), springs), Plan(), mbs) for _ in range(2))
    mbs.Assemble()
    assert one.bodies["bar0"] != other.bodies["bar0"]
    assert mbs.GetObject(one.bodies["bar0"])["name"] == "bar0"
    assert mbs.GetObject(other.bodies["bar0"])["name"] == "bar0 2"


def test_a_joint_may_be_called_like_a_segment() -> None:
    made = figure([ground(), body("a")], [joint("a", "ground.base", "a.near", BALL)])
    springs = SpringSet({"a": JointSprings("a", (AxisSpring(Z, (Linear(3.0),)),))})
    assembly = build_model(Model(made, springs), Plan())
    assert assembly.mbs.GetObject(assembly.bodies["a"])["name"] == "a"


def test_springs_of_the_plan_or_the_figure() -> None:
    figure_with = row(1, (BALL,), stiff=5.0)
    assert set(build_model(figure_with).springs) == {"joint0"}
    assert build_model(figure_with, Plan(spring_choice="none")).springs == {}
    assert read_springs(None, figure_with).joints["joint0"].axes[0].elastic == (Linear(5.0, 0.0),)


def test_springs_of_an_unknown_joint_are_refused() -> None:
    springs = SpringSet({"joint1": JointSprings("joint1", (AxisSpring(Z, (Linear(3.0),)),))})
    with pytest.raises(ModelError, match="for joint `joint1`, unknown to the figure; did you mean"):
        build_model(Model(row(1), springs), Plan())


@pytest.mark.parametrize(
    ("given", "reason"),
    [
        ({"displacements": {"knee": (0.1,)}}, "no joint `knee`; known here: pin"),
        ({"displacements": {"pin": (0.1,)}}, "3 displacements, not 1"),
        ({"displacements": {"pin": (0.1, float("nan"), 0.0)}}, "not finite"),
        ({"velocities": {"knee": (0.1,)}}, "no joint `knee`; known here: pin"),
        ({"velocities": {"pin": (0.1, 0.2)}}, "3 displacements, not 2"),
        ({"velocities": {"link": (0.0,) * 6}}, "no joint `link`; known"),
        ({"velocities": {"pin": (0.0,) * 3}, "free_root": True}, "no joint `pin`; known"),
    ],
)
def test_plans_that_do_not_fit_the_figure(given, reason) -> None:
    with pytest.raises(ModelError, match=reason):
        initial_state(one_body(BALL), Plan(**given))


@pytest.mark.parametrize("missing", ["mass", "inertia", "CM"])
def test_a_segment_without_what_it_needs(missing: str) -> None:
    link = body("link")
    if missing == "CM":
        link = replace(link, sites={"near": link.sites["near"]})
    else:
        link = replace(link, **{missing: None})
    with pytest.raises(InputError, match=f"segment `link` .* no .*{missing}"):
        build_model(Model(one_body(BALL, segment=link)), Plan())


def test_a_figure_in_which_nothing_moves() -> None:
    with pytest.raises(ModelError, match="none of its segments moves"):
        build_model(Model(figure([ground()], [])), Plan())


def test_a_pose_that_opens_a_loop_is_refused_with_the_gap() -> None:
    plan = Plan(displacements={"crank_bearing": (0.3,), "rocker_bearing": (0.3,)})
    with pytest.raises(OpenLoopError, match=r"\d mm"):
        build_model(Model(FOURBAR), plan)
    assert issubclass(OpenLoopError, MoverError)


def test_loads_have_a_marker_at_their_site() -> None:
    load = constant_load(SiteRef("link", "near"), LoadKind.LOCAL_FORCE, (1.0, 0.0, 0.0), 0.0, 1.0)
    assembly = build_model(Model(one_body(BALL)), Plan(loads=[load]))
    (kept,), ((marker, _),) = assembly.loads, assembly.load_items
    assert kept is load
    found = assembly.mbs.GetMarkerOutput(marker, exu.OutputVariableType.Position)
    assert np.allclose(found, 0.0)


# Props

FLOOR_AND_CRATE = Scene(
    (*FLOOR.props, Prop("crate", Box((1.0, 0.2, 0.0), (0.4, 0.4, 0.4)), Surface()))
)


def test_the_start_inside_a_prop_is_refused_with_its_depth() -> None:
    """The deepest one, by name; touching is no penetration."""
    with pytest.raises(ModelError, match=r"starts 1\.5 cm inside floor: raise the figure by 2 cm"):
        build_model(Model(ball(-0.015)), Plan(scene=FLOOR))
    made = build_model(Model(ball(0.0)), Plan(scene=FLOOR))
    assert made.contacts is not None
    build_model(Model(ball(-1e-7)), Plan(scene=FLOOR))
    build_model(Model(ball(-0.015)), Plan())
    inside = {"pin": (0.0, 0.0, 0.0, 1.0, 0.09 + 0.35, 0.0)}
    with pytest.raises(ModelError, match="starts 6 cm inside crate: raise the figure by 6 cm"):
        build_model(Model(ball(0.0)), Plan(scene=FLOOR_AND_CRATE, displacements=inside))


def test_the_start_inside_a_prop_names_the_segment() -> None:
    made = row(2)
    segments = [
        with_spheres(made.segments[f"bar{k}"], ((0.15, 0.0, 0.0), radius))
        for k, radius in enumerate((0.05, 0.25))
    ]
    straight = {"joint0": (0.0,) * 3, "joint1": (0.0,) * 3}
    low = Scene((Prop("mat", Plane((0.0, -0.2, 0.0), (0.0, 1.0, 0.0)), Surface()),))
    plan = Plan(scene=low, displacements=straight)
    with pytest.raises(ModelError, match="segment bar1 starts 5 cm inside mat"):
        initial_state(made.with_parts(*segments), plan)


def test_the_height_is_that_of_the_lowest_sphere() -> None:
    """In a scene; else that of the lowest vertex. Height is measured along minus gravity."""
    up = np.array([0.6, 0.8, 0.0])
    gravity = tuple(-9.81 * up)
    for height in (0.0, 0.3):
        plan = Plan(free_root=True, height=height, scene=FLOOR, gravity=gravity)
        scene = Scene((Prop("slope", Plane((0.0, 0.0, 0.0), tuple(up)), Surface()),))
        start = initial_state(PROTOTYPE, replace(plan, scene=scene))
        lowest = min(
            (start.placement.poses[name] @ np.append(sphere.centre, 1.0))[:3] @ up - sphere.radius
            for name, some in start.spheres.items()
            for sphere in some
        )
        assert lowest == pytest.approx(height, abs=1e-12)
        without = initial_state(PROTOTYPE, replace(plan, scene=Scene()))
        moved = start.placement.poses["lower_torso"] - without.placement.poses["lower_torso"]
        shift = moved[:3, 3]
        assert 1e-5 < np.linalg.norm(shift) < 0.05
        assert np.cross(shift, up) == pytest.approx(0.0, abs=1e-12)
        assert without.spheres == {}


def test_spheres_are_those_of_the_moving_segments() -> None:
    """Own ones in place of those fitted to a psurf."""
    own = with_spheres(PROTOTYPE.segments["left_upper_arm"], ((0.0, 0.0, 0.0), 0.04))
    plan = Plan(free_root=True, height=0.0, scene=FLOOR)
    spheres = initial_state(PROTOTYPE.with_parts(own), plan).spheres
    assert list(spheres) == list(PROTOTYPE.bodies)
    assert spheres["left_upper_arm"] == own.contact_spheres
    assert spheres["right_upper_arm"] == initial_state(PROTOTYPE, plan).spheres["right_upper_arm"]
    made = build_model(PROTOTYPE.with_parts(own), plan)
    assert made.contacts is not None
    assert made.contacts.spheres == spheres
    assert made.contacts.scene is plan.scene


def test_a_figure_without_a_contact_sphere_touches_nothing() -> None:
    """A segment whose mass is not known has not even a capsule."""
    bare = one_body(BALL, segment=replace(body("link"), mass=None))
    assert initial_state(bare, Plan()).spheres == {}
    with pytest.raises(ModelError, match="cannot touch anything: no segment has a contact sphere"):
        initial_state(bare, Plan(scene=FLOOR))


def test_an_empty_scene_builds_no_contact(prototype) -> None:
    assert prototype.contacts is None
    assert build_model(ball(0.1), Plan(scene=Scene())).contacts is None
