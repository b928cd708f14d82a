"""One run of a study, from the values of its parameters to its measures.

`simulate` uses a second thread, in which the coarser of the runs that it compares proceed; with
`threads=1` they follow one after the other, and the numbers are the same bit for bit. Where every
core has a process of its own, one thread is best.
"""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from generator.diagnostics import MoverError, WallLimitError
from generator.kinematics.tree import build_tree
from generator.motion_files import npz
from generator.motion_files.motion import motion_from_recording
from generator.recording import WHOLE_RECORDING, Ending, Integrator, RecordingPart
from generator.simulation.plan import Plan
from generator.study.held_posture import measure_held_posture
from generator.study.measures import (
    NOT_MOVING,
    Measured,
    measure_motion,
    measure_rest,
    parts_of_measures,
)
from generator.study.parameter_paths import Case
from generator.study.parameters import build_case
from generator.study.study import (
    NO_EQUILIBRIUM,
    WRONG_INPUT,
    Measure,
    RunMethod,
    RunResult,
    Statistic,
    Study,
    failed_run,
)


def run_case(
    study: Study, values: Sequence[float], keep: Path | None = None, threads: int = 2
) -> RunResult:
    """Run a study once and measure it; a run that fails has no measures.

    The result depends on the study and the values only, bit for bit: not on earlier runs, the
    process or the number of threads.

    Args:
        study: the study.
        values: values of its parameters, in their order.
        keep: `.npz` file for the motion, written as a whole or not at all; None to keep none.
        threads: 1 or 2.

    Raises:
        OSError: the motion cannot be written.
        KeyboardInterrupt: the run was interrupted.
    """
    try:
        case = build_case(study, values)
    except (MoverError, ValueError) as failure:  # a plan raises ValueError
        return failed_run(study, WRONG_INPUT, str(failure))
    return measure_case(study, case, keep, threads)


def measure_case(study: Study, case: Case, keep: Path | None = None, threads: int = 2) -> RunResult:
    """Run and measure a case of a study; see `run_case`."""
    from generator.simulation.statics.equilibrium import NoEquilibriumError  # imports Exudyn

    measures = tuple(study.measures.values())
    at_rest = [each for each in measures if each.take is Statistic.REST]
    at_start = [each for each in measures if each.take is Statistic.START]
    moving = [each for each in measures if each.take not in NOT_MOVING]
    numbers: Measured = {}
    try:
        if moving or keep is not None or not measures:
            from generator.simulation.run import simulate

            parts = WHOLE_RECORDING
            if keep is None:
                parts = parts_of_measures(case.figure, moving, case.model.contact)
            plan = _fast_plan(case) if study.method is RunMethod.FAST else case.plan
            if plan.integrator is not Integrator.IMPLICIT:
                parts |= {RecordingPart.AGREEMENT}
            recording = simulate(case.model, plan, record=parts, threads=threads)
            if recording.outcome.ending is Ending.INTERRUPTED:
                raise KeyboardInterrupt
            motion = motion_from_recording(recording)
            if keep is not None:
                npz.write(motion, keep)
            if not recording.outcome.succeeded:
                return failed_run(study, recording.outcome.ending.value, recording.outcome.message)
            numbers |= measure_motion(motion, case.plan, moving)
        if at_start:
            numbers |= measure_held_posture(case, at_start)
        if at_rest:
            numbers |= _measure_at_rest(case, at_rest)
    except WallLimitError as failure:
        return failed_run(study, Ending.TOO_LONG.value, str(failure))
    except NoEquilibriumError as failure:
        return failed_run(study, NO_EQUILIBRIUM, str(failure))
    except MoverError as failure:
        return failed_run(study, WRONG_INPUT, str(failure))
    return RunResult(Ending.DONE.value, "", {each.name: numbers[each.name] for each in measures})


def _fast_plan(case: Case) -> Plan:
    """Return the plan of a fast run: the implicit method for a fall that is not to be certified."""
    plan = case.plan
    can = plan.integrator is Integrator.COMPILED and plan.step is None
    can = can and not (plan.python_torques or plan.certify)
    if not (can and plan.scene.props) or plan.links.links or build_tree(case.figure).closures:
        return plan
    return replace(plan, integrator=Integrator.IMPLICIT)


def _measure_at_rest(case: Case, measures: Sequence[Measure]) -> Measured:
    """Return the measures in the equilibrium of a figure, or on the props of its scene."""
    if case.plan.scene.props:
        from generator.simulation.statics.resting import find_resting_pose

        pose = find_resting_pose(case.model, case.plan)
        figure, displacements = pose.figure, pose.displacements
    else:
        from generator.simulation.statics.equilibrium import find_equilibrium

        displacements = find_equilibrium(case.model, case.plan).displacements
        figure = case.figure
    chains = {name: joint.chain for name, joint in figure.joints.items() if name in displacements}
    return measure_rest(chains, displacements, measures)
