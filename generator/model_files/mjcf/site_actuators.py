"""Springs of several rotations in MJCF, as this program writes them: pairs of site actuators.

An actuator without control between the sites of a joint has a torque that depends on a component of
the joint's rotation vector; a second one has it about the opposite axis, with the sites exchanged.
A pair is recognised by these numbers, whatever its name, and is a law about the axis.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from math import inf, pi

import numpy as np

from generator.diagnostics import Diagnostics
from generator.figure import is_rotation
from generator.losses import Losses
from generator.model_files.body_tree.joints import BEYOND_LIMITS, rotation_group
from generator.model_files.body_tree.to_figure import HINGES_AS_ONE, common_stem
from generator.model_files.body_tree.tree import Body, Curve, DegreeOfFreedom, FunctionCurve
from generator.model_files.mjcf.document import MAIN, Document
from generator.model_files.xml import XmlElement
from generator.rotations import Array
from springs import Linear

_TOLERANCE = 1e-5
"""Difference of directions that counts as rounding: MuJoCo saves six digits."""

_READ = frozenset(
    {"name", "class", "group", "site", "refsite", "gear", "gaintype", "gainprm", "dyntype"}
    | {"biastype", "biasprm", "forcerange", "forcelimited"}
)

_Site = tuple[str | None, Array]
"""Name of a body, None for the world, and the rotation of a site in its frame."""


@dataclass(frozen=True)
class _Torque:
    """The torque of an actuator about an axis of a joint.

    Attributes:
        element: the actuator.
        body: that the joint moves.
        sites: sites of the body and of its parent.
        on_body: True if it is the actuator of the body's site.
        turn: rotation of the body's site in the body's frame, shape (3, 3).
        axis: axis of a positive component, in the site's frame.
        terms: torque at zero [N m], and its slopes by angle and rate.
        ends: ends between which the torque is cut off [N m].
    """

    element: XmlElement
    body: str
    sites: tuple[str, str]
    on_body: bool
    turn: Array
    axis: Array
    terms: tuple[float, ...]
    ends: tuple[float, float]

    def is_pair(self, other: "_Torque") -> bool:
        """True if the two are the same torque about axes of parent and child."""
        return (
            self.sites == other.sites
            and self.on_body != other.on_body
            and self.terms == other.terms
            and self.ends == other.ends
            and bool(np.abs(self.axis - other.axis).max() < _TOLERANCE)
        )

    def torque_of_pair(self, angle: Array) -> Array:
        """Elastic torque of this actuator and its equal [N m] at angles [rad]."""
        return 2.0 * np.clip(self.terms[0] + self.terms[1] * angle, *self.ends)

    @property
    def corners(self) -> list[float]:
        """Angles within a turn at which the torque is cut off [rad]."""
        slope = self.terms[1]
        angles = [(end - self.terms[0]) / slope for end in self.ends] if slope else []
        return [angle for angle in angles if abs(angle) < pi]


def with_site_actuators(
    document: Document,
    bodies: Sequence[Body],
    world_sites: Mapping[str, Array],
    losses: Losses,
) -> tuple[list[Body], set[int]]:
    """Return the bodies with the laws of pairs of site actuators, and the identities of these."""
    torques: dict[str, list[_Torque]] = {}
    sites = _sites_by_name(bodies, world_sites)
    by_name = {body.name: body for body in bodies}
    for section in document.root.find_all("actuator"):
        for element in section.find_all("general"):
            found = _parse(document, element, sites, by_name)
            if found is not None:
                torques.setdefault(found.body, []).append(found)
    used: set[int] = set()
    changed: list[Body] = []
    for body in bodies:
        pairs = list(_pairs(torques.get(body.name, [])))
        whole = _with_laws(body, [pair[0] for pair in pairs], losses) if pairs else None
        if whole is not None:
            used |= {id(each.element) for pair in pairs for each in pair}
        changed.append(whole or body)
    return changed, used


def _sites_by_name(bodies: Sequence[Body], world: Mapping[str, Array]) -> dict[str, _Site]:
    """Return the sites by the names that the model may have for them, without ambiguous ones."""
    found: dict[str, list[_Site]] = {name: [(None, pose[:3, :3])] for name, pose in world.items()}
    for body in bodies:
        for name, pose in body.sites.items():
            for each in (name, f"{body.name}.{name}"):
                found.setdefault(each, []).append((body.name, pose[:3, :3]))
    return {name: each[0] for name, each in found.items() if len(each) == 1}


def _parse(
    document: Document,
    element: XmlElement,
    sites: Mapping[str, _Site],
    bodies: Mapping[str, Body],
) -> _Torque | None:
    """Return the torque of an actuator; None for one of another kind."""
    ignored = Diagnostics()
    whole = document.with_defaults(element, MAIN, ignored)
    words = (whole.get("site") or "", whole.get("refsite") or "")
    if whole.attributes.keys() - _READ or not all(word in sites for word in words):
        return None
    kinds = {"gaintype": "fixed", "biastype": "affine", "dyntype": "none"}
    if "biastype" not in whole.attributes or "gainprm" not in whole.attributes:
        return None
    if any((whole.get(word) or kind) != kind for word, kind in kinds.items()):
        return None
    gain = _numbers(whole, "gainprm", 10, ignored)
    gear = np.array(_numbers(whole, "gear", 6, ignored))
    terms = _numbers(whole, "biasprm", 10, ignored)
    if ignored.has_errors or any(gain) or any(gear[:3]) or any(terms[3:]):
        return None
    limited = (whole.get("forcelimited") or "auto") != "false"
    low, high = _numbers(whole, "forcerange", 2, ignored)
    ends = (low, high) if limited and low < high else (-inf, inf)
    if terms[2] > 0.0 or (terms[2] and ends != (-inf, inf)):
        return None
    on_body = True
    (moved, turn), (other, other_turn) = (sites[word] for word in words)
    axis = gear[3:]
    if moved is None or bodies[moved].parent != other:
        on_body, words, axis = False, (words[1], words[0]), -axis
        (moved, turn), (other, other_turn) = (other, other_turn), (moved, turn)
    if moved is None or bodies[moved].parent != other:
        return None
    parallel = np.abs(bodies[moved].pose[:3, :3] @ turn - other_turn).max() < _TOLERANCE
    if not parallel or abs(float(np.linalg.norm(axis)) - 1.0) > _TOLERANCE:
        return None
    return _Torque(element, moved, words, on_body, turn, axis, terms[:3], ends)


def _numbers(
    element: XmlElement, name: str, count: int, diagnostics: Diagnostics
) -> tuple[float, ...]:
    """Return the numbers of an attribute, zeros where they are left out."""
    read = element.numbers(name, diagnostics, 1, count) or ()
    return (*read, *(0.0,) * count)[:count]


def _pairs(torques: Sequence[_Torque]) -> Iterator[tuple[_Torque, _Torque]]:
    """Yield actuators that are a pair, each actuator once at most."""
    used: set[int] = set()
    for one, other in combinations(torques, 2):
        if not {id(one), id(other)} & used and one.is_pair(other):
            used |= {id(one), id(other)}
            yield one, other


def _with_laws(body: Body, torques: Sequence[_Torque], losses: Losses) -> Body | None:
    """Return a body with the laws about axes of its joint; None where it has no such axes."""
    turns = [dof for dof in body.dofs if is_rotation(dof.kind)]
    joint = next(
        (dof.joint for dof in turns if dof.joint),
        common_stem(tuple(dof.name for dof in turns)) or body.name,
    )
    dofs = list(body.dofs)
    turn = torques[0].turn
    is_turned = np.abs(turn - np.round(turn)).max() >= _TOLERANCE
    if is_turned and len(turns) == 3 and all(dof.joint for dof in turns):
        for k, dof in enumerate(dofs):  # any axes are axes of a ball
            if is_rotation(dof.kind):
                x, y, z = (turn @ dof.axis).tolist()
                dofs[k] = replace(dof, axis=(x, y, z))
    if rotation_group(dofs, joint) is None:
        return None
    left = list(torques)
    for k, dof in enumerate(dofs):
        if not is_rotation(dof.kind):
            continue
        signs = [(one, float(one.turn @ one.axis @ dof.axis)) for one in left]
        own = [(one, sign) for one, sign in signs if abs(abs(sign) - 1.0) < _TOLERANCE]
        left = [one for one, sign in signs if abs(abs(sign) - 1.0) >= _TOLERANCE]
        dofs[k] = _with_law(replace(dof, joint=joint), own)
    if left:
        return None
    if any(dof.is_passive and not dof.joint for dof in turns):
        losses.add(HINGES_AS_ONE, joint)
    return replace(body, dofs=tuple(dofs))


def _with_law(dof: DegreeOfFreedom, torques: Sequence[tuple[_Torque, float]]) -> DegreeOfFreedom:
    """Return a rotation with the sum of torques about its axis, each with its sign along it."""
    damping = dof.damping - 2.0 * sum(one.terms[2] for one, _ in torques)
    dof = replace(dof, damping=damping)
    elastic = [(one, float(np.sign(sign))) for one, sign in torques if any(one.terms[:2])]
    if not elastic:
        return dof
    corners = sorted({sign * corner for one, sign in elastic for corner in one.corners})
    ends = (min([0.0, *corners]) - BEYOND_LIMITS, max([0.0, *corners]) + BEYOND_LIMITS)

    def torque(angle: Array) -> Array:
        parts = [sign * one.torque_of_pair(sign * angle) for one, sign in elastic]
        return np.sum(parts, axis=0)

    law: Curve = FunctionCurve(torque, tuple(corners))
    at_rest, slope = float(torque(np.zeros(()))), 2.0 * sum(one.terms[1] for one, _ in elastic)
    if not corners and slope < 0.0:
        law = Linear(-slope, -at_rest / slope)
    return replace(dof, laws=(*dof.laws, law), expected_range=ends)
