"""The plates that this package makes, in the order of the thesis.

Each is named by where it is made, `module:function`, and imported by the process that makes it.
"""

from collections.abc import Mapping

_ORDER = (
    "elbow",
    "knee",
    "shoulder_abduction",
    "shoulder_flexion",
    "shoulder_rotation",
    "hip_directional",
    "hip_flexion",
    "hip_abduction",
    "hip_rotation",
    "waist_bend",
    "waist_flexion",
    "waist_twist",
    "clavicle",
    "two_joint_hip",
    "off_axis",
    "fall_energy",
    "verification",
    "work_precision",
)

PLATES: Mapping[str, str] = {name: f"plots.{name}:plate" for name in _ORDER}
"""Where each plate is made, by its name."""
