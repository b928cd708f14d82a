"""Models of biorbd, read by biorbd: points, masses, forces and passive torques are ours."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from generator import read_figure
from generator.figure import Figure, SiteRef
from generator.figure_file.read import FIGURE_FILE
from generator.identifiers import coordinate_names, plain_names
from generator.kinematics.placement import forward_kinematics
from generator.kinematics.tree import build_tree
from generator.model_files.biomod.write import FITTED_LOSS, format_files
from generator.model_files.fit_error import joint_ranges
from generator.passive_curve import passive_torque
from generator.springs_file.read import read_springs
from springs import Linear, SpringSet
from tests.chains import SKEW
from tests.generator.model_files.biomod_text import BioMod, read_biomod
from tests.generator.model_files.engines import Pinocchio
from tests.generator.model_files.mass_matrix import mass_matrix
from tests.generator.model_files.model_cases import (
    TREES,
    hinge,
    on_a_rail,
    slide,
    spring_set,
    stated_errors,
)

pytestmark = pytest.mark.verify

SHIPPED = {name: read_figure(name) for name in FIGURE_FILE.shipped() if name != "female50"}
"""Figures of different joints."""

FIGURES = {**TREES, **SHIPPED}


class Biorbd:
    """A figure in biorbd."""

    def __init__(self, of: Figure, springs: SpringSet, folder: Path) -> None:
        self.api: Any = pytest.importorskip("biorbd")
        path = folder / "model.bioMod"
        self.losses = format_files(of, springs, path).write()
        self.text: BioMod = read_biomod(path.read_text(encoding="utf-8"))
        self.model = self.api.Model(str(path))
        chains = {name: joint.chain for name, joint in of.joints.items()}
        self.coordinates = coordinate_names(chains)

    def vector(self, values: Mapping[str, np.ndarray]) -> np.ndarray:
        """Values by joint in the order of Q."""
        named = {
            own: number
            for joint, numbers in values.items()
            for own, number in zip(self.coordinates[joint], numbers, strict=True)
        }
        return np.array([named[own] for own in self.text.coordinates])


def is_loop(of: Figure) -> bool:
    return len(build_tree(of).closures) > 0


def poses_of(of: Figure) -> Iterator[dict[str, np.ndarray]]:
    """Displacements of the joints of the tree: zero, and at random."""
    rng = np.random.default_rng(3)
    joints = [branch.joint for branch in build_tree(of).joints]
    yield {joint.name: np.zeros(len(joint.chain)) for joint in joints}
    for _ in range(3):
        yield {joint.name: rng.uniform(-1.5, 1.5, len(joint.chain)) for joint in joints}


@pytest.mark.parametrize("name", FIGURES)
def test_points_and_masses_are_where_they_are_here(name: str, tmp_path: Path) -> None:
    of = FIGURES[name]
    loaded = Biorbd(of, SpringSet(), tmp_path)
    segments = plain_names(of.segments)
    sites = {
        f"{segments[segment]}.{plain}": SiteRef(segment, site)
        for segment in [*of.ground, *(b.outboard for b in build_tree(of).joints)]
        for site, plain in plain_names(of.segments[segment].sites).items()
        if site != "CM"
    }
    assert [one.to_string() for one in loaded.model.markerNames()] == list(sites)
    assert loaded.model.mass() == pytest.approx(of.total_mass, rel=1e-12)
    dofs = [one.to_string() for one in loaded.model.nameDof()]
    assert dofs == [f"{segment}_{dof}" for segment, dof in loaded.text.dofs]
    for values in poses_of(of):
        q = loaded.vector(values)
        poses = forward_kinematics(build_tree(of), values).poses
        points = [one.to_array() for one in loaded.model.markers(q)]
        for ref, point in zip(sites.values(), points, strict=True):
            pose = poses[ref.segment] @ of.site(ref).pose_in_segment
            assert np.abs(point - pose[:3, 3]).max() < 1e-9
        for segment in of.bodies:
            theirs = loaded.model.globalJCS(q, segments[segment]).to_array()
            assert np.abs(theirs - poses[segment]).max() < 1e-9


@pytest.mark.parametrize("name", FIGURES)
def test_the_mass_matrix_is_that_of_the_segments(name: str, tmp_path: Path) -> None:
    of = FIGURES[name]
    loaded = Biorbd(of, SpringSet(), tmp_path)
    places = {own: k for k, own in enumerate(loaded.text.coordinates)}
    for values in poses_of(of):
        order, expected = mass_matrix(of, values)
        mass = loaded.model.massMatrix(loaded.vector(values)).to_array()
        at = [places[loaded.coordinates[joint][k]] for joint, k in order]
        assert mass[np.ix_(at, at)] == pytest.approx(expected, rel=1e-9, abs=1e-12)


@pytest.mark.parametrize("name", [name for name, of in FIGURES.items() if not is_loop(of)])
def test_inverse_dynamics_agree_with_pinocchio(name: str, tmp_path: Path) -> None:
    of = FIGURES[name]
    loaded, twin = Biorbd(of, SpringSet(), tmp_path), Pinocchio(of, SpringSet())
    rng = np.random.default_rng(5)
    for values in poses_of(of):
        rates, changes = (
            {joint: rng.uniform(-1.0, 1.0, len(each)) for joint, each in values.items()}
            for _ in range(2)
        )
        q, v, a = (loaded.vector(each) for each in (values, rates, changes))
        torques = loaded.model.InverseDynamics(q, v, a).to_array()
        twin.set(values)
        v_twin, a_twin = np.zeros(twin.model.nv), np.zeros(twin.model.nv)
        for joint in values:
            for k in range(len(values[joint])):
                at = twin.joint(joint, k).idx_v
                v_twin[at], a_twin[at] = rates[joint][k], changes[joint][k]
        expected = twin.api.rnea(twin.model, twin.data, twin.q, v_twin, a_twin)
        by_joint = {
            joint: np.array([expected[twin.joint(joint, k).idx_v] for k in range(len(each))])
            for joint, each in values.items()
        }
        assert torques == pytest.approx(loaded.vector(by_joint), rel=1e-9, abs=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("name", SHIPPED)
def test_meshes_passive_torques_and_ranges_are_read(name: str, tmp_path: Path) -> None:
    of = SHIPPED[name]
    springs = read_springs(None, of)
    loaded = Biorbd(of, springs, tmp_path)
    assert loaded.model.getGravity().to_array() == pytest.approx([0.0, -9.81, 0.0])
    for segment in loaded.model.segments():
        own = loaded.text.segments[segment.name().to_string()]
        assert (segment.characteristics().mesh().nbVertex() > 0) == ("meshfile" in own.values)
        ranges = [(one.min(), one.max()) for one in segment.QRanges()]
        if own.names:
            assert np.array_equal(ranges, own.numbers("rangesq").reshape(-1, 2))
    count = len(loaded.text.coordinates)
    rng = np.random.default_rng(2)
    places = {dof: k for k, dof in enumerate(loaded.text.dofs)}
    for _ in range(3):
        q = rng.uniform(-0.5, 0.5, count)
        expected = np.zeros(count)
        for segment, blocks in loaded.text.of_kind("passivetorque").items():
            for block in blocks:
                at = places[segment, block.values["dof"][0]]
                n = {
                    tag: float(words[0])
                    for tag, words in block.values.items()
                    if tag not in ("type", "dof")
                }
                if block.values["type"] == ["linear"]:
                    expected[at] = n["t0"] + n["slope"] * q[at]
                else:
                    x = q[at] - n["qmid"]
                    terms = n["b1"] * np.exp(n["k1"] * x) + n["b2"] * np.exp(n["k2"] * x)
                    expected[at] = terms * (q[at] - n["deltap"]) + n["taueq"]
        torques = loaded.model.passiveJointTorque(q, rng.uniform(-1.0, 1.0, count)).to_array()
        assert torques == pytest.approx(expected, rel=1e-9, abs=1e-9)


def test_viscous_damping_is_that_of_forward_dynamics(tmp_path: Path) -> None:
    of = on_a_rail()
    springs = spring_set(hinge("hinge", viscous=0.3), slide("rail", SKEW, viscous=2.0))
    damped, free = Biorbd(of, springs, tmp_path), Biorbd(of, SpringSet(), tmp_path)
    values = {"rail": np.array([0.1]), "hinge": np.array([0.4])}
    rates = {"rail": np.array([0.7]), "hinge": np.array([-0.9])}
    q, v = damped.vector(values), damped.vector(rates)
    damping = damped.vector({"rail": np.array([2.0]), "hinge": np.array([0.3])})
    one = damped.model.ForwardDynamics(q, v, 0.0 * q).to_array()
    other = free.model.ForwardDynamics(q, v, -damping * v).to_array()
    assert one == pytest.approx(other, rel=1e-12)


def test_linear_springs_are_exact(tmp_path: Path) -> None:
    of = on_a_rail()
    springs = spring_set(
        hinge("hinge", Linear(3.0, 0.2), Linear(1.0)), slide("rail", SKEW, Linear(50.0, 0.1))
    )
    loaded = Biorbd(of, springs, tmp_path)
    values = {"rail": np.array([0.25]), "hinge": np.array([0.4])}
    q = loaded.vector(values)
    torques = loaded.model.passiveJointTorque(q, 0.0 * q).to_array()
    expected = {"rail": [-50.0 * 0.15], "hinge": [-3.0 * 0.6 - 0.4]}  # it turns about -x
    assert torques == pytest.approx(loaded.vector(expected), rel=1e-12)
    assert not any("approximated" in loss.what for loss in loaded.losses.entries)


def test_moments_of_each_displacement_err_as_stated(tmp_path: Path) -> None:
    of = SHIPPED["prototype"]
    springs = read_springs(None, of)
    loaded = Biorbd(of, springs, tmp_path)
    (fitted,) = [loss for loss in loaded.losses.entries if loss.what == FITTED_LOSS]
    stated = stated_errors(fitted)
    zero = {
        branch.joint.name: np.zeros(len(branch.joint.chain)) for branch in build_tree(of).joints
    }
    compared = 0
    for name, own in springs.joints.items():
        joint = of.joints[name]
        for k, (low, high) in enumerate(joint_ranges(joint, own)):
            place = loaded.text.coordinates.index(loaded.coordinates[name][k])
            for angle in np.linspace(max(low, -np.pi), min(high, np.pi), 13)[:-1]:
                values = {**zero, name: np.eye(len(joint.chain))[k] * angle}
                ours = passive_torque(of, springs, name, values) @ np.array(joint.chain[k].axis)
                q = loaded.vector(values)
                theirs = loaded.model.passiveJointTorque(q, 0.0 * q).to_array()
                allowed = stated.get(loaded.coordinates[name][k], 0.0)
                assert abs(theirs[place] - ours) <= 1.05 * allowed + 1e-6
                compared += 1
    assert compared == 12 * sum(len(of.joints[name].chain) for name in springs.joints)
