"""What holds joints in a simulation: `--links`, `--lock` and `--drive`, read for a figure."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import isclose
from pathlib import Path

import numpy as np

from generator.animation.driving import drives_with_warnings
from generator.commands.answer import UsageError
from generator.commands.options import chains_of, displacements_given
from generator.drive import Drive
from generator.errors import Fault, InputError, nearest
from generator.figure import Figure
from generator.posture.linked import examine_links
from generator.posture.links import Links
from generator.posture.placement import Displacements, drawn_displacements
from generator.posture.prescribed import Prescribed, PrescriptionError
from generator.posture.tree import hang

_SAME = 1e-9
"""Largest difference of displacements that count as one [rad or m]."""


@dataclass(frozen=True)
class Holding:
    """Links, locked joints and drives of a run."""

    links: Links = field(default_factory=Links)
    locked: tuple[str, ...] = ()
    drives: Mapping[str, Drive] = field(default_factory=dict[str, Drive])

    def insist_on(
        self,
        figure: Figure,
        sets: Sequence[str],
        start: float,
        velocities: Sequence[str] = (),
        *,
        free_root: bool = False,
    ) -> None:
        """Raise UsageError where options contradict each other.

        Args:
            figure: whose joints are held.
            sets: of `--set`: a joint cannot start elsewhere than it is held at the start.
            start: time of it [s].
            velocities: of `--velocity`: nor with another velocity.
            free_root: whether `--free-root` lets the figure go.

        Raises:
            UsageError: they do; or a joint is locked that cannot be.
            PrescriptionError: the links or the drives by themselves cannot be held.
        """
        tree = hang(figure)
        given = displacements_given("--set", sets, chains_of(figure))
        Prescribed(tree, self.links, {}, {})
        Prescribed(tree, Links(), {}, self.drives)
        asked: Displacements = {
            **drawn_displacements(tree),
            **{name: np.array(values) for name, values in given.items()},
        }
        locked = {name: asked[name] for name in self.locked}
        try:
            prescribed = Prescribed(tree, self.links, locked, self.drives)
        except PrescriptionError as failure:
            raise UsageError(str(failure)) from None
        put = prescribed.displacements(asked, start)
        for name in given:
            if not all(
                isclose(one, other, rel_tol=_SAME, abs_tol=_SAME)
                for one, other in zip(asked[name], put[name], strict=True)
            ):
                raise UsageError(
                    f"--set {name}: the joint is linked or driven, and starts elsewhere"
                )
        chains = chains_of(figure, free_root=free_root)
        for name in sorted(prescribed.held - chains.keys()):
            raise UsageError(
                f"--free-root lets the figure go from the ground, to which joint {name} holds it: "
                "it cannot be locked, linked or driven"
            )
        _insist_on_rates(prescribed, displacements_given("--velocity", velocities, chains), start)


def _insist_on_rates(
    prescribed: Prescribed, given: Mapping[str, Sequence[float]], start: float
) -> None:
    """Raise UsageError for velocities other than what is prescribed at the start [s]."""
    asked = {
        name: np.array(given.get(name, np.zeros(joint.degrees_of_freedom)), dtype=float)
        for name, joint in prescribed.tree.figure.joints.items()
    }
    put = prescribed.rates(asked, start)
    for name in given.keys() & asked.keys():
        if not np.allclose(asked[name], put[name], rtol=_SAME, atol=_SAME):
            raise UsageError(
                f"--velocity {name}: the joint is locked, linked or driven, and starts with "
                "another velocity"
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
    drives: Mapping[str, Drive] = {}
    if drive is not None:
        table = drives_with_warnings(drive, figure, driven)
        drives, faults = table.drives, (*faults, *table.faults)
    return Holding(read, tuple(dict.fromkeys(locks)), drives), faults
