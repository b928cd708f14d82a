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
    from generator.kinematics.placement import drawn_displacements, place
    from generator.kinematics.stability import stability
    from generator.kinematics.tree import hang
    from generator.motion_files import ActionFile, read_action, read_npz, write_recording
    from generator.recording import Outcome, Recording
    from generator.simulation.model import Assembly
    from generator.simulation.plan import Plan
    from generator.simulation.run import Progress, simulate
    from generator.simulation.statics import static_torques
    from generator.springs_file.read import read_springs

_HOMES = {
    "ActionFile": "generator.motion_files",
    "Assembly": "generator.simulation.model",
    "Outcome": "generator.recording",
    "Plan": "generator.simulation.plan",
    "Progress": "generator.simulation.run",
    "Recording": "generator.recording",
    "centre_of_mass": "generator.kinematics.centre_of_mass",
    "centre_of_mass_jacobian": "generator.kinematics.centre_of_mass",
    "drawn_displacements": "generator.kinematics.placement",
    "hang": "generator.kinematics.tree",
    "place": "generator.kinematics.placement",
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

__all__ = [
    "ActionFile",
    "Assembly",
    "Outcome",
    "Plan",
    "Progress",
    "Recording",
    "centre_of_mass",
    "centre_of_mass_jacobian",
    "drawn_displacements",
    "hang",
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
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(_HOMES[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    """The public names, imported or not."""
    return sorted({*globals(), *__all__})
