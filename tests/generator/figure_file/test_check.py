"""A simulation needs the masses that a figure may lack; figures made in Python are checked too."""

from dataclasses import replace

import pytest

from generator import (
    AxisKind,
    Figure,
    InputError,
    Joint,
    JointAxis,
    Location,
    Segment,
    Site,
    SiteRef,
    build_tree,
    by_name,
    write_figure,
)
from generator.diagnostics import select_errors
from generator.figure_file import FIGURE_FILE, read_figure, simulation_diagnostics
from generator.figure_file.check import require_valid_figure
from tests.paths import FAULTS


@pytest.mark.parametrize(
    ("stem", "count"),
    [("no_centre_of_mass", 2), ("no_masses", 1), ("zero_mass", 1), ("missing_psurf", 0)],
)
def test_a_simulation_needs_all_masses(stem: str, count: int):
    diagnostics = simulation_diagnostics(read_figure(FAULTS / "figure" / f"{stem}.fig"))
    assert len(diagnostics) == count
    assert select_errors(diagnostics) == diagnostics


@pytest.mark.parametrize("name", FIGURE_FILE.shipped())
def test_masses_and_inertias_of_shipped_figures_are_plausible(name: str):
    messages = [one.message for one in FIGURE_FILE.parse_file(name).diagnostics]
    assert not [one for one in messages if " unit" in one or "has a mass of" in one]


ARM = Segment(
    "arm",
    mass=2.5,
    inertia=(0.019, 0.019, 0.002),
    sites=by_name(Site("top"), Site("CM", Location.at(0.0, -0.15, 0.0))),
)
FLOOR = Segment("floor", mass=-1.0, sites=by_name(Site("base"), Site("hook", Location.at(0, 2, 0))))
HINGE = Joint(
    "hinge",
    SiteRef("floor", "hook"),
    SiteRef("arm", "top"),
    chain=(JointAxis(AxisKind.ROTATION, (0.0, 0.0, 1.0)),),
    displacement=(0.5,),
    upper_limit=(2.0,),
)
PENDULUM = Figure(by_name(FLOOR, ARM), by_name(HINGE), SiteRef("floor", "base"), name="one")

TEXT = """figure one {
  segment floor { mass = -1kg; site base { } site hook->location = trans(0m,2m,0m); }
  segment arm {
    mass = 2.5kg;
    inertia = (0.019 kg m2,0.019 kg m2,0.002 kg m2);
    site top { }
    site CM->location = trans(0m,-0.15m,0m);
  }
  joint hinge {
    connect floor.hook to arm.top;
    type = R(0,0,1);
    displacement = (0.5rad);
    ulimit = (2rad);
  }
  root = floor.base;
}
"""

MISTAKES = {
    "no such segment": (
        replace(HINGE, child=SiteRef("arn", "top")),
        ("arm.top", "arn.top"),
        "child of joint `hinge`: ",
    ),
    "no such site": (
        replace(HINGE, parent=SiteRef("floor", "hok")),
        ("floor.hook to", "floor.hok to"),
        "parent of joint `hinge`: ",
    ),
    "to itself": (
        replace(HINGE, child=SiteRef("floor", "base")),
        ("arm.top", "floor.base"),
        "",
    ),
    "limits": (
        replace(HINGE, lower_limit=(3.0,)),
        ("ulimit = (2rad);", "ulimit = (2rad); llimit = (3rad);"),
        "",
    ),
    "inertia": (
        replace(ARM, inertia=(1.0, 0.1, 0.1)),
        ("0.019 kg m2,0.019 kg m2,0.002 kg m2", "1 kg m2,0.1 kg m2,0.1 kg m2"),
        "",
    ),
    "attribute": (
        replace(ARM, attributes=("red",)),
        ("mass = 2.5kg;", "mass = 2.5kg; attribute = red;"),
        "segment `arm`: ",
    ),
    "ground": (replace(ARM, mass=-2.5), ("2.5kg", "-2.5kg"), ""),
    "alone": (
        Segment("leg", mass=-1.0),
        ("joint hinge", "segment leg {mass = -1kg;} joint hinge"),
        "",
    ),
}


def test_a_figure_made_in_python_is_that_of_its_text() -> None:
    assert FIGURE_FILE.parse_text(TEXT).value == PENDULUM
    assert FIGURE_FILE.parse_text(write_figure(PENDULUM)).value == PENDULUM
    require_valid_figure(PENDULUM, to_simulate=True)


@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_mistake_in_python_is_the_sentence_of_the_same_mistake_in_a_file(mistake: str) -> None:
    part, (right, wrong), owner = MISTAKES[mistake]
    assert TEXT.count(right) == 1
    read = select_errors(FIGURE_FILE.parse_text(TEXT.replace(right, wrong)).diagnostics)
    assert read
    with pytest.raises(InputError) as caught:
        require_valid_figure(PENDULUM.with_parts(part))
    made = caught.value.diagnostics
    assert sorted(one.message for one in made) == sorted(owner + one.message for one in read)
    assert sorted(one.hint for one in made) == sorted(one.hint for one in read)
    assert all(one.span is None for one in made)


def test_a_changed_figure_does_not_blame_the_lines_of_its_file() -> None:
    figure = read_figure("prototype")
    waist = replace(figure.joints["waist"], parent=SiteRef("lower_tors", "distal"))
    with pytest.raises(InputError) as caught:
        build_tree(figure.with_parts(waist))
    assert str(caught.value) == (
        "error: parent of joint `waist`: there is no segment `lower_tors`\n"
        "  hint: did you mean `lower_torso`?"
    )


def test_only_a_simulation_needs_masses() -> None:
    light = PENDULUM.with_parts(replace(ARM, mass=None))
    require_valid_figure(light)
    with pytest.raises(InputError, match="segment `arm` moves but has no mass"):
        require_valid_figure(light, to_simulate=True)
