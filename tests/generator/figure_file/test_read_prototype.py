"""The shipped prototype is appendix A, number by number; this table was typed from the thesis."""

import numpy as np
import pytest

from generator.figure import AxisKind, Rotation, SiteRef, Translation
from generator.figure_file import FIGURE_FILE, read_figure, simulation_diagnostics
from generator.figure_file.write import write_figure

# name: psurf, attributes, mass [g], inertia [g cm2]
SEGMENTS = {
    "right_lower_leg": ("ecalf", "3", 4000.77, (1199091.8750, 1453679.8750, 292090.1563)),
    "left_lower_leg": ("ecalf", "3", 4000.77, (1199091.8750, 1453679.8750, 292090.1563)),
    "right_upper_leg": ("eupleg", "3", 8205.55, (992266.1875, 1013080.3125, 156199.0156)),
    "left_upper_leg": ("eupleg", "3", 8205.55, (992266.1875, 1013080.3125, 156199.0156)),
    "right_lower_arm": ("elowarm", "3 11", 1815.81, (365474.6875, 361975.3750, 13135.1484)),
    "left_lower_arm": ("elowarm", "3 13", 1815.81, (365474.6875, 361975.3750, 13135.1484)),
    "right_upper_arm": ("euparm", "3", 2297.40, (165567.2500, 171408.9688, 19422.7441)),
    "left_upper_arm": ("euparm", "3", 2297.40, (165567.2500, 171408.9688, 19422.7441)),
    "lower_torso": ("eltorso", "3 13", 3469.32, (232921.1406, 124958.4453, 303026.2500)),
    "center_torso": ("echest", "3 15", 13169.60, (9540146.0, 9199660.0, 1203154.8750)),
    "body_root": (None, "", -1.00, None),
}

# segment: {site: (xyz [deg] or None, trans [cm])}
SITES = {
    "lower_leg": {
        "proximal": (None, (0, 0, 0)),
        "distal": (None, (0, 0, 36.80)),
        "CM": (None, (2.61, 0.01, 23.73)),
    },
    "upper_leg": {
        "proximal": (None, (0, 0, 0)),
        "distal": (None, (0, 0, 43.40)),
        "CM": (None, (0, 0, 18.07)),
    },
    "lower_arm": {
        "proximal": (None, (0, 0, 0)),
        "distal": (None, (0, 0, 28.80)),
        "CM": (None, (-0.01, 0, 17.51)),
    },
    "upper_arm": {
        "proximal": (None, (0, 0, 0)),
        "distal": (None, (0, 0, 33.40)),
        "CM": (None, (-0.03, 0.02, 13.99)),
    },
    "lower_torso": {
        "proximal": (None, (0, 0, 0)),
        "distal": (None, (0, 0, 13.10)),
        "rlateral": ((-180, 0, 0), (0, -6.12, 0)),
        "llateral": ((-180, 0, 0), (0, 6.12, 0)),
        "CM": (None, (0, 0, 6.17)),
    },
    "center_torso": {
        "proximal": (None, (0, 0, 0)),
        "distal": (None, (0, 0, 47.60)),
        "utproximal": (None, (0, 0, 47.60)),
        "utdistal": (None, (0, 0, 47.60)),
        "utleft": ((-90, 0, 0), (0, 0, 47.60)),
        "utright": ((90, 0, 0), (0, 0, 47.60)),
        "rstdistal": ((90, 0, 0), (0, 0, 50)),
        "lstdistal": ((-90, 0, 0), (0, 0, 50)),
        "rcl_lateral": ((-180, 0, 0), (0, -17.20, 50)),
        "lcl_lateral": ((-180, 0, 0), (0, 17.20, 50)),
        "CM": (None, (0.09, -0.08, 33.76)),
    },
    "body_root": {
        "distal": ((-90, 0, -90), (0, 0, 0)),
        "left": ((-90, 0, 0), (0, 0, 0)),
        "right": ((90, 0, 0), (0, 0, 0)),
        "floor": ((45, 90, 45), (0, 0, -94.10)),
        "base": (None, (0, -94.10, 0)),
    },
}

LEFT, RIGHT = "+z +x +y", "-z -x +y"

# joint: parent, child, axes, stiff [dyn cm/rad]
JOINTS = {
    "waist": ("lower_torso.distal", "center_torso.proximal", LEFT, 1.00),
    "root_torso": ("body_root.distal", "lower_torso.proximal", "+x +y +z", None),
    "left_shoulder": ("center_torso.lcl_lateral", "left_upper_arm.proximal", LEFT, 1.00),
    "right_shoulder": ("center_torso.rcl_lateral", "right_upper_arm.proximal", RIGHT, 1.00),
    "right_elbow": ("right_upper_arm.distal", "right_lower_arm.proximal", "+y", 1.00),
    "left_elbow": ("left_upper_arm.distal", "left_lower_arm.proximal", "+y", 1.00),
    "right_hip_joint": ("lower_torso.rlateral", "right_upper_leg.proximal", RIGHT, 1.00),
    "left_hip_joint": ("lower_torso.llateral", "left_upper_leg.proximal", LEFT, 1.00),
    "right_knee": ("right_upper_leg.distal", "right_lower_leg.proximal", "-y", 1.00),
    "left_knee": ("left_upper_leg.distal", "left_lower_leg.proximal", "-y", 1.00),
}


def _shifted(value, places):
    """The float nearest to the decimal `value` with its point moved: 2.61 and -2 give 0.0261."""
    return float(f"{value!r}e{places}")


@pytest.fixture(scope="module")
def figure():
    return read_figure("prototype")


def test_the_segments_are_those_of_the_appendix(figure):
    assert list(figure.segments) == list(SEGMENTS)
    for name, (psurf, attributes, mass, inertia) in SEGMENTS.items():
        segment = figure.segments[name]
        assert segment.psurf == (psurf and f"{psurf}.pss")
        assert segment.attributes == tuple(f"attribute{number}" for number in attributes.split())
        assert segment.mass == _shifted(mass, -3)
        assert segment.inertia == (inertia and tuple(_shifted(moment, -7) for moment in inertia))


def test_the_sites_are_those_of_the_appendix(figure):
    for name, segment in figure.segments.items():
        expected = SITES[name.removeprefix("left_").removeprefix("right_")]
        assert list(segment.sites) == list(expected)
        for site, (angles, offset) in expected.items():
            turn = () if angles is None else (Rotation(tuple(np.radians(angles).tolist())),)
            shift = Translation(tuple(_shifted(length, -2) for length in offset))
            assert segment.sites[site].location.factors == (*turn, shift)


def test_the_joints_are_those_of_the_appendix(figure):
    assert list(figure.joints) == list(JOINTS)
    for name, (parent, child, axes, stiff) in JOINTS.items():
        joint = figure.joints[name]
        assert (str(joint.parent), str(joint.child)) == (parent, child)
        for factor, axis in zip(joint.chain, axes.split(), strict=True):
            expected = [0.0, 0.0, 0.0]
            expected["xyz".index(axis[1])] = float(axis[0] + "1")
            assert (factor.kind, list(factor.axis)) == (AxisKind.ROTATION, expected)
        assert joint.displacement == (0.0,) * len(joint.chain)
        assert joint.stiff == (stiff and (_shifted(stiff, -7),) * len(joint.chain))
        assert (joint.rest, joint.damp, joint.lower_limit, joint.upper_limit) == (None,) * 4


def test_the_rest_is_that_of_the_appendix(figure):
    assert figure.root == SiteRef("body_root", "base")
    assert figure.name is None
    assert list(figure.attributes) == [f"attribute{number}" for number in (3, 11, 13, 15)]
    for attribute in figure.attributes.values():
        assert attribute.fields == {"rgb": (1.00, 0.37, 0.00)}


def test_ten_segments_move_with_22_degrees_of_freedom(figure):
    assert figure.ground == {"body_root"}
    assert len(figure.bodies) == 10
    assert figure.degrees_of_freedom == 22
    assert figure.total_mass == pytest.approx(49.27798, abs=1e-9)


def test_the_reader_remarks_on_the_mass_and_on_nothing_else():
    reading = FIGURE_FILE.parse_file("prototype")
    (fault,) = reading.diagnostics
    assert fault.message == (
        "total mass 49.28 kg is far below a 50th-percentile man's (about 78 kg)"
    )
    assert simulation_diagnostics(reading.value) == ()


def test_the_file_is_laid_out_by_the_writer(figure):
    text = FIGURE_FILE.shipped()["prototype"].read_text("utf-8")
    assert text[text.index("figure {") :] == write_figure(figure)
