"""Conversion of a body tree into a figure.

Segments have principal axes of inertia, as close as possible to the axes of the body. Degrees of
freedom of one body whose axes do not meet or are oblique become several joints with carriers
between them: segments with a tiny share of the body's mass.

Bodies that no engine can move as they are, without mass or of impossible inertia, are repaired:
models have them from rounding in CAD programs, as point masses, or as frames at the ends of chains.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import permutations, takewhile
from math import inf

import numpy as np

from generator.diagnostics import Diagnostics, shorten
from generator.figure import (
    CENTRE_OF_MASS_SITE,
    Figure,
    Follower,
    Joint,
    Location,
    Rotation,
    Segment,
    Site,
    SiteRef,
    Translation,
    Vector,
)
from generator.figure_file.lexer import KEYWORDS, MAX_WORD_LENGTH
from generator.follower_curve import FollowerCurve
from generator.identifiers import free_name, plain_name
from generator.inertia import MassProperties
from generator.input_files.coordinates import CoordinateMapping
from generator.kinematics.placement import initial_displacements, pose_figure
from generator.kinematics.tree import build_tree
from generator.losses import Effect, Losses
from generator.model_files.body_tree.joints import (
    JointGroup,
    damping_entries,
    group_dofs,
    max_table_points,
    spring_entries,
    with_group,
    with_reachable_limits,
    without_laws,
)
from generator.model_files.body_tree.shapes import join_shapes, with_colours
from generator.model_files.body_tree.tree import (
    Body,
    BodyReach,
    BodyTree,
    add_new_names,
    merge_massless_bodies,
    merge_rigid_bodies,
    swap_massless_parents,
)
from generator.model_files.model_files import Imported
from generator.model_files.xml import body_fixed_angles
from generator.rotations import Array, pose_matrix
from generator.springs_file.parse import SpringEntry, SpringsFile
from generator.springs_file.reach import ReachEntry
from generator.springs_file.read import MAX_MIDDLE_LIMIT
from springs import SphericalLaw

_SUFFIX_LENGTH = 12
"""Characters that are left for a number at the end."""


@dataclass
class Names:
    """Names of one kind.

    Attributes:
        renamed: renamed by requested name, the name used instead.
    """

    renamed: dict[str, str] = field(default_factory=dict[str, str])
    _assigned: set[str] = field(default_factory=set[str])
    _protected: set[str] = field(default_factory=set[str])

    def protect(self, names: Iterable[str]) -> None:
        """Reserve the names of the model that need no change."""
        self._protected |= {name for name in names if _sanitise(name) == name}

    def assign(self, name: str) -> str:
        """Return the name for a requested one: the same if possible."""
        word = _sanitise(name)
        if word in self._assigned or (word in self._protected and word != name):
            word = free_name(word, self._assigned | self._protected)
        self._assigned.add(word)
        if word != name:
            self.renamed[name] = word
        return word

    def assign_new(self, stem: str) -> str:
        """Return a name for a part that the model does not have."""
        return self.assign(free_name(stem, self._protected))


def _sanitise(name: str) -> str:
    """Return the name, or the closest one that the figure language allows."""
    word = plain_name(name[: MAX_WORD_LENGTH - _SUFFIX_LENGTH])
    return f"{word}_" if word in KEYWORDS else word


def common_stem(names: tuple[str, ...]) -> str:
    """Return the common beginning and end of names: `hip_right` of `hip_x_right`, `hip_y_right`.

    Empty if they have nothing in common.
    """
    front = _common_prefix(names)
    back = _common_prefix([name[len(front) :][::-1] for name in names])[::-1]
    stem = f"{front.rstrip('_')}{back}" if front else back.lstrip("_")
    return stem if any(letter.isalpha() for letter in stem) else ""


def _common_prefix(names: Sequence[str]) -> str:
    letters = takewhile(lambda column: len(set(column)) == 1, zip(*names, strict=False))
    return "".join(column[0] for column in letters)


MAX_OFF_DIAGONAL = 1e-12
"""Off-diagonal parts of a tensor that count as rounding, relative to its largest part."""


def principal_frame(mass: MassProperties) -> Array:
    """Return the rotation of the principal axes in the body's frame, shape (3, 3).

    The identity if the body's axes are principal. Otherwise each axis is matched with the nearest
    principal axis, so that a nearly diagonal tensor rotates the axes by little.
    """
    tensor = mass.inertia
    if np.abs(tensor - np.diag(np.diag(tensor))).max() <= MAX_OFF_DIAGONAL * np.abs(tensor).max():
        return np.eye(3)
    axes = np.linalg.eigh(tensor)[1]
    best = max(
        permutations(range(3)), key=lambda order: float(np.abs(np.diag(axes[:, list(order)])).sum())
    )
    chosen = axes[:, list(best)]
    chosen = chosen * np.where(np.diag(chosen) < 0.0, -1.0, 1.0)
    if np.linalg.det(chosen) < 0.0:
        chosen[:, int(np.argmin(np.abs(np.diag(chosen))))] *= -1.0
    return chosen


CARRIER_SHARE = 1e-9
"""Share of a body's mass and inertia in a carrier; it changes accelerations by about as much."""

LEAST_CARRIER = 2e-15
"""Least mass and moment of inertia of a carrier [kg, kg m2]: MuJoCo refuses those below 1e-15."""

WORLD = "world"
ORIGIN = "origin"
FRAME = "frame"
"""Site of a segment that has the axes of the model's body."""

NOISE = 1e-15
"""Rounding errors [rad or m]: smaller values are written as zero."""

HINGES_AS_ONE = "laws of hinges that form one joint act on its rotation vector, not on each angle"

POLE = (
    "three hinges that form one joint have a pole: a run ends where the middle one comes to 90 deg "
    "(--apart keeps them apart, without a pole)"
)


@dataclass
class _FigureDraft:
    """The figure under construction.

    Attributes:
        losses: collects what the figure does not hold.
        separate: see `figure_from_tree`.
        max_points: max points of a spring's table.
        hinged: joints of several hinges with laws of each angle.
        balls: joints of several rotations whose laws are not of each angle.
        near_pole: joints of `hinged` of which nothing keeps the middle one of three from 90 deg.
        followers: joints and places of displacements that follow coordinates, with these and the
            curves.
        reaches: tables of the reaches of limbs.
        segment_frames: segment frames by body of the model (None is the world), the name of its
            segment and the rotation of the segment's axes in the body's frame.
        sites: sites of each segment, poses in the segment.
    """

    losses: Losses
    separate: bool
    max_points: int
    segments: dict[str, Segment] = field(default_factory=dict[str, Segment])
    sites: dict[str, dict[str, Array]] = field(default_factory=dict[str, dict[str, Array]])
    joints: dict[str, Joint] = field(default_factory=dict[str, Joint])
    springs_tables: list[SpringEntry] = field(default_factory=list[SpringEntry])
    coordinates: dict[str, CoordinateMapping] = field(default_factory=dict[str, CoordinateMapping])
    hinged: list[str] = field(default_factory=list[str])
    balls: list[str] = field(default_factory=list[str])
    near_pole: list[str] = field(default_factory=list[str])
    followers: list[tuple[str, int, str, FollowerCurve]] = field(
        default_factory=list[tuple[str, int, str, FollowerCurve]]
    )
    reaches: list[ReachEntry] = field(default_factory=list[ReachEntry])
    segment_names: Names = field(default_factory=Names)
    joint_names: Names = field(default_factory=Names)
    site_names: dict[str, Names] = field(default_factory=dict[str, Names])
    segment_frames: dict[str | None, tuple[str, Array]] = field(
        default_factory=dict[str | None, tuple[str, Array]]
    )

    def add_segment(
        self,
        name: str,
        mass: MassProperties | None,
        sites: Mapping[str, Array],
        *,
        is_carrier: bool = False,
    ) -> tuple[str, Array]:
        """Add the segment of a body; return its name and its axes in the body's frame, (3, 3)."""
        names = self.segment_names
        label = names.assign_new(name) if is_carrier else names.assign(name)
        turn = np.eye(3) if mass is None else principal_frame(mass)
        names = self.site_names[label] = Names()
        names.protect(sites)
        self.sites[label] = {}
        moments = None
        if mass is not None:
            names.assign(CENTRE_OF_MASS_SITE)
            self.sites[label][CENTRE_OF_MASS_SITE] = pose_matrix(np.eye(3), turn.T @ mass.centre)
            x, y, z = np.diag(turn.T @ mass.inertia @ turn).tolist()
            moments = x, y, z
        self.segments[label] = Segment(label, None if mass is None else mass.mass, moments)
        for site, pose in ((FRAME, np.eye(4)), *sites.items()):
            off = np.inf if mass is None else np.abs(pose[:3, 3] - mass.centre).max()
            if site != CENTRE_OF_MASS_SITE or off >= _SAME_PLACE:
                self.add_site(label, turn, site, pose)
        return label, turn

    def add_site(self, segment: str, turn: Array, name: str, pose_in_body: Array) -> str:
        """Add a site to a segment; return its name."""
        label = self.site_names[segment].assign(name)
        self.sites[segment][label] = pose_matrix(turn.T, np.zeros(3)) @ pose_in_body
        return label

    def add_joint_site(self, body: str | None, name: str, pose_in_body: Array) -> SiteRef:
        """Add a site to the segment of a body (None is the world)."""
        segment, turn = self.segment_frames[body]
        return SiteRef(segment, self.add_site(segment, turn, name, pose_in_body))

    def build_figure(self, root_site: SiteRef, name: str | None) -> Figure:
        """Return the figure."""
        segments = {
            key: Segment(
                key,
                segment.mass,
                segment.inertia,
                sites={site: Site(site, location_from_pose(pose)) for site, pose in sites.items()},
            )
            for (key, segment), sites in zip(
                self.segments.items(), self.sites.values(), strict=True
            )
        }
        return Figure(segments, self.joints, root_site, name=name)


_SAME_PLACE = 1e-6
"""Distance of a site called `CM` from the centre of mass at which it is that one [m]."""


def figure_from_tree(
    tree: BodyTree,
    diagnostics: Diagnostics,
    losses: Losses,
    *,
    separate: bool = False,
    fixed_bodies: frozenset[str] = frozenset(),
) -> Imported | None:
    """Convert a tree into a figure; None, with diagnostics, if that is impossible.

    Args:
        tree: tree as the model has it.
        diagnostics: collects errors.
        losses: collects what the figure does not hold.
        separate: make each revolute with springs, damping or limits a joint of its own, with
            carriers between them; otherwise revolutes through one point become one joint, under a
            law of coordinates if no ball of the model has laws.
        fixed_bodies: bodies without degrees of freedom that stay separate segments on rigid joints.
    """
    if diagnostics.has_errors:
        # What seems to be missing may be in a part that could not be read.
        return None
    whole = swap_massless_parents(fix_massless_ends(tree, losses))
    whole = merge_rigid_bodies(whole, losses, fixed_bodies)
    kept = {body.name for body in whole.bodies}
    merged = [body.name for body in tree.bodies if body.name not in kept]
    if merged:
        losses.add_description(
            "bodies without a joint become parts of those that they are fixed to", *merged
        )
    carried = {body.name: body for body in whole.bodies}
    whole, gone = merge_massless_bodies(whole)
    for name in gone:
        if carried[name].shapes:
            losses.add_description("shapes of bodies without mass", name)
        if np.any(carried[name].extra_inertia):
            losses.add("inertia of bodies without mass", name)
    if gone:
        losses.add("bodies without mass: their joints become parts of the next body's joint", *gone)
    whole = replace(whole, bodies=tuple(_moving_bodies(whole, losses)))
    _check_masses(whole, diagnostics)
    if diagnostics.has_errors:
        return None
    bodies = [
        replace(body, dofs=tuple(with_reachable_limits(dof, losses) for dof in body.dofs))
        for body in whole.bodies
    ]
    whole = replace(whole, bodies=tuple(bodies))
    max_points = max_table_points(dof for body in whole.bodies for dof in body.dofs)
    draft = _FigureDraft(losses, separate, max_points)
    draft.segment_names.protect(body.name for body in whole.bodies)
    draft.joint_names.protect(name for body in whole.bodies for name in _model_joint_names(body))
    ground, turn = draft.add_segment(WORLD, None, {})
    root = draft.add_site(ground, turn, ORIGIN, pose_matrix(tree.up_rotation.T, np.zeros(3)))
    draft.site_names[ground].protect(whole.sites)
    for name, pose in whole.sites.items():
        draft.add_site(ground, turn, name, pose)
    draft.segment_frames[None] = ground, turn
    for body in whole.bodies:
        _add_body(draft, body)
    _add_followers(draft)
    _add_name_losses(draft)
    name = None if tree.name is None else Names().assign(tree.name)
    springs = _springs_file(draft, tree)
    shapes = {ground: whole.shapes}
    for body in whole.bodies:
        segment, turn = draft.segment_frames[body.name]
        pose = pose_matrix(turn.T, np.zeros(3))
        shapes[segment] = tuple(shape.transformed(pose) for shape in body.shapes)
    surfaces, colours = join_shapes(shapes, losses)
    figure = with_colours(draft.build_figure(SiteRef(ground, root), name), colours)
    if draft.followers:
        figure = pose_figure(figure, initial_displacements(build_tree(figure)))
    return Imported(figure, springs, losses, draft.coordinates, surfaces)


def _add_followers(draft: _FigureDraft) -> None:
    """Let displacements follow those that the coordinates of the model became."""
    for name, place, control, curve in draft.followers:
        joint, at = draft.joints[name], draft.coordinates[control]
        followers = list(joint.followers or (None,) * len(joint.chain))
        followers[place] = Follower(at.joint, at.index, curve.of_line(at.scale, at.offset))
        draft.joints[name] = replace(joint, followers=tuple(followers))


def _springs_file(draft: _FigureDraft, tree: BodyTree) -> SpringsFile | None:
    """Return the springs beside the fields, with the law of joints of several rotations."""
    law = tree.law if tree.law is not SphericalLaw.CONSERVATIVE else None
    if draft.hinged and tree.law is None and not draft.balls:
        law = SphericalLaw.COORDINATES
        if draft.near_pole:
            draft.losses.add(POLE, *draft.near_pole)
    elif draft.hinged:
        draft.losses.add(f"{HINGES_AS_ONE} (--apart keeps them exact)", *draft.hinged)
    found = SpringsFile(tuple(draft.springs_tables), law=law, reaches=tuple(draft.reaches))
    return None if found == SpringsFile(()) else found


def _moving_bodies(tree: BodyTree, losses: Losses) -> Iterator[Body]:
    """Yield the bodies with mass and inertia that a body can have, where they carry any mass."""
    heaviest: dict[str | None, MassProperties] = {}
    for body in reversed(tree.bodies):
        here = body.mass or heaviest.get(body.name)
        if here is not None:
            heaviest[body.parent] = max(
                here, heaviest.get(body.parent, here), key=lambda each: each.mass
            )
    for body in tree.bodies:
        if body.mass is None and body.name in heaviest:
            what = f"bodies without mass between others have {CARRIER_SHARE:g} of the next one's"
            losses.add(what, body.name)
            carrier = replace(_carrier_mass(heaviest[body.name]), centre=np.zeros(3))
            yield replace(body, mass=carrier)
        else:
            yield with_possible_inertia(body, losses)


def _check_masses(tree: BodyTree, diagnostics: Diagnostics) -> None:
    """Check that the moving bodies have mass, and that there are some."""
    for body in tree.bodies:
        if body.mass is None:
            diagnostics.error(
                f"`{shorten(body.name)}` moves but has no mass",
                body.span,
                "every body that moves needs mass and inertia",
            )
    if not tree.bodies and not diagnostics.has_errors:
        diagnostics.error(
            "nothing in this model moves", tree.span, "a figure has at least one joint"
        )


def _add_body(draft: _FigureDraft, body: Body) -> None:
    """Add the segment of a body, its joints, and the carriers between them."""
    whole = body.total_mass_properties
    assert whole is not None, "checked before"
    groups = group_dofs(body.dofs, separate=draft.separate)
    carrier = _carrier_mass(whole)
    mass = whole.with_mass(whole.mass - max(len(groups) - 1, 0) * carrier.mass)
    asked = [_group_joint_name(body, group, len(groups)) for group in groups]
    asked = asked or [body.joint or body.name]
    own, joint_names = _model_joint_names(body), draft.joint_names
    names = [
        joint_names.assign(name) if name in own else joint_names.assign_new(name) for name in asked
    ]
    parent, pose = body.parent, body.pose
    for k, group in enumerate(groups[:-1], start=1):
        name = f"{body.name}/{k}"
        draft.losses.add(
            "hinges and slides of one body that are separate joints, as their axes are oblique, do "
            "not meet or have own springs; between them is a segment of "
            f"{CARRIER_SHARE:g} of its mass and inertia (at least {LEAST_CARRIER:g} kg m2), which "
            "changes its accelerations by about this share",
            f"{body.name} ({', '.join(freedom.name for freedom in body.dofs)})",
            effect=Effect.APPROXIMATION,
        )
        draft.segment_frames[name] = draft.add_segment(
            f"{body.name}_{k}", carrier, {}, is_carrier=True
        )
        _add_joint(draft, names[k - 1], (parent, name), pose, group, body.reach)
        parent, pose = name, np.eye(4)
    draft.segment_frames[body.name] = draft.add_segment(body.name, mass, body.sites)
    last = groups[-1] if groups else None
    _add_joint(draft, names[-1], (parent, body.name), pose, last, body.reach)


def _carrier_mass(mass: MassProperties) -> MassProperties:
    """Return the mass of a carrier of a body, centred where the body is.

    With what is left of the body it has the body's mass and centre of mass.
    """
    mean = float(np.trace(mass.inertia)) / 3.0
    return MassProperties(
        max(CARRIER_SHARE * mass.mass, LEAST_CARRIER),
        mass.centre,
        max(CARRIER_SHARE * mean, LEAST_CARRIER) * np.eye(3),
    )


def _add_joint(
    draft: _FigureDraft,
    name: str,
    ends: tuple[str | None, str],
    pose_in_parent: Array,
    group: JointGroup | None,
    reach: BodyReach | None,
) -> None:
    """Add a joint between the segments of two bodies; rigid without a group.

    A reach is the law of the joint of several rotations.
    """
    frame = np.eye(4) if group is None else pose_matrix(group.frame, np.asarray(group.centre))
    parent = draft.add_joint_site(ends[0], name, pose_in_parent @ frame)
    child = draft.add_joint_site(ends[1], f"to_{name}", frame)
    joint = Joint(name, parent, child)
    if group is None:
        draft.joints[name] = joint
        return
    for place, freedom in enumerate(reversed(group.dofs)):
        if freedom.curve is not None:
            draft.followers.append((name, place, freedom.control, freedom.curve))
            continue
        draft.coordinates[freedom.name] = CoordinateMapping(
            name, place, freedom.offset, freedom.scale
        )
    if reach is not None and len(group.rotations) > 1:
        draft.reaches.append(replace(reach.table, joints=(name,)))
        draft.springs_tables += [replace(law, joints=(name,)) for law in reach.laws]
        draft.springs_tables += damping_entries(group, name)
        group = replace(group, dofs=tuple(without_laws(dof) for dof in group.dofs))
    else:
        _add_law(draft, name, group)
    draft.joints[name] = with_group(joint, group, draft.losses)
    draft.springs_tables += spring_entries(group, name, draft.max_points, draft.losses)


def _add_law(draft: _FigureDraft, name: str, group: JointGroup) -> None:
    """Note whether the laws of a joint of several rotations are of each angle."""
    passive = [freedom for freedom in group.rotations if freedom.is_passive]
    if len(group.rotations) < 2 or not passive:
        return
    if any(freedom.joint for freedom in passive):
        draft.balls.append(name)
        return
    draft.hinged.append(name)
    if len(group.rotations) == 3:
        middle = group.rotations[1]
        known = middle.expected_range or (-inf, inf)
        low = known[0] if middle.lower is None else middle.lower
        high = known[1] if middle.upper is None else middle.upper
        if max(-low, high) > MAX_MIDDLE_LIMIT:
            draft.near_pole.append(name)


def _model_joint_names(body: Body) -> set[str]:
    """Return the names that the model uses for the joints of a body."""
    words = {word for freedom in body.dofs for word in (freedom.name, freedom.joint)}
    return {*words, body.joint} - {""}


def _group_joint_name(body: Body, group: JointGroup, count: int) -> str:
    """Return the model's name of the joint, or the common part of its coordinate names."""
    if count == 1 and body.joint:
        return body.joint
    if len(group.dofs) == 1:
        return group.dofs[0].name
    words = {freedom.joint for freedom in group.dofs}
    if len(words) == 1 and "" not in words:
        return words.pop()
    return common_stem(tuple(freedom.name for freedom in group.dofs)) or body.name


def _add_name_losses(draft: _FigureDraft) -> None:
    """Report changed names, and the displacement that each coordinate became."""
    renamed = {**draft.segment_names.renamed, **draft.joint_names.renamed}
    for names in draft.site_names.values():
        renamed |= names.renamed
    if renamed:
        add_new_names(draft.losses, renamed)
    for name, joint in draft.joints.items():
        if len(joint.free_places) > 1:
            own = {at.index: key for key, at in draft.coordinates.items() if at.joint == name}
            draft.losses.add_description(
                "coordinates that form one joint, in the order of its displacements",
                f"{name} ({', '.join(own[k] for k in sorted(own))})",
            )


def location_from_pose(pose: Array) -> Location:
    """Return `xyz(...) * trans(...)` of a pose (4, 4), without identities."""
    angles, offset = _vector(body_fixed_angles(pose[:3, :3])), _vector(pose[:3, 3])
    factors: list[Rotation | Translation] = [Rotation(angles)] if any(angles) else []
    return Location((*factors, Translation(offset)))


def _vector(values: Iterable[float]) -> Vector:
    x, y, z = (0.0 if abs(value) < NOISE else float(value) for value in values)
    return x, y, z


LEAST_RADIUS = 1e-3
"""Radius of the ball that a point mass becomes [m]."""

_NOISE = 1e-12
"""Moments that count as zero, relative to the largest."""


def fix_massless_ends(tree: BodyTree, losses: Losses) -> BodyTree:
    """Return the tree in which bodies that move no mass are fixed in the pose of the model.

    Without any mass in the tree nothing changes: it is for the caller to report that.
    """
    moves_mass = {body.name: body.mass is not None for body in tree.bodies}
    for body in reversed(tree.bodies):
        if body.parent is not None:
            moves_mass[body.parent] |= moves_mass[body.name]
    if not any(moves_mass.values()):
        return tree
    bodies: list[Body] = []
    for body in tree.bodies:
        kept = body
        if body.dofs and not moves_mass[body.name]:
            pose = body.pose
            for dof in body.dofs:
                pose = pose @ dof.pose
            kept = replace(body, pose=pose, dofs=(), joint="")
            what = "bodies without mass at the end of a chain are fixed, and so are their joints"
            losses.add(what, f"{body.name} ({', '.join(dof.name for dof in body.dofs)})")
        bodies.append(kept)
    return replace(tree, bodies=tuple(bodies))


def with_possible_inertia(body: Body, losses: Losses) -> Body:
    """Return the body with the inertia of one that can exist.

    Moments of zero or less are those of a ball of 1 mm; then, if the largest moment is above the
    sum of the others, the smallest is raised to the difference, or both to half the largest.
    """
    if body.mass is None:
        return body
    tensor = body.mass.inertia + body.extra_inertia
    moments, axes = np.linalg.eigh((tensor + tensor.T) / 2.0)
    possible = _possible_moments(moments, body.mass.mass)
    if np.array_equal(moments, possible):
        return body
    numbers = (", ".join(f"{moment:.3g}" for moment in row) for row in (moments, possible))
    what = "moments of inertia that no body has are raised to possible ones [kg m2]"
    losses.add(what, f"{body.name} ({' to '.join(numbers)})")
    mass = MassProperties(body.mass.mass, body.mass.centre, axes @ np.diag(possible) @ axes.T)
    return replace(body, mass=mass, extra_inertia=np.zeros((3, 3)))


def _possible_moments(moments: Array, mass: float) -> Array:
    """Return principal moments in ascending order, raised to those of a body, shape (3,)."""
    ball = 0.4 * mass * LEAST_RADIUS**2
    largest = moments[2] if moments[2] > 0.0 else ball
    raised = np.where(moments > _NOISE * largest, moments, min(ball, largest))
    first, second, third = np.sort(raised)
    if third > (first + second) * (1.0 + _ROUNDING):
        first = third - second
        if first > second:
            first = second = third / 2.0
        return np.array([first, second, third])
    return raised


_ROUNDING = 1e-9
"""Relative excess of the largest moment over the sum of the others that is left as it is."""
