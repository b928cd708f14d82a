"""A motion as X3D: an HAnim humanoid with interpolators that turn its joints.

X3D 4.0 (ISO/IEC 19775-1:2023) and HAnim 2.0 (ISO/IEC 19774-1:2019). Lengths are metres, y is up,
the figure faces +z. Centres of joints, sites and shapes stand where they are when all displacements
of the figure are zero, which is HAnim's own default pose for a figure that stands upright.

The names that HAnim (ISO/IEC 19774-1:2019) has for the joints and segments of a human body.
"""

import re
from collections.abc import Iterable, Iterator, Mapping
from itertools import count
from pathlib import Path
from xml.sax.saxutils import quoteattr

import numpy as np

from generator.figure import Segment
from generator.losses import Loss, Losses
from generator.motion_files.appearance import Look, looks_of
from generator.motion_files.motion import NO_MASSES, Clip, unheld
from generator.motion_files.skeleton import Bone, Skeleton, axis_angles, closings, skeleton_of
from generator.names import plain_names
from generator.rotations import Array
from generator.text_io import write_whole

ROOT = "humanoid_root"
"""The joint in which every hierarchy begins."""

SACRUM = "sacrum"
"""The segment that moves with it."""

_SIDED = re.compile(r"(left|right|l|r)_([a-z]+)(?:_joint)?")

_OF_SIDE = {
    "hip": ("hip", "thigh"),
    "knee": ("knee", "calf"),
    "ankle": ("talocrural", "talus"),
    "clavicle": ("sternoclavicular", "clavicle"),
    "sternoclavicular": ("sternoclavicular", "clavicle"),
    "shoulder": ("shoulder", "upperarm"),
    "elbow": ("elbow", "forearm"),
    "wrist": ("radiocarpal", "carpal"),
}
_OF_MIDDLE = {"waist": ("vl5", "l5"), "neck": ("vc4", "c4")}


def hanim_names(joint: str) -> tuple[str, str] | None:
    """HAnim's names of a joint and of the segment it moves; None where it has none.

    Args:
        joint: the figure's name, such as `left_knee`.
    """
    name = joint.lower()
    if name in _OF_MIDDLE:
        return _OF_MIDDLE[name]
    match = _SIDED.fullmatch(name)
    if match is None or match[2] not in _OF_SIDE:
        return None
    side = match[1][0]
    moves, moved = _OF_SIDE[match[2]]
    return f"{side}_{moves}", f"{side}_{moved}"


def names_of(joints: Iterable[str]) -> dict[str, tuple[str, str]]:
    """HAnim's names of those joints that it knows; of two that would share one, the first."""
    known: dict[str, tuple[str, str]] = {}
    for joint in joints:
        pair = hanim_names(joint)
        if pair is not None and pair not in known.values():
            known[joint] = pair
    return known


_LEAST_SHIFT = 1e-7
"""A joint gets an interpolator for its position when it moves by more than this [m]."""

_DIGITS = 12
_CLOCK = "clock"

_NO_XML = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")

_HEAD = """\
<?xml version="1.0" encoding="UTF-8"?>
<!DOCTYPE X3D PUBLIC "ISO//Web3D//DTD X3D 4.0//EN" \
"https://www.web3d.org/specifications/x3d-4.0.dtd">
<X3D profile="Immersive" version="4.0" \
xmlns:xsd="http://www.w3.org/2001/XMLSchema-instance" \
xsd:noNamespaceSchemaLocation="https://www.web3d.org/specifications/x3d-4.0.xsd">
<head>
<component name="HAnim" level="1"/>"""


def write(clip: Clip, path: Path) -> Losses:
    """Write a motion as X3D, whole or not at all.

    Raises:
        OSError: the file cannot be written.
        OtherMotionError: the motion is of another figure.
    """
    skeleton = skeleton_of(clip)
    looks, unseen = looks_of(clip.figure)
    scene = _Scene(clip, skeleton, looks)
    write_whole(path, "".join(f"{line}\n" for line in scene.lines()))
    start = float(clip.times[0])
    losses = [
        *skeleton.losses(_LEAST_SHIFT),
        *unseen,
        Loss(f"the time of the first frame, {start:g} s; the motion begins when it is shown")
        if start
        else None,
        Loss("joints that HAnim does not know, under the figure's names", scene.unknown)
        if scene.unknown
        else None,
        Loss("displacements: the file holds orientations, without whole turns"),
        NO_MASSES,
        unheld(clip),
        Loss(f"digits: numbers have {_DIGITS}"),
    ]
    return Losses.of("X3D", losses)


class _Scene:
    """The lines of the file, and the names that things have in it."""

    def __init__(self, clip: Clip, skeleton: Skeleton, looks: Mapping[str, Look]) -> None:
        self._clip, self._skeleton, self._looks = clip, skeleton, looks
        self._used = {_CLOCK}
        known = names_of(bone.joint for bone in skeleton.bones)
        self.unknown = tuple(b.joint for b in skeleton.bones if b.joint not in known)
        self._ground_is_root = len(skeleton.roots) != 1
        if self._ground_is_root:
            self._root = self._new(ROOT)
        else:
            root = skeleton.roots[0].joint
            known[root] = (ROOT, SACRUM if known else "")
            self.unknown = tuple(name for name in self.unknown if name != root)
        segments = {bone.segment: known.get(bone.joint, ("", ""))[1] for bone in skeleton.bones}
        plain = plain_names([bone.joint for bone in skeleton.bones])
        self._joints = {
            bone.joint: self._new(
                known[bone.joint][0] if bone.joint in known else plain[bone.joint]
            )
            for bone in skeleton.bones
        }
        plain = plain_names(clip.figure.segments)
        self._segments = {
            name: self._new(segments.get(name) or plain[name]) for name in clip.figure.segments
        }
        self._sites: list[str] = []

    def _new(self, word: str) -> str:
        """The word, or one like it that nothing has yet."""
        if word in self._used:
            word = next(new for k in count(2) if (new := f"{word}_{k}") not in self._used)
        self._used.add(word)
        return word

    def lines(self) -> Iterator[str]:
        """The whole file."""
        yield _HEAD
        yield _tag("meta", "/", name="generator", content="exudyn-mover")
        for line in self._clip.header.lines():
            name, _, value = line.partition(" ")
            yield _tag("meta", "/", name=name, content=value)
        yield "</head>"
        yield "<Scene>"
        moving = {bone.segment for bone in self._skeleton.bones}
        for name, segment in self._clip.figure.segments.items():
            if name not in moving:
                yield _tag("Group", DEF=self._segments[name])
                yield from self._within(segment, "Transform")
                yield "</Group>"
        yield from self._humanoid()
        if self._clip.times.size > 1:
            yield from self._motion()
        yield "</Scene>"
        yield "</X3D>"

    def _humanoid(self) -> Iterator[str]:
        figure = self._clip.figure
        name = figure.name or self._clip.header.figure
        yield _tag("HAnimHumanoid", DEF=self._new("humanoid"), name=name, version="2.0")
        outermost = 0 if self._ground_is_root else 1
        if self._ground_is_root:
            yield _tag("HAnimJoint", DEF=self._root, name=ROOT, containerField="skeleton")
        for bone, ends in closings(self._skeleton.bones):
            here = self._joints[bone.joint]
            yield _tag(
                "HAnimJoint",
                DEF=here,
                name=here,
                containerField="children" if bone.depth >= outermost else "skeleton",
                center=_row(bone.centre),
                rotation=_row(axis_angles(bone.turns[:1])[0]),
                translation=_row(bone.shifts[0] if self._is_shifted(bone) else np.zeros(3)),
            )
            segment = self._segments[bone.segment]
            yield _tag("HAnimSegment", DEF=segment, name=segment)
            yield from self._within(figure.segments[bone.segment], "HAnimSite")
            yield "</HAnimSegment>"
            yield from ["</HAnimJoint>"] * ends
        if self._ground_is_root:
            yield "</HAnimJoint>"
        yield from self._uses()
        yield "</HAnimHumanoid>"

    def _uses(self) -> Iterator[str]:
        """The lists of what is in the humanoid, as HAnim asks for."""
        joints = [self._root] if self._ground_is_root else []
        joints += [self._joints[bone.joint] for bone in self._skeleton.bones]
        for joint in joints:
            yield _tag("HAnimJoint", "/", USE=joint, containerField="joints")
        for bone in self._skeleton.bones:
            segment = self._segments[bone.segment]
            yield _tag("HAnimSegment", "/", USE=segment, containerField="segments")
        for site in self._sites:
            yield _tag("HAnimSite", "/", USE=site, containerField="sites")

    def _within(self, segment: Segment, kind: str) -> Iterator[str]:
        """Sites and shape of a segment, where they are at rest."""
        for site in segment.sites.values():
            pose = self._skeleton.rest[segment.name] @ site.pose_in_segment
            word = self._new(next(iter(plain_names([f"{segment.name}_{site.name}"]).values())))
            named = {"DEF": word}
            if kind == "HAnimSite":
                self._sites.append(word)
                named["name"] = word
            turn, where = axis_angles(pose[None, :3, :3])[0], pose[:3, 3]
            yield _tag(kind, "/", **named, translation=_row(where), rotation=_row(turn))
        if segment.name in self._looks:
            yield from self._shape(segment, self._looks[segment.name])

    def _shape(self, segment: Segment, look: Look) -> Iterator[str]:
        points = self._skeleton.shape_at_rest(segment, look.surface.vertices)
        corners = " -1 ".join(" ".join(map(str, face)) for face in look.surface.faces)
        yield "<Shape>"
        yield "<Appearance>"
        yield _tag("Material", "/", diffuseColor=_row(np.array(look.colour)))
        yield "</Appearance>"
        yield _tag("IndexedFaceSet", solid="false", convex="false", coordIndex=f"{corners} -1")
        yield _tag("Coordinate", "/", point=_row(points.ravel()))
        yield "</IndexedFaceSet>"
        yield "</Shape>"

    def _is_shifted(self, bone: Bone) -> bool:
        return bone.farthest_shift > _LEAST_SHIFT

    def _motion(self) -> Iterator[str]:
        times = self._clip.times
        whole = float(times[-1] - times[0])
        yield _tag("TimeSensor", "/", DEF=_CLOCK, cycleInterval=repr(whole), loop="true")
        keys = _row((times - times[0]) / whole)
        for bone in self._skeleton.bones:
            turns = axis_angles(bone.turns)
            yield from self._driven(bone, "OrientationInterpolator", "rotation", keys, turns)
            if self._is_shifted(bone):
                name = "translation"
                yield from self._driven(bone, "PositionInterpolator", name, keys, bone.shifts)

    def _driven(self, bone: Bone, kind: str, field: str, keys: str, values: Array) -> Iterator[str]:
        joint = self._joints[bone.joint]
        word = self._new(f"{joint}_{field}")
        yield _tag(kind, "/", DEF=word, key=keys, keyValue=_row(values.ravel()))
        clock = {"fromNode": _CLOCK, "fromField": "fraction_changed"}
        yield _tag("ROUTE", "/", **clock, toNode=word, toField="set_fraction")
        source = {"fromNode": word, "fromField": "value_changed"}
        yield _tag("ROUTE", "/", **source, toNode=joint, toField=field)


def _tag(kind: str, end: str = "", **fields: str) -> str:
    """The beginning of an element, or all of it with the end `/`."""
    said = "".join(f" {k}={quoteattr(_NO_XML.sub('?', value))}" for k, value in fields.items())
    return f"<{kind}{said}{end}>"


def _row(values: Array) -> str:
    return " ".join(f"{value:.{_DIGITS}g}" for value in (values + 0.0).tolist())
