"""The motion of a figure as positions and speeds of a MuJoCo model, which then plays it.

The model is read for the order and the kinds of its joints; its joints have the names that the
writer gives them, and its bodies those of the segments.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from generator.diagnostics import InputError, error
from generator.identifiers import coordinate_names, plain_names, reserve_name
from generator.kinematics.placement import MAX_FRAMES_PER_PLACEMENT
from generator.kinematics.tree import Tree
from generator.model_files.xml import XmlElement
from generator.rotations import Array, matrix_from_quaternion, quaternion_from_matrix

WORLD = "world"
"""Name of the body of the ground, and of the site whose axes are those of the world."""

BALL, FREE = "ball", "free"
_SINGLE = ("hinge", "slide")


@dataclass(frozen=True)
class _Place:
    """A joint of the model.

    Attributes:
        name: Name.
        kind: Type.
        body: Name of its body.
        parent: Name of the body that it moves in; None for the world.
        rest: Rotation of its body there at zero displacements, shape (3, 3).
    """

    name: str
    kind: str
    body: str
    parent: str | None
    rest: Array


def body_name(names: Mapping[str, str], segment: str) -> str:
    """Return the name of a segment's body; MuJoCo's own body is called `world`.

    `names` are the plain names of all segments.
    """
    name = names[segment]
    return reserve_name(name, {*names.values()}) if name == WORLD else name


def _places(element: XmlElement, parent: str | None) -> Iterator[_Place]:
    """Yield the joints below an element in the order of MuJoCo."""
    waiting = [(body, parent) for body in reversed(list(element.find_all("body")))]
    while waiting:
        body, above = waiting.pop()
        name = body.get("name") or ""
        turn = np.array(body.numbers("quat", 4) or (1.0, 0.0, 0.0, 0.0))
        for joint in body.find_all("joint", "freejoint"):
            kind = FREE if joint.tag == "freejoint" else joint.get("type") or _SINGLE[0]
            rest = matrix_from_quaternion(turn / np.linalg.norm(turn))
            yield _Place(joint.get("name") or "", kind, name, above, rest)
        waiting += [(child, name) for child in reversed(list(body.find_all("body")))]


@dataclass(frozen=True)
class Motion:
    """A motion of n frames.

    Attributes:
        tree: Tree that moves, with a free root or without.
        displacements: Displacements of each joint, shape (n, degrees of freedom) [rad or m].
        poses: Poses of the segments in the world, shape (n, 4, 4).
        rates: Rates of the displacements, likewise; None if they are unknown.
    """

    tree: Tree
    displacements: Mapping[str, Array]
    poses: Mapping[str, Array]
    rates: Mapping[str, Array] | None = None

    @cached_property
    def twists(self) -> Mapping[str, Array]:
        """Angular velocity and velocity at the world's origin of each segment, shape (n, 6)."""
        kinematics = self.tree.kinematics
        assert self.rates is not None
        values = kinematics.displacement_vector(self.displacements)
        rates = kinematics.displacement_vector(self.rates)
        parts = [
            kinematics.twists(values[start : start + MAX_FRAMES_PER_PLACEMENT])
            for start in range(0, len(values), MAX_FRAMES_PER_PLACEMENT)
        ]
        twists = np.concatenate(parts)
        return {
            name: np.einsum("nmk,nm->nk", twists, rates * mask)
            for name, mask in kinematics.motion_masks.items()
        }


@dataclass(frozen=True)
class Track:
    """A motion in the coordinates of a MuJoCo model with nq positions and nv speeds.

    Attributes:
        qpos: Positions, shape (n, nq).
        qvel: Speeds, shape (n, nv); None for a motion without rates.
    """

    qpos: Array
    qvel: Array | None


def track_of_motion(root: XmlElement, motion: Motion) -> Track:
    """Return a motion in the coordinates of a model.

    Args:
        root: Element `mujoco` of the model.
        motion: Motion of its figure.

    Raises InputError for a model with other joints than the motion, such as one that is attached.
    """
    places = [place for world in root.find_all("worldbody") for place in _places(world, None)]
    _check_joints(places, motion)
    plain = plain_names(motion.tree.figure.segments)
    segments = {body_name(plain, name): name for name in plain}
    coordinates = _coordinates(motion.tree)
    positions: list[Array] = []
    speeds: list[Array] = []
    for place in places:
        if place.kind in _SINGLE:
            joint, k = coordinates[place.name]
            positions.append(motion.displacements[joint][:, k : k + 1])
            if motion.rates is not None:
                speeds.append(motion.rates[joint][:, k : k + 1])
            continue
        pose = motion.poses[segments[place.body]]
        parent = None if place.parent is None else segments.get(place.parent)
        above = np.eye(3) if parent is None else motion.poses[parent][:, :3, :3]
        turn = pose[:, :3, :3]
        if place.kind == FREE:
            positions.append(pose[:, :3, 3])
        else:
            turn = place.rest.T @ np.swapaxes(above, -1, -2) @ turn
        positions.append(_continuous(quaternion_from_matrix(turn)))
        if motion.rates is not None:
            twist = motion.twists[segments[place.body]]
            spin = twist[:, :3] - (0.0 if parent is None else motion.twists[parent][:, :3])
            if place.kind == FREE:
                speeds.append(twist[:, 3:] + np.cross(twist[:, :3], pose[:, :3, 3]))
            speeds.append((np.swapaxes(pose[:, :3, :3], -1, -2) @ spin[..., None])[..., 0])
    moved = None if motion.rates is None else np.concatenate(speeds, axis=1)
    return Track(np.concatenate(positions, axis=1), moved)


def _coordinates(tree: Tree) -> dict[str, tuple[str, int]]:
    """Return joint and place in the chain by the name of a hinge or a slide."""
    chains = {branch.joint.name: branch.joint.chain for branch in tree.joints}
    plain = plain_names(chains)
    found = {
        coordinate: (name, k)
        for name, listed in coordinate_names(chains).items()
        for k, coordinate in enumerate(listed)
    }
    return found | {plain[name]: (name, 0) for name, chain in chains.items() if len(chain) == 1}


def _check_joints(places: list[_Place], motion: Motion) -> None:
    """Raise InputError for joints of the model that the motion lacks, and the other way round."""
    branches = [branch.joint for branch in motion.tree.joints]
    coordinates, plain = _coordinates(motion.tree), plain_names(joint.name for joint in branches)
    joints = {name: one for one, name in plain.items()}
    names = plain_names(motion.tree.figure.segments)
    bodies = {body_name(names, name) for name in names}
    moved: set[str] = set()
    unknown = [place.body for place in places if place.body not in bodies]
    for place in places:
        if place.kind in _SINGLE and place.name in coordinates:
            moved.add(coordinates[place.name][0])
        elif place.kind in (BALL, FREE) and place.name in joints:
            moved.add(joints[place.name])
        else:
            unknown.append(place.name or place.body)
    missing = [plain[one.name] for one in branches if one.chain and one.name not in moved]
    if unknown or missing:
        sentences = [
            f"the {owner} has no {', '.join(f'`{name}`' for name in names)}, which the {other} has"
            for owner, other, names in (("motion", "model", unknown), ("model", "motion", missing))
            if names
        ]
        hint = "write the model with the start of the run: --floor, --scene or --free-root"
        raise InputError(
            [error(f"the model is of another motion: {'; '.join(sentences)}", hint=hint)]
        )


def _continuous(quaternions: Array) -> Array:
    """Return quaternions of n frames with the signs that make them continuous, shape (n, 4)."""
    products = np.sum(quaternions[1:] * quaternions[:-1], axis=1)
    signs = np.cumprod(np.concatenate([[1.0], np.where(products < 0.0, -1.0, 1.0)]))
    return quaternions * signs[:, None]
