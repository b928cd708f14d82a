"""The passive curves of a figure as a table for any program (`.csv`).

A row is an angle of a joint about one axis; rows of one curve follow one another, and the first has
its reference. The titles, with units, are the first line, so that spreadsheets and
`pandas.read_csv` read it as it is. Columns of sliding joints exist only if a sliding joint has
springs.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from math import ceil, degrees, floor, isfinite, radians
from pathlib import Path

import numpy as np

from generator.diagnostics import InputError, error
from generator.figure import Figure, Joint
from generator.identifiers import coordinate_names, plain_names, renaming_loss
from generator.joint_chain import Chain, build_chain
from generator.losses import Effect, Losses
from generator.model_files.fit_error import format_size
from generator.model_files.model_files import ModelFiles
from generator.passive_curve import PassiveCurve, axis_springs, initial_angles, passive_curve
from generator.rotations import Array
from generator.springs_file.axes import parallel_sign
from generator.text_io import format_csv_rows
from generator.units import ROTATION_UNITS, TRANSLATION_UNITS
from springs import AxisSpring, JointSprings, SphericalLaw, SpringSet, total_torque
from springs.elastic import Elastic, Range, common_valid_range, total_friction

DECIMALS = 6
"""Decimals of an angle [deg] or a position [m]; the moment of a row is that at these values."""

ROTATION_VECTOR = "rotation vector"
"""Coordinate of joints with several rotations: the angle is a component of the rotation vector."""

_SLOPE_STEP = 1e-6
"""Half of the difference of the angles from which the stiffness is taken [rad or m]."""

FAST = 1e3
"""Rate at which all friction is fully developed [rad/s or m/s]."""

_ANGLE_ROUNDING = 1e-7
"""Rounding of an angle in the file [rad]; rows at the ends of a measured range lie within it."""

_SLIDE_STEP = 1e-3
"""Distance of the rows of a sliding joint [m], whose range has at most `_MAX_SLIDE_ROWS` steps."""

_MAX_SLIDE_ROWS = 1000

_SLIDE_RANGE = 0.1
"""Distance on both sides of zero that the rows of a sliding joint cover at least [m]."""

_TITLES = (
    *("joint", "coordinate", "motion", "axis x", "axis y", "axis z"),
    *("angle [deg]", "angle [rad]", "moment [N m]", "stiffness [N m/rad]", "damping [N m s/rad]"),
    *("friction [N m]", "measured", "held angles", "reference"),
)
_SLIDE_TITLES = ("position [m]", "force [N]", "stiffness [N/m]", "damping [N s/m]", "friction [N]")


@dataclass(frozen=True)
class _Curve:
    """The rows of a joint about or along one axis.

    Attributes:
        joint: its plain name.
        coordinate: the displacement that the angle is, or `ROTATION_VECTOR`.
        spring: spring about the axis; positive angles are about its direction.
        slides: True along the axis, False about it.
        laws: laws whose torques add.
        angles: angles of the rows, as the file has them, shape (n,) [rad or m].
        held_angles: angles of other joints on which the curve depends, by name [rad].
        references: references of the laws.
    """

    joint: str
    coordinate: str
    spring: AxisSpring
    slides: bool
    laws: tuple[Elastic, ...]
    angles: Array
    held_angles: Mapping[str, float]
    references: tuple[str, ...]

    def torque(self, angles: Array) -> Array:
        """Torque on the child [N m or N], shape (n,)."""
        return np.asarray(total_torque(self.laws, angles)) + np.zeros_like(angles)

    @property
    def stiffness(self) -> Array:
        """Minus the slope of the torque, at a breakpoint the mean of both sides, shape (n,)."""
        above, below = (self.torque(self.angles + step) for step in (_SLOPE_STEP, -_SLOPE_STEP))
        return (below - above) / (2.0 * _SLOPE_STEP)

    @property
    def friction(self) -> Array:
        """Torque against a motion apart from viscous damping [N m or N], shape (n,)."""
        own = total_friction(self.spring.elastic, self.angles, FAST)
        friction = np.zeros_like(self.angles) if own is None else -np.asarray(own)
        return self.spring.damping.coulomb + friction

    @property
    def interpolation_error(self) -> float:
        """Largest error of straight lines between the rows, half-way between two [N m or N]."""
        torques = self.torque(self.angles)
        middle = self.torque(0.5 * (self.angles[:-1] + self.angles[1:]))
        return float(np.abs(middle - 0.5 * (torques[:-1] + torques[1:])).max(initial=0.0))


def format_files(figure: Figure, springs: SpringSet, path: Path) -> ModelFiles:
    """Format the passive curves of a figure as the table at `path`.

    Raises InputError for a figure without springs.
    """
    text, losses = format_curves(figure, springs)
    return ModelFiles(path, {path: text}, losses)


def format_curves(figure: Figure, springs: SpringSet) -> tuple[str, Losses]:
    """The table of the passive curves, and its losses; raises InputError as `format_files`."""
    curves = list(_curves(figure, springs))
    if not curves:
        message = "the figure has no springs and therefore no passive curves"
        raise InputError([error(message, hint="name springs with --springs")])
    has_slides = any(curve.slides for curve in curves)
    place = _TITLES.index("measured")
    titles = (*_TITLES[:place], *(_SLIDE_TITLES if has_slides else ()), *_TITLES[place:])
    rows = (row for curve in curves for row in _rows(curve, has_slides))
    return format_csv_rows([titles, *rows]), _losses(figure, springs, curves)


def has_curves(springs: SpringSet) -> bool:
    """Return whether there are springs of which a table can be written."""
    return bool(springs.coupled) or any(
        axis.elastic or axis.damping.viscous or axis.damping.coulomb
        for joint in springs.joints.values()
        for axis in (*joint.axes, *joint.translations)
    )


def with_curves(files: ModelFiles, figure: Figure, springs: SpringSet) -> ModelFiles:
    """Add the table of a figure's springs, `arm_springs.csv` beside `arm.urdf`, if it has any."""
    if not has_curves(springs):
        return files
    table = files.path.with_name(f"{files.path.stem}_springs.csv")
    contents = {table: format_curves(figure, springs)[0], **files.contents}
    return replace(files, contents=contents)


def _curves(figure: Figure, springs: SpringSet) -> Iterator[_Curve]:
    """Yield the curves of all joints, about axes and then along them."""
    joints, at = plain_names(figure.joints), initial_angles(figure)
    coordinates = coordinate_names({name: one.chain for name, one in figure.joints.items()})
    for name, joint in figure.joints.items():
        plain, chain = joints[name], build_chain(joint.chain)
        own = springs.joints.get(name, JointSprings(name))
        found = list(axis_springs(springs, name))
        found += [each for each in own.axes if each not in found and _has_damping(each)]
        for spring in found:
            sense, coordinate = spring, ROTATION_VECTOR
            has_coordinates = springs.law is SphericalLaw.COORDINATES and own.reach is None
            if len(chain.rotations) == 1 or has_coordinates:
                k = max(
                    chain.rotations,
                    key=lambda k: abs(np.dot(chain.joint_axes[k].axis, spring.direction)),
                )
                sense, coordinate = _in_sense_of(spring, chain, k), coordinates[name][k]
            curve = passive_curve(figure, springs, name, sense, at)
            angles, others = _rotation_angles(curve), curve.held_angles
            yield _Curve(
                plain, coordinate, sense, False, curve.laws, angles, others, curve.references
            )
        for spring in own.translations:
            if not spring.elastic and not _has_damping(spring):
                continue
            index = chain.translation_along(spring.direction)
            sense, coordinate = _in_sense_of(spring, chain, index), coordinates[name][index]
            positions = _slide_positions(joint, index, sense.elastic)
            references = (spring.reference,) if spring.reference else ()
            yield _Curve(plain, coordinate, sense, True, sense.elastic, positions, {}, references)


def _has_damping(spring: AxisSpring) -> bool:
    return bool(spring.damping.viscous or spring.damping.coulomb)


def _in_sense_of(spring: AxisSpring, chain: Chain, index: int) -> AxisSpring:
    """Return the spring in the sense of a factor of the chain, whose displacement is the angle."""
    if parallel_sign(spring.direction, chain.joint_axes[index].axis) >= 0:
        return spring
    motion = spring.motion and f"opposite of {spring.motion}"
    return replace(spring.with_opposite_axis(), motion=motion)


def _rotation_angles(curve: PassiveCurve) -> Array:
    """Whole degrees that cover a curve, its breakpoints and the ends of its valid range [rad]."""
    low, high = degrees(curve.angles[0]), degrees(curve.angles[-1])
    first, last = max(floor(low), -180), min(ceil(high), 180)
    special = [degrees(angle) for angle in _special_points(curve.laws)]
    angles = [*map(float, range(first, last + 1)), *(a for a in special if first < a < last)]
    return np.array([radians(angle) for angle in _rounded(angles)])


def _slide_positions(joint: Joint, index: int, laws: tuple[Elastic, ...]) -> Array:
    """Whole steps that cover the limits and the breakpoints of a slide [m]."""
    special = _special_points(laws)
    ends = [-_SLIDE_RANGE, _SLIDE_RANGE, *special]
    for limits in (joint.lower_limit, joint.upper_limit):
        ends += [] if limits is None or not isfinite(limits[index]) else [limits[index]]
    step = _SLIDE_STEP
    while max(ends) - min(ends) > _MAX_SLIDE_ROWS * step:
        step *= 10.0
    whole = range(floor(min(ends) / step), ceil(max(ends) / step) + 1)
    return np.array(_rounded([*(step * k for k in whole), *special]))


def _rounded(values: list[float]) -> list[float]:
    """Return the values as the file has them, increasing, each once."""
    return sorted({round(value, DECIMALS) + 0.0 for value in values})


def _special_points(laws: tuple[Elastic, ...]) -> list[float]:
    """Breakpoints and finite ends of the valid range [rad or m]."""
    points = [point for law in laws for point in law.breakpoints]
    points += common_valid_range(laws) or ()
    return [point for point in points if isfinite(point)]


def _rows(curve: _Curve, has_slides: bool) -> Iterator[list[str]]:
    """Yield the cells of the rows of a curve."""
    limits = common_valid_range(curve.laws)
    damping = f"{curve.spring.damping.viscous:.9g}"
    head = [curve.joint, curve.coordinate, curve.spring.motion]
    head += [f"{part + 0.0:.9g}" for part in curve.spring.direction]
    others = "; ".join(
        f"{name} {degrees(angle):.6g} deg" for name, angle in curve.held_angles.items()
    )
    source = "; ".join(curve.references)
    values = zip(
        curve.angles.tolist(),
        curve.torque(curve.angles).tolist(),
        curve.stiffness.tolist(),
        curve.friction.tolist(),
        strict=True,
    )
    for angle, torque, stiffness, friction in values:
        resistance = [f"{torque + 0.0:.9g}", f"{stiffness:.6g}", damping, f"{friction + 0.0:.9g}"]
        turn = [f"{round(degrees(angle), DECIMALS) + 0.0:.10g}", f"{angle:.10g}", *resistance]
        if not has_slides:
            cells = turn
        elif curve.slides:
            position = f"{round(angle, DECIMALS) + 0.0:.10g}"
            cells = [*([""] * len(turn)), position, *resistance]
        else:
            cells = [*turn, *([""] * len(_SLIDE_TITLES))]
        yield [*head, *cells, _is_measured(angle, limits), others, source]
        source = ""


def _is_measured(angle: float, limits: Range | None) -> str:
    if limits is None:
        return "unknown"
    low, high = limits
    return "yes" if low - _ANGLE_ROUNDING <= angle <= high + _ANGLE_ROUNDING else "no"


def _losses(figure: Figure, springs: SpringSet, curves: list[_Curve]) -> Losses:
    """Return what the table does not hold."""
    losses = Losses("passive curves")
    losses.add("everything but the springs, damping and friction of joints")
    losses.add_loss(renaming_loss(plain_names(figure.joints)))
    several = dict.fromkeys(curve.joint for curve in curves if curve.coordinate == ROTATION_VECTOR)
    if several:
        losses.add(
            f"the law that joins the axes of several rotations ({springs.law.value}): "
            "each curve is for rotations about its axis alone",
            *several,
        )
    coupled = dict.fromkeys(curve.joint for curve in curves if curve.held_angles)
    if coupled:
        losses.add("laws over several joints, except with the held angles in the table", *coupled)
    largest = max(curves, key=lambda curve: curve.interpolation_error)
    if (size := largest.interpolation_error) >= 1e-6:
        effort = (TRANSLATION_UNITS if largest.slides else ROTATION_UNITS).effort
        losses.add(
            f"straight lines between the rows, which err by {format_size(size)} {effort} at most",
            largest.joint,
            effect=Effect.APPROXIMATION,
        )
    if any(curve.friction.any() for curve in curves):
        losses.add("the rate at which friction sets in", effect=Effect.APPROXIMATION)
    return losses
