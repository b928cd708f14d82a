"""Models that are broken: one sentence each with a place, and nothing else ever."""

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from generator.diagnostics import InputError, Source
from generator.model_files.formats import parse_model, read_model
from tests.generator.model_files.imported_models import MODELS

LINK = (
    '<link name="{0}"><inertial><mass value="1"/>'
    '<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>'
)
HINGE = (
    '<joint name="{0}" type="continuous"><parent link="{1}"/><child link="{2}"/>'
    '<axis xyz="0 0 1"/></joint>'
)


def mjcf(body: str, before: str = "") -> str:
    return f"<mujoco>{before}<worldbody>{body}</worldbody></mujoco>"


def urdf(*parts: str) -> str:
    return f'<robot name="r">{"".join(parts)}</robot>'


def osim(bodies: str = "", joints: str = "", rest: str = "", version: str = "40500") -> str:
    return (
        f'<OpenSimDocument Version="{version}"><Model name="m"><BodySet><objects>{bodies}'
        f"</objects></BodySet><JointSet><objects>{joints}</objects></JointSet>{rest}"
        "</Model></OpenSimDocument>"
    )


def osim_body(name: str = "leg", inertia: str = "1 1 1 0 0 0") -> str:
    return f'<Body name="{name}"><mass>1</mass><inertia>{inertia}</inertia></Body>'


def osim_joint(kind: str = "PinJoint", child: str = "leg", parent: str = "ground") -> str:
    return (
        f'<{kind} name="hip"><socket_parent_frame>{parent}</socket_parent_frame>'
        f"<socket_child_frame>{child}</socket_child_frame></{kind}>"
    )


def muscle(points: str) -> str:
    return (
        '<ForceSet><objects><Thelen2003Muscle name="rectus"><GeometryPath>'
        f"<PathPointSet><objects>{points}</objects></PathPointSet></GeometryPath>"
        "</Thelen2003Muscle></objects></ForceSet>"
    )


GEOM = '<geom size="0.1"/>'

FAULTS = {
    # XML
    "": "this file is empty",
    "  \n ": "this file is empty",
    "<mujoco><worldbody></mujoco>": "this is not XML: mismatched tag",
    "<mujoco>": "this is not XML: no element found",
    "figure { }": "this is not XML: syntax error",
    "<mujoco a='1' a='2'/>": "this is not XML: duplicate attribute",
    '<!DOCTYPE m [<!ENTITY a "b">]><mujoco>&a;</mujoco>': "a document type is not read",
    "<mujoco>&undefined;</mujoco>": "this is not XML: undefined entity",
    "<sdf version='1.6'/>": "`sdf` is not a model that can be read",
    "<mujocoo/>": "`mujocoo` is not a model that can be read",
    "<mujoco>" + "<default class='a'>" * 300 + "</default>" * 300 + "</mujoco>": (
        "elements are nested too deeply"
    ),
    # MJCF
    "<mujoco/>": "this model has no `worldbody`",
    mjcf(""): "nothing in this model moves",
    mjcf(f"<body>{GEOM}</body>"): "nothing in this model moves",
    mjcf(f'<body><joint type="screw"/>{GEOM}</body>'): "unknown joint type `screw`",
    mjcf('<body name="b"><joint/></body>'): "`b` moves but has no mass",
    mjcf(f'<body><joint axis="0 0 0"/>{GEOM}</body>'): "this vector has no direction",
    mjcf(f'<body><joint axis="0 0"/>{GEOM}</body>'): "2 numbers instead of 3",
    mjcf(f'<body><joint axis="0 0 z"/>{GEOM}</body>'): "`z` is not a number",
    mjcf(f'<body><joint axis="0 0 nan"/>{GEOM}</body>'): "`nan` is not a number",
    mjcf(f'<body><joint axis="0 0 1e999"/>{GEOM}</body>'): "`1e999` is too large",
    mjcf(f'<body pos="1 2"><joint/>{GEOM}</body>'): "2 numbers instead of 3",
    mjcf(
        f'<body quat="0 0 0 0"><joint/>{GEOM}</body>'
    ): "the zero quaternion is not an orientation",
    mjcf(f'<body quat="1 0 0 0" euler="0 0 0"><joint/>{GEOM}</body>'): (
        "`quat` and `euler` both give the orientation"
    ),
    mjcf(f'<body><joint class="knee"/>{GEOM}</body>'): "there is no default class `knee`",
    mjcf('<body><joint/><geom type="box" size="0.1"/></body>'): "a box needs 3 positive sizes",
    mjcf('<body><joint/><geom size="-1"/></body>'): "a sphere needs 1 positive size",
    mjcf('<body><joint/><geom type="blob" size="1"/></body>'): "unknown geom type `blob`",
    mjcf('<body><joint/><geom type="mesh" mesh="skull"/></body>'): "meshes are not read",
    mjcf(f'<body name="a"><joint/>{GEOM}</body><body name="a"><joint/>{GEOM}</body>'): (
        "a second body named `a`"
    ),
    mjcf(f'<body><joint range="40 20"/>{GEOM}</body>'): "leave no range",
    mjcf(f'<body><joint damping="-1"/>{GEOM}</body>'): "is negative",
    mjcf(f'<body>{GEOM}<joint/><body><joint type="free"/>{GEOM}</body></body>'): (
        "a free joint is the only one of a body that hangs on the world"
    ),
    mjcf(f'<body>{GEOM}<joint type="ball"/><joint/></body>'): (
        "a body with a ball joint has no other joint that turns"
    ),
    mjcf('<body><joint/><inertial mass="1"/></body>'): "`inertial` has no inertia",
    mjcf('<body><joint/><inertial mass="1" diaginertia="1 1 3"/></body>'): (
        "no body has the principal moments"
    ),
    mjcf('<body><joint/><inertial mass="-1" diaginertia="1 1 1"/></body>'): (
        "the mass of a body must be above zero"
    ),
    mjcf('<composite type="rope"/>'): "a composite of many bodies (`composite`) is not read",
    mjcf(f"<body><joint/>{GEOM}<bdoy/></body>"): "unknown element `bdoy` in `body`",
    mjcf("", '<include file="nowhere.xml"/>'): "the included file cannot be used",
    mjcf("", '<compiler angle="gon"/>'): "`gon` is not a value of `angle`",
    mjcf("", '<compiler eulerseq="xy"/>'): "`eulerseq` has three letters out of xyzXYZ",
    mjcf("", '<compiler coordinate="global"/>'): "`global` is not a value of `coordinate`",
    # URDF
    urdf(): "this robot has no links",
    urdf('<link name="a"/>'): "nothing in this model moves",
    urdf('<link name="a"/><link name="b"/>', HINGE.format("j", "a", "b")): (
        "`b` moves but has no mass"
    ),
    urdf('<link name="a"/>', LINK.format("b")): "no joint carries the link `b`, nor `a`",
    urdf(LINK.format("a"), LINK.format("a")): "a second link named `a`",
    urdf(LINK.format("a"), HINGE.format("j", "a", "c")): "there is no link `c`",
    urdf(
        *map(LINK.format, "abc"),
        HINGE.format("i", "a", "b"),
        HINGE.format("j", "a", "c"),
        HINGE.format("k", "b", "c"),
    ): "a second joint carries the link `c`: loops cannot be read",
    urdf(
        *map(LINK.format, "abc"), HINGE.format("i", "b", "c"), HINGE.format("j", "c", "b")
    ): "the joints from `b` lead back to it: loops cannot be read",
    urdf(
        LINK.format("a"),
        LINK.format("b"),
        HINGE.format("j", "a", "b").replace("continuous", "ball"),
    ): "unknown joint type `ball`",
    urdf('<link name="a"><inertial><mass value="1"/></inertial></link>'): (
        "this inertial has no inertia"
    ),
    urdf(
        '<link name="a"/>',
        LINK.format("b").replace('ixx="1"', 'ixx="9"'),
        HINGE.format("j", "a", "b"),
    ): "the inertia of `b` is impossible",
    urdf("<xacro:macro/>"): "`xacro:macro` is a macro",
    # OpenSim
    "<OpenSimDocument/>": "this document has no `Model`",
    osim(version="20302"): "this model was written by OpenSim 3 or older",
    osim(osim_body()): "no joints lead from the ground to the body `leg`",
    osim(osim_body(), osim_joint("EllipsoidJoint")): "the joint type `EllipsoidJoint` is not read",
    osim(osim_body(), osim_joint(child="lge")): "there is no frame `lge`",
    osim(osim_body(), osim_joint() + osim_joint()): ("the joint `hip` closes a loop"),
    osim(osim_body(), osim_joint(parent="leg")): "the joint `hip` joins `leg` to itself",
    osim(osim_body(inertia="0 0 0 0 0 0"), osim_joint()): "the inertia of `leg` is not positive",
    osim(osim_body(inertia="1 1 x 0 0 0"), osim_joint()): "`x` is not a number",
    osim(osim_body(), osim_joint(), muscle("")): "the path of `rectus` has no points",
    osim(osim_body(), osim_joint(), muscle("<PathPoint/>")): "the path of `rectus` has one point",
    osim(osim_body(), osim_joint("CustomJoint")): "this joint has no `SpatialTransform`",
}


@pytest.mark.parametrize("text", FAULTS, ids=range(len(FAULTS)))
def test_a_broken_model_is_one_sentence_with_a_place(text):
    with pytest.raises(InputError) as caught:
        parse_model(Source("model.xml", text)).require_value()
    (fault,) = caught.value.diagnostics
    assert FAULTS[text] in fault.message
    assert fault.span is not None
    assert fault.span.line >= 1
    assert str(fault).startswith("model.xml:")


def test_the_place_is_that_of_the_value():
    text = '<mujoco>\n <worldbody>\n  <body><joint axis="0 one 0"/></body></worldbody></mujoco>'
    with pytest.raises(InputError) as caught:
        parse_model(Source("model.xml", text)).require_value()
    first = caught.value.diagnostics[0]
    assert (first.span.line, first.span.column, first.span.text) == (3, 24, "one")


def test_all_faults_are_told_at_once():
    body = '<body name="a"><joint axis="0 0 0"/><geom type="blob" size="1"/></body>'
    with pytest.raises(InputError) as caught:
        parse_model(Source("model.xml", mjcf(body * 2))).require_value()
    assert len(caught.value.diagnostics) == 3


def test_a_fault_in_an_included_file_is_placed_there(tmp_path):
    (tmp_path / "main.xml").write_text(
        mjcf(f"<body><joint/>{GEOM}</body>", '<include file="part.xml"/>')
    )
    (tmp_path / "part.xml").write_text("<mujoco>\n<oops></mujoco>")
    with pytest.raises(InputError) as caught:
        read_model(tmp_path / "main.xml")
    (fault,) = caught.value.diagnostics
    assert fault.span.source.name == str(tmp_path / "part.xml")
    assert fault.span.line == 2


def test_a_file_that_includes_itself_ends(tmp_path):
    (tmp_path / "main.xml").write_text(mjcf("", '<include file="main.xml"/>'))
    with pytest.raises(InputError, match="included a second time"):
        read_model(tmp_path / "main.xml")


@pytest.mark.parametrize("name", ["missing.xml", "."])
def test_a_file_that_cannot_be_read_is_a_sentence(tmp_path, name):
    with pytest.raises(InputError):
        read_model(tmp_path / name)


SAMPLES = [
    (MODELS / name).read_text(encoding="utf-8")
    for name in ("humanoid.xml", "mechanism.xml", "arm.urdf", "leg.osim")
]


@given(st.data())
@settings(
    max_examples=80, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
def test_a_damaged_model_is_read_or_refused(data):
    text = data.draw(st.sampled_from(SAMPLES))
    start = data.draw(st.integers(0, len(text) - 1))
    end = min(len(text), start + data.draw(st.integers(0, 40)))
    middle = data.draw(st.sampled_from(["", "0", "-", "nan", "é", "<", ">", '"', "&lt;", "1e300"]))
    damaged = text[:start] + middle + text[end:]
    try:
        said = parse_model(Source("model.xml", damaged), MODELS).require_value().losses.entries
    except InputError as failure:
        said = failure.diagnostics
    assert all(str(one) for one in said)
    assert said
