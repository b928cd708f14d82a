"""A figure that went through DYSPAM's files moves as it did, in real runs of Exudyn."""

from dataclasses import replace
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest

from generator import read_figure
from generator.figure import AxisKind, Figure, JointAxis, Site, SiteRef
from generator.model_files.dyspam import read as dyspam_reader
from generator.model_files.dyspam import write as dyspam
from generator.springs_file.read import load_springs
from springs import AxisSpring, Cubic, Damping, JointSprings, Linear, SpringSet
from tests.chains import BALL, at, body, chain, figure, ground, joint, two_bodies
from tests.generator.model_files.dyspam_folders import own_springs, run, there_and_back, tracks

SHIPPED = Path(str(files("figures")))
NEAR = 1e-7
"""Positions that differ by less are the same motion [m]."""


def shipped(name: str) -> tuple[Figure, SpringSet]:
    made = read_figure(SHIPPED / f"{name}.fig")
    springs = load_springs(made, SHIPPED, name).value.springs
    assert springs is not None
    return made, springs


def posed(given: Figure, **displacements: tuple[float, ...]) -> Figure:
    joints = dict(given.joints)
    for name, values in displacements.items():
        joints[name] = replace(joints[name], displacement=values)
    return replace(given, joints=joints)


def distance(given: Figure, springs: SpringSet, folder: Path) -> float:
    """The largest distance of a site from itself read back; the figure has to move for it."""
    reading, _ = there_and_back(given, springs, folder)
    assert reading.value is not None
    assert reading.value is not None
    before = tracks(run(given, springs), given)
    after = tracks(run(reading.value.figure, reading.value.springs), reading.value.figure)
    assert before.shape == after.shape
    assert np.max(np.ptp(before, axis=1)) > 0.01
    return float(np.max(np.abs(before - after)))


def test_the_pendulum_with_its_force(tmp_path):
    assert distance(*shipped("pendulum"), tmp_path / "out") < NEAR


def test_a_closed_loop(tmp_path):
    assert distance(*shipped("fourbar"), tmp_path / "out") < NEAR


def test_the_prototype_bent_until_its_springs_push_on_both_sides(tmp_path):
    made, springs = shipped("prototype")
    bent = posed(
        made,
        waist=(0.2, -0.6, 1.1),
        left_shoulder=(0.4, 0.9, -0.5),
        right_shoulder=(-0.3, 1.2, 0.8),
        left_hip_joint=(-0.7, 0.5, 0.2),
        right_hip_joint=(0.8, -0.9, 0.6),
        left_elbow=(1.9,),
        right_elbow=(-0.3,),
        left_knee=(-0.2,),
        right_knee=(1.7,),
    )
    assert distance(bent, springs, tmp_path / "out") < NEAR
    free = run(bent, SpringSet())
    apart = np.abs(tracks(free, bent) - tracks(run(bent, springs), bent))
    assert np.max(apart) > 0.05


@pytest.mark.parametrize(
    "text",
    ["Rs", "R-z", "R-y", "Rx Ry R-z", "R-x R-y R-z", "Rz R-x R-z", "R-y Rx R-y", "Rs Ra Rz"],
)
@pytest.mark.parametrize("reverse", [False, True])
def test_axes_of_all_kinds_and_connections_written_backwards(text, reverse, tmp_path):
    factors = chain(text)
    if text == "Rs Ra Rz":
        factors = (*factors[:2], JointAxis(AxisKind.ROTATION, (2.0 / 3.0, 2.0 / 3.0, -1.0 / 3.0)))
    values = (0.7, -0.4, 0.5)[: len(factors)]
    given = two_bodies(factors, values, reverse=reverse)
    assert distance(given, own_springs(given), tmp_path / "out") < NEAR


@pytest.mark.parametrize("text", ["R-x Ry Rz", "R-x R-y Rz", "R-x R-y R-z", "Rz R-y Rx", "R-x"])
def test_springs_about_negative_axes(text, tmp_path):
    """Linear ones with a rest, a cubic that is not odd, a cubic from a rest, and friction."""
    given = two_bodies(chain(text), (0.5, -0.3, 0.6)[: len(chain(text))])
    laws = (
        ((Cubic((2.0, -3.0, -4.0, -9.0), 1),), Damping(0.05)),
        ((Linear(3.0, 0.4),), Damping(0.02)),
        ((Cubic((0.5, 4.0, 2.0, 6.0), -1, rest=0.2),), Damping(0.01, 0.05)),
    )
    axes = tuple(
        AxisSpring(factor.axis, *law)
        for factor, law in zip(given.joints["tested"].chain, laws, strict=False)
    )
    springs = SpringSet({"tested": JointSprings("tested", axes)})
    assert distance(given, springs, tmp_path / "out") < NEAR
    resting = tracks(run(given, springs), given) - tracks(run(given, SpringSet()), given)
    assert np.max(np.abs(resting)) > 1e-3


def test_a_turned_root_and_all_kinds_of_loads(tmp_path):
    tip = Site(
        "tip",
        at((0.4, 0.2, -0.7), (0.1, -0.3, 0.2)),
        global_force=(1.0, 2.0, -1.0),
        local_force=(-2.0, 0.5, 1.0),
        global_moment=(0.1, 0.0, -0.2),
        local_moment=(0.0, 0.3, 0.1),
    )
    link = body("link", sites={"tip": tip})
    pin = joint("pin", "ground.hook", "link.near", BALL, (0.2, 0.1, -0.4))
    floor = ground(hook=at((0.3, 0.2, 0.1), (0.2, 0.5, -0.1)), turned=at((0.5, -0.2, 0.9)))
    given = replace(figure([floor, link], [pin]), root=SiteRef("ground", "turned"))
    assert distance(given, SpringSet(), tmp_path / "out") < NEAR


def test_rates_are_those_of_the_displacements(tmp_path):
    given = two_bodies(chain("Ry"), (0.3,))
    dyspam.write(given, SpringSet(), tmp_path / "out")
    path = tmp_path / "out" / dyspam.TABLES
    lines = path.read_text().splitlines()
    lines[-2] = " ".join([*lines[-2].split()[:4], "0.1", "0.2", "0.3"])
    lines[-1] = " ".join([*lines[-1].split()[:2], "-1.5"])
    path.write_text("\n".join(lines))
    reading = dyspam_reader.parse_dyspam(tmp_path / "out")
    assert reading.value.rates == {"joint1": (0.3, 0.2, 0.1), "joint2": (-1.5,)}
    assert any("rates" in str(loss) for loss in reading.value.losses.entries)
