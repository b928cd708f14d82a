"""docs/contact.md, "Scene files": the example is read, the table has every key and its bounds."""

import re

import pytest

from generator.contact.box import Box
from generator.contact.plane import Plane
from generator.input_files.scene import SCENE_FILE, SCENE_TABLES
from springs.contact import DEFAULT_SURFACE
from tests.paths import DOCS

PAGE = (DOCS / "contact.md").read_text(encoding="utf-8")
SECTION = re.split(r"^## ", PAGE.partition("\n## Scene files\n")[2], flags=re.MULTILINE)[0]


def block(language: str) -> str:
    """The one example of a language."""
    (text,) = re.findall(rf"^```{language}\n(.*?)^```", SECTION, re.MULTILINE | re.DOTALL)
    return text


def test_the_file_is_read():
    reading = SCENE_FILE.parse_text(block("toml"))
    assert reading.diagnostics == ()
    assert reading.value is not None
    bed, wall = reading.value.props
    assert isinstance(bed.shape, Box)
    assert isinstance(wall.shape, Plane)
    assert bed.surface == wall.surface


def test_the_python_runs():
    exec(compile(block("python"), "contact.md", "exec"), {})


def test_the_table_has_every_key():
    cells = "".join(line for line in SECTION.splitlines() if line.startswith("|"))
    keys = {key for table in SCENE_TABLES.values() for key in table.keys}
    assert set(re.findall(r"`([a-z]+(?:_\w+)?)`", cells)) == keys


@pytest.mark.parametrize(
    ("key", "attribute"),
    [
        ("stiffness_N_m", "stiffness"),
        ("damping_s_m", "damping"),
        ("friction", "friction"),
        ("transition_m", "transition_depth"),
        ("friction_speed_m_s", "friction_speed"),
    ],
)
def test_the_defaults_and_bounds_of_the_table(key: str, attribute: str):
    (row,) = re.findall(rf"^\| \| `{key}` \| (.*) \|$", SECTION, re.MULTILINE)
    (default,) = re.findall(r"\[default: (\S+)\]", row)
    assert float(default) == getattr(DEFAULT_SURFACE, attribute)
    least, largest = re.search(r"from ([\d.e-]+)[^|]*? to ([\d.e]+)", row).groups()
    surface = '[[surface]]\nname = "a"\nsource = "b"\n{} = {}\n'
    plane = '[[plane]]\nname = "c"\nnormal = [0, 1, 0]\nsurface = "a"\n'
    for value, is_valid in (
        (float(least), True),
        (float(largest), True),
        (float(least) * 0.99 - 1e-9, False),
        (float(largest) * 1.01, False),
    ):
        reading = SCENE_FILE.parse_text(surface.format(key, repr(value)) + plane)
        assert (reading.value is not None) is is_valid


def test_the_shipped_scenes_are_named():
    assert all(f"`{name}`" in SECTION for name in SCENE_FILE.shipped())
