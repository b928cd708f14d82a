"""Static moments, against inverse dynamics of MuJoCo and by laws of statics."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from generator.figure import Figure
from generator.figure_file import FIGURE_FILE
from generator.hold.posture import Holder
from generator.hold.statics import Load, load_wrenches, net_moments, site_point, weight_wrenches
from generator.kinematics.placement import Placement, forward_kinematics, initial_displacements
from generator.kinematics.tree import build_tree
from generator.model import Model
from generator.model_files.formats import read_model
from generator.model_files.mjcf.write import format_mjcf
from generator.rotations import Array, quaternion_from_matrix
from springs import SpringSet
from tests.generator.model_files.engines import OpenSim
from tests.generator.model_files.imported_models import MODELS

PERSONS = ("male50", "female50")


def figure_of(name: str) -> Figure:
    if name in PERSONS:
        return FIGURE_FILE.read(name)
    return read_model(MODELS / name).figure


def random_displacements(of: Figure, random: np.random.Generator) -> dict[str, Array]:
    """Angles up to 0.8 rad, translations up to a centimetre."""
    found: dict[str, Array] = {}
    for name, joint in of.joints.items():
        size = np.array([0.8 if any(axis.twist.angular) else 0.01 for axis in joint.chain])
        found[name] = random.uniform(-size, size)
    return found


def random_loads(of: Figure, random: np.random.Generator) -> list[Load]:
    names = [name for name, body in of.bodies.items() if body.centre_of_mass is not None]
    chosen = random.choice(names, 3, replace=False).tolist()
    return [
        Load(name, float(random.uniform(0, 20)), tuple(random.uniform(-80, 80, 3).tolist()))
        for name in chosen
    ]


def required_in_mujoco(
    of: Figure, model: Any, placement: Placement, loads: list[Load]
) -> dict[str, Array]:
    """What joints must supply, along our displacements, by `mj_inverse`."""
    api: Any = pytest.importorskip("mujoco")
    data = api.MjData(model)
    tree = placement.tree
    for index in range(model.njnt):
        one = model.joint(index)
        name, _, number = one.name.rpartition("_")
        start = model.jnt_qposadr[index]
        if one.type[0] == api.mjtJoint.mjJNT_FREE:
            pose = placement.poses[model.body(model.jnt_bodyid[index]).name]
            data.qpos[start : start + 3] = pose[:3, 3]
            data.qpos[start + 3 : start + 7] = quaternion_from_matrix(pose[:3, :3])
        elif one.type[0] == api.mjtJoint.mjJNT_BALL:
            joint = of.joints[one.name]
            site = of.site(joint.child).pose_in_segment[:3, :3]
            turn = site @ placement.pose_in_parent(joint)[:3, :3] @ site.T
            data.qpos[start : start + 4] = quaternion_from_matrix(turn)
        elif one.name in of.joints:
            data.qpos[start] = placement.displacements[one.name][0]
        else:
            data.qpos[start] = placement.displacements[name][int(number) - 1]
    api.mj_forward(model, data)
    for name in of.bodies:
        body = data.body(name if name != "world" else "world_2")
        assert np.allclose(body.xpos, placement.poses[name][:3, 3], atol=1e-10)
    applied = np.zeros(model.nv)
    for load in loads:
        point = site_point(placement, load.segment, load.site)
        body = model.body(load.segment).id
        api.mj_applyFT(model, data, load.total, np.zeros(3), point, body, applied)
    data.qacc[:] = 0.0
    api.mj_inverse(model, data)
    needed = np.array(data.qfrc_inverse) - applied
    kinematics = tree.kinematics
    twists = kinematics.twists(kinematics.displacement_vector(placement.displacements))
    found = {name: np.zeros(len(of.joints[name].chain)) for name in kinematics.columns}
    for index in range(model.njnt):
        one = model.joint(index)
        name, _, number = one.name.rpartition("_")
        start = model.jnt_dofadr[index]
        if one.type[0] == api.mjtJoint.mjJNT_FREE:
            body = model.jnt_bodyid[index]
            rotation, place = data.xmat[body].reshape(3, 3), data.xpos[body]
            force = needed[start : start + 3]
            moment = rotation @ needed[start + 3 : start + 6] + np.cross(place, force)
            rows = twists[kinematics.columns[one.name]]
            found[one.name] = rows @ np.concatenate([moment, force])
        elif one.type[0] == api.mjtJoint.mjJNT_BALL:
            rotation = data.xmat[model.jnt_bodyid[index]].reshape(3, 3)
            torque = rotation @ needed[start : start + 3]
            turns = list(tree.chains[one.name].rotations)
            rows = twists[kinematics.columns[one.name]]
            found[one.name][turns] = rows[turns, :3] @ torque
        elif one.name in of.joints:
            found[one.name][0] = needed[start]
        else:
            found[name][int(number) - 1] = needed[start]
    return found


@pytest.mark.slow
@pytest.mark.verify
@pytest.mark.parametrize("name", [*PERSONS, "humanoid.xml"])
def test_moments_are_those_of_mujoco(name: str):
    api: Any = pytest.importorskip("mujoco")
    of, random = figure_of(name), np.random.default_rng(3)
    tree, largest = build_tree(of), 0.0
    model = api.MjModel.from_xml_string(format_mjcf(of, SpringSet())[0])
    model.opt.disableflags = api.mjtDisableBit.mjDSBL_CONSTRAINT
    for _ in range(200):
        placement = forward_kinematics(tree, random_displacements(of, random))
        loads = random_loads(of, random)
        wrenches = weight_wrenches(placement, of) + load_wrenches(placement, loads)
        own = net_moments(placement, wrenches)
        for joint, expected in required_in_mujoco(of, model, placement, loads).items():
            largest = max(largest, float(np.abs(own[joint] - expected).max(initial=0.0)))
    assert largest < 1e-6


def required_in_opensim(engine: OpenSim, placement: Placement, loads: list[Load]) -> Array:
    """What coordinates must supply, in their order, by `InverseDynamicsSolver`."""
    api, model, state = engine.api, engine.model, engine.state
    engine.set(placement.displacements)
    model.realizeDynamics(state)
    bodies = [model.getBodySet().get(k) for k in range(model.getBodySet().getSize())]
    indices = {body.getName(): int(body.getMobilizedBodyIndex()) for body in bodies}
    none = api.SpatialVec(api.Vec3(0.0), api.Vec3(0.0))
    applied = api.VectorOfSpatialVec(1 + max(indices.values()), none)
    for one in load_wrenches(placement, loads):
        moment = np.cross(one.point - placement.poses[one.segment][:3, 3], one.force)
        parts = api.Vec3(*moment.tolist()), api.Vec3(*one.force.tolist())
        applied.set(indices[one.segment], api.SpatialVec(*parts))
    solver, still = api.InverseDynamicsSolver(model), api.Vector(state.getNU(), 0.0)
    # With stated forces the solver leaves out gravity, which it has without them.
    both = [solver.solve(state, still), solver.solve(state, still, still, applied)]
    return sum(np.array([part.get(k) for k in range(state.getNU())]) for part in both)


@pytest.mark.slow
@pytest.mark.verify
@pytest.mark.parametrize("name", [*PERSONS, "humanoid.xml"])
def test_moments_are_those_of_opensim(name: str, tmp_path: Path):
    of, random = figure_of(name), np.random.default_rng(4)
    tree, engine, largest = build_tree(of), OpenSim(of, SpringSet(), tmp_path), 0.0
    order = coordinate_order(engine)
    for _ in range(200):
        placement = forward_kinematics(tree, random_displacements(of, random))
        loads = [load for load in random_loads(of, random) if load.segment in of.bodies]
        wrenches = weight_wrenches(placement, of) + load_wrenches(placement, loads)
        needed = required_in_opensim(engine, placement, loads)
        for joint, moments in net_moments(placement, wrenches).items():
            for k, moment in enumerate(moments, 1):
                largest = max(largest, abs(moment - needed[order[f"{joint}_{k}"]]))
    assert largest < 1e-6


def coordinate_order(engine: OpenSim) -> dict[str, int]:
    """Indices of the coordinates in the state, by name."""
    names = engine.model.getCoordinateSet()
    coordinates = [names.get(k) for k in range(names.getSize())]
    order: dict[str, int] = {}
    for one in coordinates:
        for other in coordinates:
            other.setValue(engine.state, float(other is one), False)
        values = engine.state.getQ()
        order[one.getName()] = int(np.argmax([values.get(k) for k in range(values.size())]))
    return order


@pytest.mark.parametrize("name", PERSONS)
def test_mirror_image_has_mirrored_moments(name: str):
    holder = Holder.of(Model.of(FIGURE_FILE.read(name)))
    angles = {"left_hip_joint": (0.1, 0.2, 0.5), "right_hip_joint": (0.0, 0.1, 0.3)}
    angles |= {"left_knee": (0.9,), "right_knee": (0.5,), "left_shoulder": (0.2, 0.3, 1.0)}
    angles |= {"left_elbow": (0.2, 0.7), "right_elbow": (-0.1, 1.2), "waist": (0.1, 0.05, 0.4)}
    mirrored = {other_side(joint): np.array(row) for joint, row in angles.items()}
    mirrored["waist"] = np.array([-0.1, -0.05, 0.4])
    plain = {joint: np.array(row) for joint, row in angles.items()}
    one = holder.posture(plain, [Load("left_hand", 4.0, (3.0, 5.0, 7.0))], must_balance=False)
    other = holder.posture(
        mirrored, [Load("right_hand", 4.0, (-3.0, 5.0, 7.0))], must_balance=False
    )
    demands = {(each.joint, each.direction): each for each in other.joints}
    for own in one.joints:
        direction = own.direction
        for side, opposite in (
            (" to the left", " to the right"),
            (" to the right", " to the left"),
        ):
            if direction.endswith(side):
                direction = direction.removesuffix(side) + opposite
                break
        if own.active < 1e-9:
            continue
        image = demands[other_side(own.joint), direction]
        assert image.active == pytest.approx(own.active, abs=1e-9)
        assert image.capacity == own.capacity
    assert one.hands[0].force == pytest.approx(other.hands[0].force)
    assert one.hands[0].strength.capacity == pytest.approx(other.hands[0].strength.capacity)
    assert one.spine is not None
    assert other.spine is not None
    assert one.spine.compression == pytest.approx(other.spine.compression, abs=1e-9)


def other_side(joint: str) -> str:
    side, _, rest = joint.partition("_")
    return {"left": "right", "right": "left"}.get(side, side) + (f"_{rest}" if rest else "")


@pytest.mark.parametrize("supports", [None, ("left_foot",), ("left_foot", "right_hand.CM", "seat")])
def test_weights_loads_and_supports_are_in_equilibrium(supports: tuple[str, ...] | None):
    of, random = FIGURE_FILE.read("male50"), np.random.default_rng(8)
    holder = Holder.of(Model.of(of), supports=supports)
    start = initial_displacements(holder.tree)
    for _ in range(5):
        pose = {name: row + random.uniform(-0.1, 0.1, len(row)) for name, row in start.items()}
        pose |= {"neck": np.zeros(6)}
        if supports is None:
            pose = start
        found = holder.posture(pose, random_loads(of, random), must_balance=False)
        assert found.residual < 1e-9
        # The root's displacements are those of the whole body.
        assert np.abs(found.net["root_torso"]).max() < 1e-9


def test_models_of_other_programs_are_judged_without_strengths(tmp_path: Path):
    imported = read_model(MODELS / "humanoid.xml")
    holder = Holder.of(Model(imported.figure, SpringSet()), supports=("ground",))
    assert holder.body is None
    assert holder.posture().weakest is None
