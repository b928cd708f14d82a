from math import degrees, exp

import pytest

from springs.published.parse import PublishedError, parse_publication

HEAD = 'reference = "A. Author 1999"\nsureness = "P"\n'
CURVE = """
[[curve]]
name = "knee"
motion = "knee flexion"
formula = "B1 exp(k1 th) + B2 exp(k2 th)"
angle_unit = "rad"
moment_unit = "N m"
coefficients = { B1 = 2.0, k1 = -3.0, B2 = -1.0, k2 = 0.5 }
"""
COUPLED = """
[[coupled]]
name = "leg"
coordinates = ["hip flexion", "knee flexion"]
formula = "M = constant + sum of sign exp(c + hip h + knee k + ankle a)"
angle_unit = "rad"
constants = { hip = 1.5 }
usable_deg = { hip = [-10.0, 90.0], knee = [0.0, 120.0] }
term = [{ moment = "knee", sign = -1, c = 0.2, hip = 0.5, knee = 2.0 }]
"""
MUSCLE = """
formula = "M = -gradient of sum of exp(rates . angles - |first rate| slack)/|first rate|"
angle_unit = "rad"
term = [{ muscle = "flexors", first = "hip", rates = { hip = -5.1 }, slack_deg = 19.5 }]
"""
RHYTHM = """
[[rhythm]]
name = "clavicle"
bone = "clavicle elevation"
points_deg = [[0, 1], [90, 10]]
"""
RANGE = '\n[[range]]\nmotion = "knee flexion"\ndeg = 140\n'


def printed(a):
    return 2.0 * exp(-3.0 * a) - exp(0.5 * a)


def the_curve(extra=""):
    return parse_publication(HEAD + CURVE + extra).curves["knee"]


@pytest.mark.parametrize(
    ("signs", "ours"),
    [
        ("", printed(0.4)),
        ("angle_sign = -1\nmoment_sign = -1", -printed(-0.4)),
        ("moment_sign = -1", -printed(0.4)),
        ("angle_sign = -1", printed(-0.4)),
    ],
)
def test_printed_senses_are_turned_into_ours(signs, ours):
    assert the_curve(signs).law.torque(0.4) == pytest.approx(ours)


def test_a_range_is_turned_with_the_angle():
    row = the_curve("angle_sign = -1\nmoment_sign = -1\nmeasured_deg = [-120, 10]")
    assert row.range_is_measured
    assert [degrees(end) for end in row.valid_range] == pytest.approx([-10.0, 120.0])
    assert row.law.valid_range == row.valid_range
    assert not the_curve("usable_deg = [-120, 10]").range_is_measured
    assert the_curve().valid_range is None


def test_units_are_turned():
    in_deg = CURVE.replace('"rad"', '"deg"').replace('"N m"', '"dyn cm"')
    row = parse_publication(HEAD + in_deg).curves["knee"]
    assert row.law.torque(0.01) == pytest.approx(1e-7 * printed(degrees(0.01)))


def test_defaults_stand_in_for_what_a_row_leaves_out():
    defaults = '[defaults]\nplace = "table 1"\ndamping_Nms_rad = 0.5\nangle_sign = 1\n'
    source = parse_publication(HEAD + 'note = "of the whole"\n' + defaults + CURVE)
    row = source.curves["knee"]
    assert (row.reference.place, row.damping, row.note) == ("table 1", 0.5, "")
    assert (source.note, source.reference.place) == ("of the whole", "")


def test_a_coupled_row_in_the_other_sense():
    law = parse_publication(HEAD + COUPLED + 'turned = ["knee"]').coupled_laws["leg"].law
    plain = parse_publication(HEAD + COUPLED).coupled_laws["leg"].law
    assert plain.torques((0.3, 0.4)) == pytest.approx((1.5, -exp(0.2 + 0.15 + 0.8)))
    assert law.torques((0.3, -0.4)) == pytest.approx((1.5, exp(0.2 + 0.15 + 0.8)))
    assert [degrees(end) for end in law.valid_ranges[1]] == pytest.approx([-120.0, 0.0], abs=1e-9)


def test_numbers_may_be_whole_and_a_limit_may_be_a_least_value():
    row = parse_publication(HEAD + RANGE + "at_least = true\nage = 30").ranges[0]
    assert degrees(row.limit) == pytest.approx(140.0)
    assert (row.at_least, row.age, row.moment) == (True, 30.0, None)


NO_FORMULA = HEAD + CURVE.partition("formula")[0]
SUM, MUSCLES = HEAD + COUPLED, HEAD + COUPLED.partition("formula")[0] + MUSCLE
FAULTS = [
    ("x = ", "this is not TOML"),
    ('sureness = "P"', "there is no `reference`"),
    ('reference = "A"\nsureness = "sure"', "'sure' is not a valid Sureness"),
    (HEAD + "colour = 1", "unknown `colour`; known are reference,"),
    (HEAD + CURVE + "colour = 1", "curve knee: unknown `colour`"),
    (HEAD + "[defaults]\ncolour = 1\n" + CURVE, "defaults: unknown `colour`"),
    (HEAD + CURVE.replace("B1 exp(k1", "B1 sin(k1"), "curve knee: there is no `B1 sin"),
    (HEAD + CURVE.replace('"rad"', '"grad"'), "there is no `grad`"),
    (HEAD + CURVE.replace('"N m"', '"Nm"'), "there is no `Nm`"),
    (HEAD + CURVE.replace("B1 = 2.0, ", ""), "there is no `B1`"),
    (HEAD + CURVE.replace("B1 = 2.0, ", "B1 = 2.0, B3 = 2.0, "), "unknown `B3`; known are B1, k1,"),
    (HEAD + CURVE + "deviation = { B3 = 1.0 }", "unknown `B3`; known are B1, k1,"),
    (HEAD + CURVE + 'sample = "robots"', "'robots' is not a valid SampleKind"),
    (HEAD + CURVE + "angle_sign = 2", "there is no `2`"),
    (HEAD + CURVE + "measured_deg = [1, 2, 3]", "too many values"),
    (HEAD + CURVE + "measured_deg = [0, 1]\nusable_deg = [0, 1]", "measured or usable, not both"),
    (
        NO_FORMULA + 'formula = "points"\nangle_unit = "deg"\nmoment_unit = "N m"\n'
        "points = [[0, 1], [0, 2]]",
        "curve knee: the angles of a curve increase",
    ),
    (SUM.replace('moment = "knee"', 'moment = "toe"'), "coupled leg: unknown `toe`"),
    (SUM.replace("sign = -1", "sine = -1"), "coupled leg: unknown `sine`"),
    (SUM.replace("hip = 1.5", "toe = 1.5"), "coupled leg: unknown `toe`"),
    (MUSCLES.replace("slack_deg", "slack"), "coupled leg: unknown `slack`"),
    (MUSCLES.replace("{ hip", "{ toe"), "coupled leg: unknown `toe`"),
    (MUSCLES.replace('"hip"', '"ankle"'), "coupled leg: there is no `ankle`"),
    (HEAD + RHYTHM.replace("points_deg = [[0, 1], [90, 10]]", ""), "a rhythm has `coefficients`,"),
    (HEAD + RHYTHM + "coefficients = { d = 1 }", "rhythm clavicle: unknown `d`"),
    (HEAD + RHYTHM + "lines_deg = [{ slop = 1 }]", "rhythm clavicle: unknown `slop`"),
    (HEAD + RANGE.replace("deg = 140", ""), "range knee flexion: there is no `deg`"),
]


@pytest.mark.parametrize(("text", "message"), FAULTS)
def test_a_fault_is_a_sentence_with_the_row_s_name(text, message):
    with pytest.raises(PublishedError, match=f"^some: .*{message}|^some, .*{message}"):
        parse_publication(text, "some")
