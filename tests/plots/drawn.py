"""The shipped plates, each made once for all tests."""

from functools import cache
from importlib import import_module
from typing import Any

from plots import run
from plots.joint_curve import JointCurve
from plots.joint_plate import JointPlate
from plots.plate import Plate
from plots.plates import (
    contact,
    exported_fall,
    fall_energy,
    fall_on_floor,
    hip_directional,
    person_body,
    person_pendulums,
    person_posture,
)


@cache
def falls() -> fall_energy.Falls:
    return fall_energy.simulate_falls()


@cache
def collapse() -> fall_on_floor.Collapse:
    return fall_on_floor.simulate_collapse()


@cache
def cycle() -> hip_directional.Cycle:
    return hip_directional.simulate_cycle()


@cache
def exported() -> exported_fall.Fall:
    return exported_fall.simulate_fall()


@cache
def contact_cases() -> contact.Cases:
    return contact.simulate_cases()


@cache
def whole_bodies() -> person_body.Comparison:
    return person_body.compare_whole_bodies()


@cache
def swings() -> person_pendulums.Swings:
    return person_pendulums.simulate_swings()


@cache
def postures() -> person_posture.Postures:
    return person_posture.find_postures()


def maker(name: str) -> Any:
    """The function or the row that makes a plate."""
    path, _, attribute = run.PLATES[name].partition(":")
    return getattr(import_module(path), attribute)


@cache
def curve(name: str) -> JointCurve:
    """The curve of a joint's plate, read out of Exudyn."""
    return maker(name).read_curve()


@cache
def plate(name: str) -> Plate:
    match maker(name):
        case JointPlate() as row:
            return row.draw(curve(name))
        case fall_energy.fall_energy:
            return fall_energy.build_plate(falls())
        case contact.contact:
            return contact.build_plate(contact_cases())
        case fall_on_floor.fall_on_floor:
            return fall_on_floor.build_plate(collapse())
        case exported_fall.exported_fall:
            return exported_fall.build_plate(exported())
        case hip_directional.hip_directional:
            return hip_directional.build_plate(cycle())
        case person_body.person_body:
            return person_body.build_plate(whole_bodies())
        case person_pendulums.person_pendulums:
            return person_pendulums.build_plate(swings())
        case person_posture.person_posture:
            return person_posture.build_plate(postures())
        case make:
            return make()
