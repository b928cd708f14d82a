"""Sex and stature of a person in its figure, as an attribute of display data, and what they select.

attribute person { sex = "male"; stature_m = 1.75; }
"""

from dataclasses import dataclass

from generator.figure import Attribute, Figure
from generator.figure_file.check import (
    PERSON_ATTRIBUTE,
    SEX_KEY,
    STATURE_KEY,
    sex_and_stature,
)
from generator.person.survey import Sex
from springs.published.range_of_motion import PREFERRED_PUBLICATIONS, PUBLICATIONS_OF_WOMEN


@dataclass(frozen=True)
class Identity:
    """Sex and stature of a person.

    Attributes:
        sex: sex of the samples from which the figure was made.
        stature: [m].
    """

    sex: Sex
    stature: float

    @property
    def attribute(self) -> Attribute:
        """The attribute of a figure that holds both."""
        return Attribute(PERSON_ATTRIBUTE, {SEX_KEY: self.sex.value, STATURE_KEY: (self.stature,)})


def range_publications(sex: Sex | None) -> tuple[str, ...]:
    """Return the publications with normal ranges of a sex, the preferred first.

    Those of women precede the others for women only: they measured few joints.
    """
    women = PUBLICATIONS_OF_WOMEN if sex is Sex.FEMALE else ()
    return (*women, *PREFERRED_PUBLICATIONS)


def identity_of(figure: Figure) -> Identity | None:
    """Return sex and stature of a figure; None unless it states both, as a person does."""
    found = sex_and_stature(figure)
    if found is None or found[0] not in set(Sex):
        return None
    return Identity(Sex(found[0]), found[1])
