"""The prototype far above a floor, in random poses in which its segments touch each other."""

from functools import cache

from generator import read_figure
from generator.contact.states import CapsuleTable, SelfContactStates, evaluate_self_contact
from generator.simulation.exudyn_model.agreement import ExudynEquations
from generator.simulation.exudyn_model.contacts import _rotations
from generator.simulation.exudyn_model.model import build_model
from generator.simulation.plan import Plan
from tests.compiled_models import SettableModel
from tests.contact_figures import FLOOR
from tests.poses import Pose, random_pose

PROTOTYPE = read_figure("prototype")
PLAN = Plan(free_root=True, height=20.0, scene=FLOOR, self_contact=True)


@cache
def settable() -> tuple[SettableModel, ExudynEquations]:
    """The prototype far above a floor."""
    model = build_model(PROTOTYPE, PLAN)
    return SettableModel.of(model), ExudynEquations(model)


def table() -> CapsuleTable:
    model = settable()[0].model
    assert model.contacts is not None
    return CapsuleTable.of(model.contacts.pairs, model.figure)


def contact_in(pose: Pose, pairs: CapsuleTable | None = None) -> SelfContactStates:
    state = pose.state
    return evaluate_self_contact(
        table() if pairs is None else pairs,
        state.positions[None],
        _rotations(state.parameters)[None],
        state.velocities[None],
        state.angular_velocities[None],
    )


def poses(count: int = 12) -> list[Pose]:
    """Random poses; limbs bend so far that most have several pairs in contact."""
    return [random_pose(settable()[0].model, seed, 1.2, 3.0) for seed in range(count)]
