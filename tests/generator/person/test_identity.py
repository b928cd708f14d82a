"""Sex and stature of a person in a figure."""

import pytest

from generator.figure import Figure
from generator.figure_file import FIGURE_FILE
from generator.figure_file.write import write_figure
from generator.person.identity import Identity, identity_of, range_publications
from generator.person.survey import Sex
from springs.published.range_of_motion import PREFERRED_PUBLICATIONS, PUBLICATIONS_OF_WOMEN

TEXT = """figure {{
  attribute {name} {{ {fields} }}
  segment base {{ mass = -1g; site top->location = trans(0cm,0cm,0cm); }}
  root = base.top;
}}
"""


def figure(fields: str, name: str = "person") -> Figure:
    return FIGURE_FILE.parse_text(TEXT.format(name=name, fields=fields)).require_value()


def test_a_figure_of_a_file_states_sex_and_stature():
    read = figure('sex = "female"; stature_m = 1.628;')
    assert identity_of(read) == Identity(Sex.FEMALE, 1.628)


@pytest.mark.parametrize("sex", Sex)
def test_what_is_written_is_read(sex: Sex):
    made = Identity(sex, 1.7553)
    written = write_figure(figure("rgb = (1,0,0);").with_parts(made.attribute))
    assert identity_of(FIGURE_FILE.parse_text(written).require_value()) == made


@pytest.mark.parametrize(
    "fields",
    [
        'sex = "male";',
        "stature_m = 1.7;",
        'sex = "other"; stature_m = 1.7;',
        'sex = "male"; stature_m = 0;',
        'sex = "male"; stature_m = -1;',
        'sex = "male"; stature_m = "tall";',
        'sex = "male"; stature_m = (1,2);',
        "sex = (1,0); stature_m = 1.7;",
    ],
)
def test_other_attributes_are_not_those_of_a_person(fields: str):
    assert identity_of(figure(fields)) is None


def test_a_figure_without_the_attribute_is_not_a_person():
    assert identity_of(figure('sex = "male"; stature_m = 1.7;', name="somebody")) is None


def test_ranges_of_women_precede_the_others_for_women():
    assert range_publications(Sex.MALE) == range_publications(None) == PREFERRED_PUBLICATIONS
    assert range_publications(Sex.FEMALE) == (*PUBLICATIONS_OF_WOMEN, *PREFERRED_PUBLICATIONS)
