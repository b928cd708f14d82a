"""Strengths of a person by joint and motion, from `strengths.toml`."""

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, replace
from enum import Enum
from functools import cache
from importlib.resources import files
from typing import Any

from springs.published.tables import split_motion

GRAVITY = 9.81
"""Acceleration in the unit of strength, mass times gravity times stature [m/s2]."""

Pair = tuple[float, float]


class StrengthClass(Enum):
    """Origin of a number."""

    PUBLISHED = "published"
    """As printed."""
    SCALED = "scaled"
    """From a published number by a rule."""
    ESTIMATE = "estimate"
    """Not from a study."""


@dataclass(frozen=True)
class Body:
    """A person's measures on which strength depends.

    Attributes:
        mass: Mass [kg].
        stature: Stature [m].
        is_female: Whether it is a woman's.
    """

    mass: float
    stature: float
    is_female: bool = False


@dataclass(frozen=True)
class Strength:
    """Largest isometric torques about an axis.

    Attributes:
        largest: In the sense of the motion and against it [N m].
        origin: Class of the numbers.
        reference: Publication of the numbers; "" for an estimate.
    """

    largest: Pair
    origin: StrengthClass
    reference: str = ""


@dataclass(frozen=True)
class StrengthRow:
    """A row of the table.

    Attributes:
        motion: Part of the body and motion ("knee flexion").
        opposite: Opposite motion; that of a symmetric one is itself.
        torque: Torques of men in the sense of the motion and against it [N m]; None for shares.
        share: The same in units of mass times gravity times stature; None for torques.
        women_share: Those of women; None where the row is of men only.
        origin: Class of the numbers.
        reference: Publication with the place; "" for an estimate.
        why: Reason of a rule.
    """

    motion: str
    opposite: str
    torque: Pair | None
    share: Pair | None
    women_share: Pair | None
    origin: StrengthClass
    reference: str = ""
    why: str = ""

    def strength(self, body: Body | None) -> Strength | None:
        """Return the strength of a body; None for a share of an unknown one.

        Torques of an unknown body are those of men.
        """
        is_female = body is not None and body.is_female
        if self.share is None:
            assert self.torque is not None
            men = Strength(self.torque, self.origin, self.reference)
            return _of_women(men) if is_female else men
        if body is None:
            return None
        size = body.mass * GRAVITY * body.stature
        share = self.women_share if is_female and self.women_share is not None else self.share
        own = Strength((size * share[0], size * share[1]), self.origin, self.reference)
        return _of_women(own) if is_female and self.women_share is None else own


def _of_women(men: Strength) -> Strength:
    """Return the strength of women by the factor of the table."""
    factor = women_factor()
    largest = men.largest[0] * factor, men.largest[1] * factor
    return replace(men, largest=largest, origin=StrengthClass.ESTIMATE)


@cache
def _document() -> Mapping[str, Any]:
    return tomllib.loads(
        files("springs").joinpath("strength", "strengths.toml").read_text(encoding="utf-8")
    )


def women_factor() -> float:
    """Return women's share of men's strength, an estimate, for rows of men only."""
    return float(_document()["women"]["factor"])


@cache
def strength_rows() -> tuple[StrengthRow, ...]:
    """Return all rows of the table."""

    def pair(row: Mapping[str, Any], key: str) -> Pair | None:
        if key not in row:
            return None
        plus, minus = map(float, row[key])
        return plus, minus

    return tuple(
        StrengthRow(
            row["motion"],
            row.get("opposite", row["motion"]),
            pair(row, "torque_Nm"),
            pair(row, "share"),
            pair(row, "women_share"),
            StrengthClass(row["class"]),
            "; doi:".join(row[key] for key in ("reference", "doi") if key in row),
            row.get("why", ""),
        )
        for row in _document()["strength"]
    )


def strength(joint: str, motion: str, body: Body | None = None) -> Strength | None:
    """Return the strength of a motion of a joint; None where none is known.

    Args:
        joint: Name of the joint in its figure; one of its words says which it is ("left_elbow").
        motion: Name of a positive angle ("flexion", "twist to the left"). A part of the body before
            it ("lumbar flexion") takes precedence over the joint's words.
        body: Person; None where it is not known.
    """
    parts, kind = split_motion(joint, motion)
    for words in parts:
        wanted = {f"{word} {kind}" for word in words}
        for row in strength_rows():
            if row.motion in wanted:
                return row.strength(body)
            if row.opposite in wanted:
                own = row.strength(body)
                return own and replace(own, largest=(own.largest[1], own.largest[0]))
    return None
