"""Passive curves as a table, read again with Python's csv module and compared with the laws."""

import csv
import re
from collections.abc import Iterator
from dataclasses import replace
from io import StringIO
from math import degrees, pi
from pathlib import Path

import numpy as np
import pytest

from generator import read_figure
from generator.figure import Figure
from generator.figure_file.read import FIGURE_FILE
from generator.losses import Losses
from generator.model_files.curves_csv import ROTATION_VECTOR, format_curves, has_curves
from generator.model_files.formats import model_format
from generator.passive_curve import PassiveCurve, passive_curves
from generator.springs_file.read import read_springs
from springs import AxisSpring, Damping, JointSprings, Linear, SpringSet, Stop
from springs.hysteresis import Hysteresis
from tests.chains import SKEW, at, body, chain, figure, ground, joint, two_bodies
from tests.command import mover, run
from tests.generator.model_files.model_cases import on_a_rail, slide, spring_set
from tests.paths import ROOT

Row = dict[str, str]


def table(drawn: Figure, springs: SpringSet) -> list[Row]:
    text, _ = format_curves(drawn, springs)
    return list(csv.DictReader(StringIO(text)))


def numbers(rows: list[Row], title: str) -> np.ndarray:
    return np.array([float(row[title]) for row in rows])


def rows_of(rows: list[Row], joint_name: str, direction: tuple[float, ...]) -> list[Row]:
    """Rows of the curve about an axis of a joint."""
    titles = ("axis x", "axis y", "axis z")
    return [
        row
        for row in rows
        if row["joint"] == joint_name
        and row["angle [deg]"]
        and np.allclose([float(row[title]) for title in titles], direction, atol=1e-8)
    ]


def cases() -> Iterator[tuple[Figure, SpringSet]]:
    for name in sorted(FIGURE_FILE.shipped().keys() - {"female50"}):
        drawn = read_figure(name)
        springs = read_springs(None, drawn)
        if has_curves(springs):
            yield drawn, springs
    prototype = read_figure("prototype")
    yield prototype, read_springs("coupled", prototype)
    yield prototype, read_springs("printed", prototype)


CASES = list(cases())
IDS = [f"{drawn.name}-{Path(springs.origin).stem}" for drawn, springs in CASES]


def each_curve(drawn: Figure, springs: SpringSet) -> Iterator[tuple[PassiveCurve, list[Row]]]:
    rows = table(drawn, springs)
    for name, curves in passive_curves(drawn, springs).items():
        for curve in curves:
            yield curve, rows_of(rows, name, curve.spring.direction)


@pytest.mark.parametrize(("drawn", "springs"), CASES, ids=IDS)
def test_the_moments_are_those_of_the_laws(drawn: Figure, springs: SpringSet):
    for curve, rows in each_curve(drawn, springs):
        angles, moments = numbers(rows, "angle [rad]"), numbers(rows, "moment [N m]")
        stiffness = numbers(rows, "stiffness [N m/rad]")
        rounding = 1e-9 * (1.0 + np.abs(stiffness)) + 1e-8 * np.abs(moments)
        assert np.all(np.abs(curve.moment_at(angles) - moments) <= rounding)
        assert np.allclose(np.degrees(angles), numbers(rows, "angle [deg]"), atol=1e-7)
        assert np.all(np.diff(angles) > 0.0)
        assert angles[0] <= curve.angles[0] + 0.1 / 180 * pi
        assert {row["motion"] for row in rows} == {curve.spring.motion}
        first, *others = (row["reference"] for row in rows)
        assert first == "; ".join(curve.references)
        assert not any(others)


@pytest.mark.parametrize(("drawn", "springs"), CASES, ids=IDS)
def test_the_stiffness_is_the_slope(drawn: Figure, springs: SpringSet):
    for curve, rows in each_curve(drawn, springs):
        angles, stiffness = numbers(rows, "angle [rad]"), numbers(rows, "stiffness [N m/rad]")
        corners = np.array([*(b for law in curve.laws for b in law.breakpoints), 1e3])
        smooth = np.abs(angles[:, None] - corners).min(axis=1) > 1e-3
        slope = (curve.moment_at(angles + 1e-4) - curve.moment_at(angles - 1e-4)) / 2e-4
        scale = 1.0 + np.abs(stiffness)
        assert np.all(np.abs(slope + stiffness)[smooth] <= 1e-3 * scale[smooth])


@pytest.mark.parametrize(("drawn", "springs"), CASES, ids=IDS)
def test_rows_within_the_measured_range_are_marked(drawn: Figure, springs: SpringSet):
    for curve, rows in each_curve(drawn, springs):
        words = {row["measured"] for row in rows}
        if curve.valid_range is None:
            assert words == {"unknown"}
            continue
        low, high = (degrees(end) for end in curve.valid_range)
        inside = [float(row["angle [deg]"]) for row in rows if row["measured"] == "yes"]
        outside = [float(row["angle [deg]"]) for row in rows if row["measured"] == "no"]
        assert inside
        assert np.isclose(min(inside), max(low, -180.0), atol=1e-5)
        assert np.isclose(max(inside), min(high, 180.0), atol=1e-5)
        assert all(not low <= angle <= high for angle in outside)


@pytest.mark.parametrize(("drawn", "springs"), CASES, ids=IDS)
def test_breakpoints_have_rows(drawn: Figure, springs: SpringSet):
    for curve, rows in each_curve(drawn, springs):
        angles = numbers(rows, "angle [deg]")
        for corner in {degrees(b) for law in curve.laws for b in law.breakpoints}:
            if angles[0] <= corner <= angles[-1]:
                assert np.abs(angles - corner).min() < 1e-6


def test_held_angles_are_those_of_the_pose():
    drawn = read_figure("prototype")
    springs = read_springs("coupled", drawn)
    rows = [row for row in table(drawn, springs) if row["held angles"]]
    assert {row["joint"] for row in rows} >= {"left_knee", "left_hip_joint"}
    for curve, own in each_curve(drawn, springs):
        expected = [f"{name} {degrees(a):.6g} deg" for name, a in curve.held_angles.items()]
        assert {row["held angles"] for row in own} == {"; ".join(expected)}


ELASTIC = Linear(3.0, rest=0.2)
RESISTING = AxisSpring((0.0, 0.0, 1.0), damping=Damping(0.3, 0.2))


def test_an_axis_that_only_resists_has_rows_without_a_moment():
    drawn = two_bodies(chain("Rz"), [0.1])
    springs = SpringSet({"tested": JointSprings("tested", (RESISTING,))})
    rows = table(drawn, springs)
    assert not numbers(rows, "moment [N m]").any()
    assert set(numbers(rows, "damping [N m s/rad]")) == {0.3}
    assert set(numbers(rows, "friction [N m]")) == {0.2}
    assert {row["coordinate"] for row in rows} == {"tested_1"}


def test_hysteresis_is_a_mean_and_a_friction():
    drawn = two_bodies(chain("Rz"), [0.1])
    law = Hysteresis.from_mean_and_width(ELASTIC, 1.4)
    spring = AxisSpring((0.0, 0.0, 1.0), (law,), Damping(0.0, 0.1))
    rows = table(drawn, SpringSet({"tested": JointSprings("tested", (spring,))}))
    angles = numbers(rows, "angle [rad]")
    assert np.allclose(numbers(rows, "friction [N m]"), 0.7 + 0.1)
    assert np.allclose(numbers(rows, "moment [N m]"), -3.0 * (angles - 0.2), atol=1e-7)


def test_the_angle_of_a_hinge_is_its_displacement_also_for_a_spring_about_the_opposite_axis():
    drawn = two_bodies(chain("Rz"), [0.1])
    spring = AxisSpring((0.0, 0.0, -1.0), (ELASTIC,), motion="flexion")
    rows = table(drawn, SpringSet({"tested": JointSprings("tested", (spring,))}))
    assert {(row["axis z"], row["motion"]) for row in rows} == {("1", "opposite of flexion")}
    angles = numbers(rows, "angle [rad]")
    assert np.allclose(numbers(rows, "moment [N m]"), -3.0 * (angles + 0.2), atol=1e-7)


def test_slides_have_columns_of_their_own():
    cart = body("cart", sites={"pin": at((0.2, 0.1, 0.0), (0.0, 0.1, 0.0))})
    bar = body("bar", mass=1.1, centre=(0.0, -0.3, 0.1))
    rail = joint("rail", "ground.base", "cart.near", chain("Tx"), (0.3,))
    hinge = joint("hinge", "cart.pin", "bar.near", chain("Rx"))
    drawn = figure([ground(), cart, bar], [rail, hinge])
    stop = Stop(-0.2, 0.35, 2000.0)
    along = AxisSpring((1.0, 0.0, 0.0), (ELASTIC, stop), Damping(5.0, 0.5))
    about = AxisSpring((1.0, 0.0, 0.0), (ELASTIC,))
    springs = SpringSet(
        {
            "rail": JointSprings("rail", translations=(along,)),
            "hinge": JointSprings("hinge", (about,)),
        }
    )
    rows = table(drawn, springs)
    slides = [row for row in rows if row["joint"] == "rail"]
    turns = [row for row in rows if row["joint"] == "hinge"]
    assert len(slides) + len(turns) == len(rows)
    assert {row["coordinate"] for row in slides} == {"rail_1"}
    x = numbers(slides, "position [m]")
    expected = -3.0 * (x - 0.2) + np.asarray(stop.torque(x))
    assert np.allclose(numbers(slides, "force [N]"), expected, rtol=1e-8)
    assert {-0.2, 0.35} <= set(x)
    assert set(numbers(slides, "damping [N s/m]")) == {5.0}
    assert set(numbers(slides, "friction [N]")) == {0.5}
    assert {row["angle [rad]"] + row["moment [N m]"] for row in slides} == {""}
    assert {row["position [m]"] + row["force [N]"] for row in turns} == {""}


def test_a_long_slide_has_rows_at_greater_distances():
    rail = on_a_rail()
    far = replace(rail.joints["rail"], lower_limit=(-1e4,), upper_limit=(2e6,))
    rows = table(rail.with_parts(far), spring_set(slide("rail", SKEW, Linear(3.0))))
    assert 200 < len(rows) < 1100
    positions = numbers(rows, "position [m]")
    assert positions[0] <= -1e4
    assert positions[-1] >= 2e6


def test_several_rotations_are_told():
    drawn = read_figure("prototype")
    text, losses = format_curves(drawn, read_springs(None, drawn))
    rows = list(csv.DictReader(StringIO(text)))
    several = {row["joint"] for row in rows if row["coordinate"] == ROTATION_VECTOR}
    assert "left_shoulder" in several
    assert "left_knee" not in several
    assert any(set(loss.where) == several for loss in losses.entries)
    assert "position [m]" not in rows[0]


def interpolation_error(losses: Losses) -> float:
    sentence = next(loss.what for loss in losses.entries if "straight lines" in loss.what)
    return float(sentence.partition("err by ")[2].split()[0])


def test_straight_lines_between_the_rows_err_as_told():
    drawn = read_figure("prototype")
    springs = read_springs(None, drawn)
    _, losses = format_curves(drawn, springs)
    told, worst = interpolation_error(losses), 0.0
    for curve, rows in each_curve(drawn, springs):
        angles, moments = numbers(rows, "angle [rad]"), numbers(rows, "moment [N m]")
        fine = np.linspace(angles[0], angles[-1], 4001)
        error = np.abs(np.interp(fine, angles, moments) - curve.moment_at(fine))
        worst = max(worst, float(error.max()))
    assert 0.8 * worst <= told <= 1.1 * worst


def test_the_suffix_of_a_figures_table_is_csv(tmp_path: Path):
    drawn = read_figure("pendulum")
    springs = read_springs(None, drawn)
    path = tmp_path / "curves.csv"
    model_format(path).format_files(drawn, springs, path).write()
    assert path.read_text(encoding="utf-8") == format_curves(drawn, springs)[0]


def test_the_command_writes_curves_of_a_figure_and_motions_of_a_motion(tmp_path: Path):
    curves, motion, again = (tmp_path / name for name in ("a.csv", "b.action", "b.csv"))
    run("convert", "pendulum", curves)
    with curves.open(encoding="utf-8", newline="") as file:
        assert "moment [N m]" in next(csv.reader(file))
    run("simulate", "pendulum", "--stop", 0.01, "-o", motion)
    run("convert", motion, again)
    assert "time [s]" in again.read_text(encoding="utf-8")
    named = tmp_path / "table.txt"
    run("convert", "pendulum", named, "--to", "curves")
    assert named.read_bytes() == curves.read_bytes()


def test_the_command_says_that_a_figure_has_no_springs(tmp_path: Path):
    done = mover("convert", "fourbar", tmp_path / "a.csv")
    assert done.exit_code != 0
    assert "the figure has no springs and therefore no passive curves" in done.stderr
    assert not (tmp_path / "a.csv").exists()


PAGE = (ROOT / "docs/model-formats.md").read_text(encoding="utf-8")


@pytest.mark.parametrize(("name", "share"), [("prototype", 0.15), ("male50", 0.3)])
def test_the_limit_torques_of_the_page_are_near_the_table(
    name: str, share: float, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.chdir(tmp_path)
    drawn = read_figure(name)
    springs = read_springs(None, drawn)
    (code,) = [
        block for block in re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL) if "K_1" in block
    ]
    Path("curves.csv").write_text(format_curves(drawn, springs)[0], encoding="utf-8")
    exec(compile(code, "docs/model-formats.md", "exec"), {})
    with open("limits.csv", encoding="utf-8", newline="") as file:
        limits = {row.pop("name"): row for row in csv.DictReader(file)}
    curves = list(each_curve(drawn, springs))
    assert len(limits) == len(curves)
    for curve, rows in curves:
        limit = limits[f"{rows[0]['joint']} {rows[0]['motion']}"]
        k1, k2, k3, k4, low, high = map(float, limit.values())
        assert k1 <= 0.0 < k2
        assert k4 < 0.0 <= k3
        q = np.linspace(low, high, 200)
        fitted = k1 * np.exp(k2 * (q - high)) + k3 * np.exp(k4 * (q - low))
        expected = curve.moment_at(q)
        assert np.abs(fitted - expected).max() <= share * np.abs(expected).max()
