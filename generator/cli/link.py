"""`mover link`: what follows when joints are set that control others."""

from collections.abc import Mapping, Sequence
from math import isclose
from pathlib import Path
from typing import Annotated

import typer

from generator.cli.answer import CommandResult, format_count, format_table
from generator.cli.inputs import load_figure, placement_from_options
from generator.cli.options import (
    FigureName,
    JointValues,
    PoseFile,
    PoseOutput,
    displacements_data,
    displacements_from_options,
    in_display_units,
)
from generator.cli.outputs import check_pose_output, check_writable, write_pose_file
from generator.diagnostics import InputError, UsageError
from generator.figure import Figure
from generator.kinematics.free_root import settable_chains
from generator.kinematics.links import LINKS_FILE, Coordinate, Link, Links
from generator.kinematics.loops import close_loops
from generator.kinematics.placement import Displacements

_AGREEMENT_TOLERANCE = 1e-9
"""Largest difference of displacements that count as one [rad or m]."""


def link(
    name: FigureName,
    links_file: Annotated[
        Path, typer.Argument(metavar="LINKS.toml", help="Links file (docs/links.md).")
    ],
    pose: PoseFile = None,
    displacements: JointValues = None,
    output: PoseOutput = None,
) -> CommandResult:
    """Set joints and move the joints that are linked to them.

    The option --set may be repeated and changes what --pose says.
    """
    check_pose_output(output)
    figure, warnings = load_figure(name)
    reading = LINKS_FILE.parse_file(links_file, figure)
    if reading.value is None:
        raise InputError((*warnings, *reading.diagnostics))
    files = [] if output is None else [output]
    check_writable(files, (figure.path, links_file, pose))
    placement, more = placement_from_options(figure, pose, displacements or ())
    moved = reading.value.follow(placement.displacements)
    set_values = displacements_from_options("--set", displacements or (), settable_chains(figure))
    _check_followers(figure, reading.value, set_values, moved)
    linked = {end.joint for one in reading.value.resolved for end in (one.follower, one.control)}
    moved = close_loops(placement.tree, moved, fixed=linked | set(set_values)).displacements
    for path in files:
        write_pose_file(path, figure, moved)
    shown = {one: row for one, row in moved.items() if one in linked or one in set_values}
    return CommandResult(
        text="\n\n".join(
            [
                f"{name}: {format_count(len(reading.value.links), 'link')}",
                _links_text(figure, reading.value),
                _pose_text(figure, shown),
                *(f"wrote {path}" for path in files),
            ]
        ),
        data={
            "figure": name,
            "links": [_link_data(figure, one) for one in reading.value.resolved],
            "joints": displacements_data(figure, moved),
            "files": [str(path) for path in files],
        },
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
        follows, requested_value = float(displacements[joint][k]), requested[joint][k]
        if not isclose(
            follows, requested_value, rel_tol=_AGREEMENT_TOLERANCE, abs_tol=_AGREEMENT_TOLERANCE
        ):
            follows_text, requested_text = (
                _format_coordinate(figure, one.follower, value)
                for value in (follows, requested_value)
            )
            raise UsageError(
                f"--set {joint}: {one.follower} follows {one.control} and is at {follows_text}, "
                f"not {requested_text}"
            )


def _links_text(figure: Figure, links: Links) -> str:
    rows = [["follower", "is"]]
    for one in links.resolved:
        law = f"{one.factor:g} * {one.control}"
        offset = f" + {_format_coordinate(figure, one.follower, one.offset)}" if one.offset else ""
        rows.append([str(one.follower), law + offset])
    return format_table(rows, left_columns=2)


def _pose_text(figure: Figure, displacements: Displacements) -> str:
    rows = [["joint", "displacement"]]
    rows += [
        [
            name,
            ", ".join(
                _format_coordinate(figure, Coordinate(name, k), float(v)) for k, v in enumerate(row)
            ),
        ]
        for name, row in displacements.items()
    ]
    return format_table(rows, left_columns=2)


def _link_data(figure: Figure, one: Link) -> dict[str, object]:
    factor = figure.joints[one.follower.joint].chain[one.follower.index]
    return {
        "joint": one.follower.joint,
        "dof": one.follower.index + 1,
        "control": one.control.joint,
        "control_dof": one.control.index + 1,
        "factor": one.factor,
        "offset": in_display_units([one.offset], [factor])[0],
        "unit": factor.units.displacement,
    }


def _format_coordinate(figure: Figure, coordinate: Coordinate, value: float) -> str:
    factor = figure.joints[coordinate.joint].chain[coordinate.index]
    return f"{round(in_display_units([value], [factor])[0], 3) + 0.0:g} {factor.units.displacement}"
