"""Masses and moments of inertia of a person's segments beside those measured."""

from collections.abc import Iterator, Mapping

import numpy as np
from matplotlib.figure import Figure

from generator.person.body import LIMB_SEGMENTS, TRUNK_SEGMENTS, build_body
from generator.person.measures import Sex, estimate_measures
from plots.canvas import BLACK, LINE_STYLES, create_panels, draw_marks, draw_range
from plots.person_facts import SegmentMeans, person_facts
from plots.plate import Claim
from plots.plate_definition import PlateDefinition
from springs.backends import Array

SEGMENTS = (*reversed(TRUNK_SEGMENTS), *LIMB_SEGMENTS)
"""From the head down."""

_LEG = ("upper_leg", "lower_leg")

_QUANTITIES = (
    "mass",
    "moment of inertia about the antero-posterior axis",
    "medio-lateral axis",
    "longitudinal axis",
)

_AXES: Mapping[str, tuple[int, int, int]] = {"hand": (1, 0, 2), "foot": (2, 1, 0)}
"""Axes of a segment (0 for x) along the published ones, where they are not x, y, z."""

_LARGEST_SHOWN = 12.0
"""Largest difference on the axis [%]."""

_CAPTION = (
    "A person is built for the stature and mass of the two mean bodies, and its segments are "
    "compared with the measured ones. The person follows de Leva's table, which adjusts these same "
    "measurements: agreement tests the use of the table and of its axes, and says nothing about "
    "other people. Thigh and shank are the exception: de Leva's lengths do not add up to "
    "the stature, and the person's legs close it, {factors}; their moments of inertia change "
    "with the square of the length. The woman's foot weighs {foot:.2f} % of the body in the "
    "measured table and {own:.2f} % in de Leva's. Differences beyond {largest:g} % are drawn at "
    "the edge."
)

Differences = Mapping[str, Array]
"""Difference of each quantity from its published value by segment, shape (4,) [%]."""


def differences(sex: Sex, means: SegmentMeans) -> Differences:
    """Return the differences of a person of the stature and mass of the means [%]."""
    body = build_body(estimate_measures(sex, means.stature, means.mass))
    found: dict[str, Array] = {}
    for name in SEGMENTS:
        segment = body.segments[name]
        moments = [segment.inertia[axis] for axis in _AXES.get(name, (0, 1, 2))]
        own = np.array([segment.mass, *moments])
        found[name] = 100.0 * (own / np.array(means.segments[name]) - 1.0)
    return found


def _caption(_: Mapping[Sex, Differences]) -> str:
    factors: list[str] = []
    for sex, word in _WORDS.items():
        percent = 100.0 * (leg_factor(sex) - 1.0)
        sense = "longer" if percent > 0.0 else "shorter"
        factors.append(f"{abs(percent):.1f} % {sense} in the {word}")
    women = person_facts().segments[Sex.FEMALE]
    own = build_body(estimate_measures(Sex.FEMALE, women.stature, women.mass)).segments["foot"]
    return _CAPTION.format(
        factors=" and ".join(factors),
        largest=_LARGEST_SHOWN,
        foot=100.0 * women.segments["foot"][0] / women.mass,
        own=100.0 * own.mass / women.mass,
    )


_WORDS = {Sex.MALE: "man", Sex.FEMALE: "woman"}


def leg_factor(sex: Sex) -> float:
    """Factor by which the legs of the mean body close its stature."""
    means = person_facts().segments[sex]
    sources = build_body(estimate_measures(sex, means.stature, means.mass)).sources
    (factor,) = [row.value for row in sources if row.quantity == "length factor of the legs"]
    return factor


def claims(sex: Sex, found: Differences) -> Iterator[Claim]:
    """Compare masses, moments, and the moments of the legs with those of the means."""
    fact, word = person_facts().facts["segment_difference"], _WORDS[sex]
    others = [name for name in SEGMENTS if name not in _LEG]
    for quantity, names, rows in (
        ("mass of a segment", SEGMENTS, slice(0, 1)),
        ("moment of inertia of a segment but thigh and shank", others, slice(1, 4)),
        ("moment of inertia of thigh and shank", _LEG, slice(1, 4)),
    ):
        largest = {name: float(np.abs(found[name][rows]).max()) for name in names}
        beyond = [name.replace("_", " ") for name in names if largest[name] > fact.high]
        remark = f"beyond it: {', '.join(beyond)}"
        if names == _LEG:
            change = 100.0 * (leg_factor(sex) ** 2 - 1.0)
            remark = f"the lengths that close the stature change them by {change:+.1f} %"
        sentence = f"The {word}: largest difference from the measured {quantity}"
        yield fact.compare(sentence, max(largest.values()), remark)


def _draw(found: Mapping[Sex, Differences]) -> Figure:
    bound = person_facts().facts["segment_difference"].high
    figure, (panels,) = create_panels(4.4, 1, len(found))
    places = np.arange(len(SEGMENTS))[::-1]
    for axes, (sex, rows) in zip(panels, found.items(), strict=True):
        means = person_facts().segments[sex]
        draw_range(axes, -bound, bound, across=True)
        axes.axvline(0.0, color=BLACK, lw=0.8)
        for index, (quantity, style) in enumerate(zip(_QUANTITIES, LINE_STYLES, strict=False)):
            values = [rows[name][index] for name in SEGMENTS]
            shown = np.clip(values, -_LARGEST_SHOWN, _LARGEST_SHOWN)
            draw_marks(axes, shown, places + 0.14 * (1.5 - index), style, quantity, 4.5)
        axes.set(
            title=f"{_WORDS[sex]}, {means.stature:.3f} m, {means.mass:.1f} kg",
            xlabel="difference from the measured mean [%]",
            xlim=(-1.05 * _LARGEST_SHOWN, 1.05 * _LARGEST_SHOWN),
        )
    names = [name.replace("_", " ") for name in reversed(SEGMENTS)]
    panels[0].set_yticks(range(len(SEGMENTS)), names)
    handles = panels[0].get_legend_handles_labels()
    figure.legend(*handles, loc="outside upper left", ncols=4, fontsize=7.5)
    return figure


def _tables(found: Mapping[Sex, Differences]) -> dict[str, Mapping[str, Array]]:
    """Differences by segment, in the order of the picture."""
    return {
        "person_segments": {
            f"{_WORDS[sex]}: {quantity}, difference [%]": np.array(
                [rows[name][index] for name in SEGMENTS]
            )
            for sex, rows in found.items()
            for index, quantity in enumerate(_QUANTITIES)
        }
    }


person_segments = PlateDefinition(
    name="person_segments",
    title="A person's segments beside measured ones",
    sign="A difference is that of a person from the published mean, positive where it is larger.",
    references=person_facts().references("zatsiorsky_2002"),
    collect=lambda: {sex: differences(sex, one) for sex, one in person_facts().segments.items()},
    caption=_caption,
    draw=_draw,
    claims=lambda found: (claim for sex in found for claim in claims(sex, found[sex])),
    tables=_tables,
)
