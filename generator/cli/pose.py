"""`mover pose`: a figure in a pose, as numbers and as a file."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, NamedTuple

from generator.cli import inputs, options, outputs
from generator.cli.answer import CommandResult, Paragraphs, Table, format_count, format_written
from generator.cli.options import (
    JointDisplacement,
    format_rounded,
    in_cm,
    joint_displacements,
    output_option,
)
from generator.diagnostics import UsageError
from generator.figure_file.read import FIGURE_FILE
from generator.figure_file.write import write_figure
from generator.input_files.pose import POSE_FILE
from generator.kinematics.placement import pose_figure
from generator.rotations import Array


class SegmentPlace(NamedTuple):
    """Place of a segment in the world."""

    name: str
    position_cm: Sequence[float]
    rotation: Array
    sites_cm: Mapping[str, Sequence[float]]


@dataclass(frozen=True)
class PoseResult(CommandResult):
    """Pose of a figure."""

    figure: str
    joints: Sequence[JointDisplacement]
    segments: Sequence[SegmentPlace]
    files: Sequence[Path]

    def paragraphs(self) -> Paragraphs:
        """Return tables of the joints and of the sites."""
        count = sum(len(joint.displacement) for joint in self.joints)
        joints = format_count(len(self.joints), "joint")
        yield f"{self.figure}: {format_count(count, 'displacement')} of {joints}"
        rows = [[joint.name, *(joint.texts(4) or ["fixed"])] for joint in self.joints]
        yield Table([["joint", "displacement"], *rows])
        rows = [["site in the world", "x [cm]", "y [cm]", "z [cm]"]]
        for segment in self.segments:
            for site, where in segment.sites_cm.items():
                rows.append([f"{segment.name}.{site}", *map(format_rounded, where)])
        yield Table(rows)
        yield format_written(self.files)


def pose(
    name: options.FigureName,
    file: options.PoseFile = None,
    displacements: options.JointValues = None,
    output: Annotated[
        Path | None, output_option("FILE", "A .pose file, or a .fig with these displacements.")
    ] = None,
) -> CommandResult:
    """Show or save a pose: displacements of joints, positions.

    The option --set may be repeated and changes what --pose says.
    """
    if output is not None and output.suffix.lower() not in (POSE_FILE.suffix, FIGURE_FILE.suffix):
        raise UsageError(
            f"{output}: {outputs.suffix_fault(output)}; "
            f"known are {POSE_FILE.suffix}, {FIGURE_FILE.suffix}"
        )
    figure, warnings = inputs.load_figure(name)
    placement, more = inputs.placement_from_options(figure, file, displacements or ())
    files = outputs.output_files(output, (figure.path, file))
    for path in files:
        if path.suffix.lower() == POSE_FILE.suffix:
            outputs.write_pose_file(path, figure, placement.displacements)
        else:
            outputs.write_file(path, write_figure(pose_figure(figure, placement.displacements)))
    segments: list[SegmentPlace] = []
    for segment in figure.segments.values():
        pose = placement.poses[segment.name]
        sites = {
            site.name: in_cm((pose @ site.pose_in_segment)[:3, 3])
            for site in segment.sites.values()
        }
        segments.append(SegmentPlace(segment.name, in_cm(pose[:3, 3]), pose[:3, :3], sites))
    joints = joint_displacements(figure, placement.displacements)
    return PoseResult(name, joints, segments, files, diagnostics=(*warnings, *more))
