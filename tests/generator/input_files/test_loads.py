"""Loads from a file: what is read, and what is said of what cannot be."""

import pytest

from generator.figure import Figure, SiteRef
from generator.figure_file import read_figure
from generator.input_files.loads import LOADS_FILE
from generator.loads import LoadKind
from tests.paths import DOCS

HEADER = "site,kind,time [s],x [N],y [N],z [N]\n"
BOTH = "site,kind,time [s],x [N or N m],y [N or N m],z [N or N m]\n"


@pytest.fixture(scope="module")
def figure() -> Figure:
    return read_figure("prototype")


def test_forces_and_moments_at_several_sites_in_one_file(figure: Figure):
    text = (
        "# a push\n\n"
        + BOTH
        + "center_torso.distal, globalforce, 0, 0,0,0\r\n"
        + "right_lower_arm.distal,localmoment,0.5,0,0,.5\n"
        + "center_torso.distal,globalforce,1e-1,-80,+2.5,1e2\n"
        + "right_lower_arm.distal,localmoment,1,0,0,0.25\n"
    )
    reading = LOADS_FILE.parse_text(text, figure)
    assert reading.diagnostics == ()
    push, twist = reading.value
    assert push.site == SiteRef("center_torso", "distal")
    assert push.kind is LoadKind.GLOBAL_FORCE
    assert push.times == (0.0, 0.1)
    assert push.values == ((0.0, 0.0, 0.0), (-80.0, 2.5, 100.0))
    assert twist.site == SiteRef("right_lower_arm", "distal")
    assert twist.kind is LoadKind.LOCAL_MOMENT
    assert twist.values == ((0.0, 0.0, 0.5), (0.0, 0.0, 0.25))


def test_columns_may_stand_in_any_order(figure: Figure):
    text = (
        "z [N m],time [s],site,y [N m],kind,x [N m]\n3,0,waist_is_no_site,2,localmoment,1\n"
    ).replace("waist_is_no_site", "lower_torso.distal")
    (load,) = LOADS_FILE.parse_text(text, figure).value
    assert load.values == ((1.0, 2.0, 3.0),)


SITE = "lower_torso.distal"


def test_no_end_of_faults_is_told(figure: Figure):
    assert len(LOADS_FILE.parse_text(HEADER + "x\n" * 5000, figure).diagnostics) == 100


def test_the_example_of_the_documentation_can_be_read(figure: Figure):
    text = (DOCS / "loads.md").read_text(encoding="utf-8")
    block = [line[4:] for line in text.splitlines() if line.startswith("    ")]
    reading = LOADS_FILE.parse_text("\n".join(block), figure)
    assert reading.diagnostics == ()
    assert [load.kind for load in reading.value] == [LoadKind.GLOBAL_FORCE, LoadKind.LOCAL_MOMENT]
