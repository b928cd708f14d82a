"""A springs file of all that the fields of a figure do not hold."""

from dataclasses import replace
from pathlib import Path

import pytest

from generator.diagnostics import ModelError
from generator.figure_file import read_figure
from generator.springs_file.edit import format_besides_fields
from generator.springs_file.read import load_springs, read_springs
from springs import Linear, SphericalLaw, SpringSet

FILE = Path("model.springs.toml")


def returned(text: str, name: str) -> SpringSet:
    bare = replace(read_figure(name), path=None)
    return load_springs(bare, choice=FILE, text=text).require_value()


@pytest.mark.parametrize(
    ("name", "choice"),
    [("prototype", None), ("prototype", "printed"), ("prototype", "coupled"), ("clavicles", None)],
)
def test_springs_and_their_references_come_back(name: str, choice: str | None):
    figure = read_figure(name)
    springs = read_springs(choice, figure)
    back = returned(format_besides_fields(figure, springs), name)
    assert back.joints == springs.joints
    assert back.coupled == springs.coupled
    assert back.references == springs.references


def test_stops_of_another_stiffness_come_back():
    figure = replace(read_figure("prototype"), path=None)
    text = """[[spring]]
joints = ["left_knee"]
axis = "joint"
stiffness_Nm_rad = 3.5
stop_stiffness_Nm_rad = 77
stop_onset_deg = 2
"""
    springs = load_springs(figure, choice=FILE, text=text).require_value()
    back = returned(format_besides_fields(figure, springs), "prototype")
    assert back.joints == springs.joints


def test_fields_alone_need_no_file():
    figure = replace(read_figure("prototype"), path=None)
    springs = load_springs(figure).require_value()
    assert format_besides_fields(figure, springs) == ""


@pytest.mark.parametrize("law", [SphericalLaw.WEIGHTED, SphericalLaw.COORDINATES])
def test_the_law_of_springs_in_fields_comes_back(law: SphericalLaw):
    figure = replace(read_figure("prototype"), path=None)
    springs = replace(load_springs(figure).require_value(), law=law)
    text = format_besides_fields(figure, springs)
    assert text.splitlines() == [f'law = "{law.value}"']
    back = returned(text, "prototype")
    assert (back.joints, back.law) == (springs.joints, law)


def test_springs_that_a_file_cannot_state_are_refused():
    figure = read_figure("prototype")
    with pytest.raises(ModelError, match="beside the figure's own"):
        format_besides_fields(figure, SpringSet())
    springs = read_springs(None, figure)
    (axis,) = springs.joints["left_knee"].axes
    two = replace(axis, elastic=(*axis.elastic, Linear(1.0)))
    joints = {**springs.joints, "left_knee": replace(springs.joints["left_knee"], axes=(two,))}
    with pytest.raises(ModelError, match="several laws of `left_knee`"):
        format_besides_fields(figure, replace(springs, joints=joints))
