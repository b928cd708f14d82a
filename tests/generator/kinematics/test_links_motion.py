"""Motion of a figure with a links file."""

import numpy as np
import pytest

from generator.figure_file import FIGURE_FILE, read_figure
from generator.kinematics.links import LINKS_FILE, Coordinate, Link

PROTOTYPE = read_figure("prototype")

SLIDES = """
figure {
  segment floor { mass = -1g; site o->location = trans(0cm,0cm,0cm); }
  segment cart { mass = 1kg; inertia = (1,1,1); site o->location = trans(0cm,0cm,0cm); }
  segment lift { mass = 1kg; inertia = (1,1,1); site o->location = trans(0cm,0cm,0cm); }
  segment lid { mass = 1kg; inertia = (1,1,1); site o->location = trans(0cm,0cm,0cm); }
  segment bolt { mass = 1kg; inertia = (1,1,1); site o->location = trans(0cm,0cm,0cm); }
  joint rail { connect floor.o to cart.o; type = T(1,0,0); }
  joint shaft { connect cart.o to lift.o; type = T(0,1,0); }
  joint hinge { connect lift.o to lid.o; type = R(0,0,1); }
  joint fixed { connect lid.o to bolt.o; }
  root = floor.o;
}
"""


def slides():
    figure = FIGURE_FILE.parse_text(SLIDES).value
    assert figure is not None
    return figure


def reading_of(tmp_path, text, figure=PROTOTYPE):
    path = tmp_path / "my.links.toml"
    path.write_text(text, encoding="utf-8")
    return LINKS_FILE.parse_file(path, figure)


def links_of(tmp_path, text, figure=PROTOTYPE):
    reading = reading_of(tmp_path, text, figure)
    assert reading.diagnostics == ()
    assert reading.value is not None
    return reading.value


def table(joint, control, **more):
    lines = [f"{key} = {str(value).lower()}" for key, value in more.items()]
    return "\n".join(["[[link]]", f'joints = ["{joint}"]', f'control = "{control}"', *lines, ""])


def test_a_link_of_joints_links_each_of_their_freedoms(tmp_path):
    """Eq. 5.50."""
    links = links_of(tmp_path, table("right_shoulder", "left_shoulder", factor=-0.5))
    assert links.links == tuple(
        Link(Coordinate("right_shoulder", k), Coordinate("left_shoulder", k), -0.5)
        for k in range(3)
    )


def test_a_link_of_freedoms(tmp_path):
    more = {"dof": 3, "control_dof": 1, "factor": 2.0, "offset_deg": 90}
    (link,) = links_of(tmp_path, table("waist", "left_hip_joint", **more)).links
    assert link == Link(Coordinate("waist", 2), Coordinate("left_hip_joint", 0), 2.0, np.pi / 2)


def test_the_only_freedom_of_a_joint_need_not_be_numbered(tmp_path):
    one, other = table("left_elbow", "waist", control_dof=2), table("waist", "left_knee", dof=2)
    assert links_of(tmp_path, one).links == (
        Link(Coordinate("left_elbow", 0), Coordinate("waist", 1)),
    )
    assert links_of(tmp_path, other).links == (
        Link(Coordinate("waist", 1), Coordinate("left_knee", 0)),
    )


def test_slides_have_offsets_in_metres(tmp_path):
    (link,) = links_of(tmp_path, table("shaft", "rail", offset_m=0.2), slides()).links
    assert link == Link(Coordinate("shaft", 0), Coordinate("rail", 0), 1.0, 0.2)


def test_chains_of_tables_resolve(tmp_path):
    text = table("left_knee", "right_knee", factor=3) + table("right_knee", "left_elbow", factor=2)
    first = links_of(tmp_path, text).resolved[0]
    assert first == Link(Coordinate("left_knee", 0), Coordinate("left_elbow", 0), 6.0)


@pytest.mark.parametrize(
    ("text", "line", "said", "hint"),
    [
        (table("left_elbw", "waist"), 2, "no joint `left_elbw`", "did you mean `left_elbow`?"),
        (table("left_elbow", "waits"), 3, "no joint `waits`", "did you mean `waist`?"),
        (table("left_elbow", "waist"), 2, "has 1 degree of freedom and `waist` 3", "control_dof"),
        (table("left_elbow", "waist", dof=1), 2, "one of the 3", "`control_dof = 1`, or up to 3"),
        (table("waist", "left_elbow", dof=4), 4, "has 3 degrees of freedom, not 4", ""),
        (table("waist", "left_hip_joint", offset_deg=3), 4, "an offset belongs to one", "`dof`"),
        (table("left_knee", "left_elbow", offset_m=3), 4, "1 needs the key `offset_deg`", ""),
        (table("waist", "left_elbow", mirror=True), 2, "`left_elbow` has 1 degree of", "without"),
        (table("left_elbow", "left_elbow"), 2, "left_elbow 1 follows itself", ""),
    ],
)  # fmt: skip
def test_what_does_not_fit_the_figure_is_told(tmp_path, text, line, said, hint):
    reading = reading_of(tmp_path, text)
    assert reading.value is None
    (fault,) = reading.diagnostics
    assert said in fault.message
    assert hint in fault.hint
    assert fault.span is not None
    assert fault.span.line == line


def test_turns_and_slides_are_not_linked(tmp_path):
    (fault,) = reading_of(tmp_path, table("hinge", "rail"), slides()).diagnostics
    assert fault.message == "hinge 1 rotates and rail 1 translates: a link needs two of one kind"
    (fault,) = reading_of(tmp_path, table("fixed", "rail"), slides()).diagnostics
    assert fault.message == "joint `fixed` does not move"


def test_a_second_link_is_told_with_the_place_of_the_first(tmp_path):
    text = table("left_knee", "left_elbow") + table("left_knee", "right_elbow")
    (fault,) = reading_of(tmp_path, text).diagnostics
    assert fault.message == "a second link of left_knee 1"
    assert fault.hint == "the first is in line 2"
    assert fault.span is not None
    assert fault.span.line == 5


def test_a_cycle_of_joints_is_told_once(tmp_path):
    text = table("waist", "left_shoulder") + table("left_shoulder", "waist")
    (fault,) = reading_of(tmp_path, text).diagnostics
    assert fault.message.startswith("the links form a cycle: ")
    assert "waist 1" in fault.message
    assert "left_shoulder 1" in fault.message
    assert fault.span is not None
    assert fault.span.line == 5


def test_all_faults_are_told_at_once(tmp_path):
    text = table("left_elbw", "waist") + table("left_knee", "wrist") + table("waist", "waist")
    assert len(reading_of(tmp_path, text).diagnostics) == 3


def test_another_figures_links_are_used_with_a_warning(tmp_path):
    reading = reading_of(tmp_path, 'figure = "robot"\n' + table("left_elbow", "right_elbow"))
    assert reading.value is not None
    (fault,) = reading.diagnostics
    assert fault.message == "this file is for the figure `robot`"


def test_factors_beyond_reason_are_refused(tmp_path):
    """One by one, and where they multiply along a chain."""
    text = table("left_knee", "left_elbow", factor=1e5)
    text += table("left_elbow", "right_elbow", factor=-1e5)
    (fault,) = reading_of(tmp_path, text).diagnostics
    assert fault.message == "left_knee 1 follows right_elbow 1 by the factor -1e+10"
    assert fault.span is not None
    for factor in (1e7, -1e300, 1e301):
        (fault,) = reading_of(tmp_path, table("waist", "left_hip_joint", factor=factor)).diagnostics
        assert fault.message.startswith("`factor` must be from -1e+06 to 1e+06, not ")
        assert fault.span is not None
