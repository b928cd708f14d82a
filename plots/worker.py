"""A process that makes plates: `python -m plots.worker`, started by `plots.workers`.

It reads pairs of a plate's name and of where it is made from its standard input, and writes a
`DrawnPlate` or a `Failed` for each to its standard output, both pickled. When the input ends,
whoever wanted the plates is gone, and it ends in the middle of one.
"""

import os
import pickle
import sys
import traceback
from importlib import import_module
from queue import SimpleQueue
from threading import Thread
from types import ModuleType

from plots.drawn_plate import DrawnPlate, Failed


def make(name: str, target: str) -> DrawnPlate | Failed:
    """Make and draw the plate of a name by a function `module:function`."""
    module = None
    try:
        # What it imports may refuse the user's settings, which is a reason as any other.
        from plots.drawing import draw

        path, _, function = target.partition(":")
        module = import_module(path)
        plate = getattr(module, function)()
        if plate.name != name:
            return Failed(name, f"it calls itself `{plate.name}`")
        return draw(plate)
    except (Exception, SystemExit) as failure:
        return Failed(name, _reason(failure, module))


def _reason(failure: BaseException, module: ModuleType | None) -> str:
    """What was raised, on one line, and the last line of the plate's module that led there."""
    reason = type(failure).__name__
    if said := " ".join(str(failure).split()):
        reason += f": {said}"
    for frame in reversed(traceback.extract_tb(failure.__traceback__)):
        if module is not None and frame.filename == module.__file__:
            return f"{reason} ({os.path.basename(frame.filename)}, line {frame.lineno})"
    return reason


def main() -> None:
    """Serve until the standard input ends."""
    # Libraries print, some of them past Python: the stream of the answers is kept from them.
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    wanted: SimpleQueue[tuple[str, str]] = SimpleQueue()
    Thread(target=_listen, args=(wanted,), daemon=True).start()
    while True:
        name, target = wanted.get()
        pickle.dump(make(name, target), answers)
        answers.flush()


def _listen(wanted: "SimpleQueue[tuple[str, str]]") -> None:
    """Pass on what is asked for; end the process with the input, whatever it is doing."""
    while True:
        try:
            wanted.put(pickle.load(sys.stdin.buffer))
        except EOFError:
            os._exit(0)


if __name__ == "__main__":
    main()
