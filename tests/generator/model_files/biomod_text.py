"""A reader of `.bioMod` files that knows the words which this program writes."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np

from generator.rotations import matrix_from_axis_angle, pose_matrix

END = {"segment": "endsegment", "marker": "endmarker", "passivetorque": "endpassivetorque"}
COUNTS = {
    "parent": 1, "rtinmatrix": 1, "rt": 16, "translations": 1, "rotations": 1, "mass": 1,
    "inertia": 9, "com": 3, "meshfile": 1, "meshcolor": 3, "position": 3, "type": 1, "dof": 1,
    **dict.fromkeys(("k1", "k2", "b1", "b2", "qmid", "deltap", "taueq", "wmax", "pbeta"), 1),
    "t0": 1, "slope": 1,
}  # fmt: skip
"""Number of words after a tag."""


@dataclass(frozen=True)
class Block:
    """A segment, marker or torque: its name, its values by tag, and the words of its comments."""

    kind: str
    name: str
    values: Mapping[str, list[str]]
    names: list[str] = field(default_factory=list[str])

    def numbers(self, tag: str) -> np.ndarray:
        return np.array(self.values[tag], dtype=float)


@dataclass(frozen=True)
class BioMod:
    """A model.

    Attributes:
        gravity: acceleration [m/s2].
        blocks: in the order of the file.
    """

    gravity: np.ndarray
    blocks: list[Block]

    def of_kind(self, kind: str) -> dict[str, list[Block]]:
        found: dict[str, list[Block]] = {}
        for block in self.blocks:
            if block.kind == kind:
                found.setdefault(block.name, []).append(block)
        return found

    @property
    def segments(self) -> dict[str, Block]:
        found = self.of_kind("segment")
        assert all(len(blocks) == 1 for blocks in found.values())
        return {name: block for name, (block,) in found.items()}

    @property
    def markers(self) -> dict[str, Block]:
        found = self.of_kind("marker")
        assert all(len(blocks) == 1 for blocks in found.values())
        return {name: block for name, (block,) in found.items()}

    @property
    def coordinates(self) -> list[str]:
        """Our names of the displacements in the order of Q."""
        return [name for segment in self.segments.values() for name in segment.names]

    @property
    def dofs(self) -> list[tuple[str, str]]:
        """Segment and name of each displacement, in the order of Q."""
        return [
            (name, f"{word}{letter.upper()}")
            for name, segment in self.segments.items()
            for word, tag in (("Trans", "translations"), ("Rot", "rotations"))
            for letter in segment.values.get(tag, [""])[0]
        ]

    def poses(self, values: Mapping[str, float]) -> dict[str, np.ndarray]:
        """Pose of each segment in the world at displacements by our names."""
        poses = {"root": np.eye(4)}
        for name, segment in self.segments.items():
            pose = poses[segment.values["parent"][0]] @ segment.numbers("rt").reshape(4, 4)
            numbers = [values[own] for own in segment.names]
            steps = [
                (tag, letter)
                for tag in ("translations", "rotations")
                for letter in segment.values.get(tag, [""])[0]
            ]
            for (tag, letter), value in zip(steps, numbers, strict=True):
                axis = np.eye(3)["xyz".index(letter)]
                if tag == "translations":
                    pose = pose @ pose_matrix(np.eye(3), value * axis)
                else:
                    pose = pose @ pose_matrix(matrix_from_axis_angle(axis, value), np.zeros(3))
            poses[name] = pose
        return poses


def read_biomod(text: str) -> BioMod:
    """Read a model."""
    lines = iter(text.splitlines())
    gravity, blocks = np.zeros(3), list[Block]()
    assert next(lines) == "version 4"
    for line in lines:
        words = line.partition("//")[0].split()
        if not words:
            continue
        if words[0] == "gravity":
            gravity = np.array(words[1:], dtype=float)
        else:
            kind, name = words
            blocks.append(_read_block(kind, name, lines))
    return BioMod(gravity, blocks)


def _read_block(kind: str, name: str, lines: Iterator[str]) -> Block:
    names, words = list[str](), list[str]()
    for line in lines:
        code, _, comment = line.partition("//")
        names += [word.strip() for word in comment.split(",") if word.strip()]
        words += code.split()
        if END[kind] in words:
            break
    assert words.pop() == END[kind]
    values: dict[str, list[str]] = {}
    while words:
        tag = words.pop(0)
        count = COUNTS.get(tag)
        if tag in ("rangesq", "jointdampings"):
            count = (2 if tag == "rangesq" else 1) * len(names)
        assert count is not None, tag
        values[tag], words = words[:count], words[count:]
    return Block(kind, name, values, names)
