"""The plates of the joints' curves: what they claim, what they draw and what they write."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from matplotlib.legend import Legend

from plots.canvas import LINE_STYLES, render_figure
from plots.joint_curve import law_claims
from plots.plate import Claim, Outcome
from springs.published.tables import curve as published_row
from tests.plots.drawn import data, maker, plate

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


AGREES, DIFFERS = Outcome.AGREES, Outcome.DIFFERS
EXPECTED = (
    # Plate, words of the claim, outcome, what it measures, and how far that may be off.
    # M(a) - M(edge) = 10 N m, worked by hand from the coefficients, and the published end.
    ("elbow", "elbow flexion ends", DIFFERS, 144.6 - 97.71, 0.05),
    ("knee", "knee flexion ends", DIFFERS, 137.7 - 97.06, 0.05),
    ("knee", "hyperextension ends", AGREES, 5.86 - 1.0, 0.05),
    ("hip_abduction", "hip adduction ends", DIFFERS, 46.2 - 30.0, 0.05),
    ("hip_abduction", "hip abduction ends", AGREES, 48.3 - 45.0, 0.05),
    # Standing upright the hip has 33 N m.
    ("hip_flexion", "hip extension ends", DIFFERS, 17.4, 1e-6),
    # From -10.8 to 63.8 and from -100.1 to 31.3 deg; 62 + 168.8 and 104 + 69 deg.
    ("shoulder_flexion", "From one end", DIFFERS, 230.8 - 74.6, 0.2),
    ("shoulder_rotation", "From one end", DIFFERS, 173.0 - 131.4, 0.2),
    # The cubic is zero at 23.19 deg; 0.045 at 23 and -0.101 at 24 deg are zero at 23.31.
    ("hip_flexion", "vanishes", AGREES, 0.115, 0.005),
    ("hip_abduction", "5 N m are reached", DIFFERS, 47.3 - 30.0, 0.05),
    ("hip_rotation", "5 N m are reached", AGREES, 39.6 - 35.0, 0.05),
)


@EVERY
def test_nothing_that_is_claimed_of_a_joint_s_resistance_holds_without_springs(name) -> None:
    none = np.zeros_like(data(name).simulated)
    other = None if data(name).other_side_torques is None else none
    limp = replace(data(name), simulated=none, other_side_torques=other)
    claims = (*law_claims(limp), *maker(name).claims(limp, *maker(name).literature))
    held = [one.sentence for one in claims if one.holds]
    assert [said for said in held if "other side has the same torque" not in said] == []


@pytest.mark.parametrize(
    ("words", "low", "high"),
    [("From 20 to 80 deg", 20.0, 80.0), ("From -15 to 20 deg the", -15.0, 20.0)],
)
def test_the_difference_from_silder_s_hips(words, low, high) -> None:
    points = np.array(published_row("silder_2007/hip_knee_15").printed.points)
    at, torque = points[(points[:, 0] >= low) & (points[:, 0] <= high)].T
    thesis = np.polyval([-82.76, 188.2, -144.6, 33.180672], np.radians(at))
    rms = float(np.sqrt(np.mean((thesis - torque) ** 2)))
    found = claim("hip_flexion", words)
    assert found.measured == pytest.approx(rms, rel=1e-6)
    assert found.outcome is (AGREES if rms < 5.0 else DIFFERS)


@EVERY
def test_what_is_not_measured_is_not_compared(name) -> None:
    compared = [one for one in plate(name).claims if one.outcome in (AGREES, DIFFERS)]
    for row in maker(name).literature:
        if row.obstacle:
            assert not [one for one in compared if row.label in one.sentence]
            assert claim(name, f"The torque is that of {row.label}").obstacle == row.obstacle
    for words in ("Saul", "Anderson 1999", "Davy", "Riener", "Anderson 2007", "Han", "Schmidt"):
        assert not [one for one in compared if words in one.sentence]


def test_a_sense_that_is_not_certain_is_drawn_both_ways() -> None:
    for name, odds in (("waist_flexion", "60/40"), ("waist_twist", "50/50")):
        assert f"cubic in the other sense: the odds are {odds}" in labels(name)
        table = plate(name).tables["readings"]
        other = table["cubic in the other sense, as torque on the child [N m]"]
        assert other == pytest.approx(
            -table["cubic as printed, as torque on the child [N m]"], abs=1e-9
        )
        ends = [one for one in plate(name).claims if "normal range of" in one.sentence]
        assert len(ends) == 2
        assert all("sense" in one.obstacle for one in ends)
    assert not any("other sense" in label for label in labels("waist_bend"))


def test_published_scatter_is_a_band_and_a_column() -> None:
    table = plate("hip_flexion").tables["silder_2007_digitised"]
    low, high = (table[f"{side} edge of the scatter [N m]"] for side in ("lower", "upper"))
    assert high - low == pytest.approx(np.full_like(low, 5.0))
    assert 0.5 * (low + high) == pytest.approx(table["published [N m]"])
    upper = plate("hip_flexion").figure.axes[1]
    assert len(upper.collections) == 2
    assert "Silder 2007, digitised: 20 living subjects;" in plate("hip_flexion").caption
    assert any("(n = 10)" in label for label in labels("hip_flexion"))


def test_a_dead_zone_that_the_thesis_does_not_print_is_called_so() -> None:
    # How far the printed cubics push between their outer roots, at their extremes.
    outward = {
        "waist_bend": 4.0,
        "waist_flexion": 78.4,
        "waist_twist": 66.7,
        "shoulder_abduction": 2.4,
        "hip_abduction": 43.0,
        "hip_rotation": 10.3,
    }
    for name in PLATES:
        _, said, after = plate(name).caption.partition("drives outwards there with up to ")
        assert bool(said) is (name in outward)
        if said:
            assert float(after.split()[0]) == pytest.approx(outward[name], abs=0.06)


@EVERY
def test_the_torque_read_out_of_exudyn_is_that_of_the_law_on_both_sides(name) -> None:
    law, *rest = plate(name).claims
    assert law.sentence.startswith("The torque read out of Exudyn is that of the law")
    assert law.at_most == 1e-6
    assert 0.0 <= law.measured < 1e-9
    assert ("other side" in rest[0].sentence) is not name.startswith("waist")
    assert rest[0].holds or name.startswith("waist")


@pytest.mark.parametrize(("name", "words", "outcome", "measured", "off"), EXPECTED)
def test_what_is_claimed_of_a_joint(name, words, outcome, measured, off) -> None:
    found = claim(name, words)
    assert found.measured == pytest.approx(measured, abs=off)
    assert found.outcome is outcome


@EVERY
def test_differences_are_explained_and_nothing_fails(name) -> None:
    claims = plate(name).claims
    assert [one.sentence for one in claims if one.outcome is Outcome.FAILS] == []
    assert [one.sentence for one in claims if not (one.holds or one.explanation)] == []


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
    assert columns["published [N m]"][row] == 7.294
    # c0 of the left hip, in N m.
    assert columns["simulated [N m]"][row] == pytest.approx(33.180672, abs=1e-6)
    assert columns["simulated - published [N m]"][row] == pytest.approx(33.180672 - 7.294, abs=1e-6)


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
