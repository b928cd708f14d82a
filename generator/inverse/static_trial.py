"""Dimensions of a person from markers on landmarks, while the person stands upright.

Lengths are those between two markers, so that soles, the floor and the size of markers matter
little. Heights of the leg are built up from the malleolus, whose own height follows the stature;
those of the trunk are below the top of the head.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from math import cos, radians

import numpy as np

from generator.diagnostics import UsageError, spelling_hint
from generator.inverse.markers import Markers
from generator.person.measures import estimate_measures
from generator.person.survey import Sex
from generator.rotations import Array

SIDES = ("left", "right")
TOP = "top_of_head"

LANDMARKS = (
    *(TOP, "cervicale", "suprasternale"),
    *(f"{side}_{name}" for name in ("acromion", "elbow", "wrist") for side in SIDES),
    *(f"{side}_{name}" for name in ("trochanter", "knee", "ankle") for side in SIDES),
)
"""Landmarks of the markers; those of the trunk have no side."""

MAX_MOVEMENT = 0.05
"""Range of a marker above which a trial is not static [m]; an estimate."""

GROUND = tuple(f"{side}_{name}" for name in ("heel", "toe") for side in SIDES)
"""Landmarks that only tell where the ground and the front are; no dimension is from them."""

_PAIRED = ("ankle", "knee", "trochanter", "acromion")
"""Landmarks that are at one height on both sides of a person who stands upright."""

MAX_ASYMMETRY = 0.04
"""Difference of left and right above which a marker may be misplaced [m]; an estimate."""

_GROUND_HEIGHT, MAX_ABOVE_GROUND = 0.04, 0.06
"""Height of markers on heel and toe, and how far they and the ankle may be from theirs, in shoes
[m]; both are estimates."""

_SPREADS = (0.3, 3.0)
"""Extent of the landmarks beyond which their unit is another one [m]; an estimate."""

_MIN_HANGING = cos(radians(30.0))
"""Cosine between a hanging upper arm and the vertical; a raised one lifts the acromion."""


@dataclass(frozen=True)
class StaticMeasures:
    """Measures of a static trial.

    Attributes:
        stature: Stature [m].
        lengths: Dimensions of a person by name [m].
        markers: Markers that each of them is from, in words.
        notices: Sentences on dimensions that follow the stature, and on doubts.
        hint: Likely reason of impossible lengths, the axis or the unit; "" where none is seen.
    """

    stature: float
    lengths: Mapping[str, float]
    markers: Mapping[str, str]
    notices: tuple[str, ...]
    hint: str


def measure_static_trial(
    markers: Markers,
    sex: Sex,
    mass: float,
    stature: float | None = None,
    names: Mapping[str, str] | None = None,
    up: str = "y",
) -> StaticMeasures:
    """Measure a person who stands upright, y up, with y = 0 on the floor.

    Args:
        markers: Trajectories, of which the mean counts.
        sex: Sex of the sample.
        mass: Mass [kg].
        stature: Stature [m]; None for the height of the top of the head.
        names: Names of markers by the landmarks that they are on; others have the landmark's name.
        up: Axis that pointed up in the file, for hints.

    Raises:
        UsageError: A landmark or a marker is unknown, the stature or all lengths are missing, or a
            length is impossible.
    """
    names = names or {}
    for landmark, marker in names.items():
        if landmark not in (*LANDMARKS, *GROUND):
            hint = spelling_hint(landmark, (*LANDMARKS, *GROUND))
            raise UsageError(f"unknown landmark `{landmark}`; {hint}")
        if marker not in markers.names:
            hint = spelling_hint(marker, markers.names)
            raise UsageError(f"unknown marker `{marker}`; {hint}")
    places: dict[str, Array] = {}
    notices: list[str] = []
    for landmark in (*LANDMARKS, *GROUND):
        marker = names.get(landmark, landmark)
        seen = markers.positions[:, [name == marker for name in markers.names]].reshape(-1, 3)
        seen = seen[~np.isnan(seen).any(axis=1)]
        if zeros := int((seen == 0.0).all(axis=1).sum()):
            frames = "all frames" if zeros == len(seen) else f"{zeros} of {len(seen)} frames"
            notices.append(f"`{marker}` is at 0, 0, 0 in {frames}: it counts as missing there")
            seen = seen[(seen != 0.0).any(axis=1)]
        if not len(seen):
            continue
        places[landmark] = seen.mean(axis=0)
        movement = float(np.ptp(seen, axis=0).max())
        if movement > MAX_MOVEMENT:
            notices.append(
                f"`{marker}` moves by {100.0 * movement:.0f} cm: the trial is not static"
            )
    is_stated = stature is not None
    if stature is None:
        if TOP not in places:
            why = "".join(f"; {notice}" for notice in notices if "missing there" in notice)
            raise UsageError(
                f"the trial has no marker on the landmark `{TOP}`: give --stature{why}"
            )
        stature = float(places[TOP][1])
    hint = _axis_or_unit_hint(places, up) if places else ""
    try:
        usual = estimate_measures(sex, stature, mass).length
    except UsageError as failure:
        raise UsageError(f"{failure}; {hint}" if hint else str(failure)) from None
    if not is_stated:
        notices += _ground_doubts(places, usual("lateral_malleolus_height"))
    notices += _side_doubts(places)
    found: dict[str, float] = {}
    used: dict[str, str] = {}
    for name, parts in _lengths(places):
        if isinstance(parts, str):
            notices.append(f"`{name}` follows the other dimensions: {parts}")
            continue
        length = float(np.mean([*parts.values()]))
        if not name.endswith("height") and np.ptp([*parts.values()]) > MAX_ASYMMETRY:
            each = " and ".join(f"{100.0 * value:.1f}" for value in parts.values())
            notices.append(f"`{name}` is the mean of {each} cm: a marker may be misplaced")
        used[name] = " and ".join(parts)
        if name == "lateral_femoral_epicondyle_height":
            length += usual("lateral_malleolus_height")
        elif name == "trochanterion_height":
            length += found.get(knee := "lateral_femoral_epicondyle_height", usual(knee))
        elif TOP in used[name]:
            length = stature - length
        found[name] = length
    if not found:
        raise UsageError("no two markers are on landmarks of one length; --marker LANDMARK=NAME")
    return StaticMeasures(stature, found, used, tuple(notices), hint)


def _axis_or_unit_hint(places: Mapping[str, Array], up: str) -> str:
    """Return what a person of impossible lengths is likely to need, or ""."""
    points = np.array([*places.values()])
    floor = points.mean(axis=0) * (1.0, 0.0, 1.0)
    spread: Array = np.ptp([*points, floor], axis=0)
    if not _SPREADS[0] <= spread.max() <= _SPREADS[1]:
        return f"the landmarks extend over {spread.max():.4g} m: the file's `Units` may be others"
    if int(np.argmax(spread)) == 2:
        other = "--up z" if up == "y" else "--up y"
        return f"the landmarks extend over {spread[1]:.2g} m upwards: did you mean `{other}`?"
    return ""


def _ground_doubts(places: Mapping[str, Array], ankle: float) -> Iterator[str]:
    """Yield a sentence if the feet are not on the ground, y = 0."""
    above: dict[str, float] = {}
    for side in SIDES:
        for name, usual in (("heel", _GROUND_HEIGHT), ("toe", _GROUND_HEIGHT), ("ankle", ankle)):
            if (place := places.get(f"{side}_{name}")) is not None:
                above[f"`{side}_{name}`"] = float(place[1]) - usual
    off = {name: value for name, value in above.items() if abs(value) > MAX_ABOVE_GROUND}
    if off:
        mean = 100.0 * float(np.mean([*off.values()]))
        how = f"some {abs(mean):.0f} cm {'higher' if mean > 0.0 else 'lower'}"
        verb = "is" if len(off) == 1 else "are"
        yield (
            f"{', '.join(off)} {verb} {how} than on a person on the floor at y = 0: "
            "heights count from there; set it to zero, or state the --stature"
        )


def _side_doubts(places: Mapping[str, Array]) -> Iterator[str]:
    """Yield sentences on sides that differ in height, or that are exchanged."""
    pairs = {
        name: (left, right)
        for name in dict.fromkeys(one.partition("_")[2] for one in places)
        if (left := places.get(f"left_{name}")) is not None
        and (right := places.get(f"right_{name}")) is not None
    }
    for name in _PAIRED:
        if name in pairs:
            left, right = (float(place[1]) for place in pairs[name])
            if abs(left - right) > MAX_ASYMMETRY:
                cm = 100.0 * abs(left - right)
                higher, lower = ("left", "right") if left > right else ("right", "left")
                yield (
                    f"`{higher}_{name}` is {cm:.1f} cm higher than `{lower}_{name}`: their mean "
                    "counts; a marker may be misplaced"
                )
    ahead = [
        places[toe] - places[heel]
        for side in SIDES
        if (heel := f"{side}_heel") in places and (toe := f"{side}_toe") in places
    ]
    if not ahead and {"cervicale", "suprasternale"} <= places.keys():
        ahead = [places["suprasternale"] - places["cervicale"]]
    if not ahead:
        return
    x, _, z = np.sum(ahead, axis=0).tolist()
    leftwards = np.array([z, 0.0, -x])
    if wrong := [name for name, (left, right) in pairs.items() if (left - right) @ leftwards < 0.0]:
        yield f"left and right are exchanged, by the direction of the front: {', '.join(wrong)}"


def _lengths(places: Mapping[str, Array]) -> Iterator[tuple[str, Mapping[str, float] | str]]:
    """Yield lengths between markers [m] by their words, or why there are none, by dimension."""
    arms = [_between(places, side, "acromion", "elbow") for side in SIDES]
    hanging = [arm for arm in arms if arm is not None]
    hangs = bool(hanging) and all(one[1] > _MIN_HANGING * np.linalg.norm(one) for one in hanging)
    raised = "" if not hanging or hangs else "the upper arms do not hang"
    for name, upper, lower in (
        ("lateral_femoral_epicondyle_height", "knee", "ankle"),
        ("trochanterion_height", "trochanter", "knee"),
        ("acromion_radiale_length", "acromion", "elbow"),
        ("radiale_stylion_length", "elbow", "wrist"),
    ):
        is_height = name.endswith("height")
        parts = {
            f"{side}_{upper} to {side}_{lower}": float(one[1] if is_height else np.linalg.norm(one))
            for side in SIDES
            if (one := _between(places, side, upper, lower)) is not None
        }
        missing = f"no markers on `{upper}` and `{lower}` of one side"
        yield name, (raised if upper == "acromion" else "") or parts or missing
    left, right = (places.get(f"{side}_acromion") for side in SIDES)
    breadth, missing = "biacromial_breadth", "no markers on both acromia and an elbow"
    if left is None or right is None or not hanging:
        yield breadth, missing
    else:
        distance = float(np.linalg.norm(left - right))
        yield breadth, raised or {"left_acromion to right_acromion": distance}
    top = places.get(TOP)
    for name, landmark in (
        ("acromial_height", "acromion"),
        ("suprasternale_height", "suprasternale"),
        ("cervicale_height", "cervicale"),
    ):
        ends = [places[n] for n in (landmark, *(f"{s}_{landmark}" for s in SIDES)) if n in places]
        if top is None or not ends or (landmark == "acromion" and not hanging):
            arm = " and elbow" if landmark == "acromion" else ""
            yield name, f"no markers on `{TOP}` and `{landmark}`{arm}"
        elif landmark == "acromion" and raised:
            yield name, raised
        else:
            yield name, {f"{TOP} to {landmark}": float(top[1] - np.mean(ends, axis=0)[1])}


def _between(places: Mapping[str, Array], side: str, upper: str, lower: str) -> Array | None:
    """Return the vector from the lower to the upper landmark of a side [m]."""
    ends = [places.get(f"{side}_{name}") for name in (upper, lower)]
    return None if ends[0] is None or ends[1] is None else ends[0] - ends[1]
