"""`mover com`: the centre of mass of a figure, in a pose or along a motion."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, NamedTuple

import numpy as np

from generator.cli import inputs, options, outputs
from generator.cli.answer import CommandResult, Paragraphs, Table, format_written
from generator.cli.options import format_rounded, in_cm, option
from generator.diagnostics import UsageError
from generator.kinematics.centre_of_mass import Masses, segment_masses
from generator.kinematics.placement import Placement
from generator.motion_files.action import format_displacement
from generator.person.identity import identity_of
from generator.units import parse_unit


class SegmentCentre(NamedTuple):
    """Mass and centre of mass of a segment."""

    name: str
    mass_kg: float
    centre_of_mass_cm: Sequence[float]


class Slope(NamedTuple):
    """Derivative of the centre of mass for a displacement of a joint."""

    joint: str
    displacement: int
    unit: str
    slope: Sequence[float]


@dataclass(frozen=True)
class PoseCentre(CommandResult):
    """Centre of mass of a figure in a pose."""

    figure: str
    centre_of_mass_cm: Sequence[float]
    height_cm: float
    height_over_stature: float | None
    mass_kg: float
    segments: Sequence[SegmentCentre]
    slopes: Sequence[Slope]

    def paragraphs(self) -> Paragraphs:
        """Return the centre of mass, and a table of those of the segments."""
        centre = ", ".join(map(format_rounded, self.centre_of_mass_cm))
        title = f"{self.figure}: the centre of mass of {self.mass_kg:.4g} kg is at ({centre}) cm"
        if self.height_over_stature is not None:
            title += f"; its height is {self.height_over_stature:.3f} of the stature"
        rows = [["segment", "mass [kg]", "x [cm]", "y [cm]", "z [cm]"]]
        for name, mass, where in self.segments:
            rows.append([name, f"{mass:.4f}", *map(format_rounded, where)])
        return title, Table(rows)


@dataclass(frozen=True)
class MotionCentre(CommandResult):
    """Centre of mass of a figure along a motion, shape (frames, 3)."""

    figure: str
    motion: Path
    segments: Sequence[str]
    mass_kg: float
    times_s: Sequence[float]
    centre_of_mass_cm: Sequence[Sequence[float]]
    files: Sequence[Path]

    def paragraphs(self) -> Paragraphs:
        """Return the first, last, least and greatest coordinates."""
        centres = self.centre_of_mass_cm
        least, greatest = np.min(centres, axis=0), np.max(centres, axis=0)
        chosen = {"first": centres[0], "last": centres[-1], "least": least, "greatest": greatest}
        rows = [["centre of mass", "x [cm]", "y [cm]", "z [cm]"]]
        rows += [[name, *map(format_rounded, where)] for name, where in chosen.items()]
        yield f"{options.format_frames(self.times_s)}, {self.mass_kg:.4g} kg"
        yield Table(rows)
        yield format_written(self.files)


def com(
    name: options.FigureName,
    pose: options.PoseFile = None,
    displacements: options.JointValues = None,
    segments: Annotated[
        str | None, option("a,b,...", "Segments to include. [default: all]")
    ] = None,
    along: options.MotionFile = None,
    output: options.TableOutput = None,
) -> CommandResult:
    """Find the centre of mass, in a pose or along a motion."""
    outputs.check_table_output(output, along)
    figure, warnings = inputs.load_figure(name)
    names = None if segments is None else [segment.strip() for segment in segments.split(",")]
    try:
        masses = segment_masses(figure, names)
    except UsageError as failure:
        raise UsageError(f"--segments {segments}: {failure}") from None
    if along is None:
        placement, more = inputs.placement_from_options(figure, pose, displacements or ())
        centre, centres = masses.centre(placement.poses), masses.centres(placement.poses)
        inputs.check_distances("the centre of mass of a segment", centres)
        person, (_, height, _) = identity_of(figure), centre.tolist()
        return PoseCentre(
            name,
            in_cm(centre),
            height / options.CM,
            None if person is None else height / person.stature,
            masses.total,
            list(map(SegmentCentre, masses.segments, masses.masses, map(in_cm, centres))),
            list(_slopes(placement, masses)),
            diagnostics=(*warnings, *more),
        )
    motion, more = inputs.motion_from_options(figure, along, pose, displacements or ())
    files = outputs.output_files(output, (figure.path, along))
    placements = inputs.placements_of_motion(motion)
    centres = np.concatenate([masses.centre(some.poses) for some in placements])
    inputs.check_distances("the centre of mass", centres)
    for path in files:
        comments = [*motion.header.lines(), f"segments {' '.join(masses.segments)}"]
        rows = ((format_displacement(part, "cm") for part in row) for row in centres.tolist())
        titles = "time [s],x [cm],y [cm],z [cm]"
        outputs.write_frame_table(path, comments, titles, motion.times, rows)
    return MotionCentre(
        name,
        along,
        masses.segments,
        masses.total,
        motion.times.tolist(),
        [in_cm(row) for row in centres],
        files,
        diagnostics=(*warnings, *more),
    )


def _slopes(placement: Placement, masses: Masses) -> Iterator[Slope]:
    """Yield the derivatives of the centre of mass for each displacement [cm/deg or cm/cm]."""
    columns = iter(masses.jacobian(placement).T)
    for joint in placement.tree.figure.joints.values():
        for k, factor in enumerate(joint.chain, 1):
            unit = factor.units.displacement
            slope = in_cm(next(columns) * float(parse_unit(unit).factor))
            yield Slope(joint.name, k, f"cm/{unit}", slope)
