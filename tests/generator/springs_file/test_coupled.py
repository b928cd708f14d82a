"""`[[coupled]]` of a springs file: published laws and own numbers, held, mended, moved, hung."""

from itertools import product
from math import exp, radians
from pathlib import Path

import pytest

from generator.diagnostics import Parsed
from generator.figure_file import read_figure
from generator.springs_file.parse import SPRINGS_FILE
from generator.springs_file.read import load_springs, springs_names
from springs import SpringSet
from springs.coupled import CoupledExponential, loop_work, nearest_conservative_law
from springs.lint.finding import FindingKind
from springs.lint.report import report_coupled
from springs.published.tables import coupled_law
from tests.paths import FIGURES

PROTOTYPE = read_figure("prototype")
PUBLISHED = coupled_law("riener_edrich_1999/leg").law
POSES = [(radians(h), radians(k)) for h, k in product((-15, 20, 60, 100), (0, 40, 135))]

HEAD = (
    '[[coupled]]\njoints = ["left_hip_joint", "left_knee"]\naxes = ["y", "joint"]\n'
    'coordinates = ["hip flexion", "knee flexion"]\n'
)
LEG = (
    HEAD + 'published = "riener_edrich_1999/leg"\nheld = ["ankle dorsiflexion"]\nheld_deg = [10]\n'
)
OWN = HEAD + (
    "terms = [\n    { amplitudes_Nm = [-0.5, 0.25], rates_1_rad = [2.0, -1.0], exponent = 0.5 },\n"
    "    { amplitudes_Nm = [3, 0], rates_1_rad = [-4, 0] },\n]\nconstants_Nm = [1, -2]\n"
)


def read(text: str, tmp_path: Path) -> Parsed[SpringSet]:
    path = tmp_path / "own.springs.toml"
    path.write_text(text, encoding="utf-8")
    return load_springs(PROTOTYPE, None, None, path)


def springs_of(text: str, tmp_path: Path) -> SpringSet:
    reading = read(text, tmp_path)
    assert reading.diagnostics == ()
    assert reading.value is not None
    return reading.value


def law_of(text: str, tmp_path: Path) -> CoupledExponential:
    (spring, *_) = springs_of(text, tmp_path).coupled
    return spring.law


def test_a_published_law_is_held_at_the_angles_that_are_left(tmp_path: Path):
    (spring,) = springs_of(LEG, tmp_path).coupled
    assert [axis.joint for axis in spring.axes] == ["left_hip_joint", "left_knee"]
    assert [axis.direction for axis in spring.axes] == [(0.0, 1.0, 0.0), (0.0, -1.0, 0.0)]
    for hip, knee in POSES:
        published = PUBLISHED.torques((hip, knee, radians(10.0)))
        assert spring.law.torques((hip, knee)) == pytest.approx(published[:2], rel=1e-12)
    assert spring.reference == str(coupled_law("riener_edrich_1999/leg").reference)


def test_own_numbers_by_hand(tmp_path: Path):
    law = law_of(OWN, tmp_path)
    shared = exp(0.5 + 2.0 * 0.3 - 1.0 * 0.7)
    by_hand = (1.0 - 0.5 * shared + 3.0 * exp(-4.0 * 0.3), -2.0 + 0.25 * shared)
    assert law.torques((0.3, 0.7)) == pytest.approx(by_hand, rel=1e-14)
    assert law.valid_ranges == (None, None)
    known = law_of(OWN + "measured_deg = [[-10, 90], [0, 120]]\n", tmp_path).valid_ranges
    assert known[1] == pytest.approx((0.0, radians(120.0)))


def test_one_table_serves_both_sides(tmp_path: Path):
    sides = '[["left_hip_joint", "left_knee"], ["right_hip_joint", "right_knee"]]'
    text = LEG.replace('["left_hip_joint", "left_knee"]', sides)
    left, right = springs_of(text, tmp_path).coupled
    assert left.law == right.law
    assert [axis.joint for axis in right.axes] == ["right_hip_joint", "right_knee"]
    assert right.axes[1].direction == (0.0, -1.0, 0.0)


def test_the_order_of_the_coordinates_is_that_of_the_file(tmp_path: Path):
    text = (
        LEG.replace('["left_hip_joint", "left_knee"]', '["left_knee", "left_hip_joint"]')
        .replace('["y", "joint"]', '["joint", "y"]')
        .replace('["hip flexion", "knee flexion"]', '["knee flexion", "hip flexion"]')
    )
    there, here = law_of(text, tmp_path), law_of(LEG, tmp_path)
    for hip, knee in POSES:
        turned = tuple(reversed(here.torques((hip, knee))))
        assert there.torques((knee, hip)) == pytest.approx(turned, rel=1e-12)
    assert there.valid_ranges == tuple(reversed(here.valid_ranges))


def test_a_sense_turns_the_axis_and_not_the_law(tmp_path: Path):
    (spring,) = springs_of(LEG + "senses = [+1, -1]\n", tmp_path).coupled
    assert spring.axes[1].direction == (0.0, 1.0, 0.0)
    assert spring.law == law_of(LEG, tmp_path)


def test_the_nearest_conservative_law_takes_the_place_of_the_published(tmp_path: Path):
    leg = LEG.replace("[10]", "[0]")
    published, mended = (
        law_of(leg + more, tmp_path) for more in ("", 'conservative = "nearest"\n')
    )
    box = ((radians(-15.0), radians(100.0)), (0.0, radians(135.0)))
    assert loop_work(published, box) == pytest.approx(-12.67, abs=0.01)
    assert loop_work(mended, box) == pytest.approx(0.0, abs=1e-10)
    assert mended == nearest_conservative_law(published, published.valid_ranges).law
    (spring,) = read(leg + 'conservative = "nearest"\n', tmp_path).value.coupled
    assert (spring.law, spring.original) == (mended, published)


def test_the_shipped_file_is_the_prototypes_with_another_hip_and_knee():
    assert springs_names(FIGURES, "prototype") == ("coupled",)
    plain, other = (
        load_springs(PROTOTYPE, FIGURES, "prototype", choice) for choice in (None, "coupled")
    )
    assert plain.value is not None
    assert other.value is not None
    assert other.diagnostics == plain.diagnostics
    assert load_springs(PROTOTYPE, FIGURES, "prototype", "prototype.coupled") == other
    legs = {"left_hip_joint", "right_hip_joint", "left_knee", "right_knee"}
    for name, joint in plain.value.joints.items():
        mine = other.value.joints[name]
        assert [a.damping for a in mine.axes] == [a.damping for a in joint.axes]
        if name not in legs:
            assert mine == joint
            continue
        pairs = zip(mine.axes, joint.axes, strict=True)
        assert [a.direction for a, b in pairs if a != b] == [
            (0.0, -1.0 if "knee" in name else 1.0, 0.0)
        ]
    box = ((radians(-15.0), radians(100.0)), (0.0, radians(135.0)))
    for spring in other.value.coupled:
        assert loop_work(spring.law, box) == pytest.approx(0.0, abs=1e-10)
    assert len(other.value.coupled) == 2


@pytest.mark.parametrize("choice", ["couplde", "", "no such", "x" * 5000])
def test_a_name_that_is_none_lists_what_there_is(choice: str):
    (fault,) = load_springs(PROTOTYPE, FIGURES, "prototype", choice).diagnostics
    assert "beside the figure `prototype`" in fault.message
    assert fault.hint == "there are coupled, none, printed; else name a file"


@pytest.mark.parametrize("held", ["20", "-20", "0.0", "19.999999999"])
def test_within_the_known_range_a_coordinate_is_held_without_a_word(held: str):
    assert SPRINGS_FILE.parse_text(LEG.replace("[10]", f"[{held}]")).diagnostics == ()


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ('"hip flexion", "knee flexion"', '"one", "two"'),
        ('"left_hip_joint", "left_knee"', '"first", "second"'),
    ],
)
def test_names_without_a_known_joint_are_not_doubted(old: str, new: str):
    assert SPRINGS_FILE.parse_text(OWN.replace(old, new)).diagnostics == ()


def test_two_laws_over_the_same_axes_add(tmp_path: Path):
    loaded = read(LEG + OWN, tmp_path).value
    assert loaded is not None
    assert len(loaded.coupled) == 2


def test_a_law_that_is_scaled_to_nothing_can_be_checked(tmp_path: Path):
    (one,) = report_coupled(springs_of(LEG + "scale = 0\n", tmp_path))
    assert not [f for f in one.doubts if f.kind is not FindingKind.SYMMETRY]
