"""Modules of which a command executes functions, outside of imports.

Run with `python -m benchmarks.executed_modules simulate pendulum`. Features that a run does not
have should not be entered: a pendulum passes no contact, link or loop.
"""

import sys
from importlib import import_module
from types import FrameType

PACKAGES = ("generator", "springs")


def executed_modules(words: list[str]) -> dict[str, set[str]]:
    """Run a command of `mover`, and return the functions that it executes by module."""
    from generator.cli.app import main

    import_module("generator.simulation.compiled_run")  # which may compile the integrator
    found: dict[str, set[str]] = {}

    def note(frame: FrameType, event: str, _: object) -> None:
        module = str(frame.f_globals.get("__name__"))
        name = frame.f_code.co_qualname
        if event != "call" or module.partition(".")[0] not in PACKAGES:
            return
        if name not in found.get(module, ()) and not _is_importing(frame):
            found.setdefault(module, set()).add(name)

    before, sys.argv = sys.argv, ["mover", *words]
    sys.setprofile(note)
    try:
        main()
    except SystemExit as ending:
        if ending.code:
            raise
    finally:
        sys.setprofile(None)
        sys.argv = before
    return found


def _is_importing(frame: FrameType | None) -> bool:
    """Return whether a frame is part of an import of the packages."""
    while frame is not None:
        module = str(frame.f_globals.get("__name__"))
        if frame.f_code.co_name == "<module>" and module.partition(".")[0] in PACKAGES:
            return True
        frame = frame.f_back
    return False


def main() -> None:
    """Print the number of modules and their functions."""
    found = executed_modules(sys.argv[1:])
    print(f"{len(found)} modules")
    for module, names in sorted(found.items()):
        print(f"{module}: {', '.join(sorted(names))}")


if __name__ == "__main__":
    main()
