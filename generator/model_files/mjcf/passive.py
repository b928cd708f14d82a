"""The springs of a figure in MuJoCo without approximation, as a callback in Python.

For a model written without springs, or at the joints whose springs a model lacks:

    model = mujoco.MjModel.from_xml_path("out.xml")
    mujoco.set_mjcb_passive(PassiveSprings(model, figure, springs))
    mujoco.set_mjcb_passive(PassiveSprings(model, figure, springs, ["left_shoulder"]))
"""

from collections.abc import Collection
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from generator.diagnostics import ModelError, UnknownNameError, spelling_hint
from generator.figure import Figure
from generator.joint_chain import Chain
from generator.kinematics.tree import TreeJoint
from generator.losses import Losses
from generator.model_files.export_model import build_export_model, split_joint_laws
from generator.model_files.mjcf.track import body_name
from generator.model_files.mjcf.write import chain_indices, site_name
from generator.rotations import Array, matrix_from_rotation_vector, rotation_vector_from_matrix
from springs import (
    AxisSpring,
    JointSprings,
    RotationLaw,
    SphericalLaw,
    SpringSet,
    rotation_law,
    total_torque,
)


@dataclass(frozen=True)
class _Single:
    """A spring of one displacement, with the places of its position and its speed."""

    spring: AxisSpring
    position: int
    speed: int


@dataclass(frozen=True)
class _Several:
    """The law of several rotations of a joint, its sites and the places of its speeds."""

    law: RotationLaw
    parent: int
    child: int
    speeds: tuple[int, ...]
    sign: float


class PassiveSprings:
    """Adds the passive torques of a figure's springs to a model that lacks them.

    Laws over several joints and springs of joints that close loops are left out.
    """

    def __init__(
        self,
        model: Any,
        figure: Figure,
        springs: SpringSet,
        joints: Collection[str] | None = None,
    ) -> None:
        """Find the joints of the figure in a model.

        Args:
            model: Model (`mujoco.MjModel`), with the joints to the ground of the figure or free.
            figure: Figure of the model.
            springs: Springs of the figure.
            joints: Names of the joints whose springs the model lacks; None for all joints.

        Raises:
            ModelError: The model has other bodies.
            UnknownNameError: No joint of a name has springs.
        """
        own = springs.joints.keys()
        for name in joints or ():
            if name not in own:
                raise UnknownNameError(
                    f"joint `{name}` has no springs of its own; {spelling_hint(name, own)}"
                )
        springs = springs.of_joints(own if joints is None else joints)
        export = build_export_model(figure, springs, Losses("MuJoCo model"))
        branches = {branch.joint.name: branch for branch in export.tree.joints}
        self._single: list[_Single] = []
        self._several: list[_Several] = []
        for name in export.tree_springs:
            branch, own = branches[name], export.joint_springs(name)
            chain = export.tree.chains[name]
            places = _joint_places(
                model, body_name(export.segments, branch.outboard), branch, chain
            )
            single = own if len(chain.rotations) == 1 else replace(own, axes=(), reach=None)
            for k, spring in split_joint_laws(chain, single, springs.law).uncoupled.items():
                joint = places[k]
                position, speed = int(model.jnt_qposadr[joint]), int(model.jnt_dofadr[joint])
                self._single.append(_Single(spring, position, speed))
            if len(chain.rotations) > 1 and (own.axes or own.reach):
                law = rotation_law(own, springs.law, chain.rotation_axes)
                speeds: list[int] = []
                for k, joint in places.items():
                    first = int(model.jnt_dofadr[joint])
                    if k is None:
                        speeds += range(first, first + 3)
                    elif k in chain.rotations:
                        speeds.append(first)
                parent, child = (
                    int(model.site(site_name(export, e)).id) for e in branch.joint.ends
                )
                sign = 1.0 if branch.parent_is_inboard else -1.0
                self._several.append(_Several(law, parent, child, tuple(speeds), sign))

    def __call__(self, _model: Any, data: Any) -> None:
        """Add the torques in the state of `data` (`mujoco.MjData`)."""
        for each in self._single:
            angle, rate = float(data.qpos[each.position]), float(data.qvel[each.speed])
            torque = total_torque(each.spring.elastic, angle) + each.spring.resistance(angle, rate)
            data.qfrc_passive[each.speed] += torque
        for each in self._several:
            parent = np.reshape(data.site_xmat[each.parent], (3, 3))
            child = np.reshape(data.site_xmat[each.child], (3, 3))
            r = rotation_vector_from_matrix(parent.T @ child)
            half_way = parent @ matrix_from_rotation_vector(0.5 * r)
            speeds = list(each.speeds)
            axes: Array = each.sign * data.cdof[speeds, :3]
            rate = half_way.T @ (data.qvel[speeds] @ axes)
            torque = each.law.torque(r) + each.law.damping(r, rate)
            data.qfrc_passive[speeds] += axes @ (half_way @ torque)


def _joint_places(model: Any, body: str, branch: TreeJoint, chain: Chain) -> dict[int | None, int]:
    """Return the model's joint numbers by place in the chain; None stands for a ball."""
    bare = split_joint_laws(chain, JointSprings(branch.joint.name), SphericalLaw.CONSERVATIVE)
    from_chain = chain_indices(branch, bare)
    number = int(model.body(body).id)
    first, count = int(model.body_jntadr[number]), int(model.body_jntnum[number])
    if count != len(from_chain):
        raise ModelError(
            f"the model's body `{body}` does not have joint `{branch.joint.name}` of the figure"
        )
    return {k: first + place for place, k in enumerate(from_chain)}
