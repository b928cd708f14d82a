"""`mover settle`: the pose in which a figure comes to rest."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import numpy as np
import typer

from generator.cli.answer import CommandResult, ExitCode, format_count, format_table
from generator.cli.contact import (
    FloorOption,
    FrictionOption,
    HeightOption,
    SceneOption,
    add_sphere_warnings,
    scene_from_options,
)
from generator.cli.inputs import (
    constraints_from_options,
    load_figure,
    require_simulatable,
    springs_from_option,
    start_displacements_from_options,
)
from generator.cli.interrupts import hold_interrupts
from generator.cli.options import (
    FigureName,
    Gravity,
    JoiningLaw,
    JointValues,
    LinksFile,
    LockedJoints,
    PoseFile,
    PoseOutput,
    SpringsChoice,
    displacements_data,
    format_rounded,
    in_display_units,
    vector_from_option,
)
from generator.cli.outputs import check_pose_output, check_writable, write_pose_file
from generator.cli.progress import (
    item_progress_bar,
    load_compiled_integrator,
    no_item_monitor,
)
from generator.diagnostics import Diagnostic, MoverError, UsageError, warning
from generator.figure import Figure
from generator.kinematics.links import mirrored_differences, mirrored_name
from generator.kinematics.placement import forward_kinematics, initial_displacements
from generator.kinematics.tree import build_tree
from generator.rotations import Array
from generator.scene import Plane
from generator.simulation.import_exudyn import import_exudyn
from generator.simulation.plan import STANDARD_GRAVITY, Plan

if TYPE_CHECKING:
    from generator.simulation.equilibrium import Equilibrium
    from generator.simulation.resting import AttachedPose, RestingPose


def settle(
    name: FigureName,
    springs: SpringsChoice = None,
    law: JoiningLaw = None,
    gravity: Gravity = None,
    pose: PoseFile = None,
    displacements: JointValues = None,
    links: LinksFile = None,
    locks: LockedJoints = None,
    floor: FloorOption = False,
    height: HeightOption = None,
    friction: FrictionOption = None,
    scene: SceneOption = None,
    wall_limit: Annotated[
        float | None, typer.Option(help="Limit of computing time [s]. [default: 600]")
    ] = None,
    output: PoseOutput = None,
    *,
    show_progress: bool = False,
) -> CommandResult:
    """Find the equilibrium of a figure under gravity and springs.

    With --floor or --scene, a pose in which the free figure rests on the props.
    The options --set and --lock may be repeated.
    """
    check_pose_output(output)
    figure, warnings = load_figure(name)
    spring_set, more = springs_from_option(figure, springs, law)
    start, doubts = start_displacements_from_options(figure, pose, displacements or ())
    require_simulatable(figure, spring_set, None if links or locks else start, (*warnings, *more))
    constraints, others = constraints_from_options(figure, links, locks or ())
    constraints.check_consistency(figure, displacements or (), 0.0)
    files = [] if output is None else [output]
    check_writable(files, (figure.path, springs, pose, links))
    if wall_limit is not None and not wall_limit > 0.0:
        raise UsageError(f"--wall-limit {wall_limit}: the limit must be positive")
    plan = Plan(
        springs=spring_set,
        joining=law,
        displacements=start,
        links=constraints.links,
        locked=constraints.locked,
        gravity=STANDARD_GRAVITY if gravity is None else vector_from_option("--gravity", gravity),
        wall_limit=Plan.wall_limit if wall_limit is None else wall_limit,
    )
    props = scene_from_options(
        floor=floor, friction=friction, scene=scene, height=height, up=plan.up
    )
    if props.scene.props:
        plan = replace(plan, scene=props.scene, height=props.height, free_root=True)
        faults = (*warnings, *more, *doubts, *others, *props.diagnostics)
        return _rest_on_props(name, figure, plan, output, faults, show_progress=show_progress)
    if height is not None:
        raise UsageError("--height needs --floor or --scene: the figure hangs from the ground")
    with hold_interrupts():  # Exudyn would report Ctrl-C as a damaged installation
        import_exudyn()
    from generator.simulation.equilibrium import (  # Exudyn takes its time
        MAX_STEPS,
        NoEquilibriumError,
        SearchProgress,
    )
    from generator.simulation.equilibrium import find_equilibrium as come_to_rest

    faults = (*warnings, *more, *doubts, *others)
    monitor = item_progress_bar if show_progress else no_item_monitor
    try:
        with monitor(MAX_STEPS, "steps at most") as update:

            def watch(progress: SearchProgress) -> None:
                update(f"{progress.force:.3g} N m or N left")

            rest = come_to_rest(figure, plan, watch)
    except NoEquilibriumError as failure:
        return CommandResult(
            text=f"{name} has no equilibrium pose; nothing was written",
            data={"figure": name, "error": str(failure)},
            diagnostics=faults,
            code=ExitCode.RUN_FAILED,
            failure=str(failure),
        )
    asymmetric: list[str] = []
    if not constraints.links.links and _is_symmetric_set(constraints.locked):
        asymmetric = _asymmetric_joints(figure, start, rest.displacements)
        faults = (*faults, *_asymmetry_warnings(figure, asymmetric, rest.displacements))
    for path in files:
        write_pose_file(path, figure, rest.displacements)
    pose_text = _pose_text(figure, rest.displacements)
    parts = [f"{name} {rest.state}", pose_text, _numbers_text(rest)]
    return CommandResult(
        text="\n\n".join([*parts, *(f"wrote {path}" for path in files)]),
        data={
            "figure": name,
            "state": rest.state,
            "joints": displacements_data(figure, rest.displacements),
            "residual_Nm_or_N": rest.residual,
            "stiffness_Nm_per_rad_or_N_per_m": rest.stiffness,
            "slowest_per_s2": rest.slowest_rate_squared,
            "growth_per_s": rest.growth,
            "energy_J": rest.energy,
            "start_energy_J": rest.start_energy,
            "steps": rest.steps,
            "asymmetric_joints": asymmetric,
            "files": [str(path) for path in files],
        },
        diagnostics=faults,
    )


MAX_SYMMETRIC_DIFFERENCE = 1e-3
"""Difference of a pose from its mirror image beyond which it gets a warning [rad or m]."""

MAX_START_DIFFERENCE = 1e-6
"""Difference of a start from its mirror image up to which it is symmetric [rad or m]."""

MAX_JOINTS_LISTED = 3


def _is_symmetric_set(joints: Sequence[str]) -> bool:
    return {mirrored_name(name) for name in joints} == set(joints)


def _asymmetric_joints(
    figure: Figure, start: Mapping[str, Sequence[float]], rest: Mapping[str, Array]
) -> list[str]:
    """Return the left joints that rest otherwise than the right ones, the largest difference first.

    None if their start already differs.
    """
    own = initial_displacements(build_tree(figure))
    before = {**own, **{name: np.asarray(values) for name, values in start.items()}}
    if max(mirrored_differences(figure, before).values(), default=0.0) > MAX_START_DIFFERENCE:
        return []
    after = mirrored_differences(figure, rest)
    differing = [name for name in after if after[name] > MAX_SYMMETRIC_DIFFERENCE]
    return sorted(differing, key=lambda name: -after[name])


def _asymmetry_warnings(
    figure: Figure, joints: Sequence[str], rest: Mapping[str, Array]
) -> Iterator[Diagnostic]:
    """Yield a warning with the joints that rest asymmetrically."""
    if not joints:
        return
    pairs = [
        f"{name} at {_displacement_text(figure, name, rest)}"
        f" but {mirrored_name(name)} at {_displacement_text(figure, mirrored_name(name), rest)}"
        for name in joints[:MAX_JOINTS_LISTED]
    ]
    more = len(joints) - MAX_JOINTS_LISTED
    others = f"; {format_count(more, 'more pair')}" if more > 0 else ""
    yield warning(
        f"the figure rests asymmetrically after a symmetric start: {'; '.join(pairs)}{others}",
        hint="it may have several poses of rest: compare their energies from other starts (--set), "
        "or link both sides (--links)",
    )


def _displacement_text(figure: Figure, name: str, rest: Mapping[str, Array]) -> str:
    chain = figure.joints[name].chain
    shown = zip(in_display_units(rest[name], chain), chain, strict=True)
    return " ".join(
        f"{format_rounded(value, 1)} {axis.units.displacement}" for value, axis in shown
    )


def _pose_text(figure: Figure, rest: Mapping[str, Array]) -> str:
    rows = [["joint", "displacement"]]
    for name, joint in figure.joints.items():
        values = zip(in_display_units(rest[name], joint.chain), joint.chain, strict=True)
        rows.append(
            [
                name,
                *(
                    f"{format_rounded(value, 3)} {factor.units.displacement}"
                    for value, factor in values
                ),
            ]
        )
    return format_table(rows)


def _numbers_text(rest: "Equilibrium") -> str:
    rows = [["residual force", f"{rest.residual:.2g} N m or N"]]
    if rest.stiffness is not None and rest.slowest_rate_squared is not None:
        rows.append(["smallest stiffness", f"{rest.stiffness:.4g} {rest.stiffness_unit}"])
        rows.append(
            ["squared rate of the slowest motion", f"{rest.slowest_rate_squared:.4g} 1/s^2"]
        )
    if rest.has_growing_motions:
        rows.append(["small motions grow at a rate of", f"{rest.growth:.4g} 1/s"])
    if rest.energy is not None and rest.start_energy is not None:
        lost = rest.start_energy - rest.energy
        rows.append(["energy", f"{rest.energy:.6g} J, {lost:.6g} J less than at the start"])
    rows.append(["steps", str(rest.steps)])
    return format_table(rows, left_columns=2)


def _rest_on_props(
    name: str,
    figure: Figure,
    plan: Plan,
    output: Path | None,
    faults: tuple[Diagnostic, ...],
    *,
    show_progress: bool,
) -> CommandResult:
    """Find a pose of the free figure at rest on the props of a plan."""
    with hold_interrupts():
        import_exudyn()
    load_compiled_integrator(show_progress=show_progress)
    try:
        from generator.simulation.resting import MAX_TESTS, attach_pose, find_resting_pose
    except ImportError as failure:
        raise MoverError(f"a pose at rest on props needs numba: {failure}") from None
    from generator.simulation.equilibrium import NoEquilibriumError

    faults = add_sphere_warnings(figure, tuple(faults))
    monitor = item_progress_bar if show_progress else no_item_monitor
    try:
        with monitor(MAX_TESTS, "tests at most") as update:

            def watch(now: float, acceleration: float) -> None:
                update(f"{now:.3g} s, {acceleration:.2g} m/s^2 left")

            rest = find_resting_pose(figure, plan, watch)
    except NoEquilibriumError as failure:
        return CommandResult(
            text=f"{name} does not come to rest on {_prop_names(plan)}; nothing was written",
            data={"figure": name, "error": str(failure)},
            diagnostics=faults,
            code=ExitCode.RUN_FAILED,
            failure=str(failure),
        )
    attached = attach_pose(figure, rest)
    asymmetric: list[str] = []
    if _is_symmetric_start(figure, plan):
        asymmetric = _asymmetric_joints(figure, plan.displacements, attached.displacements)
    if asymmetric:
        faults = (*faults, _side_warning())
    files = [] if output is None else [output]
    for path in files:
        write_pose_file(path, figure, attached.displacements)
        faults = (*faults, *_loss_warnings(path, attached))
    state = "a stable pose" if rest.is_stable else "an unstable pose, which it leaves if disturbed"
    parts = [
        f"{name} rests on {_prop_names(plan)} in {state}",
        _pose_text(figure, attached.displacements),
        _load_text(rest),
        _rest_text(rest),
    ]
    return CommandResult(
        text="\n\n".join([*parts, *(f"wrote {path}" for path in files)]),
        data={
            "figure": name,
            "stable": rest.is_stable,
            "props": [prop.name for prop in plan.scene.props],
            "joints": displacements_data(figure, attached.displacements),
            "centre_of_mass_m": rest.centre_of_mass.tolist(),
            "height_m": rest.height,
            "weight_N": rest.weight,
            "weight_carried": rest.weight_carried,
            "shares": dict(rest.shares),
            "forces_N": {segment: force.tolist() for segment, force in rest.forces.items()},
            "depths_m": dict(rest.depths),
            "energy_J": rest.energy,
            "start_energy_J": rest.start_energy,
            "acceleration_m_per_s2": rest.acceleration,
            "creep_m_per_s": rest.creep,
            "growth_per_s": rest.growth,
            "simulated_s": rest.time,
            "asymmetric_joints": asymmetric,
            "orientations_lost": list(attached.turned),
            "places_lost": list(attached.moved),
            "files": [str(path) for path in files],
        },
        diagnostics=faults,
    )


MAX_START_DISTANCE = 1e-3
"""Distance of a centre of mass from its mirror image up to which a start is symmetric [m]."""


def _is_symmetric_start(figure: Figure, plan: Plan) -> bool:
    """Return whether figure and props are about their own mirror images in a plane of constant x.

    Boxes count as asymmetric.
    """
    sideways = [plan.up[0]]
    for prop in plan.scene.props:
        sideways.append(prop.shape.normal[0] if isinstance(prop.shape, Plane) else 1.0)
    has_pairs = all(mirrored_name(name) in figure.bodies for name in figure.bodies)
    if any(sideways) or not has_pairs or not _is_symmetric_set(plan.locked):
        return False
    tree = build_tree(figure)
    changed = {name: np.asarray(values) for name, values in plan.displacements.items()}
    poses = forward_kinematics(tree, {**initial_displacements(tree), **changed}).poses
    centres = {
        name: (poses[name] @ np.append(np.asarray(segment.centre_of_mass), 1.0))[:3]
        for name, segment in figure.bodies.items()
    }
    others = {name: centres[mirrored_name(name)] for name in centres}
    middles = [0.5 * (centre[0] + others[name][0]) for name, centre in centres.items()]
    offsets = [centre[1:] - others[name][1:] for name, centre in centres.items()]
    return bool(
        np.ptp(middles) <= MAX_START_DISTANCE and np.max(np.abs(offsets)) <= MAX_START_DISTANCE
    )


def _side_warning() -> Diagnostic:
    return warning(
        "the figure rests asymmetrically after a symmetric start: it may fall to the other side "
        "as well",
        hint="turn the start a little to choose the side (--set), and compare several starts",
    )


def _prop_names(plan: Plan) -> str:
    return " and ".join(prop.name for prop in plan.scene.props)


def _loss_warnings(path: Path, attached: "AttachedPose") -> Iterator[Diagnostic]:
    """Warn of what the joints to the ground cannot hold of a pose at rest."""
    if attached.turned:
        yield warning(
            f"{path} does not hold the orientation of {attached.turned[0]}: the joints to the "
            "ground cannot have it"
        )
    elif attached.moved:
        yield warning(
            f"{path} holds the joints and the orientation, but not the place of the figure",
            hint="--height sets its height again; beside boxes its horizontal place matters too",
        )


def _load_text(rest: "RestingPose") -> str:
    """Format what the segments that touch props carry, the largest force first."""
    rows = [["touching", "of the weight", "force [N]", "depth [mm]"]]
    sizes = {name: float(np.linalg.norm(force)) for name, force in rest.forces.items()}
    for name in sorted(sizes, key=lambda name: -sizes[name]):
        if sizes[name] > 0.0:
            share = f"{100.0 * rest.shares[name]:.1f} %" if rest.shares else ""
            rows.append([name, share, f"{sizes[name]:.4g}", f"{1000.0 * rest.depths[name]:.1f}"])
    return format_table(rows) if len(rows) > 1 else "nothing is touched"


def _rest_text(rest: "RestingPose") -> str:
    rows: list[list[str]] = []
    if rest.weight_carried is not None:
        rows.append(["weight carried", f"{rest.weight_carried:.4f} of {rest.weight:.4g} N"])
    rows.append(["height of the centre of mass", f"{rest.height:.4g} m"])
    if rest.energy is not None and rest.start_energy is not None:
        lost = rest.start_energy - rest.energy
        rows.append(["energy", f"{rest.energy:.6g} J, {lost:.6g} J less than at the start"])
    rows += [
        ["remaining acceleration", f"{rest.acceleration:.2g} m/s^2 ({rest.fastest})"],
        ["creep by smooth friction", f"{1000.0 * rest.creep:.2g} mm/s ({rest.creeping})"],
    ]
    if not rest.is_stable:
        rows.append(["small motions grow at a rate of", f"{rest.growth:.4g} 1/s"])
    rows.append(["found after", f"{rest.time:.4g} s of a damped fall"])
    return format_table(rows, left_columns=2)
