"""MuJoCo's own format (`.xml`, `.mjcf`): bodies, joints, springs, loops, surfaces.

A body hangs on its base at the pose of zero displacements, and its joints move it in the order in
which they are listed, the outermost first: a figure's chain from its last factor to its first, or,
where the body is the joint's parent, from the first to the last and against the axes. Three turns
are one ball, whose quaternion turns the body's own frame.

A hinge or a slide has the spring force -(a x + b x^2 + c x^3), x being counted from `springref`. A
fixed tendon has the same with x counted from the ends of its `springlength`, zero between them; so
what a curve does beyond a corner is a tendon of one joint, slack on one side.
"""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from generator.figure import Figure, Joint
from generator.kinematics.tree import Branch
from generator.losses import Losses, Report
from generator.model_files.export_model import (
    JointLaws,
    Model,
    common_damping,
    common_stiffness,
    laws_of,
    lose_what_no_format_has,
    model_of,
    rubs,
    unused_name,
    used_springs,
)
from generator.model_files.mjcf.write_parts import (
    add_loads,
    add_loops,
    add_sites,
    add_surfaces,
    quaternion,
)
from generator.model_files.piecewise import piecewise_cubic
from generator.model_files.xml_write import Element, add, document, numbers
from generator.rotations import Array, inverse_pose, unit
from generator.text_io import write_whole
from springs import AxisSpring, JointSprings, SpringSet

GRAVITY = (0.0, -9.81, 0.0)

STEP = 0.001
"""Time step of the file [s]."""

_FAR = 1e6
"""An end of a tendon's slack range that is never reached [rad or m]."""

_SPRINGS = "springs of several turns at once, unless they resist turns about all axes alike"
_DAMPING = "damping of several turns at once, unless it is that of turns about all axes alike"
_CURVES = "springs whose curve is no cubic, as a whole or piece by piece, or is nowhere zero"
_COULOMB = "Coulomb friction as it is: MuJoCo's own holds a joint at rest, where ours lets it creep"


def write(figure: Figure, springs: SpringSet, path: Path) -> Losses:
    """Write a figure and its springs as a MuJoCo model, whole or not at all.

    Raises:
        OSError: the file cannot be written.
        InputError: a segment that moves lacks a mass, an inertia or a centre of mass.
    """
    text, losses = mjcf_of(figure, springs)
    write_whole(path, text)
    return losses


def mjcf_of(figure: Figure, springs: SpringSet) -> tuple[str, Losses]:
    """The text of a MuJoCo model, and what it does not hold; raises InputError as `write`."""
    report = Report("MuJoCo model")
    model = model_of(figure, report)
    root = Element("mujoco", model=figure.name or "figure")
    add(root, "compiler", angle="radian", autolimits="true", inertiafromgeom="false")
    add(root, "option", integrator="RK4", timestep=numbers(STEP), gravity=numbers(GRAVITY))
    sections = {tag: Element(tag) for tag in ("asset", "worldbody", "equality", "tendon")}
    sections |= {tag: Element(tag) for tag in ("actuator", "keyframe")}
    root.extend(sections.values())
    builder = _Builder(model, springs, report, sections["worldbody"], sections["tendon"])
    builder.build()
    add_surfaces(model, sections["asset"], builder.bodies, report)
    add_loops(model, sections["equality"], builder.bodies, report)
    add_loads(model, sections["actuator"])
    add(sections["keyframe"], "key", name="start", qpos=numbers(builder.start))
    for section in sections.values():
        if not len(section):
            root.remove(section)
    lose_what_no_format_has(model, springs, report)
    return document(root, _COMMENTS), report.losses


_COMMENTS = (
    "For MuJoCo 3.7 or later, which takes springs with several coefficients.",
    "Units are metres, kilograms, seconds and radians; y is up.",
    "The key `start` is the pose in which the figure is drawn; without it all displacements are 0.",
)


class _Builder:
    """Bodies and their joints, from the ground outwards."""

    def __init__(
        self, model: Model, springs: SpringSet, report: Report, world: Element, tendons: Element
    ) -> None:
        self._model, self._report, self._tendons = model, report, tendons
        self._springs = dict(used_springs(model, springs))
        self.bodies: dict[str, Element] = dict.fromkeys(model.figure.ground, world)
        self._starts: dict[str, list[float]] = {}
        self._joints = {
            model.joints[name]
            for name, chain in model.tree.chains.items()
            if len(chain.factors) == 1 or len(chain.turns) == 3
        }
        self._segments = {"world", *model.segments.values()}

    @property
    def start(self) -> list[float]:
        """Positions of all joints in the pose of the figure, in MuJoCo's order."""
        world = next(iter(self.bodies.values()))
        return [value for body in world.iter("body") for value in self._starts[body.attrib["name"]]]

    def build(self) -> None:
        """All bodies, each base before its tip."""
        model = self._model
        world = next(iter(self.bodies.values()))
        add(world, "site", name="world", size="0.001")
        for name in model.figure.ground:
            add_sites(model, world, name, model.placement.poses[name])
        for branch in model.tree.branches:
            self._hang(branch)
            add_sites(model, self.bodies[branch.tip], branch.tip, np.eye(4))

    def _hang(self, branch: Branch) -> None:
        model, joint = self._model, branch.joint
        ends = joint.ends if branch.forward else joint.ends[::-1]
        base, tip = (model.site(ref) for ref in ends)
        pose = base @ inverse_pose(tip)
        if branch.base in model.figure.ground:
            pose = model.placement.poses[branch.base] @ pose
        segment = model.figure.segments[branch.tip]
        assert segment.mass is not None
        assert segment.inertia is not None
        assert segment.centre_of_mass is not None
        name = model.segments[branch.tip]
        if name == "world":
            # MuJoCo's own body has this name.
            name = unused_name(name, self._segments)
        body = add(
            self.bodies[branch.base],
            "body",
            name=name,
            pos=numbers(pose[:3, 3]),
            quat=numbers(quaternion(pose[:3, :3])),
        )
        self.bodies[branch.tip] = body
        add(
            body,
            "inertial",
            pos=numbers(segment.centre_of_mass),
            mass=numbers(segment.mass),
            diaginertia=numbers(segment.inertia),
        )
        springs = self._springs.get(joint.name, JointSprings(joint.name))
        chain = model.tree.chains[joint.name]
        free = len(chain.turns) == len(chain.slides) == 3 and branch.base in model.figure.ground
        if free and not springs.axes and not springs.slides:
            add(body, "freejoint", name=model.joints[joint.name])
            at = model.placement.poses[branch.tip]
            self._starts[name] = [*at[:3, 3], *quaternion(at[:3, :3])]
        else:
            self._add_joints(body, branch, tip, springs)

    def _add_joints(self, body: Element, branch: Branch, tip: Array, springs: JointSprings) -> None:
        joint, chain = branch.joint, self._model.tree.chains[branch.joint.name]
        laws = laws_of(chain, springs)
        position = numbers(tip[:3, 3])
        names = self._names(joint)
        displacements = self._model.placement.displacements[joint.name]
        start: list[float] = []
        self._starts[body.attrib["name"]] = start
        for k in freedoms(branch, chain.slides_are_outside):
            if k is None:
                turn = chain.pose(displacements)[:3, :3]
                turn = turn if branch.forward else turn.T
                start += quaternion(tip[:3, :3] @ turn @ tip[:3, :3].T).tolist()
                ball = add(body, "joint", name=names[k], type="ball", pos=position)
                self._hold_together(ball, joint, laws)
                continue
            start.append(float(displacements[k]))
            factor = joint.chain[k]
            axis = tip[:3, :3] @ unit(factor.axis) * (1.0 if branch.forward else -1.0)
            kind = "hinge" if factor.kind == "R" else "slide"
            place = {} if kind == "slide" else {"pos": position}
            element = add(body, "joint", name=names[k], type=kind, **place, axis=numbers(axis))
            if k in laws.alone:
                self._hold(element, joint, laws.alone[k])
        if len(chain.turns) == 2 and any(axis.elastic for axis in laws.together):
            self._report.lose(_SPRINGS, joint.name)
        if len(chain.turns) == 2 and any(axis.damping.viscous for axis in laws.together):
            self._report.lose(_DAMPING, joint.name)
        self._lose_friction(joint, laws)

    def _names(self, joint: Joint) -> dict[int | None, str]:
        """Names of a joint's hinges and slides by place in its chain, and of its ball."""
        name = self._model.joints[joint.name]
        if len(joint.chain) == 1:
            return {0: name}
        coordinates = self._model.coordinates[joint.name]
        is_ball = [factor.kind for factor in joint.chain].count("R") == 3
        parts = {
            k: unused_name(coordinates[k], self._joints)
            for k, factor in enumerate(joint.chain)
            if factor.kind == "T" or not is_ball
        }
        return {None: name, **parts}

    def _hold_together(self, ball: Element, joint: Joint, laws: JointLaws) -> None:
        """Springs of a ball."""
        if not laws.together:
            return
        stiffness, damping = common_stiffness(laws.together), common_damping(laws.together)
        if stiffness:
            ball.set("stiffness", numbers(stiffness))
        if damping:
            ball.set("damping", numbers(damping))
        if stiffness is None:
            self._report.lose(_SPRINGS, joint.name)
        if damping is None:
            self._report.lose(_DAMPING, joint.name)

    def _hold(self, element: Element, joint: Joint, spring: AxisSpring) -> None:
        """A spring of a hinge or a slide."""
        held = piecewise_cubic(spring.elastic) if spring.elastic else None
        if held is not None:
            if any(held.terms):
                element.set("springref", numbers(held.root))
                element.set("stiffness", _stiffness(held.terms))
            name = element.attrib["name"]
            for number, step in enumerate(held.steps, 1):
                ends = (-_FAR, step.corner) if step.above else (step.corner, _FAR)
                tendon = add(
                    self._tendons,
                    "fixed",
                    name=f"{name}_corner_{number}",
                    springlength=numbers(ends),
                    stiffness=_stiffness(step.terms),
                )
                add(tendon, "joint", joint=name, coef="1")
        elif spring.elastic:
            self._report.lose(_CURVES, joint.name)
        if spring.damping.viscous:
            element.set("damping", numbers(spring.damping.viscous))
        if spring.damping.coulomb:
            element.set("frictionloss", numbers(spring.damping.coulomb))

    def _lose_friction(self, joint: Joint, laws: JointLaws) -> None:
        """Friction that MuJoCo has in another way or not at all."""
        every = (*laws.alone.values(), *laws.together)
        if any(rubs(spring) for spring in every):
            self._report.lose("friction that depends on the angle", joint.name)
        if any(spring.damping.coulomb for spring in laws.alone.values()):
            self._report.lose(_COULOMB, joint.name)
        if any(spring.damping.coulomb for spring in laws.together):
            self._report.lose("Coulomb friction of several turns at once", joint.name)


def freedoms(branch: Branch, slides_are_outside: bool) -> Iterator[int | None]:
    """Places in a branch's chain, the outermost first; None stands for a ball of three turns."""
    chain = branch.joint.chain
    turns = [k for k, factor in enumerate(chain) if factor.kind == "R"]
    slides = [k for k, factor in enumerate(chain) if factor.kind == "T"]
    ball: list[int | None] = [None]
    about: list[int | None] = ball if len(turns) == 3 else [*reversed(turns)]
    outermost_first = [*slides, *about] if slides_are_outside else [*about, *slides]
    yield from outermost_first if branch.forward else reversed(outermost_first)


def _stiffness(terms: tuple[float, float, float]) -> str:
    """Coefficients of a torque as those of a spring, which resists; as few as there are.

    One coefficient is what versions before 3.7 take.
    """
    count = max(k for k, term in enumerate(terms, 1) if term)
    return numbers([-term for term in terms[:count]])
