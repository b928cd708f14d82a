"""A spherical joint turned about axes between its own: the two readings of eq. 4.4 compared.

The prototype's hip turned about axes between its own, its torques read out of Exudyn.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from generator import Plan, read_figure, static_torques
from generator.rotations import Sequence3, cross_matrix, matrix_from_rotation_vector
from generator.simulation.plan import springs_of
from plots.canvas import GREY, PENS, THESIS, blank, styled, write_foot, zero_line
from plots.plate import Claim, Plate
from springs import AxisSpring, Cubic, Joining, SpringSet, total_torque
from springs.backends import Array
from springs.cubic import polynomial
from springs.elastic import extrapolation
from springs.published import tables as published

JOINT = "left_hip_joint"

_NODES = 4
"""Gauss-Legendre nodes of a piece of a loop: exact for cubics and beyond."""

_PIECES = 6
"""Of a side of a loop, at least."""


@dataclass(frozen=True)
class Oblique:
    """Torques on the leg for turns of one size about several axes, shape (n,) each [N m].

    Attributes:
        along: the axis of the turn.
        across: it, in the half-way frame, towards flexion.
    """

    along: Array
    across: Array


@dataclass(frozen=True)
class Work:
    """Work of a joint that is carried along a way, shape (n,) each.

    Attributes:
        way: length covered in the space of rotation vectors [rad].
        work: done on the leg since the start [J].
    """

    way: Array
    work: Array


class ObliqueHip:
    """The left hip. Rotation vectors are given as components of abduction and flexion."""

    def __init__(self) -> None:
        """Take the figure, and the springs of this joint alone."""
        self._body = read_figure("prototype")
        self._springs = springs_of(self._body, Plan()).joints[JOINT]
        self._sequence = Sequence3(tuple(one.axis for one in self._body.joints[JOINT].chain))
        self._plane = np.array([self.about(m).direction for m in ("abduction", "flexion")])

    @property
    def axes(self) -> tuple[AxisSpring, ...]:
        """The springs about the joint's axes."""
        return self._springs.axes

    def about(self, motion: str) -> AxisSpring:
        """The spring about one axis: `abduction`, `flexion` or `medial rotation`."""
        return next(spring for spring in self.axes if spring.motion == motion)

    def torques(self, turns: Array, joining: Joining) -> Array:
        """Torque on the leg [N m] at rotation vectors [rad], pelvis's site axes, (n, 3) each."""
        matrices = matrix_from_rotation_vector(turns)
        poses = [{JOINT: self._sequence.angles(matrix)} for matrix in matrices]
        plan = Plan(springs=SpringSet({JOINT: self._springs}, joining))
        return static_torques(self._body, poses, plan)[JOINT]

    def oblique(self, turn: float, directions: Array, joining: Joining) -> Oblique:
        """Torques of a turn [rad] about axes at `directions` from abduction to flexion [rad]."""
        axes = np.stack([np.cos(directions), np.sin(directions)], axis=1) @ self._plane
        across = np.stack([-np.sin(directions), np.cos(directions)], axis=1) @ self._plane
        half = matrix_from_rotation_vector(0.5 * turn * axes)
        torques = np.einsum("nji,nj->ni", half, self.torques(turn * axes, joining))
        return Oblique(np.sum(torques * axes, axis=1), np.sum(torques * across, axis=1))

    def carried(self, corners: Sequence[tuple[float, float]], joining: Joining) -> Work:
        """Work on the leg carried along straight sides from corner to corner [rad].

        The torque is read at Gauss-Legendre nodes of pieces of the sides, which end where a law has
        a corner, and multiplied with the turn of the leg that belongs to the step between them.
        """
        nodes, weights = np.polynomial.legendre.leggauss(_NODES)
        turns: list[Array] = []
        steps: list[Array] = []
        way = [0.0]
        for start, end in pairwise(np.array(corners)):
            for low, high in pairwise(self._cuts(start, end)):
                share = low + 0.5 * (high - low) * (nodes + 1.0)
                turns.append((start + share[:, None] * (end - start)) @ self._plane)
                lengths: Array = 0.5 * (high - low) * weights
                steps.append(lengths[:, None] * ((end - start) @ self._plane))
                way.append(way[-1] + (high - low) * float(np.linalg.norm(end - start)))
        at = np.concatenate(turns)
        turned = np.einsum("nij,nj->ni", _turn_map(at), np.concatenate(steps))
        work = np.sum(self.torques(at, joining) * turned, axis=1)
        pieces = np.sum(work.reshape(-1, _NODES), axis=1)
        return Work(np.array(way), np.concatenate([[0.0], np.cumsum(pieces)]))

    def _cuts(self, start: Array, end: Array) -> list[float]:
        """Where a side is cut into pieces, from 0 to 1."""
        cuts = {k / _PIECES for k in range(_PIECES + 1)}
        for spring in self.axes:
            first, last = (float(p @ self._plane @ spring.direction) for p in (start, end))
            for corner in (corner for law in spring.elastic for corner in law.corners):
                if min(first, last) < corner < max(first, last):
                    cuts.add((corner - first) / (last - first))
        return sorted(cuts)


def _turn_map(turns: Array) -> Array:
    """What makes the turn of a body out of the change of its rotation vector, (n, 3, 3).

    1 + (1 - cos a)/a^2 [r]x + (a - sin a)/a^3 [r]x^2, in the axes of what it turns against.
    """
    a = np.linalg.norm(turns, axis=1)[:, None, None]
    k = cross_matrix(turns)
    return np.eye(3) + (1.0 - np.cos(a)) / a**2 * k + (a - np.sin(a)) / a**3 * (k @ k)


# Matplotlib leaves the types of its keyword arguments open.
# pyright: reportUnknownMemberType=false


TURN = np.radians(60.0)
"""By which the leg is turned about axes between abduction and flexion [rad]."""

LOOP = ((0.0, 0.0), (TURN, 0.0), (TURN, TURN), (0.0, TURN), (0.0, 0.0))
"""A closed loop: corners in abduction and flexion, components of the rotation vector [rad]."""

TORQUE_BOUND = 1e-6
"""Torques that differ by less are the same [N m]."""

WORK_BOUND = 1e-6
"""Work below which nothing but rounding is left [J]."""

_DIRECTIONS = np.radians(np.linspace(0.0, 90.0, 37))
_ON_AXIS = np.radians(np.arange(-90.0, 91.0, 15.0))
_PENS = {Joining.CONSERVATIVE: PENS[0], Joining.WEIGHTED: PENS[1]}
_SIGN = (
    "Torques act on the leg: along the axis of the turn positive in its sense, across it positive "
    "from abduction towards flexion, in the frame half-way between pelvis and leg. Work is "
    "positive where the joint drives the leg. Left hip; abduction is about x, flexion about y."
)
_CAPTION = (
    "Left: the leg is turned by 60 deg about axes from abduction (0 deg) to flexion (90 deg). All "
    "points were read out of Exudyn with the prototype at rest; the thin line is eq. 4.4 of the "
    "thesis as printed. Both readings of it are the axis's own law at both ends. Between them the "
    "conservative law pushes less, for each axis sees its own component of the turn and not the "
    "whole of it. Right: the leg is carried round a closed loop of orientations (abducted, flexed, "
    "brought back, lowered), and the torque read out of Exudyn times the turn is summed. The "
    "conservative law gives back what it took; the weighted law does not. No measurement of a hip "
    "turned about oblique axes is public, so none is drawn. The thesis's curve of abduction is an "
    "estimate of its author; of that of flexion: {known}."
)


def off_axis() -> Plate:
    """Draw the plate."""
    hip = ObliqueHip()
    turned = {joining: hip.oblique(TURN, _DIRECTIONS, joining) for joining in Joining}
    carried = {joining: hip.carried(LOOP, joining) for joining in Joining}
    thesis = published.publication("otani_1989").reference
    references = (
        str(replace(thesis, place="eq. 4.4, and appendix A, records of the left hip")),
        hip.about("flexion").reference,
        hip.about("abduction").reference,
    )
    as_printed = printed(hip)
    known = published.curve("otani_1989/hip_y").measured
    return Plate(
        name="off_axis",
        title="A hip turned about oblique axes (the thesis's eq. 4.4)",
        caption=_CAPTION.format(known=extrapolation(known, 0.0, TURN)),
        sign=_SIGN,
        figure=_draw(turned, as_printed, carried, references),
        claims=tuple(_claims(hip, carried)),
        tables=_tables(turned, as_printed, carried),
        references=references,
    )


def printed(hip: ObliqueHip) -> Oblique:
    """Eq. 4.4 as printed, M_i = A_i M_i(a), in the sense in which each cubic restores."""
    weights = np.cos(_DIRECTIONS), np.sin(_DIRECTIONS)
    x, y = (
        weight * _as_printed(hip.about(motion))
        for weight, motion in zip(weights, ("abduction", "flexion"), strict=True)
    )
    return Oblique(weights[0] * x + weights[1] * y, weights[0] * y - weights[1] * x)


def _as_printed(spring: AxisSpring) -> float:
    """A cubic at the turn, without its dead zone [N m]."""
    (cubic,) = spring.elastic
    assert isinstance(cubic, Cubic)
    return cubic.sense * float(polynomial(cubic.coefficients, TURN))


def off_the_axis_laws(hip: ObliqueHip, joining: Joining) -> float:
    """Greatest difference from an axis's own law about it, turned about each both ways [N m]."""
    differences: list[float] = []
    for spring in hip.axes:
        direction = np.array(spring.direction)
        about = hip.torques(np.outer(_ON_AXIS, direction), joining) @ direction
        own = np.asarray(total_torque(spring.elastic, _ON_AXIS))
        differences.append(float(np.abs(about - own).max()))
    return max(differences)


def _claims(hip: ObliqueHip, carried: Mapping[Joining, Work]) -> list[Claim]:
    claims = [
        Claim(
            f"Turned by -90 to 90 deg about each of its axes, the {joining.value} law in Exudyn "
            "has about this axis the torque of the axis's own law",
            off_the_axis_laws(hip, joining),
            "N m",
            at_most=TORQUE_BOUND,
        )
        for joining in Joining
    ]
    for joining in Joining:
        work = float(carried[joining].work[-1])
        claims.append(
            Claim(
                f"The {joining.value} law does no work on a leg that is carried round a closed "
                "loop of orientations",
                work,
                "J",
                at_least=-WORK_BOUND,
                at_most=WORK_BOUND,
                remark=""
                if joining is Joining.CONSERVATIVE
                else "it is no gradient: going round one way it feeds energy, the other way it "
                "takes it",
            )
        )
    return claims


def _draw(
    turned: Mapping[Joining, Oblique],
    as_printed: Oblique,
    carried: Mapping[Joining, Work],
    references: tuple[str, ...],
) -> Figure:
    with styled():
        figure = blank(7.0)
        panels = figure.subplot_mosaic(
            [["along", "loop"], ["across", "work"], ["difference", "work"]],
            height_ratios=(1.2, 1.2, 0.9),
        )
        for name in ("along", "across"):
            _draw_torques(panels[name], turned, as_printed, name)
        _draw_difference(panels["difference"], turned)
        for name in ("along", "across", "difference"):
            panels[name].set_xticks(range(0, 91, 15))
            panels[name].tick_params(labelbottom=name == "difference")
            zero_line(panels[name])
        panels["difference"].set_xlabel("axis of the turn [deg]: 0 abduction, 90 flexion")
        panels["along"].set_title("turned by 60 deg", loc="left")
        panels["along"].legend(loc="lower right")
        _draw_loop(panels["loop"])
        _draw_work(panels["work"], carried)
        write_foot(figure, _SIGN, references)
    return figure


def _draw_torques(
    axes: Axes, turned: Mapping[Joining, Oblique], as_printed: Oblique, name: str
) -> None:
    at = np.degrees(_DIRECTIONS)
    axes.plot(
        at,
        getattr(as_printed, name),
        color=THESIS.colour,
        lw=0.9,
        label="thesis, eq. 4.4 as printed",
    )
    for joining, pen in _PENS.items():
        axes.plot(
            at,
            getattr(turned[joining], name),
            pen.dash,
            marker=pen.mark,
            markevery=3,
            ms=4.0,
            mfc="white",
            color=pen.colour,
            label=f"{joining.value}, Exudyn",
        )
    axes.set_ylabel(f"torque {name} [N m]")


def _draw_difference(axes: Axes, turned: Mapping[Joining, Oblique]) -> None:
    at = np.degrees(_DIRECTIONS)
    weighted, conservative = turned[Joining.WEIGHTED], turned[Joining.CONSERVATIVE]
    along = weighted.along - conservative.along
    across = weighted.across - conservative.across
    axes.plot(at, along, "-", color=GREY, label="along")
    axes.plot(at, across, "--", color=GREY, label="across")
    axes.set_ylabel("weighted -\nconservative [N m]")
    axes.set_ylim(-65.0, 110.0)
    axes.legend(loc="upper left", ncols=2)


def _draw_loop(axes: Axes) -> None:
    corners = np.degrees(np.array(LOOP))
    for number, (start, end) in enumerate(pairwise(corners), start=1):
        axes.annotate("", end, start, arrowprops={"arrowstyle": "-|>", "lw": 1.4})
        axes.annotate(
            str(number),
            0.5 * (start + end),
            ha="center",
            va="center",
            fontsize=8.0,
            bbox={"boxstyle": "circle", "fc": "white", "ec": GREY},
        )
    axes.set_xlim(-10.0, 70.0)
    axes.set_ylim(-10.0, 70.0)
    axes.set_aspect("equal")
    axes.set_xticks(range(0, 61, 20))
    axes.set_yticks(range(0, 61, 20))
    axes.set_xlabel("abduction [deg]")
    axes.set_ylabel("flexion [deg]")
    axes.set_title("the loop of rotation vectors", loc="left")


def _draw_work(axes: Axes, carried: Mapping[Joining, Work]) -> None:
    for joining, pen in _PENS.items():
        way, work = np.degrees(carried[joining].way), carried[joining].work
        axes.plot(
            way,
            work,
            pen.dash,
            marker=pen.mark,
            ms=3.5,
            mfc="white",
            color=pen.colour,
            label=f"{joining.value}, Exudyn:\n{_in_all(float(work[-1]))}",
        )
    for number, end in enumerate(np.degrees(TURN) * np.arange(1, len(LOOP)), start=1):
        axes.axvline(end, color=GREY, lw=0.8)
        place = (end - 0.5 * np.degrees(TURN), 0.02)
        axes.annotate(str(number), place, xycoords=("data", "axes fraction"), ha="center")
    zero_line(axes)
    axes.set_xticks(range(0, 241, 60))
    axes.set_xlabel("way round the loop [deg]")
    axes.set_ylabel("work on the leg [J]")
    axes.legend(loc="upper left")


def _in_all(work: float) -> str:
    return f"{work:+.2f} J in all" if abs(work) > WORK_BOUND else "none in all"


def _tables(
    turned: Mapping[Joining, Oblique], as_printed: Oblique, carried: Mapping[Joining, Work]
) -> dict[str, dict[str, Array]]:
    oblique = {"axis from abduction to flexion [deg]": np.degrees(_DIRECTIONS)}
    oblique |= {"eq. 4.4 along [N m]": as_printed.along, "eq. 4.4 across [N m]": as_printed.across}
    loop = {"way [deg]": np.degrees(carried[Joining.CONSERVATIVE].way)}
    for joining in Joining:
        oblique[f"{joining.value} along [N m]"] = turned[joining].along
        oblique[f"{joining.value} across [N m]"] = turned[joining].across
        loop[f"work, {joining.value} [J]"] = carried[joining].work
    return {"oblique": oblique, "loop": loop}
