"""`mover shoulder`: position an arm by the latitude and longitude of its elbow."""

from collections.abc import Sequence
from dataclasses import fields
from math import degrees, isfinite, radians
from pathlib import Path

import numpy as np

from generator.cli.answer import CommandResult, UsageError, format_table
from generator.cli.inputs import load_figure
from generator.cli.options import format_rounded, in_display_units
from generator.cli.outputs import check_writable, write_text
from generator.figure import Figure
from generator.figure_file.write import write_pose
from generator.input_files.pose import POSE_SUFFIX
from generator.kinematics.shoulder import Jump, ShoulderAngles, ShoulderError, Side, jumps_near
from generator.kinematics.shoulder_pose import ArmPose, pose_arm
from generator.kinematics.shoulder_rhythm import RHYTHMS, ShoulderRhythm
from generator.rotations import wrap_angle
from generator.units import INPUT_BOUNDS, Dimension

_ANGLE_DESCRIPTIONS = {
    "clavicle_elevation": "upwards",
    "clavicle_abduction": "forwards",
    "humerus_elevation": "on the clavicle, as printed (eq. 5.47)",
    "humerus_abduction": "on the clavicle, as printed (eq. 5.48)",
    "twist": "about the humerus, natural (eq. 5.49)",
}


def shoulder(
    name: str,
    *,
    side: str,
    latitude: float,
    longitude: float,
    rhythm: str,
    output: Path | None = None,
) -> CommandResult:
    """Position one arm of the figure that `name` means.

    Args:
        name: a path, or the name of a shipped figure.
        side: "left" or "right".
        latitude: of the elbow [deg], 0 overhead to 180 hanging.
        longitude: of the elbow [deg], 0 ahead, 90 to the arm's own side.
        rhythm: a key of `RHYTHMS`.
        output: pose file for the arm's joints.

    Raises:
        UsageError: a direction that no elbow has, or another kind of output file.
        InputError: the figure is wrong, or the file cannot be written.
        ShoulderError: the figure has no such arm.
    """
    for option, value in (("--latitude", latitude), ("--longitude", longitude)):
        if not isfinite(value):
            raise UsageError(f"{option} {value}: the number must be finite")
        if not (bound := INPUT_BOUNDS[Dimension.ANGLE]).contains(radians(value)):
            raise UsageError(f"{option} {value:g}: {bound}")
    if not 0.0 <= latitude <= 180.0:
        raise UsageError(f"--latitude {latitude:g}: it is between 0, overhead, and 180, hanging")
    check_pose_output(output)
    figure, warnings = load_figure(name)
    files = [] if output is None else [output]
    check_writable(files, (figure.path,))
    follows = RHYTHMS[rhythm]
    where = radians(latitude), radians(longitude)
    try:
        pose = pose_arm(figure, Side(side), *where, follows)
    except ShoulderError as failure:
        raise ShoulderError(f"{name}: {failure}") from None
    near = jumps_near(*where, follows)
    for path in files:
        write_text(path, write_pose(figure, {k: list(v) for k, v in pose.displacements.items()}))
    head = f"{name}, {side} arm, elbow at latitude {latitude:g} deg, longitude {longitude:g} deg"
    return CommandResult(
        text="\n\n".join(
            [head, _angles_text(pose.angles), _pose_text(figure, pose)]
            + ([_jumps_text(near)] if near else [])
            + [_rhythm_text(figure, side, follows), *(f"wrote {path}" for path in files)]
        ),
        data={
            "figure": name,
            "side": side,
            "latitude_deg": latitude,
            "longitude_deg": longitude,
            "rhythm": rhythm,
            "angles_deg": _angles(pose.angles),
            "displacements": _displacements(figure, pose),
            "elbow_error_deg": degrees(pose.elbow_error),
            "printed_miss_deg": degrees(pose.printed_angle_error),
            "near": [
                {
                    "angle": jump.angle,
                    "place": jump.place,
                    "size_deg": degrees(jump.size),
                    "distance_deg": degrees(jump.distance),
                }
                for jump in near
            ],
            "references": [str(reference) for reference in follows.references],
            "files": [str(path) for path in files],
        },
        diagnostics=warnings,
    )


def check_pose_output(output: Path | None) -> None:
    """Raise UsageError for a file that is to hold a pose and has another suffix."""
    if output is not None and output.suffix.lower() != POSE_SUFFIX:
        said = f"`{output.suffix}` is no known suffix" if output.suffix else "the suffix is missing"
        raise UsageError(f"-o {output}: {said}; a pose file ends in {POSE_SUFFIX}")


def _angles(angles: ShoulderAngles) -> dict[str, float]:
    """The angles by name [deg], the twist within half a turn of zero."""
    values = {one.name: np.asarray(getattr(angles, one.name)) for one in fields(angles)}
    values["twist"] = wrap_angle(values["twist"])
    return {name: degrees(float(value)) for name, value in values.items()}


def _displacements(figure: Figure, pose: ArmPose) -> dict[str, list[float]]:
    return {
        name: in_display_units(values, figure.joints[name].chain)
        for name, values in pose.displacements.items()
    }


def _angles_text(angles: ShoulderAngles) -> str:
    rows = [["angle", "", "[deg]"]]
    rows += [
        [name.replace("_", " "), _ANGLE_DESCRIPTIONS[name], format_rounded(value, 3)]
        for name, value in _angles(angles).items()
    ]
    return format_table(rows, left_columns=2)


def _pose_text(figure: Figure, pose: ArmPose) -> str:
    rows = [["joint", "displacement [deg]"]]
    rows += [
        [name, ",".join(format_rounded(value, 3) for value in values)]
        for name, values in _displacements(figure, pose).items()
    ]
    lines = [
        format_table(rows),
        f"The elbow of the figure is {degrees(pose.elbow_error):.1g} deg from where it was asked "
        f"for; with the humerus angles as printed it would miss by "
        f"{degrees(pose.printed_angle_error):.1f} deg.",
    ]
    return "\n".join(lines)


def _jumps_text(jumps: Sequence[Jump]) -> str:
    lines = [
        f"  {jump.angle.replace('_', ' ')} jumps by {degrees(jump.size):.3g} deg, "
        f"{degrees(jump.distance):.2g} deg away, at {jump.place}"
        for jump in jumps
    ]
    return "\n".join(["Near a jump, where a small motion of the arm is a large one:", *lines])


def _rhythm_text(figure: Figure, side: str, rhythm: ShoulderRhythm) -> str:
    lines = [f"rhythm {rhythm.name}: {reference}" for reference in rhythm.references]
    if f"{side}_clavicle" not in figure.joints:
        lines.append(f"The figure has no joint `{side}_clavicle`: the arm turns on the torso.")
    return "\n".join(lines)
