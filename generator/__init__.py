"""exudyn-mover's figures and their motion.

The names that a script needs are here; each is imported when it is first asked for, so that what
needs no engine does not wait for one.
"""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from generator.figure_file import read_figure
    from generator.figure_file.write import write_pose
    from generator.input_files.pose import read_pose
    from generator.kinematics.centre_of_mass import centre_of_mass, centre_of_mass_jacobian
    from generator.kinematics.placement import forward_kinematics, initial_displacements
    from generator.kinematics.stability import stability
    from generator.kinematics.tree import build_tree
    from generator.motion_files import ActionFile, read_action, read_npz, write_recording
    from generator.recording import Outcome, Recording
    from generator.simulation.model import ExudynModel
    from generator.simulation.plan import Plan
    from generator.simulation.run import Progress, simulate
    from generator.simulation.statics import static_torques
    from generator.springs_file.read import read_springs

    Assembly = ExudynModel
    drawn_displacements = initial_displacements
    hang = build_tree
    place = forward_kinematics

_MODULES = {
    "ActionFile": "generator.motion_files",
    "ExudynModel": "generator.simulation.model",
    "Outcome": "generator.recording",
    "Plan": "generator.simulation.plan",
    "Progress": "generator.simulation.run",
    "Recording": "generator.recording",
    "build_tree": "generator.kinematics.tree",
    "centre_of_mass": "generator.kinematics.centre_of_mass",
    "centre_of_mass_jacobian": "generator.kinematics.centre_of_mass",
    "forward_kinematics": "generator.kinematics.placement",
    "initial_displacements": "generator.kinematics.placement",
    "read_action": "generator.motion_files",
    "read_figure": "generator.figure_file",
    "read_npz": "generator.motion_files",
    "read_pose": "generator.input_files.pose",
    "read_springs": "generator.springs_file.read",
    "simulate": "generator.simulation.run",
    "stability": "generator.kinematics.stability",
    "static_torques": "generator.simulation.statics",
    "write_pose": "generator.figure_file.write",
    "write_recording": "generator.motion_files",
}

_EARLIER_NAMES = {
    "Assembly": "ExudynModel",
    "drawn_displacements": "initial_displacements",
    "hang": "build_tree",
    "place": "forward_kinematics",
}
"""Names of an earlier version, which scripts may still use."""

__all__ = [
    "ActionFile",
    "Assembly",
    "ExudynModel",
    "Outcome",
    "Plan",
    "Progress",
    "Recording",
    "build_tree",
    "centre_of_mass",
    "centre_of_mass_jacobian",
    "drawn_displacements",
    "forward_kinematics",
    "hang",
    "initial_displacements",
    "place",
    "read_action",
    "read_figure",
    "read_npz",
    "read_pose",
    "read_springs",
    "simulate",
    "stability",
    "static_torques",
    "write_pose",
    "write_recording",
]


def __getattr__(name: str) -> object:
    """A public name, from the module that defines it."""
    target = _EARLIER_NAMES.get(name, name)
    if target not in _MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(_MODULES[target]), target)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    """The public names, imported or not."""
    return sorted({*globals(), *__all__})
