"""Colours of segments."""

from dataclasses import replace

import pytest

from generator.figure import Attribute
from generator.geometry.read import (
    GREY,
    segment_colour,
)
from tests.chains import BALL, body, figure, ground, joint

RED = Attribute("red", {"rgb": (1.0, 0.0, 0.0)})
BRIGHT = Attribute("bright", {"rgb": (2.0, -1.0, 0.5)})
SHINY = Attribute("shiny", {"shine": (1.0,)})


@pytest.mark.parametrize(
    ("attributes", "colour"),
    [
        (("shiny", "red", "bright"), (1.0, 0.0, 0.0)),
        (("bright",), (1.0, 0.0, 0.5)),
        (("shiny",), GREY),
        (("none",), GREY),
        ((), GREY),
    ],
)
def test_the_first_attribute_with_a_colour_gives_it(attributes, colour):
    link = replace(body("link"), attributes=attributes)
    made = figure([ground(), link], [joint("pin", "ground.base", "link.near", BALL)])
    made = replace(made, attributes={each.name: each for each in (RED, BRIGHT, SHINY)})
    assert segment_colour(made, link) == colour
