"""The result of a run: numpy arrays by name, and how the run ended."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum
from functools import cached_property
from importlib import import_module
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from generator.contact.record import ContactRecord
from generator.contact.scene import NO_SCENE, Scene
from generator.diagnostics import ModelError, NamedMapping, format_count
from generator.figure import JointAxis, Site
from generator.kinematics.free_root import tree_for_motion
from generator.kinematics.placement import MAX_FRAMES_PER_PLACEMENT
from generator.kinematics.range_of_motion import RangeExcess, range_excesses
from generator.losses import Losses
from generator.model import Model
from generator.notebook import PageView, html_table
from generator.rotations import Array
from generator.run_options import Integrator
from generator.units import AxisUnits
from springs.short_repr import short_repr

if TYPE_CHECKING:
    from pandas import DataFrame  # pyright: ignore[reportMissingTypeStubs]


class Ending(Enum):
    """Ending of a run."""

    DONE = "done"
    """At the stop time, within the tolerance; with a fixed step, at the stop time."""
    INACCURATE = "tolerance not met"
    """At the stop time, where the error is above the tolerance or unknown."""
    SOLVER_FAILED = "solver failed"
    TURNED_OVER = "turned through 180 deg"
    POLE = "at the pole of a joint"
    """Within a degree of where the outer two of three rotations have one axis."""
    TOO_LONG = "wall time used up"
    INTERRUPTED = "interrupted"


EARLY_STOP_ENDINGS = (Ending.INTERRUPTED, Ending.TOO_LONG)
"""Endings that say nothing about the motion, and nothing against earlier passes."""


@short_repr
@dataclass(frozen=True)
class Outcome:
    """Ending of a run, with its sentence.

    Attributes:
        ending: kind of ending.
        message: the sentence shown to the user.
        last_time: last recorded time [s].
        joint: the joint to blame, where there is one.
    """

    ending: Ending
    message: str
    last_time: float
    joint: str | None = None

    @property
    def succeeded(self) -> bool:
        """Return whether the run reached its stop time, within its tolerance if it has one."""
        return self.ending is Ending.DONE

    @property
    def reached_stop(self) -> bool:
        """Return whether the run reached its stop time, however accurate it is there."""
        return self.ending in (Ending.DONE, Ending.INACCURATE)


@short_repr
@dataclass(frozen=True)
class Accuracy:
    """Error estimate of a run.

    Attributes:
        estimate: largest joint-angle error over joints and frames [rad]; None with a fixed step and
            of a live simulation, infinite where too few passes finished.
        tolerance: required joint-angle error [rad]; None likewise.
        tolerance_met_until: time up to which the estimate stays below the tolerance [s]; the last
            time without a tolerance.
        step: smallest step used, of a live simulation the mean one [s].
        steps: number of steps of all passes.
        by_frame: error estimate of each frame [rad], shape (n,).
    """

    estimate: float | None
    tolerance: float | None
    tolerance_met_until: float
    step: float
    steps: int
    by_frame: Array


class RecordingPart(Enum):
    """Part of a recording that a run may leave out; see `simulate`."""

    VELOCITIES = "velocities"
    ROTATION_VECTORS = "rotation vectors"
    REACTIONS = "reactions"
    """Reactions of joints, and torques of drives."""
    PASSIVE_TORQUES = "passive torques"
    ENERGY = "energy"
    LOSSES = "losses"
    """Energies that are integrals of powers alone (what is lost, and the work)."""
    CONTACT = "contact"
    """Contact record, without the sensitivity."""
    CONTACT_STEPS = "contact of steps"
    """Contact record without what is known by frame, overlap and the head injury criterion."""
    HEAD_INJURY = "head injury"
    """Contact record of the steps with the head injury criterion."""
    CONTACT_SENSITIVITY = "contact sensitivity"
    """Difference from a run whose start is disturbed, which is one more run."""
    AGREEMENT = "agreement"
    """Comparison of accelerations of the compiled method with Exudyn's; a run that disagrees is
    repeated by Exudyn's integrator."""


WHOLE_RECORDING = frozenset(RecordingPart)
"""All parts of a recording."""

STEP_PARTS = frozenset(
    {RecordingPart.CONTACT, RecordingPart.CONTACT_STEPS, RecordingPart.HEAD_INJURY}
)
"""Parts that need the contact of each step."""


ENERGY_KINDS = ("kinetic", "gravity", "spring", "dissipated", "work")
"""Kinds of energy in a recording.

With those of contact, kinetic + gravity + spring + dissipated + contact + contact damping +
friction - work is constant.
"""

CONTACT_ENERGY_KINDS = ("contact", "contact damping", "friction")
"""Kinds of energy of a run with contact: stored in the surfaces, lost in impact damping, lost in
sliding."""


TONE_ENERGY_KIND = "tone"
"""Work done by the tone of muscles, of a run with tone; the balance subtracts it as well."""


LOSS_KINDS = ("dissipated", "work", TONE_ENERGY_KIND, "contact damping", "friction")
"""Kinds of energy that are integrals of powers alone."""


def energy_kinds(energy: Mapping[str, Array]) -> tuple[str, ...]:
    """Kinds of energy of a run, those of contact last; none where it left them out."""
    return tuple(
        kind for kind in (*ENERGY_KINDS, TONE_ENERGY_KIND, *CONTACT_ENERGY_KINDS) if kind in energy
    )


class EnergyChange(NamedTuple):
    """Energy in the first and in the last frame [J]."""

    first: float
    last: float


_MAPPINGS = (
    "poses",
    "chains",
    "displacements",
    "velocities",
    "rotation_vectors",
    "reactions",
    "passive_torques",
    "energy",
    "drive_torques",
)


_PARTS = {
    "velocities": RecordingPart.VELOCITIES,
    "rotation_vectors": RecordingPart.ROTATION_VECTORS,
    "reactions": RecordingPart.REACTIONS,
    "passive_torques": RecordingPart.PASSIVE_TORQUES,
    "energy": RecordingPart.ENERGY,
    "drive_torques": RecordingPart.REACTIONS,
}
"""Part of a recording to which a mapping belongs."""


def _format_range(units: AxisUnits, values: Array) -> tuple[str, ...]:
    """Format the first, smallest, largest and last value in deg or cm, and the unit."""
    numbers = (values[0], np.min(values), np.max(values), values[-1])
    texts = (f"{round(units.scale * number, 2) + 0.0:.2f}" for number in numbers)
    return (*texts, units.displacement)


@dataclass(frozen=True, eq=False)
class SiteMotion:
    """Motion of a site of a recording, in world axes.

    Attributes:
        recording: Recording with a model.
        segment: Name of the segment.
        site: Site of the segment.
    """

    recording: "Recording"
    segment: str
    site: Site

    def __repr__(self) -> str:
        """Names of the segment and the site, in a line."""
        return f"<SiteMotion of {self.segment}.{self.site.name} in {self.recording!r}>"

    @cached_property
    def position(self) -> Array:
        """Position, shape (n, 3) [m]."""
        return (self.recording.poses[self.segment] @ self.site.pose_in_segment)[:, :3, 3]

    @cached_property
    def velocity(self) -> Array:
        """Velocity, shape (n, 3) [m/s], from the rates of the joints.

        Raises UnknownNameError for a recording without velocities.
        """
        run = self.recording
        kinematics = tree_for_motion(run.require_model().figure, run.chains).kinematics
        values = kinematics.displacement_vector(run.displacements)
        rates = kinematics.displacement_vector(run.velocities)
        rates = rates * kinematics.motion_masks[self.segment]
        twists = np.empty((len(values), 6))
        for start in range(0, len(values), MAX_FRAMES_PER_PLACEMENT):
            some = slice(start, start + MAX_FRAMES_PER_PLACEMENT)
            twists[some] = np.einsum("nmk,nm->nk", kinematics.twists(values[some]), rates[some])
        return twists[:, 3:] + np.cross(twists[:, :3], self.position)


@dataclass(frozen=True)
class Recording:
    """A motion. n frames; SI units and radians; joints and segments in figure order.

    Attributes:
        times: shape (n,) [s].
        poses: poses of each segment in the world, shape (n, 4, 4); the ground's are constant.
        chains: the factors of each joint with a row in `displacements`.
        displacements: displacements of each joint, shape (n, degrees of freedom) [rad or m],
            continuous in time.
        velocities: rates of the displacements [rad/s or m/s], same shapes.
        rotation_vectors: rotation vectors of the child's site in the parent's, shape (n, 3) [rad],
            0 to pi long.
        reactions: reactions of each joint on its child at the child's site, shape (n, 6): force
            [N], moment [N m], in the parent's site axes, springs not included; what locks, links or
            drives the joint is.
        passive_torques: passive torques of each joint's springs and damping on the child, shape (n,
            3) [N m], in the parent's site axes.
        centre_of_mass: centre of mass of all that moves, shape (n, 3) [m].
        energy: energy by kind (`ENERGY_KINDS`; with contact also `CONTACT_ENERGY_KINDS`), shape
            (n,) [J].
        outcome: how the run ended.
        accuracy: what the run knows of its error.
        constraint_drift: largest distance by which any joint's sites parted [m].
        prescribed_motion_drift: largest drift of a locked, linked or driven joint from where it
            must be, before the frames were projected [rad or m].
        drive_torques: torques that drive a joint, about the axes of its displacements,
            shape (n, degrees of freedom) [N m]; torque times rate is its power. The torque is part
            of the reaction.
        wall_time: time spent stepping [s].
        build_time: time spent building the system [s].
        springs: where the springs are from, "none" without any.
        law: law of spherical joints.
        integrator: method of integration.
        integrator_reason: why it is Exudyn's; "" for the compiled one.
        agreement_with_exudyn: largest difference of the accelerations of the compiled method from
            those of the Exudyn model in several frames, relative to the largest; None for Exudyn's
            integrator.
        contact: contact with the props of the scene; None for a run without props.
        recorded: parts that the run recorded; mappings of others are empty.
        model: Figure and springs that were simulated, with a free root as well with all joints;
            None for a recording from an `.npz` file, which does not hold them.
        scene: Props around the figure; of a live simulation those of the last frame. Files of older
            versions have none.
    """

    times: Array
    poses: Mapping[str, Array]
    chains: Mapping[str, tuple[JointAxis, ...]]
    displacements: Mapping[str, Array]
    velocities: Mapping[str, Array]
    rotation_vectors: Mapping[str, Array]
    reactions: Mapping[str, Array]
    passive_torques: Mapping[str, Array]
    centre_of_mass: Array
    energy: Mapping[str, Array]
    outcome: Outcome
    accuracy: Accuracy
    constraint_drift: float = 0.0
    prescribed_motion_drift: float = 0.0
    drive_torques: Mapping[str, Array] = field(default_factory=dict[str, Array])
    wall_time: float = 0.0
    build_time: float = 0.0
    springs: str = "none"
    law: str = "conservative"
    integrator: Integrator = Integrator.COMPILED
    integrator_reason: str = ""
    agreement_with_exudyn: float | None = None
    contact: ContactRecord | None = None
    recorded: frozenset[RecordingPart] = WHOLE_RECORDING
    model: Model | None = None
    scene: Scene = NO_SCENE

    def __post_init__(self) -> None:
        """Give the mappings errors that state the nearest name."""
        subjects = {"poses": "segment", "energy": "energy"}
        for name in _MAPPINGS:
            subject = f"the recording has no {subjects.get(name, 'joint')}"
            part = _PARTS.get(name)
            if part is not None and part not in self.recorded:
                subject = f"the run was not asked to record {part.value}: it has no"
            object.__setattr__(self, name, NamedMapping(getattr(self, name), subject))

    def __repr__(self) -> str:
        """Size and outcome, in a line."""
        return (
            f"<Recording: {format_count(self.times.size, 'frame')}, "
            f"{self.times[0]:g} to {self.times[-1]:g} s, "
            f"{format_count(len(self.displacements), 'joint')}. {self.outcome.message}>"
        )

    def _repr_html_(self) -> str:
        """Table of the joints with the range of their displacements, for notebooks."""
        rows = (
            (name, k + 1, *_format_range(self.chains[name][k].units, values[:, k]))
            for name, values in self.displacements.items()
            for k in range(values.shape[1])
        )
        columns = ("joint", "displacement", "first", "smallest", "largest", "last", "unit")
        return html_table(str(self).strip("<>"), columns, rows)

    def view(self, height: int = 600) -> PageView:
        """Return the page of the motion, as `write("FALL.html")` makes it, for a notebook.

        The last line of a cell, `recording.view()`, shows the body in 3-D with its curves, without
        a server; the cell's output has some 1.5 MB.

        Args:
            height: Height of the cell [px].

        Raises:
            MoverError: The page cannot hold the recording, or it has no model.
        """
        make = import_module("generator.motion_files.page").page_of_motion
        motion = import_module("generator.motion_files.motion").motion_from_recording(self)
        return PageView(make(motion)[0], height)

    @property
    def accuracy_text(self) -> str:
        """Estimate of the error, or the reason why there is none, in a phrase."""
        accuracy = self.accuracy
        if accuracy.tolerance is None:
            return "error not estimated"
        asked = f"tolerance {accuracy.tolerance:.1e} rad"
        if self.times.size == 1:
            return f"error not estimated: the run failed at its first frame ({asked})"
        if accuracy.estimate is None or not isfinite(accuracy.estimate):
            return f"error not estimated: too few passes finished ({asked})"
        met = f"met until {accuracy.tolerance_met_until:g} s"
        return f"estimated joint-angle error {accuracy.estimate:.1e} rad ({asked}, {met})"

    def require_model(self) -> Model:
        """Return the model. Raises ModelError for a recording without one."""
        if self.model is None:
            raise ModelError(
                "a recording from a file does not hold its figure: give it one, as "
                "replace(recording, model=Model.of(figure)) or convert(..., figure=figure)"
            )
        return self.model

    @property
    def range_excesses(self) -> tuple[RangeExcess, ...]:
        """Return the places of joints beyond their ranges in the frames, the farthest first.

        Raises:
            ModelError: The recording is from a file; see `require_model`.
            UnknownNameError: The rotation vectors were not recorded, and a joint has a reach.
        """
        model = self.require_model()
        joints, springs = model.figure.joints.values(), model.springs.joints.values()
        has_limits = any(joint.lower_limit or joint.upper_limit for joint in joints)
        if not has_limits and all(joint.reach is None for joint in springs):
            return ()
        return range_excesses(model, self.times, self.displacements, self.rotation_vectors)

    def site(self, name: str) -> "SiteMotion":
        """Return the motion of a site, such as `"left_foot.heel"`.

        Raises:
            UnknownNameError: The figure has no such segment or site; the message states the
                nearest one.
            ModelError: The recording is from a file; see `require_model`.
        """
        segments = self.require_model().figure.segments
        names = NamedMapping(
            {f"{one.name}.{site}": (one, site) for one in segments.values() for site in one.sites},
            "the figure has no site",
        )
        segment, site = names[name]
        return SiteMotion(self, segment.name, segment.sites[site])

    def write(self, path: str | Path) -> Losses:
        """Write the recording, whole or not at all, in the format of the path's suffix.

        Returns:
            What the file could not hold.

        Raises:
            UsageError: The suffix is unknown.
            OSError: The file cannot be written.
            MoverError: The format cannot hold the recording, or it has no model.
        """
        # By name, as below: the formats read recordings, so they are above.
        return import_module("generator.motion_files").write_recording(self, Path(path))

    def to_dataframe(self) -> "DataFrame":
        """Return the table of the recording: the columns of its `.csv`, a row a frame.

        Raises:
            ImportError: pandas is not installed.
            ModelError: The recording is from a file; see `require_model`.
        """
        return import_module("generator.motion_files.tables").dataframe_of_recording(self)

    @property
    def energy_balance(self) -> Array:
        """Sum of what a run keeps: all kinds less the work of loads and tone, shape (n,) [J]."""
        supplied = ("work", TONE_ENERGY_KIND)
        gains = [self.energy[kind] for kind in energy_kinds(self.energy) if kind not in supplied]
        works = [self.energy[kind] for kind in energy_kinds(self.energy) if kind in supplied]
        return np.sum(gains, axis=0) - np.sum(works, axis=0)

    @property
    def energy_text(self) -> str:
        """Error of the balance and exchanged energy, in a phrase."""
        imbalance = float(np.max(np.abs(self.energy_balance - self.energy_balance[0])))
        exchanged = max(float(np.ptp(values)) for values in self.energy.values())
        return f"balanced to {imbalance:.2g} J, with {exchanged:.4g} J exchanged"

    @property
    def energy_changes(self) -> Mapping[str, EnergyChange]:
        """Energy of each kind in the first and in the last frame."""
        rows = ((kind, self.energy[kind]) for kind in energy_kinds(self.energy))
        return {kind: EnergyChange(float(row[0]), float(row[-1])) for kind, row in rows}
