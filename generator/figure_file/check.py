"""Checks of a figure: references, limits, masses and inertias, and the path from the root."""

import re
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import replace
from itertools import chain
from math import hypot, isfinite, pi
from pathlib import Path

from generator.diagnostics import (
    Diagnostic,
    Diagnostics,
    InputError,
    Span,
    TooManyErrors,
    error,
    select_errors,
    shorten,
    spelling_hint,
    warning,
)
from generator.figure import (
    CENTRE_OF_MASS_SITE,
    Figure,
    Joint,
    Rotation,
    Segment,
    SiteRef,
    follower_faults,
)
from generator.figure_file.resolve import FigureDraft, origin_span
from generator.text_io import is_file
from generator.units import MAX_MODEL_NUMBER

INERTIA_TRIANGLE_TOLERANCE = 1e-6
"""By how much, relative, one printed moment of inertia may exceed the sum of the other two."""

SUSPICIOUS_MASS_RANGE = (20.0, 65.0)
"""Between these masses [kg] a figure built like a person gets a note with a man's weight."""

PLAUSIBLE_MASS_RANGE = (1e-3, 1e3)
"""Mass of a segment outside which it gets a warning [kg]."""

MIN_BARE_MASS = 0.01
"""Masses without a unit get a warning where the largest of them is below this [kg]."""

MAX_SPHERE_DISTANCE = 1.0
"""Distance of a contact sphere from the sites of its segment above which it gets a warning [m]."""

OSMIUM_DENSITY = 22590.0
"""Density of the densest material [kg/m^3]."""

PERSON_ATTRIBUTE = "person"
"""Attribute that states the stature of a person, for which the mass was chosen."""

SEX_KEY, STATURE_KEY = "sex", "stature_m"
"""Its fields: "male" or "female", and the stature [m]."""

MEDIAN_MALE_MASS = 78.0
"""Mass of a 50th-percentile man [kg], rounded."""


FOLLOWER_HINT = "a follower's displacement is that of its curve: write this, or 0"


def check_figure(
    draft: FigureDraft, directory: Path | None, diagnostics: Diagnostics
) -> Figure | None:
    """Check the parts of a figure and build it; None, with the errors reported, if any is wrong.

    `directory` is where the geometry files lie; None when the figure comes from no file.
    """
    for segment in draft.segments.values():
        _check_inertia(segment, diagnostics)
        _check_attributes(segment, draft, diagnostics)
        _check_contact_spheres(segment, diagnostics)
    for joint in draft.joints.values():
        _check_joint(joint, draft, diagnostics)
    if directory is not None and not diagnostics.has_syntax_errors:
        _check_psurfs(draft.segments.values(), directory, diagnostics)
    if draft.root is None:
        if not diagnostics.is_incomplete and "root" not in draft.origins:
            diagnostics.error(
                "the figure has no root",
                draft.span,
                "write `root = SEGMENT.SITE;`: that site is held at the origin of the world",
            )
        return None
    root_place = draft.origins.get("root")
    root_found = _check_site(draft.root, "the root", root_place, draft, diagnostics)
    if not root_found or diagnostics.is_incomplete:
        return None
    figure = draft.build_figure(draft.root)
    if not diagnostics.has_errors:
        stated = {name: joint.displacement for name, joint in draft.joints.items()}
        for name, fault in follower_faults(draft.joints, stated, stated):
            place = origin_span(draft.joints[name].origins, "displacement")
            diagnostics.warning(fault, place, FOLLOWER_HINT)
    else:
        sound = {key: joint for key, joint in draft.joints.items() if _is_complete(joint, draft)}
        figure = Figure(draft.segments, sound, draft.root)
    if len(figure.joints) == len(draft.joints):
        _check_connectivity(figure, diagnostics)
        _check_ground(figure, diagnostics)
    diagnostics.entries.extend(
        warning(message, place, hint) for message, place, hint in _missing_mass_data(figure)
    )
    _check_centre_of_mass_frames(figure, diagnostics)
    _check_total_mass(figure, draft.span, diagnostics)
    _check_segment_masses(figure, diagnostics)
    _check_bare_inertias(figure, diagnostics)
    return None if diagnostics.has_errors else figure


def require_valid_figure(figure: Figure, *, to_simulate: bool = False) -> None:
    """Check a figure that was made or changed in Python as a file is checked.

    The errors have no place in a file, since the values may be other than those that it states.

    Args:
        figure: the figure.
        to_simulate: whether missing masses of moving segments are errors.

    Raises:
        InputError: with all errors.
    """
    segments = {
        name: replace(
            segment,
            sites={key: replace(site, origins={}) for key, site in segment.sites.items()},
            origins={},
        )
        for name, segment in figure.segments.items()
    }
    draft = FigureDraft(
        None,
        figure.name,
        segments,
        {name: replace(joint, origins={}) for name, joint in figure.joints.items()},
        dict(figure.attributes),
        figure.root,
    )
    diagnostics = Diagnostics()
    with suppress(TooManyErrors):
        check_figure(draft, None, diagnostics)
    errors = select_errors(diagnostics.entries)
    if to_simulate and not errors:
        errors = simulation_diagnostics(draft.build_figure(figure.root))
    if errors:
        raise InputError(errors)


def simulation_diagnostics(figure: Figure) -> tuple[Diagnostic, ...]:
    """Errors of a simulation that are warnings on reading: missing masses of moving segments."""
    faults = (*_missing_mass_data(figure), *_immense_numbers(figure))
    return tuple(error(message, place, hint) for message, place, hint in faults)


def _immense_numbers(figure: Figure) -> Iterable[tuple[str, Span | None, str]]:
    """Masses, inertias and sites with which a motion cannot be computed: message, place, hint."""
    hint = f"at most {MAX_MODEL_NUMBER:.0e} in SI units"
    for name, segment in figure.bodies.items():
        spheres = [(*each.centre, each.radius) for each in segment.contact_spheres]
        numbers = {
            "mass": (segment.mass or 0.0,),
            "inertia": segment.inertia or (),
            "contact": tuple(chain.from_iterable(spheres)),
        }
        for field, values in numbers.items():
            if any(abs(value) > MAX_MODEL_NUMBER for value in values):
                message = f"the {field} of `{shorten(name)}` is too large"
                yield message, origin_span(segment.origins, field), hint
        for site in segment.sites.values():
            if not abs(site.pose_in_segment).max() <= MAX_MODEL_NUMBER:
                message = f"site `{shorten(site.name)}` of `{shorten(name)}` is too far away"
                yield message, origin_span(site.origins, "location"), hint


def _check_inertia(segment: Segment, diagnostics: Diagnostics) -> None:
    """Check that moments of inertia are positive and none exceeds the sum of the others."""
    if segment.inertia is None:
        return
    place = origin_span(segment.origins, "inertia")
    if min(segment.inertia) <= 0.0:
        diagnostics.error(
            f"the inertia of `{shorten(segment.name)}` is not positive",
            place,
            "every principal moment of a body with size is above zero",
        )
    elif 2.0 * max(segment.inertia) > sum(segment.inertia) * (1.0 + INERTIA_TRIANGLE_TOLERANCE):
        diagnostics.error(
            f"no body has the inertia of `{shorten(segment.name)}`: one moment exceeds the sum of "
            "the other two",
            place,
            "give the principal moments about the centre of mass",
        )


def _check_attributes(segment: Segment, draft: FigureDraft, diagnostics: Diagnostics) -> None:
    if diagnostics.has_syntax_errors:
        return
    for name in segment.attributes:
        if name not in draft.attributes:
            diagnostics.error(
                _with_owner(
                    f"there is no attribute `{shorten(name)}`",
                    f"segment `{shorten(segment.name)}`",
                    place := origin_span(segment.origins, f"attribute {name}"),
                ),
                place,
                spelling_hint(name, draft.attributes) or "the figure defines no attributes",
            )


def _check_contact_spheres(segment: Segment, diagnostics: Diagnostics) -> None:
    """Warn of spheres of the ground, and of the first one far from the segment's sites.

    The distance is that from the box around the sites.
    """
    if segment.contact_spheres and segment.has_ground_mass:
        diagnostics.warning(
            f"contact spheres of `{shorten(segment.name)}`, a part of the ground, touch nothing",
            origin_span(segment.origins, "contact"),
            "what a figure falls on is a prop of a scene file",
        )
        return
    points = [site.pose_in_segment[:3, 3].tolist() for site in segment.sites.values()]
    sides = [(min(along), max(along)) for along in zip(*points, strict=True)]
    for index, sphere in enumerate(segment.contact_spheres if sides else ()):
        outside = [
            max(low - part, part - high, 0.0)
            for (low, high), part in zip(sides, sphere.centre, strict=True)
        ]
        distance = hypot(*outside)
        if distance > MAX_SPHERE_DISTANCE:
            diagnostics.warning(
                f"a contact sphere of `{shorten(segment.name)}` is {distance:.3g} m away from the "
                "segment's sites",
                origin_span(segment.origins, f"contact {index}", "contact"),
                "a centre is in the segment's frame; a number without a unit is in cm",
            )
            return


def _with_owner(message: str, owner: str, place: Span | None) -> str:
    """Name the owner of a wrong reference in front of its message, where no place shows it."""
    return message if place is not None else f"{owner}: {message}"


def _check_joint(joint: Joint, draft: FigureDraft, diagnostics: Diagnostics) -> None:
    """Check the ends, limits and springs of a joint."""
    for end in ("parent", "child"):
        ref = joint.parent if end == "parent" else joint.child
        owner = f"{end} of joint `{shorten(joint.name)}`"
        _check_site(ref, owner, joint.origins.get(end), draft, diagnostics)
    if joint.parent.segment == joint.child.segment:
        diagnostics.error(
            f"joint `{shorten(joint.name)}` joins `{shorten(joint.parent.segment)}` to itself",
            origin_span(joint.origins, "connect"),
            "a joint connects two different segments",
        )
    lower, upper = joint.lower_limit or (), joint.upper_limit or ()
    if any(low > high for low, high in zip(lower, upper, strict=False)):
        diagnostics.error(
            f"a lower limit of `{shorten(joint.name)}` is above its upper limit",
            origin_span(joint.origins, "llimit"),
        )
    _check_followers(joint, draft, diagnostics)
    for word, values in (("stiff", joint.stiff), ("damp", joint.damp)):
        if min(values or (0.0,)) < 0.0:
            diagnostics.warning(
                f"`{word}` of `{shorten(joint.name)}` is negative: it drives the joint",
                origin_span(joint.origins, word),
                "a passive joint has none below zero",
            )


def _check_followers(joint: Joint, draft: FigureDraft, diagnostics: Diagnostics) -> None:
    """Check that displacements follow free ones of joints that are there."""
    for place, one in enumerate(joint.followers, 1):
        if one is None:
            continue
        control, span = draft.joints.get(one.joint), origin_span(joint.origins, "follow")
        follower = f"displacement {place} of `{shorten(joint.name)}`"
        if control is None or not 0 <= one.index < len(control.chain):
            message = f"{follower} follows one that the figure does not have"
            diagnostics.error(message, span, spelling_hint(one.joint, draft.joints))
        elif control.followers and control.followers[one.index] is not None:
            if (one.joint, one.index) == (joint.name, place - 1):
                message, hint = f"{follower} follows itself", "let it follow another, or be `free`"
            else:
                message = f"{follower} follows one of `{shorten(one.joint)}` that is not free"
                hint = "let both follow the same displacement"
            diagnostics.error(message, span, hint)


def _check_site(
    ref: SiteRef, owner: str, span: Span | None, draft: FigureDraft, diagnostics: Diagnostics
) -> bool:
    """Return whether the site exists; report it missing unless parts could not be read."""
    if _has_site(ref, draft):
        return True
    if diagnostics.has_syntax_errors:
        return False
    segment = draft.segments.get(ref.segment)
    if segment is None:
        diagnostics.error(
            _with_owner(f"there is no segment `{shorten(ref.segment)}`", owner, span),
            span,
            spelling_hint(ref.segment, draft.segments),
        )
    else:
        message = f"segment `{shorten(ref.segment)}` has no site `{shorten(ref.site)}`"
        diagnostics.error(
            _with_owner(message, owner, span),
            span,
            spelling_hint(ref.site, segment.sites) or "it has no sites at all",
        )
    return False


def _has_site(ref: SiteRef, draft: FigureDraft) -> bool:
    return ref.segment in draft.segments and ref.site in draft.segments[ref.segment].sites


def _is_complete(joint: Joint, draft: FigureDraft) -> bool:
    is_connection = joint.parent.segment != joint.child.segment
    return is_connection and _has_site(joint.parent, draft) and _has_site(joint.child, draft)


def _check_psurfs(segments: Iterable[Segment], directory: Path, diagnostics: Diagnostics) -> None:
    """One warning for each geometry file that is not beside the figure."""
    reported: set[str] = set()
    for segment in segments:
        name = segment.psurf
        if name is None or name in reported or is_file(directory / name):
            continue
        reported.add(name)
        diagnostics.warning(
            f"there is no file `{shorten(name)}` beside the figure",
            origin_span(segment.origins, "psurf"),
            "the segment has no shape; a run without contact is not affected",
        )


def _check_connectivity(figure: Figure, diagnostics: Diagnostics) -> None:
    """Check that joints connect every segment to the root."""
    neighbours: dict[str, set[str]] = {name: set() for name in figure.segments}
    for joint in figure.joints.values():
        neighbours[joint.parent.segment].add(joint.child.segment)
        neighbours[joint.child.segment].add(joint.parent.segment)
    reached, open_ends = {figure.root.segment}, [figure.root.segment]
    while open_ends:
        new = neighbours[open_ends.pop()] - reached
        reached |= new
        open_ends.extend(new)
    for name, segment in figure.segments.items():
        if name not in reached:
            diagnostics.error(
                f"no joints lead from the root to segment `{shorten(name)}`",
                origin_span(segment.origins),
                f"the root is `{shorten(str(figure.root))}`",
            )


def _check_ground(figure: Figure, diagnostics: Diagnostics) -> None:
    """Check that every segment of negative mass is fixed to the ground."""
    for name, segment in figure.bodies.items():
        if segment.has_ground_mass:
            diagnostics.error(
                f"`{shorten(name)}` has a negative mass but is not fixed to the ground",
                origin_span(segment.origins, "mass"),
                "a negative mass marks a part of the ground: the root's segment, or one that rigid "
                "joints hold to it",
            )


def _missing_mass_data(figure: Figure) -> Iterable[tuple[str, Span | None, str]]:
    """Missing masses, centres and inertias of moving segments: message, place and hint of each."""
    for name, segment in figure.bodies.items():
        if segment.has_ground_mass:
            continue
        place = origin_span(segment.origins)
        if not segment.mass and ("mass" not in segment.origins or segment.mass == 0.0):
            yield (
                f"segment `{shorten(name)}` moves but has no mass",
                origin_span(segment.origins, "mass"),
                "add `mass = ...g;`",
            )
            continue
        if CENTRE_OF_MASS_SITE not in segment.sites:
            yield (
                f"segment `{shorten(name)}` has a mass but no site `{CENTRE_OF_MASS_SITE}`",
                place,
                f"add `site {CENTRE_OF_MASS_SITE}->location = trans(...);`",
            )
        if segment.inertia is None and "inertia" not in segment.origins:
            yield (
                f"segment `{shorten(name)}` has a mass but no inertia",
                place,
                "add `inertia = (...);`, the principal moments about the centre of mass",
            )


def _check_centre_of_mass_frames(figure: Figure, diagnostics: Diagnostics) -> None:
    """Warn of a rotated centre of mass: only its position is used."""
    for segment in figure.bodies.values():
        site = segment.sites.get(CENTRE_OF_MASS_SITE)
        if site and any(isinstance(f, Rotation) and any(f.angles) for f in site.location.factors):
            diagnostics.warning(
                f"the orientation of `{CENTRE_OF_MASS_SITE}` in `{shorten(segment.name)}` "
                "is not used",
                origin_span(site.origins, "location"),
                "moments of inertia are along the segment's own axes",
            )


def _check_segment_masses(figure: Figure, diagnostics: Diagnostics) -> None:
    """Warn once of masses that look like kilograms without a unit, and of implausible masses."""
    segments = [one for one in figure.bodies.values() if one.mass and one.mass > 0.0]
    bare = [one for one in segments if _is_bare(one, "mass")]
    if bare and max(one.mass or 0.0 for one in bare) < MIN_BARE_MASS:
        first = bare[0]
        diagnostics.warning(
            f"a mass without a unit is in grams: `{shorten(first.name)}` has {first.mass:.4g} kg",
            origin_span(first.origins, "mass"),
            "write `kg` or `g` behind it",
        )
        segments = [one for one in segments if one not in bare]
    low, high = PLAUSIBLE_MASS_RANGE
    odd = [one for one in segments if not low <= (one.mass or 0.0) <= high]
    if odd:
        more = f", {len(odd) - 1} more are as unusual" if len(odd) > 1 else ""
        diagnostics.warning(
            f"segment `{shorten(odd[0].name)}` has a mass of {odd[0].mass:.4g} kg{more}",
            origin_span(odd[0].origins, "mass"),
            f"most segments have between {low:g} kg and {high:g} kg: check the unit",
        )


def _check_bare_inertias(figure: Figure, diagnostics: Diagnostics) -> None:
    """Warn once of inertias without a unit that no material is dense enough for."""
    bare = [
        one
        for one in figure.bodies.values()
        if one.inertia and one.mass and one.mass > 0.0 and _is_bare(one, "inertia")
    ]
    if bare and all(max(one.inertia or ()) < _least_inertia(one.mass or 0.0) for one in bare):
        first = bare[0]
        diagnostics.warning(
            f"an inertia without a unit is in g cm2: that of `{shorten(first.name)}` is "
            f"{max(first.inertia or ()):.3g} kg m2, too small for {first.mass:.4g} kg",
            origin_span(first.origins, "inertia"),
            "write `kg m2` or `g cm2` behind each number",
        )


def _least_inertia(mass: float) -> float:
    """Moment of inertia of the densest ball of a mass [kg m^2]."""
    radius = (3.0 * mass / (4.0 * pi * OSMIUM_DENSITY)) ** (1.0 / 3.0)
    return 0.4 * mass * radius**2


def sex_and_stature(figure: Figure) -> tuple[str, float] | None:
    """Return sex and stature [m] of a figure; None unless it states both, as a person does."""
    if PERSON_ATTRIBUTE not in figure.attributes:
        return None
    fields = figure.attributes[PERSON_ATTRIBUTE].fields
    sex, stature = fields.get(SEX_KEY), fields.get(STATURE_KEY)
    if not isinstance(sex, str) or not isinstance(stature, tuple) or len(stature) != 1:
        return None
    return (sex, stature[0]) if stature[0] > 0.0 and isfinite(stature[0]) else None


def _is_bare(segment: Segment, field: str) -> bool:
    """Return whether a field in a file has no unit; the `e` of an exponent is not one."""
    place = segment.origins.get(field)
    return place is not None and re.search(r"[A-DF-Za-df-z]", place.text) is None


def _check_total_mass(figure: Figure, span: Span | None, diagnostics: Diagnostics) -> None:
    """Note a light figure with a person's build, unless it states the person's stature.

    A person's build is eight moving segments or more with four free ends or more.
    """
    if PERSON_ATTRIBUTE in figure.attributes:
        return
    counts = dict.fromkeys(figure.bodies, 0)
    for joint in figure.joints.values():
        for name in {joint.parent.segment, joint.child.segment} & counts.keys():
            counts[name] += 1
    free_ends = sum(count == 1 for count in counts.values())
    low, high = SUSPICIOUS_MASS_RANGE
    if len(counts) >= 8 and free_ends >= 4 and low < figure.total_mass < high:
        diagnostics.note(
            f"total mass {figure.total_mass:.2f} kg is far below a 50th-percentile man's "
            f"(about {MEDIAN_MALE_MASS:.0f} kg)",
            span,
            "fine if intended; otherwise check the masses of the segments",
        )
