"""Every format reads back what it has written: a format without a row fails the first test."""

import csv
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from pkgutil import iter_modules
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import generator.input_files
from generator import Plan, read_figure, simulate
from generator.contact.record import HeadImpact, Overlap, PartContact, SegmentContact
from generator.contact_file.parts import Evidence
from generator.conversion import read_motion
from generator.drive import Drive
from generator.figure import AxisKind, Figure, JointAxis, SiteRef
from generator.figure_file.write import write_pose
from generator.identifiers import coordinate_names, plain_name, plain_names
from generator.input_files.links import (
    MAX_LINK_FACTOR,
)
from generator.input_files.live import LIVE_FILE, write_live
from generator.input_files.loads import LOADS_FILE
from generator.input_files.moments import MOMENTS_FILE, MeasuredMoments
from generator.input_files.pose import read_pose
from generator.input_files.scene import read_scene, write_scene
from generator.kinematics.placement import Placement, forward_kinematics, initial_displacements
from generator.kinematics.tree import build_tree
from generator.loads import LoadKind, TimedLoad
from generator.model_files.body_tree.to_figure import FRAME, WORLD
from generator.model_files.embedded import MARK
from generator.model_files.formats import MODEL_FORMATS, read_model
from generator.model_files.model_files import Imported
from generator.motion_files import MOTION_FORMATS, ActionFile, read_action, read_npz
from generator.motion_files.action import parse_displacement
from generator.motion_files.drives import read_drives
from generator.motion_files.motion import FigureMotion, Header
from generator.recording import Accuracy, Ending, Outcome, Recording
from generator.rotations import Array
from generator.units import INPUT_BOUNDS, Dimension
from springs import AxisSpring, Cubic, Damping, JointSprings, Linear, SpringSet, total_torque
from tests.chains import (
    ACROSS,
    BALL,
    SKEW,
    X,
    Y,
    Z,
    at,
    chain,
    figure,
    ground,
    joint,
    negative,
    row,
    two_bodies,
)
from tests.contacts import with_contact
from tests.generator.model_files.biomod_text import BioMod, read_biomod
from tests.generator.model_files.imported_models import (
    displacements,
    without_carried_texts,
    written_and_read,
)
from tests.generator.model_files.model_cases import (
    FOURBAR,
    LOADED,
    PENDULUM,
    PROTOTYPE,
    TREES,
    own_springs,
    posed,
)
from tests.live_logs import live_logs
from tests.motion_readers import Bvh, Glb, Page, Table, read_table
from tests.motions import MOTIONS, any_motion, clip, slides
from tests.runs import same_bits
from tests.scenes import scenes


@dataclass(frozen=True)
class Format:
    """A row of the table.

    Attributes:
        name: a format of models, a suffix of motions, or a kind of input file.
        write: its writer; a test's own where the packages only read.
        read: a reader of a path, for what was written; a test's own where the packages only write.
        compare: asserts that the second content is the first.
        cases: contents that are always tried.
        contents: others are drawn from here.
        examples: how many.
    """

    name: str
    write: Callable[[Any, Path], object]
    read: Callable[[Path, Any], Any]
    compare: Callable[[Any, Any], None]
    cases: Callable[[], Iterable[Any]] = tuple
    contents: st.SearchStrategy[Any] | None = None
    examples: int = 20

    def check(self, content: Any) -> None:
        with TemporaryDirectory() as folder:
            path = Path(folder) / f"content{self.name if self.name.startswith('.') else ''}"
            self.write(content, path)
            self.compare(content, self.read(path, content))


def assert_equal(one: Any, other: Any) -> None:
    assert other == one


def close(one: Array, other: Array, within: float) -> None:
    np.testing.assert_allclose(one, other, rtol=0.0, atol=within)


# Models

SEEDS = st.integers(0, 2**32 - 1)
RIGHT_ANGLES = (SKEW, ACROSS, tuple(np.cross(SKEW, ACROSS).tolist()))


@st.composite
def factors(draw: st.DrawFn, kind: AxisKind, sizes: Sequence[int]) -> list[JointAxis]:
    """Factors of a joint about or along signed axes at right angles."""
    axes = draw(st.sampled_from([(X, Y, Z), RIGHT_ANGLES]).flatmap(st.permutations))
    if kind is AxisKind.ROTATION and draw(st.booleans()):
        axes = [axes[0], axes[1], axes[0]]
    signed = [axis if draw(st.booleans()) else negative(axis) for axis in axes]
    return [JointAxis(kind, axis) for axis in signed[: draw(st.sampled_from(sizes))]]


CHAINS = st.tuples(
    factors(AxisKind.ROTATION, (0, 1, 2, 3)), factors(AxisKind.TRANSLATION, (0, 1, 2))
).flatmap(lambda parts: st.permutations(parts).map(lambda order: (*order[0], *order[1])))


@dataclass(frozen=True)
class Model:
    """A figure with springs; `seed` chooses the values at which they are compared."""

    figure: Figure
    springs: SpringSet
    seed: int = 0


def sprung(figure: Figure, seed: int = 0) -> Model:
    """A figure with a linear spring and damping on each joint of one displacement."""
    rng, springs = np.random.default_rng(seed), {}
    for name, held in figure.joints.items():
        if len(held.chain) == 1:
            (factor,) = held.chain
            stiffness, rest, viscous = rng.uniform([1.0, -1.0, 0.1], [50.0, 1.0, 5.0]).tolist()
            axis = AxisSpring(factor.axis, (Linear(stiffness, rest),), Damping(viscous))
            turns = factor.kind is AxisKind.ROTATION
            springs[name] = JointSprings(name, (axis,) if turns else (), () if turns else (axis,))
    return Model(figure, SpringSet(springs), seed)


TWO_BODIES = st.builds(
    lambda chain, reverse, seed: sprung(
        two_bodies(chain, (0.2,) * len(chain), reverse=reverse), seed
    ),
    CHAINS,
    st.booleans(),
    SEEDS,
)


def trees() -> list[Model]:
    """Figures whose names stay as they are."""
    return [sprung(figure) for name, figure in TREES.items() if "meet" not in name]


def named_trees() -> list[Model]:
    """Figures whose names the figure language has."""
    return [sprung(figure) for name, figure in TREES.items() if "let go" not in name]


def write_model(name: str) -> Callable[[Model, Path], object]:
    return lambda model, path: (
        MODEL_FORMATS[name].format_files(model.figure, model.springs, path).write()
    )


def read_with_springs(path: Path, _: Model) -> tuple[Imported, SpringSet]:
    imported = read_model(path)
    return imported, written_and_read(imported, path.parent)[1]


def without_psurfs(figure: Figure) -> Figure:
    return figure.with_parts(*(replace(one, psurf=None) for one in figure.segments.values()))


def without_fields(figure: Figure) -> Figure:
    bare = (replace(one, stiff=None, rest=None, damp=None) for one in figure.joints.values())
    return figure.with_parts(*bare)


def read_carried(path: Path, model: Model) -> tuple[Imported, SpringSet]:
    """What a model says in its own elements, after what it carries was compared."""
    imported, springs = read_with_springs(path, model)
    text = path.read_text(encoding="utf-8")
    if MARK in text:  # springs along slides are not in a springs file
        whole = without_psurfs(model.figure)
        assert_equal(whole if model.springs.joints else without_fields(whole), imported.figure)
        assert springs.joints == model.springs.joints
        path.write_text(without_carried_texts(text), encoding="utf-8")
    (path.parent / "model.springs.toml").unlink(missing_ok=True)  # of an earlier reading
    return read_with_springs(path, model)


def same_bodies(
    model: Model, back: tuple[Imported, SpringSet], *, free_at_start: bool = False
) -> None:
    """Poses, masses, centres and inertias of the bodies, at equal values of the coordinates.

    The coordinates of a free body of MJCF have no names; without a value it is at its start.
    """
    imported, _ = back
    figure, rng = model.figure, np.random.default_rng(model.seed)
    tree, values = build_tree(figure), {}
    moved = {key: np.zeros_like(start) for key, start in initial_displacements(tree).items()}
    for key, numbers in moved.items():
        names = names_in_model(imported, key, len(numbers))
        if free_at_start and len(numbers) == 6 and names[0] not in imported.coordinates:
            numbers += initial_displacements(tree)[key]
        # A ball of MJCF has other angles; at zero they are the same.
        if all(name in imported.coordinates for name in names):
            numbers += rng.uniform(-0.4, 0.4, len(numbers))
            values |= dict(zip(names, numbers, strict=True))
    ours = forward_kinematics(tree, moved)
    theirs = forward_kinematics(build_tree(imported.figure), displacements(imported, values))
    free = {
        n: s for n, s in imported.figure.segments.items() if FRAME in s.sites and n in figure.bodies
    }
    assert free
    for name, segment in free.items():
        close(theirs.poses[name] @ segment.sites[FRAME].pose_in_segment, ours.poses[name], 1e-9)
        if segment.sites.keys() & figure.bodies.keys() == {name} & segment.sites.keys():
            for one, other in zip(weight(theirs, name), weight(ours, name), strict=True):
                np.testing.assert_allclose(one, other, rtol=1e-8, atol=1e-9)
    fixed = imported.figure.segments[WORLD].sites.keys() - free.keys()
    mass = sum(one.mass or 0.0 for name, one in figure.bodies.items() if name not in fixed)
    assert imported.figure.total_mass == pytest.approx(mass, rel=1e-12)


def names_in_model(imported: Imported, joint: str, count: int) -> list[str]:
    return [joint] if joint in imported.coordinates else [f"{joint}_{k + 1}" for k in range(count)]


def weight(placement: Placement, name: str) -> tuple[float, Array, Array]:
    """Mass, centre of mass and inertia about it, in the world."""
    segment, pose = placement.tree.figure.segments[name], placement.poses[name]
    turn = pose[:3, :3]
    assert segment.mass is not None
    centre = turn @ segment.centre_of_mass + pose[:3, 3]
    return segment.mass, centre, turn @ np.diag(segment.inertia) @ turn.T


def same_damping(
    model: Model, back: tuple[Imported, SpringSet], *, free_at_start: bool = False
) -> None:
    same_bodies(model, back, free_at_start=free_at_start)
    for ours, theirs in springs_in_pairs(model, *back):
        assert theirs.damping == ours.damping


def same_springs(model: Model, back: tuple[Imported, SpringSet]) -> None:
    same_damping(model, back, free_at_start=True)
    for ours, theirs in springs_in_pairs(model, *back):
        for value in (-1.0, 0.3, 2.0):
            expected = total_torque(ours.elastic, value)
            assert total_torque(theirs.elastic, value) == pytest.approx(expected, rel=1e-9)


def springs_in_pairs(
    model: Model, imported: Imported, springs: SpringSet
) -> Iterator[tuple[AxisSpring, AxisSpring]]:
    """Ours and theirs, of joints of one displacement that stayed so."""
    for name, ours in model.springs.joints.items():
        (coordinate,) = names_in_model(imported, name, 1)
        where = imported.coordinates[coordinate]
        if len(imported.figure.joints[where.joint].chain) == 1:
            theirs = springs.joints[where.joint]
            yield (*ours.axes, *ours.translations)[0], (*theirs.axes, *theirs.translations)[0]


# DYSPAM has numbers for names, and angles of its own: what can be compared is how a figure moves.

BENT_ON_SPRINGS = posed(
    PROTOTYPE,
    {
        "waist": (11.0, -34.0, 63.0),
        "left_shoulder": (23.0, 52.0, -29.0),
        "left_hip_joint": (-40.0, 29.0, 11.0),
        "left_elbow": (109.0,),
        "left_knee": (-11.0,),
        "right_knee": (97.0,),
    },
)
LAWS = (
    AxisSpring(X, (Cubic((2.0, -3.0, -4.0, -9.0), 1),), Damping(0.05)),
    AxisSpring(X, (Linear(3.0, 0.4),), Damping(0.02)),
    AxisSpring(X, (Cubic((0.5, 4.0, 2.0, 6.0), -1, rest=0.2),), Damping(0.01, 0.05)),
)
"""A cubic that is not odd, a line with a rest, a cubic from a rest, and friction."""


def cases_for_dyspam() -> Iterator[Model]:
    """A force, a closed loop, springs on both sides, a turned root, even and odd signs of axes."""
    for drawn in (PENDULUM, FOURBAR, BENT_ON_SPRINGS):
        yield Model(drawn, own_springs(drawn))
    loaded = figure(
        [ground(turned=at((0.5, -0.2, 0.9)), hook=at((0.3, 0.2, 0.1), (0.2, 0.5, -0.1))),
         LOADED.segments["link"]],
        [joint("pin", "ground.hook", "link.near", BALL, (0.2, 0.1, -0.4))],
    )  # fmt: skip
    yield Model(replace(loaded, root=SiteRef("ground", "turned")), SpringSet())
    for text in ("R-x R-y Rz", "R-x Ry Rz", "R-y Rx R-y", "Rs"):
        yield on_springs(chain(text), reverse=text == "Rs")


def on_springs(factors: Sequence[JointAxis], reverse: bool) -> Model:
    """Two bodies on a joint, which has springs if its axes are x, y or z, each once."""
    drawn = two_bodies(tuple(factors), (0.5, -0.3, 0.6)[: len(factors)], reverse=reverse)
    lines = {tuple(map(abs, factor.axis)) for factor in factors}
    if not lines <= {X, Y, Z} or len(lines) < len(factors):
        return Model(drawn, SpringSet())
    axes = [replace(law, direction=f.axis) for f, law in zip(factors, LAWS, strict=False)]
    return Model(drawn, SpringSet({"tested": JointSprings("tested", tuple(axes))}))


SPHERICAL_OR_REVOLUTE = st.builds(on_springs, factors(AxisKind.ROTATION, (1, 3)), st.booleans())
"""Axes of all directions, connections written backwards, springs about negative axes."""


def tracks(figure: Figure, springs: SpringSet) -> Array:
    """Positions in a run of all sites of what moves but the triads; shape (sites, frames, 3)."""
    recording = simulate(figure, Plan(stop=0.15, frame=0.05, step=1e-3, springs=springs))
    assert recording.outcome.succeeded, recording.outcome.message
    return np.array(
        [
            (recording.poses[name] @ site.pose_in_segment)[:, :3, 3]
            for name, segment in figure.bodies.items()
            for key, site in segment.sites.items()
            if not key.startswith("joint")
        ]
    )


def moves_alike(model: Model, back: tuple[Imported, SpringSet]) -> None:
    imported, springs = back
    before = tracks(model.figure, model.springs)
    assert np.max(np.ptp(before, axis=1)) > 0.01
    close(tracks(imported.figure, springs), before, 1e-7)


def same_points(model: Model, back: BioMod) -> None:
    """Segments and markers are at the places of segments and sites, linear springs the same."""
    rng = np.random.default_rng(model.seed)
    tree = build_tree(model.figure)
    names = coordinate_names({name: joint.chain for name, joint in model.figure.joints.items()})
    segments = plain_names(model.figure.segments)
    moving = [branch.joint for branch in tree.joints]
    for size in (0.0, 1.5):
        values = {joint.name: rng.uniform(-size, size, len(joint.chain)) for joint in moving}
        numbers = {
            own: number
            for name, row in values.items()
            for own, number in zip(names[name], row.tolist(), strict=True)
        }
        assert sorted(numbers) == sorted(back.coordinates)
        ours, theirs = forward_kinematics(tree, values).poses, back.poses(numbers)
        for name, segment in model.figure.segments.items():
            own = segments[name]
            close(theirs[own], ours[name], 1e-9)
            for site, plain in plain_names(segment.sites).items():
                if site != "CM":
                    point = back.markers[f"{own}.{plain}"].numbers("position")
                    close(point, segment.sites[site].pose_in_segment[:3, 3], 1e-15)
    for name, segment in model.figure.bodies.items():
        block = back.segments[segments[name]]
        assert block.numbers("mass").tolist() == [segment.mass]
        assert np.array_equal(block.numbers("com"), segment.centre_of_mass)
        assert np.array_equal(block.numbers("inertia"), np.diag(segment.inertia).ravel())
    torques = [block for blocks in back.of_kind("passivetorque").values() for block in blocks]
    closing = {joint.name for joint in tree.closures}
    assert len(torques) == len([name for name in model.springs.joints if name not in closing])
    assert {block.values["type"][0] for block in torques} <= {"linear"}


def read_rows(path: Path, _: Model) -> list[dict[str, str]]:
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def same_moments(model: Model, rows: list[dict[str, str]]) -> None:
    """Each row of a joint of one displacement has the torque, the stiffness and the damping."""
    assert {row["joint"] for row in rows} == set(model.springs.joints)
    for name, own in model.springs.joints.items():
        titles = ("angle [rad]", "moment [N m]", "stiffness [N m/rad]", "damping [N m s/rad]")
        if own.translations:
            titles = ("position [m]", "force [N]", "stiffness [N/m]", "damping [N s/m]")
        (spring,) = (*own.axes, *own.translations)
        (law,) = spring.elastic
        assert isinstance(law, Linear)
        table = np.array([[float(r[t]) for t in titles] for r in rows if r["joint"] == name])
        assert len(table) > 100
        close(table[:, 1], law.torque(table[:, 0]), 1e-6)
        close(table[:, 2], np.full(len(table), law.stiffness), 1e-4)
        close(table[:, 3], np.full(len(table), spring.damping.viscous), 1e-8)


def sprung_trees() -> list[Model]:
    """Figures with a joint of one displacement, which has a spring."""
    return [model for model in trees() if model.springs.joints]


def on_one_spring(kinds: st.SearchStrategy[AxisKind]) -> st.SearchStrategy[Model]:
    """Two bodies on a joint of one displacement."""
    return st.builds(
        lambda kind, axis, reverse, seed: sprung(
            two_bodies((JointAxis(kind, axis),), (0.2,), reverse=reverse), seed
        ),
        kinds,
        st.sampled_from([X, negative(Y), Z, SKEW, ACROSS]),
        st.booleans(),
        SEEDS,
    )


ONE_SPRING = on_one_spring(st.sampled_from(AxisKind))


MODELS = (
    Format("peabody", write_model("peabody"), lambda path, _: read_figure(path),
           lambda model, back: assert_equal(model.figure, back), named_trees, TWO_BODIES),
    Format("mjcf", write_model("mjcf"), read_carried, same_springs, trees, TWO_BODIES),
    Format("urdf", write_model("urdf"), read_with_springs, same_damping, trees, TWO_BODIES),
    Format("osim", write_model("osim"), read_carried, same_bodies, trees, TWO_BODIES),
    Format("dyspam", write_model("dyspam"), read_with_springs, moves_alike, cases_for_dyspam,
           SPHERICAL_OR_REVOLUTE),
    Format("biomod", write_model("biomod"), lambda path, _: read_biomod(path.read_text("utf-8")),
           same_points, trees, TWO_BODIES),
    Format("curves", write_model("curves"), read_rows, same_moments, sprung_trees, ONE_SPRING),
)  # fmt: skip


# Motions


@st.composite
def motions(draw: st.DrawFn, *, is_uniform: bool = False) -> FigureMotion:
    """Any displacements of a figure, which may be let go."""
    count, seed = draw(st.integers(1, 5)), draw(SEEDS)
    gaps = np.random.default_rng(seed).uniform(0.01, 1.0, count)
    gaps = np.full(count, 0.02) if is_uniform else gaps
    times = draw(st.sampled_from([0.0, 0.3, 5.0])) + np.cumsum(gaps) - gaps[0]
    drawn = any_motion(draw(st.sampled_from(FIGURES)), times, seed, is_free=draw(st.booleans()))
    ending, digest = draw(st.sampled_from(Ending)), draw(st.none() | st.just("0f" * 32))
    return replace(drawn, header=replace(drawn.header, outcome=ending, sha256=digest))


FIGURES = [PROTOTYPE, FOURBAR, PENDULUM, slides(), *TREES.values()]


def each_figure_moved() -> Iterator[FigureMotion]:
    """A human figure, a closed loop, slides, and a figure that nothing holds."""
    yield from map(any_motion, (PROTOTYPE, FOURBAR, slides()))
    yield any_motion(PROTOTYPE, is_free=True)


def write_motion(suffix: str) -> Callable[[FigureMotion, Path], object]:
    return lambda motion, path: MOTION_FORMATS[suffix](motion, path)


def same_action(motion: FigureMotion, back: ActionFile) -> None:
    assert back.header == motion.header
    assert list(back.chains.items()) == list(motion.chains.items())
    same_displacements(motion, (back.times, dict(back.displacements)))


def same_displacements(motion: FigureMotion, back: tuple[Array, dict[str, Array]]) -> None:
    times, moved = back
    assert same_bits(motion.times, times)
    assert same_bits({n: np.ascontiguousarray(d) for n, d in motion.displacements.items()}, moved)


def read_csv(path: Path, motion: FigureMotion) -> tuple[Array, dict[str, Array]]:
    """Times and displacements of a table whose titles are `time [s]` and `JOINT.k [UNIT]`."""
    text = path.read_text(encoding="utf-8").splitlines()
    titles, *rows = csv.reader(line for line in text if not line.startswith("#"))
    columns = dict(zip(titles, zip(*rows, strict=True), strict=True))
    moved = {}
    for name, factors in motion.chains.items():
        units = [(k, UNITS_IN_TEXT[factor.kind]) for k, factor in enumerate(factors, 1)]
        parts = [
            [parse_displacement(word, unit) for word in columns[f"{name}.{k} [{unit}]"]]
            for k, unit in units
        ]
        moved[name] = np.array(parts).reshape(len(factors), len(rows)).T.copy()
    return np.array(columns["time [s]"], dtype=float), moved


UNITS_IN_TEXT = {AxisKind.ROTATION: "deg", AxisKind.TRANSLATION: "cm"}


def read_coordinates(path: Path, motion: FigureMotion) -> tuple[Table, FigureMotion]:
    return read_table(path), read_motion(path, motion.figure)


def same_coordinates(motion: FigureMotion, contents: tuple[Table, FigureMotion]) -> None:
    back, read = contents
    in_degrees = back.header["inDegrees"] == "yes"
    assert read.header == motion.header
    assert list(read.chains.items()) == list(motion.chains.items())
    if in_degrees:
        assert read.displacements.keys() == motion.displacements.keys()
        for name, values in motion.displacements.items():
            np.testing.assert_allclose(read.displacements[name], values, rtol=1e-15)
    else:
        same_displacements(motion, (read.times, dict(read.displacements)))
    factors = [factor for factors in motion.chains.values() for factor in factors]
    plain = coordinate_names(motion.chains)
    assert back.labels == ["time", *(label for name in motion.chains for label in plain[name])]
    turns = np.array([factor.kind is AxisKind.ROTATION for factor in factors], dtype=bool)
    moved = np.concatenate(list(motion.displacements.values()), axis=1)
    shown = np.where(turns & in_degrees, np.degrees(moved), moved)
    assert same_bits(back.rows, np.column_stack([motion.times, shown]))
    assert [int(back.header[key]) for key in ("nRows", "nColumns")] == list(back.rows.shape)
    assert back.header["figure"] == motion.header.figure


def site_poses(motion: FigureMotion) -> dict[tuple[str, str], Array]:
    """Poses of all sites in the world, shape (frames, 4, 4)."""
    return {
        (segment.name, site.name): motion.poses[segment.name] @ site.pose_in_segment
        for segment in motion.figure.segments.values()
        for site in segment.sites.values()
    }


def same_sites_glb(motion: FigureMotion, back: Glb) -> None:
    np.testing.assert_allclose(back.times, motion.times - motion.times[0], rtol=1e-6)
    poses = back.poses()
    for (segment, site), expected in site_poses(motion).items():
        close(poses[f"{segment}.{site}"], expected, 1e-6)


def same_page(motion: FigureMotion, back: Page) -> None:
    same_sites_glb(motion, back.glb())
    assert same_bits(motion.times, back.doubles(back.data["times"]))
    rows = iter(back.data["rows"])
    for name, factors in motion.chains.items():
        for k, factor in enumerate(factors):
            row, in_si = next(rows), motion.displacements[name][:, k]
            shown = np.degrees(in_si) if factor.kind is AxisKind.ROTATION else 100.0 * in_si
            assert row["joint"] == name
            np.testing.assert_allclose(back.floats(row["values"]), shown, rtol=1e-6, atol=1e-30)
    assert next(rows, None) is None


def same_bones(motion: FigureMotion, back: Bvh) -> None:
    """A bone carries the sites of its segment from where they are at zero displacements."""
    figure, poses = motion.tree.figure, back.poses()
    zero = {name: np.zeros(len(joint.chain)) for name, joint in motion.figure.joints.items()}
    rest = forward_kinematics(build_tree(motion.figure), zero).poses
    assert len(back.rows) == len(motion.times)
    assert back.interval == (0.02 if len(motion.times) > 1 else 1.0)
    for branch in motion.tree.joints:
        joint, segment = branch.joint, figure.segments[branch.outboard]
        moved = figure.site(joint.child if branch.parent_is_inboard else joint.parent)
        centre = (rest[segment.name] @ moved.pose_in_segment)[:3, 3]
        shift = np.eye(4)
        shift[:3, 3] = -centre
        carried = poses[plain_name(joint.name)] @ shift @ rest[segment.name]
        close(carried, motion.poses[segment.name], 1e-6)


def runs() -> Iterator[FigureMotion]:
    return map(clip, MOTIONS)


ANY_FLOAT = st.floats()


@st.composite
def ended_otherwise(draw: st.DrawFn) -> FigureMotion:
    """A run with numbers that JSON does not have, and quantities that few runs have."""
    motion = clip("fourbar")
    assert motion.recording is not None
    count, number = motion.times.size, st.none() | ANY_FLOAT
    recording = replace(
        motion.recording,
        outcome=Outcome(
            draw(st.sampled_from(Ending)), draw(PRINTED), draw(ANY_FLOAT), draw(st.none() | PRINTED)
        ),
        accuracy=Accuracy(
            draw(number),
            draw(number),
            draw(ANY_FLOAT),
            draw(ANY_FLOAT),
            draw(st.integers(0, 10**12)),
            np.full(count, draw(ANY_FLOAT)),
        ),
        constraint_drift=draw(ANY_FLOAT),
        prescribed_motion_drift=draw(ANY_FLOAT),
        drive_torques={"crank_pin": np.arange(float(count))[:, None]},
    )
    motion = replace(motion, recording=recording)
    return draw(contacts_of(motion)) if draw(st.booleans()) else motion


@st.composite
def contacts_of(draw: st.DrawFn, motion: FigureMotion) -> FigureMotion:
    """The run with contact of any numbers."""
    motion = with_contact(motion, draw(SEEDS))
    assert motion.recording is not None
    contact = motion.recording.contact
    assert contact is not None
    one = next(iter(contact.segments))
    segments = {**contact.segments, one: SegmentContact(*(draw(ANY_FLOAT) for _ in range(4)), NANS)}
    number = st.none() | ANY_FLOAT
    sensitivity = st.sampled_from([None, np.full(motion.times.size, np.inf)])
    contact = replace(
        contact,
        segments=segments,
        max_force=draw(ANY_FLOAT),
        max_depth=draw(ANY_FLOAT),
        weight_carried=draw(number),
        creep=draw(ANY_FLOAT),
        dissipated=draw(ANY_FLOAT),
        sensitivity=draw(sensitivity),
        height_sensitivity=draw(sensitivity),
        impact_shift=draw(number),
        head_injury=draw(st.dictionaries(PRINTED, ANY_FLOAT, max_size=2)),
        heads=draw(st.dictionaries(PRINTED, HEADS, max_size=2)),
        parts=draw(st.dictionaries(PRINTED, PARTS, max_size=2)),
        overlap=draw(st.none() | st.builds(Overlap, ANY_FLOAT, st.just(one), PRINTED, ANY_FLOAT)),
    )
    return replace(motion, recording=replace(motion.recording, contact=contact))


NANS = (float("nan"), float("inf"), -0.0)


PRINTED = st.text(st.characters(exclude_categories=["Cs"]), max_size=20)

HEADS = st.builds(HeadImpact, ANY_FLOAT, ANY_FLOAT, ANY_FLOAT)
PARTS = st.builds(
    PartContact,
    st.none() | ANY_FLOAT,
    ANY_FLOAT,
    ANY_FLOAT,
    ANY_FLOAT,
    st.none() | ANY_FLOAT,
    st.tuples(st.floats(0.0, 9.0), st.floats(0.0, 9.0)),
    st.sampled_from(Evidence),
    PRINTED,
)


def same_run(motion: FigureMotion, back: tuple[Header, Recording]) -> None:
    header, recording = back
    assert header == motion.header
    assert recording.model is None  # the file has no springs to make one of
    for field in fields(Recording):
        if field.name == "model":
            continue
        one, other = (getattr(run, field.name) for run in (motion.recording, recording))
        assert same_bits(one, other), field.name


MOVED = motions()
MOTION_ROWS = (
    Format(".action", write_motion(".action"), lambda path, _: read_action(path), same_action,
           each_figure_moved, MOVED),
    Format(".csv", write_motion(".csv"), read_csv, same_displacements, each_figure_moved, MOVED),
    Format(".mot", write_motion(".mot"), read_coordinates, same_coordinates, each_figure_moved,
           MOVED),
    Format(".sto", write_motion(".sto"), read_coordinates, same_coordinates, each_figure_moved,
           MOVED),
    Format(".glb", write_motion(".glb"), lambda path, _: Glb(path), same_sites_glb,
           each_figure_moved, MOVED),
    Format(".html", write_motion(".html"), lambda path, _: Page(path), same_page,
           each_figure_moved, MOVED),
    Format(".bvh", write_motion(".bvh"), lambda path, _: Bvh(path), same_bones,
           each_figure_moved, motions(is_uniform=True)),
    Format(".npz", write_motion(".npz"), lambda path, _: read_npz(path), same_run,
           runs, ended_otherwise()),
)  # fmt: skip


# Input files

NAMES = st.text(st.characters(exclude_categories=["Cs"]), max_size=25)
BOUNDED = st.floats(-0.999 * MAX_LINK_FACTOR, 0.999 * MAX_LINK_FACTOR)
"""Factors, and offsets that a conversion to degrees does not take over the edge."""


LARGEST_ANGLE = INPUT_BOUNDS[Dimension.ANGLE].max_abs
DISPLACEMENTS = st.floats(-LARGEST_ANGLE, LARGEST_ANGLE)


@st.composite
def poses(draw: st.DrawFn) -> tuple[Figure, dict[str, tuple[float, ...]]]:
    """Displacements of some of the joints of a figure."""
    figure = draw(st.sampled_from([PROTOTYPE, SLIDING]))
    movable = [name for name, joint in figure.joints.items() if joint.chain]
    names = draw(st.sets(st.sampled_from(movable), min_size=1, max_size=4))
    sizes = {name: figure.joints[name].degrees_of_freedom for name in sorted(names)}
    return figure, {n: tuple(draw(DISPLACEMENTS) for _ in range(k)) for n, k in sizes.items()}


SLIDING = row(3, (chain("Rx Ry Rz Tx Ty Tz"), chain("Ts"), ()))


def same_pose(content: tuple[Figure, dict[str, tuple[float, ...]]], back: dict[str, Array]) -> None:
    assert {name: tuple(values) for name, values in back.items()} == content[1]


TIMES = st.lists(st.floats(0.05, 2.0), min_size=2, max_size=12).map(
    lambda gaps: np.cumsum(gaps).tolist()
)
FINITE = st.floats(-1e6, 1e6)


@st.composite
def timed_loads(draw: st.DrawFn) -> tuple[TimedLoad, ...]:
    sites = [SiteRef("center_torso", "distal"), SiteRef("right_lower_arm", "distal")]
    places = st.tuples(st.sampled_from(sites), st.sampled_from(LoadKind))
    loads = []
    for site, kind in draw(st.lists(places, min_size=1, max_size=4, unique=True)):
        times = draw(TIMES)
        loads.append(TimedLoad(site, kind, tuple(times), tuple((draw(FINITE),) * 3 for _ in times)))
    return tuple(loads)


def write_loads(loads: Sequence[TimedLoad], path: Path) -> None:
    lines = ["site,kind,time [s],x [N or N m],y [N or N m],z [N or N m]"]
    for load in loads:
        for time, values in zip(load.times, load.values, strict=True):
            numbers = ",".join(map(repr, (time, *values)))
            lines.append(f"{load.site},{load.kind.value},{numbers}")
    path.write_text("\n".join(lines), encoding="utf-8")


MOMENTS = st.builds(
    lambda angles, moments: MeasuredMoments(
        tuple(sorted(angles)), tuple(moments[: len(angles)]), ""
    ),
    st.lists(st.floats(-6.0, 6.0), min_size=4, max_size=12, unique_by=lambda a: round(a, 2)),
    st.lists(FINITE, min_size=12, max_size=12),
)


def write_moments(content: MeasuredMoments, path: Path) -> None:
    rows = zip(content.angles, content.moments, strict=True)
    lines = [f"{moment!r},{angle!r}" for angle, moment in rows]
    path.write_text("\n".join(["moment [N m],angle [rad]", *lines]), encoding="utf-8")


@st.composite
def driven(draw: st.DrawFn) -> FigureMotion:
    """A motion of the prototype; as an action file or as a table it drives the joints."""
    return any_motion(PROTOTYPE, np.array(draw(TIMES)), draw(SEEDS))


def write_drives(motion: FigureMotion, path: Path) -> None:
    for suffix in DRIVE_SUFFIXES:
        MOTION_FORMATS[suffix](motion, path.with_suffix(suffix))


DRIVE_SUFFIXES = (".action", ".csv", ".mot", ".sto")


def read_all_drives(path: Path, motion: FigureMotion) -> list[Mapping[str, Drive]]:
    return [read_drives(path.with_suffix(s), motion.figure) for s in DRIVE_SUFFIXES]


def same_drives(motion: FigureMotion, back: list[Mapping[str, Drive]]) -> None:
    for drives in back:
        assert drives.keys() == motion.displacements.keys()
        for name, drive in drives.items():
            assert np.array_equal(drive.times, motion.times)
            close(np.asarray(drive.values), motion.displacements[name], 1e-14)
            close(drive.displacements(motion.times), motion.displacements[name], 1e-9)


INPUTS = (
    Format("pose", lambda content, path: path.write_text(write_pose(*content), encoding="utf-8"),
           lambda path, content: read_pose(path, content[0]), same_pose, contents=poses(),
           examples=50),
    Format("loads", write_loads, lambda path, _: LOADS_FILE.read(path, PROTOTYPE), assert_equal,
           contents=timed_loads(), examples=50),
    Format("moments", write_moments, lambda path, _: replace(MOMENTS_FILE.read(path), name=""),
           assert_equal, contents=MOMENTS, examples=50),
    Format("drives", write_drives, read_all_drives, same_drives, contents=driven()),
    Format("scene", lambda scene, path: path.write_text(write_scene(scene), encoding="utf-8"),
           lambda path, _: read_scene(path), assert_equal, contents=scenes(), examples=50),
    Format("live", lambda log, path: path.write_text(write_live(log, "a log"), encoding="utf-8"),
           lambda path, _: LIVE_FILE.read(path), assert_equal, contents=live_logs(), examples=100),
)  # fmt: skip


def test_every_format_has_a_row():
    assert [row.name for row in MODELS] == list(MODEL_FORMATS)
    assert {row.name for row in MOTION_ROWS} == set(MOTION_FORMATS)
    modules = {module.name for module in iter_modules(generator.input_files.__path__)}
    assert {row.name for row in INPUTS} == modules - {"coordinates", "csv_columns", "links", "tone"}
    # Nothing writes links and tone; coordinates have their own test, with a figure.


@pytest.mark.parametrize("form", [*MODELS, *MOTION_ROWS, *INPUTS], ids=lambda form: form.name)
def test_what_is_written_is_read_back(form: Format):
    for content in form.cases():
        form.check(content)
    if form.contents is not None and form.name not in SLOW:
        _check_examples(form)


SLOW = ("mjcf", "osim", "urdf")
"""Formats of models whose drawn contents take seconds."""


@pytest.mark.slow
@pytest.mark.parametrize("name", SLOW)
def test_drawn_models_are_read_back(name: str):
    _check_examples(replace(next(form for form in MODELS if form.name == name), examples=8))


def _check_examples(form: Format) -> None:
    assert form.contents is not None
    settings(max_examples=form.examples)(given(form.contents)(form.check))()
