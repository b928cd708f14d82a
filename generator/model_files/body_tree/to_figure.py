"""From a tree of bodies to a figure: segments along principal axes, joints, carriers between them.

Freedoms of one body that no single joint can hold, since their axes miss each other or are oblique,
become several joints with carriers between them: segments with a tiny share of the body's mass.

The axes of a segment: those of its principal inertia, as near as can be to a body's own.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from itertools import permutations

import numpy as np

from generator.diagnostics import Findings, shorten
from generator.figure import (
    CENTRE_OF_MASS,
    Figure,
    Joint,
    Location,
    Segment,
    Shift,
    Site,
    SiteRef,
    Turn,
    Vector,
)
from generator.inertia import MassProperties
from generator.losses import Report
from generator.model_files.body_tree.joints import (
    Group,
    JointFields,
    groups_of,
    joint_fields,
    spring_entries,
)
from generator.model_files.body_tree.names import Names, common_stem
from generator.model_files.body_tree.tree import (
    Body,
    PassiveTree,
    with_mass_first,
    without_massless,
    without_rigid,
)
from generator.model_files.imported import Coordinate, Imported
from generator.model_files.xml_write import body_fixed_angles
from generator.rotations import Array, homogeneous
from generator.springs_file.parse import SpringEntry, SpringsFile

DIAGONAL = 1e-12
"""Off-diagonal parts of a tensor that count as rounding, relative to its largest part."""


def principal_frame(mass: MassProperties) -> Array:
    """Rotation of the principal axes in the body's frame, shape (3, 3).

    The body's own axes where they are principal. Else each of them has the principal axis that is
    nearest to it, so that a tensor that is nearly diagonal turns the axes by little.
    """
    tensor = mass.inertia
    if np.abs(tensor - np.diag(np.diag(tensor))).max() <= DIAGONAL * np.abs(tensor).max():
        return np.eye(3)
    axes = np.linalg.eigh(tensor)[1]
    best = max(permutations(range(3)), key=lambda order: float(_nearness(axes, order).sum()))
    chosen = axes[:, list(best)]
    chosen = chosen * np.where(np.diag(chosen) < 0.0, -1.0, 1.0)
    if np.linalg.det(chosen) < 0.0:
        chosen[:, int(np.argmin(np.abs(np.diag(chosen))))] *= -1.0
    return chosen


def _nearness(axes: Array, order: tuple[int, ...]) -> Array:
    return np.abs(axes[[0, 1, 2], list(order)])


SHARE = 1e-10
"""Part of a body's mass and inertia that each carrier gets."""

WORLD = "world"
ORIGIN = "origin"
FRAME = "frame"
"""Site of a segment that has the axes of the model's body."""

NOISE = 1e-15
"""Angles [rad] and lengths [m] below this are rounding errors and are written as zero."""

_FREE = JointFields(None, None, None, None, None)


@dataclass
class _Draft:
    """The figure as it grows.

    Attributes:
        report: for what the figure does not hold.
        apart: see `figure_of`.
        turned: by the model's body (None is the world), the name of its segment and the rotation of
            the segment's axes in the body's frame.
        sites: of each segment, poses in the segment.
    """

    report: Report
    apart: bool
    segments: dict[str, Segment] = field(default_factory=dict[str, Segment])
    sites: dict[str, dict[str, Array]] = field(default_factory=dict[str, dict[str, Array]])
    joints: dict[str, Joint] = field(default_factory=dict[str, Joint])
    entries: list[SpringEntry] = field(default_factory=list[SpringEntry])
    coordinates: dict[str, Coordinate] = field(default_factory=dict[str, Coordinate])
    segment_names: Names = field(default_factory=Names)
    joint_names: Names = field(default_factory=Names)
    site_names: dict[str, Names] = field(default_factory=dict[str, Names])
    turned: dict[str | None, tuple[str, Array]] = field(
        default_factory=dict[str | None, tuple[str, Array]]
    )

    def add_segment(
        self,
        name: str,
        mass: MassProperties | None,
        sites: Mapping[str, Array],
        *,
        carrier: bool = False,
    ) -> tuple[str, Array]:
        """A segment for a body; its name, and the rotation of its axes in the body's frame."""
        names = self.segment_names
        given = names.made(name) if carrier else names.taken(name)
        turn = np.eye(3) if mass is None else principal_frame(mass)
        names = self.site_names[given] = Names()
        names.keep(sites)
        self.sites[given] = {}
        moments = None
        if mass is not None:
            names.taken(CENTRE_OF_MASS)
            self.sites[given][CENTRE_OF_MASS] = homogeneous(np.eye(3), turn.T @ mass.centre)
            moments = _vector(np.diag(turn.T @ mass.inertia @ turn))
        self.segments[given] = Segment(given, None if mass is None else mass.mass, moments)
        for site, pose in ((FRAME, np.eye(4)), *sites.items()):
            self.add_site(given, turn, site, pose)
        return given, turn

    def add_site(self, segment: str, turn: Array, name: str, pose_in_body: Array) -> str:
        """A site of a segment; its name."""
        given = self.site_names[segment].taken(name)
        self.sites[segment][given] = homogeneous(turn.T, np.zeros(3)) @ pose_in_body
        return given

    def add_end(self, body: str | None, name: str, pose_in_body: Array) -> SiteRef:
        """A site on the segment of one of the model's bodies (None is the world)."""
        segment, turn = self.turned[body]
        return SiteRef(segment, self.add_site(segment, turn, name, pose_in_body))

    def figure(self, root: SiteRef, name: str | None) -> Figure:
        """The whole."""
        segments = {
            key: Segment(
                key,
                segment.mass,
                segment.inertia,
                sites={site: Site(site, location_of(pose)) for site, pose in sites.items()},
            )
            for (key, segment), sites in zip(
                self.segments.items(), self.sites.values(), strict=True
            )
        }
        return Figure(segments, self.joints, root, name=name)


def figure_of(
    tree: PassiveTree,
    findings: Findings,
    report: Report,
    *,
    apart: bool = False,
    held: frozenset[str] = frozenset(),
) -> Imported | None:
    """The figure of a tree; None, with the faults noted, when the tree makes none.

    Args:
        tree: as the model has it.
        findings: for faults.
        report: for what the figure does not hold.
        apart: whether hinges with springs, damping or limits each become a joint of their own, with
            carriers between them; else hinges through one point become one joint, whose laws act on
            its rotation vector.
        held: bodies without freedoms that stay bodies, held rigidly.
    """
    if findings.has_errors:
        # What seems to be missing may stand where the model could not be read.
        return None
    whole = without_rigid(with_mass_first(tree), held)
    kept = {body.name for body in whole.bodies}
    merged = [body.name for body in tree.bodies if body.name not in kept]
    if merged:
        report.lose("bodies without a joint are parts of what they are fixed to", *merged)
    whole, gone = without_massless(whole)
    if gone:
        report.lose("bodies without mass are parts of the next one's joint", *gone)
    _check(whole, findings)
    if findings.has_errors:
        return None
    draft = _Draft(report, apart)
    draft.segment_names.keep(body.name for body in whole.bodies)
    draft.joint_names.keep(name for body in whole.bodies for name in _joint_names(body))
    ground, turn = draft.add_segment(WORLD, None, {})
    root = draft.add_site(ground, turn, ORIGIN, homogeneous(tree.up.T, np.zeros(3)))
    draft.site_names[ground].keep(whole.sites)
    for name, pose in whole.sites.items():
        draft.add_site(ground, turn, name, pose)
    draft.turned[None] = ground, turn
    for body in whole.bodies:
        _hang(draft, body)
    _report_names(draft)
    name = None if tree.name is None else Names().taken(tree.name)
    springs = SpringsFile(tuple(draft.entries)) if draft.entries else None
    figure = draft.figure(SiteRef(ground, root), name)
    return Imported(figure, springs, report.losses, draft.coordinates)


def _check(tree: PassiveTree, findings: Findings) -> None:
    """Bodies that move have a mass and an inertia, and there are some."""
    for body in tree.bodies:
        try:
            mass = body.whole_mass
        except ValueError as failure:
            findings.error(
                f"the inertia of `{shorten(body.name)}` is none: {failure}",
                body.place,
                "the principal moments of a body are positive, none above the sum of the others",
            )
            continue
        if mass is None:
            findings.error(
                f"`{shorten(body.name)}` moves but has no mass",
                body.place,
                "every body that moves needs mass and inertia",
            )
        elif np.linalg.eigvalsh(mass.inertia)[0] <= 0.0:
            findings.error(
                f"the inertia of `{shorten(body.name)}` is not positive",
                body.place,
                "every principal moment of a body with size is above zero",
            )
    if not tree.bodies and not findings.has_errors:
        findings.error("nothing in this model moves", tree.place, "a figure has at least one joint")


def _hang(draft: _Draft, body: Body) -> None:
    """The segment of a body, its joints, and the carriers between them."""
    whole = body.whole_mass
    assert whole is not None, "checked before"
    groups = groups_of(body.freedoms, apart=draft.apart)
    carried = max(len(groups) - 1, 0)
    mass = whole.with_mass(whole.mass * (1.0 - carried * SHARE))
    asked = [_joint_name(body, group, len(groups)) for group in groups] or [body.joint or body.name]
    own, given = _joint_names(body), draft.joint_names
    names = [given.taken(name) if name in own else given.made(name) for name in asked]
    parent, pose = body.parent, body.pose
    for k, group in enumerate(groups[:-1], start=1):
        name = f"{body.name}/{k}"
        draft.report.lose(
            "joints of one body that stay apart, since their axes miss each other, are oblique or "
            f"have springs of their own: a segment of {SHARE:g} of its mass stands between them",
            f"{body.name} ({', '.join(freedom.name for freedom in body.freedoms)})",
        )
        draft.turned[name] = draft.add_segment(
            f"{body.name}_{k}", _carrier(whole, group), {}, carrier=True
        )
        _join(draft, names[k - 1], (parent, name), pose, group)
        parent, pose = name, np.eye(4)
    draft.turned[body.name] = draft.add_segment(body.name, mass, body.sites)
    _join(draft, names[-1], (parent, body.name), pose, groups[-1] if groups else None)


def _carrier(mass: MassProperties, group: Group) -> MassProperties:
    """The tiny body between two joints, round about the first one's centre."""
    mean = float(np.trace(mass.inertia)) / 3.0
    return MassProperties(SHARE * mass.mass, np.asarray(group.centre), SHARE * mean * np.eye(3))


def _join(
    draft: _Draft,
    name: str,
    ends: tuple[str | None, str],
    pose_in_parent: Array,
    group: Group | None,
) -> None:
    """A joint between the segments of two of the model's bodies; rigid without a group."""
    frame = np.eye(4) if group is None else homogeneous(group.frame, np.asarray(group.centre))
    parent = draft.add_end(ends[0], name, pose_in_parent @ frame)
    child = draft.add_end(ends[1], f"to_{name}", frame)
    if group is None:
        draft.joints[name] = Joint(name, parent, child)
        return
    fields = joint_fields(group, name, draft.report)
    draft.entries += spring_entries(group, name, draft.report)
    inner_first = tuple(reversed(group.freedoms))
    draft.joints[name] = Joint(
        name,
        parent,
        child,
        chain=group.chain,
        displacement=tuple(freedom.value for freedom in inner_first),
        stiff=fields.stiff,
        rest=fields.rest,
        damp=fields.damp,
        lower_limit=fields.lower_limit,
        upper_limit=fields.upper_limit,
    )
    for place, freedom in enumerate(inner_first):
        draft.coordinates[freedom.name] = Coordinate(name, place, freedom.shift, freedom.scale)
    hinges = [freedom for freedom in group.turns if not freedom.whole]
    if len(group.turns) > 1 and any(freedom.is_passive for freedom in hinges):
        draft.report.lose(
            "springs, damping and limits of hinges that make one joint, which act on its rotation "
            "vector instead of on each angle",
            name,
        )


def _joint_names(body: Body) -> set[str]:
    """What the model calls joints of a body."""
    words = {word for freedom in body.freedoms for word in (freedom.name, freedom.whole)}
    return {*words, body.joint} - {""}


def _joint_name(body: Body, group: Group, count: int) -> str:
    """The model's name of the joint, or what its freedoms are called together."""
    if count == 1 and body.joint:
        return body.joint
    if len(group.freedoms) == 1:
        return group.freedoms[0].name
    words = {freedom.whole for freedom in group.freedoms}
    if len(words) == 1 and "" not in words:
        return words.pop()
    return common_stem(tuple(freedom.name for freedom in group.freedoms)) or body.name


def _report_names(draft: _Draft) -> None:
    """Tell names that changed, and which displacement of a joint each coordinate is."""
    sites = [names.changed for names in draft.site_names.values()]
    renamed = {**draft.segment_names.changed, **draft.joint_names.changed}
    for changed in sites:
        renamed |= changed
    if renamed:
        draft.report.lose(
            "names that the figure language does not have or has given already",
            *(f"`{shorten(name)}` is `{shorten(word)}`" for name, word in renamed.items()),
        )
    for name, joint in draft.joints.items():
        if len(joint.chain) > 1:
            inside = [key for key, where in draft.coordinates.items() if where.joint == name]
            draft.report.lose(
                "coordinates that are displacements of one joint, in this order",
                f"{name} ({', '.join(sorted(inside, key=lambda key: _place(draft, key)))})",
            )


def _place(draft: _Draft, key: str) -> int:
    return draft.coordinates[key].place


def location_of(pose: Array) -> Location:
    """`xyz(...) * trans(...)` of a pose (4, 4), without what is the identity."""
    angles, offset = _vector(body_fixed_angles(pose[:3, :3])), _vector(pose[:3, 3])
    factors: list[Turn | Shift] = [Turn(angles)] if any(angles) else []
    return Location((*factors, Shift(offset)))


def _vector(values: Iterable[float]) -> Vector:
    x, y, z = (0.0 if abs(value) < NOISE else float(value) for value in values)
    return x, y, z
