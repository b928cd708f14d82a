"""A figure built into an Exudyn system, accessed by the names of the figure."""

import weakref
from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any, cast

from generator.contact.states import ContactModel
from generator.diagnostics import NamedMapping
from generator.figure import Figure
from generator.joint_chain import lock_all_axes, locked_axes_from_chain
from generator.kinematics.closures import independent_constraints
from generator.model import Model
from generator.simulation.exudyn_model.bodies import (
    Constraint,
    add_bodies,
    add_constraints,
    add_loads,
    add_marker,
)
from generator.simulation.exudyn_model.constraints import (
    CoordinateConstraint,
    add_coordinate_constraints,
)
from generator.simulation.exudyn_model.contacts import add_contacts
from generator.simulation.exudyn_model.coupled_springs import CoupledObject, add_coupled_spring
from generator.simulation.exudyn_model.exudyn_api import Index, MainSystem, exu
from generator.simulation.exudyn_model.righting import RightingConnector, add_righting
from generator.simulation.exudyn_model.slides import add_slide_springs
from generator.simulation.exudyn_model.springs import (
    Connector,
    SpringBuilder,
    add_joint_springs,
    needs_slide_object,
)
from generator.simulation.plan import NO_LIMIT, Plan, WallLimit
from generator.simulation.run_model import JointKind, RunModel, prepare_run


@dataclass(frozen=True, repr=False)
class ExudynModel(RunModel):
    """A figure built into an Exudyn system, before its first step.

    Attributes:
        mbs: the live Exudyn main system.
        container: the Exudyn container that owns the system; None if the caller provided it. It is
            reset when this object is deleted, so keep the model as long as its system.
        bodies: object index of each segment; fixed segments share the ground's.
        sites: marker index of each site, by "segment.site", along the site's axes.
        joints: constraint items of each joint; none for a free joint, or for one whose locks the
            rest of a loop implies.
        springs: connectors of each joint with springs, or with an angle of a coupled law.
        coupled_objects: objects of the coupled laws.
        coordinate_constraints: constraints of links and drives.
        load_items: marker and user function of each load.
        righting: connectors of righting by joint.
    """

    springs: Mapping[str, tuple[Connector, ...]]
    mbs: MainSystem
    container: Any
    bodies: Mapping[str, Index]
    sites: Mapping[str, Index]
    joints: Mapping[str, tuple[Constraint, ...]]
    coupled_objects: tuple[CoupledObject, ...]
    coordinate_constraints: tuple[CoordinateConstraint, ...]
    load_items: tuple[tuple[Index, Any], ...]
    righting: Mapping[str, RightingConnector]


def build_model(
    model: Model | Figure,
    plan: Plan | None = None,
    mbs: MainSystem | None = None,
    contacts: ContactModel | None = None,
    limit: WallLimit = NO_LIMIT,
) -> ExudynModel:
    """Build a model into an Exudyn system: bodies, sites, joints, springs, loads, contacts.

    Args:
        model: Figure with springs, as for `simulate`; springs of a joint that detaching the root
            removes are left out.
        plan: Initial pose, velocities, gravity, loads, kind of torques; None for `Plan()`.
        mbs: a system to build into, which the caller assembles; None creates one and assembles it.
        contacts: spheres of the segments, which may be inside the props of the plan, and capsules;
            None takes those of the figure, whose spheres must start outside.
        limit: wall-time limit of the run.

    Raises:
        WallLimitError: the limit was reached.
        InputError: the figure is wrong, or moving segments have no mass; it holds all errors.
        MoverError: the figure or the plan cannot be built; the message says why.
    """
    return build_exudyn(prepare_run(model, plan or Plan(), contacts), mbs, limit)


def build_exudyn(
    run: RunModel, mbs: MainSystem | None = None, limit: WallLimit = NO_LIMIT
) -> ExudynModel:
    """Build a model that is ready to run into an Exudyn system.

    Args:
        run: the model.
        mbs: as of `build_model`.
        limit: wall-time limit of the run.

    Raises WallLimitError.
    """
    placement, prescribed, plan = run.placement, run.prescribed, run.plan
    figure, moving = run.figure, run.figure.moving_joints
    container = None
    if mbs is None:
        container = exu.SystemContainer()
        mbs = container.AddSystem()
    bodies, ground = add_bodies(mbs, placement, run.rates, plan.gravity)
    sites = {
        f"{segment.name}.{site.name}": add_marker(
            mbs, placement, bodies, segment.name, site.pose_in_segment
        )
        for segment in figure.segments.values()
        for site in segment.sites.values()
    }
    tree = placement.tree
    locks = (
        independent_constraints(placement)
        if tree.closures
        else {name: locked_axes_from_chain(chain) for name, chain in tree.chains.items()}
    )
    locks.update(
        {
            name: (lock_all_axes(placement.pose_in_parent(figure.joints[name])),)
            for name in prescribed.locked
        }
    )
    joints = {
        name: add_constraints(mbs, placement, bodies, joint, locks[name])
        for name, joint in moving.items()
    }
    builder = SpringBuilder(mbs, placement, bodies, plan.python_torques, run.tone)
    connectors: dict[str, tuple[Connector, ...]] = {}
    for name, bound in run.springs.items():
        slides = [one for one in bound if one.kind is JointKind.PRISMATIC]
        if needs_slide_object(placement, moving[name], slides):
            own = [one for one in bound if one.kind is not JointKind.PRISMATIC]
            connected = add_joint_springs(builder, moving[name], own)
            connectors[name] = (*connected, *add_slide_springs(builder, moving[name], slides))
        else:
            connectors[name] = add_joint_springs(builder, moving[name], bound)
    righting = {} if run.tone is None else add_righting(builder)
    coupled = tuple(add_coupled_spring(builder, spring, connectors) for spring in run.coupled)
    constraints: tuple[CoordinateConstraint, ...] = ()
    if prescribed:
        constraints = add_coordinate_constraints(builder, prescribed, plan.start)
    load_items = add_loads(mbs, placement, bodies, run.loads)
    contacts = run.contacts
    if contacts is not None:
        contacts = add_contacts(
            mbs,
            placement,
            bodies,
            ground,
            contacts,
            python_torques=plan.python_torques,
            limit=limit,
        )
    if container is not None:
        cast("Any", mbs).Assemble()
    values: dict[str, Any] = {one.name: getattr(run, one.name) for one in fields(RunModel)}
    values["springs"] = NamedMapping(connectors, "the model has no springs at joint")
    values["contacts"] = contacts
    model = ExudynModel(
        **values,
        mbs=mbs,
        container=container,
        bodies=NamedMapping(bodies, "the model has no segment"),
        sites=NamedMapping(sites, "the model has no site"),
        joints=NamedMapping(joints, "the model has no joint"),
        coupled_objects=coupled,
        coordinate_constraints=constraints,
        load_items=load_items,
        righting=righting,
    )
    if container is not None:
        # Without a reset Exudyn never frees the symbolic functions of a deleted system.
        weakref.finalize(model, container.Reset)
    return model
