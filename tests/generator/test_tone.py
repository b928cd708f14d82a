"""Tone that a run asks for: joints and groups, times, and what is refused."""

from math import inf

import pytest

from generator.diagnostics import ModelError
from generator.tone import Tone, group_of

JOINTS = ("waist", "thorax", "neck", "left_shoulder", "left_hip_joint", "left_knee", "tail")


def test_groups_are_found_by_words() -> None:
    assert [group_of(name) for name in JOINTS] == [
        *("trunk", "trunk", "neck", "arms", "legs", "legs", ""),
    ]


def test_all_leaves_out_what_is_righted() -> None:
    tone = Tone({"all": 0.03}, {"neck": 0.5, "trunk": 0.4})
    assert tone.righting_shares(JOINTS) == {"waist": 0.4, "thorax": 0.4, "neck": 0.5}
    assert tone.hold_shares(JOINTS) == dict.fromkeys(
        ("left_shoulder", "left_hip_joint", "left_knee", "tail"), 0.03
    )


def test_joint_precedes_its_group_and_this_all() -> None:
    tone = Tone({"all": 0.03, "legs": 0.2, "left_knee": 0.0, "neck": 0.1}, {"neck": 0.5})
    held = tone.hold_shares(JOINTS)
    assert held["left_hip_joint"] == 0.2
    assert "left_knee" not in held
    assert held["neck"] == 0.1
    assert held["tail"] == 0.03


@pytest.mark.parametrize(
    ("tone", "sentence"),
    [
        (Tone({"left_kne": 0.1}), "tone: no joint or group `left_kne`; did you mean `left_knee`"),
        (Tone({}, {"trnk": 0.1}), "righting: no joint or group `trnk`; did you mean `trunk`"),
    ],
)
def test_unknown_names_get_the_nearest(tone: Tone, sentence: str) -> None:
    with pytest.raises(ModelError, match=sentence):
        tone.hold_shares(JOINTS) | tone.righting_shares(JOINTS)


def test_group_without_a_joint_is_an_error() -> None:
    with pytest.raises(ModelError, match="the figure has no joint of the group `arms`"):
        Tone({"arms": 0.1}).hold_shares(("neck", "waist"))


@pytest.mark.parametrize(
    ("values", "sentence"),
    [
        ({"hold": {"neck": 1.5}}, "the tone of neck is from 0 to 1, not 1.5"),
        ({"righting": {"all": 0.5}}, "righting is of joints or groups"),
        ({"rise": 0.0}, "the rise of a tone is positive"),
        ({"delay": -1.0}, "the delay of a tone is not negative"),
        ({"delay": 0.3, "release": 0.32}, "released at 0.32 s, before it has risen at 0.35 s"),
        ({"strengths": {"knee": (-1.0, 2.0)}}, "the strength of knee is not negative"),
    ],
)
def test_impossible_values_are_refused(values: dict[str, object], sentence: str) -> None:
    with pytest.raises(ValueError, match=sentence):
        Tone(**values)  # pyright: ignore[reportArgumentType]


def test_shares_of_zero_are_no_tone() -> None:
    assert not Tone()
    assert not Tone({"all": 0.0}, {"neck": 0.0})
    assert Tone({"all": 0.01})
    assert str(Tone({"all": 0.03}, {"neck": 0.5}, delay=0.1, release=0.3, name="fall")) == (
        "fall; holding all 0.03; righting neck 0.5; from 0.1 s; until 0.3 s"
    )


def test_activation_is_in_the_time_of_the_run() -> None:
    activation = Tone(delay=0.1, release=0.5).activation(2.0)
    assert activation.knots == pytest.approx((2.1, 2.15, 2.5, 2.55))
    assert Tone().activation(2.0).begin == -inf
