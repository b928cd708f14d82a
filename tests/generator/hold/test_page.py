"""Pictures and pages of postures."""

import re
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
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


def test_labels_lie_on_no_load_and_no_other_label():
    holder = Holder.of(Model.of(read_figure("male50")))
    bent = {f"{side}_elbow": np.radians([0.0, 90.0]) for side in ("left", "right")}
    for pose in ({}, bent, {"left_elbow": bent["left_elbow"]}):
        posture = holder.posture(pose, [Load("left_hand", 15.0), Load("right_hand", 15.0)])
        root = ElementTree.fromstring(posture_svg(posture))
        boxes: list[tuple[float, float, float, float]] = []
        for one in root.findall(f"{SVG}text"):
            said = one.text or ""
            if said.endswith("%"):
                x, y, half = float(one.attrib["x"]), float(one.attrib["y"]), 3.5 * len(said)
                boxes.append((x - half, y - 9.0, x + half, y + 1.0))
        assert len(boxes) > 4
        for line in root.findall(f"{SVG}line"):
            x1, y1, x2, y2 = (float(line.attrib[key]) for key in ("x1", "y1", "x2", "y2"))
            for part in np.linspace(0.0, 1.0, 200):
                x, y = x1 + part * (x2 - x1), y1 + part * (y2 - y1)
                assert not any(a < x < c and b < y < d for a, b, c, d in boxes)
        for k, (a, b, c, d) in enumerate(boxes):
            for e, f, g, h in boxes[k + 1 :]:
                assert a >= g or c <= e or b >= h or d <= f


def test_colours_run_from_blue_to_red():
    assert (use_colour(0.0), use_colour(0.5), use_colour(1.0)) == ("#2c7bb6", "#ffffbf", "#d7191c")
    assert len({use_colour(use) for use in (None, 0.0, 1.0, 1.01)}) == 4
    assert use_colour(1.01) == use_colour(float("inf"))


def test_page_escapes_its_texts(posture: Posture):
    data = {"hands": [], "who": "<script>"}
    page = posture_page("<b>", ["a & b"], [["h"], ["<i>"]], ["x < y"], posture, data)
    for text in ("<b>", "<i>", "x < y", '<script>"'):
        assert text not in page
    for text in ("&lt;b&gt;", "a &amp; b", "&lt;i&gt;", "x &lt; y"):
        assert text in page


def test_command_writes_all_files(tmp_path: Path):
    files = [tmp_path / name for name in ("hold.html", "hold.csv", "hold.svg")]
    words = [word for path in files for word in ("-o", path)]
    said = answer("hold", "male50", "--load", "left_hand=6kg", *words)
    assert said["files"] == list(map(str, files))
    assert "left_shoulder" in files[1].read_text(encoding="utf-8")
    page = (tmp_path / "hold.html").read_text(encoding="utf-8")
    labels = [
        re.findall(r">(\d+ %)</text>", text)
        for text in (page, (tmp_path / "hold.svg").read_text(encoding="utf-8"))
    ]
    assert set(labels[1]) <= set(labels[0])
    assert "strong enough" in page
    assert not re.findall(r"https?://(?!www\.w3\.org/2000/svg)", page)
    assert "unsafe" not in page
