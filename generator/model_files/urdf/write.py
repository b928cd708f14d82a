"""The format of robots (`.urdf`): links in a tree, joints of one freedom, no gravity and no start.

A joint of several freedoms is a row of joints of one, in the order of its chain, with links between
them that have no mass: the angles are the figure's displacements. The frame of a link is that in
which its joint moves it, so a segment whose site is not at its origin hangs by a fixed joint from a
link at the site.

The link `world` has z up and x ahead, as programs that read the format expect; the ground's
segments are turned in it, so that their frames and all further out are the figure's.
"""

from pathlib import Path

import numpy as np

from generator.figure import Figure, Joint, Site
from generator.kinematics.tree import Branch
from generator.losses import Losses, Report
from generator.model_files.body_tree.tree import Z_UP
from generator.model_files.export_model import (
    JointLaws,
    Model,
    laws_of,
    lose_what_no_format_has,
    model_of,
    rubs,
    unused_name,
    used_springs,
)
from generator.model_files.xml_write import Element, add, document, numbers, roll_pitch_yaw
from generator.rotations import Array, homogeneous, inverse_pose, unit
from generator.text_io import write_whole
from springs import AxisSpring, JointSprings, SpringSet, Stop

NO_LIMIT = 1e9
"""What stands where the format wants a limit that the figure has not [N m, N, rad/s, m/s, m]."""


def write(figure: Figure, springs: SpringSet, path: Path) -> Losses:
    """Write a figure as a URDF model, whole or not at all.

    Raises:
        OSError: the file cannot be written.
        InputError: a segment that moves lacks a mass, an inertia or a centre of mass.
    """
    text, losses = urdf_of(figure, springs)
    write_whole(path, text)
    return losses


def urdf_of(figure: Figure, springs: SpringSet) -> tuple[str, Losses]:
    """The text of a URDF model, and what it does not hold; raises InputError as `write`."""
    report = Report("URDF model")
    model = model_of(figure, report)
    root = Element("robot", name=figure.name or "figure")
    _Links(model, springs, root, report).build()
    _lose_the_rest(model, springs, report)
    return document(root, _COMMENTS), report.losses


_COMMENTS = (
    "Units are metres, kilograms, seconds and radians. The link `world` has z up, x ahead.",
    "Links between the joints of one joint of the figure have no mass.",
)


class _Links:
    """Links and joints, from the world outwards."""

    def __init__(self, model: Model, springs: SpringSet, root: Element, report: Report) -> None:
        self._model, self._root, self._report = model, root, report
        self._springs = dict(used_springs(model, springs))
        self._links = set(model.segments.values())
        self._joints = {
            model.joints[name]
            for name, chain in model.tree.chains.items()
            if len(chain.factors) < 2
        }
        self._made: dict[str, Element] = {}

    def build(self) -> None:
        """All links, each base before its tip."""
        model = self._model
        world = self._link(unused_name("world", self._links))
        upright = homogeneous(Z_UP.T, np.zeros(3))
        for name in model.figure.ground:
            link = self._link(model.segments[name])
            fixed = unused_name(f"{link}_fixed", self._joints)
            self._join(fixed, "fixed", world, link, upright @ model.placement.poses[name])
        for branch in model.tree.branches:
            self._add(branch)

    def _add(self, branch: Branch) -> None:
        """The row of joints that hangs a segment on its base."""
        model, joint = self._model, branch.joint
        ends = joint.ends if branch.forward else joint.ends[::-1]
        pose, tip = (model.site(ref) for ref in ends)
        rest = inverse_pose(tip)
        at_origin = np.array_equal(rest, np.eye(4))
        name, link = model.joints[joint.name], model.segments[branch.base]
        laws = laws_of(model.tree.chains[joint.name], self._joint_springs(joint))
        count = len(joint.chain)
        # The outermost factor comes first; hung the other way round, that is the first, backwards.
        places = range(count)[::-1] if branch.forward else range(count)
        for place in places:
            last = at_origin and place == places[-1]
            below = model.segments[branch.tip] if last else unused_name(f"{name}_link", self._links)
            own = (
                name
                if count == 1
                else unused_name(model.coordinates[joint.name][place], self._joints)
            )
            factor = joint.chain[place]
            spring = laws.alone.get(place)
            element = self._join(own, _kind(joint, place), link, self._link(below), pose)
            sign = 1.0 if branch.forward else -1.0
            add(element, "axis", xyz=numbers(sign * unit(factor.axis)))
            _add_limits(element, joint, place)
            _add_friction(element, spring)
            link, pose = below, np.eye(4)
        if not (at_origin and count):
            fixed = name if not count else unused_name(f"{name}_fixed", self._joints)
            self._join(fixed, "fixed", link, self._link(model.segments[branch.tip]), pose @ rest)
        self._add_inertia(branch.tip)
        if count > 1:
            self._report.lose(
                "joints of several freedoms as such: they are rows of joints of one, with links "
                "without mass between them",
                joint.name,
            )

    def _joint_springs(self, joint: Joint) -> JointSprings:
        return self._springs.get(joint.name, JointSprings(joint.name))

    def _link(self, name: str) -> str:
        self._made[name] = add(self._root, "link", name=name)
        return name

    def _join(self, name: str, kind: str, parent: str, child: str, pose: Array) -> Element:
        element = add(self._root, "joint", name=name, type=kind)
        add(element, "parent", link=parent)
        add(element, "child", link=child)
        turn = numbers(roll_pitch_yaw(pose[:3, :3]))
        add(element, "origin", xyz=numbers(pose[:3, 3]), rpy=turn)
        return element

    def _add_inertia(self, name: str) -> None:
        segment = self._model.figure.segments[name]
        assert segment.mass is not None
        assert segment.inertia is not None
        assert segment.centre_of_mass is not None
        inertial = add(self._made[self._model.segments[name]], "inertial")
        add(inertial, "origin", xyz=numbers(segment.centre_of_mass), rpy="0 0 0")
        add(inertial, "mass", value=numbers(segment.mass))
        moments = {
            f"i{axis}{axis}": numbers(m) for axis, m in zip("xyz", segment.inertia, strict=True)
        }
        add(inertial, "inertia", **moments, ixy="0", ixz="0", iyz="0")


def _limits(joint: Joint, place: int) -> tuple[float | None, float | None]:
    """The limits of one displacement; those of several turns are none of one turn."""
    turns = [factor.kind for factor in joint.chain].count("R")
    if joint.chain[place].kind == "R" and turns > 1:
        return None, None
    lower, upper = joint.lower_limit, joint.upper_limit
    return None if lower is None else lower[place], None if upper is None else upper[place]


def _kind(joint: Joint, place: int) -> str:
    if joint.chain[place].kind == "T":
        return "prismatic"
    return "continuous" if _limits(joint, place) == (None, None) else "revolute"


def _add_limits(element: Element, joint: Joint, place: int) -> None:
    """The range, where there is one; without effort and velocity no range can be written."""
    if element.get("type") == "continuous":
        return
    lower, upper = _limits(joint, place)
    ends = {
        "lower": numbers(-NO_LIMIT if lower is None else lower),
        "upper": numbers(NO_LIMIT if upper is None else upper),
    }
    add(element, "limit", **ends, effort=numbers(NO_LIMIT), velocity=numbers(NO_LIMIT))


def _add_friction(element: Element, spring: AxisSpring | None) -> None:
    damping = None if spring is None else spring.damping
    if damping is not None and (damping.viscous or damping.coulomb):
        given = {"damping": damping.viscous, "friction": damping.coulomb}
        add(element, "dynamics", **{key: numbers(value) for key, value in given.items()})


def _lose_the_rest(model: Model, springs: SpringSet, report: Report) -> None:
    """What no URDF holds."""
    figure = model.figure
    report.lose("gravity: the program that reads the file has to be told")
    for joint in model.tree.closures:
        report.lose("joints that close loops: the loops are open", joint.name)
    for name, own in used_springs(model, springs):
        laws = laws_of(model.tree.chains[name], own)
        if _has_springs(figure.joints[name], laws):
            report.lose("springs", name)
        if any(rubs(spring) for spring in (*own.axes, *own.slides)):
            report.lose("friction that depends on the angle", name)
        if any(spring.damping.coulomb for spring in laws.alone.values()):
            report.lose("the rate at which Coulomb friction sets in", name)
        if any(axis.damping.viscous or axis.damping.coulomb for axis in laws.together):
            report.lose("damping and friction of several turns at once", name)
    for name, joint in figure.joints.items():
        if joint.lower_limit is None and joint.upper_limit is None:
            continue
        if model.tree.chains[name].turns[1:]:
            report.lose("limits of several turns at once", name)
        else:
            report.lose("how stops grow beyond limits: those of the file are hard", name)
    moved = [name for name, joint in figure.joints.items() if any(joint.displacement)]
    if moved:
        report.lose("the pose in which the figure is drawn: all displacements are 0", *moved)
    lose_what_no_format_has(model, springs, report)
    for name, segment in figure.segments.items():
        if name not in figure.ground and any(_is_loaded(site) for site in segment.sites.values()):
            report.lose("forces and moments at sites", name)
        if segment.psurf is not None:
            report.lose("psurfs", name)
    report.lose("sites, but for those of joints")
    if figure.attributes:
        report.lose("attributes", *figure.attributes)


def _has_springs(joint: Joint, laws: JointLaws) -> bool:
    """Whether there are springs beside the stops at the joint's limits."""
    limited = joint.lower_limit is not None or joint.upper_limit is not None
    several = any(
        not (limited and isinstance(law, Stop)) for axis in laws.together for law in axis.elastic
    )
    return several or any(
        not (isinstance(law, Stop) and (law.lower, law.upper) == _limits(joint, place))
        for place, spring in laws.alone.items()
        for law in spring.elastic
    )


def _is_loaded(site: Site) -> bool:
    loads = (site.global_force, site.local_force, site.global_moment, site.local_moment)
    return any(any(load) for load in loads if load is not None)
