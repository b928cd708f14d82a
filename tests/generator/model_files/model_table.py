"""Prints by how much motions of written models differ from ours, in three other programs."""

from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import figures
from generator import read_springs
from generator.figure import Figure
from springs import SphericalLaw, SpringSet
from tests.generator.model_files.engines import MuJoCo, OpenSim, Pinocchio, moved
from tests.generator.model_files.model_cases import (
    CLAVICLES,
    LOOPS,
    PROTOTYPE,
    TREES,
    apart,
    equal,
    ours,
    own_springs,
    spring_set,
)

COUPLED = Path(figures.__path__[0]) / "prototype.coupled.springs.toml"

SKIPPED = ("pendulum", "names that meet")


def rows() -> list[tuple[str, Figure, SpringSet, str]]:
    """Name, figure, springs, and the programs that hold them."""
    free = [(name, of, SpringSet(), "mou") for name, of in TREES.items() if name not in SKIPPED]
    pendulum = ("pendulum, with its force", TREES["pendulum"], SpringSet(), "mo")
    loops = [(name, of, SpringSet(), "mo") for name, of in LOOPS.items()]
    whole, coupled = own_springs(PROTOTYPE), read_springs(COUPLED, PROTOTYPE)
    own = whole.joints
    hinges = [one for name, one in own.items() if len(PROTOTYPE.joints[name].chain) == 1]
    balls = [
        equal(PROTOTYPE, name, 40.0, 0.08)
        for name in own
        if name not in {one.joint for one in hinges}
    ]
    return [
        *free,
        pendulum,
        *loops,
        ("prototype on its own elbows and knees", PROTOTYPE, spring_set(*hinges), "mo"),
        ("the same, equal springs elsewhere", PROTOTYPE, spring_set(*hinges, *balls), "m"),
        ("prototype on all its springs", PROTOTYPE, whole, "o"),
        ("the same, weighted law", PROTOTYPE, replace(whole, law=SphericalLaw.WEIGHTED), "o"),
        ("the same, with laws over hip and knee", PROTOTYPE, coupled, "o"),
        ("clavicles on all its springs", CLAVICLES, own_springs(CLAVICLES), "o"),
    ]


def main() -> None:
    """Print the table."""
    print("| figure | MuJoCo | its step / 16 | OpenSim | Pinocchio |")
    print("|---|---|---|---|---|")
    for name, of, springs, programs in rows():
        expected = ours(of, springs).poses
        shown = []
        for finer in (1, 16) if "m" in programs else ():
            loaded = MuJoCo(of, springs)
            loaded.model.opt.timestep /= finer
            shown.append(f"{apart(moved(loaded), expected):.1e}")
        shown += [""] * (2 - len(shown))
        with TemporaryDirectory() as folder:
            others = {"o": OpenSim, "u": Pinocchio}
            for engine in (others[letter] for letter in programs if letter in others):
                shown.append(f"{apart(moved(engine(of, springs, Path(folder))), expected):.1e}")
        shown += [""] * (4 - len(shown))
        print(f"| {name} |", " | ".join(shown), "|", flush=True)


if __name__ == "__main__":
    main()
