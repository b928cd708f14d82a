"""Shared parts of the tests of models from other programs."""

import re
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from generator.figure import Figure
from generator.figure_file import FIGURE_FILE
from generator.kinematics.placement import Placement, forward_kinematics
from generator.kinematics.tree import build_tree
from generator.model_files.body_tree.to_figure import FRAME, ORIGIN, WORLD
from generator.model_files.embedded import MARK
from generator.model_files.model_files import Imported, imported_files
from generator.recording import Recording
from generator.rotations import Array
from generator.simulation.plan import Plan
from generator.simulation.run import simulate
from generator.springs_file.read import load_springs
from springs import SpringSet

MODELS = Path(__file__).parent / "models"

Values = Mapping[str, float]


def written_and_read(imported: Imported, folder: Path) -> tuple[Figure, SpringSet]:
    """The figure and its springs as the files say them that hold it."""
    path = folder / "model.fig"
    imported_files(imported, path).write()
    figure = FIGURE_FILE.parse_file(path).value
    assert figure is not None
    bare = {name: replace(one, psurf=None) for name, one in figure.segments.items()}
    assert replace(figure, segments=bare) == imported.figure
    reading = load_springs(figure, folder, "model")
    assert reading.value is not None, reading.diagnostics
    return figure, reading.value


def without_carried_texts(text: str) -> str:
    """A model without the figure and the springs that it carries."""
    text = re.sub(rf'<text name="{MARK} [^"]*" data="[^"]*"/>', "", text)
    text = re.sub(r"<custom>\s*</custom>", "", text)
    return re.sub(rf"<{MARK}>.*</{MARK}>", "", text, flags=re.DOTALL)


def lost(imported: Imported, word: str) -> tuple[str, ...]:
    """The places of the one loss whose sentence has a word."""
    (found,) = [loss for loss in imported.losses.entries if word in loss.what]
    return found.where


def displacements(imported: Imported, values: Values) -> dict[str, Array]:
    """The figure's displacements at values of the model's coordinates; zero where none is given."""
    found = {name: np.zeros(len(joint.chain)) for name, joint in imported.figure.joints.items()}
    for name, value in values.items():
        where = imported.coordinates[name]
        found[where.joint][where.index] = (value - where.offset) / where.scale
    return found


def rates(imported: Imported, values: Values) -> dict[str, Array]:
    """The rates of the figure's displacements at rates of the model's coordinates."""
    found = {name: np.zeros(len(joint.chain)) for name, joint in imported.figure.joints.items()}
    for name, value in values.items():
        where = imported.coordinates[name]
        found[where.joint][where.index] = value / where.scale
    return found


def placed(imported: Imported, values: Values) -> Placement:
    """The figure in a pose of the model."""
    return forward_kinematics(build_tree(imported.figure), displacements(imported, values))


def pose_in_model(placement: Placement, segment: str, site: str = FRAME) -> Array:
    """Pose of a site in the model's own world, shape (4, 4)."""
    figure = placement.tree.figure
    up = figure.segments[WORLD].sites[ORIGIN].pose_in_segment
    return up @ placement.poses[segment] @ figure.segments[segment].sites[site].pose_in_segment


def coordinate(imported: Imported, recording: Recording, name: str) -> Array:
    """A coordinate of the model over the frames of a recording, shape (n,)."""
    where = imported.coordinates[name]
    return recording.displacements[where.joint][:, where.index] * where.scale + where.offset


def without_limits(imported: Imported) -> Imported:
    """The model without the stops at its limits, which other programs make otherwise."""
    joints = {
        name: replace(joint, lower_limit=None, upper_limit=None)
        for name, joint in imported.figure.joints.items()
    }
    return replace(imported, figure=replace(imported.figure, joints=joints))


def fall(
    imported: Imported,
    folder: Path,
    start: Values,
    speeds: Values,
    gravity: float = 9.81,
    stop: float = 0.5,
) -> Recording:
    """The passive motion of a model from values and rates of its coordinates."""
    figure, springs = written_and_read(imported, folder)
    plan = Plan(
        stop=stop,
        tolerance=2e-6,
        springs=springs,
        gravity=(0.0, -gravity, 0.0),
        displacements=displacements(imported, start),
        velocities=rates(imported, speeds),
    )
    recording = simulate(figure, plan)
    assert recording.outcome.succeeded, recording.outcome.message
    return recording
