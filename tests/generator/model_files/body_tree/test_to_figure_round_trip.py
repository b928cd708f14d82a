"""Figures that are written for other programs and read again."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from generator.figure import Figure
from generator.kinematics.placement import forward_kinematics, initial_displacements
from generator.kinematics.tree import build_tree
from generator.model_files.body_tree.to_figure import FRAME, WORLD
from generator.model_files.formats import read_model
from generator.model_files.imported import Imported
from generator.model_files.mjcf import write as mjcf
from generator.model_files.opensim import write as osim
from generator.model_files.urdf import write as urdf
from generator.simulation.plan import Plan
from generator.simulation.run import simulate
from springs import SpringSet
from tests.generator.model_files.imported_models import displacements
from tests.generator.model_files.model_cases import PROTOTYPE, TREES

NO_SPRINGS = SpringSet({})

WRITERS = {
    "mjcf": (mjcf.write, ".xml"),
    "osim": (osim.write, ".osim"),
    "urdf": (urdf.write, ".urdf"),
}

CASES = {name: figure for name, figure in TREES.items() if "meet" not in name}
"""Figures whose names stay as they are."""


def again(figure: Figure, form: str, folder: Path) -> Imported:
    write, suffix = WRITERS[form]
    write(figure, NO_SPRINGS, folder / f"model{suffix}")
    return read_model(folder / f"model{suffix}")


def seen(imported: Imported, values: dict[str, float]) -> dict[str, np.ndarray]:
    """Pose of every body of the model in the figure's world."""
    placement = forward_kinematics(build_tree(imported.figure), displacements(imported, values))
    return {
        name: placement.poses[name] @ segment.sites[FRAME].pose_in_segment
        for name, segment in imported.figure.segments.items()
        if FRAME in segment.sites
    }


@pytest.mark.parametrize("form", WRITERS)
@pytest.mark.parametrize("name", CASES)
def test_segments_stand_where_they_stood(name, form, tmp_path):
    figure = CASES[name]
    imported = again(figure, form, tmp_path)
    tree, rng = build_tree(figure), np.random.default_rng(1)
    moved = {key: np.zeros_like(values) for key, values in initial_displacements(tree).items()}
    values = {}
    for key, row in moved.items():
        names = (
            [key] if key in imported.coordinates else [f"{key}_{k + 1}" for k in range(len(row))]
        )
        # A ball of MJCF has other angles; at zero they are the same.
        if all(one in imported.coordinates for one in names):
            row += rng.uniform(-0.4, 0.4, len(row))
            values |= dict(zip(names, row, strict=True))
    ours, theirs = forward_kinematics(tree, moved).poses, seen(imported, values)
    common = [key for key in figure.bodies if key in theirs]
    assert common
    for key in common:
        np.testing.assert_allclose(theirs[key], ours[key], atol=1e-9, err_msg=key)
    held = imported.figure.segments[WORLD].sites
    fixed = [key for key in figure.bodies if key in held and key not in theirs]
    free = sum(segment.mass for key, segment in figure.bodies.items() if key not in fixed)
    assert imported.figure.total_mass == pytest.approx(free, rel=1e-12)


def test_the_prototype_moves_as_it_did(tmp_path):
    """By way of OpenSim's form, which keeps the pose in which a figure is drawn."""
    imported = again(PROTOTYPE, "osim", tmp_path)
    plan = Plan(stop=0.3, tolerance=2e-6, springs=NO_SPRINGS)
    ours, theirs = simulate(PROTOTYPE, plan), simulate(imported.figure, plan)
    assert ours.outcome.succeeded
    assert theirs.outcome.succeeded
    for name in PROTOTYPE.bodies:
        frame = imported.figure.segments[name].sites[FRAME].pose_in_segment
        np.testing.assert_allclose(
            theirs.poses[name] @ frame, ours.poses[name], atol=1e-5, err_msg=name
        )
    assert np.abs(np.diff(ours.centre_of_mass, axis=0)).max() > 1e-3


@pytest.mark.parametrize("form", WRITERS)
def test_bent_elbows_and_knees_fall_alike_in_every_form(form, tmp_path):
    """From displacements of hinges, which every form has; gravity is the plan's, against y."""
    imported = again(PROTOTYPE, form, tmp_path)
    bent = {name: 0.5 * (len(joint.chain) == 1) for name, joint in PROTOTYPE.joints.items()}
    values = {
        name if name in imported.coordinates else f"{name}_1": value
        for name, value in bent.items()
        if value
    }
    rows = {name: np.full(len(PROTOTYPE.joints[name].chain), value) for name, value in bent.items()}
    plan = Plan(stop=0.3, tolerance=2e-6, springs=NO_SPRINGS)
    ours = simulate(PROTOTYPE, replace(plan, displacements=rows))
    start = displacements(imported, values)
    theirs = simulate(imported.figure, replace(plan, displacements=start))
    assert ours.outcome.succeeded
    assert theirs.outcome.succeeded
    for name in PROTOTYPE.bodies:
        frame = imported.figure.segments[name].sites[FRAME].pose_in_segment
        np.testing.assert_allclose(
            theirs.poses[name] @ frame, ours.poses[name], atol=1e-5, err_msg=name
        )
    assert np.abs(ours.poses["left_lower_leg"][-1] - ours.poses["left_lower_leg"][0]).max() > 0.05
