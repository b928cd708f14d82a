"""MuJoCo's own format (`.xml`, `.mjcf`): bodies, joints, springs, loops, surfaces.

A body has its pose of zero displacements in its base, and its joints move it in the order in which
they are listed, the outermost first: a figure's chain from its last axis to its first, or, if the
body is the joint's parent, from the first to the last and against the axes. Three rotations are one
ball joint, whose quaternion rotates the body's own frame.

A hinge or a slide joint has the spring force -(a x + b x^2 + c x^3), where x is measured from
`springref`. A fixed tendon has the same force with x measured from the ends of its `springlength`,
zero between them; so a curve beyond a breakpoint is a tendon `JOINT_corner_n` of
one joint, slack on one side. An exponential of a law over several joints is such tendons
`JOINTS_spring_n` over the hinges, whose length is the sum of angles over the size of the rates, if
their angles are those of hinges. A curve without a zero has its constant part in the actuator
`JOINT_constant`.

The springs of several rotations that are functions of the rotation vector are left out, but for a
torque that is equal in all directions and viscous damping that is equal about all axes: those are
the ball's own. Under a law of coordinates the springs are those of hinges.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import product
from math import inf
from pathlib import Path
from typing import NamedTuple, assert_never, cast

import numpy as np
from numpy.typing import ArrayLike

from generator.diagnostics import Diagnostics, Source
from generator.figure import AxisKind, Figure, Joint, SiteRef, is_rotation
from generator.follower_curve import CurveKind, FollowerCurve
from generator.identifiers import reserve_name
from generator.joint_chain import Chain
from generator.kinematics.links import Coordinate, figure_links
from generator.kinematics.placement import Displacements
from generator.kinematics.tree import TreeJoint
from generator.losses import Effect, Losses
from generator.model import Model
from generator.model_files.coupled_laws import CoupledElements
from generator.model_files.embedded import embed
from generator.model_files.export_model import (
    ExportModel,
    JointLaws,
    Start,
    add_common_losses,
    build_export_model,
    common_damping,
    has_friction,
    loop_closures,
)
from generator.model_files.fit_error import FitError, FitErrors, format_range, joint_ranges
from generator.model_files.mjcf.contact import add_contact
from generator.model_files.mjcf.track import WORLD, Motion, body_name, track_of_motion
from generator.model_files.mjcf.visuals import add_visuals
from generator.model_files.model_files import ModelFiles
from generator.model_files.piecewise import (
    ROTATION_MARGIN,
    TRANSLATION_MARGIN,
    PiecewiseCubic,
    fit_piecewise_cubic,
)
from generator.model_files.xml import (
    MAX_DEPTH,
    Element,
    add_element,
    format_document,
    format_numbers,
    nesting_depth,
    parse_xml,
)
from generator.passive_curve import rotation_vector
from generator.rotations import (
    Array,
    inverse_pose,
    pose_matrix,
    quaternion_from_matrix,
    unit_vector,
)
from generator.springs_file.axes import parallel_sign
from springs import (
    AxisSpring,
    CoupledAxis,
    CoupledSpring,
    JointSprings,
    SphericalLaw,
    SpringSet,
    total_torque,
)
from springs.elastic import Range
from springs.exponential import Exponential, ExponentialTerm
from springs.spherical import VectorLaw

_SOLVER = {"solref": "0.002 1", "solimp": "0.999 0.9999 0.001 0.5 2"}
"""Stiffness of loops and of displacements that follow others: the largest that the file's time
step allows, of which the time constant is at least twice."""


def site_name(model: ExportModel, ref: SiteRef) -> str:
    """`SEGMENT.SITE`."""
    return f"{model.segments[ref.segment]}.{ref.site}"


def add_sites(model: ExportModel, body: Element, segment: str, pose: Array) -> None:
    """The sites of a segment; `pose` is that of the segment in the body, shape (4, 4)."""
    for name, site in model.figure.segments[segment].sites.items():
        _add_site(body, site_name(model, SiteRef(segment, name)), pose @ site.pose_in_segment)


def _add_site(body: Element, name: str, pose: Array) -> None:
    turn = format_numbers(quaternion_from_matrix(pose[:3, :3]))
    add_element(body, "site", name=name, pos=format_numbers(pose[:3, 3]), quat=turn, size="0.005")


def add_loops(
    model: ExportModel, equality: Element, bodies: Mapping[str, Element], losses: Losses
) -> None:
    """Add the constraints of loops: their sites, and a second point on a revolute's axis."""
    for loop in loop_closures(model, losses):
        name = model.joints[loop.joint.name]
        ends = [site_name(model, ref) for ref in loop.joint.ends]
        kind = "connect" if loop.points else "weld"
        add_element(equality, kind, name=name, site1=ends[0], site2=ends[1], **_SOLVER)
        for point in loop.points[1:]:
            names = [f"{name}.axis in {model.segments[ref.segment]}" for ref in loop.joint.ends]
            for own, ref in zip(names, loop.joint.ends, strict=True):
                pose = model.site(ref) @ pose_matrix(np.eye(3), point)
                if ref.segment in model.figure.ground:
                    pose = model.placement.poses[ref.segment] @ pose
                _add_site(bodies[ref.segment], own, pose)
            attributes = {"site1": names[0], "site2": names[1], **_SOLVER}
            add_element(equality, "connect", name=f"{name}.axis", **attributes)


def add_loads(model: ExportModel, actuators: Element) -> None:
    """The constant forces and moments at sites, as actuators that take no control."""
    for name in model.figure.bodies:
        for site in model.figure.segments[name].sites.values():
            own, zero = site.pose_in_segment[:3, :3].T, (0.0, 0.0, 0.0)
            force, moment = site.local_force or zero, site.local_moment or zero
            loads = {
                "global": [*(site.global_force or zero), *(site.global_moment or zero)],
                "local": [*(own @ force), *(own @ moment)],
            }
            for kind, load in loads.items():
                if any(load):
                    own_name = site_name(model, SiteRef(name, site.name))
                    ends = {"site": own_name} | ({"refsite": WORLD} if kind == "global" else {})
                    gear = format_numbers(load)
                    title = f"{own_name} {kind} load"
                    _add_actuator(actuators, title, (1.0, 0.0, 0.0), **ends, gear=gear)


def _add_actuator(actuators: Element, name: str, bias: ArrayLike, **attributes: str) -> None:
    """Add an actuator without control; `bias` are its force and the slopes of this."""
    fixed = {"gainprm": "0", "biastype": "affine", "biasprm": format_numbers(bias)}
    add_element(actuators, "general", name=name, **attributes, **fixed)


GRAVITY = (0.0, -9.81, 0.0)

STEP = 0.001
"""Time step of the file [s]."""

_CAMERA = {"azimuth": "90", "elevation": "-90"}
"""First direction of the viewer's camera, whose own z is up: against z, so that y is up [deg]."""

_LIGHT = {"ambient": "0.4 0.4 0.4", "diffuse": "0.5 0.5 0.5"}
"""The viewer's light; the file has no other."""

_UNREACHABLE_LENGTH = 1e6
"""Unreachable end of a tendon's slack range [rad or m]."""

ROUNDING = 1e-9
"""Share of the largest torque below which a difference is one of rounding."""

_GRID = 7
"""Values of each displacement at which a law is compared with an isotropic one."""

_CURVES = "springs whose torque is infinite within the joint's range"
_FITTED = "springs approximated by piecewise cubics"
_FIT_SAMPLES = 721
"""Displacements at which the error of a fit is computed."""

_ROTATIONS = "springs of several rotations (convert with `--law coordinates`)"
_DAMPING = "unequal damping of several rotations (convert with `--law coordinates`)"
_REACH_DAMPING = "unequal damping of joints with a reach"
_FITTED_FOLLOWERS = "curves of displacements that follow others, fitted by polynomials of degree 4"
MAX_POWERS = 5
"""Number of coefficients of the polynomial of MuJoCo's equality of two joints."""
_COULOMB = "the form of Coulomb friction: MuJoCo's holds a joint at rest, ours lets it creep"


def format_files(
    figure: Figure, springs: SpringSet, path: Path, start: Start | None = None
) -> ModelFiles:
    """Format a figure and its springs as the MuJoCo model at `path`.

    Args:
        figure: Figure.
        springs: Springs of its joints.
        path: Path of the model.
        start: Contact and rates at the start; None for a model that touches nothing, at rest.

    Raises InputError for a segment that moves without a mass, an inertia or a centre of mass.
    """
    text, losses = format_mjcf(figure, springs, start)
    if (depth := nesting_depth(text)) > MAX_DEPTH:
        losses.add(
            f"a way back into this program: elements are nested {depth:,} deep, and {MAX_DEPTH:,} "
            "levels are read"
        )
    return ModelFiles(path, {path: text}, losses)


def format_mjcf(
    figure: Figure, springs: SpringSet, start: Start | None = None
) -> tuple[str, Losses]:
    """The text of a MuJoCo model, and its losses; raises InputError as `format_files`."""
    losses = Losses("MuJoCo model")
    model = build_export_model(figure, springs, losses)
    root = Element("mujoco", model=figure.name or "figure")
    add_element(root, "compiler", angle="radian", autolimits="true", inertiafromgeom="false")
    add_element(
        root,
        "option",
        integrator="RK4",
        timestep=format_numbers(STEP),
        gravity=format_numbers(GRAVITY),
    )
    visual = add_element(root, "visual")
    add_element(visual, "global", **_CAMERA)
    add_element(visual, "headlight", **_LIGHT)
    sections = {tag: Element(tag) for tag in ("asset", "worldbody", "equality", "tendon")}
    sections |= {tag: Element(tag) for tag in ("actuator", "keyframe")}
    root.extend(sections.values())
    builder = _BodyWriter(model, losses, sections)
    builder.add_bodies()
    add_visuals(model, sections["asset"], builder.bodies, losses)
    if start is not None and start.contact is not None:
        add_contact(model, start.contact, root, builder.bodies, losses)
    add_loops(model, sections["equality"], builder.bodies, losses)
    builder.add_followers(sections["equality"])
    add_loads(model, sections["actuator"])
    key = add_element(
        sections["keyframe"], "key", name="start", qpos=format_numbers(builder.initial_positions)
    )
    if start is not None and any(map(any, start.rates.values())):
        key.set("qvel", format_numbers(_start_speeds(root, model, start.rates)))
    coupled = model.springs.coupled
    left = tuple(spring for spring in coupled if not builder.add_coupled_spring(spring))
    for section in sections.values():
        if not len(section):
            root.remove(section)
    builder.report_fits()
    rest = replace(model, springs=replace(model.springs, coupled=left))
    has_contact = start is not None and start.contact is not None
    add_common_losses(rest, losses, has_contact=has_contact, has_followers=True)
    embed(root, figure, springs)
    return format_document(root, _COMMENTS), losses


def coupled_elements(model: Model) -> CoupledElements:
    """Return the laws over several joints of a model, each with its tendons and actuators."""
    losses = Losses("")
    export = build_export_model(model.figure, model.springs, losses)
    sections = {tag: Element(tag) for tag in ("worldbody", "tendon", "actuator")}
    builder = _BodyWriter(export, losses, sections, has_axis_springs=False)
    builder.add_bodies()
    found: list[tuple[CoupledSpring, Sequence[Element]]] = []
    for spring in export.springs.coupled:
        made = [sections[tag] for tag in ("tendon", "actuator")]
        counts = [len(one) for one in made]
        builder.add_coupled_spring(spring)
        rows = zip(made, counts, strict=True)
        found.append((spring, [element for one, count in rows for element in one[count:]]))
    return found


def _start_speeds(root: Element, model: ExportModel, rates: Displacements) -> Array:
    """Return the speeds of the model for rates of the displacements, shape (nv,)."""
    parsed = parse_xml(Source("model", format_document(root, ())), Diagnostics())
    assert parsed is not None
    placed = model.placement
    now, poses, moving = (
        {name: np.asarray(values)[None] for name, values in mapping.items()}
        for mapping in (placed.displacements, placed.poses, rates)
    )
    speeds = track_of_motion(parsed, Motion(model.tree, now, poses, moving)).qvel
    assert speeds is not None
    return speeds[0]


_COMMENTS = (
    "For MuJoCo 3.7 or later, which takes springs with several coefficients.",
    "Units are metres, kilograms, seconds and radians; y is up.",
    "The key `start` is the pose in which the figure is drawn; without it all displacements are 0.",
)


class _Hinge(NamedTuple):
    """A hinge of an angle of a law: its name, its sense in the angle, and the angle's range."""

    name: str
    sense: int
    ends: Range


class _BodyWriter:
    """Bodies and their joints, from the ground outwards."""

    def __init__(
        self,
        model: ExportModel,
        losses: Losses,
        sections: Mapping[str, Element],
        *,
        has_axis_springs: bool = True,
    ) -> None:
        self._model, self._losses, self._fits = model, losses, FitErrors()
        self._has_axis_springs = has_axis_springs
        self._tendons, self._actuators = sections["tendon"], sections["actuator"]
        self._law = model.springs.law
        world = sections["worldbody"]
        self.bodies: dict[str, Element] = dict.fromkeys(model.figure.ground, world)
        self._names: dict[str, dict[int | None, str]] = {}
        self._initial_positions_by_body: dict[str, list[float]] = {}
        self._joints = {
            model.joints[name]
            for name, chain in model.tree.chains.items()
            if len(chain.joint_axes) == 1 or model.laws(name).is_ball
        }

    @property
    def initial_positions(self) -> list[float]:
        """Positions of all joints in the pose of the figure, in MuJoCo's order."""
        world = next(iter(self.bodies.values()))
        return [
            value
            for body in world.iter("body")
            for value in self._initial_positions_by_body[body.attrib["name"]]
        ]

    def add_bodies(self) -> None:
        """All bodies, each base before its tip."""
        model = self._model
        world = next(iter(self.bodies.values()))
        add_element(world, "site", name="world", size="0.001")
        for name in model.figure.ground:
            add_sites(model, world, name, model.placement.poses[name])
        for branch in model.tree.joints:
            self._add_body(branch)
            add_sites(model, self.bodies[branch.outboard], branch.outboard, np.eye(4))

    def add_followers(self, equality: Element) -> None:
        """Constrain the displacements that follow others, by polynomials of degree four or less."""
        for link in figure_links(self._model.figure).links:
            follower, control, curve = link.follower, link.control, link.curve
            if not {follower.joint, control.joint} <= self._names.keys() or curve is None:
                continue
            if curve.kind is not CurveKind.POLYNOMIAL or any(curve.numbers[MAX_POWERS:]):
                curve = self._fit_follower(follower, control, curve)
            one, other = (self._names[end.joint][end.index] for end in (follower, control))
            polynomial = format_numbers((*curve.numbers, *(0.0,) * MAX_POWERS)[:MAX_POWERS])
            add_element(equality, "joint", joint1=one, joint2=other, polycoef=polynomial, **_SOLVER)

    def _fit_follower(
        self, follower: Coordinate, control: Coordinate, curve: FollowerCurve
    ) -> FollowerCurve:
        """Return a polynomial in place of a curve, over the range of the control."""
        joints, start = self._model.figure.joints, self._model.placement.displacements
        joint, at = joints[control.joint], float(start[control.joint][control.index])
        units = joint.chain[control.index].units
        low, high = joint_ranges(joint, self._model.joint_springs(control.joint))[control.index]
        if curve.kind is CurveKind.SIMM_SPLINE:
            low, high = max(low, curve.numbers[0]), min(high, curve.numbers[-2])
        low, high = min(low, at), max(high, at)
        fitted = curve.fitted_by_polynomial(MAX_POWERS - 1, (low, high), at)
        values = np.linspace(low, high, _FIT_SAMPLES)
        of_follower = joints[follower.joint].chain[follower.index].units
        differences = of_follower.scale * (fitted.at(values) - curve.at(values))
        error = FitError.from_differences(differences, of_follower.displacement)
        if error.largest > ROUNDING * np.abs(of_follower.scale * curve.at(values)).max():
            over = f" over {format_range((low, high), units)}"
            self._fits.add(_FITTED_FOLLOWERS, str(follower), error, over)
        return fitted

    def report_fits(self) -> None:
        """Report the springs that are approximated."""
        self._fits.report(self._losses)

    def _add_body(self, branch: TreeJoint) -> None:
        model, joint = self._model, branch.joint
        base, tip = model.branch_sites(branch)
        pose = base @ inverse_pose(tip)
        if branch.inboard in model.figure.ground:
            pose = model.placement.poses[branch.inboard] @ pose
        springs = model.joint_springs(joint.name)
        chain = model.tree.chains[joint.name]
        free = (
            len(chain.rotations) == len(chain.translations) == 3
            and branch.inboard in model.figure.ground
            and not (springs.axes or springs.translations or joint.name in model.linked_joints)
        )
        if free:  # MuJoCo's own start of a free body is its place in the file
            pose = model.placement.poses[branch.outboard]
        mass, centre, moments = model.mass_properties(branch.outboard)
        name = body_name(model.segments, branch.outboard)
        body = add_element(
            self.bodies[branch.inboard],
            "body",
            name=name,
            pos=format_numbers(pose[:3, 3]),
            quat=format_numbers(quaternion_from_matrix(pose[:3, :3])),
        )
        self.bodies[branch.outboard] = body
        add_element(
            body,
            "inertial",
            pos=format_numbers(centre),
            mass=format_numbers(mass),
            diaginertia=format_numbers(moments),
        )
        if free:
            add_element(body, "freejoint", name=model.joints[joint.name])
            self._initial_positions_by_body[name] = [
                *pose[:3, 3],
                *quaternion_from_matrix(pose[:3, :3]),
            ]
        else:
            self._add_joints(body, branch, tip, springs)

    def _add_joints(
        self, body: Element, branch: TreeJoint, tip_site: Array, springs: JointSprings
    ) -> None:
        joint, chain = branch.joint, self._model.tree.chains[branch.joint.name]
        laws = self._model.laws(joint.name)
        position = format_numbers(tip_site[:3, 3])
        names = self._joint_element_names(joint, laws)
        self._names[joint.name] = names
        displacements = self._model.placement.displacements[joint.name]
        start: list[float] = []
        self._initial_positions_by_body[body.attrib["name"]] = start
        ball: Element | None = None
        for k in chain_indices(branch, laws):
            if k is None:
                turn = chain.pose(displacements)[:3, :3]
                turn = turn if branch.parent_is_inboard else turn.T
                start += quaternion_from_matrix(
                    tip_site[:3, :3] @ turn @ tip_site[:3, :3].T
                ).tolist()
                ball = add_element(body, "joint", name=names[k], type="ball", pos=position)
                if any(_limits(joint, rotation) for rotation in chain.rotations):
                    self._losses.add("limits of three rotations", joint.name)
                continue
            start.append(float(displacements[k]))
            factor = joint.chain[k]
            axis = (
                tip_site[:3, :3]
                @ unit_vector(factor.axis)
                * (1.0 if branch.parent_is_inboard else -1.0)
            )
            match factor.kind:
                case AxisKind.ROTATION:
                    placing = {"type": "hinge", "pos": position}
                case AxisKind.TRANSLATION:
                    placing = {"type": "slide"}
                case _:
                    assert_never(factor.kind)
            element = add_element(
                body, "joint", name=names[k], **placing, axis=format_numbers(axis)
            )
            # MuJoCo does not enforce the limits: our springs do.
            if ends := _limits(joint, k):
                element.attrib |= {"limited": "false", "range": format_numbers(ends)}
            if k in laws.uncoupled and self._has_axis_springs:
                self._add_axis_spring(element, joint, k, laws.uncoupled[k], springs)
        if laws.combined:
            self._add_rotation_springs(ball, joint, springs, laws.of_vector)
        self._add_friction_losses(joint, laws)

    def _joint_element_names(self, joint: Joint, laws: JointLaws) -> dict[int | None, str]:
        """Names of a joint's hinges and slides by place in its chain, and of its ball."""
        name = self._model.joints[joint.name]
        if len(joint.chain) == 1:
            return {0: name}
        coordinates = self._model.coordinates[joint.name]
        parts = {
            k: reserve_name(coordinates[k], self._joints)
            for k, factor in enumerate(joint.chain)
            if not is_rotation(factor.kind) or not laws.is_ball
        }
        return {None: name, **parts}

    def _add_rotation_springs(
        self, ball: Element | None, joint: Joint, springs: JointSprings, law: VectorLaw
    ) -> None:
        """Springs and damping of several rotations: of the ball, if equal about all axes."""
        stiffness = isotropic_stiffness(joint, springs, law)
        if stiffness is None or (ball is None and any(stiffness)):
            self._losses.add(_ROTATIONS, joint.name)
        elif ball is not None and any(stiffness):
            k1, k2, k3 = stiffness
            ball.set("stiffness", _format_stiffness((-k1, -k2, -k3)))
        damping = common_damping(springs.axes)
        if damping and ball is not None:
            ball.set("damping", format_numbers(damping))
        elif damping != 0.0:
            self._losses.add(_DAMPING if springs.reach is None else _REACH_DAMPING, joint.name)

    def _add_axis_spring(
        self, element: Element, joint: Joint, index: int, spring: AxisSpring, springs: JointSprings
    ) -> None:
        """A spring of a hinge or a slide."""
        if spring.elastic:
            ends = joint_ranges(joint, springs)[index]
            units = joint.chain[index].units
            margin = ROTATION_MARGIN if units.is_angle else TRANSLATION_MARGIN
            curve = fit_piecewise_cubic(spring.elastic, (ends[0] - margin, ends[1] + margin))
            if curve is None:
                self._losses.add(_CURVES, joint.name)
            else:
                self._add_curve(element, curve)
                values = np.linspace(*ends, _FIT_SAMPLES)
                torques = np.asarray(total_torque(spring.elastic, values))
                error = FitError.from_differences(curve.torque(values) - torques, units.effort)
                if error.largest > ROUNDING * float(np.abs(torques).max()):
                    self._fits.add(_FITTED, joint.name, error, f" over {format_range(ends, units)}")
        if spring.damping.viscous:
            element.set("damping", format_numbers(spring.damping.viscous))
        if spring.damping.coulomb:
            element.set("frictionloss", format_numbers(spring.damping.coulomb))

    def _add_curve(self, element: Element, curve: PiecewiseCubic) -> None:
        """A curve as springs of a hinge or a slide and of tendons, and its constant part."""
        name = element.attrib["name"]
        if any(curve.coefficients):
            element.set("springref", format_numbers(curve.root))
            element.set("stiffness", _format_stiffness(curve.coefficients))
        self._add_corners(name, curve, {name: 1.0})
        if curve.constant:
            self._add_constant(name, curve.constant, joint=name)

    def _add_corners(self, name: str, curve: PiecewiseCubic, coefs: Mapping[str, float]) -> None:
        """The terms of a curve beyond its breakpoints, of a sum of displacements."""
        for number, step in enumerate(curve.breakpoint_terms, 1):
            ends = (
                (-_UNREACHABLE_LENGTH, step.start)
                if step.above
                else (step.start, _UNREACHABLE_LENGTH)
            )
            self._add_tendon(f"{name}_corner_{number}", ends, step.coefficients, coefs)

    def _add_tendon(
        self,
        name: str,
        ends: tuple[float, ...],
        coefficients: tuple[float, float, float],
        coefs: Mapping[str, float],
    ) -> None:
        tendon = add_element(
            self._tendons,
            "fixed",
            name=name,
            springlength=format_numbers(ends),
            stiffness=_format_stiffness(coefficients),
        )
        for joint, coef in coefs.items():
            add_element(tendon, "joint", joint=joint, coef=format_numbers(coef))

    def _add_constant(self, name: str, force: float, **target: str) -> None:
        """A constant force on a joint or a tendon."""
        _add_actuator(self._actuators, f"{name}_constant", (force, 0.0, 0.0), **target)

    def add_coupled_spring(self, spring: CoupledSpring) -> bool:
        """Add a law over several joints, and return whether it can be written.

        It can if its exponentials are gradients of hinges: each is springs of tendons, whose length
        is its sum of angles over the size of its rates.
        """
        hinges = [self._hinge(axis) for axis in spring.axes]
        found = [hinge for hinge in hinges if hinge is not None]
        if len(found) < len(hinges) or not all(term.is_gradient for term in spring.law.terms):
            return False
        label = "_".join(self._model.joints[axis.joint] for axis in spring.axes)
        for number, term in enumerate(spring.law.terms, 1):
            size = float(np.linalg.norm(term.rates))
            end = None if term.end is None else term.end - term.exponent
            amplitude = -size * term.energy_amplitude * float(np.exp(term.exponent))
            law = Exponential((ExponentialTerm(amplitude, size, end=end),))
            weights = [rate / size for rate in term.rates]
            sides = [
                sorted(weight * angle for angle in hinge.ends)
                for weight, hinge in zip(weights, found, strict=True)
            ]
            ends = sum(side[0] for side in sides), sum(side[1] for side in sides)
            curve = fit_piecewise_cubic(
                (law,), (ends[0] - ROTATION_MARGIN, ends[1] + ROTATION_MARGIN)
            )
            if curve is None:
                return False
            coefs = {
                hinge.name: hinge.sense * weight
                for weight, hinge in zip(weights, found, strict=True)
                if weight
            }
            name = f"{label}_spring_{number}"
            self._add_tendon(name, (curve.root,), curve.coefficients, coefs)
            self._add_corners(name, curve, coefs)
            if curve.constant:
                self._add_constant(name, curve.constant, tendon=name)
            lengths = np.linspace(*ends, _FIT_SAMPLES)
            differences = curve.torque(lengths) - np.asarray(law.torque(lengths))
            error = FitError.from_differences(differences, "N m")
            self._fits.add(
                _FITTED, " and ".join(dict.fromkeys(a.joint for a in spring.axes)), error
            )
        for constant, hinge in zip(spring.law.constants, found, strict=True):
            if constant:
                self._add_constant(
                    f"{label}_{hinge.name}", hinge.sense * constant, joint=hinge.name
                )
        return True

    def _hinge(self, axis: CoupledAxis) -> _Hinge | None:
        """The hinge whose angle is that about an axis of a joint; None without one."""
        chain, names = self._model.tree.chains[axis.joint], self._names.get(axis.joint, {})
        if len(chain.rotations) > 1 and self._law is not SphericalLaw.COORDINATES:
            return None
        for k in chain.rotations:
            sense = parallel_sign(axis.direction, chain.joint_axes[k].axis)
            if sense and k in names:
                springs = self._model.joint_springs(axis.joint)
                low, high = joint_ranges(self._model.figure.joints[axis.joint], springs)[k]
                return _Hinge(names[k], sense, (sense * low, sense * high))
        return None

    def _add_friction_losses(self, joint: Joint, laws: JointLaws) -> None:
        """Friction that MuJoCo has in another way or not at all."""
        every = (*laws.uncoupled.values(), *laws.combined)
        if any(has_friction(spring) for spring in every):
            self._losses.add("friction that depends on the angle", joint.name)
        if any(spring.damping.coulomb for spring in laws.uncoupled.values()):
            self._losses.add(_COULOMB, joint.name, effect=Effect.APPROXIMATION)
        if any(spring.damping.coulomb for spring in laws.combined):
            self._losses.add("Coulomb friction of several rotations", joint.name)


def chain_indices(branch: TreeJoint, laws: JointLaws) -> list[int | None]:
    """Places in a branch's chain, the outermost first; None stands for a ball of three turns."""
    slides = laws.chain.translations[::-1]
    about: list[int | None] = [None] if laws.is_ball else [*reversed(laws.chain.rotations)]
    outermost_first = [*slides, *about] if laws.chain.translations_are_outer else [*about, *slides]
    return outermost_first if branch.parent_is_inboard else outermost_first[::-1]


def _limits(joint: Joint, index: int) -> Range | None:
    """Limits of a displacement, an open end far away; None without any."""
    low = -inf if joint.lower_limit is None else joint.lower_limit[index]
    high = inf if joint.upper_limit is None else joint.upper_limit[index]
    if (low, high) == (-inf, inf) or low >= high:
        return None
    return max(low, -_UNREACHABLE_LENGTH), min(high, _UNREACHABLE_LENGTH)


def _format_stiffness(coefficients: tuple[float, float, float]) -> str:
    """Coefficients of a torque as those of a spring, which resists; as few as there are.

    One coefficient is what versions before 3.7 take.
    """
    count = max(k for k, term in enumerate(coefficients, 1) if term)
    return format_numbers([-term for term in coefficients[:count]])


def isotropic_stiffness(
    joint: Joint, springs: JointSprings, law: VectorLaw
) -> tuple[float, float, float] | None:
    """Return k1, k2, k3 of a torque -(k1 a + k2 a^2 + k3 a^3) r/a; None for another law.

    The law has this form over the range and beyond its ends, where stops would change it.
    """
    turns = [
        np.linspace(low - ROTATION_MARGIN, high + ROTATION_MARGIN, _GRID)
        if is_rotation(factor.kind)
        else np.zeros(1)
        for factor, (low, high) in zip(joint.chain, joint_ranges(joint, springs), strict=True)
    ]
    r = rotation_vector(Chain(joint.chain), np.array(list(product(*turns))))
    torques = law.torque(r)
    angle = np.linalg.norm(r, axis=1)
    powers = np.stack([-r * angle[:, None] ** power for power in range(3)], axis=-1).reshape(-1, 3)
    found = cast("Array", np.linalg.lstsq(powers, torques.ravel())[0])
    largest = float(np.abs(torques).max())
    if np.abs(powers @ found - torques.ravel()).max() > ROUNDING * largest:
        return None
    small = np.abs(found) * angle.max() ** np.arange(1, 4) <= ROUNDING * largest
    k1, k2, k3 = (0.0 if none else float(f"{k:.12g}") for k, none in zip(found, small, strict=True))
    return k1, k2, k3
