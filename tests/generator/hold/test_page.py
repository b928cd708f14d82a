"""Pictures and pages of postures."""

from pathlib import Path
from xml.etree import ElementTree

import pytest

from generator.figure_file import read_figure
from generator.hold.page import joint_uses, posture_page, posture_svg, use_colour
from generator.hold.posture import Holder, Posture
from generator.hold.statics import Load
from generator.model import Model
from tests.command import answer

SVG = "{http://www.w3.org/2000/svg}"


@pytest.fixture(scope="module")
def posture() -> Posture:
    holder = Holder.of(Model.of(read_figure("male50")))
    return holder.posture(None, [Load("left_hand", 6.0), Load("right_hand")])


def test_picture_shows_segments_joints_and_loads_in_two_views(posture: Posture):
    root = ElementTree.fromstring(posture_svg(posture))
    figure = posture.placement.tree.figure
    assert len(root.findall(f"{SVG}polygon")) == 2 * len(figure.bodies)
    titles = [one.findtext(f"{SVG}title") or "" for one in root.findall(f"{SVG}circle")]
    assert len(titles) == 2 * (len(joint_uses(posture)) + len(posture.loads))
    weakest = posture.weakest
    assert weakest is not None
    expected = f"{weakest.joint} {weakest.direction}: {100.0 * (weakest.use or 0.0):.0f} %"
    assert expected in titles
    width, height = (float(root.attrib[key]) for key in ("width", "height"))
    for polygon in root.findall(f"{SVG}polygon"):
        for pair in polygon.attrib["points"].split():
            x, y = map(float, pair.split(","))
            assert 0.0 < x < width
            assert 0.0 < y < height


def test_colours_run_from_blue_to_red():
    assert (use_colour(0.0), use_colour(0.5), use_colour(1.0)) == ("#2c7bb6", "#ffffbf", "#d7191c")
    assert len({use_colour(use) for use in (None, 0.0, 1.0, 1.01)}) == 4
    assert use_colour(1.01) == use_colour(float("inf"))


def test_page_escapes_its_texts():
    page = posture_page("<b>", ["a & b"], [["<i>"], ["1"]], ["x < y"], "<svg/>")
    assert "<b>" not in page
    assert "<i>" not in page
    for text in ("&lt;b&gt;", "a &amp; b", "&lt;i&gt;", "x &lt; y", "<svg/>"):
        assert text in page


def test_command_writes_all_files(tmp_path: Path):
    files = [tmp_path / name for name in ("hold.html", "hold.csv", "hold.svg")]
    words = [word for path in files for word in ("-o", path)]
    said = answer("hold", "male50", "--load", "left_hand=6kg", *words)
    assert said["files"] == list(map(str, files))
    assert "left_shoulder" in files[1].read_text(encoding="utf-8")
    page = (tmp_path / "hold.html").read_text(encoding="utf-8")
    assert (tmp_path / "hold.svg").read_text(encoding="utf-8").strip() in page
    assert "strong enough" in page
    assert "<script" not in page
