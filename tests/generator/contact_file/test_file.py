"""Contact files: read as written, and errors that name the line."""

from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from generator.contact_file.file import CONTACT_FILE, write_contact
from generator.contact_file.parts import BodyContact, BodyPart, Evidence
from generator.diagnostics import InputError
from generator.figure_file.read import read_figure
from generator.model import contact_of_figure
from springs.contact_part import PartLaw

WORDS = st.text("abc_ é", min_size=1, max_size=9).map(str.strip).filter(bool)


@st.composite
def contacts(draw: st.DrawFn) -> BodyContact:
    """Any parts that a file can hold."""
    parts: list[BodyPart] = []
    spheres = iter(draw(st.lists(st.tuples(WORDS, st.integers(0, 99)), min_size=4, unique=True)))
    for name in draw(st.lists(WORDS, min_size=1, max_size=3, unique=True)):
        depths = draw(st.lists(st.floats(1e-4, 0.5), max_size=3, unique=True).map(sorted))
        stages = [(x, draw(st.floats(1.0, 1e9))) for x in (0.0, *depths)]
        scale = draw(st.floats(0.0, 1.0, exclude_min=True))
        law = PartLaw(tuple(stages), draw(st.floats(0.0, 1e3)), draw(WORDS), norm_scale=scale)
        low = draw(st.floats(0.1, 1.0))
        band = (low, draw(st.floats(1.0, 9.0)))
        evidence = draw(st.sampled_from(Evidence))
        parts.append(BodyPart(name, law, (next(spheres),), band, evidence))
    if draw(st.booleans()):
        outer = parts[0]
        parts.append(replace(outer, name=outer.name + "+", within=outer.name))
    return BodyContact(tuple(parts))


@given(contacts())
def test_what_is_written_is_read_back(contact: BodyContact) -> None:
    reading = CONTACT_FILE.parse_text(write_contact(contact, "two\nlines"))
    assert reading.require_value().parts == contact.parts
    sources = [part.law.source for part in contact.parts]
    assert [part.law.source for part in reading.require_value().parts] == sources


PART = """[[part]]
name = "pelvis"
spheres = ["lower_torso 0"]
from_m = [0, 0.03]
stiffness_N_m = [30e3, 71e3]
damping_s_m = 1
class = "scaled"
source = "assumed"
"""


@pytest.mark.parametrize(
    ("old", "new", "line", "message"),
    [
        ("[[part]]", "[[parts]]", 1, "unknown key `parts`"),
        ('"lower_torso 0"', '"lower_torso"', 3, "`lower_torso` does not name a sphere"),
        ('"lower_torso 0"', '"lower_torso -1"', 3, "does not name a sphere"),
        ("[0, 0.03]", "[0.01, 0.03]", 4, "begin at 0"),
        ("[0, 0.03]", "[0]", 4, "2 numbers"),
        ("71e3]", "-71e3]", 5, "above zero"),
        ('"scaled"', '"guess"', 7, "`class` cannot be `guess`"),
        ('source = "assumed"\n', "", 1, "`source`"),
        (PART, PART + PART, 1, "two parts of the body are called `pelvis`"),
        (PART, "", 1, "this file states no part"),
    ],
)
def test_errors_name_the_line(old: str, new: str, line: int, message: str) -> None:
    errors = CONTACT_FILE.parse_text(PART.replace(old, new)).diagnostics
    assert any(message in str(one) and one.span and one.span.line == line for one in errors), errors


def test_the_parts_of_a_figure_stand_beside_it(tmp_path: Path) -> None:
    figure = read_figure("pendulum")
    assert contact_of_figure(figure) is None
    assert figure.path is not None
    copied = tmp_path / "swing.fig"
    copied.write_bytes(figure.path.read_bytes())
    assert contact_of_figure(read_figure(copied)) is None
    beside = tmp_path / "swing.contact.toml"
    beside.write_text(PART)
    contact = contact_of_figure(read_figure(copied))
    assert contact is not None
    assert contact.laws == {"pelvis": PartLaw(((0.0, 30e3), (0.03, 71e3)), 1.0)}
    beside.write_text("")
    with pytest.raises(InputError, match=r"swing.contact.toml"):
        contact_of_figure(read_figure(copied))
