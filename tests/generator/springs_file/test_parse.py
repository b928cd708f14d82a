import time
from math import radians

import pytest
from hypothesis import given
from hypothesis import strategies as st

from generator.diagnostics import Source, select_errors
from generator.springs_file.laws import CubicEntry
from generator.springs_file.parse import SpringEntry, SpringsFile, parse_springs
from generator.springs_file.toml_spans import locate_keys
from springs import Damping, Joining, Linear

FULL = """\
figure = "prototype"   # a comment
law = "weighted"

[[spring]]
joints = ["left_hip", 'right_hip']
axis = "x"
motion = "abduction"
coefficients_Nm_rad = [-0.131, 136, 8.42,
                       -2.18e2]  # over two lines
sense = +1
dead_zone_deg = [-45, 45.0]
rest_deg = 1.5
viscous_Nms_rad = 0.08
coulomb_Nm = 0.5
stop_stiffness_Nm_rad = 500
stop_onset_deg = 2
reference = \"\"\"
a study; [not a list] # no comment\"\"\"
why = "a reason"

[[spring]]
joints = ["left_knee"]
stiffness_Nm_rad = 20.0
rest_deg = 180
"""


def content(text: str) -> SpringsFile:
    reading = parse_springs(text)
    assert reading.diagnostics == ()
    assert reading.value is not None
    return reading.value


def spring(body: str) -> str:
    return f'[[spring]]\njoints = ["left_knee"]\n{body}\n'


def said(text: str) -> list[str]:
    faults = [fault.as_dict() for fault in parse_springs(text).diagnostics]
    return [f"{f['line']}:{f['column']} {f['message']}" for f in faults]


def test_everything_a_file_can_say_is_read_in_si():
    assert content(FULL) == SpringsFile(
        figure="prototype",
        joining=Joining.WEIGHTED,
        entries=(
            SpringEntry(
                joints=("left_hip", "right_hip"),
                axis="x",
                law=CubicEntry(
                    (-0.131, 136.0, 8.42, -218.0),
                    sense=1,
                    dead_zone=(radians(-45.0), radians(45.0)),
                    dead_zone_stated=True,
                    rest=radians(1.5),
                ),
                damping=Damping(0.08, 0.5),
                stop_stiffness=500.0,
                stop_onset=radians(2.0),
                motion="abduction",
                reference="a study; [not a list] # no comment",
                why="a reason",
            ),
            SpringEntry(joints=("left_knee",), law=Linear(20.0, radians(180.0))),
        ),
    )


def test_entries_know_where_they_are_written():
    first, second = content(FULL).entries
    assert first.origins["spring"].line == 4
    assert first.origins["joints.1"].text == "'right_hip'"
    assert first.origins["joints.1"].column == 23
    assert first.origins["coefficients_Nm_rad"].line == 8
    assert first.origins["coefficients_Nm_rad"].text.endswith("-2.18e2]")
    assert first.origins["why"].line == 19
    assert second.origins["rest_deg"].text == "180"


def test_what_is_left_out_is_left_to_the_rule():
    (entry,) = content(spring("coefficients_Nm_rad = [1, 2, 3, 4]")).entries
    assert entry.law == CubicEntry((1.0, 2.0, 3.0, 4.0), None, None, False, 0.0)
    assert (entry.axis, entry.damping) == (None, Damping())


def test_a_file_can_say_that_there_is_no_dead_zone():
    body = 'coefficients_Nm_rad = [0, -1, 0, 1]\ndead_zone_deg = "none"'
    (entry,) = content(spring(body)).entries
    assert (entry.law.dead_zone, entry.law.dead_zone_stated) == (None, True)


def test_the_only_axis_of_a_joint_needs_no_name():
    bodies = ("viscous_Nms_rad = 1", 'viscous_Nms_rad = 1\naxis = "joint"')
    assert [content(spring(body)).entries[0].axis for body in bodies] == [None, None]


@given(st.floats(-360.0, 360.0), st.floats(-1e6, 1e6))
def test_numbers_are_read_to_the_last_bit(angle, moment):
    body = f"coefficients_Nm_rad = [{moment!r}, 0, 0, 1]\nrest_deg = {angle!r}"
    (entry,) = content(spring(body)).entries
    assert entry.law.coefficients[0] == moment
    assert entry.law.rest == pytest.approx(radians(angle), rel=4e-16, abs=1e-300)


@pytest.mark.parametrize("end", ["\r\n", "\r"])
def test_line_ends_do_not_matter(end):
    assert content(FULL.replace("\n", end)) == content(FULL)


C = "coefficients_Nm_rad = [1, 2, 3, 4]\n"
BROKEN = {
    "empty": ("", ["1:1 there is no spring in this file"]),
    "only a comment": ("# nothing\n", ["1:1 there is no spring in this file"]),
    "no spring": ('figure = "x"\n', ["1:1 there is no spring in this file"]),
    "unknown key": (spring(C + "sens = -1"), ["4:1 unknown key `sens` in a spring"]),
    "unknown table": ("[[springs]]\n", ["1:1 unknown key `springs` in a springs file"]),
    "table in a spring": (
        spring(C) + "[spring.more]\na = 1\n",
        ["5:1 unknown key `more` in a spring"],
    ),
    "unknown law": ('law = "linear"\n' + spring(C), ["1:7 unknown law `linear`"]),
    "law is a number": ("law = 3\n" + spring(C), ["1:7 `law` must be a text"]),
    "springs are no tables": ("spring = 3\n", ["1:10 springs are tables"]),
    "a single table": ("[spring]\n", ["1:1 springs are tables"]),
    "no joints": ("[[spring]]\n" + C, ["1:1 this spring has no `joints`"]),
    "joints empty": ("[[spring]]\njoints = []\n" + C, ["2:10 `joints` must be a list of names"]),
    "joints of numbers": (
        "[[spring]]\njoints = [1]\n" + C,
        ["2:10 `joints` must be a list of names"],
    ),
    "joints without list": (
        '[[spring]]\njoints = "a"\n' + C,
        ["2:10 `joints` must be a list of names"],
    ),
    "no law": (spring('axis = "x"'), ["1:1 this spring has no law"]),
    "wrong axis": (spring(C + 'axis = "w"'), ["4:8 `axis` cannot be `w`"]),
    "axis number": (spring(C + "axis = 3"), ["4:8 `axis` cannot be `3`"]),
    "three coefficients": (
        spring("coefficients_Nm_rad = [1, 2, 3]"),
        ["3:23 `coefficients_Nm_rad` has 3 instead of 4 numbers"],
    ),
    "coefficient alone": (
        spring("coefficients_Nm_rad = 1"),
        ["3:23 `coefficients_Nm_rad` must be a list of 4 numbers"],
    ),
    "nan, inf, text, true": (
        spring('coefficients_Nm_rad = [nan, -inf, "3", true]'),
        [
            "3:24 this number is not finite",
            "3:29 this number is not finite",
            "3:35 a number is expected here",
            "3:40 a number is expected here",
        ],
    ),
    "too large": (
        spring("stiffness_Nm_rad = 1e999\nrest_deg = " + "9" * 800),
        ["3:20 this number is too large", "4:12 this number is not finite"],
    ),
    "dead zone reversed": (
        spring(C + "dead_zone_deg = [10, -10]"),
        ["4:17 the dead zone ends before it begins"],
    ),
    "dead zone of a word": (
        spring(C + 'dead_zone_deg = "no"'),
        ["4:17 `dead_zone_deg` must be a list of 2 numbers"],
    ),
    "sense": (spring(C + "sense = 2"), ["4:9 `sense` must be -1 or +1"]),
    "sense true": (spring(C + "sense = true"), ["4:9 `sense` must be -1 or +1"]),
    "sense of a linear spring": (
        spring("stiffness_Nm_rad = 1\nsense = -1"),
        ["4:9 `sense` belongs to a cubic"],
    ),
    "both laws": (
        spring(C + "stiffness_Nm_rad = 1"),
        ["4:20 a spring is a cubic or a linear spring, not both"],
    ),
    "rest of nothing": (
        spring("viscous_Nms_rad = 1\nrest_deg = 3"),
        ["4:12 `rest_deg` belongs to a cubic or a linear spring"],
    ),
    "negative": (
        spring(
            "stiffness_Nm_rad = -1\nviscous_Nms_rad = -1\ncoulomb_Nm = -1\n"
            "stop_stiffness_Nm_rad = 0\nstop_onset_deg = 0"
        ),
        [
            "3:20 `stiffness_Nm_rad` must not be below zero",
            "4:19 `viscous_Nms_rad` must not be below zero",
            "5:14 `coulomb_Nm` must not be below zero",
            "6:25 `stop_stiffness_Nm_rad` must be above zero",
            "7:18 `stop_onset_deg` must be above zero",
        ],
    ),
    "text": (spring(C + "why = 3"), ["4:7 `why` must be a text"]),
    "in the second table": (
        spring(C) + "\n" + spring("coefficients_Nm_rad = [1, 2, 3]"),
        ["8:23 `coefficients_Nm_rad` has 3 instead of 4 numbers"],
    ),
    "inline tables have the place of their list": (
        'spring = [{joints = ["a"], stiffness_Nm_rad = -1}]\n',
        ["1:10 `stiffness_Nm_rad` must not be below zero"],
    ),
    "no value": ("figure = \n", ["1:9 invalid value"]),
    "no end of string": ('figure = "x\n', ["1:11 illegal character 'end of line'"]),
    "no end of list": ("[[spring]]\njoints = [\n", ["2:10 invalid value"]),
    "twice": (spring(C + "sense = 1\nsense = 1\n"), ["5:9 cannot overwrite a value"]),
    "braces": ("{" * 500, ["1:1 invalid statement"]),
    "binary": ("\0\1\2", ["1:1 invalid statement"]),
    "deep": ("a = " + "[" * 990, ["1:1 brackets are nested too deeply"]),
    "digits": ("a = [" + "\n0x" + "f" * 900 + "]", ["1:1 unknown key `a` in a springs file"]),
}


@pytest.mark.parametrize("name", BROKEN)
def test_what_is_wrong_is_said_with_its_place(name):
    text, expected = BROKEN[name]
    assert said(text) == expected
    assert select_errors(parse_springs(text).diagnostics)


@pytest.mark.parametrize(
    ("text", "hint"),
    [
        (spring(C + "sens = -1"), "did you mean `sense`?"),
        (spring(C + "rest = 3"), "did you mean `rest_deg`?"),
        (spring(C + "viscous = 3"), "did you mean `viscous_Nms_rad`?"),
        (spring("coefficients = 3\nviscous_Nms_rad = 1"), "did you mean `coefficients_Nm_rad`?"),
        ('law = "conservativ"\n' + spring(C), "did you mean `conservative`?"),
        (spring(C + 'axis = "w"'), "it is one of: x, y, z, joint"),
    ],
)
def test_hints_name_what_is_near(text, hint):
    assert [fault.hint for fault in parse_springs(text).diagnostics] == [hint]


def test_a_fault_shows_the_line_and_a_mark():
    (fault,) = parse_springs(spring(C + "dead_zone_deg = [10, -10]"), "my.springs.toml").diagnostics
    assert str(fault) == (
        "my.springs.toml:4:17: error: the dead zone ends before it begins\n"
        "    4 | dead_zone_deg = [10, -10]\n"
        "      |                 ^^^^^^^^^\n"
        "  hint: [lower, upper]"
    )


@pytest.mark.parametrize(
    "text",
    [
        "{" * 10**7,
        "\n".join(f"k{i}." + "a." * 480 + "a = 1" for i in range(100)),
        "[[spring]]\n" * 9000,
        "a = [\n" + "[\n" * 45000,
        "a = 9" + "9" * 10**6,
        '"' * 190,
        "'''" * 3000,
    ],
)
def test_enormous_nonsense_is_refused_quickly(text):
    start = time.process_time()
    reading = parse_springs(text)
    assert time.process_time() - start < 2.0
    assert select_errors(reading.diagnostics)
    assert len(reading.diagnostics) <= 101


@given(st.text(max_size=60))
def test_any_text_gives_faults_and_no_traceback(text):
    for whole in (text, FULL + text, spring(text)):
        reading = parse_springs(whole)
        assert reading.value is not None or select_errors(reading.diagnostics)
        for fault in reading.diagnostics:
            assert str(fault).startswith("<text>:")


def test_the_locator_passes_over_strings_and_comments():
    text = (
        '# joints = 1\na = """\nb = 2\n[[spring]]\n"""\n[[spring]]\n"b" = [ # [\n "x]",\n [1, 2],'
        " {c = 3}, ]\n[[spring]]\nb.c = 4\n"
    )
    places = locate_keys(Source("x", text))
    assert places.table("spring").line == 6
    assert places.table("spring", 1).line == 10
    assert [places.value("spring", 0, "b", k).text for k in range(3)] == [
        '"x]"',
        "[1, 2]",
        "{c = 3}",
    ]
    assert places.key("spring", 1, "b").text == "b.c"
    assert places.value("spring", 1, "b", 0).text == "4"
    assert places.value("spring", 1, "absent").line == 10
    assert places.value("", 0, "b").start == 0
