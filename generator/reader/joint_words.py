"""Whether a motion ("hip flexion") is one of the joint that gets it, by the joint's name."""

from collections.abc import Iterable, Mapping

_PARTS: Mapping[str, str] = {
    **{part: part for part in ("hip", "knee", "ankle", "shoulder", "elbow", "wrist", "neck")},
    "foot": "ankle",
    "arm": "shoulder",
    **dict.fromkeys(("waist", "lumbar", "trunk", "spine", "back"), "waist"),
}
"""Words of motions and of joints' names, and the joint that each means."""


def is_elsewhere(motion: str, joint: str) -> bool:
    """Whether a motion is that of another joint; not where either does not say which it is.

    Args:
        motion: its name, such as "knee flexion".
        joint: name of a joint, such as "left_hip_joint".
    """
    moved, named = _part(motion.lower().split()), _part(joint.lower().split("_"))
    return moved is not None and named is not None and moved != named


def _part(words: Iterable[str]) -> str | None:
    return next((_PARTS[word] for word in words if word in _PARTS), None)
