"""The door to Exudyn for a command: its faster build, and a sentence when it cannot be loaded."""

import sys
from contextlib import redirect_stdout
from io import StringIO

from generator.diagnostics import NotInstalledError


def import_exudyn() -> None:
    """Load Exudyn before anything else does, in its build without range checks if there is one.

    That build is a sixth faster and gives the same numbers; a program that has loaded Exudyn keeps
    what it has. Exudyn announces the choice on the standard output, which is kept quiet here.

    Raises:
        NotInstalledError: it cannot be loaded; the message names what is missing.
    """
    if "exudyn" not in sys.modules:
        sys.exudynFast = True  # pyright: ignore[reportAttributeAccessIssue]
    try:
        with redirect_stdout(StringIO()):
            import exudyn as _  # noqa: F401
    except ImportError as failure:
        raise NotInstalledError(_import_error_message(str(failure))) from None


def _import_error_message(failure: str) -> str:
    """What is missing, and where it comes from."""
    library = failure.split(":")[0]
    if not library.startswith("lib"):
        return f"Exudyn cannot be loaded: {failure}"
    return (
        f"Exudyn cannot be loaded because this system lacks the library {library}; "
        "on Debian and Ubuntu `apt-get install libgl1` brings it"
    )
