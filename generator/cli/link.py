"""`mover link`: the pose of a figure when joints are set that control others."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import isclose
from pathlib import Path
from typing import Annotated, NamedTuple

import typer

from generator.cli import answer, inputs, options, outputs
from generator.cli.inputs import AGREEMENT_TOLERANCE
from generator.cli.options import JointDisplacement, in_display_units, joint_displacements
from generator.diagnostics import InputError, UsageError
from generator.figure import Figure
from generator.kinematics.free_root import settable_joints
from generator.kinematics.links import LINKS_FILE, Coordinate, Links
from generator.kinematics.loops import close_loops
from generator.kinematics.placement import Displacements


class LinkedCoordinate(NamedTuple):
    """A degree of freedom that follows another one."""

    joint: str
    dof: int
    control: str
    control_dof: int
    factor: float
    offset: float
    unit: str


@dataclass(frozen=True)
class LinkResult(answer.CommandResult):
    """Pose of a figure with links."""

    figure: str
    links: Sequence[LinkedCoordinate]
    joints: Sequence[JointDisplacement]
    files: Sequence[Path]
    laws: Mapping[str, str] = field(metadata=answer.HIDDEN)
    moved: set[str] = field(metadata=answer.HIDDEN)
    count: int = field(metadata=answer.HIDDEN)

    def paragraphs(self) -> answer.Paragraphs:
        """Return tables of the links and of the joints that take part."""
        yield f"{self.figure}: {answer.format_count(self.count, 'link')}"
        yield answer.Table([("follower", "is"), *self.laws.items()], 2)
        rows = [
            [joint.name, ", ".join(map(_format_rounded, joint.displacement, joint.units))]
            for joint in self.joints
            if joint.name in self.moved
        ]
        yield answer.Table([["joint", "displacement"], *rows], 2)
        yield answer.format_written(self.files)


def link(
    name: options.FigureName,
    links_file: Annotated[
        Path, typer.Argument(metavar="LINKS.toml", help="Links file (docs/links.md).")
    ],
    pose: options.PoseFile = None,
    displacements: options.JointValues = None,
    output: options.PoseOutput = None,
) -> answer.CommandResult:
    """Set joints and move the joints that are linked to them.

    The option --set may be repeated and changes what --pose says.
    """
    outputs.check_pose_output(output)
    figure, warnings = inputs.load_figure(name)
    reading = LINKS_FILE.parse_file(links_file, figure)
    if reading.value is None:
        raise InputError((*warnings, *reading.diagnostics))
    links = reading.value
    files = outputs.output_files(output, (figure.path, links_file, pose))
    placement, more = inputs.placement_from_options(figure, pose, displacements or ())
    moved = links.follow(placement.displacements)
    joints = settable_joints(figure)
    set_values = options.displacements_from_options("--set", displacements or (), joints)
    _check_followers(figure, links, set_values, moved)
    linked = {end.joint for one in links.resolved for end in (one.follower, one.control)}
    moved = close_loops(placement.tree, moved, fixed=linked | set(set_values)).displacements
    for path in files:
        outputs.write_pose_file(path, figure, moved)
    coordinates: list[LinkedCoordinate] = []
    laws: dict[str, str] = {}
    for one in links.resolved:
        end, control = one.follower, one.control
        offset, unit = _in_display_unit(figure, end, one.offset)
        ends = (end.joint, end.index + 1, control.joint, control.index + 1)
        coordinates.append(LinkedCoordinate(*ends, one.factor, offset, unit))
        more_text = f" + {_format_rounded(offset, unit)}" if one.offset else ""
        laws[str(end)] = f"{one.factor:g} * {control}{more_text}"
    return LinkResult(
        name,
        coordinates,
        joint_displacements(figure, moved),
        files,
        laws,
        linked | set(set_values),
        len(links.links),
        diagnostics=(*warnings, *reading.diagnostics, *more),
    )


def _check_followers(
    figure: Figure,
    links: Links,
    requested: Mapping[str, Sequence[float]],
    displacements: Displacements,
) -> None:
    """Raise UsageError if a follower is set to another value than its link gives."""
    for one in links.resolved:
        joint, k = one.follower.joint, one.follower.index
        if joint not in requested:
            continue
        values = float(displacements[joint][k]), requested[joint][k]
        if not isclose(*values, rel_tol=AGREEMENT_TOLERANCE, abs_tol=AGREEMENT_TOLERANCE):
            follows, asked = (
                _format_rounded(*_in_display_unit(figure, one.follower, value)) for value in values
            )
            raise UsageError(
                f"--set {joint}: {one.follower} follows {one.control} and is at {follows}, "
                f"not {asked}"
            )


def _in_display_unit(figure: Figure, coordinate: Coordinate, value: float) -> tuple[float, str]:
    factor = figure.joints[coordinate.joint].chain[coordinate.index]
    return in_display_units([value], [factor])[0], factor.units.displacement


def _format_rounded(value: float, unit: str) -> str:
    return f"{round(value, 3) + 0.0:g} {unit}"
