"""exudyn-mover's figures and their motion.

The names that a script needs are here; each is imported when it is first asked for, so that what
needs no engine does not wait for one.
"""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from generator.animation import ActionFile, read_action, read_npz, write_recording
    from generator.engine.assembly import Assembly
    from generator.engine.plan import Plan
    from generator.engine.simulate import Progress, simulate
    from generator.engine.statics import static_torques
    from generator.posture.centre_of_mass import centre_of_mass, centre_of_mass_jacobian
    from generator.posture.placement import drawn_displacements, place
    from generator.posture.stability import stability
    from generator.posture.tree import hang
    from generator.reader import read_figure
    from generator.reader.passive import read_springs
    from generator.reader.pose_file import read_pose
    from generator.recording import Outcome, Recording
    from generator.writer import write_pose

_HOMES = {
    "ActionFile": "generator.animation",
    "Assembly": "generator.engine.assembly",
    "Outcome": "generator.recording",
    "Plan": "generator.engine.plan",
    "Progress": "generator.engine.simulate",
    "Recording": "generator.recording",
    "centre_of_mass": "generator.posture.centre_of_mass",
    "centre_of_mass_jacobian": "generator.posture.centre_of_mass",
    "drawn_displacements": "generator.posture.placement",
    "hang": "generator.posture.tree",
    "place": "generator.posture.placement",
    "read_action": "generator.animation",
    "read_figure": "generator.reader",
    "read_npz": "generator.animation",
    "read_pose": "generator.reader.pose_file",
    "read_springs": "generator.reader.passive",
    "simulate": "generator.engine.simulate",
    "stability": "generator.posture.stability",
    "static_torques": "generator.engine.statics",
    "write_pose": "generator.writer",
    "write_recording": "generator.animation",
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
