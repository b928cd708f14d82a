"""Exported models move as we do in OpenSim and MuJoCo, but for the stated errors of their laws."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from benchmarks import exports
from benchmarks.exported import (
    ExportedModel,
    MuJoCoModel,
    OpenSimModel,
    difference,
    moment_differences,
    our_moments,
    stated_errors,
)
from benchmarks.exports import Case, our_fall
from springs import SpringSet

pytestmark = pytest.mark.verify

CASES = {case.name: case for case in exports.cases()}
ENGINES = {"OpenSim": (OpenSimModel, "opensim"), "MuJoCo": (MuJoCoModel, "mujoco")}

STOP = 0.1
"""Of the falls; all of them, for half a second: `python -m benchmarks exports` [s]."""

SPARSE = 11
"""One of so many poses of the benchmark's grid is compared, of many joints one of four times it."""

MANY_JOINTS = 13

EXACT = 1e-9
"""Largest difference of the moments of a law that is not fitted, relative to the largest."""


def loaded(engine: str, case: Case, springs: SpringSet, folder: Path) -> Any:
    """A case in a program; skips the test where it is not installed."""
    make, module = ENGINES[engine]
    pytest.importorskip(module)
    return make(case.figure, springs, folder)


@pytest.mark.slow
@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("name", ["clavicles", "male50"])
def test_moments_of_every_joint_differ_by_what_is_stated(name: str, engine: str, tmp_path: Path):
    case = CASES[name].held_by(engine)
    model = loaded(engine, case, case.springs, tmp_path)
    assert model.warnings == []
    stated = stated_errors(model.losses, case.springs)
    if engine == "OpenSim":
        assert stated == {}
    sparse = SPARSE * (1 if len(case.springs.joints) < MANY_JOINTS else 4)
    for joint in case.springs.joints:
        found, size = moment_differences(model, case.figure, case.springs, joint, sparse)
        worst = float(np.linalg.norm(found, axis=1).max())
        assert worst <= stated.get(joint, EXACT * size), joint


@pytest.mark.parametrize("engine", ENGINES)
def test_a_person_without_springs_falls_as_here(engine: str, tmp_path: Path):
    """Other figures do in `tests/generator/model_files/test_export_model.py`."""
    case = CASES["male50"]
    model: ExportedModel = loaded(engine, case, SpringSet(), tmp_path)
    times, expected = our_fall(case.figure, SpringSet(), STOP)
    found = model.fall(times, exports.ACCURACIES[engine][0])
    distance, angle = difference(case.figure, found, expected)
    assert model.warnings == []
    assert distance < 1e-6
    assert angle < 1e-5


@pytest.mark.parametrize("name", ["prototype", "male50", "prototype, free root"])
def test_figures_with_springs_fall_in_opensim_as_here(name: str, tmp_path: Path):
    case = CASES[name]
    model = loaded("OpenSim", case, case.springs, tmp_path)
    times, expected = our_fall(case.figure, case.springs, STOP)
    distance, angle = difference(CASES[name].figure, model.fall(times, 1e-6), expected)
    assert distance < 1e-5
    assert angle < 1e-5


def test_arms_beyond_their_reach_fall_in_opensim_as_here(tmp_path: Path):
    """One raised backwards, one turned about itself."""
    bent = {"left_shoulder": (0.0, 0.0, -70.0), "right_shoulder": (80.0, 0.0, 0.0)}
    figure = exports.posed(CASES["male50"].figure, bent)
    case = Case("reaching", figure, CASES["male50"].springs)
    springs = case.springs.joints
    for joint, degrees in bent.items():
        moments = our_moments(figure, case.springs, joint, np.radians([degrees]))
        assert np.abs(moments).max() > 50.0, springs[joint]
    model = loaded("OpenSim", case, case.springs, tmp_path)
    times, expected = our_fall(case.figure, case.springs, STOP)
    distance, angle = difference(figure, model.fall(times, 1e-7), expected)
    assert distance < 1e-5
    assert angle < 1e-5


@pytest.mark.parametrize(("engine", "bound"), [("MuJoCo", 5e-4), ("OpenSim", 2e-5)])
def test_a_person_under_a_law_of_coordinates_falls_as_here(
    engine: str, bound: float, tmp_path: Path
):
    """From a bent start."""
    case = CASES["male50"].held_by(engine).in_coordinates
    model = loaded(engine, case, case.springs, tmp_path)
    times, expected = our_fall(case.figure, case.springs, 0.4)
    found = model.fall(times, exports.ACCURACIES[engine][0])
    assert difference(case.figure, found, expected)[0] < bound


def test_the_comparison_sees_ten_grams(tmp_path: Path):
    """A heavier hand breaks the agreement."""
    case = CASES["prototype"]
    model = loaded("MuJoCo", case, SpringSet(), tmp_path)
    times, expected = our_fall(case.figure, SpringSet(), STOP)
    model.model.body("left_lower_arm").mass += 1e-2
    assert difference(case.figure, model.fall(times, 1e-3), expected)[0] > 1e-5


@pytest.mark.parametrize("name", ["prototype", "male50"])
def test_a_model_that_mujoco_saves_again_is_the_same(name: str, tmp_path: Path):
    """`mj_saveLastXML` writes what it compiled: the masses, the springs and the start are there."""
    case = CASES[name].held_by("MuJoCo").in_coordinates
    model = loaded("MuJoCo", case, case.springs, tmp_path)
    api, saved = model.api, tmp_path / "saved.xml"
    api.mj_saveLastXML(str(saved), model.model)
    again = api.MjModel.from_xml_path(str(saved))
    states: list[tuple[np.ndarray, ...]] = []
    for one in (model.model, again):
        data = api.MjData(one)
        api.mj_resetDataKeyframe(one, data, one.key("start").id)
        api.mj_forward(one, data)
        inertia = np.zeros((one.nv, one.nv))
        api.mj_fullM(one, data, inertia)
        states.append((inertia, data.qfrc_passive.copy(), data.qfrc_actuator.copy()))
    inertias, passive, actuators = zip(*states, strict=True)
    assert inertias[1] == pytest.approx(inertias[0], rel=1e-4, abs=1e-4)
    # Angles are saved with six digits, and a stop has 1000 N m/rad.
    assert passive[1] == pytest.approx(passive[0], rel=1e-4, abs=2e-3)
    assert actuators[1] == pytest.approx(actuators[0], rel=1e-4, abs=2e-3)


def test_mujoco_s_viewer_shows_the_prototype_upright_from_the_front(tmp_path: Path):
    """The scene that the viewer draws: all shapes in their colour, and its first camera."""
    model = loaded("MuJoCo", CASES["prototype"], SpringSet(), tmp_path)
    api, camera, options = model.api, model.api.MjvCamera(), model.api.MjvOption()
    api.mjv_defaultFreeCamera(model.model, camera)
    scene = api.MjvScene(model.model, 1000)
    everything = api.mjtCatBit.mjCAT_ALL.value
    api.mjv_updateScene(model.model, model.data, options, None, camera, everything, scene)
    shapes = [scene.geoms[k] for k in range(scene.ngeom)]
    meshes = [shape for shape in shapes if shape.type == api.mjtGeom.mjGEOM_MESH]
    assert len(meshes) == len(CASES["prototype"].figure.bodies)
    assert all(mesh.rgba == pytest.approx([1.0, 0.37, 0.0, 1.0]) for mesh in meshes)
    for eye in scene.camera:
        assert eye.up == pytest.approx([0.0, 1.0, 0.0], abs=1e-6)
        assert eye.forward == pytest.approx([0.0, 0.0, -1.0], abs=1e-6)
