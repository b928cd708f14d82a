from hypothesis import given
from hypothesis import strategies as st

from generator.diagnostics import Source, Span

_TEXTS = st.text(alphabet="ab \n\té€😀", max_size=60)


@given(text=_TEXTS, data=st.data())
def test_line_and_column_agree_with_counting_by_hand(text, data):
    source = Source("text", text)
    offset = data.draw(st.integers(0, len(text)))
    before = text[:offset]
    line, column = source.line_and_column(offset)
    assert line == before.count("\n") + 1
    assert column == len(before) - (before.rfind("\n") + 1) + 1


@given(text=_TEXTS)
def test_lines_are_the_lines_of_the_text(text):
    source = Source("text", text)
    expected = text.split("\n")
    assert [source.line_text(number + 1) for number in range(len(expected))] == expected


def test_a_line_is_shown_without_its_carriage_return():
    assert Source("text", "one\r\ntwo\r\n").line_text(1) == "one"


def test_a_span_knows_its_text_and_place():
    span = Span(Source("text", "one\ntwo three"), 8, 13)
    assert (span.text, span.line, span.column) == ("three", 2, 5)


def test_a_span_reaches_to_another_and_never_ends_before_itself():
    source = Source("text", "a = (1, 2)")
    assert Span(source, 4, 5).extend_to(Span(source, 8, 9)).text == "(1, 2"
    assert Span(source, 2, 6).extend_to(Span(source, 3, 4)).text == "= (1"
