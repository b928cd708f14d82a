"""Bones of exported motions in Blender against this program's own.

    python -m benchmarks.blender [PYTHON]

PYTHON is an interpreter with the module `bpy` (`pip install bpy`); the default is this one. Falls
are written as `.glb` and `.bvh`, imported by Blender as the documentation says, and compared at ten
frames: the origin of each bone, its rotation from rest, and in a `.glb` the sites. Differences
above `MAX_DISTANCE` or `MAX_ANGLE` are a failure.
"""

import json
import subprocess
import sys
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from benchmarks import tables
from generator import Plan, read_figure, simulate
from generator.kinematics.placement import forward_kinematics
from generator.kinematics.tree import build_tree
from generator.motion_files import FigureMotion, motion_from_recording
from generator.motion_files.bvh import write as write_bvh
from generator.motion_files.glb import write as write_glb
from generator.motion_files.motion import motion_from_figure
from generator.motion_files.resample import resample
from generator.rotations import Array, rotation_vector_from_matrix

MAX_DISTANCE, MAX_ANGLE = 1e-5, 1e-5
"""Bounds of distances [m] and angles [rad]."""

FPS = 24
"""Frames per second: Blender's default."""

FRAMES = 10
"""Number of frames that are compared."""

_SCRIPT = Path(__file__).parent / "engines" / "blender_bones.py"

_FROM_OURS = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
"""Blender's world, z up, from the figure's, y up: the figure faces -y, Blender's front view."""


@dataclass(frozen=True)
class Bones:
    """Bones in Blender's world, over k frames.

    Attributes:
        origins: shape (k, 3) [m].
        rotations: from rest, shape (k, 3, 3).
        sites: origins of the sites, by `SEGMENT.SITE`, shape (k, 3) [m].
    """

    origins: Mapping[str, Array]
    rotations: Mapping[str, Array]
    sites: Mapping[str, Array]


def main() -> None:
    """Print the table."""
    python = sys.argv[1] if len(sys.argv) > 1 else sys.executable
    with TemporaryDirectory() as folder:
        rows = list(_rows(python, Path(folder)))
    tables.show(rows)
    worst = max(
        float(str(row[key])) for row in rows for key in ("origins [m]", "sites [m]") if row[key]
    )
    turned = max(float(str(row["rotations [rad]"])) for row in rows)
    if worst > MAX_DISTANCE or turned > MAX_ANGLE:
        sys.exit(f"bones differ by {worst:.2g} m or {turned:.2g} rad")


def _motions() -> Iterator[tuple[str, FigureMotion]]:
    """Yield falls of a second, and a pose."""
    for name, title, plan in (
        ("prototype", "prototype", Plan(stop=1.0)),
        ("prototype", "prototype, free", Plan(stop=1.0, free_root=True)),
        ("clavicles", "clavicles", Plan(stop=1.0)),
        ("fourbar", "fourbar", Plan(stop=1.0)),
    ):
        figure = read_figure(name)
        yield title, resample(motion_from_recording(simulate(figure, plan), figure), FPS)
    figure = read_figure("prototype")
    bent = {name: np.full(len(joint.chain), 0.4) for name, joint in figure.joints.items()}
    yield "prototype, a pose", motion_from_figure(figure, bent)


def _rows(python: str, folder: Path) -> Iterator[tables.Row]:
    for title, motion in _motions():
        count = motion.times.size
        frames = np.unique(np.linspace(0, count - 1, FRAMES).round().astype(int))
        for suffix, scale in ((".glb", 1.0), (".bvh", 100.0), (".bvh", 1.0)):
            path = folder / f"motion{suffix}"
            if suffix == ".glb":
                write_glb(motion, path)
            else:
                write_bvh(motion, path, scale=scale)
            answer = _ask_blender(python, path, frames, scale)
            ours = _our_bones(motion, frames, by_joint=suffix == ".bvh")
            yield _compare(f"{title} ({suffix}, 1 m = {scale:g})", answer, ours)


def _ask_blender(python: str, path: Path, frames: Array, scale: float) -> dict[str, Any]:
    """Return the answer of Blender on a file."""
    request = {
        "file": str(path),
        "fps": FPS,
        "first": 0 if path.suffix == ".glb" else 1,
        "frames": [int(frame) for frame in frames],
        "scale": 1.0 / scale,
    }
    done = subprocess.run(
        [python, str(_SCRIPT)],
        input=json.dumps(request),
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode:
        sys.exit(f"{python} cannot import {path.name} in Blender:\n{done.stderr}")
    return json.loads(done.stdout.splitlines()[-1])


def _our_bones(motion: FigureMotion, frames: Array, *, by_joint: bool) -> Bones:
    """Return the bones by the kinematics of the figure, in Blender's world."""
    figure = motion.tree.figure
    zero = {name: np.zeros(len(joint.chain)) for name, joint in motion.figure.joints.items()}
    rest = forward_kinematics(build_tree(motion.figure), zero).poses
    origins: dict[str, Array] = {}
    rotations: dict[str, Array] = {}
    sites: dict[str, Array] = {}
    for branch in motion.tree.joints:
        joint, segment = branch.joint, branch.outboard
        moved = figure.site(joint.child if branch.parent_is_inboard else joint.parent)
        poses = motion.poses[segment][frames]
        name = joint.name if by_joint else segment
        origins[name] = (poses @ moved.pose_in_segment)[:, :3, 3] @ _FROM_OURS.T
        turned = poses[:, :3, :3] @ rest[segment][:3, :3].T
        rotations[name] = _FROM_OURS @ turned @ _FROM_OURS.T
    for segment in motion.figure.segments.values():
        for site in segment.sites.values():
            pose = motion.poses[segment.name][frames] @ site.pose_in_segment
            sites[f"{segment.name}.{site.name}"] = pose[:, :3, 3] @ _FROM_OURS.T
    return Bones(origins, rotations, {} if by_joint else sites)


def _compare(title: str, answer: dict[str, Any], ours: Bones) -> tables.Row:
    """Return a row of the table: the largest differences."""
    bones = {
        name: np.array(poses) for name, poses in answer["bones"].items() if name in ours.origins
    }
    if bones.keys() != ours.origins.keys():
        sys.exit(f"{title}: the bones are {sorted(answer['bones'])}")
    rest = {name: np.array(answer["rest"][name]) for name in bones}
    rotations = {
        name: poses[:, :3, :3] @ np.linalg.inv(rest[name][:3, :3]) for name, poses in bones.items()
    }
    origin = max(
        np.abs(poses[:, :3, 3] - ours.origins[name]).max() for name, poses in bones.items()
    )
    angle = max(
        np.linalg.norm(
            rotation_vector_from_matrix(turned @ np.swapaxes(ours.rotations[name], 1, 2)), axis=1
        ).max()
        for name, turned in rotations.items()
    )
    sites = [
        np.abs(np.array(answer["sites"][name])[:, :3, 3] - expected).max()
        for name, expected in ours.sites.items()
    ]
    return {
        "motion": title,
        "armatures": answer["armatures"],
        "bones": len(answer["bones"]),
        "actions": answer["actions"],
        "meshes": answer["meshes"],
        "origins [m]": f"{origin:.1e}",
        "rotations [rad]": f"{angle:.1e}",
        "sites [m]": f"{max(sites):.1e}" if sites else "",
        "Blender": answer["version"],
    }


if __name__ == "__main__":
    main()
