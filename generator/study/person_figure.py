"""Model of a person, without the sources of its numbers."""

from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache
from pathlib import Path

from generator.contact_file.parts import BodyContact
from generator.diagnostics import UsageError
from generator.figure import ContactSphere, Figure
from generator.model import Model
from generator.person.body import Body, build_body
from generator.person.joints import Neck, person_figure, resolve_neck
from generator.person.measures import estimate_measures
from generator.person.passive_joints import (
    PERSON_SPRINGS,
    PassiveAxis,
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
    key = person.sex, person.stature, person.mass, tuple((measured or {}).items())
    neck = resolve_neck(person.neck, person.springs)
    with_edges = stops_edges if with_spheres else None
    body, figure, axes, contact = _make_body(*key, neck, with_edges)
    file, content = None, None
    if person.springs != "none":
        kind = "riener" if person.springs == "riener" else "published"
        leg = leg_springs(body, axes, kind, person.hip_datum)
        file = Path(f"person{SPRINGS_FILE.suffix}")
        slides = neck_slides(body) if neck is Neck.ELASTIC else ()
        content = person_springs(axes, leg, reach_springs(body, axes), slides)
    springs = load_springs(figure, choice=file, law=law, content=content).require_value()
    return Model(figure, springs, contact)


@lru_cache(maxsize=8)
def _make_body(
    sex: Sex,
    stature: float,
    mass: float,
    measured: tuple[tuple[str, float], ...],
    neck: Neck,
    stops_edges: bool | None,
) -> tuple[Body, Figure, tuple[PassiveAxis, ...], BodyContact | None]:
    """Return the parts of a person that neither springs nor hip datum change.

    They are the body, the figure, its passive laws, and the parts of the body, which come with
    contact spheres; `stops_edges` is None without spheres.
    """
    body = build_body(estimate_measures(sex, stature, mass, dict(measured)))
    figure, axes = person_figure(body, neck), passive_axes(body)
    if stops_edges is None:
        return body, figure, axes, None
    spheres, contact = _spheres_and_parts(sex, stature, mass, measured, stops_edges)
    segments = (
        replace(figure.segments[name], contact_spheres=some) for name, some in spheres.items()
    )
    return body, figure.with_parts(*segments), axes, contact


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
