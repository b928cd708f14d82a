"""Tone of muscles that a run asks for: which joints, with how much of their strength, and when."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace
from math import inf, isfinite

from generator.diagnostics import ModelError, spelling_hint
from springs.strength.strengths import StrengthClass
from springs.tone.activation import Activation
from springs.tone.law import LEAD, WIDTH

ALL = "all"
"""Name of all joints that have a known strength and are not righted."""

GROUPS: Mapping[str, frozenset[str]] = {
    "neck": frozenset({"neck"}),
    "trunk": frozenset({"waist", "lumbar", "thorax"}),
    "arms": frozenset({"clavicle", "shoulder", "elbow", "forearm", "wrist"}),
    "legs": frozenset({"hip", "knee", "ankle"}),
}
"""Words in the names of the joints of each group."""

_TIMES = ("delay", "release", "rise")


@dataclass(frozen=True)
class Tone:
    """Tone of muscles, in SI units and radians.

    Attributes:
        hold: Shares of strength, from 0 to 1, by which joints hold their angles at the start, by
            joint, group or `all`; a joint precedes its group, and this `all`.
        righting: Shares by which a joint turns its child towards the orientation that it has in
            the world where the figure stands as written, by joint or group.
        width: Error at which the torque is 0.76 of the largest one [rad].
        lead: Time by which an error is anticipated, which damps [s].
        delay: Time after the start of the run at which tone begins to rise [s]; with 0 it is there
            from the start.
        release: Time after the start of the run at which it begins to fall [s]; inf for never.
        rise: Duration of rise and fall [s].
        strengths: Largest torques about the axes of a joint in the sense of a motion and against
            it [N m], by `joint motion` or by joint, in place of those of `springs/strength`. The
            motion may be the opposite one, in whose sense the first torque is then.
        strength_classes: Classes of these, by the same names; by default estimates.
        name: Name of the file that it is from; "" for none.
    """

    hold: Mapping[str, float] = field(default_factory=dict[str, float])
    righting: Mapping[str, float] = field(default_factory=dict[str, float])
    width: float = WIDTH
    lead: float = LEAD
    delay: float = 0.0
    release: float = inf
    rise: float = 0.05
    strengths: Mapping[str, tuple[float, float]] = field(
        default_factory=dict[str, tuple[float, float]]
    )
    strength_classes: Mapping[str, StrengthClass] = field(default_factory=dict[str, StrengthClass])
    name: str = ""

    def __post_init__(self) -> None:
        """Check the values. Raises ValueError."""
        for table in (self.hold, self.righting):
            for name, share in table.items():
                if not 0.0 <= share <= 1.0:
                    raise ValueError(f"the tone of {name} is from 0 to 1, not {share:g}")
        if ALL in self.righting:
            raise ValueError(f"righting is of joints or groups ({', '.join(GROUPS)}), not of all")
        for name in ("width", "rise"):
            value = getattr(self, name)
            if not (value > 0.0 and isfinite(value)):
                raise ValueError(f"the {name} of a tone is positive, not {value:g}")
        for name in ("lead", "delay"):
            value = getattr(self, name)
            if not (value >= 0.0 and isfinite(value)):
                raise ValueError(f"the {name} of a tone is not negative, not {value:g}")
        risen = self.delay + self.rise if self.delay > 0.0 else 0.0
        if not self.release >= risen:
            raise ValueError(
                f"tone is released at {self.release:g} s, before it has risen at {risen:g} s"
            )
        for name, pair in self.strengths.items():
            if not (min(pair) >= 0.0 and isfinite(max(pair))):
                raise ValueError(f"the strength of {name} is not negative, not {pair}")
        for name in self.strength_classes.keys() - self.strengths.keys():
            raise ValueError(f"{name} has a class of its strength and no strength")

    def __bool__(self) -> bool:
        """Return whether a joint has any tone."""
        return any((*self.hold.values(), *self.righting.values()))

    def __str__(self) -> str:
        """Return shares and times in a phrase."""
        parts = [self.name] if self.name else []
        parts += [_shares("holding", self.hold), _shares("righting", self.righting)]
        if self.delay > 0.0:
            parts.append(f"from {self.delay:g} s")
        if self.release < inf:
            parts.append(f"until {self.release:g} s")
        return "; ".join(part for part in parts if part)

    def scaled(self, factor: float) -> "Tone":
        """Return the tone with all shares of strength times a factor. Raises ValueError."""
        shares = (
            {name: factor * share for name, share in table.items()}
            for table in (self.hold, self.righting)
        )
        hold, righting = shares
        return replace(self, hold=hold, righting=righting)

    def activation(self, start: float) -> Activation:
        """Return the activation in a run from a start [s]."""
        begin = start + self.delay if self.delay > 0.0 else -inf
        return Activation(begin, start + self.release, self.rise)

    def righting_shares(self, joints: Collection[str]) -> dict[str, float]:
        """Return the shares by which joints right their children, without those of zero.

        Raises ModelError for an unknown joint or group.
        """
        return _by_joint(self.righting, joints, "righting")

    def hold_shares(self, joints: Collection[str]) -> dict[str, float]:
        """Return the shares by which joints hold their angles, without those of zero.

        `all` leaves out the joints that are righted.

        Raises ModelError for an unknown joint or group.
        """
        named = {name: share for name, share in self.hold.items() if name != ALL}
        found = _by_joint(named, joints, "tone", keeps_zeros=True)
        others = self.hold.get(ALL, 0.0)
        if others > 0.0:
            righted = self.righting_shares(joints)
            found = {name: others for name in joints if name not in righted} | found
        return {name: share for name, share in found.items() if share > 0.0}


def _shares(verb: str, table: Mapping[str, float]) -> str:
    some = ", ".join(f"{name} {share:g}" for name, share in table.items() if share > 0.0)
    return f"{verb} {some}" if some else ""


def group_of(joint: str) -> str:
    """Return the group of a joint by the words of its name; "" for none."""
    words = set(joint.lower().split("_"))
    return next((name for name, parts in GROUPS.items() if words & parts), "")


def _by_joint(
    table: Mapping[str, float], joints: Collection[str], noun: str, *, keeps_zeros: bool = False
) -> dict[str, float]:
    """Return the share of each joint that a table names, itself or by its group."""
    for name in table:
        if name not in joints and not (name in GROUPS and name in map(group_of, joints)):
            known = [*joints, *GROUPS]
            kind = "the figure has no joint of the group" if name in GROUPS else "no joint or group"
            hint = spelling_hint(name, known)
            raise ModelError(f"{noun}: {kind} `{name}`" + (f"; {hint}" if hint else ""))
    shares = {
        joint: table[joint] if joint in table else table[group_of(joint)]
        for joint in joints
        if joint in table or group_of(joint) in table
    }
    return {joint: share for joint, share in shares.items() if keeps_zeros or share > 0.0}
