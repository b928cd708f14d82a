"""Files of published numbers: the head, and what is refused."""

import pytest

from generator.person.data_files import data_file_names, load_data_file, parse_data_file
from springs.published.parse import PublishedError
from springs.published.reference import Sureness

TEXT = """
reference = "A. Author, A table of the body, A Journal 1:2-3, 1996"
sureness = "C1"
place = "table 4"
note = "Ten people."
[trunk]
length_mm = 500
"""


def test_the_head_is_the_reference_and_the_rest_the_content():
    data = parse_data_file(TEXT, "author_1996")
    assert data.name == "author_1996"
    assert data.reference.text.startswith("A. Author")
    assert (data.reference.sureness, data.reference.place) == (Sureness.ONE_CODE, "table 4")
    assert (data.note, data.content) == ("Ten people.", {"trunk": {"length_mm": 500}})


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("reference =", "title =", "author: there is no `reference`"),
        ('"C1"', '"sure"', "author: 'sure' is not a valid Sureness"),
        ("[trunk]", "[trunk", "author: Expected ']'"),
    ],
)
def test_a_head_that_cannot_be_read_is_a_sentence(old: str, new: str, message: str):
    with pytest.raises(PublishedError, match=message.replace("[", r"\[")):
        parse_data_file(TEXT.replace(old, new), "author")


def test_every_file_that_comes_with_the_program_has_a_reference():
    assert "ansur_2012" in data_file_names()
    for name in data_file_names():
        data = load_data_file(name)
        assert data.name == name
        assert data.reference.text
        assert data.content


def test_an_unknown_file_lists_the_files():
    with pytest.raises(PublishedError, match=r"no data file `ansur_1988`; there are .*ansur_2012"):
        load_data_file("ansur_1988")
