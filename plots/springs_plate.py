"""Plates of a user's springs: each curve with published ones of its motion and their scatter."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from math import degrees, radians

import numpy as np

from plots.canvas import (
    GREY,
    LINE_STYLES,
    PALE,
    THESIS_STYLE,
    LineStyle,
    add_footer,
    create_panels,
    draw_curve,
    draw_points,
    draw_zero_line,
    plot_style,
)
from plots.literature import Literature, published_curve
from plots.plate import Plate, plate_name
from springs import AxisSpring, SpringSet, total_torque
from springs.backends import Array
from springs.elastic import Elastic, common_valid_range
from springs.lint.report import CurveReport, report_curves
from springs.published import tables as published

_HEIGHT = 5.2
_MARGIN = radians(15.0)
"""Angle drawn beyond the range of a curve [rad]."""

_TORQUE_MARGIN = 1.4
"""Largest torque drawn, relative to the largest of the curve and of measurements."""

OTHER_STYLE = LineStyle(GREY, "--")
"""Style of the springs to which others are compared."""


@dataclass(frozen=True)
class NamedSprings:
    """Springs and the name of their file."""

    name: str
    springs: SpringSet

    def axis(self, joint: str, spring: AxisSpring) -> AxisSpring | None:
        """Return all laws about the same axis of a joint, or None.

        Laws over several joints are those with the other angles at zero.
        """
        own = self.springs.joints.get(joint)
        found = [] if own is None else list(own.axes)
        for coupled in self.springs.coupled:
            for name, axis in zip(coupled.law.coordinates, coupled.axes, strict=True):
                if axis.joint == joint:
                    law = coupled.law.single_angle_law(
                        name, dict.fromkeys(coupled.law.coordinates, 0.0)
                    )
                    found.append(AxisSpring(axis.direction, (law,)))
        laws: list[AxisSpring] = []
        for other in found:
            across = np.cross(other.direction, spring.direction)
            if np.linalg.norm(across) < 1e-6:
                if any(other.direction) != any(spring.direction):
                    return None  # the sense of one of the axes is not known
                same = float(np.dot(other.direction, spring.direction)) >= 0.0
                laws.append(other if same else other.with_opposite_axis())
        elastic = tuple(law for one in laws for law in one.elastic)
        return replace(laws[0], elastic=elastic) if laws else None

    def label(self, joint: str, spring: AxisSpring) -> str:
        """Return the name, with the angles at which laws over several joints were taken."""
        others = [
            name
            for coupled in self.springs.coupled
            if any(
                axis.joint == joint
                and np.linalg.norm(np.cross(axis.direction, spring.direction)) < 1e-6
                for axis in coupled.axes
            )
            for name, axis in zip(coupled.law.coordinates, coupled.axes, strict=True)
            if axis.joint != joint
        ]
        angles = " and ".join(dict.fromkeys(others))
        return f"{self.name}, {angles} at 0 deg" if others else self.name

    def shares_axis(self, other: "NamedSprings") -> bool:
        """Return whether both have a spring about one axis of one joint."""
        return any(
            other.axis(name, spring) is not None
            for name, joint in self.springs.joints.items()
            for spring in joint.axes
            if spring.elastic
        )


def springs_plates(own: NamedSprings, other: NamedSprings | None = None) -> Iterator[Plate]:
    """Yield a plate for each curve; left and right joints of one curve share it."""
    names: set[str] = set()
    for report in report_curves(own.springs):
        name = plate_name(f"{report.joints[0]}_{report.spring.motion}")
        while name in names:
            name += "_"
        names.add(name)
        yield _plate(name, report, own, other)


def matching_literature(joint: str, motion: str) -> list[Literature]:
    """Return published curves of a motion of a joint, one of each publication.

    Curves of measurements come first; there are at most as many as there are styles.

    Args:
        joint: name of the joint in its figure; one of its words says which it is ("left_elbow").
        motion: name of a positive angle ("flexion", "twist to the left").
    """
    found = published.curves_of_motion(joint, motion)[: len(LINE_STYLES)]
    return [published_curve(key, key.replace("/", ", ").replace("_", " ")) for key, _ in found]


def _plate(name: str, report: CurveReport, own: NamedSprings, other: NamedSprings | None) -> Plate:
    joint, spring = report.joints[0], report.spring
    literature = matching_literature(joint, spring.motion)
    drawn = own.axis(joint, spring) or spring
    compared = None if other is None else other.axis(joint, spring)
    low, high = report.lint_range
    angles = np.linspace(low - _MARGIN, high + _MARGIN, 500)
    columns = {"angle [deg]": np.degrees(angles)}
    references = [spring.reference, *(str(row.reference) for row in literature)]
    references = list(dict.fromkeys(filter(None, references)))
    with plot_style():
        figure, ((axes,),) = create_panels(_HEIGHT + 0.25 * len(references), 1)
        axes.axvspan(degrees(low), degrees(high), color=PALE, alpha=0.35, lw=0.0)
        for row, style in zip(literature, LINE_STYLES, strict=False):
            label = f"{row.label} [{references.index(str(row.reference)) + 1}]"
            if (band := row.band(angles)) is not None:
                at = np.degrees(angles)
                axes.fill_between(at, *band, color=style.colour, alpha=0.18, lw=0.0)
            if row.points is not None:
                at, torques = row.points
                draw_points(axes, np.degrees(at), torques, style, label, row.is_line)
            else:
                torques, known = row.torque(angles), row.valid_range
                draw_curve(axes, np.degrees(angles), torques, known, style, label, 1.3)
            columns[f"{row.label} [N m]"] = row.torque(angles)
        whole = (float(angles[0]), float(angles[-1]))
        for named, one, style in ((own, drawn, THESIS_STYLE), (other, compared, OTHER_STYLE)):
            if named is not None and one is not None:
                torque, label = _torques(one.elastic, angles), named.label(joint, spring)
                columns[f"{label} [N m]"] = torque
                known = common_valid_range(one.elastic) or whole
                # Matplotlib hides a label that begins with _
                draw_curve(axes, np.degrees(angles), torque, known, style, f" {label}", 2.0)
        draw_zero_line(axes)
        axes.set(
            xlim=(degrees(float(angles[0])), degrees(float(angles[-1]))),
            ylim=_torque_limits(angles, drawn, literature, (low, high)),
            xlabel=f"angle [deg], positive in {spring.motion or 'the sense of the axis'}",
            ylabel="torque on the child [N m]",
        )
        axes.xaxis.label.set_parse_math(False)
        for text in axes.legend(loc="best", fontsize=7.5).get_texts():
            text.set_parse_math(False)
        add_footer(figure, _SIGN, references)
    return Plate(
        name=name,
        title=f"{', '.join(report.joints)}: {spring.motion or 'curve'}",
        caption=_caption(report, literature),
        sign=_SIGN,
        figure=figure,
        tables={name: columns},
        references=tuple(references),
    )


_SIGN = (
    "Torques act on the child and are positive in the sense of the angle: a torque that drives "
    "back from a positive angle is negative."
)


def _caption(report: CurveReport, literature: Sequence[Literature]) -> str:
    doubts = " ".join(f"Doubt: {finding.sentence}." for finding in report.doubts)
    range_text = (
        "Shaded: the normal range of motion, or from -90 to 90 deg where none is known. Curves are "
        "thin and dotted beyond the range in which they are known. Torques of stops at the limits "
        "leave the picture."
    )
    bands = [row for row in literature if row.scatter_text]
    scatter = " ".join(f"Band of {row.label}: {row.scatter_text}." for row in bands)
    nothing = "" if literature else "No published curve has this motion."
    return " ".join(filter(None, [range_text, scatter, nothing, doubts]))


def _torques(laws: Sequence[Elastic], angles: Array) -> Array:
    return np.asarray(total_torque(laws, angles)) + np.zeros_like(angles)


def _torque_limits(
    angles: Array,
    spring: AxisSpring,
    literature: Sequence[Literature],
    normal: tuple[float, float],
) -> tuple[float, float]:
    """Limits that show measurements and the curve, without its stops, in the normal range [N m]."""

    def largest(torques: Array, known: tuple[float, float] | None) -> float:
        low, high = known or normal
        inside = (angles >= max(low, normal[0])) & (angles <= min(high, normal[1]))
        return float(np.nanmax(np.abs(torques[inside]), initial=0.0))

    passive = spring.laws_besides_stops
    found = [largest(_torques(passive, angles), common_valid_range(passive))]
    found += [
        largest(row.torque(angles), row.valid_range)
        for row in literature
        if row.valid_range is not None and not row.obstacle
    ]
    limit = _TORQUE_MARGIN * max(1.0, max(found) or largest(_torques(spring.elastic, angles), None))
    return -limit, limit
