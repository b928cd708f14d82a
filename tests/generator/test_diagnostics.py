import pickle

import pytest

from generator.diagnostics import (
    MAX_DIAGNOSTICS,
    Diagnostics,
    InputError,
    MoverError,
    Parsed,
    Source,
    Span,
    TooManyErrors,
    closest_match,
    error,
    select_errors,
    spelling_hint,
    warning,
)


def _span(text, part):
    start = text.index(part)
    return Span(Source("arm.fig", text), start, start + len(part))


def test_a_fault_shows_place_line_mark_and_hint():
    fault = error("unknown field `mas`", _span("figure {\n  mas = 3g;\n}", "mas"), "try `mass`")
    assert str(fault).split("\n") == [
        "arm.fig:2:3: error: unknown field `mas`",
        "    2 |   mas = 3g;",
        "      |   ^^^",
        "  hint: try `mass`",
    ]


def test_a_fault_without_a_place_is_one_sentence():
    assert str(warning("there is no file")) == "warning: there is no file"


@pytest.mark.parametrize("place", [0, 57, 4000, 9990])
def test_the_mark_stays_under_its_word_when_the_line_is_cut(place):
    text = "x" * place + "HERE" + "y" * (9996 - place)
    _, line, mark = str(error("wrong", _span(text, "HERE"))).split("\n")
    assert len(line) < 120
    assert line[mark.index("^") : mark.rindex("^") + 1] == "HERE"


def test_the_mark_ends_with_the_line():
    text = "a (\nb )"
    _, line, mark = str(error("wrong", Span(Source("t", text), 2, len(text)))).split("\n")
    assert line.endswith("(")
    assert mark.endswith("^")
    assert len(mark) == len(line)


def test_characters_that_do_not_print_keep_their_room():
    text = "a\tb\x07c HERE"
    _, line, mark = str(error("wrong", _span(text, "HERE"))).split("\n")
    assert line.isprintable()
    assert line[mark.index("^") :] == "HERE"


def test_a_fault_as_a_dictionary():
    fault = warning("odd", _span("one\ntwo", "two"), "look")
    assert fault.to_json() == {
        "severity": "warning",
        "message": "odd",
        "hint": "look",
        "file": "arm.fig",
        "line": 2,
        "column": 1,
    }
    assert "file" not in error("gone").to_json()


def test_errors_are_told_from_warnings():
    faults = [warning("a"), error("b"), warning("c"), error("d")]
    assert [fault.message for fault in select_errors(faults)] == ["b", "d"]


def test_the_nearest_word_is_suggested():
    assert spelling_hint("mas", ["psurf", "mass", "inertia"]) == "did you mean `mass`?"


def test_without_a_near_word_the_known_ones_are_listed():
    assert spelling_hint("qqq", ["psurf", "mass"]) == "known here: mass, psurf"
    assert spelling_hint("qqq", []) == ""


def test_a_long_list_of_known_words_is_cut():
    hint = spelling_hint("qqq", [f"segment{number}" for number in range(500)])
    assert hint.endswith("and 480 more")


def test_the_closest_of_very_many_words_is_found():
    assert closest_match("segmnet3141", [f"segment{number}" for number in range(5000)]) is not None
    assert closest_match("zzz", [f"segment{number}" for number in range(5000)]) is None


def test_an_input_error_carries_all_faults():
    faults = (warning("first"), error("second"))
    raised = InputError(faults)
    assert raised.diagnostics == faults
    assert "first" in str(raised)
    assert "second" in str(raised)
    assert isinstance(raised, MoverError)


def test_an_input_error_keeps_its_diagnostics_when_pickled():
    source = Source("my.fig", "one\ntwo\n")
    raised = InputError((error("wrong", Span(source, 4, 7), "right"), warning("odd")))
    again = pickle.loads(pickle.dumps(raised))
    assert again.diagnostics == raised.diagnostics
    assert str(again) == str(raised)


def test_a_parsed_value_or_all_its_diagnostics():
    odd = warning("odd")
    assert Parsed(0, (odd,)).require_value() == 0
    with pytest.raises(InputError) as caught:
        Parsed(None, (odd, error("wrong"))).require_value()
    assert caught.value.diagnostics == (odd, error("wrong"))


def test_errors_of_a_part_stop_the_whole_with_one_hint():
    part, whole = Diagnostics(), Diagnostics()
    with pytest.raises(TooManyErrors):
        part.extend(Diagnostics([error(f"wrong {k}") for k in range(MAX_DIAGNOSTICS)]))
    with pytest.raises(TooManyErrors):
        whole.extend(part)
    assert whole.entries == part.entries
    assert part.entries[-1].hint == "reading stopped here, after 100 errors"


def test_an_error_is_reported_once_and_a_muted_one_never():
    found = Diagnostics()
    for _ in range(2):
        found.error("wrong", None)
    with found.muted():
        assert not found.has_errors
        found.error("another", None)
        assert found.has_errors
    assert [one.message for one in found.entries] == ["wrong"]
