"""Names that are given once: those that need no change are the first to have theirs."""

from hypothesis import given
from hypothesis import strategies as st

from generator.diagnostics import Source
from generator.model_files.body_tree.to_figure import Names
from generator.model_files.formats import parse_model

WORDS = st.text("ab _1", min_size=1, max_size=4)

MODEL = """<robot name="r">
  <link name="base"/>
  <link name="a b"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1"/></inertial></link>
  <link name="a_b"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1"/></inertial></link>
  <joint name="j 1" type="continuous"><parent link="base"/><child link="a b"/></joint>
  <joint name="j_1" type="continuous"><parent link="a b"/><child link="a_b"/></joint>
</robot>"""


@given(st.lists(WORDS, unique=True, max_size=12))
def test_a_valid_name_stays_wherever_it_stands(asked):
    names, alone = Names(), [Names().assign(name) for name in asked]
    names.protect(asked)
    found = [names.assign(name) for name in asked]
    assert len(set(found)) == len(found)
    for name, word, given_alone in zip(asked, found, alone, strict=True):
        if given_alone == name:
            assert word == name
        assert (name in names.renamed) == (word != name)


def test_a_name_that_is_made_gives_way_to_the_models():
    names = Names()
    names.protect(["arm_1"])
    assert names.assign_new("arm_1") == "arm_1_2"
    assert names.assign("arm_1") == "arm_1"
    assert names.assign_new("arm_2") == "arm_2"


def test_links_and_joints_keep_valid_names_behind_invalid_ones():
    figure = parse_model(Source("r.urdf", MODEL)).require_value().figure
    assert set(figure.bodies) == {"a_b", "a_b_2"}
    assert figure.joints["j_1"].child.segment == "a_b"
    assert figure.joints["j_1_2"].child.segment == "a_b_2"
