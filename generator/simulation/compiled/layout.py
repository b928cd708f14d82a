"""Tables of a mechanism for compiled code, and the names of their columns.

A joint of several freedoms is a chain of links with one freedom each, of which the last one is the
segment and the others have no mass; three rotations are one ball. Every link has a point of its
own, that of its joint, and axes; a segment's are those of its file.
"""

from typing import Annotated, Any, NamedTuple, TypeAlias

import numpy as np
from numba import types
from numpy.typing import NDArray

from generator.simulation.compiled.compiler import (
    INDEX_TABLE,
    INDICES,
    MATRIX,
    VECTOR,
    IndexTable,
    Indices,
    Matrix,
    Stack,
    Vector,
    compiled_type,
)

IndexArray: TypeAlias = NDArray[np.int64]
CompiledLaw: TypeAlias = Any
"""Pointer to a function of the type `LAW`."""

BALL, HINGE, SLIDE, FIXED = range(4)
"""Kinds of a link's joint: free rotation, rotation about an axis, translation along it, none."""

PARENT, KIND, COORDINATE, RATE, DRIVE = range(5)
"""Columns of `links`: the inboard link (-1 is the ground), the kind of the joint, the places of its
first coordinate and of its first rate in the state (-1: none), and its row of `drive_pieces` (-1:
free). A ball's coordinates are the quaternion of its link, its rates its angular velocity [rad/s]
in world axes; those of other joints are a displacement and its rate."""

LINK_COLUMNS = 5

ARM_IN_PARENT = 0
"""From the inboard link's point to the joint, in the inboard link's axes [m] (3 numbers)."""
AXIS_IN_PARENT = 3
"""Axis of a hinge or slide in the inboard link's axes (3)."""
COSINE_TURN = 6
"""Quaternion c of a relative orientation cos(x/2) c + sin(x/2) s at the angle x (4)."""
SINE_TURN = 10
"""Quaternion s of this orientation (4)."""
CENTRE = 14
"""From the link's point to its centre of mass, in the link's axes [m] (3)."""
MASS = 17
"""Mass [kg]."""
INERTIA = 18
"""Principal moments of inertia about the centre of mass [kg m2] (3)."""
LOCKED_VALUE = 21
"""Angle of a locked joint with one rotation [rad], else zero."""
CONSTANT_COLUMNS = 22

(
    MEASURED_PARENT,
    MEASURED_CHILD,
    MEASURED_LINK,
    MEASURED_ENDS_RUN,
    MEASURED_FORM,
    MEASURED_ANGLE,
) = range(6)
"""Columns of `measured`: the links of the parent's and of the child's site of a joint of several
rotations, or of one that closes a loop; or the link of a single displacement, else -1; 1 where a
zero of the margin ends the run; what is measured; and the place of an angle in the state,
else -1."""

MEASURED_COLUMNS = 6

ROTATION_VECTOR, ANGLE, SHIFT, TWO_ANGLES, THREE_ANGLES, RIGHTING, ACTIVATION = range(7)
"""Forms of a measured joint without a link: the components of its rotation vector, the angle about
its only axis, a displacement along an axis, the angles of a chain of two or three rotations,
innermost first; the rotation vector of the child's site from an orientation in the world; and the
activation of muscles. An angle of a joint that closes a loop is unwrapped by the integral of its
rate, which stands in the state. Righting has components along the axes of the child's site; its
torque acts on the child and its reaction on the parent's link."""

SITE_IN_PARENT, SITE_IN_CHILD = 0, 4
"""Columns of `sites`: quaternions of the joint's sites in the axes of their links. Those of a chain
are turned so that the innermost axis is x and the outermost is z. Of righting the first is the
upright orientation in the world."""
SITE_AXIS = 8
"""Axis of an angle or shift in the axes of the parent's site (3). Where the axis of a shift is the
child's, parent and child are exchanged, and it is reversed."""
MIDDLES, HANDEDNESS = 8, 11
"""Of a chain: middles of the ranges of its angles [rad] (3), each of which is within half a turn of
its own, and 1 or -1 for the middle one of three axes along y or against it."""
PLACE_IN_PARENT, PLACE_IN_CHILD = 11, 14
"""Sites of a shift from the points of their links, in the links' axes [m] (3)."""
SITE_COLUMNS = 17

LOAD_LINK, LOAD_IS_FORCE, LOAD_IS_LOCAL = range(3)
"""Columns of `loads`: the link, and 1 or 0 for what acts and along which axes."""

LINKED, ALONG, ACROSS = range(3)
"""Kinds of constraint rows: a hinge or slide follows another one, the second link's site has no
displacement along an axis of the first, an axis of the second stays perpendicular to one of the
first."""

ROW_KIND, ROW_FIRST, ROW_SECOND, ROW_PIECE, ROW_PIECES_END = range(5)
"""Columns of `rows`: the kind and two links, -1 for the ground; of linked displacements the
control, which is -1 where it is locked, then the follower, and the first and the end of the pieces
of its curve."""

FIRST_SITE, FIRST_AXIS, SECOND_SITE, SECOND_AXIS = 0, 3, 6, 9
"""Columns of `row_constants` of rows that are not linked: site from the link's point and axis, in
the axes of the first and of the second link (3 numbers each)."""

ROW_CONSTANT_COLUMNS = 12

GROUP_LINK, GROUP_FIRST, GROUP_END = range(3)
"""Columns of `sphere_groups`: the link of a segment, its first sphere, and the end of them."""

SPHERE_CENTRE, SPHERE_RADIUS = 0, 3
"""Columns of `sphere_constants`: centre from the link's point in its axes (3), and radius [m]."""

PROP_ORIGIN, PROP_AXES, PROP_LEAST, PROP_LARGEST = 0, 3, 12, 15
"""Columns of `prop_constants`: origin [m] (3), axes in the world (9), least and largest coordinates
along them (3 each) [m]."""

PROP_COLUMNS = 18

CONTACT_DEPTH, CONTACT_RATE, CONTACT_NORMAL, CONTACT_STIFFNESS = 17, 18, 19, 22
CONTACT_DAMPING, CONTACT_FRICTION, CONTACT_BEND = 23, 24, 25
"""Places in `Scratch.contact_work` of the depth, its rate, the direction of the normal force (3),
and its derivatives; see `ContactForce`."""

CONTACT_INPUTS, CONTACT_RESULTS = 9, 17
"""Number of the arguments of the law of contact, and of its results; see `Scratch.contact_work`."""

TOUCH_FORCE, TOUCH_MOMENT, TOUCH_NORMAL, TOUCH_DEEPEST = 0, 3, 6, 9
"""Columns of `touches`: force of a prop on a sphere, its moment about the link's point, direction
of the normal force, and the sphere's deepest point from the link's point (3 numbers each)."""
TOUCH_IMPACT, TOUCH_FRICTION_POWER, TOUCH_DEPTH, TOUCH_RATE = 12, 13, 14, 15
"""Powers of impact damping and friction, depth and its rate."""
TOUCH_STIFFNESS, TOUCH_DAMPING, TOUCH_FRICTION, TOUCH_BEND = 16, 17, 18, 19
"""Derivatives of the force; see `ContactForce`."""
TOUCH_COLUMNS = 20

TOUCH_GROUP, TOUCH_SPHERE, TOUCH_PROP = range(3)
"""Columns of `touch_places`: group of the sphere, sphere and prop."""

PART_DAMPING, PART_NORM_SCALE, PART_STAGES, PART_FIRST_STAGE = range(4)
"""Places of the constants of a part and a prop: damping, scale of the norm and number of stages of
`PartLaw`, and of each stage its beginning, added stiffness and transition (3)."""

PART_LARGEST, PART_SUM, PART_RATES, PART_WEIGHTS = range(4)
"""Columns of `part_sums`: largest depth of the part's spheres in a prop, and sums over the shares s
of the others in it: of s^p, of s^(p-1) times the rate, of s^(p-1)."""
PART_SCALE, PART_FORCE, PART_SLOPE = range(4, 7)
"""Derivative of the norm by a depth over s^(p-1), zero until it is known, the elastic force of the
part and its derivative."""
PART_SUM_COLUMNS = 7

PAIR_FIRST, PAIR_SECOND = range(2)
"""Columns of `pairs`: the links of two capsules."""

FIRST_MIDDLE, FIRST_HALF, SECOND_MIDDLE, SECOND_HALF = 0, 3, 6, 9
"""Columns of `pair_constants`: middle of a capsule from its link's point and half of its line, in
the link's axes (3 numbers each) [m]."""
PAIR_REACH, RADIUS_DIFFERENCE, PAIR_RANGE = 12, 13, 14
"""Distance of the lines below which they touch, radius of the first less that of the second, and
distance of the middles beyond which they are apart [m]."""

PAIR_CONSTANT_COLUMNS = 15

PAIR_INPUTS, PAIR_RESULTS = 20, 11
"""Number of the arguments of the law of two capsules, and of its results; see
`Scratch.contact_work`."""

STEP_CENTRE, STEP_ACCELERATIONS = 0, 3
"""Places in the record of a step: centre of mass of the figure [m], accelerations of those of the
links [m/s2] (3 each). Then follow the forces on the segments with spheres [N] (3 each), depth [m]
and its rate [m/s] of each sphere, and the forces on the parts of the body [N] (3 each)."""

CONTACT_WORK = max(CONTACT_INPUTS + CONTACT_RESULTS, PAIR_INPUTS + PAIR_RESULTS)
"""Size of `Scratch.contact_work`."""


class Mechanism(NamedTuple):
    """Tables of a mechanism with n links, m measured joints and l loads; k intervals of time.

    Attributes:
        links: integers by link, shape (n, LINK_COLUMNS); a link follows its inboard link.
        constants: numbers by link, shape (n, CONSTANT_COLUMNS).
        measured: links of each joint with a law, shape (m, MEASURED_COLUMNS).
        sites: orientation and places of its sites, shape (m, SITE_COLUMNS).
        loads: links and kinds of the loads, shape (l, 3).
        load_points: where they act, from the link's point in its axes, shape (l, 3) [m].
        knots: starts of the intervals in which loads and drives are polynomials, shape (k,) [s].
        load_pieces: values at the start of an interval and slopes, shape (k, l, 6).
        drive_pieces: coefficients of cubics in the time since its start, shape (k, drives, 4); with
            tone the last ones are of its activation.
        gravity: acceleration in world axes, shape (3,) [m/s2].
        parameters: constants of the laws, shape (p,); the first two scale springs and damping.
        law_rows: first parameter and switching function of each use of a law's form, then the
            displacements that it reads, shape (r, c).
        law_bounds: first use of each form, and the end, shape (forms + 1,).
        branches: 1 where a switching function of a law counts as positive, else -1: of the laws of
            joints, then the sign of each measured joint's quaternion; shape (s + m,).
        rows: kinds and links of the constraints beyond the tree, shape (q, 5).
        row_constants: their numbers, shape (q, ROW_CONSTANT_COLUMNS).
        row_curves: pieces of the curves of linked displacements; see `FollowerCurve.pieces`.
        sphere_groups: link and contact spheres of each segment that has some, in the order of
            `Scratch.contact_forces`, shape (g, 3).
        sphere_reaches: distance from the link's point within which all of them are, shape (g,) [m].
        sphere_constants: places and radii of the spheres, shape (c, 4).
        props: numbers of their shapes' classes, shape (d, 1).
        prop_constants: their numbers, shape (d, PROP_COLUMNS).
        contact_parameters: constants of the law of contact.
        contact_offsets: first of these for each sphere and prop, shape (c, d).
        sphere_parts: part of the body to which each sphere belongs, and firmer region of it or -1,
            shape (c, 2); (0, 2) where each sphere resists by itself.
        part_offsets: first of `part_parameters` for each part and prop, shape (parts, d).
        part_parameters: their constants; see `PART_DAMPING`.
        pairs: links of pairs of capsules, shape (a, 2).
        pair_constants: their places, shape (a, PAIR_CONSTANT_COLUMNS).
        pair_parameters: constants of their law.
    """

    links: IndexTable
    constants: Matrix
    measured: IndexTable
    sites: Matrix
    loads: IndexTable
    load_points: Matrix
    knots: Vector
    load_pieces: Stack
    drive_pieces: Stack
    gravity: Vector
    parameters: Vector
    law_rows: IndexTable
    law_bounds: Indices
    branches: Vector
    rows: IndexTable
    row_constants: Matrix
    row_curves: Matrix
    sphere_groups: IndexTable
    sphere_reaches: Vector
    sphere_constants: Matrix
    props: IndexTable
    prop_constants: Matrix
    contact_parameters: Vector
    contact_offsets: IndexTable
    sphere_parts: IndexTable
    part_offsets: IndexTable
    part_parameters: Vector
    pairs: IndexTable
    pair_constants: Matrix
    pair_parameters: Vector


MECHANISM = compiled_type(Mechanism)

ROTATION = 0
"""Axes of a link in the world (9)."""
ORIENTATION = 9
"""Their quaternion (4)."""
SPIN = 13
"""Angular velocity (3)."""
POINT = 16
"""Point of the link (3)."""
VELOCITY = 19
"""Velocity of the point (3)."""
SPIN_RATE = 22
"""Angular acceleration (3)."""
POINT_ACCELERATION = 25
"""Acceleration of the point less gravity (3)."""
RECORDED_COLUMNS = 28
"""Number of the columns before, which a recording keeps."""
ARM = 28
"""From the inboard link's point to its own (3)."""
AXIS = 31
"""Axis of its joint (3)."""
SPIN_BIAS = 34
"""Angular acceleration relative to the inboard link without that of the joint (3)."""
POINT_BIAS = 37
"""Acceleration of the point beyond that of the inboard link's body, likewise (3)."""
ANGULAR_INERTIA = 40
"""Part J of the articulated inertia, symmetric (6)."""
COUPLING_INERTIA = 46
"""Part H (9)."""
LINEAR_INERTIA = 55
"""Part M, symmetric (6)."""
MOMENT = 61
"""Bias moment n about the point (3)."""
FORCE = 64
"""Bias force f (3)."""
EFFORT = 67
"""Torque of a hinge or force of a slide by its law."""
JOINT_VALUE = 68
"""Displacement of a hinge or slide."""
JOINT_RATE = 69
"""Rate of a hinge or slide."""
BALL_GAIN = 70
"""Of a ball: J^-1 H (9)."""
BALL_SPIN_RATE = 79
"""Of a ball: -J^-1 n (3)."""
AXIS_INERTIA = 82
"""Of a hinge or slide: J and H, or H and M, times the axis (6)."""
INVERSE_INERTIA = 88
"""Inverse of the inertia along the axis."""
NET_EFFORT = 89
"""Effort less the bias along the axis."""
PARENT_GAIN = 90
"""Of a ball with added inertia B: (J + B)^-1 B (9)."""
WORK_COLUMNS = 99
"""Number of all columns."""

DIRECTION = 0
"""Of a constraint row: the axis of its force, or its couple, in world axes (3)."""
SLOPE = 0
"""Of a linked displacement: the derivative of its curve, in place of the direction."""
FIRST_ARM = 3
"""From the first link's point to the second's site (3)."""
SECOND_ARM = 6
"""From the second link's point to its site (3)."""
ROW_VALUE, ROW_RATE, ROW_BIAS = 9, 10, 11
"""The constrained displacement, its rate, and its second derivative at zero accelerations."""
MULTIPLIER = 12
"""Force or torque of the row."""
ROW_WRENCH = 13
"""Force of a joint's row on its second link, and its moment about the origin (6)."""
ROW_COLUMNS = 19

RESPONSE_SPIN_RATE = 0
"""Angular acceleration of a link by the unit force or torque of a row (3)."""
RESPONSE_ACCELERATION = 3
"""Acceleration of its point (3)."""
RESPONSE_JOINT = 6
"""Acceleration of its hinge or slide; of a driven one, the effort of the drive."""
RESPONSE_MOMENT = 7
"""Bias moment about its point, as `MOMENT` (3)."""
RESPONSE_FORCE = 10
"""Bias force (3)."""
RESPONSE_EFFORT = 13
"""Effort in its hinge."""
RESPONSE_COLUMNS = 14

DISSIPATION, NONCONSERVATIVE, EXTERNAL, IMPACT, FRICTION, TONE = range(6)
"""Powers that are integrated with the state [W]: of damping in joints, into laws without an energy,
of loads and drives, of damping in contacts, of friction, and of the tone of muscles."""
POWERS = 6


class Scratch(NamedTuple):
    """Working memory of an evaluation.

    Attributes:
        work: quantities of each link in world axes, shape (n, WORK_COLUMNS).
        displacements: displacements of the measured joints [rad or m], shape (m, 3).
        rates: their rates, those of rotation vectors being angular velocities in the half-way
            frame, shape (m, 3).
        torques: torques of the laws, on the child [N m or N], shape (m, 3).
        torque_axes: axes of the components of the torques in the world, as columns, shape (m, 9):
            the half-way frame of a rotation vector; of a chain the vectors that are dual to the
            axes of its rates; the axis of an angle. Of a shift its axis and the arms to the child's
            site from the points of the parent's and the child's link.
        switching: switching functions of the laws, then the cosines with their signs, (s + m,).
        powers: see `POWERS`, shape (POWERS,).
        row_work: quantities of each constraint row in world axes, shape (q, ROW_COLUMNS).
        responses: responses of each link to a unit of each row, shape (q, n, RESPONSE_COLUMNS).
        factor: factor of the rows' accelerations by their multipliers, by Cholesky, shape (q, q).
        residual: right-hand side, then solution of these equations, shape (q,).
        added_inertia: inertia that a linearly implicit method adds between a link and the inboard
            one, symmetric and in world axes for balls, along the axis for hinges and slides (first
            column), shape (n, 6); (0, 6) for explicit methods.
        contact_forces: contact forces on each segment with contact spheres, in world axes, shape
            (g, 3) [N].
        touches: what touches, in world axes, with room for all c d spheres and props, shape (c d,
            TOUCH_COLUMNS).
        touch_places: where it does, shape (c d + 1, 3), the row after the last one with the group
            -1; see `TOUCH_GROUP`.
        part_sums: sums over the spheres of a part that touch a prop, shape (parts, d,
            PART_SUM_COLUMNS).
        contact_work: arguments of the law of contact in the axes of a prop (centre of the sphere,
            its velocity and angular velocity), then its results (force and moment about the centre,
            powers of impact damping and friction, and what `CONTACT_DEPTH` and the next name). Of
            the law of two capsules, in world axes: from the first's middle to the second's, halves
            of both lines, velocity of the second's middle relative to the first's, both angular
            velocities, reach and difference of the radii; force on the second, moments on the first
            and on the second about their middles, and the powers.
    """

    work: Matrix
    displacements: Matrix
    rates: Matrix
    torques: Matrix
    torque_axes: Matrix
    switching: Vector
    powers: Vector
    row_work: Matrix
    responses: Stack
    factor: Matrix
    residual: Vector
    added_inertia: Matrix
    contact_forces: Matrix
    touches: Matrix
    touch_places: IndexTable
    part_sums: Stack
    contact_work: Vector


SCRATCH = compiled_type(Scratch)

LAW_SIGNATURE = types.void(
    MATRIX, MATRIX, VECTOR, VECTOR, INDEX_TABLE, INDICES, MATRIX, VECTOR, VECTOR
)
"""Displacements, rates, parameters, branches, uses, bounds; results: torques, switching functions,
powers."""

LAW = types.FunctionType(LAW_SIGNATURE)

CONTACTS = types.FunctionType(types.void(MECHANISM, SCRATCH))
STEP_RECORD = types.FunctionType(types.void(MECHANISM, SCRATCH, VECTOR))


class Laws(NamedTuple):
    """Pointers to the functions of forces.

    Attributes:
        joints: laws of the joints.
        contacts: contact of spheres with props.
        pairs: contact of capsules with each other.
        record_step: contact record of a step.
    """

    joints: Annotated[CompiledLaw, LAW]
    contacts: Annotated[Any, CONTACTS]
    pairs: Annotated[Any, CONTACTS]
    record_step: Annotated[Any, STEP_RECORD]


LAWS = compiled_type(Laws)
