"""`mover settle`: the pose in which a figure comes to rest."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from generator.cli.answer import CommandResult, ExitCode, format_table
from generator.cli.inputs import (
    load_figure,
    require_simulatable,
    springs_from_option,
    start_displacements_from_options,
)
from generator.cli.options import format_rounded, in_display_units, vector_from_option
from generator.cli.outputs import check_writable, write_text
from generator.cli.shoulder import check_pose_output
from generator.cli.simulate import constraints_from_options
from generator.figure import Figure
from generator.figure_file.write import write_pose
from generator.motion_files.action import display_unit
from generator.simulation.import_exudyn import import_exudyn
from generator.simulation.plan import STANDARD_GRAVITY, Plan
from springs import Joining

if TYPE_CHECKING:
    from generator.simulation.equilibrium import Equilibrium


@dataclass(frozen=True)
class Request:
    """The command line of `mover settle`; None where an option is not given."""

    figure: str
    springs: str | None = None
    law: str | None = None
    gravity: str | None = None
    pose: Path | None = None
    displacements: Sequence[str] = ()
    links: Path | None = None
    locks: Sequence[str] = ()
    output: Path | None = None


def settle(request: Request) -> CommandResult:
    """Let a figure come to rest, and write the pose.

    Raises:
        UsageError: an option cannot be read or does not fit the figure.
        InputError: a file is wrong, or cannot be written.
        MoverError: the figure cannot be built as asked.
    """
    check_pose_output(request.output)
    joining = None if request.law is None else Joining(request.law)
    figure, warnings = load_figure(request.figure)
    require_simulatable(figure, warnings)
    springs, more = springs_from_option(figure, request.springs, joining)
    start, doubts = start_displacements_from_options(figure, request.pose, request.displacements)
    holding, others = constraints_from_options(figure, request.links, request.locks)
    holding.check_consistency(figure, request.displacements, 0.0)
    files = [] if request.output is None else [request.output]
    check_writable(files, (figure.path, request.springs, request.pose, request.links))
    gravity = STANDARD_GRAVITY
    if request.gravity is not None:
        gravity = vector_from_option("--gravity", request.gravity)
    plan = Plan(
        springs=springs,
        joining=joining,
        displacements=start,
        links=holding.links,
        locked=holding.locked,
        gravity=gravity,
    )
    import_exudyn()
    from generator.simulation.equilibrium import NoEquilibriumError  # Exudyn takes its time
    from generator.simulation.equilibrium import find_equilibrium as come_to_rest

    faults = (*warnings, *more, *doubts, *others)
    try:
        rest = come_to_rest(figure, plan)
    except NoEquilibriumError as failure:
        return CommandResult(
            text=f"{request.figure} is not at rest, and nothing is written",
            data={"figure": request.figure, "error": str(failure)},
            diagnostics=faults,
            code=ExitCode.RUN_FAILED,
            failure=str(failure),
        )
    for path in files:
        write_text(
            path, write_pose(figure, {n: list(row) for n, row in rest.displacements.items()})
        )
    parts = [f"{request.figure} {rest.state}", _pose_text(figure, rest), _numbers_text(rest)]
    return CommandResult(
        text="\n\n".join([*parts, *(f"wrote {path}" for path in files)]),
        data={
            "figure": request.figure,
            "state": rest.state,
            "joints": [
                {
                    "name": name,
                    "displacement": in_display_units(rest.displacements[name], joint.chain),
                    "units": [display_unit(factor) for factor in joint.chain],
                }
                for name, joint in figure.joints.items()
            ],
            "residual_Nm_or_N": rest.residual,
            "stiffness_Nm_per_rad_or_N_per_m": rest.stiffness,
            "slowest_per_s2": rest.slowest_rate_squared,
            "growth_per_s": rest.growth,
            "energy_J": rest.energy,
            "start_energy_J": rest.start_energy,
            "steps": rest.steps,
            "files": [str(path) for path in files],
        },
        diagnostics=faults,
    )


def _pose_text(figure: Figure, rest: "Equilibrium") -> str:
    rows = [["joint", "displacement"]]
    for name, joint in figure.joints.items():
        values = zip(
            in_display_units(rest.displacements[name], joint.chain), joint.chain, strict=True
        )
        rows.append(
            [
                name,
                *(f"{format_rounded(value, 3)} {display_unit(factor)}" for value, factor in values),
            ]
        )
    return format_table(rows)


def _numbers_text(rest: "Equilibrium") -> str:
    rows = [["largest force left", f"{rest.residual:.2g} N m or N"]]
    if rest.stiffness is not None and rest.slowest_rate_squared is not None:
        rows.append(["smallest stiffness", f"{rest.stiffness:.4g} {rest.stiffness_unit}"])
        rows.append(
            ["square of the slowest motion's rate", f"{rest.slowest_rate_squared:.4g} 1/s^2"]
        )
    if rest.has_growing_motions:
        rows.append(["small motions grow at a rate of", f"{rest.growth:.4g} 1/s"])
    if rest.energy is not None and rest.start_energy is not None:
        lost = rest.start_energy - rest.energy
        rows.append(["energy", f"{rest.energy:.6g} J, {lost:.6g} J less than at the start"])
    rows.append(["steps", str(rest.steps)])
    return format_table(rows, left_columns=2)
