"""Fixed tendons of MJCF on one joint: springs that may be slack in a range."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from generator.figure import is_rotation
from generator.losses import Losses
from generator.model_files.body_tree.tree import Body, DegreeOfFreedom, FunctionCurve
from generator.model_files.coupled_laws import CarriedLaws
from generator.model_files.mjcf.document import MAIN, Document
from generator.model_files.mjcf.joints import parse_coefficients
from generator.model_files.xml import XmlElement
from generator.rotations import Array
from springs import Cubic

_LOST_ATTRIBUTES = ("armature", "frictionloss", "range", "actuatorfrcrange")


def with_tendons(
    document: Document,
    bodies: Sequence[Body],
    laws: CarriedLaws,
    losses: Losses,
) -> list[Body]:
    """Return the bodies with the springs of fixed tendons on one joint; report the others.

    Those of laws over several joints that come back are left out.
    """
    dofs = {dof.name: dof for body in bodies for dof in body.dofs}
    for section in document.root.find_all("tendon"):
        for element in laws.without(section.children):
            whole = document.with_defaults(replace(element, tag="tendon"), MAIN)
            name = whole.get("name") or element.tag
            joints = list(whole.find_all("joint"))
            if element.tag != "fixed" or len(joints) != 1:
                losses.add("tendons over several joints or along paths", name)
                continue
            dof = dofs.get(joints[0].get("joint") or "")
            if dof is None or dof.joint:
                losses.add("tendons on joints that are missing or balls", name)
                continue
            coefficient = joints[0].number("coef", 1.0)
            dofs[dof.name] = _with_tendon(dof, whole, name, coefficient, losses)
    return [replace(body, dofs=tuple(dofs[dof.name] for dof in body.dofs)) for body in bodies]


def _with_tendon(
    dof: DegreeOfFreedom,
    element: XmlElement,
    name: str,
    coefficient: float,
    losses: Losses,
) -> DegreeOfFreedom:
    """Return a degree of freedom with the spring and the damper of a tendon."""
    for word in _LOST_ATTRIBUTES:
        if word in element.attributes:
            losses.add("friction, limits and armature of tendons", name)
    stiffness = parse_coefficients(element, "stiffness")
    damping = parse_coefficients(element, "damping")
    if any(damping[1:]):
        losses.add("quadratic and cubic damping", name)
    if damping[0] > 0.0:
        dof = replace(dof, damping=dof.damping + damping[0] * coefficient * coefficient)
    if not any(stiffness) or not coefficient:
        return dof
    slack = _slack_range(dof, element, coefficient)
    if slack[0] > slack[1]:
        element.error("this slack range has no length", "", "springlength")
        return dof
    if not is_rotation(dof.kind):
        losses.add("springs of tendons on sliding joints", name)
        return dof
    if coefficient == 1.0 and stiffness[0] > 0.0 and not any(stiffness[1:]):
        law = Cubic(
            (0.0, stiffness[0], 0.0, 0.0), -1, (slack[0] - dof.offset, slack[1] - dof.offset)
        )
        return replace(dof, laws=(*dof.laws, law))

    def torque(angles: Array) -> Array:
        length = coefficient * (angles + dof.offset)
        x = length - np.clip(length, slack[0], slack[1])
        linear, square, cube = stiffness
        return -coefficient * x * (linear + x * (square + x * cube))

    ends = tuple(sorted(end / coefficient - dof.offset for end in slack))
    return replace(dof, laws=(*dof.laws, FunctionCurve(torque, ends)))


def _slack_range(
    dof: DegreeOfFreedom, element: XmlElement, coefficient: float
) -> tuple[float, float]:
    """Return the lengths between which a tendon has no force.

    Without any it is the length where the joint's own spring has none.
    """
    read = element.numbers("springlength", 1, 2) or (-1.0,)
    low, high = read[0], read[-1]
    if (low, high) == (-1.0, -1.0):
        low = high = coefficient * (dof.rest + dof.offset)
    return low, high
