"""Files of published numbers of the body."""

import pytest

from generator.person.sources import load_data_file
from springs.published.reference import Sureness


@pytest.mark.parametrize(
    ("name", "author", "sureness"),
    [
        ("ansur_2012", "C. C. Gordon", Sureness.SEVERAL_CODES),
        ("de_leva_1996", "de Leva", Sureness.SEVERAL_CODES),
        ("passive_joints", "M. K. Lebiedowska", Sureness.PAGE),
    ],
)
def test_a_file_has_its_publication_and_a_note(name: str, author: str, sureness: Sureness):
    data = load_data_file(name)
    assert data.reference.text.startswith(author)
    assert data.reference.sureness is sureness
    assert data.note == data.note.strip() != ""
