"""Persons: complete, sound, and able to move, of both sexes, in the samples' range and beyond."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import figures
from benchmarks.persons import draw_measures, find_faults
from generator import Plan, convert, read_figure, read_springs, simulate, write_figure
from generator.diagnostics import ModelError, UsageError
from generator.model import Model
from generator.person.body import LIMB_SEGMENTS, TRUNK_SEGMENTS
from generator.person.joints import PERSON_JOINTS, Neck
from generator.person.measures import estimate_measures
from generator.person.person import build_person
from generator.person.sources import Origin
from generator.person.survey import Sex
from generator.simulation.preconditions import simulation_obstacles
from springs import Linear, Stop
from tests.runs import energy_error, same_bits

MAN = build_person(estimate_measures(Sex.MALE, 1.756, 85.5))


def test_the_parts_of_a_person():
    assert MAN.measures.stature == 1.756
    assert MAN.warnings == ()
    assert set(MAN.surfaces) == {*TRUNK_SEGMENTS, *LIMB_SEGMENTS}
    assert MAN.figure.total_mass == pytest.approx(85.5, abs=1e-9)
    assert MAN.springs_file is not None
    assert MAN.riener_springs_file is not None


def test_every_rotation_has_a_spring_and_stops():
    springs = MAN.model.springs
    assert set(springs.joints) == set(MAN.figure.joints) - {"root_torso"}
    for joint in PERSON_JOINTS:
        for name in joint.names:
            motions = {axis.motion for axis in springs.joints[name].axes}
            assert motions == {rotation.motion for rotation in joint.rotations}
            reach = springs.joints[name].reach
            assert (reach is not None) == (joint.name == "shoulder")
            laws = springs.joints[name].axes if reach is None else (reach.beyond, reach.turn)
            for axis in laws:
                assert [isinstance(law, Stop) for law in axis.elastic].count(True) == 1


def test_a_person_keeps_its_springs():
    alone = simulate(MAN.figure, Plan(stop=0.1))
    given = simulate(MAN.figure, Plan(stop=0.1, springs=MAN.model.springs))
    assert same_bits(alone.displacements, given.displacements)
    stops = read_springs(None, replace(MAN.figure, springs_text=None))
    without = simulate(MAN.figure, Plan(stop=0.1, springs=stops))
    bent = [run.displacements["left_knee"][-1, 0] for run in (alone, without)]
    assert abs(bent[0] - bent[1]) > 0.01


def test_springs_of_a_file_extend_those_of_a_person(tmp_path: Path):
    file = tmp_path / "elbow.springs.toml"
    file.write_text(
        '[[spring]]\njoints = ["left_elbow"]\naxis = "y"\nstiffness_Nm_rad = 5.0\nrest_deg = 0.0\n',
        encoding="utf-8",
    )
    changed, before = read_springs(file, MAN.figure), MAN.model.springs
    others = {name: joint for name, joint in before.joints.items() if name != "left_elbow"}
    assert {name: changed.joints[name] for name in others} == others
    assert Linear(5.0, 0.0) in changed.joints["left_elbow"].axes[1].elastic


def test_the_springs_of_a_leg():
    whole, pair = MAN.model.springs, MAN.riener_model.springs
    assert [len(one.law.coordinates) for one in (*whole.coupled, *pair.coupled)] == [3, 3, 2, 2]
    assert pair.joints.keys() == whole.joints.keys()
    assert pair.joints["left_knee"] == whole.joints["left_knee"]
    chosen = build_person(MAN.measures, springs="riener")
    springs = chosen.model.springs
    assert (springs.coupled, springs.joints) == (pair.coupled, pair.joints)
    assert chosen.riener_springs_file is None
    bare = build_person(MAN.measures, springs="none")
    assert bare.riener_model == bare.model
    assert build_person(MAN.measures, springs="coupled").springs_file == MAN.springs_file
    with pytest.raises(UsageError, match="published, riener, coupled, none"):
        build_person(MAN.measures, springs="soft")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("suffix", "is_pair"), [(".fig", False), (".fig", True), (".osim", True), (".xml", False)]
)
def test_springs_come_back_from_files(suffix: str, is_pair: bool, tmp_path: Path):
    springs = (MAN.riener_model if is_pair else MAN.model).springs
    if is_pair and suffix == ".fig":
        losses = convert(MAN.figure, tmp_path / "man.fig", springs=springs)
        assert "the springs of <riener>" in str(losses[tmp_path / "man.fig"])
        return
    convert(MAN.figure, tmp_path / f"man{suffix}", springs=springs)
    if suffix != ".fig":
        convert(tmp_path / f"man{suffix}", tmp_path / "man.fig")
    again = read_springs(None, read_figure(tmp_path / "man.fig"))
    assert (again.joints, again.coupled) == (springs.joints, springs.coupled)


def test_damping_added_to_a_person_in_vain_is_refused():
    knee = replace(MAN.figure.joints["left_knee"], damp=(2.0,))
    with pytest.raises(ModelError, match="`damp` of joint `left_knee` was changed in Python"):
        simulate(MAN.figure.with_parts(knee), Plan(stop=0.1))


def test_a_person_without_springs_has_stops():
    bare = build_person(MAN.measures, springs="none")
    assert (bare.springs_file, bare.riener_springs_file) == (None, None)
    rigid = build_person(MAN.measures, neck=Neck.RIGID)
    assert bare.figure == replace(rigid.figure, springs_text=None)
    laws = [
        law for one in bare.model.springs.joints.values() for a in one.axes for law in a.elastic
    ]
    assert laws
    assert all(isinstance(law, Stop) for law in laws)


def test_the_sources_of_all_parts():
    quantities = {(one.part, one.quantity) for one in MAN.sources}
    assert len(quantities) == len(MAN.sources) > 100
    assert ("lower_arm", "mass") in quantities
    assert ("knee", "limit of knee flexion") in quantities
    bare = build_person(MAN.measures, springs="none")
    assert MAN.sources[: len(bare.sources)] == bare.sources
    assert {joint.name for joint in PERSON_JOINTS} <= {
        one.part for one in MAN.sources[len(bare.sources) :]
    }
    for one in MAN.sources:
        assert np.isfinite(one.value)
        assert one.reference is not None or one.rule or one.origin is Origin.STATED


def test_measures_outside_the_sample_are_warnings_and_impossible_ones_errors():
    assert build_person(estimate_measures(Sex.FEMALE, 1.30, 30.0)).warnings
    with pytest.raises(UsageError):
        estimate_measures(Sex.FEMALE, 0.0, 30.0)


def test_a_run_without_springs():
    run = simulate(MAN.figure, Plan(stop=0.1, spring_choice="none"))
    assert run.outcome.succeeded
    assert energy_error(run) < 1e-3


@pytest.mark.slow
def test_springs_of_the_prototype_fit_the_joints_that_it_has(tmp_path: Path):
    file = tmp_path / "me.fig"
    file.write_text(write_figure(MAN.figure))
    text = Path(figures.__file__).with_name("prototype.springs.toml").read_text(encoding="utf-8")
    # The elbow of a person turns the forearm as well, so that its axis of flexion is named.
    head, elbow, tail = text.partition('joints = ["left_elbow", "right_elbow"]\n')
    source = tmp_path / "thesis.springs.toml"
    source.write_text(head + elbow + tail.replace('"joint"', '"y"', 1), encoding="utf-8")
    figure, prototype = read_figure(file), read_figure("prototype")
    springs, own = read_springs(source, figure), read_springs(None, prototype)
    for name, joint in own.joints.items():
        theirs = [(axis.direction, axis.elastic[0]) for axis in joint.axes]
        turn = 1 if name.endswith("elbow") else 0
        axes = springs.joints[name].axes[turn:]
        ours = [(axis.direction, axis.elastic[0]) for axis in axes]
        assert ours == theirs
    assert list(simulation_obstacles(Model(figure, springs))) == []


@pytest.mark.slow
def test_a_person_of_the_benchmark_is_written_read_settled_and_simulated(tmp_path: Path):
    """A woman of 1.26 m and 52 kg, beyond the range of the survey."""
    assert list(find_faults(build_person(draw_measures(11)), tmp_path)) == []
