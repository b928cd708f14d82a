"""What is said when Ctrl-C comes before there is anything to keep.

It imports nothing that takes time: `generator.cli.app`, which prints all else, needs it while it is
imported itself.
"""

import sys
from contextlib import suppress
from typing import NoReturn

SAID = "interrupted before there was anything to write"

CODE = 3
"""As of a run that failed."""


def leave_interrupted(*, as_json: bool) -> NoReturn:
    """Say that the command was interrupted, and leave the program with the code of a failed run."""
    with suppress(OSError, AttributeError):  # there may be no such streams, or full ones
        sys.stderr.write(f"error: {SAID}\n")
        if as_json:
            sys.stdout.write(f'{{\n  "error": "{SAID}"\n}}\n')
    sys.exit(CODE)
