"""The mirror image of a figure, in the mirrored pose, moves as the mirror image."""

from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation as ScipyRotation

from generator import read_figure
from generator.figure import Figure, Location, Rotation, Segment, SiteRef, Translation
from generator.rotations import pose_matrix
from generator.simulation.plan import Plan
from generator.simulation.run import simulate
from generator.springs_file.read import read_springs
from springs import CoupledAxis, CoupledSpring, JointSprings, SphericalLaw, SpringSet
from springs.published import tables as published

PROTOTYPE = read_figure("prototype")

SIDE = np.diag([1.0, -1.0, 1.0])
"""Reflects a joint's frame: y is across in every one of them."""

WORLD = np.diag([-1.0, 1.0, 1.0])
"""Reflects the world through its sagittal plane, and a segment's own axes.

Any reflection of a segment's axes would do for the motion itself. But Euler parameters leave length
one by the square of the step, and what that does depends on the axes: the images of the axes must
be their images in the world's terms as well.
"""


def other_side(name: str) -> str:
    for one, other in (("left", "right"), ("right", "left")):
        if name.startswith(one):
            return other + name.removeprefix(one)
    for one, other in (("llateral", "rlateral"), ("lcl_lateral", "rcl_lateral")):
        if name in (one, other):
            return other if name == one else one
    return name


def mirrored_location(location: Location) -> Location:
    pose = location.pose_in_segment
    turn = ScipyRotation.from_matrix(WORLD @ pose[:3, :3] @ SIDE).as_euler("XYZ")
    x, y, z = map(float, pose[:3, 3])
    return Location((Rotation(tuple(map(float, turn))), Translation((-x, y, z))))


def mirrored_segment(segment: Segment) -> Segment:
    sites = {
        other_side(n): replace(s, name=other_side(n), location=mirrored_location(s.location))
        for n, s in segment.sites.items()
    }
    return replace(segment, name=other_side(segment.name), sites=sites)


def mirrored(figure: Figure) -> Figure:
    """Left and right exchanged, every place reflected, in the order of the original.

    The ground keeps its sites: the sagittal plane maps the one that is used onto itself.
    """

    def ref(r: SiteRef) -> SiteRef:
        if r.segment in figure.ground:
            return r
        return SiteRef(other_side(r.segment), other_side(r.site))

    segments = [
        s if n in figure.ground else mirrored_segment(s) for n, s in figure.segments.items()
    ]
    joints = {}
    for name, joint in figure.joints.items():
        new = other_side(name)
        # The chains of the two sides already differ by the signs of x and z.
        chain = figure.joints[new].chain
        joints[new] = replace(
            joint, name=new, parent=ref(joint.parent), child=ref(joint.child), chain=chain
        )
    return replace(figure, segments={s.name: s for s in segments}, joints=joints)


def mirrored_values(figure: Figure, values: dict[str, tuple[float, ...]]):
    """The same displacements on the other side; in the middle, turns about x and z change sign."""
    result = {}
    for name, numbers in values.items():
        new = other_side(name)
        if new != name:
            result[new] = numbers
            continue
        signs = [1.0 if abs(f.axis[1]) > 0.5 else -1.0 for f in figure.joints[name].chain]
        result[name] = tuple(s * n for s, n in zip(signs, numbers, strict=True))
    return result


def mirrored_springs(springs: SpringSet) -> SpringSet:
    """Each spring on the other side about the reflected axis: an axial vector, so x and z turn."""
    joints = {}
    for name, joint in springs.joints.items():
        axes = []
        for spring in joint.axes:
            x, y, z = spring.direction
            axes.append(replace(spring, direction=(-x, y, -z)))
        joints[other_side(name)] = JointSprings(other_side(name), tuple(axes))
    coupled = []
    for spring in springs.coupled:
        axes = [
            CoupledAxis(other_side(a.joint), (-a.direction[0], a.direction[1], -a.direction[2]))
            for a in spring.axes
        ]
        coupled.append(replace(spring, axes=tuple(axes)))
    return replace(springs, joints=joints, coupled=tuple(coupled))


LEG = CoupledSpring(
    published.coupled_law("riener_edrich_1999/leg").law.hold_coordinate("ankle dorsiflexion", 0.0),
    (CoupledAxis("left_hip_joint", (0.0, 1.0, 0.0)), CoupledAxis("left_knee", (0.0, -1.0, 0.0))),
)

POSE = {
    "waist": (0.2, 0.15, 0.3),
    "root_torso": (0.1, -0.2, 0.15),
    "left_shoulder": (0.3, 0.4, 0.5),
    "right_shoulder": (-0.2, 0.5, -0.3),
    "left_hip_joint": (0.2, 0.3, 0.4),
    "right_hip_joint": (0.1, -0.2, 0.6),
    "left_elbow": (0.5,),
    "right_knee": (0.7,),
}
RATES = {"left_hip_joint": (1.0, 2.0, -1.0), "right_elbow": (2.0,), "waist": (0.5, -0.4, 1.0)}


def test_the_mirror_image_of_the_prototype() -> None:
    """Within 1e-8 over 0.2 s, with a coupled law on one side.

    Centres of mass off the middle are reflected with their segments.
    """
    image = mirrored(PROTOTYPE)
    assert image != PROTOTYPE
    springs = read_springs(None, PROTOTYPE, SphericalLaw.CONSERVATIVE)
    springs = replace(springs, coupled=(LEG,))
    common = {"stop": 0.2, "step": 1e-3}
    run = simulate(PROTOTYPE, Plan(displacements=POSE, velocities=RATES, springs=springs, **common))
    reflected = simulate(
        image,
        Plan(
            displacements=mirrored_values(PROTOTYPE, POSE),
            velocities=mirrored_values(PROTOTYPE, RATES),
            springs=mirrored_springs(springs),
            **common,
        ),
    )
    assert run.outcome.succeeded
    assert reflected.outcome.succeeded
    side = pose_matrix(WORLD, np.zeros(3))
    for name in PROTOTYPE.bodies:
        expected = side @ run.poses[name] @ side
        assert np.max(np.abs(reflected.poses[other_side(name)] - expected)) < 1e-8
    for name in PROTOTYPE.joints:
        expected = np.array(
            [
                mirrored_values(PROTOTYPE, {name: tuple(r)})[other_side(name)]
                for r in run.displacements[name]
            ]
        )
        assert np.max(np.abs(reflected.displacements[other_side(name)] - expected)) < 1e-8


def test_the_springs_of_the_prototype_are_mirror_images() -> None:
    """The file's own springs: the left ones reflected are the right ones."""
    springs = read_springs(None, PROTOTYPE)
    assert mirrored_springs(springs).joints.keys() == springs.joints.keys()
    for name, joint in mirrored_springs(springs).joints.items():
        own = springs.joints[name]
        if name == "waist":
            continue  # the waist's twist and lateral bend are not quite even
        for spring, image in zip(own.axes, joint.axes, strict=True):
            angles = np.linspace(-1.0, 1.0, 21)
            told = (
                spring
                if np.dot(spring.direction, image.direction) > 0.0
                else spring.with_opposite_axis()
            )
            torques = [sum(law.torque(angles) for law in s.elastic) for s in (told, image)]
            assert np.allclose(*torques)
