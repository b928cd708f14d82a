"""XML with places."""

from xml.sax.saxutils import quoteattr

from hypothesis import given
from hypothesis import strategies as st

from generator.diagnostics import Diagnostics, Source
from generator.model_files.xml import parse_xml

NAMES = st.from_regex(r"[a-z][a-z0-9_]{0,6}", fullmatch=True)
TEXTS = st.text("abc 01&<>\"'=/-;é\u20ac\U0001d11e", max_size=12)


def parsed(text: str):
    findings = Diagnostics()
    root = parse_xml(Source("x.xml", text), findings)
    assert root is not None, findings.entries
    return root


@given(st.dictionaries(NAMES, TEXTS, max_size=4), TEXTS)
def test_attributes_stand_where_their_values_are_written(values, comment):
    written = {name: quoteattr(value) for name, value in values.items()}
    attributes = "".join(f"\n  {name} = {value}" for name, value in written.items())
    note = comment.replace("-", "")
    root = parsed(f"<!-- é{note} --><a>\n <b{attributes} /></a>")
    (child,) = root.children
    assert {name: one.text for name, one in child.attributes.items()} == values
    for name, one in child.attributes.items():
        assert one.span.text == written[name][1:-1]
    assert child.span.text == "<b"


@given(TEXTS, TEXTS)
def test_a_text_stands_between_its_tags(before, said):
    inner = said.strip() or "1"
    plain = inner.replace("&", "").replace("<", "").strip() or "1"
    root = parsed(f"<a><!--{before.replace('-', '')}--><b>\n {plain} </b><c/>rest</a>")
    first, second = root.children
    assert (first.text.text, first.text.span.text) == (plain, plain)
    assert (second.text.text, second.text.span.text) == ("", "<c")


def test_elements_are_walked_in_the_order_of_the_file():
    root = parsed("<a><b><c/></b><d/></a>")
    assert [element.tag for element in root.walk()] == ["a", "b", "c", "d"]
    assert [element.tag for element in root.find_all("d", "b")] == ["b", "d"]
    assert root.find("e") is None


def test_what_a_file_says_of_its_encoding_does_not_matter():
    """The text is decoded before it is parsed."""
    root = parsed('<?xml version="1.0" encoding="ISO-8859-1"?><a name="é"/>')
    assert root.get("name") == "é"
