"""Model of a person, without the sources of its numbers."""

from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache
from pathlib import Path

from generator.contact_file.parts import BodyContact
from generator.diagnostics import UsageError
from generator.figure import ContactSphere
from generator.model import Model
from generator.person.body import build_body
from generator.person.joints import Neck, person_figure, resolve_neck
from generator.person.measures import estimate_measures
from generator.person.passive_joints import (
    PERSON_SPRINGS,
    leg_springs,
    neck_slides,
    passive_axes,
    person_springs,
    reach_springs,
)
from generator.person.survey import Sex
from generator.springs_file.parse import SPRINGS_FILE
from generator.springs_file.read import load_springs
from generator.study.study import PersonArguments
from springs import SphericalLaw


def make_person(
    person: PersonArguments,
    measured: Mapping[str, float] | None = None,
    law: SphericalLaw | None = None,
    *,
    with_spheres: bool,
    stops_edges: bool = False,
) -> Model:
    """Return the model of a person.

    Figure and springs are those that `mover person` writes, but for the rounding of its files. The
    figure has contact spheres in place of psurfs, and these belong to parts of the body.

    Args:
        person: sex, stature, mass, springs, hip datum and neck.
        measured: dimensions by name [m].
        law: law of spherical joints; None for that of a springs file.
        with_spheres: whether the segments get contact spheres, which takes about half the time.
        stops_edges: whether limbs get further ones at which edges of boxes stop, which takes some
            two seconds.

    Raises:
        UsageError: for impossible measures, unknown springs, an impossible hip datum, and an
            elastic neck without springs.
    """
    if person.springs not in PERSON_SPRINGS:
        known = ", ".join(PERSON_SPRINGS)
        raise UsageError(f"a person has no springs `{person.springs}`; there are {known}")
    body = build_body(estimate_measures(person.sex, person.stature, person.mass, measured))
    neck = resolve_neck(person.neck, person.springs)
    figure = person_figure(body, neck)
    file, content = None, None
    if person.springs != "none":
        axes = passive_axes(body)
        kind = "riener" if person.springs == "riener" else "published"
        leg = leg_springs(body, axes, kind, person.hip_datum)
        file = Path(f"person{SPRINGS_FILE.suffix}")
        slides = neck_slides(body) if neck is Neck.ELASTIC else ()
        content = person_springs(axes, leg, reach_springs(body, axes), slides)
    loaded = load_springs(figure, choice=file, law=law, content=content).require_value()
    if not with_spheres:
        return Model(figure, loaded.springs)
    key = person.sex, person.stature, person.mass, tuple((measured or {}).items())
    spheres, contact = _spheres_and_parts(*key, stops_edges)
    segments = (
        replace(figure.segments[name], contact_spheres=some) for name, some in spheres.items()
    )
    return Model(figure.with_parts(*segments), loaded.springs, contact)


@lru_cache(maxsize=8)
def _spheres_and_parts(
    sex: Sex,
    stature: float,
    mass: float,
    measured: tuple[tuple[str, float], ...],
    stops_edges: bool,
) -> tuple[Mapping[str, tuple[ContactSphere, ...]], BodyContact]:
    """Return the contact spheres of the segments of a body, and its parts.

    Springs and hip datum have no effect on them.
    """
    from generator.person.contact_parts import person_contact
    from generator.person.shape import body_surfaces

    body = build_body(estimate_measures(sex, stature, mass, dict(measured)))
    figure, contact = person_contact(
        person_figure(body), body_surfaces(body), stops_edges=stops_edges
    )
    spheres = {name: segment.contact_spheres for name, segment in figure.bodies.items()}
    return spheres, contact
