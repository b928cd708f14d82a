"""Whether the parts of a figure make a figure, and one that can move."""

from collections.abc import Iterable
from pathlib import Path

from generator.diagnostics import (
    Diagnostic,
    Diagnostics,
    Span,
    error,
    shorten,
    spelling_hint,
    warning,
)
from generator.figure import CENTRE_OF_MASS_SITE, Figure, Joint, Rotation, Segment, SiteRef
from generator.figure_file.resolve import FigureDraft, origin_span

INERTIA_TRIANGLE_TOLERANCE = 1e-6
"""By how much, relative, one printed moment of inertia may exceed the sum of the other two."""

SUSPICIOUS_MASS_RANGE = (20.0, 65.0)
"""Between these masses [kg] a figure built like a person is told what a man weighs."""

MEDIAN_MALE_MASS = 78.0
"""Mass of a 50th-percentile man [kg], rounded."""


def check_figure(
    draft: FigureDraft, directory: Path | None, diagnostics: Diagnostics
) -> Figure | None:
    """The figure that the parts make; None, with the faults noted, when they make none.

    `directory` is where the geometry files lie; None when the figure comes from no file.
    """
    for segment in draft.segments.values():
        _check_inertia(segment, diagnostics)
        _check_attributes(segment, draft, diagnostics)
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
    root_found = _check_site(draft.root, draft.origins.get("root"), draft, diagnostics)
    if not root_found or diagnostics.is_incomplete:
        return None
    figure = draft.build_figure(draft.root)
    if diagnostics.has_errors:
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
    return None if diagnostics.has_errors else figure


def simulation_diagnostics(figure: Figure) -> tuple[Diagnostic, ...]:
    """What reading lets pass with a warning but a simulation needs: masses of all that moves."""
    return tuple(error(message, place, hint) for message, place, hint in _missing_mass_data(figure))


def _check_inertia(segment: Segment, diagnostics: Diagnostics) -> None:
    """Moments of inertia are positive and no one exceeds the sum of the others."""
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
                f"there is no attribute `{shorten(name)}`",
                origin_span(segment.origins, f"attribute {name}"),
                spelling_hint(name, draft.attributes) or "the figure defines no attributes",
            )


def _check_joint(joint: Joint, draft: FigureDraft, diagnostics: Diagnostics) -> None:
    """A joint's ends exist and differ; its limits are in order; its springs resist."""
    for end in ("parent", "child"):
        ref = joint.parent if end == "parent" else joint.child
        _check_site(ref, joint.origins.get(end), draft, diagnostics)
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
    for word, values in (("stiff", joint.stiff), ("damp", joint.damp)):
        if min(values or (0.0,)) < 0.0:
            diagnostics.warning(
                f"`{word}` of `{shorten(joint.name)}` is negative: it drives the joint",
                origin_span(joint.origins, word),
                "a passive joint has none below zero",
            )


def _check_site(
    ref: SiteRef, span: Span | None, draft: FigureDraft, diagnostics: Diagnostics
) -> bool:
    """Whether the site is there; its absence is a fault unless parts could not be read."""
    if _has_site(ref, draft):
        return True
    if diagnostics.has_syntax_errors:
        return False
    segment = draft.segments.get(ref.segment)
    if segment is None:
        diagnostics.error(
            f"there is no segment `{shorten(ref.segment)}`",
            span,
            spelling_hint(ref.segment, draft.segments),
        )
    else:
        diagnostics.error(
            f"segment `{shorten(ref.segment)}` has no site `{shorten(ref.site)}`",
            span,
            spelling_hint(ref.site, segment.sites) or "it has no sites at all",
        )
    return False


def _has_site(ref: SiteRef, draft: FigureDraft) -> bool:
    return ref.segment in draft.segments and ref.site in draft.segments[ref.segment].sites


def _is_complete(joint: Joint, draft: FigureDraft) -> bool:
    apart = joint.parent.segment != joint.child.segment
    return apart and _has_site(joint.parent, draft) and _has_site(joint.child, draft)


def _check_psurfs(segments: Iterable[Segment], directory: Path, diagnostics: Diagnostics) -> None:
    """One warning for each geometry file that is not beside the figure."""
    told: set[str] = set()
    for segment in segments:
        name = segment.psurf
        if name is None or name in told or _is_file(directory / name):
            continue
        told.add(name)
        diagnostics.warning(
            f"there is no file `{shorten(name)}` beside the figure",
            origin_span(segment.origins, "psurf"),
            "the segment will have no shape; its motion is not affected",
        )


def _is_file(path: Path) -> bool:
    try:
        return path.is_file()
    except OSError:  # a name longer than any file's
        return False


def _check_connectivity(figure: Figure, diagnostics: Diagnostics) -> None:
    """Every segment hangs on the root, over whatever joints."""
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
    """A negative mass means ground, so it stands on what does not move."""
    for name, segment in figure.bodies.items():
        if segment.has_ground_mass:
            diagnostics.error(
                f"`{shorten(name)}` has a negative mass but is not fixed to the ground",
                origin_span(segment.origins, "mass"),
                "a negative mass marks a part of the ground: the root's segment, or one that rigid "
                "joints hold to it",
            )


def _missing_mass_data(figure: Figure) -> Iterable[tuple[str, Span | None, str]]:
    """What the moving segments lack: message, place and hint of each."""
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
    """Of the centre of mass only the position counts; who turns it may expect otherwise."""
    for segment in figure.bodies.values():
        site = segment.sites.get(CENTRE_OF_MASS_SITE)
        if site and any(isinstance(f, Rotation) and any(f.angles) for f in site.location.factors):
            diagnostics.warning(
                f"the orientation of `{CENTRE_OF_MASS_SITE}` in `{shorten(segment.name)}` is not used",
                origin_span(site.origins, "location"),
                "moments of inertia are along the segment's own axes",
            )


def _check_total_mass(figure: Figure, span: Span, diagnostics: Diagnostics) -> None:
    """Tell the author of a light figure with a person's build what a man weighs.

    A person's build is eight moving segments or more with four free ends or more.
    """
    counts = dict.fromkeys(figure.bodies, 0)
    for joint in figure.joints.values():
        for name in {joint.parent.segment, joint.child.segment} & counts.keys():
            counts[name] += 1
    free_ends = sum(count == 1 for count in counts.values())
    low, high = SUSPICIOUS_MASS_RANGE
    if len(counts) >= 8 and free_ends >= 4 and low < figure.total_mass < high:
        diagnostics.warning(
            f"total mass {figure.total_mass:.2f} kg is far below a 50th-percentile man's "
            f"(about {MEDIAN_MALE_MASS:.0f} kg)",
            span,
            "fine if this is meant; otherwise look at the segments' masses",
        )
