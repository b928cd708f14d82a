"""A run enters only the modules of the features that it has."""

import subprocess
import sys

MAX_MODULES = 50
"""Largest number of modules of which `mover simulate pendulum` executes functions."""

ABSENT = ("cli.contact", "contacts", "contact_tables", "kinematics.loops", "kinematics.links")
"""Ends of modules of features that a pendulum does not have."""


def test_a_pendulum_enters_no_absent_feature() -> None:
    """In the first run, which may compile its law, and in the second, which has it."""
    script = [sys.executable, "-m", "benchmarks.executed_modules", "simulate", "pendulum"]
    for _ in range(2):
        run = subprocess.run(script, capture_output=True, text=True, check=True)
        text = run.stdout[run.stdout.index(" modules\n") - 3 :]
        count, *lines = text.strip().splitlines()
        modules = [line.partition(":")[0] for line in lines]
        assert int(count.split()[0]) == len(modules)
        assert 20 < len(modules) <= MAX_MODULES, "\n".join(lines)
        assert not [name for name in modules if name.endswith(ABSENT)]
