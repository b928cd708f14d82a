"""The figure as a live Exudyn system, spoken of by the figure's own names."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, cast

import numpy as np

from generator.diagnostics import MoverError
from generator.figure import Figure
from generator.kinematics.free_root import let_go
from generator.kinematics.loops import assemble as close_loops
from generator.kinematics.loops import consistent_rates
from generator.kinematics.placement import Displacements, Placement, drawn_displacements
from generator.kinematics.prescribed import Prescribed, PrescriptionError
from generator.kinematics.tree import Tree, hang
from generator.loads import TimedLoad
from generator.simulation.bodies import add_bodies, add_loads, add_marker, written_loads
from generator.simulation.constraints import Servo, add_servos
from generator.simulation.coupled_springs import CoupledObject, check_coupled, hang_coupled
from generator.simulation.exudyn_api import Index, MainSystem, exu
from generator.simulation.joints import Constraint, add_constraints, needed_locks, whole_lock
from generator.simulation.plan import Plan, springs_of
from generator.simulation.springs import Connector, Hanger, add_springs
from springs import JointSprings, SpringSet


class UnknownJointError(MoverError):
    """Values are given for a joint that the figure lacks, or not as many as it has freedoms."""


@dataclass(frozen=True)
class Assembly:
    """A figure built into an Exudyn system, before its first step.

    Attributes:
        mbs: the live Exudyn main system.
        container: the Exudyn container that owns it; None when the caller brought the system.
        placement: the figure's start, in the world.
        bodies: object index of each segment; parts of the ground share the ground's.
        sites: marker index of each site, by "segment.site"; axes are the site's.
        joints: constraint items of each joint (none for a joint that is free, or whose locks the
            rest of a loop implies).
        springs: connectors of each joint that has springs, or an angle of a coupled law.
        coupled: the objects of the laws over several joints.
        servos: the constraints of links and drives.
        prescribed: what is locked, linked and driven.
        loads: each load with its marker.
        spring_set: the springs that were built.
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
    servos: tuple[Servo, ...]
    prescribed: Prescribed
    loads: tuple[tuple[TimedLoad, Index, Any], ...]
    spring_set: SpringSet
    plan: Plan

    @classmethod
    def of(
        cls, figure: Figure, plan: Plan | None = None, mbs: MainSystem | None = None
    ) -> "Assembly":
        """Build a figure with the springs that the plan chooses; see `build`."""
        plan = plan or Plan()
        return build(figure, plan, springs_of(figure, plan), mbs)

    @property
    def figure(self) -> Figure:
        """The figure that was built; with a free root, the one that was let go."""
        return self.placement.tree.figure


@dataclass(frozen=True)
class Start:
    """Where a run starts.

    Attributes:
        placement: with closed loops, and all that is prescribed put in.
        rates: of the displacements, as they were asked for or are prescribed [rad/s or m/s].
        prescribed: what is locked, linked and driven.
    """

    placement: Placement
    rates: Displacements
    prescribed: Prescribed


def start_of(figure: Figure, plan: Plan) -> Start:
    """Where a run starts.

    Raises:
        UnknownJointError: the plan names a joint that the figure lacks.
        PrescriptionError: joints cannot be locked, linked or driven as the plan asks.
        OpenLoopError: the pose opens a loop that cannot be closed.
        ChainError: a joint's chain is none that one joint can hold.
    """
    tree = hang(figure)
    displacements = {**drawn_displacements(tree), **_by_joint(figure, plan.displacements)}
    prescribed = _prescribed(tree, plan, displacements)
    displacements = prescribed.displacements(displacements, plan.start)
    held = set(plan.displacements) | prescribed.held
    placement = close_loops(tree, displacements, held=held)
    if plan.free_root:
        freed, moved = let_go(figure, placement.displacements)
        placement = close_loops(hang(freed), moved, held=set(moved))
        _insist_on_kept(prescribed, freed)
        prescribed = _prescribed(placement.tree, plan, moved)
    prescribed.insist_on_loops(placement)
    rates = {
        name: np.zeros(j.degrees_of_freedom) for name, j in placement.tree.figure.joints.items()
    }
    rates.update(_by_joint(placement.tree.figure, plan.velocities))
    put_in = prescribed.rates(rates, plan.start)
    for name in plan.velocities:
        if not np.allclose(rates[name], put_in[name], rtol=1e-9, atol=1e-9):
            raise PrescriptionError(
                f"joint {name} is locked, linked or driven, and cannot start with another velocity"
            )
    return Start(placement, put_in, prescribed)


def _insist_on_kept(prescribed: Prescribed, freed: Figure) -> None:
    """Raise PrescriptionError for a joint that letting the root go has taken away."""
    for name in sorted(prescribed.held - freed.joints.keys()):
        raise PrescriptionError(
            f"joint {name} holds the figure to the ground, from which a free root lets it go: "
            "it cannot be locked, linked or driven"
        )


def _prescribed(tree: Tree, plan: Plan, displacements: Displacements) -> Prescribed:
    """What the plan prescribes; `displacements` tell where locked joints stay."""
    locked = {name: displacements.get(name, np.zeros(0)) for name in plan.locked}
    return Prescribed(tree, plan.links, locked, plan.drives)


def _by_joint(figure: Figure, values: Mapping[str, Any]) -> dict[str, Any]:
    """The values as arrays, checked against the joints."""
    checked: dict[str, Any] = {}
    for name, numbers in values.items():
        joint = figure.joints.get(name)
        if joint is None:
            raise UnknownJointError(f"the figure has no joint {name}")
        array = np.asarray(numbers, dtype=float)
        if array.shape != (joint.degrees_of_freedom,):
            raise UnknownJointError(
                f"joint {name} has {joint.degrees_of_freedom} displacements, not {array.size}"
            )
        if not np.all(np.isfinite(array)):
            raise UnknownJointError(f"a value given for joint {name} is not finite")
        checked[name] = array
    return checked


def build(
    figure: Figure,
    plan: Plan,
    springs: SpringSet,
    mbs: MainSystem | None = None,
) -> Assembly:
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
    return _build(start_of(figure, plan), plan, springs, mbs)


def _build(
    start: Start,
    plan: Plan,
    springs: SpringSet,
    mbs: MainSystem | None,
) -> Assembly:
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
    locks = needed_locks(placement)
    locks.update(
        {name: (whole_lock(placement.between(figure.joints[name])),) for name in prescribed.locked}
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
    hanger = Hanger(mbs, placement, bodies, plan.python_torques)
    held = [spring for spring in springs.coupled if all(a.joint in moving for a in spring.axes)]
    read = dict.fromkeys(axis.joint for spring in held for axis in spring.axes)
    connectors = {
        name: add_springs(
            hanger,
            moving[name],
            springs.joints.get(name, JointSprings(name)),
            plan.joining or springs.joining,
            read=name in read,
        )
        for name in dict.fromkeys([*springs.joints, *read])
        if name in moving
    }
    coupled = tuple(hang_coupled(hanger, spring, connectors) for spring in held)
    servos = add_servos(hanger, prescribed, plan.start)
    loads = [*written_loads(figure, plan.start, plan.stop), *plan.loads]
    moved = [load for load in loads if load.site.segment not in figure.ground]
    added = add_loads(mbs, placement, bodies, moved)
    if container is not None:
        cast("Any", mbs).Assemble()
    return Assembly(
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
