"""Scenes: values of the keys, defaults, exact round trip, shipped scenes by name."""

from math import inf, nan

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from generator.contact.box import Box
from generator.contact.plane import Plane
from generator.contact.scene import Cover, Prop, Scene
from generator.diagnostics import Severity, Source
from generator.input_files.scene import SCENE_FILE, write_scene
from springs.contact import DEFAULT_SURFACE, Surface
from springs.layer import Layer

TEXT = """
[[surface]]
name = "mattress"
stiffness_N_m = 5000
damping_s_m = 0.5
friction = 0.7
transition_m = 0.01
friction_speed_m_s = 0.05
source = "assumed: soft"

[[box]]
name = "bed"
centre_m = [0, 0.25, 1e-3]
size_m = [2.0, 0.5, 0.9]
angles_deg = [0, 90, 0]
surface = "mattress"

[[plane]]
name = "wall"
point_m = [0, 0, -1]
normal = [0, 0, 2]
surface = "default"

[[box]]
name = "step"
centre_m = [1, 2, 3]
size_m = [1, 1, 1]
surface = "slippery"

[[surface]]
name = "default"

[[surface]]
name = "slippery"
friction = 0.1
source = "assumed"
"""
MATTRESS = Surface(5e3, 0.5, 0.7, 0.01, 0.05)


def test_values_defaults_and_order():
    reading = SCENE_FILE.parse_text(TEXT)
    assert reading.diagnostics == ()
    assert reading.value == Scene(
        (
            Prop("bed", Box((0.0, 0.25, 1e-3), (2.0, 0.5, 0.9), (0.0, np.pi / 2, 0.0)), MATTRESS),
            Prop("wall", Plane((0.0, 0.0, -1.0), (0.0, 0.0, 2.0)), Surface()),
            Prop("step", Box((1.0, 2.0, 3.0), (1.0, 1.0, 1.0)), Surface(friction=0.1)),
        )
    )
    sources = [prop.surface.source for prop in reading.value.props]
    assert sources == ["assumed: soft", DEFAULT_SURFACE.source, "assumed"]


def test_a_plane_is_at_the_origin_by_default():
    text = '[[surface]]\nname = "a"\n[[plane]]\nname = "b"\nnormal = [1, 1, 0]\nsurface = "a"\n'
    assert SCENE_FILE.parse_text(text).require_value().props[0].shape == Plane((0, 0, 0), (1, 1, 0))


def test_surfaces_that_differ_in_their_source_alone_are_two():
    box = Box((0, 0, 0), (1, 1, 1))
    one, other = Surface(source="measured"), Surface(source="assumed")
    props = (Prop("a", box, one), Prop("b", box, other), Prop("c", box, one))
    text = write_scene(Scene(props))
    assert text.count("[[surface]]") == 2
    read = SCENE_FILE.parse_text(text).require_value()
    assert [prop.surface.source for prop in read.props] == ["measured", "assumed", "measured"]


@pytest.mark.parametrize(
    ("prop", "reason"),
    [
        (Prop("a", Box((0, 2e3, 0), (1, 1, 1)), Surface()), "coordinate is too large"),
        (Prop("a", Box((0, 0, 0), (1, 2e3, 1)), Surface()), "length is too large"),
        (Prop("a", Box((0, 0, nan), (1, 1, 1)), Surface()), "finite numbers, not nan"),
        (Prop("a", Plane((0, inf, 0), (1, 1, 1)), Surface()), "finite numbers, not inf"),
        (Prop("a", Box((0, 0, 0), (1, 1, 1)), Surface(2e9)), "`stiffness_N_m` must be from 1 to"),
        (Prop("", Box((0, 0, 0), (1, 1, 1)), Surface()), "not a name of a surface"),
        (Prop("a", Box((0, 0, 0), (1, 1, 1)), Surface(source="x" * 1000)), "too long"),
    ],
)
def test_what_no_file_holds_is_not_written(prop: Prop, reason: str):
    with pytest.raises(ValueError, match=reason):
        write_scene(Scene((prop,)))


def test_a_scene_without_props_is_not_written():
    with pytest.raises(ValueError, match="this file has no prop"):
        write_scene(Scene())


@given(
    st.text()
    | st.text("[]=\"'{}#\n boxplanesurface name size_m normal 1-.e", max_size=300)
    | st.lists(st.sampled_from(TEXT.splitlines(keepends=True)), max_size=40).map("".join)
)
def test_no_text_breaks_the_reader(text: str):
    reading = SCENE_FILE.parse_text(text)
    errors = [one for one in reading.diagnostics if one.severity is Severity.ERROR]
    assert (reading.value is None) is bool(errors)


# Shipped scenes


@pytest.mark.parametrize("name", SCENE_FILE.shipped())
def test_a_shipped_scene_is_valid_and_has_sources(name: str):
    reading = SCENE_FILE.parse_file(name)
    assert reading.diagnostics == ()
    assert all(prop.surface.source for prop in reading.value.props)
    assert all(cover.layer.source for cover in reading.value.covers)


LAYERS = """
[[surface]]
name = "mat"
{surface}
source = "assumed"
[[plane]]
name = "floor"
normal = [0, 1, 0]
surface = "mat"
[[cover]]
part = "head"
{cover}
source = "assumed"
"""
FIRM = "stiffness_N_m = 2e4"


@pytest.mark.parametrize(
    ("lines", "layer"),
    [
        ("own_stiffness_N_m = 59e3", Layer(((0.0, 59e3),))),
        ("own_stiffness_N_m = 59e3\nthickness_m = 0.04", Layer(((0.0, 59e3),), 0.04)),
        ("from_m = [0]\nown_stiffness_N_m = [59e3]", Layer(((0.0, 59e3),))),
        (
            "from_m = [0, 0.08]\nown_stiffness_N_m = [59e3, 1e6]\nthickness_m = 0.1",
            Layer(((0.0, 59e3), (0.08, 1e6)), 0.1),
        ),
        ("friction = 0.2", None),
    ],
)
def test_layers_of_surfaces_and_covers(lines, layer):
    reading = SCENE_FILE.parse(
        Source("my.scene.toml", LAYERS.format(surface=lines, cover="stiffness_N_m = 2e4"))
    )
    assert reading.diagnostics == ()
    scene = reading.require_value()
    assert scene.props[0].surface.layer == layer
    assert scene.covers == (Cover("head", Layer(((0.0, 2e4),))),)
    assert scene.covers[0].origin == f"my.scene.toml:{10 + len(lines.splitlines())}"
    assert SCENE_FILE.parse_text(write_scene(scene)).require_value() == scene


@pytest.mark.parametrize(
    ("surface", "cover", "message"),
    [
        ("thickness_m = 0.1", FIRM, "`thickness_m` needs `own_stiffness_N_m`"),
        ("from_m = [0, 0.1]", FIRM, "`from_m` needs `own_stiffness_N_m`"),
        ("own_stiffness_N_m = 1e4\nfrom_m = [0]", FIRM, "`from_m` needs a list"),
        ("own_stiffness_N_m = [1e4, 2e4]", FIRM, "begin nowhere"),
        ("own_stiffness_N_m = [1e4]\nfrom_m = [0, 1]", FIRM, "has 2 instead of 1 number"),
        ("own_stiffness_N_m = [1e4, 2e4]\nfrom_m = [0.1, 0.2]", FIRM, "begin at 0"),
        ("own_stiffness_N_m = [1e4, -1]\nfrom_m = [0, 0.2]", FIRM, "must be above zero"),
        ("own_stiffness_N_m = 0.5", FIRM, "must be from 1 to 1e+09 N/m"),
        ("own_stiffness_N_m = 1e4\nthickness_m = 0", FIRM, "must be from 1e-06 to 1 m"),
        (
            "own_stiffness_N_m = [1e4, 2e4]\nfrom_m = [0, 0.2]\nthickness_m = 0.1",
            FIRM,
            "thickness must be above the beginning of the last stage",
        ),
        ("friction = 1", "thickness_m = 0.1", "this cover has no `stiffness_N_m`"),
        ("friction = 1", f"{FIRM}\nfriction = 1", "unknown key `friction` in a cover"),
    ],
)
def test_wrong_layers_are_refused_with_their_place(surface, cover, message):
    reading = SCENE_FILE.parse_text(LAYERS.format(surface=surface, cover=cover))
    assert reading.value is None
    found = [one for one in reading.diagnostics if message in one.message]
    assert found, [one.message for one in reading.diagnostics]
    assert found[0].span is not None


def test_two_covers_of_one_part_are_refused():
    text = LAYERS.format(surface="friction = 1", cover=FIRM)
    again = text + f'[[cover]]\npart = "head"\n{FIRM}\nsource = "assumed"\n'
    (fault,) = SCENE_FILE.parse_text(again).diagnostics
    assert "a second cover is over the part `head`" in fault.message
