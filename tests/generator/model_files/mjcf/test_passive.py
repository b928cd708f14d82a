"""The springs of a figure as a callback of MuJoCo: falls as ours."""

import numpy as np
import pytest

from generator.diagnostics import ModelError, UnknownNameError
from generator.figure import Figure
from generator.figure_file import read_figure
from generator.model_files.mjcf.passive import PassiveSprings
from generator.springs_file.read import read_springs
from springs import (
    AxisSpring,
    Cubic,
    Damping,
    JointSprings,
    Linear,
    SphericalLaw,
    SpringSet,
    Stop,
)
from springs.hysteresis import Hysteresis
from tests.chains import SKEW, chain, two_bodies
from tests.generator.model_files.bent_fall import (
    fall_in_file,
    fall_with_callback,
    our_fall,
    site_distance,
)
from tests.generator.model_files.engines import MuJoCo, moved
from tests.generator.model_files.model_cases import (
    AGREEMENT,
    OTHER_CURVES,
    START,
    STOP,
    apart,
    hinge,
    on_a_rail,
    ours,
    posed,
    slide,
    spring_set,
)

pytestmark = pytest.mark.verify

LAWS = (
    (Cubic((0.0, 40.0, 0.0, 90.0), dead_zone=(-0.3, 0.2)),),
    (Linear(6.0, 0.1), Stop(-0.4, 0.3, 60.0, 0.1)),
    (Hysteresis.from_mean_and_width(Linear(5.0), 0.3, 0.2),),
)

BRIEF = 0.1
"""End of motions with several springs, whose callback is slow [s]."""


def with_callback(of: Figure, springs: SpringSet, stop: float = STOP) -> dict[str, np.ndarray]:
    """The motion of a model without springs, with the callback and a quarter of its step."""
    loaded = MuJoCo(of, SpringSet())
    loaded.model.opt.timestep /= 4
    loaded.api.set_mjcb_passive(PassiveSprings(loaded.model, of, springs))
    try:
        return moved(loaded, stop)
    finally:
        loaded.api.set_mjcb_passive(None)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("text", "reverse"), [("R-x Ry Rz", False), ("Rx Ry", True), ("Rx Ry Rz Tx", True)]
)
def test_springs_of_several_rotations_are_ours(text: str, reverse: bool) -> None:
    places = chain(text)
    of = two_bodies(places, (*START, 0.0)[: len(places)], reverse=reverse)
    count = min(3, len(places))
    axes = [
        AxisSpring(tuple(axis), law, Damping(0.1 + 0.1 * k))
        for k, (axis, law) in enumerate(zip(np.eye(3)[:count].tolist(), LAWS, strict=False))
    ]
    springs = spring_set(JointSprings("tested", tuple(axes)))
    found = with_callback(of, springs, BRIEF)
    assert apart(found, ours(of, springs, BRIEF).poses) < AGREEMENT


def test_springs_of_single_displacements_are_ours() -> None:
    springs = spring_set(
        hinge("hinge", *OTHER_CURVES["exponential"], axis=(-1.0, 0.0, 0.0), viscous=0.1),
        slide("rail", SKEW, Linear(30.0), viscous=0.5),
    )
    of = on_a_rail()
    assert apart(with_callback(of, springs), ours(of, springs).poses) < AGREEMENT


def test_another_model_is_refused() -> None:
    springs = spring_set(hinge("tested", Linear(1.0)))
    other = MuJoCo(two_bodies(chain("Rx Ry"), START[:2]), SpringSet())
    with pytest.raises(ModelError, match="does not have joint `tested`"):
        PassiveSprings(other.model, two_bodies(chain("Rx"), START[:1]), springs)


def test_the_callback_adds_the_springs_that_a_file_lacks() -> None:
    """The arms of a man with bent shoulders: the file has all springs but those with a reach."""
    of = posed(read_figure("male50"), {"right_shoulder": (0.0, 0.0, 170.0)})
    springs = read_springs(None, of)
    shoulders = [name for name, one in springs.joints.items() if one.reach is not None]
    loaded = MuJoCo(of, springs)
    lacking = loaded.api.MjData(loaded.model)
    lacking.qpos[:] = loaded.data.qpos
    loaded.api.mj_forward(loaded.model, lacking)
    loaded.api.set_mjcb_passive(PassiveSprings(loaded.model, of, springs, shoulders))
    try:
        loaded.api.mj_forward(loaded.model, loaded.data)
        added = np.flatnonzero(loaded.data.qfrc_passive - lacking.qfrc_passive)
        ours_apart = apart(moved(loaded, 0.1), ours(of, springs, 0.1).poses)
    finally:
        loaded.api.set_mjcb_passive(None)
    start = loaded.model.joint("right_shoulder").dofadr[0]
    assert set(added) <= {*range(start, start + 3)}
    assert len(added) > 0
    assert ours_apart < 3e-4
    with pytest.raises(UnknownNameError, match="joint `left_sholder` has no springs of its own"):
        PassiveSprings(loaded.model, of, springs, ["left_sholder"])


MOST_APART = 0.01
"""Largest distance of a site in the fall of the bent prototype [m]."""


def test_the_bent_prototype_falls_as_ours_with_the_callback() -> None:
    assert site_distance(fall_with_callback(), our_fall()) < MOST_APART


def test_the_bent_prototype_falls_as_ours_under_the_law_of_coordinates() -> None:
    held = site_distance(fall_in_file(), our_fall(SphericalLaw.COORDINATES))
    assert held < 1e-4
