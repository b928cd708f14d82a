"""Ctrl-C between the files of one command: are they all there, or none, and is the message true?

    python -m benchmarks.interrupts [COUNT]

Each try starts `mover` with several outputs, waits until the first hidden file has a content, and
sends SIGINT a random time later. Every answer is one of three: nothing was written, all was
written and the command says so, or the command had finished.
"""

import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

OUTPUTS = [f"out.{end}" for end in ("npz", "action", "csv", "sto", "mot", "bvh", "glb")]
SIMULATE = [
    "simulate",
    "pendulum",
    "--stop",
    "0.5",
    "--frame",
    "0.01",
    *(word for name in OUTPUTS for word in ("-o", name)),
]

CONVERT = ["convert", "prototype", "out.fig", "out.xml", "out.osim", "dyspam"]
CONVERTED = {"out.fig", "out.xml", "out.osim", "out_geometry", "dyspam"}
PERSON = ["person", "--sex", "male", "--stature", "1.75m", "--mass", "75kg", "-o", "out.fig"]
MADE = {
    "out.fig",
    "out.springs.toml",
    "out.riener.springs.toml",
    "out.sources.csv",
    "out_geometry",
    "out.contact.toml",
}
COMMANDS = ((SIMULATE, set(OUTPUTS)), (CONVERT, CONVERTED), (PERSON, MADE))

MAX_DELAY = 0.08
"""Longest time from the first hidden file to the signal [s]."""

# A shell's background job ignores SIGINT, and its children inherit that.
_START = (
    "import signal; signal.signal(signal.SIGINT, signal.default_int_handler); "
    "from generator.cli.app import main; main()"
)


@dataclass(frozen=True)
class Interruption:
    """One try.

    Attributes:
        delay: from the first hidden file to the signal [s].
        ending: of `ENDINGS`, or a description of what is wrong.
    """

    NOTHING: ClassVar = "nothing written"
    WRITTEN: ClassVar = "interrupted, all written"
    FINISHED: ClassVar = "finished before"
    ENDINGS: ClassVar = (NOTHING, WRITTEN, FINISHED)

    delay: float
    ending: str


def interrupt_commands(folder: Path, count: int, seed: int = 1) -> Iterator[Interruption]:
    """Interrupt commands at random moments between their files, each in a folder of its own."""
    moments = random.Random(seed)
    for k in range(count):
        own = folder / f"try{k}"
        own.mkdir()
        words, outputs = COMMANDS[k % len(COMMANDS)]
        delay = moments.uniform(0.0, MAX_DELAY)
        yield Interruption(delay, _interrupt(own, words, outputs, delay))


def _interrupt(folder: Path, words: list[str], outputs: set[str], delay: float) -> str:
    root = str(Path(__file__).parents[1])
    process = subprocess.Popen(
        [sys.executable, "-c", _START, *words],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": root},
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
    )
    # The empty hidden files of the beginning show that the outputs can be written.
    while process.poll() is None and not any(_size(path) for path in folder.iterdir()):
        time.sleep(0.0005)
    time.sleep(delay)
    process.send_signal(signal.SIGINT)
    _, message = process.communicate(timeout=120)
    left = {path.name for path in folder.iterdir()}
    answers = {
        (3, "error: interrupted before anything was written", ()): Interruption.NOTHING,
        (3, "error: interrupted; the files were written", tuple(sorted(outputs))): (
            Interruption.WRITTEN
        ),
        (0, "", tuple(sorted(outputs))): Interruption.FINISHED,
    }
    # At its exit Python lets the signal end the process, after all has been printed.
    code = 0 if process.returncode == -signal.SIGINT and not message.strip() else process.returncode
    said = "" if code == 0 else message.strip()
    found = (code, said, tuple(sorted(left)))
    return answers.get(found, f"exit code {found[0]}, `{found[1]}`, files {', '.join(found[2])}")


def _size(path: Path) -> int:
    try:
        return path.stat().st_size
    except FileNotFoundError:
        return 0


def main() -> None:
    """Print how often each ending was seen; fail if one is wrong."""
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 60
    with tempfile.TemporaryDirectory() as folder:
        endings = Counter(each.ending for each in interrupt_commands(Path(folder), count))
    for ending, number in sorted(endings.items()):
        print(f"| {ending} | {number} |")
    sys.exit(any(ending not in Interruption.ENDINGS for ending in endings))


if __name__ == "__main__":
    main()
