"""Props and contact spheres in MJCF, and the laws of contact as MuJoCo's soft constraints.

MuJoCo's force on a sphere that is the depth r in a prop, with the rate v, is

    f = A (k s(r)^2 r + c s(r) v) / (1 - D s(r)),

if it is small beside the inertia that the contact meets: A is the inverse inertia of the body, with
which MuJoCo divides, s(r) a curve of `solimp` from its first value over D to 1, and -k A and -c A
are `solref`. With D far below 1 that is a spring and a damper of physical stiffness and damping.
k and the curve are fitted to the elastic force of the law, up to the depth that a share of the
figure's mass reaches at `BLOW_SPEED`; c is that with which a blow of the mass 1/A at that speed
rebounds as by the law.

The spheres of a part share its law; MuJoCo's resist each by itself. So each has the law over the
number of spheres that share the force of the part on the mean of all directions.
"""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import lru_cache, partial
from math import log1p, sqrt
from typing import NamedTuple

import numpy as np

from generator.contact.box import Box
from generator.contact.scene import Prop
from generator.contact.spheres import directions
from generator.contact.states import ContactModel
from generator.figure import ContactSphere, Figure
from generator.kinematics.effective_mass import mass_matrix, point_jacobian
from generator.kinematics.placement import forward_kinematics, segment_jacobians
from generator.kinematics.tree import Tree
from generator.losses import Effect, Losses
from generator.model_files.export_model import ExportModel
from generator.model_files.xml import Element, add_element, format_numbers
from generator.rotations import Array, quaternion_from_matrix, rotation_with_z_axis
from springs.contact import Surface
from springs.contact_part import PartLaw

IMPEDANCE = 0.03
"""D, the largest impedance: the share of a body's mass that a contact adds to it."""

FRICTION_RATE = 1000.0
"""Rate at which friction below its limit takes the speed of sliding [1/s]: one over a step."""

FRICTION_RATIO = 100.0
"""Impedance of friction over that of the normal force, `impratio`."""

BLOW_SPEED = 2.5
"""Speed of the blow for which damping is fitted, that of a hand or a hip in a fall [m/s]."""

LOAD_SHARE = 0.25
"""Share of the mass of the whole body in the heaviest blow of a sphere."""

SHARED_DEPTH = 0.02
"""Depth at which the number of spheres that share a force is counted [m]."""

_DIRECTIONS = 2400
_LARGEST_DEPTH, _DEPTHS = 0.3, 3000
_FITTED_DEPTHS = 150
_DAMPINGS, _STEPS, _STEP = 61, 600, 0.05
"""Number of dampings of which one is chosen, of steps of a blow, and a step over sqrt(m/k)."""

_SMALL_DAMPING = 1e-3
"""Damping times speed below which a blow is elastic."""

_FLOOR_COLOUR, _BOX_COLOUR, _SPHERE_COLOUR = "0.8 0.8 0.8 1", "0.6 0.65 0.7 1", "0.9 0.5 0.2 0.4"
_SPHERE_GROUP = "3"
"""Group of geoms that MuJoCo's viewer does not show at first."""

Law = PartLaw | Surface


class SoftLaw(NamedTuple):
    """Law of a sphere by MuJoCo's parameters, but for the inverse inertia.

    Attributes:
        stiffness: k [N/m].
        damping: c [N s/m].
        curve: `solimp`.
        error: Root mean square error of the elastic force over its largest value in the blow.
    """

    stiffness: float
    damping: float
    curve: tuple[float, float, float, float, float]
    error: float

    def force(self, depth: Array) -> Array:
        """Elastic force at depths of any shape [N]."""
        return self.stiffness * _impedance_curve(depth, *self.curve) ** 2 * depth


def _impedance_curve(
    depth: Array, first: float, last: float, width: float, middle: float, power: float
) -> Array:
    """Return s(r) of `solimp` at depths of any shape [m]."""
    x = np.clip(depth / width, 0.0, 1.0)
    below = middle * (x / middle) ** power
    above = 1.0 - (1.0 - middle) * ((1.0 - x) / (1.0 - middle)) ** power
    return (first + (last - first) * np.where(x <= middle, below, above)) / last


@lru_cache(maxsize=1024)
def fit_soft_law(law: Law, sharing: float, mass: float, load: float) -> SoftLaw:
    """Return MuJoCo's law that is nearest to that of a sphere in a blow.

    Args:
        law: Law of the part, or of the surface.
        sharing: Number of spheres that share its force.
        mass: Mass of the blow for which damping is fitted [kg].
        load: Mass of the heaviest blow for which the elastic force is [kg].
    """
    from scipy.optimize import least_squares  # slow to import

    every = np.linspace(0.0, _LARGEST_DEPTH, _DEPTHS)
    blow = 0.5 * load * BLOW_SPEED**2
    deepest = float(np.interp(blow, np.asarray(law.energy(every)), every))
    depth = np.linspace(0.0, deepest, _FITTED_DEPTHS + 1)[1:]
    wanted = np.asarray(law.elastic_force(depth)) / sharing
    largest = float(wanted[-1])

    def made(values: Array) -> SoftLaw:
        stiffness, first, width, middle, power = values.tolist()
        curve = (IMPEDANCE * first, IMPEDANCE, width * deepest, middle, power)
        return SoftLaw(np.exp(stiffness), 0.0, curve, 0.0)

    def residual(values: Array) -> Array:
        return (made(values).force(depth) - wanted) / largest

    bounds = ([-np.inf, 0.01, 0.02, 0.05, 1.0], [np.inf, 1.0, 2.0, 0.95, 6.0])
    starts = ((np.log(largest / deepest), 0.3, width, 0.5, 2.0) for width in (0.2, 1.0))
    fits: list[Array] = [least_squares(residual, start, bounds=bounds).x for start in starts]
    soft = made(min(fits, key=lambda values: float(np.sum(residual(values) ** 2))))
    damping = _damping(soft, mass, rebound(law.damping * BLOW_SPEED))
    error = float(np.sqrt(np.mean((soft.force(depth) - wanted) ** 2))) / largest
    return soft._replace(damping=damping, error=error)


def rebound(damped_speed: float) -> float:
    """Return the speed after a blow over that before, by the law of Hunt and Crossley.

    `damped_speed` is the damping of the law times the speed before.
    """
    from scipy.optimize import brentq  # slow to import

    v = damped_speed
    if v < _SMALL_DAMPING:
        return 1.0
    gap = partial(_energy_gap, v)
    return float(brentq(gap, 0.0, min(1.0, (1.0 - 1e-12) / v)))


def _energy_gap(v: float, share: float) -> float:
    return v - log1p(v) + share * v + log1p(-share * v)


def _damping(soft: SoftLaw, mass: float, share: float) -> float:
    """Return the damping c with which a blow leaves a share of its speed [N s/m]."""
    critical = 2.0 * sqrt(soft.stiffness * mass)
    dampings = critical * np.linspace(0.0, 1.5, _DAMPINGS)
    depth, speed = np.zeros(_DAMPINGS), np.full(_DAMPINGS, BLOW_SPEED)
    step = _STEP * sqrt(mass / soft.stiffness)
    for _ in range(_STEPS):
        depth += 0.5 * step * speed
        s = _impedance_curve(np.maximum(depth, 0.0), *soft.curve)
        force = s * np.maximum(soft.stiffness * s * depth + dampings * speed, 0.0)
        speed -= step / mass * np.where(depth > 0.0, force, 0.0)
        depth += 0.5 * step * speed
    return float(np.interp(-share, speed / BLOW_SPEED, dampings))


def inverse_masses(tree: Tree) -> dict[str, float]:
    """Return the inverse inertia of each body at its centre of mass as MuJoCo has it [1/kg].

    It is the mean of three directions at zero displacements.
    """
    zero = {name: np.zeros(len(chain.joint_axes)) for name, chain in tree.chains.items()}
    placement = forward_kinematics(tree, zero)
    jacobians = segment_jacobians(placement)
    inverse = np.linalg.pinv(mass_matrix(placement, jacobians), hermitian=True)
    found: dict[str, float] = {}
    for name, segment in tree.figure.bodies.items():
        centre = placement.poses[name] @ np.append(np.asarray(segment.centre_of_mass), 1.0)
        motion = point_jacobian(jacobians[name], centre[:3])
        found[name] = float(np.sum((motion @ inverse) * motion)) / 3.0
    return found


def _sharing(law: PartLaw, centres: Array, radii: Array) -> float:
    """Return how many spheres share the force of a part, on the mean of all directions.

    Args:
        law: Law of the part.
        centres: Centres of its spheres, shape (S, 3) [m].
        radii: Their radii, shape (S,) [m].
    """
    heights = directions(_DIRECTIONS) @ centres.T + radii
    depths = np.maximum(heights - heights.max(axis=1)[:, None] + SHARED_DEPTH, 0.0)
    forces: Array = np.asarray(law.elastic_force(depths), dtype=float)
    whole: Array = np.asarray(law.elastic_force(SHARED_DEPTH), dtype=float)
    return float(np.sum(forces) / len(forces) / whole)


class _Touching(NamedTuple):
    """A contact sphere with the name of its geom and its part or region, which may be empty."""

    segment: str
    geom: str
    sphere: ContactSphere
    part: str


def _touching(model: ExportModel, contact: ContactModel) -> Iterator[_Touching]:
    for name, some in contact.spheres.items():
        for k, sphere in enumerate(some):
            part = sphere.region or sphere.part or ""
            yield _Touching(name, f"{model.segments[name]}.contact_{k}", sphere, part)


def add_contact(
    model: ExportModel,
    contact: ContactModel,
    root: Element,
    bodies: Mapping[str, Element],
    losses: Losses,
) -> None:
    """Add the props, the contact spheres, and a pair for each sphere and prop.

    Args:
        model: Model that is written.
        contact: Its spheres, which belong to segments that move, its laws and the props.
        root: Element `mujoco`, with its `option` and `worldbody`.
        bodies: Bodies by segment.
        losses: Losses of the file.
    """
    option, world = root.find("option"), root.find("worldbody")
    assert option is not None
    assert world is not None
    option.attrib |= {"cone": "elliptic", "impratio": format_numbers(FRICTION_RATIO)}
    touching = list(_touching(model, contact))
    for each in touching:
        add_element(
            bodies[each.segment],
            "geom",
            name=each.geom,
            type="sphere",
            pos=format_numbers(each.sphere.centre),
            size=format_numbers(each.sphere.radius),
            mass="0",
            contype="1",
            conaffinity="0",
            group=_SPHERE_GROUP,
            rgba=_SPHERE_COLOUR,
        )
    laws = {name: replace(law, within=None) for name, law in contact.laws.items()}
    shares = _shares(model.figure, model.placement.poses, touching, laws)
    inverse, pairs = inverse_masses(model.tree), add_element(root, "contact")
    load = LOAD_SHARE * sum(segment.mass or 0.0 for segment in model.figure.bodies.values())
    errors: dict[str, float] = {}
    for prop in contact.scene.props:
        _add_prop(world, prop)
        friction = format_numbers([prop.surface.friction] * 2)
        for each in touching:
            law: Law = prop.surface
            if each.part in laws:
                law = laws[each.part].on(prop.surface.layer)
            soft = fit_soft_law(law, shares.get(each.part, 1.0), 1.0 / inverse[each.segment], load)
            label = each.part or prop.name
            errors[label] = max(errors.get(label, 0.0), soft.error)
            scale = inverse[each.segment]
            add_element(
                pairs,
                "pair",
                geom1=prop.name,
                geom2=each.geom,
                friction=friction,
                solref=format_numbers([-soft.stiffness * scale, -soft.damping * scale]),
                solimp=format_numbers(soft.curve),
                solreffriction=format_numbers([0.0, -FRICTION_RATE * IMPEDANCE]),
            )
    for name, error in sorted(errors.items(), key=lambda item: -item[1]):
        losses.add(_SOFT, f"{name} ({error:.1%})", effect=Effect.APPROXIMATION)
    if contact.laws:
        losses.add(_EACH, effect=Effect.APPROXIMATION)


_SOFT = (
    "the laws of contact: soft constraints with linear damping, whose elastic force errs in a blow "
    f"of {BLOW_SPEED:g} m/s, root mean square of its largest"
)
_EACH = (
    "the common compression of the spheres of a part: each resists by itself, with a share that is "
    "right on the mean of all directions"
)


def _shares(
    figure: Figure,
    poses: Mapping[str, Array],
    touching: list[_Touching],
    laws: Mapping[str, PartLaw],
) -> dict[str, float]:
    """Return the number of spheres that share the force of each part, in the figure's pose."""
    found: dict[str, float] = {}
    for name, law in laws.items():
        own = [one for one in touching if name in (one.sphere.part, one.sphere.region)]
        centres = [(poses[one.segment] @ np.append(one.sphere.centre, 1.0))[:3] for one in own]
        radii = np.array([one.sphere.radius for one in own])
        found[name] = _sharing(law, np.array(centres), radii) if own else 1.0
    return found


def _add_prop(world: Element, prop: Prop) -> None:
    """Add the geom of a prop: a box, or a plane without an end."""
    pose, kind = prop.shape.pose, {"type": "plane", "size": "0 0 1", "rgba": _FLOOR_COLOUR}
    turn = pose[:3, :3]
    if isinstance(prop.shape, Box):
        size = format_numbers(0.5 * np.asarray(prop.shape.size))
        kind = {"type": "box", "size": size, "rgba": _BOX_COLOUR}
    else:  # whose normal is y, and MuJoCo's z
        turn = rotation_with_z_axis(turn[:, 1])
    place = {
        "pos": format_numbers(pose[:3, 3]),
        "quat": format_numbers(quaternion_from_matrix(turn)),
    }
    add_element(world, "geom", name=prop.name, **place, **kind)
