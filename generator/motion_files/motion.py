"""A motion of a figure with its header: from a recording or from an action file."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from hashlib import sha256
from pathlib import Path

import numpy as np

from generator.contact.record import ContactRecord
from generator.contact.scene import NO_SCENE, Scene
from generator.figure import Figure, JointAxis
from generator.input_files.coordinates import Coordinates
from generator.kinematics.free_root import tree_for_motion
from generator.kinematics.placement import batched_placements
from generator.kinematics.tree import Tree
from generator.losses import Effect, Loss
from generator.recording import Ending, Recording
from generator.rotations import Array
from generator.text_io import open_regular_file
from springs import SpringSet
from springs.short_repr import short_repr

NONE = "none"
"""Text of a missing value."""


@short_repr
@dataclass(frozen=True)
class Header:
    """The origin of a motion.

    Attributes:
        figure: name of the figure's file, else of the figure.
        sha256: sha256 of the bytes of the figure's file, in hexadecimal; None when it is in no
            file.
        start: time of the first frame [s].
        stop: time of the last frame [s].
        frame_interval: interval between frames [s]; None where there is only one.
        springs: where the springs are from.
        law: law of spherical joints.
        outcome: how the run ended.
        message: the sentence that says it.
    """

    figure: str
    sha256: str | None
    start: float
    stop: float
    frame_interval: float | None
    springs: str
    law: str
    outcome: Ending
    message: str

    def lines(self) -> Iterator[str]:
        """A line for each entry, its name first."""
        yield f"figure {self.figure}"
        yield f"sha256 {self.sha256 or NONE}"
        yield f"start {self.start!r}"
        yield f"stop {self.stop!r}"
        yield f"frame {NONE if self.frame_interval is None else repr(self.frame_interval)}"
        yield f"springs {self.springs}"
        yield f"law {self.law}"
        yield f"outcome {self.outcome.value}"
        yield f"message {self.message}"


def header_from_recording(recording: Recording, figure: Figure) -> Header:
    """The header of a recording of a figure."""
    times, path = recording.times, figure.path
    return Header(
        figure=_name_of_figure(figure),
        sha256=figure.sha256 or (None if path is None else file_sha256(path)),
        start=float(times[0]),
        stop=float(times[-1]),
        frame_interval=first_frame_interval(times),
        springs=_one_line(recording.springs),
        law=_one_line(recording.law),
        outcome=recording.outcome.ending,
        message=_one_line(recording.outcome.message),
    )


def first_frame_interval(times: Array) -> float | None:
    """Interval of the first two frames [s], without the last digits that a subtraction spoils."""
    return float(f"{times[1] - times[0]:.12g}") if len(times) > 1 else None


def file_sha256(path: Path) -> str | None:
    """SHA-256 of a file's bytes, in hexadecimal; None for a file that cannot be read."""
    try:
        return sha256(open_regular_file(path).read()).hexdigest()
    except (OSError, ValueError):  # no path may hold a zero byte
        return None


def _name_of_figure(figure: Figure) -> str:
    """Return the name of the figure's file, else of the figure."""
    return _one_line(figure.name if figure.path is None else figure.path.name)


def _one_line(text: str | None) -> str:
    """The text with its blanks made single, in characters that UTF-8 can hold."""
    return " ".join((text or NONE).encode("utf-8", "replace").decode().split()) or NONE


@short_repr
@dataclass(frozen=True, eq=False)
class FigureMotion:
    """Displacements and poses of a figure over time, the source of every format.

    Attributes:
        figure: figure as its file describes it.
        header: where the motion is from.
        chains: the factors of each joint of the motion, innermost first; with a free root they are
            those of the figure let go.
        times: times of the n frames [s], shape (n,).
        displacements: displacements of each joint, shape (n, degrees of freedom) [rad or m].
        recording: the run that the motion is from; None for one from an action file.
        springs: springs of the run; None where only the header names them.
        scene: Props around the figure.
        coordinates: coordinates of the model that the figure is from; None for those beside the
            figure's file.
    """

    figure: Figure
    header: Header
    chains: Mapping[str, tuple[JointAxis, ...]]
    times: Array
    displacements: Mapping[str, Array]
    recording: Recording | None = None
    springs: SpringSet | None = None
    scene: Scene = NO_SCENE
    coordinates: Coordinates | None = None

    @cached_property
    def tree(self) -> Tree:
        """The tree that moves. Raises ModelError when the motion is of another figure."""
        return tree_for_motion(self.figure, self.chains)

    @cached_property
    def poses(self) -> Mapping[str, Array]:
        """Poses of the segments in the world, shape (n, 4, 4): the run's, or by kinematics.

        Raises ModelError when the motion is of another figure.
        """
        if self.recording is not None:
            return self.recording.poses
        parts = [some.poses for some in batched_placements(self.tree, self.displacements)]
        return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}


def motion_from_recording(recording: Recording, figure: Figure | None = None) -> FigureMotion:
    """The motion of a run, with its springs where they are known.

    Args:
        recording: Run.
        figure: Figure of a recording from a file; None for that of its model.

    Raises ModelError for a recording without a model and a figure.
    """
    figure = figure or recording.require_model().figure
    return FigureMotion(
        figure,
        header_from_recording(recording, figure),
        recording.chains,
        recording.times,
        recording.displacements,
        recording,
        None if recording.model is None else recording.model.springs,
        recording.scene,
    )


def motion_from_figure(
    figure: Figure, displacements: Mapping[str, Array] | None = None
) -> FigureMotion:
    """The motion of one frame of a figure in a pose, at 0 s.

    Args:
        figure: the figure.
        displacements: displacements of each joint, shape (degrees of freedom,) [rad or m]; None for
            those of its file.
    """
    if displacements is None:
        displacements = {
            name: np.array(joint.displacement, dtype=float) for name, joint in figure.joints.items()
        }
    header = Header(
        figure=_name_of_figure(figure),
        sha256=None if figure.path is None else file_sha256(figure.path),
        start=0.0,
        stop=0.0,
        frame_interval=None,
        springs=NONE,
        law=NONE,
        outcome=Ending.DONE,
        message="A pose.",
    )
    chains = {name: joint.chain for name, joint in figure.joints.items()}
    frame = {name: np.asarray(values)[None] for name, values in displacements.items()}
    return FigureMotion(figure, header, chains, np.zeros(1), frame)


_QUANTITIES = ("velocities", "reactions", "passive torques", "energies", "error estimate")

GROUND_REACTION = "ground reaction"
CONTACT_SIZES = "sizes of contact forces"
CONTACT_DEPTHS = "contact depths"
PART_FORCES = "contact forces of parts, with their points"


def _contact_quantities(contact: ContactRecord | None) -> list[str]:
    """Name the quantities of a contact record."""
    if contact is None:
        return []
    names = [
        GROUND_REACTION,
        CONTACT_SIZES,
        "directions of contact forces",
        CONTACT_DEPTHS,
        "first touches, peaks and impulses",
        "weight carried and creep",
    ]
    if contact.sensitivity is not None:
        names.append("sensitivity")
    if contact.overlap is not None:
        names.append("overlap of segments")
    if contact.parts:
        names.append("contact of parts of the body")
    if contact.part_forces:
        names.append(PART_FORCES)
    return [*names, "impacts of heads"] if contact.heads or contact.head_injury else names


def unrepresented(motion: FigureMotion, *represented: str) -> Loss | None:
    """Return the loss of a run's quantities in a format; None for a motion without a run.

    Args:
        motion: the motion.
        represented: the quantities that the format holds.
    """
    if motion.recording is None:
        return None
    driven = ["drive torques"] if motion.recording.drive_torques else []
    contact = _contact_quantities(motion.recording.contact)
    left = [name for name in (*_QUANTITIES, *driven, *contact) if name not in represented]
    return Loss("results of the run other than the motion", tuple(left), effect=Effect.DESCRIPTION)


def late_start(motion: FigureMotion) -> Loss | None:
    """Return the loss of the time of the first frame, in a file that begins at 0 s."""
    start = float(motion.times[0])
    message = f"the time of the first frame, {start:g} s; the file begins at 0 s"
    return Loss(message) if start else None


def lost_props(motion: FigureMotion) -> Loss | None:
    """Return the loss of the props, in a format without a scene; None for a motion without any."""
    names = tuple(prop.name for prop in motion.scene.props)
    return Loss("the props of the scene", names) if names else None


def unknown_props(motion: FigureMotion) -> Loss | None:
    """Return the loss of the props where the run had some, but its file is of an older version."""
    run = motion.recording
    if run is None or run.contact is None or motion.scene.props:
        return None
    return Loss("the props of the scene, which the recording does not hold")


NO_FIGURE = Loss("the figure: its segments, masses and shapes; the joints alone are named")
"""Loss of files that hold displacements only."""

NO_MASSES = Loss("the masses, inertias and springs of the figure", effect=Effect.DESCRIPTION)
"""Loss of files that hold the appearance of a figure."""
