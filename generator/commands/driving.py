"""What holds joints in a simulation: `--links`, `--lock` and `--drive`, read for a figure."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import isclose
from pathlib import Path

import numpy as np

from generator.animation.driving import read_drives
from generator.commands.answer import UsageError
from generator.commands.options import chains_of, displacements_given
from generator.drive import Drive
from generator.errors import Fault, InputError, nearest
from generator.figure import Figure
from generator.posture.linked import examine_links
from generator.posture.links import Links
from generator.posture.placement import Displacements, drawn_displacements
from generator.posture.prescribed import Prescribed
from generator.posture.tree import hang

_SAME = 1e-9
"""Largest difference of displacements that count as one [rad or m]."""


@dataclass(frozen=True)
class Holding:
    """Links, locked joints and drives of a run."""

    links: Links = field(default_factory=Links)
    locked: tuple[str, ...] = ()
    drives: Mapping[str, Drive] = field(default_factory=dict[str, Drive])

    def insist_on(self, figure: Figure, sets: Sequence[str], start: float) -> None:
        """Raise UsageError where `--set` puts a joint elsewhere than it is held at the start [s].

        Raises PrescriptionError where the joints cannot be held so.
        """
        tree = hang(figure)
        given = displacements_given("--set", sets, chains_of(figure))
        asked: Displacements = {
            **drawn_displacements(tree),
            **{name: np.array(values) for name, values in given.items()},
        }
        locked = {name: asked[name] for name in self.locked}
        put = Prescribed(tree, self.links, locked, self.drives).displacements(asked, start)
        for name in given:
            if not all(
                isclose(one, other, rel_tol=_SAME, abs_tol=_SAME)
                for one, other in zip(asked[name], put[name], strict=True)
            ):
                raise UsageError(
                    f"--set {name}: the joint is linked or driven, and starts elsewhere"
                )


def holding_of(
    figure: Figure,
    links: Path | None,
    locks: Sequence[str],
    drive: Path | None = None,
    driven: Sequence[str] = (),
) -> tuple[Holding, tuple[Fault, ...]]:
    """What the options say, with warnings.

    Args:
        figure: whose joints they are.
        links: a links file.
        locks: names of joints.
        drive: an action file or a table.
        driven: names of the joints that it drives; all when there are none.

    Raises:
        UsageError: a joint is unknown.
        InputError: a file is wrong.
    """
    for option, names in (("--lock", locks), ("--driven", driven)):
        for name in names:
            if name not in figure.joints:
                hint = nearest(name, figure.joints)
                raise UsageError(f"{option} {name}: the figure has no joint `{name}`; {hint}")
    if driven and drive is None:
        raise UsageError("--driven chooses joints of the --drive file, which is missing")
    read, faults = Links(), ()
    if links is not None:
        reading = examine_links(links, figure)
        if reading.links is None:
            raise InputError(reading.faults)
        read, faults = reading.links, reading.faults
    drives = dict[str, Drive]() if drive is None else read_drives(drive, figure, driven)
    return Holding(read, tuple(dict.fromkeys(locks)), drives), faults
