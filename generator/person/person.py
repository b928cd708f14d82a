"""A person: body, figure, surfaces and springs, and the sources of all numbers."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

from generator.diagnostics import UsageError, shorten
from generator.figure import Figure
from generator.geometry.surface import Surface
from generator.model import Model
from generator.person.body import Body, build_body
from generator.person.joints import Neck, limit_sources, person_figure, resolve_neck
from generator.person.measures import Measures, measure_sources
from generator.person.passive_joints import (
    HIP_DATUM,
    PERSON_SPRINGS,
    PassiveAxis,
    leg_springs,
    neck_slides,
    passive_axes,
    person_springs,
    reach_springs,
    spring_sources,
)
from generator.person.shape import body_surfaces, shape_sources
from generator.person.sources import SourcedNumber
from generator.person.stance import stance_sources
from generator.springs_file.parse import SPRINGS_FILE, SpringsFile
from generator.springs_file.read import load_springs
from generator.springs_file.write import write_springs


@dataclass(frozen=True)
class Person:
    """A person of a sex, stature and mass.

    Attributes:
        body: segments with their masses, and the places of the joints.
        figure: standing upright, with its springs; without psurfs until its files are written.
        surfaces: closed, outward, in the segments' frames [m], by their names without side.
        passive_axes: laws and damping of the joints, one an axis; empty where none were asked for.
        springs_file: the same as a springs file; None where none were asked for.
        riener_springs_file: springs of the legs with the law of hip and knee alone, which extend
            the others; None without springs, and where the others have this law.
        sources: sources of the numbers, in the order of the parts above.
    """

    body: Body
    figure: Figure
    surfaces: Mapping[str, Surface]
    passive_axes: tuple[PassiveAxis, ...]
    springs_file: SpringsFile | None
    riener_springs_file: SpringsFile | None
    sources: tuple[SourcedNumber, ...]

    def __repr__(self) -> str:
        """Sex, stature, mass and springs, in a line."""
        measures = self.measures
        return (
            f"<Person: {measures.sex.value}, {measures.stature:.6g} m, {measures.mass:.6g} kg, "
            f"axes with springs: {len(self.passive_axes)}>"
        )

    @property
    def measures(self) -> Measures:
        """Measures from which the person was made."""
        return self.body.measures

    @property
    def warnings(self) -> tuple[str, ...]:
        """Sentences on measures outside the samples."""
        return self.body.measures.warnings

    @cached_property
    def model(self) -> Model:
        """The figure with its springs, for `simulate`; stops alone without laws."""
        return Model.of(self.figure)

    @cached_property
    def riener_model(self) -> Model:
        """The figure with `riener_springs_file`; without it as `model`."""
        if self.riener_springs_file is None:
            return self.model
        file = Path(f"<riener>{SPRINGS_FILE.suffix}")
        text = write_springs(self.riener_springs_file)
        return Model(self.figure, load_springs(self.figure, choice=file, text=text).require_value())


def build_person(
    measures: Measures,
    springs: str = "published",
    hip_datum: float = HIP_DATUM,
    neck: Neck | None = None,
) -> Person:
    """Return the person of these measures.

    Args:
        measures: such as of `estimate_measures`.
        springs: "published", "riener" with the law of hip and knee alone, or "none"; "coupled" is
            "published".
        hip_datum: hip flexion of the upright person in the coordinate of Silder et al. [rad].
        neck: kind of the neck; an elastic one has three translations, and springs along them. None
            for `DEFAULT_NECK`, rigid without springs.

    Raises:
        UsageError: for unknown springs, an elastic neck without springs, and a hip datum beyond 0
            to 15 deg.
    """
    if springs not in PERSON_SPRINGS:
        known = ", ".join(PERSON_SPRINGS)
        raise UsageError(f"a person has no springs `{shorten(springs)}`; there are {known}")
    neck = resolve_neck(neck, springs)
    body = build_body(measures)
    figure = person_figure(body, neck)
    surfaces = body_surfaces(body)
    sources = (*measure_sources(measures), *body.sources, *limit_sources(body))
    sources += (*stance_sources(body), *shape_sources(body))
    if springs == "none":
        return Person(body, figure, surfaces, (), None, None, sources)
    axes = passive_axes(body)
    riener = leg_springs(body, axes, "riener")
    legs = (
        [riener] if springs == "riener" else [leg_springs(body, axes, hip_datum=hip_datum), riener]
    )
    reach = reach_springs(body, axes)
    sources += spring_sources(body, axes, (*legs, reach))
    slides = neck_slides(body) if neck is Neck.ELASTIC else ()
    sources += tuple(row for slide in slides for row in slide.sources)
    springs_file = person_springs(axes, legs[0], reach, slides)
    figure = replace(figure, springs_text=write_springs(springs_file))
    beside = None if springs == "riener" else riener
    return Person(body, figure, surfaces, axes, springs_file, beside, sources)
