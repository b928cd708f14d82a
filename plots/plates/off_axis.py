"""The hip rotated about axes between its own: two readings of the thesis's eq. 4.4 compared."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from generator import Plan, read_figure, static_torques
from generator.rotations import RotationSequence, cross_matrix, matrix_from_rotation_vector
from generator.springs_file.read import read_springs
from plots.canvas import GREY, LINE_STYLES, THESIS_STYLE, create_canvas, draw_line, draw_zero_line
from plots.literature import thesis_reference
from plots.plate import Claim
from plots.plate_definition import PlateDefinition
from springs import AxisSpring, Cubic, SphericalLaw, SpringSet, total_torque
from springs.backends import Array
from springs.coupled import gauss_nodes
from springs.cubic import polynomial
from springs.elastic import describe_extrapolation
from springs.published import tables as published

HIP_JOINT = "left_hip_joint"

_GAUSS_NODES = 4
"""Gauss-Legendre nodes on a piece of a loop: exact up to degree 7."""

_MIN_PIECES_PER_SIDE = 6
"""Smallest number of pieces of a side of a loop."""


@dataclass(frozen=True)
class ObliqueTorques:
    """Torques on the leg for rotations by one angle about several axes, shape (n,) each [N m].

    Attributes:
        along: component along the axis of rotation.
        across: component across it, in the half-way frame, towards flexion.
    """

    along: Array
    across: Array


class ObliqueHip:
    """The left hip; rotation vectors are components of abduction and flexion."""

    def __init__(self) -> None:
        """Load the figure and the springs of the hip."""
        self._body = read_figure("prototype")
        self._springs = read_springs(None, self._body).joints[HIP_JOINT]
        self._sequence = RotationSequence(
            tuple(factor.axis for factor in self._body.joints[HIP_JOINT].chain)
        )
        self._plane = np.array([self.spring_about(m).direction for m in ("abduction", "flexion")])

    @property
    def axes(self) -> tuple[AxisSpring, ...]:
        """The springs about the joint's axes."""
        return self._springs.axes

    def spring_about(self, motion: str) -> AxisSpring:
        """The spring about one axis: `abduction`, `flexion` or `medial rotation`."""
        return next(spring for spring in self.axes if spring.motion == motion)

    def torques(self, rotation_vectors: Array, law: SphericalLaw) -> Array:
        """Torque on the leg [N m] at rotation vectors [rad] in axes of the pelvis, (n, 3) each."""
        matrices = matrix_from_rotation_vector(rotation_vectors)
        poses = [{HIP_JOINT: self._sequence.angles(matrix)} for matrix in matrices]
        plan = Plan(springs=SpringSet({HIP_JOINT: self._springs}, law))
        return static_torques(self._body, poses, plan)[HIP_JOINT]

    def oblique_torques(self, angle: float, directions: Array, law: SphericalLaw) -> ObliqueTorques:
        """Torques at an angle [rad] about axes at `directions` from abduction to flexion [rad]."""
        axes = np.stack([np.cos(directions), np.sin(directions)], axis=1) @ self._plane
        across = np.stack([-np.sin(directions), np.cos(directions)], axis=1) @ self._plane
        half = matrix_from_rotation_vector(0.5 * angle * axes)
        torques = np.einsum("nji,nj->ni", half, self.torques(angle * axes, law))
        return ObliqueTorques(np.sum(torques * axes, axis=1), np.sum(torques * across, axis=1))

    def work_along_path(
        self, vertices: Sequence[tuple[float, float]], law: SphericalLaw
    ) -> tuple[Array, Array]:
        """Return the length of a path of straight sides between vertices [rad], and the work [J].

        Both are since the start, shape (n,): lengths in the space of rotation vectors, work on the
        leg.

        The torque is read at Gauss-Legendre nodes on pieces of the sides, which end at the
        breakpoints of the laws, and multiplied by the rotation of the leg.
        """
        vectors: list[Array] = []
        steps: list[Array] = []
        path = [0.0]
        for start, end in pairwise(np.array(vertices)):
            for low, high in pairwise(self._piece_ends(start, end)):
                share, lengths = gauss_nodes((low, high), _GAUSS_NODES)
                vectors.append((start + share[:, None] * (end - start)) @ self._plane)
                steps.append(lengths[:, None] * ((end - start) @ self._plane))
                path.append(path[-1] + (high - low) * float(np.linalg.norm(end - start)))
        at = np.concatenate(vectors)
        rotations = np.einsum("nij,nj->ni", _rotation_jacobian(at), np.concatenate(steps))
        work = np.sum(self.torques(at, law) * rotations, axis=1)
        pieces = np.sum(work.reshape(-1, _GAUSS_NODES), axis=1)
        return np.array(path), np.concatenate([[0.0], np.cumsum(pieces)])

    def _piece_ends(self, start: Array, end: Array) -> list[float]:
        """Ends of the pieces of a side, from 0 to 1."""
        cuts = {k / _MIN_PIECES_PER_SIDE for k in range(_MIN_PIECES_PER_SIDE + 1)}
        for spring in self.axes:
            first, last = (float(p @ self._plane @ spring.direction) for p in (start, end))
            for angle in (angle for law in spring.elastic for angle in law.breakpoints):
                if min(first, last) < angle < max(first, last):
                    cuts.add((angle - first) / (last - first))
        return sorted(cuts)


def _rotation_jacobian(rotation_vectors: Array) -> Array:
    """Jacobian from the rate of a rotation vector r to the angular velocity, (n, 3, 3).

    1 + (1 - cos a)/a^2 [r]x + (a - sin a)/a^3 [r]x^2 with a = |r|, in the axes of the parent.
    """
    a = np.linalg.norm(rotation_vectors, axis=1)[:, None, None]
    k = cross_matrix(rotation_vectors)
    return np.eye(3) + (1.0 - np.cos(a)) / a**2 * k + (a - np.sin(a)) / a**3 * (k @ k)


ROTATION_ANGLE = np.radians(60.0)
"""Rotation of the leg about axes between abduction and flexion [rad]."""

LOOP = (
    (0.0, 0.0),
    (ROTATION_ANGLE, 0.0),
    (ROTATION_ANGLE, ROTATION_ANGLE),
    (0.0, ROTATION_ANGLE),
    (0.0, 0.0),
)
"""Vertices of a closed loop: abduction and flexion, components of the rotation vector [rad]."""

TORQUE_BOUND = 1e-6
"""Difference below which torques are equal [N m]."""

WORK_BOUND = 1e-6
"""Work below which only rounding is left [J]."""

_DIRECTIONS = np.radians(np.linspace(0.0, 90.0, 37))
_ON_AXIS_ANGLES = np.radians(np.arange(-90.0, 91.0, 15.0))
_LINE_STYLES = {SphericalLaw.CONSERVATIVE: LINE_STYLES[0], SphericalLaw.WEIGHTED: LINE_STYLES[1]}
_CAPTION = (
    "Left: the leg is rotated by 60 deg about axes from abduction (0 deg) to flexion (90 deg). All "
    "points were read out of Exudyn with the prototype at rest; the thin line is eq. 4.4 of the "
    "thesis as printed. At both ends both readings of it are the axis's own law. Between them the "
    "conservative law has less torque, because each axis depends on its own component of the "
    "rotation, not on the whole angle. Right: the leg moves round a closed loop of orientations "
    "(abducted, flexed, adducted, extended), and the torque read out of Exudyn is integrated over "
    "the rotation. The conservative law returns all energy, the weighted law does not. No "
    "measurement of a hip rotated about oblique axes is public. The thesis's curve of abduction is "
    "an estimate of its author; range of that of flexion: {known}."
)


@dataclass(frozen=True)
class ObliqueRotations:
    """Torques at `_DIRECTIONS`, read and by eq. 4.4, and work along `LOOP`, by law."""

    hip: ObliqueHip
    torques: Mapping[SphericalLaw, ObliqueTorques]
    as_printed: ObliqueTorques
    path_work: Mapping[SphericalLaw, tuple[Array, Array]]


def rotate_hip() -> ObliqueRotations:
    """Read the torques of the hip out of Exudyn."""
    hip = ObliqueHip()
    torques = {law: hip.oblique_torques(ROTATION_ANGLE, _DIRECTIONS, law) for law in _LINE_STYLES}
    work = {law: hip.work_along_path(LOOP, law) for law in _LINE_STYLES}
    return ObliqueRotations(hip, torques, printed_torques(hip), work)


def printed_torques(hip: ObliqueHip) -> ObliqueTorques:
    """Eq. 4.4 as printed, M_i = A_i M_i(a), with each cubic in its restoring sense."""
    weights, parts = (np.cos(_DIRECTIONS), np.sin(_DIRECTIONS)), list[Array]()
    for weight, motion in zip(weights, ("abduction", "flexion"), strict=True):
        (cubic,) = hip.spring_about(motion).elastic
        assert isinstance(cubic, Cubic)
        torque = cubic.sense * float(polynomial(cubic.coefficients, ROTATION_ANGLE))
        parts.append(weight * torque)
    (p, q), (x, y) = weights, parts
    return ObliqueTorques(p * x + q * y, p * y - q * x)


def max_on_axis_difference(hip: ObliqueHip, law: SphericalLaw) -> float:
    """Largest difference from the axes' own laws, for rotations about single axes [N m]."""
    differences: list[float] = []
    for spring in hip.axes:
        direction = np.array(spring.direction)
        about = hip.torques(np.outer(_ON_AXIS_ANGLES, direction), law) @ direction
        own = np.asarray(total_torque(spring.elastic, _ON_AXIS_ANGLES))
        differences.append(float(np.abs(about - own).max()))
    return max(differences)


def _claims(made: ObliqueRotations) -> Iterator[Claim]:
    for law in _LINE_STYLES:
        sentence = (
            f"Rotated by -90 to 90 deg about each of its axes, the hip with the {law.value} "
            "law in Exudyn has the torque of the axis's own law"
        )
        yield Claim(sentence, max_on_axis_difference(made.hip, law), "N m", at_most=TORQUE_BOUND)
    yield Claim(
        "The conservative law does no work round a closed loop of orientations",
        float(made.path_work[SphericalLaw.CONSERVATIVE][1][-1]),
        "J",
        at_least=-WORK_BOUND,
        at_most=WORK_BOUND,
    )
    yield Claim(
        "The weighted law is not the gradient of an energy: round the same loop it does work",
        float(made.path_work[SphericalLaw.WEIGHTED][1][-1]),
        "J",
        at_least=1.0,
        remark="the other way round it removes as much",
    )


def _draw(made: ObliqueRotations) -> Figure:
    figure = create_canvas(7.0)
    panels = figure.subplot_mosaic(
        [["along", "loop"], ["across", "work"], ["difference", "work"]],
        height_ratios=(1.2, 1.2, 0.9),
    )
    at, rest = np.degrees(_DIRECTIONS), panels["difference"]
    weighted, conservative = (
        made.torques[law] for law in (SphericalLaw.WEIGHTED, SphericalLaw.CONSERVATIVE)
    )
    for name, dash in (("along", "-"), ("across", "--")):
        printed, label = getattr(made.as_printed, name), "thesis, eq. 4.4 as printed"
        draw_line(panels[name], at, printed, THESIS_STYLE, label, lw=0.9)
        for law, pen in _LINE_STYLES.items():
            torque, label = getattr(made.torques[law], name), f"{law.value}, Exudyn"
            draw_line(panels[name], at, torque, pen, label, markevery=3, lw=1.6)
        panels[name].set_ylabel(f"torque {name} [N m]")
        less = getattr(weighted, name) - getattr(conservative, name)
        rest.plot(at, less, dash, color=GREY, label=name)
    rest.set(ylabel="weighted -\nconservative [N m]", ylim=(-65.0, 110.0))
    rest.legend(loc="upper left", ncols=2)
    for name in ("along", "across", "difference"):
        panels[name].set_xticks(range(0, 91, 15))
        panels[name].tick_params(labelbottom=name == "difference")
        draw_zero_line(panels[name])
    rest.set_xlabel("axis of rotation [deg]: 0 abduction, 90 flexion")
    panels["along"].set_title("rotated by 60 deg")
    panels["along"].legend(loc="lower right")
    _draw_loop(panels["loop"])
    _draw_work(panels["work"], made)
    return figure


def _draw_loop(axes: Axes) -> None:
    vertices = np.degrees(np.array(LOOP))
    for number, (start, end) in enumerate(pairwise(vertices), start=1):
        axes.annotate("", end, start, arrowprops={"arrowstyle": "-|>", "lw": 1.4})
        axes.annotate(
            str(number),
            0.5 * (start + end),
            ha="center",
            va="center",
            fontsize=8.0,
            bbox={"boxstyle": "circle", "fc": "white", "ec": GREY},
        )
    limits, ticks = (-10.0, 70.0), range(0, 61, 20)
    axes.set(xlim=limits, ylim=limits, aspect="equal", xticks=ticks, yticks=ticks)
    axes.set(xlabel="abduction [deg]", ylabel="flexion [deg]", title="loop of rotation vectors")


def _draw_work(axes: Axes, made: ObliqueRotations) -> None:
    for law, pen in _LINE_STYLES.items():
        path, work = made.path_work[law]
        total = f"{work[-1]:+.2f} J" if abs(work[-1]) > WORK_BOUND else "none"
        label = f"{law.value}, Exudyn:\n{total} in total"
        draw_line(axes, np.degrees(path), work, pen, label, ms=3.5, lw=1.6)
    for number, end in enumerate(np.degrees(ROTATION_ANGLE) * np.arange(1, len(LOOP)), start=1):
        axes.axvline(end, color=GREY, lw=0.8)
        place = (end - 0.5 * np.degrees(ROTATION_ANGLE), 0.02)
        axes.annotate(str(number), place, xycoords=("data", "axes fraction"), ha="center")
    draw_zero_line(axes)
    axes.set_xticks(range(0, 241, 60))
    axes.set(xlabel="path along the loop [deg]", ylabel="work on the leg [J]")
    axes.legend(loc="upper left")


def _tables(made: ObliqueRotations) -> dict[str, dict[str, Array]]:
    loop = {"way [deg]": np.degrees(made.path_work[SphericalLaw.CONSERVATIVE][0])}
    oblique = {"axis from abduction to flexion [deg]": np.degrees(_DIRECTIONS)}
    rows = {"eq. 4.4": made.as_printed, **{law.value: made.torques[law] for law in _LINE_STYLES}}
    for name, torques in rows.items():
        oblique |= {f"{name} along [N m]": torques.along, f"{name} across [N m]": torques.across}
    for law in _LINE_STYLES:
        loop[f"work, {law.value} [J]"] = made.path_work[law][1]
    return {"oblique": oblique, "loop": loop}


off_axis = PlateDefinition(
    name="off_axis",
    title="A hip rotated about oblique axes (the thesis's eq. 4.4)",
    sign="Torques act on the leg: positive along the axis in the sense of the rotation, and across "
    "it from abduction towards flexion, in the frame half-way between pelvis and leg. Work is "
    "positive if the joint drives the leg. Left hip; abduction is about x, flexion about y.",
    references=(
        thesis_reference("eq. 4.4, and appendix A, records of the left hip"),
        *(ObliqueHip().spring_about(motion).reference for motion in ("flexion", "abduction")),
    ),
    collect=rotate_hip,
    caption=_CAPTION.format(
        known=describe_extrapolation(
            published.curve("otani_1989/hip_y").valid_range, 0.0, ROTATION_ANGLE
        )
    ),
    draw=_draw,
    claims=_claims,
    tables=_tables,
)
