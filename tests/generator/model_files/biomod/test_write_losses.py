"""Losses of `.bioMod` files, names, and chains that are rows of segments; no engine is needed."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from generator import read_figure
from generator.figure import Figure
from generator.losses import Loss
from generator.model_files.biomod.passive_torque import COUPLING_LOSS
from generator.model_files.biomod.write import (
    FITTED_LOSS,
    LIMITS_LOSS,
    format_biomod,
    format_files,
)
from generator.springs_file.read import read_springs
from springs import Linear, SpringSet, Stop
from springs.hysteresis import Hysteresis
from tests.chains import chain, one_body, two_bodies
from tests.generator.model_files.biomod_text import BioMod, read_biomod
from tests.generator.model_files.model_cases import (
    FOURBAR,
    hinge,
    on_a_rail,
    spring_set,
    stated_errors,
)

PROTOTYPE = read_figure("prototype")


def model_of(of: Figure, springs: SpringSet | None = None) -> BioMod:
    return read_biomod(format_biomod(of, springs or SpringSet())[0])


def lost(of: Figure, springs: SpringSet) -> dict[str, tuple[str, ...]]:
    return {loss.what: loss.where for loss in format_biomod(of, springs)[1].entries}


def test_left_and_right_have_the_same_displacements() -> None:
    dofs = model_of(PROTOTYPE).dofs
    left = {(name.replace("left", "right"), dof) for name, dof in dofs if "left" in name}
    assert left == {(name, dof) for name, dof in dofs if "right" in name}
    assert ("left_knee", "RotY") in dofs


@pytest.mark.parametrize(
    ("text", "segments"),
    [
        ("Rx Ry Rz", ["tested"]),
        ("R-x Ry R-z", ["tested"]),
        ("Rx R-y Rz", ["tested"]),
        ("Rs Ra", ["tested"]),
        ("Rx Ry Rz Tx Ty Tz", ["tested"]),
        ("Rx Ry Rx", ["tested_3", "tested_2", "tested_1"]),
        ("Tx Ry", ["tested_2", "tested_1"]),
        ("", []),
    ],
)
def test_chains_are_one_segment_or_a_row(text: str, segments: list[str]) -> None:
    of = two_bodies(chain(text), (0.1,) * len(text.split()))
    found = [name for name, _ in model_of(of).dofs if name.startswith("tested")]
    assert list(dict.fromkeys(found)) == segments


def test_the_names_of_the_world_and_of_segments_are_not_taken_twice() -> None:
    of = one_body(chain("Rz"))
    pin = of.joints["pin"]
    named = replace(of, joints={"link": replace(pin, name="link")})
    assert list(model_of(named).segments) == ["ground", "link_joint", "link"]
    link = replace(of.segments["link"], name="Root")
    child = replace(pin, child=replace(pin.child, segment="Root"))
    rooted = replace(
        of, segments={"ground": of.segments["ground"], "Root": link}, joints={"pin": child}
    )
    assert list(model_of(rooted).segments) == ["ground", "pin", "Root_segment"]


def test_of_the_prototype_all_springs_are_approximated() -> None:
    springs = read_springs(None, PROTOTYPE)
    found = lost(PROTOTYPE, springs)
    several = {name for name, own in springs.joints.items() if len(own.axes) > 1}
    assert stated_errors(Loss(COUPLING_LOSS, found[COUPLING_LOSS])).keys() == several
    coordinates = stated_errors(Loss(FITTED_LOSS, found[FITTED_LOSS]))
    joints = {name.rpartition("_")[0] for name in coordinates}
    assert joints == set(springs.joints)
    assert set(found["damping and friction of several rotations"]) == several
    assert not any("reference" in what for what in found)


def test_stops_are_lost() -> None:
    of = on_a_rail()
    stopped = lost(of, spring_set(hinge("hinge", Linear(2.0), Stop(-0.5, 0.5))))
    assert stopped["stops at limits: the ranges of the file do not stop a joint"] == ("hinge",)
    assert not any("stops" in what for what in lost(of, spring_set(hinge("hinge", Linear(2.0)))))


def test_friction_and_limits_of_several_rotations_are_lost() -> None:
    of = on_a_rail()
    law = Hysteresis.from_mean_and_width(Linear(2.0), 1.0)
    found = lost(of, spring_set(hinge("hinge", law, coulomb=0.2)))
    assert found["friction that depends on the angle"] == ("hinge",)
    assert found["Coulomb friction"] == ("hinge",)
    several = one_body(chain("Rx Ry"), lower_limit=(-0.3, -0.2))
    assert lost(several, SpringSet())[LIMITS_LOSS] == ("pin",)
    (ranges,) = [one.numbers("rangesq") for one in model_of(several).segments.values() if one.names]
    assert ranges == pytest.approx([-0.2, np.pi, -0.3, np.pi])


def test_loops_are_open() -> None:
    assert lost(FOURBAR, SpringSet())["joints that close loops: the loops are open"] == (
        "rocker_pin",
    )


@pytest.mark.slow
def test_files_beside_the_model_have_no_blank_in_their_path(tmp_path: Path) -> None:
    path = tmp_path / "my arm.bioMod"
    files = format_files(PROTOTYPE, read_springs(None, PROTOTYPE), path)
    files.write()
    assert list(files.contents)[-1] == path
    model = read_biomod(path.read_text(encoding="utf-8"))
    meshes = [
        one.values["meshfile"][0] for one in model.segments.values() if "meshfile" in one.values
    ]
    assert meshes
    assert all((tmp_path / mesh).is_file() and " " not in mesh for mesh in meshes)
    assert (tmp_path / "my arm_springs.csv").is_file()


def test_numbers_have_all_digits_and_no_exponents() -> None:
    of = one_body(chain("Rz"))
    link = replace(of.segments["link"], mass=1.2345678901234567e-7)
    text, _ = format_biomod(of.with_parts(link), SpringSet())
    assert "e-" not in text
    assert read_biomod(text).segments["link"].numbers("mass").tolist() == [link.mass]
