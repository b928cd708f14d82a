"""`mover com`: the centre of mass of a figure, in a pose or along a motion."""

from typing import Annotated

import numpy as np
import typer

from generator.cli.answer import CommandResult, format_count, format_table
from generator.cli.inputs import (
    check_distances,
    load_figure,
    motion_from_options,
    placement_from_options,
    placements_of_motion,
)
from generator.cli.options import (
    CM,
    FigureName,
    JointValues,
    MotionFile,
    PoseFile,
    TableOutput,
    format_rounded,
    in_cm,
    xyz_cm,
)
from generator.cli.outputs import check_table_output, check_writable, write_file
from generator.diagnostics import Diagnostic, UsageError
from generator.kinematics.centre_of_mass import Masses, segment_masses
from generator.kinematics.placement import Placement
from generator.motion_files import FigureMotion
from generator.motion_files.action import format_displacement
from generator.person.identity import identity_of
from generator.rotations import Array
from generator.text_io import format_csv_comment
from generator.units import parse_unit


def com(
    name: FigureName,
    pose: PoseFile = None,
    displacements: JointValues = None,
    segments: Annotated[
        str | None, typer.Option(metavar="a,b,...", help="Segments to include. [default: all]")
    ] = None,
    along: MotionFile = None,
    output: TableOutput = None,
) -> CommandResult:
    """Find the centre of mass, in a pose or along a motion."""
    check_table_output(output, along)
    figure, warnings = load_figure(name)
    names = None if segments is None else [segment.strip() for segment in segments.split(",")]
    try:
        masses = segment_masses(figure, names)
    except UsageError as failure:
        raise UsageError(f"--segments {segments}: {failure}") from None
    if along is None:
        placement, more = placement_from_options(figure, pose, displacements or ())
        return _pose_result(name, placement, masses, (*warnings, *more))
    motion, more = motion_from_options(figure, along, pose, displacements or ())
    files = [] if output is None else [output]
    check_writable(files, (figure.path, along))
    centres = np.concatenate([masses.centre(some.poses) for some in placements_of_motion(motion)])
    check_distances("the centre of mass", centres)
    for path in files:
        write_file(path, _format_csv(motion, masses, centres))
    return CommandResult(
        text="\n".join([_summary(motion, masses, centres), *(f"wrote {path}" for path in files)]),
        data={
            "figure": name,
            "motion": str(along),
            "segments": list(masses.segments),
            "mass_kg": masses.total,
            "times_s": motion.times.tolist(),
            "centre_of_mass_cm": [in_cm(row) for row in centres],
            "files": [str(path) for path in files],
        },
        diagnostics=(*warnings, *more),
    )


def _pose_result(
    name: str, placement: Placement, masses: Masses, diagnostics: tuple[Diagnostic, ...]
) -> CommandResult:
    centre, centres = masses.centre(placement.poses), masses.centres(placement.poses)
    check_distances("the centre of mass of a segment", centres)
    rows = [["segment", "mass [kg]", "x [cm]", "y [cm]", "z [cm]"]]
    rows += [
        [segment, f"{mass:.4f}", *map(format_rounded, in_cm(where))]
        for segment, mass, where in zip(masses.segments, masses.masses, centres, strict=True)
    ]
    title = f"{name}: the centre of mass of {masses.total:.4g} kg is at {xyz_cm(centre)}"
    height = float(centre[1])
    person = identity_of(placement.tree.figure)
    relative = None if person is None else height / person.stature
    if relative is not None:
        title += f"; its height is {relative:.3f} of the stature"
    return CommandResult(
        text=f"{title}\n\n{format_table(rows)}",
        data={
            "figure": name,
            "centre_of_mass_cm": in_cm(centre),
            "height_cm": height / CM,
            "height_over_stature": relative,
            "mass_kg": masses.total,
            "segments": [
                {"name": segment, "mass_kg": float(mass), "centre_of_mass_cm": in_cm(where)}
                for segment, mass, where in zip(
                    masses.segments, masses.masses, centres, strict=True
                )
            ],
            "slopes": _jacobian_data(placement, masses),
        },
        diagnostics=diagnostics,
    )


def _jacobian_data(placement: Placement, masses: Masses) -> list[dict[str, object]]:
    """Return the derivatives of the centre of mass for each displacement [cm/deg or cm/cm]."""
    columns = iter(masses.jacobian(placement).T)
    return [
        {
            "joint": joint.name,
            "displacement": k,
            "unit": f"cm/{factor.units.displacement}",
            "slope": in_cm(next(columns) * float(parse_unit(factor.units.displacement).factor)),
        }
        for joint in placement.tree.figure.joints.values()
        for k, factor in enumerate(joint.chain, 1)
    ]


def _summary(motion: FigureMotion, masses: Masses, centres: Array) -> str:
    times = motion.times
    chosen = [("first", centres[0]), ("last", centres[-1])]
    chosen += [("least", np.min(centres, axis=0)), ("greatest", np.max(centres, axis=0))]
    rows = [["centre of mass", "x [cm]", "y [cm]", "z [cm]"]]
    rows += [[name, *map(format_rounded, in_cm(where))] for name, where in chosen]
    frames = f"{format_count(len(times), 'frame')}, {times[0]:g} to {times[-1]:g} s"
    return f"{frames}, {masses.total:.4g} kg\n\n{format_table(rows)}\n"


def _format_csv(motion: FigureMotion, masses: Masses, centres: Array) -> str:
    """Format the centre of mass of every frame as CSV, under the header of the motion."""
    comments = [*motion.header.lines(), f"segments {' '.join(masses.segments)}"]
    lines = ["time [s],x [cm],y [cm],z [cm]"]
    for time, centre in zip(motion.times.tolist(), centres.tolist(), strict=True):
        lines.append(",".join([repr(time), *(format_displacement(part, "cm") for part in centre)]))
    return "".join([*map(format_csv_comment, comments), *(f"{line}\n" for line in lines)])
