"""Visual geoms of segments, as elements; `test_write.py` reads them with MuJoCo."""

from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

from generator.figure import Figure
from generator.geometry.appearance import mass_capsule
from generator.geometry.read import segment_colour
from generator.model_files.mjcf.write import format_mjcf
from springs import SpringSet
from tests.chains import chain, two_bodies
from tests.generator.model_files.model_cases import PROTOTYPE, START

BARS = two_bodies(chain("Rx Ry"), START[:2])


def bodies(of: Figure) -> dict[str | None, ElementTree.Element]:
    root = ElementTree.fromstring(format_mjcf(of, SpringSet())[0])
    return {body.get("name"): body for body in root.iter("body")}


def numbers(element: ElementTree.Element, name: str) -> list[float]:
    return [float(word) for word in element.attrib[name].split()]


def test_capsules_are_from_the_centre_of_mass_to_each_joint() -> None:
    capsule = mass_capsule(BARS, BARS.segments["first"])
    assert capsule is not None
    geoms = bodies(BARS)["first"].findall("geom")
    assert [geom.get("type") for geom in geoms] == ["capsule"] * len(capsule.ends)
    lines = [numbers(geom, "fromto") for geom in geoms]
    assert np.array(lines)[:, :3] == pytest.approx(np.tile(capsule.centre, (len(geoms), 1)))
    assert np.array(lines)[:, 3:] == pytest.approx(capsule.ends)
    assert {tuple(numbers(geom, "size")) for geom in geoms} == {(capsule.radius,)}


def test_a_centre_of_mass_at_the_only_joint_gives_a_sphere() -> None:
    second = BARS.segments["second"]
    tip = second.sites["tip"]
    at_joint = replace(second.sites["CM"], location=tip.location)
    of = BARS.with_parts(replace(second, sites={**second.sites, "CM": at_joint}))
    kinds = {geom.get("type") for geom in bodies(of)["second"].findall("geom")}
    assert kinds == {"sphere"}


@pytest.mark.parametrize("content", ["", "no psurf"])
def test_a_segment_whose_psurf_cannot_be_read_has_its_capsules(
    content: str, tmp_path: Path
) -> None:
    of = replace(BARS, path=tmp_path / "bars.fig")
    of = of.with_parts(replace(of.segments["second"], psurf="shape.pss"))
    if content:
        (tmp_path / "shape.pss").write_text(content, encoding="utf-8")
    kinds = [geom.get("type") for geom in bodies(of)["second"].findall("geom")]
    assert kinds == [geom.get("type") for geom in bodies(BARS)["second"].findall("geom")] != []
    (loss,) = format_mjcf(of, SpringSet())[1].entries
    assert loss.what.startswith("psurfs that cannot be read (")
    assert loss.what.endswith("): capsules instead")
    assert loss.where == ("second",)


def test_psurfs_are_meshes_of_their_own_colour_without_mass_and_contact() -> None:
    for name, body in bodies(PROTOTYPE).items():
        (geom,) = body.findall("geom")
        assert geom.get("type") == "mesh"
        segment = PROTOTYPE.segments[str(name)]
        assert numbers(geom, "rgba") == pytest.approx([*segment_colour(PROTOTYPE, segment), 1.0])
        assert [geom.get(key) for key in ("mass", "contype", "conaffinity")] == ["0"] * 3
