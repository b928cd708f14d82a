"""Moments of inertia, centre of mass and dimensions of a whole person beside measured ones."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from math import degrees, radians

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from generator.geometry.read import segment_colour
from generator.inertia import MassProperties
from generator.person.measures import Sex, estimate_measures
from generator.person.person import Person, build_person
from generator.person.stance import standing_stance
from generator.person.survey import survey
from plots.canvas import (
    BLACK,
    LINE_STYLES,
    PALE,
    LineStyle,
    create_canvas,
    draw_marks,
    draw_range,
    draw_strip,
    draw_zero_line,
)
from plots.figure_image import Body as Surfaces
from plots.figure_image import Poses, Strip, View
from plots.person_facts import MeasuredMan, person_facts
from plots.plate import Claim, comparison, incomparable_claim
from plots.plate_definition import PlateDefinition
from plots.whole_body import (
    Posture,
    mass_properties,
    on_both_sides,
    place_in_posture,
    surface_points,
)
from springs.backends import Array

STANDING = "standing"

MEASURED_POSTURES: Mapping[str, Posture] = {
    STANDING: {},
    "arms_up": on_both_sides({"shoulder": (0.0, 0.0, 180.0)}),
    "spread": on_both_sides({"shoulder": (0.0, 135.0, 0.0), "hip_joint": (0.0, 30.0, 0.0)}),
}
"""Postures of the men who were measured. The angles of the last one are assumed."""

SITTING = on_both_sides({"hip_joint": (0.0, 0.0, 90.0), "knee": (90.0,), "elbow": (0.0, 90.0)})

_STRAIGHT = on_both_sides({"shoulder": (0.0, 0.0, 0.0), "hip_joint": (0.0, 0.0, 0.0)})
"""Limbs straight down from their joints."""

LEVEL_ARMS = on_both_sides({"shoulder": (0.0, 90.0, 0.0)})

_AXES = {"antero-posterior": 2, "lateral": 0, "long": 1}
"""Axes of the standing figure's world."""

_WORDS = {Sex.MALE: "man", Sex.FEMALE: "woman"}

_STANCE = ("arms", "legs")
"""Attributes of a stance."""

DIMENSIONS = ("sitting_height", "span", "wrist_height")


@dataclass(frozen=True, eq=False)
class WholePerson:
    """A person with its surfaces, in postures."""

    person: Person

    @cached_property
    def surfaces(self) -> Surfaces:
        """Surfaces of the figure's segments."""
        figure = self.person.figure
        surfaces = {
            name: self.person.surfaces[name.removeprefix("left_").removeprefix("right_")]
            for name in figure.bodies
        }
        colours = [segment_colour(figure, figure.segments[name]) for name in surfaces]
        return Surfaces.of_surfaces(surfaces, colours)

    def poses(self, posture: Posture) -> Poses:
        """Poses in a posture; the pelvis stays where it is when the person stands."""
        return place_in_posture(self.person.figure, posture)

    def whole(self, posture: Posture) -> MassProperties:
        """Mass properties in a posture."""
        return mass_properties(self.person.figure, self.poses(posture))

    @cached_property
    def dimensions(self) -> Mapping[str, float]:
        """The dimensions of `DIMENSIONS` [m].

        Sitting height: from the underside of the lower torso's surface to the top of the head.
        Span: of all surfaces, arms level. Wrist height: of the joint.
        """
        sitting = self.poses(SITTING)
        head = surface_points(self.surfaces, sitting, ["head"])
        seat = surface_points(self.surfaces, sitting, ["lower_torso"])
        level = surface_points(self.surfaces, self.poses(LEVEL_ARMS))
        return {
            "sitting_height": float(head[:, 1].max() - seat[:, 1].min()),
            "span": float(np.ptp(level[:, 0])),
            "wrist_height": float(self.poses({})["left_hand"][1, 3]),
        }


def _expected(name: str, person: WholePerson) -> tuple[float, float]:
    """Value that the survey expects of a person, and its standard error [m]."""
    measures = person.person.measures
    return survey().expected(name, measures.sex, measures.stature, measures.mass)


def build_whole_person(sex: Sex, stature: float, mass: float) -> WholePerson:
    """Build a person, without springs."""
    return WholePerson(build_person(estimate_measures(sex, stature, mass), springs="none"))


@dataclass(frozen=True, eq=False)
class Comparison:
    """Persons beside measured bodies.

    Attributes:
        men: the measured men, each with the person of his stature and mass.
        persons: three of each sex: mean, and two standard deviations shorter and one lighter, two
            taller and one heavier.
    """

    men: tuple[tuple[MeasuredMan, WholePerson], ...]
    persons: Mapping[Sex, tuple[WholePerson, ...]]

    def mean(self, sex: Sex) -> WholePerson:
        """The person of mean stature and mass."""
        return self.persons[sex][1]

    @cached_property
    def _wholes(self) -> Mapping[str, Sequence[MassProperties]]:
        """Mass properties of the men's persons by posture."""
        return {
            name: [person.whole(posture) for _, person in self.men]
            for name, posture in MEASURED_POSTURES.items()
        }

    def inertia_ratios(self, posture: str) -> Array:
        """Moment of inertia over the measured one, shape (men, 3)."""
        axes = list(_AXES.values())
        own = np.array([np.diag(whole.inertia)[axes] for whole in self._wholes[posture]])
        return own / np.array([man.postures[posture].moments for man, _ in self.men])

    def centre_differences(self, posture: str) -> Array:
        """Distance of the centre of mass from the top of the head, less the measured one, (men,).

        In % of the stature.
        """
        heights = np.array([whole.centre[1] for whole in self._wholes[posture]])
        measured = np.array([man.postures[posture].centre_depth for man, _ in self.men])
        statures = np.array([man.stature for man, _ in self.men])
        return 100.0 * (statures - heights - measured) / statures

    def dimension_differences(self, name: str) -> Mapping[Sex, Array]:
        """Dimension of the persons less the expected one of the survey, shape (3,) [m]."""
        return {
            sex: np.array([one.dimensions[name] - _expected(name, one)[0] for one in persons])
            for sex, persons in self.persons.items()
        }


def compare_whole_bodies() -> Comparison:
    """Build the persons."""
    men, persons = person_facts().men, dict[Sex, tuple[WholePerson, ...]]()
    for sex, sample in survey().samples.items():
        stature, mass = sample.stature, sample.mass
        sizes = [
            (stature.mean + 2.0 * side * stature.deviation, mass.mean + side * mass.deviation)
            for side in (-1.0, 0.0, 1.0)
        ]
        persons[sex] = tuple(build_whole_person(sex, *size) for size in sizes)
    return Comparison(
        tuple((man, build_whole_person(Sex.MALE, man.stature, man.mass)) for man in men), persons
    )


def _caption(made: Comparison) -> str:
    man, sitting = made.mean(Sex.MALE), made.mean(Sex.MALE).poses(SITTING)
    straight = np.mean(
        [
            person.whole(_STRAIGHT).inertia[1, 1] / one.postures[STANDING].moments[2]
            for one, person in made.men
        ]
    )
    stances = [standing_stance(person.person.body) for _, person in made.men]
    arms, legs = ([round(degrees(getattr(one, name))) for one in stances] for name in _STANCE)
    thigh, torso = (
        surface_points(man.surfaces, sitting, [name])[:, 1].min()
        for name in ("left_upper_leg", "lower_torso")
    )
    return (
        "Above: the mean man of the survey, his centre of mass marked. Middle: moments of inertia "
        "about axes through the centre of mass, of persons of the stature and mass of three men "
        "over the men's own; the band is the largest error of their compound pendulum, 8 %. "
        "Spread, the arms are 45 deg above level and each leg is 30 deg out, which is assumed. "
        "Standing, the moment about the long axis is that of the men by the choice of the stance, "
        f"arms {min(arms)} to {max(arms)} deg and legs {max(legs)} deg out: with straight limbs it "
        f"is {straight:.2f} of the measured one. With the arms raised straight up it is too small. "
        "Below, left: place of the centre of mass on the long "
        "axis. Below, right: dimensions of persons of mean stature and mass, of two standard "
        "deviations of stature and one of mass less, and as much more, less those that the survey "
        "expects; bars: its standard error. None of these dimensions was used to build a person. "
        "Sitting height is measured from the underside of the lower torso's surface to the top of "
        "the head; the undersides of the thighs, whose flesh no seat compresses, lie "
        f"{1e3 * (torso - thigh):.0f} mm lower. The span is long because no clavicle moves the "
        "shoulders inwards as the arms rise."
    )


def _claims(made: Comparison) -> Iterator[Claim]:
    facts = person_facts().facts
    for sex in _WORDS:
        person = made.mean(sex)
        yield facts["centre_of_mass_height"].compare(
            f"Height of the centre of mass of the mean {_WORDS[sex]}, standing",
            float(person.whole({}).centre[1]) / person.person.measures.stature,
        )
    for posture in MEASURED_POSTURES:
        words, ratios = _words(posture), made.inertia_ratios(posture).mean(axis=0)
        for axis, ratio in zip(_AXES, ratios.tolist(), strict=True):
            yield facts["body_inertia_ratio"].compare(
                f"{words.capitalize()}: moment of inertia about the {axis} axis over the measured "
                "one, mean of three men",
                ratio,
                remark="the person's arms are straight up from their joints",
            )
        yield facts["centre_of_mass_difference"].compare(
            f"{words.capitalize()}: distance of the centre of mass from the top of the head, less "
            "the measured one, mean of three men",
            float(made.centre_differences(posture).mean()),
        )
    yield incomparable_claim(
        "Sitting: moments of inertia of three men",
        "the page does not state which of three seated postures it shows; its numbers suggest "
        "raised thighs",
    )
    for name in DIMENSIONS:
        for sex, differences in made.dimension_differences(name).items():
            error = 1e3 * _expected(name, made.mean(sex))[1]
            yield comparison(
                f"{_words(name).capitalize()} of the mean {_WORDS[sex]} less that of the survey, "
                "within its standard error",
                1e3 * float(differences[1]),
                "mm",
                -error,
                error,
                _REMARKS.get(name, ""),
            )


_REMARKS = {
    "span": "no clavicle moves the shoulders inwards as the arms rise",
    "sitting_height": "it is measured on flesh that no seat compresses",
}
"""Likely reasons of differences, by dimension."""


_STRIP = Strip(
    View(turn=radians(35.0), tilt=radians(8.0)),
    spacing=1.75,
    left=-0.95,
    right=0.95,
    bottom=-0.1,
    top=2.25,
    floor=None,
    scale=110.0,
)


def _draw(made: Comparison) -> Figure:
    figure = create_canvas(8.2)
    grid = figure.add_gridspec(3, 2, height_ratios=(1.25, 1.0, 1.0))
    _draw_postures(figure.add_subplot(grid[0, :]), made.mean(Sex.MALE))
    _draw_ratios(figure.add_subplot(grid[1, :]), made)
    _draw_centres(figure.add_subplot(grid[2, 0]), made)
    _draw_dimensions(figure.add_subplot(grid[2, 1]), made)
    return figure


def _draw_postures(axes: Axes, person: WholePerson) -> None:
    postures = {**MEASURED_POSTURES, "sitting": SITTING}
    draw_strip(axes, _STRIP, person.surfaces, [person.poses(each) for each in postures.values()])
    for place, (name, posture) in enumerate(postures.items()):
        at = place * _STRIP.spacing
        axes.text(at, _STRIP.bottom, _words(name), ha="center", va="top", fontsize=8.0)
        x, y, _ = _STRIP.view.axes @ person.whole(posture).centre
        draw_marks(axes, [x + at], [y], LineStyle(BLACK, "", "o"))


def _words(name: str) -> str:
    return name.replace("_", " ")


def _draw_ratios(axes: Axes, made: Comparison) -> None:
    fact = person_facts().facts["body_inertia_ratio"]
    draw_range(axes, fact.low, fact.high)
    axes.axhline(1.0, color=BLACK, lw=0.8)
    places: list[float] = []
    for group, posture in enumerate(MEASURED_POSTURES):
        ratios = made.inertia_ratios(posture)
        x = 3.5 * group + np.arange(len(_AXES))
        places += x.tolist()
        for (man, _), row, style in zip(made.men, ratios, LINE_STYLES, strict=False):
            label = f"man of {man.stature:.2f} m, {man.mass:.0f} kg" if not group else "_"
            draw_marks(axes, x, row, style, label)
        axes.text(x[1], 1.19, _words(posture), ha="center", va="top", fontsize=8.0)
    labels = [name.replace("-", "-\n") for name in _AXES]
    axes.set_xticks(places, labels * len(MEASURED_POSTURES), fontsize=7.0)
    axes.set(xlim=(-0.8, places[-1] + 2.4), ylim=(0.6, 1.2))
    axes.set_ylabel("moment of inertia\nover the measured one")
    axes.grid(visible=False, axis="x")
    axes.legend(loc="lower right", fontsize=6.5)


def _draw_centres(axes: Axes, made: Comparison) -> None:
    fact = person_facts().facts["centre_of_mass_difference"]
    draw_range(axes, fact.low, fact.high)
    draw_zero_line(axes)
    for place, posture in enumerate(MEASURED_POSTURES):
        for value, style in zip(made.centre_differences(posture), LINE_STYLES, strict=False):
            draw_marks(axes, [place], [value], style)
    axes.set_xlim(-0.5, len(MEASURED_POSTURES) - 0.5)
    axes.set_xticks(range(len(MEASURED_POSTURES)), list(map(_words, MEASURED_POSTURES)))
    axes.set_ylabel("centre of mass below the\ntop: difference [% of stature]")


def _draw_dimensions(axes: Axes, made: Comparison) -> None:
    draw_zero_line(axes)
    for place, name in enumerate(DIMENSIONS):
        for side, (sex, values) in zip(
            (-0.15, 0.15), made.dimension_differences(name).items(), strict=True
        ):
            style = LINE_STYLES[0 if sex is Sex.MALE else 1]
            error = 1e3 * _expected(name, made.mean(sex))[1]
            ends = [place + side - 0.12, place + side + 0.12]
            axes.fill_between(ends, -error, error, color=PALE, lw=0.0)
            label = ("men" if sex is Sex.MALE else "women") if place == 0 else "_"
            x = place + side + np.array([-0.07, 0.0, 0.07])
            draw_marks(axes, x, 1e3 * values, style, label, 4.5)
    axes.set_xticks(range(len(DIMENSIONS)), list(map(_words, DIMENSIONS)))
    axes.set_ylabel("difference from\nthe survey [mm]")
    axes.legend(fontsize=6.5)


def _tables(made: Comparison) -> dict[str, Mapping[str, Array]]:
    return {
        "postures": {
            f"{_words(posture)}: {quantity}": values
            for posture in MEASURED_POSTURES
            for quantity, values in (
                *(
                    (f"{axis} moment of inertia over measured", made.inertia_ratios(posture)[:, k])
                    for k, axis in enumerate(_AXES)
                ),
                ("centre of mass, difference [% of stature]", made.centre_differences(posture)),
            )
        },
        "dimensions": {
            f"{_WORDS[sex]}: {_words(name)}, difference [m]": values
            for name in DIMENSIONS
            for sex, values in made.dimension_differences(name).items()
        },
    }


person_body = PlateDefinition(
    name="person_body",
    title="Whole persons beside measured ones",
    sign="Ratios are those of a person to the measured value, differences the person less the "
    "measured value.",
    references=(*person_facts().references("santschi_1963"), str(survey().reference)),
    collect=compare_whole_bodies,
    caption=_caption,
    draw=_draw,
    claims=_claims,
    tables=_tables,
)
