"""A motion as X3D: an HAnim humanoid with interpolators that turn its joints.

X3D 4.0 (ISO/IEC 19775-1:2023) and HAnim 2.0 (ISO/IEC 19774-1:2019). Lengths are metres, y is up,
the figure faces +z. Centres of joints, sites and shapes stand where they are when all displacements
of the figure are zero, which is HAnim's own default pose for a figure that stands upright.

The names that HAnim (ISO/IEC 19774-1:2019) has for the joints and segments of a human body.
"""

import re
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path

import numpy as np

from generator.figure import Segment
from generator.geometry.appearance import Appearance, segment_appearances
from generator.losses import Loss, Losses
from generator.motion_files.motion import NO_MASSES, FigureMotion, unrepresented
from generator.motion_files.skeleton import (
    Bone,
    Skeleton,
    axis_angles,
    bones_with_block_ends,
    build_skeleton,
)
from generator.names import plain_name, plain_names, reserve_name
from generator.rotations import Array
from generator.text_io import write_atomic

ROOT = "humanoid_root"
"""The joint in which every hierarchy begins."""

SACRUM = "sacrum"
"""The segment that moves with it."""

_SIDED_JOINT = re.compile(r"(left|right|l|r)_([a-z]+)(?:_joint)?")

_SIDED_NAMES = {
    "hip": ("hip", "thigh"),
    "knee": ("knee", "calf"),
    "ankle": ("talocrural", "talus"),
    "clavicle": ("sternoclavicular", "clavicle"),
    "sternoclavicular": ("sternoclavicular", "clavicle"),
    "shoulder": ("shoulder", "upperarm"),
    "elbow": ("elbow", "forearm"),
    "wrist": ("radiocarpal", "carpal"),
}
_MIDLINE_NAMES = {"waist": ("vl5", "l5"), "neck": ("vc4", "c4")}


def hanim_names(joint: str) -> tuple[str, str] | None:
    """HAnim's names of a joint and of the segment it moves; None where it has none.

    Args:
        joint: the figure's name, such as `left_knee`.
    """
    name = joint.lower()
    if name in _MIDLINE_NAMES:
        return _MIDLINE_NAMES[name]
    match = _SIDED_JOINT.fullmatch(name)
    if match is None or match[2] not in _SIDED_NAMES:
        return None
    side = match[1][0]
    moves, moved = _SIDED_NAMES[match[2]]
    return f"{side}_{moves}", f"{side}_{moved}"


def hanim_names_by_joint(joints: Iterable[str]) -> dict[str, tuple[str, str]]:
    """HAnim's names of those joints that it knows; of two that would share one, the first."""
    known: dict[str, tuple[str, str]] = {}
    for joint in joints:
        pair = hanim_names(joint)
        if pair is not None and pair not in known.values():
            known[joint] = pair
    return known


_MIN_TRANSLATION = 1e-7
"""A joint gets an interpolator for its position when it moves by more than this [m]."""

_DIGITS = 12
_CLOCK = "clock"

_INVALID_XML_CHARACTER = re.compile("[\0-\x08\x0b\x0c\x0e-\x1f\ud800-\udfff\ufffe\uffff]")

_HEAD = """\
<?xml version="1.0" encoding="UTF-8"?>
<!DOCTYPE X3D PUBLIC "ISO//Web3D//DTD X3D 4.0//EN" \
"https://www.web3d.org/specifications/x3d-4.0.dtd">
<X3D profile="Immersive" version="4.0" \
xmlns:xsd="http://www.w3.org/2001/XMLSchema-instance" \
xsd:noNamespaceSchemaLocation="https://www.web3d.org/specifications/x3d-4.0.xsd">
<head>
<component name="HAnim" level="1"/>"""


def write(motion: FigureMotion, path: Path) -> Losses:
    """Write a motion as X3D, whole or not at all.

    Raises:
        OSError: the file cannot be written.
        ModelError: the motion is of another figure.
    """
    skeleton = build_skeleton(motion)
    appearances, unseen = segment_appearances(motion.figure)
    scene = _SceneWriter(motion, skeleton, appearances)
    write_atomic(path, "".join(f"{line}\n" for line in scene.lines()))
    start = float(motion.times[0])
    losses = [
        *skeleton.losses(_MIN_TRANSLATION),
        *unseen,
        Loss(f"the time of the first frame, {start:g} s; the motion begins when it is shown")
        if start
        else None,
        Loss("joints that HAnim does not know, under the figure's names", scene.unknown_joints)
        if scene.unknown_joints
        else None,
        Loss("displacements: the file holds orientations, without whole turns"),
        NO_MASSES,
        unrepresented(motion),
        Loss(f"digits: numbers have {_DIGITS}"),
    ]
    return Losses.collect("X3D", losses)


class _SceneWriter:
    """The lines of the file, and the names that things have in it."""

    def __init__(
        self, motion: FigureMotion, skeleton: Skeleton, appearances: Mapping[str, Appearance]
    ) -> None:
        self._motion, self._skeleton, self._appearances = motion, skeleton, appearances
        self._used_names = {_CLOCK}
        known = hanim_names_by_joint(bone.joint for bone in skeleton.bones)
        self.unknown_joints = tuple(b.joint for b in skeleton.bones if b.joint not in known)
        self._ground_is_root = len(skeleton.roots) != 1
        if self._ground_is_root:
            self._root = reserve_name(ROOT, self._used_names)
        else:
            root = skeleton.roots[0].joint
            known[root] = (ROOT, SACRUM if known else "")
            self.unknown_joints = tuple(name for name in self.unknown_joints if name != root)
        segments = {bone.segment: known.get(bone.joint, ("", ""))[1] for bone in skeleton.bones}
        plain = plain_names([bone.joint for bone in skeleton.bones])
        self._joints = {
            bone.joint: reserve_name(
                known[bone.joint][0] if bone.joint in known else plain[bone.joint],
                self._used_names,
            )
            for bone in skeleton.bones
        }
        plain = plain_names(motion.figure.segments)
        self._segments = {
            name: reserve_name(segments.get(name) or plain[name], self._used_names)
            for name in motion.figure.segments
        }
        self._sites: list[str] = []

    def lines(self) -> Iterator[str]:
        """The whole file."""
        yield _HEAD
        yield _format_tag("meta", "/", name="generator", content="exudyn-mover")
        for line in self._motion.header.lines():
            name, _, value = line.partition(" ")
            yield _format_tag("meta", "/", name=name, content=value)
        yield "</head>"
        yield "<Scene>"
        moving = {bone.segment for bone in self._skeleton.bones}
        for name, segment in self._motion.figure.segments.items():
            if name not in moving:
                yield _format_tag("Group", DEF=self._segments[name])
                yield from self._segment_lines(segment, "Transform")
                yield "</Group>"
        yield from self._humanoid_lines()
        if self._motion.times.size > 1:
            yield from self._motion_lines()
        yield "</Scene>"
        yield "</X3D>"

    def _humanoid_lines(self) -> Iterator[str]:
        figure = self._motion.figure
        name = figure.name or self._motion.header.figure
        yield _format_tag(
            "HAnimHumanoid",
            DEF=reserve_name("humanoid", self._used_names),
            name=name,
            version="2.0",
        )
        outermost = 0 if self._ground_is_root else 1
        if self._ground_is_root:
            yield _format_tag("HAnimJoint", DEF=self._root, name=ROOT, containerField="skeleton")
        for bone, ends in bones_with_block_ends(self._skeleton.bones):
            here = self._joints[bone.joint]
            yield _format_tag(
                "HAnimJoint",
                DEF=here,
                name=here,
                containerField="children" if bone.depth >= outermost else "skeleton",
                center=_format_row(bone.centre),
                rotation=_format_row(axis_angles(bone.rotations[:1])[0]),
                translation=_format_row(
                    bone.translations[0] if self._is_translated(bone) else np.zeros(3)
                ),
            )
            segment = self._segments[bone.segment]
            yield _format_tag("HAnimSegment", DEF=segment, name=segment)
            yield from self._segment_lines(figure.segments[bone.segment], "HAnimSite")
            yield "</HAnimSegment>"
            yield from ["</HAnimJoint>"] * ends
        if self._ground_is_root:
            yield "</HAnimJoint>"
        yield from self._use_lines()
        yield "</HAnimHumanoid>"

    def _use_lines(self) -> Iterator[str]:
        """The lists of what is in the humanoid, as HAnim asks for."""
        joints = [self._root] if self._ground_is_root else []
        joints += [self._joints[bone.joint] for bone in self._skeleton.bones]
        for joint in joints:
            yield _format_tag("HAnimJoint", "/", USE=joint, containerField="joints")
        for bone in self._skeleton.bones:
            segment = self._segments[bone.segment]
            yield _format_tag("HAnimSegment", "/", USE=segment, containerField="segments")
        for site in self._sites:
            yield _format_tag("HAnimSite", "/", USE=site, containerField="sites")

    def _segment_lines(self, segment: Segment, kind: str) -> Iterator[str]:
        """Sites and shape of a segment, where they are at rest."""
        for site in segment.sites.values():
            pose = self._skeleton.rest_poses[segment.name] @ site.pose_in_segment
            word = reserve_name(plain_name(f"{segment.name}_{site.name}"), self._used_names)
            named = {"DEF": word}
            if kind == "HAnimSite":
                self._sites.append(word)
                named["name"] = word
            turn, where = axis_angles(pose[None, :3, :3])[0], pose[:3, 3]
            yield _format_tag(
                kind, "/", **named, translation=_format_row(where), rotation=_format_row(turn)
            )
        if segment.name in self._appearances:
            yield from self._shape_lines(segment, self._appearances[segment.name])

    def _shape_lines(self, segment: Segment, appearance: Appearance) -> Iterator[str]:
        points = self._skeleton.points_at_rest(segment, appearance.surface.vertices)
        corners = " -1 ".join(" ".join(map(str, face)) for face in appearance.surface.faces)
        yield "<Shape>"
        yield "<Appearance>"
        yield _format_tag("Material", "/", diffuseColor=_format_row(np.array(appearance.colour)))
        yield "</Appearance>"
        yield _format_tag(
            "IndexedFaceSet", solid="false", convex="false", coordIndex=f"{corners} -1"
        )
        yield _format_tag("Coordinate", "/", point=_format_row(points.ravel()))
        yield "</IndexedFaceSet>"
        yield "</Shape>"

    def _is_translated(self, bone: Bone) -> bool:
        return bone.max_translation > _MIN_TRANSLATION

    def _motion_lines(self) -> Iterator[str]:
        times = self._motion.times
        whole = float(times[-1] - times[0])
        yield _format_tag("TimeSensor", "/", DEF=_CLOCK, cycleInterval=repr(whole), loop="true")
        keys = _format_row((times - times[0]) / whole)
        for bone in self._skeleton.bones:
            turns = axis_angles(bone.rotations)
            yield from self._interpolator_lines(
                bone, "OrientationInterpolator", "rotation", keys, turns
            )
            if self._is_translated(bone):
                name = "translation"
                yield from self._interpolator_lines(
                    bone, "PositionInterpolator", name, keys, bone.translations
                )

    def _interpolator_lines(
        self, bone: Bone, kind: str, field: str, keys: str, values: Array
    ) -> Iterator[str]:
        joint = self._joints[bone.joint]
        word = reserve_name(f"{joint}_{field}", self._used_names)
        yield _format_tag(kind, "/", DEF=word, key=keys, keyValue=_format_row(values.ravel()))
        clock = {"fromNode": _CLOCK, "fromField": "fraction_changed"}
        yield _format_tag("ROUTE", "/", **clock, toNode=word, toField="set_fraction")
        source = {"fromNode": word, "fromField": "value_changed"}
        yield _format_tag("ROUTE", "/", **source, toNode=joint, toField=field)


def _format_tag(kind: str, end: str = "", **fields: str) -> str:
    """The beginning of an element, or all of it with the end `/`."""
    from xml.sax.saxutils import quoteattr  # imports the whole of urllib

    attributes = "".join(
        f" {k}={quoteattr(_INVALID_XML_CHARACTER.sub('?', value))}" for k, value in fields.items()
    )
    return f"<{kind}{attributes}{end}>"


def _format_row(values: Array) -> str:
    return " ".join(f"{value:.{_DIGITS}g}" for value in (values + 0.0).tolist())
