"""Hip moment at several knee angles: muscles that span both joints (the thesis's section 4.2.4)."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure

from generator import Plan, read_figure, static_torques
from plots.canvas import (
    GREY,
    LINE_STYLES,
    THESIS_STYLE,
    create_panels,
    draw_curve,
    draw_marks,
    draw_points,
    draw_zero_line,
)
from plots.literature import YOON_MANSOUR, thesis_reference
from plots.plate import Claim, ClaimKind
from plots.plate_definition import PlateDefinition
from springs import CoupledAxis, CoupledSpring, SpringSet
from springs.backends import Array
from springs.coupled import ConservativeFit, CoupledExponential, loop_work, nearest_conservative_law
from springs.elastic import Range, describe_extrapolation
from springs.published import tables as published

HIP, KNEE = "left_hip_joint", "left_knee"

_FLEXION_AXES = (CoupledAxis(HIP, (0.0, 1.0, 0.0)), CoupledAxis(KNEE, (0.0, -1.0, 0.0)))


class TwoJointLeg:
    """The left leg of the prototype with a coupled law of hip and knee and no other springs."""

    def __init__(self, law: CoupledExponential) -> None:
        """Add the law to hip and knee."""
        self._body = read_figure("prototype")
        self._plan = Plan(springs=SpringSet(coupled=(CoupledSpring(law, _FLEXION_AXES),)))

    def torques(self, angles: Sequence[Array]) -> tuple[Array, ...]:
        """Torques on thigh and shank in Exudyn, in the sense of flexion, shape (n,) each [N m].

        Args:
            angles: flexion of hip and knee, shape (n,) each [rad].
        """
        poses = [
            {HIP: np.array([0.0, 0.0, h]), KNEE: np.array([k])}
            for h, k in zip(*angles, strict=True)
        ]
        read = static_torques(self._body, poses, self._plan)
        return tuple(read[axis.joint] @ np.array(axis.direction) for axis in _FLEXION_AXES)


KNEE_ANGLES = (15.0, 60.0, 90.0, 110.0)
"""Knee angles at which Silder et al. measured the hip [deg]."""

EXTENDED_ANGLE, FLEXED_ANGLE = -15.0, 80.0
"""Hip angles at the ends of all of their curves [deg]."""

USABLE_RANGES: tuple[Range, Range] = (
    (np.radians(-15.0), np.radians(100.0)),
    (0.0, np.radians(135.0)),
)
"""Ranges of hip and knee in which Riener & Edrich's equations are used [rad]."""

TORQUE_BOUND = 1e-6
"""Difference below which torques are equal [N m]."""

WORK_BOUND = 0.01
"""Work round a loop below which a law is conservative [J]."""

_HIP_ANGLES = np.arange(-30.0, 110.1, 1.0)
_SAMPLE_ANGLES = np.arange(-15.0, 100.1, 5.0)
_CAPTION = (
    "The thesis's hip is independent of the knee; the measurements of Yoon & Mansour, its source, "
    "are not public. Left: points digitised from Silder et al. for four knee angles, as "
    "substitutes, and the thesis's cubic. Right: Riener & Edrich's equations for the same knee "
    "angles as lines, thin and dotted outside the range in which they are used, and torques read "
    "out of Exudyn as markers, with the equations on hip and knee of the prototype and the ankle "
    "fixed at 0 deg. The equations are {beyond}. Below: equations minus points (left), and nearest "
    "conservative law of the same exponentials minus the equations (right). The equations are not "
    "conservative: round a closed loop of hip and knee angles they do work. The conservative law "
    "changes the moment of the hip by {hip:.2f} and that of the knee by {knee:.2f} N m (rms)."
)


@dataclass(frozen=True)
class HipMoments:
    """Law and leg, and hip moments by knee angle [deg].

    Attributes:
        law: Law of hip and knee.
        leg: Leg with this law.
        nearest: Nearest conservative law.
        silder: (hip angle [deg], moment [N m]) of each point, shape (n, 2).
        riener: read out of Exudyn at the hip angles of Silder's points [N m], shape (n,).
        at_sample_angles: read out of Exudyn at `_SAMPLE_ANGLES` [N m], shape (m,).
    """

    law: CoupledExponential
    leg: TwoJointLeg
    nearest: ConservativeFit
    silder: Mapping[float, Array]
    riener: Mapping[float, Array]
    at_sample_angles: Mapping[float, Array]


def collect_hip_moments() -> HipMoments:
    """Collect Silder's points, and the moments of a leg at the same angles."""
    whole = published.coupled_law("riener_edrich_1999/leg").law
    law = whole.hold_coordinate("ankle dorsiflexion", 0.0)
    leg = TwoJointLeg(law)
    silder = {
        knee: np.array(published.curve(f"silder_2007/hip_knee_{knee:.0f}").printed.points)
        for knee in KNEE_ANGLES
    }
    return HipMoments(
        law,
        leg,
        nearest_conservative_law(law, USABLE_RANGES),
        silder,
        {knee: _simulate_hip_moments(leg, points[:, 0], knee) for knee, points in silder.items()},
        {knee: _simulate_hip_moments(leg, _SAMPLE_ANGLES, knee) for knee in KNEE_ANGLES},
    )


def _caption(made: HipMoments) -> str:
    hip, knee = made.nearest.rms_difference
    beyond = describe_extrapolation(USABLE_RANGES[0], *np.radians(_HIP_ANGLES[[0, -1]]))
    return _CAPTION.format(beyond=beyond, hip=hip, knee=knee)


def _simulate_hip_moments(leg: TwoJointLeg, hip: Array, knee: float) -> Array:
    """Hip moments of a leg at hip angles and one knee angle [deg], in N m."""
    at = np.radians(hip)
    return leg.torques((at, np.full_like(at, np.radians(knee))))[0]


def _claims(made: HipMoments) -> Iterator[Claim]:
    yield Claim(
        "The hip moment read out of Exudyn is that of Riener & Edrich's equations, over all "
        "angles drawn",
        max(
            float(np.abs(made.at_sample_angles[knee] - _law_moments(made.law, knee)).max())
            for knee in KNEE_ANGLES
        ),
        "N m",
        at_most=TORQUE_BOUND,
    )
    measured = {knee: dict(points) for knee, points in made.silder.items()}
    ends = (EXTENDED_ANGLE, FLEXED_ANGLE)
    silder = {end: {knee: measured[knee][end] for knee in KNEE_ANGLES} for end in ends}
    riener = {
        end: {
            knee: float(_simulate_hip_moments(made.leg, np.array([end]), knee)[0])
            for knee in (0.0, *KNEE_ANGLES)
        }
        for end in ends
    }
    for name, moments in (("Silder's points", silder), ("Riener & Edrich's equations", riener)):
        yield from _footnote_claims(f"The thesis's footnote 3 of chapter 4 and {name}", moments)
    yield from _gradient_claims(made)


def _footnote_claims(name: str, ends: Mapping[float, Mapping[float, float]]) -> Iterator[Claim]:
    """Compare the third footnote of the thesis's chapter 4 with moments, as margins."""
    for angle, word, most, least in (
        (EXTENDED_ANGLE, "extended", "most", "least"),
        (FLEXED_ANGLE, "flexed", "least", "most"),
    ):
        moments = ends[angle]
        *others, bent = sorted(moments)
        straight = others[0]
        over = moments[bent] - max(moments[knee] for knee in others)
        under = min(moments[knee] for knee in (*others[1:], bent)) - moments[straight]
        yield Claim(
            f"{name}: {word}, at {angle:g} deg, the hip resists {most} with the knee most flexed "
            f"({bent:g} deg) and {least} with it straightest ({straight:g} deg): smaller of the "
            "two margins",
            min(over, under),
            "N m",
            at_least=0.0,
            kind=ClaimKind.COMPARISON,
            remark=""
            if over >= 0.0 or angle == FLEXED_ANGLE
            else f"the moment falls from {moments[straight]:.1f} N m with the knee at "
            f"{straight:g} deg to {moments[bent]:.1f} N m at {bent:g} deg: the equation lacks a "
            "muscle that a flexed knee stretches over the extended hip",
        )


def _law_moments(law: CoupledExponential, knee: float, hip: Array = _SAMPLE_ANGLES) -> Array:
    """Hip moments of a law at hip angles and one knee angle [deg], in N m."""
    return np.asarray(law.torques((np.radians(hip), np.full_like(hip, np.radians(knee))))[0])


def _gradient_claims(made: HipMoments) -> list[Claim]:
    law, leg, nearest = made.law, made.leg, made.nearest
    loop = "round hip -15 to 100 and knee 0 to 135 deg"
    own = loop_work(law, USABLE_RANGES)
    scatter = published.curve("silder_2007/hip_knee_15").rms_error
    assert scatter is not None
    return [
        Claim(
            f"Riener & Edrich's hip and knee in Exudyn do the work of their equations {loop}, "
            f"{own:.2f} J, so that they have no energy: difference",
            abs(loop_work(leg, USABLE_RANGES) - own),
            "J",
            at_most=TORQUE_BOUND,
        ),
        Claim(
            f"The nearest conservative law of the same exponentials does no work in Exudyn {loop}",
            loop_work(TwoJointLeg(nearest.law), USABLE_RANGES),
            "J",
            at_least=-WORK_BOUND,
            at_most=WORK_BOUND,
        ),
        Claim(
            "That law differs from Riener & Edrich's hip moment by less than models fitted to "
            f"single subjects from these ({scatter:g} N m, Silder et al.): rms difference",
            nearest.rms_difference[0],
            "N m",
            at_most=scatter,
        ),
    ]


def _draw(made: HipMoments) -> Figure:
    figure, ((points, equations), (residual, gradient)) = create_panels(7.2, 2, 2, (2.2, 1.0))
    thesis = np.asarray(published.curve("otani_1989/hip_y").law.torque(np.radians(_HIP_ANGLES)))
    label = "thesis [1]: knee at 15 deg"
    equations.plot([], [], ":", color=GREY, lw=0.8, label="outside the usable range")
    points.plot(_HIP_ANGLES, thesis, color=THESIS_STYLE.colour, lw=2.2, label=label)
    for knee, pen in zip(KNEE_ANGLES, LINE_STYLES, strict=False):
        hip, moment = made.silder[knee].T
        draw_points(points, hip, moment, pen, f"substitute [3]: knee at {knee:g} deg")
        draw_points(residual, hip, made.riener[knee] - moment, pen, "_")
        torque = _law_moments(made.law, knee, _HIP_ANGLES)
        draw_curve(equations, _HIP_ANGLES, torque, USABLE_RANGES[0], pen, "_", 1.0)
        label = f"Exudyn, knee at {knee:g} deg"
        draw_marks(equations, _SAMPLE_ANGLES, made.at_sample_angles[knee], pen, label, 4.0)
        change = _law_moments(made.nearest.law, knee, _HIP_ANGLES) - torque
        draw_curve(gradient, _HIP_ANGLES, change, USABLE_RANGES[0], pen, "_", 1.0)
    for axes in (points, residual, equations, gradient):
        draw_zero_line(axes)
        axes.set_xticks(range(-30, 121, 30))
    for axes in (points, equations):
        axes.set_ylim(-70.0, 100.0)
        axes.legend(loc="upper right")
    points.set(title="thesis, and Silder's points", ylabel="hip moment [N m]")
    equations.set_title("substitute [4]: Riener & Edrich")
    residual.set(title="Riener & Edrich in Exudyn - Silder", ylabel="difference [N m]")
    gradient.set_title("nearest conservative law - Riener & Edrich")
    for axes in (residual, gradient):
        axes.set_xlabel("hip flexion [deg]")
    return figure


def _tables(made: HipMoments) -> dict[str, dict[str, Array]]:
    exudyn = {"hip flexion [deg]": _SAMPLE_ANGLES}
    tables = {"exudyn": exudyn}
    for knee in KNEE_ANGLES:
        column = f"knee {knee:g} deg [N m]"
        exudyn[f"Exudyn, {column}"] = made.at_sample_angles[knee]
        exudyn[f"equations, {column}"] = _law_moments(made.law, knee)
        exudyn[f"nearest gradient of its form, {column}"] = _law_moments(made.nearest.law, knee)
        hip, moment = made.silder[knee].T
        tables[f"silder_knee_{knee:.0f}"] = {
            "hip flexion [deg]": hip,
            "Silder [N m]": moment,
            "Riener & Edrich in Exudyn [N m]": made.riener[knee],
        }
    return tables


two_joint_hip = PlateDefinition(
    name="two_joint_hip",
    title="Hip moment at several knee angles (the thesis's section 4.2.4)",
    sign="The moment acts on the thigh and is positive towards flexion: it resists where it is "
    "positive in extension and negative in flexion. Hip angle: 0 standing, flexion positive; knee "
    "angle: 0 straight, flexion positive.",
    references=(
        thesis_reference("section 4.2.4 and appendix A"),
        YOON_MANSOUR,
        str(published.curve("silder_2007/hip_knee_15").reference),
        str(published.coupled_law("riener_edrich_1999/leg").reference),
    ),
    collect=collect_hip_moments,
    caption=_caption,
    draw=_draw,
    claims=_claims,
    tables=_tables,
)
