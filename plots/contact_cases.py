"""Motions in contact that have a closed form, each simulated and compared with it.

The bodies are free, touch with a few spheres, and start where these touch a plane. The closed forms
follow from the law of `springs.contact.Surface`; none of them has a number in common with the
simulation but the constants of the case.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from math import asinh, atan, cos, exp, hypot, sin, sqrt, tan

import numpy as np
from scipy.optimize import brentq
from scipy.special import lambertw

from generator import Plan, Recording, simulate
from generator.contact.plane import Plane
from generator.contact.scene import Prop, Scene
from generator.contact.shape import Shape
from generator.figure import (
    AxisKind,
    ContactSphere,
    Figure,
    Joint,
    JointAxis,
    Location,
    Segment,
    Site,
    SiteRef,
    Vector,
)
from generator.run_options import Integrator
from springs import SpringSet
from springs.backends import Array
from springs.contact import Surface

GRAVITY = 9.81
"""[m/s^2]"""

MASS = 2.0
"""Mass of every body [kg]."""

BODY = "body"

_WORLD_AXES: tuple[Vector, ...] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))

BALL_RADIUS = 0.1
"""[m]"""

BALL_INERTIA = 0.4 * MASS * BALL_RADIUS**2
"""Moment of inertia of a homogeneous ball [kg m^2]."""

BALL = (ContactSphere((0.0, 0.0, 0.0), BALL_RADIUS),)

BLOCK_HALF_SIZE = (0.1, 0.05, 0.1)
"""Half the edges of the block, its contact spheres included [m]."""

_BLOCK_SPHERE_RADIUS = 0.02

BLOCK = tuple(
    ContactSphere((i * x, j * y, k * z), _BLOCK_SPHERE_RADIUS)
    for x, y, z in [[half - _BLOCK_SPHERE_RADIUS for half in BLOCK_HALF_SIZE]]
    for i, j, k in product((-1, 1), repeat=3)
)
"""Spheres in the corners of the block."""

BLOCK_INERTIA = tuple(
    MASS / 3.0 * (sum(half**2 for half in BLOCK_HALF_SIZE) - own**2) for own in BLOCK_HALF_SIZE
)
"""Moments of inertia of the homogeneous block [kg m^2]."""

_BLOCK_SPHERES_BELOW = 4

FIRM = Surface(damping=20.0)
"""Surface on which a body comes to rest at once; the closed forms do not contain the damping."""

ROD_LENGTH = 1.0
"""[m]"""

ROD_FOOT = 0.02
"""Radius of the contact sphere at the lower end of the rod [m]."""

ROD_INERTIA = MASS * ROD_LENGTH**2 / 12.0
"""Moment of inertia of the thin rod about its centre [kg m^2]."""

ROUGH = Surface(stiffness=1e6, damping=20.0, friction=5.0, transition_depth=1e-4)
"""Hard and rough surface, on which the foot of the rod rolls and hardly moves up or down."""

HORIZONTAL = Plane((0.0, 0.0, 0.0), (0.0, 1.0, 0.0))

TOLERANCE = 2e-8
"""Tolerance of the runs [rad or m]."""


@dataclass(frozen=True)
class ContactCase:
    """A simulated motion, and a number of it beside the same number by its closed form."""

    measured: float
    closed_form: float
    run: Recording

    @property
    def relative_error(self) -> float:
        """Difference from the closed form, relative to it."""
        return abs(self.measured / self.closed_form - 1.0)


def free_body(
    spheres: Sequence[ContactSphere],
    inertia: Sequence[float],
    position: Sequence[float],
    turn: float = 0.0,
) -> Figure:
    """Return a figure of one body, whose centre of mass is its origin.

    Args:
        spheres: spheres by which it touches.
        inertia: principal moments [kg m^2].
        position: position of its centre [m].
        turn: turn about the world's z axis [rad].
    """
    x, y, z = map(float, inertia)
    turned = JointAxis(AxisKind.ROTATION, (0.0, 0.0, 1.0))
    moved = [JointAxis(AxisKind.TRANSLATION, axis) for axis in _WORLD_AXES]
    ground = Segment("ground", mass=-1.0, sites={"base": Site("base")})
    sites = {name: Site(name, Location()) for name in ("CM", "near")}
    body = Segment(BODY, MASS, (x, y, z), sites=sites, contact_spheres=tuple(spheres))
    base = SiteRef("ground", "base")
    place = (turn, *map(float, position))
    pin = Joint("pin", base, SiteRef(BODY, "near"), (turned, *moved), place)
    return Figure({"ground": ground, BODY: body}, {"pin": pin}, base)


def slope_normal(slope: float) -> Vector:
    """Normal of a plane that descends towards +x with an angle [rad]."""
    return (sin(slope), cos(slope), 0.0)


def simulate_contact(
    figure: Figure,
    shape: Shape,
    surface: Surface,
    stop: float,
    *,
    velocity: Vector = (0.0, 0.0, 0.0),
    spin: Vector = (0.0, 0.0, 0.0),
    gravity: Vector = (0.0, -GRAVITY, 0.0),
    frames: int = 50,
    tolerance: float = TOLERANCE,
    integrator: Integrator = Integrator.COMPILED,
) -> Recording:
    """Simulate a body of `free_body` and a prop.

    Args:
        figure: the body.
        shape: shape of the prop.
        surface: surface of the prop.
        stop: end of the run [s].
        velocity: velocity of its centre at the start [m/s].
        spin: angular velocity at the start [rad/s].
        gravity: [m/s^2].
        frames: number of intervals between frames.
        tolerance: [rad or m].
        integrator: method of integration.
    """
    plan = Plan(
        stop=stop,
        frame=stop / frames,
        tolerance=tolerance,
        springs=SpringSet(),
        gravity=gravity,
        free_root=True,
        scene=Scene((Prop("prop", shape, surface),)),
        velocities={BODY: (*spin, *velocity)},
        integrator=integrator,
    )
    return simulate(figure, plan)


def body_velocity(run: Recording) -> Array:
    """Velocity of the centre of mass of a body of `free_body`, shape (n, 3) [m/s]."""
    return run.velocities[BODY][:, 3:]


def restitution(damping: float, speed: float) -> float:
    """Return the coefficient of restitution of an impact at a speed [m/s] without gravity.

    From m dv/dt = -k q(d) (1 + a v) and v = dd/dt follows m v dv / (1 + a v) = -k q dd, whose right
    side has the same integral on the way in as, with the other sign, on the way out. So

        a v - ln(1 + a v) = -a e v - ln(1 - a e v),

    which contains neither the stiffness, nor the mass, nor the function q. By the principal branch
    W of Lambert's function, e = (1 + W(-(1 + a v) exp(-1 - a v))) / a v.

    Args:
        damping: a [s/m].
        speed: v of the approach [m/s].
    """
    x = damping * speed
    if x == 0.0:
        return 1.0
    return (1.0 + float(np.real(lambertw(-(1.0 + x) * exp(-1.0 - x))))) / x


def simulate_impact(
    surface: Surface,
    speed: float,
    tolerance: float = TOLERANCE,
    integrator: Integrator = Integrator.COMPILED,
) -> Recording:
    """Let a ball hit a plane without gravity; see `simulate_contact` for the arguments."""
    ball = free_body(BALL, (BALL_INERTIA,) * 3, (0.0, BALL_RADIUS, 0.0))
    # Ten times the duration of a linear impact with the transition depth added to the depth.
    depth = surface.transition_depth + speed * sqrt(MASS / surface.stiffness)
    return simulate_contact(
        ball,
        HORIZONTAL,
        surface,
        10.0 * depth / speed,
        velocity=(0.0, -speed, 0.0),
        gravity=(0.0, 0.0, 0.0),
        tolerance=tolerance,
        integrator=integrator,
    )


def rebound(damping: float, speed: float, stiffness: float) -> ContactCase:
    """Compare the speed after an impact."""
    run = simulate_impact(Surface(stiffness, damping), speed)
    return ContactCase(float(body_velocity(run)[-1, 1]) / speed, restitution(damping, speed), run)


def peak_force(speed: float, surface: Surface) -> float:
    """Largest force of an impact without damping [N]: where the energy stored is m v^2 / 2."""
    energy, e = 0.5 * MASS * speed**2, surface.transition_depth
    deepest = e + speed * sqrt(MASS / surface.stiffness)
    depth = brentq(lambda depth: float(surface.energy(depth)) - energy, 0.0, deepest)
    return float(surface.elastic_force(float(depth)))


def elastic_peak(speed: float) -> ContactCase:
    """Compare the largest force of an impact without damping."""
    surface = Surface(damping=0.0)
    run = simulate_impact(surface, speed)
    assert run.contact is not None
    return ContactCase(run.contact.max_force, peak_force(speed, surface), run)


def creep_speed(slope: float, surface: Surface) -> float:
    """Speed with which a body creeps down a slope below the friction angle [m/s].

    The friction mu N c / sqrt(c^2 + s^2) equals the downhill force N tan(slope).
    """
    ratio = tan(slope) / surface.friction
    return surface.friction_speed * ratio / sqrt(1.0 - ratio**2)


def slip_acceleration(slope: float, surface: Surface) -> float:
    """Acceleration of a body that slips down a slope by Coulomb's friction [m/s^2].

    It is g (sin - mu cos), far above the friction speed.
    """
    return GRAVITY * (sin(slope) - surface.friction * cos(slope))


def resting_depth(load: float, surface: Surface) -> float:
    """Depth in which a contact sphere carries a load [N] at rest [m]."""
    e = surface.transition_depth
    high = e + load / surface.stiffness
    return float(brentq(lambda depth: float(surface.elastic_force(depth)) - load, 0.0, high))


def stopping_distance(speed: float, surface: Surface, sinking: float = 0.0) -> float:
    """Distance in which a body that slides on a horizontal plane comes to rest [m].

    From v dv/dx = -mu g v / sqrt(v^2 + s^2) the distance is that of Coulomb's friction, v^2 / 2 mu
    g, with a correction: (v sqrt(v^2 + s^2) + s^2 asinh(v / s)) / 2 mu g. A body that sinks into
    the plane at the beginning is meanwhile carried by less than its weight: the friction that is
    missing lengthens the way by mu times the depth.

    Args:
        speed: speed at the start [m/s].
        surface: surface with mu and s.
        sinking: depth into which the body sinks [m].
    """
    s, mu = surface.friction_speed, surface.friction
    return (speed * hypot(speed, s) + s**2 * asinh(speed / s)) / (2.0 * mu * GRAVITY) + mu * sinking


def _block_on_slope(slope: float, stop: float, speed: float = 0.0) -> Recording:
    """Simulate a block that lies on a firm slope; its speed is downhill."""
    normal = slope_normal(slope)
    position = [BLOCK_HALF_SIZE[1] * part for part in normal]
    return simulate_contact(
        free_body(BLOCK, BLOCK_INERTIA, position, -slope),
        Plane((0.0, 0.0, 0.0), normal),
        FIRM,
        stop,
        velocity=(speed * cos(slope), -speed * sin(slope), 0.0),
    )


def downhill_velocity(run: Recording, slope: float) -> Array:
    """Velocity of the centre of mass down a slope, shape (n,) [m/s]."""
    return body_velocity(run) @ (cos(slope), -sin(slope), 0.0)


def _late_acceleration(run: Recording, slope: float) -> float:
    """Mean acceleration down a slope in the last fifth of a run [m/s^2]."""
    speed, first = downhill_velocity(run, slope), len(run.times) * 4 // 5
    return float((speed[-1] - speed[first]) / (run.times[-1] - run.times[first]))


def creeping_block(slope: float) -> ContactCase:
    """Put a block on a slope below the friction angle."""
    friction, speed = FIRM.friction * GRAVITY * cos(slope), creep_speed(slope, FIRM)
    settling = hypot(speed, FIRM.friction_speed) ** 3 / (friction * FIRM.friction_speed**2)
    run = _block_on_slope(slope, 0.2 + 10.0 * settling)
    return ContactCase(float(downhill_velocity(run, slope)[-1]), speed, run)


def slipping_block(slope: float) -> ContactCase:
    """Put a block on a slope above the friction angle."""
    run = _block_on_slope(slope, 1.0)
    return ContactCase(_late_acceleration(run, slope), slip_acceleration(slope, FIRM), run)


def stopping_block(speed: float) -> ContactCase:
    """Let a block slide to rest on a horizontal plane."""
    run = _block_on_slope(0.0, 1.2 * speed / (FIRM.friction * GRAVITY) + 0.1, speed)
    sinking = resting_depth(MASS * GRAVITY / _BLOCK_SPHERES_BELOW, FIRM)
    distance = float(np.ptp(run.centre_of_mass[:, 0]))
    return ContactCase(distance, stopping_distance(speed, FIRM, sinking), run)


def resting_block() -> ContactCase:
    """Put a block on a horizontal plane."""
    run = _block_on_slope(0.0, 0.6)
    assert run.contact is not None
    carried = run.contact.weight_carried
    assert carried is not None
    return ContactCase(carried, 1.0, run)


def friction_angle_of_rolling(surface: Surface) -> float:
    """Slope above which a homogeneous ball slips [rad]: the friction 2/7 m g sin exceeds mu N."""
    return atan(3.5 * surface.friction)


def ball_acceleration(slope: float, surface: Surface) -> float:
    """Acceleration of a homogeneous ball down a slope [m/s^2]: 5/7 g sin where it rolls."""
    if slope < friction_angle_of_rolling(surface):
        return 5.0 / 7.0 * GRAVITY * sin(slope)
    return slip_acceleration(slope, surface)


def ball_on_incline(slope: float, *, turned_gravity: bool = False) -> ContactCase:
    """Release a ball on a slope: on an inclined plane, or on a horizontal one in turned gravity."""
    tilt = 0.0 if turned_gravity else slope
    normal = slope_normal(tilt)
    down = slope - tilt
    run = simulate_contact(
        free_body(BALL, (BALL_INERTIA,) * 3, [BALL_RADIUS * part for part in normal]),
        Plane((0.0, 0.0, 0.0), normal),
        FIRM,
        1.0,
        gravity=(GRAVITY * sin(down), -GRAVITY * cos(down), 0.0),
    )
    return ContactCase(_late_acceleration(run, tilt), ball_acceleration(slope, FIRM), run)


def rolling_speed(speed: float) -> float:
    """Speed with which a homogeneous ball rolls that began by sliding [m/s]: 5/7 of that speed.

    The friction has no moment about the line of contact.
    """
    return speed / (1.0 + BALL_INERTIA / (MASS * BALL_RADIUS**2))


def ball_begins_to_roll(speed: float) -> ContactCase:
    """Let a ball slide on a horizontal plane until it rolls."""
    run = simulate_contact(
        free_body(BALL, (BALL_INERTIA,) * 3, (0.0, BALL_RADIUS, 0.0)),
        HORIZONTAL,
        FIRM,
        speed / (3.5 * FIRM.friction * GRAVITY) + 0.2,
        velocity=(speed, 0.0, 0.0),
    )
    return ContactCase(float(body_velocity(run)[-1, 0]), rolling_speed(speed), run)


def tipping_rate(start: float, angle: float) -> float:
    """Angular velocity of a thin rod that tips and rolls over its rounded foot [rad/s].

    The potential energy m g h (cos start - cos angle), with the centre h above that of the foot's
    sphere of radius r, becomes (I + m (h^2 + 2 h r cos angle + r^2)) omega^2 / 2.

    Args:
        start: angle from the vertical at which it was at rest [rad].
        angle: angle from the vertical [rad].
    """
    h, r = 0.5 * ROD_LENGTH, ROD_FOOT
    inertia = ROD_INERTIA + MASS * (h**2 + 2.0 * h * r * cos(angle) + r**2)
    return sqrt(2.0 * MASS * GRAVITY * h * (cos(start) - cos(angle)) / inertia)


def tipping_rod(start: float, angles: Sequence[float]) -> tuple[ContactCase, ...]:
    """Release a rod that stands on its foot, `start` from the vertical; a case for each angle."""
    half = 0.5 * ROD_LENGTH
    run = simulate_contact(
        free_body(
            (ContactSphere((0.0, -half, 0.0), ROD_FOOT),),
            (ROD_INERTIA, 1e-3 * ROD_INERTIA, ROD_INERTIA),
            (half * sin(start), half * cos(start) + ROD_FOOT, 0.0),
            -start,
        ),
        HORIZONTAL,
        ROUGH,
        0.75,
        frames=150,
    )
    poses = run.poses[BODY]
    tilts = np.arctan2(poses[:, 0, 1], poses[:, 1, 1])
    frames = [int(np.argmin(np.abs(tilts - angle))) for angle in angles]
    rates = -run.velocities[BODY][:, 0]
    return tuple(
        ContactCase(float(rates[frame]), tipping_rate(start, float(tilts[frame])), run)
        for frame in frames
    )


def tumbling_block() -> Recording:
    """Throw a spinning block on a horizontal plane."""
    block, start = free_body(BLOCK, BLOCK_INERTIA, (0.0, 0.3, 0.0), 0.4), (1.5, 0.0, 0.4)
    spin = (5.0, 3.0, -7.0)
    return simulate_contact(
        block, HORIZONTAL, Surface(), 1.2, velocity=start, spin=spin, frames=120
    )


def exchanged_energy(run: Recording) -> float:
    """Range of the kinetic energy of a run plus the energy dissipated [J]."""
    lost = run.energy["contact damping"][-1] + run.energy["friction"][-1]
    return float(np.ptp(run.energy["kinetic"]) + lost)
