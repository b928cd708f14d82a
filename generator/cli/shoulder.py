"""`mover shoulder`: position an arm by the latitude and longitude of its elbow."""

from collections.abc import Sequence
from dataclasses import fields
from enum import StrEnum
from math import degrees, isfinite, radians
from typing import Annotated

import numpy as np
import typer

from generator.cli.answer import CommandResult, format_table
from generator.cli.inputs import load_figure
from generator.cli.options import FigureName, PoseOutput, format_rounded, in_display_units
from generator.cli.outputs import check_pose_output, check_writable, write_pose_file
from generator.diagnostics import ModelError, UsageError
from generator.figure import Figure
from generator.kinematics.shoulder import (
    RHYTHMS,
    Jump,
    ShoulderAngles,
    ShoulderRhythm,
    Side,
    jumps_near,
)
from generator.kinematics.shoulder_pose import ArmPose, pose_arm
from generator.rotations import wrap_angle
from generator.units import INPUT_BOUNDS, Dimension

_ANGLE_DESCRIPTIONS = {
    "clavicle_elevation": "upwards",
    "clavicle_abduction": "forwards",
    "humerus_elevation": "on the clavicle, as printed (eq. 5.47)",
    "humerus_abduction": "on the clavicle, as printed (eq. 5.48)",
    "twist": "about the humerus, natural (eq. 5.49)",
}


class Rhythm(StrEnum):
    """Rhythms of the shoulder, by the keys of `RHYTHMS`."""

    OTANI = "otani"
    DE_GROOT_BRAND = "de_groot_brand"


def shoulder(
    name: FigureName,
    side: Annotated[Side, typer.Option(help="Side of the arm.")],
    latitude: Annotated[float, typer.Option(help="Elbow latitude [deg]: 0 overhead, 180 hanging.")],
    longitude: Annotated[float, typer.Option(help="Elbow longitude [deg]: 0 forward, 90 outward.")],
    rhythm: Annotated[Rhythm, typer.Option(help="Rhythm of the clavicle.")] = Rhythm.OTANI,
    output: PoseOutput = None,
) -> CommandResult:
    """Pose an arm by the direction of its elbow."""
    for option, value in (("--latitude", latitude), ("--longitude", longitude)):
        if not isfinite(value):
            raise UsageError(f"{option} {value}: the number must be finite")
        if not (bound := INPUT_BOUNDS[Dimension.ANGLE]).contains(radians(value)):
            raise UsageError(f"{option} {value:g}: {bound}")
    if not 0.0 <= latitude <= 180.0:
        raise UsageError(f"--latitude {latitude:g}: must be between 0 (overhead) and 180 (hanging)")
    check_pose_output(output)
    figure, warnings = load_figure(name)
    files = [] if output is None else [output]
    check_writable(files, (figure.path,))
    follows = RHYTHMS[rhythm]
    where = radians(latitude), radians(longitude)
    try:
        pose = pose_arm(figure, side, *where, follows)
    except ModelError as failure:
        raise ModelError(f"{name}: {failure}") from None
    near = jumps_near(*where, follows)
    for path in files:
        write_pose_file(path, figure, pose.displacements)
    head = f"{name}, {side} arm, elbow at latitude {latitude:g} deg, longitude {longitude:g} deg"
    return CommandResult(
        text="\n\n".join(
            [head, _angles_text(pose.angles), _pose_text(figure, pose)]
            + ([_jumps_text(near)] if near else [])
            + [_rhythm_text(figure, side, follows), *(f"wrote {path}" for path in files)]
        ),
        data={
            "figure": name,
            "side": side.value,
            "latitude_deg": latitude,
            "longitude_deg": longitude,
            "rhythm": rhythm.value,
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
    return "\n".join(
        ["Near a discontinuity, where a small motion of the arm changes an angle by much:", *lines]
    )


def _rhythm_text(figure: Figure, side: str, rhythm: ShoulderRhythm) -> str:
    lines = [f"rhythm {rhythm.name}: {reference}" for reference in rhythm.references]
    if f"{side}_clavicle" not in figure.joints:
        lines.append(f"The figure has no joint `{side}_clavicle`: the arm turns on the torso.")
    return "\n".join(lines)
