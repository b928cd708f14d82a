"""Figures made for tests: one body or a row of bodies on joints of any chain."""

from collections.abc import Mapping, Sequence

import numpy as np

from generator.figure import (
    AxisKind,
    Figure,
    Joint,
    JointAxis,
    Location,
    Rotation,
    Segment,
    Site,
    SiteRef,
    Translation,
)
from generator.kinematics.links import Coordinate, Link

Vector = tuple[float, float, float]

X: Vector = (1.0, 0.0, 0.0)
Y: Vector = (0.0, 1.0, 0.0)
Z: Vector = (0.0, 0.0, 1.0)
SKEW: Vector = (2.0 / 3.0, -1.0 / 3.0, 2.0 / 3.0)
ACROSS: Vector = (1.0 / 3.0, -2.0 / 3.0, -2.0 / 3.0)
"""Perpendicular to SKEW."""

GROUND = "ground"
BASE = SiteRef(GROUND, "base")


def negative(axis: Vector) -> Vector:
    x, y, z = axis
    return -x, -y, -z


def chain(text: str) -> tuple[JointAxis, ...]:
    """Factors from words like `Rx R-y Tz Rs`: s is SKEW, a is ACROSS."""
    axes = {"x": X, "y": Y, "z": Z, "s": SKEW, "a": ACROSS}
    return tuple(
        JointAxis(
            AxisKind(word[0]),
            negative(axes[word[-1]]) if "-" in word else axes[word[-1]],
        )
        for word in text.split()
    )


BALL = chain("Rx Ry Rz")
FREE = chain("Rx Ry Rz Tx Ty Tz")


def at(turn: Vector = (0.0, 0.0, 0.0), shift: Vector = (0.0, 0.0, 0.0)) -> Location:
    return Location((Rotation(turn), Translation(shift)))


def ground(**sites: Location) -> Segment:
    places = {"base": Location(), **sites}
    return Segment(GROUND, mass=-1.0, sites={n: Site(n, where) for n, where in places.items()})


def body(
    name: str,
    mass: float = 2.0,
    inertia: Vector = (0.03, 0.04, 0.05),
    centre: Vector = (0.05, -0.1, 0.2),
    sites: Mapping[str, Location | Site] | None = None,
) -> Segment:
    """A segment with a site `near` at its origin and whatever else is given."""
    places: dict[str, Location | Site] = {"near": Location(), "CM": at(shift=centre)}
    places.update(sites or {})
    made = {n: where if isinstance(where, Site) else Site(n, where) for n, where in places.items()}
    return Segment(name, mass, inertia, sites=made)


def joint(
    name: str,
    parent: str,
    child: str,
    factors: tuple[JointAxis, ...],
    displacement: Sequence[float] | None = None,
    **fields: tuple[float, ...],
) -> Joint:
    """`connect parent to child`, both written `segment.site`."""
    ends = [SiteRef(*text.split(".")) for text in (parent, child)]
    values = (0.0,) * len(factors) if displacement is None else tuple(map(float, displacement))
    return Joint(name, ends[0], ends[1], factors, values, **fields)


def figure(segments: Sequence[Segment], joints: Sequence[Joint]) -> Figure:
    return Figure({s.name: s for s in segments}, {j.name: j for j in joints}, BASE)


def one_body(
    factors: tuple[JointAxis, ...],
    displacement: Sequence[float] | None = None,
    segment: Segment | None = None,
    **fields: tuple[float, ...],
) -> Figure:
    """One body, `link`, that hangs from the origin by the joint `pin`."""
    link = segment or body("link")
    pin = joint("pin", "ground.base", "link.near", factors, displacement, **fields)
    return figure([ground(), link], [pin])


def free_body(
    displacement: Sequence[float] | None = None,
    centre: Vector = (0.05, -0.1, 0.2),
    inertia: Vector = (0.03, 0.04, 0.05),
) -> Figure:
    """One body on a chain of three rotations and three translations."""
    return one_body(FREE, displacement, body("link", centre=centre, inertia=inertia))


def two_bodies(
    factors: tuple[JointAxis, ...], displacement: Sequence[float], *, reverse: bool = False
) -> Figure:
    """A body on a ball joint, and a second one on the joint `tested`, whose sites are turned.

    With `reverse` the connection is written the other way round.
    """
    first = body("first", sites={"far": at((0.4, -0.7, 0.3), (0.1, -0.3, 0.2))})
    second = body(
        "second",
        mass=1.3,
        inertia=(0.02, 0.015, 0.01),
        centre=(0.1, 0.15, -0.05),
        sites={"tip": at((-0.3, 0.9, 0.5), (0.02, 0.04, -0.03))},
    )
    ends = ("second.tip", "first.far") if reverse else ("first.far", "second.tip")
    return figure(
        [ground(), first, second],
        [
            joint("ball", "ground.base", "first.near", BALL, (0.3, -0.2, 0.4)),
            joint("tested", *ends, factors, displacement),
        ],
    )


def row(
    count: int,
    chains: Sequence[tuple[JointAxis, ...]] = (BALL,),
    bend: float = 0.3,
    **fields: float,
) -> Figure:
    """A row of `count` bars of 0.3 m; joint k has the chain k modulo the number of chains.

    `fields` (`stiff`, `damp`) are given to every factor of every joint.
    """
    segments, joints = [ground()], []
    last = "ground.base"
    for k in range(count):
        name = f"bar{k}"
        segments.append(
            body(
                name,
                max(1.0 - 0.05 * k, 0.05),
                (0.002, 0.01, 0.009),
                (0.15, 0.01, -0.02),
                {"far": at(shift=(0.3, 0.0, 0.0))},
            )
        )
        factors = chains[k % len(chains)]
        size = len(factors)
        values = bend * np.cos(1.3 * k + np.arange(size))
        given = {key: (value,) * size for key, value in fields.items()}
        joints.append(joint(f"joint{k}", last, f"{name}.near", factors, values, **given))
        last = f"{name}.far"
    return figure(segments, joints)


def link(follower: str, control: str, factor: float = 1.0, offset: float = 0.0) -> Link:
    """A link of `joint` or `joint 2`, degrees of freedom counted from 1."""

    def freedom(text: str) -> Coordinate:
        name, _, number = text.partition(" ")
        return Coordinate(name, int(number or 1) - 1)

    return Link(freedom(follower), freedom(control), factor, offset)
