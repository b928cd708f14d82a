"""The plates of the joints' curves: what they claim, what they draw and what they write."""

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
import pytest
from matplotlib.legend import Legend

from plots.canvas import LINE_STYLES, render_figure
from plots.joint_curve import law_claims
from plots.plate import Claim
from tests.plots.drawn import curve, maker, plate

PLATES = {
    "elbow": "4.2",
    "knee": "4.3",
    "shoulder_abduction": "4.4",
    "shoulder_flexion": "4.5",
    "shoulder_rotation": "4.6",
    "hip_flexion": "4.8",
    "hip_abduction": "4.9",
    "hip_rotation": "4.10",
    "waist_bend": "4.11",
    "waist_flexion": "4.12",
    "waist_twist": "4.13",
}
EVERY = pytest.mark.parametrize("name", PLATES)


def legend(name: str) -> Legend:
    found = plate(name).figure.axes[0].get_legend()
    assert found is not None
    return found


def labels(name: str) -> list[str]:
    return [text.get_text() for text in legend(name).get_texts()]


def claim(name: str, words: str) -> Claim:
    (found,) = (one for one in plate(name).claims if words in one.sentence)
    return found


@dataclass(frozen=True)
class Expected:
    """A claim by its words; what it measures, and how far that may be off."""

    plate: str
    words: str
    holds: bool
    measured: float
    off: float


EXPECTED = (
    # Stops: M(a) - M(edge) = 10 N m, worked by hand from the coefficients.
    Expected("elbow", "stop of flexion", False, 97.4 + 0.31, 0.05),
    Expected("knee", "stop of flexion", False, 89.0 + 8.06, 0.05),
    Expected("shoulder_abduction", "stop of abduction", False, 131.9, 0.2),
    Expected("shoulder_flexion", "stop of flexion", False, 63.8, 0.2),
    Expected("shoulder_rotation", "stop of medial rotation", False, 31.3, 0.2),
    Expected("waist_flexion", "stop of flexion", False, 55.9, 0.2),
    # -2.206618 + 30.54884913 a - 50.8802156 a^2 + 29.9064608 a^3 at 90 deg.
    Expected("shoulder_flexion", "raised forward to 90 deg", False, 36.148, 0.001),
    # The cubic is zero at 23.19 deg; 0.5 at 20 and -0.2 at 25 deg are zero at 23.57.
    Expected("hip_flexion", "Silder 2007, digitised does", True, 0.38, 0.01),
    Expected("hip_flexion", "Silder 2007, equation does", False, 31.0 - 23.2, 0.1),
    # From a table of both at 20, 25 .. 70 deg.
    Expected("hip_flexion", "From 20 to 70 deg", True, 1.74 / 6.82, 0.005),
    Expected("hip_flexion", "At -15 deg", False, 85.4 / 28.4, 0.01),
    Expected("hip_flexion", "90 deg with the knee", True, -34.3, 0.05),
    # At 95 deg -7.0 N m stand against -7.0 between -6.0 and -8.2, at 115 deg -51.4 against -14.
    Expected("knee", "At 95 deg", True, 1.0, 0.05),
    Expected("knee", "At 115 deg", False, 51.4 / 14.0, 0.1),
    Expected("hip_abduction", "At 30 deg", False, 0.0, 1e-9),
    Expected("hip_abduction", "At 60 deg", True, 98.8 / 106.5, 0.01),
    Expected("hip_abduction", "At -60 deg", True, 117.0 / 106.5, 0.01),
    Expected("hip_abduction", "At both ends", False, 46.2 - 30.0, 0.05),
    Expected("hip_rotation", "dead zone ends", True, 35.0 - 33.2, 0.1),
    Expected("waist_twist", "At both ends", False, 71.5 - 45.0, 0.1),
    Expected("shoulder_rotation", "without torque", True, 2.8, 0.05),
    # How far the printed cubics push between their outer roots, at their extremes.
    Expected("waist_bend", "As printed", False, 4.0, 0.05),
    Expected("waist_flexion", "As printed", False, 78.4, 0.05),
    Expected("waist_twist", "As printed", False, 66.7, 0.05),
    Expected("shoulder_abduction", "As printed", False, 2.4, 0.05),
    Expected("hip_abduction", "As printed", False, 43.0, 0.05),
    Expected("hip_rotation", "As printed", False, 10.3, 0.05),
    # The waist's twist is free where six lumbar segments in series hold 80.2 N m/rad.
    Expected("waist_twist", "half of that of Schmidt 1998", False, 1.0, 1e-9),
    # From the published numbers: those of the joint are less.
    Expected("elbow", "both torques are small", False, 12.09, 0.01),
    Expected("knee", "both torques are small", True, 6.0, 1e-9),
    Expected("hip_rotation", "both torques are small", True, 5.0, 0.01),
    # Of the angles at which shoulder and model push, 7 are after the model's zero and before 8 deg.
    Expected("shoulder_flexion", "push the same way", False, 100.0 * 7.0 / 9.0, 0.1),
)

FREE = (
    "both torques are small",
    "Within the normal range",
    "raised forward to 90 deg",
    "rotates without torque",
)
"""Claims that a joint does not resist somewhere."""

OF_OTHERS = (
    "other side has the same torque",
    "The dead zone ends",
    "Riener & Edrich's equation gives",
)
"""Claims of two sides, of a law's own numbers, and of a published equation."""


@EVERY
def test_a_joint_without_springs_fails_all_that_is_claimed_of_its_resistance(name) -> None:
    none = np.zeros_like(curve(name).simulated)
    other = None if curve(name).other_side_torques is None else none
    limp = replace(curve(name), simulated=none, other_side_torques=other)
    claims = (*law_claims(limp), *maker(name).claims(limp, *maker(name).literature))
    held = [one.sentence for one in claims if one.holds]
    assert [said for said in held if not any(w in said for w in (*FREE, *OF_OTHERS))] == []


@EVERY
def test_what_is_claimed_to_be_free_is_not_without_all_torque(name) -> None:
    for one in plate(name).claims:
        if any(words in one.sentence for words in FREE):
            assert one.measured > 0.1, one.sentence


@EVERY
def test_the_torque_read_out_of_exudyn_is_that_of_the_law_on_both_sides(name) -> None:
    law, *rest = plate(name).claims
    assert law.sentence.startswith("The torque read out of Exudyn is that of the law")
    assert law.at_most == 1e-6
    assert 0.0 <= law.measured < 1e-9
    assert ("other side" in rest[0].sentence) is not name.startswith("waist")
    assert rest[0].holds or name.startswith("waist")


@pytest.mark.parametrize("expected", EXPECTED, ids=lambda e: f"{e.plate}-{e.words}")
def test_what_is_claimed_of_a_joint(expected) -> None:
    found = claim(expected.plate, expected.words)
    assert found.measured == pytest.approx(expected.measured, abs=expected.off)
    assert found.holds is expected.holds


@EVERY
def test_claims_that_fail_have_a_remark(name) -> None:
    claims = plate(name).claims
    assert [claim.sentence for claim in claims if not (claim.holds or claim.remark)] == []


@EVERY
def test_a_plate_has_its_name_figure_sign_and_references(name) -> None:
    made = plate(name)
    assert made.name == name
    assert made.title.endswith(f"(the thesis's figure {PLATES[name]})")
    assert "positive in" in made.sign
    assert "Torques act on the child" in made.sign
    assert made.references[0].startswith("E. M. Otani")
    assert len(set(made.references)) == len(made.references)
    foot = " ".join(made.figure.get_supxlabel().split())
    for number, text in enumerate(made.references, start=1):
        assert f"[{number}] {' '.join(text.split())}" in foot


@EVERY
def test_the_picture_has_its_elements(name) -> None:
    made = plate(name)
    strip, upper, lower = made.figure.axes
    assert made.figure.get_suptitle() == made.title
    assert [label.get_text() for label in strip.get_yticklabels()] == ["dead zone", "normal range"]
    assert upper.get_ylabel() == "torque on the child [N m]"
    assert lower.get_ylabel() == "simulated -\npublished [N m]"
    assert lower.get_xlabel().startswith("angle [deg], positive in ")
    said = labels(name)
    assert said[0] == "simulated: read out of Exudyn, joint at rest"
    assert any(label.startswith("thesis: cubic as printed") for label in said)
    own = ("thesis", "end of the normal range [")
    published = [label for label in said if label.endswith("]") and not label.startswith(own)]
    assert any(label.startswith(own[1]) for label in said)
    assert 1 <= len(published) <= len(LINE_STYLES)
    # Where the thesis had a source of its own, what is drawn stands in for it.
    estimates = ("hip_abduction", "hip_rotation", "waist_bend", "waist_flexion", "waist_twist")
    assert all(label.startswith("substitute: ") is (name not in estimates) for label in published)
    styles = [
        (line.get_linestyle(), line.get_marker())
        for line in legend(name).get_lines()
        if str(line.get_label()) in published
    ]
    assert len(set(styles)) == len(styles) == len(published)


@EVERY
def test_the_marks_are_what_was_read_out_of_exudyn(name) -> None:
    made = plate(name)
    readings = made.tables["readings"]
    upper = made.figure.axes[1]
    (marks,) = (
        line
        for line in upper.get_lines()
        if line.get_marker() == "o" and line.get_markerfacecolor() == "#E69F00"
    )
    angles, torques = (np.asarray(values, dtype=float) for values in marks.get_data())
    assert len(angles) > 15
    expected = np.interp(angles, readings["angle [deg]"], readings["simulated [N m]"])
    assert np.max(np.abs(torques - expected)) < 1e-9


@EVERY
def test_tables_have_units_in_their_headers_and_columns_of_one_length(name) -> None:
    for columns in plate(name).tables.values():
        assert {len(column) for column in columns.values()} == {len(columns["angle [deg]"])}
        assert all(header.endswith(("[deg]", "[N m]")) for header in columns)
        assert np.all(np.diff(columns["angle [deg]"]) > 0.0)


@EVERY
def test_nothing_is_drawn_beyond_a_known_range_without_a_word(name) -> None:
    """Each curve that is dotted somewhere is named in the caption with the range it has."""
    made = plate(name)
    for line in legend(name).get_lines():
        label = str(line.get_label())
        published = label.removeprefix("substitute: ").rpartition(" [")[0]
        if line.get_linestyle() == ":" and not label.startswith("end of"):
            assert f"{published}: " in made.caption
            after = made.caption.partition(f"{published}: ")[2].partition(". ")[0]
            assert "the range in which this curve was measured is not known" in after


def test_what_is_cut_off_is_told() -> None:
    assert "Torques outside -60 to 40 N m are cut off" in plate("elbow").caption
    assert "extrapolated at -25 .. 0 deg and 130 .. 155 deg" in plate("elbow").caption
    assert "extrapolated at -30 .. -15 deg and 100 .. 135 deg" in plate("hip_flexion").caption


def test_the_digitised_curve_stands_in_a_table_of_its_own() -> None:
    columns = plate("hip_flexion").tables["silder_2007_digitised"]
    row = int(np.flatnonzero(np.isclose(columns["angle [deg]"], 0.0))[0])
    assert columns["published [N m]"][row] == 7.3
    # c0 of the left hip, in N m.
    assert columns["simulated [N m]"][row] == pytest.approx(33.180672, abs=1e-6)
    assert columns["simulated - published [N m]"][row] == pytest.approx(25.880672, abs=1e-6)


@pytest.mark.parametrize(
    ("name", "angle", "torque"),
    [
        # 1.014 + 29.224 a - 6.13885 a^2 + 214.423 a^3 less its value at the edge, resisting.
        ("elbow", -20.0, 20.1),
        ("elbow", 50.0, 0.0),
        ("elbow", 110.0, -465.0),
        ("knee", 105.0, -24.8),
        ("knee", -5.0, 8.4),
        ("shoulder_abduction", 150.0, -21.0),
        ("shoulder_flexion", 120.0, -113.3),
        ("shoulder_rotation", 45.0, -20.9),
        ("hip_flexion", -15.0, 85.4),
        ("hip_abduction", 60.0, -98.8),
        ("hip_rotation", -60.0, 69.8),
        ("waist_bend", 45.0, -26.3),
        ("waist_flexion", 75.0, -184.3),
        ("waist_twist", -75.0, 30.0),
    ],
)
def test_readings_worked_by_hand(name, angle, torque) -> None:
    readings = plate(name).tables["readings"]
    at = np.argmin(np.abs(readings["angle [deg]"] - angle))
    assert readings["angle [deg]"][at] == pytest.approx(angle)
    assert readings["simulated [N m]"][at] == pytest.approx(
        torque, abs=0.5 if angle == 110 else 0.06
    )


def test_the_printed_cubic_ruled_out_by_a_dead_zone_is_dashed() -> None:
    for name, dashed in (("knee", True), ("hip_flexion", False)):
        assert ("cubic as printed, ruled out by the dead zone" in labels(name)) is dashed


def test_single_points_are_not_joined() -> None:
    lines = plate("hip_abduction").figure.axes[1].get_lines()
    (points,) = (
        line
        for line in lines
        if len(np.asarray(line.get_xdata())) == 2 and line.get_marker() == "s"
    )
    assert points.get_linestyle() == "None"
    assert np.allclose(np.asarray(points.get_xdata(), dtype=float), [-40.0, 30.0])
    assert np.allclose(np.asarray(points.get_ydata(), dtype=float), [5.0, -5.0])


@pytest.mark.parametrize("name", ["knee", "shoulder_rotation"])
def test_nothing_overlaps_the_curves(name) -> None:
    """Legend, ranges, curves, residuals and foot stand below each other."""
    figure = plate(name).figure
    render_figure(figure, "png")
    renderer = figure.canvas.get_renderer()  # pyright: ignore[reportAttributeAccessIssue]
    strip, upper, lower = figure.axes
    boxes = [one.get_window_extent(renderer) for one in (legend(name), strip, upper, lower)]
    for above, below in pairwise(boxes):
        assert above.y0 >= below.y1 - 1.0
    assert boxes[0].x1 <= figure.bbox.x1
    foot = figure._supxlabel.get_window_extent(renderer)  # pyright: ignore
    assert foot.y0 >= 0.0
    assert foot.x1 <= figure.bbox.x1
    assert foot.y1 <= lower.get_window_extent(renderer).y0
