"""Dimensions of a person from a static trial."""

from pathlib import Path

import numpy as np
import pytest

from generator.diagnostics import UsageError
from generator.figure_file import read_figure
from generator.inverse.markers import Markers, format_trc
from generator.inverse.static_trial import LANDMARKS, StaticMeasures, measure_static_trial
from generator.person.identity import identity_of
from generator.person.measures import Measures, estimate_measures
from generator.person.survey import Sex
from generator.rotations import Array
from tests.command import answer, mover, run

STATED = {
    "lateral_malleolus_height": 0.071,
    "lateral_femoral_epicondyle_height": 0.51,
    "trochanterion_height": 0.93,
    "acromial_height": 1.46,
    "suprasternale_height": 1.455,
    "cervicale_height": 1.54,
    "biacromial_breadth": 0.40,
    "acromion_radiale_length": 0.345,
    "radiale_stylion_length": 0.262,
}
MEASURED = {name: value for name, value in STATED.items() if name != "lateral_malleolus_height"}
SOLE = 0.025


def me() -> Measures:
    return estimate_measures(Sex.MALE, 1.79, 78.0, STATED)


def landmarks(arm: float = 5.0, sole: float = 0.0) -> dict[str, Array]:
    """Landmarks of a person with arms at an angle from the body [deg], on soles [m]."""
    person = me()

    def length(name: str) -> float:
        return person.length(name)

    half, out = 0.5 * length("biacromial_breadth"), np.radians(arm)
    places = {
        "top_of_head": (0.0, person.stature, 0.02),
        "cervicale": (0.0, length("cervicale_height"), -0.07),
        "suprasternale": (0.0, length("suprasternale_height"), 0.07),
    }
    for side, sign in (("left", 1.0), ("right", -1.0)):
        acromion = np.array([sign * half, length("acromial_height"), 0.0])
        along = np.array([sign * np.sin(out), -np.cos(out), 0.0])
        elbow = acromion + length("acromion_radiale_length") * along
        hip = sign * 0.17
        places |= {
            f"{side}_acromion": tuple(acromion),
            f"{side}_elbow": tuple(elbow),
            f"{side}_wrist": tuple(elbow + length("radiale_stylion_length") * along),
            f"{side}_trochanter": (hip, length("trochanterion_height"), 0.0),
            f"{side}_knee": (hip, length("lateral_femoral_epicondyle_height"), 0.01),
            f"{side}_ankle": (hip, length("lateral_malleolus_height"), 0.03),
        }
    shift = np.array([0.0, sole, 0.0])
    return {name: np.array(place) + shift for name, place in places.items()}


def trial(places: dict[str, Array], noise: float = 0.0) -> Markers:
    rng = np.random.default_rng(1)
    frames = np.stack([*places.values()]) + noise * rng.normal(size=(200, len(places), 3))
    return Markers(0.01 * np.arange(200.0), tuple(places), frames)


def measure(
    places: dict[str, Array], noise: float = 0.0, stature: float | None = None
) -> StaticMeasures:
    return measure_static_trial(trial(places, noise), Sex.MALE, 78.0, stature)


def test_lengths_are_those_of_the_person_who_stood():
    """Only the malleolus stays by the stature, and heights of the leg are built up from it."""
    assert set(landmarks()) == set(LANDMARKS)
    found = measure(landmarks())
    assert found.stature == pytest.approx(1.79)
    assert found.notices == ()
    assert found.lengths.keys() == MEASURED.keys()
    usual = estimate_measures(Sex.MALE, 1.79, 78.0).length("lateral_malleolus_height")
    for name, value in MEASURED.items():
        leg = name in ("lateral_femoral_epicondyle_height", "trochanterion_height")
        shift = usual - STATED["lateral_malleolus_height"] if leg else 0.0
        assert found.lengths[name] == pytest.approx(value + shift, abs=1e-12), name


def test_soles_and_noise_hardly_matter_with_a_stature():
    plain = measure(landmarks(), stature=1.79)
    shod = measure(landmarks(sole=SOLE), noise=0.002, stature=1.79)
    for name, value in plain.lengths.items():
        assert shod.lengths[name] == pytest.approx(value, abs=1e-3)


def test_raised_arms_tell_nothing_of_shoulders():
    found = measure(landmarks(arm=80.0))
    gone = {"acromion_radiale_length", "biacromial_breadth", "acromial_height"}
    assert MEASURED.keys() - found.lengths.keys() == gone
    told = [notice for notice in found.notices if "the upper arms do not hang" in notice]
    assert len(told) == len(gone)


def test_what_is_missing_is_told_and_one_side_is_enough():
    kept = {name: place for name, place in landmarks().items() if "left_" in name}
    found = measure(kept, stature=1.79)
    legs = {name for name in MEASURED if "epicondyle" in name or "trochanter" in name}
    assert found.lengths.keys() == legs | {"acromion_radiale_length", "radiale_stylion_length"}
    assert len(found.notices) == len(MEASURED) - len(found.lengths)
    assert found.markers["radiale_stylion_length"] == "left_elbow to left_wrist"
    without_knee = {name: place for name, place in kept.items() if name != "left_knee"}
    assert not legs & measure(without_knee, stature=1.79).lengths.keys()


def exchanged(places: dict[str, Array]) -> dict[str, Array]:
    """Exchange left and right of places by their names."""
    other = {"left": "right", "right": "left"}
    parts = {name: name.partition("_") for name in places}
    return {f"{other.get(a, a)}{b}{c}": places[name] for name, (a, b, c) in parts.items()}


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"left_knee": (0.0, 0.09, 0.0)}, "`left_knee` is 9.0 cm higher than `right_knee`"),
        ({"left_wrist": (0.0, -0.09, 0.0)}, "`radiale_stylion_length` is the mean of"),
        (dict.fromkeys(LANDMARKS, (0.0, 0.4, 0.0)), "`left_ankle`, `right_ankle` are some 38 cm"),
    ],
)
def test_a_misplaced_body_or_marker_is_told(changes: dict[str, tuple[float, ...]], told: str):
    places = landmarks()
    for name, shift in changes.items():
        places[name] = places[name] + shift
    (notice,) = measure(places).notices
    assert notice.startswith(told)


def test_left_is_on_the_left_of_the_front():
    """The trunk or, before it, the feet say where the front is."""
    (notice,) = measure(exchanged(landmarks())).notices
    assert notice.startswith("left and right are exchanged")
    feet = {
        f"{side}_{name}": np.array([sign * 0.17, 0.04, ahead])
        for side, sign in (("left", 1.0), ("right", -1.0))
        for name, ahead in (("heel", -0.05), ("toe", 0.18))
    }
    places = {name: at for name, at in (landmarks() | feet).items() if name != "cervicale"}
    assert not any("exchanged" in notice for notice in measure(places).notices)
    assert any("exchanged" in notice for notice in measure(exchanged(places)).notices)


def test_a_marker_at_the_origin_is_missing():
    found = measure({**landmarks(), "left_wrist": np.zeros(3)})
    assert found.notices == (
        "`left_wrist` is at 0, 0, 0 in all frames: it counts as missing there",
    )
    assert found.markers["radiale_stylion_length"] == "right_elbow to right_wrist"


def test_a_walk_is_no_static_trial():
    places = landmarks()
    markers = trial(places)
    markers.positions[:, :, 0] += np.linspace(0.0, 0.5, 200)[:, None]
    found = measure_static_trial(markers, Sex.MALE, 78.0)
    assert "`top_of_head` moves by 50 cm: the trial is not static" in found.notices


@pytest.mark.parametrize(
    ("places", "message"),
    [
        ({}, "no marker on the landmark `top_of_head`"),
        ({"top_of_head": np.array([0.0, 1.79, 0.0])}, "no two markers are on landmarks"),
        ({**landmarks(), "top_of_head": np.array([0.0, 17.9, 0.0])}, "17.9 m is imp.*`Units`"),
    ],
)
def test_nothing_to_measure_is_refused(places: dict[str, Array], message: str):
    with pytest.raises(UsageError, match=message):
        measure({"nose": np.ones(3), **places})


@pytest.mark.slow
def test_a_person_from_a_trial(tmp_path: Path):
    path, figure = tmp_path / "static.trc", tmp_path / "me.fig"
    path.write_text(format_trc(trial(landmarks())).replace("left_knee", "LKNE"))
    words = ("person", "--sex", "male", "--mass", "78kg", "--markers", path)
    named = (*words, "--marker", "left_knee=LKNE")
    said = answer(*named, "-o", figure)
    assert said["warnings"] == []
    dimensions = {one["name"]: one for one in said["dimensions"] if one["measured"]}
    assert dimensions.keys() == MEASURED.keys()
    assert dimensions["biacromial_breadth"]["value_m"] == pytest.approx(0.40)
    person = identity_of(read_figure(figure))
    assert person is not None
    assert person.stature == pytest.approx(1.79)
    text = run(*named, "--stature", "1.8m").stdout
    assert "left_knee to left_ankle and right_knee to right_ankle" in text
    # A file of dimensions comes before the markers.
    measures = tmp_path / "me.toml"
    measures.write_text("biacromial_breadth_cm = 41\n")
    both = {one["name"]: one for one in answer(*named, "--measures", measures)["dimensions"]}
    assert both["biacromial_breadth"]["value_m"] == pytest.approx(0.41)
    assert both["radiale_stylion_length"]["measured"]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--marker", "left_knee"), "expected LANDMARK=NAME"),
        (("--marker", "knee=LKNE"), "unknown landmark `knee`; did you mean `left_knee`?"),
        (("--marker", "left_knee=LKN"), "unknown marker `LKN`; did you mean `LKNE`?"),
        (("--up", "x"), "y or z points up"),
        (("--up", "z"), "static.trc: a stature of 0.02 m is impossible"),
        (("--up", "z", "--stature", "1.79m"), "upwards: did you mean `--up y`?"),
    ],
)
def test_options_of_a_trial_are_checked(words: tuple[str, ...], message: str, tmp_path: Path):
    path = tmp_path / "static.trc"
    path.write_text(format_trc(trial(landmarks())).replace("left_knee", "LKNE"))
    said = mover("person", "--sex", "male", "--mass", "78kg", "--markers", path, *words)
    assert said.exit_code == 2
    assert message in said.stderr


def test_a_stature_is_needed_without_a_trial():
    said = mover("person", "--sex", "male", "--mass", "78kg")
    assert said.exit_code == 2
    assert "state the --stature" in said.stderr
    said = mover("person", "--sex", "male", "--mass", "78kg", "--marker", "left_knee=LKNE")
    assert "--marker says what the markers of --markers STATIC.trc are on" in said.stderr
