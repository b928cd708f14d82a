import math
from dataclasses import replace

import numpy as np
import pytest

from generator.diagnostics import ModelError, Source, Span
from generator.figure import (
    AxisKind,
    Figure,
    Joint,
    JointAxis,
    Location,
    Rotation,
    Segment,
    Site,
    SiteRef,
    Translation,
)
from generator.figure_file import read_figure

Z = JointAxis(AxisKind.ROTATION, (0.0, 0.0, 1.0))


def _turn(*degrees):
    return Rotation(tuple(math.radians(angle) for angle in degrees))


def _segment(name, mass=1.0, **more):
    return Segment(name, mass=mass, sites={"o": Site("o")}, **more)


def _joint(name, parent, child, *chain):
    return Joint(name, SiteRef(parent, "o"), SiteRef(child, "o"), chain, (0.0,) * len(chain))


def _figure(segments, joints, root="floor"):
    return Figure(
        {segment.name: segment for segment in segments},
        {joint.name: joint for joint in joints},
        SiteRef(root, "o"),
    )


def test_xyz_gives_the_triad_of_figure_3_2():
    triad = [[0, 0, -1], [0, 1, 0], [1, 0, 0]]
    assert _turn(-45, -90, -45).matrix[:3, :3] == pytest.approx(np.array(triad), abs=1e-15)


def test_a_turn_before_a_shift_leaves_the_shift_in_the_segment_frame():
    pose = Location((_turn(-180, 0, 0), Translation((0.0, -0.0612, 0.0)))).pose_in_segment
    assert pose[:3, 3] == pytest.approx([0.0, -0.0612, 0.0], abs=1e-17)
    assert pose[:3, :3] == pytest.approx(np.diag([1.0, -1.0, -1.0]), abs=1e-15)


def test_a_shift_before_a_turn_is_turned():
    pose = Location((Translation((1.0, 0.0, 0.0)), _turn(0, 0, 90))).pose_in_segment
    assert pose[:3, 3] == pytest.approx([0.0, 1.0, 0.0], abs=1e-15)


def test_a_site_without_a_location_is_the_segment_frame():
    assert Site("o").pose_in_segment == pytest.approx(np.eye(4), abs=0.0)


def test_the_ground_is_what_rigid_joints_hold_to_the_root():
    segments = [
        _segment("floor", None),
        _segment("wall", -1.0),
        _segment("shelf", -1.0),
        _segment("box", 2.0),
        _segment("door", 3.0),
    ]
    joints = [
        _joint("shelf_on_wall", "shelf", "wall"),
        _joint("wall_on_floor", "floor", "wall"),
        _joint("box_on_shelf", "shelf", "box"),
        _joint("hinge", "wall", "door", Z),
    ]
    figure = _figure(segments, joints)
    assert figure.ground == {"floor", "wall", "shelf"}
    assert list(figure.bodies) == ["box", "door"]
    assert figure.total_mass == 5.0
    assert figure.degrees_of_freedom == 1


def test_the_centre_of_mass_is_the_site_of_that_name():
    centre = Site("CM", Location((Translation((0.1, 0.2, 0.3)),)))
    assert Segment("a", sites={"CM": centre}).centre_of_mass == pytest.approx([0.1, 0.2, 0.3])
    assert Segment("a").centre_of_mass is None


def test_a_negative_mass_means_ground():
    assert Segment("a", mass=-1.0).has_ground_mass
    assert not Segment("a", mass=0.0).has_ground_mass
    assert not Segment("a").has_ground_mass


def test_figures_are_compared_without_their_places():
    span = Span(Source("text", "floor"), 0, 5)
    assert _segment("floor", origins={"name": span}) == _segment("floor")
    assert _segment("floor") != _segment("floor", 2.0)


def test_a_site_is_found_by_its_reference():
    figure = _figure([_segment("floor")], [])
    assert figure.site(SiteRef("floor", "o")).name == "o"
    assert str(SiteRef("floor", "o")) == "floor.o"
    with pytest.raises(KeyError):
        figure.site(SiteRef("floor", "p"))


def test_each_value_checks_its_own_numbers():
    with pytest.raises(ModelError, match="the zero vector is not a joint axis"):
        JointAxis(AxisKind.ROTATION, (0.0, 0.0, 0.0))
    with pytest.raises(ModelError, match="`stiff` has 2 values, but the joint has 1 degree of"):
        replace(_joint("hinge", "a", "b", Z), stiff=(1.0, 2.0))
    with pytest.raises(ModelError, match="`rest` must be finite"):
        replace(_joint("hinge", "a", "b", Z), rest=(math.nan,))
    with pytest.raises(ModelError, match="segment `a`: `inertia` needs three finite numbers"):
        _segment("a", inertia=(1.0, 1.0))
    with pytest.raises(ModelError, match="site `o`: `local_force` needs three finite numbers"):
        Site("o", local_force=(0.0, math.inf, 0.0))
    with pytest.raises(ModelError, match="a translation: `offset` needs three finite numbers"):
        Location.at(math.nan, 0.0, 0.0)


def test_numbers_of_any_kind_become_floats():
    assert JointAxis("R", (0, 0, 2)) == Z
    hinge = Joint("hinge", SiteRef("a", "o"), SiteRef("b", "o"), (Z,), stiff=np.array([3]))
    assert hinge.displacement == (0.0,)
    assert hinge.stiff == (3.0,)
    assert type(hinge.stiff[0]) is float
    assert _segment("a", np.float64(2.0)).mass == 2.0
    assert Location.at(0, -1, 0) == Location((Translation((0.0, -1.0, 0.0)),))


def test_an_absent_limit_may_be_infinite_on_its_side_only():
    hinge = _joint("hinge", "a", "b", Z)
    assert replace(hinge, upper_limit=(math.inf,)).upper_limit == (math.inf,)
    with pytest.raises(ModelError, match="`lower_limit` must be finite"):
        replace(hinge, lower_limit=(math.inf,))


def test_parts_are_replaced_or_added():
    figure = _figure([_segment("floor"), _segment("arm")], [_joint("hinge", "floor", "arm", Z)])
    changed = figure.with_parts(
        _segment("arm", 3.0), _segment("hand"), _joint("wrist", "arm", "hand")
    )
    assert list(changed.segments) == ["floor", "arm", "hand"]
    assert changed.segments["arm"].mass == 3.0
    assert list(changed.joints) == ["hinge", "wrist"]
    assert figure.segments["arm"].mass == 1.0


def test_a_figure_is_shown_in_a_line_and_as_tables():
    figure = read_figure("prototype")
    line = "Figure prototype: 11 segments, 10 joints, 22 degrees of freedom, 49.28 kg"
    assert repr(figure) == f"<{line}>"
    page = figure._repr_html_()
    assert page.startswith(f"<p>{line}</p><div")
    assert "<td>left_knee</td><td>left_upper_leg.distal</td>" in page
    assert page.count("<tr>") == 2 + 11 + 10
    assert "<td>&lt;b&gt;</td>" in _figure([_segment("<b>")], [], "<b>")._repr_html_()
