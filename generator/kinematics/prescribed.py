"""Displacements that are prescribed: of joints that are locked, driven by a table, or linked.

Of the displacements of a figure those that follow from time or from others are told apart from
those that are free. What follows a driven or a locked joint is driven or locked with it.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from generator.diagnostics import MoverError, nearest
from generator.drive import Drive
from generator.figure import Joint
from generator.kinematics.links import Freedom, Links
from generator.kinematics.placement import (
    Displacements,
    Placement,
    motion_maps,
    relative_motion_map,
)
from generator.kinematics.tree import Tree
from generator.rotations import Array

_INDEPENDENT = 1e-7
"""Smallest singular value of rows that do not follow from each other [m or 1]."""


class PrescriptionError(MoverError, ValueError):
    """Joints that cannot be locked, linked or driven as asked; the message says why."""


@dataclass(frozen=True)
class Prescribed:
    """Which displacements of a tree are prescribed, and how.

    Attributes:
        tree: whose joints they are.
        links: between turns of joints.
        locked: displacements at which joints stay, by name [rad or m].
        drives: by joint; of turns only.

    Raises:
        PrescriptionError: a joint is unknown, does not move, closes a loop, or is told two ways.
    """

    tree: Tree
    links: Links
    locked: Displacements
    drives: Mapping[str, Drive]

    def __post_init__(self) -> None:
        """Refuse what is unknown or contradicts itself."""
        for name in self.locked:
            self._insist_moves(name, "locked")
        for name, drive in self.drives.items():
            self._insist_fits(name, drive)
            if name in self.locked:
                raise PrescriptionError(f"joint {name} is both locked and driven")
        driven = self._driven
        for link in self.links.resolved:
            for freedom in (link.follower, link.control):
                joint = self._insist_moves(freedom.joint, "linked")
                if freedom.index >= len(joint.chain):
                    raise PrescriptionError(
                        f"joint {joint.name} has {len(joint.chain)} degrees of freedom: "
                        f"{freedom} cannot be linked"
                    )
                self._insist_turns(joint, freedom.index, "linked")
            if link.follower.joint in self.locked:
                raise PrescriptionError(f"{link.follower} follows {link.control} and is locked")
            if link.follower in driven:
                raise PrescriptionError(f"{link.follower} follows {link.control} and is driven")

    def __bool__(self) -> bool:
        """Whether anything is prescribed."""
        return bool(self.links.links or self.locked or self.drives)

    @property
    def _driven(self) -> frozenset[Freedom]:
        joints = self.tree.figure.joints
        return frozenset(
            Freedom(name, k)
            for name, drive in self.drives.items()
            for k in freedoms_driven(joints[name], drive)
        )

    def _insist_moves(self, name: str, verb: str) -> Joint:
        """The joint of a name. Raises PrescriptionError when it cannot be prescribed."""
        joint = self.tree.figure.joints.get(name)
        if joint is None:
            hint = nearest(name, self.tree.figure.joints)
            raise PrescriptionError(f"there is no joint {name} to be {verb}; {hint}")
        if not joint.chain:
            raise PrescriptionError(f"joint {name} does not move, so it cannot be {verb}")
        if joint in self.tree.closures:
            others = ", ".join(branch.joint.name for branch in self.tree.branches)
            raise PrescriptionError(
                f"joint {name} closes a loop and cannot be {verb}: its displacements follow from "
                f"those of {others}"
            )
        return joint

    def _insist_turns(self, joint: Joint, index: int, verb: str) -> None:
        if joint.chain[index].kind != "R":
            raise PrescriptionError(
                f"{Freedom(joint.name, index)} slides: only turns can be {verb} in a simulation"
            )

    def _insist_fits(self, name: str, drive: Drive) -> None:
        joint = self._insist_moves(name, "driven")
        freedoms = freedoms_driven(joint, drive)
        count = np.shape(drive.values)[1]
        if len(freedoms) != count or max(freedoms) >= len(joint.chain):
            raise PrescriptionError(
                f"joint {name} has {len(joint.chain)} degrees of freedom, which its drive of "
                f"{count} columns does not fit"
            )
        for k in freedoms:
            self._insist_turns(joint, k, "driven")

    @cached_property
    def freedoms(self) -> tuple[Freedom, ...]:
        """The displacements of the tree, in the order of its kinematics."""
        return tuple(
            Freedom(name, k)
            for name, columns in self.tree.kinematics.columns.items()
            for k in range(columns.stop - columns.start)
        )

    @cached_property
    def free(self) -> tuple[Freedom, ...]:
        """Those of them that nothing prescribes."""
        held = self._driven | self.links.followers
        return tuple(f for f in self.freedoms if f not in held and f.joint not in self.locked)

    @cached_property
    def held(self) -> frozenset[str]:
        """Names of the joints that are prescribed, in part at least, or control others."""
        linked = {f.joint for one in self.links.resolved for f in (one.follower, one.control)}
        return frozenset({*self.locked, *self.drives, *linked})

    @cached_property
    def columns(self) -> Array:
        """Slope of the tree's displacements by the free ones, shape (m, number of free ones)."""
        places = {freedom: k for k, freedom in enumerate(self.freedoms)}
        matrix = np.zeros((len(places), len(self.free)))
        for column, freedom in enumerate(self.free):
            matrix[places[freedom], column] = 1.0
        for link in self.links.resolved:
            matrix[places[link.follower]] = link.factor * matrix[places[link.control]]
        return matrix

    def displacements(self, given: Displacements, times: float | Array) -> dict[str, Array]:
        """The displacements with all that is prescribed put in.

        Args:
            given: by joint, shape (..., n) [rad or m]; what they say of others than the free
                displacements is not looked at.
            times: shape (...) [s].
        """
        moved = {name: np.array(values, dtype=float) for name, values in given.items()}
        for name, values in self.locked.items():
            moved[name][...] = values
        for name, drive in self.drives.items():
            moved[name][..., list(self._places(name))] = drive.at(times)
        return self.links.follow(moved)

    def rates(self, given: Displacements, times: float | Array) -> dict[str, Array]:
        """The rates of the displacements with all that is prescribed put in, as `displacements`."""
        moved = {name: np.array(values, dtype=float) for name, values in given.items()}
        for name in self.locked:
            moved[name][...] = 0.0
        for name, drive in self.drives.items():
            moved[name][..., list(self._places(name))] = drive.rates(times)
        for link in self.links.resolved:
            control = moved[link.control.joint][..., link.control.index]
            moved[link.follower.joint][..., link.follower.index] = link.factor * control
        return moved

    def _places(self, name: str) -> tuple[int, ...]:
        return freedoms_driven(self.tree.figure.joints[name], self.drives[name])

    def insist_on_loops(self, placement: Placement) -> None:
        """Raise PrescriptionError where loops and prescriptions hold the same motion twice."""
        if not self.tree.closures or not self:
            return
        loops = loop_rows(placement)
        if _rank(loops @ self.columns) < _rank(loops):
            closing = ", ".join(joint.name for joint in self.tree.closures)
            raise PrescriptionError(
                f"the loop that {closing} closes is over-constrained: it does not leave as many "
                f"motions as are prescribed of {', '.join(sorted(self.held))}"
            )


def freedoms_driven(joint: Joint, drive: Drive) -> tuple[int, ...]:
    """Which of a joint's degrees of freedom a drive drives, from 0."""
    return tuple(range(len(joint.chain))) if drive.freedoms is None else drive.freedoms


def loop_rows(placement: Placement) -> Array:
    """Rows (n, m) that the rates of the tree's displacements make zero where loops stay closed."""
    maps = motion_maps(placement)
    rows = [np.zeros((0, placement.tree.kinematics.size))]
    for joint in placement.tree.closures:
        twists = placement.tree.chains[joint.name].twists(placement.displacements[joint.name])
        twists[:, 3:] += np.cross(twists[:, :3], placement.between(joint)[:3, 3])
        blocked = np.eye(6) - twists.T @ np.linalg.pinv(twists.T)
        rows.append(blocked @ relative_motion_map(placement, maps, joint))
    return np.vstack(rows)


def _rank(rows: Array) -> int:
    return int(np.sum(np.linalg.svd(rows, compute_uv=False) > _INDEPENDENT)) if rows.size else 0
