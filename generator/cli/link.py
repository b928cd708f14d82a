"""`mover link`: what follows when joints are set that control others."""

from collections.abc import Mapping, Sequence
from math import isclose
from pathlib import Path

from generator.cli.answer import Answer, UsageError, aligned, counted
from generator.cli.inputs import figure_of, placement_asked
from generator.cli.options import chains_of, displacements_given, in_units
from generator.cli.outputs import insist_writable, write_text
from generator.cli.shoulder import insist_on_pose_file
from generator.diagnostics import InputError
from generator.figure import Figure
from generator.figure_file.write import write_pose
from generator.kinematics.links import Freedom, Link, Links, examine_links
from generator.kinematics.loops import assemble
from generator.kinematics.placement import Displacements
from generator.motion_files.action import unit_of

_SAME = 1e-9
"""Largest difference of displacements that count as one [rad or m]."""


def link(
    name: str,
    links_file: Path,
    pose: Path | None = None,
    sets: Sequence[str] = (),
    output: Path | None = None,
) -> Answer:
    """Set joints of the figure that `name` means, and let the linked ones follow.

    Args:
        name: a path, or the name of a shipped figure.
        links_file: a links file.
        pose: a pose file to start from, in place of the figure's own pose.
        sets: of the form `JOINT=a,b,c` [deg or cm].
        output: pose file for all joints.

    Raises:
        UsageError: a setting cannot be read, or asks a follower for another place.
        InputError: the figure, its links or the pose are wrong, or the output cannot be written.
        OpenLoopError: the figure's loops cannot be closed with the linked joints as they are.
    """
    insist_on_pose_file(output)
    figure, warnings = figure_of(name)
    reading = examine_links(links_file, figure)
    if reading.links is None:
        raise InputError((*warnings, *reading.faults))
    files = [] if output is None else [output]
    insist_writable(files, (figure.path, links_file, pose))
    placement, more = placement_asked(figure, pose, sets)
    moved = reading.links.follow(placement.displacements)
    given = displacements_given("--set", sets, chains_of(figure))
    _insist(figure, reading.links, given, moved)
    linked = {end.joint for one in reading.links.resolved for end in (one.follower, one.control)}
    moved = assemble(placement.tree, moved, held=linked | set(given)).displacements
    for path in files:
        write_text(path, write_pose(figure, {one: list(row) for one, row in moved.items()}))
    shown = {one: row for one, row in moved.items() if one in linked or one in given}
    return Answer(
        text="\n\n".join(
            [
                f"{name}: {counted(len(reading.links.links), 'link')}",
                _links_text(figure, reading.links),
                _pose_text(figure, shown),
                *(f"wrote {path}" for path in files),
            ]
        ),
        data={
            "figure": name,
            "links": [_link_data(figure, one) for one in reading.links.resolved],
            "joints": [
                {
                    "name": one,
                    "displacement": in_units(moved[one], joint.chain),
                    "units": [unit_of(factor) for factor in joint.chain],
                }
                for one, joint in figure.joints.items()
            ],
            "files": [str(path) for path in files],
        },
        faults=(*warnings, *reading.faults, *more),
    )


def _insist(
    figure: Figure, links: Links, given: Mapping[str, Sequence[float]], moved: Displacements
) -> None:
    """Raise UsageError where a setting says of a follower what does not follow."""
    for one in links.resolved:
        joint, k = one.follower.joint, one.follower.index
        if joint not in given:
            continue
        follows, said = float(moved[joint][k]), given[joint][k]
        if not isclose(follows, said, rel_tol=_SAME, abs_tol=_SAME):
            raise UsageError(
                f"--set {joint}: {one.follower} follows {one.control} and is at "
                f"{_shown(figure, one.follower, follows)}, not {_shown(figure, one.follower, said)}"
            )


def _links_text(figure: Figure, links: Links) -> str:
    rows = [["follower", "is"]]
    for one in links.resolved:
        law = f"{one.factor:g} * {one.control}"
        offset = f" + {_shown(figure, one.follower, one.offset)}" if one.offset else ""
        rows.append([str(one.follower), law + offset])
    return aligned(rows, left=2)


def _pose_text(figure: Figure, displacements: Displacements) -> str:
    rows = [["joint", "displacement"]]
    rows += [
        [name, ", ".join(_shown(figure, Freedom(name, k), float(v)) for k, v in enumerate(row))]
        for name, row in displacements.items()
    ]
    return aligned(rows, left=2)


def _link_data(figure: Figure, one: Link) -> dict[str, object]:
    factor = figure.joints[one.follower.joint].chain[one.follower.index]
    return {
        "joint": one.follower.joint,
        "dof": one.follower.index + 1,
        "control": one.control.joint,
        "control_dof": one.control.index + 1,
        "factor": one.factor,
        "offset": in_units([one.offset], [factor])[0],
        "unit": unit_of(factor),
    }


def _shown(figure: Figure, freedom: Freedom, value: float) -> str:
    factor = figure.joints[freedom.joint].chain[freedom.index]
    return f"{round(in_units([value], [factor])[0], 3) + 0.0:g} {unit_of(factor)}"
