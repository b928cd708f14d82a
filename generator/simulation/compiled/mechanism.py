"""Tables of a figure for the compiled evaluation, and its initial state."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import assert_never

import numpy as np

from generator.contact.states import ContactModel
from generator.drive import Drive
from generator.figure import ContactSphere, Joint, SiteRef, is_rotation
from generator.follower_curve import POWERS_FROM, CurveKind, FollowerCurve
from generator.joint_chain import Chain
from generator.kinematics.closures import independent_constraints, rotation_equations
from generator.kinematics.placement import Placement, segment_jacobians
from generator.kinematics.prescribed import PrescribedMotion, driven_indices
from generator.kinematics.tree import TreeJoint
from generator.loads import TimedLoad
from generator.rotations import (
    Array,
    cross_product,
    inverse_pose,
    quaternion_from_matrix,
    unit_vector,
)
from generator.simulation.compiled.compiler import FunctionPointer
from generator.simulation.compiled.contact_tables import (
    NO_PAIRS,
    NO_SPHERES,
    contact_tables,
    pair_tables,
)
from generator.simulation.compiled.equations import (
    EVALUATE_LAWS,
    KEEP_STATE,
    RECORD_NOTHING,
    TOUCH_NOTHING,
    TREE_RATES,
    Equations,
)
from generator.simulation.compiled.law_code import (
    LawUse,
    Place,
    build_law_tables,
    coupled_law,
    displacement_law,
    rotation_vector_law,
    tone_law,
    vector_tone_law,
)
from generator.simulation.compiled.layout import (
    ACROSS,
    ACTIVATION,
    ALONG,
    ANGLE,
    ARM_IN_PARENT,
    AXIS_IN_PARENT,
    BALL,
    CENTRE,
    CONSTANT_COLUMNS,
    CONTACT_WORK,
    COORDINATE,
    COSINE_TURN,
    DRIVE,
    FIXED,
    HANDEDNESS,
    HINGE,
    INERTIA,
    KIND,
    LINK_COLUMNS,
    LINKED,
    LOCKED_VALUE,
    MASS,
    MEASURED_COLUMNS,
    MIDDLES,
    PARENT,
    PART_SUM_COLUMNS,
    POWERS,
    RATE,
    RESPONSE_COLUMNS,
    RIGHTING,
    ROTATION_VECTOR,
    ROW_COLUMNS,
    ROW_CONSTANT_COLUMNS,
    SHIFT,
    SINE_TURN,
    SITE_COLUMNS,
    SLIDE,
    STEP_ACCELERATIONS,
    THREE_ANGLES,
    TOUCH_COLUMNS,
    TWO_ANGLES,
    WORK_COLUMNS,
    CompiledLaw,
    IndexArray,
    Laws,
    Mechanism,
    Scratch,
)
from generator.simulation.muscle_tone import JointTones
from generator.simulation.run_model import BoundSpring, JointKind, bind_springs
from springs import AxisSpring, CoupledAxis, RotationLaw, Singularity, SpringSet
from springs.coordinates import CoordinateLaw
from springs.tone.activation import Activation

_NO_SITES = np.zeros(SITE_COLUMNS)


@dataclass(frozen=True)
class CompiledModel:
    """A figure ready for compiled integration.

    Attributes:
        equations: equations of motion, with the laws of its joints.
        mechanism: its tables.
        scratch: working memory of evaluations.
        initial_state: coordinates, rates and integrals of powers, shape (n,).
        balls: number of balls; their quaternions come first in a state.
        segment_links: link of each moving segment.
        points: point of each link in the axes of its segment, shape (links, 3) [m]; zero for links
            within a joint.
        joint_links: inboard link (-1 for the ground) and outboard link of each joint, shape (j, 2).
        measured_joints: joint name of each measured joint.
        coordinates: coordinates for each joint whose displacements are all coordinates, their
            places in a state, in the order of its chain.
        factor_links: link of each factor of a joint that has its own, by the joint's name and the
            factor's index; of a ball, by its innermost rotation; of a fixed joint, by -1.
        row_joints: joint of each constraint row that closes a loop, and True where the second link
            is that of the child; rows of linked rotations come after them.
        touching: names of the segments with contact spheres, in the order of the integrals of their
            forces, which come before those of powers in a state.
    """

    equations: Equations
    mechanism: Mechanism
    scratch: Scratch
    initial_state: Array
    balls: int
    segment_links: Mapping[str, int]
    points: Array
    joint_links: IndexArray
    measured_joints: tuple[str, ...]
    coordinates: Mapping[str, tuple[int, ...]]
    factor_links: Mapping[tuple[str, int], int]
    row_joints: tuple[tuple[str, bool], ...]
    touching: tuple[str, ...]

    @property
    def has_contact(self) -> bool:
        """True if segments may touch props or each other."""
        return len(self.mechanism.sphere_groups) + len(self.mechanism.pairs) > 0

    @property
    def step_record(self) -> int:
        """Number of columns of the record of a step; see `STEP_CENTRE`."""
        links, spheres = len(self.mechanism.links), len(self.mechanism.sphere_constants)
        parts = len(self.mechanism.part_offsets)
        return STEP_ACCELERATIONS + 3 * (links + len(self.touching) + parts) + 2 * spheres

    @property
    def integrals(self) -> int:
        """Number of integrals of forces and powers, which come last in a state."""
        return 3 * len(self.touching) + POWERS

    @property
    def rate_places(self) -> list[int]:
        """Places of the rates in a state."""
        return [
            int(row[RATE]) + k
            for row in self.mechanism.links
            if row[RATE] >= 0
            for k in range(3 if row[KIND] == BALL else 1)
        ]


@dataclass
class _Link:
    """A link while the tables are made.

    Attributes:
        parent: the inboard link; -1 is the ground.
        kind: kind of its joint.
        arm: arm from the inboard link's point to the joint, in the inboard link's axes, shape (3,)
            [m].
        turn: axes of the joint in those of the inboard link, shape (3, 3).
        axis: axis of a hinge or slide, in the inboard link's axes, shape (3,).
        joint: name of the figure's joint.
        factor: index of the factor in the joint's chain; -1 for a fixed joint.
        tip: pose of the joint's site in the segment, shape (4, 4); None within a joint.
        segment: name of the segment; None within a joint.
        drive: index of its drive; -1 without one.
    """

    parent: int
    kind: int
    arm: Array
    turn: Array
    axis: Array
    joint: str
    factor: int = -1
    tip: Array | None = None
    segment: str | None = None
    drive: int = -1


@dataclass
class MechanismBuilder:
    """Build the tables of a figure, joint by joint.

    Attributes:
        placement: initial placement, with closed loops.
        rates: rates of the tree's displacements, shape (m,) [rad/s or m/s].
        springs: the springs of its joints, without obstacles.
        prescribed: locks, links and drives.
        loads: loads on moving segments.
        gravity: gravity in world axes [m/s2].
        times: start and stop [s].
        contacts: contact with props and of segments; None without any.
        tone: tone of the joints; None without any.
    """

    placement: Placement
    rates: Array
    springs: SpringSet
    prescribed: PrescribedMotion
    loads: Sequence[TimedLoad]
    gravity: Sequence[float]
    times: tuple[float, float]
    contacts: ContactModel | None = None
    tone: JointTones | None = None

    def __post_init__(self) -> None:
        """Begin without links."""
        self.tree, self.figure = self.placement.tree, self.placement.tree.figure
        self.links: list[_Link] = []
        self.segment_links: dict[str, int] = {}
        self.factor_links: dict[tuple[str, int], int] = {}
        self.drives: list[tuple[Drive, int]] = []
        self.row_joints: list[tuple[str, bool]] = []
        self.motion_size = 0  # coordinates and rates
        self.closing_angles: list[float] = []
        self.touching: dict[str, Sequence[ContactSphere]] = {}
        if self.contacts is not None:
            self.touching = {name: some for name, some in self.contacts.spheres.items() if some}

    def build(self) -> CompiledModel:
        """Return the model with its initial state."""
        for branch in self.tree.joints:
            self._add_joint(branch)
        links, constants, points = self._link_tables()
        measured, sites, uses, names = self._laws()
        law, parameters, law_rows, law_bounds, switches = build_law_tables(uses)
        activation = () if self.tone is None else (self.tone.activation,)
        drives = [drive for drive, _ in self.drives]
        knots = smooth_intervals(self.loads, drives, self.times, activation)
        touching, contacts = self.touching, self.contacts
        spheres, pairs = NO_SPHERES, NO_PAIRS
        if contacts is not None:
            scene, laws = contacts.scene, contacts.laws
            spheres = contact_tables(scene, touching, self.segment_links, points, laws)
            pairs = pair_tables(contacts.pairs, self.segment_links, points)
        state = self._initial_state(links)
        mechanism = Mechanism(
            links,
            constants,
            measured,
            sites,
            *self._load_tables(points),
            knots,
            load_pieces(self.loads, knots, self.times[1]),
            drive_pieces(self.drives, knots, self.times[1], activation),
            np.array(self.gravity, dtype=float),
            parameters,
            law_rows,
            law_bounds,
            np.ones(switches + len(measured)),
            *self._rows(),
            *spheres,
            *pairs,
        )
        rows, count = len(mechanism.rows), len(measured)
        touches = mechanism.contact_offsets.size
        scratch = Scratch(
            np.zeros((len(links), WORK_COLUMNS)),
            np.zeros((count, 3)),
            np.zeros((count, 3)),
            np.zeros((count, 3)),
            np.zeros((count, 9)),
            np.zeros(switches + count),
            np.zeros(POWERS),
            np.zeros((rows, ROW_COLUMNS)),
            np.zeros((rows, len(links), RESPONSE_COLUMNS)),
            np.zeros((rows, rows)),
            np.zeros(rows),
            np.zeros((0, 6)),
            np.zeros((len(touching), 3)),
            np.zeros((touches, TOUCH_COLUMNS)),
            np.full((touches + 1, 3), -1, dtype=np.int64),
            np.zeros((*mechanism.part_offsets.shape, PART_SUM_COLUMNS)),
            np.zeros(CONTACT_WORK),
        )
        joint_links = [self._end_links(joint.ends) for joint in self.figure.joints.values()]
        return CompiledModel(
            _equations_with(law, mechanism),
            mechanism,
            scratch,
            state,
            sum(link.kind == BALL for link in self.links),
            self.segment_links,
            points,
            np.array(joint_links, dtype=np.int64).reshape(-1, 2),
            tuple(names),
            self._coordinates(links),
            self.factor_links,
            tuple(self.row_joints),
            tuple(touching),
        )

    def _coordinates(self, links: IndexArray) -> dict[str, tuple[int, ...]]:
        places = {
            name: tuple(
                int(links[self.factor_links[name, k], COORDINATE])
                if (name, k) in self.factor_links
                and self.links[self.factor_links[name, k]].kind in (HINGE, SLIDE)
                else -1
                for k in range(len(self.figure.joints[name].chain))
            )
            for name in self.tree.kinematics.columns
        }
        return {name: some for name, some in places.items() if some and min(some) >= 0}

    def _add_joint(self, branch: TreeJoint) -> None:
        """Add the links of a joint, from its inboard to its outboard segment."""
        joint, chain = branch.joint, self.tree.chains[branch.joint.name]
        ends = joint.ends if branch.parent_is_inboard else joint.ends[::-1]
        inboard, outboard = (self.figure.site(ref).pose_in_segment for ref in ends)
        parent = self.segment_links.get(branch.inboard, -1)
        if parent < 0:
            inboard = self.placement.poses[branch.inboard] @ inboard
        else:
            inboard = inboard.copy()
            inboard[:3, 3] -= self._own_point(parent)
        steps = self._steps(joint.name, chain, branch.parent_is_inboard)
        if not steps or joint.name in self.prescribed.locked:
            locked = self.placement.pose_in_parent(joint)
            pose = inboard @ (locked if branch.parent_is_inboard else inverse_pose(locked))
            self.factor_links.update(
                {(joint.name, k): len(self.links) for k in range(len(joint.chain))}
            )
            steps = [(FIXED, np.zeros(3), -1)]
            inboard = pose
        for number, (kind, axis, factor) in enumerate(steps):
            pose = inboard if number == 0 else np.eye(4)
            link = _Link(
                parent, kind, pose[:3, 3], pose[:3, :3], pose[:3, :3] @ axis, joint.name, factor
            )
            parent = len(self.links)
            self.links.append(link)
            self.factor_links[joint.name, factor] = parent
            drive = self.prescribed.drives.get(joint.name)
            if drive is not None and factor in (driven := driven_indices(joint, drive)):
                link.drive = len(self.drives)
                self.drives.append((drive, driven.index(factor)))
        self.links[-1].tip = outboard
        self.links[-1].segment = branch.outboard
        self.segment_links[branch.outboard] = parent

    def _steps(
        self, name: str, chain: Chain, parent_is_inboard: bool
    ) -> list[tuple[int, Array, int]]:
        """Kind, axis and factor of the links of a joint, in their order from the inboard side."""
        sense = 1.0 if parent_is_inboard else -1.0
        steps = [
            (HINGE if is_rotation(one.kind) else SLIDE, sense * unit_vector(one.axis), k)
            for k, one in enumerate(chain.joint_axes)
        ]
        slides, turns = (
            [steps[k] for k in reversed(places)] for places in (chain.translations, chain.rotations)
        )
        linked = {
            end.joint
            for link in self.prescribed.resolved_links
            for end in (link.follower, link.control)
        }
        if len(chain.rotations) == 3 and name not in linked and name not in self.prescribed.drives:
            turns = [(BALL, np.zeros(3), chain.rotations[0])]
        steps = [*slides, *turns] if chain.translations_are_outer else [*turns, *slides]
        return steps if parent_is_inboard else steps[::-1]

    def _own_point(self, link: int) -> Array:
        """Point of a link in the axes of its segment."""
        tip = self.links[link].tip
        return np.zeros(3) if tip is None else tip[:3, 3]

    def _link_tables(self) -> tuple[IndexArray, Array, Array]:
        links = np.full((len(self.links), LINK_COLUMNS), -1, dtype=np.int64)
        constants = np.zeros((len(self.links), CONSTANT_COLUMNS))
        points = np.array([self._own_point(k) for k in range(len(self.links))])
        balls = sum(link.kind == BALL for link in self.links)
        free = [link for link in self.links if link.kind in (HINGE, SLIDE) and link.drive < 0]
        coordinates = 4 * balls + len(free)
        self.motion_size = coordinates + 3 * balls + len(free)
        ball, scalar = 0, 0
        for k, link in enumerate(self.links):
            links[k, PARENT], links[k, KIND], links[k, DRIVE] = link.parent, link.kind, link.drive
            if link.kind == BALL:
                links[k, COORDINATE], links[k, RATE] = 4 * ball, coordinates + 3 * ball
                ball += 1
            elif link.kind != FIXED and link.drive < 0:
                links[k, COORDINATE] = 4 * balls + scalar
                links[k, RATE] = coordinates + 3 * balls + scalar
                scalar += 1
            row = constants[k]
            row[ARM_IN_PARENT : ARM_IN_PARENT + 3] = link.arm
            row[AXIS_IN_PARENT : AXIS_IN_PARENT + 3] = link.axis
            if link.kind == FIXED and len(self.tree.chains[link.joint].rotations) == 1:
                index = self.tree.chains[link.joint].rotations[0]
                row[LOCKED_VALUE] = self.placement.displacements[link.joint][index]
            tip = np.eye(3) if link.tip is None else link.tip[:3, :3].T
            base = quaternion_from_matrix(link.turn)
            after = quaternion_from_matrix(tip)
            row[COSINE_TURN : COSINE_TURN + 4] = _product(base, after)
            if link.kind == HINGE:
                local = np.append(0.0, link.turn.T @ link.axis)
                row[SINE_TURN : SINE_TURN + 4] = _product(base, _product(local, after))
            if link.segment is not None:
                segment = self.figure.segments[link.segment]
                centre = segment.centre_of_mass
                assert centre is not None
                assert segment.inertia is not None
                row[CENTRE : CENTRE + 3] = centre - points[k]
                row[MASS] = segment.mass
                row[INERTIA : INERTIA + 3] = segment.inertia
        return links, constants, points

    def _laws(self) -> tuple[IndexArray, Array, list[LawUse], list[str]]:
        """Measured joints with their sites, the laws that use them, and the joints' names."""
        bound, coupled = bind_springs(self.tree, self.springs, self.tone)
        coupled_names = {axis.joint for spring in coupled for axis in spring.axes}
        rows: list[list[int]] = []
        sites: list[Array] = []
        uses: list[LawUse] = []
        names: list[str] = []
        row_of: dict[str, int] = {}
        laws: dict[str, RotationLaw] = {}
        holds = not (self.touching or (self.contacts and self.contacts.pairs))
        for name, one in ((name, one) for name, group in bound.items() for one in group):
            joint, chain = self.figure.joints[name], self.tree.chains[name]
            springs: Sequence[AxisSpring | None] = one.springs
            match one.kind:
                case JointKind.REVOLUTE:
                    row_of[name] = len(rows)
                    springs = springs or (None,)
                    row, site = self._angle_row(joint, chain)
                case JointKind.SPHERICAL:
                    assert one.law is not None
                    row_of[name], law = len(rows), one.law
                    laws[name] = law
                    elastic = name in coupled_names or any(spring.elastic for spring in law.axes)
                    row, site = self._rotation_row(joint, law, elastic)
                    springs = law.springs if isinstance(law, CoordinateLaw) else ()
                    if not springs:
                        uses.append(rotation_vector_law(law, len(rows), holds_pieces=holds))
                case JointKind.PRISMATIC:
                    row, site = self._shift_row(joint, chain, one.axis_index)
                case _:
                    assert_never(one.kind)
            uses += [
                displacement_law(spring, (len(rows), k), holds_pieces=holds)
                for k, spring in enumerate(springs)
            ]
            rows.append(row)
            sites.append(site)
            names.append(name)
        for spring in coupled:
            by_vector = [
                name
                for name in dict.fromkeys(axis.joint for axis in spring.axes)
                if name in laws and not isinstance(laws[name], CoordinateLaw)
            ]
            vectors = tuple((name, row_of[name], laws[name]) for name in by_vector)
            places = tuple(
                None
                if axis.joint in by_vector
                else self._place(axis, row_of[axis.joint], laws.get(axis.joint))
                for axis in spring.axes
            )
            uses.append(coupled_law(spring, places, vectors, holds_pieces=holds))
        if self.tone is not None:
            activation = len(rows)
            rows.append([-1, -1, -1, 0, ACTIVATION, -1])
            sites.append(_NO_SITES)
            names.append("")
            for name in self.tone.hold:
                uses += _hold_laws(bound[name][0], row_of[name], activation)
            for name, righting in self.tone.righting.items():
                joint = self.figure.joints[name]
                uses.append(vector_tone_law(righting.axes, len(rows), activation, is_righting=True))
                rows.append([*self._end_links(joint.ends), -1, 0, RIGHTING, -1])
                site = self._sites(joint.ends, np.zeros(3))
                site[:4] = quaternion_from_matrix(righting.upright)
                sites.append(site)
                names.append(name)
        return (
            np.array(rows, dtype=np.int64).reshape(-1, MEASURED_COLUMNS),
            np.array(sites, dtype=float).reshape(-1, SITE_COLUMNS),
            uses,
            names,
        )

    def _place(self, axis: CoupledAxis, row: int, law: RotationLaw | None) -> tuple[Place, float]:
        """Displacement about an axis of a joint, and the sense in which it is counted."""
        if isinstance(law, CoordinateLaw):
            component, sense = law.coordinates.place(axis.direction)
            return (row, component), sense
        (only,) = self.tree.chains[axis.joint].rotation_axes
        return (row, 0), float(np.sign(np.dot(axis.direction, only)))

    def _rotation_row(
        self, joint: Joint, law: RotationLaw, is_elastic: bool
    ) -> tuple[list[int], Array]:
        """Rows of `Mechanism.measured` and `Mechanism.sites` of a joint's two or three angles."""
        ends = self._end_links(joint.ends)
        if not isinstance(law, CoordinateLaw):
            ends_run = is_elastic and law.singularity is Singularity.HALF_TURN
            row = [*ends, -1, int(ends_run), ROTATION_VECTOR, -1]
            return row, self._sites(joint.ends, np.zeros(3))
        chain = law.coordinates
        inner, outer = np.array(chain.axes[0]), np.array(chain.axes[-1])
        turn = np.column_stack([inner, cross_product(outer, inner), outer])
        site = self._sites(joint.ends, np.zeros(3), turn)
        site[[MIDDLES, MIDDLES + 2]] = chain.middles[0], chain.middles[-1]
        if len(chain.axes) == 2:
            return [*ends, -1, 0, TWO_ANGLES, -1], site
        site[HANDEDNESS] = np.sign(turn[:, 1] @ np.array(chain.axes[1]))
        return [*ends, -1, 1, THREE_ANGLES, -1], site

    def _angle_row(self, joint: Joint, chain: Chain) -> tuple[list[int], Array]:
        """Rows of `Mechanism.measured` and `Mechanism.sites` of a joint's only angle."""
        index = chain.rotations[0]
        if joint not in self.tree.closures:
            return self._link_row(joint.name, index), _NO_SITES
        place = self.motion_size + len(self.closing_angles)
        self.closing_angles.append(float(self.placement.displacements[joint.name][index]))
        row = [*self._end_links(joint.ends), -1, 0, ANGLE, place]
        return row, self._sites(joint.ends, unit_vector(chain.rotation_axes[0]))

    def _shift_row(self, joint: Joint, chain: Chain, index: int) -> tuple[list[int], Array]:
        """Rows of `Mechanism.measured` and `Mechanism.sites` of a translation of a joint."""
        if joint not in self.tree.closures:
            return self._link_row(joint.name, index), _NO_SITES
        ends, axis = joint.ends, chain.translation_gradient(index)
        if not chain.translations_are_outer:
            ends, axis = ends[::-1], -axis
        return [*self._end_links(ends), -1, 0, SHIFT, -1], self._sites(ends, axis)

    def _rows(self) -> tuple[IndexArray, Array, Array]:
        """Rows of the joints that close loops and of the links, their constants and curves."""
        rows: list[list[int]] = []
        constants: list[Array] = []
        locks = independent_constraints(self.placement) if self.tree.closures else {}
        for joint in self.tree.closures:
            for lock in locks[joint.name]:
                ends = (joint.child, joint.parent) if lock.from_child else joint.ends
                first, second = (self.segment_links.get(ref.segment, -1) for ref in ends)
                (place, axes), (other_place, other_axes) = (
                    self._site_on_link(ref, lock.frame) for ref in ends
                )
                kinds = [(ALONG, k, k) for k in range(3) if lock.translations[k]]
                kinds += [(ACROSS, u, v) for u, v, _ in rotation_equations(lock.rotations)]
                for kind, u, v in kinds:
                    rows.append([kind, first, second, 0, 0])
                    constants.append(
                        np.concatenate([place, axes[:, u], other_place, other_axes[:, v]])
                    )
                    self.row_joints.append((joint.name, not lock.from_child))
        pieces: list[Array] = []
        for link in self.prescribed.resolved_links:
            curve, control = link.as_curve, -1
            if link.control.joint in self.prescribed.locked:
                locked = self.prescribed.locked[link.control.joint][link.control.index]
                curve = FollowerCurve(CurveKind.POLYNOMIAL, (float(link.at(locked)),))
            else:
                control = self.factor_links[link.control.joint, link.control.index]
            follower = self.factor_links[link.follower.joint, link.follower.index]
            first = len(pieces)
            pieces += list(curve.pieces)
            rows.append([LINKED, control, follower, first, len(pieces)])
            constants.append(np.zeros(ROW_CONSTANT_COLUMNS))
        curves = np.zeros((len(pieces), max(map(len, pieces), default=POWERS_FROM)))
        for row, piece in zip(curves, pieces, strict=True):
            row[: len(piece)] = piece
        return (
            np.array(rows, dtype=np.int64).reshape(-1, 5),
            np.array(constants, dtype=float).reshape(-1, ROW_CONSTANT_COLUMNS),
            curves,
        )

    def _site_on_link(self, ref: SiteRef, frame: Array) -> tuple[Array, Array]:
        """Place of a site from its link's point, and the axes of a joint frame in it.

        In the axes of the link; of the ground, in world axes.
        """
        pose = self.figure.site(ref).pose_in_segment
        link = self.segment_links.get(ref.segment, -1)
        if link < 0:
            pose = self.placement.poses[ref.segment] @ pose
            return pose[:3, 3], pose[:3, :3] @ frame
        return pose[:3, 3] - self._own_point(link), pose[:3, :3] @ frame

    def _link_row(self, name: str, factor: int) -> list[int]:
        """Row of a single displacement of a joint in the tree."""
        return [-1, -1, self.factor_links[name, factor], 0, ROTATION_VECTOR, -1]

    def _end_links(self, ends: Sequence[SiteRef]) -> list[int]:
        return [self.segment_links.get(ref.segment, -1) for ref in ends]

    def _sites(self, ends: Sequence[SiteRef], axis: Array, turn: Array | None = None) -> Array:
        """Row of `Mechanism.sites`; both frames may be turned."""
        frame = np.eye(3) if turn is None else turn
        places, axes = zip(*(self._site_on_link(ref, frame) for ref in ends), strict=True)
        quaternions = [quaternion_from_matrix(turn) for turn in axes]
        return np.concatenate([*quaternions, axis, *places])

    def _initial_state(self, links: IndexArray) -> Array:
        jacobians = segment_jacobians(self.placement)
        columns = self.tree.kinematics.columns
        size = self.motion_size + len(self.closing_angles)
        state = np.zeros(size + 3 * len(self.touching) + POWERS)
        state[self.motion_size : size] = self.closing_angles
        outboard = {branch.joint.name: branch for branch in self.tree.joints}
        for row, link in zip(links, self.links, strict=True):
            place, rate = row[COORDINATE], row[RATE]
            if place < 0:
                continue
            if link.kind == BALL:
                branch = outboard[link.joint]
                orientation = self.placement.poses[branch.outboard][:3, :3]
                if link.segment is None:
                    ends = branch.joint.ends
                    ref = ends[1] if branch.parent_is_inboard else ends[0]
                    orientation = orientation @ self.figure.site(ref).pose_in_segment[:3, :3]
                state[place : place + 4] = quaternion_from_matrix(orientation)
                state[rate : rate + 3] = (jacobians[branch.outboard] @ self.rates)[:3]
            else:
                state[place] = self.placement.displacements[link.joint][link.factor]
                state[rate] = self.rates[columns[link.joint].start + link.factor]
        return state

    def _load_tables(self, points: Array) -> tuple[IndexArray, Array]:
        rows = [
            [
                self.segment_links[load.site.segment],
                int(load.kind.is_force),
                int(load.kind.is_local),
            ]
            for load in self.loads
        ]
        places = [
            self.figure.site(load.site).pose_in_segment[:3, 3]
            - points[self.segment_links[load.site.segment]]
            for load in self.loads
        ]
        return (
            np.array(rows, dtype=np.int64).reshape(-1, 3),
            np.array(places, dtype=float).reshape(-1, 3),
        )


def _hold_laws(turns: BoundSpring, row: int, activation: int) -> list[LawUse]:
    """Tones that hold the displacements of a joint, as `rotation_tone` states them."""
    if turns.law is None:
        return [tone_law(axis, (row, 0), activation) for axis in turns.tone]
    if not isinstance(turns.law, CoordinateLaw):
        return [vector_tone_law(turns.tone, row, activation)]
    chain = turns.law.coordinates
    places = [chain.place(axis.direction)[0] for axis in turns.tone]
    return [
        tone_law(axis.oriented_along(chain.axes[k]), (row, k), activation)
        for axis, k in zip(turns.tone, places, strict=True)
    ]


def _product(p: Array, q: Array) -> Array:
    """Quaternion of the rotation by q followed by p."""
    scalar = p[0] * q[0] - p[1:] @ q[1:]
    vector = p[0] * q[1:] + q[0] * p[1:] + cross_product(p[1:], q[1:])
    return np.concatenate([[scalar], vector])


def _equations_with(law: CompiledLaw, mechanism: Mechanism) -> Equations:
    """Return the equations of motion of a mechanism with the laws of its joints.

    With rows of constraints beyond the tree, with contacts, or with contacts between links, the
    functions for these are compiled as well.
    """
    contacts, pairs, record_step = TOUCH_NOTHING, TOUCH_NOTHING, RECORD_NOTHING
    if len(mechanism.sphere_groups) > 0:
        from generator.simulation.compiled.contact_forces import APPLY_CONTACTS, RECORD_STEP

        contacts, record_step = APPLY_CONTACTS, RECORD_STEP
    if len(mechanism.pairs) > 0:
        from generator.simulation.compiled.self_contact_forces import APPLY_PAIRS

        pairs = APPLY_PAIRS
    laws = Laws(law, contacts, pairs, record_step)
    if len(mechanism.rows) == 0:
        return Equations(laws, EVALUATE_LAWS, TREE_RATES, KEEP_STATE)
    from generator.simulation.compiled.projection import (
        compute_constrained_rates,
        project_state,
    )

    constrained = FunctionPointer(compute_constrained_rates), FunctionPointer(project_state)
    return Equations(laws, EVALUATE_LAWS, *constrained)


_SAMPLED_SHARES = np.array([0.25, 0.75])
"""Places within an interval at which a load is read, away from jumps at its ends."""


def smooth_intervals(
    loads: Sequence[TimedLoad],
    drives: Sequence[Drive],
    times: tuple[float, float],
    activations: Sequence[Activation] = (),
) -> Array:
    """Start, and times until the stop at which a load, drive or tone is not smooth, (k,) [s]."""
    start, stop = times
    ends = [float(t) for load in loads for t in load.times]
    ends += [float(t) for drive in drives for t in drive.times]
    ends += [t for activation in activations for t in activation.knots]
    return np.array([start, *sorted({t for t in ends if start < t < stop})])


def load_pieces(loads: Sequence[TimedLoad], knots: Array, stop: float) -> Array:
    """Value at the start of each interval and slope of each load, shape (k, l, 6)."""
    lengths = np.diff(np.append(knots, stop))
    inner = knots[:, None] + _SAMPLED_SHARES * lengths[:, None]
    pieces = np.zeros((len(knots), len(loads), 6))
    for k, load in enumerate(loads):
        values = load.components(inner)
        slopes = (values[:, 1] - values[:, 0]) / (0.5 * lengths[:, None])
        pieces[:, k, 3:] = slopes
        pieces[:, k, :3] = values[:, 0] - slopes * (0.25 * lengths[:, None])
    return pieces


def drive_pieces(
    drives: Sequence[tuple[Drive, int]],
    knots: Array,
    stop: float,
    activations: Sequence[Activation] = (),
) -> Array:
    """Coefficients of each drive's cubic in the time since each interval's start, (k, drives, 4).

    Those of activations follow.

    Args:
        drives: each with one of its columns.
        knots: starts of the intervals, shape (k,) [s].
        stop: end of the last interval [s].
        activations: activations of muscles.
    """
    middles = 0.5 * (knots + np.append(knots[1:], stop))
    pieces = np.zeros((len(knots), len(drives) + len(activations), 4))
    for k, (drive, column) in enumerate(drives):
        for order, factor in enumerate((1.0, 1.0, 0.5)):
            pieces[:, k, order] = factor * drive.derivatives(knots, order)[:, column]
        pieces[:, k, 3] = drive.derivatives(middles, 3)[:, column] / 6.0
    ends = np.append(knots[1:], stop)
    for k, activation in enumerate(activations, len(drives)):
        pieces[:, k] = [activation.cubic(*one) for one in zip(knots, ends, strict=True)]
    return pieces
