"""`mover pose`: a figure in a pose, as numbers and as a file."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from generator.cli.answer import Answer, UsageError, aligned, counted
from generator.cli.inputs import figure_of, placement_asked
from generator.cli.options import in_cm, in_units, rounded
from generator.cli.outputs import insist_writable, write_text
from generator.figure import Figure
from generator.figure_file.read import FIGURE_SUFFIX
from generator.figure_file.write import write_figure, write_pose
from generator.input_files.pose import POSE_SUFFIX
from generator.kinematics.placement import Placement
from generator.motion_files.action import unit_of


def pose(
    name: str, file: Path | None = None, sets: Sequence[str] = (), output: Path | None = None
) -> Answer:
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
    figure, warnings = figure_of(name)
    placement, more = placement_asked(figure, file, sets)
    files = [] if output is None else [output]
    insist_writable(files, (figure.path, file))
    for path in files:
        write_text(path, _written(placement, path))
    texts = [_title(name, figure), _joints(placement), _sites(placement)]
    return Answer(
        text="\n\n".join([*texts, *(f"wrote {path}" for path in files)]),
        data={"figure": name, **_data(placement), "files": [str(path) for path in files]},
        faults=(*warnings, *more),
    )


def _written(placement: Placement, path: Path) -> str:
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
    return f"{name}: {counted(freedoms, 'displacement')} of {counted(joints, 'joint')}"


def _joints(placement: Placement) -> str:
    rows = [["joint", "displacement"]]
    for name, joint in placement.tree.figure.joints.items():
        values = in_units(placement.displacements[name], joint.chain)
        shown = zip(values, joint.chain, strict=True)
        cells = [f"{rounded(value, 4)} {unit_of(factor)}" for value, factor in shown]
        rows.append([name, *(cells or ["fixed"])])
    return aligned(rows)


def _sites(placement: Placement) -> str:
    rows = [["site in the world", "x [cm]", "y [cm]", "z [cm]"]]
    for segment, sites in _positions(placement).items():
        rows += [[f"{segment}.{site}", *map(rounded, where)] for site, where in sites.items()]
    return aligned(rows)


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
                "displacement": in_units(placement.displacements[name], joint.chain),
                "units": [unit_of(factor) for factor in joint.chain],
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
