"""Losses of DYSPAM's files, and figures that they refuse."""

from dataclasses import replace
from importlib.resources import files
from pathlib import Path

import pytest

from generator import read_figure
from generator.cli.answer import format_paragraphs
from generator.cli.convert import convert
from generator.diagnostics import InputError, Parsed
from generator.figure import (
    CENTRE_OF_MASS_SITE,
    Attribute,
    ContactSphere,
    Figure,
    Segment,
    Site,
)
from generator.losses import Losses
from generator.model_files.dyspam import read as dyspam_reader
from generator.model_files.dyspam import write as dyspam
from springs import (
    AxisSpring,
    CoupledAxis,
    CoupledSpring,
    Cubic,
    Damping,
    Elastic,
    JointSprings,
    Linear,
    SphericalLaw,
    SpringSet,
)
from springs.interpolated import Interpolated
from springs.published import tables as published
from tests.chains import BALL, SKEW, X, Y, Z, at, body, chain, figure, ground, joint, one_body
from tests.generator.model_files.model_cases import own_springs

SHIPPED = Path(str(files("figures")))
RESTORING = (0.0, 2.0, 0.0, 3.0)


def there_and_back(
    figure: Figure, springs: SpringSet, folder: Path
) -> tuple[Parsed[dyspam_reader.DyspamModel], Losses]:
    losses = dyspam.format_files(figure, springs, folder).write()
    return dyspam_reader.parse_dyspam(folder), losses


def sentences(losses: Losses) -> dict[str, tuple[str, ...]]:
    return {loss.what: loss.where for loss in losses.entries}


def written(given: Figure, springs: SpringSet, folder: Path) -> dict[str, tuple[str, ...]]:
    return sentences(dyspam.format_files(given, springs, folder / "out").write())


def hung(direction: tuple[float, float, float], *laws: Elastic, **more: float) -> SpringSet:
    spring = AxisSpring(direction, laws, Damping(**more))
    return SpringSet({"pin": JointSprings("pin", (spring,))})


def test_the_least_that_is_lost_is_the_names(tmp_path):
    lost = written(one_body(BALL), SpringSet(), tmp_path)
    assert lost == {"names, in place of which are numbers": ("body 1 was link", "joint 1 was pin")}


def test_everything_of_a_figure_that_goes_is_told(tmp_path):
    made = body("link", sites={"tip": at((0.1, 0.2, 0.3))})
    spheres = (ContactSphere((0.0, 0.0, 0.0), 0.1),)
    link = replace(made, psurf="a.pss", attributes=("red",), contact_spheres=spheres)
    floor = ground(shelf=at(shift=(1.0, 0.0, 0.0)))
    base = replace(floor.sites["base"], local_force=(1.0, 0.0, 0.0))
    floor = replace(floor, sites={**floor.sites, "base": base})
    pin = joint("pin", "ground.base", "link.near", chain("R-y"), (0.1,), lower_limit=(-1.0,))
    given = figure([floor, link], [pin]).with_parts(Attribute("red"))
    lost = written(given, own_springs(given), tmp_path)
    del lost["names, in place of which are numbers"]
    assert lost == {
        "axes, signs and order of rotations: revolutes turn about z, sphericals by z-y-x angles": (
            "pin",
        ),
        "limits and their stops": ("pin",),
        "psurfs": ("link",),
        "attributes": ("link",),
        "contact spheres": ("link",),
        "directions of sites at which no joint is": ("link.tip",),
        "sites of the ground at which no joint is": ("ground.shelf",),
        "loads on the ground, which move nothing": ("ground.base",),
    }


@pytest.mark.parametrize(
    ("springs", "what", "where"),
    [
        (
            hung(X, Interpolated(((-1.0, 2.0), (1.0, -2.0)))),
            "neither a line nor a cubic",
            ("pin x",),
        ),
        (hung(X, Linear(2.0), Linear(3.0)), "several laws about one axis", ("pin x",)),
        (hung(SKEW, Linear(2.0)), "none of their joint's x, y and z", ("pin",)),
        (hung(Y, Cubic(RESTORING, +1)), "another sense or dead zone", ("pin y",)),
        (hung(Y, Cubic(RESTORING, -1, (-0.2, 0.3))), "another sense or dead zone", ("pin y",)),
        (hung(Z, Cubic((0.0, -2.0, 0.0, 3.0), -1)), "another sense or dead zone", ("pin z",)),
        (hung(Z, Cubic((0.0, 2.0, 3.0, 0.0), -1)), "another sense or dead zone", ("pin z",)),
        (hung(Z, Linear(-2.0), coulomb=0.1), "another sense or dead zone", ("pin z",)),
    ],
)
def test_a_spring_that_would_come_back_as_another_is_left_out_and_told(
    springs, what, where, tmp_path
):
    reading, losses = there_and_back(one_body(BALL), springs, tmp_path / "out")
    found = [loss for loss in losses.entries if what in loss.what]
    assert [loss.where for loss in found] == [where]
    assert found[0].what.endswith("left out")
    assert reading.value is not None
    assert reading.value.springs.joints == {}


def test_what_is_lost_of_springs_that_are_written(tmp_path):
    spring = AxisSpring(X, (Cubic(RESTORING),), Damping(0.1, 0.2, 0.5), "bend", "a book", "why")
    law = published.coupled_law("riener_edrich_1999/leg").law
    axes = tuple(CoupledAxis("pin", X) for _ in law.coordinates)
    springs = SpringSet(
        {"pin": JointSprings("pin", (spring,))},
        SphericalLaw.WEIGHTED,
        coupled=(CoupledSpring(law, axes),),
    )
    lost = written(one_body(BALL), springs, tmp_path)
    del lost["names, in place of which are numbers"]
    assert lost == {
        "the slip rate of friction, which is then 0.01 rad/s": ("pin x",),
        "springs over several joints, left out": ("pin",),
        "what springs say of their motions, references and reasons": ("pin",),
        "the way in which the axes of a spherical joint join (weighted), which is conservative "
        "when read": (),
    }


REFUSED = [
    ("Tx", "has a translation"),
    ("Rx Tx", "has a translation"),
    ("Rx Ry", "turns about two axes"),
    ("", "is rigid"),
    ("Rx Rs Ry", "each rotation axis must be perpendicular"),
    ("Rx Ry Rz Rx", "at most three"),
]


@pytest.mark.parametrize(("text", "said"), REFUSED)
def test_a_joint_that_the_files_cannot_hold_is_refused_before_anything_is_written(
    text, said, tmp_path
):
    factors = chain(text)
    given = one_body(factors, (0.0,) * len(factors))
    with pytest.raises(InputError) as caught:
        dyspam.format_files(given, SpringSet(), tmp_path / "out").write()
    (fault,) = caught.value.diagnostics
    assert fault.message.startswith("joint `pin` cannot be written for DYSPAM: ")
    assert said in fault.message
    assert not (tmp_path / "out").exists()


def test_all_refusals_are_told_at_once(tmp_path):
    bare = Segment(
        "light", sites={"near": Site("near"), CENTRE_OF_MASS_SITE: Site(CENTRE_OF_MASS_SITE)}
    )
    joints = [
        joint("pin", "ground.base", "link.near", chain("Tx")),
        joint("pan", "ground.base", "light.near", chain("Rx Ry")),
    ]
    with pytest.raises(InputError) as caught:
        dyspam.format_files(
            figure([ground(), body("link"), bare], joints), SpringSet(), tmp_path / "out"
        ).write()
    assert [fault.message.split(" ")[1] for fault in caught.value.diagnostics] == [
        "`light`",
        "`pin`",
        "`pan`",
    ]


def test_an_open_loop_and_a_figure_at_rest_are_refused(tmp_path):
    loop = read_figure(SHIPPED / "fourbar.fig")
    near = loop.joints["rocker_pin"]
    far = replace(loop.segments["frame"].sites["rocker_pivot"], location=at(shift=(9.0, 0, 0)))
    frame = replace(loop.segments["frame"], sites={**loop.segments["frame"].sites, far.name: far})
    apart = replace(loop, segments={**loop.segments, "frame": frame})
    with pytest.raises(InputError, match=f"opens the loop at joint {near.name}"):
        dyspam.format_files(apart, SpringSet(), tmp_path / "out").write()
    with pytest.raises(InputError, match="none of its segments moves"):
        dyspam.format_files(figure([ground()], []), SpringSet(), tmp_path / "out").write()


def test_a_folder_that_cannot_be_made_is_an_error_of_the_system(tmp_path):
    (tmp_path / "out").write_text("a file")
    with pytest.raises(OSError, match="exists"):
        dyspam.format_files(one_body(BALL), SpringSet(), tmp_path / "out").write()


def test_springs_of_an_older_figure_do_not_stay_behind(tmp_path):
    folder = tmp_path / "out"
    dyspam.format_files(one_body(BALL), hung(X, Cubic(RESTORING)), folder).write()
    assert (folder / dyspam.OPTIONAL).read_text()
    reading, _ = there_and_back(one_body(BALL), SpringSet(), folder)
    assert (folder / dyspam.OPTIONAL).read_text() == ""
    assert reading.value is not None
    assert reading.value.springs.joints == {}


def test_the_command_takes_the_folder_s_name_for_its_format(tmp_path):
    folder = tmp_path / "dyspam"
    for _ in range(2):
        answer = convert("pendulum", [folder])
        assert sorted(path.name for path in folder.iterdir()) == sorted(dyspam.FILES)
    assert "psurfs: floor, link1" in format_paragraphs(answer.paragraphs())
    convert("pendulum", [tmp_path / "other"], to="dyspam")
    for name in dyspam.FILES:
        assert (tmp_path / "other" / name).read_text() == (folder / name).read_text()
    with pytest.raises(InputError, match="turns about two axes"):
        convert("clavicles", [folder])
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="cannot be written: it is not a directory"):
        convert("pendulum", [tmp_path / "file"], to="dyspam")


def test_a_reading_with_errors_gives_no_figure(tmp_path):
    with pytest.raises(InputError, match="there is no folder"):
        dyspam_reader.parse_dyspam(tmp_path / "nothing").require_value()
