"""`mover pose`: a figure in a pose, as numbers and as a file."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from generator.cli.answer import CommandResult, UsageError, format_count, format_table
from generator.cli.inputs import load_figure, placement_from_options
from generator.cli.options import format_rounded, in_cm, in_display_units
from generator.cli.outputs import check_writable, write_text
from generator.figure import Figure
from generator.figure_file.read import FIGURE_SUFFIX
from generator.figure_file.write import write_figure, write_pose
from generator.input_files.pose import POSE_SUFFIX
from generator.kinematics.placement import Placement
from generator.motion_files.action import display_unit


def pose(
    name: str, file: Path | None = None, sets: Sequence[str] = (), output: Path | None = None
) -> CommandResult:
    """Displacements of all joints and positions of all sites of the figure that `name` means.

    Args:
        name: of the figure.
        file: a pose file.
        sets: of the form `JOINT=a,b,c` [deg or cm]; they change what the file says.
        output: where the pose goes: a pose file, or a figure file with these displacements.

    Raises:
        UsageError: an option cannot be read or does not fit the figure.
        InputError: the figure or the pose file is wrong, or the output cannot be written.
        OpenLoopError: the figure's loops cannot be closed.
    """
    if output is not None and output.suffix.lower() not in (POSE_SUFFIX, FIGURE_SUFFIX):
        said = f"`{output.suffix}` is no known suffix" if output.suffix else "the suffix is missing"
        raise UsageError(f"{output}: {said}; known are {POSE_SUFFIX}, {FIGURE_SUFFIX}")
    figure, warnings = load_figure(name)
    placement, more = placement_from_options(figure, file, sets)
    files = [] if output is None else [output]
    check_writable(files, (figure.path, file))
    for path in files:
        write_text(path, _format_output(placement, path))
    texts = [_title(name, figure), _joints(placement), _sites(placement)]
    return CommandResult(
        text="\n\n".join([*texts, *(f"wrote {path}" for path in files)]),
        data={"figure": name, **_data(placement), "files": [str(path) for path in files]},
        diagnostics=(*warnings, *more),
    )


def _format_output(placement: Placement, path: Path) -> str:
    """The text of a file of this suffix."""
    figure = placement.tree.figure
    rows = {
        name: tuple(float(value) for value in row) for name, row in placement.displacements.items()
    }
    if path.suffix.lower() == POSE_SUFFIX:
        return write_pose(figure, rows)
    joints = {
        name: replace(joint, displacement=rows[name]) for name, joint in figure.joints.items()
    }
    return write_figure(replace(figure, joints=joints))


def _title(name: str, figure: Figure) -> str:
    freedoms, joints = figure.degrees_of_freedom, len(figure.joints)
    return f"{name}: {format_count(freedoms, 'displacement')} of {format_count(joints, 'joint')}"


def _joints(placement: Placement) -> str:
    rows = [["joint", "displacement"]]
    for name, joint in placement.tree.figure.joints.items():
        values = in_display_units(placement.displacements[name], joint.chain)
        shown = zip(values, joint.chain, strict=True)
        cells = [f"{format_rounded(value, 4)} {display_unit(factor)}" for value, factor in shown]
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
        "joints": [
            {
                "name": name,
                "displacement": in_display_units(placement.displacements[name], joint.chain),
                "units": [display_unit(factor) for factor in joint.chain],
            }
            for name, joint in placement.tree.figure.joints.items()
        ],
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
