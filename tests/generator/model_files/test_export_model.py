"""Models for other programs: they place the segments as we do and move them as we do."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from generator.figure import Figure
from generator.kinematics.loops import close_loops
from generator.kinematics.placement import forward_kinematics, initial_displacements
from generator.kinematics.tree import build_tree
from generator.rotations import Array
from springs import JointSprings, SpringSet
from tests.chains import SKEW
from tests.generator.model_files.engines import Engine, MuJoCo, OpenSim, Pinocchio, moved
from tests.generator.model_files.model_cases import (
    AGREEMENT,
    CURVES,
    LOADED,
    LOOPS,
    OTHER_CURVES,
    PROTOTYPE,
    TREES,
    apart,
    equal,
    hinge,
    on_a_rail,
    ours,
    own_springs,
    slide,
    spring_set,
)

pytestmark = pytest.mark.verify

FREE = SpringSet()
FIGURES = TREES | LOOPS
VARIED = (
    *("names that meet", "clavicles", "prototype, let go", "pendulum"),
    *(
        "slides along the child's axes, child nearer to the root",
        "slides and turns about three axes",
    ),
)
"""Trees that fall in programs of which `test_coordinates_are_the_displacements` has all."""
with_loops = pytest.mark.parametrize("engine", [MuJoCo, OpenSim])


@with_loops
@pytest.mark.parametrize("name", FIGURES)
def test_segments_and_sites_start_where_the_figure_is_drawn(
    name: str, engine: type[MuJoCo | OpenSim], tmp_path: Path
):
    of = FIGURES[name]
    loaded, tree = engine(of, FREE, tmp_path), build_tree(of)
    expected = close_loops(tree, initial_displacements(tree)).poses
    close = 1e-12 if engine is MuJoCo else 1e-9
    for segment, pose in loaded.poses().items():
        assert pose == pytest.approx(expected[segment], abs=close)
    for segment, one in of.segments.items():
        for site in one.sites.values():
            pose = expected[segment] @ site.pose_in_segment
            assert loaded.site(segment, site.name) == pytest.approx(pose, abs=close)


@pytest.mark.parametrize("engine", [OpenSim, Pinocchio])
@pytest.mark.parametrize("name", TREES)
def test_coordinates_are_the_displacements(
    name: str, engine: type[OpenSim | Pinocchio], tmp_path: Path
):
    of = TREES[name]
    loaded, tree, random = engine(of, FREE, tmp_path), build_tree(of), np.random.default_rng(3)
    count = loaded.model.getNumCoordinates() if engine is OpenSim else loaded.model.nv
    assert count == of.degrees_of_freedom
    for _ in range(5):
        values = {
            joint: random.uniform(-1.2, 1.2, len(one.chain)) for joint, one in of.joints.items()
        }
        loaded.set(values)
        expected = forward_kinematics(tree, values).poses
        for segment, pose in loaded.poses().items():
            close = 1e-9 if engine is OpenSim else 1e-12
            assert pose == pytest.approx(expected[segment], abs=close)


@cache
def fall(name: str) -> dict[str, Array]:
    """Our motion without springs."""
    return dict(ours(FIGURES[name], FREE).poses)


def unloaded(of: Figure) -> Figure:
    """The figure without forces and moments at its sites."""
    none = dict.fromkeys(("global_force", "local_force", "global_moment", "local_moment"))
    bare = {
        name: replace(one, sites={n: replace(site, **none) for n, site in one.sites.items()})
        for name, one in of.segments.items()
    }
    return replace(of, segments=bare)


@pytest.mark.parametrize(
    ("name", "engine"),
    [*((name, MuJoCo) for name in TREES), *((n, e) for n in VARIED for e in (OpenSim, Pinocchio))],
)
def test_figures_without_springs_fall_alike(name: str, engine: type[Engine], tmp_path: Path):
    of, expected = TREES[name], None
    if engine is Pinocchio and name == "pendulum":  # URDF has no loads
        of = unloaded(of)
        expected = ours(of, FREE).poses
    assert apart(moved(engine(of, FREE, tmp_path)), expected or fall(name)) < AGREEMENT


@with_loops
@pytest.mark.parametrize("name", LOOPS)
def test_loops_stay_closed_and_move_alike(name: str, engine: type[Engine], tmp_path: Path):
    assert apart(moved(engine(LOOPS[name], FREE, tmp_path)), fall(name)) < AGREEMENT


@with_loops
def test_a_constant_load_acts_alike(engine: type[Engine], tmp_path: Path):
    expected = ours(LOADED, FREE).poses
    assert apart(moved(engine(LOADED, FREE, tmp_path)), expected) < AGREEMENT


def own_hinges() -> list[JointSprings]:
    """The springs of the prototype's elbows and knees."""
    own = own_springs(PROTOTYPE).joints
    return [one for name, one in own.items() if len(PROTOTYPE.joints[name].chain) == 1]


def test_in_mujoco_the_prototype_falls_alike_on_its_own_hinges_and_equal_balls():
    balls = [n for n in own_springs(PROTOTYPE).joints if len(PROTOTYPE.joints[n].chain) == 3]
    springs = spring_set(*own_hinges(), *(equal(PROTOTYPE, name, 40.0, 0.08) for name in balls))
    loaded = MuJoCo(PROTOTYPE, springs)
    assert not loaded.losses.entries
    loaded.model.opt.timestep /= 4
    assert apart(moved(loaded, 0.2), ours(PROTOTYPE, springs, 0.2).poses) < AGREEMENT


SLIDE_ON_A_CUBIC = slide("rail", SKEW, *CURVES["cubic"], viscous=0.3)
SLIDE_WITH_STOPS = slide("rail", SKEW, *CURVES["stop"], viscous=0.3)
RUBBING = {"viscous": 0.05, "coulomb": 0.05, "slip": 0.1}


@pytest.mark.parametrize(
    ("engine", "laws", "damping", "rail"),
    [
        *((MuJoCo, laws, {"viscous": 0.05}, SLIDE_ON_A_CUBIC) for laws in CURVES.values()),
        (OpenSim, CURVES["table"], RUBBING, SLIDE_WITH_STOPS),
        *((OpenSim, laws, RUBBING, SLIDE_WITH_STOPS) for laws in OTHER_CURVES.values()),
        (Pinocchio, (), {"viscous": 0.2}, slide("rail", SKEW, viscous=3.0)),
    ],
)
def test_springs_and_damping_move_a_hinge_and_a_slide_alike(
    engine: type[Engine], laws: tuple, damping: dict, rail: JointSprings, tmp_path: Path
):
    """The hinge's spring is about the opposite axis."""
    of, springs = on_a_rail(), spring_set(hinge("hinge", *laws, axis=(1.0, 0, 0), **damping), rail)
    assert apart(moved(engine(of, springs, tmp_path)), ours(of, springs).poses) < AGREEMENT
