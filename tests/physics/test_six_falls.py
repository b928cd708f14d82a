"""The six falls of docs/contact.md end as the page says."""

import re
import shlex
from collections.abc import Callable

import numpy as np
import pytest

from generator import Recording, read_figure, read_npz
from generator.contact.box import Box
from generator.contact.scene import Scene
from generator.geometry.read import read_segment_surface
from generator.input_files.scene import read_scene
from generator.rotations import Array
from tests.command import run
from tests.paths import DOCS

pytestmark = pytest.mark.slow

PAGE = (DOCS / "contact.md").read_text(encoding="utf-8")
COMMANDS = re.findall(
    r"^mover (.*)$", PAGE.partition("## Six falls")[2].partition("\n## ")[0], re.MULTILINE
)
FIGURE = read_figure("prototype")


def skin(recording: Recording) -> dict[str, Array]:
    """Vertices of each segment in the world at every frame, shape (n, v, 3) [m]."""
    found: dict[str, Array] = {}
    for name, segment in FIGURE.segments.items():
        if segment.psurf is not None:
            poses, vertices = recording.poses[name], read_segment_surface(FIGURE, segment).vertices
            turned = np.einsum("nij,vj->nvi", poses[:, :3, :3], vertices)
            found[name] = turned + poses[:, None, :3, 3]
    return found


def box_of(scene: str, name: str) -> Box:
    (box,) = [prop.shape for prop in read_scene(scene).props if prop.name == name]
    assert isinstance(box, Box)
    return box


def lies(recording: Recording) -> bool:
    """Tell whether the figure lies on the floor."""
    return recording.centre_of_mass[-1, 1] < 0.15


def falls_over_the_step(recording: Recording) -> bool:
    step = box_of("step", "step")
    points = skin(recording)
    hindmost = min(points[f"{side}_lower_leg"][-1, :, 2].min() for side in ("left", "right"))
    return lies(recording) and points["center_torso"][-1, :, 2].min() > step.centre[2] > hindmost


def lies_beside_the_bed(recording: Recording) -> bool:
    bed = box_of("bed", "bed")
    edge = bed.centre[0] - 0.5 * bed.size[0]
    return lies(recording) and recording.centre_of_mass[-1, 0] < edge


def sits(recording: Recording) -> bool:
    """Tell whether the pelvis rests on the seat, and the torso leans on the back."""
    assert recording.contact is not None
    forces = recording.contact.forces
    seat = box_of("seat", "seat")
    pelvis = recording.poses["lower_torso"][-1, :3, 3]
    return (
        abs(pelvis[2] - seat.centre[2]) < 0.5 * seat.size[2]
        and 0.0 < pelvis[1] - seat.size[1] < 0.2
        and forces["lower_torso"][-1, 1] > 50.0
        and forces["center_torso"][-1, 2] > 10.0
    )


ENDS = (lies, lies, lies, falls_over_the_step, lies_beside_the_bed, sits)


@pytest.mark.parametrize(("command", "is_as_meant"), [*zip(COMMANDS, ENDS, strict=True)])
def test_a_fall(tmp_path, command: str, is_as_meant: Callable[[Recording], bool]) -> None:
    file = tmp_path / "fall.npz"
    run(*shlex.split(command), "--tolerance", 3e-4, "--certify", "-q", "-o", file)
    _, recording = read_npz(file)
    contact, balance = recording.contact, recording.energy_balance
    assert contact is not None
    assert recording.accuracy.tolerance_met_until == recording.times[-1]
    assert contact.weight_carried == pytest.approx(1.0, abs=0.02)
    assert contact.creep < 0.02
    assert np.ptp(balance) < 1e-6 * np.ptp(recording.energy["gravity"])
    assert is_as_meant(recording)
    for name, points in skin(recording).items():
        assert points[..., 1].min() > -0.05, f"{name} under the floor"
        assert points[-1, :, 1].min() > -0.015, f"{name} under the floor at rest"
        for prop in scene_of(command).props:
            if name.endswith("lower_leg"):
                continue  # edges enter shins, as the page says
            local = (points - prop.shape.pose[:3, 3]) @ prop.shape.pose[:3, :3]
            assert prop.shape.distance(np.moveaxis(local, -1, 0))[0].min() > -0.06, (
                f"{name} in {prop.name}"
            )


def scene_of(command: str) -> Scene:
    words = shlex.split(command)
    return read_scene(words[words.index("--scene") + 1]) if "--scene" in words else Scene()
