"""Strengths of the legs by angle, beside norms of the knee."""

from collections.abc import Iterator, Mapping

import numpy as np
from matplotlib.figure import Figure

from plots.canvas import BLACK, LINE_STYLES, Look, create_panels
from plots.plate import Claim, comparison
from plots.plate_definition import PlateDefinition
from springs.backends import Array
from springs.strength.strengths import (
    Age,
    Body,
    Norm,
    Strength,
    norm_reference,
    norms,
    strength,
    strength_rows,
)

BODIES: Mapping[str, Body] = {"men": Body(72.0, 1.75), "women": Body(60.0, 1.63, is_female=True)}
"""Bodies for which torques are divided by mass; their statures are estimates."""

_NORMS, _OLD_NORMS = {"adult": "norm of adults [2]"}, "norm over 65 [2]"
"""Labels of the intervals of norms."""

_AGES = {Age.YOUNG: "18-25", Age.MIDDLE: "55-65", Age.OLD: "over 65, scaled by the norms"}
_MOTIONS = {"hip": "flexion", "knee": "flexion", "ankle": "dorsiflexion"}
_RANGES = {"hip": (-20.0, 120.0), "knee": (-5.0, 135.0), "ankle": (-45.0, 35.0)}
_MID_RANGE = {"knee extension": (55.0, 75.0), "knee flexion": (20.0, 40.0)}
"""Places at which the norms of mid-range are drawn [deg]: near the best angles of the curves."""

Curves = Mapping[tuple[str, str, Age], Strength]
"""Strengths by joint, `men` or `women`, and age."""


def collect() -> Curves:
    """Return the strengths of the bodies."""
    found: dict[tuple[str, str, Age], Strength] = {}
    for joint, motion in _MOTIONS.items():
        for who, body in BODIES.items():
            for age in Age:
                aged = Body(body.mass, body.stature, body.is_female, age)
                own = strength(joint, motion, aged)
                assert own is not None
                found[joint, who, age] = own
    return found


def _angles(joint: str) -> Array:
    return np.linspace(*_RANGES[joint], 281)


def _torques(own: Strength, joint: str, mass: float) -> tuple[Array, Array]:
    """Return torques in the sense of the motion and against it, negative [N m/kg]."""
    angles = np.radians(_angles(joint))
    return own.capacity(angles, False) / mass, -own.capacity(angles, True) / mass


def _norms_of(who: str) -> Iterator[Norm]:
    sex = BODIES[who].sex
    return (one for one in norms() if one.sex == sex)


def claims(found: Curves) -> Iterator[Claim]:
    """Compare the largest torques of knees with the intervals of norms."""
    for who, body in BODIES.items():
        for one in _norms_of(who):
            is_old = one.age != "adult"
            own = found["knee", who, Age.OLD if is_old else Age.YOUNG]
            largest = own.largest[one.motion.endswith("extension")] / body.mass
            low, high = one.interval
            age = "over 65 years, scaled to the middle of the norm" if is_old else "of 18-25 years"
            sentence = f"{one.motion.capitalize()} of {who} {age}"
            if is_old:
                yield Claim(sentence, largest, "N m/kg", low, high)
            else:
                remark = f"{100.0 * (1.0 - largest / low):.0f} % under the interval of adults"
                yield comparison(sentence, largest, "N m/kg", low, high, remark)


def _draw(found: Curves) -> Figure:
    figure, rows = create_panels(5.6, len(BODIES), len(_MOTIONS), share_rows=False)
    for panels, (who, body) in zip(rows, BODIES.items(), strict=True):
        for axes, (joint, motion) in zip(panels, _MOTIONS.items(), strict=True):
            for (age, label), style in zip(_AGES.items(), LINE_STYLES, strict=False):
                for torques in _torques(found[joint, who, age], joint, body.mass):
                    look: Look = {"color": style.colour, "lw": 1.6, "label": label}
                    axes.plot(_angles(joint), torques, style.dash, **look)
                    label = "_"
            if joint == "knee":
                for one in _norms_of(who):
                    sign = -1.0 if one.motion.endswith("extension") else 1.0
                    width = 2.5 if one.age == "adult" else 1.0
                    ends = [sign * end for end in one.interval]
                    place = np.mean(_MID_RANGE[one.motion]) + (0.0 if one.age == "adult" else 12.0)
                    bar: Look = {"lw": width, "label": _NORMS.get(one.age, _OLD_NORMS)}
                    axes.plot([place, place], ends, color=BLACK, solid_capstyle="butt", **bar)
            axes.axhline(0.0, color=BLACK, lw=0.8)
            axes.set(title=f"{joint}, {who}", xlabel=f"{motion} [deg]" if who == "women" else "")
        panels[0].set_ylabel("torque [N m/kg]")
    handles, labels = rows[0][1].get_legend_handles_labels()  # the knee's
    shown = dict(zip(labels, handles, strict=True))
    figure.legend(shown.values(), shown, loc="outside upper left", ncols=5, fontsize=7.5)
    return figure


def _tables(found: Curves) -> dict[str, Mapping[str, Array]]:
    tables: dict[str, Mapping[str, Array]] = {}
    for joint, motion in _MOTIONS.items():
        columns: dict[str, Array] = {f"{motion} [deg]": _angles(joint)}
        for who, body in BODIES.items():
            for age in Age:
                plus, minus = _torques(found[joint, who, age], joint, body.mass)
                columns[f"{who} {age}, {motion} [N m/kg]"] = plus
                columns[f"{who} {age}, opposite [N m/kg]"] = minus
        tables[f"strength_of_{joint}"] = columns
    return tables


strength_of_legs = PlateDefinition(
    name="strength_of_legs",
    title="Strength of the legs by angle",
    sign="Torques are positive towards flexion and dorsiflexion, negative towards the opposite.",
    references=(
        str(next(row.citation for row in strength_rows() if row.has_curves)),
        str(norm_reference()),
    ),
    collect=collect,
    caption=(
        "Largest voluntary torque, held still, of a man of 72 kg and 1.75 m and a woman of 60 kg "
        "and 1.63 m. Bars are 95 % intervals of the pooled means at mid-range, thick of adults, "
        "thin of older people, drawn near the best angles of the curves. The published curves of "
        "people over 65 are of six, and are not used: knees have the middle of the norm, hips and "
        "ankles are scaled alike, an estimate. Beyond the angles at which the cosine vanishes, "
        "the torque is zero."
    ),
    draw=_draw,
    claims=claims,
    tables=_tables,
)
