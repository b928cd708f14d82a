"""Psurf files: what they say, and that reading undoes writing."""

from fractions import Fraction
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from generator.geometry import PSURF_FILE, Surface, format_psurf, mass_properties, write_psurf
from generator.geometry.psurf import MAX_LINES
from tests.paths import FIGURES

WEDGE = """\
0 0 0      the corner
10 0 0
0 10 0     0.0 0.0 1.0
99 99 99   nobody uses it
0 0 10
;;
1 3 2;
1 2 5 ; red
2 3 5 wall;

3 1 5;
;; the end
"""


def parsed(text):
    reading = PSURF_FILE.parse_text(text)
    assert reading.diagnostics == ()
    return reading.value


def test_lengths_are_centimetres_and_vertices_count_from_one():
    surface = parsed(WEDGE)
    assert surface.vertices.tolist()[:2] == [[0.0, 0.0, 0.0], [0.1, 0.0, 0.0]]
    assert surface.faces == ((0, 2, 1), (0, 1, 4), (1, 2, 4), (2, 0, 4))
    assert mass_properties(surface, 6000.0).mass == pytest.approx(1.0, rel=1e-12)


def test_another_unit_can_be_said():
    surface = PSURF_FILE.parse_text(WEDGE, unit=Fraction(254, 10_000)).value
    assert surface is not None
    assert surface.vertices[1].tolist() == [0.254, 0.0, 0.0]


def test_faces_may_have_any_number_of_vertices():
    surface = parsed("0 0 0\n1 0 0\n2 1 0\n1 2 0\n0 2 0\n0 0 1\n;;\n5 4 3 2 1;\n1 2 6;\n;;\n")
    assert surface.corner_counts.tolist() == [5, 3]


def test_each_block_counts_its_own_vertices():
    block = "0 0 {0}\n1 0 {0}\n0 1 {0}\n;;\n1 2 3;\n3 2 1;\n;;\n"
    surface = parsed(block.format(0) + "\n" + block.format(5))
    assert surface.faces == ((0, 1, 2), (2, 1, 0), (3, 4, 5), (5, 4, 3))
    assert [surface.vertex_name(v) for v in (0, 2, 3, 5)] == ["1:1", "1:3", "2:1", "2:3"]


def test_faces_know_their_lines():
    surface = parsed(WEDGE)
    assert [surface.face_name(f) for f in range(4)] == [
        "1 (line 7)", "2 (line 8)", "3 (line 9)", "4 (line 11)",
    ]  # fmt: skip
    place = surface.face_span(1)
    assert place is not None
    assert place.text == "1 2 5 ;"


def test_reading_stops_after_a_hundred_errors():
    faults = PSURF_FILE.parse_text("0 0 0\n" * 3 + ";;\n" + "1 2 7;\n" * 150 + ";;\n").diagnostics
    assert len(faults) == 100
    assert "reading stopped here" in faults[-1].hint


@pytest.mark.parametrize("text", ["4.0", "+4.0", "-1.5", ".5", "2x", "4.0 outer"])
def test_the_text_of_a_face_does_not_begin_as_a_number(text):
    head = "0 0 0\n1 0 0\n0 1 0\n0 0 1\n;;\n"
    (fault,) = PSURF_FILE.parse_text(f"{head}1 3 2 {text};\n1 2 4;\n;;\n").diagnostics[:1]
    assert fault.span is not None
    assert (fault.span.line, fault.span.text) == (6, text.split()[0])
    assert "is not the number of a vertex" in fault.message


@pytest.mark.parametrize("text", ["outer 4.0", "(4)", "front-left"])
def test_other_text_of_a_face_says_nothing(text):
    assert parsed(f"0 0 0\n1 0 0\n0 1 0\n;;\n1 3 2 {text};\n;;\n").faces == ((0, 2, 1),)


def test_a_text_of_too_many_lines_is_refused():
    (fault,) = PSURF_FILE.parse_text("0 0 0\n" * MAX_LINES).diagnostics
    assert fault.message == "this psurf has 500,001 lines"
    assert "at most 500,000 are read" in fault.hint


@pytest.mark.parametrize("numbers", ["1e400 0 0", "1 2", "1 2 x", "0 0 1e", "1 2 3"])
def test_plain_vertices_are_read_as_others_are(numbers):
    """With a blank more than a word may be long, the same numbers are read one by one."""
    rest = "\n1 0 0\n0 1 0\n;;\n1 2 3;\n;;\n"
    plain, long = (
        PSURF_FILE.parse_text(numbers + rest),
        PSURF_FILE.parse_text(numbers + " " * 300 + rest),
    )
    assert [f.message for f in plain.diagnostics] == [f.message for f in long.diagnostics]
    assert (plain.value is None) == (long.value is None)
    if plain.value is not None and long.value is not None:
        assert (plain.value.vertices == long.value.vertices).all()


def test_a_word_without_end_is_no_number():
    for text in ("9" * 5000 + " 0 0\n", "0 0 0\n;;\n1 2 " + "9" * 5000 + ";\n"):
        assert any("9..." in fault.message for fault in PSURF_FILE.parse_text(text).diagnostics)


@pytest.mark.parametrize("name", sorted(path.name for path in FIGURES.glob("*.pss")))
def test_shipped_psurfs_come_back_as_they_are_written(name):
    surface = PSURF_FILE.read(FIGURES / name)
    again = parsed(format_psurf(surface))
    assert (again.vertices == surface.vertices).all()
    assert again.faces == surface.faces
    numbers = [float(word) for word in format_psurf(surface).split(";;")[0].split()]
    written = [float(w) for w in (FIGURES / name).read_text().split(";;")[0].split()]
    assert numbers == written


coordinates = st.floats(allow_nan=False, allow_infinity=False, max_value=1e300, min_value=-1e300)


@st.composite
def surfaces(draw):
    points = draw(st.lists(st.tuples(*[coordinates] * 3), min_size=3, max_size=12))
    corners = st.lists(
        st.integers(0, len(points) - 1), min_size=3, max_size=len(points), unique=True
    )
    return Surface.from_faces(points, draw(st.lists(corners, min_size=1, max_size=8)))


@given(surfaces(), st.sampled_from([Fraction(1, 100), Fraction(1), Fraction(254, 10_000)]))
def test_reading_undoes_writing(surface, unit):
    again = PSURF_FILE.parse_text(format_psurf(surface, unit), unit=unit).value
    assert again is not None
    assert (again.vertices == surface.vertices).all()
    assert again.faces == surface.faces


def test_files_are_read_and_written(tmp_path):
    surface = parsed(WEDGE)
    path = tmp_path / "wedge.pss"
    write_psurf(surface, path)
    assert PSURF_FILE.read(path).faces == surface.faces
    assert PSURF_FILE.read(str(path)).name == str(path)
    with pytest.raises(OSError, match="directory"):
        write_psurf(surface, tmp_path / "nowhere" / "wedge.pss")


# Surfaces


def test_fans_make_up_the_faces():
    surface = Surface.from_faces(np.zeros((6, 3)), [(0, 1, 2), (0, 2, 3, 4, 5)])
    triangles, owners = surface.fan_triangles
    assert triangles.T.tolist() == [[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 5]]
    assert owners.tolist() == [0, 1, 1, 1]


@given(surfaces(), st.integers(0, 255))
def test_turning_faces_turns_these_faces(surface, bits):
    mask = np.array([bool(bits >> k & 1) for k in range(surface.face_count)])
    turned = surface.with_flipped_faces(mask)
    expected = [f[::-1] if m else f for f, m in zip(surface.faces, mask, strict=True)]
    assert list(turned.faces) == expected
    assert turned.with_flipped_faces(mask).faces == surface.faces


@given(surfaces())
def test_each_corner_is_followed_by_the_next_of_its_face(surface):
    pairs = zip(surface.corners.tolist(), surface.next_corners.tolist(), strict=True)
    assert list(pairs) == [pair for f in surface.faces for pair in pairwise([*f, f[0]])]


@pytest.mark.parametrize(
    ("vertices", "faces", "said"),
    [
        (np.zeros((3, 3)), [(0, 1)], "three corners"),
        (np.zeros((3, 3)), [(0, 1, 3)], "none of the 3 vertices"),
        (np.zeros((3, 3)), [(0, 1, -1)], "none of the 3 vertices"),
        (np.full((3, 3), np.nan), [(0, 1, 2)], "finite"),
        (np.zeros((3, 2)), [(0, 1, 2)], "shape"),
    ],
)
def test_what_is_no_surface_is_refused(vertices, faces, said):
    with pytest.raises(ValueError, match=said):
        Surface.from_faces(vertices, faces)
