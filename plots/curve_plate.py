"""The plate of one joint's curve: picture, words, numbers and references put together."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from plots.claim import Claim
from plots.joint_curve import JointCurve
from plots.literature import Literature
from plots.moment_axes import Window, draw_joint
from plots.plate import Plate
from springs import published
from springs.operations import Array

_DRAWN = (
    "Circles: the torque that Exudyn's equations of motion hold for the prototype at rest, read "
    "every 5 deg{held}. Black: the cubic as the thesis prints it, in the sense of the torque on "
    "the child{dashed}. Above: the normal range of motion ({ends}) and the law's dead zone. Below: "
    "simulated less published. Simulated and law differ by {differ:.1g} N m at most, which no "
    "picture shows."
)


def curve_plate(
    name: str,
    title: str,
    curve: JointCurve,
    literature: Sequence[Literature],
    window: Window,
    claims: Sequence[Claim],
    words: str,
    sources: Sequence[str] = (),
) -> Plate:
    """The plate of a curve.

    Args:
        name: of the plate.
        title: with the thesis's figure.
        curve: as it was read.
        literature: drawn beside it.
        window: what the picture shows.
        claims: all of them.
        words: what is to be said of this joint, in front of what is said of every sheet.
        sources: references beyond those of the curves and of the ends of the normal range.
    """
    thesis = published.publication("otani_1989").reference
    own = [str(replace(thesis, place="appendix A")), curve.spring.reference]
    others = [str(one.reference) for one in literature]
    ends = [str(end.reference) for end in (curve.low, curve.high) if end is not None]
    references = tuple(dict.fromkeys([*own, *others, *ends, *sources]))
    sign = sign_of(curve)
    numbered = {text: number for number, text in enumerate(references, start=1)}
    return Plate(
        name=name,
        title=title,
        caption=_caption(curve, literature, window, words, numbered),
        sign=sign,
        figure=draw_joint(title, curve, literature, window, f"{sign} {_cut(window)}", references),
        claims=tuple(claims),
        tables=_tables(curve, literature, window),
        references=references,
    )


def _cut(window: Window) -> str:
    low, high = window.torques
    first, last = window.residuals
    return (
        f"Torques beyond {low:g} to {high:g} N m are cut off, differences beyond {first:g} to "
        f"{last:g}; published curves are thin and dotted where they are not known to hold."
    )


def sign_of(curve: JointCurve) -> str:
    """The sign convention in words."""
    said = f"Angles are positive in {curve.motion}, 0 with the figure standing upright, arms down. "
    said += "Torques act on the child and are positive in the same sense: one that drives back "
    said += "from a positive angle is negative."
    moment = "resists" if curve.cubic.sense < 0 else "acts on the child"
    return f"{said} The printed moment {moment}."


def _caption(
    curve: JointCurve,
    literature: Sequence[Literature],
    window: Window,
    words: str,
    numbered: Mapping[str, int],
) -> str:
    ends = dict.fromkeys(
        f"{end.motion} [{numbered[str(end.reference)]}]"
        for end in (curve.low, curve.high)
        if end is not None
    )
    low, high = np.radians(window.angles)
    said = [
        words,
        _DRAWN.format(
            held=f", {curve.held}" if curve.held else "",
            dashed="" if curve.cubic.dead_zone is None else ", dashed within the dead zone",
            ends=", ".join(ends),
            differ=float(np.abs(curve.simulated - curve.law).max()),
        ),
        "" if curve.low and curve.high else "Where a range has a ? no verified end is known.",
        _cut(window),
    ]
    for one in literature:
        notes = [one.held, one.note, "" if one.is_digitised else one.beyond(low, high)]
        if any(notes):
            said.append(f"{one.label}: {'; '.join(filter(None, notes))}.")
    return " ".join(filter(None, said))


def _tables(
    curve: JointCurve, literature: Sequence[Literature], window: Window
) -> dict[str, dict[str, Array]]:
    """The readings with every formula beside them, and each digitised curve at its own angles."""
    read = {
        "angle [deg]": np.degrees(curve.angles),
        "simulated [N m]": curve.simulated,
        "law [N m]": curve.law,
        "cubic as printed, as torque on the child [N m]": curve.printed(curve.angles),
    }
    if curve.other_side is not None:
        read["simulated, other side [N m]"] = curve.other_side
    tables = {"readings": read}
    inside = curve.within(*np.radians(window.angles))
    for one in literature:
        if one.points is None:
            # Beyond the window an exponential says nothing, and may be larger than a number.
            shown = np.where(inside, one.torque(curve.angles), np.nan)
            read[f"{one.label} [N m]"] = shown
        else:
            at, torques = one.points
            simulated = np.interp(at, curve.angles, curve.simulated)
            tables[_file_word(one.label)] = {
                "angle [deg]": np.degrees(at),
                "published [N m]": torques,
                "simulated [N m]": simulated,
                "simulated - published [N m]": simulated - torques,
            }
    return tables


def _file_word(label: str) -> str:
    """A label as part of a file's name."""
    words = "".join(c if c.isalnum() else " " for c in label.lower()).split()
    return "_".join(words)
