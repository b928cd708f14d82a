"""Sex and stature of a person in its figure, as an attribute of display data, and what they select.

attribute person { sex = "male"; stature_m = 1.75; }
"""

from dataclasses import dataclass
from math import isfinite

from generator.figure import Attribute, Figure
from generator.figure_file.check import PERSON_ATTRIBUTE
from generator.person.survey import Sex
from springs.published.range_of_motion import PREFERRED_PUBLICATIONS, PUBLICATIONS_OF_WOMEN

SEX_KEY = "sex"
STATURE_KEY = "stature_m"


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
    if PERSON_ATTRIBUTE not in figure.attributes:
        return None
    fields = figure.attributes[PERSON_ATTRIBUTE].fields
    sex, stature = fields.get(SEX_KEY), fields.get(STATURE_KEY)
    if sex not in set(Sex) or not isinstance(stature, tuple) or len(stature) != 1:
        return None
    return Identity(Sex(sex), stature[0]) if stature[0] > 0.0 and isfinite(stature[0]) else None
