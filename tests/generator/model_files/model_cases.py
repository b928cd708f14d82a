"""Figures and springs that models in other formats are compared on, and our motions of them."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from generator.figure import AxisKind, Figure, JointAxis, Site
from generator.figure_file import read_figure
from generator.kinematics.free_root import detach_root
from generator.kinematics.loops import close_loops
from generator.kinematics.placement import initial_displacements
from generator.kinematics.tree import build_tree
from generator.losses import Loss
from generator.recording import Recording
from generator.simulation.plan import Plan
from generator.simulation.run import simulate
from generator.springs_file.read import read_springs
from springs import AxisSpring, Cubic, Damping, Elastic, JointSprings, Linear, SpringSet, Stop
from springs.exponential import Exponential, ExponentialTerm
from springs.hysteresis import Hysteresis
from springs.interpolated import Interpolated
from tests.chains import BALL, FREE, Vector, at, body, chain, figure, ground, joint, two_bodies

Values = Mapping[str, Sequence[float]]

AGREEMENT = 1e-4
"""Largest difference of orientations allowed [rad], and of places [m]."""

TOLERANCE = 2e-5
"""That our runs are asked to hold [rad]."""

STOP, FRAME = 0.5, 0.05


def posed(drawn: Figure, degrees: Values) -> Figure:
    """The figure with other displacements of some joints."""
    joints = dict(drawn.joints)
    for name, angles in degrees.items():
        joints[name] = replace(joints[name], displacement=tuple(np.radians(angles).tolist()))
    return replace(drawn, joints=joints)


BENT = {
    "waist": (10.0, 20.0, -15.0),
    "root_torso": (5.0, -10.0, 8.0),
    "left_shoulder": (20.0, 40.0, -30.0),
    "right_shoulder": (-15.0, 25.0, 35.0),
    "right_elbow": (-40.0,),
    "left_elbow": (-5.0,),
    "right_hip_joint": (10.0, 15.0, -30.0),
    "left_knee": (100.0,),
}
"""Elbows and a knee on their springs, and on both sides of the dead zones."""

PROTOTYPE = posed(read_figure("prototype"), BENT)
CLAVICLES = posed(read_figure("clavicles"), BENT | {"left_clavicle": (10.0, -20.0)})
PENDULUM = read_figure("pendulum")
"""With a constant force at its centre of mass."""

FOURBAR = read_figure("fourbar")

START = (0.5, -0.3, 0.4)


def slider(text: str, *, reverse: bool = False) -> Figure:
    """Two bodies whose second one slides and turns, by a chain as in `chain`."""
    kinds = [word[0] for word in text.split()]
    start = [0.2 if kind is AxisKind.ROTATION else 0.05 for kind in kinds]
    return two_bodies(chain(text), start, reverse=reverse)


def on_a_rail() -> Figure:
    """A body that slides on a rail on the ground, with a bar on a hinge."""
    cart = body("cart", sites={"pin": at((0.2, 0.1, 0.0), (0.0, 0.1, 0.0))})
    bar = body("bar", mass=1.1, centre=(0.0, -0.3, 0.1))
    rail = joint("rail", "ground.base", "cart.near", chain("Ts"), (0.3,))
    return figure(
        [ground(), cart, bar], [rail, joint("hinge", "cart.pin", "bar.near", chain("R-x"))]
    )


def unheld(held: Figure) -> Figure:
    """The figure in its pose, without its joints to the ground."""
    values = {name: np.array(one.displacement) for name, one in held.joints.items()}
    return detach_root(held, values)[0]


def named_alike() -> Figure:
    """Names that those of parts of a joint, or of the other program's own parts, may meet."""
    first = body("world", sites={"far": at((0.4, -0.7, 0.3), (0.1, -0.3, 0.2))})
    second = body("a_between", sites={"far": at(shift=(0.2, 0.0, 0.1))})
    joints = [
        joint("a", "ground.base", "world.near", chain("Rx Ry Rx"), (0.1, 0.3, 0.2)),
        joint("a_1", "world.far", "a_between.near", chain("Rz"), (0.3,)),
        joint("a_outer", "a_between.far", "a_link.near", chain("Rx Rz"), (0.4, 0.2)),
        joint("a_outer_1", "a_link.far", "ground_.near", chain("Ry"), (0.4,)),
    ]
    third = body("a_link", sites={"far": at(shift=(0.0, 0.3, 0.0))})
    return figure([ground(), first, second, third, body("ground_")], joints)


TREES = {
    "names that meet": named_alike(),
    "prototype": PROTOTYPE,
    "prototype, let go": unheld(PROTOTYPE),
    "clavicles": CLAVICLES,
    "pendulum": PENDULUM,
    "oblique axes, the last along the first": two_bodies(chain("Rs Ra Rs"), START),
    "the same, child nearer to the root": two_bodies(chain("Rs Ra Rs"), START, reverse=True),
    "three axes, child nearer to the root": two_bodies(chain("Rz R-x Ry"), START, reverse=True),
    "two turns": two_bodies(chain("Rs Ra"), START[:2]),
    "two turns, child nearer to the root": two_bodies(chain("Rs Ra"), START[:2], reverse=True),
    "slides along the parent's axes": slider("Rs Ra Tx Tz"),
    "slides along the child's axes": slider("Tx Ts Rz Ry"),
    "slides along the child's axes, child nearer to the root": slider("Tx Ts Rz Ry", reverse=True),
    "slides and turns about three axes": slider("Rx Ry Rz Tx Ty"),
    "a slide along the child's axis, turns about three": slider("Ty Rx Ry Rz", reverse=True),
    "a slide between two turns about its axis": slider("Rz Tz Ry"),
    "a free body on a fixed one": two_bodies((), ()),
    "rail": on_a_rail(),
}
"""Figures without loops."""


LOADED = figure(
    [
        ground(),
        body(
            "link",
            sites={
                "loaded": Site(
                    "loaded",
                    at((0.4, -0.7, 0.3), (0.1, -0.3, 0.2)),
                    global_force=(1.0, -2.0, 0.5),
                    local_force=(0.3, 0.2, -1.0),
                    global_moment=(0.1, 0.0, -0.2),
                    local_moment=(0.05, -0.1, 0.02),
                )
            },
        ),
    ],
    [joint("pin", "ground.base", "link.near", BALL, (0.3, 0.2, 0.1))],
)
"""Loads of all kinds at a site that is turned."""


def linked(
    factors: tuple[JointAxis, ...], second: tuple[JointAxis, ...] = BALL, *, reverse: bool = False
) -> Figure:
    """Two bars that hang from the ground, one on a ball and one on a chain, joined below."""
    far = {"far": at((0.3, -0.2, 0.5), (0.2, -0.5, 0.1))}
    end = {"end": at(shift=(0.1, -0.6, 0.2))}
    one = body("one", centre=(0.1, -0.2, 0.05), sites=far)
    other = body("other", 1.4, (0.02, 0.03, 0.02), (0.0, -0.3, 0.0), end)
    ends = ("other.end", "one.far") if reverse else ("one.far", "other.end")
    drawn = figure(
        [ground(right=at(shift=(0.5, 0.0, 0.2))), one, other],
        [
            joint("ball", "ground.base", "one.near", BALL, (0.1, 0.2, 0.3)),
            joint("second", "ground.right", "other.near", second),
            joint("closing", *ends, factors),
        ],
    )
    tree = build_tree(drawn)
    closed = close_loops(tree, initial_displacements(tree)).displacements
    return posed(drawn, {name: np.degrees(values) for name, values in closed.items()})


LOOPS = {
    "four bars": FOURBAR,
    "closed by a ball": linked(BALL),
    "closed by a rigid joint": linked((), FREE),
    "closed by a hinge": linked(chain("Rs")),
    "closed by a hinge, the other way round": linked(chain("Rs"), reverse=True),
}


def own_springs(of: Figure) -> SpringSet:
    """The springs of a figure's files."""
    return read_springs(None, of)


def equal(of: Figure, name: str, stiffness: float, viscous: float) -> JointSprings:
    """A spring of a joint that resists turns about all its axes alike."""
    laws = (Linear(stiffness),) if stiffness else ()
    axes = [AxisSpring(f.axis, laws, Damping(viscous)) for f in of.joints[name].chain]
    return JointSprings(name, tuple(axes))


def hinge(
    name: str, *laws: object, axis: tuple = (1.0, 0.0, 0.0), **damping: float
) -> JointSprings:
    return JointSprings(name, (AxisSpring(axis, laws, Damping(**damping)),))


def slide(name: str, axis: Vector, *laws: Elastic, **damping: float) -> JointSprings:
    return JointSprings(name, (), (AxisSpring(axis, laws, Damping(**damping)),))


def spring_set(*joints: JointSprings) -> SpringSet:
    return SpringSet({one.joint: one for one in joints})


CURVES = {
    "cubic": (Cubic((0.7, 9.0, -1.5, 6.0), rest=0.1),),
    "cubic with a dead zone": (Cubic((0.5, 9.0, -1.0, 6.0), -1, (-0.2, 0.3), 0.1),),
    "stop": (Stop(-0.2, 0.15, 400.0, 0.05),),
    "stop on one side": (Stop(None, 0.1),),
    "table": (Interpolated(((-1.0, 9.0), (-0.3, 1.0), (0.2, 0.5), (0.6, -4.0), (1.2, -9.0))),),
    "several": (Linear(4.0, 0.3), Stop(-0.3, 0.4, 100.0, 0.1), Cubic((0.0, 1.0, 2.0, 3.0))),
}
"""Curves that are cubics, piece by piece."""

OTHER_CURVES = {
    "exponential": (
        Exponential((ExponentialTerm(3.0, -4.0, 0.1), ExponentialTerm(-2.0, 5.0, 0.2)), 0.3),
    ),
    "hysteresis": (Hysteresis.from_mean_and_width(Linear(8.0, 0.1), 0.4, 0.2),),
}


def ours(of: Figure, springs: SpringSet, stop: float = STOP) -> Recording:
    """Our motion from the pose in which a figure is drawn."""
    plan = Plan(stop=stop, frame=FRAME, tolerance=TOLERANCE, springs=springs)
    recording = simulate(of, plan)
    assert recording.outcome.succeeded
    return recording


def apart(one: Mapping[str, np.ndarray], other: Mapping[str, np.ndarray]) -> float:
    """Largest angle between orientations [rad] or distance of origins [m] of the segments."""
    turns = max(_angle(poses[:, :3, :3], other[name][:, :3, :3]) for name, poses in one.items())
    shifts = max(
        np.abs(poses[:, :3, 3] - other[name][:, :3, 3]).max() for name, poses in one.items()
    )
    return float(max(turns, shifts))


def _angle(one: np.ndarray, other: np.ndarray) -> float:
    """From the chord between matrices, which small angles do not spoil."""
    chord = np.linalg.norm(one - other, axis=(1, 2)) / np.sqrt(8.0)
    return float(2.0 * np.arcsin(np.minimum(chord, 1.0)).max())


def stated_errors(loss: Loss) -> dict[str, float]:
    """Largest errors of fits by joint or displacement, as a loss states them [N m]."""
    stated: dict[str, float] = {}
    for where in loss.where:
        names, _, sizes = where.partition(" (")
        stated |= dict.fromkeys(names.split(" and "), float(sizes.split()[0]))
    return stated
