from math import radians

import pytest
from hypothesis import given
from hypothesis import strategies as st

from generator.diagnostics import Source, select_errors
from generator.springs_file.coupled import COUPLED_ROWS
from generator.springs_file.laws import CubicEntry
from generator.springs_file.parse import SPRING_ROWS, SPRINGS_FILE, SpringEntry, SpringsFile
from generator.toml_file.spans import locate_keys
from springs import Damping, Linear, SphericalLaw
from tests.work import counted_calls

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
    reading = SPRINGS_FILE.parse_text(text)
    assert reading.diagnostics == ()
    assert reading.value is not None
    return reading.value


def spring(body: str) -> str:
    return f'[[spring]]\njoints = ["left_knee"]\n{body}\n'


def test_everything_a_file_can_say_is_read_in_si():
    assert content(FULL) == SpringsFile(
        figure="prototype",
        law=SphericalLaw.WEIGHTED,
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
    assert (entry.axis, entry.damping) == (None, None)


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
def test_enormous_nonsense_is_refused_with_little_work(text):
    reading, calls = counted_calls(lambda: SPRINGS_FILE.parse_text(text))
    assert calls < 1_000 + 20 * min(len(text), 100_000)
    assert select_errors(reading.diagnostics)
    assert len(reading.diagnostics) <= 101


VALUES = st.recursive(
    st.sampled_from(["1", "-2.5", "nan", '"x"', "true", "[]", "{}", "{a = 1}"]),
    lambda inner: st.lists(inner, max_size=3).map(lambda items: f"[{', '.join(items)}]"),
    max_leaves=6,
)


def tables(keys):
    return st.dictionaries(st.sampled_from(keys), VALUES, max_size=5)


@given(tables(SPRING_ROWS.keys), tables(COUPLED_ROWS.keys))
def test_values_of_any_kind_give_faults_and_no_traceback(own, coupled):
    for head, table in ((spring(""), own), ("[[coupled]]\n", coupled)):
        lines = [f"{key} = {value}\n" for key, value in table.items() if key not in head]
        reading = SPRINGS_FILE.parse_text(head + "".join(lines))
        assert (reading.value is None) is bool(select_errors(reading.diagnostics))
        for fault in reading.diagnostics:
            assert str(fault).startswith("<text>:")


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        ('axis = "along z"\nstiffness_Nm_rad = 3', "`stiffness_Nm_rad` is of a rotation"),
        ('axis = "along z"\nstiffness_N_m = 3\nviscous_Nms_rad = 1', "`viscous_Nms_rad` is of a"),
        ('axis = "z"\nstiffness_N_m = 3', "`stiffness_N_m` is of a translation"),
        ("viscous_Ns_m = 3", "`viscous_Ns_m` is of a translation"),
        ('axis = "along z"\nstiffness_N_m = -3', "`stiffness_N_m` must not be below zero"),
        ('axis = "along z"\nrest_m = 0.1', "`rest_m` belongs to a linear spring along"),
        ('axis = "along z"', "this spring has no law"),
    ],
)
def test_keys_of_rotations_and_translations_do_not_mix(lines: str, message: str):
    reading = SPRINGS_FILE.parse_text(f'[[spring]]\njoints = ["neck"]\n{lines}\n')
    assert reading.value is None
    assert message in "\n".join(map(str, reading.diagnostics))


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
