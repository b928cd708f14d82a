"""`mover com`: the centre of mass of a figure, in a pose or along a motion."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from generator.cli.answer import Answer, UsageError, aligned, counted
from generator.cli.inputs import Motion, figure_of, insist_near, motion_asked, placement_asked
from generator.cli.options import in_cm, rounded, xyz_cm
from generator.cli.outputs import insist_writable, write_text
from generator.diagnostics import Fault
from generator.figure import Figure
from generator.kinematics.centre_of_mass import Masses, UnknownSegmentError, masses_of
from generator.kinematics.placement import Placement
from generator.motion_files.action import shown_number, unit_of
from generator.rotations import Array
from generator.units import unit_named


@dataclass(frozen=True)
class Request:
    """The command line of `mover com`; None where an option is not given."""

    figure: str
    pose: Path | None = None
    displacements: Sequence[str] = ()
    segments: str | None = None
    along: Path | None = None
    output: Path | None = None


def com(request: Request) -> Answer:
    """The centre of mass that is asked for.

    Raises:
        UsageError: an option cannot be read or does not fit the figure.
        InputError: the figure, the pose or the motion is wrong, or the output cannot be written.
        MoverError: there is no such pose or motion of the figure, or no mass.
    """
    insist_on_table(request.output, request.along)
    figure, warnings = figure_of(request.figure)
    masses = masses_asked(figure, request.segments)
    if request.along is None:
        placement, more = placement_asked(figure, request.pose, request.displacements)
        return _in_a_pose(request.figure, placement, masses, (*warnings, *more))
    motion, more = motion_asked(figure, request.along, request.pose, request.displacements)
    files = [] if request.output is None else [request.output]
    insist_writable(files, (figure.path, request.along))
    centres = np.concatenate([masses.centre(some.poses) for some in motion.placements()])
    insist_near("the centre of mass", centres)
    for path in files:
        write_text(path, _table(motion, masses, centres))
    return Answer(
        text="\n".join([_summary(motion, masses, centres), *(f"wrote {path}" for path in files)]),
        data={
            "figure": request.figure,
            "motion": str(request.along),
            "segments": list(masses.segments),
            "mass_kg": masses.total,
            "times_s": motion.action.times.tolist(),
            "centre_of_mass_cm": [in_cm(row) for row in centres],
            "files": [str(path) for path in files],
        },
        faults=(*warnings, *more),
    )


def insist_on_table(output: Path | None, along: Path | None) -> None:
    """Raise UsageError for an output that is no table, or for one of a single pose."""
    if output is None:
        return
    if along is None:
        raise UsageError("-o writes a row for each frame of a motion, so it goes with --along")
    if output.suffix.lower() != ".csv":
        raise UsageError(f"{output}: the table is a file of comma-separated values, .csv")


def masses_asked(figure: Figure, segments: str | None) -> Masses:
    """The masses of the segments that `a,b,c` names, else of all. Raises UsageError."""
    names = None if segments is None else [name.strip() for name in segments.split(",")]
    try:
        return masses_of(figure, names)
    except UnknownSegmentError as failure:
        raise UsageError(f"--segments {segments}: {failure}") from None


def _in_a_pose(
    name: str, placement: Placement, masses: Masses, faults: tuple[Fault, ...]
) -> Answer:
    centre, centres = masses.centre(placement.poses), masses.centres(placement.poses)
    insist_near("the centre of mass of a segment", centres)
    rows = [["segment", "mass [kg]", "x [cm]", "y [cm]", "z [cm]"]]
    rows += [
        [segment, f"{mass:.4f}", *map(rounded, in_cm(where))]
        for segment, mass, where in zip(masses.segments, masses.masses, centres, strict=True)
    ]
    title = f"{name}: the centre of mass of {masses.total:.4g} kg is at {xyz_cm(centre)}"
    return Answer(
        text=f"{title}\n\n{aligned(rows)}",
        data={
            "figure": name,
            "centre_of_mass_cm": in_cm(centre),
            "mass_kg": masses.total,
            "segments": [
                {"name": segment, "mass_kg": float(mass), "centre_of_mass_cm": in_cm(where)}
                for segment, mass, where in zip(
                    masses.segments, masses.masses, centres, strict=True
                )
            ],
            "slopes": _slopes(placement, masses),
        },
        faults=faults,
    )


def _slopes(placement: Placement, masses: Masses) -> list[dict[str, object]]:
    """How far the centre of mass goes for a degree or a centimetre of each displacement."""
    columns = iter(masses.jacobian(placement).T)
    return [
        {
            "joint": joint.name,
            "displacement": k,
            "unit": f"cm/{unit_of(factor)}",
            "slope": in_cm(next(columns) * float(unit_named(unit_of(factor)).factor)),
        }
        for joint in placement.tree.figure.joints.values()
        for k, factor in enumerate(joint.chain, 1)
    ]


def _summary(motion: Motion, masses: Masses, centres: Array) -> str:
    times = motion.action.times
    chosen = [("first", centres[0]), ("last", centres[-1])]
    chosen += [("least", np.min(centres, axis=0)), ("greatest", np.max(centres, axis=0))]
    rows = [["centre of mass", "x [cm]", "y [cm]", "z [cm]"]]
    rows += [[name, *map(rounded, in_cm(where))] for name, where in chosen]
    frames = f"{counted(len(times), 'frame')}, {times[0]:g} to {times[-1]:g} s"
    return f"{frames}, {masses.total:.4g} kg\n\n{aligned(rows)}\n"


def _table(motion: Motion, masses: Masses, centres: Array) -> str:
    """The centre of mass of every frame, under the header of the motion."""
    lines = [f"# {line}" for line in motion.action.header.lines()]
    lines += [f"# segments {' '.join(masses.segments)}", "time [s],x [cm],y [cm],z [cm]"]
    for time, centre in zip(motion.action.times.tolist(), centres.tolist(), strict=True):
        lines.append(",".join([repr(time), *(shown_number(part, "cm") for part in centre)]))
    return "".join(f"{line}\n" for line in lines)
