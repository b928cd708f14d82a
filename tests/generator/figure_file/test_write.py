"""Writing is the inverse of reading, to the last bit."""

import math
import string
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from generator.diagnostics import InputError
from generator.figure import (
    Attribute,
    AxisKind,
    ContactSphere,
    Figure,
    Follower,
    Joint,
    JointAxis,
    Location,
    Rotation,
    Segment,
    Site,
    SiteRef,
    Translation,
)
from generator.figure_file import FIGURE_FILE, read_figure
from generator.figure_file.write import write_figure
from generator.follower_curve import CurveKind, FollowerCurve

_LETTERS = string.ascii_letters + "_"
NAMES = st.builds(
    str.__add__,
    st.sampled_from(_LETTERS),
    st.text(alphabet=_LETTERS + string.digits, max_size=12),
) | st.sampled_from(["site", "joint", "to", "connect", "root", "R", "xyz", "e5", "mass", "cm"])
FLOATS = st.floats(allow_nan=False, allow_infinity=False) | st.integers(-2000, 2000).map(
    lambda hundredths: hundredths / 100
)
POSITIVE = st.floats(min_value=1e-300, max_value=1e300)
STRINGS = st.text(max_size=60).map(lambda text: text.translate({34: "", 10: "", 13: ""}))
VECTORS = st.tuples(FLOATS, FLOATS, FLOATS)


def _unit(vector):
    length = math.hypot(*vector)
    return tuple(component / length for component in vector)


SMALL = st.floats(-1.0, 1.0)
AXES = st.sampled_from(
    [tuple(sign * float(i == k) for i in range(3)) for k in range(3) for sign in (1, -1)]
) | st.tuples(SMALL, SMALL, SMALL).filter(lambda v: math.hypot(*v) > 1e-3).map(_unit)
LOCATIONS = st.builds(
    Location,
    st.lists(st.builds(Rotation, VECTORS) | st.builds(Translation, VECTORS), max_size=3).map(tuple),
)
SPHERES = st.builds(ContactSphere, VECTORS, POSITIVE)
FACTORS = st.builds(JointAxis, st.sampled_from("RT"), AXES)


@st.composite
def sites(draw):
    names = draw(st.lists(NAMES | st.just("CM"), min_size=1, max_size=3, unique=True))
    loads = st.none() | VECTORS
    return {
        name: Site(name, draw(LOCATIONS), draw(loads), draw(loads), draw(loads), draw(loads))
        for name in names
    }


@st.composite
def segments(draw, name, attributes, ground):
    inertia = draw(st.none() | POSITIVE)
    return Segment(
        name=name,
        mass=-draw(POSITIVE) if ground else draw(st.none() | POSITIVE),
        inertia=inertia and (inertia, inertia, inertia),
        psurf=draw(st.none() | STRINGS),
        attributes=tuple(draw(st.lists(st.sampled_from(attributes), max_size=3)))
        if attributes
        else (),
        sites=draw(sites()),
        contact_spheres=tuple(draw(st.lists(SPHERES, max_size=3))),
    )


@st.composite
def joints(draw, name, parent, child):
    chain = tuple(draw(st.lists(FACTORS, max_size=4)))
    rows = st.tuples(*[FLOATS] * len(chain))
    low, high = draw(st.none() | rows), draw(st.none() | rows)
    if low and high:
        pairs = [sorted(pair) for pair in zip(low, high, strict=True)]
        low, high = tuple(pair[0] for pair in pairs), tuple(pair[1] for pair in pairs)
    ends = [
        SiteRef(segment.name, draw(st.sampled_from(list(segment.sites))))
        for segment in draw(st.permutations([parent, child]))
    ]
    return Joint(
        name=name,
        parent=ends[0],
        child=ends[1],
        chain=chain,
        displacement=draw(rows),
        stiff=draw(st.none() | rows),
        rest=draw(st.none() | rows),
        damp=draw(st.none() | rows),
        lower_limit=low,
        upper_limit=high,
    )


@st.composite
def curves(draw):
    if draw(st.booleans()):
        powers = draw(st.lists(FLOATS, min_size=1, max_size=4))
        return FollowerCurve(CurveKind.POLYNOMIAL, tuple(powers))
    count = draw(st.integers(2, 6))
    steps, values = (
        st.lists(st.floats(low, 9.0), min_size=count, max_size=count) for low in (1e-3, -9.0)
    )
    points = np.stack([np.cumsum(draw(steps)) - 4.0, draw(values)], axis=1)
    return FollowerCurve(CurveKind.SIMM_SPLINE, tuple(points.ravel()))


@st.composite
def with_followers(draw, joint, controls):
    """A joint whose displacements but the first may follow the first ones of joints."""
    followed = st.builds(Follower, st.sampled_from(controls or [""]), st.just(0), curves())
    others = [draw(st.none() | followed) for _ in joint.chain[1:]]
    return replace(joint, followers=(None, *others) if joint.chain else ())


@st.composite
def figures(draw):
    values = st.lists(FLOATS, max_size=3).map(tuple) | STRINGS
    attributes = {
        name: Attribute(name, draw(st.dictionaries(NAMES, values, max_size=3)))
        for name in draw(st.lists(NAMES, max_size=3, unique=True))
    }
    names = draw(st.lists(NAMES, min_size=1, max_size=4, unique=True))
    parts = [
        draw(segments(name, list(attributes), ground=index == 0))
        for index, name in enumerate(names)
    ]
    links = []
    for index, name in enumerate(draw(st.permutations([f"j_{name}" for name in names[1:]]))):
        parent = parts[draw(st.integers(0, index))]
        links.append(draw(joints(name, parent, parts[index + 1])))
    controls = [link.name for link in links if link.chain]
    links = [draw(with_followers(link, controls)) for link in links]
    root = SiteRef(names[0], draw(st.sampled_from(list(parts[0].sites))))
    return Figure(
        {part.name: part for part in parts},
        {link.name: link for link in links},
        root,
        attributes,
        draw(st.none() | NAMES),
    )


def _order(figure):
    return [
        list(figure.attributes),
        list(figure.joints),
        [(name, list(segment.sites)) for name, segment in figure.segments.items()],
        [list(attribute.fields) for attribute in figure.attributes.values()],
    ]


@pytest.mark.slow
@given(figure=figures())
def test_any_figure_reads_back_equal_and_in_order(figure):
    text = write_figure(figure)
    reading = FIGURE_FILE.parse_text(text)
    assert reading.value == figure, "\n".join(map(str, reading.diagnostics))
    assert _order(reading.value) == _order(figure)
    assert write_figure(reading.value) == text


@pytest.mark.parametrize("name", ["prototype", "clavicles", "pendulum", "fourbar"])
def test_a_shipped_figure_reads_back_equal(name):
    figure = read_figure(name)
    assert FIGURE_FILE.parse_text(write_figure(figure)).value == figure


def test_the_layout():
    arm = Segment(
        "arm",
        mass=0.025,
        inertia=(5e-6, 5e-6, 5e-6),
        psurf="arm.pss",
        attributes=("red",),
        contact_spheres=(ContactSphere((0.0, -0.01, 0.0), 0.03), ContactSphere((0.1, 0, 0), 0.02)),
        sites={
            "near": Site(
                "near", Location((Rotation((math.pi / 2, 0.0, 0.0)), Translation((0.0, 0.01, 0.0))))
            ),
            "CM": Site(
                "CM", Location((Translation((0.05, 0.0, 0.0)),)), global_force=(1.0, 0.0, 0.0)
            ),
        },
    )
    floor = Segment("floor", mass=-0.001, sites={"top": Site("top")})
    elbow = Joint(
        "elbow",
        SiteRef("floor", "top"),
        SiteRef("arm", "near"),
        (JointAxis(AxisKind.ROTATION, (0.0, 0.0, 1.0)),),
        (math.pi / 6,),
        stiff=(1000.0,),
    )
    red = Attribute("red", {"rgb": (1.0, 0.37, 0.0), "shade": "flat"})
    figure = Figure(
        {"floor": floor, "arm": arm},
        {"elbow": elbow},
        SiteRef("floor", "top"),
        {"red": red},
        "one_arm",
    )
    assert write_figure(figure).splitlines() == [
        "figure one_arm {",
        "  attribute red {",
        "    rgb = (1,0.37,0);",
        '    shade = "flat";',
        "  }",
        "  segment floor {",
        "    mass = -1g;",
        "    site top {",
        "    }",
        "  }",
        "  segment arm {",
        '    psurf = "arm.pss";',
        "    attribute = red;",
        "    mass = 25g;",
        "    inertia = (50,50,50);",
        "    contact = (sphere(0cm,-1cm,0cm,3cm),sphere(10cm,0cm,0cm,2cm));",
        "    site near->location = xyz(90deg,0deg,0deg) * trans(0cm,1cm,0cm);",
        "    site CM {",
        "      location = trans(5cm,0cm,0cm);",
        "      globalforce = (1N,0,0);",
        "    }",
        "  }",
        "  joint elbow {",
        "    connect floor.top to arm.near;",
        "    type = R(0,0,1);",
        f"    displacement = ({math.pi / 6!r}rad);",
        "    stiff = (1000 N m/rad);",
        "  }",
        "  root = floor.top;",
        "}",
    ]


BARE = Segment("floor", mass=-1.0, sites={"top": Site("top")})
FIGURE = Figure({"floor": BARE}, {}, SiteRef("floor", "top"))


@pytest.mark.parametrize("name", ["", "2nd", "épaule", "left arm", "a-b", "a" * 201])
def test_names_that_the_language_has_not_are_refused(name):
    with pytest.raises(ValueError, match="no such name"):
        write_figure(replace(FIGURE, name=name))


@pytest.mark.parametrize("text", ['say "a"', "two\nlines", "two\rlines", "a" * 199])
def test_strings_that_the_language_has_not_are_refused(text):
    figure = replace(FIGURE, segments={"floor": replace(BARE, psurf=text)})
    with pytest.raises(ValueError, match="no such string"):
        write_figure(figure)


@pytest.mark.parametrize("mass", [math.nan, math.inf])
def test_numbers_that_are_not_finite_are_refused(mass):
    with pytest.raises(ValueError, match="segment `floor`: the mass must be finite"):
        replace(BARE, mass=mass)


def test_a_figure_that_would_not_be_read_is_not_written():
    with pytest.raises(InputError, match="the root: segment `floor` has no site `tap`"):
        write_figure(replace(FIGURE, root=SiteRef("floor", "tap")))
