"""`mover pose`: a figure in a pose, as numbers and as a file."""

from pathlib import Path
from typing import Annotated

import typer

from generator.cli.answer import CommandResult, format_count, format_table
from generator.cli.inputs import load_figure, placement_from_options
from generator.cli.options import (
    FigureName,
    JointValues,
    PoseFile,
    displacements_data,
    format_rounded,
    in_cm,
    in_display_units,
)
from generator.cli.outputs import check_writable, suffix_fault, write_file, write_pose_file
from generator.diagnostics import UsageError
from generator.figure import Figure
from generator.figure_file.read import FIGURE_FILE
from generator.figure_file.write import write_figure
from generator.input_files.pose import POSE_FILE
from generator.kinematics.placement import Placement, pose_figure


def pose(
    name: FigureName,
    file: PoseFile = None,
    displacements: JointValues = None,
    output: Annotated[
        Path | None,
        typer.Option(
            "--output",
            "-o",
            metavar="FILE",
            help="A .pose file, or a .fig with these displacements.",
        ),
    ] = None,
) -> CommandResult:
    """Show or save a pose: displacements of joints, positions.

    The option --set may be repeated and changes what --pose says.
    """
    if output is not None and output.suffix.lower() not in (POSE_FILE.suffix, FIGURE_FILE.suffix):
        raise UsageError(
            f"{output}: {suffix_fault(output)}; known are {POSE_FILE.suffix}, {FIGURE_FILE.suffix}"
        )
    figure, warnings = load_figure(name)
    placement, more = placement_from_options(figure, file, displacements or ())
    files = [] if output is None else [output]
    check_writable(files, (figure.path, file))
    for path in files:
        _write_output(placement, path)
    texts = [_title(name, figure), _joints(placement), _sites(placement)]
    return CommandResult(
        text="\n\n".join([*texts, *(f"wrote {path}" for path in files)]),
        data={"figure": name, **_data(placement), "files": [str(path) for path in files]},
        diagnostics=(*warnings, *more),
    )


def _write_output(placement: Placement, path: Path) -> None:
    """Write a file of this suffix. Raises InputError."""
    figure, rows = placement.tree.figure, placement.displacements
    if path.suffix.lower() == POSE_FILE.suffix:
        write_pose_file(path, figure, rows)
        return
    write_file(path, write_figure(pose_figure(figure, rows)))


def _title(name: str, figure: Figure) -> str:
    freedoms, joints = figure.degrees_of_freedom, len(figure.joints)
    return f"{name}: {format_count(freedoms, 'displacement')} of {format_count(joints, 'joint')}"


def _joints(placement: Placement) -> str:
    rows = [["joint", "displacement"]]
    for name, joint in placement.tree.figure.joints.items():
        values = in_display_units(placement.displacements[name], joint.chain)
        shown = zip(values, joint.chain, strict=True)
        cells = [f"{format_rounded(value, 4)} {axis.units.displacement}" for value, axis in shown]
        rows.append([name, *(cells or ["fixed"])])
    return format_table(rows)


def _sites(placement: Placement) -> str:
    rows = [["site in the world", "x [cm]", "y [cm]", "z [cm]"]]
    for segment, sites in _positions(placement).items():
        rows += [
            [f"{segment}.{site}", *map(format_rounded, where)] for site, where in sites.items()
        ]
    return format_table(rows)


def _positions(placement: Placement) -> dict[str, dict[str, list[float]]]:
    """Positions of the sites of every segment in the world [cm]."""
    return {
        name: {
            site.name: in_cm((placement.poses[name] @ site.pose_in_segment)[:3, 3])
            for site in segment.sites.values()
        }
        for name, segment in placement.tree.figure.segments.items()
    }


def _data(placement: Placement) -> dict[str, object]:
    positions = _positions(placement)
    return {
        "joints": displacements_data(placement.tree.figure, placement.displacements),
        "segments": [
            {
                "name": name,
                "position_cm": in_cm(placement.poses[name][:3, 3]),
                "rotation": placement.poses[name][:3, :3].tolist(),
                "sites_cm": sites,
            }
            for name, sites in positions.items()
        ],
    }
