"""`mover settle`: the pose in which a figure comes to rest."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from generator.cli.answer import Answer, ExitCode, aligned
from generator.cli.inputs import figure_of, insist_on_motion, springs_of, start_of
from generator.cli.options import in_units, rounded, vector_given
from generator.cli.outputs import insist_writable, write_text
from generator.cli.shoulder import insist_on_pose_file
from generator.cli.simulate import holding_of
from generator.figure import Figure
from generator.figure_file.write import write_pose
from generator.motion_files.action import unit_of
from generator.simulation.import_exudyn import open_exudyn
from generator.simulation.plan import STANDARD_GRAVITY, Plan
from springs import Joining

if TYPE_CHECKING:
    from generator.simulation.equilibrium import Rest


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


def settle(request: Request) -> Answer:
    """Let a figure come to rest, and write the pose.

    Raises:
        UsageError: an option cannot be read or does not fit the figure.
        InputError: a file is wrong, or cannot be written.
        MoverError: the figure cannot be built as asked.
    """
    insist_on_pose_file(request.output)
    joining = None if request.law is None else Joining(request.law)
    figure, warnings = figure_of(request.figure)
    insist_on_motion(figure, warnings)
    springs, more = springs_of(figure, request.springs, joining)
    start, doubts = start_of(figure, request.pose, request.displacements)
    holding, others = holding_of(figure, request.links, request.locks)
    holding.insist_on(figure, request.displacements, 0.0)
    files = [] if request.output is None else [request.output]
    insist_writable(files, (figure.path, request.springs, request.pose, request.links))
    gravity = STANDARD_GRAVITY
    if request.gravity is not None:
        gravity = vector_given("--gravity", request.gravity)
    plan = Plan(
        springs=springs,
        joining=joining,
        displacements=start,
        links=holding.links,
        locked=holding.locked,
        gravity=gravity,
    )
    open_exudyn()
    from generator.simulation.equilibrium import NoRestError  # Exudyn takes its time
    from generator.simulation.equilibrium import settle as come_to_rest

    faults = (*warnings, *more, *doubts, *others)
    try:
        rest = come_to_rest(figure, plan)
    except NoRestError as failure:
        return Answer(
            text=f"{request.figure} is not at rest, and nothing is written",
            data={"figure": request.figure, "error": str(failure)},
            faults=faults,
            code=ExitCode.RUN_FAILED,
            failure=str(failure),
        )
    for path in files:
        write_text(
            path, write_pose(figure, {n: list(row) for n, row in rest.displacements.items()})
        )
    parts = [f"{request.figure} {rest.state}", _pose_text(figure, rest), _numbers_text(rest)]
    return Answer(
        text="\n\n".join([*parts, *(f"wrote {path}" for path in files)]),
        data={
            "figure": request.figure,
            "state": rest.state,
            "joints": [
                {
                    "name": name,
                    "displacement": in_units(rest.displacements[name], joint.chain),
                    "units": [unit_of(factor) for factor in joint.chain],
                }
                for name, joint in figure.joints.items()
            ],
            "residual_Nm_or_N": rest.residual,
            "stiffness_Nm_per_rad_or_N_per_m": rest.stiffness,
            "slowest_per_s2": rest.slowest,
            "growth_per_s": rest.growth,
            "energy_J": rest.energy,
            "start_energy_J": rest.start_energy,
            "steps": rest.steps,
            "files": [str(path) for path in files],
        },
        faults=faults,
    )


def _pose_text(figure: Figure, rest: "Rest") -> str:
    rows = [["joint", "displacement"]]
    for name, joint in figure.joints.items():
        values = zip(in_units(rest.displacements[name], joint.chain), joint.chain, strict=True)
        rows.append([name, *(f"{rounded(value, 3)} {unit_of(factor)}" for value, factor in values)])
    return aligned(rows)


def _numbers_text(rest: "Rest") -> str:
    rows = [["largest force left", f"{rest.residual:.2g} N m or N"]]
    if rest.stiffness is not None and rest.slowest is not None:
        rows.append(["smallest stiffness", f"{rest.stiffness:.4g} {rest.stiffness_unit}"])
        rows.append(["square of the slowest motion's rate", f"{rest.slowest:.4g} 1/s^2"])
    if rest.grows:
        rows.append(["small motions grow at a rate of", f"{rest.growth:.4g} 1/s"])
    if rest.energy is not None and rest.start_energy is not None:
        lost = rest.start_energy - rest.energy
        rows.append(["energy", f"{rest.energy:.6g} J, {lost:.6g} J less than at the start"])
    rows.append(["steps", str(rest.steps)])
    return aligned(rows, left=2)
