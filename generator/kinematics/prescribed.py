"""Prescribed displacements: of joints that are locked, driven by a table, or linked.

The remaining displacements of a figure are free. A follower of a driven or locked joint is driven
or locked with it.
"""

from collections.abc import Container, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import assert_never

import numpy as np

from generator.diagnostics import ModelError, spelling_hint
from generator.drive import Drive
from generator.figure import AxisKind, Joint
from generator.kinematics.links import Coordinate, Link, Links, figure_links
from generator.kinematics.placement import (
    Displacements,
    Placement,
    relative_jacobian,
    segment_jacobians,
)
from generator.kinematics.tree import Tree
from generator.rotations import Array

_RANK_TOLERANCE = 1e-7
"""Smallest singular value of independent rows [m or 1]."""


@dataclass(frozen=True)
class PrescribedMotion:
    """The prescribed displacements of a tree.

    Attributes:
        tree: tree whose joints they are.
        links: links between rotations of joints, beside those of the figure.
        locked: constant displacements, by joint [rad or m].
        drives: drives by joint; of rotations only.

    Raises:
        ModelError: a joint is unknown, does not move, closes a loop, or is
            prescribed twice.
    """

    tree: Tree
    links: Links
    locked: Displacements
    drives: Mapping[str, Drive]

    def __post_init__(self) -> None:
        """Check that joints exist, move, and are prescribed once."""
        for name in self.locked:
            self._require_movable_joint(name, "locked")
        for name, drive in self.drives.items():
            self._check_drive_fits(name, drive)
            if name in self.locked:
                raise ModelError(f"joint {name} is both locked and driven")
        driven = self._driven_coordinates
        for link in self.resolved_links:
            for freedom in (link.follower, link.control):
                joint = self._require_movable_joint(freedom.joint, "linked")
                if freedom.index >= len(joint.chain):
                    raise ModelError(
                        f"joint {joint.name} has {len(joint.chain)} degrees of freedom: "
                        f"{freedom} cannot be linked"
                    )
                if link.curve is None:
                    self._check_is_rotation(joint, freedom.index, "linked")
            if link.follower.joint in self.locked:
                raise ModelError(f"{link.follower} follows {link.control} and is locked")
            if link.follower in driven:
                raise ModelError(f"{link.follower} follows {link.control} and is driven")

    def __bool__(self) -> bool:
        """Return whether anything is prescribed."""
        return bool(self.all_links.links or self.locked or self.drives)

    @cached_property
    def all_links(self) -> Links:
        """The links and those of the figure's own followers."""
        figure = self.tree.figure
        return self.links.beside(figure_links(figure)) if figure.has_followers else self.links

    @cached_property
    def resolved_links(self) -> tuple[Link, ...]:
        """Links of single degrees of freedom; none within what is locked as the figure has it."""
        return tuple(
            link
            for link in (self.all_links.resolved if self.all_links.links else ())
            if link.curve is None or not {link.follower.joint, link.control.joint} <= {*self.locked}
        )

    @property
    def _driven_coordinates(self) -> frozenset[Coordinate]:
        joints = self.tree.figure.joints
        return frozenset(
            Coordinate(name, k)
            for name, drive in self.drives.items()
            for k in driven_indices(joints[name], drive)
        )

    def _require_movable_joint(self, name: str, verb: str) -> Joint:
        """Return the joint of a name. Raises ModelError when it cannot be prescribed."""
        joint = self.tree.figure.joints.get(name)
        if joint is None:
            hint = spelling_hint(name, self.tree.figure.joints)
            raise ModelError(f"the figure has no joint {name}, so it cannot be {verb}; {hint}")
        if not joint.chain:
            raise ModelError(f"joint {name} does not move, so it cannot be {verb}")
        if joint in self.tree.closures:
            others = ", ".join(branch.joint.name for branch in self.tree.joints)
            raise ModelError(
                f"joint {name} closes a loop and cannot be {verb}: its displacements follow from "
                f"those of {others}"
            )
        return joint

    def _check_is_rotation(self, joint: Joint, index: int, verb: str) -> None:
        kind = joint.chain[index].kind
        match kind:
            case AxisKind.ROTATION:
                return
            case AxisKind.TRANSLATION:
                raise ModelError(
                    f"{Coordinate(joint.name, index)} is a translation: "
                    f"only rotations can be {verb} in a simulation"
                )
            case _:
                assert_never(kind)

    def _check_drive_fits(self, name: str, drive: Drive) -> None:
        joint = self._require_movable_joint(name, "driven")
        freedoms = driven_indices(joint, drive)
        count = np.shape(drive.values)[1]
        if len(freedoms) != count or max(freedoms) >= len(joint.chain):
            raise ModelError(
                f"joint {name} has {len(joint.chain)} degrees of freedom, but its drive of "
                f"{count} columns does not fit them"
            )
        for k in freedoms:
            self._check_is_rotation(joint, k, "driven")

    @cached_property
    def coordinates(self) -> tuple[Coordinate, ...]:
        """Displacements of the tree, in the order of its kinematics."""
        return tuple(
            Coordinate(name, k)
            for name, columns in self.tree.kinematics.columns.items()
            for k in range(columns.stop - columns.start)
        )

    @cached_property
    def free_coordinates(self) -> tuple[Coordinate, ...]:
        """Displacements that are not prescribed."""
        determined = self._driven_coordinates | {link.follower for link in self.resolved_links}
        return tuple(
            f for f in self.coordinates if f not in determined and f.joint not in self.locked
        )

    @cached_property
    def fixed_joints(self) -> frozenset[str]:
        """Names of the joints that are prescribed, at least in part, or control others."""
        linked = {f.joint for one in self.resolved_links for f in (one.follower, one.control)}
        return frozenset({*self.locked, *self.drives, *linked})

    def free_jacobian(self, displacements: Displacements) -> Array:
        """Jacobian of the tree's displacements by the free ones, shape (m, number of free ones).

        Args:
            displacements: Displacements by joint, shape (n,) [rad or m].
        """
        places = {freedom: k for k, freedom in enumerate(self.coordinates)}
        matrix = np.zeros((len(places), len(self.free_coordinates)))
        for column, freedom in enumerate(self.free_coordinates):
            matrix[places[freedom], column] = 1.0
        for link in self.resolved_links:
            control = displacements[link.control.joint][link.control.index]
            matrix[places[link.follower]] = link.at(control, 1) * matrix[places[link.control]]
        return matrix

    def impose_displacements(
        self, displacements: Displacements, times: float | Array
    ) -> dict[str, Array]:
        """Return the displacements with the prescribed values inserted.

        Args:
            displacements: displacements by joint, shape (..., n) [rad or m]; only the free ones are
                used.
            times: shape (...) [s].
        """
        result = {name: np.array(values, dtype=float) for name, values in displacements.items()}
        for name, values in self.locked.items():
            result[name][...] = values
        for name, drive in self.drives.items():
            result[name][..., list(self._driven_indices(name))] = drive.displacements(times)
        return self.all_links.follow(result) if self.all_links.links else result

    def impose_rates(
        self, rates: Displacements, times: float | Array, displacements: Displacements
    ) -> dict[str, Array]:
        """Return the rates with the prescribed values inserted, as `impose_displacements` does.

        Args:
            rates: Rates by joint, shape (..., n) [rad/s or m/s].
            times: Times, shape (...) [s].
            displacements: Displacements that have been imposed, in the shape of the rates.
        """
        result = {name: np.array(values, dtype=float) for name, values in rates.items()}
        for name in self.locked:
            result[name][...] = 0.0
        for name, drive in self.drives.items():
            result[name][..., list(self._driven_indices(name))] = drive.rates(times)
        for link in self.resolved_links:
            at = (..., link.control.index)
            slope = link.at(displacements[link.control.joint][at], 1)
            rate = slope * result[link.control.joint][at]
            result[link.follower.joint][..., link.follower.index] = rate
        return result

    def _driven_indices(self, name: str) -> tuple[int, ...]:
        return driven_indices(self.tree.figure.joints[name], self.drives[name])

    def check_free_root(self, joints: Container[str]) -> None:
        """Raise ModelError for a prescribed joint that is not left with a free root."""
        for name in sorted(self.fixed_joints):
            if name not in joints:
                raise ModelError(
                    f"joint {name} connects the figure to the ground and is removed by a free "
                    "root: it cannot be locked, linked or driven"
                )

    def check_loops(self, placement: Placement) -> None:
        """Raise ModelError where a loop and a prescription constrain the same motion."""
        if not self.tree.closures or not self:
            return
        loops = loop_closure_jacobian(placement)
        if _rank(loops @ self.free_jacobian(placement.displacements)) < _rank(loops):
            closing = ", ".join(joint.name for joint in self.tree.closures)
            raise ModelError(
                f"the loop closed by {closing} is over-constrained: it leaves fewer motions than "
                f"are prescribed for {', '.join(sorted(self.fixed_joints))}"
            )


def driven_indices(joint: Joint, drive: Drive) -> tuple[int, ...]:
    """Return the indices of a joint's degrees of freedom that a drive prescribes, from 0."""
    return tuple(range(len(joint.chain))) if drive.coordinates is None else drive.coordinates


def loop_closure_jacobian(placement: Placement) -> Array:
    """Return rows (n, m) whose product with the tree's rates is zero while loops stay closed."""
    maps = segment_jacobians(placement)
    rows = [np.zeros((0, placement.tree.kinematics.size))]
    for joint in placement.tree.closures:
        twists = placement.tree.chains[joint.name].twists(placement.displacements[joint.name])
        twists[:, 3:] += np.cross(twists[:, :3], placement.pose_in_parent(joint)[:3, 3])
        blocked = np.eye(6) - twists.T @ np.linalg.pinv(twists.T)
        rows.append(blocked @ relative_jacobian(placement, maps, joint))
    return np.vstack(rows)


def _rank(rows: Array) -> int:
    return int(np.sum(np.linalg.svd(rows, compute_uv=False) > _RANK_TOLERANCE)) if rows.size else 0
