"""The figure as a live Exudyn system, spoken of by the figure's own names."""

import weakref
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, cast

import numpy as np

from generator.diagnostics import ModelError
from generator.figure import Figure
from generator.kinematics.free_root import detach_root
from generator.kinematics.loops import close_loops as close_loops
from generator.kinematics.loops import consistent_rates
from generator.kinematics.placement import Displacements, Placement, initial_displacements
from generator.kinematics.prescribed import PrescribedMotion
from generator.kinematics.tree import Tree, build_tree
from generator.loads import TimedLoad
from generator.simulation.bodies import add_bodies, add_loads, add_marker, constant_site_loads
from generator.simulation.constraints import CoordinateConstraint, add_coordinate_constraints
from generator.simulation.coupled_springs import CoupledObject, add_coupled_spring, check_coupled
from generator.simulation.exudyn_api import Index, MainSystem, exu
from generator.simulation.joints import (
    Constraint,
    add_constraints,
    independent_constraints,
    lock_all_axes,
)
from generator.simulation.plan import Plan, resolve_springs
from generator.simulation.springs import Connector, SpringBuilder, add_joint_springs
from springs import JointSprings, SpringSet


@dataclass(frozen=True)
class ExudynModel:
    """A figure built into an Exudyn system, before its first step.

    Attributes:
        mbs: the live Exudyn main system.
        container: the Exudyn container that owns it; None when the caller brought the system. It is
            emptied together with this object, so keep the model as long as its system.
        placement: the figure's start, in the world.
        bodies: object index of each segment; parts of the ground share the ground's.
        sites: marker index of each site, by "segment.site"; axes are the site's.
        joints: constraint items of each joint (none for a joint that is free, or whose locks the
            rest of a loop implies).
        springs: connectors of each joint that has springs, or an angle of a coupled law.
        coupled: the objects of the laws over several joints.
        coordinate_constraints: the constraints of links and drives.
        prescribed: what is locked, linked and driven.
        loads: each load with its marker.
        spring_set: the springs that were built; its joining is the plan's, if it has one.
        plan: the plan that it was built for.
    """

    mbs: MainSystem
    container: Any
    placement: Placement
    bodies: Mapping[str, Index]
    sites: Mapping[str, Index]
    joints: Mapping[str, tuple[Constraint, ...]]
    springs: Mapping[str, tuple[Connector, ...]]
    coupled: tuple[CoupledObject, ...]
    coordinate_constraints: tuple[CoordinateConstraint, ...]
    prescribed: PrescribedMotion
    loads: tuple[tuple[TimedLoad, Index, Any], ...]
    spring_set: SpringSet
    plan: Plan

    @classmethod
    def of(
        cls, figure: Figure, plan: Plan | None = None, mbs: MainSystem | None = None
    ) -> "ExudynModel":
        """Build a figure with the springs that the plan chooses; see `build`."""
        plan = plan or Plan()
        return build_model(figure, plan, resolve_springs(figure, plan), mbs)

    @property
    def figure(self) -> Figure:
        """The figure that was built; with a free root, the one that was let go."""
        return self.placement.tree.figure


@dataclass(frozen=True)
class InitialState:
    """Where a run starts.

    Attributes:
        placement: with closed loops, and all that is prescribed put in.
        rates: of the displacements, as they were asked for or are prescribed [rad/s or m/s].
        prescribed: what is locked, linked and driven.
    """

    placement: Placement
    rates: Displacements
    prescribed: PrescribedMotion


def initial_state(figure: Figure, plan: Plan) -> InitialState:
    """Where a run starts.

    Raises:
        ModelError: the plan names a joint that the figure lacks.
        ModelError: joints cannot be locked, linked or driven as the plan asks.
        OpenLoopError: the pose opens a loop that cannot be closed.
        ModelError: a joint's chain is none that one joint can hold.
    """
    tree = build_tree(figure)
    displacements = {
        **initial_displacements(tree),
        **_checked_joint_values(figure, plan.displacements),
    }
    prescribed = _build_prescribed_motion(tree, plan, displacements)
    displacements = prescribed.impose_displacements(displacements, plan.start)
    held = set(plan.displacements) | prescribed.held
    placement = close_loops(tree, displacements, held=held)
    if plan.free_root:
        freed, moved = detach_root(figure, placement.displacements)
        placement = close_loops(build_tree(freed), moved, held=set(moved))
        _check_prescribed_joints_kept(prescribed, freed)
        prescribed = _build_prescribed_motion(placement.tree, plan, moved)
    prescribed.check_loops(placement)
    rates = {
        name: np.zeros(j.degrees_of_freedom) for name, j in placement.tree.figure.joints.items()
    }
    rates.update(_checked_joint_values(placement.tree.figure, plan.velocities))
    put_in = prescribed.impose_rates(rates, plan.start)
    for name in plan.velocities:
        if not np.allclose(rates[name], put_in[name], rtol=1e-9, atol=1e-9):
            raise ModelError(
                f"joint {name} is locked, linked or driven, and cannot start with another velocity"
            )
    return InitialState(placement, put_in, prescribed)


def _check_prescribed_joints_kept(prescribed: PrescribedMotion, freed: Figure) -> None:
    """Raise ModelError for a joint that letting the root go has taken away."""
    for name in sorted(prescribed.held - freed.joints.keys()):
        raise ModelError(
            f"joint {name} holds the figure to the ground, from which a free root lets it go: "
            "it cannot be locked, linked or driven"
        )


def _build_prescribed_motion(
    tree: Tree, plan: Plan, displacements: Displacements
) -> PrescribedMotion:
    """What the plan prescribes; `displacements` tell where locked joints stay."""
    locked = {name: displacements.get(name, np.zeros(0)) for name in plan.locked}
    return PrescribedMotion(tree, plan.links, locked, plan.drives)


def _checked_joint_values(figure: Figure, values: Mapping[str, Any]) -> dict[str, Any]:
    """The values as arrays, checked against the joints."""
    checked: dict[str, Any] = {}
    for name, numbers in values.items():
        joint = figure.joints.get(name)
        if joint is None:
            raise ModelError(f"the figure has no joint {name}")
        array = np.asarray(numbers, dtype=float)
        if array.shape != (joint.degrees_of_freedom,):
            raise ModelError(
                f"joint {name} has {joint.degrees_of_freedom} displacements, not {array.size}"
            )
        if not np.all(np.isfinite(array)):
            raise ModelError(f"a value given for joint {name} is not finite")
        checked[name] = array
    return checked


def build_model(
    figure: Figure,
    plan: Plan,
    springs: SpringSet,
    mbs: MainSystem | None = None,
) -> ExudynModel:
    """Build a figure into an Exudyn system: bodies, sites, joints, springs, loads.

    Args:
        figure: what to build.
        plan: start pose, velocities, gravity, loads, kind of torques.
        springs: the springs to hang on the joints; those of joints that are not there are left out,
            and coupled laws over a joint that letting the root go has taken away.
        mbs: a system to build into, which the caller then assembles himself together with what else
            he puts there; None makes a new one and assembles it.

    Raises:
        MoverError: the figure or the plan cannot be built; the message says why.
    """
    check_coupled(figure, springs.coupled)
    if plan.joining is not None:
        springs = replace(springs, joining=plan.joining)
    return _build_from_initial_state(initial_state(figure, plan), plan, springs, mbs)


def _build_from_initial_state(
    start: InitialState,
    plan: Plan,
    springs: SpringSet,
    mbs: MainSystem | None,
) -> ExudynModel:
    placement, prescribed = start.placement, start.prescribed
    figure = placement.tree.figure
    container = None
    if mbs is None:
        container = exu.SystemContainer()
        mbs = container.AddSystem()
    held = set(plan.velocities) | prescribed.held
    rates = consistent_rates(placement, start.rates, held=held)
    bodies, _ = add_bodies(mbs, placement, rates, plan.gravity)
    sites = {
        f"{segment.name}.{site.name}": add_marker(
            mbs, placement, bodies, segment.name, site.pose_in_segment
        )
        for segment in figure.segments.values()
        for site in segment.sites.values()
    }
    locks = independent_constraints(placement)
    locks.update(
        {
            name: (lock_all_axes(placement.pose_in_parent(figure.joints[name])),)
            for name in prescribed.locked
        }
    )
    moving = {
        name: joint
        for name, joint in figure.joints.items()
        if not {joint.parent.segment, joint.child.segment} <= figure.ground
    }
    joints = {
        name: add_constraints(mbs, placement, bodies, joint, locks[name])
        for name, joint in moving.items()
    }
    hanger = SpringBuilder(mbs, placement, bodies, plan.python_torques)
    held = [spring for spring in springs.coupled if all(a.joint in moving for a in spring.axes)]
    read = dict.fromkeys(axis.joint for spring in held for axis in spring.axes)
    connectors = {
        name: add_joint_springs(
            hanger,
            moving[name],
            springs.joints.get(name, JointSprings(name)),
            springs.joining,
            read_rotation=name in read,
        )
        for name in dict.fromkeys([*springs.joints, *read])
        if name in moving
    }
    coupled = tuple(add_coupled_spring(hanger, spring, connectors) for spring in held)
    servos = add_coordinate_constraints(hanger, prescribed, plan.start)
    loads = [*constant_site_loads(figure, plan.start, plan.stop), *plan.loads]
    moved = [load for load in loads if load.site.segment not in figure.ground]
    added = add_loads(mbs, placement, bodies, moved)
    if container is not None:
        cast("Any", mbs).Assemble()
    model = ExudynModel(
        mbs,
        container,
        placement,
        bodies,
        sites,
        joints,
        connectors,
        coupled,
        servos,
        prescribed,
        added,
        springs,
        plan,
    )
    if container is not None:
        # Exudyn keeps the symbolic functions of a system that is dropped without a reset.
        weakref.finalize(model, container.Reset)
    return model
