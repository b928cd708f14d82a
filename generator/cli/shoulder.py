"""`mover shoulder`: position an arm by the latitude and longitude of its elbow."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from enum import StrEnum
from math import degrees, isfinite, radians
from pathlib import Path
from typing import Annotated, NamedTuple

import numpy as np
import typer

from generator.cli import inputs, options, outputs
from generator.cli.answer import HIDDEN, CommandResult, Paragraphs, Table, format_written
from generator.cli.options import format_rounded, in_display_units
from generator.diagnostics import ModelError, UsageError
from generator.kinematics.shoulder import RHYTHMS, ShoulderAngles, Side, jumps_near
from generator.kinematics.shoulder_pose import pose_arm
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


class NearJump(NamedTuple):
    """A discontinuity near the direction of an elbow."""

    angle: str
    place: str
    size_deg: float
    distance_deg: float


@dataclass(frozen=True)
class ShoulderResult(CommandResult):
    """Angles of an arm and the displacements of its joints."""

    figure: str
    side: Side
    latitude_deg: float
    longitude_deg: float
    rhythm: Rhythm
    angles_deg: Mapping[str, float]
    displacements: Mapping[str, Sequence[float]]
    elbow_error_deg: float
    printed_miss_deg: float
    near: Sequence[NearJump]
    references: Sequence[str]
    files: Sequence[Path]
    has_clavicle: bool = field(metadata=HIDDEN)

    def paragraphs(self) -> Paragraphs:
        """Return the angles, the displacements, and what is discontinuous nearby."""
        yield (
            f"{self.figure}, {self.side} arm, elbow at latitude {self.latitude_deg:g} deg, "
            f"longitude {self.longitude_deg:g} deg"
        )
        rows = [["angle", "", "[deg]"]]
        for name, value in self.angles_deg.items():
            about = _ANGLE_DESCRIPTIONS[name]
            rows.append([name.replace("_", " "), about, format_rounded(value, 3)])
        yield Table(rows, 2)
        rows = [["joint", "displacement [deg]"]]
        for name, values in self.displacements.items():
            rows.append([name, ",".join(format_rounded(value, 3) for value in values)])
        yield (
            f"{Table(rows)}\nThe elbow of the figure is {self.elbow_error_deg:.1g} deg from where "
            "it was asked for; with the humerus angles as printed it would miss by "
            f"{self.printed_miss_deg:.1f} deg."
        )
        jumps = [
            f"\n  {jump.angle.replace('_', ' ')} jumps by {jump.size_deg:.3g} deg, "
            f"{jump.distance_deg:.2g} deg away, at {jump.place}"
            for jump in self.near
        ]
        if jumps:
            title = "Near a discontinuity, where a small motion of the arm changes an angle by much"
            yield f"{title}:{''.join(jumps)}"
        name = RHYTHMS[self.rhythm].name
        lines = [f"rhythm {name}: {reference}" for reference in self.references]
        if not self.has_clavicle:
            joint = f"{self.side}_clavicle"
            lines.append(f"The figure has no joint `{joint}`: the arm turns on the torso.")
        yield "\n".join(lines)
        yield format_written(self.files)


def shoulder(
    name: options.FigureName,
    side: Annotated[Side, typer.Option(help="Side of the arm.")],
    latitude: Annotated[float, typer.Option(help="Elbow latitude [deg]: 0 overhead, 180 hanging.")],
    longitude: Annotated[float, typer.Option(help="Elbow longitude [deg]: 0 forward, 90 outward.")],
    rhythm: Annotated[Rhythm, typer.Option(help="Rhythm of the clavicle.")] = Rhythm.OTANI,
    output: options.PoseOutput = None,
) -> CommandResult:
    """Pose an arm by the direction of its elbow."""
    for option, value in (("--latitude", latitude), ("--longitude", longitude)):
        if not isfinite(value):
            raise UsageError(f"{option} {value}: the number must be finite")
        if not (bound := INPUT_BOUNDS[Dimension.ANGLE]).contains(radians(value)):
            raise UsageError(f"{option} {value:g}: {bound}")
    if not 0.0 <= latitude <= 180.0:
        raise UsageError(f"--latitude {latitude:g}: must be between 0 (overhead) and 180 (hanging)")
    outputs.check_pose_output(output)
    figure, warnings = inputs.load_figure(name)
    files = outputs.output_files(output, (figure.path,))
    follows = RHYTHMS[rhythm]
    where = radians(latitude), radians(longitude)
    try:
        pose = pose_arm(figure, side, *where, follows)
    except ModelError as failure:
        raise ModelError(f"{name}: {failure}") from None
    for path in files:
        outputs.write_pose_file(path, figure, pose.displacements)
    return ShoulderResult(
        name,
        side,
        latitude,
        longitude,
        rhythm,
        _angles_in_degrees(pose.angles),
        {
            joint: in_display_units(values, figure.joints[joint].chain)
            for joint, values in pose.displacements.items()
        },
        degrees(pose.elbow_error),
        degrees(pose.printed_angle_error),
        [
            NearJump(jump.angle, jump.place, degrees(jump.size), degrees(jump.distance))
            for jump in jumps_near(*where, follows)
        ],
        list(map(str, follows.references)),
        files,
        f"{side}_clavicle" in figure.joints,
        diagnostics=warnings,
    )


def _angles_in_degrees(angles: ShoulderAngles) -> dict[str, float]:
    """Return the angles by name [deg], the twist within half a turn of zero."""
    values = {one.name: np.asarray(getattr(angles, one.name)) for one in fields(angles)}
    values["twist"] = wrap_angle(values["twist"])
    return {name: degrees(float(value)) for name, value in values.items()}
