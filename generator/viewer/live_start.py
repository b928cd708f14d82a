"""Starts of a live simulation: a fall of a person, a hanging figure, or a person who sits."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from enum import StrEnum
from pathlib import Path

from generator.contact.scene import FLOOR, NO_SCENE, Scene, with_floor
from generator.diagnostics import MoverError, UsageError
from generator.figure import Figure
from generator.figure_file.write import write_pose
from generator.input_files.live import LiveStart
from generator.input_files.scene import SCENE_FILE, write_scene
from generator.rotations import Array
from generator.simulation.falls import FALLS, fall_plan
from generator.simulation.sitting import sitting_start
from generator.viewer.folder import names_in_folder, path_in_folder

PAGE_POSE = "pose of the page"
"""Kind of a fall that begins in the pose that the page shows."""

KINDS = (*FALLS, PAGE_POSE)

NO_PROPS = "none"
"""Choice of no scene beside that of the fall."""


class Preset(StrEnum):
    """Start of a live simulation."""

    FALL = "Fall"
    PIN = "Hang"
    SIT = "Sit"


def presets_of(figure: Figure) -> tuple[Preset, ...]:
    """Return the presets of a figure; one without the legs of a person hangs."""
    try:
        fall_plan(figure, next(iter(FALLS)))
        sitting_start(figure)
    except (MoverError, OSError):
        return (Preset.PIN,)
    return tuple(Preset)


def scene_names(folder: Path) -> tuple[str, ...]:
    """Return the scenes that may be chosen: files of the folder, and shipped ones."""
    tables = names_in_folder(folder, ".toml")
    own = (name for name in tables if name.endswith(SCENE_FILE.suffix))
    return (NO_PROPS, *own, *SCENE_FILE.shipped())


def chosen_scene(folder: Path, name: str) -> Scene:
    """Return the scene of a choice. Raises UsageError and InputError."""
    if name == NO_PROPS:
        return NO_SCENE
    if name.endswith(SCENE_FILE.suffix):
        return SCENE_FILE.read(path_in_folder(folder, name, (".toml",)))
    if name not in SCENE_FILE.shipped():
        raise UsageError(f"there is no scene `{name}`")
    return SCENE_FILE.read(SCENE_FILE.shipped()[name])


def pose_text(figure: Figure, displacements: Mapping[str, Array]) -> str:
    """Return the text of a pose file of those displacements that are of joints of the figure."""
    own = {
        name: [float(value) for value in displacements[name]]
        for name, joint in figure.joints.items()
        if joint.chain and len(displacements.get(name, ())) == len(joint.chain)
    }
    return write_pose(figure, own)


@dataclass(frozen=True)
class StartChoice:
    """Choices that a start follows from.

    Attributes:
        preset: Preset.
        kind: Kind of a fall, a name of `KINDS`.
        seed: Seed of a fall.
        scene: Props beside those of a fall.
        height: Height of the lowest point [m]; zero leaves a kind of fall its own.
    """

    preset: Preset
    kind: str = PAGE_POSE
    seed: int = 0
    scene: Scene = NO_SCENE
    height: float = 0.0

    def apply(
        self, start: LiveStart, figure: Figure, displacements: Mapping[str, Array]
    ) -> LiveStart:
        """Return a start with that of this choice.

        Args:
            start: Start with springs, law and gravity; of a figure that hangs its root too.
            figure: Figure.
            displacements: Displacements of its joints in the pose of the page [rad or m].

        Raises:
            MoverError: The figure cannot start so.
            ValueError: A file cannot hold the scene.
        """
        if self.preset is Preset.PIN:
            return replace(start, pose=pose_text(figure, displacements))
        start = replace(start, free_root=True)
        if self.preset is Preset.SIT:
            pose, scene = sitting_start(figure)
            text = pose_text(figure, {**displacements, **pose})
            return replace(start, pose=text, scene=write_scene(scene), height=0.0)
        if self.kind != PAGE_POSE:
            text = write_scene(self.scene) if self.scene.props or self.scene.covers else ""
            height = self.height or None
            return replace(start, fall=self.kind, seed=self.seed, scene=text, height=height)
        props = self.scene
        if all(prop.name != FLOOR for prop in props.props):
            props = with_floor(props, 0.0)
        text = pose_text(figure, displacements)
        return replace(start, pose=text, scene=write_scene(props), height=self.height)
