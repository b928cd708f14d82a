"""The names that HAnim (ISO/IEC 19774-1:2019) has for the joints and segments of a human body."""

import re
from collections.abc import Iterable

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
