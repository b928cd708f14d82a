"""Options of the runs of a study: the plan is the one of `mover simulate` with these options."""

from math import radians
from pathlib import Path

import numpy as np
import pytest

from generator.cli.options import displacements_from_options, velocities_from_options
from generator.figure_file import read_figure
from generator.input_files.scene import read_scene
from generator.kinematics.free_root import settable_joints
from generator.simulation.plan import Plan
from springs import SphericalLaw
from tests.paths import FIGURES
from tests.study_runs import parse_study_text

REST = """
[design]
kind = "grid"
[parameters]
g = { path = "gravity", values = [0.9, 1.1] }
[measures]
end = { column = "kinetic [J]", take = "last" }
"""


def plan(options: str, figure: str = "prototype", folder: Path = FIGURES) -> Plan:
    """Return the plan of a study with options."""
    text = f'figure = "{figure}"\n{options}\n{REST}'
    return parse_study_text(text, folder).require_value().plan


def test_a_plan_without_options_is_that_of_a_run():
    assert plan("") == Plan()


def test_numbers_are_in_si():
    made = plan("start = 0.1\nstop = 2\nframe = 0.01\nstep = 1e-3\nwall_limit = 5")
    values = (made.start, made.stop, made.frame, made.step, made.wall_limit)
    assert values == (0.1, 2.0, 0.01, 1e-3, 5.0)
    assert plan("tolerance = 1e-4").tolerance == 1e-4
    assert plan("gravity = [0, 0, -1.62]").gravity == (0.0, 0.0, -1.62)


def test_a_floor_frees_the_figure_and_is_at_its_feet():
    made = plan("floor = true\nfriction = 0.3\nself_contact = true\ngravity = [0, 0, -9.81]")
    assert made.free_root
    assert made.height == 0.0
    assert made.self_contact
    (floor,) = made.scene.props
    assert floor.surface.friction == 0.3
    assert floor.shape.normal == (0.0, 0.0, 1.0)
    assert plan("floor = true\nheight = 0.5").height == 0.5
    assert plan("free_root = true").height is None


def test_a_scene_is_a_file_or_a_name(tmp_path: Path):
    made = plan('scene = "seat"\nfloor = true')
    assert made.free_root
    assert made.scene.props[1:] == read_scene("seat").props
    (tmp_path / "own.toml").write_text((FIGURES / "bed.scene.toml").read_text("utf-8"), "utf-8")
    assert plan('scene = "own.toml"\nheight = 1', folder=tmp_path).scene == read_scene("bed")


def test_a_law_joins_the_springs():
    text = f'figure = "prototype"\nlaw = "weighted"\n{REST}'
    study = parse_study_text(text, FIGURES).require_value()
    assert study.model.springs.law is SphericalLaw.WEIGHTED


def test_displacements_are_those_of_the_command_line():
    made = plan("[set]\nleft_knee = -30\nright_knee = [0.1]\n[velocity]\nleft_knee = 90")
    figure = read_figure("prototype")
    sets, rates = ["left_knee=-30", "right_knee=0.1"], ["left_knee=90"]
    joints = settable_joints(figure)
    assert made.displacements == displacements_from_options("--set", sets, joints)
    assert made.velocities == velocities_from_options(rates, figure)
    assert made.displacements["left_knee"] == pytest.approx([radians(-30)], rel=1e-15)


def test_a_joint_whose_name_ends_in_a_unit_has_its_own(tmp_path: Path):
    text = (FIGURES / "pendulum.fig").read_text("utf-8").replace("joint shoulder", "joint a_cm")
    (tmp_path / "own.fig").write_text(text, "utf-8")
    made = plan("[set]\na_cm = [1, 2, 3]", "own.fig", tmp_path)
    assert made.displacements["a_cm"] == pytest.approx([radians(k) for k in (1, 2, 3)], rel=1e-15)


def test_a_free_segment_has_a_velocity_in_metres():
    made = plan("free_root = true\n[velocity]\nlower_torso = [90, 0, 0, 0, 0, 2]")
    assert made.velocities["lower_torso"] == pytest.approx([radians(90), 0, 0, 0, 0, 2])


def test_a_pose_gives_all_joints_and_set_replaces_some(tmp_path: Path):
    text = (
        "joint left_knee { displacement = (-40deg); }\njoint left_elbow { displacement = (9deg); }"
    )
    (tmp_path / "bent.pose").write_text(text, "utf-8")
    made = plan('pose = "bent.pose"\n[set]\nleft_knee = -20', folder=tmp_path).displacements
    figure = read_figure("prototype")
    assert made.keys() == figure.joints.keys()
    assert made["left_knee"] == pytest.approx([radians(-20)], rel=1e-15)
    assert made["left_elbow"] == pytest.approx([radians(9)], rel=1e-15)
    assert made["right_knee"] == figure.joints["right_knee"].displacement


def test_a_pose_closes_the_loops(tmp_path: Path):
    figure = read_figure("fourbar")
    name = next(iter(figure.joints))
    (tmp_path / "open.pose").write_text(f"joint {name} {{ displacement = (20deg); }}", "utf-8")
    made = plan('pose = "open.pose"', "fourbar", tmp_path).displacements
    assert made[name] == pytest.approx([radians(20)], abs=1e-9)
    others = [one for one in figure.joints if one != name]
    assert any(
        not np.allclose(made[one], figure.joints[one].displacement, atol=1e-3) for one in others
    )


def test_loops_that_cannot_be_closed_are_an_error(tmp_path: Path):
    turned = "joint {} {{ displacement = (170deg); }}"
    text = "".join(map(turned.format, list(read_figure("fourbar").joints)[:3]))
    (tmp_path / "open.pose").write_text(text, "utf-8")
    study = f'figure = "fourbar"\npose = "open.pose"\n{REST}'
    fault, *_ = parse_study_text(study, tmp_path).diagnostics
    assert fault.span is not None
    assert fault.span.text == '"open.pose"'
