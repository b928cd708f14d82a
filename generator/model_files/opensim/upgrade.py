"""Upgrade of models of OpenSim 3 and older, in which bodies contain joints, by OpenSim itself."""

import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryDirectory

from generator.diagnostics import shorten
from generator.losses import Losses
from generator.model_files.xml import XmlElement, parse_xml
from generator.text_io import load_text

_SCRIPT = """
import sys
import opensim
opensim.Logger.setLevelString("off")
opensim.Model(sys.argv[1]).printToXML(sys.argv[2])
print(opensim.GetVersion().partition("-")[0])
"""

_TIME_LIMIT = 120.0
"""Longest time that OpenSim may take [s]; a model of 90 muscles takes 2 s."""


def upgraded_document(root: XmlElement, losses: Losses) -> XmlElement | None:
    """Return a document in the format of OpenSim 4; None, with an error, without OpenSim's package.

    It runs in a process of its own, in a folder of its own: it writes a log there, and may crash.

    Args:
        root: the element `OpenSimDocument` of the older format.
        losses: notes that the model was upgraded.
    """
    message = "this model was written by OpenSim 3 or older"
    if find_spec("opensim") is None:
        hint = "install OpenSim's package, which converts it (`pip install opensim`)"
        root.error(message, f"{hint}, or save it with OpenSim 4", "Version")
        return None
    with TemporaryDirectory() as name:
        folder = Path(name)
        model, written = folder / "older.osim", folder / "model.osim"
        source = root.span.source
        if source.path is None:
            model.write_text(source.text, encoding="utf-8")
        else:  # it may name other files beside it
            model = source.path.absolute()
        command = [sys.executable, "-c", _SCRIPT, str(model), str(written)]
        try:
            done = subprocess.run(
                command, cwd=folder, capture_output=True, timeout=_TIME_LIMIT, check=False
            )
            output = done.stderr.decode(errors="replace").strip().splitlines()
            reason = next((line for line in output if ": std::exception" in line), "")
            reason = reason.partition("what(): ")[2] or (output[-1] if output else "it crashed")
        except subprocess.TimeoutExpired:
            done, reason = None, f"it takes more than {_TIME_LIMIT:.0f} s"
        if done is None or done.returncode != 0 or not written.exists():
            root.error(f"{message}, and OpenSim cannot convert it", shorten(reason), "Version")
            return None
        upgraded, fault = load_text(written, f"{source.name} as OpenSim 4 writes it")
        version = done.stdout.decode(errors="replace").split()
    losses.add_description(
        f"older format: OpenSim {' '.join(version[-1:])} has converted the model first"
    )
    if fault is not None:
        what = f"{message}, and the converted one cannot be read: {fault.message}"
        root.error(what, at="Version")
        return None
    return parse_xml(upgraded, root.diagnostics)
