"""`mover settle`: the pose in which a figure comes to rest."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import numpy as np
import typer

from generator.cli import answer, inputs, options
from generator.cli.contact import add_sphere_warnings
from generator.cli.outputs import check_pose_output, output_files, write_pose_file
from generator.cli.progress import (
    item_progress_bar,
    load_compiled_integrator,
    load_exudyn,
    no_monitor,
)
from generator.diagnostics import Diagnostic, MoverError, warning
from generator.figure import Figure
from generator.kinematics.links import mirrored_differences, mirrored_name
from generator.kinematics.placement import forward_kinematics, initial_displacements
from generator.kinematics.tree import build_tree
from generator.model import Model
from generator.rotations import Array
from generator.simulation.plan import Plan

if TYPE_CHECKING:
    from generator.simulation.statics.equilibrium import Equilibrium
    from generator.simulation.statics.resting import AttachedPose, RestingPose


@dataclass(frozen=True)
class NoRest(answer.CommandResult):
    """Failed search for a pose of rest."""

    figure: str
    error: str
    text: str = field(metadata=answer.HIDDEN)

    def paragraphs(self) -> answer.Paragraphs:
        """State that nothing was written."""
        return (f"{self.figure} {self.text}; nothing was written",)


@dataclass(frozen=True)
class HangingRest(answer.CommandResult):
    """Equilibrium of a figure that hangs from the ground."""

    figure: str
    rest: "Equilibrium"
    joints: Sequence[options.JointDisplacement]
    asymmetric_joints: Sequence[str]
    files: Sequence[Path]

    def to_json(self) -> dict[str, object]:
        """Return state, joints, and the numbers of the search."""
        rest = self.rest
        return {
            "figure": self.figure,
            "state": rest.state,
            "joints": self.joints,
            "residual_Nm_or_N": rest.residual,
            "stiffness_Nm_per_rad_or_N_per_m": rest.stiffness,
            "slowest_per_s2": rest.slowest_rate_squared,
            "growth_per_s": rest.growth,
            "energy_J": rest.energy,
            "start_energy_J": rest.start_energy,
            "steps": rest.steps,
            "asymmetric_joints": self.asymmetric_joints,
            "files": self.files,
        }

    def paragraphs(self) -> answer.Paragraphs:
        """Return state, joints, and the numbers of the search."""
        rest = self.rest
        rows = [("residual force", f"{rest.residual:.2g} N m or N")]
        if rest.stiffness is not None and rest.slowest_rate_squared is not None:
            rate = f"{rest.slowest_rate_squared:.4g} 1/s^2"
            rows.append(("smallest stiffness", f"{rest.stiffness:.4g} {rest.stiffness_unit}"))
            rows.append(("squared rate of the slowest motion", rate))
        if rest.has_growing_motions:
            rows.append(("small motions grow at a rate of", f"{rest.growth:.4g} 1/s"))
        rows += [*_energy_rows(rest.energy, rest.start_energy), ("steps", str(rest.steps))]
        yield f"{self.figure} {rest.state}"
        yield _joints_table(self.joints)
        yield answer.Table(rows, 2)
        yield answer.format_written(self.files)


@dataclass(frozen=True)
class PropsRest(answer.CommandResult):
    """Pose of a free figure at rest on props."""

    figure: str
    props: Sequence[str]
    rest: "RestingPose"
    attached: "AttachedPose"
    joints: Sequence[options.JointDisplacement]
    asymmetric_joints: Sequence[str]
    files: Sequence[Path]

    def to_json(self) -> dict[str, object]:
        """Return state, joints, what the segments carry, and the numbers of the search."""
        rest = self.rest
        return {
            "figure": self.figure,
            "stable": rest.is_stable,
            "props": self.props,
            "joints": self.joints,
            "centre_of_mass_m": rest.centre_of_mass,
            "height_m": rest.height,
            "weight_N": rest.weight,
            "weight_carried": rest.weight_carried,
            "shares": rest.shares,
            "forces_N": rest.forces,
            "depths_m": rest.depths,
            "energy_J": rest.energy,
            "start_energy_J": rest.start_energy,
            "acceleration_m_per_s2": rest.acceleration,
            "creep_m_per_s": rest.creep,
            "growth_per_s": rest.growth,
            "simulated_s": rest.time,
            "asymmetric_joints": self.asymmetric_joints,
            "orientations_lost": self.attached.turned,
            "places_lost": self.attached.moved,
            "files": self.files,
        }

    def paragraphs(self) -> answer.Paragraphs:
        """Return state, joints, what the segments carry, and the numbers of the search."""
        rest = self.rest
        state = (
            "a stable pose" if rest.is_stable else "an unstable pose, which it leaves if disturbed"
        )
        yield f"{self.figure} rests on {' and '.join(self.props)} in {state}"
        yield _joints_table(self.joints)
        rows = [["touching", "of the weight", "force [N]", "depth [mm]"]]
        sizes = {name: float(np.linalg.norm(force)) for name, force in rest.forces.items()}
        for name in sorted(sizes, key=lambda name: -sizes[name]):
            if sizes[name] > 0.0:
                share = f"{100.0 * rest.shares[name]:.1f} %" if rest.shares else ""
                depth = f"{1000.0 * rest.depths[name]:.1f}"
                rows.append([name, share, f"{sizes[name]:.4g}", depth])
        yield answer.Table(rows) if len(rows) > 1 else "nothing is touched"
        yield self._numbers()
        yield answer.format_written(self.files)

    def _numbers(self) -> answer.Table:
        rest = self.rest
        rows = [
            ("height of the centre of mass", f"{rest.height:.4g} m"),
            *_energy_rows(rest.energy, rest.start_energy),
            ("remaining acceleration", f"{rest.acceleration:.2g} m/s^2 ({rest.fastest})"),
            ("creep by smooth friction", f"{1000.0 * rest.creep:.2g} mm/s ({rest.creeping})"),
        ]
        if rest.weight_carried is not None:
            carried = f"{rest.weight_carried:.4f} of {rest.weight:.4g} N"
            rows.insert(0, ("weight carried", carried))
        if not rest.is_stable:
            rows.append(("small motions grow at a rate of", f"{rest.growth:.4g} 1/s"))
        return answer.Table([*rows, ("found after", f"{rest.time:.4g} s of a damped fall")], 2)


def _joints_table(joints: Sequence[options.JointDisplacement]) -> answer.Table:
    rows = ([joint.name, *joint.texts(3)] for joint in joints)
    return answer.Table([["joint", "displacement"], *rows])


def _energy_rows(energy: float | None, start: float | None) -> Iterator[tuple[str, str]]:
    """Yield the row on the energy at rest and at the start [J]."""
    if energy is not None and start is not None:
        yield "energy", f"{energy:.6g} J, {start - energy:.6g} J less than at the start"


def settle(
    name: options.FigureName,
    springs: options.SpringsChoice = None,
    law: options.LawChoice = None,
    gravity: options.Gravity = None,
    pose: options.PoseFile = None,
    displacements: options.JointValues = None,
    links: options.LinksFile = None,
    locks: options.LockedJoints = None,
    floor: options.FloorOption = False,
    height: options.HeightOption = None,
    friction: options.FrictionOption = None,
    scene: options.SceneOption = None,
    wall_limit: Annotated[
        float | None, typer.Option(help="Limit of computing time [s]. [default: 600]")
    ] = None,
    output: options.PoseOutput = None,
    *,
    show_progress: bool = False,
) -> answer.CommandResult:
    """Find the equilibrium of a figure under gravity and springs.

    With --floor or --scene, a pose in which the free figure rests on the props.
    The options --set and --lock may be repeated.
    """
    check_pose_output(output)
    plan, of_plan = inputs.plan_from_options(inputs.given_options(locals()))
    figure, warnings = inputs.load_figure(name)
    spring_set, more = inputs.springs_from_option(figure, springs, law)
    start, of_start = inputs.start_displacements_from_options(figure, pose, displacements or ())
    inputs.require_simulatable(
        Model(figure, spring_set), None if links or locks else start, (*warnings, *more)
    )
    constraints, others = inputs.constraints_from_options(figure, links, locks or ())
    constraints.check_consistency(figure, displacements or (), 0.0)
    files = output_files(output, (figure.path, springs, pose, links))
    plan = replace(
        plan,
        springs=spring_set,
        law=law,
        displacements=start,
        links=constraints.links,
        locked=constraints.locked,
    )
    diagnostics = (*warnings, *more, *of_start, *others, *of_plan)
    if plan.scene.props:
        return _rest_on_props(name, figure, plan, output, diagnostics, show_progress=show_progress)
    load_exudyn()
    from generator.simulation.statics.equilibrium import (  # Exudyn takes its time
        MAX_STEPS,
        NoEquilibriumError,
        SearchProgress,
    )
    from generator.simulation.statics.equilibrium import find_equilibrium as come_to_rest

    monitor = item_progress_bar if show_progress else no_monitor
    try:
        with monitor(MAX_STEPS, "steps at most") as update:

            def watch(progress: SearchProgress) -> None:
                update(f"{progress.force:.3g} N m or N left")

            rest = come_to_rest(figure, plan, watch)
    except NoEquilibriumError as failure:
        reason = str(failure)
        return NoRest(
            name, reason, "has no equilibrium pose", diagnostics=diagnostics, failure=reason
        )
    asymmetric: list[str] = []
    if not constraints.links.links and _is_symmetric_set(constraints.locked):
        asymmetric = _asymmetric_joints(figure, start, rest.displacements)
        diagnostics = (*diagnostics, *_asymmetry_warnings(figure, asymmetric, rest.displacements))
    for path in files:
        write_pose_file(path, figure, rest.displacements)
    joints = options.joint_displacements(figure, rest.displacements)
    return HangingRest(name, rest, joints, asymmetric, files, diagnostics=diagnostics)


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
    texts = {one.name: " ".join(one.texts(1)) for one in options.joint_displacements(figure, rest)}
    pairs = [
        f"{name} at {texts[name]} but {mirrored_name(name)} at {texts[mirrored_name(name)]}"
        for name in joints[:MAX_JOINTS_LISTED]
    ]
    more = len(joints) - MAX_JOINTS_LISTED
    others = f"; {answer.format_count(more, 'more pair')}" if more > 0 else ""
    yield warning(
        f"the figure rests asymmetrically after a symmetric start: {'; '.join(pairs)}{others}",
        hint="it may have several poses of rest: compare their energies from other starts (--set), "
        "or link both sides (--links)",
    )


def _rest_on_props(
    name: str,
    figure: Figure,
    plan: Plan,
    output: Path | None,
    diagnostics: tuple[Diagnostic, ...],
    *,
    show_progress: bool,
) -> answer.CommandResult:
    """Find a pose of the free figure at rest on the props of a plan."""
    load_exudyn()
    load_compiled_integrator(show_progress=show_progress)
    try:
        from generator.simulation.statics.resting import MAX_TESTS, attach_pose, find_resting_pose
    except ImportError as failure:
        raise MoverError(f"a pose at rest on props needs numba: {failure}") from None
    from generator.simulation.statics.equilibrium import NoEquilibriumError

    diagnostics = add_sphere_warnings(figure, diagnostics)
    props = [prop.name for prop in plan.scene.props]
    monitor = item_progress_bar if show_progress else no_monitor
    try:
        with monitor(MAX_TESTS, "tests at most") as update:

            def watch(now: float, acceleration: float) -> None:
                update(f"{now:.3g} s, {acceleration:.2g} m/s^2 left")

            rest = find_resting_pose(figure, plan, watch)
    except NoEquilibriumError as failure:
        reason, text = str(failure), f"does not come to rest on {' and '.join(props)}"
        return NoRest(name, reason, text, diagnostics=diagnostics, failure=reason)
    attached = attach_pose(figure, rest)
    asymmetric: list[str] = []
    if _is_symmetric_start(figure, plan):
        asymmetric = _asymmetric_joints(figure, plan.displacements, attached.displacements)
    if asymmetric:
        side = warning(
            "the figure rests asymmetrically after a symmetric start: "
            "it may fall to the other side as well",
            hint="turn the start a little to choose the side (--set), and compare several starts",
        )
        diagnostics = (*diagnostics, side)
    files = [] if output is None else [output]
    for path in files:
        write_pose_file(path, figure, attached.displacements)
        diagnostics = (*diagnostics, *_loss_warnings(path, attached))
    joints = options.joint_displacements(figure, attached.displacements)
    return PropsRest(
        name, props, rest, attached, joints, asymmetric, files, diagnostics=diagnostics
    )


MAX_START_DISTANCE = 1e-3
"""Distance of a centre of mass from its mirror image up to which a start is symmetric [m]."""


def _is_symmetric_start(figure: Figure, plan: Plan) -> bool:
    """Return whether figure and props are about their own mirror images in a plane of constant x.

    Of the props only planes count as symmetric.
    """
    sideways = [plan.up[0]]
    for prop in plan.scene.props:
        sideways.append(float(prop.shape.pose[0, 1]) if prop.shape.is_endless else 1.0)
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
