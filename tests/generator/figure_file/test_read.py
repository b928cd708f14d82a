"""The figure language by example, and the ways in which its files can be strange."""

import math
import os
from unittest.mock import Mock

import pytest
from hypothesis import given
from hypothesis import strategies as st

from generator.diagnostics import Diagnostics, Source, TooManyErrors, select_errors
from generator.figure import AxisKind, JointAxis, Rotation, SiteRef, Translation
from generator.figure_file import FIGURE_FILE, lexer, read_figure
from generator.figure_file.lexer import TokenKind, tokenize
from tests.work import counted_calls

FIGURE = """figure {{
  segment floor {{
    mass = -1g;
    site top->location = trans(0cm,10cm,0cm);
  }}
  segment arm {{
    mass = 25g;
    inertia = (50,50,50);
    site near->location = trans(0cm,0cm,0cm);
    site CM->location = trans(5cm,0cm,0cm);
    {segment}
  }}
  joint elbow {{
    connect floor.top to arm.near;
    {joint}
  }}
  root = floor.top;
  {figure}
}}
"""


def _text(segment="", joint="", figure=""):
    return FIGURE.format(segment=segment, joint=joint, figure=figure)


def _read(**parts):
    reading = FIGURE_FILE.parse_text(_text(**parts))
    assert reading.diagnostics == ()
    return reading.value


def test_the_pendulum_of_figure_3_4():
    figure = read_figure("pendulum")
    link, shoulder = figure.segments["link1"], figure.joints["shoulder"]
    assert figure.root == SiteRef("floor", "prox")
    assert figure.ground == {"floor"}
    assert link.mass == 0.025
    assert link.inertia == (5e-6, 5e-6, 5e-6)
    assert link.sites["CM"].global_force == (1e-3, 0.0, 0.0)
    assert list(link.sites) == ["prox", "dist", "CM"]
    assert figure.segments["floor"].sites["dist"].location.factors == (
        Rotation((-math.pi / 4, -math.pi / 2, -math.pi / 4)),
        Translation((0.0, 1.2, 0.0)),
    )
    assert [factor.axis for factor in shoulder.chain] == [(1, 0, 0), (0, 1, 0), (0, 0, 1)]
    assert shoulder.displacement == (0.0, math.radians(40), math.radians(20))
    assert [round(angle, 6) for angle in reversed(shoulder.displacement)] == [0.349066, 0.698132, 0]
    assert shoulder.stiff == (1e-5, 1e-4, 1e-4)
    assert shoulder.rest == (0.0, 0.0, 0.0)
    assert shoulder.damp is None


def test_the_shipped_figures_have_no_errors():
    assert {"clavicles", "fourbar", "pendulum", "prototype"} <= set(FIGURE_FILE.shipped())
    for name in FIGURE_FILE.shipped():
        assert select_errors(FIGURE_FILE.parse_file(name).diagnostics) == (), name


def test_a_joint_without_a_type_is_rigid():
    joint = _read().joints["elbow"]
    assert (joint.chain, joint.displacement, joint.degrees_of_freedom) == ((), (), 0)


def test_all_fields_of_a_joint():
    joint = _read(
        joint="""type = R(0,1,0)*T(0,0,-1);
        displacement = (30deg, 2cm);
        stiff = (2 N m/rad, 3 N/m);
        rest = (-10deg, 1in);
        damp = (1 N m s/rad, 1 N s/m);
        llimit = (-90deg, 0);
        ulimit = (1rad, 1ft);"""
    ).joints["elbow"]
    assert joint.chain == (
        JointAxis(AxisKind.ROTATION, (0.0, 1.0, 0.0)),
        JointAxis(AxisKind.TRANSLATION, (0.0, 0.0, -1.0)),
    )
    assert joint.displacement == pytest.approx((math.radians(30), 0.02), rel=1e-15)
    assert joint.stiff == (2.0, 3.0)
    assert joint.rest == (math.radians(-10), 0.0254)
    assert joint.damp == (1.0, 1.0)
    assert joint.lower_limit == (-math.pi / 2, 0.0)
    assert joint.upper_limit == (1.0, 0.3048)


def test_bare_stiffness_and_damping_are_cgs():
    joint = _read(joint="type = R(0,1,0)*T(0,0,1); stiff = (5,7); damp = (800000,1);").joints[
        "elbow"
    ]
    assert joint.stiff == (5e-7, 7e-3)
    assert joint.damp == (0.08, 1e-3)


def test_an_axis_of_few_digits_gets_length_one_and_one_axis_needs_no_brackets():
    joint = _read(joint="type = R(0.7071068,0.7071068,0); stiff = 5;").joints["elbow"]
    assert math.hypot(*joint.chain[0].axis) == pytest.approx(1.0, abs=1e-15)
    assert joint.stiff == (5e-7,)


def test_the_lines_of_a_site_accumulate():
    site = (
        _read(
            segment="""site tip->location = trans(1cm,2cm,3cm);
    site tip->globalforce = (1 N,0,0);
    site tip { localforce = (2,0,0); globalmoment = (3 N m,0,0); }
    site tip->localmoment = (4,0,0);"""
        )
        .segments["arm"]
        .sites["tip"]
    )
    assert site.location.factors == (Translation((0.01, 0.02, 0.03)),)
    assert site.global_force == (1.0, 0.0, 0.0)
    assert site.local_force == (2e-5, 0.0, 0.0)
    assert site.global_moment == (3.0, 0.0, 0.0)
    assert site.local_moment == (4e-7, 0.0, 0.0)


def test_a_location_is_composed_of_what_is_written():
    sites = (
        _read(
            segment="""site a { }
    site b->location = trans(1cm,0,0) * xyz(90deg,0,0) * trans(0,1cm,0);"""
        )
        .segments["arm"]
        .sites
    )
    assert sites["a"].location.factors == ()
    assert sites["b"].location.factors == (
        Translation((0.01, 0.0, 0.0)),
        Rotation((math.pi / 2, 0.0, 0.0)),
        Translation((0.0, 0.01, 0.0)),
    )


def test_attribute_is_a_block_and_a_field():
    figure = _read(
        segment="attribute = (red,blue);",
        figure='attribute red { rgb = (1,0,0); } attribute blue { shade = flat; name = "B 1"; }',
    )
    assert figure.segments["arm"].attributes == ("red", "blue")
    assert figure.attributes["red"].fields == {"rgb": (1.0, 0.0, 0.0)}
    assert figure.attributes["blue"].fields == {"shade": "flat", "name": "B 1"}
    assert _read(segment="attribute = red;", figure="attribute red { }").segments[
        "arm"
    ].attributes == ("red",)


def test_comments_blanks_and_empty_statements_say_nothing():
    plain = FIGURE_FILE.parse_text(_text()).value
    text = _text().replace(";", " /* a ; } */ ;; # } \n").replace("site ", "site\n/**/ ")
    assert FIGURE_FILE.parse_text(text).value == plain


def test_units_are_glued_or_spaced():
    glued = _read(segment="site x->location = trans(1cm,2mm,3in);")
    assert _read(segment="site x->location = trans(1 cm,2\tmm, 3 in );") == glued


def test_the_words_of_the_language_can_be_names():
    text = (
        _text(joint="type = R(0,0,1);")
        .replace("floor", "segment")
        .replace("top", "to")
        .replace("arm", "joint")
        .replace("elbow", "connect")
        .replace("near", "location")
    )
    reading = FIGURE_FILE.parse_text(text)
    assert reading.diagnostics == ()
    assert reading.value.root == SiteRef("segment", "to")


def test_everything_knows_where_it_is_written():
    figure = _read(joint="type = R(0,0,1); rest = (5deg);")
    arm, elbow = figure.segments["arm"], figure.joints["elbow"]
    assert arm.origins["name"].text == "arm"
    assert arm.origins["mass"].text == "25g"
    assert arm.sites["CM"].origins["location"].text == "trans(5cm,0cm,0cm)"
    assert elbow.origins["connect"].text == "connect floor.top to arm.near"
    assert elbow.origins["parent"].text == "floor.top"
    assert elbow.origins["rest"].text == "(5deg)"
    assert figure.origins["root"].text == "floor.top"


@pytest.mark.parametrize("length", [0.9999989, 1.0000011])
def test_an_axis_off_by_more_than_its_print_is_refused(length):
    reading = FIGURE_FILE.parse_text(_text(joint=f"type = R(0,{length},0);"))
    assert "instead of 1" in reading.diagnostics[0].message


def test_a_body_of_ten_heavy_links_in_a_row_is_no_person():
    links = "".join(
        f"""segment s{i} {{ mass = 4kg; inertia = (1,1,1); site CM->location = trans(1cm,0,0); }}
        joint j{i} {{ connect {"arm" if i == 0 else f"s{i - 1}"}.CM to s{i}.CM; }}"""
        for i in range(10)
    )
    reading = FIGURE_FILE.parse_text(_text(figure=links))
    assert reading.value.total_mass == pytest.approx(40.025)
    assert reading.diagnostics == ()


# Paths and names


def test_a_file_that_may_not_be_read_is_told(tmp_path, monkeypatch):
    path = tmp_path / "arm.fig"
    path.write_text(_text())
    monkeypatch.setattr(os, "open", Mock(side_effect=PermissionError(13, "Permission denied")))
    (fault,) = FIGURE_FILE.parse_file(path).diagnostics
    assert fault.message.endswith("cannot be read: permission denied")


def test_a_geometry_file_beside_the_figure_is_found(tmp_path):
    path = tmp_path / "arm.fig"
    path.write_text(_text(segment='psurf = "arm.pss";'))
    assert len(FIGURE_FILE.parse_file(path).diagnostics) == 1
    (tmp_path / "arm.pss").write_text("")
    assert FIGURE_FILE.parse_file(path).diagnostics == ()


def test_a_geometry_file_with_an_impossible_name_is_missing(tmp_path):
    path = tmp_path / "arm.fig"
    path.write_text(_text(segment=f'psurf = "{"é" * 190}.pss";'))
    (fault,) = FIGURE_FILE.parse_file(path).diagnostics
    assert "there is no file" in fault.message


# Encodings


# Size and speed

LENGTH = 50_000


@pytest.mark.parametrize(
    ("head", "piece"),
    [
        ("", "{"),
        ("figure {", "{"),
        ("figure {", "}"),
        ("figure { root = ", "("),
        ("", "figure {"),
        ("", "\n"),
        ("", "#\n"),
        ("", "/**/"),
        ("", "/*\n"),
        ("", '"'),
        ("figure {", '"\n'),
        ("", "a"),
        ("", "$ "),
        ("", "é "),
        ("figure { segment a { mass = ", "1"),
        ("figure { segment a { mass = 1", " kg"),
        ("figure { segment a { inertia = (", "1,"),
        ("figure { segment a {", "m = 1;"),
        ("figure { segment a {", "site b->location = xyz(1,2,3);"),
        ("figure {", "segment a { }"),
    ],
)
def test_the_work_of_a_long_text_grows_as_its_length(head, piece):
    text = head + piece * (LENGTH // len(piece))
    (faults, told), calls = counted_calls(lambda: _faults_and_sentences(text))
    assert calls < 10_000 + 60 * LENGTH
    assert 1 <= len(faults) <= 200
    assert len(told) < 60_000
    assert all(fault.span is not None for fault in faults)


def _faults_and_sentences(text):
    faults = FIGURE_FILE.parse_text(text).diagnostics
    return faults, "\n".join(map(str, faults))


def test_of_ten_million_words_the_first_are_read(monkeypatch):
    monkeypatch.setattr(lexer, "MAX_TOKENS", 1_000)
    text = "figure { root = " + "(" * 10_000_000
    (faults, _), calls = counted_calls(lambda: _faults_and_sentences(text))
    assert calls < 60_000
    assert "more than 1,000 words and marks" in faults[-1].message


def test_after_a_hundred_errors_reading_stops():
    reading = FIGURE_FILE.parse_text(_text(segment="colour = 1;\n" * 500))
    assert len(reading.diagnostics) == 100
    assert "reading stopped here, after 100 errors" in reading.diagnostics[-1].hint


def test_of_many_warnings_a_hundred_are_told():
    sites = "".join(f"site s{i}->location = xyz(1,0,0);\n" for i in range(250))
    reading = FIGURE_FILE.parse_text(_text(segment=sites))
    assert reading.value is not None
    assert len(reading.diagnostics) == 100
    assert reading.diagnostics[-1].hint.endswith("and 150 more warnings")


# Tokens

_SCRAPS = st.one_of(
    st.text(max_size=80),
    st.text(alphabet='abeE019.+-*/{}();,="#\n \t\r>_é$', max_size=120),
)


@given(text=_SCRAPS)
def test_any_text_is_cut_into_tokens_in_order(text):
    source, findings = Source("text", text), Diagnostics()
    tokens = []
    try:
        tokens.extend(tokenize(source, findings))
    except TooManyErrors:
        assert len(findings.entries) == 100
        return
    assert tokens[-1].kind is TokenKind.END
    ends = [0, *(token.end for token in tokens)]
    assert all(end <= token.start for end, token in zip(ends, tokens, strict=False))
    for token in tokens[:-1]:
        assert token.start < token.end <= len(text)
        if token.kind is TokenKind.NAME:
            assert text[token.start : token.end] == token.text
    if not findings.entries:
        spaced = " ".join(text[token.start : token.end] for token in tokens)
        again = list(tokenize(Source("text", spaced), Diagnostics()))
        assert [(t.kind, t.text, t.unit) for t in again] == [
            (t.kind, t.text, t.unit) for t in tokens
        ]
