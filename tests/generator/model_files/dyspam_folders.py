"""Figures written to a folder and read back, for tests."""

from pathlib import Path

import numpy as np

from generator import Plan, simulate
from generator.diagnostics import Parsed
from generator.figure import Figure
from generator.losses import Losses
from generator.model_files.dyspam import read as dyspam_reader
from generator.model_files.dyspam import write as dyspam
from generator.recording import Ending, Recording
from generator.springs_file.read import load_springs
from springs import SpringSet


def there_and_back(
    figure: Figure, springs: SpringSet, folder: Path
) -> tuple[Parsed[dyspam_reader.DyspamModel], Losses]:
    losses = dyspam.write(figure, springs, folder)
    return dyspam_reader.parse_dyspam(folder), losses


def own_springs(figure: Figure) -> SpringSet:
    springs = load_springs(figure).value.springs
    assert springs is not None
    return springs


def run(figure: Figure, springs: SpringSet) -> Recording:
    recording = simulate(figure, Plan(stop=0.3, frame=0.05, step=1e-3, springs=springs))
    assert recording.outcome.ending is Ending.DONE, recording.outcome.message
    return recording


def tracks(recording: Recording, figure: Figure) -> np.ndarray:
    """Positions of all sites of what moves, joints' triads left out; shape (sites, frames, 3)."""
    return np.array(
        [
            (recording.poses[name] @ site.pose_in_segment)[:, :3, 3]
            for name, segment in figure.bodies.items()
            for key, site in segment.sites.items()
            if not key.startswith("joint")
        ]
    )
