"""Tone files and the options of tone."""

from math import inf

import pytest

from generator.diagnostics import InputError, UsageError
from generator.input_files.tone import TONE_FILE, tone_from_options
from generator.tone import Tone
from springs.strength.strengths import StrengthClass

TEXT = """\
delay_s = 0.1
width_rad = 0.3
[[hold]]
joints = ["all"]
share = 0.03
class = "estimate"
[[righting]]
joints = ["neck", "trunk"]
share = 0.5
class = "estimate"
source = "share of head impacts"
[[strength]]
motion = "tail flexion"
torque_Nm = [10, 20]
class = "published"
source = "a paper"
"""


def test_file_is_read() -> None:
    assert TONE_FILE.parse_text(TEXT).require_value() == Tone(
        {"all": 0.03},
        {"neck": 0.5, "trunk": 0.5},
        width=0.3,
        delay=0.1,
        strengths={"tail flexion": (10.0, 20.0)},
        strength_classes={"tail flexion": StrengthClass.PUBLISHED},
    )


def test_shipped_file_is_read_with_its_sources() -> None:
    tone = TONE_FILE.read("fall")
    assert tone.righting == {"neck": 0.45, "trunk": 0.45}
    assert tone.hold == {}
    assert (tone.width, tone.lead, tone.release) == (0.2, 0.1, inf)


@pytest.mark.parametrize(
    ("old", "new", "line", "sentence"),
    [
        ("share = 0.03", "share = 3", 5, "`share` must be from 0 to 1, not 3"),
        ('["all"]', '["all", "all"]', 4, "a second share of `all`"),
        ('["neck", "trunk"]', '["all"]', 8, "righting is of joints or groups"),
        ('source = "a paper"\n', "", 15, "is published and has no `source`"),
        ("[10, 20]", "[10, -20]", 14, "a strength is not below zero"),
        (
            "[[strength]]",
            '[[strength]]\nmotion = "tail flexion"\ntorque_Nm = [1, 2]\nclass = "estimate"\n\n'
            "[[strength]]",
            18,
            "a second strength of `tail flexion`",
        ),
        ("delay_s", "delay", 1, "unknown key `delay`"),
        ('class = "estimate"\n[[right', "[[right", 3, "this hold table has no `class`"),
        ("delay_s = 0.1", "delay_s = 0.1\nrelease_s = 0.12", 1, "before it has risen"),
    ],
)
def test_errors_name_the_line(old: str, new: str, line: int, sentence: str) -> None:
    assert old in TEXT
    found = TONE_FILE.parse_text(TEXT.replace(old, new, 1))
    assert found.value is None
    (fault,) = found.diagnostics
    assert sentence in fault.message
    assert fault.span is not None
    assert fault.span.line == line


def test_options() -> None:
    assert tone_from_options("0.03") == Tone({"all": 0.03})
    found = tone_from_options("fall", ["neck = 0.2"], ["left_knee,arms=0.1"], "100ms", "0.3 s")
    assert found.righting == {"neck": 0.2, "trunk": 0.45}
    assert found.hold == {"left_knee": 0.1, "arms": 0.1}
    assert (found.delay, found.release, found.name) == (0.1, 0.3, "fall")
    assert not tone_from_options(None)


@pytest.mark.parametrize(
    ("values", "sentence"),
    [
        (("2",), "--tone 2: a share of the strength is from 0 to 1"),
        (("nan",), "--tone nan: a share"),
        ((None, ["neck"]), "--right neck: expected JOINTS=SHARE"),
        ((None, ["neck=x"]), "--right neck=x: expected JOINTS=SHARE"),
        ((None, ["neck=2"]), "--right neck=2: a share"),
        ((None, [], ["=0.1"]), "--hold =0.1: expected JOINTS=SHARE"),
        (("0.1", [], [], "3"), "--delay 3: expected a time such as"),
        (("0.1", [], [], "0.3s", "0.1s"), "before it has risen"),
        ((None, ["all=0.1"]), "righting is of joints or groups"),
    ],
)
def test_wrong_options_are_refused(values: tuple[object, ...], sentence: str) -> None:
    with pytest.raises(UsageError, match=sentence):
        tone_from_options(*values)  # pyright: ignore[reportArgumentType]


def test_unknown_file_gets_the_nearest_name() -> None:
    with pytest.raises(InputError, match="no shipped tone of that name") as caught:
        tone_from_options("fal")
    assert "fall" in str(caught.value)
