"""Parts of a body: their spheres, and what is refused."""

import pytest

from generator.contact_file.parts import BodyContact, BodyPart
from generator.diagnostics import ModelError
from generator.figure import ContactSphere
from springs.contact_part import PartLaw

LAW = PartLaw(((0.0, 3e4),))
SPHERES = {
    "thigh": (ContactSphere((0.0, 0.0, 0.1), 0.1), ContactSphere((0.0, 0.0, 0.4), 0.1)),
    "shank": (ContactSphere((0.0, 0.0, 0.1), 0.1),),
}


def test_spheres_get_the_names_of_their_parts():
    knee = BodyPart("knee", LAW, (("thigh", 1), ("shank", 0)))
    made = BodyContact((knee,)).assign(SPHERES)
    assert [one.part for some in made.values() for one in some] == ["", "knee", "knee"]
    assert [len(some) for some in made.values()] == [2, 1]
    assert SPHERES["thigh"][1].part == ""


def test_a_sphere_that_is_not_there_is_named():
    contact = BodyContact((BodyPart("knee", LAW, (("thigh", 2),)),))
    with pytest.raises(ModelError, match="`knee` has sphere 2 of segment `thigh`, which has 2 of"):
        contact.assign(SPHERES)
    contact = BodyContact((BodyPart("hand", LAW, (("hand", 0),)),))
    with pytest.raises(ModelError, match="segment `hand`, which has 0 of them"):
        contact.assign(SPHERES)


def test_a_region_is_within_a_part():
    leg = BodyPart("leg", LAW, (("thigh", 0), ("thigh", 1)))
    knee = BodyPart("knee", PartLaw(((0.0, 3e4), (0.01, 6e4))), (("thigh", 1),), within="leg")
    contact = BodyContact((leg, knee))
    made = contact.assign(SPHERES)["thigh"]
    assert [(one.part, one.region) for one in made] == [("leg", ""), ("leg", "knee")]
    assert contact.laws["knee"].within == LAW
    assert contact.laws["leg"].within is None


@pytest.mark.parametrize(
    ("stiffness", "sphere", "within", "message"),
    [
        (6e4, ("thigh", 1), "arm", "`knee` is within `arm`, but no other part has this name"),
        (6e4, ("thigh", 1), "knee", "`knee` is within `knee`, but no other part has this name"),
        (6e4, ("thigh", 0), "leg", "sphere 0 of segment `thigh`, which `leg`, that it is within"),
        (2e4, ("thigh", 1), "leg", "`knee` is softer than `leg`"),
    ],
)
def test_a_region_fits_its_part(stiffness, sphere, within, message):
    leg = BodyPart("leg", LAW, (("thigh", 1),))
    knee = BodyPart("knee", PartLaw(((0.0, stiffness),)), (sphere,), within=within)
    with pytest.raises(ModelError, match=message):
        BodyContact((leg, knee))


def test_parts_share_neither_names_nor_spheres():
    knee = BodyPart("knee", LAW, (("thigh", 1),))
    with pytest.raises(ModelError, match="two parts of the body are called `knee`"):
        BodyContact((knee, BodyPart("knee", LAW, (("thigh", 0),))))
    with pytest.raises(ModelError, match="sphere 1 of segment `thigh` belongs to the parts `knee`"):
        BodyContact((knee, BodyPart("thigh", LAW, (("thigh", 1),))))
