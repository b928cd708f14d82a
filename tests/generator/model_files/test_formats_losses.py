"""Losses of models in other formats, by joint, and figures that they refuse."""

import re
from collections.abc import Callable
from dataclasses import replace
from math import inf
from pathlib import Path
from xml.etree import ElementTree

import pytest

from generator.diagnostics import InputError
from generator.figure import Attribute, ContactSphere, Figure
from generator.figure_file import FIGURE_FILE
from generator.kinematics.loops import OpenLoopError
from generator.losses import Losses
from generator.model_files.biomod.write import format_biomod
from generator.model_files.mjcf import write as mjcf
from generator.model_files.mjcf.write import format_mjcf
from generator.model_files.opensim import write as osim
from generator.model_files.opensim.write import format_osim
from generator.model_files.urdf import write as urdf
from generator.model_files.urdf.write import SPRINGS_LOSS, format_urdf
from generator.text_io import make_source
from springs import (
    AxisSpring,
    CoupledAxis,
    CoupledSpring,
    Cubic,
    Damping,
    JointSprings,
    Linear,
    SphericalLaw,
    SpringSet,
    Stop,
)
from springs.coupled import CoupledExponential, CoupledTerm
from tests.chains import SKEW, at, chain, one_body, row, two_bodies
from tests.generator.model_files.model_cases import (
    BENT,
    CURVES,
    FOURBAR,
    OTHER_CURVES,
    PENDULUM,
    PROTOTYPE,
    equal,
    hinge,
    linked,
    on_a_rail,
    own_springs,
    slide,
    spring_set,
)

Text = Callable[[Figure, SpringSet], tuple[str, Losses]]

BALLS = ["waist", "right_hip_joint", "left_hip_joint", "left_shoulder", "right_shoulder"]
HINGES = ["right_elbow", "left_elbow", "right_knee", "left_knee"]
SEVERAL = "springs of several rotations (convert with `--law coordinates`)"
DAMPING = "unequal damping of several rotations (convert with `--law coordinates`)"
CURVED = "springs approximated by piecewise cubics"
COULOMB = "the form of Coulomb friction: MuJoCo's holds a joint at rest, ours lets it creep"
ROWS = (
    "joints of several degrees of freedom: each becomes a chain of single ones with massless "
    "links between them"
)
GRAVITY = "gravity: set it in the program that reads the file"
SITES = "sites other than those of joints"
DRAWN = "the pose in which the figure is drawn: all displacements are 0"


def lost(write: Text, of: Figure, springs: SpringSet) -> dict[str, set[str]]:
    """The places of every loss without their errors, by its sentence."""
    losses = write(of, springs)[1]
    assert len({loss.what for loss in losses.entries}) == len(losses.entries)
    return {
        loss.what: {name for where in loss.where for name in where.split(" (")[0].split(" and ")}
        for loss in losses.entries
    }


def test_of_the_prototype_mujoco_loses_the_springs_of_its_balls() -> None:
    springs = own_springs(PROTOTYPE)
    for law in (SphericalLaw.CONSERVATIVE, SphericalLaw.WEIGHTED):
        under = replace(springs, law=law)
        assert lost(format_mjcf, PROTOTYPE, under) == {SEVERAL: set(BALLS)}
    assert not lost(format_mjcf, PROTOTYPE, replace(springs, law=SphericalLaw.COORDINATES))


def test_of_the_prototype_opensim_loses_nothing() -> None:
    assert not lost(format_osim, PROTOTYPE, own_springs(PROTOTYPE))


def test_of_the_prototype_urdf_loses_all_springs_and_much_else() -> None:
    assert lost(format_urdf, PROTOTYPE, own_springs(PROTOTYPE)) == {
        ROWS: {*BALLS, "root_torso"},
        GRAVITY: set(),
        SPRINGS_LOSS: {*BALLS, *HINGES},
        "damping and friction of several rotations": set(BALLS),
        DRAWN: set(BENT),
        SITES: set(),
    }


def test_of_a_loop_urdf_loses_the_closing_joint_and_opensim_its_displacement() -> None:
    springs = spring_set(hinge("rocker_pin", Linear(1.0), axis=(0.0, 0.0, 1.0)))
    closing = {"rocker_pin"}
    closed = {"springs of joints that close loops": closing}
    assert lost(format_mjcf, FOURBAR, springs) == closed
    coordinates = {
        "displacements of joints that close loops, which do not become coordinates": closing
    }
    assert lost(format_osim, FOURBAR, springs) == coordinates
    losses = lost(format_urdf, FOURBAR, springs)
    assert losses["joints that close loops: the loops are open"] == closing
    assert losses["springs of joints that close loops"] == closing
    assert SPRINGS_LOSS not in losses


@pytest.mark.parametrize("write", [format_mjcf, format_osim])
def test_loops_that_points_cannot_close_are_named(write: Text) -> None:
    sliding = lost(write, linked(chain("Rz Tz")), SpringSet())
    assert sliding["joints with translations that close a loop: the loop is open"] == {"closing"}
    turning = lost(write, linked(chain("Rx Ry")), SpringSet())
    assert turning["joints of two rotations that close a loop: they rotate freely"] == {"closing"}
    assert not lost(format_mjcf, linked(chain("Rx Ry Rz Tx Ty Tz")), SpringSet())


@pytest.mark.parametrize("name", OTHER_CURVES)
def test_mujoco_loses_curves_that_are_no_cubics_and_friction_of_the_angle(name: str) -> None:
    of = on_a_rail()
    springs = spring_set(hinge("hinge", *OTHER_CURVES[name]), slide("rail", SKEW, *CURVES["stop"]))
    friction = {"friction that depends on the angle": {"hinge"}}
    assert lost(format_mjcf, of, springs) == (
        friction if name == "hysteresis" else {CURVED: {"hinge"}}
    )
    assert not lost(format_osim, of, springs)


def test_mujoco_has_a_coulomb_friction_of_its_own() -> None:
    springs = spring_set(hinge("hinge", coulomb=0.5), slide("rail", SKEW, viscous=1.0))
    text, losses = format_mjcf(on_a_rail(), springs)
    assert [(loss.what, loss.where) for loss in losses.entries] == [(COULOMB, ("hinge",))]
    joints = {one.get("name"): one for one in ElementTree.fromstring(text).iter("joint")}
    assert joints["hinge"].get("frictionloss") == "0.5"
    assert joints["rail"].get("damping") == "1"


def test_springs_of_several_turns_are_left_out_unless_they_are_equal_about_all_axes() -> None:
    of = two_bodies(chain("Rx Ry Rz"), (0.1, 0.2, 0.3))
    alike = equal(of, "tested", 3.0, 0.1)
    assert not lost(format_mjcf, of, spring_set(alike))
    stiffer = replace(alike.axes[0], elastic=(Linear(4.0),))
    damped = replace(alike.axes[0], damping=Damping(0.2))
    bent = replace(alike.axes[0], elastic=(Linear(3.0, 0.1),))
    rubbing = replace(alike.axes[0], damping=Damping(0.1, 0.3))
    for axis, expected in (
        (stiffer, SEVERAL),
        (bent, SEVERAL),
        (damped, DAMPING),
        (rubbing, "Coulomb friction of several rotations"),
    ):
        springs = spring_set(JointSprings("tested", (axis, *alike.axes[1:])))
        assert lost(format_mjcf, of, springs) == {expected: {"tested"}}
        coordinates = lost(format_mjcf, of, replace(springs, law=SphericalLaw.COORDINATES))
        assert set(coordinates) == ({COULOMB} if axis is rubbing else set())
    two_axes = spring_set(JointSprings("tested", alike.axes[:2]))
    assert lost(format_mjcf, of, two_axes) == {SEVERAL: {"tested"}, DAMPING: {"tested"}}
    universal = two_bodies(chain("Rx Ry"), (0.1, 0.2))
    springs = spring_set(equal(universal, "tested", 3.0, 0.1))
    assert lost(format_mjcf, universal, springs) == {SEVERAL: {"tested"}, DAMPING: {"tested"}}
    assert not lost(format_osim, universal, springs)


def test_errors_of_fits_are_losses_in_newton_metres_over_the_range() -> None:
    springs = spring_set(hinge("hinge", *OTHER_CURVES["exponential"]))
    (loss,) = format_mjcf(on_a_rail(), springs)[1].entries
    (where,) = loss.where
    assert loss.what == CURVED
    assert re.fullmatch(r"hinge \(\S+ N m at most, \S+ N m rms over -90 to 90 deg\)", where)


def test_a_limit_at_infinity_is_none_in_urdf() -> None:
    of = one_body(chain("Tx"), lower_limit=(-0.3,), upper_limit=(inf,))
    (limit,) = ElementTree.fromstring(format_urdf(of, SpringSet())[0]).iter("limit")
    assert [float(limit.attrib[end]) for end in ("lower", "upper")] == [-0.3, 1e9]


def test_limits_and_stops_in_urdf() -> None:
    of = one_body(chain("Rx"), lower_limit=(-0.3,), upper_limit=(0.4,))
    text, losses = format_urdf(of, spring_set(hinge("pin", Stop(-0.3, 0.4))))
    assert {loss.what: loss.where for loss in losses.entries} == {
        GRAVITY: (),
        "the stiffness of stops: the limits of the file are rigid": ("pin",),
        SITES: (),
    }
    joint = next(j for j in ElementTree.fromstring(text).iter("joint") if j.get("name") == "pin")
    limit = joint.find("limit")
    assert joint.get("type") == "revolute"
    assert limit is not None
    assert (limit.get("lower"), limit.get("upper")) == ("-0.3", "0.4")
    several = one_body(chain("Rx Ry"), lower_limit=(-0.3, -0.2))
    assert lost(format_urdf, several, SpringSet())["limits of several rotations"] == {"pin"}


def test_stops_that_are_no_limits_are_lost_in_urdf() -> None:
    springs = spring_set(hinge("hinge", *CURVES["stop"]))
    assert lost(format_urdf, on_a_rail(), springs)[SPRINGS_LOSS] == {"hinge"}


@pytest.mark.parametrize("write", [format_mjcf, format_osim, format_urdf])
def test_contact_spheres_are_lost(write: Text) -> None:
    of = one_body(chain("Rx"))
    link = replace(of.segments["link"], contact_spheres=(ContactSphere((0.0, 0.0, 0.0), 0.1),))
    assert lost(write, of.with_parts(link), SpringSet())["contact spheres"] == {"link"}


@pytest.mark.parametrize("write", [format_mjcf, format_urdf])
def test_laws_over_several_joints_are_lost(write: Text) -> None:
    of = on_a_rail()
    axes = (CoupledAxis("hinge", (1.0, 0.0, 0.0)), CoupledAxis("hinge", (1.0, 0.0, 0.0)))
    no_energy = CoupledTerm((1.0, 0.0), (1.0, 2.0))
    law = CoupledExponential(("a", "b"), (no_energy,), (0.0, 0.0), (None, None))
    springs = SpringSet(coupled=(CoupledSpring(law, axes),))
    assert lost(write, of, springs)["laws over several joints"] == {"hinge"}


def test_loads_are_lost_in_urdf_only() -> None:
    assert lost(format_urdf, PENDULUM, SpringSet())["forces and moments at sites"] == {"link1"}
    assert not lost(format_mjcf, PENDULUM, SpringSet())
    assert not lost(format_osim, PENDULUM, SpringSet())


def test_psurfs_that_cannot_be_read_are_lost_in_mujoco() -> None:
    of = one_body(chain("Rx"))
    link = replace(of.segments["link"], psurf="nowhere.pss")
    of = replace(of, segments={**of.segments, "link": link})
    ((what, where),) = lost(format_mjcf, of, SpringSet()).items()
    assert what.startswith("psurfs that cannot be read")
    assert where == {"link"}


@pytest.mark.parametrize("write", [format_mjcf, format_osim, format_urdf, format_biomod])
def test_attributes_that_are_more_than_a_colour_are_lost(write: Text) -> None:
    shiny = Attribute("shiny", {"gloss": (1.0,), "rgb": (1.0, 0.0, 0.0)})
    known = [shiny, Attribute("red", {"rgb": (1.0, 0.0, 0.0)}), Attribute("bare")]
    of = replace(one_body(chain("Rx")), attributes={one.name: one for one in known})
    assert lost(write, of, SpringSet())["attributes other than a colour"] == {"shiny"}


def test_names_that_other_programs_would_not_take_are_changed() -> None:
    of = one_body(chain("Rx"))
    link = replace(of.segments["link"], name="a <b>")
    pin = replace(of.joints["pin"], child=replace(of.joints["pin"].child, segment="a <b>"))
    of = replace(of, segments={"ground": of.segments["ground"], "a <b>": link}, joints={"pin": pin})
    for write in (format_mjcf, format_osim, format_urdf):
        text, losses = write(of, SpringSet())
        assert 'name="a__b_"' in text
        assert any(one.where == ("'a <b>' is a__b_",) for one in losses.entries)


NO_MASS = """figure {
  segment g { mass = -1g; site a->location = trans(0cm,0cm,0cm); }
  segment bare { site a->location = trans(0cm,0cm,0cm); }
  segment light {
    mass = 0g;
    inertia = (1,1,1);
    site a->location = trans(0cm,0cm,0cm);
    site CM->location = trans(0cm,0cm,0cm);
  }
  joint one { connect g.a to bare.a; type = R(0,0,1); }
  joint two { connect g.a to light.a; type = R(0,0,1); }
  root = g.a;
}
"""


@pytest.mark.parametrize("module", [mjcf, osim, urdf])
def test_segments_without_mass_are_refused_all_at_once(module: object, tmp_path: Path) -> None:
    of = FIGURE_FILE.parse(make_source(NO_MASS, "light.fig")).value
    assert of is not None
    path = tmp_path / "out"
    with pytest.raises(InputError) as failure:
        module.format_files(of, SpringSet(), path).write()
    bare, light = failure.value.diagnostics
    lacks = "a positive mass, an inertia and a site CM"
    assert bare.message == f"segment `bare` moves and lacks {lacks}, which a model needs"
    assert str(bare).startswith("light.fig:3:11: error")
    assert light.message == "segment `light` moves and lacks a positive mass, which a model needs"
    assert not path.exists()


@pytest.mark.parametrize("module", [mjcf, osim, urdf])
def test_other_figures_that_are_refused(module: object, tmp_path: Path) -> None:
    path = tmp_path / "out"
    of = one_body(chain("Rx"))
    bare = replace(of, segments={"ground": of.segments["ground"]}, joints={})
    with pytest.raises(InputError, match="none of the figure's segments moves"):
        module.format_files(bare, SpringSet(), path).write()
    along = slide("rail", (0.0, 1.0, 0.0), Linear(1.0))
    with pytest.raises(
        InputError, match="`rail` has a spring along an axis on which it does not translate"
    ):
        module.format_files(on_a_rail(), spring_set(along), path).write()
    frame = FOURBAR.segments["frame"]
    far = replace(frame.sites["rocker_pivot"], location=at(shift=(9.0, 0.0, 0.0)))
    frame = replace(frame, sites={**frame.sites, far.name: far})
    torn = replace(FOURBAR, segments={**FOURBAR.segments, "frame": frame})
    with pytest.raises(OpenLoopError):
        module.format_files(torn, SpringSet(), path).write()
    assert not path.exists()


@pytest.mark.parametrize("module", [mjcf, osim, urdf])
def test_a_path_that_cannot_be_written_is_left_alone(module: object, tmp_path: Path) -> None:
    with pytest.raises(OSError, match="No such file or directory"):
        module.format_files(PENDULUM, SpringSet(), tmp_path / "nowhere" / "out").write()


@pytest.mark.parametrize("write", [format_mjcf, format_osim, format_urdf])
def test_a_long_row_of_bodies_can_be_written(write: Text, shallow_stack: int) -> None:
    of = row(shallow_stack, [chain("Rz")])
    root = ElementTree.fromstring(write(of, SpringSet())[0])
    names = {one.get("name") for one in root.iter() if one.tag.lower() in ("body", "link")}
    assert set(of.bodies) <= names


def test_a_spring_set_for_other_joints_is_passed_over() -> None:
    law = AxisSpring((1.0, 0.0, 0.0), (Cubic((0.0, 1.0, 0.0, 1.0)),))
    springs = SpringSet({"elsewhere": JointSprings("elsewhere", (law,))})
    with_others, without = (
        re.sub(r"\s*<custom>.*</custom>", "", format_mjcf(PENDULUM, each)[0], flags=re.DOTALL)
        for each in (springs, SpringSet())
    )
    assert with_others == without
