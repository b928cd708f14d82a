"""What a report was made with: the versions, the machine and the command."""

import platform
import shlex
from collections.abc import Sequence
from importlib.metadata import version

_DISTRIBUTIONS = ("exudyn-mover", "exudyn", "numpy", "scipy", "matplotlib")


def made_with(names: Sequence[str]) -> dict[str, str]:
    """What makes the plates of these names, or all of them when there are no names.

    The folder of the report is not told: where it lies does not change it. Nor is the time.
    """
    return {
        "command": shlex.join(["mover", "plots", "-o", "DIR", *names]),
        **{name: version(name) for name in _DISTRIBUTIONS},
        "Python": platform.python_version(),
        "machine": platform.platform(),
    }
