"""Frames that the sockets of OpenSim's components name."""

import numpy as np
import pytest

from generator.diagnostics import Diagnostics, Source
from generator.model_files.opensim.frames import GROUND, FrameIndex
from generator.model_files.xml import XmlElement, parse_xml

MODEL = """<Model><Ground name="ground"/><BodySet name="bodyset"><objects><Body name="thigh">
<components><PhysicalOffsetFrame name="knee"><socket_parent>..</socket_parent>
<translation>0 -0.4 0</translation><Mesh name="own"/></PhysicalOffsetFrame>
<PhysicalOffsetFrame name="below"><socket_parent>../knee</socket_parent>
<translation>0 -0.1 0</translation></PhysicalOffsetFrame></components></Body></objects></BodySet>
<Joint name="a"><socket>{}</socket></Joint></Model>"""


def model(path: str) -> tuple[FrameIndex, XmlElement, XmlElement]:
    root = parse_xml(Source("m.osim", MODEL.format(path)), Diagnostics())
    assert root is not None
    (joint,) = (element for element in root.walk() if element.tag == "Joint")
    return FrameIndex.from_model(root), root, joint


@pytest.mark.parametrize(
    ("path", "body", "height"),
    [
        ("/ground", GROUND, 0.0),
        ("ground", GROUND, 0.0),
        ("/bodyset/thigh", "thigh", 0.0),
        ("/bodyset/thigh/knee", "thigh", -0.4),
        ("../bodyset/thigh/below", "thigh", -0.5),
        ("knee", "thigh", -0.4),
    ],
)
def test_frames_are_found_by_path_or_name(path: str, body: str, height: float):
    frames, _, joint = model(path)
    found = frames.resolve(joint, "socket")
    assert found is not None
    assert found[0] == body
    np.testing.assert_allclose(found[1][:3, 3], [0.0, height, 0.0])


def test_a_component_without_a_socket_stands_in_the_frame_around_it():
    frames, root, _ = model("/ground")
    by_name = {element.get("name"): element for element in root.walk()}
    for owner, height in (("knee", -0.4), ("below", -0.5), ("thigh", 0.0)):
        found = frames.resolve(by_name["own"], "socket_frame", default=by_name[owner])
        assert found is not None
        assert (found[0], found[1][1, 3]) == ("thigh", pytest.approx(height))
    assert frames.resolve(by_name["own"], "socket_frame", default=by_name["ground"])[0] == GROUND


def test_an_unknown_frame_is_an_error():
    frames, _, joint = model("/bodyset/shank")
    assert frames.resolve(joint, "socket") is None
    assert joint.diagnostics.has_errors
