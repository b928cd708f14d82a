"""Passive moments along a measured motion: a band over laws and over the zero of each angle.

The share of positive work that is passive depends on the law, and on the angle that its source
calls zero, by a factor of two for 10 deg at the hip. So it is a range, and samples beyond the
angles that were measured do not count.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property, partial
from math import radians
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from generator.diagnostics import MoverError, UsageError
from generator.input_files.coordinates import Coordinates
from generator.inverse.legs import MOTIONS, Leg
from generator.inverse.moments import JointMoments
from generator.joint_chain import build_chain
from generator.model import Model
from generator.motion_files import FigureMotion
from generator.passive_curve import angle_about
from generator.rotations import Array
from generator.text_io import csv_lines
from springs import SpringSet
from springs.elastic import Range, common_valid_range
from springs.published.parse import PublishedError
from springs.published.tables import coupled_law, curve

DEFAULT_LAWS = ("riener_edrich_1999/leg", "silder_2007/leg_curves")
"""Laws of the leg; not `silder_2007/leg`, whose source gives means of parameters."""

MEAN_PARAMETERS = ("silder_2007/leg",)
"""Laws of parameters that are means of subjects, which is not the mean of their moments."""

ZERO_WITH_NEUTRAL, ZERO_WITHOUT = radians(5.0), radians(10.0)
"""Uncertainty of the zero of an angle with a static trial, and without one [rad]."""

VERTICAL_FORCE = "vertical force [N]"
"""Title of the column of a body's measured force, after its name."""

MIN_KNOWN_WORK, MIN_VARIANTS = 0.5, 0.5
"""Least part of the net positive work at known angles of a variant that counts in a share, and of
the variants of a law that count, so that its share is a range."""

Bools = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class PassiveTorque:
    """Passive moment of a coordinate along a motion.

    Attributes:
        torques: Moments on the child, shape (n,) [N m].
        is_known: Whether all angles that it depends on are within the range of the law, shape (n,).
    """

    torques: Array
    is_known: Bools


@dataclass(frozen=True)
class LegLaw:
    """A published law of angles of the leg, on both legs of a motion.

    Attributes:
        name: Key of the law in the published tables.
        legs: Legs by side.
        moments: Coordinates along the motion.
        zeros: Value of each coordinate where its angle is zero [rad]; 0 by default.
        hip_zero: Hip flexion in the law's coordinate there [rad].
    """

    name: str
    legs: Mapping[str, Leg]
    moments: JointMoments
    zeros: Mapping[str, float]
    hip_zero: float = 0.0

    @property
    def groups(self) -> Sequence[tuple[str, ...]]:
        """Coordinates whose zeros move together: the hips, the knees and the ankles of the law."""
        return [
            tuple(leg[motion].coordinate for leg in self.legs.values())
            for motion in published_law(self.name)[0]
        ]  # fmt: skip

    def torques(self, shifts: Mapping[str, float]) -> dict[str, PassiveTorque]:
        """Return the moments of both legs by coordinate, with the zeros of angles moved [rad]."""
        motions, ranges, evaluate = published_law(self.name)
        found: dict[str, PassiveTorque] = {}
        for leg in self.legs.values():
            angles = [self._angle(motion, leg, shifts) for motion in motions]
            count = len(self.moments.times)
            known = np.ones(count, dtype=bool)
            for angle, ends in zip(angles, ranges, strict=True):
                known &= (angle >= ends[0]) & (angle <= ends[1])
            for motion, torque in zip(motions, evaluate(angles), strict=True):
                at = leg[motion]
                moment = at.sign * np.asarray(torque) + np.zeros(count)
                found[at.coordinate] = PassiveTorque(moment, known)
        return found

    def _angle(self, motion: str, leg: Leg, shifts: Mapping[str, float]) -> Array:
        """Angle of the law in its own sense [rad], shape (n,)."""
        at = leg[motion]
        values = self.moments.coordinates[at.coordinate].values
        angle = at.sign * (values - self.zeros.get(at.coordinate, 0.0))
        own = self.hip_zero if motion == "hip flexion" else 0.0
        return angle + own + shifts.get(at.coordinate, 0.0)


Evaluate: TypeAlias = Callable[[Sequence[Array]], Sequence[Array]]
"""Returns the moment about each angle of a law [N m], at its angles [rad]."""


def published_law(name: str) -> tuple[tuple[str, ...], list[Range], Evaluate]:
    """Return the angles of a published law, the ranges in which it is known, and its moments.

    Raises UsageError for an unknown law, and for one whose range is not known.
    """
    evaluate: Evaluate
    try:
        law = coupled_law(name).law
        motions, ranges, evaluate = law.coordinates, law.valid_ranges, law.torques
    except PublishedError as failure:
        try:
            row = curve(name)
        except PublishedError:
            raise UsageError(f"--springs {name}: {failure}") from None
        torque = row.law.torque

        def of_one(angles: Sequence[Array]) -> Sequence[Array]:
            return [np.asarray(torque(angles[0]))]

        motions, ranges, evaluate = (row.motion,), (row.valid_range,), of_one

    strange = [motion for motion in motions if motion not in MOTIONS.values()]
    if strange:
        raise UsageError(
            f"--springs {name}: this law is of {', '.join(strange)}; known are angles of the leg, "
            f"{', '.join(MOTIONS.values())}"
        )
    known = [ends for ends in ranges if ends is not None]
    if len(known) < len(ranges):
        raise UsageError(
            f"--springs {name}: the range in which this law was measured is not known, so that no "
            "share can be told"
        )
    return motions, known, evaluate


@dataclass(frozen=True)
class SpringsLaw:
    """The springs of a figure along a motion, without damping and friction.

    Attributes:
        name: Origin of the springs.
        motion: Motion of the figure.
        springs: Springs of its joints.
        moments: Coordinates along the motion.
        places: Displacements of the figure by coordinate.
        zeros: Value of each coordinate where its angle is zero [rad]; 0 by default.
    """

    name: str
    motion: FigureMotion
    springs: SpringSet
    moments: JointMoments
    places: Coordinates
    zeros: Mapping[str, float] = field(default_factory=dict[str, float])

    @property
    def groups(self) -> Sequence[tuple[str, ...]]:
        """The coordinates of joints with elastic laws, each by itself."""
        return [(name,) for name in self._elastic]

    @property
    def _elastic(self) -> list[str]:
        joints = {name for name, one in self.springs.joints.items() if one.is_elastic}
        joints |= {axis.joint for one in self.springs.coupled for axis in one.axes}
        coordinates = self.moments.coordinates
        return [
            name
            for name, at in self.places.items()
            if at.joint in joints and coordinates[name].is_angle
        ]

    def torques(self, shifts: Mapping[str, float]) -> dict[str, PassiveTorque]:
        """Return the moments of all elastic joints, with the zeros of angles moved [rad]."""
        kinematics = self.motion.tree.kinematics
        columns = {
            name: kinematics.columns[at.joint].start + at.index for name, at in self.places.items()
        }
        values = np.zeros((len(self.moments.times), kinematics.size))
        for name, at in self.places.items():
            zero = self.zeros.get(name, at.offset) - shifts.get(name, 0.0)
            values[:, columns[name]] = (self.moments.coordinates[name].values - zero) / at.scale
        loaded, bare = (forces(values) for forces in self._static_forces)
        forces, known = loaded - bare, self._known(values)
        return {
            name: PassiveTorque(
                forces[:, columns[name]] / self.places[name].scale, known[self.places[name].joint]
            )
            for name in self._elastic
        }

    @cached_property
    def _static_forces(self) -> tuple[Callable[[Array], Array], ...]:
        """Forces on displacements of the figure with its springs and without, without gravity."""
        # Imported here, since Exudyn takes a second and published laws do not need it.
        from generator.simulation.plan import Plan
        from generator.simulation.run_model import prepare_run
        from generator.simulation.statics.static_forces import StaticState

        figure, plan = self.motion.tree.figure, Plan(gravity=(0.0, 0.0, 0.0))
        springs = (self.springs.of_joints(figure.joints), SpringSet())
        models = [prepare_run(Model(figure, some), plan) for some in springs]

        def forces(model: int, values: Array) -> Array:
            return StaticState.from_displacements(models[model], values).forces()

        return partial(forces, 0), partial(forces, 1)

    def _known(self, values: Array) -> dict[str, Bools]:
        """Return whether the laws of each joint are known to hold, shape (n,)."""
        tree, law = self.motion.tree, self.springs.law
        known: dict[str, Bools] = {}

        def check(joints: Iterable[str], joint: str, axis: Array, ends: Range | None) -> None:
            chain = build_chain(tree.figure.joints[joint].chain)
            at = values[:, tree.kinematics.columns[joint]]
            x, y, z = axis
            angle = angle_about(chain, law, (x, y, z), at)
            inside = np.zeros(len(values), dtype=bool)
            if ends is not None:
                inside = (angle >= ends[0]) & (angle <= ends[1])
            for name in joints:
                known[name] = known.get(name, np.ones(len(values), dtype=bool)) & inside

        for joint, one in self.springs.joints.items():
            for spring in one.axes:
                if spring.elastic:
                    ends = common_valid_range(spring.elastic)
                    check([joint], joint, np.array(spring.direction), ends)
        for coupled in self.springs.coupled:
            joints = [axis.joint for axis in coupled.axes]
            for axis, ends in zip(coupled.axes, coupled.law.valid_ranges, strict=True):
                check(joints, axis.joint, np.array(axis.direction), ends)
        nowhere = np.zeros(len(values), dtype=bool)
        return {name: known.get(name, nowhere) for name in tree.figure.joints}


PassiveLaw: TypeAlias = LegLaw | SpringsLaw
"""Passive moments of some coordinates as functions of their angles."""


@dataclass(frozen=True, eq=False)
class PassiveBand:
    """Passive moment of a coordinate over laws and zeros.

    Attributes:
        lower, upper: Smallest and largest moment of variants that are known there, nan where none
            is, shape (n,) [N m].
        known: Share of the variants that are known, shape (n,).
        shares: Positive passive work over the net one for each variant, by law, where at least
            `MIN_KNOWN_WORK` of the net work is at known angles; none where fewer than
            `MIN_VARIANTS` of them are.
        known_works: Part of the net positive work at known angles of each variant, by law.
    """

    lower: Array
    upper: Array
    known: Array
    shares: Mapping[str, Sequence[float]]
    known_works: Mapping[str, Sequence[float]]

    @property
    def share_range(self) -> Range | None:
        """Smallest and largest share; None where no law is known."""
        every = [share for shares in self.shares.values() for share in shares]
        return (min(every), max(every)) if every else None

    @property
    def known_range(self) -> Range:
        """Smallest and largest part of the net positive work that a variant is known for."""
        every = [part for parts in self.known_works.values() for part in parts]
        return min(every), max(every)


def passive_bands(
    moments: JointMoments, laws: Sequence[PassiveLaw], uncertainty: float
) -> dict[str, PassiveBand]:
    """Return the bands of all coordinates that a law has moments of.

    Args:
        moments: Net moments along the motion.
        laws: Laws, at least one.
        uncertainty: Uncertainty of the zero of each angle [rad].
    """
    variants: dict[str, dict[str, list[PassiveTorque]]] = {}
    for law in laws:
        shifts: list[dict[str, float]] = [{}]
        for group in law.groups:
            shifts += [dict.fromkeys(group, sign * uncertainty) for sign in (-1.0, 1.0)]
        for shift in shifts:
            for name, torque in law.torques(shift).items():
                variants.setdefault(name, {}).setdefault(law.name, []).append(torque)
    return {name: _band(moments, name, by_law) for name, by_law in variants.items()}


def _band(
    moments: JointMoments, name: str, by_law: Mapping[str, Sequence[PassiveTorque]]
) -> PassiveBand:
    one = moments.coordinates[name]
    every = [torque for torques in by_law.values() for torque in torques]
    known = np.array([torque.is_known for torque in every])
    stacked = np.where(known, np.array([torque.torques for torque in every]), np.nan)
    nowhere = ~known.any(axis=0)
    lower, upper = (
        np.where(nowhere, np.nan, end(np.where(known, stacked, fill), axis=0))
        for end, fill in ((np.min, np.inf), (np.max, -np.inf))
    )
    whole = moments.works(one.powers).positive
    shares: dict[str, list[float]] = {}
    parts: dict[str, list[float]] = {}
    for law, torques in by_law.items():
        shares[law], parts[law] = [], []
        for torque in torques:
            net = moments.works(one.powers, torque.is_known).positive
            passive = moments.works(torque.torques * one.rates, torque.is_known).positive
            parts[law].append(net / whole if whole > 0.0 else 0.0)
            if whole > 0.0 and net >= MIN_KNOWN_WORK * whole:
                shares[law].append(passive / net)
        if len(shares[law]) < max(2.0, MIN_VARIANTS * len(torques)):
            shares[law] = []
    return PassiveBand(lower, upper, known.mean(axis=0), shares, parts)


def require_legs(legs: Mapping[str, Leg], figure: str) -> None:
    """Raise MoverError for a figure without legs, to which published laws could belong."""
    if not legs:
        raise MoverError(
            f"{figure}: no hip, knee and ankle were found by their names, such as `hip_r`, "
            "`knee_r`, `ankle_r` or `left_hip`, so that published laws belong to no joint; "
            "--springs FILE takes the springs of any joints"
        )


def format_bands(
    moments: JointMoments,
    bands: Mapping[str, PassiveBand],
    vertical_forces: Mapping[str, Array] | None = None,
) -> Iterator[str]:
    """Yield the lines of a table: net and passive moments and powers at each time.

    `known` is the share of laws and zeros that were measured at the angles of the sample.

    Args:
        moments: Moments along a motion.
        bands: Passive moments by coordinate.
        vertical_forces: Measured forces upwards by body, shape (n,) [N].
    """
    titles = ["time [s]", "sure"]
    columns: list[Sequence[object]] = [
        moments.times.tolist(),
        ["yes" if sure else "no" for sure in moments.is_sure],
    ]
    for name, band in bands.items():
        one = moments.coordinates[name]
        lower, upper = (end * one.rates for end in (band.lower, band.upper))
        parts = {
            "net [N m]": one.forces,
            "passive lower [N m]": band.lower,
            "passive upper [N m]": band.upper,
            "net power [W]": one.powers,
            "passive power lower [W]": np.minimum(lower, upper),
            "passive power upper [W]": np.maximum(lower, upper),
            "known": band.known,
        }
        for title, values in parts.items():
            titles.append(f"{name} {title}")
            columns.append(["" if np.isnan(value) else value for value in values.tolist()])
    for body, values in (vertical_forces or {}).items():
        titles.append(f"{body} {VERTICAL_FORCE}")
        columns.append(values.tolist())
    return csv_lines([titles, *zip(*columns, strict=True)])
