"""exudyn-mover's figures and their motion.

The names that a script needs are here; each is imported when it is first asked for, so that what
needs no engine does not wait for one.
"""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from generator.animation import ActionFile, read_action, write_recording
    from generator.engine.assembly import Assembly
    from generator.engine.plan import Plan
    from generator.engine.simulate import Progress, simulate
    from generator.reader import read_figure
    from generator.recording import Outcome, Recording

_HOMES = {
    "ActionFile": "generator.animation",
    "Assembly": "generator.engine.assembly",
    "Outcome": "generator.recording",
    "Plan": "generator.engine.plan",
    "Progress": "generator.engine.simulate",
    "Recording": "generator.recording",
    "read_action": "generator.animation",
    "read_figure": "generator.reader",
    "simulate": "generator.engine.simulate",
    "write_recording": "generator.animation",
}

__all__ = [
    "ActionFile",
    "Assembly",
    "Outcome",
    "Plan",
    "Progress",
    "Recording",
    "read_action",
    "read_figure",
    "simulate",
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
